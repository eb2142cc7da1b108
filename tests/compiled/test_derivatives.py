"""Equations of the user's, compiled with their derivatives."""

import inspect
import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import pytest

import armwright
from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, Link
from armwright.arrays import Array
from armwright.compiled.derivatives import derivative
from armwright.compiled.quantities import emit_quantity
from armwright.dynamics.derivatives import forward_dynamics_derivatives, inverse_dynamics_derivatives
from armwright.dynamics.energy import link_kinetic_energy, link_potential_energy
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.dynamics.regressors import regressor
from armwright.dynamics.shares import gravity_efforts
from armwright.errors import InvalidValueError, KindError, ShapeError, UnknownNameError
from armwright.tracing import atan2, cos, select, sin, sqrt
from armwright.tracing.scalar import Scalar
from oracles.arms import of_all_kinds, random_arm

ROUNDING = 1e-12  # relative to the largest number
STEP = 1e-5
DIFFERENCE = 1e-8  # of central differences with that step: its square times a third derivative, and rounding over it


def hand(q: Sequence[Scalar], lengths: Sequence[Scalar]) -> list[Scalar]:
    """Distance and direction of the end of a chain of two bars, and a price that has a threshold."""
    x = lengths[0] * cos(q[0]) + lengths[1] * cos(q[0] + q[1])
    y = lengths[0] * sin(q[0]) + lengths[1] * sin(q[0] + q[1])
    return [sqrt(x * x + y * y), atan2(y, x), select(q[1] > 0.5, x * y, abs(y) / lengths[1])]


def potential(q: Sequence[Scalar]) -> Scalar:
    """A scalar with a choice, a root and an angle."""
    r = sqrt(1.0 + q[0] * q[0] + q[1] * q[1])
    return select(q[2] > 0.0, r * atan2(q[1], q[0]), sin(q[2]) / r) + q[2] * q[2] * q[0]


def _differences(function, q: Array) -> Array:  # type: ignore[no-untyped-def]
    """Central differences of an array-valued function by (k,) numbers: the last axis."""
    steps = STEP * np.eye(len(q))
    return np.stack([(function(q + step) - function(q - step)) / (2 * STEP) for step in steps], axis=-1)


def test_against_central_differences(rng: np.random.Generator) -> None:
    """Derivatives by both inputs are those of central differences, on both sides of the threshold."""
    fast = derivative(hand, {"q": 2, "lengths": 2}, of=("q", "lengths"))
    for q, lengths in zip(rng.uniform(0.1, 1.2, size=(20, 2)), rng.uniform(1, 2, size=(20, 2)), strict=True):
        values, by_q, by_lengths = fast(q, lengths)

        np.testing.assert_allclose(values, hand(q.tolist(), lengths.tolist()), rtol=ROUNDING)
        np.testing.assert_allclose(by_q, _differences(lambda x, p=lengths: fast(x, p)[0], q), atol=DIFFERENCE)
        np.testing.assert_allclose(by_lengths, _differences(lambda x, p=q: fast(p, x)[0], lengths), atol=DIFFERENCE)


def test_hessian_against_central_differences(rng: np.random.Generator) -> None:
    """The Hessian is the central difference of the gradient, and symmetric to the bit."""
    fast = derivative(potential, {"q": np.int64(3)}, of="q", order=2)
    for q in rng.uniform(0.2, 1.0, size=(20, 3)) * ([1, 1, 1], [1, 1, -1])[int(rng.integers(2))]:
        value, gradient, hessian = fast(q)

        np.testing.assert_allclose(value, potential(q.tolist()), rtol=ROUNDING)
        np.testing.assert_allclose(gradient, _differences(lambda x: fast(x)[0], q), atol=DIFFERENCE)
        np.testing.assert_allclose(hessian, _differences(lambda x: fast(x)[1], q), atol=DIFFERENCE)
        np.testing.assert_array_equal(hessian, hessian.T)


def test_equations_of_an_arm(rng: np.random.Generator) -> None:
    """Energies of an arm: the slope of the potential one is gravity's, the curvature of the kinetic one the mass."""
    arm = random_arm(rng, 3)
    q, qd = rng.normal(size=(2, 10, 3))

    _, slope = derivative(partial(link_potential_energy, arm), {"q": 3}, of="q")(q)
    *_, curvature = derivative(partial(link_kinetic_energy, arm), {"q": 3, "qd": 3}, of="qd", order=2)(q, qd)

    expected = gravity_efforts(arm, q)
    np.testing.assert_allclose(slope, expected, atol=ROUNDING * np.abs(expected).max())
    M = mass_matrix(arm, q, drives=False)
    np.testing.assert_allclose(curvature, M, atol=ROUNDING * np.abs(M).max())


