"""``armwright export``."""

import json
from pathlib import Path

import pytest

from cli_calls import armwright
from export.cases import CELLS, EXAMPLES

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

PALLETISE, UR5 = EXAMPLES / "palletise.rlo", CELLS["urscript"]
SHORT = "BEGIN MOVE ARM_1 TO ARM_1 * XYZ(0, 0, 0.05) END."
GUARDED = """VAR a : FRAME ;
BEGIN
  a = (1,0,0, 0,-1,0, 0,0,-1, 0.45,-0.10,0.20) ;
  MOVE ARM_1 TO a STRAIGHTLY, ON DIST(ARM_1, a) < 0.05 DO HALT ;
END.
"""


@pytest.mark.parametrize(
    ("target", "cell", "files"),
    [
        ("urscript", "urscript", {"palletise.script"}),
        ("krl", "krl", {"palletise.src"}),
        ("rapid", "rapid", {"palletise.mod"}),
        ("fanuc", "fanuc", {"PALLETIS.ls"}),
        ("ros2", "urscript", {"ARM_1.trajectory.yaml", "ARM_1.goal.yaml", "events.json"}),
        ("csv", "urscript", {"ARM_1.csv", "events.json"}),
    ],
)
@pytest.mark.drawn(0.34)
def test_files_of_each_target(target: str, cell: str, files: set[str], tmp_path: Path) -> None:
    """The folder has the files of the target, their proof and the record of the command."""
    done = armwright("export", target, PALLETISE, "--cell", CELLS[cell], "--mode", "plan", "-o", tmp_path / "out")

    assert (done.returncode, done.stderr) == (0, "")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {*files, "proof.json", "run.json"}
    proof = json.loads((tmp_path / "out" / "proof.json").read_text(encoding="utf-8"))
    assert proof["target"] == target
    assert all(one["passed"] and one["count"] >= 0 for one in proof["comparisons"])
    assert proof["approximations"]
    assert f"{target}: 2" in done.stdout
    assert all(f"wrote {tmp_path / 'out' / name}" in done.stdout for name in files)


def short(tmp_path: Path) -> Path:
    """A program with one MOVE."""
    path = tmp_path / "palletise.rlo"
    path.write_text(SHORT, encoding="utf-8")
    return path


def test_the_proof_alone(tmp_path: Path) -> None:
    """Without a folder only the proof is printed, as data with --json and not at all with --quiet."""
    program = short(tmp_path)
    done = armwright("export", "urscript", program, "--cell", UR5, "--json", cwd=tmp_path)
    data = json.loads(done.stdout)

    assert (done.returncode, data["exit_status"], data["target"]) == (0, 0, "urscript")
    assert "output" not in data
    assert armwright("export", "urscript", program, "--cell", UR5, "-q", cwd=tmp_path).stdout == ""
    assert list(tmp_path.iterdir()) == [program]


@pytest.mark.parametrize("target", ["urscript", "ros2", "csv"])
def test_what_cannot_be_exported_has_its_line(target: str, tmp_path: Path) -> None:
    """A guarded MOVE is refused with its line, its code and what to do, and nothing is written."""
    program = tmp_path / "guarded.rlo"
    program.write_text(GUARDED, encoding="utf-8")
    done = armwright("export", target, program, "--cell", UR5, "-o", tmp_path / "out")

    assert done.returncode == 3
    assert "error[E611]" in done.stdout
    assert "guarded.rlo:4:" in done.stdout
    assert "nothing was exported" in done.stderr
    assert not (tmp_path / "out").exists()
    data = json.loads(armwright("export", target, program, "--cell", UR5, "--json").stdout)
    assert (data["exit_status"], data["error"]["code"], data["error"]["line"]) == (3, "E611", 4)


def test_a_run_that_fails_is_not_exported(tmp_path: Path) -> None:
    """A program that fails in the cell says so, as `run` does."""
    program = tmp_path / "far.rlo"
    program.write_text("BEGIN MOVE ARM_1 TO ARM_1 * XYZ(5, 0, 0) END.", encoding="utf-8")
    done = armwright("export", "rapid", program, "--cell", CELLS["rapid"], "-o", tmp_path / "out")

    assert (done.returncode, "error[E401]" in done.stdout) == (3, True)
    assert not (tmp_path / "out").exists()


