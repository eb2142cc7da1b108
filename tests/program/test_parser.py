"""What the parser makes of the sentences of RLO-2."""

import gc
import time

import pytest
from hypothesis import given, strategies as st

from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.source import Source, Span
from armwright.program.language.words import Standard
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import scan
from armwright.program.syntax.parser import parse
from armwright.program.syntax.token_stream import MAX_DEPTH

# So often a thing is repeated that no sound program would.
MANY = 4_000
# How much longer eight times the program may take: twice eight, for the noise of the machine; squared it were 64.
LINEAR = 16.0


def read(text: str, standard: Standard = Standard.RLO_2) -> tuple[tree.Program, list[Diagnostic]]:
    source = Source("t.rlo", text)
    scanned = scan(source, text, standard)
    program, slips = parse(source, scanned.tokens, standard)
    return program, [*scanned.diagnostics, *slips]


def statements(text: str) -> tuple[tree.Statement, ...]:
    program, found = read(f"BEGIN {text} END.")
    assert found == []
    return program.statements


def shown(node: object) -> str:
    """Write an expression with a pair of parentheses for each operation."""
    match node:
        case tree.Binary(operation=sign, left=left, right=right):
            return f"({shown(left)} {sign} {shown(right)})"
        case tree.Unary(operation=sign, operand=operand):
            return f"({sign} {shown(operand)})"
        case tree.Function(name=name, arguments=items) | tree.Index(name=name, indices=items):
            return f"{name.key}[{', '.join(map(shown, items))}]"
        case tree.Matrix(items=items):
            return f"<{', '.join(map(shown, items))}>"
        case tree.Number() | tree.Name() | tree.ArmName():
            return node.text
    raise AssertionError(node)


def value(text: str) -> tree.Expression:
    (one,) = statements(f"x = {text}")
    assert isinstance(one, tree.Assign)
    return one.value


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("a - b - c", "((a - b) - c)"),
        ("a - (b - c)", "(a - (b - c))"),
        ("a + b * c / d", "(a + ((b * c) / d))"),
        ("a * -b", "(a * (- b))"),
        ("a OR b AND NOT c", "(a OR (b AND (NOT c)))"),
        ("NOT a < b + 1", "(NOT (a < (b + 1)))"),
        ("a = 1 AND b <> 2", "((a = 1) AND (b <> 2))"),
        ("(a OR b) AND c", "((a OR b) AND c)"),
        ("- - a", "(- (- a))"),
        ("INV(f) * g", "(INV[f] * g)"),
        ("slot[i, j + 1] * lift", "(SLOT[i, (j + 1)] * lift)"),
        ("ARM-1 * XYZ(0, 0, -5mm)", "(ARM-1 * XYZ[0, 0, -5mm])"),
        ("((a))", "a"),
        ("(a, (b, 2))", "<a, <b, 2>>"),
    ],
)
def test_operations(text: str, meant: str) -> None:
    """Products hold together before sums, sums before comparisons, these before NOT, AND and OR; then from the left."""
    assert shown(value(text)) == meant


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("-5", tree.Number(Span(10, 12), "-5", -5.0)),
        ("- 5", tree.Number(Span(10, 13), "-5", -5.0)),
        ("2.5cm", tree.Number(Span(10, 15), "2.5cm", 2.5, "CM")),
        ("-1e2deg", tree.Number(Span(10, 17), "-1e2deg", -100.0, "DEG")),
    ],
)
def test_numbers(text: str, number: tree.Number) -> None:
    """A minus right before a number is its sign, a unit right behind it part of it."""
    assert value(text) == number


def test_sign_or_difference() -> None:
    """A minus behind a value takes away, and the number behind it has no sign of its own."""
    assert shown(value("a -5")) == "(a - 5)"
    assert shown(value("a - -5")) == "(a - -5)"


def test_nearest_if() -> None:
    """ELSE belongs to the nearest IF that has none."""
    (outer,) = statements("IF a = 1 THEN IF b = 1 THEN HALT ELSE RETRY")

    assert isinstance(outer, tree.If)
    assert outer.otherwise is None
    assert isinstance(outer.then, tree.If)
    assert isinstance(outer.then.otherwise, tree.Retry)


def test_clauses_behind_a_guard() -> None:
    """A clause behind the action of ON belongs to the MOVE."""
    (move,) = statements("MOVE ARM_1 TO f ON FORCE(Z) > 8 DO hit = 1, WITH SPEED = 5 VIA (g)")

    assert isinstance(move, tree.Move)
    assert [type(clause) for clause in move.clauses] == [tree.On, tree.Speed, tree.Via]


def test_parts_of_a_program() -> None:
    """Imports, units, variables and procedures come in any order and stay in it."""
    program, found = read(
        'VAR a : FRAME ; IMPORT "c.json" ; PROCEDURE p(x, y : SCALAR, f : ARRAY [2] OF FRAME) ; VAR z : TRANS ;'
        " BEGIN END ; UNITS MM, DEG ; VAR e : EVENT ; BEGIN p(1, 2, b) END."
    )

    assert found == []
    assert [type(header).__name__ for header in program.headers] == [
        *("Declaration", "Import", "Procedure", "Units", "Declaration")
    ]
    (procedure,) = program.procedures
    assert [[name.text for name in one.names] for one in procedure.parameters] == [["x", "y"], ["f"]]
    assert [size.value for size in procedure.parameters[1].type.sizes] == [2.0]
    assert procedure.parameters[1].type.text == "ARRAY [2] OF FRAME"