def test_equal_scalars() -> None:
    """Two scalars are compared as numbers are: where they are equal the first branch is taken, elsewhere the second."""
    fast = derivative(
        lambda x: [select(x[0] == 0.0, 5.0 * x[1], x[1]), select(x[0] != x[1], 1.0 / (x[0] - x[1]), 7.0), x[0] == x[0]],
        {"x": 2},
        of="x",
    )

    for x, expected, slopes in (
        ((0.0, 2.0), (10.0, -0.5, 1.0), ((0.0, 5.0), (-0.25, 0.25), (0.0, 0.0))),
        ((2.0, 2.0), (2.0, 7.0, 1.0), ((0.0, 1.0), (0.0, 0.0), (0.0, 0.0))),
        ((-0.0, 0.0), (0.0, 7.0, 1.0), ((0.0, 5.0), (0.0, 0.0), (0.0, 0.0))),
    ):
        values, by_x = fast(x)
        np.testing.assert_array_equal(values, expected)
        np.testing.assert_array_equal(by_x, slopes)


def test_angles_that_have_no_sine() -> None:
    """An angle that the equation makes too large has no sine, rather than one beyond 1; a smaller one has."""
    fast = derivative(lambda x: [sin(x[0] * x[0]), cos(x[0] / x[1]), cos(x[0] - 3.0 * x[1])], {"x": 2}, of="x")

    values, by_x = fast([3.1e7, 1.0])
    assert np.abs(values).max() <= 1
    assert np.isfinite(by_x).all()
    values, by_x = fast([4e7, 1e-8])
    assert np.isnan(values).tolist() == [True, True, False]
    assert np.isnan(by_x).any(axis=1).tolist() == [True, True, False]


@pytest.mark.parametrize("quantity", ["inverse_branches", "inverse_dynamics"])
def test_angles_of_an_arm_have_sines(quantity: str) -> None:
    """The angles of an arm cannot be too large, and no operation asks whether they are."""
    code = emit_quantity(load_arm("ur5"), quantity).code

    assert not any(np.isnan(code.graph.nodes[i].value) for i in code.order)


def test_shapes(rng: np.random.Generator) -> None:
    """Inputs are vectors, matrices and single numbers, with leading axes; derivatives have the axes of both."""

    def equation(A: Sequence[Scalar], x: Sequence[Scalar], c: Sequence[Scalar]) -> list[Scalar]:
        return [c[0] * (A[2 * i] * x[0] + A[2 * i + 1] * x[1]) for i in range(3)]

    fast = derivative(equation, {"A": (3, 2), "x": 2, "c": ()}, of=["x", "A", "c"])
    A, x, c = rng.normal(size=(5, 3, 2)), rng.normal(size=(4, 1, 2)), rng.normal(size=(4, 5))

    values, by_x, by_A, by_c = fast(A, x, c)

    np.testing.assert_allclose(values, c[..., None] * (A @ x[..., None])[..., 0], rtol=ROUNDING)
    np.testing.assert_allclose(by_x, c[..., None, None] * A, rtol=ROUNDING)
    assert by_A.shape == (4, 5, 3, 3, 2)
    expected = np.einsum("ij,abk->abijk", np.eye(3), c[..., None] * x)
    np.testing.assert_allclose(by_A, expected, rtol=ROUNDING)
    np.testing.assert_allclose(by_c, (A @ x[..., None])[..., 0], rtol=ROUNDING)
    alone = fast(A[3], x[2, 0], c[2, 3])
    for one, many in zip(alone, (values, by_x, by_A, by_c), strict=True):
        np.testing.assert_array_equal(one, many[2, 3])


def test_hessian_by_several_inputs() -> None:
    """By two inputs the Hessian has the numbers of both, one behind the other: of a b² it is worked by hand."""
    fast = derivative(lambda a, b: a[0] * b[0] * b[0], {"a": 1, "b": 1}, of=("b", "a"), order=2)

    value, by_b, by_a, hessian = fast([3.0], [2.0])

    assert (value, by_b, by_a) == (12.0, 12.0, 4.0)
    np.testing.assert_array_equal(hessian, [[6.0, 4.0], [4.0, 0.0]])


