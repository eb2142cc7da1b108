"""RLO-2 at work: values, loops, procedures, arrays, recovery, guards, blends, durations."""

import math
from collections.abc import Callable

import attrs
import numpy as np
import pytest

from armwright.arm.model import Joint
from armwright.cell.frames import WORLD
from armwright.cell.model import Cell
from armwright.kinematics.forward_kinematics import forward
from armwright.program.vm.machine import Limits
from program.running import EXACT, cell_of, down, expect, failure, printed, run

PLACES = (
    "VAR a, b, c : FRAME ; t : TRANS ; n, m : SCALAR ; BEGIN n = 0 ; m = 0 ; "
    "a = (1,0,0, 0,-1,0, 0,0,-1, 0.40,0.15,0.20) ; b = (1,0,0, 0,-1,0, 0,0,-1, 0.50,-0.10,0.15) ; "
    "c = (1,0,0, 0,-1,0, 0,0,-1, 0.45,-0.15,0.10) ; t = XYZ(0, 0, -0.05) ; "
)


def say(expression: str, units: str = "") -> str:
    return printed(run(f"{units} {PLACES} PRINT({expression}) END."))[0]


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("1 + 2 * 3", "7"),
        ("(1 + 2) * 3", "9"),
        ("7 - 2 - 1", "4"),
        ("8 / 4 / 2", "1"),
        ("-2 * -3", "6"),
        ("--2", "2"),
        ("1 < 2 AND 2 < 1", "false"),
        ("1 < 2 OR 2 < 1", "true"),
        ("NOT 1 = 1", "false"),
        ("1 <> 2", "true"),
        ("1 >= 1", "true"),
        ("DIST(a, b)", f"{math.dist((0.4, 0.15, 0.2), (0.5, -0.1, 0.15)):.6g}"),
        ("2cm", "0.02"),
        ("1in", "0.0254"),
        ("250ms", "0.25"),
        ("3N", "3"),
        ('"text", 5', "text 5"),
        ("XYZ(1, 2, 3) * INV(XYZ(1, 2, 3))", "(1,0,0, 0,1,0, 0,0,1, 0,0,0)"),
        ("ROTZ(90)", "(0,1,0, -1,0,0, 0,0,1, 0,0,0)"),
        ("INV(a) * b", "(1,0,0, 0,1,0, 0,0,1, 0.1,0.25,0.05)"),
    ],
)
def test_values_of_expressions(expression: str, value: str) -> None:
    """Operators bind as in Pascal's school book, and places multiply like matrices."""
    assert say(expression) == value


@pytest.mark.parametrize(
    ("units", "expression", "value"),
    [
        ("UNITS MM ;", "2cm", "20"),
        ("UNITS MM ;", "DIST(WORLD, WORLD * XYZ(3, 4, 0))", "5"),
        ("UNITS IN ;", "127mm", "5"),
        ("UNITS RAD ;", "180deg", "3.14159"),
        ("UNITS MM, RAD ;", "ROTZ(0)", "(1,0,0, 0,1,0, 0,0,1, 0,0,0)"),
    ],
)
def test_values_in_units(units: str, expression: str, value: str) -> None:
    """Numbers with a unit count in the unit of the program, and distances come back in it."""
    text = f"{units} BEGIN PRINT({expression}) END."

    assert printed(run(text)) == [value]


def test_and_looks_no_further_than_it_must() -> None:
    """The right side of AND and OR is left alone where the left side decides."""
    text = "VAR x : ARRAY [3] OF SCALAR ; n : SCALAR ; BEGIN n = 0 ; "
    text += "IF n > 0 AND x[n] > 1 THEN PRINT(1) ELSE PRINT(2) ; IF n = 0 OR x[n] = 1 THEN PRINT(3) END."

    assert printed(run(text)) == ["2", "3"]


@pytest.mark.parametrize(
    ("head", "passes"),
    [
        ("1 TO 3", ["1", "2", "3"]),
        ("3 TO 1", []),
        ("3 TO 1 STEP -1", ["3", "2", "1"]),
        ("0 TO 1 STEP 0.25", ["0", "0.25", "0.5", "0.75", "1"]),
        ("0 TO 0.3 STEP 0.1", ["0", "0.1", "0.2", "0.3"]),
        ("1 TO m + 2", ["1", "2"]),
    ],
)
def test_for_loops(head: str, passes: list[str]) -> None:
    """FOR counts without drift: a tenth added three times is three tenths."""
    assert printed(run(PLACES + f"FOR n = {head} DO PRINT(n) END.")) == passes


