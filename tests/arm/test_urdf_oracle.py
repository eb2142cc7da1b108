"""Arms from URDF files beside Pinocchio, whose own parser reads the same files."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from armwright.arm.load import read_arm
from armwright.arm.model import Arm
from armwright.arm.urdf.reader import load_urdf, read_urdf
from armwright.arm.urdf.writer import urdf_text
from armwright.arm.write import toml_text
from armwright.arrays import Array
from armwright.calibration.chain import kinematic_chain
from armwright.compiled.quantities import emit_quantity
from armwright.dynamics.accelerations import forward_dynamics
from armwright.dynamics.energy import kinetic_energy
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.dynamics.lagrange_euler import lagrange_euler
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.dynamics.shares import coriolis_efforts
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.jacobians import jacobian
from oracles.urdf import KINDS, RELATIONS, Oracle, joint, oracle, random_body, random_origin, random_urdf
from samples import Sample, examples

EXACTLY = 1e-12
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


@pytest.mark.drawn(0.4)
@pytest.mark.parametrize("joints", range(1, 13))
def test_random_chains(joints: int, rng: np.random.Generator, tmp_path: Path) -> None:
    """A chain of any length with joints of all kinds, axes however they lie, and links welded to links."""
    for _ in range(20):
        text = random_urdf(rng, any_plan(rng, joints))

        check(read(tmp_path, text), oracle(text, "hand"), rng)


@settings(max_examples=examples(60), suppress_health_check=[HealthCheck.function_scoped_fixture])
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
    """Axes that nearly point one way are kept as they are: poses, efforts and masses are Pinocchio's to rounding."""
    angle = 2 * 10.0**exponent
    text = TWO_AXES.format(angle=repr(np.pi - angle if turned else angle))
    (tmp_path / "nearly.urdf").write_text(text)
    reading, known = read_urdf(tmp_path / "nearly.urdf"), oracle(text, "hand")

    assert len(reading.notes) == (1e-11 < angle < 1e-4)
    check(reading.arm, known, rng, max(EXACTLY, 3 * angle if angle < 1e-11 else 0.0))


def test_chains_of_nearly_parallel_axes(sample: Sample, tmp_path: Path) -> None:
    """However little the axes of a chain lean, the arm stands, moves and weighs as Pinocchio says, to 1e-12."""
    worst = 0.0
    for rng in sample.cases(200):
        text = leaning_chain(rng, int(rng.integers(2, 8)))
        arm, known = read(tmp_path, text), oracle(text, "hand")
        q, qd, qdd, tau = rng.uniform(-2, 2, size=(4, arm.n))
        M = known.mass_matrix(q)
        bias = known.inverse_dynamics(q, qd, np.zeros(arm.n))
        for ours, theirs in (
            (forward(arm, q), known.forward(q)),
            (jacobian(arm, q), known.jacobian(q)),
            (inverse_dynamics(arm, q, qd, qdd, drives=False), known.inverse_dynamics(q, qd, qdd)),
            (mass_matrix(arm, q, drives=False), M),
            (M @ forward_dynamics(arm, q, qd, tau), tau - bias),
            (np.array(lagrange_euler(arm, *(x.tolist() for x in (q, qd, qdd)))), known.inverse_dynamics(q, qd, qdd)),
        ):
            worst = max(worst, float(np.abs(ours - theirs).max() / max(1.0, np.abs(theirs).max())))
    assert worst < 1e-12
    sample.record("URDF chains with nearly parallel axes", sample.count(200), 0, worst=f"{worst:.1e}")


def leaning_chain(rng: np.random.Generator, joints: int) -> str:
    """A chain whose axes are parallel but for a small angle, or lie anyhow."""
    parts, last = ['<robot name="leaning">', '<link name="base"/>'], "base"
    for i in range(1, joints + 1):
        # Angles below 1e-11 count as typed with twelve digits, and are rounded.
        small = rng.choice((-1, 1), size=3) * rng.uniform(0.3, 1, size=3) * 10.0 ** rng.uniform(-9, -1)
        rpy = small if rng.random() < 0.7 else rng.uniform(-3, 3, size=3)
        kind = str(rng.choice(("revolute", "prismatic"), p=(0.8, 0.2)))
        inside = '<axis xyz="0 0 1"/><limit lower="-2.5" upper="2" effort="80" velocity="2"/>'
        parts += [random_body(rng, f"link_{i}")]
        parts += [joint(f"joint_{i}", kind, (last, f"link_{i}"), (rng.normal(scale=0.3, size=3), rpy), inside)]
        last = f"link_{i}"
    parts += [random_body(rng, "hand"), joint("wrist", "fixed", (last, "hand"), random_origin(rng)), "</robot>"]
    return "\n".join(parts)


