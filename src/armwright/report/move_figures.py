"""Figures of a move: joints and tool over time, and the path of the tool in space with its approach vectors."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from armwright.arrays import Array
from armwright.motion.tool_path import zyz_angles
from armwright.motion.trajectory import Samples
from armwright.report.figures import empty_figure, evenly_spaced, plain_label, set_equal_scales, svg_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_STYLES = ("-", "--", "-.", ":", (0, (5, 1)), (0, (1, 1)))
# Approach vectors along a path, and their length relative to its extent.
_ARROWS, _ARROW_LENGTH = 26, 0.16


class Panel(NamedTuple):
    """Curves over a common axis.

    Attributes:
        title: the quantity; may be empty.
        unit: unit of the curves.
        lines: (m,) values by the name of the curve.
    """

    title: str
    unit: str
    lines: Mapping[str, Array]


def panels(
    title: str, t: Array, shown: Sequence[Panel], *, marks: Mapping[str, float] | None = None, columns: int = 1
) -> str:
    """Draw panels of curves over time, stacked.

    Args:
        title: title of the figure.
        t: (m,) times [s].
        shown: the panels, from the top, column by column.
        marks: times by the names that are printed above the panels, such as those of poses [s].
        columns: number of columns.

    Returns:
        An SVG file's text.
    """
    rows = -(-len(shown) // columns)
    figure = empty_figure((6.8 * columns, 1.1 + 2.1 * rows))
    grid = figure.subplots(rows, columns, sharex=True, squeeze=False)
    for axis, panel in zip(grid.T.flat, shown, strict=False):
        draw_curves(axis, t, panel)
        for time in (marks or {}).values():
            axis.axvline(time, color="0.6", linewidth=0.7, linestyle=":", zorder=0)
    for axis in grid[0]:
        for name, time in (marks or {}).items():
            # Above the title of the panel.
            above = {"xytext": (0, 17), "textcoords": "offset points", "ha": "center", "va": "bottom", "color": "0.4"}
            axis.annotate(plain_label(name), (time, 1), xycoords=("data", "axes fraction"), **above)
    for axis in grid[-1]:
        axis.set_xlabel("time, s")
    return svg_text(figure, title)


def path_figure(title: str, X: Array, marks: Mapping[str, Array]) -> str:
    """Draw the path of the tool with its approach vectors.

    Args:
        title: title of the figure.
        X: (m, 4, 4) poses along the path.
        marks: (3,) positions to mark, by name [m].

    Returns:
        An SVG file's text.
    """
    figure = empty_figure((6.4, 5.6))
    draw_path(figure.add_subplot(projection="3d"), X, marks)
    return svg_text(figure, title)


def overview(title: str, t: Array, time_panels: Sequence[Panel], X: Array, marks: Mapping[str, Array]) -> str:
    """Draw three panels over time and the path in space in a square.

    Args:
        title: title of the figure.
        t: (m,) times [s].
        time_panels: three panels: left above, right above, left below.
        X: (k, 4, 4) poses along the path, drawn right below.
        marks: (3,) positions to mark, by name [m].

    Returns:
        An SVG file's text.
    """
    figure = empty_figure((10.4, 7.6))
    for index, panel in enumerate(time_panels):
        axis = figure.add_subplot(2, 2, index + 1)
        draw_curves(axis, t, panel)
        axis.set_xlabel("time, s")
    draw_path(figure.add_subplot(2, 2, 4, projection="3d"), X, marks)
    return svg_text(figure, title)


def joint_panels(samples: Samples, revolute: Sequence[bool]) -> list[Panel]:
    """Return panels of positions, speeds and accelerations of joints, in degrees or cm."""
    names = [f"joint {i + 1}" for i in range(len(revolute))]
    scale = np.where(revolute, 180 / np.pi, 100.0)
    unit = "deg" if all(revolute) else "cm" if not any(revolute) else "deg, cm"
    quantities = {"position": ("", samples.q), "speed": ("/s", samples.qd), "acceleration": ("/s²", samples.qdd)}
    return [
        Panel(name, unit + per, dict(zip(names, (values * scale).T, strict=True)))
        for name, (per, values) in quantities.items()
    ]


def tool_panels(t: Array, X: Array) -> list[Panel]:
    """Return panels of position and ZYZ angles of the tool (m, 4, 4), and of their differences in time."""
    positions = X[:, :3, 3] * 100
    angles = np.degrees(zyz_angles(X[:, :3, :3]))
    result = []
    for unit, names, values in (("cm", "xyz", positions), ("deg", ("phi", "theta", "psi"), angles)):
        rate = _time_derivative(values, t)
        quantity = "position" if unit == "cm" else "ZYZ angles"
        for title, per, curve in (
            (quantity, "", values),
            (f"speed of the {quantity}", "/s", rate),
            (f"acceleration of the {quantity}", "/s²", _time_derivative(rate, t)),
        ):
            result.append(Panel(title, unit + per, dict(zip(names, curve.T, strict=True))))
    return result


def _time_derivative(values: Array, t: Array) -> Array:
    """Return the rates of values (m, k) by differences of second order where there are enough samples."""
    if len(t) < 2:
        return np.zeros_like(values)
    return np.asarray(np.gradient(values, t, axis=0, edge_order=2 if len(t) > 2 else 1))


def draw_curves(axis: "Axes", t: Array, panel: Panel) -> None:
    """Draw the curves of a panel."""
    for (name, values), style in zip(panel.lines.items(), _STYLES * 4, strict=False):
        axis.plot(t, values, linestyle=style, label=plain_label(name), linewidth=1.4)
    axis.set(ylabel=panel.unit, xlim=(float(t[0]), float(t[-1])))
    axis.set_title(plain_label(panel.title), loc="left", fontsize="medium")
    axis.grid(visible=True, alpha=0.3)
    axis.legend(loc="center left", bbox_to_anchor=(1.005, 0.5), fontsize="small", frameon=False)


def draw_path(axis: Any, X: Array, marks: Mapping[str, Array]) -> None:
    """Draw a path in space with its approach vectors."""
    p = X[:, :3, 3] * 100
    some = evenly_spaced(len(X), _ARROWS)
    extent = float(np.ptp(p, axis=0).max()) or 1.0
    a = X[some, :3, 2] * _ARROW_LENGTH * extent
    axis.plot(*p.T, linewidth=2.0, color="C0")
    axis.quiver(*p[some].T, *a.T, color="C1", linewidth=1.0, arrow_length_ratio=0.25)
    for name, position in marks.items():
        x, y, z = position * 100
        axis.plot([x], [y], [z], "o", color="C3", markersize=5)
        axis.text(x, y, z, f"  {plain_label(name)}", color="C3")
    tips = p[some] + a
    low, high = np.minimum(p.min(axis=0), tips.min(axis=0)), np.maximum(p.max(axis=0), tips.max(axis=0))
    set_equal_scales(axis, low, high, least=1e-3)
    axis.set(xlabel="x, cm", ylabel="y, cm", zlabel="z, cm")
