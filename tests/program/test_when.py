"""WHEN at work: conditions judged on every servo tick, actions that interrupt, BRAKE and RESUME."""

import attrs
import numpy as np
import pytest

from armwright.arrays import Array
from armwright.cell.hardware import Hardware
from armwright.cell.model import Cell
from armwright.cell.signals import Input
from armwright.cell.simulator import Simulator
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.trajectory import Trajectory
from armwright.physics.world import PhysicsCell
from armwright.program.bytecode.instructions import Code
from armwright.program.debugger.debugger import Command, Debugger
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.machine import Limits, RunError
from armwright.program.vm.recording import Effect, Recording
from program.running import cell_of, code_of, failure, printed, run
from program.test_signals import signals_cell
from program.watching import watching_statements
from samples import Sample

PERIOD = 1e-3
# A MOVE of each kind of stage, after one that brings the arm to its start; all take more than half a second.
MOVES = {
    "PTP": "MOVE ARM_1 TO g WITH SPEED = 60",
    "LINE": "MOVE ARM_1 TO g STRAIGHTLY, WITH SPEED = 60",
    "SPLINE": "MOVE ARM_1 TO g VIA (h, k), WITH SPEED = 100",
    "BLEND": "MOVE ARM_1 TO g VIA (h, k), WITH SPEED = 100, WITH BLEND = 30",
}
FRAMES = """UNITS MM ; VAR f, g, h, k : FRAME ; n, m : SCALAR ; note : TEXT ; ready, other : EVENT ;
BEGIN
  n = 0 ; m = 0 ; f = ARM_1 ; g = f * XYZ(60, 90, -40) ; h = f * XYZ(0, 60, 0) ; k = f * XYZ(30, 90, 0) ;
"""
# Stops keep to their limits but for rounding and the bend of an acceleration between two samples.
LIMIT = 1 + 1e-5
# Tool positions on the path of a motion that nothing disturbed [m].
ON_PATH = 1e-9


def program(text: str, cell: Cell | None = None, hardware: Hardware | None = None) -> Recording:
    """Run statements behind the frames that they may use."""
    cell = cell or signals_cell()
    return interpret(code_of(f"{FRAMES}{text}\nEND.", cell), cell, hardware or Simulator(cell))


def lines(text: str, **inputs: Input) -> list[str]:
    return printed(program(text, signals_cell(**inputs)))


def at(*times: float) -> Input:
    """Return an input that changes at these times, from off."""
    return Input(timeline=tuple((time, float(number % 2 == 0)) for number, time in enumerate(times)))


def of_kind(recording: Recording, kind: str) -> list[Effect]:
    return [effect for effect in recording.effects if effect.kind == kind]


# ---- reaction, path and limits -------------------------------------------------------------------------------------


def distances(path: Trajectory, q: Array) -> Array:
    """Return how far positions (k, n) are from the curve of a motion, by Newton steps from the nearest of some."""
    times = np.linspace(0, path.duration, 4001)
    t = times[np.array([np.linalg.norm(path(times) - one, axis=1).argmin() for one in q])]
    for _ in range(8):
        along = path(t, 1)
        speed = (along**2).sum(axis=1)
        step = ((path(t) - q) * along).sum(axis=1) / np.where(speed > 0, speed, np.inf)
        t = np.clip(t - np.clip(step, -times[1], times[1]), 0, path.duration)
    return np.linalg.norm(path(t) - q, axis=1)


