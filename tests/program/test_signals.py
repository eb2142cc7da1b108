"""Inputs and outputs at work: timelines, links, live switches, pulses, and waits for conditions."""

from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.cell.hardware import DeviceError, SimulatedHardware
from armwright.cell.model import Cell
from armwright.cell.outputs import Device
from armwright.cell.signals import Input, Signals
from armwright.cell.simulator import Simulator
from armwright.physics.world import PhysicsCell
from armwright.program import Source, compile as translate, run as run_program
from armwright.program.debugger.debugger import Command, Debugger, DebuggerError
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.machine import RunError
from armwright.program.vm.recording import log_csv_lines
from program.running import cell_of, code_of, failure, printed, run
from samples import Sample

EXAMPLES = Path(__file__).parents[2] / "examples"
PERIOD = 1e-3
INPUTS = {
    "DOOR": Input(start=1.0, timeline=((0.5, 0.0), (1.0, 1.0))),
    "PRESSED": Input(follows="PRESS", delay=0.25),
    "ASKED": Input(event="READY", pulse=0.1),
    "BEGUN": Input(event="READY"),
    "LEVEL": Input(analogue=True, start=-1.0, timeline=((0.3, 2.5),)),
}


def signals_cell(**inputs: Input) -> Cell:
    devices = {"LAMP": Device(), "PRESS": Device(), "VALVE": Device(analogue=True)}
    return attrs.evolve(
        cell_of("cell1"),
        devices=devices,
        inputs={**INPUTS, **inputs},
    )


def lines(text: str, cell: Cell | None = None) -> list[str]:
    return printed(run(f"VAR n, t : SCALAR ; ready : EVENT ; BEGIN {text} END.", cell or signals_cell()))


def test_timeline() -> None:
    """An input changes on its timeline, and has its start before."""
    text = "FOR n = 0 TO 4 DO BEGIN PRINT(INPUT(door), ANALOG(level)) ; PAUSE 0.25 END ;"

    assert lines(text) == ["true -1", "true -1", "false 2.5", "false 2.5", "true 2.5"]


def test_input_follows_an_output() -> None:
    """An input that follows a device repeats it later, when it goes on and when it goes off."""
    text = """OPERATE press ON ; t = TIME ; WAIT UNTIL INPUT(pressed) ; PRINT(TIME - t) ;
    OPERATE press OFF ; t = TIME ; WAIT UNTIL NOT INPUT(pressed) ; PRINT(TIME - t) ;"""

    assert lines(text) == ["0.25", "0.25"]


def test_input_from_an_event() -> None:
    """A SIGNAL of the program switches an input on: for a time, or for ever."""
    text = """PRINT(INPUT(asked), INPUT(begun)) ; PAUSE 1 ; SIGNAL ready ; PRINT(INPUT(asked), INPUT(begun)) ;
    PAUSE 0.1 ; PRINT(INPUT(asked), INPUT(begun)) ;"""

    assert lines(text) == ["false false", "true true", "false true"]


def test_a_second_signal_keeps_an_input_on() -> None:
    """An input that an event switches on for a time is on for that time after each SIGNAL, the last one included."""
    text = """SIGNAL ready ; PAUSE 0.08 ; SIGNAL ready ; PAUSE 0.04 ; PRINT(INPUT(asked)) ;
    PAUSE 0.05 ; PRINT(INPUT(asked)) ; PAUSE 0.02 ; PRINT(INPUT(asked)) ;"""

    assert lines(text) == ["true", "true", "false"]


def test_what_came_last_counts(sample: Sample) -> None:
    """An input is what came last of its timeline and the output that it follows, looked up among all changes."""
    for rng in sample.cases(100):
        times = np.cumsum(rng.uniform(0.01, 0.2, 20)).tolist()
        timeline = tuple((time, float(value)) for value, time in enumerate(times))
        source = Input(analogue=True, start=-1.0, timeline=timeline, follows="PRESS", delay=0.3)
        signals, changes = Signals({"LEVEL": source}), [*timeline]
        for now in np.sort(rng.uniform(0.0, 2.5, 100)).tolist():
            signals.now = now
            if rng.uniform() < 0.2:
                value = float(rng.integers(100, 200))
                signals.write("PRESS", value)
                changes.append((now + source.delay, value))
            past = sorted(change for change in changes if change[0] <= now)

            assert signals.input("LEVEL") == (past[-1][1] if past else -1.0)


