"""Files of measurements, and what is made of them."""

import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armwright.accuracy.assessment import Assessment, assess
from armwright.accuracy.measurement_file import AnyTest, PathTest, PoseTest, read_measurements
from armwright.errors import ArmwrightError, FileFormatError, IncompleteRowsWarning, InvalidValueError, UnknownNameError
from armwright.files.limits import raised

Read = Callable[..., tuple[AnyTest, ...]]
HEAD = "test,pose,cycle,x_mm,y_mm\n"
POSE = f"{HEAD}pose,P1,commanded,400,0\npose,P1,1,401,0\npose,P1,2,403,0\n"
RUNS = "test,path,cycle,t_s,x_mm,y_mm\npath,L,commanded,,0,0\npath,L,commanded,,100,0\n" + "".join(
    f"path,L,{j},{t},{100 * t},{j}\n" for j in (1, 2) for t in (0, 1)
)


@pytest.fixture
def read(tmp_path: Path) -> Read:
    """Read texts as files of measurements."""

    def reading(*texts: str) -> tuple[AnyTest, ...]:
        paths = [tmp_path / f"file{i}.csv" for i in range(len(texts))]
        for path, text in zip(paths, texts, strict=True):
            path.write_text(text, encoding="utf-8")
        return read_measurements(paths)

    return reading


def values(assessment: Assessment) -> dict[str, float]:
    """The measures by their symbols."""
    return {measure.symbol: measure.value for measure in assessment.measures}


def test_poses(read: Read) -> None:
    """Two poses 1 and 3 mm off: AP 2 mm; both are 1 mm from their mean: RP 1 mm. The notes name the plane and n."""
    assessment = assess(read(POSE), few=True)

    assert values(assessment) == pytest.approx({"AP": 2e-3, "AP_x": 2e-3, "AP_y": 0, "RP": 1e-3}, abs=1e-12)
    assert assessment.planar
    assert assessment.few
    assert {(measure.cycles, measure.required, measure.few) for measure in assessment.measures} == {(2, 30, True)}


@pytest.mark.parametrize(
    "test", ["pose", "distance", "drift", "multidirectional", "exchangeability", "path", "reorientation"]
)
@pytest.mark.parametrize("angles", ["c", "b", "ac", "abc"])
def test_angles_have_the_names_of_their_columns(read: Read, test: str, angles: str) -> None:
    """A planar arm rotates about z alone: its file has c_deg, and its measures are AP_c and RP_c, never AP_a."""
    goal, turn = (",".join(x for _ in angles) for x in ("0", "0.1"))
    columns = ",".join(f"{angle}_deg" for angle in angles)
    if test in {"path", "reorientation"}:
        head = f"test,path,cycle,x_mm,y_mm,{columns}"
        rows = [f"{test},L,{cycle},{x},0,{goal}" for cycle in ("commanded", "1", "2") for x in (0, 100)]
    else:
        head = f"test,pose,cycle,t_s,direction,robot,x_mm,y_mm,{columns}"
        poses = {"distance": ("P1", "P2")}.get(test, ("P1",))
        parts = 2 if test in {"drift", "multidirectional", "exchangeability"} else 1
        rows = [f"{test},{pose},commanded,,,,0,0,{goal}" for pose in poses]
        rows += [
            f"{test},{pose},{cycle},{part},{part},{part},0,{cycle},{turn}"
            for pose in poses
            for part in range(parts)
            for cycle in (1, 2)
        ]

    assessment = assess(read("\n".join([head, *rows, ""])), few=True)

    turning = {measure.symbol.partition("_")[2] for measure in assessment.measures if measure.unit == "rad"}
    assert turning == set(angles)


def test_files_of_other_angles_are_not_mixed(read: Read) -> None:
    """A rotation about z is not compared with one about x because each is the only one of its file."""
    with pytest.raises(FileFormatError, match="other coordinates or angles"):
        read(
            "test,pose,cycle,x_mm,y_mm,c_deg\npose,P,commanded,0,0,1\n",
            "test,pose,cycle,x_mm,y_mm,a_deg\npose,P,1,0,0,1\n",
        )


