"""Mistakes in calls of the mechanics commands: one message that names the option or the file, and never a traceback."""

import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from armwright.arm.load import load_arm, read_load
from armwright.arm.model import Link
from armwright.cli.app import main
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.dynamics.payloads import payload
from armwright.errors import FileFormatError
from armwright.simulation.simulator import simulate
from cli_calls import armwright

Q = "10,20,30,40,50,60"
JPL = "0,90,500,0,45,0"
Q_JPL = np.array([0, np.pi / 2, 0.5, 0, np.pi / 4, 0])
HEADER = "q1,q2,q3,q4,q5,q6"
Call = Callable[..., tuple[int, str, str]]


@pytest.fixture
def call(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Call:
    """The command line without a process of its own: exit status, what it printed, what it said is wrong."""
    monkeypatch.setattr("armwright.cli.failures.signal.signal", lambda *_: None)
    monkeypatch.setenv("COLUMNS", "300")
    monkeypatch.setenv("NO_COLOR", "1")

    def run(*arguments: str | Path) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["armwright", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, said = capsys.readouterr()
        return int(ended.value.code or 0), out, " ".join(said.replace("│", " ").split())

    return run


OPTIONS = {
    "forward -q": ("forward", "puma560", "-q"),
    "jacobian -q": ("jacobian", "puma560", "-q"),
    "singularity -q": ("singularity", "puma560", "-q"),
    "torque -q": ("torque", "puma560", "-q"),
    "torque --qd": ("torque", "puma560", "-q", Q, "--qd"),
    "torque --qdd": ("torque", "puma560", "-q", Q, "--qdd"),
    "torque --wrench": ("torque", "puma560", "-q", Q, "--wrench"),
    "simulate -q": ("simulate", "puma560", "-q"),
    "simulate --qd": ("simulate", "puma560", "-q", Q, "--qd"),
    "inverse --near": ("inverse", "puma560", "--xyz", "400,100,200", "--near"),
}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "expected 6 finite numbers, got 0"),
        (",,,,,", "expected 6 finite numbers, got 0"),
        ("1,2,3", "expected 6 finite numbers, got 3: 1,2,3"),
        ("1,2,3,4,5,6,7", "expected 6 finite numbers, got 7"),
        ("1;2;3;4;5;6", "expected 6 numbers, got '1;2;3;4;5;6'"),
        ("1,2,3,4,5,6°", "expected 6 numbers, got '6°'"),
        ("-", "expected 6 numbers, got '-'"),
        ("nan,0,0,0,0,0", "every number must be finite and no larger than 1e+100, got nan"),
        ("0,0,0,0,0,1e400", "every number must be finite and no larger than 1e+100, got 1e400"),
        ("0,0,-1e308,0,0,0", "every number must be finite and no larger than 1e+100, got -1e308"),
    ],
)
@pytest.mark.parametrize("option", OPTIONS)
def test_what_are_no_six_numbers(call: Call, option: str, text: str, said: str) -> None:
    """What is not one finite number per joint is refused by the name of the option."""
    status, out, error = call(*OPTIONS[option], text)

    assert (status, out) == (2, "")
    assert f"Invalid value for {option.split()[1]}: {said}" in error


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (("forward", "pumma560", "-q", Q), 2, "no arm 'pumma560'. Did you mean 'puma560'?"),
        (("show", "PUMA560"), 2, "no arm 'PUMA560'. Did you mean 'puma560'?"),
        (("show", ""), 2, "no arm ''. All "),
        (("singularity", "nowhere/arm.toml", "-q", Q), 4, "nowhere/arm.toml: no such file"),
        (("simulate", "/", "-q", Q), 4, "/: expected a file, got a folder"),
        (("torque", "\0.toml", "-q", Q), 4, "'\\x00.toml': no file can have this name"),
        (("kernel", "ur5", "jacobain"), 2, "no quantity 'jacobain'. Did you mean 'jacobian'?"),
        (("study", "stanford-torqe"), 2, "no study 'stanford-torqe'. Did you mean 'stanford-torque'?"),
        (("show",), 2, "Missing argument"),
        (("arms", "puma560"), 2, "unexpected extra argument"),
        (("jacobian", "puma560", "-q", Q, "--frame", ""), 2, "'' is not one of 'base', 'tool'"),
        (("inverse", "puma560", "--xyz", "1,2"), 2, "--xyz: expected 3 finite numbers, got 2"),
        (("inverse", "puma560", "--xyz", "1e200,0,0"), 2, "--xyz: every number must be finite and no larger than"),
        (("inverse", "puma560", "--xyz", "1,2,3", "--rpy", "0"), 2, "--rpy: expected 3 finite numbers, got 1"),
        (("inverse", "puma560", "--noap", "1 2 3"), 2, "--noap: expected 12 finite numbers, got 3"),
        (("inverse", "puma560", "--noap", " ".join("0" * 12)), 2, "pose: expected"),
        (("inverse", "puma560", "--noap", "1 0 0 0 1 0 0 0 -1 .4 .1 .2"), 2, "pose: expected"),
        (
            ("inverse", "puma560", "--noap", "1 0 0 0 1 0 0 0 1 .4 .1 .2", "--rpy", "0,0,90"),
            2,
            "--rpy: the twelve numbers of --noap include the orientation",
        ),
        (("torque", "puma560"), 2, "-q: expected the motion"),
        (("torque", "puma560", "--qd", Q), 2, "-q: expected the motion"),
        (
            ("torque", "puma560", "--csv", "x.csv", "--qd", Q),
            2,
            "--csv: expected no --qd and --qdd with a table, which has its own velocities and accelerations",
        ),
        (("simulate", "puma560", "-q", Q, "--duration", "-1"), 2, "duration: expected more than 0 s, got -1.0"),
        (("simulate", "puma560", "-q", Q, "--duration", "nan"), 2, "duration: expected more than 0 s, got nan"),
        (("simulate", "puma560", "-q", Q, "--duration", "1e9"), 2, "would be 1e+12 samples; expected at most 1e+07"),
        (("simulate", "puma560", "-q", Q, "--duration", "long"), 2, "'--duration'"),
        (("simulate", "puma560", "-q", Q, "--step-ms", "nan"), 2, "--step-ms: expected 0.001 to 1000, got nan"),
        (
            ("simulate", "puma560", "-q", "0,0,400,0,0,0"),
            2,
            "joint 3 starts at 400 deg, outside its stops at -45 and 225 deg",
        ),
        (("simulate", "ur5", "-q", Q, "--method", "euler"), 2, "'euler' is not one of"),
    ],
)
def test_mistakes_in_a_call(call: Call, arguments: tuple[str, ...], status: int, said: str) -> None:
    """Unknown names, missing files, times without a meaning: each is told with what there is instead."""
    got, out, error = call(*arguments)

    assert (got, out) == (status, "")
    assert said in error


