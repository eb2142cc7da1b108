"""Routines do the same with NumPy and as machine code."""

import mmap
import sys
from ctypes import CDLL, CFUNCTYPE, addressof, c_int64, c_void_p, cast, create_string_buffer

import numpy as np
import pytest

from armwright.motion.forward_backward import Bounds, largest_squares
from armwright.tracing import loops
from armwright.tracing.emit_loops import EmittedLoops
from armwright.tracing.loops import Loops, Runner, Table, compiled, with_numpy
from armwright.tracing.native import function_address
from armwright.tracing.scalar import Scalar, larger, select, sqrt


@pytest.fixture(params=[with_numpy, compiled])
def run(request: pytest.FixtureRequest) -> Runner:
    """What runs a routine."""
    runner: Runner = request.param
    return runner


def _sums(loops: Loops, x: Table, result: Table) -> None:
    (total,) = loops.walk(x.shape[0], (0.0,), lambda i, total: (total + x[i],))

    def step(i: Scalar, behind: Scalar) -> tuple[Scalar]:
        result[i] = behind / total
        return (behind + x[i],)

    loops.walk(x.shape[0], (0.0,), step, reverse=True)


def test_steps_follow_each_other(run: Runner, rng: np.random.Generator) -> None:
    """What is carried comes from the step before, in either direction; a table of nothing takes no step."""
    x = rng.uniform(1, 2, 17)

    behind = np.cumsum(x[::-1])[::-1] - x
    np.testing.assert_allclose(run(_sums, [x], x.shape)[0], behind / x.sum(), rtol=1e-14, atol=1e-15)
    assert run(_sums, [x[:0]], (0,))[0].shape == (0,)


def _roots(loops: Loops, x: Table, result: Table) -> None:
    def of_number(i: Scalar) -> tuple[Scalar]:
        def step(y: Scalar) -> tuple[Scalar, tuple[Scalar]]:
            better = (y + x[i] / y) / 2
            return abs(better - y) <= 1e-9 * y, (better,)

        return loops.until(100, (larger(x[i], 1.0),), step)

    loops.fill([result], [x.shape[0]], of_number)


def test_each_is_done_by_itself(run: Runner, rng: np.random.Generator) -> None:
    """Numbers that take more steps than others do not change those, not by a bit."""
    x = 10 ** rng.uniform(-6, 6, 50)

    found = run(_roots, [x], x.shape)[0]

    np.testing.assert_allclose(found, np.sqrt(x), rtol=1e-15)
    np.testing.assert_array_equal(found[:1], run(_roots, [x[:1]], (1,))[0])


def _of_rows(loops: Loops, x: Table, result: Table) -> None:
    rows, columns = x.shape
    (most,) = loops.each([rows], lambda i: [loops.largest(columns, lambda k: x[i, k])])
    (scaled,) = loops.each([rows, columns], lambda i, k: [x[i, k] - most[i]])
    least = loops.least(rows, lambda i: most[i])
    (under,) = loops.each([rows], lambda i: [loops.least(columns, lambda k: sqrt(scaled[i, k] * scaled[i, k]) + least)])
    result[0] = least

    def step(i: Scalar, total: Scalar) -> tuple[Scalar]:
        row = scaled.row(i)
        high, first = loops.first_largest(columns, lambda k: row[k])
        low, last = loops.first_least(columns, lambda k: row[k])
        (total,) = loops.when(
            first < last, lambda: (total + row[last] - low + high + 1.0,), lambda: (total + row[first],)
        )
        result[i + 1] = total + under[i]
        return (total,)

    loops.walk(rows, (0.0,), step)


def test_largest_and_least(run: Runner, rng: np.random.Generator) -> None:
    """Of equal numbers the first one counts."""
    x = rng.integers(0, 4, (40, 6)).astype(float)

    scaled = x - x.max(axis=1, keepdims=True)
    least = x.max(axis=1).min()
    total = np.cumsum(x.argmax(axis=1) < x.argmin(axis=1))
    np.testing.assert_array_equal(run(_of_rows, [x], (41,))[0], [least, *(total + np.abs(scaled).min(axis=1) + least)])