@pytest.mark.parametrize("kind", MOVES)
@pytest.mark.parametrize("away", [False, True], ids=["stands", "moves away"])
def test_brake_and_resume_at_random_ticks(kind: str, away: bool, sample: Sample) -> None:  # noqa: FBT001 - a case
    """Whenever a switch is set, the arm brakes on that tick, keeps its path and its limits, and comes to its goal.

    The path is that of the same MOVE undisturbed. An arm that the action has moved elsewhere comes back to where it
    was braked first.
    """
    elsewhere = "MOVE ARM_1 TO ARM_1 * XYZ(0, 0, 10) ; " * away
    action = f"BEGIN BRAKE ; n = n + 1 ; {elsewhere}PAUSE m ; RESUME END"
    free = program(f"{MOVES[kind]} ;")
    path, arm = free.stages[-1].motion, free.cell.arms["ARM_1"].arm
    assert [stage.stage.kind for stage in free.stages] == [kind]
    worst = apart = 0.0
    for rng in sample.cases(20):
        times = np.sort(rng.uniform(0.0, 1.2 * path.duration, 2))
        pause = float(rng.choice([0.0, rng.uniform(0.0, 0.3)]))
        text = (
            f"m = {pause:.4f} ; WHEN INPUT(go) OR INPUT(again) DO {action} ; {MOVES[kind]} ; PRINT(n, DIST(ARM_1, g))"
        )
        recording = program(text, signals_cell(GO=at(times[0], times[0] + 0.01), AGAIN=at(times[1], times[1] + 0.01)))
        end = of_kind(recording, "MOVE")[-1].t1
        begun = [effect.t0 for effect in of_kind(recording, "WHEN")]
        expected = [np.ceil(time / PERIOD - 1e-6) * PERIOD for time in times]
        assert begun[:1] == pytest.approx(expected[:1] if expected[0] <= end else [])
        for stage in recording.stages:
            worst = max(worst, (stage.motion.peaks(1) / arm.limits.speed).max())
            worst = max(worst, (stage.motion.peaks(2) / arm.limits.acceleration).max())
            if stage.stage.kind == kind and not (away and stage.goal_names != ("g",)):
                q = stage.motion(np.linspace(0, stage.motion.duration, 60))
                apart = max(apart, distances(path, q).max() * arm.reach)
        for before, after in zip(recording.streams[0].q, recording.streams[0].q[1:], strict=False):
            assert np.abs(after - before).max() <= (arm.limits.speed * PERIOD).max() * LIMIT
        assert float(printed(recording)[0].split()[1]) < 1e-6
    sample.record(f"{kind} braked and resumed at random ticks", sample.count(20), 0, worst=worst)

    assert worst <= LIMIT
    assert apart <= ON_PATH


def test_end_of_a_braked_move() -> None:
    """An action that brakes and does not resume ends the MOVE where the arm stands; the program goes on behind it."""
    recording = program(
        f"WHEN INPUT(go) DO BRAKE ; {MOVES['LINE']} ; PRINT(TIME, DIST(ARM_1, f)) ; MOVE ARM_1 TO f",
        signals_cell(GO=at(0.3)),
    )
    time, distance = map(float, printed(recording)[0].split())

    assert 0.3 < time < 0.4
    assert 1 < distance < 60
    assert [effect.text.endswith("; halted") for effect in of_kind(recording, "MOVE")] == [True, False]


def test_without_brake() -> None:
    """An action without BRAKE acts while the MOVE goes on, which takes as long as without it."""
    free = of_kind(program(f"{MOVES['SPLINE']} ;"), "MOVE")[0].t1
    text = f"WHEN INPUT(go) DO BEGIN PULSE lamp FOR 1 ; PRINT(TIME) END ; {MOVES['SPLINE']} ; PRINT(TIME)"

    assert [float(line) for line in lines(text, GO=at(0.2))] == pytest.approx([0.2, free], abs=1e-4)


