"""Records: what is done with a record is what is done with variables of the names of its fields."""

import random
import re
from pathlib import Path

import pytest

from armwright.cell.reader import read_cell
from armwright.errors import InvalidValueError
from armwright.program import Source, compile as translate, run
from armwright.program.bytecode.assembler import assemble, assembly
from armwright.program.debugger.debugger import Debugger
from armwright.program.debugger.expressions import ExpressionError
from armwright.program.formatter.format import formatted
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language_server.analysis import Analysis, Settings, analyse
from armwright.program.language_server.cell_lookup import CellCache
from armwright.program.language_server.completions import completions
from armwright.program.language_server.hover import hover
from armwright.program.language_server.rename import rename
from armwright.program.repl.session import Session
from program.running import cell_of
from samples import Sample

EXAMPLES = Path(__file__).parents[2] / "examples"
PARTS = """UNITS MM ;
RECORD part ;
  weight : SCALAR ;
  place : FRAME ;
  label : TEXT ;
END ;
VAR a, b : part ;
    slot : ARRAY [3] OF part ;
    n : SCALAR ;
PROCEDURE lift(INOUT p : part, by : SCALAR) ;
BEGIN
  p.place = p.place * XYZ(0, 0, by) ;
  p.weight = p.weight + by ;
END ;
BEGIN
  a.weight = 2 ;
  a.place = WORLD * XYZ(1, 2, 3) ;
  a.label = "one" ;
  FOR n = 1 TO 3 DO
    slot[n] = a ;
  slot[2].weight = 7 ;
  lift(slot[2], 10) ;
  b = slot[2] ;
  PRINT(b.weight, Z(b.place), b.label, a.weight, Z(a.place)) ;
END.
"""


def test_records_run() -> None:
    """Assignments copy, elements are things of their own, and a procedure changes what it is given INOUT."""
    recording = run(translate(Source("parts.rlo", PARTS), cell_of("cell1")))

    assert recording.trace()[0] == 'PRINT "17 13 one 2 3"'


def random_program(rng: random.Random) -> tuple[str, str]:
    """Return a program with records, and one with a variable for each field and array instead."""
    kinds = {"weight": "SCALAR", "shift": "TRANS", "place": "FRAME", "good": "BOOLEAN", "note": "TEXT"}
    fields = rng.sample(sorted(kinds), rng.randint(1, 5))
    values = {
        "weight": lambda: str(rng.randint(-9, 9)),
        "shift": lambda: f"XYZ({rng.randint(-9, 9)}, 0, 1)",
        "place": lambda: f"WORLD * XYZ({rng.randint(-9, 9)}, 2, 1)",
        "good": lambda: rng.choice(("TRUE", "FALSE")),
        "note": lambda: f'"{rng.choice("abc")}"',
    }
    record = "".join(f"  {field} : {kinds[field]} ;\n" for field in fields)
    whole = f"RECORD thing ;\n{record}END ;\nVAR a, b : thing ; s : ARRAY [2] OF thing ;\n"
    plain = "VAR " + "".join(
        f"a_{field}, b_{field} : {kinds[field]} ; s_{field} : ARRAY [2] OF {kinds[field]} ;\n" for field in fields
    )
    heads = ("a", "b", "s[1]", "s[2]")
    records, variables = [], []

    def variable(head: str, field: str) -> str:
        name, bracket, index = head.partition("[")
        return f"{name}_{field}{bracket}{index}"

    for head in heads:
        for field in fields:
            value = values[field]()
            records.append(f"{head}.{field} = {value}")
            variables.append(f"{variable(head, field)} = {value}")
    for _ in range(rng.randint(1, 8)):
        left, right = rng.choice(heads), rng.choice(heads)
        if rng.random() < 0.5:
            records.append(f"{left} = {right}")
            variables += [f"{variable(left, field)} = {variable(right, field)}" for field in fields]
        else:
            field = rng.choice(fields)
            records.append(f"{left}.{field} = {right}.{field}")
            variables.append(f"{variable(left, field)} = {variable(right, field)}")
    shown = rng.choice(heads)
    records.append(f"PRINT(TEXT({shown}), a, b, s[1], s[2])")
    lists = {head: ", ".join(variable(head, field) for field in fields) for head in heads}
    variables.append(f"PRINT(TEXT({lists[shown]}), {', '.join(lists.values())})")
    return f"{whole}BEGIN\n{_lines(records)}END.\n", f"{plain}BEGIN\n{_lines(variables)}END.\n"


def _lines(statements: list[str]) -> str:
    return "".join(f"  {statement} ;\n" for statement in statements)


