"""Verified intermediate code: what the compiler makes passes, and what passes can be interpreted."""

import contextlib
import re
from pathlib import Path

import numpy as np
import pytest

from armwright.cell.simulator import Simulator
from armwright.errors import FileFormatError
from armwright.program import Source, compile as translate
from armwright.program.bytecode.assembler import assemble, assembly
from armwright.program.bytecode.instructions import Op
from armwright.program.bytecode.verifier import CodeError, Flow, State, Verifier
from armwright.program.bytecode.verify import apply_rule, verify
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.machine import Limits, RunError
from program.running import cell_of, code_of, corpus_text
from program.shelf import ACCEPTED, cell_of as told_cell
from samples import Sample

# Programs with each kind of statement in them.
TEXTS = {
    "loops": "VAR n, s : SCALAR ; a : ARRAY [3] OF SCALAR ; BEGIN s = 0 ; FOR n = 1 TO 3 DO a[n] = 2 * n ; "
    "WHILE s < 3 DO "
    "s = s + a[2] ; IF (s > 1) AND (n = 3) THEN PRINT (s) ELSE HALT END.",
    "processes": "VAR e : EVENT ; n : SCALAR ; BEGIN COBEGIN BEGIN WAIT e ; LOCK (n) DO n = 1 END ; "
    "BEGIN PAUSE 0.01 ; SIGNAL e END COEND ; PRINT (n) END.",
    "recovery": "VAR n : SCALAR ; f : FRAME ; BEGIN n = 0 ; TRY n = n + 1 ; f = WORLD * XYZ (9, 0, 0) ; "
    "IF n < 3 THEN MOVE ARM_1 TO f RECOVER IF n < 3 THEN RETRY ; PRINT (n) END END.",
    "calls": "PROCEDURE p (x : SCALAR, f : FRAME) ; VAR g : FRAME ; BEGIN g = f * XYZ (x, 0, 0) ; "
    "PRINT (DIST (f, g)) END ; BEGIN p (0.1, ARM_1) ; p (0.2, WORLD) END.",
    "guards": "VAR f : FRAME ; BEGIN f = ARM_1 * XYZ (0, 0, 0.02) ; AFFIX f TO WORLD ; "
    "MOVE ARM_1 TO f WITH SPEED = 20 ON (DIST (ARM_1, f) < 0.01) OR (FORCE (Z) > 5) DO HALT ; UNFIX f END.",
    "watches": "VAR n : SCALAR ; BEGIN n = 0 ; WHEN w : PRIORITY 2 : n > 1 DO BEGIN BRAKE ; n = 0 ; RESUME END ; "
    "WHEN w OFF ; MOVE ARM_1 TO ARM_1 * XYZ (0, 0, 0.02) END.",
}
LIMITS = Limits(steps=2000, depth=20, processes=20, time=5.0)


@pytest.mark.parametrize("path", ACCEPTED, ids=lambda path: path.stem)
def test_what_the_compiler_makes(path: Path) -> None:
    """Code of every accepted program can be interpreted."""
    text = path.read_text(encoding="utf-8")
    code = translate(Source(path.name, text), told_cell(text)).code
    if code is not None:
        verify(code)


