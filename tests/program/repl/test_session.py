"""Sessions: statements that are done as they are entered, and taken back."""

import time
from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.cell.model import Cell
from armwright.cell.simulator import Simulator
from armwright.errors import FileFormatError
from armwright.program.language.source import Source
from armwright.program.language.words import Standard
from armwright.program.repl.frame_view import arm_lines, frame_table_lines, zyx_angles
from armwright.program.repl.session import InputResult, Session
from armwright.program.repl.undo_report import SILENT_EFFECTS
from armwright.program.semantics.cell_symbols import ImportedFrames
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.machine import Limits, Machine
from armwright.spatial.poses import homogeneous
from program.running import DOWN, EXACT, cell_of, code_of, corpus_text, down

PROGRAMS = ("p01", "p02", "p03", "p04", "p05", "p06", "p07")
ABOVE = "(1,0,0, 0,-1,0, 0,0,-1, 0.40, 0.15, 0.20)"
ASIDE = "(1,0,0, 0,-1,0, 0,0,-1, 0.50, -0.10, 0.15)"
FAR = "(1,0,0, 0,-1,0, 0,0,-1, 0.40, 0.15, -9)"


def session(*inputs: str, cell: Cell | None = None, std: Standard = Standard.RLO_2) -> Session:
    """Begin a session with some inputs, all of which can be done."""
    talk = Session(cell or cell_of("cell1"), std)
    for text in inputs:
        answer = talk.enter(text)
        assert answer.is_complete, text
        assert not answer.is_wrong, answer.diagnostics
    return talk


def codes(answer: InputResult) -> list[str]:
    """Return the codes of what is wrong."""
    return [one.code for one in answer.diagnostics]


def places(machine: Machine) -> dict[str, list[float] | None]:
    """Return where everything is."""
    return {
        name: machine.state.tree.world(name).ravel().tolist() if machine.has_pose(name) else None
        for name in machine.state.tree
    }


def trace(answer: InputResult) -> list[str]:
    """Return the lines of the trace of an input."""
    return [effect.text for effect in answer.effects if effect.kind not in (*SILENT_EFFECTS, "PRINT")]


def everything(talk: Session) -> tuple[object, ...]:
    """Return all that an error or an undo has to bring back, as plain data."""
    machine = talk.state.machine
    configurations = {name: machine.hardware.configuration(name, machine.now).tolist() for name in machine.state.hands}
    parents = {name: machine.state.tree.parent(name) for name in machine.state.tree}
    values = {name: np.asarray(value).tolist() for name, value in machine.state.values.items()}
    hands = {name: (hand.reached_frame, hand.held_frame) for name, hand in machine.state.hands.items()}
    rest = (
        dict(machine.state.events),
        machine.now,
        machine.hardware.active_devices(),
        len(machine.state.effects),
        len(machine.state.trees),
    )
    return places(machine), parents, configurations, values, hands, *rest, talk.program()


# ---- values and statements -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("n", "3"),
        ("n * 2 + 1", "7"),
        ("2 + 3", "5"),
        ("-n", "-3"),
        ("(n + 1) / 2 ;", "2"),
        ("n > 2 AND NOT n = 4", "true"),
        ('"n is", n', "n is 3"),
        ("DIST(a, a)", "0"),
        ("a", "(1,0,0, 0,-1,0, 0,0,-1, 0.4,0.15,0.2)"),
        ("slot[2]", "(1,0,0, 0,-1,0, 0,0,-1, 0.4,0.15,0.2)"),
        ("slot[n - 1] * XYZ(0, 0, 0.2)", "(1,0,0, 0,-1,0, 0,0,-1, 0.4,0.15,0)"),
        ("n = 5 ; n", "5"),
    ],
)
def test_values(text: str, shown: str) -> None:
    """An expression shows its value; an equals sign behind a name at the start is an assignment."""
    talk = session("VAR a : FRAME ; slot : ARRAY [3] OF FRAME ; n : SCALAR", f"n = 3 ; a = {ABOVE} ; slot[2] = a")

    answer = talk.enter(text)

    assert answer.printed_lines == (shown,)
    assert not answer.diagnostics