@pytest.mark.parametrize(
    ("text", "head"),
    [
        ("IF a = 1 THEN HALT", "IF a = 1"),
        ("WHILE a = 1 DO HALT", "WHILE a = 1"),
        ("FOR i = 1 TO 3 STEP 2 DO HALT", "FOR i = 1 TO 3 STEP 2"),
        ("LOCK (f, g) DO HALT", "LOCK (f, g)"),
    ],
)
def test_heads(text: str, head: str) -> None:
    """The head of a statement that holds another reaches up to THEN or DO, which it leaves out."""
    program, _ = read(f"BEGIN {text} END.")
    (one,) = program.statements

    assert isinstance(one, tree.If | tree.While | tree.For | tree.Lock)
    assert f"BEGIN {text} END."[one.head.start : one.head.end] == head


def depth(node: object) -> int:
    """Return how deep a tree is, without going down into it by calls."""
    deepest, waiting = 0, [(node, 1)]
    while waiting:
        now, level = waiting.pop()
        if isinstance(now, tuple):
            waiting += [(one, level) for one in now]
        elif hasattr(now, "__attrs_attrs__"):
            deepest = max(deepest, level)
            waiting += [(getattr(now, field.name), level + 1) for field in now.__attrs_attrs__]
    return deepest


DEEP = {
    "parentheses": f"n = {'(' * MANY}1{')' * MANY}",
    "parentheses never closed": f"n = {'(' * MANY}",
    "minus": f"n = {'-' * MANY}x",
    "not": f"IF {'NOT ' * MANY}a = 1 THEN HALT",
    "comparisons": f"n = a{' < a' * MANY}",
    "indices": f"n = {'a[' * MANY}1{']' * MANY}",
    "functions": f"n = {'a(' * MANY}1{')' * MANY}",
    "calls": f"{'a(' * MANY}1{')' * MANY}",
    "blocks": f"{'BEGIN ' * MANY}{'END ' * MANY}",
    "blocks never closed": "BEGIN " * MANY,
    "choices": f"{'IF a = 1 THEN ' * MANY}HALT",
    "other choices": f"{'IF a = 1 THEN HALT ELSE BEGIN ' * MANY}HALT {'END ' * MANY}",
    "misspelt choices": f"{'IFF a = 1 THEN ' * MANY}HALT",
    "loops": f"{'REPEAT ' * MANY}{'UNTIL a = 1 ' * MANY}",
    "counting": f"{'FOR i = 1 TO 2 DO ' * MANY}HALT",
    "branches": f"{'COBEGIN BEGIN ' * MANY}{'END COEND ' * MANY}",
    "branches never closed": "COBEGIN " * MANY,
    "locks": f"{'LOCK (a) DO ' * MANY}HALT",
    "recoveries": f"{'TRY ' * MANY}{'RECOVER END ' * MANY}",
    "guards": f"{'MOVE a TO b ON c = 1 DO BEGIN ' * MANY}{'END ' * MANY}",
}


@pytest.mark.parametrize("text", DEEP.values(), ids=DEEP)
def test_depth(text: str) -> None:
    """However deep a program is, it is told so and nothing breaks; its tree is never deep."""
    program, found = read(f"BEGIN {text} ; n = 2 END.")

    assert found
    assert depth(program) <= 2 * MAX_DEPTH
    assert depth(program.statements) < MAX_DEPTH + 20


@pytest.mark.parametrize("text", [f"1{' + x' * MANY}", f"{'(' * 90}1{(' + x' * 80 + ')') * 90}"])
def test_long_is_not_deep(text: str) -> None:
    """A sum may have any number of terms: only what is nested is deep."""
    _, found = read(f"BEGIN n = {text} END.")

    assert found == []


@pytest.mark.parametrize("terms", [MAX_DEPTH // 2 - 1, MAX_DEPTH // 2 + 1])
def test_deepest(terms: int) -> None:
    """Sums inside of sums, each in its parentheses, may be nearly fifty deep, and no deeper."""
    _, found = read(f"BEGIN n = {'(1 + ' * terms}x{')' * terms} END.")

    assert [one.code for one in found] == (["E119"] if terms > MAX_DEPTH // 2 else [])


def test_linear_time() -> None:
    """Eight times as long a program takes about eight times as long to read."""
    short, long = (min(_seconds(count) for _ in range(3)) for count in (250, 2000))

    assert long < LINEAR * short


def _seconds(count: int) -> float:
    part = "IF n > 1 THEN BEGIN MOVE ARM_1 TO f * XYZ(0, 0, -5mm) WITH APPROACH = g, VIA (v, w) ; n = n - 1 END ;\n"
    text = f"BEGIN {part * count} END."
    # What looks for garbage looks at all that the session has made so far, and takes its own time.
    gc.disable()
    try:
        started = time.process_time()
        read(text)
        return time.process_time() - started
    finally:
        gc.enable()


WORDS = """
    VAR BEGIN END . ; , ( ) [ ] = : := == <> < + - * / AND OR NOT ARM_1 1 5mm "text" f g MOVE TO WITH VIA ON SPEED BLEND
    IF THEN ELSE WHILE DO REPEAT UNTIL FOR STEP COBEGIN COEND PRIORITY SIGNAL WAIT PAUSE LOCK TRY RECOVER RETRY HALT
    PRINT PROCEDURE ARRAY OF EVENT FRAME IMPORT UNITS MM OFF RIGIDLY GRASP OPEN OPERATE READ VISIONS AFFIX UNFIX AT FROM
"""


@given(st.lists(st.sampled_from(WORDS.split()), max_size=60), st.sampled_from(["", "BEGIN"]), st.sampled_from(Standard))
def test_any_words(words: list[str], start: str, standard: Standard) -> None:
    """No order of the words raises or goes on for ever, and every message lies in the text."""
    text = " ".join([start, *words])
    program, found = read(text, standard)

    assert all(0 <= one.span.start <= one.span.end <= len(text) for one in found)
    assert program.span.end <= len(text)
    assert found or program.statements is not None
