"""A run that gets a signal at any moment of its life: old results or new ones, and a mix is always named."""

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import attrs
import numpy as np
import pytest
from typer.testing import CliRunner

from armwright.cli.app import app
from armwright.files.output import RECORD, is_stray, stray_files
from armwright.files.result_folder import PREFIX
from samples import Sample

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

EXAMPLES = Path(__file__).parents[2] / "examples"
# Whose results a folder holds.
OLD, NEW, MIX = "old", "new", "mix"
# What a run makes as it begins to write, and before it moves its files to their place, which takes so long [s].
WRITES, MOVES, MOVING = f"{PREFIX}*", f"{PREFIX}*/new/{RECORD}", 0.004


@attrs.define
class Bench:
    """What all runs of this module share.

    Attributes:
        before: results of another command, with files that a run does not write.
        run: the arguments of the run, without the folder.
        life: how long the last run lived that came to its end [s].
        writing: how long it lived from the first thing that it wrote [s].
    """

    before: Path
    run: tuple[str, ...]
    life: float
    writing: float

    def start(self, out: Path) -> "subprocess.Popen[str]":
        """Start a run into a folder."""
        command = [sys.executable, "-m", "armwright", *self.run, "-o", str(out)]
        return subprocess.Popen(
            command,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=hear_signals,  # noqa: PLW1509 - it takes no lock
        )

    def again(self, out: Path) -> None:
        """Run once more, in this process and undisturbed."""
        done = CliRunner().invoke(app, [*self.run, "-o", str(out)])
        assert done.exit_code == 0, done.output


def hear_signals() -> None:
    """Undo what whoever started the tests may have made deaf, such as `nohup`."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """Make older results, and measure an undisturbed run."""
    folder = tmp_path_factory.mktemp("struck")
    before, program = folder / "before", folder / "new.rlo"
    program.write_text('BEGIN PAUSE 3 ; PRINT ("new") ; END.')
    measured = str(EXAMPLES / "measured_poses.csv")
    assert CliRunner().invoke(app, ["iso9283", measured, "-o", str(before)]).exit_code == 0
    told = Bench(before, ("run", str(program), "--cell", str(EXAMPLES / "stanford_cell.toml")), 0.0, 0.0)
    told.again(folder / "warm")
    began = time.monotonic()
    with told.start(folder / "whole") as running:
        until(running, folder, WRITES)
        writes = time.monotonic()
        assert running.wait(timeout=300) == 0
    told.life, told.writing = time.monotonic() - began, time.monotonic() - writes
    return told


def until(running: "subprocess.Popen[str]", parent: Path, what: str) -> None:
    """Wait until a run has made what is asked for beside its folder, or has ended."""
    while running.poll() is None and not any(parent.glob(what)):
        time.sleep(0.0002)


def struck(bench: Bench, out: Path, number: signal.Signals, rng: np.random.Generator) -> tuple[int, str]:
    """Strike a run at any moment of its life, or while it writes or moves; return its status and its last words."""
    began = time.monotonic()
    with bench.start(out) as running:
        after, during = (("", bench.life), (WRITES, bench.writing), (MOVES, MOVING))[rng.integers(3)]
        if after:
            until(running, out.parent, after)
        with contextlib.suppress(subprocess.TimeoutExpired):
            running.wait(timeout=rng.uniform(0.0, during))
            bench.life = time.monotonic() - began
        running.send_signal(number)
        _, said = running.communicate(timeout=300)
    return running.returncode, said


def held(out: Path) -> str:
    """Say whose results a folder holds: a mix is told by its hashes alone."""
    if stray_files(out):
        return MIX
    said = json.loads((out / RECORD).read_text())
    assert {path.name for path in out.iterdir()} == {*said["files"], RECORD, "mine.txt"}
    return NEW if "motion.csv" in said["files"] else OLD


def with_old_results(bench: Bench, out: Path) -> None:
    """Put older results into a folder, with a file of somebody's own."""
    shutil.copytree(bench.before, out)
    (out / "mine.txt").write_text("mine")
    assert held(out) == OLD


