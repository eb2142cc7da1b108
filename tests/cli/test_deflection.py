"""The command deflection: its tables, its JSON, its files, and what it refuses."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.dynamics import read_stiffness, static_deflection
from armwright.kinematics.forward_kinematics import forward
from cli_calls import armwright

Q_DEG = "10,-20,30,0,40,0"
STIFFNESS = """
[joint.1]
x_Nm_per_rad = 2e5
[joint.2]
z_Nm_per_rad = 3e4
y_Nm_per_rad = 1e5
"""


def test_of_one_configuration() -> None:
    """Stiffness about own axes: the elbow or shoulder that carries most yields most; the parts add up."""
    done = armwright("deflection", "puma560", "--stiffness", "3e4", "-q", Q_DEG, "--load", "2,0,0,60", "--json")
    data = json.loads(done.stdout)

    (row,) = data["rows"]
    assert data["most_yielding_joint"] == 2
    assert sum(row["shares_m"]) == pytest.approx(row["length_m"], rel=0.01)
    arm = load_arm("puma560")
    compliance = np.zeros((6, 3))
    compliance[:, 2] = 1 / 3e4
    expected = static_deflection(arm, compliance, np.radians([10, -20, 30, 0, 40, 0]), payload=(2, 0, 0, 0.06))
    np.testing.assert_allclose(row["displacement_m"], expected.displacement[0], rtol=1e-12)


def test_of_the_gears_of_the_arm() -> None:
    """Without a stiffness it is that of the gears in the arm file."""
    file = str(Path(__file__).parents[2] / "examples" / "two_link_springs.toml")
    own = armwright("deflection", file, "-q", "57.3,68.75", "--json")
    K = load_arm(file).motor_values("stiffness").tolist()
    given = armwright("deflection", file, "-q", "57.3,68.75", "--stiffness", ",".join(map(repr, K)), "--json")

    assert json.loads(own.stdout)["rows"] == json.loads(given.stdout)["rows"]


def test_of_a_program(tmp_path: Path) -> None:
    """A table has a page and corrected positions, from which the loaded arm has its tool where the rigid arm has it."""
    q = np.linspace([0, -0.4, 0.5, 0, 0.6, 0], [1, 0.2, 0.9, 0.4, 0.8, 0.2], 4)
    rows = [",".join(f"q{i}" for i in range(1, 7)), *(",".join(map(str, row)) for row in q)]
    (tmp_path / "path.csv").write_text("\n".join(rows), encoding="utf-8")
    (tmp_path / "stiffness.toml").write_text(STIFFNESS, encoding="utf-8")

    done = armwright(
        *("deflection", "puma560", "--stiffness", "stiffness.toml", "--csv", "path.csv"),
        *("--wrench", "0,0,-50,0,0,0", "-o", "out"),
        cwd=tmp_path,
        columns=120,
    )

    assert "Rigid, for no stiffness is given: joint 3" in done.stdout
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        *("report.html", "deflection.json", "run.json", "compensated.csv", "displacement.svg")
    }
    with (tmp_path / "out" / "compensated.csv").open(encoding="utf-8") as file:
        corrected = np.array([*csv.reader(file)][1:], dtype=np.float64)
    arm = load_arm("puma560")
    compliance = read_stiffness(tmp_path / "stiffness.toml", arm)
    reached = static_deflection(arm, compliance, corrected, wrench=(0, 0, -50, 0, 0, 0))
    np.testing.assert_allclose(reached.tool, forward(arm, q), atol=1e-9)
    assert np.linalg.norm(reached.displacement, axis=1).min() > 1e-4


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--stiffness", "1e4"), "expected the configurations, either one as -q or a table of them as --csv FILE"),
        (("-q", Q_DEG), "expected a stiffness: the gears of puma560 are rigid"),
        (("-q", Q_DEG, "--stiffness", "0"), "expected 0.001 to 1e+12, got 0"),
        (("-q", Q_DEG, "--stiffness", "1,2"), "expected one number, or 6, one per joint, got 2"),
        (("-q", Q_DEG, "--stiffness", "1"), "yields by more than 0.5 rad or m"),
    ],
)
def test_usage(arguments: tuple[str, ...], said: str) -> None:
    """What is missing or out of range is said."""
    done = armwright("deflection", "puma560", *arguments)
    assert done.returncode in {2, 3}
    assert said in " ".join(done.stderr.replace("│", " ").split())


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "expected a stiffness, such as z_Nm_per_rad = 2e4 in [joint.2]"),
        ("[joint.7]\nz_Nm_per_rad = 1", "7"),
        ("[joint.2]\nz_N_per_m = 1", "z_Nm_per_rad"),
        ("[joint.2]\nz_Nm_per_rad = -1", "0.001"),
    ],
)
def test_stiffness_files(tmp_path: Path, text: str, said: str) -> None:
    """A file of stiffness names joints and axes that the arm has, with a stiffness above 0."""
    (tmp_path / "s.toml").write_text(text, encoding="utf-8")
    done = armwright("deflection", "puma560", "--stiffness", "s.toml", "-q", Q_DEG, cwd=tmp_path)
    assert done.returncode == 4
    assert said in " ".join(done.stderr.split())
