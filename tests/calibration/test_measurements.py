"""Files of measurements, good ones and those that people send."""

import math
import tracemalloc
from collections.abc import Callable, Sequence
from pathlib import Path

import attrs
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint
from armwright.calibration.measurements import read_measurements
from armwright.errors import FileFormatError, IncompleteRowsWarning, UnknownNameError

Write = Callable[[str], Path]
HEAD = "joint_1_deg,joint_2_deg,x_mm,y_mm,z_mm"
ROWS = ("10,-20,300.5,10,5", "20,30,-310,20.25,5", "-40,55,100,-200,6")


@pytest.fixture
def arm() -> Arm:
    """Return an elbow of two joints."""
    return Arm(name="elbow", joints=[Joint(kind="revolute", a=0.2), Joint(kind="revolute", a=0.15)])


@pytest.fixture
def sliding() -> Arm:
    """Return a turning joint with a slide of 0.1 to 0.5 m."""
    return Arm(
        name="slider",
        joints=[Joint(kind="revolute"), Joint(kind="prismatic", alpha=1.5, limits=Limits(lower=0.1, upper=0.5))],
    )


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def written(text: str) -> Path:
        path = tmp_path / "points.csv"
        path.write_text(text, encoding="utf-8")
        return path

    return written


def table(head: str, rows: Sequence[str] = ROWS) -> str:
    return "\n".join([head, *rows]) + "\n"


def refused(path: Path, arm: Arm, units: tuple[str, str] | None = None) -> str:
    """Return what is said of a file, without the folder it lies in."""
    with pytest.raises(FileFormatError) as caught:
        read_measurements(path, arm, units=units)
    return str(caught.value).replace(str(path), path.name)


# ---- good files ----------------------------------------------------------------------------------------------------


def test_units(arm: Arm, write: Write) -> None:
    """Numbers become radians and metres by the units in the names of their columns."""
    measured = read_measurements(write(table(HEAD)), arm)

    np.testing.assert_allclose(measured.q, np.radians([[10, -20], [20, 30], [-40, 55]]), rtol=1e-15)
    np.testing.assert_allclose(
        measured.points, [[0.3005, 0.01, 0.005], [-0.31, 0.02025, 0.005], [0.1, -0.2, 0.006]], rtol=1e-15
    )
    assert measured.names == ("2", "3", "4")
    assert not measured.check.any()
    assert measured.warnings == ()


def test_any_order_and_notes(arm: Arm, write: Write) -> None:
    """Columns may stand in any order and case; those that begin with note are for people; empty lines are nothing."""
    text = "z_m,Note,Joint_2_rad,x_m,y_m,joint_1_rad\n\n0.3,anything,0.2,0.1,0.2,-0.1\n,,,,,\n0.3,,0.3,0.1,0.2,0.1\n"

    measured = read_measurements(write(text), arm)

    np.testing.assert_allclose(measured.q, [[-0.1, 0.2], [0.1, 0.3]])
    np.testing.assert_allclose(measured.points[0], (0.1, 0.2, 0.3))
    assert measured.names == ("3", "5")


def test_targets_and_differences(arm: Arm, write: Write) -> None:
    """Where a file has targets and what was off, the tool was at their sum; units may be stated for all columns."""
    head = "step_order,x_t,y_t,z_t,x_dif,y_dif,z_dif,joint_1,joint_2"

    measured = read_measurements(write(table(head, ["7,300,10,5,-0.5,0.25,1,10,20"])), arm, units=("mm", "deg"))

    np.testing.assert_allclose(measured.points, [[0.2995, 0.01025, 0.006]])
    np.testing.assert_allclose(measured.q, np.radians([[10, 20]]))
    assert measured.names == ("7",)


