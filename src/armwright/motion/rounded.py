"""Straight legs through poses whose corners are rounded, run without a stop and never slower than with stops.

Every corner is rounded by Paul's blend: where one leg is left and the next is met, the rates of position and of the
rotation vector go over from those of the one to those of the other by 3 h² - 2 h³, h from 0 to 1. So the path has a
continuous second derivative, stays in the triangle of its corner, bends there one way only, and is on the legs
themselves between the corners. It misses the pose by 3/16 of the half-width of the blend times the change of the rate,
so a bound of that bounds the width. The joints are solved along this path, which has no time yet; ``timing_law`` gives
it one.
"""

from functools import partial
from itertools import pairwise
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.errors import InvalidValueError
from armwright.motion.blends import MISS
from armwright.motion.chain import chain
from armwright.motion.efforts import slowing_for_efforts
from armwright.motion.follow import TURN_PER_METRE, Followed, PathError, check_ends, follow
from armwright.motion.follow_hand import Carried, carry_on
from armwright.motion.hand_path import hand_path
from armwright.motion.path import NEGLIGIBLE, Path, report_speed
from armwright.motion.solver import Solver, solver_of
from armwright.motion.timing_law import Timed, timed
from armwright.motion.trajectory import Trajectory, hold, join
from armwright.motion.trapezoid import shortest_trapezoid
from armwright.spatial.rotations import rotation_vector

# The joints keep the hand so many times nearer to the rounded path than to a single line: a line may be off by its
# deviation anywhere, a path with corners only at these.
_CLOSER = 50.0
# In the middle third of a leg the hand is no farther from it than this [m], and than this part of the corner.
_MIDDLE, _MIDDLE_PART = 5e-4, 0.1
# Poses nearer to the one before than this part of what a corner may miss are passed with it.
_TOGETHER = 0.0125
# Where a rounded corner meets what stops the arm, which the legs may not meet, it is made so much tighter, so often.
_TIGHTER, _TRIES = 8.0, 2
_HALVINGS = 40
# So that rounding does not carry what is just allowed beyond it.
_HAIR = 1e-9
# A blend needs some width before and after each pose; nothing is rounded at the ends.
_NO_BLEND = 1.0


@attrs.frozen(kw_only=True, eq=False)
class Rounded:
    """A run along straight legs with rounded corners.

    Attributes:
        trajectory: of the joints, at rest at both ends; position, speed and acceleration are continuous.
        deviation: upper bound of the distance of the hand from the straight legs [m].
        turn_deviation: the same of the angle from the orientations on them [rad].
        knots: number of poses that were solved.
        slowed: why it runs slower than asked, or empty.
        stops: whether it stops at every pose, because no run without a stop was as fast.
    """

    trajectory: Trajectory
    deviation: float
    turn_deviation: float
    knots: int
    slowed: str
    stops: bool = False

    @property
    def duration(self) -> float:
        """How long it takes [s]."""
        return self.trajectory.duration


class _Legs(NamedTuple):
    """Straight legs from pose to pose.

    Attributes:
        poses: (k, 4, 4).
        numbers: (k,) which of the poses that were given they are.
        lengths: (k - 1,) as ``Path.lengths`` counts them [m].
        speeds: (k - 1,) of the hand on them, by the report's rule [m/s].
        bend: (k - 2,) change of the rate of position at the corners, per length.
        twist: (k - 2,) change of the rate of the rotation vector, per length [rad/m].
    """

    poses: Array
    numbers: list[int]
    lengths: Array
    speeds: Array
    bend: Array
    twist: Array


