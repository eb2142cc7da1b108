"""How fast to run along a path of the joints: as fast as limits allow, with continuous acceleration.

The path is a trajectory q(s) whose second derivative is continuous; what it calls time is a mere parameter s. First
the fastest run on a grid is found, whose s'' is constant from one position of the grid to the next. Then s(t) is
averaged over a moving window of time, which leaves a cubic on each piece and makes s'' continuous, from rest to rest.
Where averaging has carried the joints over a limit, the limit is drawn tighter there and the run is found again. The
result q(s(t)) is a polynomial on each piece, of exactly the same path.

What averaging costs grows with the window. The window is as long as a small part of the shortest time allows, and the
run takes just that part more: so the duration depends on the path as the shortest one does, and not on how well a
window happens to fit.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import reduce
from typing import NamedTuple

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.motion.certificate import BindingLimit
from armwright.motion.forward_backward import Bounds, Nothing, largest_squares, write_largest_squares
from armwright.motion.knots import segments_at
from armwright.motion.limited import limited_motion
from armwright.motion.polynomials import composed_peaks, crossing, shifted_terms
from armwright.motion.solver import Solver
from armwright.motion.trajectory import Trajectory
from armwright.tracing.loops import Loops, Table
from armwright.tracing.scalar import Scalar, larger, select, sqrt

# From rest to the full speed of the path takes no less than this where a joint has no limit of acceleration [s].
_RAMP = 0.05
# What averaging may cost, in parts of the shortest time and at most [s]; no window is longer than that.
_COST, _MAX_LENGTH = 0.006, 0.05
# Windows that are tried: where one costs too much, the next is shorter in that proportion and by a little more.
_WINDOWS, _LESS, _LEAST_STEP = 8, 0.9, 1 / 16
# Rounds of drawing limits tighter where they are passed.
_ROUNDS = 4
# The grid has so many intervals for each one between two knots of the path, on which its curvature hardly changes: the
# more, the fewer knots there are, so that there are some so many in all.
_FINER, _ENOUGH = 4, 400
# Parts of an interval where its bounds are kept, and parts of a piece where the limits are sampled.
_PARTS, _SAMPLED = (0.0, 0.5, 1.0), (0.0, 0.25, 0.5, 0.75, 1.0)
# Two breaks nearer than this part of the duration are one; a knot is passed at a time found to this part of its piece.
_SAME, _CONVERGED = 1e-10, 1e-12
# Halvings of a piece to find when the run is at a position on the path.
_HALVINGS = 20
# So that rounding does not make a run too long that is just short enough.
_ROUNDING = 1e-9
# A joint that uses this part of what the fullest limit uses binds.
_BINDS = 0.95


class TimedPath(NamedTuple):
    """A run along a path.

    Attributes:
        trajectory: of the joints, at rest and without acceleration at both ends.
        factor: how many times longer it takes than a run at full speed that no joint limits.
        because: which limit, and which joint, from 0, binds longest; None where the joints do not slow it.
        run: before it was slowed by the same factor throughout.
        speed: largest speeds of all that has limits, (n,) for most arms: see ``Arm.all_limits``.
        acceleration: largest accelerations of these.
    """

    trajectory: Trajectory
    factor: float
    because: BindingLimit | None
    run: _Run
    speed: Array
    acceleration: Array

    def when(self, s: float) -> float:
        """Return when the run is at ``s``, as a part of its duration."""
        run = self.run
        begins = run.law[:, 0] + run.grid.times[run.intervals.astype(np.intp)]
        k = int(segments_at(begins, s, len(begins)))
        (_, slow, bend, jerk), sought = run.law[k].tolist(), s - float(begins[k])
        start, end = run.times[k : k + 2].tolist()
        low, high = 0.0, end - start
        for _ in range(_HALVINGS):
            t = (low + high) / 2
            low, high = (t, high) if ((jerk * t + bend) * t + slow) * t <= sought else (low, t)
        return float((start + (low + high) / 2) / run.times[-1])


class _Grid(NamedTuple):
    """A path cut into intervals.

    Attributes:
        solver: the arm.
        times: (m + 1,) the parameters s of the path where m intervals begin, and the last one ends.
        cubics: (m, 4, n) the joints on each, and behind them the drives that have limits: n is the number of both.
        caps: (m,) the largest s' on each.
        a: (m, rows) bounds |a u + b x| <= 1 on each, of x = s'² at its start and u = s'', that hold all along it.
        b: (m, rows) the same.
        squares: (m + 1,) s'² at their ends on the fastest run whose s'' is constant on each.
        even: the time of a run at the largest s' throughout [s].
        shortest: the time of the fastest run [s].
    """

    solver: Solver
    times: Array
    cubics: Array
    caps: Array
    a: Array
    b: Array
    squares: Array
    even: float
    shortest: float

    @property
    def allowed(self) -> float:
        """How long a run may take [s]."""
        return _allowed(self.shortest)


class _Run(NamedTuple):
    """A run of which the limits have been sampled.

    Attributes:
        grid: the path.
        times: (p + 1,) when its p pieces begin, and the last one ends [s].
        intervals: (p,) the number of the interval of the path that each is on.
        law: (p, 4) coefficients of the path on that interval by the time since the piece began.
        along: (p,) the largest part that each piece uses of the speed on the path.
        of_joints: (p, 2 n) the same of the speeds and of the roots of the accelerations of the joints.
        most: the largest part of all.
    """

    grid: _Grid
    times: Array
    intervals: Array
    law: Array
    along: Array
    of_joints: Array
    most: float

    @property
    def duration(self) -> float:
        """How long it takes, slowed to keep the limits where they were sampled [s]."""
        return float(self.times[-1]) * max(1.0, self.most)


def timed(solver: Solver, path: Trajectory, caps: Array, *, ramp: float = 0.0) -> TimedPath:
    """Return a run along a path, from rest to rest, inside the limits of speed and acceleration of the joints.

    Args:
        solver: the arm, with n joints.
        path: cubics with continuous second derivatives.
        caps: (m,) the largest s' on each of its m segments.
        ramp: from rest to the full speed of the path no less than this is to be taken [s].
    """
    arm, limits = solver.arm, solver.arm.all_limits
    grid = _gridded(solver, limited_motion(arm, path), caps, ramp)
    run = _smooth(grid)
    terms, speed, acceleration = composed_peaks(grid.cubics, run.law, run.intervals, run.times, solver.run)
    over = max(
        float((speed / limits.speed).max()),
        math.sqrt(float((acceleration / limits.acceleration).max())),
        float(run.along.max()),
        grid.allowed / float(run.times[-1]),
    )
    terms *= (over ** -np.arange(terms.shape[1], dtype=np.float64))[:, None]
    trajectory = Trajectory.of_planner(run.times * over, terms if len(speed) == arm.n else terms[:, :, : arm.n].copy())
    factor = trajectory.duration / _allowed(grid.even + max(_RAMP, ramp))
    because = _binding(arm, run) if factor > 1 else None
    return TimedPath(trajectory, factor, because, run, speed / over, acceleration / over**2)


def _allowed(shortest: float) -> float:
    """Return how long a run may take whose shortest time is given [s]."""
    return shortest + min(_COST * shortest, _MAX_LENGTH)


def _gridded(solver: Solver, path: Trajectory, caps: Array, ramp: float) -> _Grid:
    """Return a path with every segment cut into equal parts."""
    limits = solver.arm.all_limits
    m, _, n = path.coefficients.shape
    finer = min(max(math.ceil(_ENOUGH / len(caps)), 1), _FINER)
    ramp = max(ramp, 0.0 if np.isfinite(limits.acceleration).all() else _RAMP)
    inputs = [path.times, path.coefficients, caps, limits.speed, limits.acceleration, np.array([ramp])]
    of_rows = m * finer, 1 + len(_PARTS) * (1 + 2 * n)
    times, cubics, fine_caps, a, b, squares, facts = solver.run(
        _grid, inputs, (m * finer + 1,), (m, finer, 4, n), (m, finer), of_rows, of_rows, (m * finer + 1,), (2,)
    )
    return _Grid(
        solver, times, cubics.reshape(-1, 4, n), fine_caps.reshape(-1), a, b, squares, float(facts[0]), float(facts[1])
    )


def _grid(loops: Loops, *tables: Table) -> None:
    """Write a grid: see ``_gridded``.

    Read are times and cubics of a path, the largest s' on its segments, the limits of the joints, and a bound of s'';
    written the attributes of a ``_Grid`` in their order.
    """
    path, terms, caps, speed, acceleration, ramp, times, cubics, fine_caps, a, b, squares, facts = tables
    m, finer, _, n = cubics.shape
    count = m * finer

    def begin(i: Scalar, k: Scalar) -> list[Scalar]:
        return [path[i] + (path[i + 1] - path[i]) * (loops.number(k) / finer), caps[i]]

    loops.fill([times.shaped(m, finer), fine_caps], [m, finer], begin)
    times[count] = path[m]

    def cubic(i: Scalar, k: Scalar, j: Scalar) -> list[Scalar]:
        start = (path[i + 1] - path[i]) * (loops.number(k) / finer)
        return shifted_terms([terms[i, power, j] for power in range(4)], [start])[0]

    loops.fill([cubics.part(2, power) for power in range(4)], [m, finer, n], cubic)
    local, most = cubics.shaped(count, 4, n), fine_caps.shaped(count)
    (lengths,) = loops.each([count], lambda i: [times[i + 1] - times[i]])
    loops.fill([a.part(1, 0), b.part(1, 0)], [count], lambda i: [0.0 * most[i] + ramp[0], 0.0 * most[i]])
    for p, part in enumerate(_PARTS):
        first = 1 + p * (2 * n + 1)

        def of_path(i: Scalar, part: float = part) -> list[Scalar]:
            on_x = 1 / (most[i] * most[i])
            # At a part of the interval x has grown by 2 u times the path.
            return [2 * lengths[i] * part * on_x, on_x]

        def of_joint(i: Scalar, j: Scalar, part: float = part) -> list[Scalar]:
            s, grown = part * lengths[i], 2 * lengths[i] * part
            c1, c2, c3 = (local[i, power, j] for power in (1, 2, 3))
            rate, bend = (3 * c3 * s + 2 * c2) * s + c1, (6 * c3 * s + 2 * c2) / acceleration[j]
            square = (rate / speed[j]) ** 2
            return [square * grown, bend * grown + rate / acceleration[j], square, bend]

        loops.fill([a.part(1, first), b.part(1, first)], [count], of_path)
        columns = [x.behind(first + 1 + k * n, 1) for x in (a, b) for k in (0, 1)]
        loops.fill(columns, [count, n], of_joint)
    write_largest_squares(loops, Bounds(a, b, Nothing()), lengths, (0.0, 0.0), squares)
    facts[0] = loops.sums(count, lambda i: lengths[i] / most[i])[count]
    (speeds,) = loops.each([count + 1], lambda i: [sqrt(squares[i])])
    facts[1] = loops.sums(count, lambda i: 2 * lengths[i] / (speeds[i + 1] + speeds[i]))[count]


def _smooth(grid: _Grid) -> _Run:
    """Return the fastest run averaged over as long a window as may be, or the fastest of those that were tried."""
    most = grid.allowed - grid.shortest
    window, runs = most, []
    for _ in range(_WINDOWS):
        runs.append(_averaged_within(grid, window))
        cost = runs[-1].duration - grid.shortest
        if cost <= most + _ROUNDING * grid.shortest:
            break
        window *= max(_LESS * most / cost, _LEAST_STEP)
    return min(runs, key=lambda run: run.duration)


def _averaged_within(grid: _Grid, window: float) -> _Run:
    """Return the fastest run averaged over a window, with bounds drawn tighter where that passes limits."""
    lengths = grid.times[1:] - grid.times[:-1]
    tighter, runs, x = np.ones((len(lengths), 1)), [], grid.squares
    for _ in range(_ROUNDS):
        runs.append(_averaged(grid, x, window))
        if runs[-1].duration <= (1 + _ROUNDING) * grid.allowed:
            break
        worst = np.ones(len(lengths))
        uses = np.maximum(runs[-1].along, runs[-1].of_joints.max(axis=1))
        np.maximum.at(worst, runs[-1].intervals.astype(np.intp), uses)
        tighter = tighter * worst[:, None] ** 2
        bounds = Bounds(grid.a * tighter, grid.b * tighter, np.zeros_like(grid.a))
        x = largest_squares(bounds, lengths, (False, False), grid.solver.run)
    return min(runs, key=lambda run: run.duration)


def _averaged(grid: _Grid, squares: Array, window: float) -> _Run:
    """Return a run averaged over a moving window of time, and what it uses of the limits.

    Args:
        grid: the path.
        squares: (m + 1,) s'² at the ends of its intervals; s'' is constant on each.
        window: [s].
    """
    limits = grid.solver.arm.all_limits
    m, _, n = grid.cubics.shape
    inputs = [grid.times, grid.cubics, grid.caps, limits.speed, limits.acceleration, squares, np.array([window])]
    # As many pieces as there may be: each interval begins and ends in the window, and begins once more.
    p = 3 * m + 1
    times, law, intervals, along, of_joints, facts = grid.solver.run(
        _averaged_run, inputs, (p + 1,), (p, 4), (p,), (p,), (p, 2, n), (2,)
    )
    count, most = int(facts[0]), float(facts[1])
    return _Run(
        grid,
        times[: count + 1],
        intervals[:count],
        law[:count],
        along[:count],
        of_joints[:count].reshape(count, -1),
        most,
    )


def _averaged_run(loops: Loops, *tables: Table) -> None:
    """Write the pieces of an averaged run: see ``_averaged``.

    What is written are the attributes of a ``_Run`` in their order, and how many pieces there are and ``most``.
    """
    starts, cubics, caps, speed, acceleration, squares, window, times, laws, intervals, along, of_joints, facts = tables
    breaks, law = _moving_average(loops, starts, squares, window[0])
    parts, count = _cut(loops, starts, breaks, law)
    m, _, n = cubics.shape
    last = law.shape[0]

    def of_piece(k: Scalar) -> list[Scalar]:
        begin, middle = parts[k], (parts[k + 1] + parts[k]) / 2
        piece = loops.segment(breaks, middle, last)
        start, *higher = shifted_terms([law[piece, power] for power in range(4)], [begin - breaks[piece]])[0]
        t = middle - begin
        at = loops.segment(starts, ((higher[2] * t + higher[1]) * t + higher[0]) * t + start, m)
        return [begin, start - starts[at], *higher, loops.number(at)]

    columns = [laws.part(1, power) for power in range(4)]
    loops.fill([times, *columns, intervals], [count], of_piece)

    def samples(k: Scalar) -> list[Scalar]:
        length = parts[k + 1] - parts[k]
        return [x for part in _SAMPLED for x in _along([laws[k, power] for power in range(4)], part * length)]

    sampled = loops.each([count], samples, 3 * len(_SAMPLED))

    def of_path(k: Scalar) -> list[Scalar]:
        return [reduce(larger, (rates[k] for rates in sampled[1::3]), 0.0) / caps[loops.whole(intervals[k])]]

    def of_joint(k: Scalar, j: Scalar) -> list[Scalar]:
        at = loops.whole(intervals[k])
        cubic = [cubics[at, power, j] for power in range(4)]
        fastest, hardest = _used(cubic, zip(*(iter([table[k] for table in sampled]),) * 3, strict=True))
        return [fastest / speed[j], sqrt(hardest / acceleration[j])]

    loops.fill([along], [count], of_path)
    loops.fill([of_joints.part(1, 0), of_joints.part(1, 1)], [count, n], of_joint)
    times[count], facts[0] = parts[count], count
    (uses,) = loops.each(
        [count],
        lambda k: [larger(loops.largest(n, lambda j: larger(of_joints[k, 0, j], of_joints[k, 1, j])), along[k])],
    )
    facts[1] = loops.largest(count, lambda k: uses[k])


def _moving_average(loops: Loops, starts: Table, squares: Table, window: Scalar) -> tuple[Table, Table]:
    """Return s(t) averaged over a moving window of time: its breaks (k + 1,) and cubics (k, 4).

    Args:
        loops: the loops.
        starts: (m + 1,) where the intervals in s begin, and the last one ends.
        squares: (m + 1,) s'² there; s'' is constant on each.
        window: [s].
    """
    m = starts.shape[0] - 1
    (speeds,) = loops.each([m + 1], lambda i: [sqrt(squares[i])])
    (steps,) = loops.each([m], lambda i: [2 * (starts[i + 1] - starts[i]) / (speeds[i + 1] + speeds[i])])
    t = loops.sums(m, lambda i: steps[i])
    # The integral of s(t): on each interval and, with the last coefficients, after the end. Before the start it is 0.
    bends = loops.table(m + 1)
    loops.fill([bends], [m], lambda i: [(speeds[i + 1] - speeds[i]) / steps[i] / 6])
    bends[m] = 0.0
    grown = loops.sums(m, lambda i: ((bends[i] * steps[i] + speeds[i] / 2) * steps[i] + starts[i]) * steps[i])
    (later,) = loops.each([m + 1], lambda i: [t[i] + window])
    breaks, count = _apart(loops, t, later)

    def around(begin: Scalar, within: Scalar) -> list[Scalar]:
        piece = loops.segment(t, within, m + 1)
        terms = [grown[piece], starts[piece], speeds[piece] / 2, bends[piece]]
        started = within >= 0.0
        return [select(started, x, 0.0) for x in shifted_terms(terms, [begin - t[piece]])[0]]

    def of_piece(k: Scalar) -> list[Scalar]:
        begin, middle = breaks[k], (breaks[k + 1] + breaks[k]) / 2
        ahead, behind = around(begin, middle), around(begin - window, middle - window)
        return [(x - y) / window for x, y in zip(ahead, behind, strict=True)]

    law = loops.table(count, 4)
    loops.fill([law.part(1, power) for power in range(4)], [count], of_piece)
    return breaks, law


def _cut(loops: Loops, starts: Table, breaks: Table, law: Table) -> tuple[Table, Scalar]:
    """Return the times (p + 1,) at which cubics s(t) begin, and at which they pass an inner start; and p."""
    count, knots = law.shape[0], starts.shape[0] - 2
    begins = loops.highest(count, lambda k: law[k, 0])

    def of_knot(i: Scalar) -> list[Scalar]:
        knot = starts[i + 1]
        piece = loops.segment(begins, knot, count)
        length = breaks[piece + 1] - breaks[piece]
        return [breaks[piece] + _passed(loops, [law[piece, power] for power in range(4)], length, knot)]

    (passed,) = loops.each([knots], of_knot)
    return _apart(loops, breaks, passed)


def _used(cubic: list[Scalar], sampled: Iterable[tuple[Scalar, ...]]) -> tuple[Scalar, Scalar]:
    """Return the largest speed and the largest acceleration of a joint on a cubic q(s), given s, s' and s'' there."""
    _, c1, c2, c3 = cubic
    speed: Scalar = 0.0
    acceleration: Scalar = 0.0
    for x, rate, bend in sampled:
        slope, curve = (3 * c3 * x + 2 * c2) * x + c1, 6 * c3 * x + 2 * c2
        speed = larger(abs(slope * rate), speed)
        acceleration = larger(abs(curve * rate * rate + slope * bend), acceleration)
    return speed, acceleration


