"""Programs that would run for ever, and numbers that no robot has."""

import attrs
import pytest

from armwright.program import Source, compile as translate
from armwright.program.formatter.format import formatted
from armwright.program.syntax import tree
from armwright.program.vm.machine import Limits
from program.running import cell_of, failure, printed, run

HEAD = (
    "VAR f, far : FRAME ; t : TRANS ; n, i : SCALAR ; e : EVENT ;\n"
    "PROCEDURE again ; BEGIN COBEGIN BEGIN again() END ; BEGIN n = 1 END COEND END ;\n"
    "BEGIN\n  f = ARM_1 ; far = f * XYZ(9, 9, 9) ; n = 0 ;\n  "
)


def program(text: str) -> str:
    return f"{HEAD}{text}\nEND.\n"


@pytest.mark.parametrize(
    "text",
    [
        "TRY MOVE ARM_1 TO far RECOVER RETRY END",
        "WHILE n = 0 DO TRY MOVE ARM_1 TO far RECOVER n = 0 END",
        "WHILE n = 0 DO MOVE ARM_1 TO ARM_1",
        "TRY WHILE n = 0 DO n = 0 RECOVER RETRY END",
    ],
)
def test_moves_without_time_come_to_an_end(text: str) -> None:
    """Planning costs time, so MOVEs that never move an arm are not tried as often as assignments are made."""
    error = failure(program(text), limits=Limits(steps=20_000))

    assert error.diagnostic.code == "E504"
    assert error.time == 0


def test_a_move_counts_as_many_steps() -> None:
    """Of 20 000 steps without time, 20 MOVEs that cannot be made leave nothing."""
    text = "WHILE n < 30 DO TRY MOVE ARM_1 TO far RECOVER BEGIN n = n + 1 ; PRINT(n) END END"

    error = failure(program(text), limits=Limits(steps=20_000))

    assert error.recording is not None
    assert printed(error.recording())[-1] == "19"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("TRY WHILE n = 0 DO PAUSE 1 RECOVER RETRY END", "PAUSE 1"),
        ("PAUSE 1E6", "PAUSE 1E6"),
        (
            "MOVE ARM_1 TO f * XYZ(0, 0, 0.01) WITH DURATION = 1E5",
            "MOVE ARM_1 TO f * XYZ(0, 0, 0.01) WITH DURATION = 1E5",
        ),
    ],
)
def test_the_clock_stops_at_the_limit(text: str, line: str) -> None:
    """A program that runs too long ends at the limit, at what it was doing then, and no RECOVER goes on with it."""
    error = failure(program(text), limits=Limits(time=2.0))

    assert error.diagnostic.code == "E506"
    assert 2 <= error.time < 3
    assert program(text)[error.diagnostic.span.start : error.diagnostic.span.end] == line


def test_branches_without_end() -> None:
    """A procedure that calls itself in a branch is a recursion without end too."""
    error = failure(program("again()"))

    assert error.diagnostic.code == "E505"


@pytest.mark.parametrize("around", ["{0}", "TRY {0} RECOVER PRINT(1) END"])
def test_more_branches_than_there_may_be(around: str) -> None:
    """Where a branch cannot begin, those before it that have not been let go yet are given up."""
    text = program(around.format(f"COBEGIN {' ; '.join(['BEGIN PAUSE 1 END'] * 20)} COEND"))

    if around == "{0}":
        assert failure(text, limits=Limits(processes=10)).diagnostic.code == "E505"
    else:
        assert printed(run(text, limits=Limits(processes=10))) == ["1"]


@pytest.mark.parametrize(("period", "time"), [(0.1, 0.6), (0.1, 0.7), (1e-3, 0.6), (2e-3, 4.35)])
def test_a_program_that_ends_at_the_limit(period: float, time: float) -> None:
    """A program that takes just as long as it may is not ended, however its ticks are rounded."""
    cell = attrs.evolve(cell_of("cell1"), period=period)

    assert run(f"BEGIN PAUSE {time} END.", cell, Limits(time=time)).duration == pytest.approx(time)
    assert failure(f"BEGIN PAUSE {time + period} END.", cell, Limits(time=time)).diagnostic.code == "E506"


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("FOR i = 1 TO 1E99 STEP 1E-300 DO n = 1", "E504"),
        ("t = XYZ(1E99, 0, 0) ; FOR i = 1 TO 2000 DO t = t * t", "E240"),
        ("MOVE ARM_1 TO f WITH DURATION = 1E99", "E231"),
    ],
)
def test_numbers_out_of_range(text: str, code: str) -> None:
    """Numbers that no robot has are told at their statement."""
    assert failure(program(text), limits=Limits(steps=10_000)).diagnostic.code == code


def test_far_places_are_told_in_short() -> None:
    """A place as far as no arm reaches is told in powers of ten, not in a hundred digits."""
    (note,) = failure(program("MOVE ARM_1 TO f * XYZ(1E99, 0, 0)")).diagnostic.notes

    assert "1e+102" in note
    assert len(note) < 200


def test_a_move_to_where_the_arm_is_takes_its_duration() -> None:
    """A MOVE with a DURATION takes so long, also where there is nothing to be moved."""
    assert run(program("MOVE ARM_1 TO ARM_1 WITH DURATION = 2")).duration == pytest.approx(2)


def test_who_has_the_lock() -> None:
    """Of a lock that is waited for in vain the message says who has it."""
    error = failure(program("LOCK (f) DO COBEGIN BEGIN LOCK (f) DO n = 1 END ; BEGIN n = 2 END COEND"))

    assert (error.diagnostic.code, error.diagnostic.label) == (
        "E501",
        "branch 1 waits for the lock of f, held by program",
    )


def test_long_expressions() -> None:
    """A sum of three thousand terms is long and not deep: it is checked, run, written out and laid out."""
    count = 3_000
    told = " AND ".join(["n > 0"] * count)
    text = f"VAR n : SCALAR ; BEGIN n = 1 ; PRINT({' + '.join(['n'] * count)}) ; IF {told} THEN "
    text += f"PRINT({' - '.join(['1'] * count)}, 1{' * 2 / 2' * count}) END."

    assert printed(run(text)) == ["3000", "-2998 1"]
    compiled = translate(Source("long.rlo", text))
    assert formatted(Source("long.rlo", formatted(compiled.source))) == formatted(compiled.source)
    assert sum(len(line) for line in tree.dump(compiled.tree)) < 500 * 8 * count


@pytest.mark.parametrize("place", ["t {0}", "n > 0 AND {0}", "{0} > 0 OR n", "1 + {0}"])
def test_mistakes_in_long_expressions(place: str) -> None:
    """A mistake in a long sum is told once, in a message that does not repeat the sum."""
    wrong = " + ".join(["n"] * 2000 + ["t"] + ["n"] * 2000)
    text = f"VAR n : SCALAR ; t : TRANS ; BEGIN n = 1 ; t = XYZ(1,1,1) ; n = {place.format(wrong)} END."
    said = translate(Source("long.rlo", text)).diagnostics

    assert 1 <= len(said) <= 2
    assert all(len(one.message) < 200 and len("".join(one.helps)) < 200 for one in said)
