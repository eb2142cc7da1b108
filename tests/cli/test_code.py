"""armwright code, programs that are run from code, and programs that import their cell."""

import json
from pathlib import Path

import pytest

from cli_calls import armwright

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
CELL = EXAMPLES / "two_arms.toml"
FRAMES = '{"frames": {"BOX": [1,0,0, 0,-1,0, 0,0,-1, 0.40, 0.10, 0.10]}}'
IMPORTING = 'IMPORT "cell.toml" ;\nIMPORT "parts.json" ;\nBEGIN\n  MOVE ARM_1 TO box\nEND.\n'


@pytest.fixture
def importing(tmp_path: Path) -> Path:
    """Return a program that imports a cell and frames, which lie beside it."""
    (tmp_path / "cell.toml").write_text(CELL.read_text())
    (tmp_path / "parts.json").write_text(FRAMES)
    path = tmp_path / "program.rlo"
    path.write_text(IMPORTING)
    return path


def test_run_from_code(tmp_path: Path) -> None:
    """Code that was written to a file runs to the same trace as the program."""
    code = tmp_path / "hand_over.rlc"
    written = armwright("code", EXAMPLES / "hand_over.rlo", "--cell", CELL, "-o", code)
    from_code = armwright("run", code, "--cell", CELL, "--json")
    from_text = armwright("run", EXAMPLES / "hand_over.rlo", "--cell", CELL, "--json")

    assert (written.returncode, from_code.returncode) == (0, 0)
    assert json.loads(from_code.stdout)["trace"] == json.loads(from_text.stdout)["trace"]


def test_listing_and_whole(tmp_path: Path) -> None:
    """A listing has the constants at its end; the whole code is what a file of it prints again."""
    listing = armwright("code", EXAMPLES / "bench.rlo").stdout
    whole = armwright("code", EXAMPLES / "bench.rlo", "--full").stdout
    path = tmp_path / "bench.rlc"
    path.write_text(whole)

    assert listing.splitlines()[-4].startswith("c0 ")
    assert "\nsource\n" in whole
    again = armwright("code", path, "--full").stdout
    assert [line.split(" ;")[0].rstrip() for line in again.splitlines()] == [
        line.split(" ;")[0].rstrip() for line in whole.splitlines()
    ]


def test_code_that_makes_no_sense(tmp_path: Path) -> None:
    """What is wrong with code is told with file and line."""
    path = tmp_path / "bad.rlc"
    path.write_text("program 5\nsource\n")
    result = armwright("run", path, "--cell", CELL)

    assert result.returncode == 4
    assert f"{path}:1: expected text" in result.stderr


def test_code_that_does_not_fit_together(tmp_path: Path) -> None:
    """Code that can be read and still means nothing, as a branch that ends where none began, is told with its file."""
    path = tmp_path / "bad.rlc"
    path.write_text(armwright("code", EXAMPLES / "bench.rlo", "--full").stdout.replace("GRASP  ARM_1", "QUIT", 1))
    result = armwright("run", path, "--cell", CELL)

    assert result.returncode == 4
    assert result.stderr.startswith(f"armwright: {path}:")
    assert "Traceback" not in result.stderr


def test_the_cell_is_imported(importing: Path) -> None:
    """Without --cell the program runs in the first cell that it imports, with the frames of all files."""
    result = armwright("run", importing, "-o", importing.parent / "out")
    run = json.loads((importing.parent / "out" / "run.json").read_text())

    assert result.returncode == 0, result.stderr + result.stdout
    assert run["trace"] == ["ARM_1 MOVE: PTP box @100"]
    assert run["inputs"]["cell"] is None
    assert [Path(one["path"]).name for one in run["inputs"]["imports"]] == ["cell.toml", "parts.json"]


def test_no_cell_at_all(tmp_path: Path) -> None:
    """A program without a cell is told what it needs."""
    path = tmp_path / "program.rlo"
    path.write_text("BEGIN OPEN ARM_1 END.")
    result = armwright("run", path)

    assert result.returncode == 2
    assert "--cell" in result.stderr


def test_sarif(tmp_path: Path) -> None:
    """Armwright check --format sarif names the file as it was given."""
    path = tmp_path / "wrong.rlo"
    path.write_text("BEGIN OPEN END.")
    result = armwright("check", path, "--format", "sarif")

    assert result.returncode == 1
    (one,) = json.loads(result.stdout)["runs"][0]["results"]
    assert one["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] == path.as_posix()


@pytest.mark.parametrize(
    ("option", "code"), [(("--max-steps", "1000"), "E504"), (("--max-steps", "1000000", "--max-time", "2"), "E506")]
)
def test_programs_without_end(tmp_path: Path, option: tuple[str, ...], code: str) -> None:
    """A program that would never end is ended by the limits of the command."""
    path = tmp_path / "ever.rlo"
    pause = "" if code == "E504" else "PAUSE 0.5 ;"
    path.write_text(f"VAR n : SCALAR ; BEGIN n = 0 ; WHILE n < 1 DO BEGIN {pause} n = 0 END END.")
    result = armwright("run", path, "--cell", CELL, *option)

    assert result.returncode == 3
    assert f"error[{code}]" in result.stdout


def test_old_language(tmp_path: Path) -> None:
    """--std=83 runs a program that uses words of RLO-2 as names."""
    path = tmp_path / "old.rlo"
    path.write_text("VAR wait : SCALAR ; BEGIN wait = 5 ; READ SYSTEM (ARM_1) END.")

    assert armwright("run", path, "--cell", CELL, "--std", "83").returncode == 0
    refused = armwright("run", path, "--cell", CELL)
    assert refused.returncode == 1
    assert "--std=83" in refused.stdout
