"""Several processes on one clock: order, priorities, events, locks, arms, and how they stop."""

import os
import subprocess
import sys
import textwrap

import numpy as np
import pytest

from armwright.program import Source, compile as translate
from armwright.program.vm.machine import Limits
from armwright.program.vm.recording import Recording
from program.running import cell_of, corpus_text, down, expect, failure, printed, run

HOME = "VAR a, b : FRAME ; n : SCALAR ; e, g : EVENT ; BEGIN a = (1,0,0, 0,-1,0, 0,0,-1, 0.40,0.15,0.20) ; "
HOME += "b = (1,0,0, 0,-1,0, 0,0,-1, 0.70,0.15,0.20) ; n = 0 ; "


def branches(*texts: str) -> str:
    return f"{HOME} COBEGIN {' ; '.join(texts)} COEND END."


@pytest.mark.parametrize(
    ("first", "second", "order"),
    [
        ("", "", ["1", "1", "2", "2"]),
        ("PRIORITY 1 :", "PRIORITY 2 :", ["2", "2", "1", "1"]),
        ("PRIORITY 2 :", "PRIORITY 1 :", ["1", "1", "2", "2"]),
    ],
)
def test_order_of_one_instant(first: str, second: str, order: list[str]) -> None:
    """What is due at the same instant is served by priority, then in the order of the text."""
    body = "BEGIN PRINT({0}) ; PRINT({0}) END"
    recording = run(branches(f"{first} {body.format(1)}", f"{second} {body.format(2)}"))

    assert printed(recording) == order


def test_a_lock_taken_twice_is_kept_until_the_outer_end() -> None:
    """An error that leaves the inner LOCK of a frame gives back nothing that the outer one still holds."""
    recording = run(
        branches(
            "BEGIN LOCK (n) DO BEGIN TRY LOCK (n) DO PRINT(1 / n) RECOVER PRINT(1) END ; PAUSE 1 ; PRINT(2) END END",
            "BEGIN PAUSE 0.5 ; LOCK (n) DO PRINT(3) END",
        )
    )

    assert printed(recording) == ["1", "2", "3"]


def test_signal_wakes_the_important_one_first() -> None:
    """A process of high priority goes on at the instant its event comes, before the one that signalled."""
    recording = run(branches("PRIORITY 1 : BEGIN SIGNAL e ; PRINT(1) END", "PRIORITY 2 : BEGIN WAIT e ; PRINT(2) END"))

    assert printed(recording) == ["2", "1"]


def test_events_count() -> None:
    """SIGNAL adds one, WAIT takes one: two signals before the waits let both through."""
    recording = run(HOME + "SIGNAL e ; SIGNAL e ; WAIT e ; WAIT e ; PRINT(3) END.")

    assert printed(recording) == ["3"]


def waits(recording: Recording) -> list[tuple[str, str, float, float]]:
    """Return what was waited for: in which branch, in words, from when, until when."""
    return [(one.process, one.text, one.t0, one.t1) for one in recording.effects if one.kind in ("WAIT", "LOCK")]


def test_waiting_is_shown_from_its_start() -> None:
    """WAIT and LOCK last from when they begin to wait; what is there at once takes no time."""
    recording = run(
        branches(
            "BEGIN WAIT e ; LOCK (n) DO PAUSE 1 END",
            "BEGIN PAUSE 0.5 ; SIGNAL g ; SIGNAL e ; LOCK (n) DO PAUSE 2 END",
            "BEGIN PAUSE 0.75 ; WAIT g ; LOCK (a) DO PRINT(1) END",
        )
    )

    assert waits(recording) == [
        ("branch 1", "WAIT e", 0.0, pytest.approx(0.5)),
        ("branch 1", "LOCK n", pytest.approx(0.5), pytest.approx(0.5)),
        ("branch 2", "LOCK n", pytest.approx(0.5), pytest.approx(1.5)),
        ("branch 3", "WAIT g", pytest.approx(0.75), pytest.approx(0.75)),
        ("branch 3", "LOCK a", pytest.approx(0.75), pytest.approx(0.75)),
    ]


