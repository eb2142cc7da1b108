"""Teaching into a cell file: what is taught is read back, all else stays as it is, nothing wrong is written."""

from pathlib import Path

import numpy as np
import pytest

from armwright.cell.reader import read_cell
from armwright.errors import OutputError, UnknownNameError
from armwright.studio.cell_file import CellFile, TeachingError
from oracles.arms import random_pose
from samples import Sample

TEXT = """\
# The cell of a test.
name = "bench"   # behind a value

[arms.ARM_1]
model = "stanford"
hand = [1, 0, 0,  0,-1, 0,  0, 0,-1,   0.45, 0.00, 0.25]

[frames]
# Where parts come.
FEEDER = [1, 0, 0,  0,-1, 0,  0, 0,-1,   0.45, 0.10, 0.25]
ABOVE = { on = "FEEDER", at = [1, 0, 0,  0, 1, 0,  0, 0, 1,  0, 0, -0.1] }  # hangs
"""


@pytest.fixture
def file(tmp_path: Path) -> CellFile:
    path = tmp_path / "bench.toml"
    path.write_text(TEXT)
    return CellFile(path)


def test_taught_frames(file: CellFile, sample: Sample) -> None:
    """Frames are where they were taught, in the world or on another frame, to a tenth of a micrometre."""
    for number, rng in enumerate(sample.cases(100)):
        X, X_WP = random_pose(rng), read_cell(file.path).tree().world("FEEDER")
        file.teach(f"P{number}", X)
        file.teach(f"Q{number}", X, "FEEDER", X_WP)
        file.save(file.path)
        tree = read_cell(file.path).tree()
        for name in (f"P{number}", f"Q{number}"):
            np.testing.assert_allclose(tree.world(name), X, atol=2e-7)


def test_joint_targets(file: CellFile, sample: Sample) -> None:
    """Joint targets are where they were taught, also at limits; they are renamed and forgotten like frames."""
    limits = file.cell.arms["ARM_1"].arm.limits
    lower, upper = np.maximum(limits.lower, -3.0), np.minimum(limits.upper, 3.0)
    for number, rng in enumerate(sample.cases(100)):
        q = np.where(rng.random(6) < 0.2, upper, rng.uniform(lower, upper))
        file.teach_joints(f"j{number}", "ARM_1", q)
        file.save(file.path)
        np.testing.assert_allclose(read_cell(file.path).joint_targets[f"J{number}"].q, q, atol=1e-7)
    file.rename("J0", "home")
    with pytest.raises(TeachingError, match="HOME is taken already"):
        file.rename("FEEDER", "Home")
    with pytest.raises(TeachingError, match="HOME is a frame of the cell already"):
        file.teach("HOME", np.eye(4))
    file.forget("HOME")
    assert "HOME" not in file.cell.joint_targets


def test_all_else_stays(file: CellFile) -> None:
    """Comments and layout are kept; the change is shown before it is written."""
    file.teach("NEW", np.eye(4))

    assert file.path.read_text() == TEXT
    added = [line for line in file.difference().splitlines()[2:] if line[:1] in "+-"]
    assert added == ["+NEW = [1, 0, 0,  0, 1, 0,  0, 0, 1,  0, 0, 0]"]
    file.save(file.path)
    assert [line for line in file.path.read_text().splitlines() if line not in TEXT.splitlines()] == [added[0][1:]]
    assert not file.changed
    assert file.difference() == ""


def test_rename_forget_undo(file: CellFile) -> None:
    """What hangs on a renamed frame follows it; a frame that carries another is not taken out."""
    file.rename("feeder", "supply")
    assert file.cell.frames["ABOVE"].parent == "SUPPLY"
    assert "# Where parts come." in file.text
    with pytest.raises(TeachingError, match="ABOVE is attached to SUPPLY"):
        file.forget("SUPPLY")
    file.forget("ABOVE")
    assert set(file.cell.frames) == {"SUPPLY"}
    file.undo()
    file.undo()
    assert file.text == TEXT
    assert set(file.cell.frames) == {"FEEDER", "ABOVE"}
    with pytest.raises(TeachingError, match="nothing has been taught"):
        file.undo()


@pytest.mark.parametrize("name", ["", "a b", "1st", "A]\nevil = 1", 'A"', "WORLD", "ARM_1", "Ä"])
def test_wrong_names(file: CellFile, name: str) -> None:
    """What is no name of a frame changes nothing."""
    with pytest.raises(TeachingError):
        file.teach(name, np.eye(4))
    assert file.text == TEXT


def test_refused(file: CellFile, tmp_path: Path) -> None:
    """Unknown frames, names that are taken, JSON, and files that somebody else has changed."""
    with pytest.raises(UnknownNameError, match="FEEDER"):
        file.rename("FEDER", "X")
    with pytest.raises(TeachingError, match="ABOVE is taken already"):
        file.rename("FEEDER", "above")
    file.teach("NEW", np.eye(4))
    file.path.write_text(TEXT + "# by another program\n")
    with pytest.raises(OutputError, match="changed since it was read"):
        file.save(file.path)
    assert file.path.read_text().endswith("# by another program\n")
    other = tmp_path / "cell.json"
    other.write_text('{"arms": {"ARM_1": {"joint_positions": [0, 0, 0.3, 0, 0, 0]}}}')
    with pytest.raises(TeachingError, match=r"cell\.json is JSON"):
        CellFile(other).teach("P", np.eye(4))