def test_units(read: Read) -> None:
    """Metres, inches, degrees, milliradians, minutes: all become SI units; files may have different ones."""
    commanded = "test,pose,cycle,x_m,y_m,z_m,c_rad\npose,P1,commanded,0.4,0.1,0.3,1.5707963\n"
    attained = "note,test,pose,cycle,c_deg,z_in,y_in,x_in\nwarm,pose,P1,1,90.5,11.811,3.937,15.748\n"

    (test,) = read(commanded, attained)

    assert isinstance(test, PoseTest)
    np.testing.assert_allclose(test.clouds[0].positions, [(0.4, 0.1, 0.3)], atol=1e-5)
    np.testing.assert_allclose(test.clouds[0].angles, [[np.radians(90.5)]])
    np.testing.assert_allclose(test.clouds[0].commanded_angles, [np.pi / 2], atol=1e-7)


def test_runs(read: Read) -> None:
    """Two runs 1 and 2 mm beside a line: AT 1.5 mm, RT 0.5 mm; without a speed nothing is message of it."""
    (test,) = tests = read(RUNS)

    assert isinstance(test, PathTest)
    assert values(assess(tests, few=True)) == pytest.approx({"AT": 1.5e-3, "RT": 0.5e-3})


def test_conditions_are_apart(read: Read) -> None:
    """The same pose at two speeds is two tests."""
    text = POSE.replace("cycle", "condition,cycle", 1)
    slow, fast = (text.replace("P1,", f"P1,{speed} %,") for speed in (10, 100))

    tests = read(slow, fast)

    assert [test.condition for test in tests] == ["10 %", "100 %"]


def test_all_pose_tests(read: Read) -> None:
    """Distance, directions, robots, drift and compliance, each with what it needs."""
    head = "test,pose,direction,robot,t_h,load_n,cycle,x_mm,y_mm\n"
    rows = [
        *(f"distance,{p},,,,,{c},{x},0" for p, x in (("A", 0), ("B", 90)) for c in ("commanded", 2, 1)),
        *(f"multidirectional,A,{d},,,,{c},{d},0" for d in (1, 2, 4) for c in (1, 2)),
        *(f"exchangeability,A,,r{r},,,{c},0,{r}" for r in range(5) for c in (1, 2)),
        *(f"drift,A,,,{t},,{c},{t},0" for t in (2, 0, 8) for c in (1, 2)),
        "drift,A,,,,,commanded,0,0",
        *(f"compliance,A,-x,,,{load},1,{-load / 100},0" for load in (0, 50, 100)),
    ]

    assessment = assess(read(head + "\n".join(rows)), few=True)

    expected = {"AD": 0, "RD": 0, "vAP": 3e-3, "E": 4e-3, "dAP": 8e-3, "dRP": 0, "C": 1e-5, "C_x": -1e-5, "C_y": 0}
    assert {key: value for key, value in values(assessment).items() if key in expected} == pytest.approx(
        expected, abs=1e-9
    )
    assert next(measure.note for measure in assessment.measures if measure.symbol == "vAP") == "between 1 and 4"
    assert (
        next(measure.note for measure in assessment.measures if measure.symbol == "C")
        == "force along -x, up to 100 N, 2 of 10 loads"
    )


def test_band_from_repeatability(read: Read) -> None:
    """The band of a robot that comes to rest at P1 is RP of P1, here 1 mm; another may be given."""
    rows = "".join(
        f"settling,P1,{j},{t},{x},0\n" for j in (1, 2, 3) for t, x in enumerate((300, 390, 400, *[400] * 20))
    )
    tests = read(POSE, "test,pose,cycle,t_s,x_mm,y_mm\n" + rows)

    assessment = assess(tests, few=True)

    # From 390 to 400 mm in the second second: 399 mm after 1.9 s.
    assert next(measure.note for measure in assessment.measures if measure.symbol == "t") == "within 1 mm"
    result = assessment.results[1][0]
    assert result.entered == pytest.approx([1.9] * 3)  # type: ignore[union-attr]
    assert assess(tests, few=True, band=5e-3).results[1][0].entered == pytest.approx([1.5] * 3)  # type: ignore[union-attr]
    with pytest.raises(InvalidValueError, match="settling P1: no band is specified, and pose P1 has no test"):
        assess(tests[1:], few=True)


