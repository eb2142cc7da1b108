"""Straight lines with a certificate: knots where they are needed, until the deviation between them is bounded."""

from __future__ import annotations

import math
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import one_posture
from armwright.arrays import Array, ArrayLike, number
from armwright.errors import IncapableArmError, InvalidValueError
from armwright.kinematics.inverse_kinematics.candidates import exact_pose
from armwright.kinematics.inverse_kinematics.solution import Outcome, violations
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.certificate import CLOSEST, Certificate, LimitName, checked_deviation, slowing
from armwright.motion.chain import Room, beside, chain
from armwright.motion.deviation import Deviation, Spline, Ways, deviation_of, turned, turning_points
from armwright.motion.efforts import effort_peaks, slowing_for_efforts
from armwright.motion.follow import TURN_PER_METRE, PathError
from armwright.motion.path import NEGLIGIBLE, TURN_RADIUS, report_speed, report_step
from armwright.motion.quintic_polynomials import check_speed
from armwright.motion.solver import AnyArm, Solver, solver_of
from armwright.motion.stops import (
    SLOWEST,
    Guide,
    Stop,
    at_speed,
    changing,
    idlest,
    look_closely,
    nearest_singularity,
)
from armwright.motion.trajectory import Trajectory, hold, whole_ticks
from armwright.motion.xspline_path import xspline
from armwright.spatial.rotations import rotation_vector

# Part of the time in which the hand gathers speed, and again in which it loses it.
_RAMP = 0.25
# Knots to begin with, and at most; rounds of putting knots where they are missing.
_FEWEST, _MOST, _ROUNDS = 9, 4000, 12
# Where knots are this part of the duration apart and a joint still rushes, more of them do not help.
_SHORT = 64
# The deviation of a spline falls with the fourth power of the step; so many times closer than that are new knots put.
_CLOSER = 1.1


@attrs.frozen(kw_only=True, eq=False)
class CertifiedLine:
    """A straight line of the hand, planned.

    Attributes:
        trajectory: of the joints, at rest at both ends.
        certificate: what it keeps.
    """

    trajectory: Trajectory
    certificate: Certificate


class Line(NamedTuple):
    """A straight way of the hand, and when it is where on it.

    Attributes:
        A: (4, 4) pose at the start.
        B: (4, 4) pose at the end.
        turn: (3,) rotation vector from one to the other, in the axes of A [rad].
        duration: [s].
    """

    A: Array
    B: Array
    turn: Array
    duration: float

    def fractions(self, t: Array) -> Array:
        """Return the fraction of the way at times (k,): the speed rises and falls as the quintic's position does."""
        u = t / self.duration
        x = np.minimum(np.minimum(u, 1 - u) / _RAMP, 1.0)
        ramp = _RAMP * x**4 * (2.5 + x * (x - 3))
        even = np.where(u < 0.5, u - _RAMP / 2, 1 - u - _RAMP / 2)
        near = np.where(x < 1, ramp, even) / (1 - _RAMP)
        return np.where(u < 0.5, near, 1 - near)

    def poses(self, s: Array) -> Array:
        """Return the poses (k, 4, 4) at fractions (k,) of the way."""
        X = np.zeros((len(s), 4, 4))
        X[:, :3, :3] = self.A[:3, :3] @ turned(self.turn[None], s[None])[0]
        X[:, :3, 3] = self.A[:3, 3] + s[:, None] * (self.B[:3, 3] - self.A[:3, 3])
        X[:, 3, 3] = 1.0
        return X


def straight_line(
    arm: AnyArm,
    q_start: ArrayLike,
    X_goal: ArrayLike,
    *,
    deviation: float = 1e-3,
    turn: float | None = None,
    speed: float = 100.0,
    period: float | None = None,
) -> CertifiedLine:
    """Plan a straight line of the hand and certify it.

    Knots are solved on the line and joined by an X-spline in joint space; where the hand strays too far between two
    of them, more are put in. Then the motion is slowed until the joints keep their limits of speed, acceleration and
    effort.

    Args:
        arm: an arm, or a compiled one, which plans some ten times faster.
        q_start: (n,) present joint positions [rad] or [m].
        X_goal: (4, 4) pose at the end of the line.
        deviation: allowed distance of the hand from the line [m].
        turn: allowed angle from the orientation that belongs to the position of the hand on the line, and to its
            progress on it [rad]; 5 mrad for each mm of the deviation when left out. On a line shorter than the
            deviation the progress alone counts.
        speed: 1 to 120, 100 is normal: by the report's rule, as a LINE of the robot language has it.
        period: of the servo [s], to end on a whole number of them; any duration when left out.

    Returns:
        The motion and its certificate.

    Raises:
        PathError: a pose of the line is out of reach, a joint passes a limit, the posture would have to change on the
            way, or a singularity keeps the hand from staying within the deviation; with the place and the cause.
        InvalidValueError: deviation, turn or speed are out of range.
        IncapableArmError: gravity alone takes more than a joint may give, or the arm has no reach or tool speed.
    """
    return certified(arm, q_start, X_goal, deviation=deviation, turn=turn, speed=speed, period=period, closely=True)


