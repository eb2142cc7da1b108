"""Following a path: joints solved at knots, joined by X-splines, and held against path and limits."""

from __future__ import annotations

from typing import NoReturn

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike
from armwright.errors import ArmwrightError
from armwright.kinematics.inverse_kinematics.solution import Outcome, violations
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.certificate import LimitName, checked_deviation, slower
from armwright.motion.chain import Room, beside, chain
from armwright.motion.deviation import Deviation, Spline, Ways, deviation_of
from armwright.motion.path import NEGLIGIBLE, Knots, Path, place_knots
from armwright.motion.solver import Solver, solver_of
from armwright.motion.stops import (
    SLOWEST,
    Cause,
    Guide,
    Stop,
    at_speed,
    cause_of,
    changing,
    idlest,
    look_closely,
    nearest_singularity,
)
from armwright.motion.trajectory import Trajectory, hold
from armwright.motion.xspline_path import xspline
from armwright.spatial.rotations import rotation_vector

# The rule's knots are halved at most this often before the path is given up: 1/64 of the rule's step.
_HALVINGS = 6
# The report's path through several frames turns its corners without a stop, so it must round them; and it is gross
# motion. It may leave the straight ways between its frames by this much more than a line may leave its own.
_CORNER_ROOM = 20.0
# A line planned for a coarse deviation may be slower or faster than one for a fine one, as few long steps gather speed
# late and many short ones ask for more acceleration. What may be off by more than the first is planned for each of
# these that it allows, and the fastest is run; deviations beyond the last would only turn the hand [m].
COARSE = (1e-3, 2e-3, 5e-3)
# Turning the hand by this much is allowed where the place may be off by one metre's thousandth: 5 mrad per mm.
TURN_PER_METRE = 5.0


@attrs.frozen(kw_only=True, eq=False)
class Followed:
    """A path that the joints can follow.

    Attributes:
        trajectory: of the joints, at rest at both ends.
        knots: number of knots solved.
        deviation: upper bound of the distance of the hand from the path, between samples as well [m].
        turn_deviation: upper bound of the angle from the orientation that belongs to the progress on the path [rad].
        slowed: why it runs slower than the rule says, or empty.
    """

    trajectory: Trajectory
    knots: int
    deviation: float
    turn_deviation: float
    slowed: str


class PathError(ArmwrightError, ValueError):
    """A path cannot be followed.

    Attributes:
        cause: out of ``reach``, beyond the joint ``limits``, or through a ``singular`` posture.
        segment: which way of the path, from 0.
        fraction: how far along that way.
        joint: number of the joint that stops it, from 1; None where it is no single one, or not known.
        reason: what happens there, without the place.
    """

    def __init__(
        self,
        cause: Cause,
        segment: int,
        fraction: float,
        message: str,
        *,
        joint: int | None = None,
        reason: str | None = None,
    ) -> None:
        """Say what stops the arm, and where."""
        self.cause, self.segment, self.fraction, self.joint = cause, segment, fraction, joint
        self.reason = message if reason is None else reason
        super().__init__(message)


def follow(arm: Arm, path: Path, q_start: ArrayLike, *, deviation: float, speed: float) -> Followed:
    """Return the joint motion along a path, from rest to rest, passing the poses between without a stop.

    Args:
        arm: any arm; without a closed-form inverse each posture is sought from the one before it.
        path: begins where the hand is at ``q_start``.
        q_start: (n,) present joint positions.
        deviation: allowed distance of the hand from a single straight way [m]; twenty times as much is allowed on a
            path with corners. The orientation may be off by ``TURN_PER_METRE`` times as many radians. Of more than 1
            mm the part is used that gives the fastest run, 5 mm at most.
        speed: 1 to 120, 100 is normal.

    Raises:
        PathError: a pose on the way is out of reach, a joint passes a limit, or a singularity keeps the hand from
            staying within the deviation.
        InvalidValueError: deviation or speed are out of range.

    Source:
        TR-83-008, "straight line motion" and "continuous motion"; the knots of its rule are halved until the
        deviation between them, which the rule only estimates, really is within the bound.
    """
    if path.lengths().max() <= NEGLIGIBLE:
        return Followed(trajectory=hold(q_start, 0.0), knots=1, deviation=0.0, turn_deviation=0.0, slowed="")
    checked_deviation(deviation)
    runs: list[Followed] = []
    for tried in [each for each in COARSE if each <= deviation] or [deviation]:
        try:
            runs.append(_closely_followed(arm, path, q_start, deviation=tried, speed=speed))
        except PathError as error:
            last = error
            if error.cause == "reach":  # a pose out of reach is so for every deviation
                break
    if not runs:
        raise last
    return min(runs, key=lambda run: run.trajectory.duration)