def rounded_move(
    arm: Arm,
    path: Path,
    q_start: Array,
    *,
    deviation: float,
    speed: float,
    corner: float | None = None,
    blend: float | None = None,
) -> Rounded:
    """Plan a run straight from pose to pose that rounds its corners and rests only at both ends.

    The path and the joints on it depend on the poses, on ``corner`` or ``blend`` and on ``deviation``, the timing
    on ``speed`` and the limits as well. Position and orientation are rounded alike.

    Args:
        arm: the arm; its ``reach`` and ``tool_speed`` scale the speed.
        path: begins where the hand is at ``q_start``; equal poses one after the other count once.
        q_start: (n,) present joint positions.
        deviation: what a single line may be off [m]; here the joints keep the hand 50 times nearer to its path.
        speed: 1 to 120, 100 is normal.
        corner: how far the hand may be from the straight legs, and pass a pose, at most [m]; the orientation may be
            off by ``TURN_PER_METRE`` times as many radians. In the middle third of a leg it is within a tenth of
            that, and within 0.5 mm. Such a run is never slower than the legs one by one.
        blend: instead of it, how far from a pose its rounding may begin [m]; where a leg is short, at its middle. The
            efforts are kept as well then.

    Raises:
        PathError: the arm cannot follow it from where it stands, however tight the corners.
        InvalidValueError: a number is out of range.
    """
    for what, value in (("blend", blend), ("corner", corner), ("deviation", deviation)):
        if value is not None and not 0 < value < np.inf:
            raise InvalidValueError(f"{what}: expected more than 0 m, got {value:g}")
    together = NEGLIGIBLE if corner is None else max(min(_TOGETHER * corner, _MIDDLE / 2), NEGLIGIBLE)
    kept = _apart(path.poses, together)
    if Path(poses=path.poses[kept]).lengths().max() <= NEGLIGIBLE:
        return Rounded(trajectory=hold(q_start, 0.0), deviation=0.0, turn_deviation=0.0, knots=1, slowed="")
    check_ends(arm, path)
    legs, solver = _legs(arm, path, kept, speed), solver_of(arm)
    closer = min(deviation, deviation if corner is None else corner) / _CLOSER
    off = closer + (together if len(kept) < 1 + (path.lengths() > NEGLIGIBLE).sum() else 0.0)
    half = np.minimum(legs.lengths[:-1], legs.lengths[1:]) / 2
    widths = np.minimum(half, np.inf if blend is None else blend)
    if corner is not None:
        widths = _widths(legs, half, corner, off)
    stopping = partial(_with_stops, arm, path, legs, q_start, deviation=deviation, speed=speed)
    try:
        carried, run, widths = _tightened(solver, legs, widths, q_start, closer)
    except PathError:
        stopped = None if corner is None else stopping()
        if stopped is None:
            raise
        return stopped
    rounded = Rounded(
        trajectory=run.trajectory,
        deviation=off + float((MISS * widths * legs.bend).max(initial=0.0)),
        turn_deviation=TURN_PER_METRE * off + float((MISS * widths * legs.twist).max(initial=0.0)),
        knots=len(carried.trajectory.times),
        slowed="" if run.because is None else _slower(run.factor, *run.because),
    )
    if corner is None:
        return _inside_efforts(arm, rounded, run.factor)
    if rounded.duration <= _shortest_with_stops(solver, legs, q_start):
        return rounded
    stopped = stopping()
    return rounded if stopped is None or rounded.duration <= stopped.duration else stopped


def _apart(poses: Array, together: float) -> list[int]:
    """Return the numbers of poses of which none is as near as ``together`` to the one before; both ends among them."""

    def near(i: int, j: int) -> bool:
        return float(Path(poses=poses[[i, j]]).lengths()[0]) <= together

    kept, last = [0], len(poses) - 1
    for i in range(1, last):
        if not near(kept[-1], i):
            kept.append(i)
    while len(kept) > 1 and near(kept[-1], last):
        kept.pop()
    return [*kept, last]


def _legs(arm: Arm, path: Path, kept: list[int], speed: float) -> _Legs:
    X = path.poses[kept]
    lengths = Path(poses=X).lengths()
    R = X[:, :3, :3]
    rates = np.diff(X[:, :3, 3], axis=0) / lengths[:, None]
    turns = rotation_vector(np.swapaxes(R[:-1], -1, -2) @ R[1:]) / lengths[:, None]
    speeds = np.array([report_speed(arm, A[:3, 3], B[:3, 3], speed) for A, B in pairwise(X)])
    bend, twist = (np.linalg.norm(np.diff(each, axis=0), axis=-1) for each in (rates, turns))
    return _Legs(X, kept, lengths, speeds, bend, twist)


def _widths(legs: _Legs, half: Array, corner: float, off: float) -> Array:
    """Return the half-widths (k - 2,) of the widest blends that keep what is asked of corners and of middle thirds.

    Args:
        legs: the legs.
        half: (k - 2,) of the shorter leg at each corner.
        corner: how far the hand may be from the legs [m].
        off: which part of that is spent otherwise [m].
    """
    change = np.maximum(legs.bend, legs.twist / TURN_PER_METRE)
    with np.errstate(divide="ignore"):
        widths = np.minimum(half, (1 - _HAIR) * max(corner - off, corner / 2) / (MISS * change))
    # From the beginning of a blend of half-width r on, the path leaves its leg as u³ / 4 r² - u⁴ / 16 r³.
    allowed = min(_MIDDLE, _MIDDLE_PART * corner) / 2
    thirds = np.stack([legs.lengths[:-1], legs.lengths[1:]]) / 3
    low, high = np.minimum(widths, thirds.min(axis=0)), widths.copy()
    for _ in range(_HALVINGS):
        u = np.maximum(high - thirds, 0.0)
        far = (change * (u**3 / (4 * high**2) - u**4 / (16 * high**3))).max(axis=0) > allowed
        if not far.any():
            break
        high = np.where(far, (low + high) / 2, high)
    else:
        high = low
    return np.asarray(high)