@pytest.mark.share(0.04)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP], ids=lambda number: number.name)
@pytest.mark.drawn(0.34)
def test_signal_leaves_old_or_new_results(number: signal.Signals, bench: Bench, sample: Sample, tmp_path: Path) -> None:
    """A signal leaves the old results or the new ones, and says truly which; the next run leaves nothing else."""
    found = {OLD: 0, NEW: 0}
    silent = 0
    for case, rng in enumerate(sample.cases(50)):
        out = tmp_path / str(case) / "out"
        with_old_results(bench, out)

        status, said = struck(bench, out, number, rng)

        now = held(out)
        found[now] += 1
        # Before the commands are there to hear it a signal ends the process without a word.
        silent += status in (1, -number)
        # Python itself is not started yet: it dies of SIGINT with words and a status of its own.
        unborn = status == 1 and said.startswith("Fatal Python error: init_import_site")
        assert status in (0, 128 + number, -number) or unborn, said
        assert "armwright/cli" not in said, said
        words = {OLD: "nothing was written", NEW: f"the results are written: '{out}'"}
        assert said == (f"armwright: interrupted; {words[now]}\n" if status == 128 + number else said if status else "")
        assert now == NEW or status
        bench.again(out)
        assert held(out) == NEW
        assert [path.name for path in out.parent.iterdir()] == ["out"]
    sample.record(
        f"{number.name} at a whole run", sum(found.values()), 0, worst=f"{found}, {silent} before its imports"
    )


@pytest.mark.share(0.04)
def test_kill_leaves_named_mixes_at_most(bench: Bench, sample: Sample, tmp_path: Path) -> None:
    """SIGKILL leaves old results, new ones, or a mix whose every file is named; the next run clears up."""
    found = {OLD: 0, NEW: 0, MIX: 0}
    for case, rng in enumerate(sample.cases(50)):
        out = tmp_path / str(case) / "out"
        with_old_results(bench, out)

        struck(bench, out, signal.SIGKILL, rng)

        now = held(out)
        found[now] += 1
        if now == MIX:
            assert_named(out)
        bench.again(out)
        assert held(out) == NEW
        assert [path.name for path in out.parent.iterdir()] == ["out"]
    sample.record("SIGKILL at a whole run", sum(found.values()), 0, worst=f"{found}, all mixes named")


def assert_named(out: Path) -> None:
    """Whoever reads a file of a mix is told, unless it is one of the run that the record speaks of."""
    told = json.loads((out / RECORD).read_text())["files"]
    for path in out.iterdir():
        if path.name not in (RECORD, "mine.txt") and path.name not in told:
            assert is_stray(path)


def test_next_run_removes_leftovers(bench: Bench, tmp_path: Path) -> None:
    """What several killed runs have left beside a folder, in it or half removed is gone after the next run."""
    out = tmp_path / "out"
    with_old_results(bench, out)
    for _ in range(3):
        with bench.start(out) as running:
            until(running, tmp_path, WRITES)
            # It is stopped for good as soon as something of it is there.
            running.kill()
        shutil.copytree(next(iter(tmp_path.glob(f"{PREFIX}*"))), tmp_path / f"{PREFIX}{os.urandom(8).hex()}")
    empty, locked = tmp_path / f"{PREFIX}{'0' * 16}", out / f"{PREFIX}{'1' * 16}"
    empty.mkdir()
    (locked / "new").mkdir(parents=True)
    (locked / "lock").touch()
    assert len(list(tmp_path.glob(f"{PREFIX}*"))) >= 4

    bench.again(out)

    assert held(out) == NEW
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def _code(bench: Bench, to: Path) -> list[str]:
    return ["code", *bench.run[1:], "-o", str(to)]


def _convert(_bench: Bench, to: Path) -> list[str]:
    return ["convert", "puma560", "-o", str(to)]


def _plan_poses(_bench: Bench, to: Path) -> list[str]:
    return ["plan-poses", "puma560", "-n", "12", "-o", str(to)]


@pytest.mark.parametrize(("call", "name"), [(_code, "x.rlc"), (_convert, "x.urdf"), (_plan_poses, "x.csv")])
def test_single_files_remove_leftovers(
    call: Callable[[Bench, Path], list[str]], name: str, bench: Bench, tmp_path: Path
) -> None:
    """Beside a single file that is written, what a killed process has left goes as well."""
    to = tmp_path / name
    for left in ("0" * 16, "1" * 16):
        (tmp_path / f"{PREFIX}{left}" / "new").mkdir(parents=True)
        (tmp_path / f"{PREFIX}{left}" / "lock").touch()
        (tmp_path / f"{PREFIX}{left}" / "new" / name).write_text("half")

    done = CliRunner().invoke(app, call(bench, to))

    assert done.exit_code == 0, done.output
    assert [path.name for path in tmp_path.iterdir()] == [name]