def test_squares_have_the_same_bits(rng: np.random.Generator) -> None:
    """The fastest run under random bounds is the same with NumPy and as machine code, and keeps the bounds."""
    for _ in range(30):
        count, rows = (int(x) for x in rng.integers(1, 30, 2))
        a, b = rng.normal(size=(2, count, rows)) * (rng.uniform(size=(2, count, rows)) > 0.3)
        bounds, lengths = Bounds(a, b, rng.uniform(-0.9, 0.9, (count, rows))), rng.uniform(0.01, 0.1, count)
        rests = bool(rng.integers(2)), bool(rng.integers(2))

        x = largest_squares(bounds, lengths, rests)

        np.testing.assert_array_equal(x, largest_squares(bounds, lengths, rests, compiled))
        u = (x[1:] - x[:-1]) / (2 * lengths)
        use = np.abs(a * u[:, None] + b * x[:-1, None] + bounds.c)
        rounding = 1e-9 * (1 + np.abs(a * u[:, None]) + np.abs(b * x[:-1, None]))
        assert (use <= 1 + rounding).all()


def _two(loops: Loops, x: Table, y: Table, doubled: Table, total: Table) -> None:
    (sums,) = loops.each(x.shape, lambda i, k: [x[i, k] + y[k]])
    loops.fill([doubled], x.shape, lambda i, k: [sums[i, k] * 2.0])
    total[0] = loops.largest(x.shape[1], lambda k: y[k])


def _of_columns(loops: Loops, x: Table, most: Table) -> None:
    rows, columns = x.shape
    loops.fill([most], [columns], lambda k: [loops.largest(rows, lambda i: x[i, k])])


def test_largest_of_columns(run: Runner, rng: np.random.Generator) -> None:
    """An inner loop may run over the first axis; of no rows the largest is minus infinity."""
    x = rng.normal(size=(4, 3))

    np.testing.assert_array_equal(run(_of_columns, [x], (3,))[0], x.max(axis=0))
    np.testing.assert_array_equal(run(_of_columns, [x[:0]], (3,))[0], -np.inf)


def _of_order(loops: Loops, x: Table, y: Table, *results: Table) -> None:
    sums, highest, merged, kept, counts, segments = results
    n = x.shape[0]
    total, most = loops.sums(n, lambda i: x[i]), loops.highest(n, lambda i: x[i])
    both = loops.merged(y, most)
    (places,), count = loops.kept([n], lambda i: x[i] > 0.5)
    (rows, columns), pairs = loops.kept([n, y.shape[0]], lambda i, k: x[i] < y[k])
    loops.fill([sums], [n + 1], lambda i: [total[i]])
    loops.fill([highest], [n], lambda i: [most[i]])
    loops.fill([merged], [merged.shape[0]], lambda i: [both[i]])
    loops.fill([kept], [count], lambda i: [x[loops.whole(places[i])]])
    loops.fill([segments], [n], lambda i: [loops.number(loops.segment(y, x[i], y.shape[0]))])
    counts[0], counts[1] = count, pairs
    counts[2] = loops.total(pairs, lambda i: rows[i]) + 100 * loops.total(pairs, lambda i: columns[i])


def test_order(run: Runner, rng: np.random.Generator) -> None:
    """Sums, largest so far, tables in order, what is kept, and segments are those of NumPy."""
    for n in (1, 2, 40):
        x, y = rng.uniform(size=n), np.sort(rng.uniform(size=7))
        y[3] = y[4]
        above = x[x > 0.5]
        rows, columns = np.nonzero(x[:, None] < y)

        sums, highest, merged, kept, counts, segments = run(
            _of_order, [x, y], (n + 1,), (n,), (n + 7,), (n,), (3,), (n,)
        )

        np.testing.assert_allclose(sums, np.append(0.0, np.cumsum(x)), rtol=1e-14)
        np.testing.assert_array_equal(highest, np.maximum.accumulate(x))
        np.testing.assert_array_equal(merged, np.sort([*y, *highest]))
        np.testing.assert_array_equal(kept[: len(above)], above)
        assert counts.tolist() == [len(above), len(rows), rows.sum() + 100 * columns.sum()]
        np.testing.assert_array_equal(segments, np.clip(np.searchsorted(y, x, side="right") - 1, 0, 6))


def _nearly(loops: Loops, x: Table, y: Table, merged: Table) -> None:
    both = loops.merged(x, y)
    loops.fill([merged], [merged.shape[0]], lambda i: [both[i]])