def test_brake_between_stages(sample: Sample) -> None:
    """At the end of a stage, and in the last tick of it, BRAKE and RESUME leave the rest of the MOVE as it is."""
    move = "MOVE ARM_1 TO g WITH APPROACH = h, WITH SPEED = 60"
    free = program(f"{move} ;")
    ends = [stage.t1 for stage in free.stages]
    for time in (*ends, *(end - PERIOD for end in ends), *(end + PERIOD for end in ends[:1])):
        text = f"WHEN INPUT(go) DO BEGIN BRAKE ; RESUME END ; {move} ; PRINT(DIST(ARM_1, g)) ; PAUSE 0.1"
        assert float(lines(text, GO=at(time))[0]) < 1e-6
    for rng in sample.cases(10):
        text = f"WHEN INPUT(go) DO BEGIN BRAKE ; MOVE ARM_1 TO f ; RESUME END ; {move} ; PRINT(DIST(ARM_1, g))"
        assert float(lines(text, GO=at(rng.uniform(0, ends[-1])))[0]) < 1e-6


def test_in_physics(sample: Sample) -> None:
    """With physics the action begins on the tick of its switch, and what is sent to the joints keeps the limits."""
    for rng in sample.cases(4):
        time, kind = float(rng.uniform(0.05, 0.5)), str(rng.choice(list(MOVES)))
        cell = signals_cell(GO=at(time))
        watch = "WHEN INPUT(go) DO BEGIN BRAKE ; PRINT(TIME) ; PAUSE 0.1 ; RESUME END"
        text = f"{watch} ; {MOVES[kind]} ; PRINT(DIST(ARM_1, g))"
        recording = program(text, cell, PhysicsCell(cell))
        arm = cell.arms["ARM_1"].arm
        assert of_kind(recording, "WHEN")[0].t0 == pytest.approx(np.ceil(time / PERIOD - 1e-6) * PERIOD)
        for stage in recording.stages:
            assert (stage.motion.peaks(1) <= arm.limits.speed * LIMIT).all()
            assert (stage.motion.peaks(2) <= arm.limits.acceleration * LIMIT).all()
        assert float(printed(recording)[1]) < 1


# ---- which action comes first --------------------------------------------------------------------------------------


def test_priority_then_text() -> None:
    """Of conditions that hold on one tick the one of higher priority acts first, then the first of the text."""
    text = """WHEN INPUT(go) DO PRINT("a") ; WHEN PRIORITY 3 : INPUT(go) DO PRINT("b") ;
    WHEN late : PRIORITY 3 : INPUT(go) DO PRINT("c") ; WHEN PRIORITY 7 : TIME >= 0.1 DO PRINT("d") ; PAUSE 0.2 ;"""

    assert lines(text, GO=at(0.1)) == ["d", "b", "c", "a"]


def test_an_equal_does_not_interrupt() -> None:
    """While an action runs, one of higher priority interrupts it; an equal and a lower one wait, and are not lost."""
    text = """WHEN PRIORITY 2 : INPUT(go) DO BEGIN PRINT("begin", TIME) ; PAUSE 0.5 ; PRINT("end", TIME) END ;
    WHEN PRIORITY 2 : INPUT(equal) DO PRINT("equal", TIME) ;
    WHEN INPUT(low) DO PRINT("low", TIME) ;
    WHEN PRIORITY 3 : INPUT(high) DO PRINT("high", TIME) ;
    PAUSE 2 ; PRINT("over", TIME) ;"""

    assert lines(text, GO=at(0.1), EQUAL=at(0.2, 0.21), LOW=at(0.15, 0.16), HIGH=at(0.3)) == [
        "begin 0.1",
        "high 0.3",
        "end 0.6",
        "equal 0.6",
        "low 0.6",
        "over 2",
    ]


def test_acts_once_until_it_has_not_held() -> None:
    """A condition acts when it begins to hold, on arming too, and again only after a tick on which it did not hold."""
    text = (
        "WHEN INPUT(go) OR n > 0 DO PRINT(TIME) ; PAUSE 1 ; n = 1 ; PAUSE 0.1 ; n = 0 ; PAUSE 0.1 ; n = 1 ; PAUSE 0.1 ;"
    )

    assert lines(text, GO=Input(start=1.0, timeline=((0.2, 0.0), (0.4, 1.0), (0.5, 0.0)))) == [
        "0",
        "0.4",
        "1.001",
        "1.201",
    ]