def certified(
    arm: AnyArm,
    q_start: ArrayLike,
    X_goal: ArrayLike,
    *,
    deviation: float,
    turn: float | None = None,
    speed: float = 100.0,
    period: float | None = None,
    closely: bool,
) -> CertifiedLine:
    """Plan a straight line as ``straight_line`` does; unless ``closely``, no look at what really stops it is taken.

    That is for those who try many lines and ask for no reason.
    """
    solver = solver_of(arm)
    q, A, B = _ends(solver, q_start, X_goal, deviation)
    turn = TURN_PER_METRE * deviation if turn is None else number(turn, "turn")
    if not turn >= CLOSEST:
        raise InvalidValueError(
            f"turn: expected {CLOSEST:g} rad or more, the closest that can be certified, got {turn:g}"
        )
    line = timed_line(solver.arm, A, B, speed)
    if line is None:
        return _nowhere(solver.arm, q, A, deviation, turn)
    spline, found, times = _planned(solver, line, q, Room(deviation, turn), closely=closely)
    trajectory = Trajectory(times=times, coefficients=spline.joints)
    _check_positions(solver.arm, line, trajectory)
    trajectory, slower = _kept_to_limits(arm, line, spline, found, trajectory)
    if period is not None:
        trajectory = whole_ticks(trajectory, period)
    stretch = trajectory.duration / times[-1]
    worst = int(found.place.argmax())
    time = float(times[worst] + found.worst[worst] * spline.lengths[worst]) * stretch
    certificate = Certificate(
        arm=solver.arm,
        deviation_asked=deviation,
        deviation=float(found.place.max()),
        deviation_seen=float(found.seen.max()),
        turn_asked=turn,
        turn=float(found.turn.max()),
        turn_seen=float(found.seen_turn.max()),
        worst_time=time,
        worst_place=np.asarray(solver.forward(trajectory(time))[:3, 3]),
        knots=len(times),
        looks=found.looks * len(spline.lengths),
        peaks={
            "speed": found.speed.max(axis=0) / stretch,
            "acceleration": found.acceleration.max(axis=0) / stretch**2,
            "effort": slower.efforts,
        },
        factor=slower.factor,
        because=slower.because,
        backward=found.backward,
    )
    return CertifiedLine(trajectory=trajectory, certificate=certificate)


class _Slower(NamedTuple):
    """How many times slower a motion is run, for which limit of which joint, and the (n,) efforts that it takes."""

    factor: float
    because: tuple[LimitName, int] | None
    efforts: Array


def _kept_to_limits(
    arm: AnyArm, line: Line, spline: Spline, found: Deviation, trajectory: Trajectory
) -> tuple[Trajectory, _Slower]:
    """Run a line slower until the joints keep their limits of speed, acceleration and effort."""
    solver = solver_of(arm)
    factor, because = _slowing(solver.arm, line, trajectory, found)
    efforts = _efforts(solver, spline, found.looks, factor)
    if (efforts > solver.arm.limit("effort")).any():
        slower = slowing_for_efforts(arm, trajectory.slowed(factor))
        factor, because = factor * slower.factor, because if slower.joint is None else ("effort", slower.joint)
        efforts = effort_peaks(arm, trajectory.slowed(factor)).peaks
    return trajectory.slowed(factor), _Slower(factor, because, efforts)


def _slowing(
    arm: Arm, line: Line, trajectory: Trajectory, found: Deviation
) -> tuple[float, tuple[LimitName, int] | None]:
    """Return how many times slower a line must be run to keep speeds and accelerations, and for which of them."""
    factor, because = slowing(arm, {"speed": found.speed.max(axis=0), "acceleration": found.acceleration.max(axis=0)})
    if because is not None and because[0] == "speed" and factor > SLOWEST:
        time = trajectory.times[found.speed[:, because[1]].argmax()]
        s = float(line.fractions(np.array([time]))[0])
        raise _singular(arm, line, s, nearest_singularity(arm, trajectory(time)), joint=because[1] + 1, factor=factor)
    return factor, because


def _efforts(solver: Solver, spline: Spline, looks: int, factor: float) -> Array:
    """Return the largest efforts (n,) at the looks of a motion run so many times slower."""
    t = (np.linspace(0.0, 1.0, looks + 1) * spline.lengths[:, None])[..., None]
    a, b, c, d = (spline.joints[:, None, power] for power in range(4))
    q = ((d * t + c) * t + b) * t + a
    qd = ((3 * d * t + 2 * c) * t + b) / factor
    qdd = (6 * d * t + 2 * c) / factor**2
    return np.asarray(np.abs(solver.inverse_dynamics(q, qd, qdd)).max(axis=(0, 1)))


