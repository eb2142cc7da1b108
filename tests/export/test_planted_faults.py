"""A checker notices what is wrong in an exported file."""

import json
import re
from itertools import pairwise

import attrs
import numpy as np
import pytest

from armwright.arm import Coupling
from armwright.errors import CheckFailedError
from armwright.export import export_run
from armwright.export.checkers import (
    fanuc as fanuc_checker,
    krl as krl_checker,
    rapid as rapid_checker,
    urscript as urscript_checker,
)
from armwright.export.checkers.actions import CheckError
from armwright.export.checkers.comparison import compare
from armwright.export.checkers.joint_tables import compare_counts, compare_trajectory
from armwright.export.proof import Comparison, Proof
from armwright.export.writers import drive_csv, fanuc, krl, rapid, ros2, urscript
from export.cases import planned, recorded, with_number_changed

LANGUAGES = {
    "urscript": (urscript, urscript_checker),
    "krl": (krl, krl_checker),
    "rapid": (rapid, rapid_checker),
    "fanuc": (fanuc, fanuc_checker),
}
MOTIONS = r"[JL] P\[|mov|MoveL|MoveAbsJ|servoj|PTP \{|LIN \{"
PROGRAM = """
VAR a, b, c : FRAME ;
BEGIN
  a = (1,0,0, 0,-1,0, 0,0,-1, 0.40, 0.15,0.20) ;
  b = (1,0,0, 0,-1,0, 0,0,-1, 0.45, 0.00,0.25) ;
  c = (1,0,0, 0,-1,0, 0,0,-1, 0.40,-0.15,0.20) ;
  MOVE ARM_1 TO a ;
  OPERATE LAMP ON ;
  MOVE ARM_1 TO c STRAIGHTLY ;
  PAUSE 0.5 ;
  PRINT ("at c") ;
  MOVE ARM_1 TO a VIA (b), WITH BLEND = 0.02 ;
END.
"""
KNOTS = PROGRAM.replace("END.", "MOVE ARM_1 TO c VIA (b) ; END.")


def failed(target: str, text: str, program: str = PROGRAM) -> set[str]:
    """The quantities of a file that are beyond what is allowed."""
    try:
        read = LANGUAGES[target][1].read(text)
    except CheckError as error:
        return {str(error)}
    return {one.quantity for one in compare(read, planned(program, target)) if not one.passed}


def written(target: str, program: str = PROGRAM) -> str:
    """The right file."""
    return str(LANGUAGES[target][0].write(planned(program, target)).text)


def numbers_of(text: str, line: int) -> int:
    """The line with the numbers of a motion: its own, or that of the position it names."""
    lines = text.splitlines()
    place = re.search(r"P\[\d+\]", lines[line])
    return line if place is None else lines.index(f"{place[0]}{{") + 3


@pytest.mark.parametrize("target", LANGUAGES)
def test_nothing_is_found_in_the_right_file(target: str) -> None:
    """The file as it is written passes."""
    assert failed(target, written(target)) == set()


@pytest.mark.parametrize("target", LANGUAGES)
def test_every_motion_counts(target: str) -> None:
    """A number in the middle of any motion that is off by a hundredth is found, whatever its unit."""
    text = written(target)
    lines = [i for i, line in enumerate(text.splitlines()) if re.search(MOTIONS, line)]
    assert len(lines) == 5 or target == "fanuc"  # which has knots on rounded corners

    for line in lines:
        changed = with_number_changed(text, numbers_of(text, line), 0.01)
        assert changed != text
        assert failed(target, changed), text.splitlines()[line]


@pytest.mark.parametrize("target", LANGUAGES)
def test_every_line_counts(target: str) -> None:
    """No motion, output, wait or text can be left out, doubled or swapped with the next."""
    lines = written(target).splitlines(keepends=True)
    words = (
        r"[JL] P\[|DO\[|WAIT \d|MESSAGE|mov|sleep|digital|textmsg|MoveL|MoveAbsJ|SetDO|WaitTime|TPWrite|PTP \{|LIN \{|"
        r"WAIT SEC|\$OUT|\$LOOP_MSG\[\]="
    )
    motions = [i for i, line in enumerate(lines) if re.search(words, line)]

    for i in motions:
        assert failed(target, "".join(lines[:i] + lines[i + 1 :])), lines[i]
        assert failed(target, "".join([*lines[: i + 1], lines[i], *lines[i + 1 :]])), lines[i]
    for i, j in pairwise(motions[1:6]):
        swapped = [*lines]
        swapped[i], swapped[j] = lines[j], lines[i]
        assert failed(target, "".join(swapped)), (lines[i], lines[j])


