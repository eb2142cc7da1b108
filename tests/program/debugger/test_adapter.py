"""The debug adapter as an editor meets it: requests, answers and events."""

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from armwright.program.bytecode.assembler import assembly
from program.debugger.client import Client
from program.running import CORPUS, cell_of, code_of

P02, P08 = CORPUS / "p02.rlo", CORPUS / "p08.rlo"


@pytest.fixture
def client() -> Iterator[Client]:
    """Connect to an adapter, and end it whatever happens."""
    with Client() as client:
        yield client


@pytest.fixture
def process() -> Iterator[Client]:
    """Start ``armwright debug`` in a process of its own, and end it whatever happens."""
    with Client(process=True) as client:
        yield client


@pytest.fixture
def written(tmp_path: Path) -> Any:
    """Return what writes a program into a file."""

    def write(text: str) -> Path:
        path = tmp_path / "test.rlo"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_a_whole_session(process: Client) -> None:
    """Breakpoint, steps, frames as variables, a step back, a watched frame, and on to the end."""
    process.launch(P02, lines=(10,))
    stop = process.wait("stopped")
    assert (stop["reason"], process.line()) == ("breakpoint", 10)
    assert process.scope("Frames")["apf1"]["value"] == "no value yet"

    assert process.step("next")["reason"] == "step"
    frames = process.scope("Frames")
    assert frames["apf1"]["value"] == "(1,0,0, 0,-1,0, 0,0,-1, 0.4,0.15,0.15)"
    parts = process.inside(frames["apf1"])
    assert (parts["parent"]["value"], parts["p"]["value"]) == ("obj1", "(0.4, 0.15, 0.15)")
    assert process.inside(process.scope("Arms")["ARM_1"])["joint 4"]["value"].endswith(" deg")

    assert process.step("stepBack")["reason"] == "step"
    assert process.line() == 10
    assert process.scope("Frames")["apf1"]["value"] == "no value yet"

    process.step("next")
    process.step("next")
    info = process.ask("dataBreakpointInfo", name="apf1")
    assert info["accessTypes"] == ["write"]
    (bound,) = process.ask("setDataBreakpoints", breakpoints=[{"dataId": info["dataId"]}])["breakpoints"]
    assert bound["verified"]
    stop = process.step("continue")
    assert stop["reason"] == "data breakpoint"
    assert stop["hitBreakpointIds"] == [bound["id"]]
    assert stop["text"] == "apf1 begins to move with ARM_1"
    assert process.line() == 14

    process.ask("continue", threadId=1)
    assert process.wait("exited")["exitCode"] == 0
    process.wait("terminated")
    process.ask("disconnect")
    assert process.status() == 0
    assert process.errors() == ""


def test_what_it_can(client: Client) -> None:
    """Editors are told before the launch what can be asked for."""
    can = client.ask("initialize", adapterID="rlo")

    for what in ("StepBack", "DataBreakpoints", "SetVariable", "SteppingGranularity", "EvaluateForHovers"):
        assert can[f"supports{what}"] is True
    assert [one["filter"] for one in can["exceptionBreakpointFilters"]] == ["uncaught", "caught"]


def test_stages_and_ticks(client: Client) -> None:
    """A step by instruction is one servo tick; stepStage goes from one part of a MOVE to the next."""
    client.launch(P02, lines=(11,))
    client.wait("stopped")
    assert client.step("stepStage")["description"] == "ARM_1 begins PTP apf1"
    client.step("next", granularity="instruction")
    client.step("stepIn", granularity="instruction")
    assert client.scope("Run")["clock"]["value"] == "0.002 s"
    client.step("stepBack", granularity="instruction")
    assert client.scope("Run")["clock"]["value"] == "0.001 s"

    assert client.step("stepStage")["description"] == "ARM_1 begins LINE obj1"
    assert client.line() == 11


