"""The graph of traced equations."""

import math
from collections.abc import Callable

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from armwright.arm.load import load_arm
from armwright.dynamics.newton_euler import newton_euler
from armwright.kinematics.jacobians import jacobian_columns
from armwright.tracing.graph import Graph, Traced, operation_count, reachable
from armwright.tracing.scalar import Scalar, atan2, cbrt, cos, exp, round_half_even, select, sin, sqrt
from oracles.arms import random_arm
from oracles.graphs import evaluate

ROUNDING = 1e-12


def test_the_same_term_is_one_node() -> None:
    """A product written twice, once the other way round, is computed once."""
    a, b = Graph().inputs(2)

    assert (a * b).node == (b * a).node
    assert operation_count(a.graph, [(a * b + b * a).node]) == {"add": 1, "multiply": 1}


@pytest.mark.parametrize(
    ("equation", "operations"),
    [
        (lambda x: 0.0 * x, 0),
        (lambda x: 1.0 * x, 0),
        (lambda x: x + 0.0, 0),
        (lambda x: x - x, 0),
        (lambda x: x / 1.0, 0),
        (lambda x: 0.0 - (0.0 - x), 0),
        (lambda x: -1.0 * x, 1),
        (lambda x: (2.0 + 3.0) * x, 1),
        (lambda x: select(0.0 * x < 1.0, x, sin(x)), 0),
        (lambda x: sin(-x) + sin(x), 0),
        (lambda x: cos(-x) - cos(x), 0),
        (lambda x: (-x) * (-x), 1),
    ],
)
def test_what_does_nothing_costs_nothing(equation, operations: int) -> None:  # type: ignore[no-untyped-def]
    """Zeros, ones and double signs leave the graph, and constants are folded."""
    (x,) = Graph().inputs(1)
    result = equation(x)

    count = operation_count(x.graph, [result.node]) if isinstance(result, Traced) else {}
    assert sum(count.values()) == operations, count


def test_a_condition_has_no_value_while_tracing() -> None:
    """An equation that branches on a traced value is refused with what to write instead."""
    (x,) = Graph().inputs(1)

    with pytest.raises(TypeError, match="write select"):
        _ = 1.0 if x > 0 else 2.0


def test_only_what_is_needed_is_kept() -> None:
    """Terms that no output uses are not counted."""
    a, b = Graph().inputs(2)
    _ = sin(a) * b
    used = a + b

    assert reachable(a.graph, [used.node]) == sorted([a.node, b.node, used.node])


finite = st.floats(-50, 50)
expressions = st.recursive(
    st.sampled_from(["a", "b", "c", "0.0", "1.0", "-1.0", "2.5"]),
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from("+-*"), inner).map(lambda t: f"({t[0]} {t[1]} {t[2]})"),
        st.tuples(st.sampled_from(["sin", "cos", "sqrt", "cbrt", "exp", "-"]), inner).map(lambda t: f"{t[0]}({t[1]})"),
        # Of points right of the y axis: elsewhere the angle depends on the sign of a zero, which is not kept.
        st.tuples(inner, inner).map(lambda t: f"atan2({t[0]}, 1.0 + {t[1]} * {t[1]})"),
        st.tuples(inner, inner, inner).map(lambda t: f"select({t[0]} < {t[1]}, {t[2]}, {t[0]})"),
    ),
    max_leaves=25,
)
SCOPE = {"sin": sin, "cos": cos, "sqrt": sqrt, "cbrt": cbrt, "exp": exp, "atan2": atan2, "select": select}


@given(expressions, finite, finite, finite)
def test_any_expression(text: str, a: float, b: float, c: float) -> None:
    """Whatever is written, the simplified graph has exactly the value of the expression on floats."""
    graph = Graph()
    x, y, z = graph.inputs(3)
    result = eval(text, SCOPE, {"a": x, "b": y, "c": z})
    expected = eval(text, SCOPE, {"a": a, "b": b, "c": c})

    node = result.node if isinstance(result, Traced) else graph.constant(float(result))
    (value,) = evaluate(graph, [node], [a, b, c])

    assert value == expected


@pytest.mark.parametrize("joints", [1, 3, 6, 9])
def test_newton_euler_through_the_graph(joints: int, rng: np.random.Generator) -> None:
    """The traced law of motion has the values of the law on floats, for any arm."""
    arm = random_arm(rng, joints)
    graph = Graph()
    inputs = graph.inputs(3 * joints)

    def law(x: list[Scalar]) -> list[Scalar]:
        return newton_euler(arm, x[:joints], x[joints : 2 * joints], x[2 * joints :])

    outputs = [y.node if isinstance(y, Traced) else graph.constant(y) for y in law(inputs)]
    numbers = rng.normal(size=3 * joints).tolist()

    np.testing.assert_allclose(evaluate(graph, outputs, numbers), law(numbers), rtol=ROUNDING, atol=ROUNDING)


def test_structure_pays() -> None:
    """Right-angled twists and zero offsets halve the work: the Stanford arm needs fewer than 600 operations."""

    def count(arm) -> int:  # type: ignore[no-untyped-def]
        graph = Graph()
        x = graph.inputs(18)
        outputs = [y.node for y in newton_euler(arm, x[:6], x[6:12], x[12:])]
        return sum(operation_count(graph, outputs).values())

    stanford = count(load_arm("stanford-jpl"))
    general = count(random_arm(np.random.default_rng(1), 6))

    assert stanford < 600
    assert general > 1.8 * stanford


def test_sine_and_cosine_are_taken_once() -> None:
    """A Jacobian takes one sine and one cosine per turning joint whose angle matters."""
    arm = load_arm("puma560")
    graph = Graph()
    columns = jacobian_columns(arm, graph.inputs(6))

    outputs = [x.node for column in columns for x in column if isinstance(x, Traced)]
    count = operation_count(graph, outputs)

    assert count["sin"] <= 5
    assert count["cos"] <= 5


@pytest.mark.parametrize("function", [sin, cos, round_half_even])
def test_no_number_is_a_constant_too(function: Callable[[Scalar], Scalar]) -> None:
    """A function of a constant that is infinite or no number has a value, and does not stop the tracing."""
    (x,) = Graph().inputs(1)
    infinite, nan = 1.0 / (0.0 * x), 0.0 * x / (0.0 * x)

    values = [x.graph.value(function(constant).node) for constant in (nan, infinite, -infinite)]

    expected = [math.nan, math.inf, -math.inf] if function is round_half_even else [math.nan] * 3
    np.testing.assert_array_equal(values, expected)
    np.testing.assert_array_equal([function(x) for x in (math.nan, math.inf, -math.inf)], expected)


def test_signed_zero_and_negative_constants() -> None:
    """-0.0 and 0.0 are two constants, as atan2 can tell."""
    graph = Graph()

    assert graph.constant(-0.0) != graph.constant(0.0)
    assert math.copysign(1, evaluate(graph, [graph.constant(-0.0)], [])[0]) == -1
