"""Errors by their kinds: which RECOVER takes them, errors of the program's own, and their texts."""

import attrs
import pytest

from armwright.cell.simulator import Simulator
from armwright.program import Source, compile as translate
from armwright.program.vm.interpreter import interpret
from program.running import cell_of, failure, printed, run

DECLARED = "VAR n : SCALAR ; f, unseen : FRAME ;"
TROUBLE = {
    "MOTION": "f = WORLD * XYZ(50, 0, 0) ; MOVE ARM_1 TO f",
    "CAMERA": "READ VISIONS (unseen)",
    "DEVICE": "OPERATE nothing",
    "TIMEOUT": "WAIT UNTIL FALSE WITHIN 0.1",
    "FRAMES": "f = unseen",
    "VALUE": "n = 1 ; n = 1 / (n - 1)",
    "OWN": "RAISE own",
}


def lines(text: str) -> list[str]:
    # Without knowledge of the cell the compiler lets names pass that the cell does not have.
    cell = attrs.evolve(cell_of("cell1"), devices=frozenset({"LAMP"}))
    compiled = translate(Source("t.rlo", f"{DECLARED} BEGIN n = 0 ; {text} END."))
    assert compiled.code is not None, [one.message for one in compiled.diagnostics]
    return printed(interpret(compiled.code, cell, Simulator(cell)))


@pytest.mark.parametrize("kind", TROUBLE)
def test_named_kind_is_recovered(kind: str) -> None:
    """An error goes to the RECOVER that names its kind, through those that name others."""
    others = ", ".join(other for other in TROUBLE if other != kind)
    text = f"""TRY TRY {TROUBLE[kind]} RECOVER ({others}) PRINT("wrong") END
    RECOVER ({kind}) PRINT("right") END ; IF n > 5 THEN RAISE own"""

    assert lines(text) == ["right"]


def test_unnamed_kind_goes_on_outwards() -> None:
    """An error that no RECOVER names ends the program, with the statements of none of them run."""
    error = failure('BEGIN TRY TRY RAISE a RECOVER (b) PRINT("b") END ; RAISE b RECOVER (c) RAISE c END END.')

    assert (error.diagnostic.code, error.kind, error.diagnostic.message) == ("E508", "A", "error `a` is raised")


def test_message() -> None:
    """MESSAGE is the text of the error that was recovered last: that of RAISE, or that of the language."""
    text = """PRINT(MESSAGE = "") ; TRY RAISE own WITH TEXT("part", 3) RECOVER PRINT(MESSAGE) END ;
    TRY n = 1 / n RECOVER PRINT(MESSAGE) END ; PRINT(MESSAGE) ;"""

    assert lines(text) == ["true", "part 3", "1 cannot be divided by 0", "1 cannot be divided by 0"]


def test_error_in_a_recovery_is_of_its_own_kind() -> None:
    """What fails in a RECOVER goes outwards by its own kind, not by that of the error before."""
    text = 'TRY TRY RAISE a RECOVER (a) RAISE b END RECOVER (b) PRINT("b") END ;'

    assert lines(text) == ["b"]


def test_retry_after_a_named_kind() -> None:
    """RETRY begins the TRY again, which recovers from the same kinds once more."""
    text = "TRY n = n + 1 ; IF n < 4 THEN RAISE again ; PRINT(n) RECOVER (again) RETRY END ;"

    assert lines(text) == ["4"]


def test_error_out_of_procedures_and_branches() -> None:
    """An error leaves procedures and branches until a RECOVER names it; their locks are given back."""
    text = """VAR n : SCALAR ;
    PROCEDURE inner ; BEGIN TRY LOCK (n) DO RAISE deep WITH "deep" RECOVER (shallow) PRINT("wrong") END END ;
    PROCEDURE outer ; BEGIN inner() ; PRINT("wrong") END ;
    BEGIN
      n = 0 ;
      TRY COBEGIN BEGIN outer() END ; BEGIN PAUSE 5 ; PRINT("wrong") END COEND
      RECOVER (deep) LOCK (n) DO PRINT(MESSAGE, TIME) END ;
      IF n > 0 THEN RAISE shallow
    END."""

    assert printed(run(text)) == ["deep 0"]


def test_raise_in_a_function_and_a_guard() -> None:
    """A function that a guard evaluates may raise an error: the arm is stopped, and a TRY around the MOVE goes on."""
    text = """UNITS MM ; VAR start : FRAME ;
    FUNCTION near (f, g : FRAME) : BOOLEAN ; BEGIN IF DIST(f, g) > 20 THEN RAISE far ; RETURN FALSE END ;
    BEGIN start = ARM_1 ;
      TRY MOVE ARM_1 TO start * XYZ(0, 0, 60) STRAIGHTLY, WITH SPEED = 10, ON near(ARM_1, start) DO HALT
      RECOVER (far) PRINT(DIST(ARM_1, start)) END
    END."""

    assert 20 < float(printed(run(text, cell_of("cell1")))[0]) < 30


def test_deadlock_is_not_recovered() -> None:
    """Where all processes wait for ever there is nobody to go on at RECOVER."""
    text = """VAR n : SCALAR ; e, f : EVENT ; BEGIN n = 0 ;
      TRY COBEGIN
        BEGIN FOR n = 1 TO 1 DO WAIT e ; SIGNAL f END ; BEGIN WHILE n < 0 DO SIGNAL e ; WAIT f ; SIGNAL e END
      COEND RECOVER PRINT("on") END
    END."""

    assert failure(text).diagnostic.code == "E501"


def test_a_kind_that_nothing_raises_is_corrected_as_the_program_spells_it() -> None:
    """The suggestion for a kind is a word of the program, not its key."""
    compiled = translate(Source("t.rlo", "BEGIN TRY RAISE clampy RECOVER (clampi) PRINT(MESSAGE) END END."))

    assert [(one.code, one.helps) for one in compiled.diagnostics] == [("E236", ("did you mean `clampy`?",))]
