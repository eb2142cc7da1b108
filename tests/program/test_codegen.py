"""Intermediate code: what each statement becomes."""

import numpy as np
import pytest

from armwright.program import KnownCell, Source, compile as translate
from armwright.program.bytecode.instructions import Code, Constant, MotionKind, Op, listing
from armwright.program.language.kinds import VariableKind, VariableType
from program.shelf import BARE

# Twelve numbers as the program writes them come through unchanged, or as the nearest rotation to rounding.
ROUNDING = 1e-12


def code_of(text: str) -> Code:
    compilation = translate(Source("t.rlo", text), BARE)
    assert compilation.code is not None, [one.message for one in compilation.diagnostics]
    return compilation.code


def move_of(clauses: str) -> list[tuple[object, ...]]:
    """Return the instructions of the MOVE with some clauses in a program where every frame has a value."""
    code = code_of(
        "VAR f, a, d, v, w : FRAME ; n : SCALAR ; BEGIN READ VISIONS (f) ; READ VISIONS (a) ; READ VISIONS (d) ;"
        f"READ VISIONS (v) ; READ VISIONS (w) ; n = 40 ; MOVE ARM_1 TO f {clauses} ; END."
    )
    ops = [step.op for step in code.instructions]
    whole = code.instructions[ops.index(Op.MVBEG) : ops.index(Op.MVEND) + 1]
    return [(step.op.value, *step.operands, step.comment) for step in whole]


def stages(clauses: str) -> list[tuple[str, ...]]:
    return [tuple(stage.split()) for stage in str(move_of(clauses)[-1][-1]).split(" / ")]


@pytest.mark.parametrize(
    ("clauses", "expected"),
    [
        ("", [("PTP", "f")]),
        ("DIRECTLY", [("PTP", "f")]),
        ("STRAIGHTLY", [("LINE", "f")]),
        ("VIA (v, w)", [("SPLINE", "v", "w", "f")]),
        ("WITH APPROACH = a", [("PTP", "a"), ("LINE", "f")]),
        ("WITH DEPARTURE = d", [("LINE", "d"), ("PTP", "f")]),
        ("WITH APPROACH = a, VIA (v, w)", [("SPLINE", "v", "w", "a"), ("LINE", "f")]),
        ("WITH DEPARTURE = d, VIA (v)", [("LINE", "d"), ("SPLINE", "v", "f")]),
        ("WITH APPROACH = a, WITH DEPARTURE = d", [("LINE", "d"), ("PTP", "a"), ("LINE", "f")]),
        ("VIA (v) WITH DEPARTURE = d WITH APPROACH = a", [("LINE", "d"), ("SPLINE", "v", "a"), ("LINE", "f")]),
    ],
)
def test_stages(clauses: str, expected: list[tuple[str, ...]]) -> None:
    """Departure is one line, the way between is PTP or a spline, and the last stage to an approached goal is a line."""
    assert stages(clauses) == expected


@pytest.mark.parametrize(
    ("clauses", "parts"),
    [
        ("", ["MVDIR"]),
        ("WITH SPEED = 12.5", ["MVDIR", "MVSPD 12.5"]),
        ("DIRECTLY, WITH SPEED = n", ["MVDIR", "MVSPD N"]),
        ("STRAIGHTLY", ["MVSTR"]),
        ("SMOOTHLY, STRAIGHTLY", ["MVSTR", "MVSMO"]),
        ("VIA (v)", ["MVVIA V"]),
        ("VIA (v, w), WITH BLEND = 20mm", ["MVVIA V W", "MVBLD 0.02"]),
        ("WITH DURATION = 300ms", ["MVDIR", "MVDUR 0.3"]),
        ("WITH DEPARTURE = d, VIA (v, w), WITH APPROACH = a", ["MVDEP D", "MVVIA V W", "MVAPP A"]),
    ],
)
def test_parts(clauses: str, parts: list[str]) -> None:
    """Without a clause on the way a MOVE is direct; numbers stand in the units of the program."""
    assert [" ".join(map(str, part[:-1])) for part in move_of(clauses)[1:-1]] == parts


