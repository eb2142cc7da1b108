"""The debugger: where it stops, what it shows then, and how it goes back."""

import numpy as np
import pytest

from armwright.cell.simulator import Simulator
from armwright.program.debugger.breakpoints import HitConditionError
from armwright.program.debugger.debugger import Command, Debugger, DebuggerError
from armwright.program.debugger.expressions import ExpressionError
from armwright.program.debugger.stop_reason import Stop
from armwright.program.debugger.variables import Variable
from armwright.program.language.words import Standard
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.machine import Limits
from program.running import cell_of, code_of, corpus_text, down

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

HEAD = "VAR f, g : FRAME ;\n    n, m : SCALAR ;\n    t : TRANS ;\n    e : EVENT ;\n"
CALLS = (
    "PROCEDURE add(k : SCALAR, p : FRAME) ;\nVAR double : SCALAR ;\nBEGIN\n  double = 2 * k ;\n"
    "  p = p * XYZ(0, 0, double) ;\nEND ;\nVAR a : FRAME ;\n    n : SCALAR ;\nBEGIN\n"
    "  a = (1,0,0, 0,1,0, 0,0,1, 0,0,0) ;\n  n = 1 ;\n  add(n, a) ;\n  n = 2 ;\n  add(n, a) ;\n  PRINT(n)\nEND.\n"
)
LOOP = "VAR i, n : SCALAR ;\nBEGIN\n  n = 0 ;\n  FOR i = 1 TO 5 DO\n    n = n + i ;\n  PRINT(n)\nEND.\n"
# Places are given in the programs to so many digits.
ROUNDING = 1e-9


def load(text: str, cell: str = "cell1", limits: Limits | None = None) -> Debugger:
    """Load a program and stand in front of its first statement."""
    place = cell_of(cell)
    debugger = Debugger(code_of(text, place), place, limits)
    debugger.begin()
    stop = debugger.run_slice()
    assert stop is not None
    assert stop.reason == "entry"
    return debugger


def run(debugger: Debugger, command: Command, path: tuple[int, ...] = ()) -> Stop:
    """Let the run go on to its next stop."""
    debugger.resume(command, path)
    stop = debugger.run_slice()
    assert stop is not None
    return stop


def line(debugger: Debugger, path: tuple[int, ...] = ()) -> int:
    return debugger.code.source.line(debugger.stack(path)[0].span.start)


def lines(debugger: Debugger, command: Command, count: int) -> list[int]:
    """Make so many steps; return the lines they end in."""
    found = []
    for _ in range(count):
        stop = run(debugger, command)
        found.append(line(debugger, stop.path))
    return found


def inside(shown: Variable) -> dict[str, Variable]:
    assert shown.children is not None
    return {one.name: one for one in shown.children()}


def scope(debugger: Debugger, name: str, path: tuple[int, ...] = (), level: int = 0) -> dict[str, Variable]:
    (one,) = (one for one in debugger.scopes(path, level) if one.name == name)
    return inside(one)


def printed(debugger: Debugger) -> list[str]:
    return [str(one.data["printed"]) for one in debugger.machine.state.effects if one.kind == "PRINT"]


# ---- steps ---------------------------------------------------------------------------------------------------------


def test_next_goes_over_calls() -> None:
    """A step over a call ends at the statement behind it, with all that the procedure did."""
    debugger = load(CALLS)

    assert lines(debugger, "next", 4) == [11, 12, 13, 14]
    np.testing.assert_allclose(debugger.view.state.tree.world("A")[:3, 3], (0, 0, 2), atol=ROUNDING)


def test_in_goes_into_calls_and_out_comes_back() -> None:
    """A step into a call ends at the first statement of the procedure; a step out at the one behind the call."""
    debugger = load(CALLS)
    lines(debugger, "next", 2)

    assert lines(debugger, "in", 1) == [4]
    assert [frame.title for frame in debugger.stack()] == ["add", "program"]
    assert debugger.code.source.line(debugger.stack()[1].span.start) == 12
    assert lines(debugger, "out", 1) == [13]


