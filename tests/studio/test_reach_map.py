"""Maps of where a tool can be brought, against the plain inverse kinematics."""

import base64

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.cell.model import CellArm
from armwright.kinematics.inverse_kinematics.solution import Outcome
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.studio.live_arm import LiveArm
from armwright.studio.reach_map import ReachMap
from samples import Sample


@pytest.mark.parametrize("name", ["puma560", "ur5", "stanford"])
def test_against_the_inverse(name: str, sample: Sample) -> None:
    """Each point is out of reach, beyond a limit or reached as the inverse kinematics says."""
    arm = load_arm(name)
    rng = np.random.default_rng(sample.seed)
    middle = np.clip((arm.limits.lower + arm.limits.upper) / 2, -3, 3)
    live = LiveArm("ARM_1", CellArm(arm=arm, start=np.clip(middle + 0.5, arm.limits.lower, arm.limits.upper)))
    reached = ReachMap(live, ("xy", "xz", "yz")[rng.integers(3)])
    while not reached.done:
        reached.step()
    state = reached.state()
    values = np.frombuffer(base64.b64decode(state["values"]), dtype=np.uint8)
    side, wrong = state["side"], 0

    for number in rng.integers(side * side, size=sample.count(400)).tolist():
        row, column = divmod(number, side)
        X = live.tool.copy()
        X[:3, 3] = np.array(state["corner"]) + np.array(state["u"]) * column / (side - 1)
        X[:3, 3] += np.array(state["v"]) * row / (side - 1)
        plain = inverse(arm, X, live.q)
        kinds = {Outcome.OUT_OF_REACH: 0, Outcome.OUT_OF_LIMITS: 1}
        wrong += min(int(values[number]), 2) != kinds.get(plain.outcome, 2)
    sample.record(f"points of maps of {name}", sample.count(400), wrong)
    assert wrong == 0
    assert (values > 1).any()
    assert (values < 2).any()
