"""Every option and argument of every command with values that nobody means: a documented end, and never our fault."""

import json
import os
import shutil
import stat
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from functools import cache
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import typer.main

from armwright.cli.app import app
from armwright.errors import ExitStatus
from armwright.files.store import cache_folder
from files.logs_of_others import json_log, motion
from fork_server import fork_server
from identification.simulated import log, truth
from samples import Sample

pytestmark = pytest.mark.early

HERE = Path(__file__).parents[1]
EXAMPLES = HERE.parent / "examples"
Q = "10,-60,80,40,50,60"
# What most commands need.
LOADED = ("armwright.cli.app", "armwright.arm.load", "armwright.program.api", "armwright.cell.reader",
          "armwright.program.vm.interpreter", "armwright.report.run_files", "armwright.motion.moves",
          "armwright.clearance.reader", "armwright.compiled.arm", "rich.markdown")  # fmt: skip
# A server ends when it is told to [s].
_SERVED = 6.0
# By the words that call it: arguments with which a command does something small.
CALLS: dict[str, list[str]] = {
    "": ["arms", "--json"],
    "run": ["p.rlo", "--cell", "cell.toml", "-o", "out", "--json"],
    "check": ["p.rlo", "--cell", "cell.toml", "--json"],
    "export": ["ros2", "p.rlo", "--cell", "cell.toml", "-o", "out", "--json"],
    "explain": ["E206", "--json"],
    "repl": ["p.rlo", "--cell", "cell.toml", "--json"],
    "studio": ["cell.toml", "p.rlo"],
    "debug": ["p.rlo", "--cell", "cell.toml"],
    "fmt": ["p.rlo", "--json"],
    "fix": ["p.rlo", "--json"],
    "lsp": [],
    "code": ["p.rlo", "--cell", "cell.toml"],
    "arms": ["--json"],
    "show": ["ur5", "--json"],
    "convert": ["arm.urdf", "-o", "out.toml", "--json"],
    "forward": ["ur5", "-q", Q, "--json"],
    "inverse": ["ur5", "--xyz", "400,100,300", "--json"],
    "jacobian": ["ur5", "-q", Q, "--json"],
    "torque": ["puma560", "-q", Q, "--json"],
    "deflection": ["puma560", "--stiffness", "2e4", "-q", Q, "--json"],
    "singularity": ["ur5", "-q", Q, "--json"],
    "simulate": ["puma560", "-q", Q, "--duration", "0.01", "--json"],
    "move": ["joint", "puma560-seed", "poses.toml", "--no-film", "--json"],
    "replay": ["log.mcap", "--json"],
    "iso9283": ["measured.csv", "--json"],
    "calibrate": ["puma560-seed", "points.csv", "--folds", "2", "--json"],
    "calibrate-camera": ["corners.csv", "--size", "640x480", "--squares", "9x7", "--square-mm", "30", "--json"],
    "plan-poses": ["ur5", "-n", "16", "--json"],
    "plan-excitation": ["stanford", "--period", "2", "--harmonics", "3", "--json"],
    "identify": ["puma560", "efforts.csv", "--json"],
    "clearance": [],
    "clearance simulate": ["slider-crank", "--speed-rpm", "300", "--revolutions", "0.05", "--json"],
    "clearance sweep": ["five-bar", "-o", "out", "--paths", "x1", "-n", "2", "--workers", "1", "--json"],
    "clearance estimate": ["five-bar", "rest.csv", "--json"],
    "clearance correct": ["five-bar", "--path", "x1", "--rounds", "1", "--knots", "2", "--json"],
    "clearance wear": ["five-bar", "--path", "x1", "--k", "1e-5", "--steps", "1", "--json"],
    "clearance vibration": ["four-bar", "--speed-rpm", "6000", "--json"],
    "clearance compare": ["five-bar", "five-bar", "--cells", "3", "--json"],
    "clearance plan-checks": [
        "five-bar",
        "--path",
        "x1",
        "--k",
        "1e-4",
        "--limit",
        "0.5",
        "--horizon",
        "1e6",
        "--lives",
        "2",
        "--json",
    ],
    "clearance export": ["slider-crank", "--speed-rpm", "300", "--revolutions", "0.05", "-o", "out"],
    "clearance tolerance": [
        "five-bar",
        "bar_tolerances.toml",
        "--pose",
        "0,-575",
        "--limit",
        "0.1",
        "--samples",
        "2",
        "--json",
    ],
    "clearance reliability": ["five-bar", "--pose", "0,-575", "--limit", "0.6", "--samples", "20", "--json"],
    "tolerance": ["puma560", "tolerances.toml", "-q", Q, "--limit", "0.5", "--samples", "20", "--json"],
    "life": ["puma560", "efforts.csv", "life.toml", "--limit", "0.1", "--samples", "20", "--json"],
    "vibration": ["ur5", "-q", Q, "--stiffness", "1e4", "--json"],
    "study": ["stanford-torque", "--json"],
    "kernel": ["ur5", "forward", "--json"],
}
PROGRAM = """VAR there : FRAME ;
BEGIN
  there = (0,0,-1, 0,1,0, 1,0,0, 0.45,0.10,0.70) ;
  MOVE ARM_1 TO there ;
  PAUSE 0.01
END.
"""
# What is there when a command is called, beside a pipe and a device.
GIVEN = {
    "cell.toml": "puma_cell.toml",
    "arm.urdf": "seven_joints.urdf",
    "poses.toml": "puma_poses.toml",
    "measured.csv": "measured_poses.csv",
    "points.csv": "puma_points.csv",
    "corners.csv": "board_corners.csv",
    "rest.csv": "five_bar_rest.csv",
    "tolerances.toml": "puma_tolerances.toml",
    "bar_tolerances.toml": "five_bar_tolerances.toml",
    "life.toml": "puma_life.toml",
}
VALUES = [
    *("", " ", "-", "--", "-1", "0", "0.5", "1e-320", "1e999", "nan", "-inf", str(10**30), "9" * 5000, "1" * 99_999),
    *("1e-308", "1e-100", "1e9", "1e300"),
    *("1,2,3", "nan,0,0,0,0,0", "J1=", "J2=nan", "=", ",", "x1,x1", "a=b=c", "%s%n{0}", "[bold]x[/no]", "$(id)", "\\"),
    *(
        "ä\N{RIGHT-TO-LEFT OVERRIDE}\x85",
        "\x1b[31ma\x07\r\n\tb",
        os.fsdecode(b"\xff\xfe"),
        os.fsdecode(b"\xed\xa0\x80/x"),
    ),
    *("zero", "pipe", "folder", ".", "..", "~", "none.toml", "none/none.csv", "p.rlo", "cell.toml", "rest.csv"),
    *("zero.rlo", "arm.urdf", "out.svg", "folder/a.toml", "x" * 300),
]