def _tightened(
    solver: Solver, legs: _Legs, widths: Array, q_start: Array, closer: float
) -> tuple[Carried, Timed, Array]:
    """Return the joints along the rounded path, their run, and the widths of the corners that they can follow."""
    for attempt in range(_TRIES):
        tighter = widths / _TIGHTER**attempt
        try:
            return *_run(solver, legs, tighter, q_start, closer), tighter
        except PathError as error:
            last = error
    raise last


def _run(solver: Solver, legs: _Legs, widths: Array, q_start: Array, closer: float) -> tuple[Carried, Timed]:
    """Return the joints along the rounded path over the time at full speed, and their run."""
    top = float(legs.speeds.max())
    times = np.concatenate([[0.0], np.cumsum(legs.lengths)]) / top
    blends = np.concatenate([[_NO_BLEND], widths / top, [_NO_BLEND]])
    hand = hand_path(legs.poses, times, blends, ends="running", orientation="geodesic")
    try:
        carried = carry_on(solver, hand, times, q_start, deviation=closer, room=_CLOSER * closer)
    except PathError as error:
        segment = legs.numbers[error.segment + 1] - 1
        raise PathError(
            error.cause, segment, error.fraction, str(error), joint=error.joint, reason=error.reason
        ) from error
    caps = _caps(carried.trajectory.times, times, widths / top, legs.speeds / top)
    return carried, timed(solver.arm, carried.trajectory, caps)


def _caps(knots: Array, times: Array, widths: Array, speeds: Array) -> Array:
    """Return the largest part of full speed (m,) on each interval between knots: of its leg, and from leg to leg.

    It goes over from one leg's to the next's as the rates of the path do, so that no blend takes longer than its legs.
    """
    middles = (knots[1:] + knots[:-1]) / 2
    caps = np.full(len(middles), speeds[0])
    for at, width, change in zip(times[1:-1], widths, np.diff(speeds), strict=True):
        h = np.clip((middles - at + width) / (2 * width), 0.0, 1.0)
        caps += change * h**2 * (3 - 2 * h)
    return caps


def _inside_efforts(arm: Arm, rounded: Rounded, factor: float) -> Rounded:
    """Return a run slowed as much as the efforts ask for."""
    found = slowing_for_efforts(arm, rounded.trajectory)
    if found.joint is None:
        return rounded
    slowed = _slower(factor * found.factor, "effort", found.joint)
    return attrs.evolve(rounded, trajectory=rounded.trajectory.slowed(found.factor), slowed=slowed)


def _with_stops(arm: Arm, path: Path, legs: _Legs, q_start: Array, *, deviation: float, speed: float) -> Rounded | None:
    """Return the straight lines one by one, with a stop at every pose; None where they cannot be run."""
    lines: list[Followed] = []
    q = q_start
    for first, last in pairwise(legs.numbers):
        try:
            line = follow(arm, Path(poses=path.poses[[first, last]]), q, deviation=deviation, speed=speed)
        except PathError:
            return None
        lines.append(line)
        q = line.trajectory(line.trajectory.duration)
    return Rounded(
        trajectory=join([line.trajectory for line in lines]),
        deviation=max(line.deviation for line in lines),
        turn_deviation=max(line.turn_deviation for line in lines),
        knots=sum(line.knots for line in lines),
        slowed="with a stop at every frame: rounded corners would take longer, or the arm cannot follow them",
        stops=True,
    )


def _shortest_with_stops(solver: Solver, legs: _Legs, q_start: Array) -> float:
    """Return a time that no run with a stop at every pose is shorter than; 0 where it is not known."""
    limits = solver.arm.limit("speed"), solver.arm.limit("acceleration")
    q, missed = chain(solver, legs.poses, q_start)
    if missed is not None or not np.isfinite(limits[1]).all():
        return 0.0
    by_joints = [shortest_trapezoid(way, *limits) for way in np.diff(q, axis=0)]
    return float(np.maximum(legs.lengths / legs.speeds, by_joints).sum())


def _slower(factor: float, limit: str, joint: int) -> str:
    return f"{factor:.2f} times slower, for the {limit} of joint {joint + 1}"
