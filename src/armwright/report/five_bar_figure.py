"""The workspace of a five-bar with its singularities, and the conditioning of its transmission."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from armwright.arrays import Array
from armwright.clearance.five_bar import MODES, FiveBar, Mode, elbow_positions, inverse, inverse_all
from armwright.clearance.five_bar_parts import five_bar_coordinates
from armwright.clearance.five_bar_workspace import (
    Workspace,
    condition_number,
    singular_curves,
    singularity_sines,
    workspace,
)
from armwright.clearance.ideal import tip_position
from armwright.clearance.scenario import Scenario
from armwright.errors import InvalidValueError, one_of
from armwright.report.figures import Drawing, empty_figure, svg_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Sine of the angle between rods below which they are aligned, and have no condition number.
_ALIGNED = 1e-9
# Difference of equal angles at most [rad], and points of a path that are drawn.
_EQUAL_ANGLES, _MAX_POINTS = 1e-6, 200
# Cells of the map along its longer side.
_MAP_CELLS = 260


def workspace_figure(bar: FiveBar, mode: Mode = "out", paths: Sequence[Array] = ()) -> Drawing:
    """Return the workspace with its singularities, in an assembly mode.

    Args:
        bar: the five-bar.
        mode: assembly mode of its elbows.
        paths: (k, 2) positions of paths to draw [m]; the arm is drawn at the start of the first.

    Raises:
        UnknownNameError: the mode is unknown.
        InvalidValueError: the rods cannot meet, or a path starts out of reach.
    """
    one_of("assembly mode", mode, MODES)
    figure = empty_figure((7.4, 6.6))
    axis = figure.subplots()
    space = workspace(bar, _MAP_CELLS)
    edges = [np.append(x, 2 * x[-1] - x[-2]) - (x[1] - x[0]) / 2 for x in (space.x * 1e3, space.y * 1e3)]
    gains = _inverse_condition_numbers(bar, space, mode)
    colours = axis.pcolormesh(*edges, gains, cmap="YlGnBu", vmin=0, vmax=1, rasterized=True, zorder=0)
    figure.colorbar(colours, ax=axis, label="smallest gain of the motors by the largest", shrink=0.8)
    _draw_curves(axis, bar, mode)
    for path in paths:
        axis.plot(*(path * 1e3).T, color="C1", linewidth=2.2, zorder=4)
    start = paths[0][0] if paths else _innermost_position(space)
    _draw_arm(axis, bar, inverse(bar, start, mode), start)
    axis.set(xlabel="x, mm", ylabel="y, mm", title=f"elbows {mode}")
    axis.set_aspect("equal")
    axis.margins(0.03)
    figure.legend(*axis.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    caption = (
        f"Workspace with elbows {mode}: borders and serial singularities; parallel singularities of this mode "
        f"and of the others; colour: how evenly the motors move the tip"
    )
    return Drawing("workspace", caption, svg_text(figure))


def scenario_workspace(scenario: Scenario) -> Drawing | None:
    """Return the workspace of the five-bar of a scenario, with its path; None for another linkage."""
    try:
        bar = FiveBar.of(scenario.linkage)
    except InvalidValueError:
        return None
    tips = tip_position(scenario.linkage, scenario.ideal.q)
    for mode, angles in inverse_all(bar, tips[0]).items():
        differences = five_bar_coordinates(scenario.linkage, angles) - scenario.ideal.q[0]
        if np.abs(np.sin(differences / 2)).max() < _EQUAL_ANGLES:
            return workspace_figure(bar, mode, [tips[:: max(1, len(tips) // _MAX_POINTS)]])
    raise AssertionError("a five-bar has four assembly modes")


def _inverse_condition_numbers(bar: FiveBar, space: Workspace, mode: Mode) -> Array:
    """Return the reciprocal condition number of the transmission, (j, i); NaN out of reach."""
    evenness = np.full(space.distance.shape, np.nan)
    inside = space.distance > 0
    positions = np.stack(np.meshgrid(space.x, space.y), axis=-1)[inside]
    angles = inverse(bar, positions, mode)
    values = np.zeros(len(positions))
    bent = np.abs(singularity_sines(angles)[:, 1]) > _ALIGNED
    values[bent] = 1.0 / condition_number(bar, angles[bent])
    evenness[inside] = values
    return evenness


def _draw_curves(axis: "Axes", bar: FiveBar, mode: Mode) -> None:
    styles: dict[str, dict[str, Any]] = {
        "serial singularity": {"color": "k", "linewidth": 1.6},
        "parallel singularity": {"color": "C3", "linewidth": 1.8},
        "in another mode": {"color": "C3", "linewidth": 0.8, "linestyle": ":"},
    }
    labelled: set[str] = set()
    for curve in singular_curves(bar):
        own = "parallel singularity" if curve.modes[0] == mode else "in another mode"
        label = "serial singularity" if curve.kind == "serial" else own
        axis.plot(*(curve.points * 1e3).T, **styles[label], label=None if label in labelled else label)
        labelled.add(label)


def _draw_arm(axis: "Axes", bar: FiveBar, angles: Array, tip: Array) -> None:
    elbow_0, elbow_1 = elbow_positions(bar, angles[[0, 3]]) * 1e3
    points = np.stack([bar.motors[0] * 1e3, elbow_0, np.asarray(tip) * 1e3, elbow_1, bar.motors[1] * 1e3])
    axis.plot(*points.T, "-", color="0.25", linewidth=3.2, solid_capstyle="round", zorder=5)
    axis.plot(*points.T, "o", color="w", markeredgecolor="0.25", markersize=6, zorder=6)


def _innermost_position(space: Workspace) -> Array:
    """Return the position farthest from the border, below the motors if the workspace extends there."""
    j, i = np.unravel_index(int(space.distance[: max(1, len(space.y) // 2)].argmax()), space.distance.shape)
    return np.array([space.x[i], space.y[j]])
