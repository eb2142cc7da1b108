"""The workspace of a five-bar, its singularities, and the transmission from its motors to its tip.

At a serial singularity an arm is stretched or folded, θ1 = θ2 + kπ or θ4 = θ3 + kπ: the tip cannot move along that arm.
These positions bound the workspace. At a parallel singularity the rods are in one line, θ2 = θ3 + kπ: the motors do not
hold the tip across them.
"""

from __future__ import annotations

import itertools
import math
from typing import Literal, NamedTuple, TypeAlias

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arrays import LARGEST, Array, ArrayLike, Flags, of_shape
from armwright.clearance.five_bar import MODES, FiveBar, elbow_positions
from armwright.clearance.plane_vectors import perpendicular
from armwright.errors import InvalidValueError

CurveKind: TypeAlias = Literal["serial", "parallel"]

# Points of a curve of singular positions.
_POINTS = 1440
# A point so near to a circle lies on it [m].
_ON_CIRCLE = 1e-9
# Rods so little bent are in one line: the sine of their angle.
_IN_LINE = 1e-12
# The largest number of cells along a side of the grid of the workspace.
_MAX_CELLS = 4000


class SingularCurve(NamedTuple):
    """A curve of positions at which a five-bar is singular.

    Attributes:
        kind: ``serial`` or ``parallel``.
        points: (k, 2) [m].
        modes: (k,) the assembly mode in which each is singular; the last may be of the next curve. Empty for a border
            of the workspace, which two modes share.
    """

    kind: CurveKind
    points: Array
    modes: npt.NDArray[np.str_]


@attrs.frozen(kw_only=True, eq=False)
class Workspace:
    """The workspace of the tip, on a grid.

    Attributes:
        x: (i,) columns of the grid [m].
        y: (j,) rows [m].
        distance: (j, i) to the border; below 0 outside [m].
    """

    x: Array
    y: Array
    distance: Array

    @property
    def reachable(self) -> Flags:
        """(j, i) whether the tip reaches the middle of a cell."""
        return np.asarray(self.distance >= 0)


def boundary_distance(bar: FiveBar, tip: ArrayLike) -> Array:
    """Return the distances of points from the border of the workspace.

    Args:
        bar: the five-bar.
        tip: (..., 2) points [m].

    Returns:
        (...) distances [m], below 0 for points out of reach; minus infinity for an empty workspace.
    """
    points = of_shape(tip, (2,), "tip", LARGEST)
    distances = np.array(_reach_margin(bar, points))
    outside = distances < 0
    if np.any(outside):
        distances[outside] = -_outside_distance(bar, points[outside])
    return distances


def workspace(bar: FiveBar, cells: int = 200) -> Workspace:
    """Return the workspace on a grid that holds all of it.

    Args:
        bar: the five-bar.
        cells: along the longer side of the grid.

    Raises:
        InvalidValueError: the arms never meet, or the cells are too many or too few.
    """
    if not 2 <= cells <= _MAX_CELLS:
        raise InvalidValueError(f"cells: expected 2 to {_MAX_CELLS}, got {cells}")
    low, high = (np.array([_extreme_point(bar, i, sign)[i] for i in range(2)]) for sign in (-1, 1))
    size = float((high - low).max()) / cells
    counts = np.maximum(2, np.ceil((high - low) / size - 1e-9).astype(int))
    x, y = (low[i] + (np.arange(counts[i]) + 0.5) * size for i in range(2))
    grid = np.stack(np.meshgrid(x, y), axis=-1)
    return Workspace(x=x, y=y, distance=boundary_distance(bar, grid))


def singularity_sines(angles: ArrayLike) -> Array:
    """Return the sines of the angles between links, which change their sign at a singularity.

    Args:
        angles: (..., 4) θ1 to θ4 [rad].

    Returns:
        (..., 3) at the left elbow sin(θ2 - θ1) and at the right elbow sin(θ3 - θ4), first and last: 0 at a serial
        singularity; between them sin(θ2 - θ3) at the tip: 0 at a parallel one.
    """
    return np.asarray(np.sin(_angles_between_links(angles)), dtype=np.float64)


def jacobian(bar: FiveBar, angles: ArrayLike) -> Array:
    """Return the Jacobian of the tip with respect to the cranks.

    Args:
        bar: the five-bar.
        angles: (..., 4) θ1 to θ4 [rad].

    Returns:
        (..., 2, 2) velocity of the tip by the speeds of the left and the right crank [m].

    Raises:
        InvalidValueError: the rods are in one line, a parallel singularity.
    """
    theta = of_shape(angles, (4,), "angles θ1 to θ4", LARGEST)
    between = _angles_between_links(theta)
    across = np.sin(between[..., 1])
    if np.any(np.abs(across) < _IN_LINE):
        index = np.argwhere(np.abs(across) < _IN_LINE)[0]
        row = f" {', '.join(map(str, index))}" if index.size else ""
        raise InvalidValueError(f"angles{row}: the rods are in one line, a parallel singularity: the tip is not held")
    # The motion of the tip by one crank is normal to the rod of the other arm, whose elbow is at rest.
    normals = np.stack([np.cos(theta[..., [2, 1]]), np.sin(theta[..., [2, 1]])], axis=-2)
    sines = np.stack([np.sin(between[..., 0]), -np.sin(between[..., 2])], axis=-1) * bar.cranks
    return np.asarray(normals * (sines / across[..., None])[..., None, :], dtype=np.float64)