FILES = {
    "empty": ("", ": the file is empty; expected column names in its first line"),
    "columns without rows": (HEADER + "\n", ": no rows after the column names"),
    "a thousand and a decimal comma": (
        HEADER.replace(",", ";") + "\n1,5;2;3;4;5;1.000\n",
        ":2: q6: expected a decimal comma, as in line 2, got '1.000'",
    ),
    "a column twice": (HEADER + ",q2\n1,1,1,1,1,1,1\n", ":1: q2: a second column for this quantity, after q2"),
    "a short row": (HEADER + "\n1,1\n", ":2: expected 6 values, one per column, got 2"),
    "a word": (HEADER + "\n1,1,1,1,1,1\n\n1,1,one,1,1,1\n", ":4: q3: expected a number, got 'one'"),
    "an endless number": (HEADER + "\n1,1,1,1,1,inf\n", ":2: q6: every number must be finite"),
    "a zero byte": (HEADER + "\n1,1,1,1,1,\0001\n", ":2: q6: expected a number, got "),
    "a number of a page": (HEADER + "\n" + "1" * 200_000 + ",1,1,1,1,1\n", "not valid CSV: field larger than"),
}


@pytest.mark.parametrize("what", FILES)
@pytest.mark.parametrize("command", ["forward", "jacobian"])
def test_files_that_are_no_rows(call: Call, tmp_path: Path, command: str, what: str) -> None:
    """A file without the columns, without rows, or with something else in them is refused by file and line."""
    text, said = FILES[what]
    file = tmp_path / "rows.csv"
    file.write_text(text)

    status, out, error = call(command, "puma560", "--csv", file)

    assert (status, out) == (4, "")
    assert error.startswith(f"armwright: {file}:")
    assert said in error


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_files_of_any_system(call: Call, tmp_path: Path, end: str) -> None:
    """The line ends of any system and a mark of byte order make no difference, nor do blanks round names."""
    file = tmp_path / "rows.csv"
    file.write_bytes(f"\ufeff{HEADER.replace(',', ' , ')}{end}.1,.2,.3,.4,.5,.6{end}".encode())

    status, out, _ = call("forward", "puma560", "--csv", file, "--json")

    assert status == 0
    assert json.loads(out)[0]["q"] == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]


