"""Loops over links: by hand, in Python, and in the code of a kernel, where they give the same numbers."""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import pytest

from armwright.errors import InvalidValueError
from armwright.tracing.emit import Emitted, Equation, emit
from armwright.tracing.graph import Graph, operation_count
from armwright.tracing.kernel import Kernel
from armwright.tracing.scalar import Scalar, cos, sin
from armwright.tracing.scan import scan

LINKS = 7
ROUNDING = 1e-14  # of some dozens of operations


@pytest.fixture(scope="module", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Compile into a folder of the module's own; the modules behind it use the user's again."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("ARMWRIGHT_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


def _rolled(equation: Equation, **inputs: int) -> Emitted:
    return emit("loops", equation, inputs or {"x": LINKS}, max_straight=1)


def _agree(equation: Any, rng: np.random.Generator, **inputs: int) -> None:
    """Compare the kernel whose loops are loops with the equation on floats, alone and in a batch."""
    inputs = inputs or {"x": LINKS}
    kernel = Kernel(emitted=_rolled(equation, **inputs))
    rows = [rng.uniform(-2, 2, (11, width)) for width in inputs.values()]

    values = kernel(*rows)

    outputs = values if isinstance(values, tuple) else (values,)
    for k in range(11):
        expected = equation(*(row[k].tolist() for row in rows))
        for output, floats in zip(outputs, expected, strict=True):
            np.testing.assert_allclose(output[k], floats, rtol=ROUNDING, atol=ROUNDING)
        alone = kernel(*(row[k] for row in rows))
        for output, one in zip(outputs, alone if isinstance(alone, tuple) else (alone,), strict=True):
            np.testing.assert_array_equal(one, output[k])


def test_by_hand() -> None:
    """Sums of 1, 2 and 3 from the first, and from the last, and what is left at the end."""

    def step(total: float, x: float) -> tuple[float, float]:
        return total + x, total + x

    assert scan(step, 0.0, [1.0, 2.0, 3.0]) == (6.0, [1.0, 3.0, 6.0])
    assert scan(step, 0.0, [1.0, 2.0, 3.0], reverse=True) == (6.0, [6.0, 5.0, 3.0])
    assert scan(step, 4.0, []) == (4.0, [])


def test_state_and_results(rng: np.random.Generator) -> None:
    """The state at the end, and the results of each link in the order of the links, outward and inward."""

    def step(state: list[Scalar], x: Scalar) -> tuple[list[Scalar], Scalar]:
        a, b = state
        return [a + x * b, cos(x) - b], a * x

    def equation(x: Sequence[Scalar]) -> list[list[Scalar]]:
        state, results = scan(step, [0.5, x[0]], x)
        inward, backward = scan(step, [0.5, x[0]], x, reverse=True)
        return [state, results, inward, backward]

    _agree(equation, rng)


class _Bar(NamedTuple):
    slides: bool
    length: float
    numbers: list[float]


def test_kinds_and_constants(rng: np.random.Generator) -> None:
    """Links of two kinds with constants of their own; what comes out unchanged, or is a constant, is no result."""
    bars = [_Bar(i % 3 == 1, rng.normal(), [1.0, 0.0, rng.normal()]) for i in range(LINKS)]

    def step(state: Scalar, bar: _Bar, x: Scalar) -> tuple[Scalar, tuple[Scalar, list[Scalar], float, Scalar]]:
        a, b, c = bar.numbers
        if bar.slides:
            return state * bar.length + x, (x, [bar.length, c, 2.0], 3.0, state)
        return a * sin(x + bar.length) + b * state, (state * c, [x, c, state + c], 4.0, x * x)

    def equation(x: Sequence[Scalar]) -> list[list[Scalar]]:
        state, results = scan(step, 1.0, bars, x)
        return [[state], [n for a, b, c, d in results for n in (a, *b, c, d)]]

    _agree(equation, rng)


def test_one_loop_after_another(rng: np.random.Generator) -> None:
    """A loop takes the results of an earlier one, inward and outward, beside inputs and other scalars."""

    def outward(state: Scalar, x: Scalar, y: Scalar) -> tuple[Scalar, list[Scalar]]:
        return state + x, [state * y, cos(state), y]

    def inward(state: Scalar, kept: list[Scalar], x: Scalar, other: Scalar) -> tuple[Scalar, Scalar]:
        a, b, y = kept
        return state * 0.5 + a * other, state * b + x * y

    def equation(x: Sequence[Scalar], y: Sequence[Scalar]) -> list[list[Scalar]]:
        end, kept = scan(outward, 0.0, x, y)
        others = [a[0] * y[0] for a in kept]
        start, results = scan(inward, end, kept, [x[0], *y[1:]], others, reverse=True)
        return [[start, kept[2][1]], [a * b for a, b in zip(results, x, strict=True)]]

    _agree(equation, rng, x=LINKS, y=LINKS)


def test_equal_numbers_are_carried_once() -> None:
    """Of a symmetric matrix the loop carries half, though the step is written for all of it."""

    def step(A: list[list[Scalar]], x: Scalar) -> tuple[list[list[Scalar]], list[Any]]:
        a = A[0][1] * x + A[1][1]
        return [[A[0][0] + x, a], [a, A[1][1] * x]], []

    graph = Graph(rolls=True)
    A, _ = scan(step, [[0.0, 0.0], [0.0, 0.0]], graph.inputs(LINKS))

    assert A[0][1].node == A[1][0].node
    assert graph.loops[0].carried == 3


def test_length_of_the_code() -> None:
    """The operations are counted for every link, and written once."""

    def step(state: Scalar, x: Scalar) -> tuple[Scalar, Scalar]:
        return state * x, state + x

    def written(links: int) -> tuple[dict[str, int], int]:
        graph = Graph(rolls=True)
        state, results = scan(step, 1.0, graph.inputs(links))
        (loop,) = graph.loops
        return operation_count(graph, [state.node, results[0].node]), len(loop.steps[0].graph.nodes)

    (few, short), (many, long) = written(5), written(50)
    assert few == {"add": 5, "multiply": 5}
    assert many == {"add": 50, "multiply": 50}
    assert short == long


def test_scalars_of_elsewhere() -> None:
    """A step that takes a traced scalar past its arguments would mix two graphs: that is noticed."""
    graph = Graph(rolls=True)
    elsewhere, *x = graph.inputs(LINKS)

    with pytest.raises(TypeError, match="another graph"):
        scan(lambda state, x: (state + elsewhere * x, []), 0.0, x)
    with pytest.raises(TypeError, match="another graph"):
        scan(lambda state, _: (state, elsewhere), 0.0, x)


def test_short_enough() -> None:
    """Up to the limit every link is written out, and beyond it the code has a loop."""

    def step(state: Scalar, x: Scalar) -> tuple[Scalar, Scalar]:
        return state * x, state + x

    def equation(x: Sequence[Scalar]) -> list[list[Scalar]]:
        return [[scan(step, 1.0, x)[0]]]

    # The inputs, the 1 at the beginning, and of each further link its product and its sum.
    nodes = LINKS + 1 + 2 * LINKS - 1
    straight, loop = (emit("product", equation, {"x": LINKS}, max_straight=nodes - k) for k in (0, 1))
    assert not straight.code.graph.loops
    assert straight.operations == {"multiply": LINKS - 1}
    assert len(loop.code.graph.loops) == 1
    assert loop.operations["multiply"] == LINKS


def test_watched_inputs(rng: np.random.Generator) -> None:
    """NaN is refused for every link, and a large angle where its sine is taken: in links that turn, not that slide."""
    kinds = ["slides" if i % 2 == 0 else "turns" for i in range(LINKS)]

    def step(state: Scalar, kind: str, x: Scalar, y: Scalar) -> tuple[Scalar, Scalar]:
        return state + y, state + (x if kind == "slides" else sin(x))

    def equation(x: Sequence[Scalar], y: Sequence[Scalar]) -> list[list[Scalar]]:
        return [scan(step, 0.0, kinds, x, y)[1]]

    kernel = Kernel(emitted=_rolled(equation, x=LINKS, y=LINKS))
    x, y = rng.uniform(-1, 1, (2, 9, LINKS))
    assert kernel.emitted.angles == {"x"}
    for bad in (x, y):
        for i in range(LINKS):
            kept, bad[4, i] = bad[4, i], np.nan
            with pytest.raises(InvalidValueError, match="must be finite, got nan"):
                kernel(x, y)
            bad[4, i] = kept
    x[2, 0], y[3, 1] = 1e13, 1e13
    kernel(x, y)
    x[2, 1] = 1e13
    with pytest.raises(InvalidValueError, match="x"):
        kernel(x, y)


def test_sequences_of_two_lengths() -> None:
    """A sequence with more links than another is a mistake, of which nothing is left out silently."""
    with pytest.raises(ValueError, match="argument 2 is longer"):
        scan(lambda total, a, b: (total + a * b, total), 0.0, [1.0, 2.0], [1.0, 2.0, 3.0])
