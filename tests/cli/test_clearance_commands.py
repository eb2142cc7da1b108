"""``armwright clearance sweep``, ``estimate`` and ``correct`` as a user calls them."""

import json
import re
import shutil
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cli_calls import armwright

pytest.importorskip("sklearn")
pytest.importorskip("xarray")

EXAMPLES = Path(__file__).parents[2] / "examples"
REST, PATHS = EXAMPLES / "five_bar_rest.csv", EXAMPLES / "five_bar_paths.csv"
# What the example's arm has [m], and how its friction goes.
PLAY = {"J2": 0.328e-3, "J3": 0.171e-3, "J4": 0.483e-3}
CENTRE = ("--friction-velocity", "centre", "--threshold-mm-s", "10")
CLEARANCES = [part for name, c in PLAY.items() for part in ("--clearance", f"{name}={c * 1e3:g}")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep of 64 arms on the three paths of the example."""
    path = tmp_path_factory.mktemp("sweep") / "out"
    done = armwright("clearance", "sweep", "five-bar", *CENTRE, "-n", "64", "--workers", "1", "-o", path)
    assert done.returncode == 0, done.stderr
    first, *rest = done.stdout.splitlines()
    assert first == f"64 linkages on y1, y3, y7: {path}"
    assert [line.partition(":")[0] for line in rest] == ["y1", "y3", "y7"]
    assert all(re.fullmatch(r"y\d: predictable until t = 0\.2\d+ s in half .*, of 0\.25 s", line) for line in rest)
    return path


def test_examples_are_what_the_script_writes() -> None:
    """The example's files are those of its script; its runs up to the impacts, which processors round differently."""
    import runpy

    texts = runpy.run_path(str(EXAMPLES / "five_bar.py"))["texts"]()

    assert set(texts) == {REST.name, PATHS.name}
    for path in (REST, PATHS):
        made, kept = ([line.split(",") for line in text.splitlines()] for text in (texts[path.name], path.read_text()))
        assert [row[0] for row in made] == [row[0] for row in kept]
        pairs = np.array([[made[1:], kept[1:]]])[0, :, :, 1:].astype(float)
        if path == PATHS:
            pairs = pairs[:, pairs[0, :, 0] < 0.19]
        np.testing.assert_allclose(*pairs, rtol=0, atol=1e-3)


def check(found: dict[str, Any], accuracy: float) -> None:
    """Means are near the truth, which lies near or in the intervals."""
    right = [1 - abs(one["mean"] / PLAY[name] - 1) for name, one in found["parameters"].items()]
    assert list(found["parameters"]) == list(PLAY)
    assert np.mean(right) > accuracy
    for name, one in found["parameters"].items():
        low, high = one["interval"]
        assert low < one["mean"] < high
        assert abs(one["mean"] - PLAY[name]) < 3.5 * one["deviation"]
        assert one["identifiable"]
    assert np.shape(found["correlation"]) == (3, 3)


def test_estimate_at_rest() -> None:
    """The example's readings tell its clearances to a hundredth, with intervals that hold them."""
    found = json.loads(armwright("clearance", "estimate", "five-bar", REST, "--json").stdout)

    assert found["method"] == "rest"
    check(found, 0.99)
    assert found["notes"][0].startswith("4 poses, 40 readings; ")


def test_table_of_an_estimate() -> None:
    """A person gets millimetres, what is told, and how the clearances lean against one another."""
    done = armwright("clearance", "estimate", "five-bar", REST, "--noise-um", "20", columns=120)

    assert done.returncode == 0, done.stderr
    lines = {line.split()[0]: line for line in done.stdout.splitlines() if line.strip()}
    assert "90 % interval mm" in lines["pin"]
    assert "identifiable" in lines["pin"]
    mean, deviation = (float(x) for x in lines["J4"].split()[1:3])
    assert mean == pytest.approx(0.483, abs=0.01)
    # 20 µm, ten readings: some 2 to 10 µm.
    assert 0.001 < deviation < 0.01
    assert " yes " in lines["J4"]
    # 0.483 mm of play and a coefficient of 0.05.
    assert "friction (0.05) may hold a journal 24 µm to either side" in done.stdout


def test_estimate_on_paths(folder: Path) -> None:
    """The example's runs tell its clearances through a sweep of 64 simulations, and the model fits."""
    done = armwright("clearance", "estimate", "five-bar", PATHS, "--sweep", folder, "--noise-um", "2", "--json")

    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["method"] == "paths"
    check(found, 0.985)
    assert found["notes"][0] == "15 features of 3 paths, learnt from 64 simulations"
    assert found["notes"][1].startswith("predictable until, in half of the simulations: y1 0.2")
    assert found["random_features"] == []
    assert set(found["predictable_until"]) == {"y1", "y3", "y7"}


def test_interrupted_sweep(tmp_path: Path) -> None:
    """Who stops a sweep by Ctrl-C is told that what is finished is kept, and how it goes on."""
    few = ("--paths", "y1", "--replicates", "0")
    command = ["clearance", "sweep", "five-bar", *few, "--workers", "1", "-n", "65536", "-o", "out"]
    with subprocess.Popen(
        [sys.executable, "-m", "armwright", *command], cwd=tmp_path, stderr=subprocess.PIPE, text=True
    ) as running:
        while not list(tmp_path.glob("out/blocks/???????.npy")) and running.poll() is None:
            time.sleep(0.1)
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=300)

    assert running.returncode == 130
    kept = "finished runs are stored in 'out'; the same command resumes the sweep"
    assert said == f"armwright: interrupted; {kept}\n"
    assert list(tmp_path.glob("out/blocks/???????.npy"))


