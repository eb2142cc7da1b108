"""Derivatives of traced equations, by both modes."""

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest

from armwright.arm.model import Motor
from armwright.dynamics.drives import joint_friction_law
from armwright.tracing.derivatives import forward_mode, jacobian, replaced, reverse_mode
from armwright.tracing.evaluation import evaluate
from armwright.tracing.graph import Graph, Traced, operation_count
from armwright.tracing.scalar import Scalar, atan2, cbrt, cos, exp, round_half_even, select, sin, sqrt
from oracles import graphs
from samples import Sample

ROUNDING = 1e-12  # relative to the largest derivative

OPERATIONS: dict[str, Callable[[Scalar, Scalar], Scalar]] = {
    "add": lambda x, y: x + y,
    "subtract": lambda x, y: x - y,
    "multiply": lambda x, y: x * y,
    "square": lambda x, _: x * x,
    "divide": lambda x, y: x / y,
    "negate": lambda x, _: -x,
    "sin": lambda x, _: sin(x),
    "cos": lambda x, _: cos(x),
    "sqrt": lambda x, y: sqrt(x * x + y * y),
    "cbrt": lambda x, y: cbrt(x + y),
    "exp": lambda x, y: exp(-(x * x) + 0.1 * y),
    "atan2": atan2,
    "absolute": lambda x, _: abs(x),
    "round": lambda x, y: y * round_half_even(x),
    "less": lambda x, y: select(x < y, x * y, x + y),
    "less_equal": lambda x, y: select(x <= y, x, y * y),
}


def _nodes(*scalars: Scalar) -> list[int]:
    return [x.node for x in scalars]


