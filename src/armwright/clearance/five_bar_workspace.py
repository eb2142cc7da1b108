"""Where the tip of a five-bar can go, where it is singular on the way, and how well its motors move it there.

A serial singularity is where an arm is stretched or folded, θ1 = θ2 + kπ or θ4 = θ3 + kπ: the tip cannot move along
that arm. These places bound the workspace. A parallel singularity is where the rods are in one line, θ2 = θ3 + kπ: the
motors do not hold the tip across them.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple, TypeAlias

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arrays import Array, ArrayLike, Flags, floats
from armwright.clearance.five_bar import MODES, FiveBar, elbows, places_of
from armwright.errors import InvalidValueError, ShapeError

CurveKind: TypeAlias = Literal["serial", "parallel"]

# Points of a curve of singular places.
_POINTS = 1440
# A place so near to a circle lies on it [m].
_ON = 1e-9
# Rods so little bent are in one line: the sine of their angle.
_IN_LINE = 1e-12
# The workspace is mapped on so many cells along each side at most.
_MOST_CELLS = 4000


class Singularity(NamedTuple):
    """How near a configuration is to being singular; numbers change their sign when it passes one.

    Attributes:
        serial: (..., 2) sin(θ2 - θ1) and sin(θ3 - θ4), of the left and the right elbow.
        parallel: (...) sin(θ2 - θ3), of the pin that joins the rods.
        elbow_angles: (..., 2) by how much each elbow has to turn until its arm is stretched or folded [rad].
        tip_angle: (...) by how much the rods have to turn against one another until they are in one line [rad].
    """

    serial: Array
    parallel: Array
    elbow_angles: Array
    tip_angle: Array


class Transmission(NamedTuple):
    """How well the motors move the tip.

    Attributes:
        gains: (..., 2) the largest and the smallest speed of the tip for a speed of 1 of both motors together [m/rad].
        condition: (...) their ratio: 1 where the tip moves alike in all directions, infinite at a singularity.
        angles: (..., 3) transmission angles, at left elbow, tip and right elbow: between their two links, 0 to π/2
            [rad]; near 0 little force comes through.
    """

    gains: Array
    condition: Array
    angles: Array


class Curve(NamedTuple):
    """Places at which a five-bar is singular.

    Attributes:
        kind: ``serial`` or ``parallel``.
        places: (k, 2) [m].
        modes: (k,) the assembly mode in which each is singular; the last may be of the next curve. Empty where it is a
            border of the workspace, which two modes share.
    """

    kind: CurveKind
    places: Array
    modes: npt.NDArray[np.str_]


@attrs.frozen(kw_only=True, eq=False)
class Workspace:
    """Where the tip can go, on a grid.

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

    @property
    def area(self) -> float:
        """Of the cells that are reached [m²]."""
        return float(self.reachable.sum() * (self.x[1] - self.x[0]) * (self.y[1] - self.y[0]))


def boundary_distance(bar: FiveBar, tip: ArrayLike) -> Array:
    """Return how far places are from the border of the workspace.

    Args:
        bar: the five-bar.
        tip: (..., 2) places [m].

    Returns:
        (...) distances [m], below 0 for places out of reach; minus infinity where nothing can be reached at all.
    """
    places = places_of(tip, "tip")
    inside = _slack(bar, places).min(axis=-1)
    flat, found = places.reshape(-1, 2), inside.reshape(-1).copy()
    outside = found < 0
    if np.any(outside):
        found[outside] = -_from_outside(bar, flat[outside])
    return np.asarray(found.reshape(inside.shape), dtype=np.float64)


def workspace(bar: FiveBar, cells: int = 200) -> Workspace:
    """Return the workspace on a grid that holds all of it.

    Args:
        bar: the five-bar.
        cells: along the longer side of the grid.

    Raises:
        InvalidValueError: the arms never meet, or the cells are too many or too few.
    """
    if not 2 <= cells <= _MOST_CELLS:
        raise InvalidValueError(f"cells: expected 2 to {_MOST_CELLS}, got {cells}")
    corners = np.stack([_most(bar, way) for way in ((-1, 0), (0, -1), (1, 0), (0, 1))])
    low, high = np.array([corners[0, 0], corners[1, 1]]), np.array([corners[2, 0], corners[3, 1]])
    size = float((high - low).max()) / cells
    counts = np.maximum(2, np.ceil((high - low) / size - 1e-9).astype(int))
    x, y = (low[i] + (np.arange(counts[i]) + 0.5) * size for i in range(2))
    grid = np.stack(np.meshgrid(x, y), axis=-1)
    return Workspace(x=x, y=y, distance=boundary_distance(bar, grid))


def singularity(angles: ArrayLike) -> Singularity:
    """Return how near configurations are to being singular, for angles (..., 4) θ1 to θ4 [rad]."""
    turns = _turns(angles)
    sines, rest = np.sin(turns), np.abs(np.remainder(turns + math.pi / 2, math.pi) - math.pi / 2)
    return Singularity(sines[..., [0, 2]], sines[..., 1], rest[..., [0, 2]], rest[..., 1])


