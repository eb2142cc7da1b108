"""The commands forward, jacobian, inverse, torque and kernel."""

import json
from pathlib import Path

import llvmlite.binding as llvm
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.write import toml_text
from armwright.dynamics.equation_of_motion import terms
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.jacobians import jacobian
from cli_calls import armwright
from oracles.published_arms import iiwa14

Q_DEG = "10,20,30,40,50,60"
Q = np.radians([10, 20, 30, 40, 50, 60])


def test_forward_in_millimetres() -> None:
    """The pose is printed row by row under its columns, its place in millimetres; with --json in metres."""
    X = forward(load_arm("puma560"), Q)

    head, *lines = armwright("forward", "puma560", "-q", Q_DEG).stdout.splitlines()
    data = json.loads(armwright("forward", "puma560", "-q", Q_DEG, "--json").stdout)

    assert head.split() == ["n", "o", "a", "p", "mm"]
    printed = np.array([[float(word) for word in line.split()] for line in lines])
    np.testing.assert_allclose(printed[:, 3], X[:3, 3] * 1e3, atol=5e-4)
    np.testing.assert_allclose(printed[:, :3], X[:3, :3], atol=5e-7)
    np.testing.assert_allclose(data["pose"], X, atol=1e-12)


def test_slides_are_millimetres() -> None:
    """The third number for the Stanford arm is the boom's length in mm."""
    data = json.loads(armwright("forward", "stanford", "-q", "0,90,500,0,0,0", "--json").stdout)

    np.testing.assert_allclose(data["q"], [0, np.pi / 2, 0.5, 0, 0, 0], atol=1e-12)


@pytest.mark.parametrize("frame", ["base", "tool"])
def test_jacobian(frame: str) -> None:
    """Both frames, in SI units."""
    data = json.loads(armwright("jacobian", "puma560", "-q", Q_DEG, "--frame", frame, "--json").stdout)

    expected = jacobian(load_arm("puma560"), Q, "tool" if frame == "tool" else "base")
    np.testing.assert_allclose(data["jacobian"], expected, atol=1e-12)


def test_inverse_finds_the_configuration() -> None:
    """The configuration whose pose is asked for comes back, nearest first."""
    noap = forward(load_arm("puma560"), Q)[:3].T.ravel()

    done = armwright("inverse", "puma560", "--noap", " ".join(map(repr, map(float, noap))), "--near", Q_DEG, "--json")

    data = json.loads(done.stdout)
    assert data["answer"] == "solved"
    np.testing.assert_allclose(data["branches"][0]["q"], Q, atol=1e-9)


@pytest.mark.parametrize(
    ("call", "line", "heads"),
    [
        (
            ("inverse", "stanford", "--xyz", "400,150,50"),
            1,
            "j1 deg  j2 deg  j3 mm  j4 deg  j5 deg  j6 deg  branch",
        ),
        (("jacobian", "stanford", "-q", "0,90,500,0,45,0"), 0, "j1 rad/s  j2 rad/s  j3 m/s  j4 rad/s"),
    ],
)
def test_heads_have_units(call: tuple[str, ...], line: int, heads: str) -> None:
    """Above every column of numbers stand its joint and its unit."""
    head = armwright(*call).stdout.splitlines()[line]

    assert " ".join(head.split()).startswith(" ".join(heads.split()))


def test_inverse_of_seven_joints(tmp_path: Path) -> None:
    """The solutions at a swivel are printed with it, and the swivels within the limits; all of that is in the JSON."""
    path = tmp_path / "iiwa14.toml"
    path.write_text(toml_text(iiwa14()))
    call = ("inverse", str(path), "--xyz", "400,100,400", "--rpy", "180,0,20", "--swivel", "-30")

    lines = armwright(*call).stdout.splitlines()
    data = json.loads(armwright(*call, "--json").stdout)

    assert lines.count("    swivel -30.000 deg") == len(data["branches"]) == 8
    assert "swivels within the limits, in deg:" in lines
    assert {branch["swivel"] for branch in data["branches"]} == {np.radians(-30)}
    inside = {one["label"] for one in data["swivels"] if one["lower"] <= np.radians(-30) <= one["upper"]}
    assert {branch["label"] for branch in data["branches"] if branch["allowed"]} == inside


def test_inverse_of_seven_joints_without_a_closed_form() -> None:
    """The solutions are examples, as the last line says."""
    lines = armwright("inverse", "gen3", "--xyz", "300,100,400", "--rpy", "180,0,20").stdout.splitlines()

    assert lines[0] == "solved"
    assert lines[-1] == "examples: an arm of 7 joints has endless configurations for a pose"