@pytest.mark.filterwarnings("always::armwright.errors.IncompleteRowsWarning")
def test_files_with_units(call: Call, tmp_path: Path) -> None:
    """Joints may be in degrees and columns may have other names, where the names or a map say so."""
    file, mapping = tmp_path / "rows.csv", tmp_path / "map.toml"
    file.write_text("A1;joint_2 [deg];q3_mrad;q4;q5;q6;remark\n90,5;;1;1;1;1;lost\n90,5;-20;100;0;0;0,25;warm\n")
    mapping.write_text('[columns]\nA1 = "q1_deg"\n')
    options = ("forward", "puma560", "--csv", file, "--json", "--skip-incomplete", "--columns")

    typed, written = call(*options, "A1=joint_1_deg"), call(*options, mapping)

    assert typed == written
    assert (
        f"armwright: warning: {file}: 1 row omitted because of empty cells, 1 read: joint_2 [deg] in line 2" in typed[2]
    )
    np.testing.assert_allclose(json.loads(typed[1])[0]["q"], [*np.radians([90.5, -20]), 0.1, 0, 0, 0.25])


@pytest.mark.parametrize(
    ("columns", "status", "said"),
    [
        ("A1=", 2, "--columns: expected a column map such as A1=joint_1_deg,X=x_mm, got 'A1='"),
        ("nowhere.toml", 4, "nowhere.toml: no such file"),
        ("A9=q1_deg", 4, "rows.csv:1: A9: no such column to map to q1_deg. There are q1, q2"),
    ],
)
def test_bad_column_maps(call: Call, tmp_path: Path, columns: str, status: int, said: str) -> None:
    """A column map that is none, is missing, or is of another file ends the command with one line."""
    file = tmp_path / "rows.csv"
    file.write_text(f"{HEADER}\n0,0,0,0,0,0\n")

    got, out, error = call("forward", "puma560", "--csv", file, "--columns", columns)

    assert (got, out) == (status, "")
    assert said in error


@pytest.mark.parametrize("option", [("--columns", "A1=q1"), ("--skip-incomplete",)])
def test_table_options_without_a_table(call: Call, option: tuple[str, ...]) -> None:
    """What is said of a table is refused where none is read."""
    got, _, error = call("forward", "puma560", "-q", Q, *option)

    assert got == 2
    assert f"{option[0]}: expected a table, --csv FILE, with this option" in error


def test_velocities_by_joint_names(call: Call, tmp_path: Path) -> None:
    """Positions, velocities and accelerations of joints may have the names and units of the arm's joints."""
    file, arm = tmp_path / "rows.csv", load_arm("puma560")
    names = [
        f"joint_{i}{what}" for what in ("_deg", "_velocity_deg_per_s", "_acceleration_deg_per_s2") for i in range(1, 7)
    ]
    row = np.arange(1.0, 19.0)
    file.write_text(f"{','.join(names)}\n{','.join(map(str, row))}\n")

    _, out, _ = call("torque", "puma560", "--csv", file, "--json")

    q, qd, qdd = np.radians(row).reshape(3, 6)
    np.testing.assert_allclose(json.loads(out)[0]["total"], inverse_dynamics(arm, q, qd, qdd), atol=1e-9)


