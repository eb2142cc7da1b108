"""A straight line that is moved sideways while an arm runs along it, as a sensor says.

With X(t) the pose of the tool on the line, e the side, and c(t) the offset, the tool goes along X(t) moved by c(t) e.
The offset follows what is asked for at a limited rate, averaged as in ``averaged_law``: so its acceleration is
continuous whatever is asked for from now on. Each time that another offset is asked for, the rest of the motion is
planned anew, and its limits are looked at before the arm runs it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.errors import ArmwrightError
from armwright.motion.averaged_law import WINDOW, AveragedLaw, averaged
from armwright.motion.chain import chain
from armwright.motion.controlled_stop import until_a_tick
from armwright.motion.knots import divided
from armwright.motion.limited import limited_efforts, limited_label, limited_motion, passed_limits
from armwright.motion.solver import AnyArm, Solver, solver_of
from armwright.motion.trajectory import Trajectory

# From rest to its full rate the offset takes so long, the shortest that keeps the limits [s].
_RAMPS = (0.1, 0.2, 0.4, 0.8)
# Offsets nearer than this are the same [m].
_SAME = 1e-7
# What would take longer than this is a slip of units [s].
_LONGEST = 3600.0
# Knots are put so far apart to begin with [s], and twice as close, so often, where the tool is farther off than so [m].
_STEP, _ROUNDS, NEAR = 0.02, 5, 1e-6
# Where an interval is looked at between its knots.
_LOOKS = np.linspace(0.0, 1.0, 5)[1:-1]
# What a limit may be exceeded by: rounding.
_ROUNDING = 1e-9


class CorrectionError(ArmwrightError, ValueError):
    """An arm cannot follow a correction; the text says why."""


@attrs.frozen(kw_only=True, eq=False)
class CorrectedLine:
    """A line with its offset; a value: what asks for another offset returns the next one.

    Attributes:
        line: of the joints, without an offset, to rest.
        start: when it began [s].
        side: (3,) where an offset leads, of length 1, in the base of the arm.
        rate: the largest change of the offset [m/s].
        bound: the largest offset [m].
        law: the offset by the time, before it is averaged.
        running: what the joints do.
        since: from when on [s].
    """

    line: Trajectory
    start: float
    side: Array
    rate: float
    bound: float
    law: AveragedLaw
    running: Trajectory
    since: float

    @classmethod
    def along(cls, line: Trajectory, start: float, side: Array, *, rate: float, bound: float) -> CorrectedLine:
        """Return a line that begins without an offset."""
        law = AveragedLaw(np.array([start]), np.zeros(1), np.zeros(1))
        return cls(line=line, start=start, side=side, rate=rate, bound=bound, law=law, running=line, since=start)

    @property
    def end(self) -> float:
        """When the arm is at rest [s]."""
        return self.since + self.running.duration

    def offset(self, now: float) -> float:
        """Return how far the tool is beside the line [m]."""
        return float(averaged(self.law, now)(0.0)[0])

    def toward(self, arm: AnyArm, offset: float, now: float, period: float) -> CorrectedLine:
        """Return the line whose offset goes to another one from now on; the line itself where it goes there already.

        Args:
            arm: the arm.
            offset: to go to [m].
            now: a whole number of servo periods [s].
            period: of the servo [s].

        Raises:
            CorrectionError: the arm cannot follow it within its limits.
        """
        if abs(offset - float(self.law.s[-1])) <= _SAME:
            return self
        solver, so_far, errors = solver_of(arm), self.law.until(now, now), list[CorrectionError]()
        for ramp in _RAMPS:
            law = _toward(so_far, offset, self.rate, self.rate / ramp)
            if errors and np.abs(law.s).max() > self.bound:
                # It would be braked too late.
                break
            try:
                return attrs.evolve(self, law=law, running=self._planned(solver, law, now, period), since=now)
            except CorrectionError as error:
                errors.append(error)
        raise errors[0]

    def _planned(self, solver: Solver, law: AveragedLaw, now: float, period: float) -> Trajectory:
        """Return what the joints do from now on."""
        done, local = now - self.start, now - self.since
        aside = averaged(law, now)
        duration = max(self.line.duration - done, float(law.t[-1]) + WINDOW - now)
        if duration > _LONGEST:
            raise CorrectionError(f"that would take {duration:.4g} s, and more than {_LONGEST:g} s are not planned")

        def course(t: Array) -> Array:
            X = np.asarray(solver.forward(self.line(np.minimum(done + t, self.line.duration)))).copy()
            X[:, :3, 3] += aside(np.minimum(t, aside.duration)) * self.side
            return X

        q, qd = self.running(local), self.running(local, 1)
        knots = np.linspace(0.0, duration, max(4, math.ceil(duration / _STEP)) + 1)
        for _ in range(_ROUNDS):
            X = course(knots)
            # What runs is this near to its course.
            X[0] = np.asarray(solver.forward(q[None]))[0]
            chained, failed = chain(solver, X, q)
            if failed is not None:
                raise CorrectionError("a pose beside the line is out of reach")
            motion = _spline(knots, chained, qd)
            t = (knots[:-1, None] + np.diff(knots)[:, None] * _LOOKS).ravel()
            off = np.linalg.norm(np.asarray(solver.forward(motion(t)))[:, :3, 3] - course(t)[:, :3, 3], axis=1)
            worst = off.reshape(-1, len(_LOOKS)).max(axis=1)
            if worst.max() <= NEAR:
                for fault in _faults(solver, motion):
                    raise CorrectionError(fault)
                return until_a_tick(motion, period)
            knots = divided(knots, np.where(worst > NEAR, 2, 1).astype(np.intp))
        raise CorrectionError("the arm is nearly singular beside the line")


def _toward(law: AveragedLaw, goal: float, rate: float, change: float) -> AveragedLaw:
    """Return a law that goes on from where it ends to a goal and rests there, at limited rates and changes of them."""
    v, way = float(law.v[-1]), goal - float(law.s[-1])
    sign = math.copysign(1.0, way - v * abs(v) / (2 * change))
    peak = sign * min(rate, math.sqrt(max(change * sign * way + v * v / 2, 0.0)))
    first, last = abs(peak - v) / change, abs(peak) / change
    between = way - (v + peak) / 2 * first - peak / 2 * last
    # Where it turns back it stands for a moment, as far out as it comes.
    turned = abs(v) / change if v * peak < 0 else 0.0
    phases = [(turned, 0.0), (first - turned, peak), (between / peak if peak else 0.0, peak), (last, 0.0)]
    t, s, rates = law.t.tolist(), law.s.tolist(), law.v.tolist()
    for length, after in phases:
        if length > _ROUNDING:
            t.append(t[-1] + length)
            s.append(s[-1] + (rates[-1] + after) / 2 * length)
            rates.append(after)
    s[-1], rates[-1] = goal, 0.0
    return AveragedLaw(np.array(t), np.array(s), np.array(rates))


def _spline(times: Array, q: Array, qd: Array) -> Trajectory:
    """Return the cubic spline through configurations (k, n), from a speed (n,) to rest."""
    from scipy.interpolate import CubicSpline  # noqa: PLC0415 - SciPy takes longer to import than all else

    spline = CubicSpline(times, q, bc_type=((1, qd), (1, np.zeros_like(qd))))
    return Trajectory.of_planner(times.copy(), np.ascontiguousarray(np.moveaxis(spline.c[::-1], 0, 1)))


def _faults(solver: Solver, motion: Trajectory) -> Iterator[str]:
    """Give the limits of joints and drives that a motion passes, in words."""
    arm, limits = solver.arm, solver.arm.all_limits
    yield from map(str, passed_limits(arm, motion))
    of_drives, t = limited_motion(arm, motion), motion.times
    tau = limited_efforts(arm, np.asarray(solver.inverse_dynamics(*(motion(t, order) for order in range(3)))))
    for what, peaks, most in (
        ("be too fast", of_drives.peaks(1), limits.speed),
        ("accelerate too much", of_drives.peaks(2), limits.acceleration),
        ("need too much effort", np.abs(tau).max(axis=0), limits.effort),
    ):
        if (peaks > most * (1 + _ROUNDING)).any():
            yield f"{limited_label(arm, int((peaks / most).argmax()))} would {what}"
