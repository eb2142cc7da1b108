"""Programs run in small cells, for tests."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.cell.simulator import Simulator
from armwright.dynamics import inverse_dynamics
from armwright.kinematics import forward
from armwright.motion.limited import limited_efforts, limited_positions
from armwright.program import Source, compile as translate, known_cell
from armwright.program.bytecode.instructions import Code
from armwright.program.language.words import Standard
from armwright.program.vm.interpreter import advance, interpret, next_process
from armwright.program.vm.machine import Limits, Machine, RunError
from armwright.program.vm.recording import Recording
from armwright.spatial.poses import homogeneous

CORPUS = Path(__file__).parent / "corpus"
EXACT = 1e-6  # the corpus gives positions to this
DOWN = np.diag((1.0, -1.0, -1.0))


def cell_of(name: str) -> Cell:
    """Return one of the cells of the corpus: cell1, cell2, jam, seat."""
    return read_cell(CORPUS / f"{name}.json")


def code_of(text: str, cell: Cell, *, std: Standard = Standard.RLO_2) -> Code:
    """Translate a program that has no errors."""
    compiled = translate(Source("test.rlo", text), known_cell(cell), std=std)
    assert compiled.code is not None, [(one.code, one.message) for one in compiled.diagnostics]
    return compiled.code


def run(text: str, cell: Cell | None = None, limits: Limits | None = None) -> Recording:
    """Run a program that has no errors."""
    cell = cell or cell_of("cell1")
    return interpret(code_of(text, cell), cell, Simulator(cell), limits=limits)


def failure(text: str, cell: Cell | None = None, limits: Limits | None = None) -> RunError:
    """Run a program that fails on the way; return how."""
    try:
        run(text, cell, limits)
    except RunError as error:
        return error
    raise AssertionError("nothing went wrong")


def tool_positions(recording: Recording) -> Array:
    """Return the positions (k, 3) of the tool of the only arm at the ticks."""
    placed = recording.cell.arms["ARM_1"]
    return np.asarray((placed.base @ forward(placed.arm, recording.streams[0].q))[:, :3, 3])


def check_ticks(recording: Recording) -> None:
    """Positions, speeds, accelerations and efforts keep their limits at every tick; speeds do not jump."""
    arm, (stream,) = recording.cell.arms["ARM_1"].arm, recording.streams
    limits, period = arm.all_limits, recording.cell.period
    assert ((stream.q >= arm.limits.lower) & (stream.q <= arm.limits.upper)).all()
    speeds = limited_positions(arm, stream.qd)
    assert (np.abs(speeds) <= limits.speed * (1 + 1e-6)).all()
    assert (np.abs(limited_positions(arm, stream.qdd)) <= limits.acceleration * (1 + 1e-6)).all()
    for qd, acceleration in ((speeds, limits.acceleration), (stream.qd, arm.limits.acceleration)):
        assert (np.abs(np.diff(qd, axis=0)) / period <= acceleration * (1 + 1e-3) + 1e-6).all()
    tau = inverse_dynamics(arm, stream.q, stream.qd, stream.qdd)
    assert (np.abs(limited_efforts(arm, tau)) <= limits.effort * (1 + 1e-3)).all()


def check_going_back(text: str, cell: Cell, is_there: Callable[[Machine], bool]) -> None:
    """A copy of a machine that has come to a state goes on as the machine itself does."""
    machine = Machine(code_of(text, cell), cell, Simulator(cell))
    while not is_there(machine):
        advance(machine, next_process(machine))
    copied = machine.copy()
    for one in (machine, copied):
        while not one.state.has_ended:
            advance(one, next_process(one))
    assert np.array_equal(machine.recording().streams[0].q, copied.recording().streams[0].q)


def corpus_text(name: str) -> str:
    """Return a program of the corpus."""
    return (CORPUS / f"{name}.rlo").read_text(encoding="utf-8")


def down(x: float, y: float, z: float) -> Array:
    """Return a place from above."""
    return homogeneous(DOWN, (x, y, z))


def expect(recording: Recording, **frames: Array) -> None:
    """Check where frames are at the end."""
    for name, X in frames.items():
        np.testing.assert_allclose(recording.tree.world(name), X, atol=EXACT, err_msg=name)


def printed(recording: Recording) -> list[str]:
    """Return the lines that a program printed."""
    return [str(effect.data["printed"]) for effect in recording.effects if effect.kind == "PRINT"]