def test_for_bounds_are_evaluated_once() -> None:
    """A bound that the loop changes does not change the loop."""
    assert printed(run(PLACES + "m = 2 ; FOR n = 1 TO m DO BEGIN m = 9 ; PRINT(n) END END.")) == ["1", "2"]


def test_while_and_repeat() -> None:
    """WHILE looks first, REPEAT looks last."""
    text = PLACES + "WHILE n < 3 DO n = n + 1 ; REPEAT n = n + 1 UNTIL n > 2 ; PRINT(n) END."

    assert printed(run(text)) == ["4"]


def test_recursion_by_value() -> None:
    """A number is passed by value: every call has its own."""
    text = (
        "VAR sum : SCALAR ; PROCEDURE add(k : SCALAR) ; BEGIN IF k > 0 THEN BEGIN add(k - 1) ; sum = sum + k END END ;"
        "BEGIN sum = 0 ; add(100) ; PRINT(sum) END."
    )

    assert printed(run(text)) == ["5050"]


def test_frames_by_reference() -> None:
    """A procedure can place, hang and release the caller's frame."""
    text = (
        "VAR part, slot : FRAME ; PROCEDURE hang(f, g : FRAME) ; BEGIN f = g * XYZ(0, 0, -0.1) ; AFFIX f TO g END ;"
        "BEGIN slot = (1,0,0, 0,-1,0, 0,0,-1, 0.4,0,0.1) ; hang(part, slot) ; slot = slot * XYZ(0.1, 0, 0) END."
    )
    recording = run(text)

    assert recording.tree.parent("PART") == "SLOT"
    expect(recording, PART=down(0.5, 0, 0.2))


def test_local_frames_go_with_their_procedure() -> None:
    """What hung on a local frame keeps its place when the procedure is over."""
    text = (
        "VAR part : FRAME ; PROCEDURE put(d : SCALAR) ; VAR nest : FRAME ; BEGIN "
        "nest = (1,0,0, 0,-1,0, 0,0,-1, 0.4,0,d) ; AFFIX part TO nest AT XYZ(0, 0, -0.1) END ;"
        "BEGIN put(0.1) ; put(0.2) END."
    )
    recording = run(text)

    assert recording.tree.parent("PART") == WORLD
    expect(recording, PART=down(0.4, 0, 0.3))
    assert not any("NEST" in name for name in recording.tree)


def test_expression_as_a_frame_argument() -> None:
    """A place that is worked out stands in an unnamed frame for the call."""
    text = PLACES.replace("BEGIN n", "PROCEDURE go(f : FRAME) ; BEGIN MOVE ARM_1 TO f END ; BEGIN n", 1)
    recording = run(text + "go(a * t) END.")

    expect(recording, ARM_1=down(0.40, 0.15, 0.25))


def test_arrays_by_reference() -> None:
    """A procedure fills the caller's array."""
    text = (
        "VAR x : ARRAY [4] OF SCALAR ; i : SCALAR ; PROCEDURE fill(y : ARRAY [4] OF SCALAR) ; VAR k : SCALAR ;"
        "BEGIN FOR k = 1 TO 4 DO y[k] = k * k END ; BEGIN fill(x) ; PRINT(x[1], x[4]) END."
    )

    assert printed(run(text)) == ["1 16"]


def test_rigid_links_move_the_parent() -> None:
    """A frame that hangs rigidly takes its parent along when it is placed; one that does not, does not."""
    for how, x in (("RIGIDLY", 0.5), ("NONRIGIDLY", 0.4), ("", 0.4)):
        text = PLACES + f"AFFIX b TO a AT XYZ(0.1, 0, 0) {how} ; b = b * XYZ(0.1, 0, 0) END."
        expect(run(text), A=down(x, 0.15, 0.20), B=down(0.6, 0.15, 0.20))


def test_unfix_without_from() -> None:
    """UNFIX cuts a frame from whatever it hangs on."""
    recording = run(PLACES + "AFFIX b TO a ; UNFIX b ; a = a * XYZ(1, 0, 0) END.")

    expect(recording, B=down(0.50, -0.10, 0.15))
    assert recording.tree.parent("B") == WORLD


