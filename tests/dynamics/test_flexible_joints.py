"""Arms on the springs of their gears: modes, compliance, deflection."""

import attrs
import numpy as np
import pinocchio as pin
import pytest
from scipy.linalg import eigh

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, Link
from armwright.dynamics.flexible_joints import deflection, modes, tool_compliance, with_gears
from armwright.dynamics.shares import gravity_efforts
from armwright.dynamics.vibration import assess_vibration
from armwright.errors import InvalidValueError, ShapeError, TooFewError, UnsupportedArmError
from armwright.kinematics.forward_kinematics import forward
from oracles.arms import coupled, random_arm, random_configurations
from oracles.with_pinocchio import pinocchio_model
from samples import Sample

# Two uniform rods of 1 kg and 1 m, turned about z.
ROD = Link(mass=1.0, com=(-0.5, 0, 0), inertia=np.diag((0, 1 / 12, 1 / 12)))
RODS = Arm(name="rods", joints=[Joint(kind="revolute", a=1.0)] * 2, links=[ROD] * 2, gravity=(0, 0, 0))


@pytest.mark.parametrize(
    ("degrees", "expected"), [(0, (9.2920, 61.8204)), (90, (12.0470, 31.5394)), (180, (18.5553, 30.958))]
)
def test_two_rods(degrees: float, expected: tuple[float, float]) -> None:
    """Two uniform rods on springs of 10 kN m/rad vibrate at the known frequencies."""
    found = modes(with_gears(RODS, 1e4), (0.3, np.radians(degrees)))

    np.testing.assert_allclose(found.frequencies, expected, atol=5.01e-5)
    # By hand: M = [[5/3 + cos q2, 1/3 + cos(q2) / 2], [., 1/3]] kg m².
    cosine = np.cos(np.radians(degrees))
    masses = np.linalg.eigvalsh([[5 / 3 + cosine, 1 / 3 + cosine / 2], [1 / 3 + cosine / 2, 1 / 3]])
    np.testing.assert_allclose(found.frequencies, np.sqrt(1e4 / masses[::-1]) / (2 * np.pi), rtol=1e-13)


def test_beside_pinocchio(sample: Sample) -> None:
    """Frequencies and shapes are those of the eigenvalue problem with the mass matrix of another library."""
    rng = next(sample.cases(1))
    for _ in range(sample.count(100)):
        arm = random_arm(rng, 5)
        stiffness, damping = rng.uniform(1e3, 1e5, 5), rng.uniform(0, 10, 5)
        (q,) = random_configurations(arm, rng, 1)
        model, data, _ = pinocchio_model(arm)
        M = np.array(pin.crba(model, data, q))
        M = np.triu(M) + np.triu(M, 1).T

        found = modes(with_gears(arm, stiffness, damping), q)

        # M v = (1 / omega²) K v, whose eigenvalues keep the digits of the low frequencies.
        inverse_squares, _ = eigh(M, np.diag(stiffness))
        np.testing.assert_allclose(found.frequencies * 2 * np.pi, inverse_squares[::-1] ** -0.5, rtol=1e-12)
        np.testing.assert_allclose(found.shapes.T @ M @ found.shapes, np.eye(5), atol=1e-9)
        shares = np.einsum("ik,i,ik->k", found.shapes, damping, found.shapes)
        np.testing.assert_allclose(shares, 2 * found.damping * found.frequencies * 2 * np.pi, rtol=1e-9)


def test_rigid_gears() -> None:
    """A rigid gear holds its joint, as a gear of enormous stiffness does."""
    arm = load_arm("puma560")
    q = np.array([0.1, -0.4, 0.6, 0.2, 0.5, 0.1])
    stiffness = np.array([1e5, 1e5, 5e4, np.inf, np.inf, np.inf])

    held = modes(with_gears(arm, stiffness), q)

    stiff = modes(with_gears(arm, np.where(np.isfinite(stiffness), stiffness, 1e12)), q)
    np.testing.assert_allclose(held.frequencies, stiff.frequencies[:3], rtol=1e-5)
    assert not held.shapes[3:].any()


def test_compliance_and_deflection(rng: np.random.Generator) -> None:
    """The tool yields by J K⁻¹ Jᵀ per force, and a heavy arm stands where gears and weight balance."""
    arm = with_gears(random_arm(rng, 6), rng.uniform(1e7, 1e8, 6))
    (q,) = random_configurations(arm, rng, 1)
    force = np.array([30.0, -20.0, 10.0, 0, 0, 0])

    alone, pushed = deflection(arm, q), deflection(arm, q, wrench=force)

    moved = forward(arm, q + pushed)[:3, 3] - forward(arm, q + alone)[:3, 3]
    np.testing.assert_allclose(moved, (tool_compliance(arm, q) @ force)[:3], rtol=1e-3, atol=1e-12)
    np.testing.assert_allclose(alone, -gravity_efforts(arm, q) / arm.motor_values("stiffness"))


def test_refused(rng: np.random.Generator) -> None:
    """Rigid arms, coupled drives, joints without mass, and numbers that do not fit are refused by name."""
    with pytest.raises(UnsupportedArmError, match="no gear is flexible"):
        modes(RODS, (0, 0))
    with pytest.raises(UnsupportedArmError, match="coupled drives"):
        modes(with_gears(coupled(random_arm(rng, 3), rng), 1e4), np.zeros(3))
    with pytest.raises(InvalidValueError, match="moves no mass"):
        modes(with_gears(attrs.evolve(RODS, links=[ROD, Link()]), 1e4), (0, 0))
    with pytest.raises(InvalidValueError, match="stiffness must be above 0, got 0"):
        with_gears(RODS, 0.0)
    with pytest.raises(InvalidValueError, match=r"stiffness must be 0\.001 or more, got 1e-09"):
        with_gears(RODS, 1e-9)
    with pytest.raises(ShapeError, match="stiffness"):
        with_gears(RODS, [1.0, 2.0, 3.0])
    flexible = with_gears(RODS, [np.inf, 1e4])
    with pytest.raises(ShapeError, match="qd: expected shape"):
        assess_vibration(flexible, np.zeros((3, 2)), np.zeros((2, 2)), np.zeros((3, 2)))
    with pytest.raises(ShapeError, match="force"):
        assess_vibration(flexible, np.zeros((3, 2)), force=(1, 2))
    with pytest.raises(TooFewError):
        assess_vibration(flexible, np.zeros((0, 2)))
