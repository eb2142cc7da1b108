"""The files of an identification: the arm with its masses and friction, its parameters, a page and its figures."""

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from armwright.arm.urdf.writer import urdf_text
from armwright.arm.write import toml_text, without_meshes
from armwright.identification.payload import Payload
from armwright.identification.result import Identification, Prediction
from armwright.report.elements import Card, Tile, downloads, figures, tables
from armwright.report.figures import Drawing, empty_figure, evenly_spaced, plain_label, svg_text
from armwright.report.static_page import static_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# What each file holds.
_CONTENTS = {
    "arm.toml": "the identified arm as an arm file",
    "arm.urdf": "the identified arm with masses and inertias; of friction what URDF can hold",
    "loaded_arm.toml": "the arm with the load as an arm file",
    "parameters.json": "every parameter with its interval, the covariance, held-out errors",
    "payload.json": "the load with its errors",
    "efforts.svg": "measured efforts and those predicted",
    "residuals.svg": "what is not predicted",
}
# Points of a curve, more than which nobody sees.
_POINTS = 1500


def identification_files(found: Identification, *, title: str, command: str) -> dict[str, str]:
    """Return the files of an identification by name.

    Args:
        found: the identification.
        title: of the page.
        command: the command line that made it.
    """
    shown = found.validation or found.training
    kind = "held-out" if found.validation else "fitted"
    caption = f"Efforts of the {kind} log {shown[0].name}: measured, and predicted"
    held_out = "; red: held out" if found.validation else ""
    drawn = [
        Drawing("efforts", caption, _efforts(found, shown[0])),
        Drawing("residuals", f"What is not predicted of all logs, one after the other{held_out}", _residuals(found)),
    ]
    files: dict[str, str] = {}
    if found.arm is not None:
        # The triangles of meshes stay in the files that they came from.
        arm, _ = without_meshes(found.arm)
        files["arm.toml"] = f"# {arm.name}: identified from {_logs(found)}\n{toml_text(arm)}\n"
        files["arm.urdf"] = urdf_text(arm)
    files["parameters.json"] = json.dumps(found.as_data(), indent=2) + "\n"
    files |= {f"{drawing.name}.svg": drawing.svg for drawing in drawn}
    beside = {name: _CONTENTS[name] for name in files}
    return {**files, "report.html": _page(found, drawn, beside, title=title, command=command)}


def payload_files(found: Payload) -> dict[str, str]:
    """Return the files of a load by name: the arm with it, and its numbers."""
    arm, _ = without_meshes(found.loaded)
    return {
        "loaded_arm.toml": f"# {arm.name} with a load of {found.load.mass:.4g} kg\n{toml_text(arm)}\n",
        "payload.json": json.dumps(found.as_data(), indent=2) + "\n",
    }


def _page(found: Identification, drawn: Sequence[Drawing], files: dict[str, str], *, title: str, command: str) -> str:
    errors, relative, tried, weak, of_links, of_drives, *links = found.tables()
    facts = [note for note in found.notes if note not in found.warnings]
    model, fit = found.model, found.fit
    return static_page(
        title=title,
        command=command,
        sections=[
            Card("Held out and fitted", tables([errors, relative])),
            Card("Efforts", figures(drawn)),
            Card("Parameters", tables([of_links, of_drives]), "faded: hardly known"),
            Card("Hardly known", tables([weak]) if weak.rows else "<p>Every base parameter is known well.</p>"),
            Card("Links and choices", tables([*links, tried])),
            Card("Files", downloads(files)),
        ],
        numbers=_tiles(found),
        notes=facts,
        warnings=found.warnings,
        named=(
            ("Arm", model.arm.title or model.arm.name),
            ("Logs", _logs(found)),
            ("Base parameters", str(len(fit.values))),
            ("Friction", found.law),
        ),
    )


def _logs(found: Identification) -> str:
    return ", ".join(dict.fromkeys(each.name for each in found.training))


def _tiles(found: Identification) -> list[Tile]:
    shown = found.validation or found.training
    measured, missed = (
        np.sqrt(np.mean([(values**2).mean() for values in each]))
        for each in ([x.measured for x in shown], [x.measured - x.predicted for x in shown])
    )
    kind = "held-out" if found.validation else "fitted"
    return [
        Tile(f"{missed / measured:.1%}", f"of the efforts of {kind} logs are not predicted (root mean square)"),
        Tile(f"{len(found.fit.values) - len(found.weak)}", f"base parameters known well, of {len(found.fit.values)}"),
        Tile(f"{found.preparation.delay * 1e3:.1f} ms", "positions are read later than efforts"),
        Tile(f"{len(found.fit.outliers)}", f"outliers among {int(found.fit.counts.sum())} equations"),
    ]


def _efforts(found: Identification, shown: Prediction) -> str:
    rows = evenly_spaced(len(shown.t), _POINTS)
    figure = _grid(found)
    for i, axes in enumerate(figure.axes):
        axes.plot(shown.t[rows], shown.measured[rows, i], color="0.6", linewidth=1.4, label="measured")
        axes.plot(shown.t[rows], shown.predicted[rows, i], color="C0", linewidth=0.9, label="predicted")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), fontsize="small", loc="outside upper right", ncols=2)
    return svg_text(figure)


def _residuals(found: Identification) -> str:
    figure, logs = _grid(found), [*found.training, *found.validation]
    start = 0.0
    for k, each in enumerate(logs):
        rows = evenly_spaced(len(each.t), _POINTS)
        held_out = k >= len(found.training)
        for i, axes in enumerate(figure.axes):
            residual = each.measured[rows, i] - each.predicted[rows, i]
            axes.plot(
                start + each.t[rows] - each.t[0], residual, linewidth=0.7, color="C3" if held_out else f"C{k % 3}"
            )
        start += float(each.t[-1] - each.t[0]) * 1.02
    return svg_text(figure)


def _grid(found: Identification) -> "Figure":
    """Return a figure with axes for every joint, two in a row."""
    joints = found.model.arm.joints
    figure = empty_figure((7.4, 1.5 * ((len(joints) + 1) // 2) + 0.4))
    axes = figure.subplots((len(joints) + 1) // 2, min(2, len(joints)), squeeze=False, sharex=True).ravel()
    for spare in axes[len(joints) :]:
        spare.remove()
    for i, (each, joint) in enumerate(zip(axes, joints, strict=False), 1):
        each.set_title(plain_label(joint.name or f"joint {i}"), fontsize="small")
        each.set_ylabel(joint.units.effort)
        each.grid(visible=True, alpha=0.3)
    for each in axes[max(0, len(joints) - 2) : len(joints)]:
        each.set_xlabel("s")
    return figure
