"""Functions with a value, and parameters that are other names of the caller's variables."""

import math

import pytest

from armwright.cell.simulator import Simulator
from armwright.errors import FileFormatError
from armwright.program.bytecode.assembler import assemble, assembly
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.machine import Limits
from program.running import cell_of, code_of, failure, printed, run
from samples import Sample

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

GCD = """FUNCTION gcd (a, b : SCALAR) : SCALAR ;
BEGIN IF b = 0 THEN RETURN a ; RETURN gcd(b, MOD(a, b)) END ;
"""


def test_recursion(sample: Sample) -> None:
    """Euclid's algorithm finds the greatest common divisor, as the math module does."""
    pairs = [rng.integers(1, 10_000, 2).tolist() for rng in sample.cases(100)]
    calls = " ".join(f"PRINT(gcd({a}, {b})) ;" for a, b in pairs)

    assert printed(run(f"{GCD} BEGIN {calls} END.")) == [f"{math.gcd(a, b)}" for a, b in pairs]


def test_value_in_the_middle_of_an_expression() -> None:
    """What was worked out before a call is still there behind it, in a function that calls itself too."""
    text = """FUNCTION fib (n : SCALAR) : SCALAR ;
    BEGIN IF n < 2 THEN RETURN n ; RETURN fib(n - 1) + fib(n - 2) END ;
    BEGIN PRINT(fib(3) * 100 + fib(fib(6)) - fib(1)) END."""

    assert printed(run(text)) == ["220"]


def test_arguments_stay_as_they_are() -> None:
    """A function may use its parameters as variables: the variables of the caller do not change."""
    text = """VAR n : SCALAR ; FUNCTION down (n : SCALAR) : SCALAR ;
    BEGIN WHILE n > 3 DO n = n - 3 ; RETURN n END ;
    BEGIN n = 11 ; PRINT(down(n), n) END."""

    assert printed(run(text)) == ["2 11"]


@pytest.mark.parametrize(
    ("kind", "value", "shown"),
    [
        ("TRANS", "XYZ(1, 0, 0)", "(1,0,0, 0,1,0, 0,0,1, 1,0,0)"),
        ("FRAME", "WORLD * XYZ(0, 2, 0)", "(1,0,0, 0,1,0, 0,0,1, 0,2,0)"),
        ("BOOLEAN", "k > 1", "true"),
        ("TEXT", 'TEXT("k", k)', "k 2"),
        ("SCALAR", "k", "2"),
    ],
)
def test_kinds_of_values(kind: str, value: str, shown: str) -> None:
    """A function may give a number, a transformation, a pose, a condition or a text."""
    function = f"FUNCTION value (k : SCALAR) : {kind} ; BEGIN RETURN {value} END ;"

    assert printed(run(f"VAR v : {kind} ; {function} BEGIN v = value(2) ; PRINT(v) END.")) == [shown]


def test_condition_of_a_guard() -> None:
    """In a guard a function is worked out at every tick, with the pose of the moving arm."""
    text = """UNITS MM ; VAR start : FRAME ; n : SCALAR ;
    FUNCTION gone (f : FRAME, g : FRAME) : BOOLEAN ;
    VAR sum, k : SCALAR ;
    BEGIN sum = 0 ; FOR k = 1 TO 3 DO sum = sum + DIST(f, g) / 3 ; RETURN sum > 25 END ;
    BEGIN start = ARM_1 ;
      MOVE ARM_1 TO start * XYZ(0, 0, 60) STRAIGHTLY, WITH SPEED = 5,
        ON gone(ARM_1, start) DO BEGIN n = DIST(ARM_1, start) ; HALT END ;
      PRINT(n)
    END."""
    recording = run(text, cell_of("cell1"))

    assert 25 < float(printed(recording)[0]) < 25.5
    assert not [effect for effect in recording.effects if effect.kind == "PLACE" and effect.data["frame"] != "START"]


def test_function_without_end() -> None:
    """A function that never returns ends the program, in a condition too."""
    loop = "FUNCTION ever (n : SCALAR) : SCALAR ; BEGIN WHILE n > 0 DO n = n + 1 ; RETURN n END ;"
    for use in ("PRINT(ever(1))", "MOVE ARM_1 TO ARM_1 * XYZ(0, 0, 0.01) ON ever(1) > 0 DO HALT"):
        assert failure(f"{loop} BEGIN {use} END.", limits=Limits(steps=5000)).diagnostic.code == "E504"