@pytest.mark.parametrize("ends", ["HALT", "n = 1 / n"])
def test_waiting_in_vain(ends: str) -> None:
    """What is waited for when a program ends is shown, too, and that it did not come."""
    text = branches(
        "BEGIN PAUSE 0.25 ; WAIT e END",
        f"BEGIN LOCK (b) DO BEGIN PAUSE 1 ; {ends} END ; SIGNAL e END",
        "BEGIN PAUSE 0.5 ; LOCK (b) DO PRINT(1) END",
    )
    recording = run(text) if ends == "HALT" else failure(text).recording()  # type: ignore[misc]

    assert waits(recording) == [
        ("branch 2", "LOCK b", 0.0, 0.0),
        ("branch 1", "WAIT e, in vain", pytest.approx(0.25), pytest.approx(1.0)),
        ("branch 3", "LOCK b, in vain", pytest.approx(0.5), pytest.approx(1.0)),
    ]
    assert [one.data["in_vain"] for one in recording.effects if "vain" in one.text] == [True, True]


def test_pauses_go_by_the_clock() -> None:
    """PAUSE takes its time on the common clock, in any unit of time."""
    recording = run(branches("BEGIN PAUSE 300ms ; PRINT(1) END", "BEGIN PAUSE 0.2 ; PRINT(2) ; PAUSE 0.2s END"))

    assert printed(recording) == ["2", "1"]
    assert recording.duration == pytest.approx(0.4)


def test_branches_share_variables() -> None:
    """What one branch writes the others read."""
    recording = run(branches("BEGIN n = 7 ; SIGNAL e END", "BEGIN WAIT e ; PRINT(n) END"))

    assert printed(recording) == ["7"]


def test_locks_keep_each_other_out() -> None:
    """A LOCK that needs a frame of another waits until that one is given back."""
    recording = run(
        branches(
            "BEGIN LOCK (a, b) DO BEGIN PRINT(1) ; PAUSE 1 ; PRINT(2) END END",
            "BEGIN LOCK (b) DO PRINT(3) END",
        )
    )

    assert printed(recording) == ["1", "2", "3"]


def test_crossed_locks() -> None:
    """Two LOCKs of the same frames in opposite order do not wait for each other for ever."""
    recording = run(
        branches(
            "BEGIN LOCK (a, b) DO PAUSE 0.1 ; PRINT(1) END",
            "BEGIN LOCK (b, a) DO PAUSE 0.1 ; PRINT(2) END",
        )
    )

    assert printed(recording) == ["1", "2"]


@pytest.mark.parametrize(
    ("declared", "first", "second"),
    [
        ("n : SCALAR", "n", "n"),
        ("n : TRANS", "n", "n"),
        ("n : EVENT", "n", "n"),
        ("n : FRAME", "n", "n"),
        ("n : ARRAY [2] OF SCALAR", "n[2]", "n[1 + 1]"),
        ("n : ARRAY [2] OF SCALAR", "n", "n[1]"),
        ("n : ARRAY [2] OF FRAME", "n[1]", "n"),
    ],
)
def test_locked_variables(declared: str, first: str, second: str) -> None:
    """Whatever can be shared can be locked: a variable of any type, an element, or an array with all its elements."""
    locked = "LOCK ({0}) DO BEGIN PRINT({1}) ; PAUSE 0.1 ; PRINT({1}) END"
    text = f"VAR {declared} ; BEGIN COBEGIN BEGIN {locked.format(first, 1)} END ; BEGIN {locked.format(second, 2)} END"

    assert printed(run(f"{text} COEND END.")) == ["1", "1", "2", "2"]


def test_different_elements() -> None:
    """LOCKs of different elements, and of different arrays whose names begin alike, do not wait for each other."""
    locked = "BEGIN LOCK ({0}) DO BEGIN PRINT({1}) ; PAUSE 0.1 ; PRINT({1}) END END"
    texts = [locked.format(name, number) for number, name in enumerate(("s[1]", "s[2]", "s1", "s2[1]"))]
    text = "VAR s, s2 : ARRAY [2] OF SCALAR ; s1 : SCALAR ; BEGIN COBEGIN " + " ; ".join(texts) + " COEND END."

    assert printed(run(text)) == [*"0123", *"0123"]


