"""From traced graphs to the operations of a processor, evaluated one by one with exact fractions."""

import itertools
import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from armwright.arrays import LARGEST, LARGEST_ANGLE
from armwright.tracing.emit import Guarded, emit
from armwright.tracing.graph import Graph, Traced
from armwright.tracing.machine import MachineCode, Watched, fused, machine_code, scheduled, with_results
from armwright.tracing.scalar import Scalar, atan2, cbrt, cos, exp, round_half_even, select, sin, sqrt
from oracles.graphs import evaluate_machine

LANGUAGE = {"add", "subtract", "multiply", "divide", "negate", "absolute", "sqrt", "less", "less_equal", "select"}
LANGUAGE |= {"fma", "bit", "both", "either", "differ", "not", "number", "input", "constant"}


def values(code: MachineCode, *inputs: float) -> list[float]:
    return list(evaluate_machine(code, code.outputs, inputs))


def one(equation: Callable[..., Scalar], inputs: int) -> MachineCode:
    """The operations of an equation with one number as its result."""
    scalars = Graph().inputs(inputs)
    return machine_code(scalars[0].graph, [equation(*scalars).node])


def everything(x: Scalar, y: Scalar) -> Scalar:
    turned = sin(3.0 * x) * cos(y - x) + atan2(y, x * y - 1.0) + cbrt(x - y) * exp(-(y * y))
    return select(abs(x) < y, sqrt(x * x + y * y) / (2.0 + turned), round_half_even(7.0 * y) - turned * turned)


def test_means_what_the_equation_means(rng: np.random.Generator) -> None:
    """The operations give what the equation gives with the functions of the library, but for rounding."""
    code = one(everything, 2)

    assert {code.graph.nodes[i].op for i in code.order} <= LANGUAGE
    for x, y in rng.uniform(-2, 2, (200, 2)).tolist():
        expected = everything(x, y)
        assert values(code, x, y)[0] == pytest.approx(expected, rel=1e-13, abs=1e-14)


@pytest.mark.parametrize("reach", [1.0, 1e5])
def test_sine_and_cosine(reach: float, rng: np.random.Generator) -> None:
    """Both are within 2 units in the last place of the library's, and share their operations."""
    x, *_ = Graph().inputs(1)
    code = machine_code(x.graph, [sin(x).node, cos(x).node])

    for angle in rng.uniform(-reach, reach, 300).tolist():
        for value, exact in zip(values(code, angle), (math.sin(angle), math.cos(angle)), strict=True):
            assert abs(value - exact) <= 2 * math.ulp(exact)
    assert len(code.order) < 1.2 * len(machine_code(x.graph, [sin(x).node]).order)


def test_arc_tangent_of_zeros_of_either_sign() -> None:
    """At the axes the arc tangent is that of the library; zeros of either sign are +0.0."""
    code = one(atan2, 2)

    for y in (0.0, -0.0, 1.0, -1.0):
        for x in (0.0, -0.0, 1.0, -1.0):
            (angle,) = values(code, y, x)
            assert angle == math.atan2(y + 0.0, x + 0.0)
            assert math.copysign(1.0, angle) == (-1.0 if y < 0 else 1.0)


@pytest.mark.parametrize("equation", [sin, cos, sqrt, cbrt, exp, abs, lambda x: atan2(x, 0.5), lambda x: atan2(0.5, x)])
def test_what_is_no_number_goes_on(equation: Callable[[Scalar], Scalar]) -> None:
    """NaN within an equation comes out as NaN."""
    assert math.isnan(values(one(equation, 1), math.nan)[0])


def test_roots_of_what_is_not_above_zero() -> None:
    """They are 0, of -0.0 too."""
    for x in (0.0, -0.0, -1e-300, -4.0):
        (root,) = values(one(sqrt, 1), x)
        assert (root, math.copysign(1.0, root)) == (0.0, 1.0)


def test_truth_values_and_numbers() -> None:
    """A comparison counts as 1 or 0, a number holds where it is not 0, and a flag is a truth value."""
    x, y = Graph().inputs(2)
    results = [(x < y) + 2.0, select(x, 3.0 * y, y), select(x < y, x, y), x]
    code = machine_code(x.graph, [r.node for r in results], flags=[3])

    assert values(code, 1.0, 2.0) == [3.0, 6.0, 1.0, True]
    assert values(code, -0.0, -2.0) == [2.0, -2.0, -2.0, False]
    assert values(code, -1.0, -2.0) == [2.0, -6.0, -2.0, True]


# ---- which multiplication an addition takes in ----


def joined(equation: Callable[..., Sequence[Traced]], inputs: int) -> int:
    scalars = Graph().inputs(inputs)
    return machine_code(scalars[0].graph, [x.node for x in equation(*scalars)]).joined


@pytest.mark.parametrize(
    ("equation", "count"),
    [
        (lambda a, b, c: [a * b + c], 1),
        (lambda a, b, c: [a * b - c], 1),
        (lambda a, b, c: [c - a * b], 1),
        (lambda a, b, c: [a * b + c, a * b - c], 2),
        (lambda a, b, c: [a * b + c * a], 1),
        # The product is needed all the same.
        (lambda a, b, c: [a * b + c, a * b], 0),
        (lambda a, b, c: [a * b + c, sin(a * b)], 0),
        (lambda a, b, c: [a * b + a * b, c], 0),
    ],
)
def test_products_that_disappear(equation: Callable[..., Sequence[Traced]], count: int) -> None:
    """A product is taken in by all sums that use it, or by none."""
    assert joined(equation, 3) == count