def test_help_of_the_function() -> None:
    """The function has the inputs as its arguments, and says by what it differentiates."""
    fast = armwright.compiled.derivative(hand, {"q": 2, "lengths": 2}, of="lengths")

    assert fast.__name__ == "hand"
    assert str(inspect.signature(fast)) == "(q, lengths, *, threads=None, out=None)"
    assert "derivatives by lengths" in (fast.__doc__ or "")


def test_numbers_that_are_none() -> None:
    """What kernels refuse is refused here: numbers that are not finite, and other shapes."""
    fast = derivative(hand, {"q": 2, "lengths": 2}, of="q")

    with pytest.raises(InvalidValueError, match="lengths: every number must be finite"):
        fast([0.1, 0.2], [1.0, np.nan])
    with pytest.raises(ShapeError, match="q: expected shape"):
        fast([0.1, 0.2, 0.3], [1.0, 1.0])


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"of": "p"}, UnknownNameError, "'p'"),
        ({"of": ()}, InvalidValueError, "of: expected the name of an input"),
        ({"of": "q", "order": 3}, InvalidValueError, "order: expected 1 or 2, got 3"),
        ({"of": "q", "order": 2}, InvalidValueError, "the equation returns a list of 3 scalars"),
        ({"of": "q", "inputs": {"q": 0, "lengths": 2}}, ShapeError, "inputs: expected a size above 0"),
        ({"of": "q", "inputs": {"q": True, "lengths": 2}}, ShapeError, "got True"),
        ({"of": "q", "inputs": {"q": (2, 0.5), "lengths": 2}}, ShapeError, r"got \(2, 0.5\)"),
        ({"of": "q", "inputs": {"q": 2, "a b": 2}}, InvalidValueError, "got 'a b'"),
        ({"of": "q", "inputs": {"q": 10**400, "lengths": 2}}, ShapeError, "at most 10,000 numbers for 'q'"),
        ({"of": "q", "inputs": {"q": 2, 1: 2}}, KindError, "inputs: expected the name of each to be a text.*got 1"),
        ({"of": 5}, KindError, "of: expected the name of an input, or a list of such, got 5"),
        ({"of": ("q", 5)}, KindError, "of: expected the name of an input"),
        ({"of": "q", "order": True}, InvalidValueError, "order: expected 1 or 2, got True"),
        ({"of": "q", "equation": lambda _q, _p: 10**400}, InvalidValueError, "equation: expected a number no larger"),
        (
            {"of": "q", "equation": lambda q, _p: 10**400 * q[0]},
            InvalidValueError,
            "equation: expected a number no lar",
        ),
        ({"of": "q", "equation": lambda q, _p: q[0] * "3"}, KindError, "equation: expected a number, got '3'"),
        ({"of": "q", "equation": lambda q, _p: "a" + q[0]}, KindError, "equation: expected a number, got 'a'"),
        ({"of": "q", "equation": lambda q, _p: q[0] * 1j}, KindError, "equation: expected a number, got 1j"),
        ({"of": "q", "equation": "hand"}, KindError, "expected a function of scalars, got 'hand'"),
        ({"of": "q", "equation": lambda _q, _p: "x"}, KindError, "return a scalar or a list of scalars, .* got 'x'"),
        ({"of": "q", "equation": lambda _q, _p: []}, ShapeError, "at least one scalar"),
        ({"of": "q", "equation": lambda q, _p: [[q[0]]]}, KindError, "return a scalar or a list of scalars"),
    ],
)
def test_mistakes(arguments: dict[str, object], error: type[Exception], message: str) -> None:
    """What is no equation, no input and no order is refused with what was expected."""
    given = {"equation": hand, "inputs": {"q": 2, "lengths": 2}} | arguments

    with pytest.raises(error, match=message):
        derivative(given.pop("equation"), given.pop("inputs"), **given)  # type: ignore[arg-type]


def test_arms_of_all_kinds(rng: np.random.Generator) -> None:
    """Compiled derivatives and regressors of arms with fixed transforms, weightless links and friction are the plain.

    Among the velocities are those of joints at rest.
    """
    arm = of_all_kinds(random_arm(rng, 4), rng)
    fast, motion = armwright.compile_arm(arm), rng.normal(size=(3, 21, 4))
    motion[1, ::4, ::2] = 0.0
    for plain in (inverse_dynamics_derivatives, forward_dynamics_derivatives, regressor):
        found, expected = getattr(fast, plain.__name__)(*motion), plain(arm, *motion)

        for one, other in zip(*((x,) if isinstance(x, np.ndarray) else x for x in (found, expected)), strict=True):
            np.testing.assert_allclose(one, other, atol=1e-10 * np.abs(other).max())


