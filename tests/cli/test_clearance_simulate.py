"""The command clearance simulate: what it prints, writes and refuses."""

import csv
import json
from importlib import resources
from pathlib import Path

import pytest

from cli_calls import armwright

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

FILES = {
    "report.html", "samples.csv", "summary.json", "path.svg", "bearings.svg", "error.svg", "spectrum.svg", "forces.svg",
    "energy.svg", "workspace.svg", "run.json",
}  # fmt: skip


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a run of path y1."""
    folder = tmp_path_factory.mktemp("rattling") / "out"
    done = armwright(
        "clearance", "simulate", "five-bar", "--path", "y1", "--clearance-mm", "0.4", "--clearance", "J2=0.3mm",
        "--step", "2e-5", "-o", folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert f"report: {folder / 'report.html'}" in done.stdout
    assert "five-bar, y1: finished after 0.25 s" in done.stdout
    return folder


def test_files(written: Path) -> None:
    """The folder holds page, samples, summary and figures; the summary has the clearances that were asked for."""
    told = json.loads((written / "summary.json").read_text())

    assert {file.name for file in written.iterdir()} == FILES
    assert {name: pin["clearance"] * 1e3 for name, pin in told["pins"].items()} == pytest.approx(
        {"J2": 0.3, "J3": 0.4, "J4": 0.4}
    )
    assert told["command"].startswith("armwright clearance simulate five-bar --path y1")
    with (written / "samples.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2501
    assert float(rows[-1]["time_s"]) == pytest.approx(told["duration"])
    assert float(rows[-1]["friction_loss_J"]) == pytest.approx(told["energy"]["friction_loss"], rel=1e-8)
    assert "five-bar: y1</h1>" in (written / "report.html").read_text()


def test_options_reach_the_run() -> None:
    """Law, friction, step and sample are those of the run, and told in SI units."""
    done = armwright(
        "clearance", "simulate", "five-bar", "--path", "y1", "--law", "exact", "--friction", "0", "--step", "2e-5",
        "--sample", "1e-3", "--start", "rigid", "--threshold-mm-s", "2", "--json",
    )  # fmt: skip

    how = json.loads(done.stdout)["settings"]
    assert how["impact_law"] == "exact"
    assert how["restitution_given"] == pytest.approx(0.9, abs=1e-9)
    assert (how["friction"], how["start"], how["friction_threshold"]) == (0.0, "rigid", 2e-3)
    assert (how["step"], how["sample"]) == pytest.approx((2e-5, 1e-3))
    assert json.loads(done.stdout)["energy"]["friction_loss"] == 0


def test_turning_drive() -> None:
    """A slider-crank takes a speed and turns; at 600 rev/min two turns take 0.2 s."""
    done = armwright(
        "clearance",
        "simulate",
        "slider-crank",
        "--speed-rpm",
        "600",
        "--revolutions",
        "2",
        "--start",
        "centred",
        "--step",
        "2e-5",
        "--json",
    )

    told = json.loads(done.stdout)
    assert told["path"] == "2 revolutions at 600 rev/min"
    assert told["duration"] == pytest.approx(0.2)
    assert told["status"] == "finished"
    assert list(told["pins"]) == ["B"]


def test_quiet() -> None:
    """With -q nothing is printed."""
    done = armwright("clearance", "simulate", "five-bar", "--path", "y1", "--step", "2e-5", "-q")

    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["fivebar", "--path", "y1"], "no linkage 'fivebar'. Did you mean 'five-bar'?"),
        (["five-bar", "--path", "Y2"], "no path 'Y2'. Did you mean 'y2'?"),
        (["five-bar", "--path", "y1", "--clearance", "j3=0.2"], "no pin 'j3'. Did you mean 'J3'?"),
        (["five-bar", "--path", "y1", "--law", "flors"], "no law of impact 'flors'. Did you mean 'flores'?"),
        (["five-bar", "--path", "y1", "--clearance-mm", "0"], "contact needs them above 0, got 0 mm"),
        (["five-bar", "--path", "y1", "--clearance", "J2=-1"], "pin J2: clearance: expected 0 or more"),
        (["five-bar", "--path", "y1", "--step", "1e-3"], "is too long for contacts"),
    ],
)
def test_misspelt_names_and_wrong_numbers(arguments: list[str], said: str) -> None:
    """A slip ends with one line that names the nearest thing, or what is expected."""
    done = armwright("clearance", "simulate", *arguments, columns=200)

    assert done.returncode == 2
    assert done.stderr.startswith("armwright: ")
    assert done.stderr.count("\n") == 1
    assert said in done.stderr
    assert done.stdout == ""


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["five-bar"], "five-bar takes --path y1"),
        (["five-bar", "--path", "y1", "--speed-rpm", "60"], "either --path or --speed-rpm"),
        (["slider-crank", "--path", "y1"], "slider-crank has 1; use --speed-rpm"),
        (["four-bar", "--speed-rpm", "0"], "expected a speed of 1e-06 to 1e+09 rev/min in either direction"),
        (["five-bar", "--path", "y1", "--clearance", "J2"], "J2=0.5, got J2"),
        (["five-bar", "--path", "y1", "--clearance", "J2=thick"], "J2=0.5, got J2=thick"),
    ],
)
def test_options_that_do_not_fit_together(arguments: list[str], said: str) -> None:
    """Options that do not fit together, or cannot be read, are a matter of usage: status 2, and what was meant."""
    done = armwright("clearance", "simulate", *arguments, columns=200)

    assert done.returncode == 2
    assert said in done.stderr


def test_help() -> None:
    """Help has an example in it."""
    done = armwright("clearance", "simulate", "--help")

    assert "Example: armwright clearance simulate five-bar --path y1" in " ".join(done.stdout.split())


def test_nothing_heavy_for_help() -> None:
    """The module of the command imports neither NumPy nor the simulation."""
    import subprocess
    import sys

    code = "import armwright.cli.clearance, sys; print(sorted({'numpy', 'numba', 'matplotlib'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert done.stdout.strip() == "[]"


def test_micrometres_for_millimetres() -> None:
    """A clearance larger than its journal is that of no bearing: another unit was meant."""
    done = armwright("clearance", "simulate", "five-bar", "--path", "y1", "--clearance", "J2=300")

    assert done.returncode == 2
    assert "clearance J2: expected at most the radius of the journal, 10 mm, got 300 mm" in done.stderr


def test_pick_and_place() -> None:
    """The path that is corrected can be simulated too, with its three targets."""
    done = armwright("clearance", "simulate", "five-bar", "--path", "pick-and-place", "--step", "2e-5", "--json")

    assert [one["time"] for one in json.loads(done.stdout)["targets"]] == pytest.approx([0.0, 0.25, 0.5])


def test_elastic_rod(tmp_path: Path) -> None:
    """A linkage with an elastic rod has its bending in the table, the summary and the samples, and loses no energy."""
    slider = resources.files("armwright.clearance.catalogue").joinpath("slider-crank.toml").read_text("utf-8")
    points = "points = { A = [0.0, 0.0], B = [0.12, 0.0] }"
    assert points in slider
    file = tmp_path / "elastic.toml"
    file.write_text(slider.replace(points, f"{points}\nelastic = {{ square_mm = 6, modes = 1 }}"), encoding="utf-8")

    done = armwright(
        "clearance", "simulate", file, "--speed-rpm", "120", "--revolutions", "0.02", "--step", "4e-6",
        "-o", tmp_path / "out", columns=100,
    )  # fmt: skip

    assert done.returncode == 0, done.stderr
    told = json.loads((tmp_path / "out" / "summary.json").read_text())
    rod, energy = told["rods"]["rod"], told["energy"]
    assert 1e-6 < rod["bent_at_start"] < rod["bent_at_most"] < 1e-3
    assert f"{rod['frequencies'][0]:.4g}" in next(line for line in done.stdout.splitlines() if "on pins" in line)
    assert energy["damping_loss"] > 0
    assert energy["imbalance"] < 0.02 * energy["driven"]
    with (tmp_path / "out" / "samples.csv").open() as samples:
        rows = list(csv.DictReader(samples))
    assert max(abs(float(row["rod.bend1_m"])) for row in rows) == pytest.approx(rod["bent_at_most"], rel=1e-8)
    assert float(rows[-1]["damping_loss_J"]) == pytest.approx(energy["damping_loss"], rel=1e-8)
    assert "bent at the start" in (tmp_path / "out" / "report.html").read_text()
