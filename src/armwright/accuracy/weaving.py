"""Weaving: how far stroke and frequency of a swinging run are from the commanded ones, WS and WF."""

from collections.abc import Sequence

import attrs
import numpy as np

from armwright.accuracy.cycles import check_cycles
from armwright.accuracy.trace import Trace, frozen_array, refuse_mixed_dimensions
from armwright.arrays import Array, positive, reduce_by_fields
from armwright.errors import InvalidValueError

# A swing turns round where it has come back by this part of the whole width: more than from the middle to a side.
_REVERSAL_SHARE = 0.6


@attrs.frozen(kw_only=True, eq=False)
class WeavingDeviation:
    """How far a weave is from the commanded one.

    Attributes:
        stroke: WS, attained less commanded stroke, in parts of the commanded one.
        frequency: WF, attained less commanded frequency, in parts of the commanded one.
        commanded_stroke: W_c, from side to side [m].
        commanded_frequency: f_c [Hz].
        strokes: (n,) mean stroke of each cycle [m].
        frequencies: (n,) of each cycle [Hz].
        cycles: n.
    """

    stroke: float
    frequency: float
    commanded_stroke: float
    commanded_frequency: float
    strokes: Array = attrs.field(converter=frozen_array)
    frequencies: Array = attrs.field(converter=frozen_array)
    cycles: int

    __reduce__ = reduce_by_fields


def weaving_deviation(commanded: Trace, runs: Sequence[Trace], speed: float, *, few: bool = False) -> WeavingDeviation:
    """Return WS and WF of a weave.

    The commanded frequency is the speed along the middle line over the length of one weave; the standard writes it as
    ten times the speed over the length of ten weaves.

    Args:
        commanded: the corners of the weave, from the first to the last point of its middle line.
        runs: what was measured, with times.
        speed: the commanded one along the middle line [m/s].
        few: take fewer than 3 cycles.

    Raises:
        KindError: the speed is not a number.
        ShapeError: path and runs have different numbers of columns.
        InvalidValueError: there are too few cycles, the speed is not above 0, something does not weave or has no times.

    Source:
        ISO 9283:1998, 11.
    """
    count = check_cycles("weaving", [len(runs)], few=few, least=1)
    refuse_mixed_dimensions([commanded.positions, *(run.positions for run in runs)], "weaving")
    speed = positive(speed, "weaving: the commanded speed", "m/s")
    line = commanded.positions[-1] - commanded.positions[0]
    if not np.linalg.norm(line) > 0:
        raise InvalidValueError("weaving: the commanded weave ends at its start, so it has no centre line")
    forward = line / np.linalg.norm(line)
    sideways = _weaving_direction(commanded.positions - commanded.positions[0], forward)
    swings, reversals = _strokes_and_reversals(commanded.positions @ sideways, "the commanded path")
    stations = (commanded.positions @ forward)[reversals]
    pitch = 2 * (stations[-1] - stations[0]) / (len(reversals) - 1)
    if not pitch > 0:
        raise InvalidValueError("weaving: the commanded weave does not advance along its centre line")
    strokes, frequencies = [], []
    for j, run in enumerate(runs):
        widths, extremes = _strokes_and_reversals(run.positions @ sideways, f"run {j + 1}")
        t = run.timed(f"weaving: run {j + 1}")[extremes]
        strokes.append(float(widths.mean()))
        frequencies.append(float((len(extremes) - 1) / (2 * (t[-1] - t[0]))))
    stroke, frequency = float(swings.mean()), float(speed / pitch)
    return WeavingDeviation(
        stroke=float(np.mean(strokes)) / stroke - 1,
        frequency=float(np.mean(frequencies)) / frequency - 1,
        commanded_stroke=stroke,
        commanded_frequency=frequency,
        strokes=strokes,
        frequencies=frequencies,
        cycles=count,
    )


def _weaving_direction(relative: Array, forward: Array) -> Array:
    """Return the direction across the middle line in which a weave is widest."""
    across = relative - (relative @ forward)[:, None] * forward
    _, widths, axes = np.linalg.svd(across - across.mean(axis=0), full_matrices=False)
    if not widths[0] > 0:
        raise InvalidValueError("weaving: the commanded path is a straight line, not a weave")
    return np.asarray(axes[0])


def _strokes_and_reversals(offsets: Array, name: str) -> tuple[Array, Array]:
    """Return the widths from side to side and the samples at which a run reverses.

    Raises:
        InvalidValueError: there are fewer than three reversals.
    """
    back = _REVERSAL_SHARE * np.ptp(offsets)
    reversals: list[int] = []
    low = high = 0
    rising: bool | None = None
    for i, value in enumerate(offsets.tolist()):
        low = i if value < offsets[low] else low
        high = i if value > offsets[high] else high
        if rising is not False and value < offsets[high] - back:
            reversals.append(high)
            rising, low = False, i
        elif rising is not True and value > offsets[low] + back:
            reversals.append(low)
            rising, high = True, i
    if len(reversals) < 3:
        raise InvalidValueError(f"weaving: {name} reverses {len(reversals)} times; expected at least three reversals")
    extremes = np.array(reversals)
    return np.abs(np.diff(offsets[extremes])), extremes
