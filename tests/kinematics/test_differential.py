"""Joint rates of the PUMA in closed form, two ways, against each other and against the numerical Jacobian."""

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint
from armwright.arrays import Array
from armwright.errors import InvalidValueError, ShapeError, UnknownNameError, UnsupportedArmError
from armwright.kinematics.differential import (
    Method,
    SingularConfigurationError,
    differential_inverse,
    rates_by_blocks,
    rates_by_derivative,
    wrist_motion,
)
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.recognise import find_geometry
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.kinematics.jacobians import jacobian
from armwright.tracing.graph import Graph
from armwright.tracing.scalar import Scalar
from oracles.arms import random_configurations, random_pose
from oracles.graphs import evaluate

# Agreement with a solver that loses digits with the condition of the Jacobian, at most 1e3 in these tests.
SOLVED = 1e-9
METHODS: tuple[Method, Method] = ("blocks", "derivative")
ELBOW = np.arctan2(0.433, -0.02)  # the PUMA's elbow is straight where tan q3 = d4 / a3


@pytest.fixture
def puma() -> Arm:
    """The catalogue's PUMA."""
    return load_arm("puma560")


def _regular(arm: Arm, q: Array) -> Array:
    J = jacobian(arm, q)
    return q[np.linalg.cond(J) < 1e3]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("frame", ["base", "tool"])
def test_against_the_numerical_jacobian(method: Method, frame: str, puma: Arm, rng: np.random.Generator) -> None:
    """At well-conditioned configurations both methods yield what solving the Jacobian yields, in base and tool axes."""
    arm = attrs.evolve(puma, base=random_pose(rng), tool=random_pose(rng))
    q = _regular(arm, random_configurations(arm, rng, 3000))
    twist = rng.normal(size=(len(q), 6))

    rates = differential_inverse(arm, q, twist, method=method, frame=frame).checked()  # type: ignore[arg-type]

    expected = np.linalg.solve(jacobian(arm, q, frame), twist[..., None])[..., 0]  # type: ignore[arg-type]
    assert len(q) > 2000
    scale = np.abs(expected).max(axis=-1, keepdims=True)
    assert (np.abs(rates - expected) / scale).max() < SOLVED


def test_both_ways_agree(puma: Arm, rng: np.random.Generator) -> None:
    """Blocks and derivative give the same rates for the same twist, in configurations of any condition above 1e-6."""
    q = random_configurations(puma, rng, 5000)
    q = q[np.linalg.svd(jacobian(puma, q), compute_uv=False)[:, -1] > 1e-6]
    twist = rng.normal(size=(len(q), 6))

    blocks, derivative = (differential_inverse(puma, q, twist, method=method).checked() for method in METHODS)

    np.testing.assert_allclose(blocks, derivative, rtol=1e-9, atol=1e-9 * np.abs(blocks).max())
    regular = np.linalg.cond(jacobian(puma, q)) < 1e3
    np.testing.assert_allclose(blocks[regular], derivative[regular], atol=1e-9)


def test_it_is_the_slope_of_the_inverse(puma: Arm) -> None:
    """Along a motion of the hand the configurations that the inverse finds move at the rates."""
    q = np.array((0.3, -0.4, 0.5, 0.6, 0.7, 0.8))
    qd = np.array((0.1, -0.2, 0.3, 0.2, -0.1, 0.4))
    twist = jacobian(puma, q) @ qd
    step = 1e-5

    before, after = (inverse(puma, forward(puma, q + s * step * qd), q).best.q for s in (-1, 1))

    np.testing.assert_allclose(differential_inverse(puma, q, twist).rates, (after - before) / (2 * step), atol=1e-8)


def test_turning_the_waist(puma: Arm) -> None:
    """A hand that circles the base axis at 1 rad/s, turning with it, is moved by joint 1 alone."""
    q = [0.3, -0.4, 0.5, 0.6, 0.7, 0.8]
    x, y, _ = forward(puma, q)[:3, 3]

    for method in METHODS:
        rates = differential_inverse(puma, q, [-y, x, 0, 0, 0, 1], method=method).checked()

        np.testing.assert_allclose(rates, (1, 0, 0, 0, 0, 0), atol=1e-12)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("number", range(6))
def test_arms_built_like_the_puma(method: Method, number: int) -> None:
    """Other signs, offsets, a shoulder ahead of its axis, base and tool: the same two ways."""
    rng = np.random.default_rng(number)
    right = (np.pi / 2, -np.pi / 2)
    numbers = [
        {"d": 0.3, "a": rng.choice((0.0, 0.1)), "alpha": rng.choice(right)},
        {"d": 0.1, "a": rng.choice((0.4, -0.4)), "alpha": rng.choice((0.0, np.pi))},
        {"d": 0.05, "a": 0.03, "alpha": rng.choice(right)},
        {"d": 0.35, "alpha": rng.choice(right)},
        {"alpha": rng.choice(right)},
        {"d": 0.08, "a": 0.1, "alpha": 0.3},
    ]
    joints = [Joint(kind="revolute", theta=rng.uniform(-3, 3), **row) for row in numbers]
    arm = Arm(name="like a PUMA", joints=joints, base=random_pose(rng), tool=random_pose(rng))
    q = _regular(arm, rng.uniform(-np.pi, np.pi, size=(300, 6)))
    twist = rng.normal(size=(len(q), 6))

    rates = differential_inverse(arm, q, twist, method=method).checked()

    assert len(q) > 100
    np.testing.assert_allclose((jacobian(arm, q) @ rates[..., None])[..., 0], twist, atol=SOLVED)


