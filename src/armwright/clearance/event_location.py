"""The part of a compiled simulation that locates impacts of journals within a step.

The law of an impact divides by the speed with which the journal came. Without this part a simulation takes that speed
at the end of the step of the impact, when the wall has already reduced it. With it such a step is repeated in two
parts: the first ends where the depth is 0, and the speed there is the impact speed. That time follows from the cubic
through depth and rate at both ends of the step, and from one correction by Newton's method. Impacts of two pins in one
step are located one after the other.

All lanes make the parts together; those without an impact are reset, so that their bits do not change.

The functions are emitted for a linkage, see ``lane_layout``. What they share: ``x``, ``y``, ``state`` and ``change``
are those of the loop; ``table`` holds the drives and ``h`` is the length of the step; ``done`` (LANES,) is the fraction
of the step that each lane has completed, ``part`` (LANES,) the fraction it makes next, and ``hit`` (LANES,) the pin
with an impact in it, or -1; ``walls`` are those of worn pins.
"""

from __future__ import annotations

import numpy as np

from armwright.arrays import Array
from armwright.clearance.lane_layout import (
    COLUMNS,
    FIRST_DEPTH,
    FIRST_DRIVE,
    FIRST_MEMORY,
    LANES,
    PINS,
    RK4,
    STAGES,
    STATES,
    Integers,
    N,
    rates,
)


def resolve_impacts(
    x: Array,
    y: Array,
    state: Array,
    before: Array,
    after: Array,
    change: Array,
    depths: Array,
    done: Array,
    part: Array,
    hit: Integers,
    table: Array,
    lengths: Array,
    step: int,
    walls: Array,
    counts: Integers,
    row: Integers,
    runs: int,
) -> None:
    """Repeat the step before ``step`` for the lanes with impacts, and count the impacts of the first runs."""
    steps, h = table.shape[0], lengths[step - 1]
    ending = np.zeros(LANES)
    done[:] = 0.0
    for _ in range(PINS):
        if find_impacts(x, y, depths, done, part, hit, h) == 0:
            break
        locate_impacts(x, y, state, before, after, change, depths, done, part, hit, table, step - 1, h, walls)
        for k in range(LANES):
            if hit[k] >= 0 and k < runs:
                counts[row[k], hit[k]] += 1
            ending[k] = 1.0 if step == steps else 0.0
        evaluate(x, y, state, table, min(step, steps - 1), ending, walls)


def set_drives(x: Array, table: Array, step: int, k: int, moment: float) -> None:
    """Set the drives of a lane at a fraction of a step: a parabola through the three moments of the table."""
    for i in range(COLUMNS):
        a, b, c = table[step, 0, i], table[step, 1, i], table[step, 2, i]
        bent = 2.0 * (a - 2.0 * b + c)
        x[(FIRST_DRIVE + i) * LANES + k] = a + moment * (c - a - bent + moment * bent)


def evaluate(x: Array, y: Array, state: Array, table: Array, step: int, moment: Array, walls: Array) -> None:
    """Evaluate the equations at the state, each lane at its own fraction of a step."""
    for k in range(LANES):
        set_drives(x, table, step, k, moment[k])
    for j in range(STATES * LANES):
        x[j] = state[j]
    rates(x, y, walls)


def make_part(
    x: Array,
    y: Array,
    state: Array,
    change: Array,
    table: Array,
    step: int,
    h: float,
    done: Array,
    part: Array,
    walls: Array,
) -> None:
    """Integrate each lane over its part of a step."""
    for stage in range(STAGES):
        ahead = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
        for k in range(LANES):
            set_drives(x, table, step, k, done[k] + ahead * part[k])
        for i in range(STATES):
            for k in range(LANES):
                j = i * LANES + k
                x[j] = state[j] + (ahead * h * part[k] * y[j] if stage > 0 else 0.0)
        rates(x, y, walls)
        if RK4:
            weight = 1.0 if stage in {0, 3} else 2.0
            for j in range(STATES * LANES):
                change[j] = y[j] if stage == 0 else change[j] + weight * y[j]
    add_part(y, state, change, h, part)