@pytest.mark.parametrize(
    ("program", "old", "new", "fault"),
    [
        (
            "loops",
            r"JZ     %(\d+) @(\d+)",
            r"JZ     WORLD @\2",
            "JZ expects a truth value, but WORLD is a pose or a transformation",
        ),
        (
            "loops",
            r"MUL    (%\d+) \S+ (\S+)",
            r"MUL    \1 WORLD \2",
            "MUL expects two numbers, or two poses or transformations",
        ),
        ("loops", r"ELEM   (%\d+) A ", r"ELEM   \1 N ", "N is not an array of 1 dimension"),
        (
            "loops",
            r"ELEM   %\d+ A ",
            "ELEM   N A ",
            "ELEM expects a temporary such as %1 for its result, got N",
        ),
        (
            "guards",
            r"MVON   (@\d+) %\d+",
            r"MVON   \1 WORLD",
            "MVON expects a temporary such as %1 for the value of its condition, got WORLD",
        ),
        ("loops", r"STOP", "RET", "RET cannot end the program"),
        ("loops", r"STOP", "QUIT", "QUIT cannot end the program"),
        ("loops", r"STOP", "RETRY", "RETRY is outside of RECOVER"),
        ("processes", r"JOIN", "PAUSE  1.0", "expected FORKs and their JOIN without other instructions in between"),
        ("processes", r"UNLK   N", "UNLK   N N", "UNLK must release the variables of the last LOCK"),
        ("processes", r"WAIT   E", "WAIT   N", "WAIT expects the name of a variable of type EVENT, got N"),
        ("recovery", r"ENDR", "RET", "RET cannot end the program"),
        ("recovery", r"LOADS  N c\d", "ENDR", "ENDR has no RECOVER to end"),
        ("calls", r"CALL   P \S+ \S+", "CALL   P 1.0", "P has 2 parameters, got 1 argument"),
        ("calls", r"CALL   P", "CALL   Q", "there is no procedure Q"),
        ("calls", r"CALL   P \S+", "CALL   P WORLD", "CALL expects a number, but WORLD is a pose or a transformation"),
        ("guards", r"FORCE  (%\d+) Z", r"FORCE  \1 W", "FORCE expects the axis X, Y or Z, or MX, MY or MZ, got W"),
        ("guards", r"MVHLT", "QUIT", "QUIT cannot end an action"),
        ("watches", r"RESUME", "MVHLT", "MVHLT cannot end the action of a WHEN"),
        ("watches", r"DISARM @\d+", "DISARM @0000", "DISARM expects instructions WHEN"),
        ("watches", r"WHSET  W OFF", "WHSET  W N", "WHSET expects ON or OFF, got N"),
        ("guards", r"MVEND", "JOIN", "expected FORKs and their JOIN without other instructions in between"),
        ("guards", r"DIST   (%\d+)", r"PAUSE  1.0", "the operands of PAUSE have wrong kinds or a wrong number"),
    ],
)
def test_refused(program: str, old: str, new: str, fault: str) -> None:
    """Code that the virtual machine could not go through is refused, with the line and what is wrong."""
    text = assembly(code_of(TEXTS[program], cell_of("cell1")))
    changed, count = re.subn(old, new, text, count=1)
    assert count == 1, text
    with pytest.raises(FileFormatError, match=re.escape(fault)) as caught:
        assemble(changed, "x.rlc")

    assert re.match(r"x\.rlc:\d+: ", str(caught.value))


def _assembled(steps: list[str], *constants: str) -> str:
    """Return the text of intermediate code with one scalar, an array of scalars and three frames."""
    names = "".join(f"var {name}\n" for name in ("N SCALAR", "S ARRAY [3] OF SCALAR", "A FRAME", "B FRAME"))
    numbers = "".join(f"constant c{index} {value}\n" for index, value in enumerate(constants))
    code = "".join(f"{number:04d} 1:1+0! {step}\n" for number, step in enumerate(steps))
    return f'program "x.rlo"\nunits MM DEG\n{names}{numbers}code\n{code}source\n|\n'


def _ladder(rungs: int) -> str:
    """Return code with many jumps to one instruction, in front of each of which another value has been written."""
    below = 2 * rungs + 2
    climb = [step for rung in range(rungs) for step in (f"COPY %{rung} 1.0", f"JZ N @{below:04d}")]
    return _assembled(["COPY N 1.0", *climb, "STOP", *["COPY N 1.0"] * rungs, "STOP"])


def test_code_is_gone_through_once() -> None:
    """What many jumps lead to is followed once, however much is certain in front of each of them."""
    code = assemble(_ladder(200), "x.rlc")
    followed = []

    def rule(verifier: Verifier, state: State) -> Flow:
        followed.append(verifier.at)
        return apply_rule(verifier, state)

    Verifier(code, rule).follow()

    assert len(followed) <= 2 * len(code.instructions)