def test_every_statement() -> None:
    """Each statement becomes its instruction, with canonical names."""
    code = code_of(
        "VAR f, g : FRAME ; t : TRANS ; n : SCALAR ; BEGIN n = 60 ; t = (1,0,0,0,1,0,0,0,1,-1,-1,-1) ;"
        "Read Visions (f) ; AFFIX g TO f AT t ; AFFIX f TO station ; UNFIX f FROM STATION ; OPEN ARM-1 ; GRASP arm-01 ;"
        "READ SYSTEM (arm_1) ; OPERATE Tool1 ; Zero Force arm-1 ; n = FORCE(X) + torque(y) ; END."
    )

    assert [(step.op.value, *step.operands) for step in code.instructions] == [
        ("LOADS", "N", Constant(0)),
        ("LOADM", "T", Constant(1)),
        ("READV", "F"),
        ("AFFAT", "G", "F", "T"),
        ("AFFIX", "F", "STATION"),
        ("UNFIX", "F", "STATION"),
        ("OPEN", "ARM_1"),
        ("GRASP", "ARM_1"),
        ("READS", "ARM_1"),
        ("OPER", "TOOL1", "ON"),
        ("ZEROF", "ARM_1"),
        ("FORCE", "%1", "X"),
        ("FORCE", "%2", "MY"),
        ("ADD", "N", "%1", "%2"),
        ("STOP",),
    ]
    assert code.constants == (60.0, (1, 0, 0, 0, 1, 0, 0, 0, 1, -1, -1, -1))
    assert code.types["G"] == VariableType(VariableKind.FRAME)
    assert code.types["T"] == VariableType(VariableKind.TRANS)
    assert code.types["N"] == VariableType(VariableKind.SCALAR)
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


def test_trajectories() -> None:
    """There are the three basic trajectories of the report, one with rounded corners, arcs, and to what moves."""
    assert [kind.value for kind in MotionKind] == ["PTP", "LINE", "SPLINE", "BLEND", "ARC", "TRACK"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("n = 1 + 2 * n", ["MUL %1 2.0 N", "ADD N 1.0 %1"]),
        ("f = f * XYZ(1, 2, 3)", ["XYZ %1 1.0 2.0 3.0", "MUL F F %1"]),
        ("x[1,2] = n", ["ELEM %1 X 1.0 2.0", "COPY %1 N"]),
        ("IF n > 1 THEN HALT", ["GT %1 N 1.0", "JZ %1 @", "HALT"]),
        ("IF n > 1 OR n < 0 THEN HALT", ["GT %1 N 1.0", "NOT %2 %1", "JZ %2 @", "LT %1 N 0.0", "JZ %1 @", "HALT"]),
        ("WHILE n < 3 DO n = 4", ["LT %1 N 3.0", "JZ %1 @", "LOADS N c", "JMP @"]),
        ("REPEAT n = 4 UNTIL n > 3", ["LOADS N c", "GT %1 N 3.0", "JZ %1 @"]),
        ("LOCK (f) DO SIGNAL e", ["LOCK F", "SIG E", "UNLK F"]),
        ("TRY HALT RECOVER RETRY END", ["TRY @", "HALT", "ENDT @", "RETRY", "ENDR"]),
    ],
)
def test_statements_of_rlo_2(text: str, expected: list[str]) -> None:
    """Expressions need no stack: each operation puts its value somewhere, the last one where the statement wants it."""
    code = code_of(
        "VAR f : FRAME ; n : SCALAR ; e : EVENT ; x : ARRAY [1,2] OF SCALAR ; "
        f"BEGIN n = 0 ; x[1,1] = 0 ; f = WORLD ; SIGNAL e ; PRINT(x[1,1]) ; {text} END."
    )
    shown = []
    for step in code.instructions[7:-1]:
        words = [operand if isinstance(operand, str) else repr(operand) for operand in step.operands]
        words = ["@" if "JumpTarget" in word else "c" if "Constant" in word else word for word in words]
        shown.append(" ".join((step.op.value, *words)))
    first = min(int(word[1:]) for row in shown for word in row.split() if word[0] == "%") if "%" in str(shown) else 1
    renamed = [
        " ".join(f"%{int(word[1:]) - first + 1}" if word[0] == "%" else word for word in row.split()) for row in shown
    ]

    assert renamed == expected


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
