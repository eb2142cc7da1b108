"""Derivatives of inverse and forward dynamics."""

import attrs
import numpy as np
import pinocchio as pin
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, Link
from armwright.arrays import Array
from armwright.dynamics.accelerations import forward_dynamics
from armwright.dynamics.derivatives import effort_partials, forward_dynamics_derivatives, inverse_dynamics_derivatives
from armwright.dynamics.drives import with_drives
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.dynamics.newton_euler import newton_euler
from armwright.errors import InvalidValueError, ShapeError, UnitWarning, UnsupportedArmError
from armwright.tracing.evaluation import evaluate
from armwright.tracing.graph import Graph
from oracles.arms import of_all_kinds, random_arm, random_configurations
from oracles.graphs import complex_step
from oracles.with_pinocchio import pinocchio_model, with_rotors
from samples import Sample

AGREEMENT = 1e-12  # relative to the largest number of a matrix
# Of a matrix that the inverse of a mass matrix enters, for each unit of its condition number.
OF_INVERSE = 1e-14


def _assert_near(found: Array, expected: Array, tolerance: float = AGREEMENT) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance * max(1.0, np.abs(expected).max()))


def _arms(rng: np.random.Generator, joints: int) -> list[Arm]:
    """A random arm, and one with fixed transforms, weightless links and friction."""
    return [random_arm(rng, joints), of_all_kinds(random_arm(rng, joints), rng)]


def _in_pinocchio(arm: Arm) -> tuple[pin.Model, pin.Data]:
    model, _, _ = pinocchio_model(arm)
    return with_rotors(model, arm)


def _viscous(arm: Arm) -> Array:
    return np.diag(arm.motor_values("viscous"))


def test_inverse_dynamics_against_pinocchio(sample: Sample) -> None:
    """Pinocchio differentiates the efforts likewise; of friction, which it does not have, the viscous part counts."""
    for rng in sample.cases(60):
        for arm in _arms(rng, int(rng.integers(1, 8))):
            model, data = _in_pinocchio(arm)
            q, qd, qdd = (*random_configurations(arm, rng, 1), *rng.normal(size=(2, arm.n)))

            found = inverse_dynamics_derivatives(arm, q, qd, qdd)

            pin.computeRNEADerivatives(model, data, q, qd, qdd)
            _assert_near(found.dq, data.dtau_dq)
            _assert_near(found.dqd, data.dtau_dv + _viscous(arm))
            _assert_near(found.M, mass_matrix(arm, q))
    sample.record("derivatives of inverse dynamics are those of Pinocchio, random arms", 2 * sample.count(60), 0)


def test_forward_dynamics_against_pinocchio(sample: Sample) -> None:
    """Pinocchio differentiates the accelerations likewise, at efforts from which friction is taken away."""
    for rng in sample.cases(60):
        for arm in _arms(rng, int(rng.integers(1, 8))):
            model, data = _in_pinocchio(arm)
            q, qd, tau = (*random_configurations(arm, rng, 1), *rng.normal(size=(2, arm.n)))

            found = forward_dynamics_derivatives(arm, q, qd, tau)

            M = mass_matrix(arm, q)
            still = [0.0] * arm.n
            friction = with_drives(arm, still, qd.tolist(), still)
            pin.computeABADerivatives(model, data, q, qd, tau - friction)
            inverse = np.triu(data.Minv) + np.triu(data.Minv, 1).T
            tolerance = max(AGREEMENT, OF_INVERSE * np.linalg.cond(M))
            _assert_near(found.dtau, inverse, tolerance)
            _assert_near(found.dq, data.ddq_dq, tolerance)
            _assert_near(found.dqd, data.ddq_dv - inverse @ _viscous(arm), tolerance)
    sample.record("derivatives of forward dynamics are those of Pinocchio, random arms", 2 * sample.count(60), 0)


@pytest.mark.parametrize("name", ["puma560", "ur5", "stanford"])
def test_catalogue_against_pinocchio(name: str, rng: np.random.Generator) -> None:
    """The same holds for arms of right angles, whose graphs have lost most of their nodes."""
    arm = load_arm(name)
    model, data = _in_pinocchio(arm)
    q, qd, qdd = rng.normal(size=(3, arm.n))

    dq, dqd, M = inverse_dynamics_derivatives(arm, q, qd, qdd)

    pin.computeRNEADerivatives(model, data, q, qd, qdd)
    _assert_near(dq, data.dtau_dq)
    _assert_near(dqd, data.dtau_dv + _viscous(arm))
    _assert_near(M, mass_matrix(arm, q))