def add_part(y: Array, state: Array, change: Array, h: float, part: Array) -> None:
    """Move the state of each lane on by its part of a step."""
    if RK4:
        for i in range(STATES):
            for k in range(LANES):
                state[i * LANES + k] += h * part[k] / 6.0 * change[i * LANES + k]
    else:
        for i in range(N, STATES):
            for k in range(LANES):
                state[i * LANES + k] += h * part[k] * y[i * LANES + k]
        for i in range(N):
            for k in range(LANES):
                state[i * LANES + k] += h * part[k] * state[(N + i) * LANES + k]


def crossing_fraction(d0: float, r0: float, d1: float, r1: float) -> float:
    """Return the fraction of an interval at which a depth passes 0, from depths and rates at both ends.

    The straight line between the depths is where the search for the root of their cubic begins.
    """
    bent, twisted = 3.0 * (d1 - d0) - 2.0 * r0 - r1, r0 + r1 - 2.0 * (d1 - d0)
    fraction = d0 / (d0 - d1)
    for _ in range(4):
        depth = d0 + fraction * (r0 + fraction * (bent + fraction * twisted))
        rate = r0 + fraction * (2.0 * bent + fraction * 3.0 * twisted)
        if rate > 0.0:
            fraction = min(1.0, max(0.0, fraction - depth / rate))
    return fraction


def find_impacts(x: Array, y: Array, depths: Array, done: Array, part: Array, hit: Integers, h: float) -> int:
    """Find the first impact of each lane since ``done``, and its fraction of the step; return how many lanes have one.

    ``depths`` (2 · PINS · LANES,) are the depths, and their rates, that the pins had then.
    """
    count = 0
    for k in range(LANES):
        hit[k], part[k] = -1, 0.0
        for i in range(PINS):
            if y[(STATES + 3 * i) * LANES + k] > x[(FIRST_MEMORY + 2 * i) * LANES + k]:
                remaining = (1.0 - done[k]) * h
                j = (FIRST_DEPTH + 2 * i) * LANES + k
                d0, r0 = depths[2 * i * LANES + k], depths[(2 * i + 1) * LANES + k]
                fraction = (1.0 - done[k]) * crossing_fraction(d0, r0 * remaining, y[j], y[j + LANES] * remaining)
                if hit[k] < 0 or fraction < part[k]:
                    hit[k], part[k] = i, fraction
        if hit[k] >= 0:
            count += 1
    return count


def locate_impacts(
    x: Array,
    y: Array,
    state: Array,
    before: Array,
    after: Array,
    change: Array,
    depths: Array,
    done: Array,
    part: Array,
    hit: Integers,
    table: Array,
    step: int,
    h: float,
    walls: Array,
) -> None:
    """Repeat a step from the state ``before``, up to the impacts and from there to its end."""
    after[:] = state
    moment = np.zeros(LANES)
    for correction in range(2):
        state[:] = before
        make_part(x, y, state, change, table, step, h, done, part, walls)
        for k in range(LANES):
            moment[k] = done[k] + part[k]
        evaluate(x, y, state, table, step, moment, walls)
        if correction == 0:
            correct(y, done, part, hit, h)
    for k in range(LANES):
        if hit[k] >= 0:
            pin = hit[k]
            x[(FIRST_MEMORY + 2 * pin) * LANES + k] = 1.0
            x[(FIRST_MEMORY + 2 * pin + 1) * LANES + k] = y[(STATES + 3 * pin + 1) * LANES + k]
            done[k] = moment[k]
            part[k] = 1.0 - done[k]
            for i in range(2 * PINS):
                depths[i * LANES + k] = y[(FIRST_DEPTH + i) * LANES + k]
            for i in range(STATES):
                before[i * LANES + k] = state[i * LANES + k]
    make_part(x, y, state, change, table, step, h, done, part, walls)
    for k in range(LANES):
        if hit[k] < 0:
            for i in range(STATES):
                state[i * LANES + k] = after[i * LANES + k]


def correct(y: Array, done: Array, part: Array, hit: Integers, h: float) -> None:
    """Correct the parts by one Newton step on the depth at their ends."""
    for k in range(LANES):
        if hit[k] >= 0:
            j = (FIRST_DEPTH + 2 * hit[k]) * LANES + k
            if y[j + LANES] > 0.0:
                part[k] = min(1.0 - done[k], max(0.0, part[k] - y[j] / (y[j + LANES] * h)))
