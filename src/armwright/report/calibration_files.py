"""The files of a calibration: the corrected arm in all forms, its errors, a page and its figures."""

import json
from typing import TYPE_CHECKING

import numpy as np

from armwright.arm.write import toml_text
from armwright.calibration.assessment import CalibrationAssessment
from armwright.calibration.correction import corrected_arm, corrected_tables, corrected_urdf, robot_files
from armwright.calibration.joint_errors import identified_compliance
from armwright.dynamics.stiffness_file import stiffness_text
from armwright.report.calibration_page import calibration_page, length_residuals
from armwright.report.figures import Drawing, empty_figure, plain_axes, plain_label, svg_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# The distances that are drawn.
_DISTANCES = {
    "nominal, base best-fitted",
    "calibrated, held out",
    "calibrated, all readings",
    "non-geometric, held out",
}
# What each file holds.
_CONTENTS = {
    "arm.toml": "the corrected arm as an arm file, with its base in the frame of the measurements",
    "arm.urdf": "the corrected arm with every identified error",
    "dh_standard.csv": "Denavit-Hartenberg parameters of arm.toml, standard convention",
    "dh_modified.csv": "Denavit-Hartenberg parameters of arm.toml, modified convention",
    "dh_hayati.csv": "parameters of arm.urdf with rotations about y",
    "calibration.conf": "differences from the model, as controllers of Universal Robots keep them",
    "kinematics.yaml": "frames of the joints for ROS 2, as kinematics_params_file of ur_description",
    "stiffness.toml": "stiffness of the joints, for armwright deflection",
    "errors.json": "every error with its interval, the covariance, residuals before and after",
    "residuals.svg": "residuals of each reading",
    "distances.svg": "distances before and after, sorted",
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
    files = {
        "arm.toml": f"# {assessment.arm.name} {how}\n{toml_text(corrected_arm(assessment.tabular))}\n",
        "arm.urdf": corrected_urdf(assessment.full),
        **{f"dh_{name}.csv": text for name, text in tables.items()},
        **robot_files(assessment.full),
        "errors.json": json.dumps(assessment.as_data(), indent=2) + "\n",
        **{f"{drawing.name}.svg": drawing.svg for drawing in drawn},
    }
    if assessment.nongeometric:
        compliance = identified_compliance(assessment.nongeometric.calibration)
        if (compliance > 0).any():
            files["stiffness.toml"] = stiffness_text(assessment.arm, compliance)
    beside = {name: _CONTENTS[name] for name in files}
    return {**files, "report.html": calibration_page(assessment, drawn, beside, title=title, command=command)}


def _residuals_figure(assessment: CalibrationAssessment) -> "Figure":
    measured, residuals = assessment.fitted, length_residuals(assessment)
    figure = empty_figure((7.4, 4.6))
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.4, 1))
    points = {i + 1: values * 1e3 for i, values in residuals.items() if len(values) == 3}
    for axis, (name, marker) in enumerate(zip("xyz", "o^s", strict=True)):
        along = [values[axis] for values in points.values()]
        upper.plot([*points], along, marker, markersize=2.4, label=name, alpha=0.7)
    others = [(i + 1, value * 1e3) for i, values in residuals.items() if len(values) != 3 for value in values]
    if others:
        upper.plot(*zip(*others, strict=True), ".", label="planes, distances", color="C4")
    upper.set(ylabel="residual, mm")
    upper.legend(ncols=4, fontsize="small", loc="upper right", markerscale=2)
    held_out = assessment.held_out.distance * 1e3
    lower.plot(np.arange(1, len(measured) + 1), held_out, ".", color="C0", markersize=3)
    for i in assessment.remarkable:
        lower.plot(i + 1, held_out[i], "o", color="C3", markersize=6, fillstyle="none")
        name = plain_label(assessment.fitted_names[i])
        lower.annotate(name, (i + 1, held_out[i]), (6, -3), textcoords="offset points", fontsize="small", color="C3")
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