# ---- arming and disarming ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("around", "expected"),
    [
        ("BEGIN {} ; PAUSE 0.1 END ; PAUSE 1 ;", []),
        ("BEGIN {} ; PAUSE 1 END ;", ["0.55"]),
        ("REPEAT {} ; PAUSE 0.1 UNTIL TIME > 0.3 ; PAUSE 1 ;", []),
        ("WHILE TIME < 1 DO BEGIN {} ; PAUSE 0.1 END ; PAUSE 1 ;", ["0.55", "0.6", "0.7", "0.8", "0.9"]),
        ("TRY {} ; PAUSE 0.1 ; n = 1 / 0 RECOVER PAUSE 1 END ;", []),
        ("TRY {} ; PAUSE 0.1 RECOVER n = 2 END ; PAUSE 1 ;", []),
        ("TRY n = 1 / 0 RECOVER {} ; PAUSE 1 END ; PAUSE 1 ;", ["0.55"]),
        ("TRY {} ; n = n + 1 ; PAUSE 0.1 ; n = 1 / (n - 1) RECOVER RETRY END ; PAUSE 1 ;", []),
        ("COBEGIN BEGIN {} ; PAUSE 0.1 END ; BEGIN PAUSE 1 END COEND ;", []),
        ("COBEGIN BEGIN {} ; PAUSE 0.6 END ; BEGIN PAUSE 1 END COEND ;", ["0.55"]),
        ("{} ; COBEGIN BEGIN PAUSE 1 END ; BEGIN PAUSE 0.1 END COEND ;", ["0.55"]),
        ("WHEN w : INPUT(go) DO PRINT(TIME) ; WHEN w OFF ; PAUSE 0.1 ; WHEN w ON ; WHEN w ON ; PAUSE 1 ;", ["0.55"]),
        ("WHEN w : INPUT(go) DO PRINT(TIME) ; PAUSE 0.1 ; WHEN w OFF ; PAUSE 1 ; WHEN w ON ; PAUSE 1 ;", ["1.1"]),
        ("WHEN w : n = 0 DO BEGIN WHEN w OFF ; PRINT(TIME) END ; n = 1 ; n = 0 ; PAUSE 1 ;", ["0"]),
    ],
)
def test_armed_in_its_block(around: str, expected: list[str]) -> None:
    """A WHEN is armed from its statement to the end of its block, however that is left, and is switched by its name."""
    assert lines(around.format("WHEN INPUT(go) DO PRINT(TIME)"), GO=at(0.55)) == expected


def test_armed_in_a_procedure() -> None:
    """A WHEN of a procedure sees its parameters, and is disarmed when it returns; one of the caller stays armed."""
    text = """VAR n : SCALAR ;
    PROCEDURE work (INOUT count : SCALAR, limit : SCALAR) ;
    BEGIN WHEN INPUT(go) AND limit > 1 DO count = count + limit ; PAUSE 0.3 END ;
    BEGIN n = 0 ; WHEN INPUT(go) DO n = n + 100 ; work(n, 5) ; PRINT(n, TIME) ; PAUSE 1 ; PRINT(n) ;
    work(n, 1) ; PRINT(n) END."""

    assert printed(run(text, signals_cell(GO=at(0.1, 0.2, 0.5, 0.6)))) == ["105 0.3", "205", "205"]


