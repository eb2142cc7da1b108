"""Friction of all kinds and springs in arm files, URDF and MJCF, and as they are shown."""

import math
from pathlib import Path

import attrs
import mujoco
import numpy as np
import pytest

from armwright.arm.description import tables
from armwright.arm.load import load_arm
from armwright.arm.mjcf.reader import load_mjcf, read_mjcf
from armwright.arm.model import Motor, Spring
from armwright.arm.urdf.writer import lost_in_urdf
from armwright.arm.write import toml_text
from armwright.dynamics.shares import gravity_efforts
from armwright.errors import FileFormatError
from armwright.physics.mjcf import arm_mjcf
from cli_calls import armwright
from oracles.arms import random_arm, with_all_friction, with_springs
from samples import Sample

BODY = "[joint.link]\nmass_kg = 2\ninertia_kgm2 = [0.1, 0.1, 0.1]\n"
FULL = f"""
[[joint]]
kind = "revolute"
a_mm = 500
{BODY}
[joint.spring]
stiffness_Nm_per_rad = 12
rest_deg = 30
[joint.motor]
coulomb_forward_Nm = 2
coulomb_backward_Nm = 1
offset_Nm = -0.5
stribeck_Nm = 1.5
stribeck_speed_deg_per_s = 3
cube_root_Nm = 0.7
stiffness_Nm_per_rad = 900
damping_Nms = 2
[[joint]]
kind = "prismatic"
{BODY}
[joint.spring]
stiffness_N_per_m = 100
rest_mm = 20
[joint.motor]
offset_N = 4
stribeck_N = 5
stribeck_speed_mm_per_s = 6
cube_root_N = 7
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "arm.toml"
    path.write_text(text)
    return path


def test_keys(tmp_path: Path) -> None:
    """Every number is read in SI, by the unit of its key."""
    turning, sliding = (arm := load_arm(written(tmp_path, FULL))).motors

    assert turning == Motor(
        coulomb_forward=2,
        coulomb_backward=1,
        offset=-0.5,
        stribeck=1.5,
        stribeck_speed=math.radians(3),
        cube_root=0.7,
        stiffness=900,
        damping=2,
    )
    assert sliding == Motor(offset=4, stribeck=5, stribeck_speed=0.006, cube_root=7)
    assert arm.joints[0].spring == Spring(stiffness=12, rest=math.radians(30))
    assert arm.joints[1].spring == Spring(stiffness=100, rest=0.02)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            ("stribeck_speed_deg_per_s = 3\n", ""),
            "joint 1, motor, stribeck_Nm: how it fades is missing: specify stribeck_speed_deg_per_s or ",
        ),
        (("stribeck_speed_deg_per_s = 3", "stribeck_speed_deg_per_s = 0"), "expected a number above 0, got 0"),
        (("cube_root_Nm = 0.7", "cube_root_Nm = -0.7"), "joint 1, motor, cube_root_Nm: "),
        (("cube_root_Nm", "cube_root_N"), "cube_root_N: unknown key; did you mean 'cube_root_Nm'?"),
        (("stiffness_Nm_per_rad = 12", "stiffness_Nm_per_rad = -12"), "joint 1, spring, stiffness_Nm_per_rad: "),
        (("stiffness_Nm_per_rad", "stiffness_N_per_m"), "unknown key; known keys: rest_deg, stiffness_Nm_per_rad"),
        (("rest_deg = 30", 'rest_deg = "up"'), "joint 1, spring, rest_deg: expected a number"),
        (("offset_Nm = -0.5", "offset_Nm = inf"), "joint 1, motor, offset_Nm: "),
        (("= 900", "= 1e-9"), "joint 1, motor, stiffness_Nm_per_rad: expected 0.001 to 1e+12, got 1e-09"),
    ],
)
def test_mistakes(change: tuple[str, str], message: str, tmp_path: Path) -> None:
    """A mistake is reported with its place, and what would be right."""
    path = written(tmp_path, FULL.replace(*change, 1))
    with pytest.raises(FileFormatError) as caught:
        load_arm(path)
    assert message in str(caught.value)
    assert "arm.toml:" in str(caught.value)


def test_arm_files_keep_everything(sample: Sample, tmp_path: Path) -> None:
    """What is written is read back to the last bit."""
    for rng in sample.cases(100):
        arm = with_springs(with_all_friction(random_arm(rng, int(rng.integers(1, 8))), rng), rng)
        assert load_arm(written(tmp_path, toml_text(arm))) == arm


def test_what_is_lost() -> None:
    """URDF and MJCF name all that they cannot hold; MJCF keeps springs, to the bit."""
    arm = load_arm("stanford-jpl")
    motor = Motor(offset=-0.5, stribeck=1.5, stribeck_speed=0.05, cube_root=0.7, stiffness=900)
    spring = Spring(stiffness=12, rest=0.3)
    arm = attrs.evolve(
        arm,
        motors=[motor, *arm.motors[1:]],
        joints=[attrs.evolve(joint, spring=spring) if i in (0, 2) else joint for i, joint in enumerate(arm.joints)],
    )
    of_friction = {
        "joint 1: the offset of the friction, -0.5 N m, is not in the file",
        "joint 1: the Stribeck term of the friction, 1.5 N m, is not in the file",
        "joint 1: the cube-root term of the friction, 0.7 N m, is not in the file",
        "joint 1: the stiffness of its gear, 900 N m/rad, is not in the file",
    }
    of_springs = {
        "joint 1: its spring of 12 N m/rad is not in the file",
        "joint 3: its spring of 12 N/m is not in the file",
    }
    assert of_friction | of_springs <= {*lost_in_urdf(arm)}
    file = arm_mjcf(arm)
    assert of_friction <= {*file.lost}
    assert not of_springs & {*file.lost}


def test_springs_in_mjcf(sample: Sample, tmp_path: Path) -> None:
    """Springs are written and read back to the last bit, and MuJoCo has their efforts from the file."""
    path = tmp_path / "arm.xml"
    for rng in sample.cases(40):
        arm = with_springs(random_arm(rng, int(rng.integers(1, 6))), rng)
        path.write_text(arm_mjcf(arm).text)
        back = load_mjcf(path)
        assert [joint.spring for joint in back.joints] == [joint.spring for joint in arm.joints]

        model = mujoco.MjModel.from_xml_path(str(path))
        data = mujoco.MjData(model)
        data.qpos[:] = q = rng.uniform(-1, 1, arm.n)
        mujoco.mj_forward(model, data)
        found = data.qfrc_bias - data.qfrc_spring
        # Bodies that MuJoCo does not take are written with more inertia; these are not among them.
        expected = gravity_efforts(arm, q)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10 * max(1.0, np.abs(expected).max()))


def test_a_spring_of_mujoco(tmp_path: Path) -> None:
    """A spring in degrees, of a joint whose zero is elsewhere, is that of MuJoCo; what is not linear is named."""
    (path := tmp_path / "arm.xml").write_text(
        """<mujoco><worldbody><body name="a"><joint name="turn" axis="0 0 1" ref="20"
        springref="-30" stiffness="7 2 0"/><geom size="0.1" pos="0.3 0 0"/></body></worldbody></mujoco>"""
    )
    reading = read_mjcf(path)
    (joint,) = reading.arm.joints

    assert (joint.spring.stiffness, joint.spring.rest) == (7, pytest.approx(math.radians(-30)))
    assert "joint 'turn': of its spring only the linear part is read" in reading.notes
    path.write_text(path.read_text().replace("7 2 0", "-7"))
    assert "joint 'turn': its spring, which pushes away with 7, is not read" in read_mjcf(path).notes
    path.write_text(path.read_text().replace("-7", "7"))
    arm = load_mjcf(path)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for q in (-1.0, 0.0, 0.7):
        data.qpos[0] = q
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.qfrc_bias - data.qfrc_spring, gravity_efforts(arm, [q]), atol=1e-10)


def test_show(tmp_path: Path) -> None:
    """Terms and springs have columns and a table where an arm has them, and nowhere else."""
    path = written(tmp_path, FULL)
    shown = armwright("show", str(path)).stdout

    assert "1.5 N m, exp(-(v / 3°/s)²)" in shown
    assert "5 N, exp(-(v / 6 mm/s)²)" in shown
    assert "-0.5 N m" in shown
    assert "12 N m/rad          30°" in shown
    puma = [head for table in tables(load_arm("puma560")) for head in (*table.heads, table.title)]
    assert not {"offset", "Stribeck friction", "cube-root friction", "Springs at the joints"} & {*puma}
    torque = armwright("torque", str(path), "-q", "10,20", "--qd", "3,-4").stdout
    assert "dry friction" in torque
    assert "springs" in torque