@pytest.mark.parametrize("exponent", [-9, -6, -3])
def test_fixed_transforms_are_written(exponent: int, rng: np.random.Generator, tmp_path: Path) -> None:
    """An arm file and a URDF file of an arm with fixed transforms are the same arm again, names and all."""
    (tmp_path / "nearly.urdf").write_text(TWO_AXES.format(angle=repr(10.0**exponent)))
    arm = load_urdf(tmp_path / "nearly.urdf")
    (tmp_path / "again.toml").write_text(toml_text(arm), encoding="utf-8")
    (tmp_path / "again.urdf").write_text(urdf_text(arm), encoding="utf-8")
    q, qd, qdd = rng.uniform(-2, 2, size=(3, arm.n))

    assert read_arm(tmp_path / "again.toml") == arm
    again = load_urdf(tmp_path / "again.urdf")
    assert [part.name for part in (*again.joints, *again.links)] == [part.name for part in (*arm.joints, *arm.links)]
    assert (again.base_link, again.tool_link) == (arm.base_link, arm.tool_link)
    near(forward(again, q), forward(arm, q), EXACTLY)
    near(inverse_dynamics(again, q, qd, qdd), inverse_dynamics(arm, q, qd, qdd), EXACTLY)


def test_quantities_of_fixed_transforms(rng: np.random.Generator, tmp_path: Path) -> None:
    """Kernels, energy, the inverse by steps and the chain of calibration know fixed transforms as all else does."""
    text = leaning_chain(np.random.default_rng(5), 6)
    arm = read(tmp_path, text)
    assert any(one.fixed is not None for one in arm.joints)
    q, qd = rng.uniform(-2, 2, size=(2, arm.n))

    emitted = emit_quantity(arm, "inverse_dynamics")
    assert emitted.operations
    h = 1e-6
    power = (kinetic_energy(arm, q + h * qd, qd) - kinetic_energy(arm, q - h * qd, qd)) / (2 * h)
    C = coriolis_efforts(arm, q, qd)
    np.testing.assert_allclose(qd @ C, power, rtol=1e-5)
    np.testing.assert_allclose(kinematic_chain(arm).forward(q).position[0], forward(arm, q)[:3, 3], atol=1e-12)
    errors = np.zeros(len(kinematic_chain(arm).names))
    reached = kinematic_chain(arm).forward(q).position_jacobian[0]
    for k in range(len(errors)):
        off = errors.copy()
        off[k] = 1e-6
        moved = kinematic_chain(arm).forward(q, off).position[0] - kinematic_chain(arm).forward(q, -off).position[0]
        np.testing.assert_allclose(reached[:, k], moved / 2e-6, atol=1e-6)


def test_a_half_turn_typed_short(tmp_path: Path) -> None:
    """Two half turns typed as 3.1416 leave axes that lean; they are kept so, and the reading says so."""
    (tmp_path / "short.urdf").write_text(TWO_AXES.format(angle="3.1416"))

    reading = read_urdf(tmp_path / "short.urdf")

    assert len(reading.notes) == 1
    assert reading.notes[0] == (
        "joints 'shoulder' and 'elbow': their axes deviate by 7.3e-06 rad from parallel, which is preserved; if "
        "they should be parallel, write their angles with more digits"
    )


def test_example(rng: np.random.Generator) -> None:
    """The example, seven joints with flange, gripper and tool point, is the arm that Pinocchio reads."""
    arm = load_urdf(EXAMPLE)

    assert (arm.n, arm.name) == (7, "seven_joints")
    for _ in range(10):
        check(arm, oracle(EXAMPLE.read_text(), "tool_point"), rng)