def test_tables_that_are_in_order_but_for_rounding(run: Runner) -> None:
    """A number that is out of order by rounding comes to its place."""
    x, y = np.array([0.0, 1.0, 1.0 - 1e-16, 1.0 - 2e-16, 2.0]), np.array([1.0 - 3e-16, 1.0 - 4e-16, 3.0])

    np.testing.assert_array_equal(run(_nearly, [x, y], (8,))[0], np.sort([*x, *y]))


def _parts(loops: Loops, x: Table, result: Table, rows: Table) -> None:
    m, k, n = x.shape
    flat = x.shaped(m * k, n)
    loops.fill([result.part(1, 0), result.part(1, 1)], [m, n], lambda i, j: [x.part(1, 1)[i, j], flat[i, j]])
    loops.fill([result.behind(2, 1).part(1, 0)], [m - 1, n], lambda i, j: [x[i + 1, 0, j]])
    below = loops.follow([k, n], lambda j: x[0, 0, j], lambda i, j, last: last / 2 + x.part(0, 1)[i, j], reverse=True)
    loops.fill([rows], [k, n], lambda i, j: [below[i, j]])


def test_parts_of_tables(run: Runner, rng: np.random.Generator) -> None:
    """Parts of tables are read and written where they are, and rows follow each other column by column."""
    x = rng.normal(size=(3, 2, 4))

    result, rows = run(_parts, [x], (3, 3, 4), (2, 4))

    np.testing.assert_array_equal(result[:, 0], x[:, 1])
    np.testing.assert_array_equal(result[:, 1], x.reshape(6, 4)[:3])
    np.testing.assert_array_equal(result[:2, 2], x[1:, 0])
    last = x[0, 0] / 2 + x[1, 1]
    np.testing.assert_array_equal(rows, [last / 2 + x[1, 0], last])


def test_arrays_as_they_come(run: Runner, rng: np.random.Generator) -> None:
    """Arrays of other orders and kinds are converted; several tables are written."""
    x, y = rng.normal(size=(5, 4)), rng.integers(0, 9, 5)

    for each in (x.T, np.ascontiguousarray(x.T)):
        doubled, total = run(_two, [each, np.asarray(y)], (4, 5), (1,))
        np.testing.assert_array_equal(doubled, (x.T + y) * 2)
        assert total == [y.max()]


def test_without_the_layout_of_objects(monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator) -> None:
    """Where it is not known how objects lie in memory, a routine is called by the addresses of its arrays."""
    monkeypatch.setattr(loops, "layout_is_known", lambda: False)
    fresh = loops._Compiled(quickly=False)
    x, y = rng.normal(size=(4, 5)), rng.normal(size=5)

    doubled, total = fresh(_two, [x[:, ::-1], y], (4, 5), (1,))

    np.testing.assert_array_equal(doubled, (x[:, ::-1] + y) * 2)
    assert total == [y.max()]


def test_other_axes_are_refused() -> None:
    """An array has as many axes as the one before it at the same place."""
    compiled(_two, [np.ones((2, 3)), np.ones(3)], (2, 3), (1,))

    with pytest.raises(TypeError, match="axes"):
        compiled(_two, [np.ones(3), np.ones(3)], (2, 3), (1,))


@pytest.mark.parametrize("tables", [0, 1])
def test_memory_is_given_back(tables: int) -> None:
    """Where memory is short a routine says so, and frees what it has taken."""
    routine = CFUNCTYPE(c_int64, *[c_void_p] * 4)(
        function_address(EmittedLoops(4).module(_two, [2, 1, 2, 1]), "routine")
    )
    taken, freed = list[int](), list[int]()

    def allocate(size: int) -> int | None:
        if len(taken) == tables:
            return None
        buffer = create_string_buffer(size)
        keep.append(buffer)
        taken.append(addressof(buffer))
        return taken[-1]

    keep: list[object] = []
    functions = CFUNCTYPE(c_void_p, c_int64)(allocate), CFUNCTYPE(None, c_void_p)(freed.append)
    arrays = [np.ones((2, 3)), np.ones(3), np.empty((2, 3)), np.empty(1)]
    pointers = (c_void_p * 4)(*(x.ctypes.data for x in arrays))
    lengths = (c_int64 * 6)(2, 3, 3, 2, 3, 1)

    assert routine(pointers, lengths, *(cast(f, c_void_p) for f in functions)) == 1 - tables
    assert freed == taken
    assert len(taken) == tables