def test_locals() -> None:
    """In a procedure its parameters and variables are seen, by value or as the caller's; outside they are not."""
    debugger = load(CALLS)
    lines(debugger, "next", 2)
    lines(debugger, "in", 2)

    own = scope(debugger, "Locals")
    assert (own["k"].value, own["double"].value) == ("1", "2")
    assert debugger.evaluate("k + double").value == "3"
    assert inside(own["p"])["p"].value == "(0, 0, 0)"
    assert debugger.evaluate("n", (), 1).value == "1"
    with pytest.raises(ExpressionError, match="`k` is not declared"):
        debugger.evaluate("k", (), 1)


def test_loop_is_one_stop_per_pass() -> None:
    """Stepping through a FOR stops once in front of it, then at its body and its head in turn."""
    debugger = load(LOOP)

    assert lines(debugger, "next", 6) == [4, 5, 4, 5, 4, 5]
    assert debugger.evaluate("i").value == "3"


def test_whole_program_by_steps_is_the_same_run() -> None:
    """Whichever way a program is gone through, what it leaves is what a run without a debugger leaves."""
    cell = cell_of("cell2")
    text = corpus_text("p08")
    expected = interpret(code_of(text, cell), cell, Simulator(cell))
    debugger = load(text, "cell2")
    while not debugger.has_ended:
        run(debugger, "in")
    recording = debugger.machine.recording()

    assert recording.trace() == expected.trace()
    for one, other in zip(recording.streams, expected.streams, strict=True):
        np.testing.assert_array_equal(one.q, other.q)


def test_stages() -> None:
    """A step by stage stops where each part of a MOVE begins, and in front of the statement behind it."""
    debugger = load(corpus_text("p02"))
    lines(debugger, "next", 6)
    texts = [run(debugger, "stage").text for _ in range(3)]

    assert texts == ["ARM_1 begins PTP apf1", "ARM_1 begins LINE obj1", ""]
    assert line(debugger) == 13


def test_ticks_show_the_arm_on_its_way() -> None:
    """A step by tick is one period of the servo; the arm is shown where it is, the program's own table stays."""
    debugger = load(corpus_text("p02"))
    lines(debugger, "next", 6)
    run(debugger, "stage")
    before = debugger.machine.state.tree.world("ARM_1")
    run(debugger, "stage")
    begun = debugger.time
    for count in range(1, 4):
        run(debugger, "tick")
        assert debugger.time == pytest.approx(begun + count * debugger.machine.cell.period)
    configuration = debugger.machine.hardware.configuration("ARM_1", debugger.time)
    cell = debugger.machine.cell.arms["ARM_1"]

    from armwright.kinematics.forward_kinematics import forward

    np.testing.assert_allclose(
        debugger.view.state.tree.world("ARM_1"), cell.base @ forward(cell.arm, configuration), atol=ROUNDING
    )
    np.testing.assert_array_equal(debugger.machine.state.tree.world("ARM_1"), before)
    assert line(debugger) == 11


def test_what_hangs_on_an_arm_is_shown_moving() -> None:
    """In the middle of a motion a frame that hangs on the hand is shown as far from it as ever."""
    debugger = load(corpus_text("p02"))
    lines(debugger, "next", 8)
    run(debugger, "stage")
    for _ in range(200):
        run(debugger, "tick")
    tree = debugger.view.state.tree

    assert np.linalg.norm(tree.world("APF1")[:3, 3] - down(0.40, 0.15, 0.15)[:3, 3]) > 1e-3
    np.testing.assert_allclose(tree.world("APF1")[:3, 3] - tree.world("ARM_1")[:3, 3], (0, 0, 0.1), atol=1e-6)


# ---- back ----------------------------------------------------------------------------------------------------------


def test_every_step_back_is_where_a_step_forward_was() -> None:
    """Steps back lead through the same places, values and frames as the steps forward, in opposite order."""
    debugger = load(corpus_text("p02"))
    way = []
    while True:
        way.append((line(debugger), debugger.time, debugger.evaluate("frames").value))
        if run(debugger, "next").has_ended:
            break
    back = []
    for _ in way:
        run(debugger, "back")
        back.append((line(debugger), debugger.time, debugger.evaluate("frames").value))

    assert back == way[::-1]


