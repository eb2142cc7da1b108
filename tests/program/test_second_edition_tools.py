"""The second edition in the tools: sessions, the debugger, the formatter, and what editors show."""

import attrs
import pytest
from lsprotocol import types as lsp

from armwright.cell.signals import Input
from armwright.program.debugger.debugger import Command, Debugger
from armwright.program.debugger.expressions import ExpressionError
from armwright.program.formatter.format import formatted
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language.source import Source
from armwright.program.language_server.analysis import Analysis, Settings, analyse
from armwright.program.language_server.cell_lookup import CellCache
from armwright.program.language_server.completions import completions
from armwright.program.language_server.hover import hover
from armwright.program.language_server.semantic_tokens import KINDS, line_tokens
from armwright.program.language_server.signature_help import signature_help
from armwright.program.repl.session import Session
from program.running import cell_of, code_of

PROGRAM = """VAR n, k : SCALAR ; ok : BOOLEAN ; note : TEXT ;
CONST pitch = 20 ;
FUNCTION twice (a : SCALAR) : SCALAR ;
BEGIN
  a = 2 * a ;
  RETURN a
END ;
PROCEDURE count (INOUT c : SCALAR) ;
BEGIN
  c = c + 1
END ;
BEGIN
  n = twice(pitch) + 1 ;
  count(n) ;
  ok = n > 40 ;
  note = TEXT("n", n) ;
  TRY RAISE jam WITH note RECOVER (jam) PRINT(MESSAGE) END ;
  WHEN stop : n < 0 DO BRAKE ;
  WHEN stop OFF ;
  TIMER lap ON ;
  n = TIMER(lap) ;
  PRINT(n)
END.
"""


# ---- sessions ------------------------------------------------------------------------------------------------------


def test_session() -> None:
    """A session takes constants, functions and texts, shows values of all kinds, and is a program when it is kept."""
    session = Session(cell_of("cell1"))
    inputs = [
        "CONST pitch = 20",
        "VAR n : SCALAR ; ok : BOOLEAN ; s : TEXT",
        "FUNCTION twice (a : SCALAR) : SCALAR ;",
        "BEGIN RETURN 2 * a END",
        "n = twice(pitch)",
        "n",
        "twice(n) + 1",
        "ok = n > 1 AND TRUE",
        "ok",
        's = TEXT("n", n)',
        "s",
        '"plain"',
        "CONST pitch = 30",
        "twice(pitch)",
        "MAX(pitch, PI)",
    ]
    shown, waiting = [], ""
    for text in inputs:
        answer = session.enter(waiting + text)
        waiting = "" if answer.is_complete else f"{waiting}{text}\n"
        assert not answer.is_wrong, (text, answer.diagnostics)
        shown += answer.printed_lines if answer.is_complete else ()

    assert shown == ["40", "81", "true", "n 40", "plain", "60", "30"]


def test_wait_in_a_block_of_a_session() -> None:
    """The UNTIL of a WAIT ends no REPEAT: a block in which one stands is complete at its END."""
    session = Session(cell_of("cell1"))

    assert not session.enter("BEGIN\n  WAIT UNTIL TRUE ;").is_complete
    assert session.enter("BEGIN\n  WAIT UNTIL TRUE ;\n  PRINT(1)\nEND").is_complete


# ---- the debugger --------------------------------------------------------------------------------------------------


def stopped(text: str = PROGRAM) -> Debugger:
    """Stand in front of the first statement of a program."""
    cell = attrs.evolve(cell_of("cell1"), inputs={"DOOR": Input(start=1.0)})
    debugger = Debugger(code_of(text, cell), cell)
    debugger.begin()
    debugger.run_slice()
    # The constant comes first.
    assert line_after(debugger, "next") == 13
    return debugger


def line_after(debugger: Debugger, command: Command) -> int:
    debugger.resume(command)
    debugger.run_slice()
    return debugger.code.source.line(debugger.stack()[0].span.start)