def condition_number(bar: FiveBar, angles: ArrayLike) -> Array:
    """Return the condition number of the transmission from the motors to the tip.

    Args:
        bar: the five-bar.
        angles: (..., 4) θ1 to θ4 [rad].

    Returns:
        (...) the largest by the smallest speed of the tip for a speed of 1 of both motors together: 1 where the tip
        moves alike in all directions, infinite at a serial singularity.

    Raises:
        InvalidValueError: the rods are in one line, a parallel singularity.
    """
    gains = np.asarray(np.linalg.svd(jacobian(bar, angles), compute_uv=False), dtype=np.float64)
    with np.errstate(divide="ignore"):
        return np.asarray(gains[..., 0] / gains[..., 1], dtype=np.float64)


def singular_curves(bar: FiveBar) -> list[SingularCurve]:
    """Return the curves of positions of the tip at which the five-bar is singular.

    Serial ones are the borders of the reach of each arm, as far as the other arm reaches them. Parallel ones are inside
    the workspace; which of them a motion passes depends on its assembly mode.
    """
    angles = np.linspace(0, 2 * math.pi, _POINTS + 1)
    corners = np.array(_reach_corners(bar)).reshape(-1, 2)
    curves: list[SingularCurve] = []
    for motor, reaches in zip(bar.motors, bar.reaches, strict=True):
        # Where circles of both arms intersect, one border ends and another begins.
        ends = np.arctan2(*(corners - motor).T[::-1]) % (2 * math.pi)
        for reach in reaches[reaches > 0]:
            circle = _circle_points(motor, reach, np.sort(np.concatenate([angles, ends])))
            curves += _split_curve("serial", circle, _is_reachable(bar, circle), np.full(len(circle), ""))
    lines = [float(bar.rods.sum())]
    if bar.rods[0] == bar.rods[1]:
        # Equal rods fold where the elbows coincide, and then rotate about them.
        for elbow in _circle_intersections(bar.motors, float(bar.cranks[0]), float(bar.cranks[1])):
            circle = _circle_points(elbow, bar.rods[0], angles)
            ends = np.broadcast_to(elbow, circle.shape)
            curves += _split_curve(
                "parallel", circle, np.full(len(circle), True), _assembly_modes(bar, circle, ends, ends)
            )
    else:
        lines.append(float(bar.rods[0] - bar.rods[1]))
    for length in lines:
        for branch in (-1.0, 1.0):
            curves += _parallel_curves(bar, angles, length, branch)
    return curves


# ---- inside --------------------------------------------------------------------------------------------------------


def _circle_points(centre: Array, radius: float, angles: Array) -> Array:
    return centre + radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1)


def _angles_between_links(angles: ArrayLike) -> Array:
    """Return (..., 3) angles between links: left elbow θ2 - θ1, tip θ2 - θ3, right elbow θ3 - θ4."""
    theta = of_shape(angles, (4,), "angles θ1 to θ4", LARGEST)
    return np.asarray(theta[..., [1, 1, 2]] - theta[..., [0, 2, 3]], dtype=np.float64)


def _reach_margin(bar: FiveBar, points: Array) -> Array:
    """Return (...) the distance of points (..., 2) from the nearest circle of a reach, below 0 out of reach [m]."""
    distances = np.linalg.norm(points[..., None, :] - bar.motors, axis=-1)
    margins = np.concatenate([distances - bar.reaches[:, 0], bar.reaches[:, 1] - distances], axis=-1)
    return np.asarray(margins.min(axis=-1), dtype=np.float64)


def _is_reachable(bar: FiveBar, points: Array) -> Flags:
    """Return (...) whether points (..., 2) are in reach, or on its border but for rounding."""
    return np.asarray(_reach_margin(bar, points) >= -_ON_CIRCLE)


def _reach_corners(bar: FiveBar) -> list[Array]:
    """Return the intersections of circles of both arms that both arms reach."""
    points = [
        point
        for radii in itertools.product(*bar.reaches.tolist())
        for point in _circle_intersections(bar.motors, *radii)
    ]
    return [point for point in points if _is_reachable(bar, point)]


def _outside_distance(bar: FiveBar, points: Array) -> Array:
    """Return the distances of points (k, 2) out of reach from the nearest in reach: on a circle, or in a corner."""
    best = np.full(len(points), np.inf)
    for motor, reaches in zip(bar.motors, bar.reaches, strict=True):
        away = points - motor
        size = np.linalg.norm(away, axis=-1, keepdims=True)
        # From a motor its entire circle is equally near; if a part of it is out of reach, its corners are as near.
        outward = np.where(size > 0, away / np.where(size > 0, size, 1.0), [0.0, -1.0])
        for reach in reaches:
            near = motor + reach * outward
            nearer = np.minimum(best, np.linalg.norm(points - near, axis=-1))
            best = np.where(_is_reachable(bar, near), nearer, best)
    for corner in _reach_corners(bar):
        best = np.minimum(best, np.linalg.norm(points - corner, axis=-1))
    return best


