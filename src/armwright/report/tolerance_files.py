"""The files of an assessment of tolerances: a page, its numbers, and figures of errors, shares and costs."""

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from armwright.reliability.allocation import Allocation
from armwright.reliability.assessment import ToleranceAssessment
from armwright.report.elements import Card, Tile, downloads, figures, tables
from armwright.report.figures import Drawing, empty_figure, plain_axes, svg_text
from armwright.report.static_page import static_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Dimensions that a figure shows by name; the rest are summed up.
_BARS = 20


def tolerance_files(assessment: ToleranceAssessment, *, command: str) -> dict[str, str]:
    """Return the files of an assessment by name.

    Args:
        assessment: of the tolerances.
        command: the command line that made it.
    """
    drawn = list(_drawings(assessment))
    limit, worst = assessment.limit, float(assessment.worst_case.max())
    holds = limit is None or worst <= limit
    beside = {"tolerance.json": "bounds and probabilities of every pose, shares and tolerances of every dimension"}
    return {
        "tolerance.json": json.dumps(assessment.as_data(), indent=2, ensure_ascii=False) + "\n",
        "report.html": static_page(
            title=f"Tolerances of {assessment.mechanism.name}",
            command=command,
            sections=[
                Card("Accuracy", tables(assessment.tables())),
                Card("Figures", figures(drawn)),
                Card("Files", downloads(beside, drawn)),
            ],
            numbers=_tiles(assessment),
            notes=assessment.notes,
            warnings=(),
            verdict=None
            if limit is None
            else ("the worst case keeps the limit" if holds else "the worst case exceeds the limit", holds),
        ),
        **{f"{drawing.name}.svg": drawing.svg for drawing in drawn},
    }


def _tiles(assessment: ToleranceAssessment) -> Iterator[Tile]:
    limit, worst = assessment.limit, float(assessment.worst_case.max())
    over = limit is not None and worst > limit
    if assessment.mean.any():
        yield Tile(f"{assessment.mean.max() * 1e3:.3f} mm", "mean dimensions")
    yield Tile(f"{worst * 1e3:.3f} mm", "worst case", mark="bad" if over else "")
    yield Tile(f"{assessment.statistical.max() * 1e3:.3f} mm", "statistical, three standard deviations")
    if limit is not None and assessment.on_path is not None:
        yield Tile(f"{assessment.on_path.probability:.2g}", f"probability of more than {limit * 1e3:g} mm at any pose")
    first = assessment.ranking[0]
    share = assessment.error.shares[assessment.worst_pose, first]
    yield Tile(f"{share:.0%}", f"share of {assessment.tolerances[first].name}, the largest")


def _drawings(assessment: ToleranceAssessment) -> Iterator[Drawing]:
    if len(assessment.numbers) > 1:
        yield Drawing(
            "errors",
            "errors along the poses: worst case, three standard deviations, and the middle nine tenths of random "
            f"{assessment.mechanism.kind}s",
            _errors(assessment),
        )
    yield Drawing(
        "shares", "shares: parts of the variance of the error at the pose where it varies most", _shares(assessment)
    )
    if assessment.allocation is not None:
        yield Drawing(
            "costs",
            "tolerances of least cost: how many times wider than given; those right of 1 can be relaxed",
            _changes(assessment, assessment.allocation),
        )


def _errors(assessment: ToleranceAssessment) -> str:
    figure = empty_figure((7.4, 4.0))
    axes = plain_axes(figure, "pose", f"error of the {assessment.mechanism.point}, mm")
    poses = assessment.numbers
    low, high = np.quantile(assessment.sampled, (0.05, 0.95), axis=0) * 1e3
    many = f"nine tenths of random {assessment.mechanism.kind}s"
    axes.fill_between(poses, low, high, color="C0", alpha=0.2, label=many)
    axes.plot(poses, assessment.worst_case * 1e3, "-", color="C3", label="worst case")
    axes.plot(poses, assessment.statistical * 1e3, "--", color="C0", label="statistical")
    if assessment.mean.any():
        axes.plot(poses, assessment.mean * 1e3, "-.", color="C2", label="mean dimensions")
    if assessment.limit is not None:
        axes.axhline(assessment.limit * 1e3, color="C7", linestyle=":", label="limit")
    # Room for the legend above the lines.
    axes.set_ylim(0, 1.3 * axes.get_ylim()[1])
    axes.locator_params(axis="x", integer=True)
    axes.legend(fontsize="small", loc="upper right", ncols=2)
    return svg_text(figure, "Error along the poses")


def _shares(assessment: ToleranceAssessment) -> str:
    shares = assessment.error.shares[assessment.worst_pose]
    order = [i for i in assessment.ranking if shares[i] > 0][:_BARS]
    names = [assessment.tolerances[i].name for i in order]
    values = [100 * shares[i] for i in order]
    if (rest := 100 - sum(values)) > 0.05:
        names, values = [*names, "all others"], [*values, rest]
    figure = empty_figure((7.4, 0.9 + 0.24 * len(names)))
    axes = plain_axes(figure, "share of the variance, %", "")
    _bars(axes, names, values)
    return svg_text(figure, "Shares of the dimensions")


def _changes(assessment: ToleranceAssessment, allocation: Allocation) -> str:
    widths = allocation.half_widths
    order = [i for i in assessment.ranking if np.isfinite(widths[i])][:_BARS]
    figure = empty_figure((7.4, 0.9 + 0.24 * len(order)))
    axes = plain_axes(figure, "tolerance of least cost / given tolerance", "")
    values = [float(widths[i] / assessment.tolerances[i].half_width) for i in order]
    _bars(axes, [assessment.tolerances[i].name for i in order], values, start=1.0)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("{x:g}" if max(values) < 10 * min(values) else "")
    axes.axvline(1, color="C7", linewidth=1)
    return svg_text(figure, "Tolerances of least cost")


def _bars(axes: "Axes", names: list[str], values: list[float], *, start: float = 0.0) -> None:
    """Draw horizontal bars, the first on top."""
    places = np.arange(len(names))[::-1]
    axes.barh(places, np.array(values) - start, left=start, height=0.7, color="C0")
    axes.set_yticks(places, names)
    axes.grid(visible=False, axis="y")