def test_nominal_beside_measured(arm: Arm, write: Write) -> None:
    """Nominal points beside measured ones change nothing: the joints say where the tool should be."""
    export = """Name;A1 [deg];A2 [deg];nominal X [mm];nominal Y [mm];nominal Z [mm];X meas [mm];Y meas [mm];Z meas [mm]
a;10,0;-20,0;300,0;10,0;5,0;300,5;10,0;5,0
b;20,0;30,0;-310,0;20,0;5,0;-310,0;20,25;5,0
c;-40,0;55,0;100,0;-200,0;5,0;100,0;-200,0;6,0
"""
    columns = {"A1 [deg]": "joint_1_deg", "A2 [deg]": "joint_2_deg"}

    measured, plain = read_measurements(write(export), arm, columns=columns), read_measurements(write(table(HEAD)), arm)

    np.testing.assert_array_equal(measured.q, plain.q)
    np.testing.assert_array_equal(measured.points, plain.points)
    assert measured.names == ("a", "b", "c")


def test_joint_names_of_a_urdf(arm: Arm, write: Write) -> None:
    """The joints of an arm from URDF may be called what the URDF calls them."""
    names = ("shoulder_pan_joint", "J.Elbow")
    named = attrs.evolve(
        arm, joints=[attrs.evolve(joint, name=name) for joint, name in zip(arm.joints, names, strict=True)]
    )
    head = HEAD.replace("joint_1_deg", "J.Elbow_deg").replace("joint_2", "shoulder_pan_joint")

    measured = read_measurements(write(table(head)), named)

    np.testing.assert_array_equal(measured.q, read_measurements(write(table(HEAD)), arm).q[:, ::-1])


def test_joints_that_a_urdf_counts_from_0(arm: Arm, write: Write) -> None:
    """Where the second joint of a URDF is called joint_1 nobody knows which is meant, until a column map says it."""
    joints = [attrs.evolve(joint, name=f"joint_{i}") for i, joint in enumerate(arm.joints)]
    path, named = write(table(HEAD)), attrs.evolve(arm, joints=joints)

    assert "joint_1_deg: joint_1 is a name of joint_1 and joint_2; specify which is meant by --columns" in refused(
        path, named
    )
    columns = {f"joint_{i}_deg": f"joint_{i}_deg" for i in (1, 2)}
    measured = read_measurements(path, named, columns=columns)
    np.testing.assert_array_equal(measured.q, read_measurements(path, arm).q)


def test_rows_with_gaps(arm: Arm, write: Write) -> None:
    """Rows without a joint or with part of a point are refused together, or left out with a warning."""
    path = write(table(HEAD, [*ROWS, "1,,3,4,5", "1,2,3,,5"]))

    said = "points.csv:5: cells are empty: joint_2_deg in line 5; y_mm in line 6; --skip-incomplete omits 2 rows"
    assert refused(path, arm) == said
    with pytest.warns(IncompleteRowsWarning, match="2 rows omitted because of empty cells, 3 read"):
        measured = read_measurements(path, arm, skip_incomplete=True)
    assert measured.names == ("2", "3", "4")


def test_a_row_that_has_no_point_is_complete(arm: Arm, write: Write) -> None:
    """A row of a touched plane has no point, and is not left out for that; one with half a point is."""
    path = write(table(f"{HEAD},plane", [*(f"{row}," for row in ROWS), "1,2,,,,table", "1,2,3,,,table"]))

    with pytest.warns(
        IncompleteRowsWarning, match="1 row omitted because of empty cells, 4 read: y_mm in line 6; z_mm in line 6"
    ):
        measured = read_measurements(path, arm, skip_incomplete=True)
    assert measured.readings.plane.tolist() == [-1, -1, -1, 0]


def test_units_in_the_names_come_first(arm: Arm, write: Write) -> None:
    """Stated units are for those columns whose names tell none."""
    head = "joint_1,joint_2,x_m,y_m,z_m"

    measured = read_measurements(write(table(head, ["10,20,0.3,0.1,0"])), arm, units=("mm", "deg"))

    np.testing.assert_allclose(measured.points, [[0.3, 0.1, 0.0]])


