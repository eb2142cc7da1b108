"""The page of a calibration: distances before and after, errors with their intervals, residuals in space, files."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.calibration.assessment import CalibrationAssessment
from armwright.files.result_table import ResultTable
from armwright.kinematics.forward_kinematics import link_poses
from armwright.report.elements import Card, Tile, downloads, figures, length_text, table, tables
from armwright.report.figures import Drawing, round_number
from armwright.report.static_page import static_page
from armwright.report.stick_figure import skeleton_points

_AXES = "xyz"
# An error below so many standard errors may be none.
_SIGMAS = 2.0
_PARAMETERS = "dots with intervals of 95 %, which end at the scale; faded: below two standard errors"
# Half the width of the scale of the errors, and its height, in units of its drawing.
_HALF, _HEIGHT = 110, 16
# A residual of the median length is drawn as long as this part of the size of the cloud of points.
_ARROW = 0.06
_VIEW = (
    '<div class="turned"><svg id="points" viewBox="-50 -32 100 64" tabindex="0" role="img" '
    'aria-label="The tracked points with their residuals as arrows, and the arm in its first reading. '
    'Drag or use the arrow keys to turn."></svg><p class="quiet">{text}</p></div>'
)


def calibration_page(
    assessment: CalibrationAssessment,
    drawn: Sequence[Drawing],
    files: Mapping[str, str],
    *,
    title: str,
    command: str,
) -> str:
    """Return the text of the page.

    Args:
        assessment: of the calibration.
        drawn: its figures.
        files: what lies beside the page, by name.
        title: heading of the page.
        command: the command line that made it.

    Returns:
        HTML text; write it as UTF-8.
    """
    *summary, _, fixed = assessment.tables()
    data = residual_view(assessment)
    fitted = len(assessment.full.names)
    return static_page(
        title=title,
        command=command,
        sections=[
            Card("Summary", tables(summary)),
            Card("Parameters", _errors(assessment, fixed), _PARAMETERS),
            Card("Residuals", _VIEW.format(text=_view_text(data)) + figures(drawn)),
            Card("Files", downloads(files)),
        ],
        numbers=_tiles(assessment),
        notes=[note for note in assessment.notes if note not in assessment.warnings],
        warnings=assessment.warnings,
        named=(
            ("Arm", assessment.arm.title or assessment.arm.name),
            ("Readings", str(len(assessment.fitted))),
            ("Errors fitted", str(fitted)),
        ),
        verdict=("doubtful", False) if assessment.contradictions else None,
        scripts=("points.js",),
        data=data,
    )


def residual_view(assessment: CalibrationAssessment) -> dict[str, Any]:
    """Return the data of the view of the residuals, in the best-fitted base frame of the nominal arm.

    Returns:
        points: (m, 3) positions of the tool of the calibrated arm [m].
        arrows: for each point the (3,) residual, from the reading to the calibrated arm, magnified [m]; None where it
            does not have three coordinates.
        said: for each point, which reading it is and the length of its residual.
        marked: numbers of the points whose residual is too large for chance.
        arm: (k, 3) corners of the arm in the first reading [m].
        factor: how many times as long as the residuals the arrows are.
    """
    full, measured = assessment.full, assessment.fitted
    R, origin = full.chain.base[:3, :3], full.chain.base[:3, 3]
    lengths = full.after.distance
    points = (full.chain.forward(measured.q, full.arm_errors).position - origin) @ R
    vectors = {i: values for i, values in length_residuals(assessment).items() if len(values) == len(_AXES)}
    typical = float(np.median(lengths))
    factor = round_number(_ARROW * float(np.ptp(points, axis=0).max()) / typical) if typical > 0 else 1.0
    names = assessment.fitted_names
    return {
        "points": points.tolist(),
        "arrows": [(factor * vectors[i] @ R).tolist() if i in vectors else None for i in range(len(measured))],
        "said": [f"{name}: {length_text(length)}" for name, length in zip(names, lengths.tolist(), strict=True)],
        "marked": list(assessment.remarkable),
        "arm": skeleton_points(assessment.arm, link_poses(assessment.arm, measured.q[:1]))[0].tolist(),
        "factor": factor,
    }


def length_residuals(assessment: CalibrationAssessment) -> dict[int, Array]:
    """Return the lengths among the residuals by the number of the reading: along x, y and z, or one number [m]."""
    residuals = assessment.full.model.residuals(assessment.fitted, assessment.full.errors)
    values, reading = (column[~residuals.is_rotation] for column in (residuals.values, residuals.reading))
    return {i: values[reading == i] for i in np.unique(reading).tolist()}


# ---- inside --------------------------------------------------------------------------------------------------------


def _view_text(data: Mapping[str, Any]) -> str:
    arrows = f"Arrows: residuals of the readings, magnified {data['factor']:g} times, to the calibrated arm. "
    red = "Red: larger than noise explains. " if data["marked"] else ""
    return f"{arrows}{red}Grey: the arm in the first reading. Drag, or use the arrow keys, to turn."


def _tiles(assessment: CalibrationAssessment) -> Iterator[Tile]:
    """Give the mean distance before and after, and the largest after, all of readings that were held out."""
    kinds = assessment.distances
    for name, text in (
        ("nominal, base best-fitted", "mean distance of the readings: nominal arm, base best-fitted"),
        ("calibrated, held out", "calibrated, held out: at readings that were not fitted to"),
        ("non-geometric, held out", "with the non-geometric model, held out"),
    ):
        if name in kinds:
            arrow = "" if name.startswith("nominal") else "\N{RIGHTWARDS ARROW} "
            yield Tile(f"{arrow}{length_text(float(kinds[name].mean()))}", text)
    held_out = kinds["non-geometric, held out" if "non-geometric, held out" in kinds else "calibrated, held out"]
    yield Tile(length_text(float(held_out.max())), "largest, held out")


def _errors(assessment: CalibrationAssessment, fixed: ResultTable) -> str:
    """Return the errors as tables of lengths and angles, each with a dot and its interval on a common scale.

    Those that were not fitted are in a table beside the lengths.
    """
    full = assessment.full
    is_length = full.model.is_length[list(full.identifiability.fitted)]
    blocks = []
    for title, unit, factor, rows in (
        ("Lengths", "mm", 1e3, np.flatnonzero(is_length)),
        ("Angles", "deg", 180 / math.pi, np.flatnonzero(is_length == 0)),
    ):
        if not len(rows):
            continue
        values, errors, bounds = (x[rows] * factor for x in (full.values, full.standard_errors, full.intervals()))
        clear = np.abs(values) >= _SIGMAS * errors
        # Errors that are hardly identifiable have intervals that hide all others; they are cut off.
        scale = _upper_round(float(np.abs(bounds[clear] if clear.any() else bounds).max()))
        numbers = ResultTable(
            title=title,
            heads=("error", unit, "±"),
            rows=[
                (full.names[i], f"{value:+z.4f}", f"{error:.4f}")
                for i, value, error in zip(rows.tolist(), values.tolist(), errors.tolist(), strict=True)
            ],
            numbers=(1, 2),
            marks=["" if known else "faded" for known in clear],
        )
        drawn = [
            _interval(value / scale, low / scale, high / scale)
            for value, (low, high) in zip(values.tolist(), bounds.tolist(), strict=True)
        ]
        blocks.append(f"<h3>{title}</h3>{table(numbers, last=[_scale(scale, unit), *drawn])}")
    if fixed.rows:
        blocks.append(f'<h3 class="next">{fixed.title}</h3>{table(fixed)}')
    first, *others = blocks
    return f'<div class="tables errors"><div>{first}</div><div>{"".join(others)}</div></div>'


def _upper_round(x: float) -> float:
    """Return the smallest of 1, 2, 5, 10, 20 ... and of their decimal fractions that is not below x."""
    power = 10.0 ** math.floor(math.log10(max(x, 1e-12)))
    return next((digit * power for digit in (1, 2, 5) if digit * power >= x), 10 * power)


def _scale(scale: float, unit: str) -> str:
    return f"<span>\N{MINUS SIGN}{scale:g}</span><span>0</span><span>+{scale:g} {unit}</span>"


def _interval(value: float, low: float, high: float) -> str:
    """Return a value and its interval, both relative to the end of the scale, as a drawing."""
    x, x0, x1 = (f"{_HALF * part:.1f}" for part in (value, low, high))
    middle = _HEIGHT // 2
    return (
        f'<svg viewBox="-{_HALF + 5} -{middle} {2 * _HALF + 10} {_HEIGHT}" aria-hidden="true">'
        f'<path class="zero" d="M0-{middle}V{middle}"/><path d="M{x0} 0H{x1}"/><circle cx="{x}" r="3.2"/></svg>'
    )