def test_values_leave_nothing() -> None:
    """Looking at a value is no statement: undo takes back what was done before it."""
    talk = session("VAR n : SCALAR ; n = 3")
    before = everything(talk)

    assert talk.enter("n + 1").printed_lines == ("4",)

    assert everything(talk) == before
    assert talk.undo() == ("n = 3",)


def test_an_arm_stands_where_the_last_statement_left_it() -> None:
    """A MOVE goes on from where the one before ended, and the clock goes on with it."""
    talk = session("VAR a, b : FRAME", f"a = {ABOVE}", f"b = {ASIDE}")

    first = talk.enter("MOVE ARM_1 TO a")
    then = talk.state.machine.now
    second = talk.enter("MOVE ARM_1 TO b STRAIGHTLY")

    assert trace(first) == ["ARM_1 MOVE: PTP a @100"]
    assert trace(second) == ["ARM_1 MOVE: LINE b @100"]
    assert second.effects[0].t0 == then
    np.testing.assert_allclose(talk.state.machine.state.tree.world("ARM_1"), down(0.5, -0.1, 0.15), atol=EXACT)


@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.parametrize("line_by_line", [False, True])
@pytest.mark.drawn(0.4)
def test_programs_do_what_they_do(name: str, *, line_by_line: bool) -> None:
    """A program comes to the same end whether it is run, loaded into a session, or pasted line by line."""
    cell, text = cell_of("cell1"), corpus_text(name)
    recording = interpret(code_of(text, cell), cell, Simulator(cell))
    talk = Session(cell)
    trace: list[str] = []
    if line_by_line:
        begun = ""
        # A number alone, as on the empty lines of a listing, would be a value.
        for line in text[: text.upper().index("END.") + 4].splitlines():
            begun += f"{line}\n"
            answer = talk.enter(begun)
            assert not answer.is_wrong, answer.diagnostics
            if answer.is_complete:
                trace += [one.text for one in answer.effects if one.kind not in ("PLACE", "LOCK")]
                begun = ""
        assert not begun
    else:
        answer = talk.load(Source(name, text))
        trace = [one.text for one in answer.effects if one.kind not in ("PLACE", "LOCK")]

    machine = talk.state.machine
    assert trace == recording.trace()
    assert machine.now == pytest.approx(recording.duration, abs=1e-9)
    for frame in recording.tree:
        if recording.tree.has_value(frame):
            np.testing.assert_allclose(machine.state.tree.world(frame), recording.tree.world(frame), atol=EXACT)


@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.drawn(0.4)
def test_a_session_is_a_program(name: str) -> None:
    """The session as a program runs to the same end, and its own session is the same program."""
    cell = cell_of("cell1")
    talk = Session(cell)
    talk.load(Source(name, corpus_text(name)))

    text = talk.program("saved")
    recording = interpret(code_of(text, cell), cell, Simulator(cell))
    again = Session(cell)
    again.load(Source("again", text))

    assert recording.duration == pytest.approx(talk.state.machine.now, abs=1e-9)
    np.testing.assert_allclose(recording.configurations["ARM_1"], _configuration(talk), atol=EXACT)
    assert again.program("saved") == text


def _configuration(talk: Session) -> np.ndarray:
    machine = talk.state.machine
    return machine.hardware.configuration("ARM_1", machine.now)


def test_branches_side_by_side() -> None:
    """COBEGIN is one statement: when it is over, both arms rest, and the session goes on."""
    talk = Session(cell_of("cell2"))

    answer = talk.load(Source("p08", corpus_text("p08")))

    assert not answer.is_wrong
    np.testing.assert_allclose(talk.state.machine.state.tree.world("PART"), down(0.70, -0.20, 0.05), atol=EXACT)
    assert trace(talk.enter("OPEN ARM_2")) == ["ARM_2 OPEN"]


