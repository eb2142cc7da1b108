"""How fast to run along a path of the joints: as fast as limits allow, with continuous acceleration.

The path is a trajectory q(s) whose second derivative is continuous; what it calls time is a mere parameter s. First
the fastest run on a grid is found, whose s'' is constant from one place of the grid to the next. Then s(t) is averaged
over a moving window of time, which leaves a cubic on each piece and makes s'' continuous, from rest to rest. Where
averaging has carried the joints over a limit, the limit is drawn tighter there and the run is found again. The result
q(s(t)) is a polynomial on each piece, of exactly the same path.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.motion.certificate import LimitName
from armwright.motion.forward_backward import Bounds, largest_squares
from armwright.motion.polynomials import composed, derivative, evaluate, shifted
from armwright.motion.trajectory import Trajectory

# From rest to the full speed of the path takes no less than this, whatever the joints can do [s].
_RAMP = 0.05
# Windows that are tried, the smoothest first [s]; a shorter one is taken where the run is shorter by this part.
_WINDOWS = tuple(0.08 * 2.0**-k for k in range(12))
_WORTH = 0.01
# Rounds of drawing limits tighter where they are passed; what is left, less than this, is taken off by slowing all.
_ROUNDS, _PASSED = 4, 0.02
# Parts of an interval where its bounds are kept, and parts of a piece where the limits are looked at.
_PARTS, _SEEN = (0.0, 0.5, 1.0), (0.0, 0.25, 0.5, 0.75, 1.0)
# Two breaks nearer than this part of the duration are one; halvings to find where a knot is passed.
_SAME, _HALVINGS = 1e-10, 60
# A joint that uses this part of what the fullest limit uses binds.
_BINDS = 0.95


class Timed(NamedTuple):
    """A run along a path.

    Attributes:
        trajectory: of the joints, at rest and without acceleration at both ends.
        factor: how many times longer it takes than a run at full speed that no joint limits.
        because: which limit, and which joint, from 0, binds longest; None where the joints do not slow it.
    """

    trajectory: Trajectory
    factor: float
    because: tuple[LimitName, int] | None


class _Run(NamedTuple):
    """A run of which the limits have been looked at.

    Attributes:
        trajectory: of the joints.
        intervals: (p,) on which interval of the path each of its p pieces is.
        uses: (p, 1 + 2 n) the largest part of its limits that each piece uses: the speed on the path, the speeds and
            the roots of the accelerations of the joints.
    """

    trajectory: Trajectory
    intervals: npt.NDArray[np.intp]
    uses: Array

    @property
    def slowing(self) -> float:
        """How many times slower all must run to keep the limits where they were looked at."""
        return max(1.0, float(self.uses.max()))

    @property
    def duration(self) -> float:
        """How long it takes, slowed to keep the limits [s]."""
        return self.trajectory.duration * self.slowing


def timed(arm: Arm, path: Trajectory, caps: Array) -> Timed:
    """Return a run along a path, from rest to rest, inside the limits of speed and acceleration of the joints.

    Args:
        arm: the arm, with n joints.
        path: cubics with continuous second derivatives.
        caps: (m,) the largest s' on each of its m segments.
    """
    bounds = _bounds(arm, path, caps)
    best: _Run | None = None
    for window in _WINDOWS:
        run = _smoothed(arm, path, caps, bounds, window)
        if best is not None and run.duration > best.duration * (1 - _WORTH):
            break
        best = run
    assert best is not None  # noqa: S101 - there are windows
    trajectory = best.trajectory
    over = max(
        float((trajectory.peaks(1) / arm.limit("speed")).max()),
        math.sqrt(float((trajectory.peaks(2) / arm.limit("acceleration")).max())),
        float(best.uses[:, 0].max()),
        1.0,
    )
    free = float((np.diff(path.times) / caps).sum()) + _RAMP + _WINDOWS[0]
    trajectory = trajectory.slowed(over)
    factor = trajectory.duration / free
    return Timed(trajectory, factor, _binding(arm.n, best) if factor > 1 else None)


def _bounds(arm: Arm, path: Trajectory, caps: Array) -> Bounds:
    """Return bounds on x = s'² at the start of every segment, and on u = s'', that hold all along it."""
    lengths, terms = np.diff(path.times), path.coefficients
    speed, acceleration = arm.limit("speed"), arm.limit("acceleration")
    a, b = [np.full((len(lengths), 1), _RAMP)], [np.zeros((len(lengths), 1))]
    for part in _PARTS:
        at = (part * lengths)[:, None]
        rate, bend = evaluate(derivative(terms, 1), at), evaluate(derivative(terms, 2), at)
        # At this part of the segment x has grown by 2 u times the way.
        for on_u, on_x in (
            (0.0, 1 / caps[:, None] ** 2),
            (0.0, (rate / speed) ** 2),
            (rate / acceleration, bend / acceleration),
        ):
            a.append(on_u + on_x * 2 * at)
            b.append(on_x)
    on_u, on_x = np.concatenate(a, axis=1), np.concatenate(b, axis=1)
    return Bounds(on_u, on_x, np.zeros_like(on_u))