# ---- what is interrupted -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("statement", "over"),
    [
        # The clock of a PAUSE goes on; none is over before the action.
        ("PAUSE 0.35", 0.4),
        ("PAUSE 0.15", 0.3),
        ("WAIT UNTIL INPUT(later)", 0.5),
        ("WAIT UNTIL INPUT(short)", 0.6),
        ("WAIT UNTIL FALSE WITHIN 0.2 ELSE n = 1", 0.3),
        ("WAIT ready WITHIN 1 ELSE n = 1", 0.3),
        ("WAIT ready WITHIN 0.1 ELSE n = 1", 0.3),
        ("WAIT ready", 0.3),
        ("WAIT other", 0.45),
        ("LOCK (m) DO n = 1", 0.35),
        ("COBEGIN BEGIN PAUSE 0.2 END ; BEGIN PAUSE 0.1 END COEND", 0.3),
        ("COBEGIN BEGIN PAUSE 0.45 END ; BEGIN PAUSE 0.1 END COEND", 0.5),
    ],
)
def test_what_waits_goes_on(statement: str, over: float) -> None:
    """Whatever a process waits for when it is interrupted, it waits for afterwards; what came meanwhile is there."""
    text = f"""COBEGIN
    BEGIN
      WHEN INPUT(go) DO BEGIN PRINT(TIME) ; PAUSE 0.2 ; PRINT(TIME) END ;
      PAUSE 0.05 ; {statement} ; PRINT(TIME)
    END ;
    BEGIN LOCK (m) DO PAUSE 0.35 END ;
    BEGIN PAUSE 0.2 ; SIGNAL ready ; PAUSE 0.25 ; SIGNAL other END
    COEND ;"""
    times = [float(line) for line in lines(text, GO=at(0.1), LATER=at(0.5), SHORT=at(0.15, 0.25, 0.6))]

    assert times == pytest.approx([0.1, 0.3, over], abs=1e-6)


def test_keeps_locks() -> None:
    """An action that runs while its process holds a LOCK does not wait for that, and keeps others waiting for it."""
    text = """COBEGIN
    BEGIN WHEN INPUT(go) DO BEGIN LOCK (m) DO n = 1 ; PAUSE 0.2 ; PRINT("action", TIME) END ; LOCK (m) DO PAUSE 0.15 ;
      PRINT("unlocked", TIME) END ;
    BEGIN PAUSE 0.05 ; LOCK (m) DO PRINT("other", TIME) END
    COEND ;"""

    assert lines(text, GO=at(0.1)) == ["action 0.3", "unlocked 0.3", "other 0.3"]


def test_arm_of_the_interrupted_process() -> None:
    """GRASP closes the hand that the process has used last, whatever an action used meanwhile."""
    cell = cell_of("cell2")
    text = "WHEN TIME > 0.1 DO OPEN ARM_2 ; OPEN ARM_1 ; PAUSE 1 ; GRASP"
    recording = run(f"BEGIN {text} END.", cell)

    assert [effect.arm for effect in of_kind(recording, "GRASP")] == ["ARM_1"]


def test_errors() -> None:
    """An error in an action is recovered in it, and RESUME still works; or by the TRY around what it interrupts."""
    inside = "WHEN INPUT(go) DO BEGIN BRAKE ; TRY MOVE ARM_1 TO f * XYZ(9000, 0, 0) RECOVER PRINT(1) END ; RESUME END ;"
    around = (
        f"TRY WHEN INPUT(go) DO RAISE stopped WITH note ; note = TEXT(5) ; {MOVES['LINE']} RECOVER PRINT(MESSAGE) END ;"
    )

    assert lines(f"{inside} {MOVES['LINE']} ; PRINT(DIST(ARM_1, g) < 0.001)", GO=at(0.3)) == ["1", "true"]
    assert lines(f'note = "" ; {around} PRINT(DIST(ARM_1, g) > 1)', GO=at(0.3)) == ["5", "true"]
    assert failure("BEGIN WHEN TIME > 0.1 DO RAISE jam ; PAUSE 1 END.").diagnostic.code == "E508"
    assert failure("VAR n : SCALAR ; BEGIN n = 0 ; WHEN 1 / n > 0 DO n = 2 ; PAUSE 1 END.").diagnostic.code == "E240"