def test_back_over_a_call() -> None:
    """A step back behind a call ends in front of the call, and from inside a procedure at the call in the end."""
    debugger = load(CALLS)
    lines(debugger, "next", 3)
    assert lines(debugger, "back", 1) == [12]
    lines(debugger, "in", 2)

    assert lines(debugger, "back", 2) == [4, 12]


def test_back_to_the_start() -> None:
    """In front of the first statement there is nothing to go back to."""
    debugger = load(LOOP)

    assert run(debugger, "back").reason == "start"
    assert lines(debugger, "next", 1) == [4]


def test_tick_back() -> None:
    """A tick back is the moment before: the same place of the arm as one tick forward came from."""
    debugger = load(corpus_text("p02"))
    lines(debugger, "next", 6)
    places = []
    for _ in range(4):
        run(debugger, "tick")
        places.append(debugger.view.state.tree.world("ARM_1"))
    for expected in places[-2::-1]:
        run(debugger, "tick back")
        np.testing.assert_array_equal(debugger.view.state.tree.world("ARM_1"), expected)


def test_reverse_finds_the_last_breakpoint() -> None:
    """Going back stops at the last passage of a breakpoint, then the one before, then at the start."""
    debugger = load(LOOP)
    debugger.add_breakpoint(5)
    for _ in range(4):
        run(debugger, "continue")
    values = []
    while (stop := run(debugger, "reverse")).reason == "breakpoint":
        values.append(debugger.evaluate("i").value)

    assert values == ["3", "2", "1"]
    assert stop.reason == "start"


def test_back_after_the_end() -> None:
    """A program that is over can be taken back, and goes on from there to the same end."""
    debugger = load(LOOP)
    assert run(debugger, "continue").reason == "end"
    with pytest.raises(DebuggerError, match="has ended"):
        run(debugger, "next")

    assert lines(debugger, "back", 2) == [7, 6]
    assert run(debugger, "continue").reason == "end"
    assert printed(debugger) == ["15"]


def test_long_runs_are_taken_back_soon() -> None:
    """A step back from the end of a long run does not run it again from the start."""
    import time

    text = "VAR i, n : SCALAR ; BEGIN n = 0 ; FOR i = 1 TO 60000 DO n = n + i ; PRINT(n) END."
    debugger = load(text)
    begun = time.perf_counter()
    run(debugger, "continue")
    whole = time.perf_counter() - begun
    begun = time.perf_counter()
    run(debugger, "back")

    assert time.perf_counter() - begun < whole / 2


# ---- breakpoints ---------------------------------------------------------------------------------------------------


def test_breakpoint_moves_to_a_statement() -> None:
    """A breakpoint in a line without a statement goes to the next that has one; behind the last it is none."""
    debugger = load(CALLS)

    first, last, inner = debugger.add_breakpoint(7), debugger.add_breakpoint(99), debugger.add_breakpoint(2)
    assert first.start is not None
    assert first.start.line == 10
    assert last.start is None
    assert last.message == "no statement begins on this line or below"
    assert inner.start is not None
    assert inner.start.line == 4


def test_breakpoint_in_a_procedure() -> None:
    """A breakpoint in a procedure stops each call of it."""
    debugger = load(CALLS)
    debugger.add_breakpoint(5)

    values = []
    while run(debugger, "continue").reason == "breakpoint":
        values.append(debugger.evaluate("double").value)
    assert values == ["2", "4"]


def test_conditions_and_counts() -> None:
    """A breakpoint stops where its condition is true, or at the passages that its count names."""
    for more, expected in (
        ({"condition": "i > 2 AND n < 10"}, ["3", "4"]),
        ({"hit_condition": "2"}, ["2"]),
        ({"hit_condition": "% 2"}, ["2", "4"]),
        ({"hit_condition": ">= 4"}, ["4", "5"]),
    ):
        debugger = load(LOOP)
        debugger.add_breakpoint(5, **more)
        seen = []
        while run(debugger, "continue").reason == "breakpoint":
            seen.append(debugger.evaluate("i").value)
        assert seen == expected


