"""Programs of the first edition of RLO-2 compile to the code that they had before there was a second."""

import hashlib
import re

import attrs
import pytest

from armwright.program import Compilation, Source, compile as translate
from armwright.program.bytecode.assembler import assembly
from armwright.program.bytecode.instructions import Code, Instruction, Operand
from armwright.program.language.words import VALUES, WORDS_IN_CONTEXT
from armwright.program.semantics.builtins import FUNCTIONS
from program.shelf import BARE, HERE, compile_file

EXAMPLES = HERE.parents[1] / "examples"
# Of each program the first 16 digits of the SHA-256 of its code, written by the last release before the second edition.
DIGESTS = dict(reversed(line.split()) for line in (HERE / "corpus" / "first_edition.txt").read_text().splitlines())
# Words of the second edition, which all may be names.
WORDS = sorted({*FUNCTIONS, *VALUES, *WORDS_IN_CONTEXT})
# A program in which NAME is a variable of some type, read and written in every place where a variable may stand.
SCALARS = """VAR NAME, OTHER : SCALAR ; LIST : ARRAY [3] OF SCALAR ; F : FRAME ;
BEGIN
  NAME = 3 ; NAME = NAME + NAME * -NAME - NAME / 2 ; LIST[1] = NAME ; OTHER = LIST[NAME - NAME + 1] ;
  IF NAME > 1 AND NOT (NAME = 2) THEN NAME = 1 ELSE NAME = 2 ;
  FOR NAME = NAME TO NAME STEP NAME DO PRINT(NAME, "text", NAME) ;
  WHILE NAME < 0 DO NAME = NAME ;
  REPEAT NAME = NAME UNTIL NAME > 0 ;
  F = WORLD * XYZ(NAME, 0, NAME) ; PAUSE NAME ; PAUSE NAME ;
  LOCK (NAME) DO NAME = (NAME) ;
  MOVE ARM_1 TO F WITH SPEED = NAME, ON NAME > FORCE(Z) DO NAME = NAME
END.
"""
FRAMES = """VAR NAME, OTHER : FRAME ; NAMES : ARRAY [2] OF FRAME ; NUMBER : SCALAR ;
PROCEDURE RUN (NAME : FRAME) ; BEGIN AFFIX NAME TO ARM_1 ; UNFIX NAME END ;
BEGIN
  NAME = ARM_1 ; AFFIX NAME TO ARM_1 AT XYZ(0,0,0) ; UNFIX NAME FROM ARM_1 ; NAMES[1] = NAME ;
  NUMBER = DIST(NAME, NAME) ;
  READ VISIONS (NAME) ; RUN(NAME) ; MOVE ARM_1 TO NAME VIA (NAME, NAME * XYZ(0,0,0)), WITH APPROACH = NAME ;
  UNFIX NAME
  ; OPEN ARM_1 ; PRINT(NUMBER, NAME)
END.
"""
PROCEDURES = """VAR NUMBER : SCALAR ;
PROCEDURE NAME (A : SCALAR) ; BEGIN NUMBER = A ; IF A > 1 THEN NAME(A - 1) END ;
PROCEDURE OTHER ; BEGIN NAME(2) END ;
BEGIN
  NAME(3) ; OTHER() ; IF NUMBER > 0 THEN NAME(1) ELSE NAME (NUMBER) ; NAME((1)) ; PRINT(NUMBER)
END.
"""
EVENTS = """VAR NAME : EVENT ; NAMES : ARRAY [2] OF EVENT ;
BEGIN
  SIGNAL NAME ; WAIT NAME ; SIGNAL NAMES[1] ; WAIT NAMES[1] ;
  COBEGIN BEGIN WAIT NAME END ; BEGIN SIGNAL NAME END COEND
END.
"""


@pytest.mark.parametrize("name", DIGESTS)
def test_same_code(name: str) -> None:
    """The code of each program of the shelf and each example is what it was, to the last character of its text form."""
    path = HERE / name
    code = (translate(path) if EXAMPLES in path.resolve().parents else compile_file(path)).code
    assert code is not None

    assert hashlib.sha256(assembly(code).encode()).hexdigest()[:16] == DIGESTS[name]


def compiled(text: str, name: str) -> Compilation:
    return translate(Source("t.rlo", re.sub(r"\bNAME(S?)\b", rf"{name}\1", text)), BARE)


def renamed(code: Code, old: str, new: str) -> tuple[Instruction, ...]:
    """Return the instructions of a code with another name in place of one."""
    names = {old: new, f"{old}S": f"{new}S"}

    def operand(value: Operand) -> Operand:
        return names.get(value, value) if isinstance(value, str) else value

    return tuple(attrs.evolve(step, operands=tuple(map(operand, step.operands))) for step in code.instructions)


def said(compilation: Compilation) -> list[tuple[str, int]]:
    return [(one.code, compilation.source.line(one.span.start)) for one in compilation.diagnostics]


@pytest.mark.parametrize("word", WORDS)
@pytest.mark.parametrize(
    "text", [SCALARS, FRAMES, PROCEDURES, EVENTS], ids=["scalars", "frames", "procedures", "events"]
)
def test_variable_of_that_name_wins(word: str, text: str) -> None:
    """A program that calls something by a word of the second edition has the same code as with any other name."""
    if text is PROCEDURES and word in ("XYZ", "ROTX", "ROTY", "ROTZ", "INV", "DIST", "FORCE"):
        pytest.skip("no procedure could ever have this name")
    neutral = "Q" * len(word)
    with_word, without = compiled(text, word), compiled(text, neutral)
    assert without.code is not None, said(without)
    assert with_word.code is not None, said(with_word)
    assert said(with_word) == said(without)

    assert with_word.code.instructions == renamed(without.code, neutral, word)
    assert list(with_word.code.types.values()) == list(without.code.types.values())
