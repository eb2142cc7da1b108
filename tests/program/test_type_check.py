"""What expressions are, and the names that they are made of."""

import pytest

from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.source import Source
from armwright.program.language.words import Standard
from armwright.program.semantics import check
from armwright.program.semantics.expression_types import ExpressionType, expression_text
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.symbols import Symbols
from armwright.program.semantics.type_check import infer_type
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import scan
from armwright.program.syntax.parser import parse

DECLARED = {
    "F": VariableType(VariableKind.FRAME),
    "G": VariableType(VariableKind.FRAME),
    "T": VariableType(VariableKind.TRANS),
    "U": VariableType(VariableKind.TRANS),
    "N": VariableType(VariableKind.SCALAR),
    "E": VariableType(VariableKind.EVENT),
    "SLOT": VariableType(VariableKind.FRAME, (2, 3)),
    "COUNT": VariableType(VariableKind.SCALAR, (4,)),
}
UNIT = "(1,0,0, 0,1,0, 0,0,1, 0,0,0)"


def parsed(text: str) -> tree.Program:
    source = Source("t.rlo", text)
    program, slips = parse(source, scan(source, text, Standard.RLO_2).tokens, Standard.RLO_2)
    assert slips == []
    return program


def expression(text: str) -> tree.Expression:
    """Return the tree of an expression."""
    (statement,) = parsed(f"BEGIN PRINT({text}) END.").statements
    assert isinstance(statement, tree.Print)
    (item,) = statement.items
    assert not isinstance(item, tree.String)
    return item


def judged(text: str) -> tuple[ExpressionType | None, list[Diagnostic]]:
    """Return what an expression is, and what is said of it."""
    names = NameResolver(None)
    names.symbols.types.update(DECLARED)
    return infer_type(names, expression(text)), names.diagnostics


def checked(text: str) -> tuple[Symbols, list[Diagnostic]]:
    symbols, found, _ = check.check(parsed(text))
    return symbols, found


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1 + n * 2 / -n", ExpressionType.SCALAR),
        ("2mm", ExpressionType.SCALAR),
        ("DIST(f, ARM_1)", ExpressionType.SCALAR),
        ("FORCE(z)", ExpressionType.SCALAR),
        ("TORQUE(z)", ExpressionType.SCALAR),
        ("count[count[1]]", ExpressionType.SCALAR),
        ("n < 3", ExpressionType.CONDITION),
        ("NOT n = 1 AND (n > 2 OR n <> 4)", ExpressionType.CONDITION),
        ("ARM_1", ExpressionType.FRAME),
        ("WORLD", ExpressionType.FRAME),
        ("slot[2, n + 1]", ExpressionType.FRAME),
        ("f * t", ExpressionType.FRAME),
        ("ARM_1 * XYZ(0, 0, n) * ROTX(90)", ExpressionType.FRAME),
        (f"f * {UNIT}", ExpressionType.FRAME),
        ("t * u", ExpressionType.TRANS),
        (f"t * {UNIT}", ExpressionType.TRANS),
        ("INV(t)", ExpressionType.TRANS),
        ("INV(f) * g", ExpressionType.TRANS),
        ("INV(f) * g * t", ExpressionType.TRANS),
        (f"INV(f) * {UNIT}", ExpressionType.TRANS),
        ("INV(INV(f))", ExpressionType.FRAME),
        ("INV(f)", ExpressionType.INVERSE),
        (UNIT, ExpressionType.MATRIX),
        (f"{UNIT} * t", ExpressionType.MATRIX),
        (f"INV({UNIT} * {UNIT})", ExpressionType.MATRIX),
        ("e", ExpressionType.EVENT),
    ],
)
def test_types_of_expressions(text: str, expected: ExpressionType) -> None:
    """A place is moved by a step to a place, steps follow one another, and two places are a step apart."""
    assert judged(text) == (expected, [])


