"""What the action of a guard may do, and what others see of an arm that is on its way."""

import numpy as np
import pytest

from armwright.kinematics.forward_kinematics import forward
from program.running import EXACT, cell_of, down, expect, failure, printed, run

F, G = down(0.45, 0.15, 0.06), down(0.45, -0.15, 0.06)
HEAD = (
    "VAR f, g, far, part : FRAME ; n : SCALAR ; e : EVENT ;\n"
    "PROCEDURE away ; BEGIN MOVE ARM_1 TO g END ;\n"
    "PROCEDURE take ; VAR q : FRAME ; BEGIN q = f ; MOVE ARM_1 TO q ; GRASP END ;\n"
    "BEGIN\n"
    "  f = (1,0,0, 0,-1,0, 0,0,-1, 0.45,0.15,0.06) ; g = (1,0,0, 0,-1,0, 0,0,-1, 0.45,-0.15,0.06) ;\n"
    "  far = f * XYZ(9,9,9) ; part = f ; n = 0 ;\n  "
)
NEAR = "MOVE ARM_1 TO f STRAIGHTLY, ON DIST(ARM_1, f) < 0.1 DO "
# An arm may not be faster from tick to tick than this share of its limit.
AT_MOST = 1.05


def program(text: str) -> str:
    return f"{HEAD}{text}\nEND.\n"


@pytest.mark.parametrize("action", ["BEGIN MOVE ARM_1 TO g END", "away()", "BEGIN PAUSE 3 ; MOVE ARM_1 TO g END"])
def test_a_move_in_an_action_begins_at_rest(action: str) -> None:
    """A MOVE in an action ends the one around it: the arm comes to rest, within its limits, and moves on from there."""
    recording = run(program(f"{NEAR}{action} ; PRINT(DIST(ARM_1, g))"))

    moves = [effect for effect in recording.effects if effect.kind == "MOVE"]
    assert [one.text.partition("MOVE: ")[2].split(" @")[0] for one in moves] == ["LINE f", "PTP g"]
    assert "PAUSE" in action or moves[0].text.endswith("halted")
    assert moves[1].t0 >= moves[0].t1
    np.testing.assert_allclose(recording.tree.world("ARM_1"), G, atol=EXACT)
    (stream,) = recording.streams
    arm = recording.cell.arms["ARM_1"].arm
    assert (np.abs(np.diff(stream.q, axis=0)) <= AT_MOST * arm.limits.speed * recording.cell.period).all()
    at = round(moves[1].t0 / recording.cell.period)
    assert np.abs(stream.q[at] - stream.q[at - 1]).max() < np.abs(np.diff(stream.q, axis=0)).max() / 10


def test_another_arm_in_an_action() -> None:
    """A process makes one MOVE at a time, so a MOVE of another arm in an action ends the one around it too."""
    recording = run(
        program(f"{NEAR}BEGIN MOVE ARM_2 TO ARM_2 * XYZ(0, 0, -0.05) END ; MOVE ARM_1 TO g"), cell_of("cell2")
    )

    assert [one.arm for one in recording.effects if one.kind == "MOVE"] == ["ARM_1", "ARM_2", "ARM_1"]
    np.testing.assert_allclose(recording.tree.world("ARM_1"), G, atol=EXACT)


def test_a_branch_in_an_action_leaves_the_arm_alone() -> None:
    """The arm of a MOVE is not free for a branch that an action begins."""
    error = failure(program(f"{NEAR}BEGIN COBEGIN BEGIN MOVE ARM_1 TO g END ; BEGIN n = 1 END COEND END"))

    assert (error.diagnostic.code, len(error.diagnostic.secondary)) == ("E503", 1)


@pytest.mark.parametrize(
    ("action", "says"),
    [("TRY n = 1/n RECOVER HALT END", "0"), ("TRY n = 1/n RECOVER BEGIN n = 5 ; RETRY END END ; HALT", "0.2")],
)
def test_halt_after_an_error_in_an_action(action: str, says: str) -> None:
    """An error in an action stops the arm; HALT in its RECOVER finds it at rest, and the program goes on."""
    recording = run(program(f"{NEAR}BEGIN {action} END ; PRINT(n)"))

    assert [one.data["printed"] for one in recording.effects if one.kind == "PRINT"] == [says]
    cell = recording.cell
    hand = forward(cell.arms["ARM_1"].arm, recording.configurations["ARM_1"])
    np.testing.assert_allclose(recording.tree.world("ARM_1"), hand, atol=EXACT)


def test_what_is_let_go_on_the_way_stays_where_it_was_then() -> None:
    """A part that one branch cuts loose while another moves it stays where the arm was at that moment."""
    recording = run(
        program(
            "AFFIX part TO ARM_1 AT XYZ(0, 0, 0) ; COBEGIN BEGIN MOVE ARM_1 TO f STRAIGHTLY END ; "
            "BEGIN PAUSE 0.4 ; UNFIX part END COEND"
        )
    )

    (stream,) = recording.streams
    there = forward(recording.cell.arms["ARM_1"].arm, stream.q[400])
    np.testing.assert_allclose(recording.tree.world("PART"), there, atol=EXACT)
    assert np.linalg.norm(there[:3, 3] - F[:3, 3]) > 0.1