# ---- what is not complete ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        "BEGIN n = 1 ;",
        "BEGIN",
        "IF n > 2 THEN",
        "IF n > 2",
        "IF n > 2 THEN n = 1 ELSE",
        "WHILE n > 2 DO",
        "REPEAT n = 1 ;",
        "TRY n = 1 RECOVER n = 2",
        "COBEGIN BEGIN n = 1 END ;",
        "PRINT(n,",
        "n = (1 + 2",
        "n = ",
        "n *",
        "slot[1",
        "{ a remark",
        "n = 1 ; { a remark",
        "VAR m",
        "VAR m :",
        "PROCEDURE p",
        "PROCEDURE p ;",
        "PROCEDURE p ; BEGIN n = 1 ;",
        "UNITS",
        "MOVE ARM_1",
        "MOVE ARM_1 TO a WITH",
        "AFFIX a TO ARM_1 AT",
    ],
)
def test_more_must_come(text: str) -> None:
    """What is open at the end of a line goes on in the next; nothing is done until then."""
    talk = session("VAR a : FRAME ; n : SCALAR ; slot : ARRAY [3] OF SCALAR ; n = 3")
    before = everything(talk)

    answer = talk.enter(text)

    assert not answer.is_complete
    assert not answer.diagnostics
    assert everything(talk) == before
    assert talk.enter(text, complete=True).is_wrong
    assert everything(talk) == before


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("MOV ARM_1 TO a", "E105"),
        ("n = (1 ;", "E112"),
        ("n = ;", "E111"),
        ("GRASP ARM", "E106"),
        ("n 3 4", "E109"),
        ("ELSE n = 1", "E127"),
        ("END", "E114"),
        ("n = 1 # 2", "E101"),
        ("p", "E202"),
    ],
)
def test_slips_are_told_at_once(text: str, code: str) -> None:
    """What no further line can make right is an error now."""
    talk = session("VAR a : FRAME ; n : SCALAR ; PROCEDURE q ; BEGIN n = 1 END ; n = 3")

    answer = talk.enter(text)

    assert answer.is_complete
    assert code in codes(answer)


def test_a_call_without_parentheses() -> None:
    """Whoever writes a procedure's name alone waits for a call, not for a second line."""
    talk = session("PROCEDURE hello ; BEGIN PRINT(1) END")

    answer = talk.enter("hello")

    assert answer.is_complete
    assert "()" in answer.diagnostics[0].message


def test_nothing() -> None:
    """Blanks, remarks and lone semicolons are no statements."""
    talk = session("", "  ", "// a remark", "{ another }", ";")

    assert talk.undo() == ()
    assert talk.line == 6


# ---- errors --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("MOVE ARM_1 TO nowhere", "E202"),
        ("MOVE ARM_1 TO b", "E304"),
        (
            "BEGIN OPEN ARM_1 ; MOVE ARM_1 TO b0 ; part = a ; AFFIX part TO ARM_1 ; MOVE part TO c END",
            "E4",
        ),
        ("BEGIN OPERATE torch ; n = 8 ; MOVE ARM_1 TO c END", "E4"),
        ("WHILE 1 = 1 DO n = n + 1", "E504"),
        ("WHILE 1 = 1 DO PAUSE 10", "E506"),
        ("WAIT ready", "E501"),
        ("n = 1 / (n - 3)", "E2"),
        ("BEGIN SIGNAL ready ; deep(1) END", "E505"),
    ],
)
def test_an_error_leaves_all_as_it_was(text: str, code: str) -> None:
    """After an error frames, values, arms, hands, devices, events and the clock are as before the statement."""
    talk = Session(cell_of("cell1"), limits=Limits(steps=2000, depth=50, time=60.0))
    talk.enter(
        "VAR a, b, b0, c, part : FRAME ; n : SCALAR ; ready : EVENT ; PROCEDURE deep(k : SCALAR) ; BEGIN deep(k) END"
    )
    talk.enter(f"n = 3 ; a = {ABOVE} ; b0 = {ASIDE} ; c = {FAR} ; MOVE ARM_1 TO a ; GRASP")
    before = everything(talk)

    answer = talk.enter(text)

    assert answer.is_wrong
    assert answer.diagnostics[-1].code.startswith(code), answer.diagnostics
    assert everything(talk) == before
    assert not talk.enter("MOVE ARM_1 TO a * XYZ(0, 0, -0.05)").is_wrong


def test_an_error_tells_what_it_takes_back() -> None:
    """The remarks name what was done before the error, and what is back where it was."""
    talk = session("VAR a, c, part : FRAME", f"a = {ABOVE} ; c = {FAR}")

    answer = talk.enter("BEGIN OPEN ARM_1 ; MOVE ARM_1 TO a ; part = a ; MOVE ARM_1 TO c END")

    assert answer.remarks == (
        "effects before that were undone: ARM_1 OPEN; ARM_1 MOVE: PTP a @100",
        "restored: ARM_1, frame part, the clock to 0.000 s",
    )