def test_recover_and_retry() -> None:
    """What goes wrong leads to RECOVER, and RETRY begins the TRY again."""
    text = PLACES + (
        "TRY n = n + 1 ; PRINT(n) ; IF n < 3 THEN MOVE ARM_1 TO a * XYZ(9, 0, 0) ; MOVE ARM_1 TO a "
        "RECOVER PRINT(-n) ; RETRY END ; PRINT(m) END."
    )
    recording = run(text)

    assert printed(recording) == ["1", "-1", "2", "-2", "3", "0"]
    expect(recording, ARM_1=down(0.40, 0.15, 0.20))
    assert sum(effect.kind == "ERROR" for effect in recording.effects) == 2


def test_recover_from_inside_a_procedure() -> None:
    """An error in a procedure is caught by the TRY of the caller, and its variables are gone."""
    text = (
        "VAR n : SCALAR ; PROCEDURE bad(k : SCALAR) ; VAR f : FRAME ; BEGIN f = WORLD ; n = k / 0 END ;"
        "BEGIN n = 1 ; TRY bad(2) RECOVER PRINT(n) END END."
    )
    recording = run(text)

    assert printed(recording) == ["1"]
    assert not any("'" in name for name in recording.tree)


def test_an_error_in_recover_goes_outward() -> None:
    """RECOVER does not catch its own errors; the TRY around it does."""
    text = PLACES + "TRY TRY n = 1 / 0 RECOVER n = 2 / 0 END RECOVER PRINT(5) END END."

    assert printed(run(text)) == ["5"]


def test_program_goes_on_after_a_guard_without_halt() -> None:
    """An action without HALT is done once, at the first tick at which its condition holds, and the motion goes on."""
    text = PLACES + "MOVE ARM_1 TO a STRAIGHTLY, ON DIST(ARM_1, a) < 0.05 DO PRINT(DIST(ARM_1, a)) END."
    recording = run(text)

    (line,) = printed(recording)
    assert float(line) == pytest.approx(0.05, abs=1e-3)
    assert float(line) < 0.05
    expect(recording, ARM_1=down(0.40, 0.15, 0.20))


def test_guard_stops_in_a_controlled_way() -> None:
    """HALT in an action brakes within the limits, and the frame table holds the place that was reached."""
    text = PLACES + "MOVE ARM_1 TO a STRAIGHTLY, ON DIST(ARM_1, a) < 0.08 DO HALT ; PRINT(DIST(ARM_1, a)) END."
    recording = run(text)

    (line,) = printed(recording)
    assert 0.001 < float(line) < 0.08
    (s,) = recording.streams
    limit = recording.cell.arms["ARM_1"].arm.limits.acceleration
    assert (np.abs(s.qdd).max(axis=0) <= limit * (1 + 1e-6)).all()
    jump = np.abs(np.diff(s.qd, axis=0))
    assert (jump <= 1.01 * limit * recording.cell.period).all()


def test_contact_without_a_guard() -> None:
    """A motion that would run into the plane is refused before it begins."""
    text = PLACES + "a = (1,0,0, 0,-1,0, 0,0,-1, 0.45,0,0.01) ; MOVE ARM_1 TO a STRAIGHTLY END."
    error = failure(text, cell_of("jam"))

    assert error.diagnostic.code == "E404"
    assert "z = 45 mm" in error.diagnostic.message
    assert error.time == 0


def test_duration() -> None:
    """WITH DURATION the whole MOVE takes as long as asked, whatever its stages; less than possible is refused."""
    recording = run(PLACES + "MOVE ARM_1 TO a WITH APPROACH = a * t, WITH DURATION = 7.5 END.")
    assert recording.duration == pytest.approx(7.5, abs=0.01)

    error = failure(PLACES + "MOVE ARM_1 TO a WITH DURATION = 10ms END.").diagnostic
    assert error.code == "E405"
    assert "s or more" in error.label