def test_conditions_that_make_no_sense() -> None:
    """A breakpoint with a condition that makes no sense is none, and says why."""
    debugger = load(LOOP)

    assert debugger.add_breakpoint(5, condition="i >").message == "expected a value after `>`"
    assert debugger.add_breakpoint(5, condition="k = 1").message.startswith("`k` is not declared")
    assert debugger.add_breakpoint(5, condition="XYZ(1,2,3)").message.startswith("expected a condition")
    assert (
        debugger.add_breakpoint(5, hit_condition="often").message
        == "expected a count such as `3`, `>= 3` or `% 3`, got `often`"
    )
    with pytest.raises(HitConditionError, match="expected a count"):
        debugger.add_watch("N", hit_condition="-1")
    assert run(debugger, "continue").reason == "end"


def test_lines_and_values_out_of_range() -> None:
    """A line below 1 stops nothing, and a number beyond the language's is not assigned."""
    debugger = load(LOOP)

    assert debugger.add_breakpoint(0).message == "lines are numbered from 1, got 0"
    assert debugger.add_breakpoint(-5).start is None
    with pytest.raises(ExpressionError, match="`1e101` is not a number of RLO"):
        debugger.assign("N", "1e101")


def test_a_condition_without_a_value_stops() -> None:
    """Where the condition of a breakpoint has no value, the run stops and says so."""
    debugger = load("VAR i, n : SCALAR ;\nBEGIN\n  i = 1 ;\n  n = 2 ;\n  PRINT(n, i)\nEND.")
    debugger.add_breakpoint(4, condition="n = 2")

    stop = run(debugger, "continue")
    assert stop.reason == "breakpoint"
    assert "`n` is used before it has a value" in stop.text


def test_log_points() -> None:
    """A breakpoint with something to say says it and does not stop."""
    debugger = load(LOOP)
    debugger.add_breakpoint(5, log_message="{i} of 5, n = {n * 10}")

    assert run(debugger, "continue").reason == "end"
    assert [text for text, _ in debugger.take_log_messages()] == [
        f"{i} of 5, n = {10 * n}" for i, n in zip("12345", (0, 1, 3, 6, 10), strict=True)
    ]


def test_watched_variable() -> None:
    """A watched variable stops the run where it changes, behind the statement, and nowhere else."""
    debugger = load(LOOP)
    debugger.add_watch("N")

    texts = []
    while (stop := run(debugger, "continue")).reason == "data breakpoint":
        texts.append(stop.text)
    assert texts == ["n = 0", "n = 1, was 0", "n = 3, was 1", "n = 6, was 3", "n = 10, was 6", "n = 15, was 10"]


def test_watched_frame_on_an_arm() -> None:
    """A watched frame stops the run at the first tick at which it moves, also because its parent does; once a MOVE."""
    debugger = load(corpus_text("p02"))
    lines(debugger, "next", 7)
    debugger.add_watch("APF1")
    stop = run(debugger, "continue")

    assert stop.text == "apf1 begins to move with ARM_1"
    assert line(debugger) == 14
    motion = debugger.machine.state.program.motion
    assert motion is not None
    assert 1 <= debugger.view.state.ticks - motion.start.tick < 20
    assert run(debugger, "continue").reason == "end"


def test_watched_frame_that_is_placed() -> None:
    """A frame moves when the frame that it hangs on is given another place, and not when it is hung elsewhere."""
    debugger = load(
        "VAR f, g : FRAME ;\nBEGIN\n  f = (1,0,0, 0,1,0, 0,0,1, 0,0,0) ;\n  g = f * XYZ(0, 0, 1) ;\n"
        "  AFFIX g TO f ;\n  f = f * XYZ(1, 0, 0) ;\n  UNFIX g ;\n  f = f * XYZ(1, 0, 0) ;\nEND.\n"
    )
    debugger.add_watch("G")

    stops = [run(debugger, "continue") for _ in range(3)]
    assert [stop.text for stop in stops] == ["g has a value", "g has moved", ""]
    assert [stop.reason for stop in stops] == ["data breakpoint", "data breakpoint", "end"]


