"""Arms of four and five joints in cells: goals that they reach and cannot turn to are refused with the angle."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.cell.reader import read_cell
from armwright.errors import FileFormatError
from armwright.kinematics.forward_kinematics import forward
from armwright.program.api import run
from armwright.program.vm.machine import RunError


def literal(X: Array) -> str:
    return f"[{', '.join(f'{x:.9f}' for x in (*X[:3, 0], *X[:3, 1], *X[:3, 2], *X[:3, 3]))}]"


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize(
    ("name", "start", "goal"),
    [
        ("m430ia-2f", (0.2, 0.4, 0.9, 0.5, 0.6), (-0.4, 0.5, 0.7, 0.6, 0.2)),
        ("xarm5", (0.2, 0.1, -0.6, 0.8, 0.3), (-0.3, 0.2, -0.9, 0.9, 0.1)),
        ("px150", (0.2, 0.1, 0.3, 0.4, 0.3), (-0.3, 0.2, 0.1, 0.5, 0.1)),
    ],
)
def test_five_joints(name: str, start: tuple[float, ...], goal: tuple[float, ...], tmp_path: Path) -> None:
    """A MOVE to a frame that the arm can turn to arrives there; to another it is an error with the angle."""
    arm = load_arm(name)
    first, second = forward(arm, np.array(start)), forward(arm, np.array(goal))
    beyond = second.copy()
    beyond[:3, :3] = Rotation.from_euler("xyz", (0.4, 0.3, 0.2)).as_matrix() @ second[:3, :3]
    (tmp_path / "cell.toml").write_text(
        f'[arms.ARM_1]\nmodel = "{name}"\nhand = {literal(first)}\n'
        f"[frames]\nGOAL = {literal(second)}\nBEYOND = {literal(beyond)}\n",
        encoding="utf-8",
    )
    (tmp_path / "good.rlo").write_text("VAR GOAL : FRAME ;\nBEGIN\n  MOVE ARM_1 TO GOAL ;\nEND.\n", encoding="utf-8")
    (tmp_path / "bad.rlo").write_text("VAR BEYOND : FRAME ;\nBEGIN\n  MOVE ARM_1 TO BEYOND ;\nEND.\n", encoding="utf-8")

    recording = run(tmp_path / "good.rlo", tmp_path / "cell.toml")

    np.testing.assert_allclose(forward(arm, recording.configurations["ARM_1"]), second, atol=1e-5)
    with pytest.raises(RunError) as caught:
        run(tmp_path / "bad.rlo", tmp_path / "cell.toml")
    error = caught.value.diagnostic
    assert error.code == "E401"
    assert any(f"'{name}', an arm of 5 joints, cannot turn its tool to the pose" in note for note in error.notes)


def test_three_joints(tmp_path: Path) -> None:
    """An arm of three joints stands in no cell."""
    (tmp_path / "cell.toml").write_text('[arms.ARM_1]\nmodel = "ntu-3r"\n', encoding="utf-8")

    with pytest.raises(FileFormatError, match="'ntu-3r' has 3 joints; an arm in a cell needs four or more"):
        read_cell(tmp_path / "cell.toml")
