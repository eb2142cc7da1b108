"""The loop of a compiled simulation: many runs of one linkage side by side, step by step.

A run keeps its bits whatever runs beside it: no lane reads another. The functions are emitted for a linkage, see
``lane_layout``.
"""

from __future__ import annotations

import numpy as np

from armwright.arrays import Array
from armwright.clearance.event_location import resolve_impacts
from armwright.clearance.lane_layout import (
    COLUMNS,
    FIRST_DEPTH,
    FIRST_DRIVE,
    FIRST_GAIN,
    FIRST_MEMORY,
    FIRST_PARAMETER,
    GAINS,
    INPUTS,
    LANES,
    LOCATED,
    MEMORY,
    OUTPUTS,
    PARAMETERS,
    PINS,
    RK4,
    STAGES,
    STATES,
    Integers,
    N,
    rates,
)

# After so many steps a simulation checks whether it is cancelled.
CHECK_EVERY = 1024


def simulate(
    first: int,
    last: int,
    start: Array,
    contacts: Array,
    gains: Array,
    table: Array,
    lengths: Array,
    sample_at: Integers,
    walls: Array,
    samples: Array,
    counts: Integers,
    peaks: Array,
    called_off: Integers,
) -> None:
    """Simulate runs ``first`` to ``last``.

    Args:
        first: number of the first run.
        last: number behind the last run.
        start: (runs, STATES) the states at the start.
        contacts: (runs, PARAMETERS) of the pins.
        gains: (runs, GAINS) of the controllers.
        table: (steps, 3, COLUMNS) the drives at the start, the middle and the end of each step.
        lengths: (steps,) of the steps [s].
        sample_at: (steps + 1,) the number of the sample that is taken at each step, or -1.
        walls: those of worn pins; empty where pins are round.
        samples: (runs, ..., STATES + PINS) to fill: states, and the normal force of each pin.
        counts: (runs, PINS) to fill: impacts.
        peaks: (runs, PINS) to fill: largest normal forces.
        called_off: (1,) 0 until the simulation is to end without a result.
    """
    steps = table.shape[0]
    x = np.zeros(INPUTS * LANES)
    y = np.zeros(OUTPUTS * LANES)
    state = np.zeros(STATES * LANES)
    change = np.zeros(STATES * LANES)
    row = np.zeros(LANES, dtype=np.int64)
    before, after = np.zeros(STATES * LANES), np.zeros(STATES * LANES)
    depths = np.zeros(2 * PINS * LANES)
    done, part = np.zeros(LANES), np.zeros(LANES)
    hit = np.zeros(LANES, dtype=np.int64)
    for begin in range(first, last, LANES):
        begin_lanes(begin, last, row, x, state, start, contacts, gains, counts, peaks)
        y[:] = 0.0
        for step in range(steps + 1):
            if step % CHECK_EVERY == 0 and called_off[0] != 0:
                return
            now = min(step, steps - 1)
            h = lengths[now]
            for stage in range(STAGES):
                begin_stage(stage, step, now, h, x, y, state, table)
                rates(x, y, walls)
                if stage == 0:
                    if LOCATED:
                        if step > 0:
                            lanes = (x, y, state, before, after, change, depths, done, part, hit)
                            resolve_impacts(*lanes, table, lengths, step, walls, counts, row, last - begin)
                        before[:] = state
                        for j in range(2 * PINS * LANES):
                            depths[j] = y[FIRST_DEPTH * LANES + j]
                    remember(step, begin, last, row, x, y, counts, peaks)
                    if sample_at[step] >= 0:
                        take_sample(sample_at[step], begin, last, row, state, y, samples)
                    if step == steps:
                        break
                if RK4:
                    add_stage(stage, change, y)
            if step < steps:
                add_step(h, state, change, y)


def begin_lanes(
    begin: int,
    last: int,
    row: Integers,
    x: Array,
    state: Array,
    start: Array,
    contacts: Array,
    gains: Array,
    counts: Integers,
    peaks: Array,
) -> None:
    """Load the lanes with the runs from ``begin`` on; lanes that are left over run the last run once more."""
    for k in range(LANES):
        row[k] = min(begin + k, last - 1)
        for i in range(STATES):
            state[i * LANES + k] = start[row[k], i]
        for i in range(PARAMETERS):
            x[(FIRST_PARAMETER + i) * LANES + k] = contacts[row[k], i]
        for i in range(GAINS):
            x[(FIRST_GAIN + i) * LANES + k] = gains[row[k], i]
        for i in range(MEMORY):
            x[(FIRST_MEMORY + i) * LANES + k] = 0.0
        for i in range(PINS):
            peaks[row[k], i] = 0.0
            counts[row[k], i] = 0


def begin_stage(stage: int, step: int, now: int, h: float, x: Array, y: Array, state: Array, table: Array) -> None:
    """Set drives and state to those at which a stage evaluates the rates; behind the last step, to its end."""
    moment = 2 if step == table.shape[0] else (stage + 1) // 2
    ahead = 0.0 if stage == 0 else (h if stage == 3 else 0.5 * h)
    for k in range(LANES):
        for i in range(COLUMNS):
            x[(FIRST_DRIVE + i) * LANES + k] = table[now, moment, i]
    for j in range(STATES * LANES):
        x[j] = state[j] + ahead * y[j]


def remember(
    step: int, begin: int, last: int, row: Integers, x: Array, y: Array, counts: Integers, peaks: Array
) -> None:
    """Remember the pins in contact and their impact speeds, count the impacts and update the largest forces."""
    for i in range(PINS):
        for k in range(LANES):
            touching = y[(STATES + 3 * i) * LANES + k]
            # A contact at the start is no impact.
            if step > 0 and touching > x[(FIRST_MEMORY + 2 * i) * LANES + k] and begin + k < last:
                counts[row[k], i] += 1
            x[(FIRST_MEMORY + 2 * i) * LANES + k] = touching
            x[(FIRST_MEMORY + 2 * i + 1) * LANES + k] = y[(STATES + 3 * i + 1) * LANES + k]
            normal = y[(STATES + 3 * i + 2) * LANES + k]
            if normal > peaks[row[k], i]:  # noqa: PLR1730 - a NaN is no largest force
                peaks[row[k], i] = normal


def take_sample(sample: int, begin: int, last: int, row: Integers, state: Array, y: Array, samples: Array) -> None:
    """Store the states and the normal force of each pin as one sample."""
    for k in range(min(LANES, last - begin)):
        for i in range(STATES):
            samples[row[k], sample, i] = state[i * LANES + k]
        for i in range(PINS):
            samples[row[k], sample, STATES + i] = y[(STATES + 3 * i + 2) * LANES + k]


def add_stage(stage: int, change: Array, y: Array) -> None:
    """Add the rates of a stage to the change of the step, in the weights of Runge and Kutta."""
    if stage == 0:
        for j in range(STATES * LANES):
            change[j] = y[j]
    else:
        weight = 1.0 if stage == 3 else 2.0
        for j in range(STATES * LANES):
            change[j] += weight * y[j]


def add_step(h: float, state: Array, change: Array, y: Array) -> None:
    """Move the state on by one step; with the semi-implicit integrator the new velocities move the coordinates."""
    if RK4:
        sixth = h / 6.0
        for j in range(STATES * LANES):
            state[j] += sixth * change[j]
    else:
        for j in range(N * LANES, STATES * LANES):
            state[j] += h * y[j]
        for j in range(N * LANES):
            state[j] += h * state[N * LANES + j]