@pytest.mark.parametrize(
    ("text", "code", "message", "help_"),
    [
        ("f * g", "E221", "`*` has no meaning between a FRAME and a FRAME", "write `INV(f) * g`"),
        ("t * f", "E221", "`*` has no meaning between a TRANS and a FRAME", "applies: `f * t`"),
        ("f + t", "E221", "`+` has no meaning between a FRAME and a TRANS", "write `f * t`"),
        ("f - t", "E221", "`-` has no meaning between a FRAME and a TRANS", "write `f * INV(t)`"),
        ("f - g", "E221", "`-` has no meaning between a FRAME and a FRAME", "write `INV(g) * f`"),
        ("f / t", "E221", "`/` has no meaning between a FRAME and a TRANS", "write `f * INV(t)`"),
        ("f = g", "E221", "`=` has no meaning between a FRAME and a FRAME", "write `DIST(f, g)`"),
        ("-t", "E221", "`-` takes a number, but this is a TRANS", "write `INV(t)`"),
        ("2 * t", "E221", "`*` has no meaning between a number and a TRANS", "XYZ"),
        ("t * INV(f)", "E221", "`*` has no meaning between a TRANS and the inverse of a FRAME", "`INV(f) * g`"),
        ("1 + (n < 2)", "E221", "`+` has no meaning between a number and a condition", "AND and OR"),
        ("INPUT(go) = TRUE", "E221", "`=` has no meaning between a condition and a condition", "write `INPUT(go)`"),
        (
            "FALSE = INPUT(go)",
            "E221",
            "`=` has no meaning between a condition and a condition",
            "write `NOT INPUT(go)`",
        ),
        ("INPUT(go) <> TRUE", "E221", "`<>` has no meaning between a condition and a condition", "`NOT INPUT(go)`"),
        ("n AND n < 2", "E219", "AND needs a condition, but `n` is a SCALAR", "write `n <> 0`"),
        ("NOT f", "E219", "NOT needs a condition, but `f` is a FRAME", "such as `n > 0`"),
        ("e + 1", "E223", "`e` is an EVENT and cannot be computed with", ""),
        ("slot", "E222", "`slot` is an ARRAY [2,3] OF FRAME and needs an index", "write `slot[1,1]`"),
        ("slot[1]", "E222", "`slot` has 2 indices, not 1", ""),
        ("slot[1,4]", "E222", "index 4 is outside 1..3", ""),
        ("n[1]", "E222", "`n` is a SCALAR and has no index", ""),
        ("XYZ(1, 2)", "E220", "XYZ takes three lengths, not 2 arguments", ""),
        ("DIST(f, t)", "E220", "DIST takes two FRAMEs, but `t` is a TRANS", ""),
        ("FORCE(n)", "E220", "FORCE takes one axis, X, Y or Z, not `n`", "FORCE(Z)"),
        ("TORQUE(n)", "E220", "TORQUE takes one axis, X, Y or Z, not `n`", "TORQUE(Z)"),
        ("ROTY(5mm)", "E224", "ROTY takes one angle, but `5mm` is a length", ""),
        ("XZY(1, 2, 3)", "E227", "unknown function `XZY`", "did you mean `XYZ`?"),
        ("slot(1, 2)", "E227", "`slot` is an ARRAY [2,3] OF FRAME and no function", "write `slot[1,2]`"),
        ("(1, 2, n)", "E206", "a matrix has 12 numbers, not 3", "write `XYZ(1, 2, n)`"),
        ("sl0t[1,1]", "E202", "`sl0t` is not declared", "did you mean `SLOT`?"),
    ],
)
def test_expressions_without_a_type(text: str, code: str, message: str, help_: str) -> None:
    """What has no meaning is named, with what was probably meant."""
    _, (found,) = judged(text)

    assert (found.code, found.message) == (code, message)
    assert help_ in " ".join(found.helps)


@pytest.mark.parametrize("text", ["a < b", "f * nothing = nothing", "-nothing < 1", "slot[nothing,1] * nothing"])
def test_no_errors_follow_an_undeclared_name(text: str) -> None:
    """Of what was reported as unknown nothing more is said."""
    _, found = judged(text)

    assert {one.code for one in found} == {"E202"}
    assert len(found) == len({one.message for one in found})


@pytest.mark.parametrize(
    "text",
    [
        "NOT n = 1 AND n > 2",
        "(n + 1) * 2 - -n",
        "n - (n - 1)",
        "n / (n * 2)",
        "INV(f) * slot[1,n + 1]",
        "-(n + 1)",
        "(n < 1 OR n > 2) AND n <> 3",
        "NOT (n < 1 AND n > 2)",
        "f * (t * u)",
    ],
)
def test_text_of_an_expression(text: str) -> None:
    """Advice repeats an expression as one would write it."""
    assert expression_text(expression(text)) == text