def _closely_followed(arm: Arm, path: Path, q_start: ArrayLike, *, deviation: float, speed: float) -> Followed:
    """Follow a path for one deviation; where that fails, look closely at what really stops the arm."""
    allowed = deviation if len(path.poses) == 2 else _CORNER_ROOM * deviation
    solver, q = solver_of(arm), np.asarray(q_start, dtype=np.float64)
    check_ends(solver, path, q)
    try:
        return _followed(solver, path, q, allowed, deviation=deviation, speed=speed)
    except PathError as error:
        if error.cause == "reach":  # a pose out of reach is so for every posture
            raise
        knots = place_knots(arm, path, deviation=deviation, speed=speed)
        look = look_closely(solver, knots.poses(path), knots.times, q, Room(allowed, TURN_PER_METRE * allowed))
        if look is None:
            raise
        if look.stop is not None:
            closer = _stopped(path, knots, look.stop)
            off = closer.segment + closer.fraction - error.segment - error.fraction
            if look.stop.agrees(error.cause, error.joint, error.reason, abs(off)):
                raise
            raise closer from error
        guide = Guide(_progress(knots), look)
        return _followed(solver, path, q, allowed, deviation=deviation, speed=speed, guide=guide)


def _followed(
    solver: Solver,
    path: Path,
    q_start: Array,
    allowed: float,
    *,
    deviation: float,
    speed: float,
    guide: Guide | None = None,
) -> Followed:
    """Put knots on a path until the hand stays within what is allowed, and keep the limits."""
    arm = solver.arm
    for halving in range(_HALVINGS + 1):
        knots = place_knots(arm, path, deviation=deviation, speed=speed, finer=2**halving)
        q = _solve(solver, path, knots, q_start, guide)
        trajectory = xspline(knots.times, q)
        found = _deviation(solver, path, knots, trajectory, allowed)
        excess = np.maximum(found.place, found.turn / TURN_PER_METRE) / allowed
        if excess.max() <= 1:
            break
    else:
        _give_up(arm, path, knots, q, excess)
    _check_between(arm, knots, trajectory)
    factor, slowed = _slowing(arm, path, knots, trajectory)
    return Followed(
        trajectory=trajectory.slowed(factor),
        knots=len(q),
        deviation=float(found.place.max()),
        turn_deviation=float(found.turn.max()),
        slowed=slowed,
    )


def check_ends(solver: Solver, path: Path, q_start: Array) -> None:
    """Refuse a path to a pose that no posture reaches, before anything between is looked at."""
    arm = solver.arm
    q, off = chain(solver, path.poses, q_start)
    for segment, X in enumerate(path.poses[1:]):
        if (off is None or segment + 1 < off) and not violations(arm, q[segment + 1]):
            continue
        solution = inverse(arm, X)
        if not solution.allowed:
            raise PathError(cause_of(solution), segment, 1.0, solution.explain())


def _progress(knots: Knots) -> Array:
    """Return where on a path knots are (k,): the number of the way, and the fraction of it."""
    return np.add(knots.segments, knots.fractions)


def _stopped(path: Path, knots: Knots, stop: Stop) -> PathError:
    """Return the error for what a close look found."""
    before, part = int(stop.place), stop.place % 1
    after = min(before + 1, len(knots.segments) - 1)
    segment = knots.segments[after if part else before]
    since = knots.fractions[before] if knots.segments[before] == segment else 0.0
    fraction = since + part * (knots.fractions[after] - since) if part else knots.fractions[before]
    x, y, z = path.at(segment, fraction)[:3, 3] * 1e3
    return PathError(
        stop.cause,
        segment,
        fraction,
        f"near ({x:.1f}, {y:.1f}, {z:.1f}) mm from the base {stop.reason}" if stop.cause == "singular" else stop.reason,
        joint=stop.joint,
        reason=stop.reason,
    )


def _solve(solver: Solver, path: Path, knots: Knots, q_start: Array, guide: Guide | None) -> Array:
    """Solve every knot by the posture nearest to the one before it, or to the guide."""
    arm, X = solver.arm, knots.poses(path)
    q, missed = chain(solver, X, q_start) if guide is None else beside(solver, X, guide.postures(_progress(knots)))
    met = q[:missed]
    outside = np.any((met < arm.limit("lower")) | (met > arm.limit("upper")), axis=1)
    for k in np.flatnonzero(outside):
        for fault in violations(arm, q[k]):
            raise PathError("limits", knots.segments[k], knots.fractions[k], str(fault), joint=fault.joint)
    if missed is not None:
        place = knots.segments[missed], knots.fractions[missed]
        solution = inverse(arm, X[missed], q[missed - 1])
        if solution.outcome is Outcome.OUT_OF_REACH:
            raise PathError("reach", *place, solution.explain())
        before, why = q[missed - 1], changing(arm, q[missed - 1])
        message = f"near {_place(path, knots, missed)} {why}"
        raise PathError("singular", *place, message, joint=idlest(arm, before), reason=why)
    return q