def test_what_an_error_takes_back_is_told_in_short() -> None:
    """Of a thousand things that were done before an error the first are named, and the others counted."""
    talk = session("VAR i : SCALAR", "i = 0")

    (remark,) = talk.enter('BEGIN FOR i = 1 TO 1000 DO PRINT("x") ; i = 1 / (i - 1000) END').remarks

    assert remark.endswith('PRINT "x"; 990 more')
    assert remark.count("PRINT") == 10


def test_statements_before_an_error_stay() -> None:
    """Of several statements those before the one that fails are done, and those behind it are not."""
    talk = session("VAR c : FRAME ; n : SCALAR", f"c = {FAR}")

    answer = talk.enter("n = 1 ; OPEN ARM_1 ; MOVE ARM_1 TO c ; n = 2 ; n = 3")

    assert trace(answer) == ["ARM_1 OPEN"]
    assert answer.remarks == ("not executed: the 2 statements after it",)
    assert talk.enter("n").printed_lines == ("1",)


def test_an_input_with_an_error_in_it_does_nothing() -> None:
    """Where the checker finds something wrong, no statement of the input is run."""
    talk = session("VAR n : SCALAR ; n = 0")

    answer = talk.enter("n = 1 ; m = 2 ; n = 3")

    assert codes(answer) == ["E202"]
    assert talk.enter("n").printed_lines == ("0",)


def test_errors_name_the_lines_that_were_seen() -> None:
    """Every line counts, also those that were wrong or said nothing to the cell."""
    talk = Session(cell_of("cell1"))
    talk.enter("VAR n : SCALAR")
    talk.skip_lines(":frames")
    talk.enter("m = 1")

    answer = talk.enter("\n  n = XYZ(0, 0, 1)")

    (error,) = answer.diagnostics
    assert answer.source.line(error.span.start) == 5
    assert answer.source.line(error.secondary[0].span.start) == 1


def test_a_file_has_its_own_lines() -> None:
    """What is wrong in a file is told with the lines of the file, though the session has lines before."""
    talk = session("VAR n : SCALAR", "n = 1")

    answer = talk.load(Source("weld.rlo", "BEGIN\n  n = 2 ;\n  k = 3 ;\nEND.\n"))

    assert answer.source.name == "weld.rlo"
    assert answer.source.line(answer.diagnostics[0].span.start) == 3
    assert talk.enter("n").printed_lines == ("1",)


def test_the_checker_knows_what_was_done() -> None:
    """Values and affixments of earlier statements count: what they make impossible is said before anything moves."""
    talk = session("VAR a, part : FRAME", f"a = {ABOVE} ; part = a", "AFFIX part TO a")

    assert codes(talk.enter("AFFIX a TO part")) == ["E305"]
    assert codes(talk.enter("UNFIX part FROM ARM_1")) == ["E306"]
    assert codes(talk.enter("MOVE part TO a")) == ["E301"]


def test_a_halt_ends_the_program() -> None:
    """Behind a HALT nothing more is done, though values can be looked at; undo goes back to before it."""
    talk = session("VAR n : SCALAR ; n = 1", "IF n = 1 THEN HALT")

    answer = talk.enter("n = 2")

    assert answer.is_wrong
    assert "HALT" in answer.remarks[0]
    assert talk.enter("n").printed_lines == ("1",)
    talk.undo()
    assert not talk.enter("n = 2").is_wrong


def test_warnings_are_said_once() -> None:
    """A warning about a statement is said with it, and not again with every later one."""
    text = "OPEN ARM_1 ; MOVE ARM_1 TO part ; GRASP ; MOVE part TO a"
    talk = session("VAR a, part : FRAME", f"a = {ABOVE} ; part = {ASIDE}")

    assert codes(talk.enter(text)) == ["W201"]
    assert codes(talk.enter("MOVE ARM_1 TO a * XYZ(0, 0, -0.05)")) == []


# ---- back and forth ------------------------------------------------------------------------------------------------