def test_errors_beside_branches() -> None:
    """An error that an action recovers from ends no branch; one in a branch ends the action too."""
    within = """WHEN INPUT(go) DO BEGIN TRY m = 1 / 0 RECOVER PRINT("action", TIME) END ; PAUSE 0.1 END ;
    COBEGIN BEGIN PAUSE 0.5 ; PRINT("branch", TIME) END ; BEGIN PAUSE 0.1 END COEND ;"""
    assert lines(f'{within} PRINT("over", TIME)', GO=at(0.3)) == ["action 0.3", "branch 0.5", "over 0.5"]

    beside = """TRY WHEN INPUT(go) DO TRY PAUSE 1 ; PRINT("wrong") RECOVER PRINT("wrong") END ;
    COBEGIN BEGIN PAUSE 0.5 ; m = 1 / 0 END ; BEGIN PAUSE 3 END COEND RECOVER PRINT("recovered", TIME) END ;
    PAUSE 2 ;"""
    assert lines(beside, GO=at(0.3)) == ["recovered 0.5"]


def test_an_error_ends_a_move_that_was_put_aside() -> None:
    """Where the action has moved the arm elsewhere and fails, the MOVE that it interrupted is over, and recorded so."""
    text = f"""TRY WHEN INPUT(go) DO BEGIN MOVE ARM_1 TO f ; RAISE jam END ; {MOVES["LINE"]} RECOVER PRINT(TIME) END ;
    MOVE ARM_1 TO g"""
    recording = program(text, signals_cell(GO=at(0.3)))

    assert [effect.text.endswith("; braked") for effect in of_kind(recording, "MOVE")] == [True, False, False]


def test_halt() -> None:
    """HALT in an action ends the program, arms at rest; in an ON of a MOVE of the action it ends that MOVE alone."""
    recording = program(f"WHEN INPUT(go) DO HALT ; {MOVES['PTP']} ; PRINT(1)", signals_cell(GO=at(0.3)))
    assert printed(recording) == []
    assert of_kind(recording, "END")[0].text == "HALT"

    text = "WHEN INPUT(go) DO BEGIN MOVE ARM_1 TO f WITH SPEED = 5, ON TIME > 0.5 DO HALT ; RESUME END ;"
    assert lines(f"{text} {MOVES['LINE']} ; PRINT(DIST(ARM_1, g) < 0.001)", GO=at(0.3)) == ["true"]


def test_interrupts_the_action_of_an_on() -> None:
    """The action of an ON is interrupted like any statement, and goes on; its MOVE is braked and resumed meanwhile."""
    move = "MOVE ARM_1 TO g STRAIGHTLY, WITH SPEED = 60, ON TIME > 0.1 DO BEGIN PAUSE 0.2 ; PRINT(2, TIME) END"
    text = f"WHEN INPUT(go) DO BEGIN BRAKE ; PRINT(1) ; PAUSE 0.3 ; RESUME END ; {move} ; PRINT(DIST(ARM_1, g) < 0.001)"
    spoken = lines(text, GO=at(0.2))

    assert [spoken[0], spoken[1][0], spoken[2]] == ["1", "2", "true"]
    assert float(spoken[1].split()[1]) > 0.5


def test_nested_actions_brake_and_resume(sample: Sample) -> None:
    """An action brakes and moves, one of higher priority brakes that MOVE and resumes it; all come to their goals."""
    text = f"""WHEN INPUT(go) DO BEGIN MOVE ARM_1 TO h ; PRINT(DIST(ARM_1, h) < 0.001) ; RESUME END ;
    WHEN PRIORITY 1 : INPUT(again) DO BEGIN BRAKE ; MOVE ARM_1 TO ARM_1 * XYZ(0, 0, -10) ; RESUME END ;
    {MOVES["LINE"]} ; PRINT(DIST(ARM_1, g) < 0.001)"""
    for rng in sample.cases(20):
        assert lines(text, GO=at(0.3), AGAIN=at(float(rng.uniform(0.25, 1.2)))) == ["true", "true"]


def anyhow(code: Code, cell: Cell) -> Recording:
    """Return the recording of a run, which may fail."""
    try:
        return interpret(code, cell, Simulator(cell), limits=Limits(time=20.0))
    except RunError as error:
        failed = error.recording
    assert failed is not None
    return failed()


