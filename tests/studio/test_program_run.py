"""A run that is shown at the pace of a clock: what a user does refers to what is shown, whoever computes it."""

import time
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from armwright.cell.hardware import HardwareFactory
from armwright.cell.reader import read_cell
from armwright.errors import UnknownNameError
from armwright.physics.kinematic_cell import kinematic_cell
from armwright.physics.world import PhysicsCell
from armwright.program.api import compile as compile_program, run
from armwright.program.debugger.debugger import DebuggerError
from armwright.program.language.source import Source
from armwright.studio.program_run import ProgramRun
from samples import Sample

EXAMPLES = Path(__file__).parents[2] / "examples"
CELL = read_cell(EXAMPLES / "puma_cell.toml")
PROGRAM = """VAR n : SCALAR ;
BEGIN
  n = 1 ;
  MOVE ARM_1 TO ARM_1 * XYZ(0, 0, -0.1) ;
  n = 2 ;
  MOVE ARM_1 TO ARM_1 * XYZ(0.1, 0, 0) ;
  n = 3
END.
"""
CODE = compile_program(Source("p.rlo", PROGRAM), CELL).code
assert CODE is not None


@pytest.fixture(params=["here", "beside"])
def executor(request: pytest.FixtureRequest) -> Iterator[Executor | None]:
    """Who computes the run: whoever shows it, or another thread."""
    if request.param == "here":
        yield None
        return
    with ThreadPoolExecutor(1) as pool:
        yield pool


def shown(executor: Executor | None, lines: tuple[int, ...] = ()) -> ProgramRun:
    it = ProgramRun(CODE, CELL, kinematic_cell, lines, executor)
    it.begin(stop_on_entry=False)
    return it


def go_by(it: ProgramRun, seconds: float) -> None:
    """Let time go by that is shown, and what is computed be finished."""
    for _ in range(round(seconds / 0.02)):
        it.tick(0.02)
        if it._executor is not None:
            time.sleep(0.002)
    for _ in range(500):
        if it._computing is None and not it._commands:
            break
        time.sleep(0.002)
        it.tick(0.0)


def until(it: ProgramRun, seconds: float) -> None:
    """Let time go by until a time is shown [s]."""
    while it.time < seconds:
        it.tick(0.02)
        time.sleep(0.001)


def value(it: ProgramRun) -> str:
    return next(row["value"] for row in it.state()["variables"] if row["name"] == "n")


def test_a_pause_is_where_it_is_shown(executor: Executor | None) -> None:
    """The program stands where it is shown, with the values of then, and goes on from there as if nothing had been."""
    it = shown(executor)
    until(it, 0.5)
    q, at = it.motion("ARM_1")[0], it.time
    it.pause()
    go_by(it, 0.1)
    assert it.time == at
    assert (it.state()["reason"], value(it)) == ("pause", "1")
    assert it.lines()[0]["line"] == 4
    np.testing.assert_allclose(it.motion("ARM_1")[0], q, atol=1e-12)
    it.go("continue")
    go_by(it, 10.0)
    assert it.state()["reason"] == "end"
    alone = run(Source("p.rlo", PROGRAM), CELL)
    np.testing.assert_allclose(it.motion("ARM_1")[0], alone.streams[0].q[-1], atol=1e-12)
    assert it.time == pytest.approx(alone.duration, abs=1e-9)


def test_a_step_begins_at_what_is_shown(executor: Executor | None) -> None:
    """In the middle of the first MOVE a step leads to its end, and one back to its beginning."""
    it = shown(executor)
    until(it, 0.5)
    it.go("back")
    go_by(it, 0.1)
    assert (it.time, it.lines()[0]["line"]) == (pytest.approx(0.0, abs=1e-9), 4)
    it.go("continue")
    until(it, 0.4)
    it.pause()
    go_by(it, 0.1)
    paused = it.time
    it.go("next")
    go_by(it, 5.0)
    assert (it.lines()[0]["line"], value(it)) == (5, "1")
    assert paused < it.time < 3.0
    with pytest.raises(UnknownNameError, match="no process"):
        it.go("next", "branch 7")


def test_a_breakpoint_counts_from_what_is_shown_on(executor: Executor | None) -> None:
    """A breakpoint in front of what the program has long done, but has not been shown, is come to."""
    it = shown(executor)
    until(it, 0.3)
    it.set_breakpoints([5])
    go_by(it, 6.0)
    assert (it.state()["reason"], it.lines()[0]["line"], value(it)) == ("breakpoint", 5, "1")


def commanded(it: ProgramRun, rng: np.random.Generator) -> None:
    """Give a command, or none."""
    match rng.integers(0, 12):
        case 0:
            it.pause()
        case 1:
            it.go("continue")
        case 2:
            it.go(rng.choice(["back", "next", "stage", "tick"]))
        case 3:
            it.set_breakpoints(rng.choice([3, 4, 5, 6], size=rng.integers(0, 3), replace=False).tolist())


def to_its_end(it: ProgramRun) -> None:
    """Let a run go on until it ends."""
    it.set_breakpoints([])
    for _ in range(40):
        go_by(it, 0.6)
        if it.state()["ended"]:
            return
        if not it.playing:
            it.go("continue")
    raise AssertionError(f"it does not end: {it.state()}")


@pytest.mark.parametrize("hardware", [kinematic_cell, PhysicsCell])
def test_any_commands(sample: Sample, hardware: HardwareFactory) -> None:
    """Whatever is asked for in any order, what is shown goes on steadily, and the run ends as by itself."""
    alone = run(Source("p.rlo", PROGRAM), CELL, hardware=hardware)
    fastest = float(np.max(CELL.arms["ARM_1"].arm.limits.speed))
    for rng in sample.cases(20):
        with ThreadPoolExecutor(1) as pool:
            it = ProgramRun(CODE, CELL, hardware, (), pool)
            it.begin(stop_on_entry=False)
            q, at = it.motion("ARM_1")[0], 0.0
            for _ in range(100):
                # A program that has ended takes only steps back.
                with suppress(DebuggerError):
                    commanded(it, rng)
                    it.tick(float(rng.uniform(0.0, 0.05)))
                it.state()
                now = it.motion("ARM_1")[0]
                assert np.abs(now - q).max() <= fastest * abs(it.time - at) + 1e-6
                if (measured := it.measured("ARM_1")) is not None:
                    assert np.isfinite(measured.q).all()
                q, at = now, it.time
                time.sleep(0.001)
            to_its_end(it)
            np.testing.assert_allclose(it.motion("ARM_1")[0], alone.streams[0].q[-1], atol=1e-12)