def test_sweep_goes_on(folder: Path) -> None:
    """The same command again finds all there; another design in that folder is refused, and nothing is lost."""
    arguments = ("clearance", "sweep", "five-bar", *CENTRE, "--workers", "1", "-o", folder)
    before = (folder / "results.nc").read_bytes()

    again = armwright(*arguments, "-n", "64", "--json")
    other = armwright(*arguments, "-n", "32")

    told = json.loads(again.stdout)
    chaos = told.pop("chaos")
    assert told == {"runs": 64, "failed": 0, "paths": ["y1", "y3", "y7"], "folder": str(folder)}
    assert all(0.2 < one["earliest"] <= one["until"] < 0.25 and one["chance"] == [] for one in chaos.values())
    assert other.returncode == 3
    assert "contains another sweep: design.runs is 64 in the folder, 32 here" in other.stderr
    assert (folder / "results.nc").read_bytes() == before


def test_damaged_sweep(folder: Path, tmp_path: Path) -> None:
    """Whoever reads a sweep back names the file that is damaged, with status 4; it is not changed."""
    swept = tmp_path / "swept"
    shutil.copytree(folder, swept)
    results, block = swept / "results.nc", swept / "blocks" / "0000000.npy"
    results.write_bytes(results.read_bytes()[:-1] + b"x")
    block.write_bytes(b"")
    sweep = ("clearance", "sweep", "five-bar", *CENTRE, "--workers", "1", "-n", "64", "-o", swept)

    learnt = armwright("clearance", "estimate", "five-bar", PATHS, "--sweep", swept, "--noise-um", "2")
    again = armwright(*sweep)
    results.unlink()
    anew = armwright(*sweep, "--json")

    assert [done.returncode for done in (learnt, again, anew)] == [4, 4, 4]
    assert f"armwright: {results}: damaged: its checksum does not match run.json; it is not changed" in learnt.stderr
    assert f"{results}: damaged" in again.stderr
    assert json.loads(anew.stdout)["error"]["file"] == str(block)
    assert block.read_bytes() == b""


def test_factorial_with_friction(tmp_path: Path) -> None:
    """Two levels of three clearances and of friction are sixteen runs; quiet, nothing is said."""
    from armwright.sweep.results import load

    options = ("--design", "factorial", "--levels", "2", "--to-friction", "0.1", "--paths", "y1", "--quiet")
    done = armwright("clearance", "sweep", "five-bar", *CENTRE, *options, "--workers", "1", "-o", tmp_path / "out")

    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    with load(tmp_path / "out") as data:
        assert data.sizes["run"] == 16
        assert np.unique(data.friction).tolist() == [0.0, 0.1]
        assert np.unique(data.c_J3).tolist() == [1e-4, 5e-4]
        assert data.c_J3.attrs["units"] == "m"
        assert data.y1_slope_spread.attrs["units"] == "m/s"
        assert data.y1_until.attrs["units"] == "s"


