"""Denavit-Hartenberg tables in files, of both conventions, and the turns they are made of."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from armwright.arm.dh import about_com, carry, from_modified, to_modified, twist
from armwright.arm.load import read_arm
from armwright.arm.model import Arm, Link
from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import link_poses
from armwright.spatial.poses import inverse
from armwright.spatial.rotations import elementary_rotation
from oracles.arms import random_arm, random_configurations, random_link, random_pose

ROUNDING = 1e-12  # matrices multiplied in another order


def shift(x: float, y: float, z: float) -> Array:
    X = np.eye(4)
    X[:3, 3] = x, y, z
    return X


def turned(axis: str, angle: float) -> Array:
    X = np.eye(4)
    X[:3, :3] = Rotation.from_euler(axis, angle).as_matrix()
    return X


def modified_poses(arm: Arm, q: Array) -> list[Array]:
    """Frames 1 to n and the tool of a modified table, multiplied out as Craig writes it."""
    X, poses = arm.base, []
    for joint, position in zip(arm.joints, q, strict=True):
        theta = joint.theta + position if joint.revolute else joint.theta
        d = joint.d if joint.revolute else joint.d + position
        X = X @ turned("x", joint.alpha) @ shift(joint.a, 0, 0) @ turned("z", theta) @ shift(0, 0, d)
        poses.append(X)
    return [*poses, X @ arm.tool]


def as_file(arm: Arm, convention: str) -> str:
    """Write an arm as an arm file, with the numbers of its joints taken to be of that convention."""
    lines = [f'convention = "{convention}"']
    for name, X in (("base", arm.base), ("tool", arm.tool)):
        lines += [f"[{name}]", f"xyz_m = {X[:3, 3].tolist()}", f"rotation = {X[:3, :3].tolist()}"]
    for joint, link in zip(arm.joints, arm.links, strict=True):
        lines += ["[[joint]]", f'kind = "{joint.kind}"', f"theta_rad = {joint.theta}", f"d_m = {joint.d}"]
        lines += [f"a_m = {joint.a}", f"alpha_rad = {joint.alpha}"]
        I = link.inertia
        six = [I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]]
        lines += ["[joint.link]", f"mass_kg = {link.mass}", f"com_m = {link.com.tolist()}"]
        lines += [f"inertia_kgm2 = {np.array(six).tolist()}"]
    return "\n".join(lines)


@pytest.fixture
def written(tmp_path: Path) -> Callable[[Arm, str], Arm]:
    """Write an arm into a file and read it back."""

    def write(arm: Arm, convention: str) -> Arm:
        (tmp_path / "arm.toml").write_text(as_file(arm, convention))
        return read_arm(tmp_path / "arm.toml")

    return write


@pytest.mark.parametrize("joints", [1, 2, 5, 7])
def test_modified_table(joints: int, rng: np.random.Generator, written: Callable[[Arm, str], Arm]) -> None:
    """A modified table puts the tool where the product of its own transforms puts it, joints of both kinds."""
    table = random_arm(rng, joints)
    arm = written(table, "modified")

    for q in random_configurations(table, rng, 20):
        np.testing.assert_allclose(link_poses(arm, q)[-1], modified_poses(table, q)[-1], atol=joints * ROUNDING)


def test_there_and_back(rng: np.random.Generator) -> None:
    """A standard table made modified and standard again is the same, but for what stands before the tool."""
    table = random_arm(rng, 5)

    rows, last = to_modified(table.joints)
    before, joints, _ = from_modified(rows, table.links)

    np.testing.assert_array_equal(before, np.eye(4))
    assert joints[:-1] == list(table.joints[:-1])
    np.testing.assert_allclose(last, twist(table.joints[-1].alpha, table.joints[-1].a))


def test_standard_table(rng: np.random.Generator, written: Callable[[Arm, str], Arm]) -> None:
    """A standard table is taken as it stands."""
    table = random_arm(rng, 4)
    arm = written(table, "standard")

    assert [(j.kind, j.theta, j.d, j.a, j.alpha) for j in arm.joints] == [
        (j.kind, j.theta, j.d, j.a, j.alpha) for j in table.joints
    ]
    for new, old in zip(arm.links, table.links, strict=True):
        np.testing.assert_array_equal(new.com, old.com)
        np.testing.assert_allclose(new.inertia, old.inertia, atol=ROUNDING)
    np.testing.assert_allclose(arm.base, table.base, atol=ROUNDING)
    np.testing.assert_allclose(arm.tool, table.tool, atol=ROUNDING)


def test_carry_there_and_back(rng: np.random.Generator) -> None:
    """A body described in another frame and back again is the same body."""
    link, X = random_link(rng), random_pose(rng)
    back = carry(carry(link, X), inverse(X))

    np.testing.assert_allclose(back.com, link.com, atol=ROUNDING)
    np.testing.assert_allclose(back.inertia, link.inertia, atol=ROUNDING)


def test_a_rod_about_its_end() -> None:
    """A thin rod of 1 kg and 1 m has 1/3 kg m² about its end and 1/12 about its middle."""
    about_end = np.diag([0, 1 / 3, 1 / 3])

    np.testing.assert_allclose(about_com(about_end, 1.0, np.array((0.5, 0, 0))), np.diag([0, 1 / 12, 1 / 12]))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_elementary_rotation(axis: int, rng: np.random.Generator) -> None:
    """A rotation about an axis is that of SciPy, and one by a right angle has only zeros and ones in it."""
    angle = rng.uniform(-4, 4)

    np.testing.assert_allclose(
        elementary_rotation(axis, angle), Rotation.from_euler("xyz"[axis], angle).as_matrix(), atol=ROUNDING
    )
    for quarters in (-3, -2, -1, 0, 1, 2, 3, 4):
        assert set(elementary_rotation(axis, quarters * np.pi / 2).ravel()) <= {-1.0, 0.0, 1.0}


def test_a_body_without_mass_moves_too() -> None:
    """A link with a moment and no mass keeps its moment when it is seen from a turned frame."""
    link = Link(inertia=np.diag([0, 0, 0.35]))
    X = np.eye(4)
    X[:3, :3] = elementary_rotation(0, np.pi / 2)

    np.testing.assert_array_equal(carry(link, X).inertia, np.diag([0, 0.35, 0]))
