"""What motion.csv says, looked at from outside: by differences from tick to tick."""

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.motion.polynomials import derivative, extremes, shifted
from armwright.program.vm.recording import Recording, RunStage, motion_csv_lines

# What a limit may be exceeded by.
AT_MOST = 1.001
# What twelve digits leave in a difference over a tick, as a part of the limit.
ROUNDING = 1e-6
# A time this part of a period from a tick is on it.
_HAIR = 1e-6
# A motion this far from its plan has left it [rad] or [m].
_LEFT = 1e-9


@attrs.frozen(kw_only=True)
class Differences:
    """What differences over one tick come to at most, in any joint of any arm.

    Attributes:
        speed: of q, and qd itself, as a part of the limit.
        acceleration: of qd, and qdd itself, as a part of the limit.
        off: how far they are from the mean of both ends beyond what that changes by within the tick, as a part of the
            limit.
    """

    speed: float
    acceleration: float
    off: float

    def keep(self) -> bool:
        """Whether all limits are kept, and each column is the derivative of the one before it."""
        return max(self.speed, self.acceleration) <= AT_MOST and self.off <= ROUNDING

    def worst(self, other: "Differences") -> "Differences":
        """Return the larger of both in everything."""
        pairs = zip(attrs.astuple(self), attrs.astuple(other), strict=True)
        speed, acceleration, off = (max(pair) for pair in pairs)
        return Differences(speed=speed, acceleration=acceleration, off=off)


def differences(recording: Recording) -> Differences:
    """Return what differences over one tick come to in what a run writes into motion.csv."""
    rows = [line.split(",") for line in list(motion_csv_lines(recording.streams))[1:]]
    worst = Differences(speed=0.0, acceleration=0.0, off=0.0)
    for name in recording.cell.arms:
        worst = worst.worst(_of_arm(recording, name, [row for row in rows if row[1] == name]))
    return worst


def _of_arm(recording: Recording, name: str, rows: list[list[str]]) -> Differences:
    arm, period = recording.cell.arms[name].arm, recording.cell.period
    joints = (len(rows[0]) - 2) // 4
    table = np.array([[float(x or 0) for x in row[2:]] for row in rows])
    q, qd, qdd = (table[:, i * joints : i * joints + arm.n] for i in range(3))
    stages = [stage for stage in recording.stages if stage.arm == name]
    found, off = [], 0.0
    for order, value, slope in ((1, q, qd), (2, qd, qdd)):
        rate = np.diff(value, axis=0) / period
        limit = (arm.limits.speed, arm.limits.acceleration)[order - 1]
        found.append(float(max((np.abs(rate) / limit).max(initial=0.0), (np.abs(slope) / limit).max())))
        away = np.abs(rate - (slope[1:] + slope[:-1]) / 2)
        # What changes from one row to the next changes within the tick too; only where that is not enough, look closer.
        least = np.abs(np.diff(slope, axis=0))
        beyond = (away - least) / limit
        for tick in np.flatnonzero((beyond > ROUNDING).any(axis=1)).tolist():
            low, high = _range(stages, tick, period, order)
            # At the end of a stage the row says what comes just after it.
            ends = slope[tick : tick + 2]
            low, high = np.minimum(low, ends.min(axis=0)), np.maximum(high, ends.max(axis=0))
            beyond[tick] = (away[tick] - (high - low)) / limit
        off = max(off, float(beyond.max(initial=0.0)))
    assert not qd[-1].any()
    return Differences(speed=found[0], acceleration=found[1], off=off)


def _range(stages: list[RunStage], tick: int, period: float, order: int) -> tuple[Array | float, Array | float]:
    """Return the smallest and largest value (n,) of a derivative within a tick, with both sides of every knot in it."""
    for stage in stages:
        begin = tick - round(stage.t0 / period)
        if 0 <= begin < stage.duration / period - _HAIR:
            motion, start, end = stage.motion, begin * period, min((begin + 1) * period, stage.duration)
            inside = motion.times[(motion.times > start) & (motion.times < end)]
            cuts = np.concatenate([[start], inside, [end]])
            segments = np.searchsorted(motion.times, cuts[:-1], side="right") - 1
            terms = shifted(motion.coefficients[segments], cuts[:-1] - motion.times[segments])
            low, high = extremes(derivative(terms, order), np.diff(cuts))
            return low.min(axis=0), high.max(axis=0)
    return 0.0, 0.0


def share_at_stop(recording: Recording, stage: RunStage) -> float:
    """Return the largest part of a speed limit at the last tick at which a stage that was stopped kept to its plan."""
    planned, arm, period = stage.stage.trajectory, recording.cell.arms[stage.arm].arm, recording.cell.period
    ticks = np.arange(round(stage.duration / period) + 1) * period
    left = np.abs(stage.motion(ticks) - planned(ticks)).max(axis=1) > _LEFT
    last = ticks[max(0, int(left.argmax()) - 1)] if left.any() else 0.0
    return float((np.abs(planned(last, 1)) / arm.limits.speed).max())