def test_files_in_degrees(call: Call, tmp_path: Path) -> None:
    """A file that looks as if it were in degrees is read as it stands, with a warning that names it."""
    file = tmp_path / "rows.csv"
    file.write_text(f"{HEADER}\n0.1,0.2,0.3,0.4,0.5,0.6\n10,20,30,40,50,60\n")

    status, out, error = call("forward", "puma560", "--csv", file, "--json")

    assert status == 0
    assert [row["q"][0] for row in json.loads(out)] == [0.1, 10.0]
    assert error.startswith(f"armwright: warning: {file}: joint 1 of 'puma560' is at 10 rad")
    assert "Traceback" not in error


def test_degrees_on_the_command_line(call: Call) -> None:
    """Positions typed as degrees are degrees, however many turns: there is nothing to warn of."""
    status, _, error = call("forward", "puma560", "-q", "720,0,0,0,0,0")

    assert (status, error) == (0, "")


@pytest.mark.parametrize("text", ["1.8,0,0,50", "load.toml"])
def test_load_in_the_hand(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    """A load on the command line or in a file makes the efforts those of the arm with that load."""
    monkeypatch.chdir(tmp_path)
    Path("load.toml").write_text("mass_kg = 1.8\ncom_mm = [0, 0, 50]\ninertia_kgm2 = [0.003, 0.003, 0.003]\n")
    arm = load_arm("stanford-jpl")
    inertia = np.zeros((3, 3)) if text != "load.toml" else 0.003 * np.eye(3)
    loaded = payload(arm, 1.8, (0, 0, 0.05), inertia)
    qdd = np.radians([60, 0, 0, 0, 0, 0])

    _, out, _ = call("torque", "stanford-jpl", "-q", JPL, "--qdd", "60,0,0,0,0,0", "--load", text, "--json")

    found = json.loads(out)
    still = np.zeros(6)
    np.testing.assert_allclose(found["total"], inverse_dynamics(loaded, Q_JPL, still, qdd), atol=1e-9)
    expected = inverse_dynamics(loaded, Q_JPL, still, qdd) - inverse_dynamics(arm, Q_JPL, still, qdd)
    np.testing.assert_allclose(found["load"], expected, atol=1e-9)


def test_wrench_on_the_tool(call: Call) -> None:
    """What acts on the tool is a row of its own, in numbers and in the table; the causes still sum up."""
    wrench = [1.0, 2.0, -30.0, 0.1, 0.2, 0.3]
    options = ("torque", "stanford-jpl", "-q", JPL, "--load", "1,0,0,0", "--wrench", ",".join(map(str, wrench)))

    found = json.loads(call(*options, "--json")[1])
    table = call(*options)[1]

    still = np.zeros(6)
    arm = load_arm("stanford-jpl")
    pushed = inverse_dynamics(arm, Q_JPL, still, still, wrench=wrench) - inverse_dynamics(arm, Q_JPL, still, still)
    np.testing.assert_allclose(found["wrench"], pushed, atol=1e-9)
    np.testing.assert_allclose(sum(np.array(v) for k, v in found.items() if k != "total"), found["total"], atol=1e-9)
    rows = {line[:18].strip(): line[18:].split() for line in table.splitlines()[1:]}
    assert float(rows["wrench"][1]) == pytest.approx(found["wrench"][1], abs=1e-4)
    assert float(rows["load"][1]) == pytest.approx(found["load"][1], abs=1e-4)
    assert "-0.0000" not in table


def test_load_and_wrench_on_the_rows_of_a_file(call: Call, tmp_path: Path) -> None:
    """Every row of a file is carried out with the same load and against the same wrench."""
    rows = np.random.default_rng(2).uniform(0.2, 0.5, size=(3, 18))
    names = [f"{quantity}{i}" for quantity in ("q", "qd", "qdd") for i in range(1, 7)]
    file = tmp_path / "rows.csv"
    file.write_text("\n".join([",".join(names), *(",".join(map(repr, row)) for row in rows.tolist())]))

    _, out, _ = call("torque", "stanford", "--csv", file, "--load", "2,10,0,0", "--wrench", "0,0,5,0,0,1", "--json")

    loaded = payload(load_arm("stanford"), 2.0, (0.01, 0, 0))
    expected = inverse_dynamics(loaded, rows[:, :6], rows[:, 6:12], rows[:, 12:], wrench=[0, 0, 5, 0, 0, 1])
    np.testing.assert_allclose([row["total"] for row in json.loads(out)], expected, atol=1e-9)


def test_simulation_with_a_load(call: Call) -> None:
    """An arm let go with a load falls as the arm with that load does, and without one as the arm alone."""
    options = ("simulate", "puma560", "-q", "0,0,90,0,0,0", "--duration", "0.005", "--json")
    start = np.radians([0, 0, 90, 0, 0, 0])

    loaded, bare = json.loads(call(*options, "--load", "2,0,0,30")[1]), json.loads(call(*options)[1])

    arm = load_arm("puma560")
    for found, model in ((loaded, payload(arm, 2.0, (0, 0, 0.03))), (bare, arm)):
        motion = simulate(model, start, duration=0.005)
        change = float(motion.potential[-1] - motion.potential[0])
        assert found["potential_change"] == pytest.approx(change, rel=1e-6)
    assert abs(loaded["potential_change"]) > abs(bare["potential_change"])


@pytest.mark.parametrize("command", ["torque", "simulate"])
@pytest.mark.parametrize(
    ("load", "status", "said"),
    [
        ("1", 2, "--load: expected 4 finite numbers, got 1: 1, or a file that ends in .toml"),
        ("heavy", 2, "--load: expected 4 numbers, got 'heavy', or a file that ends in .toml"),
        ("-1,0,0,0", 2, "--load: expected a mass of 0 kg or more, got -1"),
        ("nan,0,0,0", 2, "--load: every number must be finite"),
        ("missing.toml", 4, "missing.toml: no such file"),
        ("/", 4, "/: expected a file, got a folder"),
    ],
)
def test_impossible_loads(call: Call, command: str, load: str, status: int, said: str) -> None:
    """A load without a place, lighter than nothing, or in a file that does not exist is refused."""
    got, out, error = call(command, "puma560", "-q", "0,0,90,0,0,0", "--load", load)

    assert (got, out) == (status, "")
    assert said in error


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "mass_kg: missing, expected a number"),
        ("mass_kg = -1\n", ":1: mass_kg: expected 0 or more, got -1"),
        ("mass_kg = 1\ncon_mm = [0, 0, 1]\n", ":2: con_mm: unknown key; did you mean 'com_mm'?"),
        ("mass_kg = 1\ninertia_kgm2 = [1, 1, 3]\n", ":2: inertia_kgm2: a body cannot have the principal moments 1, 1,"),
    ],
)
def test_load_files(tmp_path: Path, text: str, said: str) -> None:
    """A load file without a mass, with a misspelt key, or of a body that cannot be is refused by line and key."""
    file = tmp_path / "load.toml"
    file.write_text(text)

    with pytest.raises(FileFormatError) as caught:
        read_load(file)

    assert said in str(caught.value)


def test_load_file(tmp_path: Path) -> None:
    """A load file has the keys of a link, with their units."""
    file = tmp_path / "load.toml"
    file.write_text("mass_kg = 2\ncom_cm = [1, 2, 3]\ninertia_kgm2 = [0.1, 0.1, 0.1, 0, 0, 0.01]\n")

    inertia = [[0.1, 0, 0], [0, 0.1, 0.01], [0, 0.01, 0.1]]
    assert read_load(file) == Link(mass=2.0, com=np.array([1, 2, 3]) * 1e-2, inertia=inertia)


def test_as_a_user_calls() -> None:
    """In a process of its own a mistake ends with one line on the error output, and no traceback."""
    done = armwright("torque", "puma560", "-q", Q, "--load", "nowhere.toml")

    assert (done.returncode, done.stdout) == (4, "")
    assert done.stderr == "armwright: nowhere.toml: no such file\n"