STEPS = (
    f"a = {ABOVE}",
    "MOVE ARM_1 TO a",
    "GRASP",
    "READ VISIONS (part)",
    "AFFIX part TO ARM_1",
    "OPERATE torch",
    "n = n + 1",
    "SIGNAL ready",
    "MOVE ARM_1 TO a * XYZ(0.05, 0, 0) STRAIGHTLY",
    "READ VISIONS (part)",
    "UNFIX part",
    "VAR n : TRANS",
    "n = XYZ(1, 2, 3)",
    "PAUSE 2",
    "OPERATE torch OFF",
)


def _seeing() -> Cell:
    """Return a cell whose camera has two answers, with a torch."""
    seen = (homogeneous(DOWN, (0.4, 0.1, 0.1)), homogeneous(DOWN, (0.5, 0.1, 0.1)))
    return attrs.evolve(cell_of("cell1"), visions={"PART": seen}, devices=frozenset(("TORCH",)))


def test_undo_and_redo() -> None:
    """Undo takes back frames, arms, clock, devices, events and answers of the camera; redo does them again."""
    talk = session("VAR a, part : FRAME ; n : SCALAR ; ready : EVENT", "n = 0", cell=_seeing())
    states = [everything(talk)]
    for text in STEPS:
        answer = talk.enter(text)
        assert not answer.is_wrong, answer.diagnostics
        states.append(everything(talk))

    for state in reversed(states[:-1]):
        assert len(talk.undo()) == 1
        assert everything(talk) == state
    assert talk.redo(len(STEPS)) == STEPS
    assert everything(talk) == states[-1]
    assert talk.redo() == ()


def test_the_camera_gives_its_answers_again() -> None:
    """After an undo the camera sees what it saw the first time."""
    talk = session("VAR part : FRAME", "READ VISIONS (part)", cell=_seeing())
    first = talk.state.machine.state.tree.world("PART")
    talk.enter("READ VISIONS (part)")
    second = talk.state.machine.state.tree.world("PART")

    talk.undo(2)
    talk.enter("READ VISIONS (part)")

    np.testing.assert_array_equal(talk.state.machine.state.tree.world("PART"), first)
    assert not np.allclose(first, second)


def test_undo_goes_no_further_than_the_start() -> None:
    """Whoever takes back more than there is stands at the start; what comes then takes the place of the old."""
    talk = session("VAR n : SCALAR", "n = 1", "n = 2")

    assert talk.undo(9) == ("n = 2", "n = 1", "VAR n : SCALAR")
    assert codes(talk.enter("n = 3")) == ["E202"]
    talk.redo(2)
    talk.enter("n = 5")
    assert talk.redo() == ()
    assert talk.enter("n").printed_lines == ("5",)


# ---- names that are declared anew ----------------------------------------------------------------------------------


def test_a_name_declared_anew() -> None:
    """The new one takes the name; what was done with the old one keeps it under another, also in the program."""
    talk = session("VAR f, part : FRAME", f"f = {ABOVE} ; part = f", "AFFIX part TO f")

    answer = talk.enter("VAR f : SCALAR")
    talk.enter("f = 3")

    assert answer.remarks == ("`f` is declared again; the previous one is now called `f_1`",)
    assert talk.enter("f").printed_lines == ("3",)
    assert talk.enter("DIST(f_1, part)").printed_lines == ("0",)
    assert talk.state.machine.state.tree.parent("PART") == "F_1"
    assert "AFFIX part TO f_1 ;" in talk.program()
    cell = cell_of("cell1")
    recording = interpret(code_of(talk.program(), cell), cell, Simulator(cell))
    np.testing.assert_allclose(recording.tree.world("F_1"), down(0.4, 0.15, 0.2), atol=EXACT)


def test_an_unused_name_declared_anew() -> None:
    """Before anything was done with a name, the old declaration is simply gone."""
    talk = session("VAR f, g : FRAME", "VAR f : SCALAR", "f = 1")

    assert "VAR g : FRAME ;\n    f : SCALAR ;" in talk.program()
    assert "F" not in talk.state.machine.state.tree


def test_a_procedure_declared_anew() -> None:
    """From then on all procedures call the new one; statements of before keep what they called."""
    talk = session(
        "VAR n : SCALAR ; n = 0",
        "PROCEDURE one ; BEGIN n = n + 1 END",
        "PROCEDURE two ; BEGIN one() ; one() END",
        "two()",
    )
    talk.enter("PROCEDURE one ; BEGIN n = n + 100 END")
    talk.enter("two()")

    assert talk.enter("n").printed_lines == ("202",)
    cell = cell_of("cell1")
    end = "\n  PRINT(n)\nEND."
    recording = interpret(code_of(talk.program().replace("\nEND.", end), cell), cell, Simulator(cell))
    assert recording.effects[-2].data["printed"] == "202"