@pytest.mark.parametrize("period", [1e-3, 4e-3, 0.1])
def test_duration_of_several_stages(period: float) -> None:
    """With DEPARTURE and APPROACH, each of which ends on a tick, the whole takes what was asked to the tick."""
    cell = attrs.evolve(cell_of("cell1"), period=period)
    text = PLACES + "MOVE ARM_1 TO a WITH DEPARTURE = ARM_1 * t, WITH APPROACH = a * t, WITH DURATION = 7.5123 END."

    recording = run(text, cell)

    assert len(recording.stages) == 3
    assert 7.5123 - 1e-9 <= recording.duration < 7.5123 + period
    for stage in recording.stages:
        assert stage.stage.trajectory.duration / period == pytest.approx(
            round(stage.stage.trajectory.duration / period)
        )


def changed(cell: Cell, joints: Callable[[Joint], Joint] = lambda joint: joint, **fields: float) -> Cell:
    """Return a cell whose arms have other joints, and other fields."""
    arms = {}
    for name, placed in cell.arms.items():
        arm = attrs.evolve(placed.arm, joints=[joints(joint) for joint in placed.arm.joints], **fields)
        arms[name] = attrs.evolve(placed, arm=arm)
    return attrs.evolve(cell, arms=arms)


def weak(joint: Joint) -> Joint:
    return attrs.evolve(joint, limits=attrs.evolve(joint.limits, effort=1.0))


def unlimited(joint: Joint) -> Joint:
    return attrs.evolve(joint, limits=attrs.evolve(joint.limits, speed=math.inf, acceleration=math.inf))


def slow(joint: Joint) -> Joint:
    return attrs.evolve(joint, limits=attrs.evolve(joint.limits, speed=joint.limits.speed / 10))


def test_the_shortest_duration() -> None:
    """As long as it takes in any case may be asked for, and the limits still slow it; a little less may not."""
    cell = changed(cell_of("cell1"), slow)
    free = run(f"{PLACES} MOVE ARM_1 TO a STRAIGHTLY END.", cell)
    move = f"{PLACES} MOVE ARM_1 TO a STRAIGHTLY, WITH DURATION = {{:.6f}} END."

    again = run(move.format(free.duration), cell)
    longer = run(move.format(2 * free.duration), cell)

    assert again.duration == pytest.approx(free.duration, abs=1e-9)
    assert "limited by the speed of joint" in again.stages[0].stage.slowed
    assert not longer.stages[0].stage.slowed
    assert failure(move.format(free.duration - 3 * cell.period), cell).diagnostic.code == "E405"


@pytest.mark.parametrize(
    ("cell", "move", "said"),
    [
        (changed(cell_of("cell1"), weak), "VIA (a, b), WITH BLEND = 3cm", "gravity and Coulomb friction alone require"),
        (changed(cell_of("cell1"), unlimited), "DIRECTLY", "no moving joint has a limit of speed or acceleration"),
    ],
)
def test_a_move_that_the_arm_cannot_make_at_any_speed(cell: Cell, move: str, said: str) -> None:
    """It is an error of the run, at the MOVE, after what was done until then; RECOVER goes on from there."""
    error = failure(f"{PLACES} PAUSE 0.5 ; MOVE ARM_1 TO c {move} END.", cell)

    assert error.diagnostic.code == "E406"
    assert said in error.diagnostic.message
    assert error.diagnostic.span is not None
    assert error.recording is not None
    assert error.recording().duration == pytest.approx(0.5)
    assert printed(run(f'{PLACES} TRY MOVE ARM_1 TO c {move} RECOVER PRINT("on") END END.', cell)) == ["on"]


@pytest.mark.parametrize("clause", ["", ", WITH BLEND = 3cm"])
def test_length_is_that_of_the_way_that_the_hand_went(clause: str) -> None:
    """The way past frames is shorter than its legs, by what its corners cut off."""
    recording = run(f"{PLACES} MOVE ARM_1 TO a ; MOVE ARM_1 TO a VIA (b, c){clause} END.")

    *_, stage = recording.stages
    arm = recording.cell.arms["ARM_1"].arm
    hand = forward(arm, stage.motion(np.linspace(0, stage.duration, 3000)))[:, :3, 3]
    gone = np.linalg.norm(np.diff(hand, axis=0), axis=1).sum()
    assert stage.length == pytest.approx(gone, rel=1e-3)