@pytest.mark.parametrize(
    ("equation", "exact"),
    [
        (lambda a, b, c: a * b + c, -(2.0**-104)),
        (lambda a, b, c: a * b - (-c), -(2.0**-104)),
        (lambda a, b, c: (-c) - a * b, 2.0**-104),
    ],
)
def test_rounded_once(equation: Callable[..., Traced], exact: float) -> None:
    """(1 + e)(1 - e) - 1 is -e², all of it, where the product is taken in."""
    assert values(one(equation, 3), 1 + 2.0**-52, 1 - 2.0**-52, -1.0) == [exact]


def test_fused_is_a_part_of_the_graph() -> None:
    """Of sums that could take in either product, each takes in one at most."""
    a, b, c = Graph().inputs(3)
    total = a * b + b * c
    taken = fused(a.graph, range(len(a.graph.nodes)), [total.node])

    assert list(taken) == [total.node]


# ---- what is watched ----


def verdict(code: MachineCode, node: int | None, inputs: Sequence[float]) -> bool:
    assert node is not None
    (found,) = evaluate_machine(code, [node], inputs)
    assert isinstance(found, bool)
    return found


def test_inputs_without_meaning() -> None:
    """At every place NaN, infinity and too large a number are without meaning; the largest allowed has one."""
    code = emit("watched", lambda q, v: [[sin(q[0]) + cos(q[1]) * v[0] + v[1]]], {"q": 2, "v": 2}).code
    sound = [0.1, -0.2, 3.0, 4.0]

    assert not verdict(code, code.invalid, sound)
    for place, largest in enumerate((LARGEST_ANGLE, LARGEST_ANGLE, LARGEST, LARGEST)):
        alone = [0.0] * 4
        for bad in (math.nan, math.inf, -math.inf, 1.001 * largest, -1.001 * largest):
            assert verdict(code, code.invalid, [bad if i == place else x for i, x in enumerate(sound)]), (place, bad)
        alone[place] = largest
        assert not verdict(code, code.invalid, alone)


def test_conditions_and_bounds() -> None:
    """Conditions are numbers above 0 or comparisons that hold; beyond bounds an input is unusual."""
    emitted = emit(
        "guarded",
        lambda x: Guarded([[x[0] + x[1]]], [x[0] - 1.0, x[0] < x[1]]),
        {"x": 2},
        bounds={"x": [5.0, math.inf]},
    )
    code = emitted.code

    assert not verdict(code, code.invalid, [2.0, 3.0])
    for broken in ([1.0, 3.0], [2.0, 2.0], [math.nan, 3.0]):
        assert verdict(code, code.invalid, broken)
    assert [verdict(code, code.unusual, [x, 1e6]) for x in (5.0, -5.0, 5.1, -5.1)] == [False, False, True, True]


def test_nothing_watched() -> None:
    """Without conditions and bounds there is no verdict."""
    code = one(lambda x: x + 1.0, 1)

    assert (code.invalid, code.unusual) == (None, None)


def assert_orders(code: MachineCode, order: Sequence[int]) -> None:
    """Check that an order has every node in use once, behind its operands."""
    assert sorted(order) == sorted(code.order)
    places = {node: place for place, node in enumerate(order)}
    assert all(places[k] < place for node, place in places.items() for k in code.graph.nodes[node].operands)


def chains(count: int) -> MachineCode:
    """Sums of several numbers, each of which waits for the one before, and a condition."""
    graph = Graph()
    x, *others = graph.inputs(9)
    ends = []
    for k in range(count):
        total = x
        for y in others:
            total = total * (y + k)
        ends.append(total.node)
    watched = Watched(others=[x.node], positive=[ends[0]])
    return machine_code(graph, ends, watched)


def test_results_are_known_early() -> None:
    """Each result is known long before the end, conditions stand behind what they are about, and nothing is lost."""
    code = chains(6)
    groups = [code.outputs[k : k + 2] for k in (4, 0, 2)]

    for in_turn, turns in ((False, [1, 2, 0]), (True, [0, 1, 2])):
        found = with_results(code, groups, in_turn=in_turn)

        order = [node for node, _ in found]
        assert_orders(code, order)
        assert [k for _, known in found for k in known] == turns
        for place, (_, known) in enumerate(found):
            assert all(set(groups[k]) <= set(order[: place + 1]) for k in known)
        first = min(place for place, (_, known) in enumerate(found) if known)
        assert first < 0.6 * len(order)
    # The condition of the first output does not wait for the others.
    order = [node for node, _ in with_results(code, groups)]
    (less,) = (i for i in code.order if code.graph.nodes[i].op == "less")
    assert order.index(less) == order.index(code.outputs[0]) + 1


def test_operations_side_by_side() -> None:
    """Chains whose operations wait for each other are done side by side."""
    code = chains(4)

    order = scheduled(code.graph, code.order)

    assert_orders(code, order)
    products = [i for i in order if code.graph.nodes[i].op == "multiply"]
    neighbours = sum(a in code.graph.nodes[b].operands for a, b in itertools.pairwise(products))
    in_order = [i for i in code.order if i in products]
    assert neighbours < 0.2 * sum(a in code.graph.nodes[b].operands for a, b in itertools.pairwise(in_order))