def test_locked_counter() -> None:
    """A counter that two processes lock loses no step, though each step takes its time."""
    step = "FOR {0} = 1 TO 5 DO LOCK (n) DO BEGIN {1} = n ; PAUSE 0.05 ; n = {1} + 1 END"
    text = "VAR n, i, j, k, l : SCALAR ; BEGIN n = 0 ; COBEGIN BEGIN " + step.format("i", "k")
    text += f" END ; BEGIN {step.format('j', 'l')} END COEND ; PRINT(n) END."

    assert printed(run(text)) == ["10"]


def test_locks_held_crosswise() -> None:
    """Who waits for the lock of a variable that another process holds, which waits too, is told of both."""
    take = "BEGIN LOCK ({0}) DO BEGIN PAUSE 0.1 ; LOCK ({1}) DO PAUSE 0.1 END END"
    text = f"VAR n, m : SCALAR ; BEGIN COBEGIN {take.format('n', 'm')} ; {take.format('m', 'n')} COEND END."
    error = failure(text).diagnostic

    labels = [error.label, *(label.text for label in error.secondary)]
    assert labels == [
        "branch 1 waits for the lock of m, held by branch 2",
        "branch 2 waits for the lock of n, held by branch 1",
    ]


def test_deadlock() -> None:
    """Processes that wait for one another are all named, with what they wait for."""
    error = failure(
        branches("BEGIN IF n > 1 THEN SIGNAL g ; WAIT e END", "BEGIN IF n = 0 THEN WAIT g ; SIGNAL e END")
    ).diagnostic

    assert error.code == "E501"
    assert error.message == "2 processes wait for ever"
    assert [error.label, *(label.text for label in error.secondary)] == ["branch 1 waits for e", "branch 2 waits for g"]


def test_arm_of_a_frame_in_two_branches() -> None:
    """Who moves what hangs on the arm of another branch is told which line hung it there, checked or running."""
    text = HOME + "AFFIX a TO ARM_1 ; COBEGIN BEGIN MOVE ARM_1 TO b END ; BEGIN MOVE a TO b END COEND END."
    (error,) = [one for one in translate(Source("test.rlo", text)).diagnostics if one.is_error]

    assert (error.code, [label.text for label in error.secondary]) == (
        "E503",
        ["first branch", "a was affixed to ARM_1 here"],
    )
    assert text[error.secondary[1].span.start :].startswith("AFFIX a TO ARM_1")

    hidden = (
        "VAR x : ARRAY [2] OF FRAME ; c : FRAME ; n : SCALAR ; BEGIN n = DIST(WORLD, WORLD) + 1 ; c = WORLD ;"
        "x[1] = ARM_1 ; AFFIX x[n] TO ARM_1 ; AFFIX x[2] TO x[1] AT XYZ(0, 0, 0.1) ; COBEGIN BEGIN OPEN ARM_1 END ;"
        "BEGIN MOVE x[n + 1] TO ARM_1 END COEND END."
    )
    late = failure(hidden).diagnostic

    assert (late.code, [label.text for label in late.secondary]) == ("E503", ["x[1] was affixed to ARM_1 here"])
    assert hidden[late.secondary[0].span.start :].startswith("AFFIX x[n] TO ARM_1")


def test_arm_of_two_branches() -> None:
    """An arm belongs to one branch, also where the checker cannot see who uses it."""
    text = (
        "VAR x : ARRAY [2] OF FRAME ; n : SCALAR ; BEGIN n = DIST(WORLD, WORLD) + 1 ;"
        "AFFIX x[1] TO ARM_1 AT XYZ(0, 0, 0) ; x[2] = WORLD ; COBEGIN BEGIN OPEN ARM_1 END ;"
        "BEGIN MOVE x[n] TO ARM_1 END COEND END."
    )
    error = failure(text).diagnostic

    assert error.code == "E503"
    assert error.message == "ARM_1 is used by branch 1 and by branch 2 of one COBEGIN"