def _ends(solver: Solver, q_start: ArrayLike, X_goal: ArrayLike, deviation: float) -> tuple[Array, Array, Array]:
    """Return the posture and the pose at the start, and the pose at the end, of a line that the arm can end."""
    checked_deviation(deviation)
    q = one_posture(solver.arm, q_start, "q_start")
    B = exact_pose(X_goal)
    for fault in violations(solver.arm, q):
        raise PathError("limits", 0, 0.0, f"at the start {fault}", joint=fault.joint, reason=str(fault))
    return q, np.asarray(solver.forward(q)), B


def timed_line(arm: Arm, A: Array, B: Array, speed: float) -> Line | None:
    """Return the line from A to B, timed by the report's rule; None where it has no length."""
    turn = rotation_vector(A[:3, :3].T @ B[:3, :3])
    length = max(float(np.linalg.norm(B[:3, 3] - A[:3, 3])), TURN_RADIUS * float(np.linalg.norm(turn)))
    check_speed(speed)
    if length <= NEGLIGIBLE:
        return None
    if not (math.isfinite(arm.reach) and math.isfinite(arm.tool_speed)):
        raise IncapableArmError(
            f"arm '{arm.name}': paths in space need its reach and its tool speed ([hand] in the arm file)"
        )
    return Line(A, B, turn, length / report_speed(arm, A[:3, 3], B[:3, 3], speed) / (1 - _RAMP))