def test_a_guard_sees_another_arm_moving() -> None:
    """A condition about another arm looks at where that is now, and not at where it began its MOVE."""
    recording = run(
        program(
            "COBEGIN BEGIN MOVE ARM_1 TO f STRAIGHTLY, WITH SPEED = 10, ON DIST(ARM_2, far) < 0.05 DO HALT END ; "
            "BEGIN far = (1,0,0, 0,-1,0, 0,0,-1, 0.75,0.15,0.2) ; MOVE ARM_2 TO far END COEND"
        ),
        cell_of("cell2"),
    )

    ends = {one.arm: one.t1 for one in recording.effects if one.kind == "MOVE"}
    assert ends["ARM_1"] < ends["ARM_2"]


def test_a_grasped_frame_of_a_procedure_is_forgotten_with_it() -> None:
    """A hand that closed on a frame of a procedure moves on when there is no such frame any more."""
    recording = run(program("take() ; MOVE ARM_1 TO g"))

    np.testing.assert_allclose(recording.tree.world("ARM_1"), G, atol=EXACT)


HALTING = (
    "VAR f, g : FRAME ; n, m : SCALAR ;\n"
    "PROCEDURE enough ; BEGIN n = n + 1 ; LOCK (m) DO HALT ; n = 100 END ;\n"
    "PROCEDURE deep (k : SCALAR) ; VAR q : FRAME ;\n"
    "BEGIN q = f ; TRY IF k > 0 THEN deep(k - 1) ELSE enough() RECOVER n = 100 END ; n = 100 END ;\n"
    "BEGIN f = (1,0,0, 0,-1,0, 0,0,-1, 0.45,0.15,0.06) ; g = f * XYZ(0, 0.1, 0) ; n = 0 ; m = 0 ;\n"
)


@pytest.mark.parametrize("action", ["enough()", "deep(3)", "BEGIN deep(0) ; n = 100 END"])
def test_halt_in_a_procedure_that_an_action_calls(action: str) -> None:
    """HALT ends the MOVE whether it stands in the action or in a procedure that the action calls, at any depth."""
    behind = " ; LOCK (m) DO PRINT(n) ; MOVE ARM_1 TO g END."
    called = run(f"{HALTING}{NEAR}{action}{behind}")
    within = run(f"{HALTING}{NEAR}BEGIN n = n + 1 ; HALT END{behind}")

    assert printed(called) == printed(within) == ["1"]
    np.testing.assert_array_equal(called.streams[0].q, within.streams[0].q)
    assert not any("'" in name for name in called.tree)
    expect(called, ARM_1=called.tree.world("G"))


def test_halt_in_a_procedure_that_no_action_calls() -> None:
    """A procedure that no action calls ends the program by HALT."""
    recording = run(f"{HALTING}deep(2) ; PRINT(n) END.")

    assert printed(recording) == []
    assert recording.effects[-1].text == "HALT"


def test_frames_behind_a_call_that_may_halt() -> None:
    """Where HALT in a procedure may have ended the motion, nobody knows at which frame the hand stands."""
    text = (
        "VAR f : FRAME ;\nPROCEDURE enough ; BEGIN HALT END ;\n"
        "BEGIN f = (1,0,0, 0,-1,0, 0,0,-1, 0.45,0.15,0.06) ; OPEN ARM_1 ;\n"
        "MOVE ARM_1 TO f STRAIGHTLY, ON DIST(ARM_1, f) < 0.1 DO enough() ; GRASP ; MOVE f TO f * XYZ(0, 0, -0.1) END."
    )

    assert failure(text).diagnostic.code == "E301"


def test_a_frame_that_a_halted_hand_has_not_reached_is_not_held() -> None:
    """The fingers close on no frame where HALT ended the motion to it, even if that is put there afterwards."""
    moved = "OPEN ARM_1 ; {} ; GRASP ; IF n = 0 THEN f = ARM_1 ; MOVE f TO f * XYZ(0, 0, -0.05)"

    assert failure(program(moved.format(f"{NEAR}BEGIN IF n = 0 THEN HALT END"))).diagnostic.code == "E301"
    run(program(moved.format("MOVE ARM_1 TO f STRAIGHTLY")))


def test_a_frame_that_has_left_the_fingers_is_not_held() -> None:
    """What the fingers closed on is moved with them while it is there, not from where it has been put since."""
    moved = "OPEN ARM_1 ; MOVE ARM_1 TO f ; GRASP ; {} MOVE f TO g"

    run(program(moved.format("")))
    assert failure(program(moved.format("IF n = 0 THEN f = f * XYZ(0, 0, 0.001) ;"))).diagnostic.code == "E301"


def test_a_frame_is_still_held_after_a_move_to_where_it_is() -> None:
    """The fingers hold what they closed on until the arm has gone elsewhere without it."""
    taken = "OPEN ARM_1 ; MOVE ARM_1 TO f ; GRASP ; IF n = 0 THEN MOVE ARM_1 TO {} ; MOVE f TO g"

    run(program(taken.format("f")))
    assert failure(program(taken.format("g"))).diagnostic.code == "E301"