def test_no_table_within_a_loop() -> None:
    """Memory is taken once."""

    def routine(loops: Loops, x: Table) -> None:
        def step(i: Scalar) -> tuple[()]:
            loops.table(i)
            return ()

        loops.walk(x.shape[0], (), step)

    with pytest.raises(TypeError, match="within a loop"):
        EmittedLoops(4).module(routine, [1])


def test_kinds_of_scalars() -> None:
    """A number is no truth value."""

    def routine(loops: Loops, x: Table) -> None:  # noqa: ARG001 - every routine takes them
        x[0] = select(x[0], 1.0, 2.0)

    with pytest.raises(TypeError, match="double where i1"):
        EmittedLoops(4).module(routine, [1])


def _side_by_side(loops: Loops, terms: Table, x: Table, *results: Table) -> None:
    values, chosen, numbers, later = results
    powers, n = terms.shape
    rows = x.shape[0]

    def value(i: Scalar, j: Scalar) -> list[Scalar]:
        t, zero = x[i], 0.0 * x[i]
        (sum_,) = loops.walk(powers, (zero,), lambda p, sum_: (sum_ * t + terms[p, j],), reverse=True)
        return [sum_, select(terms[0, j] < t, sqrt(abs(sum_)), t) + loops.largest(powers, lambda p: terms[p, j])]

    loops.fill([values, chosen], [rows, n], value)
    loops.fill([numbers], [rows], lambda i: [select(x[i] < 0.5, loops.number(i) / x[i], 2.0)])
    loops.fill([later], [rows - 1], lambda i: [x[i + 1] - x[i + 2 - 2]])


@pytest.mark.parametrize("lanes", [2, 4, 8])
def test_vectors_of_numbers(lanes: int, rng: np.random.Generator) -> None:
    """Innermost loops take vectors of any width, with the bits of NumPy, and neither read nor write beyond the end."""
    ir = EmittedLoops(lanes).module(_side_by_side, [2, 1, 2, 2, 1, 1])
    routine = function_address(ir, "routine")

    assert ir.count("call void @llvm.masked.store") == 4
    for n in (0, 1, lanes - 1, lanes, lanes + 1, 3 * lanes + 1):
        inputs = [rng.normal(size=(5, n)), rng.uniform(size=n + 1)]
        shapes = (n + 1, n), (n + 1, n), (n + 1,), (n,)
        around = [np.full(int(np.prod(shape)) + lanes, -7.0) for shape in shapes]
        results = [x[: int(np.prod(shape))].reshape(shape) for x, shape in zip(around, shapes, strict=True)]

        loops._by_addresses(routine, *inputs, *results)

        for got, expected in zip(results, with_numpy(_side_by_side, inputs, *shapes), strict=True):
            np.testing.assert_array_equal(got, expected)
        assert all((x[-lanes:] == -7.0).all() for x in around)


def _scattered(loops: Loops, x: Table, y: Table, *results: Table) -> None:
    turned, picked, found, halved = results
    rows, columns = x.shape
    loops.fill([turned], [columns, rows], lambda j, i: [x[i, j]])
    loops.fill([picked], [rows], lambda i: [y[loops.whole(y[i])]])
    loops.fill([found], [rows], lambda i: [loops.number(loops.segment(y, x[i, 0], rows))])
    loops.fill([halved], [rows], lambda i: [loops.until(9, (y[i],), lambda t: (t < 1.0, (t / 2,)))[0]])


def test_numbers_that_are_not_side_by_side(rng: np.random.Generator) -> None:
    """Numbers along another axis, from anywhere, and steps until each is done are taken one by one."""
    ir = EmittedLoops(4).module(_scattered, [2, 1, 2, 1, 1, 1])
    x, y = rng.uniform(0, 6, (7, 3)), np.arange(7.0)

    turned, picked, found, halved = compiled(_scattered, [x, y], (3, 7), (7,), (7,), (7,))

    assert "call void @llvm.masked.store" not in ir
    np.testing.assert_array_equal(turned, x.T)
    np.testing.assert_array_equal(picked, y)
    np.testing.assert_array_equal(found, np.floor(x[:, 0]))
    np.testing.assert_array_equal(halved, [0, 0.25, 0.25, 0.375, 0.25, 0.3125, 0.375])