def jacobian(bar: FiveBar, angles: ArrayLike) -> Array:
    """Return how the tip moves with the cranks.

    Args:
        bar: the five-bar.
        angles: (..., 4) θ1 to θ4 [rad].

    Returns:
        (..., 2, 2) velocity of the tip by the speeds of the left and the right crank [m].

    Raises:
        InvalidValueError: the rods are in one line, a parallel singularity.
    """
    turns, theta = _turns(angles), floats(angles, "angles")
    across = np.sin(turns[..., 1])
    if np.any(np.abs(across) < _IN_LINE):
        place = np.argwhere(np.abs(across) < _IN_LINE)[0]
        where = f" {', '.join(map(str, place))}" if place.size else ""
        raise InvalidValueError(f"angles{where}: the rods are in one line, a parallel singularity: the tip is not held")
    # What one crank gives to the tip goes across the other rod, which stands still.
    ways = np.stack([np.cos(theta[..., [2, 1]]), np.sin(theta[..., [2, 1]])], axis=-2)
    sines = np.stack([np.sin(turns[..., 0]), -np.sin(turns[..., 2])], axis=-1) * bar.cranks
    return np.asarray(ways * (sines / across[..., None])[..., None, :], dtype=np.float64)


def transmission(bar: FiveBar, angles: ArrayLike) -> Transmission:
    """Return how well the motors move the tip, for angles (..., 4) θ1 to θ4 [rad].

    Raises:
        InvalidValueError: the rods are in one line, a parallel singularity.
    """
    gains = np.asarray(np.linalg.svd(jacobian(bar, angles), compute_uv=False), dtype=np.float64)
    with np.errstate(divide="ignore"):
        condition = gains[..., 0] / gains[..., 1]
    rest = np.abs(np.remainder(_turns(angles) + math.pi / 2, math.pi) - math.pi / 2)
    return Transmission(gains, condition, rest)


def singular_curves(bar: FiveBar) -> list[Curve]:
    """Return the places at which the tip is when the five-bar is singular.

    Serial ones are the borders of what each arm reaches, as far as the other arm reaches them. Parallel ones lie inside
    of the workspace; which of them a motion meets depends on its assembly mode.
    """
    turn = np.linspace(0, 2 * math.pi, _POINTS + 1)
    ways = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    corners = np.array(_corners(bar)).reshape(-1, 2)
    curves: list[Curve] = []
    for motor, reaches in zip(bar.motors, bar.reaches, strict=True):
        # Where circles of both arms meet, one border ends and another begins.
        ends = np.arctan2(*(corners - motor).T[::-1]) % (2 * math.pi)
        angles = np.sort(np.concatenate([turn, ends]))
        for reach in reaches[reaches > 0]:
            ring = motor + reach * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
            curves += _pieces("serial", ring, _slack(bar, ring).min(axis=-1) >= -_ON, np.full(len(ring), ""))
    same = bar.rods[0] == bar.rods[1]
    if same:
        # Equal rods fold where the elbows fall together, and then go round them.
        for elbow in _meeting(bar.motors, float(bar.cranks[0]), float(bar.cranks[1])):
            ring = elbow + bar.rods[0] * ways
            where = np.broadcast_to(elbow, (len(ring), 2))
            curves += _pieces("parallel", ring, np.full(len(ring), True), _modes(bar, ring, where, where))
    lines = [float(bar.rods.sum())] if same else [float(bar.rods.sum()), float(bar.rods[0] - bar.rods[1])]
    for apart in lines:
        for branch in (-1.0, 1.0):
            curves += _in_line(bar, turn, apart, branch)
    return curves


# ---- inside --------------------------------------------------------------------------------------------------------


def _turns(angles: ArrayLike) -> Array:
    """Return (..., 3) angles between links: left elbow θ2 - θ1, tip θ2 - θ3, right elbow θ3 - θ4."""
    theta = floats(angles, "angles")
    if theta.ndim == 0 or theta.shape[-1] != 4:
        raise ShapeError(f"angles: expected four on the last axis, θ1 to θ4, got shape {theta.shape}")
    return np.asarray(theta[..., [1, 1, 2]] - theta[..., [0, 2, 3]], dtype=np.float64)


def _slack(bar: FiveBar, places: Array) -> Array:
    """Return (..., 4) how far places are inside of the four circles that bound the workspace [m]."""
    distances = np.linalg.norm(places[..., None, :] - bar.motors, axis=-1)
    return np.concatenate([distances - bar.reaches[:, 0], bar.reaches[:, 1] - distances], axis=-1)


def _corners(bar: FiveBar) -> list[Array]:
    """Return the places in which circles of both arms meet and both arms reach."""
    found = [
        place
        for left in bar.reaches[0]
        for right in bar.reaches[1]
        for place in _meeting(bar.motors, float(left), float(right))
    ]
    return [place for place in found if _slack(bar, place).min() >= -_ON]


