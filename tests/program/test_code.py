"""Intermediate code: what each statement becomes."""

import numpy as np
import pytest

from armwright.program import KnownCell, Source
from armwright.program import compile as translate
from armwright.program.code import Code, Kind, Move, Op, Trajectory, listing, stages_of
from program.shelf import BARE

# Twelve numbers as the program writes them come through unchanged, or as the nearest rotation to rounding.
ROUNDING = 1e-12


def code_of(text: str) -> Code:
    compilation = translate(Source("t.rlo", text), BARE)
    assert compilation.code is not None, [one.message for one in compilation.diagnostics]
    return compilation.code


def move_of(clauses: str) -> Move:
    """Return the MOVE with some clauses in a program where every frame has a value."""
    code = code_of(
        "VAR f, a, d, v, w : FRAME ; n : SCALAR ; BEGIN READ VISIONS (f) ; READ VISIONS (a) ; READ VISIONS (d) ;"
        f"READ VISIONS (v) ; READ VISIONS (w) ; n = 40 ; MOVE ARM_1 TO f {clauses} ; END."
    )
    return next(step.move for step in code.instructions if step.move)


def stages(clauses: str) -> list[tuple[str, ...]]:
    return [(stage.kind.value, *stage.frames) for stage in stages_of(move_of(clauses))]


@pytest.mark.parametrize(
    ("clauses", "expected"),
    [
        ("", [("PTP", "F")]),
        ("DIRECTLY", [("PTP", "F")]),
        ("STRAIGHTLY", [("LINE", "F")]),
        ("VIA (v, w)", [("SPLINE", "V", "W", "F")]),
        ("WITH APPROACH = a", [("PTP", "A"), ("LINE", "F")]),
        ("WITH DEPARTURE = d", [("LINE", "D"), ("PTP", "F")]),
        ("WITH APPROACH = a, VIA (v, w)", [("SPLINE", "V", "W", "A"), ("LINE", "F")]),
        ("WITH DEPARTURE = d, VIA (v)", [("LINE", "D"), ("SPLINE", "V", "F")]),
        ("WITH APPROACH = a, WITH DEPARTURE = d", [("LINE", "D"), ("PTP", "A"), ("LINE", "F")]),
        ("VIA (v) WITH DEPARTURE = d WITH APPROACH = a", [("LINE", "D"), ("SPLINE", "V", "A"), ("LINE", "F")]),
    ],
)
def test_stages(clauses: str, expected: list[tuple[str, ...]]) -> None:
    """Departure is one line, the way between is PTP or a spline, and the last stage to an approached goal is a line."""
    assert stages(clauses) == expected


@pytest.mark.parametrize(
    ("clauses", "direct", "straight", "speed"),
    [
        ("", True, False, 100.0),
        ("WITH SPEED = 12.5", True, False, 12.5),
        ("DIRECTLY, WITH SPEED = n", True, False, "N"),
        ("STRAIGHTLY", False, True, 100.0),
        ("VIA (v)", False, False, 100.0),
    ],
)
def test_ways(clauses: str, direct: bool, straight: bool, speed: float | str) -> None:  # noqa: FBT001
    """Without a clause on the way a MOVE is direct, and without a speed it has the normal one."""
    move = move_of(clauses)

    assert (move.direct, move.straight, move.speed) == (direct, straight, speed)


def test_frames_of_a_move() -> None:
    """A MOVE knows every frame that it needs."""
    assert move_of("WITH DEPARTURE = d, VIA (v, w), WITH APPROACH = a").frames == ("F", "V", "W", "A", "D")


def test_every_statement() -> None:
    """Each statement becomes its instruction, with canonical names."""
    code = code_of(
        "VAR f, g : FRAME ; t : TRANS ; n : SCALAR ; BEGIN n = 60 ; t = (1,0,0,0,1,0,0,0,1,-1,-1,-1) ;"
        "Read Visions (f) ; AFFIX g TO f AT t ; AFFIX f TO station ; UNFIX f FROM STATION ; OPEN ARM-1 ; GRASP arm-01 ;"
        "READ SYSTEM (arm_1) ; OPERATE Tool1 ; END."
    )

    assert [(step.op.value, *step.operands) for step in code.instructions] == [
        ("LOADS", "N", 0),
        ("LOADM", "T", 1),
        ("READV", "F"),
        ("AFFAT", "G", "F", "T"),
        ("AFFIX", "F", "STATION"),
        ("UNFIX", "F", "STATION"),
        ("OPEN", "ARM_1"),
        ("GRASP", "ARM_1"),
        ("READS", "ARM_1"),
        ("OPER", "TOOL1"),
        ("STOP",),
    ]
    assert code.constants == (60.0, (1, 0, 0, 0, 1, 0, 0, 0, 1, -1, -1, -1))
    assert code.kinds["G"] is Kind.FRAME
    assert code.kinds["T"] is Kind.TRANS
    assert code.kinds["N"] is Kind.SCALAR
    assert code.spelled("TOOL1") == "Tool1"
    assert code.spelled("STATION") == "station"