def test_against_complex_steps(rng: np.random.Generator) -> None:
    """The derivatives of the recursion are those of complex steps through it."""
    arm = of_all_kinds(random_arm(rng, 4), rng)
    graph = Graph()
    inputs = [graph.inputs(4) for _ in range(3)]
    efforts = with_drives(arm, newton_euler(arm, *inputs), *inputs[1:])
    values = rng.normal(size=12).tolist()

    matrices = effort_partials(arm, *inputs)

    found = np.hstack([[evaluate(graph, row, values) for row in A] for A in matrices])
    expected = [complex_step(graph, [x.node for x in efforts], values, k) for k in range(12)]
    _assert_near(found, np.array(expected).T)


def test_pendulum() -> None:
    """A pendulum of 2 kg at 0.5 m swings back with m g l cos q, and resists with m l²: worked by hand."""
    arm = Arm(
        name="pendulum",
        joints=[Joint(kind="revolute", a=0.5)],
        links=[Link(mass=2.0)],
        gravity=(0.0, -10.0, 0.0),
    )

    dq, dqd, M = inverse_dynamics_derivatives(arm, [0.3], [1.0], [2.0])
    of_acceleration = forward_dynamics_derivatives(arm, [0.3], [1.0], [4.0])

    np.testing.assert_allclose(dq, [[-10.0 * np.sin(0.3)]], rtol=1e-15)
    np.testing.assert_array_equal(dqd, [[0.0]])
    np.testing.assert_allclose(M, [[0.5]], rtol=1e-15)
    np.testing.assert_allclose(of_acceleration.dq, [[20.0 * np.sin(0.3)]], rtol=1e-15)
    np.testing.assert_allclose(of_acceleration.dtau, [[2.0]], rtol=1e-15)


def test_accelerations_follow_their_derivatives(rng: np.random.Generator) -> None:
    """A small change of efforts, positions and velocities changes the accelerations as the derivatives say."""
    arm = of_all_kinds(random_arm(rng, 5), rng)
    q, qd, tau = random_configurations(arm, rng, 20), rng.normal(size=(20, 5)), rng.normal(size=(20, 5))
    step = 1e-5 * rng.normal(size=(3, 20, 5))

    derivatives = forward_dynamics_derivatives(arm, q, qd, tau)

    expected = sum(np.einsum("kij,kj->ki", A, 2 * dx) for A, dx in zip(derivatives, step, strict=True))
    ahead, back = (forward_dynamics(arm, q + s * step[0], qd + s * step[1], tau + s * step[2]) for s in (1, -1))
    # The third derivative, times the cube of the step, is left.
    np.testing.assert_allclose(ahead - back, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def test_batches(rng: np.random.Generator) -> None:
    """Leading axes are broadcast, and every configuration has the values that it has alone."""
    arm = random_arm(rng, 3)
    q, qd, x = rng.normal(size=(2, 1, 3)), rng.normal(size=(4, 3)), rng.normal(size=3)

    for function in (inverse_dynamics_derivatives, forward_dynamics_derivatives):
        together, alone = function(arm, q, qd, x), function(arm, q[1, 0], qd[2], x)

        for many, one in zip(together, alone, strict=True):
            assert many.shape == (2, 4, 3, 3)
            _assert_near(many[1, 2], one)


def test_a_joint_that_moves_nothing() -> None:
    """Derivatives of forward dynamics name the joint whose acceleration is undefined; those of efforts exist."""
    light = Arm(name="light", joints=[Joint(kind="revolute", a=1.0)] * 2, links=[Link(mass=1.0), Link()])

    with pytest.raises(UnsupportedArmError, match="the acceleration of joint 2 is undefined"):
        forward_dynamics_derivatives(light, np.zeros((5, 2)), np.zeros(2), np.zeros(2))
    np.testing.assert_array_equal(inverse_dynamics_derivatives(light, [0, 0], [0, 0], [0, 0]).M, [[1, 0], [0, 0]])


def test_mistakes() -> None:
    """Arguments that are wrong are refused by name, and degrees are suspected."""
    arm, zeros = load_arm("stanford"), np.zeros(6)

    with pytest.raises(ShapeError, match="qdd"):
        inverse_dynamics_derivatives(arm, zeros, zeros, np.zeros(5))
    with pytest.raises(InvalidValueError, match="tau: every number must be finite"):
        forward_dynamics_derivatives(arm, zeros, zeros, np.full(6, np.nan))
    with pytest.raises(UnsupportedArmError, match="unknown"):
        inverse_dynamics_derivatives(attrs.evolve(arm, links=[Link(unknown="not said")] * 6), zeros, zeros, zeros)
    with pytest.warns(UnitWarning, match="degrees"):
        inverse_dynamics_derivatives(arm, np.full(6, 90.0), zeros, zeros)