def test_correct(tmp_path: Path) -> None:
    """A corrected pick and place misses its targets by a hundredth of before; path, numbers and figure are written."""
    done = armwright(
        "clearance", "correct", "five-bar", *CLEARANCES, *CENTRE, "--rounds", "1", "-o", tmp_path / "out", "--json"
    )

    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["clearances"] == pytest.approx(PLAY)
    assert np.mean(found["before"]) == pytest.approx(0.559e-3, rel=0.01)
    assert np.mean(found["after"]) < 5e-6
    assert len(found["mean_errors"]) == 2
    assert (found["runs"], found["sampling"]) == (16, "indistinguishable clearances")
    assert max(found["after_spread"][:2]) < 1e-8
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"path.csv", "summary.json", "paths.svg", "run.json"}
    assert json.loads((tmp_path / "out" / "summary.json").read_text()) == found
    table = np.genfromtxt(tmp_path / "out" / "path.csv", delimiter=",", names=True)
    np.testing.assert_allclose([table["x_mm"][0], table["y_mm"][0]], np.array(found["nodes"][0]) * 1e3, rtol=1e-8)
    assert (table["vx_mm_per_s"][[0, -1]] == 0).all()
    assert ET.parse(tmp_path / "out" / "paths.svg").getroot().tag.endswith("svg")


def test_correct_a_whole_path() -> None:
    """A whole path is moved at as many places as are asked for, each with its error before and after."""
    done = armwright("clearance", "correct", "five-bar", "--path", "y1", "--knots", "6", "--rounds", "1", *CENTRE)

    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert [line.startswith("mean error ") for line in lines[:2]] == [True, True]
    assert float(lines[1].split()[2]) < 0.3 * float(lines[0].split()[2])
    rows = [line.split() for line in lines if len(line.split()) == 7 and line.split()[0][0].isdigit()]
    assert [float(row[0]) for row in rows] == pytest.approx([0.0, 0.05, 0.1, 0.15, 0.2, 0.25])


@pytest.mark.parametrize("text", ["[" * 100_000, '{"misfit": 1}', "NaN", "1e300", "Infinity"])
def test_estimates_that_are_none(text: str, tmp_path: Path) -> None:
    """A file that is no estimate, or has numbers that no clearance has, is named."""
    pin = '{"mean": %s, "deviation": 1e-6, "identifiable": true}' % (text if len(text) < 9 else "0")
    pins = f'"J2": {pin}, "J3": {pin}, "J4": {pin}'
    whole = f'{{"misfit": 1, "correlation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "parameters": {{{pins}}}}}'
    (tmp_path / "estimate.json").write_text(whole if len(text) < 9 else text, encoding="utf-8")

    done = armwright("clearance", "correct", "five-bar", "--estimate", tmp_path / "estimate.json")

    assert done.returncode == 4
    assert "expected the output of `armwright clearance estimate --json` for five-bar" in done.stderr