def test_random_records(sample: Sample) -> None:
    """A program with records prints what the same program with a variable for each field prints."""
    cell = cell_of("cell1")
    for case in range(sample.count(100)):
        whole, plain = random_program(random.Random(sample.seed + case))
        program = translate(Source("r.rlo", whole), cell)
        assert program.code is not None, [(one.code, one.message) for one in program.diagnostics]
        after = formatted(Source("r.rlo", whole))

        assert run(program).trace() == run(translate(Source("p.rlo", plain), cell)).trace(), whole
        assert assemble(assembly(program.code)) == program.code
        assert formatted(Source("r.rlo", after)) == after
        again = translate(Source("r.rlo", after), cell)
        assert again.code is not None
        assert [step.operands for step in again.code.instructions] == [
            step.operands for step in program.code.instructions
        ]


def stopped_at(text: str, statement: str) -> Debugger:
    """Run a program up to a statement, from code that was written and read again."""
    cell = read_cell(EXAMPLES / "stanford_cell.toml")
    code = translate(Source("parts.rlo", text), cell).code
    assert code is not None
    debugger = Debugger(assemble(assembly(code)), cell)
    debugger.begin()
    finish(debugger)
    debugger.add_breakpoint(next(n for n, line in enumerate(text.splitlines(), 1) if statement in line))
    resume(debugger, "continue")
    return debugger


def resume(debugger: Debugger, command: str) -> None:
    debugger.resume(command)  # type: ignore[arg-type]
    finish(debugger)


def finish(debugger: Debugger) -> None:
    while debugger.running:
        debugger.run_slice(1.0)


def test_debugger_shows_records() -> None:
    """A record is one variable with its fields inside; its assignment is one statement."""
    debugger = stopped_at(PARTS, "b = slot[2] ;")
    line = debugger.code.source.line(debugger.stack(())[0].span.start)
    resume(debugger, "next")
    shown = {one.name: one for scope in debugger.scopes(()) for one in (scope.children or tuple)()}
    slots = debugger.evaluate("SLOT", ())
    assert slots.children is not None
    second = debugger.evaluate("slot[1 + 1]", ())

    assert debugger.code.source.line(debugger.stack(())[0].span.start) == line + 1
    assert (shown["a"].type, shown["a"].value.split(",")[0]) == ("part", "weight = 2")
    assert shown["a"].children is not None
    assert [(one.name, one.expression, one.slot) for one in shown["a"].children()] == [
        ("weight", "a.weight", "A.WEIGHT"),
        ("place", "a.place", "A.PLACE"),
        ("label", "a.label", "A.LABEL"),
    ]
    assert (slots.type, slots.value) == ("ARRAY [3] OF part", "3 elements")
    assert [one.value for one in slots.children()][1] == second.value
    assert second.children is not None
    assert next((one.expression, one.value) for one in second.children()) == ("slot[1 + 1].weight", "17")
    assert debugger.evaluate("slot[2].weight + 1", ()).value == "18"
    assert "slot[2].place" in debugger.evaluate("frames", ()).value
    for wrong, reason in (
        ("slot[4]", "outside 1..3"),
        ("a + 1", "is a record of the type part"),
        ("a[1]", "has no index"),
    ):
        with pytest.raises(ExpressionError, match=reason):
            debugger.evaluate(wrong, ())


def test_debugger_shows_records_of_a_procedure() -> None:
    """A parameter that is a record shows the fields of what was passed for it."""
    debugger = stopped_at(PARTS, "p.weight = p.weight + by")
    local = next(scope for scope in debugger.scopes(()) if scope.name == "Locals")
    assert local.children is not None
    found = {one.name: one for one in local.children()}

    assert (found["p"].type, found["p"].value) == ("part", debugger.evaluate("p", ()).value)


def in_editor(text: str) -> Analysis:
    return analyse("parts.rlo", PositionCodec(text), None, CellCache(), Settings())


def test_hover_shows_fields() -> None:
    """A record shows its type and its fields, and a field its type."""
    analysis = in_editor(PARTS)

    def shown(words: str, skip: int = 0) -> str:
        found = hover(analysis, PARTS.index(words) + skip, markdown=False)
        assert found is not None
        return str(found.contents.value)  # type: ignore[union-attr]

    fields = "fields: weight : SCALAR, place : FRAME, label : TEXT"
    assert shown("b = slot") == f"b : part\n{fields}\ndeclared in line 7"
    assert shown("slot[2] ;") == f"slot : ARRAY [3] OF part\n{fields}\ndeclared in line 8"
    assert shown("p.weight + by") == "p.weight : SCALAR\nparameter of lift, declared in line 10"
    assert shown("].weight", 3) == "slot[3].weight : SCALAR\nfield of part, declared in line 3"
    assert shown("  weight :", 3) == "weight : SCALAR\nfield of part"
    for place, skip in (("RECORD part", 8), ("a, b : part", 8), ("OF part", 4), ("p : part", 5)):
        assert shown(place, skip) == f"RECORD part\n{fields}\ndeclared in line 2"
    for place in ("b = slot", "a.weight = 2", "].weight = 7"):
        with pytest.raises(InvalidValueError):
            rename(analysis, PARTS.index(place) + place.startswith("]") * 3, "other")