def test_outputs() -> None:
    """A device can be read back: whether it is on, and the number that it is set to."""
    text = """PRINT(OUTPUT(lamp), SETTING(valve)) ; OPERATE lamp ON ; OPERATE valve TO 1 + 1.5 ;
    PRINT(OUTPUT(lamp), SETTING(valve), OUTPUT(valve)) ; OPERATE lamp OFF ; PRINT(OUTPUT(lamp)) ;"""

    assert lines(text) == ["false 0", "true 2.5 true", "false"]


def test_pulse() -> None:
    """A PULSE takes no time of the program, and ends by itself; what is switched meanwhile stays so."""
    text = """t = TIME ; PULSE lamp FOR 0.2 ; PRINT(TIME - t, OUTPUT(lamp)) ; PAUSE 0.199 ; PRINT(OUTPUT(lamp)) ;
    PAUSE 0.001 ; PRINT(OUTPUT(lamp)) ;
    PULSE lamp FOR 0.2 ; PAUSE 0.1 ; OPERATE lamp ON ; PAUSE 1 ; PRINT(OUTPUT(lamp)) ;"""

    assert lines(text) == ["0 true", "true", "false", "true"]


def test_all_off_at_the_end() -> None:
    """What is on when the program ends is switched off, a pulse that is under way too."""
    recording = run("BEGIN OPERATE valve TO 3 ; PULSE lamp FOR 5 ; PAUSE 1 END.", signals_cell())

    assert recording.effects[-1].text == "END; lamp OFF; valve OFF"


def test_wait_ends_at_the_tick(sample: Sample) -> None:
    """A WAIT UNTIL goes on at the first servo tick at which its condition holds, and not before."""
    for rng in sample.cases(50):
        at, other = rng.uniform(0.01, 2.0, 2)
        cell = signals_cell(GO=Input(timeline=((float(at), 1.0),)))
        text = f"COBEGIN BEGIN WAIT UNTIL INPUT(go) ; PRINT(TIME) END ; BEGIN PAUSE {other:.6f} END COEND ;"
        tick = np.ceil(at / PERIOD - 1e-6)

        assert float(lines(text, cell)[0]) == pytest.approx(tick * PERIOD, abs=PERIOD * 1e-3)


def test_wait_that_is_too_late() -> None:
    """Behind WITHIN the wait ends at its time: with ELSE in a statement, without one in an error that has a code."""
    assert lines('WAIT UNTIL FALSE WITHIN 0.7 ELSE PRINT("late", TIME) ; PRINT("on", TIME) ;') == ["late 0.7", "on 0.7"]
    assert lines('TRY WAIT UNTIL FALSE WITHIN 0.7 RECOVER PRINT("late", TIME) END ;') == ["late 0.7"]
    error = failure("BEGIN WAIT UNTIL FALSE WITHIN 0.7 END.")

    assert (error.diagnostic.code, error.time) == ("E507", pytest.approx(0.7))


def test_event_within_a_time() -> None:
    """A WAIT for an event ends with the SIGNAL or when its time is over, whichever is first; a late SIGNAL is kept."""
    text = """COBEGIN
      BEGIN WAIT ready WITHIN 2 ELSE PRINT("wrong") ; PRINT("came", TIME) ;
        WAIT ready WITHIN 1 ELSE PRINT("late", TIME) ; PAUSE 3 ;
        WAIT ready WITHIN 0 ELSE PRINT("wrong") ; PRINT(TIME) END ;
      BEGIN PAUSE 0.5 ; SIGNAL ready ; PAUSE 2 ; SIGNAL ready END
    COEND ; TRY WAIT ready WITHIN 0.5 RECOVER (timeout) PRINT(MESSAGE, TIME) END ;"""

    assert lines(text) == ["came 0.5", "late 1.5", "4.5", "what this WAIT waits for did not come in time 5"]


def test_waits_of_different_priority() -> None:
    """A signal goes to the process with the higher priority, and the other waits on until its time is over."""
    text = """COBEGIN
      BEGIN WAIT ready WITHIN 2 ELSE PRINT("first late", TIME) END ;
      PRIORITY 5 : BEGIN WAIT ready WITHIN 2 ; PRINT("second", TIME) END ;
      BEGIN PAUSE 1 ; SIGNAL ready END
    COEND ;"""

    assert lines(text) == ["second 1", "first late 2"]


def test_wait_that_need_not_wait() -> None:
    """A condition that holds takes no time, also where none is left."""
    assert lines('WAIT UNTIL TRUE ; WAIT UNTIL TRUE WITHIN 0 ELSE PRINT("late") ; PRINT(TIME) ;') == ["0"]
    assert lines('WAIT UNTIL FALSE WITHIN 0 ELSE PRINT("late", TIME) ;') == ["late 0"]