def _from_outside(bar: FiveBar, places: Array) -> Array:
    """Return how far places (k, 2) out of reach are from the nearest in reach: on a circle, or in a corner."""
    best = np.full(len(places), np.inf)
    for motor, reaches in zip(bar.motors, bar.reaches, strict=True):
        away = places - motor
        size = np.linalg.norm(away, axis=-1, keepdims=True)
        # From a motor all of its circle is equally near; if not all can be reached, its corners are as near.
        way = np.where(size > 0, away / np.where(size > 0, size, 1.0), [0.0, -1.0])
        for reach in reaches:
            near = motor + reach * way
            good = _slack(bar, near).min(axis=-1) >= -_ON
            best = np.where(good, np.minimum(best, np.linalg.norm(places - near, axis=-1)), best)
    for corner in _corners(bar):
        best = np.minimum(best, np.linalg.norm(places - corner, axis=-1))
    return best


def _most(bar: FiveBar, way: tuple[int, int]) -> Array:
    """Return the place in reach that is farthest in one of the directions of the axes."""
    circles = [
        motor + reach * np.array(way)
        for motor, reaches in zip(bar.motors, bar.reaches, strict=True)
        for reach in reaches
    ]
    found: list[Array] = [place for place in circles if _slack(bar, place).min() >= -_ON] + _corners(bar)
    if not found:
        near, far = bar.reaches.T
        raise InvalidValueError(
            f"five-bar: its arms never meet: they reach {near[0] * 1e3:g} to {far[0] * 1e3:g} mm and "
            f"{near[1] * 1e3:g} to {far[1] * 1e3:g} mm from motors {2e3 * bar.half_width:g} mm apart"
        )
    return found[int(np.argmax(np.stack(found) @ np.array(way)))]


def _meeting(centres: Array, of_a: float, of_b: float) -> list[Array]:
    """Return where two circles meet, of centres (2, 2) and radii: two places, one, or none."""
    a, b = centres
    apart = float(np.linalg.norm(b - a))
    if apart == 0:
        return []
    along = (of_a**2 - of_b**2 + apart**2) / (2 * apart)
    square = of_a**2 - along**2
    if square < -1e-15:
        return []
    way = (b - a) / apart
    foot, across = a + along * way, math.sqrt(max(square, 0.0)) * np.array([-way[1], way[0]])
    return [foot + across, foot - across] if square > 0 else [foot]


def _modes(bar: FiveBar, tips: Array, left: Array, right: Array) -> npt.NDArray[np.str_]:
    """Return (k,) the assembly modes of places of tip and elbows."""
    signs = []
    for motor, elbow in zip(bar.motors, (left, right), strict=True):
        crank, rod = elbow - motor, tips - elbow
        signs.append(np.sign(crank[..., 0] * rod[..., 1] - crank[..., 1] * rod[..., 0]))
    names = np.full(len(tips), "", dtype="U5")
    for mode, (one, other) in MODES.items():
        names[(signs[0] == one) & (signs[1] == other)] = mode
    return names


def _in_line(bar: FiveBar, turn: Array, apart: float, branch: float) -> list[Curve]:
    """Return the curves on which the rods are in one line.

    Args:
        bar: the five-bar.
        turn: (k,) angles of the left crank to try [rad].
        apart: from the left elbow along the left rod to the right elbow [m]; below 0 beyond the left elbow.
        branch: -1 or 1, which of both angles of the right crank.
    """
    # Where both branches meet, the right arm from left elbow to right motor is stretched or folded.
    ends = [
        place - bar.motors[0]
        for reach in (abs(apart) + bar.cranks[1], abs(abs(apart) - bar.cranks[1]))
        for place in _meeting(bar.motors, float(bar.cranks[0]), float(reach))
    ]
    turn = np.sort(np.concatenate([turn, [math.atan2(x, -y) % (2 * math.pi) for x, y in ends]]))
    left = elbows(bar, np.stack([turn, turn], axis=-1))[:, 0]
    way = bar.motors[1] - left
    distance = np.linalg.norm(way, axis=-1)
    safe = np.where(distance > 0, distance, 1.0)
    along = (apart**2 - bar.cranks[1] ** 2 + distance**2) / (2 * safe)
    square = apart**2 - along**2
    good = (square >= -_ON) & (distance > 0)
    unit = way / safe[:, None]
    across = np.sqrt(np.maximum(square, 0.0))[:, None] * np.stack([-unit[:, 1], unit[:, 0]], axis=-1)
    right = left + along[:, None] * unit + branch * across
    tips = left + (right - left) * (bar.rods[0] / apart)
    return _pieces("parallel", tips, good, _modes(bar, tips, left, right))


def _pieces(kind: CurveKind, places: Array, good: Flags, modes: npt.NDArray[np.str_]) -> list[Curve]:
    """Cut a row of places where some are no good, or their mode changes; there the curve goes on in the next mode."""
    cuts = np.flatnonzero((good[1:] != good[:-1]) | (modes[1:] != modes[:-1])) + 1
    found = []
    for row in np.split(np.arange(len(places)), cuts):
        last = int(row[-1])
        if good[last]:
            on = np.append(row, last + 1) if last + 1 < len(places) and good[last + 1] else row
            if len(on) > 1:
                found.append(Curve(kind, places[on], modes[on]))
    return found