def test_kept_to_check(arm: Arm, write: Write) -> None:
    """Rows of the set check are kept to check with; a column name names the rows."""
    rows = [f"{row},{word},{name}" for row, word, name in zip(ROWS, ("fit", "Check", "fit"), "abc", strict=True)]

    measured = read_measurements(write(table(f"{HEAD},set,name", rows)), arm)

    assert measured.check.tolist() == [False, True, False]
    assert measured.names == ("a", "b", "c")


def test_slide(sliding: Arm, write: Write) -> None:
    """The position of a slide is a length."""
    measured = read_measurements(write(table("joint_1_deg,joint_2_mm,x_mm,y_mm,z_mm", ["10,250,1,2,3"])), sliding)

    assert measured.q[0, 1] == pytest.approx(0.25)


def test_read_only(arm: Arm, write: Write) -> None:
    """What was measured cannot be changed by mistake."""
    measured = read_measurements(write(table(HEAD)), arm)

    with pytest.raises(ValueError, match="read-only"):
        measured.points[0, 0] = 0.0


# ---- odd, but it may be so -----------------------------------------------------------------------------------------


def test_joint_that_never_moved(arm: Arm, write: Write) -> None:
    """A joint that stands still in all rows is named."""
    measured = read_measurements(write(table(HEAD, ["10,20,300,10,5", "30,20,310,20,5"])), arm)

    assert measured.warnings == (
        (
            "joint 2 never moved: it is at 20 deg in all 2 rows. Its errors cannot be distinguished from those of its "
            "neighbours"
        ),
    )


def test_copies(arm: Arm, write: Write) -> None:
    """Rows that repeat others to the last digit are named; a configuration that is measured again is none of them."""
    again = "10,-20,300.6,10,5"

    measured = read_measurements(write(table(HEAD, [*ROWS, again, ROWS[1]])), arm)

    assert measured.warnings == (
        "line 6 equals line 3 to the last digit: a copied row adds weight, but no information",
    )


def test_beyond_limits(sliding: Arm, write: Write) -> None:
    """Positions beyond a joint's limits are named with their lines."""
    head = "joint_1_deg,joint_2_mm,x_mm,y_mm,z_mm"

    measured = read_measurements(write(table(head, ["10,250,1,2,3", "20,50,1,2,3", "30,501,2,2,3"])), sliding)

    assert measured.warnings == ("joint 2 is beyond its limits of 100 to 500 mm in lines 3, 4",)


def test_radians_for_degrees(arm: Arm, write: Write) -> None:
    """Degrees that are all within two pi are asked about."""
    measured = read_measurements(write(table(HEAD, ["1.2,-0.5,300,10,5", "0.2,2.1,310,20,5"])), arm)

    assert measured.warnings == ("no joint is farther than 2.1 degrees from 0; are these radians?",)