def test_two_arms_are_two_threads(client: Client) -> None:
    """The branches of a COBEGIN are threads with stacks of their own, and are told of when they begin and end."""
    client.launch(P08, "cell2", lines=(30,))
    stop = client.wait("stopped")
    threads = {one["name"]: one["id"] for one in client.ask("threads")["threads"]}
    assert list(threads) == ["program", "branch 1 (ARM_1)", "branch 2 (ARM_2)"]
    assert stop["threadId"] == threads["branch 2 (ARM_2)"]
    assert client.line(stop["threadId"]) == 30
    assert client.line(threads["branch 1 (ARM_1)"]) == 23
    assert client.line(1) == 12

    assert client.step("next", stop["threadId"])["threadId"] == stop["threadId"]
    assert client.line(stop["threadId"]) == 31


def test_reverse(client: Client) -> None:
    """A reverseContinue goes to the breakpoint before, and then to the start."""
    client.launch(P02, lines=(6, 9))
    client.wait("stopped")
    client.step("continue")
    assert client.step("reverseContinue")["reason"] == "breakpoint"
    assert client.line() == 6
    assert client.step("reverseContinue")["description"] == "back at the start"
    assert client.line() == 5


def test_an_error(client: Client, written: Any) -> None:
    """An error of the program is a stop at its place, with the message; going on ends the program with status 1."""
    program = written("VAR n : SCALAR ;\nBEGIN\n  n = 0 ;\n  PRINT(1 / n)\nEND.\n")
    client.launch(program)
    stop = client.wait("stopped")
    assert (stop["reason"], client.line()) == ("exception", 4)
    assert stop["text"] == "1 cannot be divided by 0"
    info = client.ask("exceptionInfo", threadId=1)
    assert (info["exceptionId"], info["breakMode"]) == ("E240", "unhandled")
    assert client.scope("Variables")["n"]["value"] == "0"

    client.ask("continue", threadId=1)
    said = client.wait("output")
    assert said["category"] == "stderr"
    assert said["output"].startswith("error[E240]: 1 cannot be divided by 0")
    assert client.wait("exited")["exitCode"] == 3


def test_errors_are_not_stopped_at_when_nobody_asks(client: Client, written: Any) -> None:
    """Without its filter an error ends the program at once."""
    program = written("VAR n : SCALAR ;\nBEGIN\n  n = 0 ;\n  PRINT(1 / n)\nEND.\n")
    client.ask("initialize")
    client.ask("setExceptionBreakpoints", filters=[])
    client.ask("launch", program=str(program), cell=str(CORPUS / "cell1.json"))
    client.ask("configurationDone")

    assert client.wait("exited")["exitCode"] == 3


def test_a_program_with_errors(client: Client, written: Any) -> None:
    """A program that cannot run fails the launch, and its messages are shown with their lines."""
    client.ask("initialize")
    program = written("BEGIN\n  OPNE ARM_1 ;\nEND.\n")
    assert client.refused("launch", program=str(program), cell=str(CORPUS / "cell1.json")) == "test.rlo: 1 error"
    assert "unknown statement `OPNE`" in client.wait("output")["output"]
    missing = client.refused("launch", program=str(program.with_name("none.rlo")), cell=str(CORPUS / "cell1.json"))
    assert "none.rlo" in missing
    os.mkfifo(pipe := str(program.with_name("pipe.rlo")))
    assert "expected a file, got a pipe" in client.refused("launch", program=pipe)
    assert "expected a file, got a pipe" in client.refused("launch", program=str(P02), cell=pipe)

    program.write_text("BEGIN\n  OPEN ARM_1\nEND.\n")
    assert "needs a cell" in client.refused("launch", program=str(program))
    client.ask("launch", program=str(program), cell=str(CORPUS / "cell1.json"), stopOnEntry=True)
    client.ask("configurationDone")
    assert client.wait("stopped")["reason"] == "entry"


