"""A view of bodies as the pages draw it, for the pictures of a film: shaded triangles, the far ones first."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from armwright.arrays import Array
from armwright.report.animation import Animation
from armwright.report.body_poses import frame_poses, placed_bodies
from armwright.report.triangles import triangles_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# As on the pages: where the camera is, how far it sees, and the light about it (right, up, away), from above its left.
_AZIMUTH, _ELEVATION, _FOCAL = -0.95, 0.4, 1.9
_LIGHT = (-0.45, 0.55, -0.75)
# The part of the picture that is filled, along both sides.
_FILLED = (0.86, 0.8)
_COLOURS = {"base": "#959fab", "link": "#aeb9c6", "fixture": "#d8d2c4"}
_ARMS = ("#e08a2e", "#2f93a6", "#8f7cc0", "#84943f")
_PARTS = ("#2a67c9", "#cf5b12", "#1e8a5a", "#a03fb0", "#8a6d00", "#c22f55", "#0c8599", "#5c6470")
_SKY, _FLOOR, _SHADOW, _PATH, _MARK = "#fbfcfd", "#d4dae2", "#dfe3e8", "#1f5fae", "#cf3a30"
# Lines of the floor along the view, and how large triangles are at most, by the size of the view: smaller ones are
# sorted better by how far away they are.
_LINES, _LARGEST = 9, 0.12
# Halvings of a triangle at most: a hall stays a few triangles.
_HALVINGS = 8


class _Solid(NamedTuple):
    """A body of the view: triangles (k, 3, 3) and normals (k, 3) in its own frame, its poses, its colour as shares."""

    corners: Array
    normals: Array
    poses: Array
    colour: Array


class FilmView:
    """The view of an animation, in the axes of a figure that measure pixels."""

    def __init__(self, animation: Animation, axes: Axes, size: tuple[int, int], marks: Array) -> None:
        """Take what is shown.

        Args:
            animation: the bodies over time.
            axes: to draw in.
            size: width and height of the picture [px].
            marks: (k, 3) points that are marked [m].
        """
        from matplotlib.collections import LineCollection, PolyCollection  # noqa: PLC0415 - takes half a second

        self._solids, tips, size_of_all = _solids(animation)
        self._middle, self._half = size_of_all
        self._floor = min(0.0, float(self._middle[2] - self._half[2]))
        self._frame(size)
        axes.set(xlim=(0, size[0]), ylim=(0, size[1]), facecolor=_SKY)
        axes.set_axis_off()
        self._shadows = PolyCollection([], facecolors=_SHADOW, edgecolors=_SHADOW, linewidths=0.3)
        self._bodies = PolyCollection([], linewidths=0.3)
        floor = LineCollection(self._floor_lines(), colors=_FLOOR, linewidths=0.8)
        for order, collection in enumerate((floor, self._shadows, self._bodies)):
            collection.set_zorder(order)
            axes.add_collection(collection)
        above: dict[str, Any] = {"zorder": 3}
        self._trails = [axes.plot([], [], color=_PATH, linewidth=1.8, alpha=0.85, **above)[0] for _ in tips]
        self._tips = [self._seen(tip)[0] for tip in tips]
        axes.plot(*self._seen(marks)[0].T, "o", color=_MARK, markersize=4.5, **above)

    def show(self, i: int) -> None:
        """Draw the instant of a number."""
        corners, colours = [], []
        for solid in self._solids:
            X = solid.poses[min(i, len(solid.poses) - 1)]
            corners.append(solid.corners @ X[:3, :3].T + X[:3, 3])
            normals = solid.normals @ np.linalg.inv(X[:3, :3])
            bright = normals @ self._light / np.maximum(np.linalg.norm(normals, axis=1), 1e-12)
            colours.append(_shaded(solid.colour, np.clip(0.38 + 0.55 * bright, 0.0, 1.0)))
        world = np.concatenate(corners)
        flat = world.copy()
        flat[..., 2] = self._floor
        self._shadows.set_verts(list(self._seen(flat)[0]))
        places, depths = self._seen(world)
        a, b, c = np.moveaxis(places, 1, 0)
        turn = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
        near = np.flatnonzero(turn > 0)
        near = near[np.argsort(-depths[near].mean(axis=1))]
        colour = np.concatenate(colours)[near]
        self._bodies.set_verts(list(places[near]))
        self._bodies.set(facecolors=colour, edgecolors=colour)
        for trail, places in zip(self._trails, self._tips, strict=True):
            trail.set_data(*places[: i + 1].T)

    def _frame(self, size: tuple[int, int]) -> None:
        """Aim the camera at the middle, from so far away that everything is in the picture."""
        sa, ca, se, ce = (f(x) for x in (_AZIMUTH, _ELEVATION) for f in (math.sin, math.cos))
        forward, right = np.array([-ce * ca, -ce * sa, -se]), np.array([-sa, ca, 0.0])
        self._axes = np.array([right, np.cross(right, forward), forward])
        light = np.array([0.0, 0.0, 0.5]) + np.array(_LIGHT) @ self._axes
        self._light = light / np.linalg.norm(light)
        self._size, self._shift = np.array(size, dtype=float), np.zeros(2)
        self._distance = 3 * float(np.linalg.norm(self._half)) or 1.0
        signs = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T
        for _ in range(8):
            seen, _ = self._seen(self._middle + signs * self._half)
            low, high = seen.min(axis=0), seen.max(axis=0)
            self._shift += (low + high - self._size) / 2
            self._distance *= float(((high - low) / (self._size * _FILLED)).max())

    def _seen(self, points: Array) -> tuple[Array, Array]:
        """Return the places (..., 2) of points (..., 3) in the picture [px], and how far away they are (...) [m]."""
        seen = (points - self._middle) @ self._axes.T
        depth = np.maximum(seen[..., 2] + self._distance, 0.02 * self._distance)
        scale = _FOCAL * self._size.min() / depth
        return self._size / 2 - self._shift + seen[..., :2] * scale[..., None], depth

    def _floor_lines(self) -> list[Array]:
        """Return the lines of a grid on the floor, each (2, 2) in the picture."""
        step = 10.0 ** math.floor(math.log10(2 * self._half.max() / _LINES))
        step *= next(k for k in (1, 2, 5, 10) if k * step * _LINES >= 2 * self._half.max())
        low, high = (np.floor((self._middle + side * 1.3 * self._half)[:2] / step) + (side > 0) for side in (-1, 1))
        xs, ys = (np.arange(a, b + 1) * step for a, b in zip(low, high, strict=True))
        ends = [((x, ys[0]), (x, ys[-1])) for x in xs] + [((xs[0], y), (xs[-1], y)) for y in ys]
        points = np.array([[(*end, self._floor) for end in line] for line in ends])
        return list(self._seen(points)[0])


def _solids(animation: Animation) -> tuple[list[_Solid], list[Array], tuple[Array, Array]]:
    """Return the bodies of a view, the paths (M, 3) of the tools, and the middle and half the size of it all."""
    meshes = [triangles_of(shape) for shape in animation.shapes]
    bodies = list(placed_bodies(animation))
    extents = []
    for body in bodies:
        vertices = meshes[body.shape][0]
        box = np.array([vertices.min(axis=0), vertices.max(axis=0)]).astype(float)
        corners = np.array(np.meshgrid(*box.T)).reshape(3, -1).T
        extents.append(corners @ np.swapaxes(body.poses[:, :3, :3], 1, 2) + body.poses[:, None, :3, 3])
    points = np.concatenate([extent.reshape(-1, 3) for extent in extents])
    low, high = points.min(axis=0), points.max(axis=0)
    largest = _LARGEST * float((high - low).max())
    solids = [
        _Solid(corners, normals, body.poses, np.array(_channels(_colour(body.tint, body.whose))))
        for body in bodies
        for corners, normals in [_halved(*meshes[body.shape], largest)]
    ]
    tips = [frame_poses(figure)[-1][:, :3, 3] for figure in animation.arms.values()]
    return solids, tips, ((low + high) / 2, (high - low) / 2)


def _halved(vertices: Any, normals: Any, faces: npt.NDArray[Any], largest: float) -> tuple[Array, Array]:
    """Return triangles (k, 3, 3) and their normals (k, 3), those with a longer side halved again and again."""
    corners, normal = vertices[faces].astype(float), normals[faces].mean(axis=1).astype(float)
    for _ in range(_HALVINGS):
        sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        longest = sides.argmax(axis=1)
        large = sides.max(axis=1) > largest
        if not large.any():
            break
        rows = np.flatnonzero(large)
        a, b, c = (corners[rows, (longest[rows] + k) % 3] for k in range(3))
        middle = (a + b) / 2
        halves = [np.stack(half, axis=1) for half in ((a, middle, c), (middle, b, c))]
        corners = np.concatenate([corners[~large], *halves])
        normal = np.concatenate([normal[~large], normal[rows], normal[rows]])
    return corners, normal


def _colour(tint: str, whose: int) -> str:
    if tint == "part":
        return _PARTS[whose % len(_PARTS)]
    return _ARMS[whose % len(_ARMS)] if tint == "joint" else _COLOURS[tint]


def _channels(colour: str) -> list[float]:
    return [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]


def _shaded(colour: Array, bright: Array) -> Array:
    """Return a colour (3,) in the light (k,), (k, 3): darker where there is little, whiter where there is much."""
    dark = colour * (0.42 + 0.58 * np.minimum(bright / 0.62, 1.0))[:, None]
    white = np.maximum(bright - 0.62, 0.0)[:, None] * 0.9
    return np.asarray(dark + (1.0 - dark) * white)