def test_inputs_that_no_derivative_needs() -> None:
    """An acceleration that is NaN is refused, though derivatives may not depend on it."""
    slide = Arm(name="slide", joints=[Joint(kind="prismatic")], links=[Link(mass=1.0)])

    with pytest.raises(InvalidValueError, match="qdd: every number must be finite"):
        armwright.compile_arm(slide).inverse_dynamics_derivatives([0.0], [0.0], [np.nan])


def test_catalogue_arm_by_the_class(rng: np.random.Generator) -> None:
    """The derivatives of an arm of the catalogue are methods of the compiled arm, which fill arrays of the caller's."""
    fast = armwright.compile_arm(load_arm("stanford"))
    q, qd, qdd = rng.normal(size=(3, 7, 6))
    out = tuple(np.empty((7, 6, 6)) for _ in range(3))

    assert fast.inverse_dynamics_derivatives(q, qd, qdd, out=out)[2] is out[2]

    np.testing.assert_allclose(out[2], fast.mass_matrix(q), atol=ROUNDING * np.abs(out[2]).max())


@pytest.mark.parametrize(
    ("equation", "message"),
    [
        (lambda q: 1.0 if q[0] in [1.0, 2.0] else q[1], "no truth value yet"),
        (lambda q: q[0] if q[0] > 0.0 else q[1], "write select"),
        (lambda q: math.sin(q[0]), "sin, cos and others of armwright.tracing"),
        (lambda q: float(q[0]), "sin, cos and others of armwright.tracing"),
        (lambda q: q[0] ** 3, "no power but 2"),
        (lambda q: q[0] ** q[1], "no power but 2"),
    ],
)
def test_what_scalars_cannot_do(equation: Callable[[Sequence[Scalar]], Scalar], message: str) -> None:
    """What needs the value of a scalar that has none yet is an error that names the way out, equality too."""
    with pytest.raises(TypeError, match=message):
        derivative(equation, {"q": 2}, of="q")


def test_inputs_that_are_none() -> None:
    """Inputs are a mapping of names to sizes; a truth value is no size."""
    with pytest.raises(KindError, match="inputs: expected names with sizes"):
        derivative(potential, ["q"], of="q")  # type: ignore[arg-type]
    for size in (True, 2.0, "2", None):
        with pytest.raises(ShapeError, match="inputs: expected a size"):
            derivative(potential, {"q": size}, of="q")  # type: ignore[dict-item]


@pytest.mark.parametrize("equation", [lambda q: np.sin(q[0]), np.sin, lambda q: math.exp(q[0])])
def test_functions_of_others(equation: Callable[[Sequence[Scalar]], Scalar]) -> None:
    """A function of another library that takes no traced scalars is an error that says where there are such."""
    with pytest.raises(TypeError) as found:
        derivative(equation, {"q": 2}, of="q")

    assert "functions from armwright.tracing" in found.value.__notes__[0]


def test_how_many_numbers_an_input_may_have() -> None:
    """An input has 10 000 numbers at most, whatever its shape."""
    for shape in (10_000, (100, 100)):
        with pytest.raises(UnknownNameError, match="nowhere"):  # what is looked at next
            derivative(lambda x: x[0], {"x": shape}, of="nowhere")
    for shape in (10_001, (73, 137)):
        with pytest.raises(ShapeError, match="expected at most 10,000 numbers"):
            derivative(lambda x: x[0], {"x": shape}, of="x")


def test_equations_over_arrays() -> None:
    """An equation may return an array of scalars; of a matrix the message says how."""
    A = np.array([[1.0, 2.0], [3.0, 4.0]])
    value, jacobian = derivative(lambda q: A @ np.array(q), {"q": 2}, of="q")([0.5, 0.25])

    np.testing.assert_array_equal(value, A @ (0.5, 0.25))
    np.testing.assert_array_equal(jacobian, A)
    with pytest.raises(KindError, match=r"a list of scalars, a matrix row by row as by np\.ravel, got array"):
        derivative(lambda q: np.outer(q, q), {"q": 2}, of="q")