def test_blend_rounds_corners() -> None:
    """BLEND passes a via point at less than the distance asked for, and never stops there."""
    recording = run(PLACES + "MOVE ARM_1 TO c VIA (a, b), WITH BLEND = 3cm END.")

    (stage,) = recording.stages
    assert stage.stage.kind == "BLEND"
    assert 0.001 < stage.stage.deviation < 0.03
    expect(recording, ARM_1=down(0.45, -0.15, 0.10))
    (s,) = recording.streams
    middle = slice(len(s.t) // 10, -len(s.t) // 10)
    assert np.abs(s.qd[middle]).max(axis=1).min() > 0.01


@pytest.mark.parametrize(
    ("text", "code", "says"),
    [
        ("n = 1 / m", "E240", "divided by 0"),
        ("n = 1E99 * 1E99", "E240", "exceeds 1e+100"),
        ("FOR n = 1 TO 3 STEP m DO PRINT(n)", "E229", "STEP"),
        ("PAUSE m - 1", "E231", "-1 s"),
        ("MOVE ARM_1 TO a WITH SPEED = n + m", "E207", "outside 1..120"),
        ("OPEN ARM_1 TO n - 1", "E231", "cannot open"),
        ("MOVE ARM_1 TO (m,0,0, 0,1,0, 0,0,1, 0,0,0)", "E206", "not a rotation"),
        ("IF n = 0 THEN AFFIX a TO ARM_1 AT t RIGIDLY ; a = b", "E310", "rigidly attached"),
        ("MOVE ARM_1 TO a * XYZ(40, 0, 0)", "E402", "cannot be reached"),
    ],
)
def test_what_goes_wrong_at_run_time(text: str, code: str, says: str) -> None:
    """Numbers that are only known at run time are checked there, with the words of the checker."""
    error = failure(PLACES + f"{text} END.").diagnostic

    assert (error.code, says in error.message + error.label) == (code, True)


def test_index_at_run_time() -> None:
    """An index that is worked out is checked when it is used."""
    text = "VAR x : ARRAY [2,3] OF SCALAR ; n : SCALAR ; BEGIN n = 4 ; x[1,n] = 1 END."
    error = failure(text).diagnostic

    assert error.code == "E222"
    assert error.message == "index 2 of `x` is 4, not an integer from 1 to 3"


def test_recursion_without_end() -> None:
    """A procedure that calls itself for ever is ended, and the message shows the call."""
    error = failure("PROCEDURE p ; BEGIN p() END ; BEGIN p() END.", limits=Limits(depth=50)).diagnostic

    assert error.code == "E505"
    assert any("called here" in label.text for label in error.secondary)


def test_metres_are_named() -> None:
    """A place far away is probably in another unit than the program's."""
    error = failure(PLACES + "MOVE ARM_1 TO a * XYZ(400, 0, 0) END.").diagnostic

    assert any("lengths in this program are metres" in help_ for help_ in error.helps)


def test_halt_ends_the_program() -> None:
    """Nothing behind HALT is done, and the devices are off."""
    recording = run(PLACES + "OPERATE torch ; PRINT(1) ; HALT ; PRINT(2) END.")

    assert printed(recording) == ["1"]
    assert recording.effects[-1].text == "HALT; torch OFF"


def test_exactness_of_quarter_turns() -> None:
    """Four quarter turns are the identity to the last digit."""
    recording = run("VAR f : FRAME ; BEGIN f = WORLD * ROTX(90) * ROTX(90) * ROTX(90) * ROTX(90) END.")

    np.testing.assert_array_equal(recording.tree.world("F"), np.eye(4))
    assert EXACT > 0


@pytest.mark.parametrize("units", ["M", "MM"])
def test_no_distance_but_rounding(units: str) -> None:
    """A hand that has come to its goal is no distance from it, though its joints round; a micrometre is told."""
    text = (
        f"UNITS {units} ; VAR f : FRAME ; BEGIN f = WORLD * XYZ(450mm, 151mm, 63mm) * ROTX(180) * ROTZ(12.3) ;"
        "MOVE ARM_1 TO f ; PRINT(DIST(ARM_1, f)) ; IF DIST(ARM_1, f) = 0 THEN PRINT(1) ;"
        "PRINT(DIST(f, f * XYZ(0.001mm, 0, 0))) END."
    )

    assert printed(run(text)) == ["0", "1", "1e-06" if units == "M" else "0.001"]