def test_steps_into_over_and_out_of_a_function() -> None:
    """A step goes into a function where it is called, through its statements and back; another goes over it."""
    debugger = stopped()
    assert [line_after(debugger, command) for command in ("in", "in", "next", "next")] == [5, 6, 14, 15]
    assert [line_after(debugger, command) for command in ("back", "back")] == [14, 13]
    assert line_after(debugger, "in") == 5
    assert debugger.stack()[0].procedure == "TWICE"
    assert line_after(debugger, "out") == 14
    assert line_after(stopped(), "next") == 14


def test_values_of_expressions() -> None:
    """A watch calls functions of the program and reads inputs, and changes nothing."""
    debugger = stopped()
    line_after(debugger, "next")
    shown = [debugger.evaluate(text).value for text in ("twice(n) + pitch", "INPUT(door)", "n > 3", "TIME")]

    assert shown == ["102", "true", "true", "0"]
    assert [name for name in debugger.machine.state.values if "'" in name] == []
    with pytest.raises(ExpressionError):
        debugger.evaluate("count(n)")


def test_assigned_values() -> None:
    """Conditions and texts can be changed while a run stands still."""
    debugger = stopped()
    for slot, text in (("OK", "n > 2 OR TRUE"), ("NOTE", '"changed"')):
        if slot == "OK":
            line_after(debugger, "next")
        debugger.assign(slot, text)

    assert [debugger.evaluate(name).value for name in ("ok", "note")] == ["true", '"changed"']


# ---- the formatter -------------------------------------------------------------------------------------------------


def test_layout() -> None:
    """Words of the second edition are in upper case where they are words; as names they keep their spelling."""
    text = """const Pitch = 20; up = xyz(0,0,PITCH) ; var log, text: scalar ; s : text ; return : array [2] of boolean;
function Twice(a: scalar): scalar; begin return 2*a end;
procedure Add(inout n : scalar, in k: scalar); begin n = n+k end;
begin log = twice(1); TEXT = log ; return[1] = true; log "a"(text, LOG); add(log, 2) ; s = text("x", log);
wait until return[1] within 2 else begin print(1); halt end;
try pulse lamp for 200ms; raise jam with s recover(jam, timeout) operate valve to 2 end;
when Log : priority 2 : (text > 1) and input(door) do begin brake; when log off; resume end; when text=3 do text=4;
timer Cycle on; timer S to 2; text = timer(S)+timer(cycle);
wait until input(door) and text > 1
end."""

    assert formatted(Source("t.rlo", text)) == (
        """CONST Pitch = 20 ;
    up = XYZ(0, 0, Pitch) ;
VAR log, text : SCALAR ;
    s : TEXT ;
    return : ARRAY [2] OF BOOLEAN ;
FUNCTION Twice(a : SCALAR) : SCALAR ;
BEGIN
  RETURN 2 * a
END ;
PROCEDURE Add(INOUT n : SCALAR, IN k : SCALAR) ;
BEGIN
  n = n + k
END ;
BEGIN
  log = Twice(1) ;
  text = log ;
  return[1] = true ;
  LOG "a" (text, log) ;
  Add(log, 2) ;
  s = TEXT("x", log) ;
  WAIT UNTIL return[1] WITHIN 2
  ELSE
  BEGIN
    PRINT(1) ;
    HALT
  END ;
  TRY
    PULSE lamp FOR 200ms ;
    RAISE jam WITH s
  RECOVER (jam, timeout)
    OPERATE valve TO 2
  END ;
  WHEN Log : PRIORITY 2 : (text > 1) AND INPUT(door) DO
  BEGIN
    BRAKE ;
    WHEN log OFF ;
    RESUME
  END ;
  WHEN text = 3 DO
    text = 4 ;
  TIMER Cycle ON ;
  TIMER S TO 2 ;
  text = TIMER(S) + TIMER(cycle) ;
  WAIT UNTIL INPUT(door) AND text > 1
END.
"""
    )


# ---- editors -------------------------------------------------------------------------------------------------------


def analysis_of(text: str) -> Analysis:
    return analyse("t.rlo", PositionCodec(text), None, CellCache(), Settings(cell=None))


def shown_at(word: str, text: str = PROGRAM) -> str:
    answer = hover(analysis_of(text), text.index(word), markdown=False)
    assert answer is not None, word
    assert isinstance(answer.contents, lsp.MarkupContent)
    return answer.contents.value


