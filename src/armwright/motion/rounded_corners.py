"""Straight legs through poses whose corners are rounded, run without a stop and never slower than with stops.

Every corner is rounded by Paul's blend: where one leg is left and the next is met, the rates of position and of the
rotation vector go over from those of the one to those of the other by 3 h² - 2 h³, h from 0 to 1. So the path has a
continuous second derivative, stays in the triangle of its corner, bends there in one direction only, and is on the legs
themselves between the corners. It misses the pose by 3/16 of the half-width of the blend times the change of the rate,
so a bound of that bounds the width. The joints are solved along this path, which has no time yet; ``timing_law`` gives
it one.
"""

from __future__ import annotations

import contextlib
from functools import cache, partial
from itertools import pairwise
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.errors import IncapableArmError, InvalidValueError
from armwright.motion.blends import MISS
from armwright.motion.certificate import Certificate
from armwright.motion.certified_motion import CertifiedMotion, certificate_of, joined, standstill
from armwright.motion.chain import chain
from armwright.motion.deviation import farthest_from_legs
from armwright.motion.efforts import slowing_for_efforts
from armwright.motion.limited import limited_positions
from armwright.motion.obstruction import MAX_SLOWDOWN, PathError, check_ends
from armwright.motion.path import NEGLIGIBLE, Path, report_speed
from armwright.motion.solver import AnyArm, solver_of
from armwright.motion.straight import COARSE, coarse_line, limited_time
from armwright.motion.timing_law import TimedPath, timed
from armwright.motion.tolerance import ROTATION_PER_METRE, Tolerance, tolerance
from armwright.motion.tool_limits import ToolLimits
from armwright.motion.tool_path import tool_path
from armwright.motion.tracking import Task, Tracking, track
from armwright.motion.trapezoidal_profile import shortest_trapezoid
from armwright.spatial.rotations import rotation_vector

# The joints keep the tool so many times nearer to the rounded path than to a single line: a line may deviate by its
# deviation anywhere, a path with corners only at these.
_CLOSER = 50.0
# Nearer than this they are kept only where the corners ask for it [m]: no encoder reports so little.
_NEAREST = 1e-7
# In the middle third of a leg the tool is no farther from it than this [m], and than this part of the corner.
_MIDDLE, _MIDDLE_PART = 5e-4, 0.1
# Poses nearer to the one before than this part of what a corner may miss are passed with it.
_TOGETHER = 0.0125
# Where a rounded corner meets what stops the arm, which the legs may not meet, it is made so much tighter, so often.
_TIGHTER, _TRIES = 8.0, 2
_HALVINGS = 40
_WITH_STOPS = "with a stop at every frame: {}"
# Knots to begin with: so far apart [s], and so many in each blend and on each leg.
_STEP, _MIN_KNOTS = 0.1, 8
# So that rounding does not carry what is just allowed beyond it.
_ROUNDING = 1e-9
# A blend needs some width before and after each pose; nothing is rounded at the ends.
_NO_BLEND = 1.0


@attrs.frozen(kw_only=True, eq=False)
class RoundedMotion:
    """A run along straight legs with rounded corners.

    Attributes:
        motion: of the joints, at rest at both ends; position, speed and acceleration are continuous. Its certificate
            bounds how far the tool is from the straight legs, and from the orientations on them.
        stops: why it stops at every pose, where no run without a stop was as fast; else empty.
        stopped_by: what keeps the arm from following rounded corners, where it stops at every pose for that.
    """

    motion: CertifiedMotion
    stops: str = ""
    stopped_by: PathError | None = None


class _Legs(NamedTuple):
    """Straight legs from pose to pose.

    Attributes:
        poses: (k, 4, 4).
        numbers: (k,) which of the poses that were given they are.
        lengths: (k - 1,) as ``Path.lengths`` counts them [m].
        speeds: (k - 1,) of the tool on them, by the report's rule [m/s].
        bend: (k - 2,) change of the rate of position at the corners, per length.
        twist: (k - 2,) change of the rate of the rotation vector, per length [rad/m].
    """

    poses: Array
    numbers: list[int]
    lengths: Array
    speeds: Array
    bend: Array
    twist: Array

    @property
    def times(self) -> Array:
        """When the poses are passed at the largest of the speeds (k,) [s]."""
        return np.asarray(np.concatenate([[0.0], np.cumsum(self.lengths)]) / self.speeds.max())