@pytest.mark.parametrize("target", LANGUAGES)
def test_every_knot_counts(target: str) -> None:
    """A knot, or a sample of a stream, that is off, left out or doubled is found."""
    text = written(target, KNOTS)
    lines = text.splitlines(keepends=True)
    knots = [i for i, line in enumerate(lines) if re.search(r"servoj|C_PTP|z1,|CNT100", line)]
    middle = knots[len(knots) // 2]

    assert failed(target, text, KNOTS) == set()
    assert failed(target, with_number_changed(text, numbers_of(text, middle), 0.01), KNOTS)
    assert failed(target, "".join(lines[:middle] + lines[middle + 1 :]), KNOTS)
    assert failed(target, "".join(lines[:middle] + lines[middle : middle + 1] * 2 + lines[middle + 1 :]), KNOTS)


@pytest.mark.parametrize(
    ("target", "stop", "passed"),
    [("krl", "}\n", "} C_PTP\n"), ("rapid", ",fine,", ",z1,"), ("fanuc", " FINE", " CNT100")],
)
def test_the_last_knot_is_a_stop(target: str, stop: str, passed: str) -> None:
    """A path that ends without a stop is found."""
    text = written(target, KNOTS)
    end = text.rindex(stop)

    assert failed(target, text[:end] + passed + text[end + len(stop) :], KNOTS) == {
        "statements that differ in kind, text or order"
    }


@pytest.mark.parametrize(
    ("target", "right", "wrong", "quantity"),
    [
        ("urscript", "set_standard_digital_out(1, True)", "set_standard_digital_out(1, False)", "statements"),
        ("urscript", "set_standard_digital_out(1, True)", "set_standard_digital_out(2, True)", "statements"),
        ("urscript", 'textmsg("at c")', 'textmsg("at d")', "statements"),
        ("urscript", "sleep(0.5000)", "sleep(0.6000)", "durations"),
        ("urscript", "set_tcp(p[0.0000000, ", "set_tcp(p[0.0100000, ", "positions"),
        ("urscript", ", r=0.02000)", ", r=0.02000)\n  sleep(0)", "statements"),
        ("urscript", ", r=0.02000)", ", r=0.04000)", "corner zones"),
        ("krl", "$APO.CDIS=20.000", "$APO.CDIS=40.000", "corner zones"),
        ("rapid", "[FALSE,20.000,", "[FALSE,40.000,", "corner zones"),
        ("krl", "$OUT[2]=TRUE", "$OUT[2]=FALSE", "statements"),
        ("krl", ",S 2,", ",S 3,", "configuration"),
        ("krl", ",S 2,", ",S 0,", "configuration"),
        ("krl", "BAS(#VEL_PTP,10)", "BAS(#VEL_PTP,110)", None),
        ("krl", "WAIT SEC 0.5000", "WAIT SEC 0.4000", "durations"),
        ("krl", "$TOOL={X 0.00000,", "$TOOL={X 1.00000,", "positions"),
        ("rapid", "SetDO doLamp,1", "SetDO doLamp,0", "statements"),
        ("rapid", "SetDO doLamp,1", "SetDO doGrip,1", "statements"),
        ("rapid", ",fine,tool_1;", ",z50,tool_1;", "statements"),
        ("rapid", ",0],[9E9", ",1],[9E9", "configuration"),
        ("rapid", "WaitTime 0.5000", "WaitTime 0.4000", "durations"),
        ("fanuc", "DO[2]=ON", "DO[2]=OFF", "statements"),
        ("fanuc", "WAIT 0.50(sec)", "WAIT 0.52(sec)", "durations"),
        ("fanuc", "MESSAGE[at c]", "MESSAGE[at d]", "statements"),
        ("fanuc", "PR[9,1]=0.00000", "PR[9,1]=1.00000", "positions"),
    ],
)
def test_single_faults(target: str, right: str, wrong: str, quantity: str | None) -> None:
    """A wrong output, text, wait, tool, zone or configuration is found, and named."""
    text = written(target)
    assert right in text
    # The first motion, to where the program begins, is as fast as one likes.
    changed = text.replace(right, wrong) if wrong.startswith((",z50", "BAS")) else text.replace(right, wrong, 1)

    found = failed(target, changed)
    if quantity is not None:
        assert any(one.startswith(quantity) for one in found), found


@pytest.mark.parametrize("target", LANGUAGES)
def test_speeds_beyond_the_limits(target: str) -> None:
    """A motion that is to take a tenth of its time would be faster than the joints can."""
    faster = {
        "urscript": (r"t=0\.(\d)(\d\d\d)\)", r"t=0.0\1\2)"),
        "krl": (r"\$VEL\.CP=0\.", "$VEL.CP=9."),
        "rapid": (r"T:=0\.(\d)", r"T:=0.0\1"),
        "fanuc": (r"(\d)\dmsec FINE", r"\1msec FINE"),
    }[target]

    assert "joint speeds that the file asks for, of the limits" in failed(target, re.sub(*faster, written(target)))


@pytest.mark.parametrize(
    ("target", "right", "wrong"),
    [
        ("urscript", "sleep(0.5000)", "freedrive_mode()"),
        ("urscript", "def x():", "def x(n):"),
        ("urscript", "end\nx()", "end\ny()"),
        ("krl", "WAIT SEC 0.5000", "HALT"),
        ("krl", "$BASE=$NULLFRAME", "$BASE=BASE_DATA[1]"),
        ("krl", ",S 2,T ", ",S 2,E1 "),
        ("krl", "=TRUE", "=MAYBE"),
        ("rapid", "WaitTime 0.5000", "WaitUntil TRUE"),
        ("rapid", "fine,tool_1;", "fine,tool_2;"),
        ("rapid", "PROC main()", "PROC other()"),
        ("fanuc", "WAIT 0.50(sec)", "WAIT DI[1]=ON"),
        ("fanuc", "UFRAME_NUM=0", "UFRAME_NUM=1"),
        ("fanuc", "PR[9]=LPOS", "PR[9]=JPOS"),
        ("fanuc", "UTOOL_NUM=9", "UTOOL_NUM=8"),
        ("fanuc", " FINE ;", " FINE Offset,PR[1] ;"),
        ("fanuc", "UT : 9,", "UT : 9, CONFIG : 'N U T, 0, 0, 0',"),
    ],
)
def test_what_a_checker_does_not_know(target: str, right: str, wrong: str) -> None:
    """A statement that a checker does not know is no proof."""
    text = written(target)
    assert right in text

    with pytest.raises(CheckError, match=r"line \d+: "):
        LANGUAGES[target][1].read(text.replace(right, wrong))


def test_a_proof_that_fails() -> None:
    """A failed proof names what is off, by how much, and where."""
    fine = Comparison(quantity="angles", count=3, worst=0.1, allowed=1.0, unit="rad")
    wrong = Comparison(quantity="places", count=2, worst=0.5, allowed=0.1, unit="mm", where="line 7")
    proof = Proof(target="krl", comparisons=(fine, wrong), approximations=("corners",))

    with pytest.raises(CheckFailedError, match=r"places: 2 compared, at most 0\.5 of 0\.1 mm \(line 7\)") as caught:
        proof.require()
    assert "angles" not in str(caught.value)
    assert [one["passed"] for one in proof.as_data()["comparisons"]] == [True, False]
    assert proof.lines()[-1] == "approximated: corners"


# ---- tables --------------------------------------------------------------------------------------------------------


def trajectory_failures(change: dict[str, object], point: int) -> set[str]:
    """What is beyond what is allowed in a trajectory with one point changed."""
    recording = recorded(PROGRAM, "urscript")
    texts = [file.text for file in ros2.write(recording, "ARM_1")]
    data = json.loads(texts[0])
    data["points"][point] |= change
    return {
        one.quantity
        for one in compare_trajectory(json.dumps(data), json.dumps({"trajectory": data}), recording, "ARM_1")
        if not one.passed
    }


def test_faults_in_trajectories() -> None:
    """A position, a speed, an acceleration or a time that is off is found."""
    assert trajectory_failures({}, 3) == set()
    assert "joints between the points" in trajectory_failures({"positions": [0.0] * 6}, 3)
    assert "joints between the points" in trajectory_failures({"velocities": [0.5] * 6}, 3)
    assert "joints between the points" in trajectory_failures({"accelerations": [90.0] * 6}, 3)
    assert trajectory_failures({"time_from_start": {"sec": 0, "nanosec": 1000}}, 3)
    assert "joint speeds at the end" in trajectory_failures({"velocities": [0.5] * 6}, -1)


def test_trajectories_are_quintic() -> None:
    """The points of a trajectory, with quintic splines between them, are the motion to a hundredth of a millimetre."""
    recording = recorded(PROGRAM, "urscript")
    proof = export_run("ros2", recording, "x").proof
    worst = {one.quantity: one for one in proof.comparisons}

    assert worst["ARM_1: joints between the points"].worst < 2e-6
    data = json.loads(export_run("ros2", recording, "x").files["ARM_1.goal.yaml"])["trajectory"]
    assert data["joint_names"][0] == "shoulder_pan_joint"
    assert len(data["points"]) < 40 * len(recording.stages)


def test_faults_in_tables_of_counts() -> None:
    """A count that is off by two is found, and so is a missing row."""
    recording = recorded(PROGRAM, "urscript")
    (file,) = drive_csv.write(recording, "ARM_1")
    lines = file.text.splitlines(keepends=True)

    def failures(text: str) -> set[str]:
        return {one.quantity for one in compare_counts(text, recording, "ARM_1") if not one.passed}

    assert failures(file.text) == set()
    first, *others = lines[300].split(",")
    assert failures("".join([*lines[:300], ",".join([str(int(first) + 2), *others]), *lines[301:]])) == {"positions"}
    assert "positions" in failures("".join([*lines[:300], *lines[301:]]))


def test_counts_of_drives() -> None:
    """Counts are those of the angles, by the counts per revolution, at every period of the drives."""
    recording = recorded(PROGRAM, "urscript")
    (file,) = drive_csv.write(recording, "ARM_1")
    head, names, *rows = file.text.splitlines()
    first = np.array([int(number) for number in rows[0].split(",")])

    assert head == "# period 0.002 s; positions in counts"
    assert names == ",".join(f"joint_{i}" for i in range(1, 7))
    np.testing.assert_array_equal(first, np.rint(recording.cell.arms["ARM_1"].start / (2 * np.pi) * 1048576))
    assert len(rows) == np.ceil(recording.duration / 0.002 - 1e-6) + 1


def test_counts_of_coupled_drives() -> None:
    """Of coupled drives the counts are where the drives are; in counts of the joints the check finds the fault."""
    before = recorded(PROGRAM, "urscript")
    placed = before.cell.arms["ARM_1"]
    C = np.eye(6)
    C[2, 1] = -1.0
    coupled = attrs.evolve(placed, arm=attrs.evolve(placed.arm, coupling=Coupling(matrix=C)))
    recording = attrs.evolve(before, cell=attrs.evolve(before.cell, arms={**before.cell.arms, "ARM_1": coupled}))
    (file,), (plain,) = drive_csv.write(recording, "ARM_1"), drive_csv.write(before, "ARM_1")
    own, of_joints = (np.loadtxt(text.text.splitlines()[2:], delimiter=",", dtype=int) for text in (file, plain))

    assert file.text.splitlines()[1] == ",".join(f"drive_{i}" for i in range(1, 7))
    assert all(one.passed for one in compare_counts(file.text, recording, "ARM_1"))
    assert not all(one.passed for one in compare_counts(plain.text, recording, "ARM_1"))
    np.testing.assert_allclose(own, of_joints @ np.linalg.inv(C).T, atol=1)


def test_events_beside_trajectories() -> None:
    """Outputs and texts are beside a trajectory, with their times and lines."""
    recording = recorded(PROGRAM, "urscript")
    events = json.loads(export_run("ros2", recording, "x").files["events.json"])

    assert [{key: event[key] for key in event if key != "time"} for event in events] == [
        {"line": 8, "device": "LAMP", "on": True},
        {"line": 11, "text": "at c"},
        {"line": 13, "device": "LAMP", "on": False},
    ]
    assert events[0]["time"] == recording.stages[1].t0