def test_pause_of_an_endless_loop(client: Client, written: Any) -> None:
    """A loop that never ends can be paused; while it runs, what needs it to stand still is refused."""
    program = written("VAR n : SCALAR ;\nBEGIN\n  n = 0 ;\n  PRINT(n) ;\n  WHILE n = 0 DO\n    PAUSE 0.001\nEND.\n")
    client.launch(program)
    assert client.wait("output")["output"] == "0\n"
    assert client.refused("stackTrace", threadId=1) == "the program is running"
    assert client.refused("next", threadId=1) == "the program is running"
    assert client.ask("threads")["threads"][0]["name"] == "program"
    client.ask("pause", threadId=1)
    assert client.wait("stopped")["reason"] == "pause"
    assert client.line() in {4, 5, 6}
    assert client.refused("pause", threadId=1) == "the program is not running"

    frame = client.stack()[0]["id"]
    values = next(one for one in client.ask("scopes", frameId=frame)["scopes"] if one["name"] == "Variables")
    set_ = client.ask("setVariable", variablesReference=values["variablesReference"], name="n", value="2 + 1")
    assert set_["value"] == "3"
    client.ask("continue", threadId=1)
    assert client.wait("exited")["exitCode"] == 0


def test_disconnect_while_it_runs(process: Client, written: Any) -> None:
    """An editor can leave a program that never ends, and the process ends."""
    process.launch(written("VAR n : SCALAR ;\nBEGIN\n  n = 0 ;\n  WHILE n = 0 DO\n    n = 0\nEND.\n"))
    process.ask("disconnect")

    assert process.status() == 0
    assert process.errors() == ""


def test_terminate_and_restart(client: Client, written: Any) -> None:
    """A program can be begun again as its file is now, with the same breakpoints, and ended where it is."""
    program = written("VAR n : SCALAR ;\nBEGIN\n  n = 1 ;\n  PRINT(n)\nEND.\n")
    client.launch(program, lines=(4,))
    client.wait("stopped")
    program.write_text("VAR n : SCALAR ;\nBEGIN\n  n = 2 ;\n  PRINT(n)\nEND.\n")
    client.ask("restart")
    client.wait("stopped")
    assert (client.line(), client.value("n")) == (4, "2")
    client.ask("terminate")

    assert client.wait("exited")["exitCode"] == 130
    client.wait("terminated")


def test_printed_lines(client: Client, written: Any) -> None:
    """What a program prints is shown with its line, and only once however it is stepped through."""
    program = written('VAR n : SCALAR ;\nBEGIN\n  n = 2 ;\n  PRINT("n is", n) ;\n  n = 3 ;\n  n = 4\nEND.\n')
    client.launch(program, stopOnEntry=True)
    client.wait("stopped")
    for command in ("next", "next", "next", "stepBack", "next"):
        client.step(command)
    said = client.wait("output")

    assert (said["category"], said["output"], said["line"]) == ("stdout", "n is 2\n", 4)
    assert not [one for one in client.events if one["event"] == "output"]


def test_breakpoints_before_the_launch(client: Client) -> None:
    """Breakpoints set before the program is known are bound when it is, and the editor is told."""
    client.ask("initialize")
    asked = client.ask("setBreakpoints", source={"path": str(P02)}, breakpoints=[{"line": 12}])["breakpoints"]
    assert asked[0]["verified"] is False
    client.ask("launch", program=str(P02), cell=str(CORPUS / "cell1.json"))
    told = client.wait("breakpoint")["breakpoint"]
    assert (told["id"], told["verified"], told["line"]) == (asked[0]["id"], True, 13)
    client.ask("configurationDone")

    assert client.wait("stopped")["hitBreakpointIds"] == [told["id"]]


def test_breakpoints_of_another_file(client: Client) -> None:
    """A breakpoint in a file that is not debugged is none, and does not touch the others."""
    client.launch(P02, lines=(7,), stopOnEntry=True)
    client.wait("stopped")
    other = client.ask("setBreakpoints", source={"path": str(P08)}, breakpoints=[{"line": 5}])["breakpoints"]
    assert other[0]["verified"] is False
    assert client.step("continue")["reason"] == "breakpoint"
    assert client.line() == 7