def test_own_names_of_a_procedure_stay() -> None:
    """A parameter of the same name, a device and an axis are other things, and keep their names."""
    talk = session(
        "VAR z, torch : SCALAR ; z = 1 ; torch = 1",
        "PROCEDURE p(z : SCALAR) ; BEGIN PRINT(z, torch) END",
        "OPERATE torch ; p(z) ; PRINT(FORCE(z))",
        "VAR z, torch : TRANS",
        cell=attrs.evolve(cell_of("cell1"), devices=None),
    )

    program = talk.program()

    assert "PROCEDURE p_1(z : SCALAR)" in program
    assert "PRINT(z, torch_1)" in program
    assert "OPERATE torch ;" in program
    assert "PRINT(FORCE(Z))" in program
    assert "p_1(z_1) ;" in program


def test_a_name_that_the_cell_knows() -> None:
    """What the camera or the cell file knows by name cannot be renamed, so it is not declared anew once used."""
    talk = session("VAR part : FRAME", "READ VISIONS (part)", cell=_seeing())

    answer = talk.enter("VAR part : SCALAR")

    assert codes(answer) == ["E203"]
    assert "`:undo`" in answer.diagnostics[0].helps[0]


def test_statements_are_listed_whole() -> None:
    """Every kind of statement is in the program as it was entered, with all that is inside of it."""
    statements = (
        "WHILE n < 3 DO n = n + 1 ;",
        "REPEAT n = n - 1 UNTIL n < 0 ;",
        "FOR n = 1 TO 2 DO PRINT(n) ;",
        "IF n = 2 AND NOT n > 3 THEN PRINT(1) ELSE PRINT(2) ;",
        "LOCK (f) DO f = WORLD * XYZ(1, 2, 3) ;",
        "TRY n = 1 / 0 RECOVER n = 7 END ;",
        "AFFIX f TO station AT XYZ(0, 0, (1 + 2) * 3) RIGIDLY ;",
        "SIGNAL ready ;",
        "WAIT ready ;",
        "PAUSE 0.5s ;",
        "OPEN ARM_1 TO 0.04 ;",
    )
    talk = session("VAR n : SCALAR ; f : FRAME ; ready : EVENT", "n = 0", *statements)

    text = "".join(talk.program().split())

    for statement in statements:
        assert "".join(statement.split()) in text


# ---- units, imports, standards -------------------------------------------------------------------------------------


def test_units_come_first() -> None:
    """Units settle what numbers mean, so they stand before the first statement; until then they can be changed."""
    talk = session("VAR t : TRANS", "UNITS CM", "UNITS RAD", "UNITS MM", "t = XYZ(1, 2, 30)")

    answer = talk.enter("UNITS CM")

    assert codes(answer) == ["E224"]
    assert "`25cm`" in answer.diagnostics[0].helps[0]
    assert not talk.enter("UNITS MM").is_wrong
    assert talk.program().startswith("UNITS RAD, MM ;")
    assert "30.00      0.00" not in "\n".join(frame_table_lines(talk))


def test_an_import_brings_arms() -> None:
    """A session that begins without a cell gets its arms from the first import that has some."""
    cell = cell_of("cell1")

    def read(name: str) -> ImportedFrames:
        if name != "cell.json":
            raise FileFormatError(Path(name), None, "", "no such file")
        return ImportedFrames(frames={frame: node.parent for frame, node in cell.frames.items()}, cell=cell)

    talk = Session(None, read_import=read)
    assert arm_lines(talk) == ["no arms: begin with `--cell`, or with an IMPORT of a cell"]
    assert codes(talk.enter("OPEN ARM_1")) == ["E302"]
    assert codes(talk.enter('IMPORT "cel.json"')) == ["E228"]
    assert not talk.enter('IMPORT "cell.json"').is_wrong
    assert trace(talk.enter("OPEN ARM_1")) == ["ARM_1 OPEN"]
    assert talk.enter("station").printed_lines == ("(1,0,0, 0,1,0, 0,0,1, 0.45,0,0)",)
    assert talk.enter('IMPORT "cell.json"').remarks == ("`cell.json` is imported already",)
    talk.undo(2)
    assert codes(talk.enter("OPEN ARM_1")) == ["E302"]