def test_completion_offers_fields() -> None:
    """Behind the point of a record its fields are offered, of the right type."""
    text = PARTS.replace("  b = slot[2] ;", "  MOVE ARM_1 TO a.")
    cut = text.index("TO a.") + 5
    labels = [one.label for one in completions(PositionCodec(text), in_editor(PARTS), cut, snippets=False)]

    assert labels == ["a.place"]


@pytest.mark.parametrize(
    ("typed", "labels"),
    [
        ("b = slot[n + 1].", ["weight", "place", "label"]),
        ("MOVE ARM_1 TO slot[slot[1].weight].", ["weight", "place", "label"]),
        ("a.", ["a.weight", "a.place", "a.label"]),
        ("n = sl", ["slot[].weight"]),
        ("n = (a.weight).", []),
    ],
)
def test_completion_of_elements(typed: str, labels: list[str]) -> None:
    """Behind the point of an element the fields stand alone; an array of records is offered with its index."""
    text = PARTS.replace("  b = slot[2] ;", f"  {typed}")
    cut = text.index(typed) + len(typed)
    offered = [one.label for one in completions(PositionCodec(text), in_editor(PARTS), cut, snippets=False)]

    assert [one for one in offered if "." in typed or "slot" in one] == labels


def test_completion_of_types() -> None:
    """Where a type stands, the records are offered too."""
    text = PARTS.replace("    n : SCALAR ;", "    n : ")
    cut = text.index("    n : ") + len("    n : ")

    assert "part" in [one.label for one in completions(PositionCodec(text), in_editor(PARTS), cut, snippets=False)]


@pytest.mark.parametrize("text", ["RECORD part", "RECORD part ; END ;", "RECORD part ; n : SCALAR", "RECORD ; END ;"])
def test_broken_records(text: str) -> None:
    """A record without fields, a name or an END is said to be so, once, and the rest is read."""
    program = translate(Source("r.rlo", f"{text}\nVAR n : SCALAR ;\nBEGIN n = 1 ; PRINT(n) END."))

    assert program.diagnostics
    assert all(one.code in ("E111", "E115", "E104", "E105", "E112") for one in program.diagnostics if one.is_error)


def test_names_of_the_first_edition() -> None:
    """RECORD, MODULE and AS are names wherever nothing follows that makes words of them."""
    text = "VAR record, module, as : SCALAR ; BEGIN record = 1 ; module = record ; as = module ; PRINT(as) END."

    assert translate(Source("r.rlo", text)).diagnostics == ()
    assert re.search(r"var RECORD SCALAR", assembly(translate(Source("r.rlo", text)).code))  # type: ignore[arg-type]


def test_one_message_for_a_record() -> None:
    """A record that is wrong as a whole is told once, by its own name; what is wrong with one field, of that field."""
    text = """\
RECORD part ; weight : SCALAR ; place : FRAME ; label : TEXT ; END ;
VAR a, b : part ; n : SCALAR ; s : ARRAY [2] OF part ;
PROCEDURE both(INOUT x : part, INOUT y : part) ; BEGIN x.weight = 1 ; y.label = "y" END ;
PROCEDURE set(INOUT x : part) ; BEGIN a.weight = 1 ; a.label = "a" ; x.weight = 2 END ;
BEGIN
  n = 1 ;
  both(b, b) ;
  both(s[n], s[n]) ;
  set(a) ;
  set(s[3]) ;
  set(s[1,2]) ;
  set(nothing) ;
  s[1].weight = s[2].label ;
  COBEGIN BEGIN b = a END ; BEGIN b = a END COEND ;
END.
"""
    diagnostics = translate(Source("r.rlo", text)).diagnostics
    told = [(text.count("\n", 0, one.span.start) + 1, one.code, one.message) for one in diagnostics]

    assert [one for one in told if one[1] != "E303" and one[1] != "W204"] == [
        (7, "E233", "`b` is passed twice to `both`, which may change it"),
        (8, "E233", "`s[n]` may be passed twice to `both`, which may change it"),
        (9, "E233", "`a` is passed to `set`, which uses it also by its own name"),
        (10, "E222", "index 3 is outside 1..2"),
        (11, "E222", "`s` has 1 index, not 2"),
        (12, "E202", "`nothing` is not declared"),
        (13, "E217", "`s[1].weight` is a SCALAR and takes a number, but `s[2].label` is a TEXT"),
        (14, "W503", "`b` is written in two branches of one COBEGIN without LOCK"),
    ]


def test_no_records_in_a_session() -> None:
    """A session that is entered line by line refuses a record with one message, on however many lines it stands."""
    session = Session()
    for text in ("RECORD part ; n : SCALAR ; END ;", "RECORD part ;\n  n : SCALAR ;\n  m, k : FRAME ;\nEND ;"):
        assert [one.code for one in session.enter(text, complete=True).diagnostics] == ["E260"]