def _along(law: list[Scalar], t: Scalar) -> tuple[Scalar, ...]:
    """Return s, s' and s'' of a cubic s(t)."""
    a, b, c, d = law
    return ((d * t + c) * t + b) * t + a, (3 * d * t + 2 * c) * t + b, 6 * d * t + 2 * c


def _passed(loops: Loops, law: list[Scalar], length: Scalar, knot: Scalar) -> Scalar:
    """Return when a cubic s(t), which never falls, passes a knot, from 0 to ``length`` [s]."""
    start, slow, bend, jerk = law

    def value_and_rate(t: Scalar) -> tuple[Scalar, Scalar]:
        return ((jerk * t + bend) * t + slow) * t + start - knot, (3 * jerk * t + 2 * bend) * t + slow

    return crossing(loops, value_and_rate, (0.0 * length, length), length / 2, tolerance=_CONVERGED * length)


def _binding(arm: Arm, run: _Run) -> BindingLimit:
    """Return which limit of which joint, or of its drive, binds for the longest time."""
    steps, of_joints = run.times[1:] - run.times[:-1], run.of_joints
    most = of_joints.max(axis=1)
    long = np.where(most >= _BINDS * most.max(), steps, 0.0)
    limited = of_joints.shape[1] // 2
    counts = np.bincount(of_joints.argmax(axis=1), weights=long, minlength=2 * limited)
    name, number = divmod(int(counts.argmax()), limited)
    return ("acceleration" if name else "speed"), number % arm.n


def _apart(loops: Loops, first: Table, second: Table) -> tuple[Table, Scalar]:
    """Return times of two tables in order, and how many there are but the first.

    Those that follow the one before at no distance are left out; the last one stays.
    """
    times = loops.merged(first, second)
    last = times.shape[0] - 1
    end = times[last]
    near = _SAME * end
    (places,), count = loops.kept(
        [last - 1], lambda i: select(times[i + 1] - times[i] > near, end - times[i + 1] > near, False)
    )
    apart = loops.table(count + 2)
    loops.fill([apart.behind(1)], [count], lambda i: [times[loops.whole(places[i]) + 1]])
    apart[0], apart[count + 1] = times[0], end
    return apart, count + 1