# ---- bad files -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ("joint_1_deg,joint_2_deg,x_mm,y_mm", "points.csv:1: z_mm: no such column; there are joint_1_deg, joint_2_deg"),
        (
            "joint_2_deg,x_mm,y_mm,z_mm",
            "points.csv:1: joint_1_deg: no such column; elbow has 2 joints, and the file has 1; there are joint_2_deg",
        ),
        (f"{HEAD},joint_3_deg", "points.csv:1: joint_3_deg: elbow has 2 joints; is this a measurement of another arm?"),
        (
            f"{HEAD},speed",
            "points.csv:1: speed: no such column. Known: joint_1_deg, joint_2_deg, x_mm, y_mm, z_mm, roll_deg",
        ),
        ("jiont_1_deg,joint_2_deg,x_mm,y_mm,z_mm", "jiont_1_deg: no such column. Did you mean 'joint_1_deg'? Known: "),
        (f"{HEAD},", "points.csv:1: '': the last column has no name, but a value in line 2"),
        (f"{HEAD},X_mm", "points.csv:1: X_mm: a second column for this quantity, after x_mm"),
        (f"{HEAD},joint_1_rad", "points.csv:1: joint_1_rad: a second column for this quantity, after joint_1_deg"),
        (
            "joint_1,joint_2_deg,x_mm,y_mm,z_mm",
            "joint_1: the name has no unit: expected joint_1_deg or joint_1_rad or joint_1_mrad, in the file or by",
        ),
        (
            "joint_1_deg,joint_2_deg,x,y,z",
            "x: the name has no unit: expected x_mm or x_m or x_cm or x_um or x_in, in",
        ),
        ("joint_1_deg,joint_2_deg,x_foot,y_mm,z_mm", "x_foot: unknown unit 'foot': expected x_mm or x_m or x_cm or"),
        (
            "joint_1_mm,joint_2_deg,x_mm,y_mm,z_mm",
            "joint_1_mm: mm is a unit of length, and joint 1 of elbow is revolute: expected joint_1_deg or",
        ),
        (
            "joint_1_deg,joint_2_deg,x_mm,y_m,z_mm",
            "y_m: coordinates must have one unit in a file, but x_mm has another",
        ),
        (
            f"{HEAD},x_dif_mm",
            "points.csv:1: x_mm: give the points, or nominal points and deviations, not both: joint_",
        ),
        (
            "joint_1_deg,joint_2_deg,x_t_mm,y_t_mm,z_t_mm",
            "points.csv:1: x_deviation_mm: no such column; there are joint_1_deg",
        ),
        (
            "joint_1_deg,joint_2_deg,x_t_mm,y_t_mm,z_t_mm,x_dif_um,y_dif_um,z_dif_um",
            "x_dif_um: nominal coordinates and deviations must have one unit in a file, but x_t_mm has another",
        ),
        (f"{HEAD},name,pose", "points.csv:1: pose: rows have a single name, and column name contains it"),
    ],
)
def test_columns(head: str, message: str, arm: Arm, write: Write) -> None:
    """Columns that are missing, unknown, given twice, or in no or the wrong unit are named with what was expected."""
    row = ",".join(["1"] * len(head.split(",")))

    assert message in refused(write(table(head, [row])), arm)


def test_unit_of_a_slide(sliding: Arm, write: Write) -> None:
    """A slide has no position in degrees."""
    said = refused(write(table(HEAD)), sliding)

    assert said.startswith(
        "points.csv:1: joint_2_deg: deg is a unit of angle, and joint 2 of slider is prismatic: expected"
    )


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("10,twenty,1,2,3", "points.csv:2: joint_2_deg: expected a number, got 'twenty'"),
        ("10,20,,2,3", "points.csv:2: x_mm: empty; expected a number, or --skip-incomplete to omit the row"),
        ("10,20,nan,2,3", "points.csv:2: x_mm: every number must be finite and no larger than 1e+100, got nan"),
        ("10,20,1,2,-inf", "points.csv:2: z_mm: every number must be finite and no larger than 1e+100, got -inf"),
        ('10,20,"1,5",2,3', "points.csv:2: x_mm: expected a number, got '1,5'; write a decimal point"),
        (
            "10,20,1,5,2,3",
            "points.csv:2: expected 5 values, one per column, got 6; does a number contain a comma?",
        ),
        ("10,20,1,5", "points.csv:2: expected 5 values, one per column, got 4"),
    ],
)
def test_values(row: str, message: str, arm: Arm, write: Write) -> None:
    """What is no number is named with line and column."""
    assert refused(write(table(HEAD, [row])), arm) == message


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "points.csv: the file is empty; expected column names in its first line"),
        ("\n \n", "points.csv: the file is empty; expected column names in its first line"),
        (HEAD, "points.csv: no rows after the column names"),
        (f"{HEAD}\n{'1' * 200_000},2,3,4,5", "points.csv:2: not valid CSV: field larger than field limit (131072)"),
    ],
    ids=["empty", "blank", "no rows", "endless"],
)
def test_no_table(text: str, message: str, arm: Arm, write: Write) -> None:
    """A file that is no table of numbers between commas says so."""
    assert message in refused(write(text), arm)