def _assert_both_modes(graph: Graph, outputs: list[int], inputs: list[int], values: list[float]) -> None:
    """Check the derivatives of a graph against complex steps."""
    expected = np.array([graphs.complex_step(graph, outputs, values, k) for k in range(len(inputs))]).T
    for mode in (forward_mode, reverse_mode):
        rows = mode(graph, outputs, inputs)
        found = [graphs.evaluate(graph, row, values) for row in rows]
        np.testing.assert_allclose(found, expected, rtol=0, atol=ROUNDING * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("name", OPERATIONS)
def test_operations(name: str, rng: np.random.Generator) -> None:
    """Every operation that an equation can have is differentiated, as complex steps say."""
    for x, y in rng.normal(size=(20, 2)).tolist():
        graph = Graph()
        inputs = graph.inputs(2)

        _assert_both_modes(graph, _nodes(OPERATIONS[name](*inputs)), _nodes(*inputs), [x, y])


def _random_equation(rng: np.random.Generator, scalars: list[Scalar], steps: int) -> list[Scalar]:
    """Apply random operations to random earlier scalars; values stay of moderate size."""
    for _ in range(steps):
        x, y, z = (scalars[i] for i in rng.integers(len(scalars), size=3))
        name = rng.choice([*OPERATIONS])
        scalars = [*scalars, sin(OPERATIONS[name](x, 2.0 + cos(y)) + 0.3 * z)]
    return scalars[-5:]


def test_random_equations(sample: Sample) -> None:
    """Both modes agree with complex steps on equations of random operations, whose terms are shared at random."""
    for rng in sample.cases(300):
        graph = Graph()
        inputs = graph.inputs(4)
        outputs = [x for x in _random_equation(rng, list(inputs), 30) if isinstance(x, Traced)]

        _assert_both_modes(graph, _nodes(*outputs), _nodes(*inputs), rng.normal(size=4).tolist())
    sample.record("derivatives of random equations are those of complex steps", sample.count(300), 0)


@pytest.mark.parametrize(
    ("equation", "at", "expected"),
    [
        (abs, 0.0, 0.0),
        (abs, -2.0, -1.0),
        (sqrt, 0.0, 0.0),
        (sqrt, -1.0, 0.0),
        (sqrt, 4.0, 0.25),
        (cbrt, 0.0, 0.0),
        (cbrt, -8.0, 1 / 12),
        (exp, 0.0, 1.0),
        (lambda x: atan2(x, 0.0 * x), 0.0, 0.0),
        (lambda x: atan2(x, x), 0.0, 0.0),
        (lambda x: atan2(x, 2.0), 0.0, 0.5),
        (round_half_even, 0.5, 0.0),
        (lambda x: 1.0 * (x < 1.0), 1.0, 0.0),
        (lambda x: select(x > 0.0, x, 3.0 * x), 0.0, 3.0),
        (lambda x: joint_friction_law(Motor(coulomb_forward=2.0, coulomb_backward=3.0)).dry(x, x), 0.0, 0.0),
        (lambda x: joint_friction_law(Motor(coulomb_forward=2.0, coulomb_backward=3.0)).dry(x, x), 0.1, 0.0),
        (lambda x: joint_friction_law(Motor(stribeck=2.0, stribeck_speed=0.5)).dry(x, x), 0.0, 0.0),
        (lambda x: joint_friction_law(Motor(cube_root=2.0, offset=1.0)).smooth(x), 0.0, 2.0 * 1e-4 ** (-2 / 3)),
    ],
)
def test_edges(equation: Callable[[Scalar], Scalar], at: float, expected: float) -> None:
    """Where there is no derivative, or one of a branch alone, the derivative is what the page says."""
    graph = Graph()
    (x,) = graph.inputs(1)
    ends = _nodes(equation(x))

    for mode in (forward_mode, reverse_mode):
        rows = mode(graph, ends, [x.node])
        assert graphs.evaluate(graph, rows[0], [at]) == [expected]


@pytest.mark.parametrize(
    "equation",
    [
        lambda x, y: select(x > 0.0, y / x, x * x * y),
        lambda x, y: select(x <= 0.0, x * x * y, y / x),
    ],
    ids=["first", "second"],
)
def test_a_branch_that_is_not_chosen(equation: Callable[[Scalar, Scalar], Scalar]) -> None:
    """A division by 0 in a branch that is not chosen leaves no NaN in the derivatives, nor in the second ones."""
    graph = Graph()
    x, y = graph.inputs(2)

    row = jacobian([equation(x, y)], [x, y])[0]
    second = jacobian(row, [x, y])

    assert evaluate(graph, row, [0.0, 2.0]) == [0.0, 0.0]
    assert [evaluate(graph, of, [0.0, 2.0]) for of in second] == [[4.0, 0.0], [0.0, 0.0]]
    assert evaluate(graph, row, [2.0, 3.0]) == [-0.75, 0.5]


@pytest.mark.parametrize("branch", [1, 2])
def test_a_branch_of_many_inputs_that_is_not_chosen(branch: int) -> None:
    """The same where the reverse mode, whose derivatives are NaN there, would take fewer operations."""
    graph = Graph()
    x, *others = inputs = graph.inputs(7)
    share = math.prod(others[1:], start=others[0]) / x
    total = sum(others, start=x)
    ends = [select(x > 0.0, share, total) if branch == 1 else select(x <= 0.0, total, share)]

    row = jacobian(ends, inputs)[0]
    reverse = reverse_mode(graph, _nodes(*ends), _nodes(*inputs))[0]

    values = [0.0, *[2.0] * 6]
    assert evaluate(graph, row, values) == [1.0] * 7
    assert np.isnan(evaluate(graph, [Traced(graph, i) for i in reverse], values)).any()
    assert sum(operation_count(graph, reverse).values()) < sum(operation_count(graph, _nodes(*row)).values())


def test_fewer_operations() -> None:
    """Of one output by many inputs the reverse mode is taken, of many outputs by one input the forward mode."""

    def count(graph: Graph, rows: list[list[int]]) -> int:
        return sum(operation_count(graph, [node for row in rows for node in row]).values())

    def counts(outputs: list[Traced], inputs: list[Traced]) -> tuple[int, int, int]:
        graph, ends, starts = inputs[0].graph, _nodes(*outputs), _nodes(*inputs)
        found = [_nodes(*row) for row in jacobian(outputs, inputs)]
        modes = (forward_mode(graph, ends, starts), reverse_mode(graph, ends, starts))
        return count(graph, found), count(graph, modes[0]), count(graph, modes[1])

    many = Graph().inputs(10)
    product = many[0] * many[1]
    for x in many[2:]:
        product = sin(product) * x
    taken, forward, reverse = counts([product], many)
    assert taken == reverse < forward

    (x,) = Graph().inputs(1)
    shared = sin(x * cos(x)) / (2.0 + sin(x))
    outputs = [shared]
    for k in range(8):
        outputs.append(cos(outputs[-1]) * (k + 2.0))
    taken, forward, reverse = counts(outputs, [x])
    assert taken == forward < reverse


def test_numbers_have_no_derivative() -> None:
    """An output that is a number, and one that does not depend on an input, have the derivative 0."""
    graph = Graph()
    x, y = graph.inputs(2)

    rows = jacobian([3.0, x], [x, y])

    assert [evaluate(graph, row, [1.0, 2.0]) for row in rows] == [[0.0, 0.0], [1.0, 0.0]]


def test_inputs_replaced(rng: np.random.Generator) -> None:
    """A function of a function: inputs become scalars of the same graph, also where these occurred before."""
    graph = Graph()
    x, y, held = graph.inputs(3)
    outputs = [sin(held) * x + held, sin(x * y), 2.0]

    found = replaced(outputs, {held.node: sin(x * y)}, graph)

    a, b = rng.normal(size=2).tolist()
    inner = np.sin(a * b)
    np.testing.assert_allclose(evaluate(graph, found, [a, b]), [np.sin(inner) * a + inner, inner, 2.0], rtol=ROUNDING)


def test_evaluated_with_arrays(rng: np.random.Generator) -> None:
    """A graph has, over arrays of any shape, the values that it has over floats, one by one."""
    graph = Graph()
    inputs = graph.inputs(4)
    outputs = [*_random_equation(rng, list(inputs), 60), inputs[2], inputs[0] < inputs[1], (inputs[0] < 1) - 1.0, 7.0]
    arrays = rng.normal(size=(4, 3, 2))

    found = evaluate(graph, outputs, list(arrays))

    nodes = [x.node if isinstance(x, Traced) else graph.constant(x) for x in outputs]
    for at in np.ndindex(3, 2):
        expected = graphs.evaluate(graph, nodes, arrays[:, *at].tolist())
        np.testing.assert_allclose([np.broadcast_to(x, (3, 2))[at] for x in found], expected, rtol=0, atol=ROUNDING)
        alone = evaluate(graph, outputs, arrays[:, *at].tolist())
        np.testing.assert_allclose(np.array(alone, dtype=float), expected, rtol=0, atol=ROUNDING)


def test_modes_give_up() -> None:
    """Forward mode stops where it takes more than it may; the mode with fewer operations is the one that is kept."""
    inputs = Graph().inputs(12)
    graph = inputs[0].graph
    total = sum((sin(x) * cos(y) for x, y in itertools.pairwise(inputs)), start=inputs[0])
    starts = [x.node for x in inputs]

    assert forward_mode(graph, [total.node], starts, 5) is None
    assert forward_mode(graph, [total.node], starts, 10_000) == forward_mode(graph, [total.node], starts)

    (x,) = Graph().inputs(1)
    powers = [x]
    for _ in range(20):
        powers.append(powers[-1] * x)
    rows = [row[0].node for row in jacobian(powers, [x])]
    of_forward = [row[0] for row in forward_mode(x.graph, [y.node for y in powers], [x.node])]
    assert rows == of_forward