def _smoothed(arm: Arm, path: Trajectory, caps: Array, bounds: Bounds, window: float) -> _Run:
    """Return the fastest run averaged over a window, with bounds drawn tighter where that passes limits."""
    lengths = np.diff(path.times)
    tighter = np.ones((len(lengths), 1))
    best: _Run | None = None
    for _ in range(_ROUNDS):
        x = largest_squares(bounds._replace(a=bounds.a * tighter, b=bounds.b * tighter), lengths, (False, False))
        run = _looked_at(arm, path, caps, *_averaged(lengths, np.sqrt(x), window))
        if best is None or run.duration < best.duration:
            best = run
        if run.slowing <= 1 + _PASSED:
            break
        worst = np.ones(len(lengths))
        np.maximum.at(worst, run.intervals, run.uses.max(axis=1))
        tighter = tighter * worst[:, None] ** 2
    assert best is not None  # noqa: S101 - there is a round
    return best


def _averaged(lengths: Array, speeds: Array, window: float) -> tuple[Array, Array]:
    """Return s(t) averaged over a moving window of time: its breaks (k + 1,) and cubics (k, 4).

    Args:
        lengths: (m,) of the intervals in s.
        speeds: (m + 1,) s' at their ends; s'' is constant on each.
        window: [s].
    """
    steps = 2 * lengths / (speeds[1:] + speeds[:-1])
    t = np.concatenate([[0.0], np.cumsum(steps)])
    # The integral of s(t), on each interval, before the start and after the end.
    integral = np.zeros((len(lengths) + 2, 4))
    integral[1:-1, 1:3] = np.stack([np.cumsum(lengths) - lengths, speeds[:-1] / 2], axis=1)
    integral[1:-1, 3] = np.diff(speeds) / steps / 6
    grown = (((integral[1:-1, 3] * steps + integral[1:-1, 2]) * steps) + integral[1:-1, 1]) * steps
    integral[1:, 0] = np.concatenate([[0.0], np.cumsum(grown)])
    integral[-1, 1] = lengths.sum()
    begins = np.concatenate([[-window], t])
    breaks = _apart(np.concatenate([t, t + window]))
    middles = (breaks[1:] + breaks[:-1]) / 2

    def around(at: Array, within: Array) -> Array:
        piece = np.clip(np.searchsorted(begins, within, side="right") - 1, 0, len(integral) - 1)
        return shifted(integral[piece][..., None], at - begins[piece])[..., 0]

    ahead, behind = around(breaks[:-1], middles), around(breaks[:-1] - window, middles - window)
    return breaks, (ahead - behind) / window


def _looked_at(arm: Arm, path: Trajectory, caps: Array, breaks: Array, law: Array) -> _Run:
    """Return q(s(t)), cut where s(t) passes a knot of the path, and what it uses of the limits."""
    knots = path.times[1:-1]
    begins = np.maximum.accumulate(law[:, 0])
    piece = np.clip(np.searchsorted(begins, knots, side="right") - 1, 0, len(law) - 1)
    low, high = np.zeros(len(knots)), np.diff(breaks)[piece]
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        below = evaluate(law[piece][..., None], middle[:, None])[:, 0] < knots
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    times = _apart(np.concatenate([breaks, breaks[piece] + low]))
    middles = (times[1:] + times[:-1]) / 2
    piece = np.clip(np.searchsorted(breaks, middles, side="right") - 1, 0, len(law) - 1)
    inner = shifted(law[piece][..., None], times[:-1] - breaks[piece])
    there = evaluate(inner, (middles - times[:-1])[:, None])[:, 0]
    interval = np.asarray(
        np.clip(np.searchsorted(path.times, there, side="right") - 1, 0, len(caps) - 1), dtype=np.intp
    )
    inner[:, 0, 0] -= path.times[interval]
    trajectory = Trajectory(times=times, coefficients=composed(path.coefficients[interval], inner[..., 0]))
    terms, steps = trajectory.coefficients, np.diff(times)
    uses = np.zeros((len(steps), 1 + 2 * arm.n))
    for part in _SEEN:
        at = (part * steps)[:, None]
        along = evaluate(derivative(inner, 1), at) / caps[interval][:, None]
        speed = np.abs(evaluate(derivative(terms, 1), at)) / arm.limit("speed")
        acceleration = np.abs(evaluate(derivative(terms, 2), at)) / arm.limit("acceleration")
        uses = np.maximum(uses, np.concatenate([along, speed, np.sqrt(acceleration)], axis=1))
    return _Run(trajectory, interval, uses)


def _binding(joints: int, run: _Run) -> tuple[LimitName, int]:
    """Return which limit of which joint binds for the longest time."""
    steps, of_joints = np.diff(run.trajectory.times), run.uses[:, 1:]
    fullest = of_joints.argmax(axis=1)
    near = of_joints.max(axis=1) >= _BINDS * of_joints.max()
    counts = np.bincount(fullest[near], weights=steps[near], minlength=2 * joints)
    name, joint = divmod(int(counts.argmax()), joints)
    return ("acceleration" if name else "speed"), joint


def _apart(times: Array) -> Array:
    """Return times in order, without those that follow the one before at no distance; the last one stays."""
    times = np.sort(times)
    kept = np.diff(times) > _SAME * times[-1]
    inner = times[1:-1][kept[:-1]]
    if len(inner) and times[-1] - inner[-1] <= _SAME * times[-1]:
        inner = inner[:-1]
    return np.concatenate([times[:1], inner, times[-1:]])
