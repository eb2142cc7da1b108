"""Arms from URDF files beside Pinocchio, whose own parser reads the same files."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from armwright.arm.model import Arm
from armwright.arm.urdf.axes import PARALLEL
from armwright.arm.urdf.reader import load_urdf, read_urdf
from armwright.arrays import Array
from armwright.dynamics.mass_matrix import mass_matrix
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.kinematics.forward import forward
from armwright.kinematics.jacobian import jacobian
from oracles.urdf import KINDS, RELATIONS, Oracle, oracle, random_urdf

AGREEMENT = 1e-9  # in parts of the largest number of the quantity

EXAMPLE = Path(__file__).parents[2] / "examples" / "seven_joints.urdf"


def check(arm: Arm, known: Oracle, rng: np.random.Generator, agreement: float = AGREEMENT) -> None:
    """The arm stands, moves and weighs as Pinocchio says."""
    q, qd, qdd = rng.uniform(-2, 2, size=(3, arm.n))
    near(forward(arm, q), known.forward(q), agreement)
    near(jacobian(arm, q), known.jacobian(q), agreement)
    near(inverse_dynamics(arm, q, qd, qdd, drives=False), known.inverse_dynamics(q, qd, qdd), agreement)
    near(mass_matrix(arm, q, drives=False), known.mass_matrix(q), agreement)


def near(ours: Array, theirs: Array, agreement: float) -> None:
    assert ours.shape == theirs.shape
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=agreement * np.abs(theirs).max())


def read(folder: Path, text: str) -> Arm:
    (folder / "random.urdf").write_text(text)
    return load_urdf(folder / "random.urdf", tip="hand")


def any_plan(rng: np.random.Generator, joints: int) -> Sequence[tuple[str, str]]:
    return [(str(rng.choice(KINDS)), str(rng.choice(RELATIONS))) for _ in range(joints)]


@pytest.mark.parametrize("joints", range(1, 13))
def test_random_chains(joints: int, rng: np.random.Generator, tmp_path: Path) -> None:
    """A chain of any length with joints of all kinds, axes however they lie, and links welded to links."""
    for _ in range(20):
        text = random_urdf(rng, any_plan(rng, joints))

        check(read(tmp_path, text), oracle(text, "hand"), rng)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    plan=st.lists(st.tuples(st.sampled_from(KINDS), st.sampled_from(RELATIONS)), min_size=2, max_size=6),
    seed=st.integers(0, 2**32 - 1),
)
def test_any_order_of_axes(plan: list[tuple[str, str]], seed: int, tmp_path: Path) -> None:
    """Whatever axes follow one another, parallel, opposite, in line or meeting: the arm is the one of the file."""
    rng = np.random.default_rng(seed)
    text = random_urdf(rng, plan)

    check(read(tmp_path, text), oracle(text, "hand"), rng)


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_but_parallel_axes(kind: str, rng: np.random.Generator, tmp_path: Path) -> None:
    """Where all axes are parallel, all twists are exactly 0 or half a turn."""
    text = random_urdf(rng, [(kind, "parallel"), *[(kind, "anti-parallel"), (kind, "parallel")] * 3])

    arm = read(tmp_path, text)

    assert {joint.alpha for joint in arm.joints} == {0.0, np.pi}
    check(arm, oracle(text, "hand"), rng)


TWO_AXES = """
<robot name="nearly">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.2 0.05 0.01"/><mass value="3"/>
    <inertia ixx="0.01" iyy="0.05" izz="0.06" ixy="0.002" ixz="0" iyz="0"/></inertial></link>
  <link name="fore"><inertial><origin xyz="0.1 0 0.02"/><mass value="2"/>
    <inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0.001" iyz="0"/></inertial></link>
  <link name="hand"/>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.3" rpy="1.5707963267948966 0 0"/><axis xyz="0 0 1"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.4 0 0.05" rpy="{angle} 0 0"/><axis xyz="0 0 1"/></joint>
  <joint name="wrist" type="fixed"><parent link="fore"/><child link="hand"/><origin xyz="0.3 0 0"/></joint>
</robot>
"""


@pytest.mark.parametrize("exponent", range(-14, 0))
@pytest.mark.parametrize("turned", [False, True])
def test_nearly_parallel_axes(exponent: int, *, turned: bool, rng: np.random.Generator, tmp_path: Path) -> None:
    """Axes that nearly point one way are made parallel where far frames would lose more than that leaves out.

    The common normal of axes at an angle of e is 1/e away; poses and efforts lose 1/e in digits from there, and the
    mass matrix, in which distances are squared, 1/e².
    """
    angle = 2 * 10.0**exponent
    text = TWO_AXES.format(angle=repr(np.pi - angle if turned else angle))
    (tmp_path / "nearly.urdf").write_text(text)
    reading, known = read_urdf(tmp_path / "nearly.urdf"), oracle(text, "hand")
    arm = reading.arm
    bent = angle <= PARALLEL

    assert (arm.joints[0].alpha in {0.0, np.pi}) == bent
    assert len(reading.notes) == (1e-9 < angle <= PARALLEL)
    if bent:
        check(arm, known, rng, agreement=max(AGREEMENT, 3 * angle))
        return
    q, qd, qdd = rng.uniform(-2, 2, size=(3, arm.n))
    near(forward(arm, q), known.forward(q), AGREEMENT)
    near(jacobian(arm, q), known.jacobian(q), AGREEMENT)
    near(inverse_dynamics(arm, q, qd, qdd, drives=False), known.inverse_dynamics(q, qd, qdd), AGREEMENT)
    near(mass_matrix(arm, q, drives=False), known.mass_matrix(q), max(1e-15 / angle**2, AGREEMENT))


def test_a_half_turn_typed_short(tmp_path: Path) -> None:
    """Two half turns typed as 3.1416 leave axes that are made parallel, and the reading says so."""
    (tmp_path / "short.urdf").write_text(TWO_AXES.format(angle="3.1416"))

    reading = read_urdf(tmp_path / "short.urdf")

    assert [joint.alpha for joint in reading.arm.joints] == [np.pi, 0]
    assert reading.notes == (
        "joints 'shoulder' and 'elbow': their axes are 7.3e-06 rad from parallel and are taken to be parallel",
    )


def test_example(rng: np.random.Generator) -> None:
    """The example, seven joints with flange, gripper and tool point, is the arm that Pinocchio reads."""
    arm = load_urdf(EXAMPLE)

    assert (arm.n, arm.name) == (7, "seven_joints")
    for _ in range(10):
        check(arm, oracle(EXAMPLE.read_text(), "tool_point"), rng)