def test_long_expressions_are_not_repeated() -> None:
    """A message does not repeat half a line; its place is marked anyway."""
    _, found = checked("BEGIN MOVE ARM_1 TO XYZ(100, 200, 300) * ROTZ(90) * ROTX(45) END.")

    assert found[0].message == "a MOVE must go to a FRAME, but this is a TRANS"


def test_names_of_a_procedure_hide_those_of_the_program() -> None:
    """A procedure's own names hide those of the program; whatever it lacks is looked up there."""
    symbols, found = checked(
        "VAR f, g : FRAME ; PROCEDURE work(f : TRANS) ; VAR n : SCALAR ; "
        "BEGIN n = 1 ; g = g * f ; PRINT(n) END ; BEGIN g = ARM_1 ; f = g ; work(XYZ(0,0,1)) END."
    )
    main, inside = symbols.scope(None), symbols.scope("WORK")

    assert found == []
    assert symbols.procedures["WORK"].parameters == ("F",)
    assert (main.type("F"), inside.type("F")) == (VariableType(VariableKind.FRAME), VariableType(VariableKind.TRANS))
    assert (main.type("N"), inside.type("N")) == (None, VariableType(VariableKind.SCALAR))
    assert (main.is_local("F"), inside.is_local("F"), inside.is_local("G")) == (False, True, False)
    assert inside.type("G") == VariableType(VariableKind.FRAME)
    assert inside.declared("F") != main.declared("F")
    assert inside.declared("G") == main.declared("G") != None  # noqa: E711
    assert inside.declared("STATION") is None


def test_units_of_a_program() -> None:
    """Bare numbers are metres and degrees until UNITS says otherwise, wherever it stands among the headers."""
    assert (checked("BEGIN END.")[0].units.length, checked("BEGIN END.")[0].units.angle) == ("M", "DEG")

    units = checked("VAR t : TRANS ; UNITS rad, mm ; BEGIN t = XYZ(0,0,1) END.")[0].units
    assert (units.length, units.angle) == ("MM", "RAD")


def test_many_undeclared_names() -> None:
    """Thousands of names that nobody declared are all reported, without looking for each among all others."""
    unknown = " ".join(f"x{number} = 1 ;" for number in range(3000))
    known = " ".join(f"VAR y{number} : SCALAR ;" for number in range(3000))
    _, found = checked(f"{known} BEGIN {unknown} END.")

    assert sum(one.code == "E202" for one in found) == 3000
    assert sum("did you mean" in "".join(one.helps) for one in found) < 20


@pytest.mark.parametrize(
    ("call", "message", "help_"),
    [
        ("n = half", "`half` is a FUNCTION and no variable", "has parentheses: `half(...)`"),
        ("n = one", "`one` is a FUNCTION and no variable", "has parentheses: `one()`"),
        ("n = swap", "`swap` is a procedure and no variable", "a statement of its own: `swap(...)`"),
        ("WAIT b", "WAIT needs an EVENT, but `b` is a condition", "write `WAIT UNTIL b`"),
        ("WAIT n", "WAIT needs an EVENT, but `n` is a SCALAR", "is declared with EVENT"),
        ("swap(n, n)", "`n` is passed twice to `swap`, which may change it", "a copy of it"),
        ("swap(a[n], a[n + 1])", "`a[n + 1]` may be passed twice to `swap`, which may change it", "a copy of it"),
    ],
)
def test_functions_and_procedures(call: str, message: str, help_: str) -> None:
    """A function without its parentheses is told from a procedure, what may be an alias from one that is."""
    text = f"""VAR n : SCALAR ; a : ARRAY [3] OF SCALAR ; b : BOOLEAN ;
    FUNCTION half (n : SCALAR) : SCALAR ; BEGIN RETURN n / 2 END ;
    FUNCTION one : SCALAR ; BEGIN RETURN 1 END ;
    PROCEDURE swap (INOUT x, y : SCALAR) ; VAR z : SCALAR ; BEGIN z = x ; x = y ; y = z END ;
    BEGIN n = 1 ; {call} END."""
    found = [one for one in checked(text)[1] if one.is_error]

    assert [one.message for one in found] == [message]
    assert help_ in " ".join(found[0].helps)
