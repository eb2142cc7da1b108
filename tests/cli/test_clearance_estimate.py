"""``armwright clearance estimate`` of resting tips as a user calls it; of paths it stands beside the sweeps."""

import json
import runpy
from pathlib import Path

import numpy as np
import pytest

from armwright.clearance.estimation.measurement_file import RestMeasurement, read_clearance_measurements
from armwright.clearance.reader import load_linkage
from cli_calls import armwright, check_mistake
from five_bar_example import EXAMPLES, PATHS, REST, assert_clearances_found

pytest.importorskip("sklearn")


def test_example_files_are_those_of_their_script() -> None:
    """The example's files are those of its script; its runs up to the impacts, which processors round differently."""
    texts = runpy.run_path(str(EXAMPLES / "five_bar.py"))["texts"]()

    assert set(texts) == {REST.name, PATHS.name}
    for path in (REST, PATHS):
        made, kept = ([line.split(",") for line in text.splitlines()] for text in (texts[path.name], path.read_text()))
        assert [row[0] for row in made] == [row[0] for row in kept]
        pairs = np.array([[made[1:], kept[1:]]])[0, :, :, 1:].astype(float)
        if path == PATHS:
            pairs = pairs[:, pairs[0, :, 0] < 0.19]
        np.testing.assert_allclose(*pairs, rtol=0, atol=1e-3)


def test_estimate_at_rest() -> None:
    """The example's readings tell its clearances to a hundredth, with intervals that hold them."""
    found = json.loads(armwright("clearance", "estimate", "five-bar", REST, "--json").stdout)

    assert found["method"] == "rest"
    assert_clearances_found(found, 0.99)
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
    assert "friction (0.05) holds each journal anywhere within its cone, up to 24 µm to either side" in done.stdout


def test_estimate_refuses_a_contradiction(tmp_path: Path) -> None:
    """Columns that are swapped end with status 3, what is far off, and no number for a clearance."""
    head, *rows = REST.read_text().strip().splitlines()
    cells = [row.split(",") for row in rows]
    off = [(float(x) - float(a), float(y) - float(b)) for _, a, b, x, y in cells]
    turned = [f"{p},{a},{b},{float(a) + v},{float(b) + u}" for (p, a, b, _, _), (u, v) in zip(cells, off, strict=True)]
    (tmp_path / "turned.csv").write_text("\n".join([head, *turned, ""]))

    done = armwright("clearance", "estimate", "five-bar", tmp_path / "turned.csv")

    assert done.returncode == 3
    assert "the data contradict the model: no clearances explain them" in done.stderr
    assert done.stdout == ""


def test_friction_widens_intervals() -> None:
    """The more friction there is, the wider are the intervals."""
    linkage, measured = load_linkage("five-bar"), read_clearance_measurements(REST)
    assert isinstance(measured, RestMeasurement)

    deviations = [measured.estimate(linkage, friction=mu).deviations for mu in (0.0, 0.05, 0.12)]

    assert np.all(np.diff(deviations, axis=0) > 0)


MISTAKES = [
    (("estimate", "five-bar", REST, "--friction", "-1"), "friction: expected 0 or more, got -1"),
    (("estimate", "five-bar", PATHS, "--friction", "0.1"), "on paths friction is that of the sweep"),
    (("estimate", "five-bar", "none.csv"), "none.csv: no such file"),
    (("estimate", "five-bar", PATHS), "measurements on paths need a sweep to compare with"),
    (("estimate", "five-bar", PATHS, "--sweep", "none", "--noise-um", "2"), "'none': the sweep does not exist"),
    (("estimate", "five-bar", REST, "--noise-um", "-1"), "noise: expected more than 0 m, got -1e-06"),
    (("estimate", "slider-crank", REST), "slider-crank: with its pins closed it has 1 freedom"),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "said"), MISTAKES)
def test_mistakes(arguments: tuple[str | Path, ...], said: str, tmp_path: Path) -> None:
    """A mistake gets one message that says what to do, no traceback, and leaves no folder behind."""
    check_mistake("clearance", *arguments, said=said, folder=tmp_path)


def test_help() -> None:
    """The help of the command has an example in it."""
    done = armwright("clearance", "estimate", "--help", columns=120)

    assert done.returncode == 0
    assert "armwright clearance estimate five-bar" in done.stdout
