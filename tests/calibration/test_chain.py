"""An arm with errors, against its exact kinematics and against derivatives by the complex step."""

import numpy as np
import numpy.typing as npt
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint
from armwright.arrays import Array
from armwright.calibration.chain import Chain, kinematic_chain
from armwright.errors import ShapeError
from armwright.kinematics.forward_kinematics import forward
from calibration.simulated import configurations, random_arm, random_errors, random_pose
from oracles.catalogue import FEW, NAMES

# Some thirty turns and shifts, each rounded.
ROUNDING = 1e-13
# Derivatives by the complex step have no other error than rounding [m/rad].
STEP = 1e-30
# Central differences: the cube of the step, and rounding over the step.
DIFFERENCE, DIFFERENCED = 1e-5, 1e-9

Complex = npt.NDArray[np.complex128]


def shift(axis: int, by: complex) -> Complex:
    X = np.eye(4, dtype=np.complex128)
    X[axis, 3] = by
    return X


def turn(axis: int, by: complex) -> Complex:
    X = np.eye(4, dtype=np.complex128)
    u, v = (axis + 1) % 3, (axis + 2) % 3
    X[u, u] = X[v, v] = np.cos(by)
    X[v, u], X[u, v] = np.sin(by), -np.sin(by)
    return X


def product(chain: Chain, q: Array, errors: npt.NDArray[np.complex128]) -> Complex:
    """Return the tool's pose as a product of matrices, by the names of the errors."""
    by = dict(zip(chain.names, errors, strict=True))
    X = chain.base @ np.eye(4, dtype=np.complex128)
    for k in range(6):
        X = X @ (shift, turn)[k // 3](k % 3, by[f"base.{'r' * (k // 3)}{'xyz'[k % 3]}"])
    X = X @ chain.arm.base
    for i, (joint, value) in enumerate(zip(chain.arm.joints, q, strict=True), 1):
        name = f"joint{i}"
        X = X @ turn(2, joint.theta + by[f"{name}.theta"] + (value if joint.revolute else 0))
        X = X @ shift(2, joint.d + by[f"{name}.d"] + (0 if joint.revolute else value))
        X = X @ shift(0, joint.a + by[f"{name}.a"]) @ turn(0, joint.alpha + by[f"{name}.alpha"])
        X = X @ turn(1, by.get(f"{name}.beta", 0))
    X = X @ chain.arm.tool
    for k in range(6):
        X = X @ (shift, turn)[k // 3](k % 3, by[f"tool.{'r' * (k // 3)}{'xyz'[k % 3]}"])
    return X


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", NAMES)
def test_no_errors(name: str, rng: np.random.Generator) -> None:
    """An arm without errors has its tool where forward kinematics has it, for every arm of the catalogue."""
    arm = load_arm(name)
    q = configurations(rng, arm, 20)

    reached = kinematic_chain(arm).forward(q)

    np.testing.assert_allclose(reached.position, forward(arm, q)[:, :3, 3], atol=ROUNDING)
    np.testing.assert_allclose(reached.rotation, forward(arm, q)[:, :3, :3], atol=ROUNDING)


@pytest.mark.parametrize("n", range(3, 8))
def test_no_errors_anywhere(n: int, rng: np.random.Generator) -> None:
    """The same for arms with slides, and a base and a tool that are turned anyhow."""
    arm = random_arm(rng, n, slides=True)
    q = configurations(rng, arm, 20)

    np.testing.assert_allclose(kinematic_chain(arm).forward(q).position, forward(arm, q)[:, :3, 3], atol=ROUNDING)


@pytest.mark.parametrize("R", [((0, 0, 1), (0, 1, 0), (-1, 0, 0)), ((0, 0, -1), (0, 1, 0), (1, 0, 0))])
def test_quarter_turn_of_the_tool(R: tuple[tuple[int, ...], ...], rng: np.random.Generator) -> None:
    """A tool turned by a right angle about y, where its turns about x and z are one, is the same tool."""
    tool = np.eye(4)
    tool[:3, :3] = R
    arm = Arm(name="one", joints=[Joint(kind="revolute", a=0.3)], tool=tool)
    q = configurations(rng, arm, 5)

    np.testing.assert_allclose(kinematic_chain(arm).forward(q).rotation, forward(arm, q)[:, :3, :3], atol=ROUNDING)


@pytest.mark.parametrize("n", range(3, 8))
def test_derivatives(n: int, rng: np.random.Generator) -> None:
    """Position, rotation and both derivatives are those of a product of matrices in complex numbers."""
    arm = random_arm(rng, n, slides=True)
    chain = kinematic_chain(arm, base=random_pose(rng, 0.5))
    q = configurations(rng, arm, 3)
    errors = random_errors(rng, chain, scale=30.0)

    reached = chain.forward(q, errors)

    for row in range(len(q)):
        X = product(chain, q[row], errors.astype(np.complex128))
        np.testing.assert_allclose(reached.position[row], X[:3, 3].real, atol=ROUNDING)
        np.testing.assert_allclose(reached.rotation[row], X[:3, :3].real, atol=ROUNDING)
        for k in range(len(errors)):
            stepped = errors.astype(np.complex128)
            stepped[k] += 1j * STEP
            slope = product(chain, q[row], stepped).imag / STEP
            spin = slope[:3, :3] @ reached.rotation[row].T
            np.testing.assert_allclose(reached.position_jacobian[row, :, k], slope[:3, 3], atol=ROUNDING)
            np.testing.assert_allclose(
                reached.rotation_jacobian[row, :, k], (spin[2, 1], spin[0, 2], spin[1, 0]), atol=ROUNDING
            )


def test_differences(rng: np.random.Generator) -> None:
    """Moving an error a little moves the tool as the derivative says."""
    chain = kinematic_chain(load_arm("stanford"))
    q = configurations(rng, chain.arm, 10)
    errors = random_errors(rng, chain)

    slopes = chain.forward(q, errors).position_jacobian

    for k, step in enumerate(DIFFERENCE * np.eye(len(errors))):
        moved = chain.forward(q, errors + step).position - chain.forward(q, errors - step).position
        np.testing.assert_allclose(slopes[:, :, k], moved / (2 * DIFFERENCE), atol=DIFFERENCED)


def test_parallel_axes_get_a_fifth_error() -> None:
    """Links between parallel axes have a turn about y, in the UR5 after joints 2 and 3; the last link has none."""
    beta = [name for name in kinematic_chain(load_arm("ur5")).names if name.endswith("beta")]

    assert beta == ["joint2.beta", "joint3.beta"]


def test_names_and_kinds() -> None:
    """Errors stand in the order of the chain, and what begins with r or is an angle of a joint is no length."""
    chain = kinematic_chain(Arm(name="one", joints=[Joint(kind="revolute", a=0.3)]))

    lengths = [name for name, is_length in zip(chain.names, chain.is_length, strict=True) if is_length]

    assert chain.names[6:10] == ("joint1.theta", "joint1.d", "joint1.a", "joint1.alpha")
    assert lengths == ["base.x", "base.y", "base.z", "joint1.d", "joint1.a", "tool.x", "tool.y", "tool.z"]


def test_wrong_number_of_errors() -> None:
    """Errors of another arm are refused."""
    chain = kinematic_chain(load_arm("ur5"))

    with pytest.raises(ShapeError, match=r"errors: expected 38 of them, got shape \(3,\)"):
        chain.forward(np.zeros(6), np.zeros(3))


def test_wrong_number_of_joints() -> None:
    """Joint positions of another arm are refused."""
    with pytest.raises(ShapeError, match="q: expected 6 numbers on the last axis"):
        kinematic_chain(load_arm("ur5")).forward(np.zeros(7))