def test_mistakes_of_the_call(tmp_path: Path) -> None:
    """A target that does not exist, a missing cell and a program with errors have their own statuses."""
    wrong = tmp_path / "wrong.rlo"
    wrong.write_text("BEGIN MOVE END.", encoding="utf-8")

    assert armwright("export", "karel", PALLETISE, "--cell", UR5).returncode == 2
    done = armwright("export", "krl", PALLETISE)
    assert (done.returncode, "needs" in done.stderr) == (2, True)
    assert armwright("export", "krl", wrong, "--cell", UR5).returncode == 1
    assert armwright("export", "krl", PALLETISE, "--cell", tmp_path / "none.toml").returncode == 4


def test_programs_and_motions(tmp_path: Path) -> None:
    """A language of a controller gets the program by default, and the motion of the run by --mode plan."""
    program = tmp_path / "loop.rlo"
    loop = "CONST last = 9 ; VAR n : SCALAR ; BEGIN FOR n = 1 TO last DO MOVE ARM_1 TO ARM_1 * XYZ(0, 0, 0.01) END."
    program.write_text(loop, encoding="utf-8")
    for mode, words, loops in (((), "the program, run for", 1), (("--mode", "plan"), "s of motion", 0)):
        out = tmp_path / words.split()[0]
        done = armwright("export", "urscript", program, "--cell", UR5, "--arg", "last=3", *mode, "-o", out)
        assert (done.returncode, words in done.stdout) == (0, True)
        text = (out / "loop.script").read_text(encoding="ascii")
        assert (text.count("while "), "9" in "".join(line for line in text.splitlines() if "while " in line)) == (
            loops,
            False,
        )
    code = tmp_path / "loop.rlc"
    armwright("code", program, "--cell", UR5, "-o", code)
    done = armwright("export", "urscript", code, "--cell", UR5, "--mode", "program")
    assert (done.returncode, "intermediate code" in done.stderr) == (2, True)


def test_hostile_names_of_files(tmp_path: Path) -> None:
    """A program whose file has quotes and commands in its name becomes a program with a plain name."""
    program = tmp_path / "x\"); halt() #\n;END 'a.rlo"
    program.write_text(SHORT, encoding="utf-8")
    for target, cell in CELLS.items():
        done = armwright("export", target, program, "--cell", cell, "-o", tmp_path / target)

        assert done.returncode == 0
        (path,) = (path for path in (tmp_path / target).iterdir() if path.suffix not in (".json", ".dat"))
        assert path.stem == ("X_HALT_E" if target == "fanuc" else "x_halt_END_a")
        text = path.read_text(encoding="ascii")
        assert "'a" not in text
        assert "halt()" not in text


def test_older_files_go_and_others_stay(tmp_path: Path) -> None:
    """A second export takes the files of the first away, and leaves what it did not write."""
    out, program = tmp_path / "out", short(tmp_path)
    armwright("export", "urscript", program, "--cell", UR5, "-o", out)
    (out / "mine.src").write_text("DEF mine( )\nEND\n", encoding="utf-8")
    done = armwright("export", "ros2", program, "--cell", UR5, "-o", out)

    names = {path.name for path in out.iterdir()}
    assert done.returncode == 0
    assert names == {"mine.src", "ARM_1.trajectory.yaml", "ARM_1.goal.yaml", "events.json", "proof.json", "run.json"}


def test_nothing_of_the_user_is_overwritten(tmp_path: Path) -> None:
    """A program of the user with the name of an exported one stays, and nothing is written."""
    program, out = short(tmp_path), tmp_path / "out"
    out.mkdir()
    (out / "palletise.script").write_text("mine", encoding="utf-8")
    done = armwright("export", "urscript", program, "--cell", UR5, "-o", out)

    assert done.returncode == 4
    assert [path.name for path in out.iterdir()] == ["palletise.script"]