def test_too_deep() -> None:
    """A function that calls itself without end is stopped as a procedure is."""
    text = "FUNCTION deep (n : SCALAR) : SCALAR ; BEGIN RETURN deep(n + 1) END ; BEGIN PRINT(deep(1)) END."

    assert failure(text).diagnostic.code == "E505"


def test_error_inside_of_a_function() -> None:
    """A TRY around its call recovers from what goes wrong in a function; the locks of the caller stay."""
    text = """VAR n : SCALAR ; FUNCTION inverse (n : SCALAR) : SCALAR ; BEGIN RETURN 1 / n END ;
    BEGIN
      n = 3 ; LOCK (n) DO BEGIN TRY n = inverse(0) RECOVER PRINT("caught", n) END ; n = inverse(2) END ; PRINT(n)
    END."""

    assert printed(run(text)) == ["caught 3", "0.5"]


def test_inout() -> None:
    """An INOUT parameter is the variable of the caller, or an element; through a second procedure too."""
    text = """VAR n : SCALAR ; list : ARRAY [2] OF SCALAR ; ok : BOOLEAN ; s : TEXT ; t : TRANS ;
    PROCEDURE double (INOUT n : SCALAR) ; BEGIN n = 2 * n END ;
    PROCEDURE fourfold (INOUT a : SCALAR) ; BEGIN double(a) ; double(a) END ;
    PROCEDURE all (INOUT ok : BOOLEAN, INOUT s : TEXT, INOUT t : TRANS) ;
    BEGIN ok = NOT ok ; s = TEXT(s, "!") ; t = t * XYZ(1, 0, 0) END ;
    BEGIN
      n = 3 ; fourfold(n) ; list[2] = 5 ; double(list[2]) ; ok = FALSE ; s = "now" ; t = XYZ(1, 0, 0) ; all(ok, s, t) ;
      PRINT(n, list[2], ok, s, X(t))
    END."""

    assert printed(run(text)) == ["12 10 true now ! 2"]


def test_inout_gives_a_first_value() -> None:
    """An INOUT parameter may give its variable the first value that it has."""
    text = "VAR n : SCALAR ; PROCEDURE start (INOUT n : SCALAR) ; BEGIN n = 7 END ; BEGIN start(n) ; PRINT(n) END."

    assert printed(run(text)) == ["7"]


def test_lock_of_an_inout_parameter() -> None:
    """The lock of an INOUT parameter is that of the variable: two branches count together and lose nothing."""
    text = """VAR n : SCALAR ;
    PROCEDURE count (INOUT a : SCALAR) ; VAR k, was : SCALAR ;
    BEGIN FOR k = 1 TO 5 DO LOCK (a) DO BEGIN was = a ; PAUSE 0.01 ; a = was + 1 END END ;
    BEGIN n = 0 ; COBEGIN BEGIN count(n) END ; BEGIN count(n) END COEND ; PRINT(n) END."""

    assert printed(run(text)) == ["10"]


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("RETV   A", 'RETV   "x"', "RETV expects a number"),
        ("CALLF  %1 HALF 4.0", "CALLF  %1 HALF", "HALF has 1 parameter, got 0 arguments"),
        ("CALLF  %1 HALF 4.0", "CALL   HALF 4.0", "HALF is a function, which CALLF calls"),
        ("RETV   A", "RET", "the code of a function must not contain RET"),
        ("DIV    A A 2.0", "DIV    N A 2.0", "a function must not change N, which is not its own"),
        ("DIV    A A 2.0", "PAUSE  2.0", "the code of a function must not contain PAUSE"),
    ],
)
def test_damaged_code(old: str, new: str, fault: str) -> None:
    """The verifier refuses code of a function that would do more than work out a value, or a value of another sort."""
    function = "FUNCTION half (a : SCALAR) : SCALAR ; BEGIN a = a / 2 ; RETURN a END ;"
    text = f"VAR n : SCALAR ; {function} BEGIN n = 0 + half(4) END."
    code = assembly(code_of(text, cell_of("cell1")))
    assert old in code

    with pytest.raises(FileFormatError, match=fault):
        assemble(code.replace(old, new))


def test_intermediate_code_of_functions() -> None:
    """The text form keeps results and INOUT parameters, and runs alike."""
    text = f"""{GCD} VAR n : SCALAR ; PROCEDURE set (INOUT n : SCALAR, k : SCALAR) ; BEGIN n = gcd(n, k) END ;
    BEGIN n = 12 ; set(n, 18) ; PRINT(n) END."""
    cell = cell_of("cell1")
    code = code_of(text, cell)
    again = assemble(assembly(code))

    assert again == code
    assert printed(interpret(again, cell, Simulator(cell))) == ["6"]