def test_reverse_to_a_movement() -> None:
    """Going back stops at the tick at which a watched frame began to move, and going on from there passes it."""
    debugger = load(corpus_text("p02"))
    lines(debugger, "next", 9)
    debugger.add_watch("OBJ1")

    stop = run(debugger, "reverse")
    assert stop.text == "obj1 begins to move with ARM_1"
    assert line(debugger) == 14
    assert run(debugger, "continue").reason == "end"


# ---- processes -----------------------------------------------------------------------------------------------------


def test_branches_have_stacks_of_their_own() -> None:
    """In a COBEGIN each branch is where it is, and the program waits at the COBEGIN."""
    debugger = load(corpus_text("p08"), "cell2")
    debugger.add_breakpoint(26)
    stop = run(debugger, "continue")

    assert stop.path == (1,)
    assert [one.title for one in debugger.processes] == ["program", "branch 1", "branch 2"]
    assert [line(debugger, one.path) for one in debugger.processes] == [12, 14, 26]


def test_steps_of_one_branch() -> None:
    """Steps of one branch stop in its statements only, while the other goes on beside it."""
    debugger = load(corpus_text("p08"), "cell2")
    debugger.add_breakpoint(25)
    run(debugger, "continue")
    seen = []
    for _ in range(4):
        stop = run(debugger, "next", (1,))
        seen.append((stop.path, line(debugger, (1,))))

    assert seen == [((1,), 27), ((1,), 28), ((1,), 29), ((1,), 30)]
    assert line(debugger, (0,)) == 23


def test_a_step_in_front_of_a_cobegin() -> None:
    """A step into a COBEGIN ends in its first branch; a step over it behind the COEND."""
    text = "VAR n : SCALAR ;\nBEGIN\n  COBEGIN\n    BEGIN\n      n = 1\n    END ;\n    BEGIN\n      PAUSE 1\n    END\n"
    text += "  COEND ;\n  PRINT(n)\nEND.\n"
    debugger = load(text)
    stop = run(debugger, "in")
    assert (stop.path, line(debugger, stop.path)) == ((0,), 5)
    run(debugger, "back", (0,))
    assert line(debugger) == 3
    stop = run(debugger, "next")

    assert (stop.path, line(debugger), debugger.time) == ((), 11, 1.0)


def test_a_branch_that_ends() -> None:
    """A step behind the last statement of a branch ends where the program that began it goes on."""
    debugger = load(corpus_text("p08"), "cell2")
    debugger.add_breakpoint(36)
    run(debugger, "continue")
    stops = [run(debugger, "next", (1,)) for _ in range(2)]

    assert [stop.path for stop in stops] == [(1,), ()]
    assert line(debugger) == 39


def test_waiting_is_one_statement() -> None:
    """A WAIT that has to wait is not begun a second time when its event comes."""
    debugger = load(corpus_text("p08"), "cell2")
    debugger.add_breakpoint(27)

    assert run(debugger, "continue").reason == "breakpoint"
    assert run(debugger, "continue").reason == "end"


# ---- errors --------------------------------------------------------------------------------------------------------


FAR = (
    "VAR f : FRAME ;\nBEGIN\n  f = (1,0,0, 0,-1,0, 0,0,-1, 9, 0, 0.2) ;\n  OPERATE lamp ;\n  MOVE ARM_1 TO f ;\nEND.\n"
)


def test_an_error_stops_at_its_place() -> None:
    """An error stops the run in front of what went wrong, with all as it was; then the program is over."""
    debugger = load(FAR)
    stop = run(debugger, "continue")

    assert stop.reason == "exception"
    assert stop.diagnostic is not None
    assert stop.diagnostic.code == "E402"
    assert line(debugger) == 5
    assert debugger.machine.hardware.active_devices() == {"LAMP"}
    assert inside(debugger.evaluate("f"))["p"].value == "(9, 0, 0.2)"
    assert run(debugger, "continue").reason == "failed"
    assert debugger.machine.hardware.active_devices() == frozenset()
    assert lines(debugger, "back", 1) == [5]