def test_grasp_takes_the_arm_named_last() -> None:
    """GRASP closes the hand of the arm that the text named last, also inside AFFIX."""
    code = code_of("VAR f : FRAME ; BEGIN READ VISIONS (f) ; OPEN ARM_1 ; GRASP ; AFFIX f TO ARM_1 ; GRASP ; END.")

    assert [step.operands for step in code.instructions if step.op is Op.GRASP] == [("ARM_1",), ("ARM_1",)]


def test_repaired_rotation() -> None:
    """A rotation typed with four digits is loaded as the nearest true one; the position stays as typed."""
    code = code_of(
        "VAR f : FRAME ; BEGIN f = (0.7071,0.7071,0, -0.7071,0.7071,0, 0,0,1, 0.5,0.25,0) ; MOVE ARM_1 TO f ; END."
    )
    numbers = np.array(code.constants[0])
    half = np.sqrt(0.5)

    np.testing.assert_allclose(numbers[:9], [half, half, 0, -half, half, 0, 0, 0, 1], atol=ROUNDING)
    assert numbers[9:].tolist() == [0.5, 0.25, 0.0]


def test_spans() -> None:
    """Every instruction points at the text that asks for it."""
    text = "VAR f : FRAME ;\nBEGIN\n  READ VISIONS (f) ;\n  MOVE ARM_1 TO f\n    WITH SPEED = 5 ;\nEND."
    code = code_of(text)
    pointed = [(step.op.value, code.source.slice(step.span)) for step in code.instructions]

    assert pointed == [
        ("READV", "READ VISIONS (f)"),
        ("MVBEG", "MOVE ARM_1 TO f\n    WITH SPEED = 5"),
        ("MVDIR", "MOVE ARM_1 TO f\n    WITH SPEED = 5"),
        ("MVSPD", "WITH SPEED = 5"),
        ("MVEND", "MOVE ARM_1 TO f\n    WITH SPEED = 5"),
        ("STOP", "."),
    ]


def test_listing_of_names_and_numbers() -> None:
    """A listing spells names as the program does, and tells a speed from the name of one."""
    rows = listing(
        code_of(
            "VAR Home : FRAME ; Slow : SCALAR ; BEGIN SLOW = 12.5 ; READ VISIONS (home) ;"
            "MOVE ARM-1 TO HOME WITH SPEED = slow ; END."
        )
    ).splitlines()

    assert rows[1].split() == ["0000", "1", "LOADS", "Slow", "c0"]
    assert rows[5].split() == ["0004", "1", "MVSPD", "Slow"]
    assert rows[3].split() == ["0002", "1", "MVBEG", "ARM_1", "Home"]
    assert rows[-1] == "c0    12.5"


def test_three_trajectories() -> None:
    """There are three basic trajectories."""
    assert [kind.value for kind in Trajectory] == ["PTP", "LINE", "SPLINE"]


@pytest.mark.parametrize(
    ("statements", "arms"),
    [
        ("MOVE tip TO goal ; GRASP", ["ARM_1"]),
        ("OPEN ARM_2 ; MOVE tip TO goal ; GRASP", ["ARM_1"]),
        ("MOVE tip TO goal ; OPEN ARM_2 ; GRASP", ["ARM_2"]),
        (
            "OPEN ARM_2 ; MOVE ARM_2 TO part ; GRASP ; MOVE ARM_1 TO goal ; MOVE part TO goal ; GRASP",
            ["ARM_2", "ARM_2"],
        ),
    ],
    ids=["moved", "named, then moved", "moved, then named", "moved by an implied AFFIX"],
)
def test_arm_of_a_grasp(statements: str, arms: list[str]) -> None:
    """A GRASP that names no arm closes the one named or moved last; a frame that is moved moves the arm it hangs on."""
    place = KnownCell(arms=frozenset({"ARM_1", "ARM_2"}), frames={"TIP": "ARM_1", "GOAL": "WORLD", "PART": "WORLD"})
    text = f"VAR tip, goal, part : FRAME ; BEGIN {statements} ; MOVE tip TO part ; END."
    code = translate(Source("t.rlo", text), place).code
    assert code is not None
    grasps = [step for step in code.instructions if step.op is Op.GRASP]

    assert [step.operands for step in grasps] == [(arm,) for arm in arms]
    assert {step.comment for step in grasps} == {"arm by context"}
