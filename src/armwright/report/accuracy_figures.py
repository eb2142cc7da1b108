"""Figures of measured accuracy: clouds of poses, deviation along paths, settling, corners, speeds, weaving."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from armwright.accuracy.assessment import Assessment
from armwright.accuracy.compliance import StaticCompliance
from armwright.accuracy.corner import CornerDeviation
from armwright.accuracy.measurement_file import PathTest, PoseTest
from armwright.accuracy.path import PathDeviation, PathVelocity
from armwright.accuracy.pose import PoseRepeatability
from armwright.accuracy.settling_time import PosingTime, Settling, attained_position
from armwright.accuracy.variation import PoseDrift, Variation
from armwright.accuracy.weaving import WeavingDeviation
from armwright.arrays import Array
from armwright.report.figures import Drawing, empty_figure, evenly_spaced, plain_axes, plain_label, svg_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, FigureBase

_Draw: TypeAlias = Callable[["Figure", Any, Any], None]

# Samples of a run that are drawn, and the drawn range about a corner, relative to its round-off or the shorter leg.
_MAX_SAMPLES, _CORNER_RANGE, _LEG_SHARE = 2000, 5.0, 0.15
_MARKS = "osD^v"
# Room around the clouds of poses, and the bars of a histogram.
_CLOUD_MARGIN, _BARS = 1.12, 10
_CLOUD_CAPTION = (
    "attained positions about the commanded one, all poses on one scale; below, distance from the barycentre cycle by "
    "cycle, and how often"
)


def accuracy_drawings(assessment: Assessment) -> list[Drawing]:
    """Return the figures of an assessment, in the order of its tests."""
    drawn: list[Drawing] = []
    cloud = partial(_draw_pose_cloud, half=_cloud_half_width(assessment))
    functions: dict[type, tuple[_Draw, str]] = {**_DRAWING_FUNCTIONS, PoseRepeatability: (cloud, _CLOUD_CAPTION)}
    for test, results in zip(assessment.tests, assessment.results, strict=True):
        title = f"{test.name}{f', {test.condition}' if test.condition else ''}"
        for result in results:
            if type(result) not in functions:
                continue
            draw, caption = functions[type(result)]
            kind = "velocity" if isinstance(result, PathVelocity) else test.kind
            figure = empty_figure((7.4, 4.2))
            draw(figure, test, result)
            svg = svg_text(figure, f"{kind}: {title}")
            drawn.append(Drawing(f"{len(drawn) + 1:02d}-{kind}", f"{kind} {title}: {caption}", svg))
    return drawn


def _plane_axes(figure: "FigureBase", size: int) -> "list[tuple[Axes, int, int]]":
    """Return the axes for a plane or the two axes for space, with the coordinates that they show."""
    pairs = [(0, 1)] if size == 2 else [(0, 1), (0, 2)]
    views = []
    for axis, (i, j) in zip(figure.subplots(1, len(pairs), squeeze=False)[0], pairs, strict=True):
        axis.set(xlabel=f"{'xyz'[i]}, mm", ylabel=f"{'xyz'[j]}, mm")
        axis.set_aspect("equal", adjustable="datalim")
        axis.grid(visible=True, alpha=0.3)
        views.append((axis, i, j))
    return views


def _draw_pose_cloud(figure: "Figure", test: PoseTest, result: PoseRepeatability, *, half: float) -> None:
    from matplotlib.patches import Circle  # noqa: PLC0415

    cloud = test.clouds[0]
    points, centre = _about_commanded(cloud.positions, test), _about_commanded(result.barycentre, test)
    figure.set_size_inches(7.4, 6.4)
    parts: Any = figure.subfigures(2, 1, height_ratios=(1.7, 1))
    upper, lower = parts
    middle = _cloud_middle(points)
    for axis, i, j in _plane_axes(upper, test.size):
        axis.plot(points[:, i], points[:, j], "o", markersize=3.5, color="C0", label="attained")
        axis.plot(centre[i], centre[j], "s", markersize=6, color="C1", label="barycentre")
        axis.plot(0, 0, "+", markersize=13, markeredgewidth=1.8, color="C3", label="commanded")
        circle = Circle((centre[i], centre[j]), result.radius * 1e3, fill=False, color="C1", linewidth=1.4, label="RP")
        axis.add_patch(circle)
        axis.set_aspect("equal", adjustable="box")
        axis.set(xlim=(middle[i] - half, middle[i] + half), ylim=(middle[j] - half, middle[j] + half))
    upper.legend(*axis.get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    trend, histogram = lower.subplots(1, 2, sharey=True, width_ratios=(3, 1))
    distances = np.linalg.norm(points - centre, axis=1)
    trend.plot(cloud.cycles, distances, "o-", markersize=3, linewidth=0.7, color="C0")
    trend.axhline(float(distances.mean()), color="C7", linestyle="--", linewidth=1.2, label="mean")
    trend.axhline(result.radius * 1e3, color="C1", linewidth=1.4, label="RP")
    trend.set(xlabel="cycle", ylabel="from the barycentre, mm", ylim=(0, None))
    trend.legend(fontsize="small", ncols=2, loc="upper left")
    histogram.hist(distances, bins=_BARS, orientation="horizontal", color="C0", edgecolor="white")
    histogram.set_xlabel("cycles")
    for axis in (trend, histogram):
        axis.locator_params(axis="x", integer=True)
        axis.grid(visible=True, alpha=0.3)


def _about_commanded(positions: Array, test: PoseTest) -> Array:
    """Return positions relative to the commanded one of a test of a pose [mm]."""
    commanded = test.clouds[0].commanded
    assert commanded is not None  # noqa: S101 - every test of a pose has it
    return (positions - commanded) * 1e3


def _cloud_middle(points: Array) -> Array:
    """Return the middle of attained positions and the commanded one, which is the origin."""
    return np.asarray((np.minimum(points.min(axis=0), 0) + np.maximum(points.max(axis=0), 0)) / 2, dtype=np.float64)


def _cloud_half_width(assessment: Assessment) -> float:
    """Return half the width that the figures of all tests of poses show, so that they can be compared [mm]."""
    half = 1e-6
    for test, results in zip(assessment.tests, assessment.results, strict=True):
        for result in results:
            if isinstance(test, PoseTest) and isinstance(result, PoseRepeatability):
                points, centre = (
                    _about_commanded(test.clouds[0].positions, test),
                    _about_commanded(result.barycentre, test),
                )
                middle = _cloud_middle(points)
                circle = np.abs(centre - middle).max() + result.radius * 1e3
                half = max(half, float(np.abs(points - middle).max()), float(np.abs(middle).max()), float(circle))
    return _CLOUD_MARGIN * half


def _draw_variation(figure: "Figure", test: PoseTest, result: Variation) -> None:
    origin = result.barycentres.mean(axis=0)
    for axis, i, j in _plane_axes(figure, test.size):
        for number, (cloud, centre) in enumerate(zip(test.clouds, result.barycentres, strict=True)):
            points, middle = (cloud.positions - origin) * 1e3, (centre - origin) * 1e3
            marker, colour = _MARKS[number % len(_MARKS)], f"C{number % 10}"
            style: dict[str, Any] = {"marker": marker, "color": colour, "linestyle": ""}
            axis.plot(points[:, i], points[:, j], **style, markersize=3.5, fillstyle="none", alpha=0.7)
            axis.plot(middle[i], middle[j], **style, markersize=8, markeredgecolor="k", label=plain_label(cloud.label))
    figure.legend(*axis.get_legend_handles_labels(), loc="outside lower center", ncols=5, frameon=False)


def _draw_drift(figure: "Figure", _test: PoseTest, result: PoseDrift) -> None:
    axis = _axes_without_offset(figure, "time, h", "mm")
    axis.plot(result.times / 3600, result.accuracy * 1e3, "o-", markersize=3.5, label="AP")
    axis.plot(result.times / 3600, result.repeatability * 1e3, "s--", markersize=3.5, label="RP")
    axis.set_ylim(bottom=0)
    axis.legend()


def _draw_settling(figure: "Figure", test: PathTest, result: Settling | PosingTime) -> None:
    axis = _axes_without_offset(figure, "time, s", "distance from the attained position, mm")
    for j, run in enumerate(test.runs):
        t = run.timed("settling")
        samples = evenly_spaced(len(t), _MAX_SAMPLES)
        distances = np.linalg.norm(run.positions - attained_position(run), axis=1)[samples] * 1e3
        axis.plot(t[samples], np.maximum(distances, result.band * 1e1), linewidth=1.1, label=f"cycle {j + 1}")
        if isinstance(result, Settling):
            for time, style in ((result.entered[j], ":"), (result.settled[j], "-")):
                axis.axvline(time, color=f"C{j % 10}", linestyle=style, linewidth=0.8)
    axis.axhline(result.band * 1e3, color="C3", linestyle="--", linewidth=1.2, label="band")
    axis.set_yscale("log")
    axis.legend(fontsize="small")


def _draw_path_deviation(figure: "Figure", _test: PathTest, result: PathDeviation) -> None:
    axis = _axes_without_offset(figure, "along the path, mm", "mm")
    s = result.stations * 1e3
    for name, values, station, style in (
        ("AT", result.offsets, result.accuracy_at, "-"),
        ("RT", result.radii, result.repeatability_at, "--"),
    ):
        line = axis.plot(s, values * 1e3, style, linewidth=1.4, label=f"{name} {values.max() * 1e3:.4g} mm")[0]
        axis.plot(station * 1e3, values.max() * 1e3, "o", markersize=5, color=line.get_color())
    axis.set_ylim(bottom=0)
    axis.legend()


def _draw_speeds(figure: "Figure", test: PathTest, result: PathVelocity) -> None:
    axis = _axes_without_offset(figure, "along the path, mm", "speed, mm/s")
    for speeds in result.speeds:
        axis.plot(result.stations * 1e3, speeds * 1e3, linewidth=1.0, color="C0", alpha=0.7)
    assert test.speed is not None  # noqa: S101 - every result has it
    axis.axhline(test.speed * 1e3, color="C3", linestyle="--", linewidth=1.2)


def _draw_corner(figure: "Figure", test: PathTest, result: CornerDeviation) -> None:
    assert test.commanded is not None  # noqa: S101 - every test of a corner has it
    path = test.commanded.positions
    near = np.linalg.norm(path - result.position, axis=1)
    reach = max(_CORNER_RANGE * max(result.round_off, result.overshoot), 1e-6)
    reach = min(reach, near[near > 0].min()) if result.round_off + result.overshoot > 0 else _LEG_SHARE * near.max()
    for axis, i, j in _plane_axes(figure, test.size):
        _draw_runs(axis, [(run.positions - result.position)[:, [i, j]] * 1e3 for run in test.runs])
        axis.plot(*((path - result.position)[:, [i, j]].T * 1e3), "k--", linewidth=1.2)
        axis.set_aspect("equal", adjustable="box")
        axis.set(xlim=(-reach * 1e3, reach * 1e3), ylim=(-reach * 1e3, reach * 1e3))


def _draw_weave(figure: "Figure", test: PathTest, _result: WeavingDeviation) -> None:
    assert test.commanded is not None  # noqa: S101 - every test of weaving has it
    for axis, i, j in _plane_axes(figure, test.size):
        _draw_runs(axis, [run.positions[:, [i, j]] * 1e3 for run in test.runs])
        axis.plot(*(test.commanded.positions[:, [i, j]].T * 1e3), "k--", linewidth=1.2)
        axis.set_aspect("auto")


def _draw_compliance(figure: "Figure", _test: PoseTest, result: StaticCompliance) -> None:
    axis = _axes_without_offset(figure, "force, N", "displacement, mm")
    forces = np.append(0.0, result.loads[-1])
    for i, name in enumerate("xyz"[: result.components.size]):
        axis.plot(result.loads, result.deflections[:, i] * 1e3, _MARKS[i], color=f"C{i}", markersize=4, label=name)
        axis.plot(forces, forces * result.components[i] * 1e3, color=f"C{i}", linewidth=1.0)
    axis.legend()


def _draw_runs(axis: "Axes", runs: Sequence[Array]) -> None:
    for number, run in enumerate(runs):
        axis.plot(*run[evenly_spaced(len(run), _MAX_SAMPLES)].T, linewidth=1.0, color=f"C{number % 10}")


def _axes_without_offset(figure: "Figure", x: str, y: str) -> "Axes":
    axis = plain_axes(figure, x, y)
    axis.ticklabel_format(useOffset=False)
    return axis


# The function that draws each other kind of result, and the caption of the figure.
_DRAWING_FUNCTIONS: dict[type, tuple[_Draw, str]] = {
    Variation: (_draw_variation, "attained positions by direction or robot, about the mean of all; barycentres filled"),
    PoseDrift: (_draw_drift, "AP and RP over time"),
    Settling: (
        _draw_settling,
        "distance from the attained position; dotted lines: the band is entered, full lines: the last time",
    ),
    PosingTime: (_draw_settling, "distance from the attained position, from departure to rest"),
    PathDeviation: (_draw_path_deviation, "distance of the mean run from the path (AT), and spread of the runs (RT)"),
    PathVelocity: (_draw_speeds, "speed of every run on the steady part of the path; the commanded one dashed"),
    CornerDeviation: (_draw_corner, "the runs about the corner, which is the origin; the commanded path dashed"),
    WeavingDeviation: (_draw_weave, "the runs; the commanded path dashed"),
    StaticCompliance: (_draw_compliance, "displacement under load along every axis, and the straight lines fitted"),
}