def test_an_error_in_a_procedure_shows_the_stack() -> None:
    """Where a procedure went wrong, its stack and its variables are still there."""
    debugger = load(
        "PROCEDURE part(k : SCALAR) ;\nVAR r : SCALAR ;\nBEGIN\n  r = 1 / k\nEND ;\n"
        "BEGIN\n  part(1) ;\n  part(0)\nEND.\n"
    )
    stop = run(debugger, "continue")

    assert stop.diagnostic is not None
    assert stop.diagnostic.code == "E240"
    assert [frame.title for frame in debugger.stack()] == ["part", "program"]
    assert debugger.evaluate("k").value == "0"


def test_errors_with_a_recovery() -> None:
    """An error with a RECOVER stops the run only when that is asked for."""
    text = "VAR n : SCALAR ;\nBEGIN\n  n = 0 ;\n  TRY\n    n = 1 / n\n  RECOVER\n    n = 7\n  END ;\n  PRINT(n)\nEND.\n"
    quiet = load(text)
    assert run(quiet, "continue").reason == "end"
    debugger = load(text)
    debugger.execution.exception_filters = frozenset({"uncaught", "caught"})
    stop = run(debugger, "continue")

    assert (stop.reason, stop.caught, line(debugger)) == ("exception", True, 5)
    assert lines(debugger, "next", 1) == [7]
    assert run(debugger, "continue").reason == "end"


def test_processes_that_wait_for_ever() -> None:
    """A deadlock stops the run at the processes that wait."""
    debugger = load("VAR e : EVENT ; n : SCALAR ;\nBEGIN\n  n = 0 ;\n  IF n = 1 THEN SIGNAL e ;\n  WAIT e\nEND.\n")
    stop = run(debugger, "continue")

    assert stop.diagnostic is not None
    assert stop.diagnostic.code == "E501"
    assert line(debugger) == 5


def test_an_error_on_the_way() -> None:
    """An error in the middle of a motion of the other arm leaves that arm where it was then."""
    text = HEAD.replace("t : TRANS ;", "") + (
        "BEGIN\n  g = (1,0,0, 0,-1,0, 0,0,-1, 0.70,0.15,0.20) ;\n  COBEGIN\n"
        "    BEGIN PAUSE 0.3 ; n = 1 / (m * 0) END ;\n    BEGIN MOVE ARM_2 TO g END\n  COEND\nEND.\n"
    )
    text = text.replace("BEGIN\n  g", "BEGIN\n  m = 0 ;\n  g", 1)
    debugger = load(text, "cell2")
    stop = run(debugger, "continue")

    assert stop.reason == "exception"
    assert stop.path == (0,)
    assert debugger.time == pytest.approx(0.3)
    assert line(debugger, (1,)) == 10
    hand = debugger.view.state.tree.world("ARM_2")[:3, 3]
    assert np.linalg.norm(hand - debugger.machine.state.tree.world("ARM_2")[:3, 3]) > 1e-3


# ---- looking and changing ------------------------------------------------------------------------------------------


def test_what_a_frame_shows() -> None:
    """A frame is shown as the program would write it, and opened to its columns, its parent and the relation."""
    debugger = load(corpus_text("p02"))
    lines(debugger, "next", 6)
    shown = scope(debugger, "Frames")["apf1"]

    assert shown.value == "(1,0,0, 0,-1,0, 0,0,-1, 0.4,0.15,0.15)"
    assert shown.type == "FRAME on obj1"
    parts = inside(shown)
    assert [parts[one].value for one in "noap"] == ["(1, 0, 0)", "(0, -1, 0)", "(0, 0, -1)", "(0.4, 0.15, 0.15)"]
    assert parts["parent"].value == "obj1"
    assert parts["relation"].value == "(1,0,0, 0,1,0, 0,0,1, 0,0,-0.1)"
    assert parts["set in line"].value == "10"


