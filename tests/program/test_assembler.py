"""The text form of intermediate code: there and back, run from it, and refused where it makes no sense."""

import re
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from armwright.cell.simulator import Simulator
from armwright.errors import FileFormatError
from armwright.program import Source, compile as translate, known_cell
from armwright.program.bytecode.assembler import assemble, assembly
from armwright.program.bytecode.instructions import Code, listing
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.machine import RunError
from program.running import cell_of, code_of, corpus_text
from program.shelf import ACCEPTED, cell_of as told_cell

CELLS = {"p07": "jam", "p08": "cell2"}
PROGRAMS = [f"p0{number}" for number in range(1, 9)]


def corpus_code(name: str) -> Code:
    return code_of(corpus_text(name), cell_of(CELLS.get(name, "cell1")))


@pytest.mark.parametrize("name", PROGRAMS)
def test_there_and_back(name: str) -> None:
    """Code that is written out and read back is the same code, and its text the same text."""
    code = corpus_code(name)
    again = assemble(assembly(code))

    assert again == code
    bare = [re.sub(r" *; .*", "", row) for row in assembly(code).split("\nsource\n")[0].split("\n")]
    assert assembly(again).split("\nsource\n")[0].split("\n")[1:] == bare[1:]
    assert re.sub(r" *; .*", "", listing(code)) == listing(again)


@pytest.mark.parametrize("path", ACCEPTED, ids=lambda path: path.stem)
def test_every_accepted_program(path: Path) -> None:
    """Whatever the translator can make is read back."""
    text = path.read_text(encoding="utf-8")
    code = translate(Source(path.name, text), told_cell(text)).code
    if code is not None:
        assert assemble(assembly(code)) == code


@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.drawn(0.4)
def test_run_from_code(name: str) -> None:
    """A run from re-read code has the trace and the joint positions of the run from the program."""
    cell = cell_of(CELLS.get(name, "cell1"))
    code = code_of(corpus_text(name), cell)
    first = interpret(code, cell, Simulator(cell))
    second = interpret(assemble(assembly(code)), cell, Simulator(cell))

    assert second.trace() == first.trace()
    for one, other in zip(first.streams, second.streams, strict=True):
        assert one.q.tobytes() == other.q.tobytes()


def test_messages_from_code() -> None:
    """What goes wrong in a run from code is shown in the program, line and word."""
    cell = cell_of("cell1")
    text = "VAR f : FRAME ;\r\nBEGIN\r\n  f = WORLD * XYZ(9, 0, 0) ; { \u00e9\\ }\r\n  MOVE ARM_1 TO f\r\nEND."
    code = code_of(text, cell)
    again = assemble(assembly(code))
    assert again.source.text == text
    with pytest.raises(RunError) as caught:
        interpret(again, cell, Simulator(cell))

    assert again.source.slice(caught.value.diagnostic.span) == "MOVE ARM_1 TO f"


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("LOADM ", "LODM  ", "unknown operation 'LODM'; did you mean 'LOADM'?"),
        ("\ncode\n", "\ncods\n", "unknown word 'cods'; did you mean 'code'?"),
        ("0001 ", "0007 ", "expected instruction 0001"),
        ("var T1 TRANS", "var T1 TRUNK", "unknown type 'TRUNK'"),
        ("AFFIX  OBJ1 STATION", "AFFIX  OBJ1", "the operands of AFFIX have wrong kinds or a wrong number"),
        ("LOADM  STATION c0", "LOADM  STATION c9", "there is no constant c9"),
        ("MVSPD  100.0", "MVSPD  1e999", "expected an operand, got '1e999'"),
        ("constant c0 ", "constant c1 ", "expected c0"),
        ("constant c0 ", "constant\nconstant c0 ", "expected c0 and 1 or 12 numbers"),
        ("units M DEG", "units FOOT", "unknown unit 'FOOT'"),
        ("\nsource\n", "\n", "the program text is missing"),
        ("STOP", "OPEN   ARM_1", "continue after the last instruction"),
        ('program "test.rlo"', "program test", 'expected text in ""'),
        ('program "test.rlo"', f"program {'[' * 100_000}", 'expected text in "", got'),
    ],
)
def test_refused(old: str, new: str, says: str) -> None:
    """Code that could not be run is refused, with the number of the line and the nearest word."""
    text = assembly(corpus_code("p02"))
    assert old in text
    with pytest.raises(FileFormatError, match=re.escape(says)) as caught:
        assemble(text.replace(old, new, 1), "bench.rlc")

    assert re.match(r"bench\.rlc:\d+: ", str(caught.value))
    assert len(str(caught.value)) < 200


@given(st.data())
def test_any_change_of_a_text(data: st.DataObject) -> None:
    """A text with any characters put in or taken out is read, or refused with a message."""
    text = assembly(corpus_code("p07"))
    start = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(start, min(len(text), start + 20)))
    changed = text[:start] + data.draw(st.text(max_size=8)) + text[end:]
    try:
        code = assemble(changed)
    except FileFormatError:
        return
    assert assemble(assembly(code)) == code


def test_known_cell_is_not_needed() -> None:
    """Code holds no cell: the same code is run in any cell that has its arms."""
    code = corpus_code("p04")

    assert known_cell(cell_of("cell2")).arms > {"ARM_1"}
    assert interpret(code, cell_of("cell2"), Simulator(cell_of("cell2"))).trace()