def test_too_few_directions(read: Read) -> None:
    """Two directions of approach instead of three, with all 30 cycles, are an estimate too, and it is message."""
    head, rows = "test,pose,direction,cycle,x_mm,y_mm\n", [(d, c) for d in (1, 2) for c in range(1, 31)]
    tests = read(head + "".join(f"multidirectional,P1,{d},{c},{d},0\n" for d, c in rows))

    (assessment,) = assess(tests, few=True).measures

    assert assessment.few
    assert (assessment.cycles, assessment.note) == (30, "between 1 and 2, 2 of 3 directions of approach")
    with pytest.raises(
        InvalidValueError, match="multidirectional P1: ISO 9283 requires 3 directions of approach, got 2"
    ):
        assess(tests)


def test_limits(read: Read) -> None:
    """A limit holds or not; one of what was not measured is a mistake."""
    assessment = assess(read(POSE), few=True).with_limits({"AP": 1e-3, "RP": 2e-3})

    assert {measure.symbol: measure.holds for measure in assessment.measures} == {
        "AP": False,
        "AP_x": None,
        "AP_y": None,
        "RP": True,
    }
    with pytest.raises(UnknownNameError, match="no measure 'PR'"):
        assessment.with_limits({"PR": 1.0})


NOMINAL = """Pose;X nominal [mm];Y nominal [mm];X measured [mm];Y measured [mm]
P1;400,0;0,0;401,0;0,0
P2;100,0;50,0;100,0;50,5
P1;400,0;0,0;403,0;0,0
P2;100,0;50,0;100,0;50,5
"""


def test_nominal_beside_measured(read: Read) -> None:
    """A tracker writes nominal beside measured poses: P1 is 1 and 3 mm off, so AP is 2 mm, RP 1 mm; P2 0.5 and 0 mm."""
    assessment = assess(read(NOMINAL), few=True)

    of = {(measure.symbol, measure.name): measure.value for measure in assessment.measures}
    assert [of["AP", "P1"], of["RP", "P1"]] == pytest.approx([2e-3, 1e-3])
    assert [of["AP", "P2"], of["RP", "P2"]] == pytest.approx([0.5e-3, 0.0], abs=1e-12)


def test_nominal_columns_say_what_rows_say(read: Read) -> None:
    """What is commanded means the same in columns of its own as in a row of its own, angles and distances too."""
    head = "test,pose,cycle,x_mm,y_mm,c_deg"
    numbers = {"A": ("0,0,10", "0.1,0,10.5", "0.3,0,10"), "B": ("90,0,0", "90,0.2,0", "90.1,0,-0.5")}
    in_rows, in_columns = [head], [f"{head},x_nominal_mm,y_nominal_mm,c_nominal_deg"]
    for test in ("pose", "distance"):
        for pose, (goal, *attained) in numbers.items():
            in_rows.append(f"{test},{pose},commanded,{goal}")
            in_rows += [f"{test},{pose},{j},{row}" for j, row in enumerate(attained, 1)]
            in_columns += [f"{test},{pose},{j},{row},{goal}" for j, row in enumerate(attained, 1)]

    by_rows, by_columns = (assess(read("\n".join(rows)), few=True).measures for rows in (in_rows, in_columns))

    assert by_rows == by_columns
    assert {"AP", "AP_c", "RP", "AD", "AD_c", "RD"} <= {measure.symbol for measure in by_rows}


def test_column_map_and_gaps(read: Read, tmp_path: Path) -> None:
    """A file of other names is read by a column map, and rows of which a cell is missing can be left out."""
    path = tmp_path / "other.csv"
    path.write_text(POSE.replace("x_mm,y_mm", "Across,Along") + "pose,P1,3,,0\n", encoding="utf-8")

    with pytest.warns(
        IncompleteRowsWarning, match=r"other\.csv: 1 row omitted because of empty cells, 3 read: Across as x_mm"
    ):
        assessment = read_measurements(path, columns={"Across": "x_mm", "Along": "y_mm"}, skip_incomplete=True)

    assert values(assess(assessment, few=True)) == values(assess(read(POSE), few=True))