def test_places_for_breakpoints(client: Client, written: Any) -> None:
    """Several statements in a line are several places to stop at."""
    program = written("VAR n : SCALAR ;\nBEGIN\n  n = 1 ; n = 2 ; n = 3\nEND.\n")
    client.launch(program, stopOnEntry=True)
    client.wait("stopped")
    places = client.ask("breakpointLocations", source={"path": str(program)}, line=3)["breakpoints"]
    assert [one["column"] for one in places] == [3, 11, 19]
    client.ask("setBreakpoints", source={"path": str(program)}, breakpoints=[{"line": 3, "column": 12}])
    client.step("continue")

    assert client.value("n") == "2"


def test_expressions_and_completions(client: Client) -> None:
    """The console works out expressions, prints the frame tree, and completes names."""
    client.launch(P02, lines=(11,))
    client.wait("stopped")
    assert client.value("DIST(obj1, obj2) > 0.1") == "true"
    assert client.value("frames").startswith("WORLD\n")
    assert "`nobody` is not declared" in client.refused("evaluate", expression="nobody")
    frame = client.stack()[0]["id"]
    hovered = client.ask("evaluate", expression="apf1", frameId=frame, context="hover")
    assert hovered["type"] == "FRAME on obj1"
    offered = client.ask("completions", text="DIST(ob", column=8, frameId=frame)["targets"]
    assert [one["label"] for one in offered] == ["obj1", "obj2"]
    assert client.ask("setExpression", expression="obj2", value="obj1 * t1")["value"].endswith("0.4,0.15,0.15)")


def test_assignments_in_the_console(client: Client, written: Any) -> None:
    """In the console `n = 7` gives a value, as in a program; in parentheses and in a watch it compares."""
    program = written(
        "VAR n : SCALAR ; a : ARRAY [2] OF SCALAR ;\nBEGIN\n  n = 1 ; a[1] = 2 ;\n  PRINT(n, a[1])\nEND.\n"
    )
    client.launch(program, lines=(4,))
    client.wait("stopped")

    def console(text: str) -> str:
        return str(client.ask("evaluate", expression=text, context="repl")["result"])

    assert [console("n = 7"), console("(n = 7)"), console("n"), console("a[1] = n * 2 ;"), console("a[n - 6]")] == [
        *("7", "true", "7", "14", "14")
    ]
    assert client.ask("evaluate", expression="n = 8", context="watch")["result"] == "false"
    assert client.refused("evaluate", expression="ARM_1 = 5", context="repl")


def test_language_and_strictness_of_a_launch(client: Client, written: Any) -> None:
    """A launch names language and strictness; without a cell the only one beside the program is meant."""
    text = (CORPUS / "p02.rlo").read_text(encoding="utf-8")
    program = written(text)
    (program.parent / "cell.json").write_text((CORPUS / "cell1.json").read_text(encoding="utf-8"))

    assert "1 error" in client.refused("launch", program=str(program), std="83", strict=True)
    client.ask("launch", program=str(program), std="83", stopOnEntry=True)


def test_arguments_of_a_launch(client: Client, written: Any) -> None:
    """A launch gives constants other values, of their types."""
    program = written(
        'CONST pitch = 25 ; title = "tray" ; VAR n : SCALAR ;\nBEGIN\n  n = 2 * pitch ; PRINT(title, n)\nEND.\n'
    )
    assert "expected a number" in client.refused("launch", program=str(program), arguments={"pitch": [1]})
    client.launch(program, lines=(3,), arguments={"PITCH": 20, "title": "box"})
    client.wait("stopped")

    assert client.ask("evaluate", expression="title")["result"] == '"box"'
    assert client.ask("evaluate", expression="2 * pitch")["result"] == "40"


def test_arrays_come_in_pieces(client: Client, written: Any) -> None:
    """Of a large array an editor can ask for some elements."""
    program = written("VAR a : ARRAY [100,100] OF SCALAR ;\nBEGIN\n  a[3,7] = 5 ;\n  PRINT(a[3,7])\nEND.\n")
    client.launch(program, lines=(4,))
    client.wait("stopped")
    array = client.scope("Variables")["a"]
    assert array["indexedVariables"] == 10000
    piece = client.ask(
        "variables", variablesReference=array["variablesReference"], filter="indexed", start=206, count=2
    )["variables"]

    assert [(one["name"], one["value"]) for one in piece] == [("[3,7]", "5"), ("[3,8]", "no value yet")]


