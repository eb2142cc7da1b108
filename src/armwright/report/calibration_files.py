"""The files of a calibration: the corrected arm in all forms, its errors, a page and its figures."""

import json
from typing import TYPE_CHECKING

import numpy as np

from armwright.arm.write import toml_text
from armwright.calibration.assessment import CalibrationAssessment
from armwright.calibration.correction import corrected_arm, corrected_tables, corrected_urdf
from armwright.report.figures import Drawing, empty_figure, plain_axes, svg_text
from armwright.report.static_page import static_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# The distances that are drawn.
_DISTANCES = {
    "nominal, base best-fitted",
    "calibrated, held out",
    "calibrated, all readings",
    "non-geometric, held out",
}


def calibration_files(assessment: CalibrationAssessment, *, title: str, command: str) -> dict[str, str]:
    """Return the files of a calibration by name.

    Args:
        assessment: of the calibration.
        title: of the page.
        command: the command line that made it.
    """
    caption = "Residuals of each reading: along x, y and z where points were measured; held-out distances below"
    drawn = [
        Drawing("residuals", caption, svg_text(_residuals_figure(assessment))),
        Drawing("distances", "Distances before and after, sorted", svg_text(distances_figure(assessment))),
    ]
    readings = len(assessment.held_out.distance)
    how = f"as calibrated with {readings} readings, without rotations about y; all errors are in errors.json"
    tables = {**corrected_tables(assessment.full), **corrected_tables(assessment.tabular)}
    return {
        "arm.toml": f"# {assessment.arm.name} {how}\n{toml_text(corrected_arm(assessment.tabular))}\n",
        "arm.urdf": corrected_urdf(assessment.full),
        **{f"dh_{name}.csv": text for name, text in tables.items()},
        "errors.json": json.dumps(assessment.as_data(), indent=2) + "\n",
        "report.html": static_page(
            title=title,
            command=command,
            tables=assessment.tables(),
            drawn=drawn,
            notes=assessment.notes,
            named=(
                ("Arm", assessment.arm.title or assessment.arm.name),
                ("Readings", str(readings)),
                ("Errors fitted", str(len(assessment.full.names))),
                ("Held out", f"{assessment.held_out.distance.mean() * 1e3:.4f} mm"),
            ),
        ),
        **{f"{drawing.name}.svg": drawing.svg for drawing in drawn},
    }


def _residuals_figure(assessment: CalibrationAssessment) -> "Figure":
    measured = assessment.fitted
    residuals = assessment.full.model.residuals(measured, assessment.full.errors)
    figure = empty_figure((7.4, 4.6))
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.4, 1))
    size = np.bincount(residuals.reading[~residuals.is_rotation], minlength=len(measured))
    number, millimetres = residuals.reading + 1, residuals.values * 1e3
    points = ~residuals.is_rotation & (size[residuals.reading] == 3)
    for i, (name, marker) in enumerate(zip("xyz", "o^s", strict=True)):
        upper.plot(number[points][i::3], millimetres[points][i::3], marker, markersize=2.4, label=name, alpha=0.7)
    others = ~residuals.is_rotation & (size[residuals.reading] == 1)
    if others.any():
        upper.plot(number[others], millimetres[others], ".", label="planes, distances", color="C4")
    upper.set(ylabel="residual, mm")
    upper.legend(ncols=4, fontsize="small", loc="upper right", markerscale=2)
    lower.plot(np.arange(1, len(measured) + 1), assessment.held_out.distance * 1e3, ".", color="C3", markersize=3)
    if assessment.repeatability is not None:
        lower.axhline(assessment.repeatability.floor * 1e3, color="C2", label="repeatability")
        lower.legend(fontsize="small", loc="upper right")
    lower.set(xlabel="reading", ylabel="held out, mm", ylim=(0, None))
    for axis in (upper, lower):
        axis.grid(visible=True, alpha=0.3)
    return figure


def distances_figure(assessment: CalibrationAssessment) -> "Figure":
    """Return the cumulative distribution of the distances between readings and arm before and after."""
    figure = empty_figure((7.4, 4.0))
    axes = plain_axes(figure, "distance, mm", "cumulative share of readings, %")
    for name, x in assessment.distances.items():
        if name in _DISTANCES:
            share = (np.arange(len(x)) + 0.5) / len(x) * 100
            axes.plot(np.maximum(np.sort(x) * 1e3, 1e-6), share, label=name)
    axes.set(xscale="log", ylim=(0, 100))
    if assessment.repeatability is not None:
        floor = assessment.repeatability.floor * 1e3
        axes.axvline(floor, color="0.4", linestyle=":", label="repeatability (root mean square)")
    axes.legend(fontsize="small")
    return figure