@pytest.mark.parametrize("method", [rates_by_blocks, rates_by_derivative])
def test_plain_numbers_and_arrays(method: object, puma: Arm, rng: np.random.Generator) -> None:
    """The equations give for floats what they give for arrays."""
    q, twist = random_configurations(puma, rng, 20), rng.normal(size=(20, 6))
    geometry = find_geometry(puma)
    assert geometry is not None
    name = "blocks" if method is rates_by_blocks else "derivative"

    many = differential_inverse(puma, q, twist, method=name).rates  # type: ignore[arg-type]

    for row, configuration, asked in zip(many, q.tolist(), twist.tolist(), strict=True):
        motion = wrist_motion(puma, geometry, configuration, asked, "base")
        one = method(geometry, geometry.angles(configuration), motion)  # type: ignore[operator]
        assert all(isinstance(rate, float) for rate in one)
        np.testing.assert_allclose(np.array(geometry.signs) * one, row, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("method", [rates_by_blocks, rates_by_derivative])
def test_the_equations_can_be_traced(method: object, puma: Arm, rng: np.random.Generator) -> None:
    """Run on traced scalars both ways leave a graph that gives what they give for floats."""
    geometry = find_geometry(puma)
    assert geometry is not None

    def rates(q: list[Scalar], twist: list[Scalar]) -> list[Scalar]:
        motion = wrist_motion(puma, geometry, q, twist, "base")
        return method(geometry, geometry.angles(q), motion)  # type: ignore[operator]

    inputs = Graph().inputs(12)
    outputs = [rate.node for rate in rates(inputs[:6], inputs[6:])]
    q, twist = random_configurations(puma, rng, 1)[0].tolist(), rng.normal(size=6).tolist()

    np.testing.assert_allclose(evaluate(inputs[0].graph, outputs, [*q, *twist]), rates(q, twist), rtol=SOLVED)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("q", "factor"),
    [
        ((0.3, 0.4, 0.5, 0.6, 0.0, 0.7), "wrist"),
        ((0.3, 0.4, ELBOW, 0.6, 0.5, 0.7), "elbow"),
        ((0.3, np.arctan2(0.432 + 0.433, -0.02), np.pi / 2, 0.6, 0.5, 0.7), "shoulder"),
    ],
)
def test_singular_configurations_are_named(method: Method, q: tuple[float, ...], factor: str, puma: Arm) -> None:
    """At a singularity there are no rates: they are NaN, never numbers that look right; the factor is named."""
    place = ("shoulder", "elbow", "wrist").index(factor)

    found = differential_inverse(puma, q, np.ones(6), method=method)

    assert np.isnan(found.rates).all()
    np.testing.assert_array_equal(np.flatnonzero(found.singular), [place])
    with pytest.raises(
        SingularConfigurationError, match=f"the configuration is singular at the {factor}: .* damped_rates"
    ):
        found.checked()


def test_one_singular_configuration_among_many(puma: Arm) -> None:
    """Only the row that is singular stays without rates, and its number is told."""
    q = np.tile((0.3, 0.4, 0.5, 0.6, 0.7, 0.8), (3, 1))
    q[1, 4] = 0.0

    found = differential_inverse(puma, q, np.ones(6))

    np.testing.assert_array_equal(found.singular.any(axis=-1), [False, True, False])
    np.testing.assert_array_equal(np.isnan(found.rates).all(axis=-1), [False, True, False])
    np.testing.assert_allclose(jacobian(puma, q[0]) @ found.rates[2], 1.0, atol=SOLVED)
    with pytest.raises(SingularConfigurationError, match=r"^configuration 1 is singular at the wrist"):
        found.checked()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("distance", [1e-3, 1e-5, 1e-7])
def test_near_the_wrist_singularity(method: Method, distance: float, puma: Arm) -> None:
    """The nearer joint 5 is to 0 the faster joints 4 and 6 must turn, against each other; the twist is made."""
    q = np.array((0.3, 0.4, 0.5, 0.6, distance, 0.7))
    twist = np.array((0.1, 0.2, -0.1, 0.3, 0.2, 0.1))

    rates = differential_inverse(puma, q, twist, method=method).checked()

    np.testing.assert_allclose(jacobian(puma, q) @ rates, twist, atol=1e-15 / distance + 1e-12)
    assert abs(rates[3]) > 0.005 / distance
    assert rates[3] + rates[5] == pytest.approx(0, abs=distance * abs(rates[3]) + 3)


def test_refusals(puma: Arm) -> None:
    """Other arms, ways, axes and shapes are refused with what there is."""
    with pytest.raises(UnsupportedArmError, match=r"'stanford': no differential .* built like puma560"):
        differential_inverse(load_arm("stanford"), np.zeros(6), np.zeros(6))
    with pytest.raises(UnknownNameError, match=r"no method 'block'. Did you mean 'blocks'"):
        differential_inverse(puma, np.zeros(6), np.zeros(6), method="block")  # type: ignore[arg-type]
    with pytest.raises(InvalidValueError, match="'base' or 'tool', got 'hand'"):
        differential_inverse(puma, np.zeros(6), np.zeros(6), frame="hand")  # type: ignore[arg-type]
    with pytest.raises(ShapeError, match=r"q, twist: leading axes must broadcast together"):
        differential_inverse(puma, np.zeros((2, 6)), np.zeros((3, 6)))