def test_missing_file(arm: Arm, write: Write) -> None:
    """A file that does not exist is refused with the nearest name in its folder."""
    path = write(table(HEAD))

    with pytest.raises(FileFormatError, match=r"points\.csv"):
        read_measurements(path.with_name("point.csv"), arm)


def test_degrees_for_radians(arm: Arm, write: Write) -> None:
    """Radians that are many turns are asked about, with line and joint."""
    said = refused(write(table(HEAD.replace("deg", "rad"))), arm)

    assert said.startswith(
        "points.csv:4: joint_1_rad: joint 1 of 'elbow' is at -40 rad, 6.4 revolutions. If degrees are"
    )
    assert said.endswith("are the units right?")


def test_turns_that_limits_allow(arm: Arm, write: Write) -> None:
    """A joint whose limits say that it turns so far may be there."""
    far = [attrs.evolve(joint, limits=Limits(lower=-20 * math.pi, upper=20 * math.pi)) for joint in arm.joints]
    measured = read_measurements(write(table(HEAD.replace("deg", "rad"))), attrs.evolve(arm, joints=far))

    assert measured.q[2, 1] == 55.0


def test_millimetres_of_a_slide(sliding: Arm, write: Write) -> None:
    """Millimetres of a slide that are read as metres are far beyond its way."""
    said = refused(write(table("joint_1_deg,joint_2_m,x_mm,y_mm,z_mm", ["10,250,1,2,3"])), sliding)

    assert said == (
        "points.csv:2: joint_2_m: joint 2 of slider is at 250 m, and its limits are 0.1 to 0.5 m; are the units right?"
    )


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("fit", "chek", "fit"), "points.csv:3: set: expected fit or check, got 'chek'; did you mean 'check'?"),
        (("fit", "", "fit"), "points.csv:3: set: empty; expected a name, or --skip-incomplete to omit the row"),
        (("check", "check", "check"), "points.csv: set: every row is held out for validation; none is left to fit"),
    ],
)
def test_sets(words: tuple[str, ...], message: str, arm: Arm, write: Write) -> None:
    """A row is there to fit or to check with, and one at least to fit."""
    rows = [f"{row},{word}" for row, word in zip(ROWS, words, strict=True)]

    assert refused(write(table(f"{HEAD},set", rows)), arm) == message


@pytest.mark.parametrize(
    ("units", "message"),
    [(("mn", "deg"), "no unit of length 'mn'"), (("mm", "grad"), r"no unit of angle 'grad'\. Did you mean 'mrad'")],
)
def test_stated_units(units: tuple[str, str], message: str, arm: Arm, write: Write) -> None:
    """Units that there are not are refused with the nearest."""
    with pytest.raises(UnknownNameError, match=message):
        read_measurements(write(table(HEAD)), arm, units=units)


def test_six_joints_for_seven(write: Write) -> None:
    """A file of seven joints is none of a UR5."""
    head = ",".join([*(f"joint_{i}_deg" for i in range(1, 8)), "x_mm", "y_mm", "z_mm"])

    said = refused(write(table(head, ["1,2,3,4,5,6,7,8,9,10"])), load_arm("ur5"))

    assert said == "points.csv:1: joint_7_deg: ur5 has 6 joints; is this a measurement of another arm?"


# ---- more than points ----------------------------------------------------------------------------------------------