def test_what_a_run_leaves(client: Client, tmp_path: Path) -> None:
    """With an output folder a run to its end leaves what `armwright run` leaves."""
    client.launch(P02, output=str(tmp_path / "out"), noDebug=True, stopOnEntry=True)
    client.wait("terminated")

    assert {path.name for path in (tmp_path / "out").iterdir()} >= {"motion.csv", "report.html", "frames.json"}


def test_what_a_failed_run_leaves(client: Client, tmp_path: Path, written: Any) -> None:
    """A program that could not go on leaves all up to its failure, marked with it."""
    program = written("VAR n : SCALAR ;\nBEGIN\n  PAUSE 0.1 ; n = 0 ;\n  PRINT(1 / n)\nEND.\n")
    client.launch(program, output=str(tmp_path / "out"), noDebug=True)
    client.wait("terminated")

    said = json.loads((tmp_path / "out" / "run.json").read_text())
    assert (said["ended"], said["exit_status"], said["error"]["code"]) == ("failed", 3, "E240")
    assert [one["code"] for one in said["diagnostics"]][-1:] == ["E240"]
    assert ": failed</title>" in (tmp_path / "out" / "report.html").read_text()


def test_lines_and_columns_from_0(client: Client) -> None:
    """An editor that counts from 0 is told places from 0."""
    client.ask("initialize", linesStartAt1=False, columnsStartAt1=False)
    client.ask("launch", program=str(P02), cell=str(CORPUS / "cell1.json"), stopOnEntry=True)
    (bound,) = client.ask("setBreakpoints", source={"path": str(P02)}, breakpoints=[{"line": 9}])["breakpoints"]
    assert (bound["line"], bound["column"]) == (9, 4)
    client.ask("configurationDone")
    client.wait("stopped")

    assert client.line() == 4


def test_columns_are_halves_of_words(client: Client, written: Any) -> None:
    """A character beyond the basic plane takes two columns, in what editors are told and in what they ask for."""
    program = written("VAR n : SCALAR ;\nBEGIN\n  { \U0001f916\U0001f916 } n = 1 ; { \U0001f600 } n = 2 ;\nEND.\n")
    client.launch(program, stopOnEntry=True)
    client.wait("stopped")

    (frame,) = client.stack()
    assert (frame["column"], frame["endColumn"]) == (12, 17)
    asked = [{"line": 3, "column": column} for column in (12, 13, 27)]
    bound = client.ask("setBreakpoints", source={"path": str(program)}, breakpoints=asked)["breakpoints"]
    assert [one["column"] for one in bound] == [12, 27, 27]
    (word,) = client.ask("completions", text="\U0001f916 DI", column=6)["targets"]
    assert (word["label"], word["start"]) == ("DIST", 4)


def test_what_was_imported_is_recorded(client: Client, tmp_path: Path, written: Any) -> None:
    """The record of a run that was debugged names the files that the program imported."""
    (tmp_path / "cell.json").write_bytes((CORPUS / "cell1.json").read_bytes())
    program = written('IMPORT "cell.json" ;\nBEGIN\n  OPEN ARM_1\nEND.\n')
    client.ask("initialize", adapterID="rlo")
    client.ask("launch", program=str(program), output=str(tmp_path / "out"))
    client.ask("configurationDone")
    client.wait("terminated")

    (imported,) = json.loads((tmp_path / "out" / "run.json").read_text())["inputs"]["imports"]
    assert Path(imported["path"]).name == "cell.json"