def test_random_programs(sample: Sample) -> None:
    """Whatever interrupts what, the joints keep their limits, no motion jumps, and the run comes again."""
    for rng in sample.cases(20):
        inputs = {name: at(*np.sort(rng.uniform(0, 4, 8)).tolist()) for name in "ABC"}
        text, cell = watching_statements(rng), signals_cell(**inputs)
        code = code_of(f"{FRAMES}{text}\nEND.", cell)
        first, second = (anyhow(code, cell) for _ in range(2))
        arm, q = cell.arms["ARM_1"].arm, first.streams[0].q
        for stage in first.stages:
            assert (stage.motion.peaks(1) <= arm.limits.speed * LIMIT).all(), text
            assert (stage.motion.peaks(2) <= arm.limits.acceleration * LIMIT).all(), text
        # Between two stages, and between a stage and its stop, there is no jump either.
        assert (np.abs(np.diff(q, axis=0)) <= arm.limits.speed * PERIOD * LIMIT).all(), text
        assert (np.abs(np.diff(q, 2, axis=0)) <= arm.limits.acceleration * PERIOD**2 * 1.2).all(), text
        assert q.tobytes() == second.streams[0].q.tobytes()
        assert [effect.text for effect in first.effects] == [effect.text for effect in second.effects]


# ---- waits that cannot end -----------------------------------------------------------------------------------------


def test_deadlock() -> None:
    """A WHEN whose condition cannot come true any more helps no process out of a deadlock; who waits is told."""
    text = """VAR n : SCALAR ; a, b : EVENT ;
    BEGIN n = 0 ; COBEGIN
      BEGIN WHEN n > 1 DO SIGNAL a ; WAIT a ; n = 3 END ;
      BEGIN WHEN w : TIME > 0.1 DO BEGIN WHEN w OFF ; WAIT b END ; PAUSE 1 ; SIGNAL b END
    COEND END."""
    error = failure(text, limits=Limits(time=5.0))

    assert (error.diagnostic.code, error.time) == ("E501", pytest.approx(0.101, abs=2e-3))
    told = [error.diagnostic.label, *(label.text for label in error.diagnostic.secondary)]
    assert told == ["branch 1 waits for a", "WHEN w of branch 2 waits for b"]


def test_no_deadlock() -> None:
    """A process that waits goes on when a WHEN of its own signals its event, by an input, a variable or the time."""
    for condition in ("INPUT(go)", "TIME >= 0.5", "n > 0"):
        waits = f"WHEN {condition} DO SIGNAL ready ; WAIT ready ; PRINT(TIME)"
        text = f"COBEGIN BEGIN {waits} END ; BEGIN PAUSE 0.5 ; n = 1 END COEND"
        assert [float(line) for line in lines(text, GO=at(0.5))] == pytest.approx([0.5], abs=1.1e-3)


def test_same_bits_again() -> None:
    """The same program has the same run, to the last bit, also with two arms that interrupt one another's waits."""
    cell = attrs.evolve(cell_of("cell2"), inputs=signals_cell(GO=at(0.2, 0.3, 0.6)).inputs)
    text = """VAR f, g : FRAME ; n : SCALAR ; ready : EVENT ;
    BEGIN f = ARM_1 * XYZ(0,0,-0.05) ; g = ARM_2 * XYZ(0,0,-0.05) ; n = 0 ;
    COBEGIN
      BEGIN WHEN INPUT(go) DO BEGIN BRAKE ; SIGNAL ready ; PAUSE 0.1 ; RESUME END ; MOVE ARM_1 TO f WITH SPEED = 5 END ;
      BEGIN WHEN n > 0 DO BRAKE ; WAIT ready ; n = 1 ; MOVE ARM_2 TO g WITH SPEED = 5 ; PRINT(TIME) END
    COEND END."""
    first, second = run(text, cell), run(text, cell)

    assert printed(first) == printed(second)
    for one, other in zip(first.streams, second.streams, strict=True):
        assert one.q.tobytes() == other.q.tobytes()
    moved = forward(cell.arms["ARM_1"].arm, first.streams[0].q[-1]) - forward(
        cell.arms["ARM_1"].arm, first.streams[0].q[0]
    )
    assert np.linalg.norm(moved[:3, 3]) == pytest.approx(0.05, abs=1e-6)


