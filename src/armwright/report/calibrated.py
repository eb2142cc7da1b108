"""A calibration as people read it: what was found, what is held, before and after, files and a page."""

import html
import io
import json
import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arm.write import toml_text
from armwright.arrays import Array
from armwright.calibration.correcting import corrected_arm
from armwright.calibration.fitting import Calibration, calibrate
from armwright.calibration.measurements import Measurements
from armwright.calibration.validation import cross_validated
from armwright.kinematics.forward import forward
from armwright.report.figures import Drawing, svg_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Turns about y, which a Denavit-Hartenberg table has no number for.
_TILTS = ("beta",)
_STYLE = """body{font:16px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#1f2933}
table{border-collapse:collapse;margin:1rem 0}td,th{padding:.2rem .8rem;border-bottom:1px solid #e4e7eb;text-align:left}
td.n{text-align:right;font-variant-numeric:tabular-nums}figure{margin:1.5rem 0}img{max-width:100%}
figcaption{color:#52606d}"""


@attrs.frozen(kw_only=True, eq=False)
class Calibrated:
    """A calibration with all that is told of it.

    Attributes:
        arm: as it was said to be.
        measurements: what was measured.
        full: with all errors that can be told.
        table: without turns about y, for arm files.
        raw: (m,) distances of the points from the arm as said, in its own frame [m].
        held_out: (m,) distances from arms calibrated without the point, all errors [m].
        held_out_table: (m,) likewise, without turns about y [m].
        checked: (c,) distances of the points that the file keeps for checking from the corrected arm [m].
        notes: what is worth a sentence.
    """

    arm: Arm
    measurements: Measurements
    full: Calibration
    table: Calibration
    raw: Array
    held_out: Array
    held_out_table: Array
    checked: Array
    notes: tuple[str, ...]