class Case(NamedTuple):
    """One call: of a command, with one value for one of its parameters."""

    command: str
    parameter: str
    arguments: list[str]

    @property
    def has_pipe(self) -> bool:
        """Whether it reads from a pipe or writes to one."""
        return any(word == "pipe" or word.endswith("=pipe") for word in self.arguments)


Call = Callable[[Case], dict[str, Any]]


def commands() -> dict[str, Any]:
    """Return all commands by the words that call them, the program itself by none."""

    def below(command: Any, words: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
        yield " ".join(words), command
        for name, one in getattr(command, "commands", {}).items():
            yield from below(one, (*words, name))

    return dict(below(typer.main.get_command(app), ()))


def cases(name: str) -> list[Case]:
    """Return all calls of a command."""
    found, words = [], name.split()
    parameters = [one for one in commands()[name].params if one.name != "help"]
    places = [one for one in parameters if one.param_type_name == "argument"]
    for one in parameters:
        if one in places:
            rest, first = list(CALLS[name]), places.index(one)
            for value in VALUES:
                rest[first : first + 1] = [value]
                found.append(Case(name, one.name, [*words, *rest]))
            continue
        option = one.opts[-1]
        rest = _without(CALLS[name], one.opts, has_value=not one.is_flag)
        for value in [None] if one.is_flag else VALUES:
            given = [option] if value is None else [f"{option}={value}"] if option[:2] == "--" else [option, value]
            # Options of the program stand before its command.
            found.append(Case(name, one.name, [*words, *rest, *given] if words else [*given, *rest]))
    return found


def _without(arguments: list[str], option: list[str], *, has_value: bool) -> list[str]:
    """Return arguments without an option."""
    at = next((i for i, word in enumerate(arguments) if word in option), None)
    return arguments if at is None else arguments[:at] + arguments[at + 1 + has_value :]


def test_every_command_is_called() -> None:
    """Each command has a call that works, so that what is wrong is the one value that is not."""
    assert set(CALLS) == set(commands())


@pytest.fixture(scope="module")
def call(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Call]:
    """The command line, in children of one process; every call in a folder of its own."""
    base = tmp_path_factory.mktemp("walk")
    # Whose home is another folder finds what is compiled all the same.
    cache = {"ARMWRIGHT_CACHE": str(cache_folder() or base / "cache")}
    # What a command opens in a browser is opened by a program that does nothing.
    settings = {**cache, "BROWSER": "true", "COLUMNS": "120", "NO_COLOR": "1", "OPENBLAS_NUM_THREADS": "1"}
    folder = base / "around" / "here"
    with fork_server(LOADED, {**os.environ, **settings}) as server:

        def made(case: Case) -> dict[str, Any]:
            # What is written into `..` goes too.
            shutil.rmtree(folder.parent, ignore_errors=True)
            folder.mkdir(parents=True)
            _fill(folder)
            with other_end(folder / "pipe", read=case.parameter == "output") if case.has_pipe else nullcontext():
                ends = {"terminated": _SERVED} if case.command == "studio" else {}
                answer = server.call(folder, base, arguments=case.arguments, **ends)
            answer["left"] = [path.name for path in folder.parent.rglob(".armwright-*")]
            return answer

        yield made


def _fill(folder: Path) -> None:
    """Put into a folder what commands can be told of."""
    for name, example in GIVEN.items():
        shutil.copy(EXAMPLES / example, folder / name)
    (folder / "p.rlo").write_text(PROGRAM)
    (folder / "efforts.csv").write_text(_efforts())
    times = np.arange(0, 1, 0.02)
    json_log(folder / "log.mcap", times, motion(times))
    (folder / "folder").mkdir()
    os.mkfifo(folder / "pipe")
    for name in ("zero", "zero.rlo"):
        # One of our own where that is allowed, so that no defect can harm that of the machine.
        try:
            os.mknod(folder / name, stat.S_IFCHR | 0o666, os.makedev(1, 5))
        except PermissionError:
            (folder / name).symlink_to("/dev/zero")


@cache
def _efforts() -> str:
    """Return a log of efforts, from which an arm can be identified."""
    readings = log(truth(), np.random.default_rng(3), seconds=8.0)
    heads = ["time_s", *(f"joint_{i}_deg" for i in range(1, 7)), *(f"tau{i}" for i in range(1, 7))]
    rows = np.column_stack([readings.t, np.degrees(readings.q), readings.effort])
    text = StringIO()
    np.savetxt(text, rows, delimiter=",", header=",".join(heads), comments="", fmt="%.9g")
    return text.getvalue()


@contextmanager
def other_end(pipe: Path, *, read: bool) -> Iterator[None]:
    """Let somebody write into a pipe, or read from it."""
    done = f'while :; do {"cat <" if read else "echo 1,2 >"} "{pipe}" ; done'
    with subprocess.Popen(["sh", "-c", done], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as helper:
        try:
            yield
        finally:
            helper.kill()
            with suppress(OSError):  # it may wait for the pipe to be opened
                os.close(os.open(pipe, os.O_RDWR | os.O_NONBLOCK))


def wrong_in(case: Case, answer: dict[str, Any]) -> str | None:
    """Return what is wrong with how a call ended; None where nothing is."""
    status, said = answer["status"], answer["out"] + answer["err"]
    documented = {int(one) for one in ExitStatus if one < ExitStatus.INTERNAL_ERROR}
    if status not in documented:
        return f"ended with {status}"
    if "Traceback" in said or "defect of armwright" in said:
        return "shows its inside"
    if answer["left"]:
        return f"leaves {answer['left']}"
    # After `--` it is the name of a file, and `--version` and `--help` are all that is done where they stand.
    options = case.arguments[: case.arguments.index("--")] if "--" in case.arguments else case.arguments
    asked = "--json" in options and not {"--version", "--help", "-h"} & set(options)
    if asked and status != ExitStatus.CHECK_FAILED:
        return wrong_as_json(status, answer["out"])
    return None


def wrong_as_json(status: int, out: str) -> str | None:
    """Return what is wrong with what a program reads along; None where nothing is."""
    try:
        rows = [json.loads(out)]
    except ValueError:
        try:
            rows = [json.loads(line) for line in out.splitlines()]
        except ValueError:
            return "is no JSON"
    rows = rows[0] if rows and isinstance(rows[0], list) else rows
    if status and max((row.get("exit_status", 0) for row in rows), default=0) != status:
        return f"ended with {status}, and its JSON does not say so"
    return None


@pytest.mark.share(0.005)
@pytest.mark.parametrize("name", CALLS, ids=lambda name: name or "program")
@pytest.mark.drawn(0.4)
def test_any_value_of_any_parameter(name: str, sample: Sample, call: Call) -> None:
    """Whatever a command is given, it ends with a documented status; with --json in a document."""
    every = cases(name)
    if not every:
        return
    order = np.random.default_rng(sample.seed).permutation(len(every))
    wrong: list[str] = []
    for _ in sample.cases(len(every)):
        case = every[order[sample.case]]
        answer = call(case)
        fault = wrong_in(case, answer)
        if fault:
            shown = [word if len(word) < 200 else f"{word[:50]}... ({len(word)})" for word in case.arguments]
            wrong.append(f"{shown}: {fault}: {answer['status']} {answer['out'][-500:]} {answer['err'][-500:]}")
    sample.record(f"armwright {name}", sample.count(len(every)), len(wrong))
    assert not wrong, "\n".join(wrong)