def _extreme_point(bar: FiveBar, axis: int, sign: int) -> Array:
    """Return the point in reach that is farthest along an axis, in its positive or negative direction."""
    direction = sign * np.eye(2)[axis]
    circles = [
        motor + reach * direction for motor, reaches in zip(bar.motors, bar.reaches, strict=True) for reach in reaches
    ]
    points = [point for point in circles if _is_reachable(bar, point)] + _reach_corners(bar)
    if not points:
        near, far = bar.reaches.T
        raise InvalidValueError(
            f"five-bar: its arms never meet: they reach {near[0] * 1e3:g} to {far[0] * 1e3:g} mm and "
            f"{near[1] * 1e3:g} to {far[1] * 1e3:g} mm from motors {2e3 * bar.half_width:g} mm apart"
        )
    return np.asarray(points[int(np.argmax(np.stack(points) @ direction))])


def _circle_intersections(centres: Array, radius_a: float, radius_b: float) -> list[Array]:
    """Return the intersections of two circles, of centres (2, 2) and radii: two points, one, or none."""
    a, b = centres
    distance = float(np.linalg.norm(b - a))
    if distance == 0:
        return []
    along = (radius_a**2 - radius_b**2 + distance**2) / (2 * distance)
    square = radius_a**2 - along**2
    if square < -1e-15:
        return []
    unit = (b - a) / distance
    foot, across = a + along * unit, math.sqrt(max(square, 0.0)) * np.array([-unit[1], unit[0]])
    return [foot + across, foot - across] if square > 0 else [foot]


def _assembly_modes(bar: FiveBar, tips: Array, left: Array, right: Array) -> npt.NDArray[np.str_]:
    """Return (k,) the assembly modes for positions of tip and elbows."""
    signs = []
    for motor, elbow in zip(bar.motors, (left, right), strict=True):
        crank, rod = elbow - motor, tips - elbow
        signs.append(np.sign(crank[..., 0] * rod[..., 1] - crank[..., 1] * rod[..., 0]))
    names = np.full(len(tips), "", dtype="U5")
    for mode, (left_sign, right_sign) in MODES.items():
        names[(signs[0] == left_sign) & (signs[1] == right_sign)] = mode
    return names


def _parallel_curves(bar: FiveBar, angles: Array, length: float, branch: float) -> list[SingularCurve]:
    """Return the curves on which the rods are in one line.

    Args:
        bar: the five-bar.
        angles: (k,) of the left crank to evaluate [rad].
        length: from the left elbow along the left rod to the right elbow [m]; below 0 beyond the left elbow.
        branch: -1 or 1, which of both angles of the right crank.
    """
    # Where both branches coincide, the right arm from left elbow to right motor is stretched or folded.
    ends = [
        point - bar.motors[0]
        for reach in (abs(length) + bar.cranks[1], abs(abs(length) - bar.cranks[1]))
        for point in _circle_intersections(bar.motors, float(bar.cranks[0]), float(reach))
    ]
    angles = np.sort(np.concatenate([angles, [math.atan2(x, -y) % (2 * math.pi) for x, y in ends]]))
    left = elbow_positions(bar, np.stack([angles, angles], axis=-1))[:, 0]
    base = bar.motors[1] - left
    distance = np.linalg.norm(base, axis=-1)
    divisor = np.where(distance > 0, distance, 1.0)
    along = (length**2 - bar.cranks[1] ** 2 + distance**2) / (2 * divisor)
    square = length**2 - along**2
    valid = (square >= -_ON_CIRCLE) & (distance > 0)
    unit = base / divisor[:, None]
    across = np.sqrt(np.maximum(square, 0.0))[:, None] * perpendicular(unit)
    right = left + along[:, None] * unit + branch * across
    tips = left + (right - left) * (bar.rods[0] / length)
    return _split_curve("parallel", tips, valid, _assembly_modes(bar, tips, left, right))


def _split_curve(kind: CurveKind, points: Array, valid: Flags, modes: npt.NDArray[np.str_]) -> list[SingularCurve]:
    """Split a row of points at invalid ones, and at changes of the mode, where the next curve continues."""
    cuts = np.flatnonzero((valid[1:] != valid[:-1]) | (modes[1:] != modes[:-1])) + 1
    curves = []
    for row in np.split(np.arange(len(points)), cuts):
        last = int(row[-1])
        if valid[last]:
            numbers = np.append(row, last + 1) if last + 1 < len(points) and valid[last + 1] else row
            if len(numbers) > 1:
                curves.append(SingularCurve(kind, points[numbers], modes[numbers]))
    return curves
