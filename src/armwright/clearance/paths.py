"""Paths in the plane for a tip to follow: piecewise polynomials in time whose acceleration may jump between pieces.

Source:
    Thesis, 4.2 (24 test paths) and 5.2.2 (pick and place); spec of the clearance, 1.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import attrs
import numpy as np

from armwright.arrays import LARGEST, Array, ArrayLike, exact_shape, floats
from armwright.errors import InvalidValueError, ShapeError, one_of

# The thesis' test paths: where they run [m], how fast [m/s], and how long they speed up [s].
TOP_SPEED = 1.5
RAMP = 0.05
_X_ROWS = (-0.7, -0.65, -0.6, -0.55, -0.5)
_Y_COLUMNS = (-0.15, -0.1, -0.05, 0.0, 0.05, 0.1, 0.15)


# Times that differ by less than this part of a step are equal.
ROUNDING = 1e-9


class PathState(NamedTuple):
    """Positions, velocities and accelerations of a path.

    Attributes:
        position: (..., 2) [m].
        velocity: (..., 2) [m/s].
        acceleration: (..., 2) [m/s²].
    """

    position: Array
    velocity: Array
    acceleration: Array


# The name of the thesis' path of section 5.2.2.
PICK_AND_PLACE = "pick-and-place"


def _nodes(value: ArrayLike) -> Array:
    return exact_shape(value, (3, 2), "nodes", LARGEST)


@attrs.frozen(kw_only=True, eq=False)
class Path:
    """A path in the plane.

    Attributes:
        name: of the path.
        knots: (m + 1,) times at which its pieces begin and end, the first 0 [s].
        pieces: (m, a, k) of each piece and axis the coefficients, of 1, t, t² ... with t from the start of the piece.
        targets: times at which the tip is to be at its goals [s].
        follower: what follows it: the ``tip`` in the plane, or the ``drives``, one axis for each.
    """

    name: str
    knots: Array
    pieces: Array
    targets: tuple[float, ...] = ()
    follower: Literal["tip", "drives"] = "tip"

    @property
    def duration(self) -> float:
        """How long it takes [s]."""
        return float(self.knots[-1])

    def evaluate(self, t: ArrayLike, piece: ArrayLike | None = None) -> PathState:
        """Return positions, velocities and accelerations.

        Args:
            t: times [s], any shape; one before the start or after the end counts as that.
            piece: the number of the piece to take at each; by the time, at a knot the later one, when left out.
        """
        times = np.clip(floats(t, "t"), 0.0, self.duration)
        number = np.searchsorted(self.knots, times, side="right") - 1 if piece is None else np.asarray(piece)
        number = np.clip(number, 0, len(self.pieces) - 1)
        u = (times - self.knots[number])[..., None]
        derivatives = []
        coefficients = self.pieces[number]
        for _ in range(3):
            value = np.zeros((*times.shape, self.pieces.shape[1]))
            for i in range(coefficients.shape[-1] - 1, -1, -1):
                value = value * u + coefficients[..., i]
            derivatives.append(value)
            coefficients = coefficients[..., 1:] * np.arange(1, coefficients.shape[-1])
        return PathState(*derivatives)

    def halves(self, steps: int) -> tuple[PathState, PathState]:
        """Return the path at the ends and middles of equal steps.

        Where the acceleration jumps at one of these times there are two: an integrator sees no jump that falls on the
        end of a step, only one within.

        Args:
            steps: how many there are.

        Returns:
            The path at 2 steps + 1 times, as it goes on from there, and as it came there.
        """
        times = np.linspace(0.0, self.duration, 2 * steps + 1)
        rounding = ROUNDING * self.duration / steps
        after = np.searchsorted(self.knots, times + rounding, side="right") - 1
        before = np.searchsorted(self.knots, times - rounding, side="right") - 1
        return self.evaluate(times, after), self.evaluate(times, before)


def constant_speed_path(name: str, start: float, speed: float, duration: float) -> Path:
    """Return the path of one drive at constant speed.

    Args:
        name: of the path.
        start: [rad] or [m].
        speed: [rad/s] or [m/s].
        duration: [s].
    """
    if not duration > 0:
        raise InvalidValueError(f"path {name}: expected a duration above 0, got {duration:g} s")
    pieces = np.array([[[start, speed]]])
    return Path(name=name, knots=np.array([0.0, duration]), pieces=pieces, follower="drives")


def straight_path(
    name: str, start: ArrayLike, goal: ArrayLike, *, speed: float = TOP_SPEED, ramp: float = RAMP
) -> Path:
    """Return a straight path with a trapezoid of speed.

    Args:
        name: of the path.
        start: (2,) [m].
        goal: (2,) [m].
        speed: its top [m/s].
        ramp: how long it speeds up, and slows down [s].

    Raises:
        InvalidValueError: it is too short for that speed, or has no length.
    """
    a, b = (exact_shape(end, (2,), what, LARGEST) for end, what in ((start, "start"), (goal, "goal")))
    length = float(np.linalg.norm(b - a))
    if not (speed > 0 and ramp > 0):
        raise InvalidValueError(f"path {name}: speed and ramp must be above 0, got {speed:g} m/s and {ramp:g} s")
    cruise = length / speed - ramp
    if length == 0 or cruise < -1e-12:
        raise InvalidValueError(
            f"path {name}: {length * 1e3:g} mm are too short to reach {speed:g} m/s in {ramp:g} s; "
            f"at least {speed * ramp * 1e3:g} mm are needed"
        )
    direction, pull = (b - a) / length, speed / ramp
    s = [(0.0, 0.0, pull / 2), (speed * ramp / 2, speed, 0.0), (length - speed * ramp / 2, speed, -pull / 2)]
    knots = np.array([0.0, ramp, ramp + max(cruise, 0.0), 2 * ramp + max(cruise, 0.0)])
    # Where the length just suffices, rounding may leave a tiny piece of constant speed.
    keep = np.diff(knots) > 1e-12
    pieces = np.array([direction[:, None] * np.array(coefficients) for coefficients in s])
    pieces[..., 0] += a
    return Path(
        name=name, knots=np.append(knots[:-1][keep], knots[-1]), pieces=pieces[keep], targets=(float(knots[-1]),)
    )


def hermite_path(
    name: str, times: Sequence[float], positions: ArrayLike, velocities: ArrayLike, targets: Sequence[int]
) -> Path:
    """Return a path of cubic pieces through positions with specified velocities.

    Args:
        name: of the path.
        times: (m + 1) of the positions, the first 0, increasing [s].
        positions: (m + 1, 2) [m].
        velocities: (m + 1, 2) [m/s].
        targets: indices of the positions that are goals.

    Raises:
        ShapeError: the arrays do not fit together.
        InvalidValueError: the times do not increase from 0.
    """
    t, p, v = floats(times, "times"), floats(positions, "positions"), floats(velocities, "velocities")
    if t.ndim != 1 or len(t) < 2 or p.shape != (len(t), 2) or v.shape != p.shape:
        raise ShapeError(
            f"path {name}: expected (m + 1) times and (m + 1, 2) positions and velocities, "
            f"got {t.shape}, {p.shape} and {v.shape}"
        )
    if t[0] != 0 or np.any(np.diff(t) <= 0):
        raise InvalidValueError(f"path {name}: times must increase from 0, got {t.tolist()}")
    T = np.diff(t)[:, None]
    step = p[1:] - p[:-1]
    square = (3 * step / T - 2 * v[:-1] - v[1:]) / T
    cube = (v[:-1] + v[1:] - 2 * step / T) / T**2
    return Path(
        name=name,
        knots=t,
        pieces=np.stack([p[:-1], v[:-1], square, cube], axis=-1),
        targets=tuple(t[list(targets)].tolist()),
    )


@attrs.frozen(kw_only=True, eq=False)
class PickAndPlace:
    """A pick-and-place path: up, over, down; its goals are its first, middle and last node.

    Between its five nodes it is cubic. It leaves the first and comes to the last vertically, ``lift`` above them within
    ``lift_time``.

    Attributes:
        nodes: (3, 2) first, middle and last node [m].
        rise_time: from above the first to the middle [s].
        fall_time: from the middle to above the last [s].
        lift_time: over the first and the last [s].
        lift_speed: vertical, there [m/s].
        speed: horizontal, in the middle [m/s].

    Source:
        Thesis table 5.9. It leaves open how the path runs between nodes and ends: here the end mirrors the
        start (spec of the clearance, 1.2).
    """

    nodes: Array = attrs.field(converter=_nodes, default=((-0.18, -0.6), (0.0, -0.575), (0.18, -0.6)))
    rise_time: float = 0.2
    fall_time: float = 0.2
    lift_time: float = 0.05
    lift_speed: float = 0.3
    speed: float = 1.5

    def path(self) -> Path:
        """Return it as a path with three targets."""
        first, middle, last = self.nodes
        lift = np.array([0.0, self.lift_speed * self.lift_time / 2])
        positions = [first, first + lift, middle, last + lift, last]
        velocities = [(0, 0), (0, self.lift_speed), (self.speed, 0), (0, -self.lift_speed), (0, 0)]
        times: list[float] = np.cumsum([0.0, self.lift_time, self.rise_time, self.fall_time, self.lift_time]).tolist()
        return hermite_path(PICK_AND_PLACE, times, positions, velocities, (0, 2, 4))


def thesis_path(name: str) -> Path:
    """Return one of the thesis' 24 test paths, ``x1`` to ``x10`` or ``y1`` to ``y14``.

    Raises:
        UnknownNameError: there is none of that name.
    """
    return straight_path(name, *TEST_PATHS[one_of("test path", name, TEST_PATHS)])


def named_path(name: str) -> Path:
    """Return a path by its name: one of the thesis' 24, or ``pick-and-place``.

    Raises:
        UnknownNameError: there is none of that name.
    """
    if name == PICK_AND_PLACE:
        return PickAndPlace().path()
    return thesis_path(one_of("path", name, (*TEST_PATHS, PICK_AND_PLACE)))


def _test_paths() -> dict[str, tuple[tuple[float, float], tuple[float, float]]]:
    rows = [((-0.18, y), (0.18, y)) for y in _X_ROWS] + [((0.18, y), (-0.18, y)) for y in _X_ROWS]
    columns = [((x, -0.7), (x, -0.4)) for x in _Y_COLUMNS] + [((x, -0.4), (x, -0.7)) for x in _Y_COLUMNS]
    return {f"{axis}{i}": ends for axis, lines in (("x", rows), ("y", columns)) for i, ends in enumerate(lines, 1)}


TEST_PATHS = _test_paths()
