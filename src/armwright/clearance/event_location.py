"""The part of a compiled simulation that finds where in a step a journal comes down on its wall.

The law of an impact divides by the speed with which the journal came. Without this part a simulation learns that speed
at the end of the step in which the journal came, when the wall has already taken some of it. With it such a step is
made again, in two parts: the first ends where the depth is 0, and there the speed is taken. The place comes of the
cubic through depth and rate at both ends of the step, and of a correction by Newton. Two pins that come down in
one step are found one after the other.

All lanes make the parts together, and those in which nothing came down are put back: they keep their bits.
"""

# What the simulation calls: the equations as a function, drives between the moments of the table, a part of a step.
FUNCTIONS = """
@njit(error_model="numpy")
def rates(x, y):
    for k in range({lanes}):
{body}


@njit(error_model="numpy")
def tell(x, table, step, k, moment):
    for i in range({columns}):
        a, b, c = table[step, 0, i], table[step, 1, i], table[step, 2, i]
        bent = 2.0 * (a - 2.0 * b + c)
        x[({first_drive} + i) * {lanes} + k] = a + moment * (c - a - bent + moment * bent)


@njit(error_model="numpy")
def look(x, y, state, table, step, moment):
    for k in range({lanes}):
        tell(x, table, step, k, moment[k])
    for j in range({states} * {lanes}):
        x[j] = state[j]
    rates(x, y)


@njit(error_model="numpy")
def go(x, y, state, change, table, step, h, done, part):
    for stage in range({stages}):
        at = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
        for k in range({lanes}):
            tell(x, table, step, k, done[k] + at * part[k])
        for i in range({states}):
            for k in range({lanes}):
                j = i * {lanes} + k
                x[j] = state[j] + (at * h * part[k] * y[j] if stage > 0 else 0.0)
        rates(x, y)
{advance}


@njit(error_model="numpy")
def crossed(d0, r0, d1, r1):
    # A cubic has its depths and rates; the straight line is where the search begins.
    bent, twisted = 3.0 * (d1 - d0) - 2.0 * r0 - r1, r0 + r1 - 2.0 * (d1 - d0)
    place = d0 / (d0 - d1)
    for _ in range(4):
        depth = d0 + place * (r0 + place * (bent + place * twisted))
        rate = r0 + place * (2.0 * bent + place * 3.0 * twisted)
        if rate > 0.0:
            place = min(1.0, max(0.0, place - depth / rate))
    return place


@njit(error_model="numpy")
def find(x, y, state, was, done, part, hit, h):
    # Of each lane the first pin that came down since the step began, and when; how many lanes there are.
    found = 0
    for k in range({lanes}):
        hit[k], part[k] = -1, 0.0
        for i in range({pins}):
            if y[({states} + 3 * i) * {lanes} + k] > x[({first_kept} + 2 * i) * {lanes} + k]:
                rest = (1.0 - done[k]) * h
                j = ({first_depth} + 2 * i) * {lanes} + k
                d0, r0 = was[2 * i * {lanes} + k], was[(2 * i + 1) * {lanes} + k]
                place = (1.0 - done[k]) * crossed(d0, r0 * rest, y[j], y[j + {lanes}] * rest)
                if hit[k] < 0 or place < part[k]:
                    hit[k], part[k] = i, place
        if hit[k] >= 0:
            found += 1
    return found


@njit(error_model="numpy")
def locate(x, y, state, before, after, change, was, done, part, hit, table, step, h):
    after[:] = state
    moment = np.zeros({lanes})
    for correction in range(2):
        state[:] = before
        go(x, y, state, change, table, step, h, done, part)
        for k in range({lanes}):
            moment[k] = done[k] + part[k]
        look(x, y, state, table, step, moment)
        for k in range({lanes}):
            if correction == 0 and hit[k] >= 0:
                j = ({first_depth} + 2 * hit[k]) * {lanes} + k
                if y[j + {lanes}] > 0.0:
                    place = part[k] - y[j] / (y[j + {lanes}] * h)
                    part[k] = min(1.0 - done[k], max(0.0, place))
    for k in range({lanes}):
        if hit[k] >= 0:
            pin = hit[k]
            x[({first_kept} + 2 * pin) * {lanes} + k] = 1.0
            x[({first_kept} + 2 * pin + 1) * {lanes} + k] = y[({states} + 3 * pin + 1) * {lanes} + k]
            done[k] = moment[k]
            part[k] = 1.0 - done[k]
            for i in range(2 * {pins}):
                was[i * {lanes} + k] = y[({first_depth} + i) * {lanes} + k]
            for i in range({states}):
                before[i * {lanes} + k] = state[i * {lanes} + k]
    go(x, y, state, change, table, step, h, done, part)
    for k in range({lanes}):
        if hit[k] < 0:
            for i in range({states}):
                state[i * {lanes} + k] = after[i * {lanes} + k]
"""

# Room for it.
ARRAYS = """
    before = np.zeros({states} * {lanes})
    after = np.zeros({states} * {lanes})
    was = np.zeros(2 * {pins} * {lanes})
    done = np.zeros({lanes})
    part = np.zeros({lanes})
    ending = np.zeros({lanes})
    hit = np.zeros({lanes}, dtype=np.int64)
"""

# After the equations have been looked at where a step ended: make it again where it has to be.
AGAIN = """
                if stage == 0 and step > 0:
                    done[:] = 0.0
                    for again in range({pins}):
                        if find(x, y, state, was, done, part, hit, lengths[step - 1]) == 0:
                            break
                        came = lengths[step - 1]
                        locate(x, y, state, before, after, change, was, done, part, hit, table, step - 1, came)
                        for k in range({lanes}):
                            if hit[k] >= 0 and begin + k < last:
                                counts[row[k], hit[k]] += 1
                            ending[k] = 1.0 if step == steps else 0.0
                        look(x, y, state, table, now, ending)
                if stage == 0:
                    before[:] = state
                    for j in range(2 * {pins} * {lanes}):
                        was[j] = y[{first_depth} * {lanes} + j]
"""

RK4 = """
        weight = 1.0 if stage == 0 or stage == 3 else 2.0
        for j in range({states} * {lanes}):
            change[j] = y[j] if stage == 0 else change[j] + weight * y[j]
    for i in range({states}):
        for k in range({lanes}):
            state[i * {lanes} + k] += h * part[k] / 6.0 * change[i * {lanes} + k]
"""

SEMI_IMPLICIT = """
    for i in range({n}, {states}):
        for k in range({lanes}):
            state[i * {lanes} + k] += h * part[k] * y[i * {lanes} + k]
    for i in range({n}):
        for k in range({lanes}):
            state[i * {lanes} + k] += h * part[k] * state[({n} + i) * {lanes} + k]
"""
