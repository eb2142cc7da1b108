"""Conditions, texts and constants as values: what programs with them do."""

import pytest

from program.running import cell_of, code_of, failure, printed, run


def lines(text: str, declarations: str = "a, b, c : BOOLEAN ; n : SCALAR ; s, t : TEXT ;") -> list[str]:
    """Run statements; return what they print."""
    return printed(run(f"VAR {declarations} BEGIN {text} END.", cell_of("cell1")))


@pytest.mark.parametrize("a", [False, True])
@pytest.mark.parametrize("b", [False, True])
def test_kept_conditions(a: bool, b: bool) -> None:  # noqa: FBT001 - two values
    """A condition kept in a variable is what it would be in an IF, also where the variable is part of it."""
    values = f"a = {str(a).upper()} ; b = {str(b).upper()} ;"
    text = "c = a AND b ; PRINT(c) ; c = a OR b ; PRINT(c) ; c = NOT a ; PRINT(c) ; a = b AND a ; PRINT(a) ;"
    expected = [a and b, a or b, not a, b and a]

    assert lines(values + text) == [str(value).lower() for value in expected]
    assert lines(f"{values} b = a OR NOT b AND b ; PRINT(b) ;") == [str(a).lower()]


def test_right_side_is_looked_at_where_it_matters() -> None:
    """In a kept condition too, what is behind AND is not worked out where the left side decides."""
    assert lines("n = 0 ; a = n <> 0 AND 1 / n > 2 ; b = n = 0 OR 1 / n > 2 ; PRINT(a, b) ;") == ["false true"]


def test_condition_is_kept_not_its_formula() -> None:
    """What a condition was when it was kept does not change with what it was made of."""
    assert lines("n = 1 ; a = n = 1 ; n = 2 ; PRINT(a, n = 1) ;") == ["true false"]


def test_texts() -> None:
    """A text is what PRINT would write; two are equal where all characters are."""
    text = 's = TEXT("part", 3, TRUE, 0.5) ; t = TEXT("part 3", TRUE, "0.5") ; PRINT(s) ; PRINT(s = t, s <> "part") ;'

    assert lines(text) == ["part 3 true 0.5", "true true"]


def test_text_is_bounded() -> None:
    """A text that a loop makes longer and longer ends the program before it takes the memory."""
    error = failure('VAR s : TEXT ; n : SCALAR ; BEGIN s = "ab" ; FOR n = 1 TO 50 DO s = TEXT(s, s) END.')

    assert error.diagnostic.code == "E240"
    assert "too long" in error.diagnostic.message


def test_parameters_are_copies() -> None:
    """A condition and a text are passed by value: a procedure changes its own."""
    program = """VAR a : BOOLEAN ; s : TEXT ;
    PROCEDURE change (a : BOOLEAN, s : TEXT) ; BEGIN a = NOT a ; s = TEXT(s, a) ; PRINT(s) END ;
    BEGIN a = TRUE ; s = "was" ; change(a, s) ; PRINT(a, s) END."""

    assert printed(run(program)) == ["was false", "true was"]


def test_constants() -> None:
    """A constant has its value from the start, for procedures too; its unit is that of the program."""
    program = """UNITS MM ; CONST gap = 2cm ; up = XYZ(0, 0, gap) ; ok = gap = 20 ; name = "gap" ;
    PROCEDURE show ; BEGIN PRINT(name, gap, ok, Z(up)) END ;
    BEGIN show() END."""

    assert printed(run(program)) == ["gap 20 true 20"]


def test_constants_come_first_in_the_code() -> None:
    """Constants are worked out in front of the first statement, each in a step of its own."""
    code = code_of("VAR n : SCALAR ; CONST k = 3 ; BEGIN n = k END.", cell_of("cell1"))

    assert [(step.begins, step.operands[0]) for step in code.instructions[:2]] == [(True, "K"), (True, "N")]