@pytest.mark.skipif(sys.platform != "linux", reason="memory is protected by a function of Linux")
def test_memory_behind_the_end_is_not_touched() -> None:
    """A vector that is half behind the end of an array does not read there."""
    routine = function_address(EmittedLoops(8).module(_side_by_side, [2, 1, 2, 2, 1, 1]), "routine")
    size, n = mmap.PAGESIZE, 3
    pages = mmap.mmap(-1, 2 * size)
    memory = np.frombuffer(pages, dtype=np.float64)
    behind = memory.ctypes.data + size
    assert CDLL(None).mprotect(c_void_p(behind), size, 0) == 0
    terms = memory[size // 8 - 5 * n : size // 8].reshape(5, n)
    terms[:] = np.arange(5.0 * n).reshape(5, n)
    x = np.array([0.25, 0.5, 0.75, 1.0])

    results = [np.empty((4, n)), np.empty((4, n)), np.empty(4), np.empty(3)]
    loops._by_addresses(routine, terms, x, *results)

    expected = [np.polynomial.polynomial.polyval(t, terms) for t in x]
    np.testing.assert_allclose(results[0], expected, rtol=1e-15)
    assert CDLL(None).mprotect(c_void_p(behind), size, 3) == 0


def _written_roots(loops: Loops, x: Table, result: Table) -> None:
    loops.fill([result], [x.shape[0]], lambda i: [sqrt(x[i])])


def test_root_of_a_negative_number(run: Runner) -> None:
    """The root of what rounding has made negative is 0."""
    x = np.array([-1e-30, -4.0, -0.0, 0.0, 4.0])

    (found,) = run(_written_roots, [x], x.shape)

    np.testing.assert_array_equal(found, [0, 0, 0, 0, 2])


def _chosen_indices(loops: Loops, x: Table, *results: Table) -> None:
    chosen, carried, either = results
    first = x[0]
    loops.fill([chosen], chosen.shape, lambda i: [x[select(first < 0.0, i, i + 1)]])
    loops.fill([carried], carried.shape, lambda i: [x[loops.walk(2, (i,), lambda _, at: (at + 1,))[0]]])
    loops.fill([either], either.shape, lambda i: [x[loops.when(first < 0.0, lambda: (i,), lambda: (i + 3,))[0]]])


def test_chosen_and_carried_indices(run: Runner) -> None:
    """An index may be chosen between two, or carried: such numbers are taken one by one."""
    x = np.arange(12.0)

    chosen, carried, either = run(_chosen_indices, [x], (9,), (9,), (9,))

    np.testing.assert_array_equal(chosen, x[1:10])
    np.testing.assert_array_equal(carried, x[2:11])
    np.testing.assert_array_equal(either, x[3:12])


def test_columns_by_index() -> None:
    """A part of a table that is another for each number of the innermost loop is no vector."""

    def routine(loops: Loops, x: Table, result: Table) -> None:
        loops.fill([result], result.shape, lambda j: [x.part(1, j)[1]])

    x, result = np.arange(12.0).reshape(3, 4), np.empty(4)

    loops._by_addresses(function_address(EmittedLoops(4).module(routine, [2, 1]), "routine"), x, result)

    np.testing.assert_array_equal(result, x[1])


def _turned(loops: Loops, x: Table, sums: Table) -> None:
    rows, columns, depth = x.shape
    loops.fill([sums], [columns, rows], lambda j, i: [loops.largest(depth, lambda k: x[i, j, k])])


def test_axes_in_any_order(run: Runner, rng: np.random.Generator) -> None:
    """Loops may run over the axes of a table in any order, also where the innermost one stays the last."""
    x = rng.normal(size=(3, 4, 5))

    np.testing.assert_array_equal(run(_turned, [x], (4, 3))[0], x.max(axis=2).T)


def _all_but_nine(loops: Loops, x: Table, result: Table) -> None:
    loops.fill([result], [result.shape[0] - 9], lambda i: [x[i] + loops.number(i)])


@pytest.mark.parametrize("lanes", [2, 4])
def test_less_than_nothing_to_fill(lanes: int) -> None:
    """A size below 0 is a loop without steps, and not one that hardly ends."""
    routine = function_address(EmittedLoops(lanes).module(_all_but_nine, [1, 1]), "routine")
    x, result = np.ones(10), np.full(10, -7.0)

    loops._by_addresses(routine, x, result[:1])
    assert (result == -7.0).all()

    loops._by_addresses(routine, x, result)
    assert result[:2].tolist() == [1.0, -7.0]
