"""A motion of the tool to a goal that moves, and on with it.

The tool goes from what it did before (it rests, or goes with a frame already) to the moving goal on the straight line
between the two where they are at that moment: with A(t) and B(t) their poses,

    p(t) = p_A(t) + u(t) (p_B(t) - p_A(t)),    R(t) = R_A exp(u(t) log(R_A^T R_B))

where u is the quintic from 0 to 1 with no speed and acceleration at its ends. So speed and acceleration of the tool do
not jump, and from u = 1 on it is at the goal. Behind the time until which it follows, it comes smoothly to rest.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from armwright.arrays import Array
from armwright.errors import ArmwrightError
from armwright.motion.chain import chain
from armwright.motion.knots import divided
from armwright.motion.limited import limited_label, limited_motion, passed_limits
from armwright.motion.solver import AnyArm, Solver, solver_of
from armwright.motion.trajectory import Trajectory
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import angle_between, rotation_from_vector, rotation_vector

# The tool is kept as near as this to its goal between two knots [m], [rad].
_NEAR, _TURNED = 3e-7, 3e-6
# Knots are put so far apart to begin with [s], and where the tool is too far off into at most so many parts.
_STEP, _PARTS, _ROUNDS, _MAX_KNOTS = 0.02, 8, 12, 60_000
# Where an interval is looked at between its knots.
_LOOKS = np.linspace(0.0, 1.0, 6)[1:-1]
# The shortest way to the goal [s], and how much of a limit is used up.
_SHORTEST, _USED = 0.1, 0.9995
# How often the duration is made longer, by what part at least and at most, and to what [s].
_TRIES, _LONGER, _MUCH_LONGER, _LONGEST = 60, 1.02, 2.0, 120.0
# How long the tool takes to come to rest behind the end of the way, the shortest that keeps the limits [s].
_REST = (0.2, 0.4, 0.8, 1.6)
# What is followed less when the arm cannot go as far, and how often.
_LESS, _SHORTER = 0.9, 40
_OUT_OF_REACH = "a pose on the way is out of reach"


class MovingGoalError(ArmwrightError, ValueError):
    """An arm cannot come to a moving goal; the text says why."""


class CarriedPose(NamedTuple):
    """A pose that moves along a line, or stands.

    Attributes:
        pose: (4, 4) now, in the base of the arm.
        direction: (3,) of its motion, in the base of the arm.
        travel: returns how far it has come at times from now on [s], (k,) [m].
    """

    pose: Array
    direction: Array
    travel: Callable[[Array], Array]

    @classmethod
    def at_rest(cls, X: Array) -> CarriedPose:
        """Return a pose that stands."""
        return cls(X, np.zeros(3), np.zeros_like)

    def positions(self, t: Array) -> Array:
        """Return its positions (k, 3) at times (k,)."""
        return np.asarray(self.pose[:3, 3] + self.travel(t)[:, None] * self.direction)


class Pursuit(NamedTuple):
    """A motion to a moving goal and on with it.

    Attributes:
        trajectory: of the joints, to rest.
        reached: when the tool is at its goal [s].
        end: until when it follows it [s].
        cut: why it does not follow as far as it should; empty where it does.
    """

    trajectory: Trajectory
    reached: float
    end: float
    cut: str = ""


class Start(NamedTuple):
    """What an arm does when its tool sets out.

    Attributes:
        q: (n,) joint positions.
        qd: (n,) joint speeds.
        carried: where its tool would be later.
    """

    q: Array
    qd: Array
    carried: CarriedPose


class Way(NamedTuple):
    """When a moving goal is to be come to, and until when followed.

    Attributes:
        wait: before the tool sets out [s].
        end: until when the goal is followed [s]; at rest from then on where ``rests``.
        rests: whether the goal stands from ``end`` on.
        cuts: (k,) times at which its course changes its form [s].
        shortest: how long the tool is under way at least [s].
        slower: how many times as long as it could be.
        period: of the servo, of which it arrives after a whole number [s].
        fixed: how long it has to be under way [s]; None for as long as it takes.
    """

    wait: float
    end: float
    rests: bool
    cuts: Array
    shortest: float
    slower: float
    period: float
    fixed: float | None = None


class _Chase(NamedTuple):
    """A motion of the tool: from A to B between two times, on with B to the end, and to rest in a time."""

    A: CarriedPose
    B: CarriedPose
    wait: float
    reached: float
    end: float
    rest: float

    @property
    def duration(self) -> float:
        return self.end + self.rest

    def __call__(self, t: Array) -> Array:
        """Return the poses (k, 4, 4) at times (k,)."""
        x = np.clip((t - self.wait) / (self.reached - self.wait), 0.0, 1.0)
        u = x**3 * (10 + x * (6 * x - 15))
        start = self.A.positions(np.minimum(t, self.reached))
        p = start + u[:, None] * (self._goal(t) - start)
        R_A, R_B = self.A.pose[:3, :3], self.B.pose[:3, :3]
        return homogeneous(R_A @ rotation_from_vector(u[:, None] * rotation_vector(R_A.T @ R_B)), p)

    def _goal(self, t: Array) -> Array:
        p = self.B.positions(np.minimum(t, self.end))
        if self.rest:
            # At the end the goal has a speed, with which the tool runs out.
            h = 1e-4
            v = float(self.B.travel(np.array([self.end]))[0] - self.B.travel(np.array([self.end - h]))[0]) / h
            x = np.clip((t - self.end) / self.rest, 0.0, 1.0)
            p = p + (v * self.rest * (x - x**3 + x**4 / 2))[:, None] * self.B.direction
        return np.asarray(p)


def pursue(arm: AnyArm, start: Start, goal: CarriedPose, way: Way) -> Pursuit:
    """Return the motion of an arm to a moving goal and on with it, within the limits of its joints.

    The tool is within 1e-6 m of its goal from ``reached`` to ``end``; both hold at samples between the knots too.

    Args:
        arm: the arm.
        start: what it does now.
        goal: where its tool shall be.
        way: from when until when.

    Raises:
        MovingGoalError: the arm cannot come to the goal before the end, or not within its limits.
    """
    solver = solver_of(arm)
    duration = _shortest_way(solver, start, goal, way) if way.fixed is None else way.fixed
    # It rests on a tick, and follows for whole ticks.
    ticks, cut = way.end / way.period, ""
    end = (np.ceil(ticks) if way.rests else np.floor(ticks)) * way.period
    for _ in range(_SHORTER):
        reached = float(np.ceil((way.wait + duration) / way.period - 1e-6) * way.period)
        if reached >= end and not way.rests:
            reason = cut or "its goal leaves the window before"
            raise MovingGoalError(f"the arm needs {duration:.3f} s to come to its goal: {reason}")
        end = max(end, reached)
        for rest in (0.0,) if way.rests and not cut else _REST:
            found = _followed(solver, start, _Chase(start.carried, goal, way.wait, reached, end, rest), way.cuts)
            if isinstance(found, Trajectory) or found.time <= end:
                break
        if isinstance(found, Trajectory):
            return Pursuit(found, reached, end, cut)
        if found.time <= reached:
            if found.cause != "rate" or way.fixed is not None:
                raise MovingGoalError(found.reason)
            duration *= _LONGER
        else:
            ahead = np.floor(_LESS * (min(found.time, end) - reached) / way.period)
            cut, end = found.reason, reached + ahead * way.period
    raise MovingGoalError(cut or "the arm does not come to its goal within the limits of its joints")


class _Fault(NamedTuple):
    """What stops the arm, when [s], and why in words."""

    cause: str
    time: float
    reason: str


def _shortest_way(solver: Solver, start: Start, goal: CarriedPose, way: Way) -> float:
    """Return how long the tool has to be under way for the joints to keep their limits [s]."""
    duration = max(way.shortest, _SHORTEST)
    for _ in range(_TRIES):
        reached = way.wait + duration
        chase = _Chase(start.carried, goal, way.wait, reached, reached, 0.0)
        times = np.linspace(0.0, reached, max(40, int(reached / _STEP)))
        q, failed = chain(solver, chase(times), start.q)
        if failed is not None:
            raise MovingGoalError(f"the tool cannot come to its goal in a straight line: {_OUT_OF_REACH}")
        ratio = _ratios(solver, _spline(times, q, start.qd, at_rest=False)).max()
        if ratio <= 1:
            return max(duration * way.slower, way.shortest)
        duration *= min(max(ratio, _LONGER), _MUCH_LONGER)
        if duration > _LONGEST:
            break
    raise MovingGoalError("a joint would have to move too fast however long the tool is under way")


def _followed(solver: Solver, start: Start, chase: _Chase, cuts: Array) -> Trajectory | _Fault:
    """Return the joints that follow a motion of the tool, or what stops them."""
    inner = [chase.wait, chase.reached, chase.end, *cuts[(cuts > 0) & (cuts < chase.duration)]]
    marks = np.unique(np.clip([0.0, *inner, chase.duration], 0.0, chase.duration))
    marks = marks[np.append(True, np.diff(marks) > 1e-6)]
    knots = divided(marks, np.ceil(np.diff(marks) / _STEP).astype(np.intp))
    for _ in range(_ROUNDS):
        q, failed = chain(solver, chase(knots), start.q)
        if failed is not None:
            return _Fault("reach", float(knots[failed]), _OUT_OF_REACH)
        trajectory = _spline(knots, q, start.qd, at_rest=True)
        t = (knots[:-1, None] + np.diff(knots)[:, None] * _LOOKS).ravel()
        X, Y = solver.forward(trajectory(t)), chase(t)
        off = np.linalg.norm(X[:, :3, 3] - Y[:, :3, 3], axis=1) / _NEAR
        turned = angle_between(X[:, :3, :3], Y[:, :3, :3]) / _TURNED
        worst = np.maximum(off, turned).reshape(-1, len(_LOOKS)).max(axis=1)
        if worst.max() <= 1:
            return _limits_kept(solver, trajectory) or trajectory
        parts = np.where(worst > 1, np.clip(np.ceil(1.1 * worst**0.25), 2, _PARTS), 1).astype(np.intp)
        if parts.sum() > _MAX_KNOTS:
            break
        knots = divided(knots, parts)
    return _Fault("singular", float(knots[worst.argmax()]), "the arm is nearly singular on the way")


def _limits_kept(solver: Solver, trajectory: Trajectory) -> _Fault | None:
    """Return the first limit of a joint that a motion passes."""
    arm, times = solver.arm, trajectory.times
    ratios = _ratios(solver, trajectory)
    beyond = np.flatnonzero(ratios.max(axis=1) > 1 / _USED)
    faults = []
    if len(beyond):
        number = int(ratios[beyond[0]].argmax())
        faults.append(_Fault("rate", float(times[beyond[0]]), f"{limited_label(arm, number)} would be too fast"))
    for violation in passed_limits(arm, trajectory):
        low, high = arm.limits.lower, arm.limits.upper
        q = trajectory(times)
        outside = np.flatnonzero(((q < low) | (q > high)).any(axis=1))
        faults.append(_Fault("range", float(times[outside[0]]) if len(outside) else 0.0, str(violation)))
    return min(faults, key=lambda fault: fault.time, default=None)


def _ratios(solver: Solver, trajectory: Trajectory) -> Array:
    """Return (m, k) how many times its limit of speed or acceleration each joint or drive takes on each segment."""
    limits, motion = solver.arm.all_limits, limited_motion(solver.arm, trajectory)
    speed = motion.segment_peaks(1) / limits.speed
    acceleration = np.sqrt(motion.segment_peaks(2) / limits.acceleration)
    return np.asarray(np.maximum(speed, acceleration) / _USED)


def _spline(times: Array, q: Array, qd: Array, *, at_rest: bool) -> Trajectory:
    """Return the cubic spline through configurations (k, n), from a speed (n,) to rest or as the last cubics go on."""
    from scipy.interpolate import CubicSpline  # noqa: PLC0415 - SciPy takes longer to import than all else

    end = (1, np.zeros_like(qd)) if at_rest else "not-a-knot"
    spline = CubicSpline(times, q, bc_type=((1, qd), end))
    return Trajectory.of_planner(times.copy(), np.ascontiguousarray(np.moveaxis(spline.c[::-1], 0, 1)))
