"""A measured motion of joints beside the planned one: tracking errors, delays, and what is left without them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, finite_or_none
from armwright.errors import InvalidValueError, TooFewError
from armwright.files.logs.joint_log import JointStates
from armwright.files.result_table import ResultTable
from armwright.kinematics.forward_kinematics import forward

# Words in topics of motions that are planned.
PLANNED_WORDS = ("planned", "plan", "desired", "command", "commanded", "commands", "reference", "target", "setpoint")
_ROLES = (*PLANNED_WORDS, "measured", "actual", "feedback", "simulated")
# Delays that are looked for where both motions have the same clock [s], and instants that are compared for it.
_LONGEST_DELAY, _MAX_INSTANTS = 0.5, 20_000
# Share of the shorter motion that must overlap where clocks are brought together.
_LEAST_OVERLAP = 0.5
# Steps of a search that doubles its digits, and a joint that moves less than this is at rest [rad] or [m].
_MAX_STEPS, _STILL = 20, 1e-6


class MotionPair(NamedTuple):
    """Topics of a motion: where it was measured, and where it is planned; None where nothing is."""

    measured: str
    planned: str | None


@attrs.frozen(kw_only=True, eq=False)
class JointTracking:
    """How n joints followed a plan, at the k instants of the measurements within it.

    Attributes:
        names: of the joints.
        arm: the arm; None where it is not known, and then units are not either.
        t: (k,) times of the measurements [s].
        measured: (k, n) positions [rad] or [m].
        planned: (k, n) positions at the same times.
        offset: by how much the clock of the measurements is ahead of that of the plan [s]; 0 of one clock.
        delay: (n,) by how much each joint is late [s]; NaN of joints at rest.
        delay_deviation: (n,) standard deviation of the delay [s].
        left: (n,) root mean square of what is left without the delay and a constant [rad] or [m].
        tool_error: (k,) distance of the tool from where it was to be [m]; None where the arm is not known.
    """

    names: tuple[str, ...]
    arm: Arm | None
    t: Array
    measured: Array
    planned: Array
    offset: float
    delay: Array
    delay_deviation: Array
    left: Array
    tool_error: Array | None

    @property
    def error(self) -> Array:
        """Tracking error (k, n): measured less planned [rad] or [m]."""
        return np.asarray(self.measured - self.planned)

    @property
    def common_delay(self) -> float:
        """The mean of the delays, those that are known better counting more [s]; NaN where no joint moves."""
        known = np.isfinite(self.delay)
        if not known.any():
            return math.nan
        weights = 1.0 / np.maximum(self.delay_deviation[known], 1e-9) ** 2
        return float((weights * self.delay[known]).sum() / weights.sum())

    @property
    def notes(self) -> tuple[str, ...]:
        """How much was compared, the delay and the tool in words."""
        notes = [f"{len(self.t):,} instants from {self.t[0]:.3f} to {self.t[-1]:.3f} s"]
        if self.offset:
            notes.append(f"clocks brought together: the measurements begin {self.offset:+.4f} s later than the plan")
        if math.isfinite(self.common_delay):
            notes.append(f"delay of all joints {self.common_delay * 1e3:z.2f} ms")
        if self.tool_error is not None:
            worst = int(self.tool_error.argmax())
            rms = math.sqrt(float((self.tool_error**2).mean()))
            notes.append(
                f"tool within {self.tool_error[worst] * 1e3:.3g} mm of where it was to be (at {self.t[worst]:.3f} s), "
                f"root mean square {rms * 1e3:.3g} mm"
            )
        if self.arm is None:
            notes.append("the arm is not known, so neither are units: rad or m")
        return tuple(notes)

    def as_data(self) -> dict[str, Any]:
        """Return it as plain data in SI units, NaN as None."""
        joints = [
            {
                "name": name,
                "largest_error": self._largest()[i],
                "at": float(self.t[np.abs(self.error[:, i]).argmax()]),
                "rms_error": _rms(self.error[:, i]),
                "mean_error": float(self.error[:, i].mean()),
                "delay": finite_or_none(self.delay[i]),
                "delay_deviation": finite_or_none(self.delay_deviation[i]),
                "rms_without_delay": finite_or_none(self.left[i]),
            }
            for i, name in enumerate(self.names)
        ]
        tool = None if self.tool_error is None else float(self.tool_error.max())
        ends = {"from": float(self.t[0]), "to": float(self.t[-1]), "instants": len(self.t)}
        return {
            **ends,
            "offset": self.offset,
            "delay": finite_or_none(self.common_delay),
            "largest_tool_error": tool,
            "joints": joints,
        }

    def tables(self) -> Iterator[ResultTable]:
        """Yield the table of the joints."""
        rows = []
        for i, name in enumerate(self.names):
            error, unit, scale = self.error[:, i], "rad, m", 1.0
            if self.arm is not None:
                # Of angles, thousandths of a radian say more than degrees.
                unit, scale = ("mrad", 1e-3) if self.arm.joints[i].revolute else ("mm", 1e-3)
            late = "at rest" if math.isnan(self.delay[i]) else f"{self.delay[i] * 1e3:z.2f}"
            numbers = (self._largest()[i], _rms(error), float(error.mean()), float(self.left[i]))
            largest, rms, mean, left = (f"{value / scale:z.4g}" for value in numbers)
            rows.append((name, unit, largest, f"{self.t[np.abs(error).argmax()]:.3f}", rms, mean, late, left))
        heads = ("joint", "unit", "largest error", "at s", "rms", "mean", "delay ms", "rms without delay")
        yield ResultTable(title="Measured less planned", heads=heads, rows=rows, numbers=range(2, 8))

    def _largest(self) -> list[float]:
        """Return the error of the largest magnitude of each joint, with its sign."""
        rows = np.abs(self.error).argmax(axis=0)
        largest: list[float] = self.error[rows, np.arange(len(self.names))].tolist()
        return largest


def motion_pairs(topics: Sequence[str]) -> list[MotionPair]:
    """Return which topics of a log belong together, by words such as ``planned``, ``desired`` and ``measured``.

    A plan of nothing that was measured is left out.
    """
    planned = {_without_role(topic): topic for topic in topics if is_planned(topic)}
    measured = [topic for topic in topics if not is_planned(topic)]
    if len(planned) == len(measured) == 1:
        return [MotionPair(measured[0], next(iter(planned.values())))]
    return [MotionPair(topic, planned.get(_without_role(topic))) for topic in measured]


def is_planned(topic: str) -> bool:
    """Whether the name of a topic says that its motion is planned."""
    return any(word in PLANNED_WORDS for word in _words(topic))


def track_joints(
    planned: JointStates, measured: JointStates, *, arm: Arm | None = None, same_clock: bool = True
) -> JointTracking:
    """Compare a measured motion with the planned one.

    Args:
        planned: the plan.
        measured: what was measured, of the same joints: by their names, or in their order where all names differ.
        arm: the arm, for its units and its tool; its joints are those of the plan, in their order.
        same_clock: whether the times of both are comparable. Otherwise the motions are laid over one another where
            they fit best, and delays are relative to that.

    Raises:
        InvalidValueError: the joints are others, or the arm has another number of them.
        TooFewError: there are less than three instants at which both are known.
    """
    plan, seen = _same_joints(planned, measured)
    if arm is not None and arm.n != len(plan.names):
        raise InvalidValueError(f"{plan.topic}: {len(plan.names)} joints, but {arm.name} has {arm.n}")
    plan, seen = _known_rows(plan), _known_rows(seen)
    shift = 0.0 if same_clock else _best_shift(plan, seen)
    t = seen.t - shift
    rows = (t >= plan.t[0] - 1e-9) & (t <= plan.t[-1] + 1e-9)
    if rows.sum() < 3:
        raise TooFewError(
            f"{seen.topic}: {int(rows.sum())} instants within the plan of {plan.topic}; expected 3 or more"
        )
    t, q = t[rows], seen.q[rows]
    delays = [_delay(plan.t, column, t, q[:, j], plan.t[-1] - plan.t[0]) for j, column in enumerate(plan.q.T)]
    late, deviation, left = (np.array(values) for values in zip(*delays, strict=True))
    q_planned = _at(plan, t)
    tool = None
    if arm is not None:
        tool = np.linalg.norm(forward(arm, q)[:, :3, 3] - forward(arm, q_planned)[:, :3, 3], axis=1)
    return JointTracking(
        names=plan.names,
        arm=arm,
        t=t + shift,
        measured=q,
        planned=q_planned,
        offset=shift,
        delay=late,
        delay_deviation=deviation,
        left=left,
        tool_error=tool,
    )


# ---- inside ----------------------------------------------------------------------------------------------------------


def _words(topic: str) -> list[str]:
    return topic.lower().replace("/", "_").replace("-", "_").split("_")


def _without_role(topic: str) -> tuple[str, ...]:
    return tuple(word for word in _words(topic) if word not in _ROLES)


def _same_joints(planned: JointStates, measured: JointStates) -> tuple[JointStates, JointStates]:
    """Return the joints of the plan in both."""
    if set(planned.names) <= set(measured.names):
        return planned, measured.of_joints(planned.names)
    common = [name for name in planned.names if name in measured.names]
    if not common and len(planned.names) == len(measured.names):
        return planned, attrs.evolve(measured, names=planned.names)
    here, there = (", ".join(one.names[:8]) for one in (planned, measured))
    missing = [name for name in planned.names if name not in common]
    raise InvalidValueError(
        f"{planned.topic}, {measured.topic}: the joints differ: {missing[0]} is not among those measured; "
        f"planned {here}; measured {there}"
    )


def _known_rows(states: JointStates) -> JointStates:
    """Return the rows in which all positions are known, of the same time the last."""
    known = np.isfinite(states.q).all(axis=1) & np.isfinite(states.t)
    last = np.append(np.diff(states.t[known]) > 0, True)
    rows = np.flatnonzero(known)[last] if known.any() else np.empty(0, dtype=np.intp)
    if len(rows) < 3:
        raise TooFewError(f"{states.topic}: {len(rows)} instants with the positions of all joints; expected 3 or more")
    q, qd, tau = (values[rows] for values in (states.q, states.qd, states.tau))
    return attrs.evolve(states, t=states.t[rows], q=q, qd=qd, tau=tau)


def _at(states: JointStates, t: Array) -> Array:
    """Return positions (k, n) at some times, linear between rows."""
    return np.stack([np.interp(t, states.t, column) for column in states.q.T], axis=1)


def _delay(t: Array, plan: Array, t_seen: Array, seen: Array, duration: float) -> tuple[float, float, float]:
    """Return by how much a joint is late [s], the standard deviation of that, and the rms of what is left.

    Least squares in the delay and a constant, from the best of some delays on: Gauss-Newton, as the derivative of the
    plan by the delay is its speed.
    """
    if np.ptp(plan) < _STILL or np.ptp(seen) < _STILL:
        error = seen - np.interp(t_seen, t, plan)
        return math.nan, math.nan, _rms(error - error.mean())
    speed = np.gradient(plan, t)
    longest = min(_LONGEST_DELAY, duration / 4)
    inner = (t_seen >= t[0] + longest) & (t_seen <= t[-1] - longest)
    x, y = (t_seen[inner], seen[inner]) if inner.sum() > 10 and np.ptp(seen[inner]) > _STILL else (t_seen, seen)

    def errors(late: float, rows: slice = slice(None)) -> Array:
        error = y[rows] - np.interp(x[rows] - late, t, plan)
        return np.asarray(error - error.mean())

    few = slice(None, None, max(1, len(x) // _MAX_INSTANTS))
    late = min(
        np.linspace(-longest, longest, 201).tolist(), key=lambda one: (float((errors(one, few) ** 2).sum()), abs(one))
    )
    deviation = math.nan
    for _ in range(_MAX_STEPS):
        error = errors(late)
        slope = np.interp(x - late, t, speed)
        slope = slope - slope.mean()
        squares = float(slope @ slope)
        if squares <= 0.0:
            return math.nan, math.nan, _rms(error)
        step = float(-(slope @ error) / squares)
        deviation = math.sqrt(float(error @ error) / max(len(error) - 2, 1) / squares)
        late = float(np.clip(late + step, -longest, longest))
        if abs(step) < 1e-9:
            break
    within = (t_seen - late >= t[0]) & (t_seen - late <= t[-1])
    error = seen[within] - np.interp(t_seen[within] - late, t, plan)
    return late, deviation, _rms(error - error.mean())


def _best_shift(plan: JointStates, seen: JointStates) -> float:
    """Return by how much later the measurements show what the plan has [s]: where the mean square difference is least.

    The sums of all products of two sequences are a convolution, so that all shifts cost as much as a few.
    """
    from scipy.signal import fftconvolve  # noqa: PLC0415 - takes a tenth of a second

    ends = max(one.t[-1] - one.t[0] for one in (plan, seen))
    finest = min(float(np.median(np.diff(one.t))) for one in (plan, seen))
    dt = max(finest, float(ends) / _MAX_INSTANTS, 1e-6)
    grids = [np.arange(one.t[0], one.t[-1] + dt / 2, dt) for one in (plan, seen)]
    P, M = (_at(one, grid) for one, grid in zip((plan, seen), grids, strict=True))
    moving = np.ptp(P, axis=0) > _STILL
    if not moving.any():
        raise TooFewError(f"{plan.topic}: no joint moves, so that nothing brings the clocks of the two logs together")
    middle, scale = P.mean(axis=0), np.ptp(P, axis=0)
    P, M = ((Q[:, moving] - middle[moving]) / scale[moving] for Q in (P, M))
    ones_p, ones_m = np.ones(len(P)), np.ones(len(M))

    def sums(a: Array, b: Array) -> Array:
        """Return the sum of a[i] b[i + s] for every shift s, from -(len(a) - 1) on."""
        return np.asarray(fftconvolve(b, a[::-1]))

    overlap = np.round(sums(ones_p, ones_m))
    squares = sums((P**2).sum(axis=1), ones_m) + sums(ones_p, (M**2).sum(axis=1))
    products = sum(sums(P[:, j], M[:, j]) for j in range(P.shape[1]))
    enough = overlap >= max(_LEAST_OVERLAP * min(len(P), len(M)), 3)
    cost = np.where(enough, (squares - 2 * products) / np.maximum(overlap, 1), np.inf)
    best = int(cost.argmin()) - (len(P) - 1)
    shift = best * dt + float(grids[1][0] - grids[0][0])
    late = [
        _delay(plan.t, column, seen.t - shift, seen.q[:, j], float(plan.t[-1] - plan.t[0]))
        for j, column in enumerate(plan.q.T)
    ]
    known = [(value, 1 / max(spread, 1e-9) ** 2) for value, spread, _ in late if math.isfinite(value)]
    if known:
        finer = sum(value * weight for value, weight in known) / sum(weight for _, weight in known)
        shift += finer if abs(finer) < 10 * dt else 0.0
    return shift


def _rms(values: Array) -> float:
    return math.sqrt(float((values**2).mean()))
