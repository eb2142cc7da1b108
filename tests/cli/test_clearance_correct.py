"""``armwright clearance correct`` as a user calls it."""

import json
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from armwright.report.elements import length_text
from cli_calls import armwright, check_mistake
from five_bar_example import CENTRE, PLAY

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

CLEARANCES = [part for name, c in PLAY.items() for part in ("--clearance", f"{name}={c * 1e3:g}")]
ESTIMATE = {
    "parameters": {
        "J2": {"mean": 3e-4, "deviation": 1e-6, "identifiable": True},
        "J3": {"mean": 2e-4, "deviation": 1e-6, "identifiable": True},
        "J4": {"mean": 4e-4, "deviation": 1e-6, "identifiable": True},
    },
    "misfit": 0.4,
    "correlation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
}
# Thirty-two draws with a deviation of a micrometre lie so near to their mean [m].
DRAWN = 1e-6


@pytest.fixture
def estimate(tmp_path: Path) -> Path:
    """A file as ``clearance estimate --json`` prints it."""
    file = tmp_path / "estimate.json"
    file.write_text(json.dumps(ESTIMATE))
    return file


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
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "path.csv",
        "summary.json",
        "paths.svg",
        "report.html",
        "run.json",
    }
    assert json.loads((tmp_path / "out" / "summary.json").read_text()) == found
    table = np.genfromtxt(tmp_path / "out" / "path.csv", delimiter=",", names=True)
    np.testing.assert_allclose([table["x_mm"][0], table["y_mm"][0]], np.array(found["nodes"][0]) * 1e3, rtol=1e-8)
    assert (table["vx_mm_per_s"][[0, -1]] == 0).all()
    assert ET.parse(tmp_path / "out" / "paths.svg").getroot().tag.endswith("svg")
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    before, after = (length_text(np.mean(found[name])) for name in ("before", "after"))
    assert re.findall(r'<li class="figure"><b>([^<]*)</b>', page)[:2] == [before, f"→ {after}"]
    assert set(re.findall(r'<a href="([^"]*)" download>', page)) == {"path.csv", "summary.json", "paths.svg"}


def test_correct_a_whole_path(estimate: Path, tmp_path: Path) -> None:
    """A whole path is moved at as many places as are asked for, each with its error before and after.

    It is corrected for the play that was estimated, and the summary names this, not that of the catalogue.
    """
    folder, options = tmp_path / "out", ("--path", "y1", "--knots", "6", "--rounds", "1", *CENTRE)
    done = armwright("clearance", "correct", "five-bar", *options, "--estimate", estimate, "-o", folder)

    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert [line.startswith("mean error ") for line in lines[:2]] == [True, True]
    assert float(lines[1].split()[2]) < 0.3 * float(lines[0].split()[2])
    rows = [line.split() for line in lines if len(line.split()) == 7 and line.split()[0][0].isdigit()]
    assert [float(row[0]) for row in rows] == pytest.approx([0.0, 0.05, 0.1, 0.15, 0.2, 0.25])
    told = json.loads((folder / "summary.json").read_text())
    means = {name: one["mean"] for name, one in ESTIMATE["parameters"].items()}  # type: ignore[attr-defined]
    assert told["clearances"] == pytest.approx(means, abs=DRAWN)
    assert {file.name for file in folder.iterdir()} == {
        "path.csv",
        "summary.json",
        "paths.svg",
        "report.html",
        "run.json",
    }


def test_no_path_for_a_contradiction(estimate: Path) -> None:
    """What contradicts its model, or is not told, is nothing to correct a path for: the status is 3."""
    estimate.write_text(json.dumps(ESTIMATE | {"misfit": 1e-9}))
    wrong = armwright("clearance", "correct", "five-bar", "--estimate", estimate)
    parameters = {**ESTIMATE["parameters"], "J3": {"mean": 2e-4, "deviation": 1e-4, "identifiable": False}}  # type: ignore[dict-item]
    estimate.write_text(json.dumps(ESTIMATE | {"parameters": parameters}))
    unknown = armwright("clearance", "correct", "five-bar", "--estimate", estimate)

    assert wrong.returncode == 3
    assert "the data contradict the model" in wrong.stderr
    assert unknown.returncode == 3
    assert "the measurement does not identify J3" in unknown.stderr


def test_clearances_and_an_estimate(estimate: Path) -> None:
    """Clearances are given, or those of an estimate; both at once is a slip."""
    done = armwright("clearance", "correct", "five-bar", "--estimate", estimate, "--clearance", "J2=0.1")

    assert done.returncode == 2
    assert "give either --clearance or --estimate" in done.stderr


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


def test_matrix_that_does_not_fit(estimate: Path) -> None:
    """A correlation of two pins is none of three."""
    estimate.write_text(json.dumps(ESTIMATE | {"correlation": [[1, 0], [0, 1]]}))
    done = armwright("clearance", "correct", "five-bar", "--estimate", estimate)

    assert done.returncode == 4
    assert "expected the output of `armwright clearance estimate --json` for five-bar" in done.stderr


MISTAKES = [
    (("correct", "five-bar", "--path", "y99"), "no path 'y99'. Did you mean 'y9'?"),
    (("correct", "five-bar", "--clearance", "J7=0.3"), "no pin 'J7'. Known: J2, J3, J4."),
    (("correct", "five-bar", "--clearance", "J2=x"), "expected a pin and its clearance in mm"),
    (("correct", "five-bar", "--clearance", "J2=0"), "clearances: contact needs them above 0, got 0 mm"),
    (("correct", "five-bar", "--path", "y1", "--knots", "1"), "knots: expected 2 to 1000, got 1"),
    (("correct", "five-bar", "--friction-velocity", "center"), "'center' is not one of 'surface', 'centre'"),
    (("correct", "five-bar", "--rounds", "-1"), "rounds: expected 0 to 100, got -1"),
    (("correct", "five-bar", "--rounds", str(10**30)), "rounds: expected 0 to 100, got 1000"),
    (("correct", "five-bar", "--estimate", "nowhere.json"), "nowhere.json: no such file"),
    (("correct", "four-bar"), "with its pins closed it has 1 freedom, and a position of the tip fixes 2"),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "said"), MISTAKES)
def test_mistakes(arguments: tuple[str | Path, ...], said: str, tmp_path: Path) -> None:
    """A mistake gets one message that says what to do, no traceback, and leaves no folder behind."""
    check_mistake("clearance", *arguments, said=said, folder=tmp_path)


def test_help() -> None:
    """The help of the command has an example in it."""
    done = armwright("clearance", "correct", "--help", columns=120)

    assert done.returncode == 0
    assert "armwright clearance correct five-bar" in done.stdout