def test_wait_in_a_branch_that_is_ended() -> None:
    """A branch that waits for a condition is ended with its COBEGIN when another branch fails."""
    text = """TRY COBEGIN BEGIN WAIT UNTIL FALSE END ; BEGIN PAUSE 0.5 ; n = 1 / 0 END COEND
    RECOVER PRINT("recovered", TIME) END ;"""

    assert lines(text) == ["recovered 0.5"]


def test_guard_on_an_input(sample: Sample) -> None:
    """A MOVE is ended by an input at the first tick at which it is on, wherever that is."""
    for rng in sample.cases(20):
        at = float(rng.uniform(0.02, 0.3))
        cell = signals_cell(STOPPED=Input(timeline=((at, 1.0),)))
        text = """UNITS MM ; BEGIN MOVE ARM_1 TO ARM_1 * XYZ(0, 0, 60) STRAIGHTLY, WITH SPEED = 10,
            ON INPUT(stopped) DO BEGIN PRINT(TIME) ; HALT END END."""

        assert float(printed(run(text, cell))[0]) == pytest.approx(np.ceil(at / PERIOD - 1e-6) * PERIOD, abs=1e-6)


@pytest.mark.parametrize(
    ("text", "code", "says"),
    [
        ("IF INPUT(dor) THEN HALT", "R608", "has no input DOR; did you mean DOOR?"),
        ("IF INPUT(level) THEN HALT", "R608", "input LEVEL of cell 'cell1.json' is analogue; read it by ANALOG"),
        ("PRINT(ANALOG(door))", "R608", "is digital; read it by INPUT"),
        ("OPERATE lamp TO 3", "R602", "is on or off, and cannot be set to a number"),
        ("PULSE lamps FOR 3", "R602", "has no device LAMPS; did you mean LAMP?"),
        ("PRINT(OUTPUT(lamps))", "R602", "has no device LAMPS"),
        ("PULSE lamp FOR n", "E231", "a pulse of -1 s is not possible"),
        ("WAIT UNTIL FALSE WITHIN n", "E231", "WITHIN -1 s is not possible"),
    ],
)
def test_failures(text: str, code: str, says: str) -> None:
    """What the cell does not have, or cannot do, is an error where it is asked for."""
    # Without knowledge of the cell the compiler lets all names pass.
    compiled = translate(Source("t.rlo", f"VAR n : SCALAR ; BEGIN n = 0 ; n = n - 1 ; {text} END."))
    assert compiled.code is not None
    cell = signals_cell()
    with pytest.raises(RunError) as raised:
        interpret(compiled.code, cell, Simulator(cell))

    assert raised.value.diagnostic.code == code
    assert says in raised.value.diagnostic.message


def test_press() -> None:
    """The example: the press waits until the door is closed again at 6.5 s, and refuses to work when its oil is hot."""
    recording = run_program(EXAMPLES / "press.rlo", arguments={"parts": 2})
    logs = log_csv_lines(recording.effects)["press"]
    opened = next(effect for effect in recording.effects if effect.text.startswith("WAIT UNTIL INPUT(door_closed)"))

    assert (opened.t0 < 6.5, opened.t1) == (True, pytest.approx(6.5))
    assert len(logs) == 2
    assert float(logs[1].split(",")[2]) == pytest.approx(0.8)
    assert printed(recording) == ["the oil has 71 degrees"]


def test_live_switch() -> None:
    """An input that is set by hand is that, until its timeline changes it."""
    hardware = Simulator(signals_cell())
    hardware.advance(0.2)
    hardware.set_input("DOOR", 0.0)
    states = []
    for now in (0.2, 0.6, 1.2):
        hardware.advance(now)
        states.append(hardware.read_input("DOOR", analogue=False))

    assert states == [0.0, 0.0, 1.0]
    with pytest.raises(DeviceError, match="expected 0 or 1, got 2"):
        hardware.set_input("DOOR", 2.0)


def test_copied_signals() -> None:
    """Of two copies of a cell one does not see what is done to the other."""
    hardware = Simulator(signals_cell())
    assert isinstance(hardware, SimulatedHardware)
    other = hardware.copy()
    other.set_input("DOOR", 0.0)
    other.pulse("LAMP", 1.0)

    assert hardware.read_input("DOOR", analogue=False) == 1.0
    assert hardware.active_devices() == frozenset()
    assert other.active_devices() == {"LAMP"}


def step(debugger: Debugger, command: Command) -> float:
    """Let a program go on to its next stop; return the time there."""
    debugger.resume(command)
    debugger.run_slice()
    return debugger.machine.now