def _planned(
    solver: Solver, line: Line, q_start: Array, room: Room, *, closely: bool
) -> tuple[Spline, Deviation, Array]:
    """Return the joint motion along the line, how far the hand strays, and the times of the knots."""
    length = float(np.linalg.norm(line.B[:3, 3] - line.A[:3, 3]))
    rule = length / report_step(solver.arm, line.A[:3, 3], line.B[:3, 3], room.place)
    times = np.linspace(0.0, line.duration, min(max(_FEWEST, math.ceil(rule) + 2), _MOST // 4))
    try:
        return _refined(solver, line, times, q_start, room)
    except PathError as error:
        s = line.fractions(times)
        # A pose out of reach is so for every posture.
        doubtful = closely and error.cause != "reach"
        look = look_closely(solver, line.poses(s), times, q_start, room) if doubtful else None
        if look is None:
            raise
        if look.stop is not None:
            place = float(np.interp(look.stop.place, np.arange(len(s)), s))
            if look.stop.agrees(error.cause, error.joint, error.reason, abs(place - error.fraction)):
                raise
            raise _stopped(solver.arm, line, place, look.stop) from error
        return _refined(solver, line, times, q_start, room, guide=Guide(s, look))


def _stopped(arm: Arm, line: Line, s: float, stop: Stop) -> PathError:
    """Return the error for what a close look found at a fraction of the way."""
    if stop.rush is not None and stop.joint is not None:
        return _singular(arm, line, s, stop.near, joint=stop.joint, factor=stop.rush)
    return PathError(
        stop.cause, 0, s, f"on the line near {at_place(line, s)} {stop.reason}", joint=stop.joint, reason=stop.reason
    )


def _refined(
    solver: Solver, line: Line, times: Array, q_start: Array, room: Room, *, guide: Guide | None = None
) -> tuple[Spline, Deviation, Array]:
    """Put knots between ``times`` until the deviation is within its bounds everywhere."""
    n, (deviation, turn) = solver.arm.n, room
    for _ in range(_ROUNDS):
        s = line.fractions(times)
        q = _solved(solver, line, s, q_start, guide)
        c = xspline(times, np.concatenate([q, s[:, None]], axis=1)).coefficients
        spline = Spline(np.diff(times), c[..., :n], c[..., n])
        ways = Ways.of_one(line.A, line.B, line.turn, len(spline.lengths))
        found = deviation_of(
            solver.arm, solver.forward, ways, spline, allowed=deviation, allowed_turn=turn, by_position=True
        )
        excess = np.maximum(np.maximum(found.place, found.backward) / deviation, found.turn / turn)
        if excess.max() <= 1:
            return spline, found, times
        _check_rush(solver.arm, line, found, spline.lengths, q)
        parts = np.where(excess > 1, np.clip(np.ceil(_CLOSER * excess**0.25), 2, 8), 1).astype(int)
        if parts.sum() > _MOST:
            break
        inside = [a + h * np.arange(k) / k for a, h, k in zip(times, spline.lengths, parts, strict=False)]
        times = np.append(np.concatenate(inside), line.duration)
    worst = int(excess.argmax())
    joint = int(np.abs(q[worst + 1] - q[worst]).argmax())
    near = nearest_singularity(solver.arm, q[worst])
    raise _singular(solver.arm, line, float(s[worst]), near, joint=joint + 1, factor=math.inf)


def _check_rush(arm: Arm, line: Line, found: Deviation, lengths: Array, q: Array) -> None:
    """Refuse a line on which a joint rushes, before more knots are put where no number of them would help."""
    rush = np.where((lengths < line.duration / _SHORT)[:, None], found.speed / arm.limit("speed"), 0.0)
    if rush.max() > SLOWEST:
        worst, joint = np.unravel_index(int(rush.argmax()), rush.shape)
        s = float(line.fractions(np.cumsum(lengths)[worst : worst + 1])[0])
        raise _singular(
            arm, line, s, nearest_singularity(arm, q[worst]), joint=int(joint) + 1, factor=float(rush.max())
        )


def _singular(arm: Arm, line: Line, s: float, near: str, *, joint: int, factor: float) -> PathError:
    """Return the error for a place where the arm is singular, so that a joint, from 1, would have to rush."""
    why = f"the arm is singular there ({near}), {at_speed(arm, joint, factor)}"
    message = f"the hand cannot stay on the line near {at_place(line, s)}: {why}"
    return PathError("singular", 0, s, message, joint=joint, reason=f"the hand cannot stay on the line: {why}")


def _solved(solver: Solver, line: Line, s: Array, q_start: Array, guide: Guide | None) -> Array:
    """Return the postures (k, n) at fractions (k,) of the way, each next to the one before, or beside the guide."""
    X = line.poses(s)
    q, missed = chain(solver, X, q_start) if guide is None else beside(solver, X, guide.postures(s))
    # What stops the hand first is told: a limit before the pose that is not met, or that pose.
    met = q[:missed]
    outside = (met < solver.arm.limit("lower")) | (met > solver.arm.limit("upper"))
    for k in np.flatnonzero(outside.any(axis=1)):
        for fault in violations(solver.arm, q[k]):
            message = f"on the line near {at_place(line, s[k])} {fault}"
            raise PathError("limits", 0, float(s[k]), message, joint=fault.joint, reason=str(fault))
    if missed is not None:
        solution = inverse(solver.arm, X[missed], q[missed - 1])
        at = f"on the line near {at_place(line, s[missed])}"
        if solution.outcome is Outcome.OUT_OF_REACH:
            why = solution.explain()
            raise PathError("reach", 0, float(s[missed]), f"{at}: {why}", reason=why)
        before, why = q[missed - 1], changing(solver.arm, q[missed - 1])
        raise PathError("singular", 0, float(s[missed]), f"{at} {why}", joint=idlest(solver.arm, before), reason=why)
    return q


def _check_positions(arm: Arm, line: Line, trajectory: Trajectory) -> None:
    """Refuse a spline that swings over a joint limit between knots which keep it."""
    c, lengths = trajectory.coefficients, np.diff(trajectory.times)
    t = turning_points(c, lengths)
    q = ((c[:, 3] * t + c[:, 2]) * t + c[:, 1]) * t + c[:, 0]
    outside = ((q < arm.limit("lower")) | (q > arm.limit("upper"))).any(axis=(0, 2))
    for k in np.flatnonzero(outside):
        s = float(line.fractions(trajectory.times[k : k + 1])[0])
        for fault in (*violations(arm, q[0, k]), *violations(arm, q[1, k])):
            message = f"on the line near {at_place(line, s)} {fault}"
            raise PathError("limits", 0, s, message, joint=fault.joint, reason=str(fault))


def _nowhere(arm: Arm, q: Array, A: Array, deviation: float, turn: float) -> CertifiedLine:
    """Return the line from a pose to the same pose."""
    none = np.zeros(arm.n)
    return CertifiedLine(
        trajectory=hold(q, 0.0),
        certificate=Certificate(
            arm=arm,
            deviation_asked=deviation,
            deviation=0.0,
            deviation_seen=0.0,
            turn_asked=turn,
            turn=0.0,
            turn_seen=0.0,
            worst_time=0.0,
            worst_place=A[:3, 3],
            knots=1,
            looks=0,
            peaks={"speed": none, "acceleration": none, "effort": none},
            factor=1.0,
            because=None,
            backward=0.0,
        ),
    )


def at_place(line: Line, s: float) -> str:
    """Return a place on a line in words, seen from the base of the arm."""
    x, y, z = (line.A[:3, 3] + s * (line.B[:3, 3] - line.A[:3, 3])) * 1e3
    return f"({x:.1f}, {y:.1f}, {z:.1f}) mm from the base"