@pytest.mark.parametrize(
    ("arm", "swivel", "status", "said"),
    [
        ("ur5", "10", 3, "arm 'ur5' has no swivel"),
        ("ur5", "best", 2, "expected a number or one of nearest, middle, farthest, got 'best'"),
    ],
)
def test_what_is_no_swivel(arm: str, swivel: str, status: int, said: str) -> None:
    """An arm of six joints has none, and another word is none."""
    done = armwright("inverse", arm, "--xyz", "400,100,300", "--swivel", swivel)

    assert done.returncode == status
    assert said in " ".join(done.stderr.replace("│", "").split())


def test_inverse_out_of_reach() -> None:
    """A pose out of reach ends with status 1 and says how far."""
    done = armwright("inverse", "puma560", "--xyz", "5000,0,0")

    assert done.returncode == 3
    assert "mm out of reach of 'puma560'" in done.stdout
    assert "note" not in done.stdout


@pytest.mark.parametrize(
    ("place", "said"),
    [
        (("--xyz", "0.5,0.1,0.3"), "note: --xyz is in mm; in m the pose would be within reach"),
        (("--noap", "1,0,0,0,1,0,0,0,1,500,100,300"), "note: --noap is in m; in mm the pose would be within reach"),
    ],
)
def test_inverse_in_the_other_unit(place: tuple[str, str], said: str) -> None:
    """A place in metres where millimetres are asked for is out of reach, and one is told why; and the other way."""
    done = armwright("inverse", "puma560", *place)

    assert done.returncode == 3
    assert said in done.stdout.splitlines()


@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize(("command", "key"), [("forward", "pose"), ("jacobian", "jacobian")])
def test_rows_of_a_table_are_one_json_document(tmp_path: Path, command: str, key: str, count: int) -> None:
    """The results of a table are a single JSON list with an object per row, even for a table with a single row."""
    rows = np.random.default_rng(3).uniform(0.1, 0.6, (count, 6)).tolist()
    lines = ["q1,q2,q3,q4,q5,q6", *(",".join(map(repr, row)) for row in rows)]
    (tmp_path / "rows.csv").write_text("\n".join(lines), encoding="utf-8")

    data = json.loads(armwright(command, "puma560", "--csv", tmp_path / "rows.csv", "--json").stdout)

    assert [row["q"] for row in data] == rows
    function = {"forward": forward, "jacobian": jacobian}[command]
    np.testing.assert_allclose([row[key] for row in data], function(load_arm("puma560"), rows), atol=1e-12)


def test_torque_of_a_file(tmp_path: Path) -> None:
    """Every row of a long file has the efforts that it has alone."""
    motion = np.random.default_rng(5).uniform(0.1, 0.6, (1003, 18))
    names = ",".join(f"{kind}{i + 1}" for kind in ("q", "qd", "qdd") for i in range(6))
    (tmp_path / "motion.csv").write_text(
        "\n".join([names, *(",".join(map(repr, row)) for row in motion.tolist())]), encoding="utf-8"
    )

    rows = json.loads(armwright("torque", "stanford", "--csv", tmp_path / "motion.csv", "--json").stdout)

    assert len(rows) == len(motion)
    for row in (0, 999, 1000, 1002):
        alone = terms(load_arm("stanford"), *motion[row].reshape(3, 6))
        assert rows[row]["total"] == alone.total.tolist()
        assert rows[row]["own inertia"] == alone.own.tolist()


def test_torque_by_cause() -> None:
    """The causes sum up to the total, which is the inverse dynamics."""
    motion = ("-q", "0,90,500,0,45,0", "--qd", "10,20,30,40,50,60", "--qdd", "60,0,100,0,0,0")

    data = json.loads(armwright("torque", "stanford-jpl", *motion, "--json").stdout)
    table = armwright("torque", "stanford-jpl", *motion).stdout

    scale = np.array([np.pi / 180] * 2 + [1e-3] + [np.pi / 180] * 3)
    q, qd, qdd = (np.array([float(x) for x in text.split(",")]) * scale for text in motion[1::2])
    np.testing.assert_allclose(data["total"], inverse_dynamics(load_arm("stanford-jpl"), q, qd, qdd), atol=1e-9)
    np.testing.assert_allclose(sum(np.array(v) for k, v in data.items() if k != "total"), data["total"], atol=1e-9)
    assert f"{data['gravity'][1]:.4f}" in table


