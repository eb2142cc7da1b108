"""Any arm of the catalogue in a cell that has nothing else: it is jogged joint by joint, and its bodies are checked."""

from pathlib import Path

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.cell.reader import read_cell
from armwright.kinematics.forward_kinematics import forward
from armwright.physics.collision_bodies import collision_bodies
from armwright.studio.workbench import Workbench
from oracles.catalogue import FEW, NAMES
from samples import Sample


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", [name for name in NAMES if name != "ntu-3r"])
def test_jog(name: str, sample: Sample, tmp_path: Path) -> None:
    """Each joint moves the tool as the arm's own kinematics say, and stops at its limit."""
    rng, arm = np.random.default_rng(sample.seed), load_arm(name)
    start = rng.uniform(np.maximum(arm.limits.lower, -1.0), np.minimum(arm.limits.upper, 1.0))
    places = ", ".join(f"{x:.6f}" for x in start)
    (tmp_path / "cell.toml").write_text(
        f'[arms.ARM_1]\nmodel = "{name}"\njoint_positions = [{places}]\n', encoding="utf-8"
    )
    bench = Workbench(read_cell(tmp_path / "cell.toml"))
    bench.warm_up()
    live = bench.arms["ARM_1"]
    for joint in range(arm.n):
        q = live.q.copy()
        length, angle = rng.uniform(-0.02, 0.02), rng.uniform(-0.05, 0.05)
        q[joint] += angle if arm.revolute[joint] else length
        q = np.clip(q, arm.limits.lower, arm.limits.upper)

        bench.jog("ARM_1", "JOINT", joint, length, angle, 0.0)

        np.testing.assert_allclose(live.q, q, atol=1e-12)
        np.testing.assert_allclose(live.tool, forward(arm, q), atol=1e-9)


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", NAMES)
def test_pairs(name: str) -> None:
    """Every pair of bodies is either checked for collisions or left out with a reason, none twice."""
    arm = load_arm(name)
    data = collision_bodies(arm).as_data()

    pairs = [tuple(pair) for pair in data["checked"]] + [tuple(each["bodies"]) for each in data["left_out"]]
    present = [body["body"] for body in data["bodies"] if body["solids"]]
    assert len(pairs) == len(set(pairs))
    assert {body for pair in pairs for body in pair} <= {body["body"] for body in data["bodies"]}
    assert len(pairs) >= len(present) * (len(present) - 1) // 2
    assert all(each["reason"] for each in data["left_out"])