class _Task(NamedTuple):
    """What is to be planned.

    Attributes:
        arm: the arm, or a compiled one.
        path: as it was given.
        legs: the straight legs of it.
        widths: (k - 2,) half-widths of the blends at the corners [m].
        q_start: (n,) present joint positions.
        deviation: of a single line [m].
        speed: 1 to 120.
        tool: further limits of the tool; None for none.
        closer: how near the joints keep the tool to its rounded path [m].
        off: how far the path may be off besides what the corners ask for [m].
        allowed: how far the tool may be from the straight legs; of a blend, what follows from its width.
    """

    arm: AnyArm
    path: Path
    legs: _Legs
    widths: Array
    q_start: Array
    deviation: float
    speed: float
    tool: ToolLimits | None
    closer: float
    off: float
    allowed: Tolerance


def rounded_move(
    arm: AnyArm,
    path: Path,
    q_start: Array,
    *,
    deviation: float,
    speed: float,
    corner: float | None = None,
    blend: float | Array | None = None,
    tool: ToolLimits | None = None,
) -> RoundedMotion:
    """Plan a run straight from pose to pose that rounds its corners and rests only at both ends.

    The path and the joints on it depend on the poses, on ``corner`` or ``blend`` and on ``deviation``, the timing
    on ``speed`` and the limits as well. Position and orientation are rounded alike.

    Args:
        arm: the arm, or a compiled one; its reach and the speed of its tool scale the speed.
        path: begins where the tool is at ``q_start``; equal poses one after the other count once.
        q_start: (n,) present joint positions.
        deviation: what a single line may be off [m]; here the joints keep the tool 50 times nearer to its path. No
            more than ``COARSE`` is used.
        speed: 1 to 120, 100 is normal.
        corner: how far the tool may be from the straight legs, and pass a pose, at most [m]; the orientation may be
            off by ``ROTATION_PER_METRE`` times as many radians. In the middle third of a leg it is within a tenth of
            that, and within 0.5 mm. Such a run is never slower than the legs one by one.
        blend: instead of it, how far from a pose its rounding may begin [m], one number or one for each pose between
            the ends; where a leg is short, at its middle.
        tool: as for ``certified_line``.

    Returns:
        The run. It is slowed for the limits of the efforts where that helps, with ``corner`` no further than the legs
        one by one take.

    Raises:
        PathError: the arm cannot follow it from where it stands, however tight the corners.
        InvalidValueError: a number is out of range.
    """
    for what, value in (("blend", blend), ("corner", corner), ("deviation", deviation)):
        if value is not None and not ((np.asarray(value) > 0) & (np.asarray(value) < np.inf)).all():
            raise InvalidValueError(f"{what}: expected more than 0 m, got {np.min(value):g}")
    solver = solver_of(arm)
    together = NEGLIGIBLE if corner is None else max(min(_TOGETHER * corner, _MIDDLE / 2), NEGLIGIBLE)
    corners = _apart(path.poses, together)
    if Path(poses=path.poses[corners]).lengths().max() <= NEGLIGIBLE:
        return RoundedMotion(motion=standstill(solver, q_start, tolerance(deviation if corner is None else corner)))
    check_ends(solver, path, q_start)
    deviation = min(deviation, COARSE[-1])
    legs = _legs(solver.arm, path, corners, speed, tool)
    allowed = deviation if corner is None else corner
    closer = max(min(deviation, allowed), min(_CLOSER * _NEAREST, allowed)) / _CLOSER
    line_deviation = closer + (together if len(corners) < 1 + (path.lengths() > NEGLIGIBLE).sum() else 0.0)
    half = np.minimum(legs.lengths[:-1], legs.lengths[1:]) / 2
    of_each = np.broadcast_to(np.inf if blend is None else blend, len(path.poses) - 2)
    widths = np.minimum(half, of_each[np.array(corners[1:-1], dtype=np.intp) - 1])
    if corner is not None:
        widths = _blend_widths(legs, half, corner, line_deviation)
    miss, twist = (float((MISS * widths * change).max(initial=0.0)) for change in (legs.bend, legs.twist))
    bound = Tolerance(line_deviation + miss, ROTATION_PER_METRE * line_deviation + twist)
    if corner is not None:
        bound = tolerance(corner)
    task = _Task(arm, path, legs, widths, q_start, deviation, speed, tool, closer, line_deviation, bound)
    return _without_stop(task) if corner is None else _never_slower(task)


def _without_stop(task: _Task) -> RoundedMotion:
    """Return the run past the corners."""
    motion, _ = _tightened(task, MAX_SLOWDOWN)
    return RoundedMotion(motion=_inside_efforts(task, motion))