def test_quaternions_and_angles(arm: Arm, write: Write) -> None:
    """A turn is told as a quaternion or as roll, pitch and yaw; a row may go without."""
    wxyz = read_measurements(
        write(table(f"{HEAD},qw,qx,qy,qz", [f"{ROWS[0]},0.7071,0,0,0.7071", f"{ROWS[1]},1,0,0,0"])), arm
    )
    rpy = read_measurements(
        write(table(f"{HEAD},roll_deg,pitch_deg,yaw_deg,plane", [f"{ROWS[0]},10,-20,90,", f"{ROWS[1]},,,,"])), arm
    )

    np.testing.assert_allclose(wxyz.readings.rotations[0], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    expected = Rotation.from_euler("xyz", (10, -20, 90), degrees=True).as_matrix()
    np.testing.assert_allclose(rpy.readings.rotations[0], expected, atol=1e-15)
    assert np.isnan(rpy.readings.rotations[1]).all()
    np.testing.assert_array_equal(rpy.readings.with_rotation, (True, False))


def test_frames(arm: Arm, write: Write) -> None:
    """Points of a board that was set up twice name the frame they are told in."""
    rows = [f"{row},{name}" for row, name in zip(ROWS, ("flat", "roll", "flat"), strict=True)]

    readings = read_measurements(write(table(f"{HEAD},frame", rows)), arm).readings

    assert readings.frames == ("flat", "roll")
    np.testing.assert_array_equal(readings.frame, (0, 1, 0))


def test_planes_and_distances(arm: Arm, write: Write) -> None:
    """A row may tell that a plane was touched, or how far the tool is from an anchor or from another row."""
    head = "name,joint_1_deg,joint_2_deg,plane,distance_mm,anchor,to"
    rows = ["a,1,2,table,,,", "b,3,4,,250.5,wire,", "c,5,6,,20,,a", "d,5,7,floor,,,"]

    readings = read_measurements(write(table(head, rows)), arm).readings

    assert readings.planes == ("table", "floor")
    assert readings.anchors == ("wire",)
    np.testing.assert_array_equal(readings.plane, (0, -1, -1, 1))
    np.testing.assert_array_equal(readings.anchor, (-1, 0, -1, -1))
    np.testing.assert_allclose(readings.distances, (np.nan, 0.2505, 0.02, np.nan))
    np.testing.assert_allclose(readings.other[2], np.radians((1, 2)))
    assert not readings.with_point.any()


@pytest.mark.parametrize(
    ("head", "row", "message"),
    [
        (f"{HEAD},qw,qx,qy", "1,2,3,4,5,1,0,0", "points.csv:1: qz: no such column; there are joint_1_deg"),
        (f"{HEAD},qw,qx,qy,qz", "1,2,3,4,5,1,0,0,1", "points.csv:2: qw: expected a quaternion of length 1, got one of"),
        (
            f"{HEAD},roll_deg,pitch_deg,yaw_rad",
            "1,2,3,4,5,1,0,0",
            "yaw_rad: angles must have one unit in a file, but roll_",
        ),
        (f"{HEAD},roll_deg,qw", "1,2,3,4,5,1,0", "points.csv:1: qw: give roll, pitch and yaw, or a quaternion, not bo"),
        (
            f"{HEAD},distance_mm",
            "1,2,3,4,5,1",
            "distance_mm: expected a column anchor, or a column to with",
        ),
        (
            f"{HEAD},anchor",
            "1,2,3,4,5,wire",
            "points.csv:1: distance_mm: no such column; a row with anchor has a distance",
        ),
        (
            f"{HEAD},distance_mm,to",
            "1,2,3,4,5,1,a",
            "points.csv:1: name: no such column; column to has names of rows; there are",
        ),
        (f"{HEAD},plane", "1,2,,,,", "points.csv:2: x_mm or plane: empty; expected a position, a plane or a dist"),
        (f"{HEAD},frame", "1,2,3,4,5,", "points.csv:2: frame: empty; expected a name; where one point has a frame all"),
        (
            f"{HEAD},plane,roll_deg,pitch_deg,yaw_deg",
            "1,2,,,,t,1,2,3",
            "points.csv:2: cells are empty: x_mm in line 2; y_mm in line 2; z_mm in line 2; --skip",
        ),
        (
            f"{HEAD},distance_mm,anchor",
            "1,2,3,4,5,7,",
            "points.csv:2: anchor: empty; expected the anchor of the distance, or the name of another row",
        ),
        (
            f"{HEAD},distance_mm,anchor",
            "1,2,3,4,5,,w",
            "points.csv:2: distance_mm: empty; expected the length of the distance, or --skip",
        ),
        (f"{HEAD},distance_mm,anchor", "1,2,3,4,5,-7,w", "expected a distance, got -0.007 m"),
        (
            f"{HEAD},name,distance_mm,to",
            "1,2,3,4,5,first,7,fist",
            "to: expected the name of one row, got 'fist', which 0",
        ),
        (
            f"{HEAD},name,distance_mm,to",
            "1,2,3,4,5,first,7,first",
            "points.csv:2: to: expected the name of another row, got that",
        ),
        (f"{HEAD},name,distance_mm,to,anchor", "1,2,3,4,5,a,7,b,w", "got one from both"),
        (f"{HEAD},plan", "1,2,3,4,5,t", "plan: no such column. Did you mean 'plane'?"),
    ],
)
def test_more_than_points_wrong(head: str, row: str, message: str, arm: Arm, write: Write) -> None:
    """What does not belong together is named with its line and column."""
    assert message in refused(write(table(head, [row])), arm)


ANYTHING = f"{HEAD},frame,plane,distance_mm,anchor,qw,qx,qy,qz,set"
COMPLETE = "10,-20,300.5,10,5,A,,,,,,,,fit"


@pytest.mark.parametrize(
    ("row", "column"),
    [
        ("20,30,,,,,,,,,,,,fit", "x_mm or plane or distance_mm"),
        ("20,30,-310,20,5,,,,,,,,,fit", "frame"),
        ("20,30,-310,20,5,A,,100,,,,,,fit", "anchor"),
        ("20,30,,,,,,,w,,,,,fit", "x_mm or plane or distance_mm"),
        ("20,30,,,,,t,,w,,,,,fit", "distance_mm"),
        ("20,30,-310,20,5,A,,,,1,0,,0,fit", "qy"),
        ("20,30,-310,20,5,A,,,,,,,,", "set"),
    ],
)
def test_rows_that_lack_a_required_cell(row: str, column: str, arm: Arm, write: Write) -> None:
    """A row without a cell that its other cells require can be left out as any incomplete row, and is named if not."""
    path = write(table(ANYTHING, [COMPLETE, row, COMPLETE.replace("10", "30")]))

    assert f"{column} in line 3" in refused(path, arm) or f":3: {column}: empty; expected" in refused(path, arm)
    with pytest.warns(
        IncompleteRowsWarning, match=rf"1 row omitted because of empty cells, 2 read: .*{column} in line 3"
    ):
        assert len(read_measurements(path, arm, skip_incomplete=True).readings) == 2


def test_memory_of_a_row(arm: Arm, write: Write) -> None:
    """A row takes some hundred bytes, so that a million rows take less than 500 MB; as texts they took 1500."""
    rows = [f"{i % 90},-{i % 50},{i / 7:.3f},{i % 11},5,N{i}" for i in range(20_000)]
    read_measurements(write("\n".join([f"{HEAD},name", *rows[:100], ""])), arm)
    path = write("\n".join([f"{HEAD},name", *rows, ""]))
    tracemalloc.start()

    found = read_measurements(path, arm)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()

    assert len(found.q) == 20_000
    assert peak / 20_000 < 450


def test_copies_among_many(arm: Arm, write: Write) -> None:
    """Of very many rows those are told that say the same, wherever they stand."""
    rows = [f"{i / 300:.6f},-20,{i},10,5" for i in range(25_000)]
    rows[24_000] = rows[3]
    path = write("\n".join([HEAD, *rows, ""]))

    (warning,) = (text for text in read_measurements(path, arm).warnings if "copied" in text)

    assert warning.startswith("line 24002 equals line 5 to the last digit")