def test_torque_without_masses() -> None:
    """Zeros of an arm whose masses nobody published are told apart from those of an arm that needs no effort."""
    said = [armwright("torque", arm, "-q", Q_DEG).stderr for arm in ("irb140", "puma560")]

    assert said == ["armwright: note: irb140 has no masses: its own efforts are zero below\n", ""]


def test_rows_of_a_file(tmp_path: Path) -> None:
    """The rows of a CSV file with the columns of motion.csv give one answer each."""
    names = [f"{quantity}{i}" for quantity in ("q", "qd", "qdd") for i in range(1, 7)]
    rows = np.random.default_rng(1).uniform(0.2, 0.5, size=(3, 18))
    lines = [",".join(["t", *names]), *(",".join(["0", *map(repr, map(float, row))]) for row in rows)]
    (tmp_path / "rows.csv").write_text("\n".join(lines))

    said = json.loads(armwright("torque", "stanford", "--csv", tmp_path / "rows.csv", "--json").stdout)

    expected = inverse_dynamics(load_arm("stanford"), rows[:, :6], rows[:, 6:12], rows[:, 12:])
    np.testing.assert_allclose([row["total"] for row in said], expected, atol=1e-9)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t,q1,q2\n0,1,2\n", ":1: q3: no such column; puma560 has 6 joints; there are q1, q2"),
        ("q1,q2,q3,q4,q5,q6\n0,0,0,0,0,x\n", ":2: q6: expected a number, got 'x'"),
        ("q1,q2,q3,q4,q5,q6\n0,0,0\n", ":2: expected 6 values, one per column, got 3"),
        ("q1,q2,q3,q4,q5,q6\n0,0,0,0,0,nan\n", ":2: q6: every number must be finite"),
    ],
)
def test_bad_files(tmp_path: Path, text: str, said: str) -> None:
    """A file without the columns, or with a row that is no numbers, is refused with its line."""
    (tmp_path / "rows.csv").write_text(text)

    done = armwright("forward", "puma560", "--csv", tmp_path / "rows.csv")

    assert done.returncode == 4
    assert f"{tmp_path / 'rows.csv'}{said}" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("forward", "puma560"), "expected joint positions"),
        (("forward", "puma560", "-q", "1,2,3"), "expected 6 finite numbers, got 3"),
        (("forward", "puma560", "-q", "1,2,3,4,5,x"), "got 'x'"),
        (("forward", "puma560", "-q", "1,2,3,4,5,inf"), "finite"),
        (("jacobian", "puma560", "-q", Q_DEG, "--frame", "world"), "'world' is not one of 'base', 'tool'"),
        (("inverse", "puma560"), "expected the pose"),
        (("torque", "puma560"), "expected the motion"),
    ],
)
def test_usage(arguments: tuple[str, ...], said: str) -> None:
    """A call that cannot be understood ends with status 2 and says what is missing."""
    done = armwright(*arguments)

    assert done.returncode == 2
    assert said in " ".join(done.stderr.replace("│", " ").split())


def test_kernel() -> None:
    """The emitted code and the operation count are shown; a misspelt quantity gets the nearest name."""
    data = json.loads(armwright("kernel", "stanford-jpl", "forward", "--json").stdout)
    assert data["total"] == sum(data["operations"].values())
    assert "define i64 @rows(" in data["source"]
    llvm.parse_assembly(data["source"]).verify()
    assert "define i64 @single(" in armwright("kernel", "stanford-jpl", "forward", "--single").stdout
    assert "operations per configuration" in armwright("kernel", "ur5", "jacobian", "--count").stdout
    wrong = armwright("kernel", "ur5", "jacobain")
    assert (wrong.returncode, "Did you mean 'jacobian'?" in wrong.stderr) == (2, True)


@pytest.mark.parametrize("command", ["forward", "torque"])
def test_rows_of_several_arms(command: str, tmp_path: Path) -> None:
    """Joints of one arm are not taken for those of another: a file of several arms is refused by its line."""
    names = ",".join(f"{name}{i}" for name in ("q", "qd", "qdd") for i in range(1, 7))
    rows = [f"ARM_{k},{','.join(['0.5'] * 18)}" for k in (1, 1, 2)]
    path = tmp_path / "motion.csv"
    path.write_text("\n".join([f"arm,{names}", *rows]) + "\n")
    refused = armwright(command, "puma560-seed", "--csv", path)
    path.write_text("\n".join([f"arm,{names}", *rows[:2]]) + "\n")

    assert refused.returncode == 4
    assert "motion.csv:4: arm: expected rows of a single arm, got 'ARM_1' and 'ARM_2'" in refused.stderr
    assert armwright(command, "puma560-seed", "--csv", path).returncode == 0