@pytest.mark.parametrize(
    ("word", "says"),
    [
        ("CONST", "Declares constants"),
        ("pitch", "pitch : SCALAR"),
        ("twice(pitch)", "FUNCTION twice (a : SCALAR) : SCALAR"),
        ("count(n)", "PROCEDURE count (INOUT c : SCALAR)"),
        ("RETURN", "Ends a FUNCTION"),
        ("INOUT", "another name of the variable"),
        ("TEXT(", "the text that PRINT would write"),
        ("RAISE", "an error of the program's own"),
        ("jam)", "a kind of error of the program"),
        ("MESSAGE", "recovered from last"),
        ("BOOLEAN", "A condition"),
        ("WHEN", "comes true on a servo tick"),
        ("stop :", "the name of a WHEN"),
        ("TIMER", "Starts, stops or sets a timer"),
        ("lap ON", "TIMER(name) are its seconds"),
        ("lap)", "a timer:"),
        ("BRAKE", "stops the MOVE that it interrupts"),
        ("OFF", "Disarms a WHEN"),
    ],
)
def test_hover(word: str, says: str) -> None:
    """Each new word and name is explained where it stands."""
    assert says in shown_at(word)


def offered(written: str) -> list[str]:
    """Return what can be written where a text ends, behind the declarations of a program."""
    text = f"{PROGRAM[: PROGRAM.rindex('  PRINT(n)')]}  {written}"
    analysis = analysis_of(f"{text} END.")
    return [item.label for item in completions(PositionCodec(text), analysis, len(text), snippets=False)]


@pytest.mark.parametrize(
    ("written", "labels"),
    [
        ("n = ", {"n", "pitch", "twice", "SQRT", "TIME", "ANALOG"}),
        ("ok = ", {"ok", "TRUE", "NOT", "INPUT"}),
        ("note = ", {"note", "TEXT", "MESSAGE"}),
        ("", {"LOG", "PULSE", "RAISE", "WAIT", "WHEN", "RESUME", "TIMER"}),
        ("WHEN ", {"ok", "NOT", "PRIORITY", "INPUT"}),
        ("WHEN ok ", {"DO", "AND"}),
        ("WHEN ok DO ", {"MOVE", "BRAKE"}),
        ("TRY n = 1 RECOVER (", {"MOTION", "TIMEOUT"}),
        ("WAIT ", {"UNTIL"}),
        ("WAIT UNTIL ok ", {"WITHIN", "AND"}),
    ],
)
def test_completion(written: str, labels: set[str]) -> None:
    """What is offered is what may stand there."""
    assert labels <= set(offered(written))


def test_words_of_the_front() -> None:
    """In front of BEGIN the parts of the second edition are offered, and none of them in RLO-83."""
    text = "VAR n : SCALAR ; "
    analysis = analysis_of(f"{text} BEGIN n = 1 END.")

    assert {"CONST", "FUNCTION"} <= {
        item.label for item in completions(PositionCodec(text), analysis, len(text), snippets=False)
    }


def test_help_for_a_call() -> None:
    """While a function is called, its parameters are shown."""
    text = PROGRAM.replace("n = twice(pitch) + 1", "n = twice(")
    answer = signature_help(
        text, analysis_of(PROGRAM), text.index("twice(\n") + 6 if "twice(\n" in text else text.index("= twice(") + 8
    )

    assert answer is not None
    assert answer.signatures[0].label == "FUNCTION twice (a : SCALAR) : SCALAR"


def test_colours() -> None:
    """A word in its place has the colour of a keyword or a type, and the same word as a name that of a variable."""
    text = "CONST const = 1 ; VAR text : TEXT ;\nBEGIN text = TEXT(const) ; PRINT(text) END."
    kinds = {
        (line, token[0]): KINDS[token[2]] for line, row in enumerate(line_tokens(analysis_of(text))) for token in row
    }

    assert [kinds[0, text.index(word)] for word in ("CONST", "const =", "text :", "TEXT ;")] == [
        "keyword",
        "variable",
        "variable",
        "type",
    ]