def test_halt_stops_everything() -> None:
    """HALT in one branch stops the arm of the other in a controlled way, and the frame table knows where."""
    cell = cell_of("cell2")
    recording = run(branches("BEGIN PAUSE 0.3 ; HALT END", "BEGIN MOVE ARM_2 TO b END"), cell)

    (stream,) = (one for one in recording.streams if one.arm == "ARM_2")
    assert "ARM_2 stops" in recording.trace()
    assert np.abs(stream.qd[-1]).max() == 0
    assert np.abs(np.diff(stream.qd, axis=0)).max() < 0.1
    hand = recording.tree.world("ARM_2")[:3, 3]
    assert 0.01 < np.linalg.norm(hand - down(0.70, 0.15, 0.20)[:3, 3]) < 0.2
    limit = cell.arms["ARM_2"].arm.limits.acceleration
    assert (np.abs(stream.qdd).max(axis=0) <= limit * (1 + 1e-6)).all()


def test_an_error_stops_everything() -> None:
    """What goes wrong in one branch stops the other arm and switches the devices off."""
    text = branches(
        "BEGIN OPERATE torch ; PAUSE 0.2 ; a = a * XYZ(5, 0, 0) ; MOVE ARM_1 TO a END", "BEGIN MOVE ARM_2 TO b END"
    )
    error = failure(text, cell_of("cell2"))

    assert error.diagnostic.code == "E402"
    assert error.time > 0.2
    assert np.linalg.norm(error.tree.world("ARM_2")[:3, 3] - np.array([0.65, 0, 0.25])) > 1e-3


def test_recover_around_branches() -> None:
    """A TRY around COBEGIN catches what goes wrong in a branch, once all branches are stopped."""
    text = HOME + (
        "TRY COBEGIN BEGIN READ VISIONS (a) ; PRINT(1) END ; BEGIN MOVE ARM_2 TO b ; PRINT(2) END COEND "
        "RECOVER PRINT(3) ; MOVE ARM_2 TO b END END."
    )
    recording = run(text, cell_of("cell2"))

    assert printed(recording) == ["3"]
    expect(recording, ARM_2=down(0.70, 0.15, 0.20))


def test_same_run_on_any_hash_seed() -> None:
    """The trace and the joint positions are the same whatever seed Python's hashes have."""
    script = textwrap.dedent(
        """
        import hashlib, sys
        sys.path[:0] = sys.argv[1:]
        from program.running import cell_of, corpus_text, run
        r = run(corpus_text("p08"), cell_of("cell2"))
        print(hashlib.sha256(repr(r.trace()).encode() + b"".join(s.q.tobytes() for s in r.streams)).hexdigest())
        """
    )
    seen = set()
    for seed in ("0", "1", "4711"):
        result = subprocess.run(
            [sys.executable, "-c", script, *sys.path],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        )
        seen.add(result.stdout)

    assert len(seen) == 1


def test_step_limit() -> None:
    """A loop in which no time goes by is ended with a word on what it needs."""
    error = failure(HOME + "WHILE n = 0 DO n = 0 END.", limits=Limits(steps=5000)).diagnostic

    assert error.code == "E504"
    assert "5000 steps" in error.message


def test_time_limit() -> None:
    """A loop that pauses for ever is ended by the clock."""
    error = failure(HOME + "WHILE n = 0 DO PAUSE 1 END.", limits=Limits(time=60.0)).diagnostic

    assert error.code == "E506"
    assert "60 s" in error.message


def test_hand_over_is_the_corpus_program() -> None:
    """The program of the corpus has no warning."""
    from armwright.program import Source, compile as translate, known_cell

    compiled = translate(Source("p08.rlo", corpus_text("p08")), known_cell(cell_of("cell2")))

    assert [one.code for one in compiled.diagnostics if one.is_error] == []