def test_what_an_arm_shows() -> None:
    """An arm shows its joints in degrees and millimetres, its hand, and the stage that it is in."""
    debugger = load(corpus_text("p02"))
    lines(debugger, "next", 6)
    run(debugger, "stage")
    shown = inside(scope(debugger, "Arms")["ARM_1"])

    q = debugger.machine.cell.arms["ARM_1"].start
    assert shown["joint 2"].value == f"{np.degrees(q[1]):.6g} deg"
    assert shown["joint 3"].value == f"{q[2] * 1e3:.6g} mm"
    assert inside(shown["hand"])["p"].value == "(0.45, 0, 0.25)"
    assert shown["moves"].value.startswith("PTP apf1 of line 11, 0.000 s of ")


def test_forces_and_moments() -> None:
    """An arm that presses shows force and moment; ZERO FORCE is taken back by a step back."""
    program = corpus_text("p07").replace("depth = DIST", "ZERO FORCE ARM_1 ; depth = DIST")
    assert "ZERO FORCE" in program
    debugger = load(program, "jam")
    while "ZERO" not in program.splitlines()[line(debugger) - 1]:
        run(debugger, "next")
    pressed = scope(debugger, "Arms")["ARM_1"]
    force = debugger.evaluate("FORCE(Z)").value
    assert float(force) > 8
    assert inside(pressed)["force"].value.endswith(f" {float(force):.6g}) N")
    assert inside(pressed)["torque"].value.endswith(") N m")
    assert abs(float(debugger.evaluate("TORQUE(Z)").value)) < 1e-9

    run(debugger, "next")

    assert float(debugger.evaluate("FORCE(Z)").value) == 0
    run(debugger, "back")
    assert debugger.evaluate("FORCE(Z)").value == force


def test_units() -> None:
    """Lengths are shown in the unit of the program."""
    debugger = load("UNITS MM ;\nVAR f : FRAME ;\nBEGIN\n  f = (1,0,0, 0,1,0, 0,0,1, 400,0,20) ;\n  PRINT(f)\nEND.\n")
    run(debugger, "next")

    assert inside(debugger.evaluate("f"))["p"].value == "(400, 0, 20)"
    assert debugger.evaluate("DIST(f, f * XYZ(0, 3cm, 0))").value == "30"


def test_arrays() -> None:
    """An array opens to its elements, by their indices."""
    debugger = load(corpus_text("p05"))
    debugger.add_breakpoint(18)
    run(debugger, "continue")
    slots = scope(debugger, "Variables")["slot"]

    assert (slots.type, slots.element_count) == ("ARRAY [2,3] OF FRAME", 6)
    assert list(inside(slots)) == ["[1,1]", "[1,2]", "[1,3]", "[2,1]", "[2,2]", "[2,3]"]
    assert inside(inside(slots)["[2,3]"])["p"].value == "(480, -80, 40)"
    assert debugger.evaluate("slot[row, 1]").slot == "SLOT[1,1]"


def test_expressions() -> None:
    """Any expression of the language has its value; what has none says why."""
    debugger = load(corpus_text("p02"))
    lines(debugger, "next", 6)

    assert debugger.evaluate("DIST(obj1, apf1) * 10").value == "1"
    assert debugger.evaluate("INV(obj1) * apf1").value == "(1,0,0, 0,1,0, 0,0,1, 0,0,-0.1)"
    assert debugger.evaluate("2 > 1 AND NOT 3 = 4").value == "true"
    assert debugger.evaluate("ARM_1").type == "FRAME on the base of ARM_1"
    assert "      apf1  (0.4, 0.15, 0.15) m" in debugger.evaluate("frames").value.splitlines()
    for text, message in (
        ("obj1 *", "expected a value after"),
        ("obj1 + 1", "`\\+` has no meaning between"),
        ("DIST(obj1, nobody)", "`nobody` is not declared"),
        ("1 / 0", "cannot be divided by 0"),
        ("1 2", "`2` does not belong here"),
        ("", "expected a value"),
    ):
        with pytest.raises(ExpressionError, match=message):
            debugger.evaluate(text)


