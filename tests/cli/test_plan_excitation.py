"""``armwright plan-excitation`` as a user calls it."""

import json
from pathlib import Path

import numpy as np
import pytest

from armwright.errors import ExitStatus
from cli_calls import armwright


def test_motion_as_a_table(tmp_path: Path) -> None:
    """The CSV has the motion in SI units at the rate that was asked for, from rest to rest."""
    path = tmp_path / "motion.csv"
    done = armwright("plan-excitation", "ntu-3r", "--period", 10, "--rate-hz", 50, "-o", path)

    assert done.returncode == 0, done.stderr
    assert "condition" in done.stdout
    table = np.genfromtxt(path, delimiter=",", names=True)
    assert table["t"][-1] == pytest.approx(10)
    assert len(table) == 501
    for i in (1, 2, 3):
        assert np.gradient(table[f"q{i}"], table["t"])[2:-2] == pytest.approx(table[f"qd{i}"][2:-2], abs=2e-2)
        assert table[f"qd{i}"][[0, -1]] == pytest.approx(0, abs=1e-9)


def test_program_that_a_cell_runs(tmp_path: Path) -> None:
    """With the name of a program the poses are those of an RLO program, which the cell runs without an error."""
    path = tmp_path / "motion.rlo"
    cell = Path(__file__).parents[2] / "examples" / "stanford_cell.toml"
    done = armwright("plan-excitation", "stanford", "--cell", cell, "--period", 8, "-o", path, "--json")

    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["condition"] > 1
    done = armwright("run", path, "--cell", cell)
    assert done.returncode == 0, done.stderr
    assert "9 moves" in done.stdout


def test_cells_of_other_arms_are_refused() -> None:
    """An arm of a cell with another number of joints, or one that there is not, is an error of usage."""
    cell = Path(__file__).parents[2] / "examples" / "stanford_cell.toml"
    done = armwright("plan-excitation", "ntu-3r", "--cell", cell)
    assert done.returncode == ExitStatus.USAGE
    assert "3 joints" in done.stderr
    done = armwright("plan-excitation", "stanford", "--cell", cell, "--arm", "ARM_2")
    assert done.returncode == ExitStatus.USAGE
    assert "no arm of the cell 'ARM_2'" in done.stderr


def test_exports_for_controllers_that_keep_to_times(tmp_path: Path) -> None:
    """The motion comes with its proof for one, is refused for another, and what a third lacks is said."""
    done = armwright(
        "plan-excitation", "ur5", "--period", 4, "--harmonics", 3, "--export", "ros2", "-o", tmp_path / "a"
    )
    assert done.returncode == 0, done.stderr
    assert "joints between the points" in done.stdout
    names = {path.name for path in (tmp_path / "a").iterdir()}
    assert names == {"ARM_1.trajectory.yaml", "ARM_1.goal.yaml", "events.json", "proof.json", "run.json"}

    refused = armwright("plan-excitation", "ur5", "--export", "krl", "-o", tmp_path / "b")
    assert refused.returncode == ExitStatus.USAGE
    assert "expected ros2, csv, urscript, got krl" in refused.stderr
    assert not (tmp_path / "b").exists()

    unknown = armwright("plan-excitation", "ur5", "--period", 4, "--harmonics", 3, "--export", "csv")
    assert unknown.returncode == ExitStatus.USAGE
    assert "write `[arms.ARM_1.encoders]`" in unknown.stderr
