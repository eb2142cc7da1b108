"""Many polynomials at once: values, derivatives, shifts, and their largest and smallest values.

Coefficients are (m, k, n): of m segments and n joints, of the powers 0 to k-1 of the time since the segment began.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache, partial, reduce
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from armwright.arrays import Array, Flags
from armwright.motion.rows import Evaluator, on_arrays
from armwright.tracing.loops import Loops, Runner, Table, with_numpy
from armwright.tracing.scalar import Scalar, larger, select, smaller

Indices: TypeAlias = npt.NDArray[np.intp]

# A leading coefficient below this part of the largest is left out to find where roots are; Newton's method, on the
# whole polynomial, then puts them right.
_NEGLIGIBLE = 1e-12
_POLISHES = 3
# A parabola has so many coefficients; its roots need no search.
_PARABOLA = 3
# A single root is sought until a step is this small, behind which Newton's next one is lost in rounding.
_HALVINGS, _NEAR = 60, 1e-9


def evaluate(terms: Array, t: Array) -> Array:
    """Return values (m, n) at times t that broadcast with (m, n)."""
    value = np.empty(np.broadcast_shapes(t.shape, terms[:, 0].shape))
    value[...] = terms[:, -1]
    for power in reversed(range(terms.shape[1] - 1)):
        value *= t
        value += terms[:, power]
    return value


def derivative(terms: Array, order: int) -> Array:
    """Return the coefficients of a derivative; those of 0 where nothing is left."""
    for _ in range(order):
        powers = np.arange(1, terms.shape[1], dtype=np.float64)
        terms = terms[:, 1:] * powers[:, None] if terms.shape[1] > 1 else np.zeros_like(terms[:, :1])
    return terms


def composition(outer: Array, clock: Array) -> Array:
    """Return polynomials with others put in for their variable.

    Args:
        outer: (m, k, n) coefficients.
        clock: (m, c) those of the powers 1 to c of what is put in, which is 0 at 0.

    Returns:
        (m, c (k - 1) + 1, n).
    """
    count, joints = outer.shape[1:]
    powers = clock.shape[1]
    terms = np.zeros((len(outer), powers * (count - 1) + 1, joints))
    for power in reversed(range(count)):
        longer = np.zeros_like(terms)
        for order in range(powers):
            longer[:, order + 1 :] += terms[:, : -order - 1] * clock[:, None, None, order]
        terms = longer
        terms[:, 0] += outer[:, power]
    return terms


def slope(terms: list[Scalar]) -> list[Scalar]:
    """Return the coefficients of the derivative of one polynomial; that of 0 where nothing is left."""
    return [power * term for power, term in enumerate(terms)][1:] or [0.0 * terms[0]]


def shifted(terms: Array, shift: Array, rows: Evaluator = on_arrays) -> Array:
    """Return the coefficients of the same polynomials around positions ``shift`` (m,)."""
    return rows(shifted_terms, [terms], [shift[:, None]])[0]


def shifted_terms(terms: list[Scalar], shift: list[Scalar]) -> list[list[Scalar]]:
    """Return the coefficients of a polynomial around another position."""
    moved = []
    for power in range(len(terms)):
        value: Scalar = math.comb(len(terms) - 1, power) * terms[-1]
        for higher in reversed(range(power, len(terms) - 1)):
            value = value * shift[0] + math.comb(higher, power) * terms[higher]
        moved.append(value)
    return [moved]


def composed(outer: list[Scalar], inner: list[Scalar]) -> list[list[Scalar]]:
    """Return the coefficients of a polynomial q(s) of a polynomial s(t)."""
    terms: list[Scalar] = [0.0] * ((len(outer) - 1) * (len(inner) - 1) + 1)
    # Powers of the inner polynomial, one after the other.
    power: list[Scalar] = [1.0]
    for coefficient in outer:
        for i, x in enumerate(power):
            terms[i] = terms[i] + x * coefficient
        higher: list[Scalar] = [0.0] * (len(power) + len(inner) - 1)
        for i, x in enumerate(power):
            for k, y in enumerate(inner):
                higher[i + k] = higher[i + k] + y * x
        power = higher
    return [terms]


def extremes(
    terms: Array, lengths: Array, rows: Evaluator = on_arrays, run: Runner = with_numpy
) -> tuple[Array, Array]:
    """Return the smallest and the largest value (m, n) on each segment, by the roots of the derivative.

    Args:
        terms: (m, k, n) coefficients.
        lengths: (m,) of the segments.
        rows: evaluates equations of many rows.
        run: runs routines.
    """
    ends = [terms[:, 0], evaluate(terms, lengths[:, None])]
    between = evaluate(terms[..., None], turning_times(terms, lengths, rows, run))
    values = np.concatenate([np.stack(ends, axis=-1), between], axis=-1)
    return values.min(axis=-1), values.max(axis=-1)


def peaks(terms: Array, lengths: Array, rows: Evaluator = on_arrays) -> Array:
    """Return the largest magnitude (n,) of all segments.

    Only polynomials whose Bernstein coefficients go beyond the largest value at an end of any can hold a larger one.

    Args:
        terms: (m, k, n) coefficients.
        lengths: (m,) of the segments.
        rows: evaluates equations of many rows.
    """
    at_ends, bound = rows(_reach, [terms], [lengths[:, None]])[0].swapaxes(0, 1)
    most = at_ends.max(axis=0)
    segment, joint = np.nonzero(bound > most)
    if len(segment):
        _rise_to_extremes(most, joint, terms[segment, :, joint][..., None], lengths[segment], rows=rows, run=with_numpy)
    return np.asarray(most)


def composed_peaks(cubics: Array, law: Array, places: Array, times: Array, run: Runner) -> tuple[Array, Array, Array]:
    """Return the coefficients (p, 10, n) of a run along cubics, and its largest speeds and accelerations (n,).

    Args:
        cubics: (m, 4, n) coefficients of the joint positions by a parameter.
        law: (p, 4) coefficients of the parameter on each piece of the run, by the time since that begins.
        places: (p,) the number of the cubic that each piece is on.
        times: (p + 1,) when the pieces begin, and the last one ends [s].
        run: runs routines.
    """
    p, n = len(law), cubics.shape[2]
    terms, most, places_left, facts = run(
        _composed_peaks, [cubics, law, places, times], (p, 10, n), (2, n), (3, 2 * p * n), (1,)
    )
    left = int(facts[0])
    if left:
        order, piece, joint = places_left[:, :left].astype(np.intp)
        speeds = derivative(terms[piece, :, joint][..., None], 1)
        accelerations = np.zeros_like(speeds)
        accelerations[:, :-1] = derivative(speeds, 1)
        sought, flat = np.where((order == 0)[:, None, None], speeds, accelerations), most.reshape(-1)
        lengths = times[1:] - times[:-1]
        _rise_to_extremes(flat, order * n + joint, sought, lengths[piece], rows=on_arrays, run=run)
    return terms, most[0], most[1]


def _composed_peaks(loops: Loops, *tables: Table) -> None:
    """Write coefficients and peaks of a run: see ``composed_peaks``.

    A polynomial whose slope has no two Bernstein coefficients of opposite signs is largest at an end; where these
    change their sign once, there is one peak between. The others are left: their orders, 0 for speeds and 1 for
    accelerations, their pieces and joints are written, and how many there are.
    """
    cubics, law, places, times, terms, most, left, facts = tables
    p, powers, n = law.shape[0], 10, cubics.shape[2]

    def of_run(i: Scalar, j: Scalar) -> list[Scalar]:
        at = loops.whole(places[i])
        return composed([cubics[at, power, j] for power in range(4)], [law[i, power] for power in range(4)])[0]

    loops.fill([terms.part(1, power) for power in range(powers)], [p, n], of_run)

    def rate(order: int, i: Scalar, j: Scalar) -> list[Scalar]:
        found = [terms[i, power, j] for power in range(powers)]
        for _ in range(order + 1):
            found = slope(found)
        return found

    (lengths,) = loops.each([p], lambda i: [times[i + 1] - times[i]])
    peaks = [_Peaks(loops, lengths, partial(rate, order), most.part(0, order)) for order in (0, 1)]
    candidates = [each.at_ends(p, n) for each in peaks]
    before: Scalar = 0
    for order, (each, found) in enumerate(zip(peaks, candidates, strict=True)):
        turns = each.raised(n, found)
        before = before + _left(loops, left.behind(before, 1), order, found, turns)
    facts[0] = before


class _Candidates(NamedTuple):
    """Pieces and joints of a run whose polynomials may go beyond the largest value at an end; how many there are."""

    pieces: Table
    joints: Table
    count: Scalar


class _Peaks(NamedTuple):
    """The largest speeds, or accelerations, of a run.

    Attributes:
        loops: of the routine.
        lengths: (p,) of the pieces.
        rate: returns the coefficients on a piece, of a joint.
        peak: (n,) which are written.
    """

    loops: Loops
    lengths: Table
    rate: Callable[..., list[Scalar]]
    peak: Table

    def at_ends(self, p: Scalar, n: Scalar) -> _Candidates:
        """Write the largest at the ends of p pieces; return where n joints may have larger ones between."""
        loops, lengths, rate, peak = self
        ends, bound = loops.each([p, n], lambda i, j: _reach_of_terms(rate(i, j), lengths[i]), 2)
        loops.fill([peak], [n], lambda j: [loops.largest(p, lambda i: ends[i, j])])
        (pieces, joints), count = loops.kept(bound.shape, lambda i, j: bound[i, j] > peak[j])

        def closer(k: Scalar) -> list[Scalar]:
            i, j = loops.whole(pieces[k]), loops.whole(joints[k])
            return [_reach(rate(i, j), [lengths[i]])[0][1] - peak[j]]

        (beyond,) = loops.each([count], closer)
        (places,), few = loops.kept([count], lambda k: beyond[k] > 0)
        kept = loops.each([few], lambda k: [table[loops.whole(places[k])] for table in (pieces, joints)], 2)
        return _Candidates(kept[0], kept[1], few)

    def raised(self, n: Scalar, candidates: _Candidates) -> Table:
        """Raise the peaks of n joints by the candidates; return how often the slope of each may change its sign."""
        loops, lengths, rate, peak = self
        pieces, joints, count = candidates

        def of_candidate(k: Scalar) -> list[Scalar]:
            i, j = loops.whole(pieces[k]), loops.whole(joints[k])
            return list(_between(loops, rate(i, j), lengths[i]))

        sizes, turns = loops.each([count], of_candidate, 2)

        def risen(j: Scalar) -> list[Scalar]:
            number = loops.number(j)
            most_of = loops.largest(count, lambda k: select(abs(joints[k] - number) < 0.5, sizes[k], 0.0))
            return [larger(peak[j], most_of)]

        (peaks,) = loops.each([n], risen)
        loops.fill([peak], [n], lambda j: [peaks[j]])
        return turns


def _left(loops: Loops, rest: Table, order: int, candidates: _Candidates, turns: Table) -> Scalar:
    """Write the candidates whose slope may change its sign several times; return how many there are."""
    (several,), further = loops.kept([candidates.count], lambda k: turns[k] > 1.5)

    def of_rest(k: Scalar) -> list[Scalar]:
        at = loops.whole(several[k])
        return [0.0 * several[k] + order, candidates.pieces[at], candidates.joints[at]]

    loops.fill([rest.part(0, row) for row in range(3)], [further], of_rest)
    return further


def _reach_of_terms(terms: list[Scalar], length: Scalar) -> list[Scalar]:
    """Return the largest magnitude at an end of a polynomial, and a bound of that between: of the size of its terms."""
    bound, power = abs(terms[0]), 1.0
    for term in terms[1:]:
        power = power * length
        bound = bound + abs(term) * power
    return [larger(abs(terms[0]), abs(_value(terms, length))), bound]


def _between(loops: Loops, terms: list[Scalar], length: Scalar) -> tuple[Scalar, Scalar]:
    """Return a magnitude of a polynomial where its slope changes its sign, and how often that may be.

    Where it may not be, the magnitude is that at another point; where it may be several times, at any of them.
    """
    scaled = _by_part(slope(terms), length)
    control = [_weighted(scaled, weights) for weights in _bernstein(len(scaled) - 1).T.tolist()]
    turns: Scalar = 0.0
    start: Scalar = 0.5
    for k, (low, high) in enumerate(pairwise(control)):
        change = select(low < 0, high >= 0, high < 0)
        turns = turns + select(change, 1.0, 0.0)
        start = select(change, (k + low / select(change, low - high, 1.0)) / (len(control) - 1), start)
    sign = select(control[0] < 0, 1.0, -1.0)

    low, start = 0.0 * sign, start + 0.0 * sign
    part = crossing(loops, partial(_value_and_slope, scaled), (low, low + 1.0), start, tolerance=_NEAR, sign=sign)
    return abs(_value(terms, part * length)), turns


def _rise_to_extremes(
    most: Array, index: Indices, terms: Array, lengths: Array, *, rows: Evaluator, run: Runner
) -> None:
    """Raise the largest magnitudes of some polynomials to those between the ends of others (m, k, 1) of them."""
    lowest, highest = extremes(terms, lengths, rows, run)
    np.maximum.at(most, index, np.maximum(np.abs(lowest), np.abs(highest))[:, 0])


def _reach(terms: list[Scalar], length: list[Scalar]) -> list[list[Scalar]]:
    """Return the largest magnitude at an end of a polynomial, and a bound of that between: of its Bernstein terms."""
    scaled = _by_part(terms, length[0])
    ends = larger(abs(terms[0]), abs(_value(terms, length[0])))
    control = [abs(_weighted(scaled, weights)) for weights in _bernstein(len(terms) - 1).T[1:-1].tolist()]
    return [[ends, reduce(larger, control, ends)]]


def _by_part(terms: list[Scalar], length: Scalar) -> list[Scalar]:
    """Return the coefficients of a polynomial by the part of the length that has passed, so that they compare."""
    scaled, power = [], 1.0
    for term in terms:
        scaled.append(term * power)
        power = power * length
    return scaled


def _weighted(scaled: list[Scalar], weights: list[float]) -> Scalar:
    """Return a Bernstein coefficient of a polynomial, by weights of its coefficients of which the first is 1."""
    return sum((x * weight for x, weight in zip(scaled[1:], weights[1:], strict=True) if weight), scaled[0])


def turning_times(terms: Array, lengths: Array, rows: Evaluator = on_arrays, run: Runner = with_numpy) -> Array:
    """Return times (m, n, r) inside the segments among which are all at which a polynomial reverses.

    A polynomial whose slope has no two Bernstein coefficients of opposite signs rises or falls all along, and is not
    sampled further.
    """
    segments, count, joints = terms.shape
    if count < 3:
        return np.empty((segments, joints, 0))
    # By the part of the segment that has passed, so that coefficients compare.
    slopes = terms[:, 1:] * (np.arange(1, count) * _powers(lengths, count)[:, 1:])[..., None]
    slopes = np.swapaxes(slopes, 1, 2).reshape(-1, count - 1)
    control = slopes @ _bernstein(count - 2)
    below = control < 0
    turns = np.flatnonzero(below.any(axis=1) & (control > 0).any(axis=1))
    if not len(turns):
        return np.empty((segments, joints, 0))
    parts = np.zeros((len(slopes), count - 2))
    scaled, below = slopes[turns] / np.abs(slopes[turns]).max(axis=1, keepdims=True), below[turns]
    # Where the signs of the Bernstein coefficients change once there is one root.
    changes = below[:, 1:] != below[:, :-1]
    once = changes.sum(axis=1) == 1
    if count > _PARABOLA + 1 and once.any():
        signs = np.where(below[once, 0], 1.0, -1.0)
        parts[turns[once], 0] = run(
            _crossing, [scaled[once], signs, _of_polygon(control[turns[once]], changes[once])], signs.shape
        )[0]
        turns, scaled = turns[~once], scaled[~once]
    if len(turns):
        parts[turns] = _roots(scaled, rows)
    return np.asarray(parts.reshape(segments, joints, -1) * lengths[:, None, None])


def _of_polygon(control: Array, changes: Flags) -> Array:
    """Return where polygons of Bernstein coefficients (r, k) pass 0 on [0, 1], whose signs change as given."""
    rows, before = np.arange(len(control)), changes.argmax(axis=1)
    low, high = control[rows, before], control[rows, before + 1]
    return np.asarray((before + low / (low - high)) / changes.shape[1])


def _crossing(loops: Loops, terms: Table, signs: Table, starts: Table, roots: Table) -> None:
    """Write the roots (r,) in [0, 1] of polynomials (r, k) that have one there.

    Given are the signs (r,) of their slopes at it, and where to start.
    """
    rows, count = terms.shape

    def of_row(i: Scalar) -> tuple[Scalar]:
        def value_and_rate(x: Scalar) -> tuple[Scalar, ...]:
            zero = 0.0 * x
            return loops.walk(
                count, (zero, zero), lambda p, value, rate: (value * x + terms[i, p], rate * x + value), reverse=True
            )

        low = 0.0 * starts[i]
        return (crossing(loops, value_and_rate, (low, low + 1.0), starts[i], tolerance=_NEAR, sign=signs[i]),)

    loops.fill([roots], [rows], of_row)


def crossing(
    loops: Loops,
    value_and_rate: Callable[[Scalar], tuple[Scalar, ...]],
    bracket: tuple[Scalar, Scalar],
    start: Scalar,
    *,
    tolerance: Scalar,
    sign: Scalar = 1.0,
) -> Scalar:
    """Return the root of a function in a bracket, by Newton's method safeguarded by bisection.

    Args:
        loops: of the routine.
        value_and_rate: returns the function and its derivative.
        bracket: the interval in which there is one root.
        start: a point of it.
        tolerance: the length of the last step.
        sign: of the slope at the root.

    Source:
        Press et al., Numerical Recipes, 3rd ed., section 9.4.
    """

    def step(low: Scalar, high: Scalar, x: Scalar) -> tuple[Scalar, tuple[Scalar, ...]]:
        value, rate = value_and_rate(x)
        before = value * sign < 0
        low, high = select(before, x, low), select(before, high, x)
        rises = abs(rate) > 0
        newton = x - value / select(rises, rate, 1.0)
        inside = select(rises, select(low <= newton, newton <= high, False), False)
        following = select(inside, newton, (low + high) / 2)
        return abs(following - x) <= tolerance, (low, high, following)

    return loops.until(_HALVINGS, (*bracket, start), step)[2]


def _powers(lengths: Array, count: int) -> Array:
    """Return the powers (m, count) of lengths (m,), from 0."""
    powers = np.ones((len(lengths), count))
    powers[:, 1:] = lengths[:, None]
    return np.multiply.accumulate(powers, axis=1)


@cache
def _bernstein(degree: int) -> Array:
    """Return the matrix that takes coefficients of powers to Bernstein coefficients on [0, 1]."""
    return np.array([[math.comb(i, j) / math.comb(degree, j) for i in range(degree + 1)] for j in range(degree + 1)])


def _roots(slopes: Array, rows: Evaluator) -> Array:
    """Return points (r, d) of [0, 1] among which are all roots there of the polynomials (r, d + 1) of degree d."""
    roots = np.zeros((len(slopes), slopes.shape[1] - 1))
    significant = np.abs(slopes) > _NEGLIGIBLE
    degrees = slopes.shape[1] - 1 - significant[:, ::-1].argmax(axis=1)
    for degree in set(degrees.tolist()):
        of = np.flatnonzero(degrees == degree)
        if degree <= 2:
            roots[of, : min(2, roots.shape[1])] = _of_parabola(slopes[of])[:, : roots.shape[1]]
        else:
            roots[of, :degree] = _eigenvalues(slopes[of, : degree + 1])
    roots = np.clip(roots, 0.0, 1.0)
    return rows(_polished, [roots[:, None]], [slopes])[0][:, 0] if slopes.shape[1] > 3 else roots


def _of_parabola(rows: Array) -> Array:
    """Return the roots (r, 2) of a parabola, or of a line, without loss of digits; 0 for one that does not exist."""
    c, b, a = (rows[:, i] if i < rows.shape[1] else np.zeros(len(rows)) for i in range(3))
    q = -(b + np.copysign(np.sqrt(np.maximum(b * b - 4 * a * c, 0.0)), b)) / 2
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return np.stack([np.where(q != 0, c / q, 0.0), np.where(a != 0, q / a, 0.0)], axis=1)


def _eigenvalues(rows: Array) -> Array:
    """Return the real parts (r, d) of the roots, the eigenvalues of companion matrices.

    Two roots that meet may come out as a pair of complex numbers around their position, so no imaginary part is too
    large: whatever is found is only a position to sample.
    """
    degree = rows.shape[1] - 1
    companions = np.zeros((len(rows), degree, degree))
    companions[:, range(1, degree), range(degree - 1)] = 1.0
    companions[:, :, -1] = -rows[:, :-1] / rows[:, -1:]
    return np.asarray(np.linalg.eigvals(companions).real)


def _polished(root: list[Scalar], terms: list[Scalar]) -> list[list[Scalar]]:
    """Return a point of [0, 1] after steps of Newton's method towards a root, each where it is one for the better."""
    x = root[0]
    for _ in range(_POLISHES):
        value, rate = _value_and_slope(terms, x)
        rises = abs(rate) > 0
        ahead = smaller(larger(x - select(rises, value / select(rises, rate, 1.0), 0.0), 0.0), 1.0)
        x = select(abs(_value_and_slope(terms, ahead)[0]) < abs(value), ahead, x)
    return [[x]]


def _value(terms: list[Scalar], x: Scalar) -> Scalar:
    value = terms[-1]
    for term in terms[-2::-1]:
        value = value * x + term
    return value


def _value_and_slope(terms: list[Scalar], x: Scalar) -> tuple[Scalar, Scalar]:
    value, rate = terms[-1], 0.0 * x
    for term in terms[-2::-1]:
        rate = rate * x + value
        value = value * x + term
    return value, rate