def _deviation(solver: Solver, path: Path, knots: Knots, trajectory: Trajectory, allowed: float) -> Deviation:
    """Return how far the hand strays from the path between every two knots: upper bounds."""
    segments = np.array(knots.segments)
    # Ways without length have no knots: those that have are counted on, so that the progress goes on as well.
    number = np.searchsorted(np.unique(segments), segments)
    progress = xspline(knots.times, (number + np.array(knots.fractions))[:, None]).coefficients[..., 0].copy()
    progress[:, 0] -= number[1:]
    A, B = path.poses[segments[1:]], path.poses[segments[1:] + 1]
    R_A = A[:, :3, :3]
    turn = rotation_vector(np.swapaxes(R_A, -1, -2) @ B[:, :3, :3])
    ways = Ways(A[:, :3, 3], R_A, B[:, :3, 3] - A[:, :3, 3], turn)
    spline = Spline(np.diff(knots.times), trajectory.coefficients, progress)
    return deviation_of(
        solver.arm,
        solver.forward,
        ways,
        spline,
        allowed=allowed,
        allowed_turn=TURN_PER_METRE * allowed,
        by_position=len(path.poses) == 2,
    )


def _check_between(arm: Arm, knots: Knots, trajectory: Trajectory) -> None:
    """Refuse a spline that swings over a joint limit between knots which keep it."""
    at_knots = trajectory(knots.times)
    for q in trajectory.extremes(0):
        for fault in violations(arm, q):
            nearest = int(np.abs(at_knots[:, fault.joint - 1] - fault.value).argmin())
            raise PathError("limits", knots.segments[nearest], knots.fractions[nearest], str(fault), joint=fault.joint)


def _slowing(arm: Arm, path: Path, knots: Knots, trajectory: Trajectory) -> tuple[float, str]:
    """Return the factor of time that brings speeds and accelerations inside the limits, and its reason."""
    needs: dict[LimitName, Array] = {
        "speed": trajectory.segment_peaks(1) / arm.limit("speed"),
        "acceleration": np.sqrt(trajectory.segment_peaks(2) / arm.limit("acceleration")),
    }
    if needs["speed"].max() > SLOWEST:
        interval, worst = np.unravel_index(int(needs["speed"].argmax()), needs["speed"].shape)
        k, joint = int(interval) + 1, int(worst) + 1
        reason = (
            f"{at_speed(arm, joint, needs['speed'].max())}: the arm is nearly "
            f"singular there ({nearest_singularity(arm, trajectory(knots.times[k]))})"
        )
        message = f"near {_place(path, knots, k)} {reason}"
        raise PathError("singular", knots.segments[k], knots.fractions[k], message, joint=joint, reason=reason)
    what = max(needs, key=lambda name: float(needs[name].max()))
    joint = int(np.unravel_index(int(needs[what].argmax()), needs[what].shape)[1])
    factor = float(needs[what].max())
    return (factor, slower(arm, factor, (what, joint))) if factor > 1 else (1.0, "")


def _place(path: Path, knots: Knots, k: int) -> str:
    x, y, z = path.at(knots.segments[k], knots.fractions[k])[:3, 3] * 1e3
    return f"({x:.1f}, {y:.1f}, {z:.1f}) mm from the base"


def _give_up(arm: Arm, path: Path, knots: Knots, q: Array, badness: Array) -> NoReturn:
    worst = int(badness.argmax())
    jump = np.abs(q[worst + 1] - q[worst]) / np.where(np.isfinite(arm.limit("speed")), arm.limit("speed"), 1.0)
    joint = int(jump.argmax())
    amount = abs(q[worst + 1, joint] - q[worst, joint])
    verb, unit, scale = ("turn", "deg", 180 / np.pi) if arm.joints[joint].revolute else ("move", "mm", 1e3)
    why = (
        f"the arm is singular there ({nearest_singularity(arm, q[worst + 1])}) and {arm.called(joint)} would have to "
        f"{verb} {amount * scale:.1f} {unit} at once"
    )
    raise PathError(
        "singular",
        knots.segments[worst + 1],
        knots.fractions[worst + 1],
        f"the hand cannot stay on the path near {_place(path, knots, worst + 1)}: {why}",
        joint=joint + 1,
        reason=f"the hand cannot stay on the path: {why}",
    )