def test_the_old_language() -> None:
    """With the old standard nothing of the new one is taken, line numbers are, and a name shows its value."""
    talk = session("100 VAR f : FRAME ;", f"200 f = {ABOVE} ;", "300 MOVE ARM-1 TO f ;", std=Standard.RLO_83)

    assert talk.enter("f").printed_lines == ("(1,0,0, 0,-1,0, 0,0,-1, 0.4,0.15,0.2)",)
    assert codes(talk.enter("PRINT(f)")) == ["E214"]
    assert codes(talk.enter("VAR longernames : FRAME ;")) == ["E103"]
    assert "MOVE ARM_1 TO f ;" in talk.program()


# ---- what there is to see ------------------------------------------------------------------------------------------


def test_frames() -> None:
    """The tree shows who hangs on whom, places in the unit of the program, and turns about z, y and x."""
    talk = session(
        "UNITS MM ; VAR table, cup, nil : FRAME",
        "table = WORLD * XYZ(400, 0, 10) * ROTZ(90) ; AFFIX cup TO table AT XYZ(10, 20, 30) * ROTX(45)",
    )

    rows = [row.split() for row in frame_table_lines(talk)]

    assert rows[0] == ["frame", "x", "y", "z", "mm", "z", "y", "x", "deg"]
    assert ["table", "400.00", "0.00", "10.00", "90.00", "0.00", "0.00"] in rows
    assert ["cup", "380.00", "10.00", "40.00", "90.00", "0.00", "45.00"] in rows
    assert ["nil", "no", "value", "yet"] in rows
    lines = frame_table_lines(talk)
    assert any(line.startswith("    cup") for line in lines)
    assert any(line.startswith("  table") for line in lines)
    assert not any("BASE" in line for line in lines)


@pytest.mark.parametrize("angles", [(0.3, -0.4, 0.5), (3.0, 1.5, -2.0), (0.7, np.pi / 2, 0.0), (0.7, -np.pi / 2, 0.0)])
def test_turns(angles: tuple[float, float, float]) -> None:
    """Turning about z, the new y and the newest x gives the rotation back, also where two axes fall together."""
    z, y, x = angles

    def turn(axis: int, angle: float) -> np.ndarray:
        c, s = np.cos(angle), np.sin(angle)
        R = np.eye(3)
        a, b = (axis + 1) % 3, (axis + 2) % 3
        R[a, a], R[b, b], R[a, b], R[b, a] = c, c, -s, s
        return R

    np.testing.assert_allclose(zyx_angles(turn(2, z) @ turn(1, y) @ turn(0, x)), angles, atol=1e-7)


def test_arms() -> None:
    """Of an arm one sees its joints, where its hand is, what it holds and what hangs on it."""
    talk = session("VAR a : FRAME", f"a = {ABOVE} ; OPEN ARM_1 ; MOVE ARM_1 TO a ; GRASP ; AFFIX a TO ARM_1")

    head, joints, hand = arm_lines(talk)

    assert head == "ARM_1  stanford"
    assert joints.count("deg") == 5
    assert joints.count("mm") == 1
    assert hand.split() == ["hand", "at", "a,", "closed", "on", "a,", "carries", "a"]


# ---- time ----------------------------------------------------------------------------------------------------------


def test_time_of_a_statement() -> None:
    """A statement takes time in proportion to those before it: with ten times as many some ten times as long."""
    talk = session("VAR n : SCALAR ; f : FRAME", f"n = 0 ; f = {ABOVE}")
    shortest = []
    for count in (10, 90):
        for _ in range(count):
            talk.enter("n = n + 1")
            talk.enter("f = f * XYZ(0, 0, 0.001)")
        shortest.append(min(_seconds(talk) for _ in range(5)))

    assert talk.enter("n").printed_lines == ("110",)
    assert shortest[1] < 40 * shortest[0]


def _seconds(talk: Session) -> float:
    start = time.process_time()
    talk.enter("n = n + 1")
    return time.process_time() - start