def test_live_switch_in_the_debugger() -> None:
    """A run waits for a switch that a user sets while it stands still; gone back and run again, it is the same run."""
    text = "BEGIN\n  PAUSE 0.3 ;\n  WAIT UNTIL NOT INPUT(go) ;\n  PRINT(TIME) ;\n  PAUSE 1\nEND.\n"
    cell = signals_cell(GO=Input(start=1.0))
    debugger = Debugger(code_of(text, cell), cell)
    debugger.begin()
    debugger.run_slice()
    step(debugger, "next")
    debugger.set_input("go", 0.0)
    times = [step(debugger, command) for command in ("next", "next", "back", "next", "next")]

    assert times == pytest.approx([0.3, 0.3, 0.3, 0.3, 1.3])
    with pytest.raises(DebuggerError, match="has no input GONE"):
        debugger.set_input("gone", 1.0)


def test_timers() -> None:
    """A timer runs while it is on, keeps its seconds while it is off, and is set; all processes read the same one."""
    text = """TIMER a ON ; PAUSE 0.5 ; PRINT(TIMER(a)) ; TIMER a OFF ; PAUSE 1 ; PRINT(TIMER(a)) ;
    TIMER a ON ; TIMER a ON ; PAUSE 0.25 ; PRINT(TIMER(a)) ; TIMER a TO 0 ; PAUSE 0.125 ; PRINT(TIMER(a)) ;
    TIMER b TO -2 ; PAUSE 1 ; PRINT(TIMER(b), TIMER(a) > 1) ; TIMER b ON ;
    COBEGIN BEGIN WAIT UNTIL TIMER(b) >= 0 ; PRINT(TIMER(b)) END ; BEGIN PAUSE 1 ; TIMER b TO 4 END
    COEND ;"""

    assert lines(text) == ["0.5", "0.5", "0.75", "0.125", "-2 true", "4.001"]


def test_timer_of_a_watch(sample: Sample) -> None:
    """A WHEN on a timer acts on the tick at which that has run so long, whenever it was started."""
    for rng in sample.cases(20):
        start, length = rng.uniform(0.01, 0.5, 2).round(3)
        text = f"PAUSE {start} ; TIMER a ON ; WHEN TIMER(a) >= {length} - 1E-9 DO PRINT(TIME) ; PAUSE 2"
        assert float(lines(text)[0]) == pytest.approx(start + length, abs=1e-9)


def test_timers_gone_back() -> None:
    """In a run that is gone back in, a timer is what it was."""
    text = "BEGIN\n  TIMER a ON ;\n  PAUSE 0.3 ;\n  TIMER a TO 7 ;\n  PAUSE 1\nEND.\n"
    debugger = Debugger(code_of(text, signals_cell()), signals_cell())
    debugger.begin()
    debugger.run_slice()
    for _ in range(3):
        step(debugger, "next")
    shown = [debugger.evaluate("TIMER(a)").value]
    step(debugger, "back")

    assert [*shown, debugger.evaluate("TIMER(a)").value] == ["7", "0.3"]


def test_inputs_in_physics() -> None:
    """In a cell with physics inputs change by their timeline, their device, their event and their switch alike."""
    text = """VAR n : SCALAR ; ready : EVENT ;
    BEGIN
      FOR n = 0 TO 2 DO BEGIN PRINT(INPUT(door), ANALOG(level)) ; PAUSE 0.25 END ;
      OPERATE press ON ; n = TIME ; WAIT UNTIL INPUT(pressed) ; PRINT(TIME - n) ;
      SIGNAL ready ; PRINT(INPUT(asked), INPUT(begun)) ; PAUSE 0.1 ; PRINT(INPUT(asked), INPUT(begun)) ;
      WAIT UNTIL INPUT(switch) ; PRINT(TIME) ;
      WHEN NOT INPUT(switch) DO BEGIN BRAKE ; PRINT(TIME) ; RESUME END ;
      MOVE ARM_1 TO ARM_1 * XYZ(0, 0, 0.05) WITH SPEED = 20 ;
    END."""
    cell = signals_cell(SWITCH=Input())
    code, spoken = code_of(text, cell), []
    for kind in (PhysicsCell, Simulator):
        hardware = kind(cell)
        hardware.set_input("SWITCH", 1.0, 1.4)
        hardware.set_input("SWITCH", 0.0, 1.6)
        spoken.append(printed(interpret(code, cell, hardware)))

    assert spoken[0][:7] == ["true -1", "true -1", "false 2.5", "0.25", "true true", "false true", "1.4"]
    assert float(spoken[0][7]) > 1.6
    assert spoken[0] == spoken[1]