MISTAKES = [
    (("sweep", "five-bar", "--paths", "y15"), "no test path 'y15'. Did you mean 'y1'?"),
    (("sweep", "five-bar", "--paths", "pick-and-place"), "no test path 'pick-and-place'"),
    (("sweep", "five-bar", "--design", "lsh"), "'lsh' is not one of 'factorial', 'lhs', 'sobol'"),
    (("sweep", "five-bar", "--design", "factorial", "--levels", "1"), "levels: expected an integer of at least"),
    (("sweep", "five-bar", "--design", "factorial", "--from-mm", "0"), "contact needs them above 0, got 0 mm"),
    (("sweep", "five-bar", "-n", "100"), "a Sobol design needs a power of two of points, got 100"),
    (("sweep", "five-bar", "--from-mm", "0.5", "--to-mm", "0.1"), "bounds of c_J2: they are reversed"),
    (("sweep", "five-bar", "--step", "1e-3"), "step: 0.001 s is too long for contacts of "),
    (("sweep", "five-bar", "--replicates", "16"), "replicates: expected 0 to 15, got 16"),
    (("sweep", "four-bar"), "four-bar: with its pins closed it has 1 freedom"),
    (("sweep", "five-bra"), "no linkage 'five-bra'. Did you mean 'five-bar'?"),
    (("estimate", "five-bar", "none.csv"), "none.csv: no such file"),
    (("estimate", "five-bar", PATHS), "measurements on paths need a sweep to compare with"),
    (("estimate", "five-bar", PATHS, "--sweep", "SWEEP"), "--noise-um: expected the standard deviation"),
    (("estimate", "five-bar", PATHS, "--sweep", "none", "--noise-um", "2"), "'none': the sweep does not exist"),
    (("estimate", "five-bar", "x2.csv", "--sweep", "SWEEP", "--noise-um", "2"), "the sweep has no path x2; sweep the"),
    (("estimate", "five-bar", REST, "--noise-um", "-1"), "noise: expected more than 0 m, got -1e-06"),
    (("estimate", "slider-crank", REST), "slider-crank: with its pins closed it has 1 freedom"),
    (("correct", "five-bar", "--path", "y99"), "no path 'y99'. Did you mean 'y9'?"),
    (("correct", "five-bar", "--clearance", "J7=0.3"), "no pin 'J7'. Known: J2, J3, J4."),
    (("correct", "five-bar", "--clearance", "J2=x"), "expected a pin and its clearance in mm"),
    (("correct", "five-bar", "--clearance", "J2=0"), "clearances: contact needs them above 0, got 0 mm"),
    (("correct", "five-bar", "--path", "y1", "--knots", "1"), "knots: expected 2 to 1000, got 1"),
    (("correct", "five-bar", "--friction-velocity", "center"), "no sliding speed 'center'. Did you mean 'centre'?"),
]  # fmt: skip


@pytest.fixture(scope="module")
def answers(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> list[tuple[int, str]]:
    """Status and error output of all mistakes."""
    place = tmp_path_factory.mktemp("mistakes")
    text = PATHS.read_text(encoding="utf-8").splitlines()
    seconds = np.linspace(0.0, 0.29, 30)
    from armwright.clearance.paths import named_path

    places = named_path("x2").evaluate(seconds).position * 1e3
    rows = [f"x2,{t:.4f},{x:.4f},{y:.4f}" for t, (x, y) in zip(seconds, places, strict=True)]
    (place / "x2.csv").write_text("\n".join([text[0], *rows]) + "\n", encoding="utf-8")
    calls = [
        [str(folder) if part == "SWEEP" else str(part) for part in arguments]
        + (["--quiet", "-o", str(place / f"out{i}")] if arguments[0] == "sweep" else [])
        for i, (arguments, _) in enumerate(MISTAKES)
    ]
    done = [armwright("clearance", *call, cwd=place) for call in calls]
    assert {path.name for path in place.iterdir()} == {"x2.csv"}
    return [(one.returncode, one.stderr) for one in done]


@pytest.mark.parametrize("number", range(len(MISTAKES)), ids=[" ".join(map(str, one[0][:1])) for one in MISTAKES])
def test_mistakes(number: int, answers: list[tuple[int, str]]) -> None:
    """A mistake gets one message that says what to do, no traceback, and leaves no folder behind."""
    status, said = answers[number]

    assert status in (2, 3, 4)
    words = " ".join(said.replace("│", " ").split())
    assert MISTAKES[number][1] in words
    assert "Traceback" not in said


@pytest.mark.parametrize("command", ["sweep", "estimate", "correct"])
def test_help(command: str) -> None:
    """The help of each command has an example in it."""
    done = armwright("clearance", command, "--help", columns=120)

    assert done.returncode == 0
    assert f"armwright clearance {command} five-bar" in done.stdout


def test_help_is_quick() -> None:
    """Until a command works neither NumPy nor Numba nor matplotlib is loaded: they take longer than the help may."""
    code = (
        "import armwright.cli.clearance, sys; print(sorted({'numpy', 'numba', 'sklearn', 'scipy'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert done.stdout == "[]\n"