def test_names_that_are_words_of_the_newer_language() -> None:
    """In a program of RLO-83 a frame may be called `on`; it is found, and expressions can do all they can elsewhere."""
    text = (
        "VAR on, wait : FRAME ;\n    step : SCALAR ;\nBEGIN\n  step = 50 ;\n"
        "  on = (1,0,0, 0,-1,0, 0,0,-1, 0.4,0,0.1) ;\n"
        "  wait = (1,0,0, 0,-1,0, 0,0,-1, 0.4,0,0.3) ;\n  OPEN ARM_1 ;\nEND.\n"
    )
    cell = cell_of("cell1")
    debugger = Debugger(code_of(text, cell, std=Standard.RLO_83), cell)
    debugger.begin()
    debugger.run_slice()
    lines(debugger, "next", 3)

    assert debugger.evaluate("DIST(on, wait)").value == "0.2"
    assert debugger.evaluate("step > 3 AND step < 99").value == "true"
    assert debugger.add_breakpoint(7, condition="step = 51").start is not None


def test_looking_changes_nothing() -> None:
    """A run in which everything was looked at on the way leaves what a run without that leaves."""
    cell = cell_of("cell1")
    expected = interpret(code_of(corpus_text("p02"), cell), cell, Simulator(cell))
    debugger = load(corpus_text("p02"))
    while not run(debugger, "stage").has_ended:
        for one in debugger.scopes():
            for shown in inside(one).values():
                if shown.children is not None:
                    list(shown.children())
        debugger.evaluate("ARM_1 * XYZ(0, 0, 1)")
    recording = debugger.machine.recording()

    assert recording.trace() == expected.trace()
    np.testing.assert_array_equal(recording.streams[0].q, expected.streams[0].q)


def test_another_value() -> None:
    """The run goes on with a value that it was given, and a step back forgets it."""
    debugger = load(LOOP)
    debugger.add_breakpoint(6)
    run(debugger, "continue")
    assert debugger.assign("N", "n * 2 + 1").value == "31"
    run(debugger, "next")
    assert printed(debugger) == ["31"]
    lines(debugger, "back", 1)
    assert debugger.evaluate("n").value == "31"
    lines(debugger, "back", 2)
    run(debugger, "continue")

    assert debugger.evaluate("n").value == "15"


def test_another_place() -> None:
    """A frame that is given another place in the debugger is where a MOVE goes to."""
    debugger = load(corpus_text("p02"))
    lines(debugger, "next", 8)
    debugger.assign("OBJ2", "(1,0,0, 0,-1,0, 0,0,-1, 0.5,0.1,0.1)")
    run(debugger, "continue")

    np.testing.assert_allclose(debugger.machine.state.tree.world("ARM_1"), down(0.5, 0.1, 0.1), atol=1e-6)


def test_values_that_cannot_be_given() -> None:
    """What does not fit is refused with a reason, and nothing has changed."""
    debugger = load(corpus_text("p02"))
    lines(debugger, "next", 6)
    for kept, text, message in (
        ("OBJ1", "3", "expected a FRAME"),
        ("T1", "obj1", "expected a TRANS"),
        ("ARM_1", "obj1", "`ARM_1` cannot be assigned a value"),
    ):
        with pytest.raises(ExpressionError, match=message):
            debugger.assign(kept, text)
    run(debugger, "next")
    run(debugger, "next")
    run(debugger, "stage")
    with pytest.raises(ExpressionError, match="being moved"):
        debugger.assign("APF1", "obj2")


def test_pause_of_an_endless_loop() -> None:
    """A loop that never ends can be stopped, looked at, and left by a value."""
    debugger = load("VAR n : SCALAR ;\nBEGIN\n  n = 0 ;\n  WHILE n = 0 DO\n    PAUSE 0.001 ;\n  PRINT(n)\nEND.\n")
    debugger.resume("continue")
    assert debugger.run_slice(0.05) is None
    with pytest.raises(DebuggerError, match="running"):
        run(debugger, "next")
    stop = debugger.pause()
    assert stop.reason == "pause"
    assert line(debugger) in {4, 5}
    debugger.assign("N", "5")

    assert run(debugger, "continue").reason == "end"
    assert printed(debugger) == ["5"]