MISTAKES = {
    "two units": (
        POSE.replace("y_mm", "y_m"),
        "1: y_m: coordinates must have one unit in a file, but x_mm has another",
    ),
    "two units of angles": (
        POSE.replace("y_mm", "y_mm,a_deg,c_rad"),
        "1: c_rad: angles must have one unit in a file, but a_deg has another",
    ),
    "no unit": (POSE.replace("x_mm", "x"), "1: x: the name has no unit: expected x_mm or x_m or x_cm or x_um or x_in"),
    "a strange unit": (POSE.replace("x_mm", "x_ft"), "1: x_ft: unknown unit 'ft': expected x_mm or x_m or "),
    "no column": (POSE.replace("y_mm", "note"), "1: y_mm: no such column; there are test, pose, cycle, x_mm"),
    "a strange column": (POSE.replace("cycle", "cycl"), "1: cycl: no such column. Did you mean 'cycle'? Known: test, "),
    "twice": (POSE.replace("y_mm", "x_m"), "1: x_m: a second column for this quantity, after x_mm"),
    "no name": (
        POSE.replace("pose,", "note,", 1),
        "1: pose: expected a column pose or a column path, but the file has neither: test, cycle, x_mm, y_mm",
    ),
    "two names": (
        POSE.replace("pose,", "path,pose,", 1),
        "1: pose: expected a column pose or a column path, but the file has both: test, path, pose, cycle, x_mm, y_mm",
    ),
    "decimal comma": (POSE.replace("401", '"401,5"'), "3: x_mm: expected a number, got '401,5'; write a decimal point"),
    "too many": (
        POSE.replace("401", "401,5"),
        "3: expected 5 values, one per column, got 6; does a number contain a comma",
    ),
    "too few": (POSE.replace("401,0", "401"), "3: expected 5 values, one per column, got 4"),
    "text": (POSE.replace("401", "far"), "3: x_mm: expected a number, got 'far'"),
    "nothing": (POSE.replace("401", ""), "3: x_mm: empty; expected a number"),
    "NaN": (POSE.replace("401", "nan"), "3: x_mm: every number must be finite and no larger than 1e+100, got nan"),
    "empty": ("\n\n", ": the file is empty; expected column names in its first line"),
    "no rows": (HEAD, ": no rows after the column names"),
    "no nominal y": (
        NOMINAL.replace("Y nominal [mm]", "note"),
        "1: y_nominal_mm: no such column; either all measured columns have nominal columns, or none has; there are",
    ),
    "nothing measured": (
        NOMINAL.replace("Y measured [mm]", "z nominal [mm]"),
        "1: y_mm: no such column; there are Pose, X nominal [mm], Y nominal [mm], X measured [mm], z nominal [mm]",
    ),
    "other nominal poses": (
        NOMINAL.replace("400,0;0,0;403", "401,0;0,0;403"),
        "4: X nominal [mm]: P1 has other nominal coordinates in line 2",
    ),
    "nominal and commanded": (
        NOMINAL.replace("Pose", "Pose;cycle").replace("P1;4", "P1;commanded;4").replace("P2;", "P2;1;"),
        "2: cycle: commanded is what the nominal columns say; leave the row out",
    ),
    "nominal paths": (
        NOMINAL.replace("Pose", "Path"),
        "1: X nominal [mm]: only poses have nominal columns; a path is commanded by rows of cycle commanded",
    ),
    "a strange test": (
        POSE.replace("pose,P1,1", "posse,P1,1"),
        "3: test: expected one of pose, multidirectional, distance, ",
    ),
    "cycle 0": (POSE.replace("P1,1", "P1,0"), "3: cycle: expected 1, 2, 3 ... or the word commanded, got '0'"),
    "no pose": (POSE.replace("P1,1", ",1"), "3: pose: empty; expected a name"),
    "a cycle twice": (POSE.replace("P1,2", "P1,1"), "4: cycle: a second row of cycle 1, after line 3"),
    "commanded twice": (POSE + "pose,P1,commanded,1,1\n", "5: cycle: a second commanded pose, after the one in line 2"),
    "not commanded": (POSE.replace("commanded", "9"), "2: cycle: P1 has no commanded pose: expected a row with"),
    "nothing attained": (f"{HEAD}pose,P1,commanded,0,0\n", "2: cycle: the test has commanded rows, but no attained"),
    "metres": (
        POSE.replace("400", "0.4"),
        "2: cycle: the attained positions are 1000 times as large as the others: metres and millimetres?",
    ),
    "radians": (
        "test,pose,cycle,x_mm,y_mm,c_deg\npose,P1,commanded,0,0,1.5708\npose,P1,1,0,0,90.02\n",
        "2: cycle: the attained angles are 57.3 times as large as the others: radians and degrees?",
    ),
    "path in metres": (
        RUNS.replace("commanded,,100", "commanded,,0.1"),
        "4: cycle: the attained positions are 1000 times as large as the others: metres and millimetres?",
    ),
    "no direction": (f"{HEAD}multidirectional,P1,1,0,0\n", "2: direction: no such column; expected the direction in"),
    "no robot": (f"{HEAD}exchangeability,P1,1,0,0\n", "2: robot: no such column; expected the robot in every row"),
    "no time of drift": (
        f"{HEAD}drift,P1,1,0,0\n",
        "2: t_s: no such column; expected the time in every row of test drift",
    ),
    "no load": (
        "test,pose,direction,cycle,x_mm,y_mm\ncompliance,P1,+x,1,0,0\n",
        "2: load_n: no such column; expected the load in every row of test compliance; there are",
    ),
    "three poses": (
        HEAD + "".join(f"distance,{p},{c},0,0\n" for p in "ABC" for c in ("commanded", 1)),
        "2: pose: a distance needs two poses, got 3: A, B, C",
    ),
    "a lone cycle": (
        HEAD + "".join(f"distance,{p},{c},0,0\n" for p in "AB" for c in ("commanded", 1)) + "distance,B,2,0,0\n",
        "2: cycle: cycle 2 of A to B has one of the two poses only",
    ),
    "no path": (
        "\n".join(line for line in RUNS.split("\n") if "commanded" not in line),
        "2: cycle: L has no commanded path: expected rows with cycle commanded",
    ),
    "time back": (RUNS.replace("L,1,1,", "L,1,0,"), "5: t_s: samples must be in order of time, but 0 s follows 0"),
    "no time": (RUNS.replace("L,1,1,", "L,1,,"), "5: t_s: empty; expected the time, as in the rows of the run before"),
    "one sample": (RUNS + "path,L,3,0,0,0\n", "8: cycle: a run has two rows at least, and this is its only one"),
    "no times": (f"{HEAD}settling,P1,1,0,0\nsettling,P1,1,1,0\n", "2: t_s: no such column; expected the time in"),
    "settling commanded": (
        "test,pose,cycle,t_s,x_mm,y_mm\nsettling,P1,commanded,,0,0\nsettling,P1,1,0,0,0\n",
        "2: cycle: a settling test must not have a commanded row",
    ),
    "no speed": (RUNS.replace("path,L", "velocity,L"), "2: speed_mm_per_s: a test of velocity has the commanded"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes(name: str, read: Read) -> None:
    """The message about a mistake in a file has file, line and column."""
    text, message = MISTAKES[name]

    with pytest.raises(FileFormatError) as caught:
        read(text)

    assert f"file0.csv{'' if message.startswith(':') else ':'}{message}" in str(caught.value)


COLUMNS = "test,pose,cycle,direction,robot,t_s,load_n,x_mm,y_mm"


@pytest.mark.parametrize(
    ("test", "column"),
    [
        ("settling", "t_s"),
        ("drift", "t_s"),
        ("path", "t_s"),
        ("compliance", "load_n"),
        ("compliance", "direction"),
        ("multidirectional", "direction"),
        ("exchangeability", "robot"),
    ],
)
def test_rows_that_lack_what_their_test_requires(test: str, column: str, tmp_path: Path) -> None:
    """Rows without a time, a load, a direction or a robot that their test requires are all named, or all left out."""
    complete = {"test": test, "pose": "P1", "cycle": "1", "direction": "+x", "robot": "A", "x_mm": "1", "y_mm": "2"}
    goal = {**complete, "cycle": "commanded"}
    goals = [goal, goal] if test == "path" else [goal] if test == "drift" else []
    is_run = test in {"settling", "path"}
    rows = [{**complete, "cycle": "1" if is_run else str(i), "t_s": str(i), "load_n": str(i)} for i in range(1, 7)]
    rows[2][column] = rows[4][column] = ""
    lines = [",".join(row.get(name, "") for name in COLUMNS.split(",")) for row in goals + rows]
    path = tmp_path / "file.csv"
    path.write_text("\n".join([COLUMNS, *lines, ""]), encoding="utf-8")
    where = f"{column} in lines {len(goals) + 4}, {len(goals) + 6}"

    with pytest.raises(FileFormatError, match=f"cells are empty: {where}; --skip-incomplete omits 2 rows"):
        read_measurements(path)
    with pytest.warns(IncompleteRowsWarning, match=f"2 rows omitted because of empty cells, .* read: {where}"):
        (found,) = read_measurements(path, skip_incomplete=True)

    part = found.clouds[0].positions if isinstance(found, PoseTest) else found.runs[0].positions
    assert len(part) == (1 if test == "drift" else 4)


def test_other_layout(read: Read) -> None:
    """A test that is in a plane in one file and in space in another is refused, with both positions."""
    with pytest.raises(FileFormatError, match=r"file1.csv:2: x_mm: .*file0.csv:2 has other coordinates or angles"):
        read(POSE, "test,pose,cycle,x_mm,y_mm,z_mm\npose,P1,3,1,2,3\n")


def test_honest_offsets(read: Read) -> None:
    """A position that is far off without a factor of units in it is measured, not questioned."""
    tests = read(POSE.replace("400", "250"))

    assert values(assess(tests, few=True))["AP"] == pytest.approx(0.152)


def test_too_few_cycles(read: Read) -> None:
    """Too few cycles are refused with the name of the test; no files and a strange force are too."""
    with pytest.raises(
        InvalidValueError, match=r"^pose P1: ISO 9283 requires 30 cycles, got 2; few=True accepts fewer"
    ):
        assess(read(POSE))
    with pytest.raises(InvalidValueError, match="expected at least one file, got none"):
        read_measurements([])
    rows = "".join(f"compliance,P1,up,{load},1,0,0\n" for load in range(11))
    with pytest.raises(ArmwrightError, match=r"no direction 'up' of a force; expected one of \+x, -x, \+y, -y"):
        assess(read("test,pose,direction,load_n,cycle,x_mm,y_mm\n" + rows), few=True)


def test_examples() -> None:
    """The example files are what their script writes; the measures are offset, noise, play, speed, rounding."""
    folder = Path(__file__).parents[2] / "examples"
    scope: dict[str, Any] = {"__file__": str(folder / "measurements.py"), "__name__": "measurements"}
    exec((folder / "measurements.py").read_text(encoding="utf-8"), scope)
    for name, text in scope["texts"]().items():
        assert (folder / name).read_text(encoding="utf-8") == text

    assessment = assess(read_measurements([folder / "measured_poses.csv", folder / "measured_paths.csv"]))

    offset, noise = np.linalg.norm(scope["OFFSET"]) * 1e-3, scope["NOISE"] * 1e-3
    of = {(measure.symbol, measure.name): measure.value for measure in assessment.measures}
    # The mean of 30 scatters by a fifth of sigma, RP by a tenth of itself; three times that is allowed.
    assert of["AP", "P1"] == pytest.approx(offset, abs=0.6 * noise)
    assert of["RP", "P2"] == pytest.approx(3.616 * noise, rel=0.3)
    assert of["vAP", "P1"] == pytest.approx(0.06e-3 * np.sqrt(2), abs=1.2 * noise)
    assert abs(of["AV", "line"]) < 3e-3
    assert of["AT", "line"] == pytest.approx(np.hypot(0.17, 0) * 1e-3 / np.sqrt(2), abs=0.03e-3)
    assert 0 < of["CR", "square"] < 20e-3 / np.sqrt(2)
    assert not assessment.few


LONG = {
    "poses": f"{HEAD}pose,P1,commanded,400,0\n" + "".join(f"pose,P1,{i},400.{i},0.{i}\n" for i in range(1, 6_000)),
    "runs": "test,path,cycle,t_s,x_mm,y_mm\n"
    + "".join(f"path,L,{cycle},{i},{i},0.{i}\n" for cycle in ("commanded", 1, 2, 3) for i in range(1500)),
}


@pytest.mark.parametrize("kind", LONG)
def test_memory_of_a_row(kind: str, read: Read) -> None:
    """A row takes some hundred bytes, so that a million rows take less than 500 MB; as objects they took twice that."""
    read(POSE)
    tracemalloc.start()

    read(LONG[kind])
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()

    assert peak / 6_000 < 500


def test_too_many_parts(read: Read) -> None:
    """More poses and runs than a laboratory measures are refused with the limit; raised by name, they are read."""
    rows = "".join(f"pose,P{i},commanded,{i},0\npose,P{i},1,{i},0\npose,P{i},2,{i},0.1\n" for i in range(6))

    with raised(entries=5), pytest.raises(FileFormatError, match=r"csv:17: test: too many.*the limit is 5 entries"):
        read(HEAD + rows)
    assert len(read(HEAD + rows)) == 6
