"""Numbers out of poses and back, and the arithmetic of programs, against SciPy and the math module."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from program.running import cell_of, failure, printed, run
from samples import Sample

# Programs print six digits.
PRINTED = 2e-5
MEASURES = ("X", "Y", "Z", "ROLL", "PITCH", "YAW", "ANGLE", "AXISX", "AXISY", "AXISZ")


def numbers_of(text: str, declarations: str = "f, g : FRAME ; s, t : TRANS ; n : SCALAR ;") -> list[list[float]]:
    """Run statements; return the numbers of each line that they print."""
    recording = run(f"UNITS MM ; VAR {declarations} BEGIN {text} END.", cell_of("cell1"))
    return [[float(word) for word in line.split()] for line in printed(recording)]


def test_position_and_angles(sample: Sample) -> None:
    """Roll, pitch and yaw are turns about the fixed axes x, y and z; the axis and angle are those of one turn."""
    statements, expected = [], []
    for rng in sample.cases(200):
        rpy, p = rng.uniform((-179, -89, -179), (179, 89, 179)), rng.uniform(-900, 900, 3)
        R = Rotation.from_euler("xyz", rpy, degrees=True)
        vector = R.as_rotvec()
        angle = float(np.linalg.norm(vector))
        step = ", ".join(f"{value:.17g}" for value in p)
        turn = ", ".join(f"{value:.17g}" for value in rpy)
        statements.append(f"t = XYZ({step}) * RPY({turn}) ; PRINT({', '.join(f'{one}(t)' for one in MEASURES)}) ;")
        expected.append([*p, *rpy, math.degrees(angle), *(vector / angle)])

    np.testing.assert_allclose(numbers_of(" ".join(statements)), expected, rtol=PRINTED, atol=PRINTED)


def test_there_and_back(sample: Sample) -> None:
    """The turn about the axis by the angle of a turn is that turn, and so is the one by its roll, pitch and yaw."""
    statements = []
    for rng in sample.cases(200):
        values = ", ".join(f"{value:.6g}" for value in rng.uniform(-180, 180, 3))
        statements.append(
            f"t = RPY({values}) ; s = ROT(AXISX(t), AXISY(t), AXISZ(t), ANGLE(t)) ; PRINT(ANGLE(INV(s) * t)) ;"
            "s = RPY(ROLL(t), PITCH(t), YAW(t)) ; PRINT(ANGLE(INV(s) * t)) ;"
        )

    assert np.max(numbers_of(" ".join(statements))) < 1e-5


def test_frame_of_the_world() -> None:
    """The numbers of a FRAME are those of its pose in the world, wherever it hangs, in units of the program."""
    text = (
        "f = (0,1,0, -1,0,0, 0,0,1, 100,20,3) ; AFFIX g TO f AT XYZ(5, 0, 0) ; n = 0 ;"
        "PRINT(X(g), Y(g), Z(g), YAW(g), X(WORLD), ANGLE(WORLD), AXISZ(WORLD)) ;"
    )
    assert numbers_of(text) == [[100, 25, 3, 90, 0, 0, 1]]


def test_right_angles_are_exact() -> None:
    """At multiples of 90 degrees sines and cosines are whole, so that comparisons with them hold."""
    text = "FOR n = -450 TO 450 STEP 90 DO IF ABS(SIN(n)) + ABS(COS(n)) = 1 THEN PRINT(SIN(n), COS(n)) ;"
    turns = np.arange(-5, 6)

    assert numbers_of(text) == [
        [round(math.sin(turn * math.pi / 2)), round(math.cos(turn * math.pi / 2))] for turn in turns
    ]


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("ABS(-3.5)", 3.5),
        ("SQRT(2)", math.sqrt(2)),
        ("TAN(30)", math.tan(math.radians(30))),
        ("ASIN(0.5)", 30),
        ("ACOS(-0.5)", 120),
        ("ATAN2(-1, -1)", -135),
        ("ATAN2(0, 0)", 0),
        ("ROUND(2.5)", 3),
        ("ROUND(-2.5)", -3),
        ("ROUND(0.49999999)", 0),
        ("MOD(7, 3)", 1),
        ("MOD(-7, 3)", 2),
        ("MOD(7.5, -2)", -0.5),
        ("MIN(3, -1, 2)", -1),
        ("MAX(3, -1, 2)", 3),
        ("SIN(90deg) + SIN(PI * 1rad / 2)", 2),
        ("PI", math.pi),
    ],
)
def test_values(expression: str, expected: float) -> None:
    """Functions of numbers give what mathematics gives; MOD has the sign of its divisor."""
    assert numbers_of(f"PRINT({expression}) ;")[0][0] == pytest.approx(expected, rel=PRINTED, abs=1e-9)


@pytest.mark.parametrize(
    ("expression", "says"),
    [
        ("SQRT(n)", "-2 has no square root"),
        ("ASIN(n)", "ASIN takes a number from -1 to 1, not -2"),
        ("ACOS(n)", "ACOS takes a number from -1 to 1, not -2"),
        ("TAN(n * 45)", "-90 deg has no tangent"),
        ("MOD(1, n + 2)", "1 cannot be divided by 0"),
        ("X(ROT(0, 0, n + 2, 30))", "an axis of rotation needs a direction, but this is (0, 0, 0)"),
    ],
)
def test_no_value(expression: str, says: str) -> None:
    """What has no value is an error that names the number, and that a TRY can recover."""
    error = failure(f"VAR n : SCALAR ; BEGIN n = -2 ; PRINT({expression}) END.")

    assert (error.diagnostic.code, error.diagnostic.message) == ("E240", says)


def test_time_of_the_cell() -> None:
    """TIME is the clock on which PAUSE and MOVE take their time, from the start of the program on."""
    lines = numbers_of("PRINT(TIME) ; PAUSE 1.5 ; n = TIME ; PAUSE 250ms ; PRINT(TIME, n, TIME - n) ;")

    assert lines == [[0], [1.75, 1.5, 0.25]]


def test_guard_on_a_coordinate() -> None:
    """A guard reads the coordinates of the moving arm at every tick: the motion ends at the first tick behind them."""
    text = """UNITS MM ; VAR f : FRAME ; n : SCALAR ; BEGIN
        f = ARM_1 * XYZ(0, 0, 60) ; n = Z(ARM_1) ;
        MOVE ARM_1 TO f STRAIGHTLY, WITH SPEED = 5, ON n - Z(ARM_1) > 20 DO BEGIN PRINT(n - Z(ARM_1)) ; HALT END ;
        END."""
    reached = float(printed(run(text, cell_of("cell1")))[0])

    assert 20 < reached < 20.5