def _never_slower(task: _Task) -> RoundedMotion:
    """Return the run past the corners, or that with stops where it is faster or the only one.

    Beside a singularity a joint may be too fast: the timing slows the tool there, no further than stops would.
    """
    with_stops = cache(partial(_with_stops, task))  # worked out where it matters
    try:
        motion, ratio = _tightened(task, np.inf)
    except PathError as error:
        if (stopping := with_stops()) is None:
            raise
        stops = _WITH_STOPS.format("the arm cannot follow rounded corners")
        return RoundedMotion(motion=stopping, stops=stops, stopped_by=error)
    if ratio > MAX_SLOWDOWN and with_stops() is None:
        return _without_stop(task)
    # Where weight alone is too much for a motor the legs with stops fare no better.
    with contextlib.suppress(IncapableArmError):
        motion = _inside_efforts(task, motion)
    duration = motion.trajectory.duration
    stopping = with_stops() if duration > _shortest_with_stops(task) else None
    if stopping is not None and stopping.trajectory.duration < duration:
        return RoundedMotion(motion=stopping, stops=_WITH_STOPS.format("rounded corners would take longer"))
    return RoundedMotion(motion=motion)


def _apart(poses: Array, together: float) -> list[int]:
    """Return the numbers of poses of which none is as near as ``together`` to the one before; both ends among them."""

    def near(i: int, j: int) -> bool:
        return float(Path(poses=poses[[i, j]]).lengths()[0]) <= together

    corners, last = [0], len(poses) - 1
    for i in range(1, last):
        if not near(corners[-1], i):
            corners.append(i)
    while len(corners) > 1 and near(corners[-1], last):
        corners.pop()
    return [*corners, last]


def _legs(arm: Arm, path: Path, corners: list[int], speed: float, tool: ToolLimits | None) -> _Legs:
    X = path.poses[corners]
    lengths = Path(poses=X).lengths()
    R = X[:, :3, :3]
    rates = np.diff(X[:, :3, 3], axis=0) / lengths[:, None]
    turns = rotation_vector(np.swapaxes(R[:-1], -1, -2) @ R[1:]) / lengths[:, None]
    speeds = np.array([report_speed(arm, A[:3, 3], B[:3, 3], speed) for A, B in pairwise(X)])
    if tool is not None:
        shifts, angles = np.linalg.norm(np.diff(X[:, :3, 3], axis=0), axis=-1), np.linalg.norm(turns, axis=-1) * lengths
        legs = zip(shifts.tolist(), angles.tolist(), speeds.tolist(), strict=True)
        speeds = lengths / np.array([limited_time(arm, *leg, tool) for leg in legs])
    bend, twist = (np.linalg.norm(np.diff(each, axis=0), axis=-1) for each in (rates, turns))
    return _Legs(X, corners, lengths, speeds, bend, twist)


def _blend_widths(legs: _Legs, half: Array, corner: float, line_deviation: float) -> Array:
    """Return the half-widths (k - 2,) of the widest blends that keep what is asked of corners and of middle thirds.

    Args:
        legs: the legs.
        half: (k - 2,) of the shorter leg at each corner.
        corner: how far the tool may be from the legs [m].
        line_deviation: which part of that is spent otherwise [m].
    """
    change = np.maximum(legs.bend, legs.twist / ROTATION_PER_METRE)
    with np.errstate(divide="ignore"):
        widths = np.minimum(half, (1 - _ROUNDING) * max(corner - line_deviation, corner / 2) / (MISS * change))
    # From the beginning of a blend of half-width r on, the path leaves its leg as u³ / 4 r² - u⁴ / 16 r³.
    allowed = min(_MIDDLE, _MIDDLE_PART * corner) / 2
    thirds = np.stack([legs.lengths[:-1], legs.lengths[1:]]) / 3
    low, high = np.minimum(widths, thirds.min(axis=0)), widths
    for width in (high, *[None] * _HALVINGS):
        middle = (low + high) / 2 if width is None else width
        u = np.maximum(middle - thirds, 0.0)
        far = (change * (u**3 / (4 * middle**2) - u**4 / (16 * middle**3))).max(axis=0) > allowed
        low, high = np.where(far, low, middle), np.where(far, middle, high)
    return np.asarray(low)


def _tightened(task: _Task, most: float) -> tuple[CertifiedMotion, float]:
    """Return the run past corners as wide as the joints can follow, and how many times too fast they would be.

    Args:
        task: what is to be planned.
        most: how many times as fast as its limit a joint may have to be at the full speed of the tool.
    """
    for attempt in range(_TRIES):
        widths = task.widths / _TIGHTER**attempt
        try:
            tracking, run = _run(task, widths, most)
        except PathError as error:
            last = error
            continue
        motion = CertifiedMotion(trajectory=run.trajectory, certificate=_certificate(task, widths, tracking, run))
        return motion, float((tracking.speed / solver_of(task.arm).arm.limits.speed).max())
    raise last