# ---- the debugger --------------------------------------------------------------------------------------------------

WATCHED = """UNITS MM ; VAR n : SCALAR ;
BEGIN
  n = 0 ;
  WHEN door : INPUT(go) DO
  BEGIN
    BRAKE ;
    n = n + 1 ;
    RESUME
  END ;
  MOVE ARM_1 TO ARM_1 * XYZ(0, 60, 0) STRAIGHTLY, WITH SPEED = 40 ;
  PAUSE 0.1
END.
"""


def watched() -> Debugger:
    cell = signals_cell(GO=at(0.2))
    debugger = Debugger(code_of(WATCHED, cell), cell)
    debugger.begin()
    debugger.run_slice()
    return debugger


def line_after(debugger: Debugger, command: Command) -> int:
    debugger.resume(command)
    debugger.run_slice()
    return debugger.code.source.line(debugger.stack()[0].span.start)


def test_steps_into_an_action() -> None:
    """A step into goes into the action, and the stack says what that interrupts; a step over passes it."""
    debugger = watched()
    assert [line_after(debugger, "next") for _ in range(2)] == [4, 10]
    assert line_after(debugger, "in") == 6
    assert debugger.time == pytest.approx(0.2)
    frames = debugger.stack()
    assert [frame.title for frame in frames] == ["WHEN door", "program"]
    assert debugger.code.source.line(frames[1].span.start) == 10
    assert [line_after(debugger, "next") for _ in range(3)] == [7, 8, 11]

    debugger = watched()
    assert [line_after(debugger, "next") for _ in range(3)] == [4, 10, 11]
    assert debugger.evaluate("n").value == "1"


def test_stops_in_an_action_and_steps_back() -> None:
    """A breakpoint stops in the action; gone back to in front of the MOVE and run again, the run has the same bits."""
    debugger = watched()
    debugger.add_breakpoint(7)
    assert line_after(debugger, "continue") == 7
    assert [line_after(debugger, "back") for _ in range(2)] == [6, 10]
    assert debugger.evaluate("n").value == "0"
    assert line_after(debugger, "continue") == 7
    line_after(debugger, "continue")
    again = debugger.machine.recording()
    direct = run(WATCHED, signals_cell(GO=at(0.2)))

    assert [effect.text for effect in again.effects] == [effect.text for effect in direct.effects]
    assert again.streams[0].q.tobytes() == direct.streams[0].q.tobytes()


def test_ticks_of_a_watched_move() -> None:
    """A switch that a user sets while a run stands still in a MOVE begins the action on the next tick."""
    cell = signals_cell(GO=Input())
    debugger = Debugger(code_of(WATCHED, cell), cell)
    debugger.begin()
    debugger.run_slice()
    for command in ("next", "next", *["tick"] * 5):
        line_after(debugger, command)
    debugger.set_input("go", 1.0)
    while debugger.stack()[0].title != "WHEN door":
        line_after(debugger, "tick")

    assert debugger.machine.state.effects[-1].t0 == pytest.approx(0.006, abs=1.1e-3)


def test_trace() -> None:
    """The trace names a WHEN as the program does, or by what it has written."""
    recording = program("WHEN a : n > 0 DO m = 1 ; WHEN PRIORITY 2 : n >  0 DO m = 2 ; n = 1 ; PAUSE 0.1")

    assert [effect.text for effect in of_kind(recording, "WHEN")] == ["WHEN PRIORITY 2 : n > 0", "WHEN a"]
