"""The command life: its tables, its JSON and its files."""

import json
from pathlib import Path

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.dynamics.newton_euler import inverse_dynamics
from cli_calls import armwright

FILE = Path(__file__).parents[2] / "examples" / "puma_life.toml"


@pytest.fixture
def motion(tmp_path: Path) -> Path:
    """A table of a swing of all joints of a PUMA 560, with its efforts."""
    t = np.linspace(0, 2, 101)[:, None]
    phase = np.pi * t + np.arange(6)
    q, qd, qdd = 0.5 * np.sin(phase), 0.5 * np.pi * np.cos(phase), -0.5 * np.pi**2 * np.sin(phase)
    rows = np.hstack([t, q, qd, inverse_dynamics(load_arm("puma560"), q, qd, qdd)])
    names = ["t", *(f"{name}{i}" for name in ("q", "qd", "tau") for i in range(1, 7))]
    path = tmp_path / "motion.csv"
    np.savetxt(path, rows, delimiter=",", header=",".join(names), comments="")
    return path


def test_files(motion: Path, tmp_path: Path) -> None:
    """With -o there are a page and two figures; the first to fail stands in front, and the JSON says the same."""
    arguments = ("life", "puma560", motion, FILE, "--limit", "0.1", "--cycles-per-day", "5000", "--samples", "200")
    done = armwright(*arguments, "-o", "out", cwd=tmp_path, columns=120)
    data = json.loads(armwright(*arguments, "--json", cwd=tmp_path).stdout)

    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert written == {"report.html", "life.json", "run.json", "components.svg", "repeatability.svg"}
    assert json.loads((tmp_path / "out" / "life.json").read_text(encoding="utf-8")) == data
    hours = [one["hours"] for one in data["components"]]
    assert hours == sorted(hours)
    assert data["hours"] < hours[0]
    assert data["play"]["cycles"]["0.05"] < data["play"]["cycles"]["0.5"] < data["play"]["cycles"]["0.95"]
    assert "RP ≤ 0.1 mm with 95 % for" in " ".join(done.stdout.split())


def test_efforts_of_the_model(motion: Path, tmp_path: Path) -> None:
    """A table without efforts has the lives of one with those of the model, and a note; partly filled it is refused."""
    rows = motion.read_text(encoding="utf-8").splitlines()
    short, partly = tmp_path / "short.csv", tmp_path / "partly.csv"
    short.write_text("\n".join(",".join(row.split(",")[:13]) for row in rows), encoding="utf-8")
    partly.write_text("\n".join(",".join(row.split(",")[:15]) for row in rows), encoding="utf-8")

    given = json.loads(armwright("life", "puma560", motion, FILE, "--json").stdout)
    done = armwright("life", "puma560", short, FILE, columns=200)
    found = json.loads(armwright("life", "puma560", short, FILE, "--json").stdout)

    assert found["hours"] == pytest.approx(given["hours"], rel=0.02)
    assert "it has no efforts; those of the model of puma560 are taken" in " ".join(done.stdout.split())
    refused = armwright("life", "puma560", partly, FILE)
    assert refused.returncode == 4
    assert "tau3" in refused.stderr
    massless = armwright("life", "gp12", short, FILE)
    assert massless.returncode != 0
    assert "expected columns of efforts, since gp12 has no masses" in " ".join(massless.stderr.split())


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("empty.csv", ""),
        ("binary.csv", "\0\1\2"),
        ("letters.csv", "t,q1,q2,q3,q4,q5,q6\n0,a,b,c,d,e,f\n"),
        ("infinite.csv", "t,q1,q2,q3,q4,q5,q6\n" + "\n".join(f"{k},inf,0,0,0,0,0" for k in range(60))),
        ("huge.csv", "t,q1,q2,q3,q4,q5,q6\n" + "\n".join(f"{k},{k}e300,0,0,0,0,0" for k in range(60))),
        ("short.csv", "t,q1,q2,q3,q4,q5,q6\n0,0,0,0,0,0,0\n1,0,0,0,0,0,0\n"),
        ("back.csv", "t,q1,q2,q3,q4,q5,q6\n" + "\n".join(f"{-k},0,0,0,0,0,0" for k in range(60))),
    ],
)
def test_hostile_motions(tmp_path: Path, name: str, text: str) -> None:
    """A broken table is one message that names it."""
    (tmp_path / name).write_text(text, encoding="utf-8")
    done = armwright("life", "puma560", tmp_path / name, FILE)
    assert done.returncode == 4
    assert name in done.stderr.replace("\n", "")
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--limit", "0"), "expected a number above 0, got 0"),
        (("--cycles-per-day", "nan"), "expected a number above 0, got nan"),
        (("--dwell", "-1"), "expected 0 s or more, got -1"),
    ],
)
def test_usage(motion: Path, arguments: tuple[str, ...], said: str) -> None:
    """What is out of range is said."""
    done = armwright("life", "puma560", motion, FILE, *arguments)
    assert done.returncode == 2
    assert said in " ".join(done.stderr.replace("│", " ").split())