def _certificate(task: _Task, widths: Array, tracking: Tracking, run: TimedPath) -> Certificate:
    """Return what a run keeps of its straight legs."""
    legs = task.legs
    distance = farthest_from_legs(solver_of(task.arm), tracking.trajectory, legs.poses[:, :3, 3], legs.times)
    deviation, twist = (float((MISS * widths * change).max(initial=0.0)) for change in (legs.bend, legs.twist))
    time = run.when(distance.time) * run.trajectory.duration
    return attrs.evolve(
        certificate_of(task.arm, run.trajectory, tracking.error, task.allowed, time=time),
        # Poses that are passed with others are as near to them.
        deviation=min(task.off + deviation, distance.bound + task.off - task.closer),
        deviation_sampled=distance.sampled,
        rotation=ROTATION_PER_METRE * task.off + twist,
        rotation_sampled=None,
        factor=max(run.factor, 1.0),
        because=run.because,
    )


def _run(task: _Task, widths: Array, most: float) -> tuple[Tracking, TimedPath]:
    """Return the joints along the rounded path over the time at full speed, and their run."""
    legs, solver = task.legs, solver_of(task.arm)
    top, times = float(legs.speeds.max()), legs.times
    blends = np.concatenate([[_NO_BLEND], widths / top, [_NO_BLEND]])
    rounded = tool_path(legs.poses, times, blends, ends="running", orientation="geodesic")
    close, wide = tolerance(task.closer), tolerance(_CLOSER * task.closer)
    following = Task(solver, rounded, task.q_start, close, wide, rest=False, max_slowdown=most)
    try:
        tracked = track(following, rounded.first_knots(_STEP, _MIN_KNOTS))
    except PathError as error:
        raise error.restated(legs.numbers[error.segment + 1] - 1, str(error)) from None
    caps = _caps(tracked.trajectory.times, times, widths / top, legs.speeds / top)
    ramp = 0.0 if task.tool is None else top / task.tool.acceleration
    return tracked, timed(solver, tracked.trajectory, caps, ramp=ramp)


def _caps(knots: Array, times: Array, widths: Array, speeds: Array) -> Array:
    """Return the largest part of full speed (m,) on each interval between knots: of its leg, and from leg to leg.

    It goes over from one leg's to the next's as the rates of the path do, so that no blend takes longer than its legs.
    """
    middles = (knots[1:] + knots[:-1]) / 2
    caps = np.full(len(middles), speeds[0])
    for time, width, change in zip(times[1:-1], widths, np.diff(speeds), strict=True):
        h = np.clip((middles - time + width) / (2 * width), 0.0, 1.0)
        caps += change * h**2 * (3 - 2 * h)
    return caps


def _inside_efforts(task: _Task, motion: CertifiedMotion) -> CertifiedMotion:
    """Return a run slowed as much as the efforts ask for.

    Raises:
        IncapableArmError: weight alone asks for more than a joint may give.
    """
    slowdown = slowing_for_efforts(task.arm, motion.trajectory)
    if slowdown.joint is None:
        return motion
    return motion.slowed(task.arm, slowdown.factor, ("effort", slowdown.joint))


def _shortest_with_stops(task: _Task) -> float:
    """Return a time that no run with a stop at every pose is shorter than [s]; 0 where it is not known."""
    solver = solver_of(task.arm)
    limits = solver.arm.all_limits.speed, solver.arm.all_limits.acceleration
    q, failed = chain(solver, task.legs.poses, task.q_start)
    if failed is not None or not np.isfinite(limits[1]).all():
        return 0.0
    steps = np.diff(limited_positions(solver.arm, q), axis=0)
    by_joints = [shortest_trapezoid(displacement, *limits) for displacement in steps]
    return float(np.maximum(task.legs.lengths / task.legs.speeds, by_joints).sum())


def _with_stops(task: _Task) -> CertifiedMotion | None:
    """Return the legs as straight lines one by one, with a stop at every pose; None where they cannot be run."""
    q = task.q_start
    lines: list[CertifiedMotion] = []
    for i in task.legs.numbers[1:]:
        try:
            goal, how = task.path.poses[i], {"deviation": task.deviation, "speed": task.speed}
            lines.append(coarse_line(task.arm, q, goal, **how, tool=task.tool))
        except PathError:
            return None
        q = lines[-1].trajectory(lines[-1].trajectory.duration)
    run = joined(lines)
    certificate = attrs.evolve(
        run.certificate,
        deviation_tolerance=task.allowed.position,
        # Poses that are passed with others are as near to them.
        deviation=run.certificate.deviation + task.off - task.closer,
        rotation_tolerance=task.allowed.orientation,
        rotation=run.certificate.rotation + ROTATION_PER_METRE * (task.off - task.closer),
        backward=None,
    )
    return attrs.evolve(run, certificate=certificate)