def test_code_that_was_written_out(client: Client, tmp_path: Path) -> None:
    """A file of code is debugged by the text of the program that it holds, which the editor asks for."""
    path = tmp_path / "p02.rlc"
    text = P02.read_text(encoding="utf-8")
    path.write_text(assembly(code_of(text, cell_of("cell1"))), encoding="utf-8")
    client.launch(path, stopOnEntry=True)
    client.wait("stopped")

    (frame,) = client.stack()
    number = frame["source"]["sourceReference"]
    assert client.ask("source", sourceReference=number)["content"].splitlines() == text.splitlines()
    for source, verified in (({"path": str(path)}, False), ({"sourceReference": number}, True)):
        (bound,) = client.ask("setBreakpoints", source=source, breakpoints=[{"line": 10}])["breakpoints"]
        assert bound["verified"] == verified
    assert client.step("continue")["reason"] == "breakpoint"
    assert client.line() == 10


ODD_REQUESTS: list[tuple[str, dict[str, Any], str]] = [
    ("fly", {}, "does not support the request `fly`"),
    ("stackTrace", {}, "threadId: missing"),
    ("stackTrace", {"threadId": "one"}, "expected an integer"),
    ("stackTrace", {"threadId": 77}, "there is no thread 77"),
    ("scopes", {"frameId": 10**30}, "there is no stack frame"),
    ("variables", {"variablesReference": -1}, "nothing to open"),
    ("setBreakpoints", {"source": 3}, "source: expected an object"),
    ("setBreakpoints", {"source": {}, "breakpoints": [1]}, "expected an object"),
    ("next", {"threadId": True}, "expected an integer"),
    ("next", {"threadId": 1, "granularity": "mile"}, "granularity: expected"),
    ("setDataBreakpoints", {"breakpoints": [{}]}, "dataId: missing"),
    ("evaluate", {"expression": ["n"]}, "expected a text"),
    ("evaluate", {"expression": "ARM_9"}, "the cell has no arm ARM_9"),
    ("launch", {"program": str(P02)}, "launched already"),
    ("setVariable", {"variablesReference": 1, "name": "n", "value": "1"}, "nothing to open"),
    ("completions", {"text": "", "column": None}, "column: missing"),
    ("exceptionInfo", {"threadId": 1}, "no error"),
]


def test_odd_requests(client: Client) -> None:
    """A request that makes no sense is answered with what is wrong with it, and the session goes on."""
    assert client.refused("next", threadId=1) == "no program has been launched"
    assert client.refused("launch") == "program: missing, expected a text"
    assert "std: expected 2 or 83" in client.refused("launch", program=str(P02), std="77")
    client.launch(P02, stopOnEntry=True)
    client.wait("stopped")
    for command, arguments, message in ODD_REQUESTS:
        assert message in client.refused(command, **arguments), command

    assert client.line() == 5


NOISE = (
    b"\r\n\r\n",
    b"Content-Length: 5\r\n\r\n{oops",
    b"Content-Length: 2\r\n\r\n[]",
    b"Content-Length: -7\r\n\r\n",
    b"Content-Length: many\r\n\r\n",
    b"Hello: there\r\n\r\n",
    b"Content-Length: 4\r\n\r\n\xff\xfe\xfd\xfc",
    b'Content-Length: 18\r\n\r\n{"type":"request"}',
    b'Content-Length: 33\r\n\r\n{"type":"event","event":"unasked"}'[:-1],
    b"Content-Length: 200000\r\n\r\n" + b"[" * 200000,
)


def test_noise(client: Client) -> None:
    """What is no request at all is answered or passed over; the next request is understood."""
    for noise in NOISE:
        client.raw(noise)
        assert client.ask("initialize")["supportsStepBack"] is True


def test_requests_in_pieces(client: Client) -> None:
    """A request may come byte by byte."""
    body = json.dumps({"seq": 1, "type": "request", "command": "threads"}).encode()
    for byte in b"content-length: %d\n\n%s" % (len(body), body):
        client.raw(bytes([byte]))

    assert client.answer(1)["success"]


def test_the_editor_goes(process: Client) -> None:
    """When the editor's end of the stream is closed the debugger ends."""
    process.launch(P02, stopOnEntry=True)
    process.wait("stopped")
    process.hang_up()

    assert process.status() == 0
    assert process.errors() == ""
