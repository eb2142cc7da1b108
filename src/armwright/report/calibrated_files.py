"""The files of a calibration: the corrected arm in all forms, its errors, a page and its figures."""

import json
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from armwright.arm.write import toml_text
from armwright.calibration.correction import corrected_arm, corrected_tables, corrected_urdf
from armwright.report.calibrated import Calibrated, as_data, distances, shown_bends, shown_errors, turns
from armwright.report.figures import Drawing, empty_figure, plain_axes, svg_text
from armwright.report.plain_page import Table, plain_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def calibrated_files(found: Calibrated, *, title: str, command: str) -> dict[str, str]:
    """Return the files of a calibration by name.

    Args:
        found: the calibration.
        title: of the page.
        command: the command line that made it.
    """
    drawn = [
        Drawing(
            "residuals",
            "What is left of each reading: along x, y and z where points were measured; held out below",
            svg_text(_residuals(found)),
        ),
        Drawing("distances", "Distances before and after, sorted", svg_text(distances_figure(found))),
    ]
    head = (
        f"# {found.arm.name} as calibrated with {len(found.held_out.distance)} readings, without turns about y; "
        f"all errors are in errors.json\n"
    )
    tables = {**corrected_tables(found.full), **corrected_tables(found.table)}
    return {
        "arm.toml": head + toml_text(corrected_arm(found.table)) + "\n",
        "arm.urdf": corrected_urdf(found.full),
        **{f"dh_{name}.csv": text for name, text in tables.items()},
        "errors.json": json.dumps(as_data(found), indent=2) + "\n",
        "report.html": plain_page(
            title=title, command=command, tables=_tables(found), drawn=drawn, notes=found.notes, named=_facts(found)
        ),
        **{f"{one.name}.svg": one.svg for one in drawn},
    }


def result_tables(found: Calibrated) -> Iterator[Table]:
    """Give the tables that tell how good a calibration is."""
    heads = ("", "mean mm", "largest mm")
    yield Table(
        title="Distance of the readings",
        heads=heads,
        rows=[(name, f"{x.mean() * 1e3:.4f}", f"{x.max() * 1e3:.4f}") for name, x in distances(found).items()],
        numbers=(1, 2),
    )
    yield Table(
        title="Turn of the poses",
        heads=("", "mean deg", "largest deg"),
        rows=[
            (name, f"{math.degrees(x.mean()):.4f}", f"{math.degrees(x.max()):.4f}") for name, x in turns(found).items()
        ],
        numbers=(1, 2),
    )
    yield Table(
        title="By ISO 9283",
        heads=("", "AP mm", "largest", "AD mm", "largest"),
        rows=[(name, *(f"{x * 1e3:.4f}" for x in one)) for name, one in (found.accuracy or {}).items()],
        numbers=(1, 2, 3, 4),
        remark=_repeated(found),
    )
    if found.beyond:
        yield Table(
            title="What was tried beyond geometry, on the held-out points that chose",
            heads=("", "mean mm", "gain mm", "±", "kept"),
            rows=[
                (
                    one.name,
                    *(
                        ("", "", "")
                        if one.held_out is None
                        else (f"{one.held_out * 1e3:.4f}", "", "")
                        if number == 0
                        else (f"{one.held_out * 1e3:.4f}", f"{one.gain * 1e3:+z.4f}", f"{one.chance * 1e3:.4f}")
                    ),
                    f"{'yes' if one.kept else 'no'}{': ' if one.why else ''}{one.why}",
                )
                for number, one in enumerate(found.beyond.tried)
            ],
            numbers=(1, 2, 3),
        )
        yield Table(
            title="Bends of joints that are kept",
            heads=("bend", "value", "±", "what"),
            rows=list(shown_bends(found.beyond)),
            numbers=(1, 2),
        )


def _tables(found: Calibrated) -> Iterator[Table]:
    yield from result_tables(found)
    yield Table(
        title="Errors found", heads=("error", "value", "±", "unit"), rows=list(shown_errors(found.full)), numbers=(1, 2)
    )
    yield Table(title="Not fitted", heads=("error", "why"), rows=[(one.name, one.why) for one in found.full.held])


def _facts(found: Calibrated) -> Iterator[tuple[str, str]]:
    yield "Arm", found.arm.title or found.arm.name
    yield "Readings", str(len(found.held_out.distance))
    yield "Errors fitted", str(len(found.full.names))
    yield "Held out", f"{found.held_out.distance.mean() * 1e3:.4f} mm"


def _repeated(found: Calibrated) -> str:
    one = found.repeatability
    if one is None:
        return "each posture once; RP needs several"
    return (
        f"RP {one.RP * 1e3:.4f} mm, largest {one.RP_largest * 1e3:.4f}, of {one.configurations} postures measured "
        f"{one.cycles} times or more (of 30)"
    )


def _residuals(found: Calibrated) -> "Figure":
    seen = found.measurements.readings.take(~found.measurements.check)
    rows = found.full.model.rows(seen, found.full.errors)
    number = np.arange(1, len(seen) + 1)
    figure = empty_figure((7.4, 4.6))
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.4, 1))
    size = np.bincount(rows.of[~rows.turning], minlength=len(seen))
    points = ~rows.turning & (size[rows.of] == 3)
    for i, (name, marker) in enumerate(zip("xyz", "o^s", strict=True)):
        above.plot(
            rows.of[points][i::3] + 1, rows.off[points][i::3] * 1e3, marker, markersize=2.4, label=name, alpha=0.7
        )
    others = ~rows.turning & (size[rows.of] == 1)
    if others.any():
        above.plot(rows.of[others] + 1, rows.off[others] * 1e3, ".", label="planes, distances", color="C4")
    above.set(ylabel="left over, mm")
    above.legend(ncols=4, fontsize="small", loc="upper right", markerscale=2)
    below.plot(number, found.held_out.distance * 1e3, ".", color="C3", markersize=3)
    floor = found.repeatability
    if floor is not None:
        below.axhline(floor.floor * 1e3, color="C2", label="repeatability")
        below.legend(fontsize="small", loc="upper right")
    below.set(xlabel="reading", ylabel="held out, mm", ylim=(0, None))
    for axis in (above, below):
        axis.grid(visible=True, alpha=0.3)
    return figure


def distances_figure(found: Calibrated) -> "Figure":
    """Return the distances by which readings miss the arm before and after, sorted."""
    figure = empty_figure((7.4, 4.0))
    axes = plain_axes(figure, "distance, mm", "readings that are nearer, %")
    shown = distances(found)
    for name in ("base moved to fit", "calibrated, held out", "calibrated, all readings", "beyond geometry, held out"):
        if name in shown:
            x = shown[name]
            part = (np.arange(len(x)) + 0.5) / len(x) * 100
            axes.plot(np.maximum(np.sort(x) * 1e3, 1e-6), part, label=name)
    axes.set(xscale="log", ylim=(0, 100))
    floor = found.repeatability
    if floor is not None:
        axes.axvline(floor.floor * 1e3, color="0.4", linestyle=":", label="comes back to (root mean square)")
    axes.legend(fontsize="small")
    return figure
