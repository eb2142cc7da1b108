"""Programs run in small cells, for tests."""

from pathlib import Path

import numpy as np

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.cell.simulator import Simulator
from armwright.program import Source, compile as translate, known_cell
from armwright.program.bytecode.instructions import Code
from armwright.program.language.words import Standard
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.machine import Limits, RunError
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
