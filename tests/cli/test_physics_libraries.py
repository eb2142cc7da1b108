"""What cells with physics need beside the core: told in a line where it is missing, imported only where it is used."""

import ctypes
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from armwright.errors import ExitStatus, MissingExtraError
from cli_calls import armwright
from oracles.benches import PROGRAM, bench_text

ONE_ARM = 'name = "one"\n[arms.ARM_1]\nhand = [1,0,0, 0,-1,0, 0,0,-1, 0.45,0,0.25]\n'
TWO_ARMS = f"{ONE_ARM}[arms.ARM_2]\nbase = [1,0,0, 0,1,0, 0,0,1, 0,3,0]\nhand = [1,0,0, 0,-1,0, 0,0,-1, 0.45,3,0.25]\n"
MOVE = "VAR a : FRAME ;\nBEGIN\n  a = (1,0,0, 0,-1,0, 0,0,-1, 0.45,0.1,0.25) ;\n  MOVE ARM_1 TO a ;\nEND.\n"
TRIALS = ["--trials", "2", "--workers", "1"]
# Runs command lines, and says after each which engines have been imported so far.
SCRIPT = """import json, sys
from armwright.cli.app import main
for arguments in json.loads(sys.argv[1]):
    sys.argv = ["armwright", *arguments]
    try:
        main()
    except SystemExit as status:
        assert not status.code, status.code
    print([name for name in ("mujoco", "cv2", "OpenGL") if name in sys.modules], file=sys.stderr)
"""


def written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def bench_without_pictures() -> str:
    text = bench_text()
    return text.replace("width = 640\nheight = 480\nfovy_deg = 42\n", "")


@pytest.fixture
def call(tmp_path: Path) -> list[str | Path]:
    """A run of a program that looks for a block by a camera."""
    goal = '[trials]\ngoal = { BLOCK = { at = "SLOT", mm = 2, deg = 3 } }\n'
    cell = written(tmp_path, "cell.toml", bench_text() + goal)
    return ["run", written(tmp_path, "p.rlo", PROGRAM), "--cell", cell]


def one_line(arguments: list[str | Path]) -> str:
    """The line that a call leaves that fails because something is missing."""
    done = armwright(*arguments, columns=1000)
    assert done.returncode == MissingExtraError.exit_status
    assert len(done.stderr.splitlines()) == 1, done.stderr
    return done.stderr


@pytest.mark.parametrize("physics", [[], ["--physics"], ["--physics", *TRIALS]])
def test_without_mujoco(physics: list[str], call: list[str | Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """A cell with a scene needs MuJoCo, with physics or without."""
    monkeypatch.setitem(sys.modules, "mujoco", None)

    assert "MuJoCo cannot be loaded" in one_line([*call, *physics])


@pytest.mark.parametrize("trials", [[], TRIALS])
def test_without_opencv(trials: list[str], call: list[str | Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures need OpenCV; without physics there are none."""
    monkeypatch.setitem(sys.modules, "cv2", None)

    line = one_line([*call, "--physics", *trials])
    assert "needs opencv-python-headless; install it by: pip install 'armwright[physics]'" in line
    assert armwright(*call).returncode == ExitStatus.DONE


def test_without_opengl(call: list[str | Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures need a library of the system that draws them."""
    pytest.importorskip("cv2")
    there = ctypes.CDLL

    def load(name: str, *arguments: object, **options: object) -> object:
        if name and ("EGL" in str(name) or "OSMesa" in str(name)):
            raise OSError(f"{name}: cannot open shared object file")
        return there(name, *arguments, **options)

    monkeypatch.setattr(ctypes, "CDLL", load)
    monkeypatch.delenv("MUJOCO_GL", raising=False)

    assert "apt-get install libegl1 libgl1" in one_line([*call, "--physics"])


def test_what_is_imported(tmp_path: Path) -> None:
    """MuJoCo is imported with a second arm, a scene or parts; OpenCV and OpenGL with pictures alone."""
    cases = [
        (ONE_ARM, MOVE),
        (TWO_ARMS, MOVE),
        (bench_text(), PROGRAM),
        (bench_without_pictures(), PROGRAM, "--physics"),
    ]
    calls = []
    for number, (cell, program, *options) in enumerate(cases):
        files = written(tmp_path, f"{number}.rlo", program), written(tmp_path, f"{number}.toml", cell)
        calls.append(["run", str(files[0]), "--cell", str(files[1]), *options])
    # MuJoCo itself loads the OpenGL that the environment names.
    environment = {name: value for name, value in os.environ.items() if name != "MUJOCO_GL"}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, json.dumps(calls)],
        capture_output=True,
        text=True,
        check=True,
        env={**environment, "PYTHONPATH": os.pathsep.join(sys.path)},
    )

    imported = [line for line in done.stderr.splitlines() if line.startswith("[")]
    assert imported == ["[]", "['mujoco']", "['mujoco']", "['mujoco']"]