def calibrated(
    arm: Arm,
    measurements: Measurements,
    *,
    folds: int = 5,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> Calibrated:
    """Calibrate an arm with and without turns about y, and hold points out.

    Args:
        arm: as it is said to be.
        measurements: of it.
        folds: parts in which points are held out.
        seed: of the parts.
        progress: told what is being done.
    """

    def told(what: str) -> None:
        if progress is not None:
            progress(what)

    fit = ~measurements.check
    q, points = measurements.q[fit], measurements.points[fit]
    full = calibrate(arm, q, points, progress=progress)
    table = (
        full if not any(name.endswith(".beta") for name in full.names) else calibrate(arm, q, points, without=_TILTS)
    )
    told("holding points out: all errors")
    held_out = held_out_table = cross_validated(arm, q, points, folds=folds, seed=seed)
    if any(name.endswith(_TILTS) for name in full.chain.names):
        told("holding points out: for the arm file")
        held_out_table = cross_validated(arm, q, points, folds=folds, seed=seed, without=_TILTS)
    return Calibrated(
        arm=arm,
        measurements=measurements,
        full=full,
        table=table,
        raw=np.asarray(np.linalg.norm(forward(arm, q)[:, :3, 3] - points, axis=1), dtype=np.float64),
        held_out=held_out,
        held_out_table=held_out_table,
        checked=np.asarray(
            np.linalg.norm(full.predict(measurements.q[~fit]) - measurements.points[~fit], axis=1)
            if np.any(~fit)
            else np.zeros(0),
            dtype=np.float64,
        ),
        notes=tuple(_notes(full, measurements)),
    )


def _notes(full: Calibration, measurements: Measurements) -> Iterator[str]:
    count = len(full.names)
    left = f"what is left has a noise of {full.noise * 1e3:.3g} mm per coordinate"
    yield f"{count} errors fitted to {int((~measurements.check).sum())} points; {left}"
    yield from measurements.warnings
    if full.outliers:
        shown = ", ".join(str(i + 1) for i in full.outliers[:8])
        more = f" and {len(full.outliers) - 8} more" if len(full.outliers) > 8 else ""
        yield f"points that are farther off than they should be, and count less: {shown}{more}"


def distances(found: Calibrated) -> dict[str, Array]:
    """Return by name the distances of the points from where the arm has its tool [m]."""
    kinds = {
        "arm and base as said": found.raw,
        "base moved to fit": found.full.before,
        "calibrated, points held out": found.held_out,
        "calibrated, all points": found.full.after,
        "arm file, points held out": found.held_out_table,
        "calibrated, points kept to check": found.checked,
    }
    return {name: x for name, x in kinds.items() if len(x)}


def shown_errors(calibration: Calibration) -> Iterator[tuple[str, str, str, str]]:
    """Give the errors that were found as people read them: name, value, deviation, unit."""
    lengths = dict(zip(calibration.chain.names, calibration.chain.is_length, strict=True))
    for name, value, deviation in zip(calibration.names, calibration.values, calibration.deviations, strict=True):
        scale, unit = (1e3, "mm") if lengths[name] else (180 / math.pi, "deg")
        yield name, f"{value * scale:+.4f}", f"{deviation * scale:.4f}", unit


def as_data(found: Calibrated) -> dict[str, Any]:
    """Return a calibration as plain data, SI."""
    full = found.full
    return {
        "arm": found.arm.name,
        "points": int((~found.measurements.check).sum()),
        "errors": {
            name: {"value": float(value), "deviation": float(deviation)}
            for name, value, deviation in zip(full.names, full.values, full.deviations, strict=True)
        },
        "covariance": full.covariance.tolist(),
        "held": {one.name: one.why for one in full.held},
        "singular_values": full.identified.singular_values.tolist(),
        "noise": full.noise,
        "outliers": list(full.outliers),
        "distances": {
            name: {"mean": float(x.mean()), "largest": float(x.max())} for name, x in distances(found).items()
        },
        "notes": list(found.notes),
    }


def calibrated_files(found: Calibrated, *, title: str) -> dict[str, str]:
    """Return the files of a calibration by name.

    Args:
        found: the calibration.
        title: of the page.
    """
    from armwright.arm.urdf.writer import urdf_text  # noqa: PLC0415 - an extra reads it, writing needs it only here

    drawn = [
        Drawing(
            "residuals",
            "What is left at each point, along x, y and z; held-out distances below",
            svg_text(_residuals(found)),
        ),
        Drawing("distances", "Distances before and after, sorted", svg_text(_distances(found))),
    ]
    text = json.dumps(as_data(found), indent=2)
    head = f"# {found.arm.name} as calibrated with {len(found.raw)} points; covariance in errors.json\n"
    corrected = corrected_arm(found.table)
    return {
        "arm.toml": head + toml_text(corrected) + "\n",
        "arm.urdf": urdf_text(corrected),
        "errors.json": text + "\n",
        "report.html": _page(found, drawn, title),
        **{f"{one.name}.svg": one.svg for one in drawn},
    }


def _page(found: Calibrated, drawn: list[Drawing], title: str) -> str:
    page = io.StringIO()
    page.write(f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(title)}</title>')
    page.write(f"<style>{_STYLE}</style><h1>{html.escape(title)}</h1>")
    page.write("<table><tr><th>distance of the points</th><th>mean, mm</th><th>largest, mm</th></tr>")
    for name, one in as_data(found)["distances"].items():
        page.write(_row(name, f"{one['mean'] * 1e3:.4f}", f"{one['largest'] * 1e3:.4f}"))
    page.write("</table>")
    page.writelines(f"<p>{html.escape(note)}</p>" for note in found.notes)
    page.writelines(one.element for one in drawn)
    page.write("<h2>Errors found</h2><table><tr><th>error</th><th>value</th><th>&#177;</th><th>unit</th></tr>")
    page.writelines(_row(*cells) for cells in shown_errors(found.full))
    page.write("</table><h2>Not fitted</h2><table><tr><th>error</th><th>why</th></tr>")
    page.writelines(f"<tr><td>{one.name}</td><td>{html.escape(one.why)}</td></tr>" for one in found.full.held)
    page.write("</table></html>\n")
    return page.getvalue()


def _row(name: str, *cells: str) -> str:
    return f"<tr><td>{name}</td>{''.join(f'<td class=n>{cell}</td>' for cell in cells)}</tr>"


def _residuals(found: Calibrated) -> "Figure":
    from matplotlib.figure import Figure  # noqa: PLC0415 - costs half a second, and only figures need it

    fit = ~found.measurements.check
    off = (found.full.predict(found.measurements.q[fit]) - found.measurements.points[fit]) * 1e3
    figure = Figure(figsize=(7.4, 4.6), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.4, 1))
    number = np.arange(1, len(off) + 1)
    for i, (name, marker) in enumerate(zip("xyz", "o^s", strict=True)):
        above.plot(number, off[:, i], marker, markersize=2.4, label=name, alpha=0.7)
    above.set(ylabel="left over, mm")
    above.legend(ncols=3, fontsize="small", loc="upper right")
    below.plot(number, found.held_out * 1e3, ".", color="C3", markersize=3)
    below.set(xlabel="point", ylabel="held out, mm", ylim=(0, None))
    for axis in (above, below):
        axis.grid(visible=True, alpha=0.3)
    return figure


def _distances(found: Calibrated) -> "Figure":
    from matplotlib.figure import Figure  # noqa: PLC0415

    figure = Figure(figsize=(7.4, 4.0), layout="constrained")
    axis = figure.subplots()
    part = (np.arange(len(found.raw)) + 0.5) / len(found.raw) * 100
    for name, x in (
        ("base moved to fit", found.full.before),
        ("held out", found.held_out),
        ("all points", found.full.after),
    ):
        axis.plot(np.maximum(np.sort(x) * 1e3, 1e-6), part, label=name)
    axis.set(xscale="log", xlabel="distance, mm", ylabel="points that are nearer, %", ylim=(0, 100))
    axis.grid(visible=True, which="both", alpha=0.3)
    axis.legend()
    return figure
