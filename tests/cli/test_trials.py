"""``armwright run --trials``, as a user calls it."""

import json
from pathlib import Path

import pytest

from armwright.errors import MissingExtraError
from armwright.sweep import extras
from cli_calls import armwright
from oracles.benches import PROGRAM, bench_text

pytest.importorskip("xarray")

TRIALS = """[trials]
mass_pct = 20
pose = { BLOCK = { xy_mm = 20, yaw_deg = 180 } }
goal = { BLOCK = { at = "SLOT", mm = 2, deg = 3 } }
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a bench and its program."""
    (tmp_path / "bench.toml").write_text(bench_text() + TRIALS, encoding="utf-8")
    (tmp_path / "place.rlo").write_text(PROGRAM, encoding="utf-8")
    (tmp_path / "idle.rlo").write_text("BEGIN\n  OPEN ARM_1 ;\nEND.\n", encoding="utf-8")
    return tmp_path


def _run(folder: Path, *arguments: str, program: str = "place.rlo", status: int = 0) -> str:
    done = armwright("run", program, "--cell", "bench.toml", *arguments, cwd=folder)
    assert done.returncode == status, done
    assert "Traceback" not in done.stderr
    return done.stdout + done.stderr if status else done.stdout


def test_four_trials_succeed_and_are_resumed(folder: Path) -> None:
    command = ("--physics", "--trials", "4", "--seed", "1", "--workers", "1", "--json", "-o", "out")
    first = json.loads(_run(folder, *command))
    assert (first["success"], first["trials"], first["causes"]) == (1.0, 4, {})
    assert 0 < first["errors_mm"]["largest"] < 2
    assert json.loads((folder / "out" / "trials.json").read_text(encoding="utf-8")) == first
    # As after a kill: without the results and one block, of which the same comes out again; the others are kept.
    blocks = sorted((folder / "out" / "trials" / "blocks").glob("*.npy"))
    assert len(blocks) == 4
    (folder / "out" / "trials" / "results.nc").unlink()
    blocks[2].unlink()
    kept = [(path, path.stat().st_mtime_ns) for path in blocks if path != blocks[2]]
    assert json.loads(_run(folder, *command)) == first
    assert [(path, path.stat().st_mtime_ns) for path, _ in kept] == kept
    # A trial alone is that of the sweep.
    alone = json.loads(_run(folder, "--physics", "--seed", "1", "--trial", "3", "--json", "-o", "three"))["trial"]
    assert alone["success"]
    assert alone["error_mm"] <= first["errors_mm"]["largest"]
    assert (folder / "three" / "measured.csv").exists()


def test_trials_without_the_extra_run_in_this_process(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    command = ("--physics", "--trials", "3", "--workers", "1", "--json")
    expected = json.loads(_run(folder, *command, program="idle.rlo"))

    def missing() -> None:
        raise MissingExtraError("no")

    monkeypatch.setattr(extras, "check_extras", missing)
    found = json.loads(_run(folder, *command, program="idle.rlo"))
    assert found == expected
    # The block is still where it was drawn.
    assert found["success"] == 0.0
    assert found["causes"] == {"misplaced": {"count": 3, "trials": [1, 2, 3]}}


def test_other_files_are_other_trials(folder: Path) -> None:
    """Trials are not resumed with another program or another mesh under the same name; the message says which it is."""
    bench = folder / "bench.toml"
    bodies = (
        'meshes = [{ name = "WEDGE", mesh = "wedge.obj", unit = "mm", at = [1,0,0, 0,1,0, 0,0,1, 0.9,0.5,0.03] }]\n'
    )
    bench.write_text(bench.read_text(encoding="utf-8").replace("[scene]\n", f"[scene]\n{bodies}"), encoding="utf-8")
    wedge = "v 0 0 0\nv 0 {0} 0\nv {0} 0 0\nv 0 0 {0}\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n"
    (folder / "wedge.obj").write_text(wedge.format(20), encoding="utf-8")
    command = ("--physics", "--trials", "1", "--workers", "1", "-o", "out")
    _run(folder, *command, program="idle.rlo")

    (folder / "wedge.obj").write_text(wedge.format(30), encoding="utf-8")
    text = _run(folder, *command, program="idle.rlo", status=3)

    assert "contains another sweep: settings.cell.fixtures.WEDGE is '" in text
    (folder / "wedge.obj").write_text(wedge.format(20), encoding="utf-8")
    (folder / "idle.rlo").write_text("BEGIN END.\n", encoding="utf-8")
    assert "settings.code is '" in _run(folder, *command, program="idle.rlo", status=3)


def test_failures_are_reported_for_people(folder: Path) -> None:
    text = _run(folder, "--physics", "--trials", "2", "--workers", "1", "--seed", "5", program="idle.rlo")
    assert "0 of 2 trials succeed: 0.0%" in text
    assert "--seed 5 --trial 1" in text
    alone = _run(folder, "--physics", "--trial", "1", "--seed", "5", program="idle.rlo")
    assert "trial 1: misplaced: BLOCK is" in alone


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--trials", "2"), "--physics"),
        (("--physics", "--trials", "2", "--trial", "1"), "either --trials or --trial"),
        (("--physics", "--trials", "0"), "greater than or equal to 1"),
    ],
)
def test_mistakes(folder: Path, arguments: tuple[str, ...], words: str) -> None:
    assert words in " ".join(_run(folder, *arguments, status=2).split())


def test_a_cell_without_a_goal_is_refused(folder: Path) -> None:
    (folder / "bench.toml").write_text(bench_text(), encoding="utf-8")
    text = _run(folder, "--physics", "--trials", "2", status=2)
    assert "does not say what success is" in " ".join(text.replace("│", " ").split())
