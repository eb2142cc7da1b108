"""Arms moved by hand: solutions against the plain inverse kinematics, steps that go on steadily, remarks."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.cell.model import CellArm
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.kinematics.jacobians import jacobian
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector
from armwright.studio.live_arm import LiveArm, UnreachableError
from oracles.arms import random_configurations, random_pose
from oracles.published_arms import cobra600, iiwa14, panda, wx250
from samples import Sample

EXAMPLES = Path(__file__).parents[2] / "examples"


def live(name: str, q: np.ndarray | None = None, base: np.ndarray | None = None) -> LiveArm:
    arm = load_arm(name)
    start = (arm.limits.lower + arm.limits.upper) / 2 if q is None else q
    return LiveArm("ARM_1", CellArm(arm=arm, start=start, base=np.eye(4) if base is None else base))


@pytest.mark.parametrize("name", ["puma560", "ur5", "stanford"])
def test_solutions(name: str, sample: Sample) -> None:
    """Every solution brings the tool to where it is; those within the limits are those of the inverse kinematics."""
    for rng in sample.cases(200):
        base = random_pose(rng)
        arm = live(name, random_configurations(load_arm(name), rng, 1)[0], base)
        plain = inverse(arm.placed.arm, forward(arm.placed.arm, arm.q), arm.q)

        found = arm.solutions()

        for it in found:
            np.testing.assert_allclose(arm.tool_at(it.q), arm.tool, atol=1e-6)
        assert sum(it.here for it in found) == 1
        allowed = sorted(it.label for it in found if not it.fault)
        assert allowed == sorted(branch.label for branch in plain.branches if branch.allowed)
    sample.record(f"solutions of {name} at a pose", sample.count(200), 0)


@pytest.mark.parametrize("name", ["puma560", "ur5", "stanford", str(EXAMPLES / "seven_joints.urdf")])
def test_dragged_tool(name: str, sample: Sample) -> None:
    """A tool goes where it is dragged or stays where it is, and no joint leaps."""
    moved = 0
    for rng in sample.cases(40):
        model = load_arm(name)
        lower, upper = np.clip([model.limits.lower, model.limits.upper], -2.0, 2.0)
        arm = live(name, (lower + upper) / 2 + rng.uniform(-0.2, 0.2, model.n) * (upper - lower))
        step = homogeneous(rotation_from_vector(rng.normal(scale=0.01, size=3)), rng.normal(scale=0.003, size=3))
        for _ in range(10):
            goal, before = arm.tool @ step, arm.q
            try:
                arm.move_tool(goal)
            except UnreachableError:
                np.testing.assert_array_equal(arm.q, before)
                continue
            moved += 1
            np.testing.assert_allclose(arm.tool, goal, atol=2e-6)
            assert np.abs(arm.q - before).max() < np.radians(30.0) + 1e-9
            assert (arm.q >= arm.lower).all()
            assert (arm.q <= arm.upper).all()
    assert moved > 0


@pytest.mark.parametrize("make", [cobra600, wx250, iiwa14, panda])
def test_arms_of_other_classes(make: Callable[[], Arm], rng: np.random.Generator) -> None:
    """Few joints and seven have solutions with names of their own; the tool is dragged steadily.

    Few joints are led by the position of the tool where they cannot keep its orientation.
    """
    model = make()
    q = 0.4 * model.limits.lower + 0.6 * model.limits.upper
    arm = LiveArm("ARM_1", CellArm(arm=model, start=q, base=random_pose(rng)))

    found = arm.solutions()

    assert len({it.label for it in found}) == len(found) > 1
    assert sum(it.here for it in found) == 1
    for _ in range(5):
        goal, before = arm.tool.copy(), arm.q
        goal[:3, 3] += rng.normal(scale=0.003, size=3)
        arm.move_tool(goal)
        np.testing.assert_allclose(arm.tool[:3, 3], goal[:3, 3], atol=2e-6)
        assert np.abs(arm.q - before).max() < np.radians(30.0)


def test_out_of_reach() -> None:
    """What cannot be reached is said, with the joint and its limit or the reach."""
    arm = live("puma560")
    far = arm.tool.copy()
    far[0, 3] += 5.0
    with pytest.raises(UnreachableError, match="out of reach"):
        arm.move_tool(far)
    with pytest.raises(UnreachableError, match="out of reach"):
        arm.move_tool(far, leaping=True)


def test_remarks() -> None:
    """A joint at its limit is named, and a singular wrist with the joints that do nothing together."""
    arm = live("puma560")
    arm.set_joints(np.array([0.3, -0.5, 0.4, 0.2, 0.7, 9.9]))
    assert [(it.kind, it.joints) for it in arm.remarks()] == [("limit", (6,))]
    assert arm.remarks()[0].text == "joint 6 is at its limit"

    arm.set_joints(np.array([0.3, -0.5, 0.4, 0.2, 1e-6, 0.1]))
    (remark,) = arm.remarks()
    assert (remark.kind, remark.level, remark.joints) == ("singular", "error", (4, 6))
    assert remark.text.startswith("at a singularity of the wrist: the tool hardly ")
    # What is lost is what no joint can do.
    lost = np.linalg.svd(jacobian(arm.placed.arm, arm.q))[0][:, -1]
    axis = lost[3:] / np.linalg.norm(lost[3:])
    assert "({:.2f}, {:.2f}, {:.2f})".format(*(axis * np.sign(axis[np.abs(axis).argmax()]) + 0.0)) in remark.text
