"""Joints that carry the hand along a path planned in time, on one branch, with a bounded deviation."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.kinematics.inverse_kinematics.solution import Violation, violations
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.kinematics.inverse_kinematics.wrapping import joint_distance
from armwright.motion.blends import Ends
from armwright.motion.chain import Room, beside, chain
from armwright.motion.deviation import HandBounds, cubic_peaks, half_sines, hand_bounds
from armwright.motion.follow import TURN_PER_METRE, PathError
from armwright.motion.hand_path import HandPath
from armwright.motion.polynomials import evaluate
from armwright.motion.postures import Posture
from armwright.motion.solver import Solver
from armwright.motion.stops import (
    SLOWEST,
    Cause,
    Guide,
    at_speed,
    cause_of,
    changing,
    idlest,
    look_closely,
    nearest_singularity,
)
from armwright.motion.trajectory import Trajectory
from armwright.motion.xspline_path import smooth_weight, xspline

Counts: TypeAlias = npt.NDArray[np.intp]

# Knots to begin with: so far apart [s], and so many on each blend and each straight way at least and at most.
_STEP, _FEWEST, _ENOUGH = 0.02, 4, 500
# The same for a path whose time is a mere parameter. The deviation tells how many it takes; there are some more, for
# the accelerations of the joints, which are not as near to those of the path as the positions, decide on the timing.
_WIDE_STEP, _MORE = 0.1, 8
# Rounds of putting knots where they are missing; the deviation falls with the fourth power of the step.
_ROUNDS, _CLOSER = 8, 1.1
# Knots at most: of a motion whose time is given, and of one whose time is a mere parameter.
_MOST, _MOST_ON = 500_000, 4_000
# Whole turns; a limit passed by this part of one is not passed.
_TURN, _NONE = 2 * math.pi, 1e-9
# What the bound may add to what was seen, in parts of what is allowed; looks between two knots for it, at most.
_ADDED, _LOOKS = 0.1, 64


class Carried(NamedTuple):
    """A motion of the joints that carries the hand along its path.

    Attributes:
        label: branch of its postures.
        trajectory: of the joints.
        strays: how far the hand is off on every interval between two knots.
    """

    label: str
    trajectory: Trajectory
    strays: Strays


class Strays(NamedTuple):
    """How far the hand is from where it is planned to be, on m intervals between knots, (m,) each.

    Attributes:
        place: upper bound of the distance [m].
        turn: upper bound of the angle from the planned orientation [rad].
        seen: the largest distance that was seen [m].
        seen_turn: the largest angle that was seen [rad].
        times: when the largest distance was seen [s].
        looks: how often the hand was looked at on an interval.
    """

    place: Array
    turn: Array
    seen: Array
    seen_turn: Array
    times: Array
    looks: int


class _Manner(NamedTuple):
    """How a branch is followed.

    Attributes:
        ends: whether the joints rest at both ends or run.
        deviation: allowed distance of the hand from where it is planned to be [m].
        room: how far off the hand may be where it is looked for what stops the arm [m].
        turns: whether joints may be turned by whole turns at the start, to be inside their limits later.
        fastest: how many times as fast as it may a joint may have to be.
        most: knots.
    """

    ends: Ends
    deviation: float
    room: float
    turns: bool = True
    fastest: float = SLOWEST
    most: int = _MOST


class _Stop(NamedTuple):
    """What stops a branch: why, which joint, from 1, if it is one, and at which time [s]."""

    cause: Cause
    why: str
    joint: int | None
    time: float


def carry(solver: Solver, hand: HandPath, times: Array, near: Array, *, ends: Ends, deviation: float) -> Carried:
    """Solve a path of the hand for the joints.

    The branch is chosen once and kept: of the postures inside the limits at the start the nearest that leads to the
    end inside them.

    Args:
        solver: the arm.
        hand: the path.
        times: (k,) of its poses [s]; they tell places in errors.
        near: (n,) present joint positions.
        ends: whether the joints rest at both ends or run.
        deviation: allowed distance of the hand from where it is planned to be [m]; the orientation may be off by
            ``TURN_PER_METRE`` times as many radians.

    Raises:
        PathError: no branch carries through: what stops each of them, where.
    """
    arm = solver.arm
    t = _first_knots(hand, _STEP, _FEWEST)
    stops: dict[str, _Stop] = {}
    for start in _starts(arm, hand(0.0), near):
        found = _carried(solver, hand, t, start, _Manner(ends, deviation, deviation))
        if isinstance(found, Carried):
            return found
        stops[start.label] = found
    first = next(iter(stops.values()))
    way, fraction = _on_the_way(times, first.time)
    reasons = "; ".join(f"{label}: {_place(hand, times, stop.time)} {stop.why}" for label, stop in stops.items())
    message = f"no branch carries the hand to its last pose. {reasons}"
    raise PathError(first.cause, way, fraction, message, joint=first.joint, reason=first.why)


def carry_on(
    solver: Solver,
    hand: HandPath,
    times: Array,
    q_start: Array,
    *,
    deviation: float,
    room: float,
    fastest: float = SLOWEST,
) -> Carried:
    """Solve a path of the hand for the joints from the posture that the arm has.

    Args:
        solver: the arm.
        hand: the path, run at both ends; its time is a mere parameter.
        times: (k,) of its poses.
        q_start: (n,) joint positions at its start.
        deviation: as for ``carry``.
        room: how far off the hand may be where it is looked for what stops the arm [m].
        fastest: how many times as fast as it may a joint may have to be; infinite where whoever times the motion sees
            to that.

    Raises:
        PathError: what stops the arm, where.
    """
    start = Posture("", q_start)
    t = _first_knots(hand, _WIDE_STEP, _MORE)
    manner = _Manner("running", deviation, room, turns=False, fastest=fastest, most=_MOST_ON)
    found = _carried(solver, hand, t, start, manner)
    if isinstance(found, Carried):
        return found
    way, fraction = _on_the_way(times, found.time)
    message = f"{_place(hand, times, found.time)} {found.why}"
    raise PathError(found.cause, way, fraction, message, joint=found.joint, reason=found.why)


def _on_the_way(times: Array, t: float) -> tuple[int, float]:
    """Return on which way between poses, from 0, a time is, and at which fraction of it."""
    way = int(np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2))
    return way, float(np.clip((t - times[way]) / (times[way + 1] - times[way]), 0.0, 1.0))


def _starts(arm: Arm, X: Array, near: Array) -> list[Posture]:
    """Return a posture of every branch that is inside the limits at the first pose, nearest first."""
    solution = inverse(arm, X, near)
    if not solution.allowed:
        raise PathError(cause_of(solution), 0, 0.0, f"pose 1: {solution.explain()}")
    starts = [Posture(branch.label, branch.q) for branch in solution.allowed]
    return sorted(starts, key=lambda posture: joint_distance(arm, near, posture.q))


def _first_knots(hand: HandPath, step: float, fewest: int) -> Array:
    lengths = np.diff(hand.knots)
    parts = np.clip(np.ceil(lengths / step), fewest, _ENOUGH).astype(np.intp)
    return _divided(hand.knots, parts)


def _divided(times: Array, parts: Counts) -> Array:
    """Return times with every interval divided into so many parts."""
    h = np.repeat(np.diff(times) / parts, parts)
    place = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    return np.append(np.repeat(times[:-1], parts) + place * h, times[-1])


def _carried(solver: Solver, hand: HandPath, t: Array, start: Posture, manner: _Manner) -> Carried | _Stop:
    """Follow one branch: what it comes to, or what really stops it."""
    found = _knotted(solver, hand, t, start, manner)
    if isinstance(found, Carried) or found.cause == "reach":  # a pose out of reach is so for every posture
        return found
    wide = manner.room
    look = look_closely(solver, hand(t), t, start.q, Room(wide, TURN_PER_METRE * wide), poses_only=True)
    if look is None:
        return found
    times = np.interp(look.places, np.arange(len(t)), t)
    q = _turned_inside(solver.arm, look.q, None) if manner.turns else look.q
    beyond = _stopped(solver.arm, q, None, hand(times), times)
    if beyond is None and look.stop is not None:
        beyond = _Stop(look.stop.cause, look.stop.reason, look.stop.joint, float(times[-1]))
    if beyond is not None:
        return found if (found.cause, found.joint) == (beyond.cause, beyond.joint) else beyond
    return _knotted(solver, hand, t, start, manner, guide=Guide(t, look))


def _knotted(
    solver: Solver, hand: HandPath, t: Array, start: Posture, manner: _Manner, *, guide: Guide | None = None
) -> Carried | _Stop:
    """Put knots on one branch until the hand stays within the deviation."""
    arm, still = solver.arm, np.zeros(solver.arm.n)
    postures: Callable[[Array], Array] | None = None if guide is None else guide.postures
    for _ in range(_ROUNDS):
        X = hand(t)
        q, missed = chain(solver, X, start.q) if postures is None else beside(solver, X, postures(t))
        q = _turned_inside(arm, q, missed) if manner.turns else q
        if (stop := _stopped(arm, q, missed, X, t)) is not None:
            return stop
        rates = (still, still) if manner.ends == "rest" else (_rate(t, q), _rate(t[::-1], q[::-1]))
        trajectory = xspline(t, q, *rates, b=smooth_weight(t))
        speed, acceleration = cubic_peaks(trajectory.coefficients, np.diff(t))
        bounds = hand_bounds(arm, trajectory.coefficients, np.diff(t), speed, acceleration)
        strays = _strays(solver, hand, trajectory, bounds, manner.deviation)
        excess = np.maximum(strays.place, strays.turn / TURN_PER_METRE) / manner.deviation
        if excess.max() <= 1:
            return _swings_out(arm, trajectory) or Carried(start.label, trajectory, strays)
        # Where a joint rushes past a singularity, more knots do not help.
        if (speed / arm.limit("speed")).max() > manner.fastest:
            break
        parts = np.where(excess > 1, np.clip(np.ceil(_CLOSER * excess**0.25), 2, 8), 1).astype(np.intp)
        if parts.sum() > manner.most:
            break
        t = _divided(t, parts)
        if solver.inverse_branches is None:  # from where they nearly are already they are found at once
            postures = trajectory
    worst = int(excess.argmax())
    return _too_far(arm, q[worst], speed[worst] / arm.limit("speed"), float(t[worst]), manner.deviation)


def _too_far(arm: Arm, q: Array, rushes: Array, time: float, deviation: float) -> _Stop:
    """Say why the hand cannot be kept on its path at a posture (n,), with how fast joints are there by limits (n,)."""
    joint = int(rushes.argmax())
    if rushes[joint] > SLOWEST:
        why = at_speed(arm, joint + 1, float(rushes[joint]))
    else:
        why = f"the hand cannot be kept within {deviation * 1e3:.3g} mm of its path"
    near = nearest_singularity(arm, q)
    return _Stop("singular", f"the arm is singular ({near}): {why}" if near else why, joint + 1, time)


def _turned_inside(arm: Arm, q: Array, missed: int | None) -> Array:
    """Turn joints by as few whole turns as bring all of their way inside the limits, where any do."""
    lowest, highest = q[:missed].min(axis=0), q[:missed].max(axis=0)
    least, most = (arm.limit("lower") - lowest) / _TURN, (arm.limit("upper") - highest) / _TURN
    turns = np.where(least > _NONE, np.ceil(least), np.where(most < -_NONE, np.floor(most), 0.0))
    fits = (turns >= least - _NONE) & (turns <= most + _NONE) & [joint.revolute for joint in arm.joints]
    return np.asarray(q + _TURN * np.where(fits, turns, 0.0))


def _stopped(arm: Arm, q: Array, missed: int | None, X: Array, t: Array) -> _Stop | None:
    """Return what keeps the joints from following poses, if anything does."""
    met = q[:missed]
    outside = np.flatnonzero(((met < arm.limit("lower")) | (met > arm.limit("upper"))).any(axis=1))
    for k in outside:
        faults = violations(arm, q[k])
        if faults:
            return _Stop("limits", _beyond(faults[0], arm, met), faults[0].joint, float(t[k]))
    if missed is None:
        return None
    solution = inverse(arm, X[missed], q[missed - 1])
    if solution.allowed:
        before = q[missed - 1]
        return _Stop("singular", changing(arm, before), idlest(arm, before), float(t[missed]))
    return _Stop(cause_of(solution), solution.explain(), None, float(t[missed]))


def _beyond(fault: Violation, arm: Arm, q: Array) -> str:
    """Say which joint passes its limit, and by how much on the whole way."""
    j = fault.joint - 1
    past = max(float(q[:, j].max() - arm.limit("upper")[j]), float(arm.limit("lower")[j] - q[:, j].min()))
    unit, scale = ("deg", math.degrees(1.0)) if fault.revolute else ("mm", 1e3)
    return f"{arm.called(j)} would pass its limit {fault.limit * scale:.1f} {unit}, by {past * scale:.1f} {unit}"


def _swings_out(arm: Arm, trajectory: Trajectory) -> _Stop | None:
    """Return the limit that the joints pass between two knots which keep it, if there is one."""
    for extreme in trajectory.extremes(0):
        for fault in violations(arm, extreme):
            looks = trajectory(trajectory.times)[:, fault.joint - 1]
            nearest = int(np.abs(looks - fault.value).argmin())
            return _Stop("limits", str(fault), fault.joint, float(trajectory.times[nearest]))
    return None


def _strays(solver: Solver, hand: HandPath, trajectory: Trajectory, bounds: HandBounds, allowed: float) -> Strays:
    """Return how far the hand strays from its path on every interval.

    Both are 0 at the knots. Between two looks a time d apart a curve leaves its chord by no more than d²/8 times its
    greatest acceleration; that of the difference is no greater than those of hand and path together.
    """
    h = np.diff(trajectory.times)
    middles = (trajectory.times[1:] + trajectory.times[:-1]) / 2
    on_path = np.clip(np.searchsorted(hand.knots, middles, side="right") - 1, 0, len(hand.knots) - 2)
    pull = bounds.pull + hand.acceleration()[on_path]
    path_spin, path_change = (bound[on_path] for bound in hand.spin())
    # The second derivative of the vector part of a unit quaternion: half the acceleration, a quarter of the speed².
    spin = (bounds.spin_change + path_change + bounds.spin * path_spin) / 2 + (bounds.spin + path_spin) ** 2 / 4
    wanted = np.sqrt(np.maximum(pull, 2 * spin / TURN_PER_METRE) / (8 * _ADDED * allowed)) * h
    looks = int(min(max(math.ceil(wanted.max()), 2), _LOOKS))
    part = (np.arange(looks + 1) / looks)[:, None]
    t = (trajectory.times[:-1] + part * h).clip(0.0, trajectory.duration)
    q = np.stack([evaluate(trajectory.coefficients, (p * h)[:, None]) for p in part])
    X, wanted_X = solver.forward(q), hand(t)
    off = np.linalg.norm(X[..., :3, 3] - wanted_X[..., :3, 3], axis=-1)
    half = half_sines(wanted_X[..., :3, :3], X[..., :3, :3]).max(axis=0)
    between = (h / looks) ** 2 / 8
    return Strays(
        place=off.max(axis=0) + between * pull,
        turn=2 * np.arcsin(np.minimum(half + between * spin, 1.0)),
        seen=off.max(axis=0),
        seen_turn=2 * np.arcsin(np.minimum(half, 1.0)),
        times=t[off.argmax(axis=0), np.arange(len(h))],
        looks=looks,
    )


def _rate(t: Array, q: Array) -> Array:
    """Return the rate (n,) at the first of four equally spaced knots or more: that of the cubic through them."""
    return np.asarray((-11 * q[0] + 18 * q[1] - 9 * q[2] + 2 * q[3]) / (6 * (t[1] - t[0])))


def _place(hand: HandPath, times: Array, t: float) -> str:
    x, y, z = hand(t)[:3, 3] * 1e3
    way = int(np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2))
    return f"at {t:.3f} s, between poses {way + 1} and {way + 2}, ({x:.1f}, {y:.1f}, {z:.1f}) mm from the base,"
