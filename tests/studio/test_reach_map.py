"""Maps of where a tool can be brought, against the plain inverse kinematics."""

import base64
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.cell.model import CellArm
from armwright.kinematics.inverse_kinematics.solution import Outcome
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.studio.live_arm import LiveArm
from armwright.studio.reach_map import ReachMap
from samples import Sample

EXAMPLES = Path(__file__).parents[2] / "examples"


def whole_map(live: LiveArm, rng: np.random.Generator) -> tuple[Any, Array]:
    """A map of a random plane: the values of its points (k,), and where those are (k, 3)."""
    reached = ReachMap(live, ("xy", "xz", "yz")[rng.integers(3)])
    while not reached.done:
        reached.step()
    state = reached.state()
    values = np.frombuffer(base64.b64decode(state["values"]), dtype=np.uint8)
    rows, columns = np.divmod(np.arange(len(values)), state["side"])
    u, v = (np.outer(k, state[axis]) / (state["side"] - 1) for k, axis in ((columns, "u"), (rows, "v")))
    return values, state["corner"] + u + v


def at(live: LiveArm, point: Array) -> Array:
    """The pose (4, 4) of the tool of an arm, moved to a point."""
    X = live.tool.copy()
    X[:3, 3] = point
    return X


@pytest.mark.parametrize("name", ["puma560", "ur5", "stanford"])
def test_against_the_inverse(name: str, sample: Sample) -> None:
    """Each point is out of reach, beyond a limit or reached as the inverse kinematics says."""
    arm = load_arm(name)
    rng = np.random.default_rng(sample.seed)
    middle = np.clip((arm.limits.lower + arm.limits.upper) / 2, -3, 3)
    live = LiveArm("ARM_1", CellArm(arm=arm, start=np.clip(middle + 0.5, arm.limits.lower, arm.limits.upper)))
    values, points = whole_map(live, rng)
    wrong = 0

    for number in rng.integers(len(values), size=sample.count(400)).tolist():
        plain = inverse(arm, at(live, points[number]), live.q)
        kinds = {Outcome.OUT_OF_REACH: 0, Outcome.OUT_OF_LIMITS: 1}
        wrong += min(int(values[number]), 2) != kinds.get(plain.outcome, 2)
    sample.record(f"points of maps of {name}", sample.count(400), wrong)
    assert wrong == 0
    assert (values > 1).any()
    assert (values < 2).any()


def test_steps_of_seven_joints(sample: Sample) -> None:
    """Of an arm without a closed form what is reached by steps from where it stands is a solution of the inverse."""
    arm = load_arm(str(EXAMPLES / "seven_joints.urdf"))
    rng = np.random.default_rng(sample.seed)
    live = LiveArm("ARM_1", CellArm(arm=arm, start=[0.4, 0.8, 0.2, 1.4, 0.1, 0.6, 0.0]))
    values, points = whole_map(live, rng)

    reached = np.flatnonzero(values > 1)
    for number in rng.choice(reached, size=sample.count(60)).tolist():
        plain = inverse(arm, at(live, points[number]), live.q)
        assert plain.outcome in {Outcome.SOLVED, Outcome.SINGULAR}, points[number]
    assert 10 < len(reached) < len(values) - 10
    # The point that is nearest to where the tool is, is reached.
    assert values[np.linalg.norm(points - live.tool[:3, 3], axis=1).argmin()] > 1


def test_steps_of_three_joints(sample: Sample) -> None:
    """Of three joints the place of the tool counts: what is reached lies between two balls about the shoulder."""
    arm = load_arm("ntu-3r")
    live = LiveArm("ARM_1", CellArm(arm=arm, start=[0.4, -0.6, 1.2]))
    values, points = whole_map(live, np.random.default_rng(sample.seed))

    lateral, height = arm.joints[2].d, arm.joints[0].d
    upper, fore = arm.joints[1].a, float(np.linalg.norm(arm.tool[:3, 3]))
    flat = (points[:, :2] ** 2).sum(axis=1) - lateral**2
    away = np.sqrt(np.maximum(flat + (points[:, 2] - height) ** 2, 0.0))
    inside = (flat >= 0) & (away > abs(upper - fore)) & (away < upper + fore)
    reached = values > 1
    assert not (reached & ~inside).any()
    # Steps from one configuration find most of it.
    assert reached.sum() > 0.9 * inside.sum()