@pytest.mark.parametrize(
    ("steps", "fault"),
    [
        (["COPY N 1e101", "STOP"], "expected a number from -1e+100 to 1e+100, got 1e+101"),
        (['PRINT "\\ud800"', "STOP"], 'expected text in ""'),
        (["MVBEG A B", "MVSMO", "MVVIA A", "MVEND", "STOP"], "expected MVSMO without MVCIR, MVVIA, MVBLD"),
        (
            [*(f"TRY @{499 - n:04d}" for n in range(250)), *(f"ENDT @{n + 1:04d}" for n in range(250, 500)), "STOP"],
            "more than 200 instructions TRY are nested",
        ),
    ],
)
def test_beyond_what_can_be_run(steps: list[str], fault: str) -> None:
    """Numbers too large, half a character, MOVEs of no kind, and TRYs too deep are refused when code is read."""
    with pytest.raises(FileFormatError, match=re.escape(fault)):
        assemble(_assembled(steps), "x.rlc")


def test_constants_beyond_the_largest() -> None:
    """Constants are bounded like the results of operations."""
    with pytest.raises(FileFormatError, match=re.escape("expected numbers from -1e+100 to 1e+100")):
        assemble(_assembled(["LOADS N c0", "STOP"], "1e200"), "x.rlc")


def test_world_is_not_moved() -> None:
    """Code that moves WORLD, which the compiler refuses, ends with the error of a frame that no arm carries."""
    pose = "1 0 0 0 1 0 0 0 1 0.4 0 0.2"
    code = assemble(_assembled(["LOADM A c0", "MVBEG WORLD A", "MVDIR", "MVEND", "STOP"], pose), "x.rlc")
    cell = cell_of("cell1")

    with pytest.raises(RunError, match="`WORLD` cannot be moved"):
        interpret(code, cell, Simulator(cell), limits=LIMITS)


def test_read_before_it_is_written() -> None:
    """A value in passing that nothing has written yet is not read."""
    text = assembly(code_of(TEXTS["loops"], cell_of("cell1")))

    with pytest.raises(FileFormatError, match="%777 is read before it is written"):
        assemble(re.sub(r"(JZ     )%\d+", r"\1%777", text, count=1))


def test_interpret_verifies() -> None:
    """Who puts code together by hand hears what is wrong with it before anything moves."""
    cell = cell_of("cell1")
    code = code_of(TEXTS["loops"], cell)
    broken = type(code)(
        instructions=code.instructions[:3], types=code.types, constants=code.constants, source=code.source
    )

    with pytest.raises(CodeError, match="instruction 0"):
        interpret(broken, cell, Simulator(cell))


def mutant(text: str, draw: np.random.Generator) -> str:
    """Return the text of code with an operand, an operation or a row changed for another of the same code."""
    head, code, source = re.split(r"(?<=\ncode\n)|(?=source\n\|)", text, maxsplit=2)
    rows = [row.split() for row in code.rstrip("\n").split("\n")]
    operands = [word for row in rows for word in row[3:]]
    for _ in range(draw.integers(1, 3)):
        row, other, kind = rows[draw.integers(len(rows))], rows[draw.integers(len(rows))], draw.random()
        if kind < 0.6 and len(row) > 3:
            at = draw.integers(3, len(row))
            alike = [word for word in operands if word[0].isalpha() == row[at][0].isalpha()]
            row[at] = f"@{draw.integers(len(rows)):04d}" if row[at][0] == "@" else str(draw.choice(alike))
        elif kind < 0.75:
            row[2] = draw.choice([*(op.value for op in Op), other[2]])
        else:
            row[2:], other[2:] = other[2:], row[2:]
    return head + "\n".join(map(" ".join, rows)) + "\n" + source


@pytest.mark.proof
@pytest.mark.share(0.02)
def test_what_passes_can_be_interpreted(sample: Sample) -> None:
    """Changed code is refused, or is run to its end or to a message: no assertion fails, and nothing else is raised."""
    names = [*TEXTS, "p02", "p07"]
    cells = {name: cell_of({"p07": "jam"}.get(name, "cell1")) for name in names}
    codes = {name: code_of(TEXTS.get(name) or corpus_text(name), cells[name]) for name in names}
    ran = 0
    for draw in sample.cases(20_000):
        name = str(draw.choice(names))
        text = mutant(re.sub(r" *; [^\n]*", "", assembly(codes[name])), draw)
        try:
            code = assemble(text)
        except FileFormatError:
            continue
        ran += 1
        with contextlib.suppress(RunError):
            interpret(code, cells[name], Simulator(cells[name]), limits=LIMITS)

    sample.record("changed code, run as far as it goes", sample.count(20_000), 0, ran=ran)
    assert sample.case >= 0
