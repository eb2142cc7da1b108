"""Drawings of mode shapes that swing between their extremes: at rest, dotted, and both ends of the swing, thin."""

import html
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from armwright.arrays import Array
from armwright.report.figures import Drawing

# Width of a drawing, its margin, and the largest displacement, as a part of the size of what is drawn.
_WIDTH, _MARGIN, _SWING = 400.0, 14.0, 0.09
# A swing to and fro takes this long [s], however fast the mode is; its ease is nearly that of a sine.
_SECONDS, _EASE = 1.6, "0.37 0 0.63 1"
# Colours as of Matplotlib, which pages exchange for theirs.
_COLOUR, _GREY = "#1f77b4", "#808080"


class MovingLine(NamedTuple):
    """A line of a figure that a mode moves.

    Attributes:
        points: (k, 2) at rest, y upwards.
        shift: (k, 2) displacements by the mode, in any scale common to all lines.
        ring: whether it is a single point, drawn as a ring.
    """

    points: Array
    shift: Array
    ring: bool = False


def mode_drawing(name: str, caption: str, lines: Sequence[MovingLine]) -> Drawing:
    """Draw a mode shape that swings; where nothing may move, on paper for one, its extremes stand still.

    Args:
        name: name of its file without the suffix.
        caption: its caption.
        lines: of the figure.
    """
    points = np.concatenate([line.points for line in lines])
    shifts = np.concatenate([line.shift for line in lines])
    extent = float(np.ptp(points, axis=0).max())
    gain = _SWING * extent / max(float(np.linalg.norm(shifts, axis=-1).max()), np.finfo(float).tiny)
    both = np.concatenate([points + gain * shifts, points - gain * shifts])
    low, high = both.min(axis=0), both.max(axis=0)
    scale = (_WIDTH - 2 * _MARGIN) / max(float((high - low).max()), np.finfo(float).tiny)
    width, height = (high - low) * scale + 2 * _MARGIN

    def on_paper(positions: Array) -> Array:
        return np.stack([positions[:, 0] - low[0], high[1] - positions[:, 1]], axis=-1) * scale + _MARGIN

    parts: list[str] = []
    ghost, swinging = f"stroke: {_COLOUR}; stroke-width: 1; opacity: .4", f"stroke: {_COLOUR}; stroke-width: 3"
    for line in lines:
        ends = [on_paper(line.points + sign * gain * line.shift) for sign in (-1.0, 1.0)]
        parts.append(_shape(on_paper(line.points), line, f"stroke: {_GREY}; stroke-dasharray: 2 4; stroke-width: 1.4"))
        if np.abs(ends[1] - ends[0]).max() > 0:
            parts += [_shape(end, line, ghost) for end in ends]
            parts.append(_shape(ends[1], line, swinging, (ends[0], ends[1])))
        else:
            parts.append(_shape(ends[0], line, swinging))
    body = "\n".join(parts)
    text = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.1f} {height:.1f}">\n'
        f"<title>{html.escape(caption)}</title>\n{body}\n</svg>\n"
    )
    return Drawing(name, caption, text)


def _shape(points: Array, line: MovingLine, style: str, swing: tuple[Array, Array] | None = None) -> str:
    """Return a line as an element, which swings between two positions if they are given."""
    name = ' class="swinging"' if swing is not None else ""
    look = f'fill="none" style="{style}"{name}'
    if not line.ring:
        moving = _animation("points", swing, _text) if swing is not None else ""
        return f'<polyline points="{_text(points)}" {look}>{moving}</polyline>'
    (x, y), moving = points[0], ""
    if swing is not None:
        moving = "".join(_animation(key, swing, _coordinate(axis)) for axis, key in enumerate(("cx", "cy")))
    return f'<circle cx="{x:.2f}" cy="{y:.2f}" r="6" {look}>{moving}</circle>'


def _animation(attribute: str, swing: tuple[Array, Array], text: Callable[[Array], str]) -> str:
    first, second = map(text, swing)
    return (
        f'<animate attributeName="{attribute}" values="{first};{second};{first}" dur="{_SECONDS}s" '
        f'repeatCount="indefinite" calcMode="spline" keyTimes="0;0.5;1" keySplines="{_EASE};{_EASE}"/>'
    )


def _coordinate(axis: int) -> Callable[[Array], str]:
    return lambda points: f"{points[0, axis]:.2f}"


def _text(points: Array) -> str:
    return " ".join(f"{x:.2f},{y:.2f}" for x, y in points)
