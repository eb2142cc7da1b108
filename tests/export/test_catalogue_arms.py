"""Every arm of the catalogue in a cell: solved, weighed, moved past its surroundings, and written for its drives."""

from pathlib import Path

import attrs
import mujoco
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arm.write import toml_text
from armwright.arrays import Array
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.export import export_run
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.physics.mjcf import arm_mjcf
from armwright.program.api import run
from armwright.program.vm.machine import RunError
from oracles.catalogue import FEW, FEW_WITH_MASSES, NAMES, WITH_MASSES
from samples import Sample

IN_CELLS = [name for name in NAMES if name != "ntu-3r"]
# Moments that no body has are enlarged in MJCF, which the report of the file says.
ENLARGED = 2e-3
PROGRAM = "VAR GOAL : FRAME ;\nBEGIN\n  MOVE ARM_1 TO GOAL ;\nEND.\n"


def middle(arm: Arm, rng: np.random.Generator) -> Array:
    """A configuration away from the ends of the joints."""
    lower, upper = np.maximum(arm.limits.lower, -2.0), np.minimum(arm.limits.upper, 2.0)
    return np.asarray(lower + rng.uniform(0.2, 0.8, arm.n) * (upper - lower))


def turned(arm: Arm, way: Array) -> Array:
    """Ways of joints, without whole turns."""
    return np.where(arm.revolute, np.remainder(way + np.pi, 2 * np.pi) - np.pi, way)


def with_rates(arm: Arm) -> Arm:
    """The arm with speeds and accelerations, where its file has none."""
    joints = [
        attrs.evolve(
            joint,
            limits=attrs.evolve(
                joint.limits, speed=min(joint.limits.speed, 1.0), acceleration=min(joint.limits.acceleration, 4.0)
            ),
        )
        for joint in arm.joints
    ]
    return attrs.evolve(arm, joints=joints, documents=())


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", NAMES)
def test_solved(name: str, sample: Sample) -> None:
    """The inverse kinematics of a pose leads back to the joints that have it; seven joints only to the pose."""
    arm = load_arm(name)
    for rng in sample.cases(10):
        q = middle(arm, rng)
        X = forward(arm, q)

        branches = inverse(arm, X, q).branches

        poses = [np.abs(forward(arm, branch.q) - X).max() for branch in branches]
        assert min(poses) < 1e-6
        if arm.n <= 6 and name != "ntu-3r":
            assert min(np.abs(turned(arm, branch.q - q)).max() for branch in branches) < 1e-4


@pytest.mark.drawn(FEW_WITH_MASSES)
@pytest.mark.parametrize("name", WITH_MASSES)
def test_weighed(name: str, sample: Sample) -> None:
    """The plant of an arm with masses has its mass matrix."""
    arm, rng = load_arm(name), np.random.default_rng(sample.seed)
    model = mujoco.MjModel.from_xml_string(arm_mjcf(arm).text)
    data = mujoco.MjData(model)
    q = middle(arm, rng)
    data.qpos[:] = q
    mujoco.mj_forward(model, data)
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)

    expected = mass_matrix(arm, q)

    np.testing.assert_allclose(M, expected, atol=ENLARGED * np.abs(expected).max())


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", IN_CELLS)
def test_moved(name: str, sample: Sample, tmp_path: Path) -> None:
    """A MOVE in a cell with a post is checked for collisions, runs, and is written in counts of the drives."""
    arm, rng = with_rates(load_arm(name)), np.random.default_rng(sample.seed)
    (tmp_path / "arm.toml").write_text(toml_text(attrs.evolve(arm, name=name)), encoding="utf-8")
    for _ in range(30):
        start = middle(arm, rng)
        goal = start + 0.1 * (middle(arm, rng) - start)
        X = forward(arm, goal)
        frame = ", ".join(f"{x:.12f}" for x in X[:3].T.ravel())
        (tmp_path / "cell.toml").write_text(
            f'[arms.ARM_1]\nmodel = "arm.toml"\njoint_positions = {start.tolist()}\n'
            f"encoders = {{ counts = {[1e5] * arm.n} }}\n"
            f"[frames]\nGOAL = [{frame}]\n"
            '[scene]\nspheres = [{ name = "POST", at = [1, 0, 0, 0, 1, 0, 0, 0, 1, 9, 0, 0], diameter_mm = 50 }]\n',
            encoding="utf-8",
        )
        (tmp_path / "move.rlo").write_text(PROGRAM, encoding="utf-8")
        try:
            recording = run(tmp_path / "move.rlo", tmp_path / "cell.toml")
        except RunError as error:
            # Some configurations are ones in which the arm meets itself.
            assert error.diagnostic.code == "E406"  # noqa: PT017 - the others are none of this test
            continue
        assert recording.checked is not None
        np.testing.assert_allclose(forward(arm, recording.configurations["ARM_1"]), X, atol=1e-6)
        files = export_run("csv", recording, "move").files
        last = np.array([int(x) for x in files["ARM_1.csv"].splitlines()[-1].split(",")])
        turns = recording.configurations["ARM_1"] / np.where(arm.revolute, 2 * np.pi, 1.0)
        drives = turns if arm.coupling is None else arm.coupling.drives(turns)
        np.testing.assert_allclose(last, drives * 1e5, atol=0.51)
        return
    pytest.fail(f"{name} meets itself everywhere")
