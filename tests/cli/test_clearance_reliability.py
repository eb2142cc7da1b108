"""``armwright clearance reliability`` from the outside."""

import json
from pathlib import Path

import pytest

from cli_calls import armwright, check_mistake

AT = ("five-bar", "--pose", "-180,-600", "--samples", "20")
SMALL = ("four-bar", "--speed-rpm", "600", "--poses", "3", "--samples", "20")


def test_probability_at_a_pose() -> None:
    """At one pose it is the exact law, beside that of linkages in equilibrium."""
    clearances = ("--clearance", "J2=0.328", "--clearance", "J3=0.171", "--clearance", "J4=0.483")
    done = armwright("clearance", "reliability", *AT, *clearances, "--limit", "0.6", "--json")
    data = json.loads(done.stdout)
    assert data["poses"][0]["probability"] == pytest.approx(0.0388, abs=3e-4)
    assert data["on_path"]["probability"] == pytest.approx(data["poses"][0]["probability"], rel=0.05)
    assert data["sampled"]["nonlinearity"] < 1e-3
    assert data["lives"] == []


def test_friction_and_other_dimensions() -> None:
    """Friction in the pins, lengths and zeros have their shares."""
    others = ("--sd", "link2.length=0.01", "--sd", "link1.zero=0.002deg", "--friction", "--samples", "2")
    done = armwright("clearance", "reliability", "five-bar", "--pose", "-180,-600", "--limit", "1.1", *others)
    assert "link1.zero" in done.stdout
    assert "J4 friction" in done.stdout


def test_life_of_the_four_bar(tmp_path: Path) -> None:
    """A life has its B10 with an interval, and a page with curves."""
    file = tmp_path / "measured.csv"
    file.write_text("strokes,measure,value_mm,standard_error_mm\n1e6,B,0.501,0.001\n", encoding="utf-8")
    wear = ("--k", "1e-5", "--arc-rad", "1", "--limit", "3")
    done = armwright(
        "clearance", "reliability", *SMALL, *wear, "--measurements", str(file), "--json", "-o", str(tmp_path / "out")
    )

    data = json.loads(done.stdout)
    assert data["measurements"] == 1
    b10 = data["lives"][0]["strokes"]["0.1"]
    assert b10["interval"][0] < b10["value"] < b10["interval"][1]
    assert data["lives"][0]["pins"] == {"B": pytest.approx(1)}
    files = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"report.html", "reliability.json", "life-error.csv", "failure-error.svg", "growth-error.svg"} <= files


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (AT, "expected a limit of the error"),
        (("five-bar", "--limit", "0.6"), "expected poses"),
        ((*AT, "--limit", "0.6", "--k", "1e-5"), "wear needs the path"),
        ((*AT, "--limit", "0.6", "--limit-rp", "0.1"), "need the wear coefficient"),
        ((*AT, "--limit", "0.6", "--sd", "link2.lenght=1"), "link2.length"),
        ((*AT, "--limit", "0.6", "--sd", "link1.zero=1mm"), "expected deg, got mm"),
        ((*AT, "--limit", "0.6", "--estimate", "none.json"), "none.json"),
        ((*AT, "--limit", "0"), "limit: expected more than 0"),
        ((*SMALL, "--k", "1e-5"), "a life needs a limit"),
        (("five-bar", "--pose", "0,9000", "--limit", "1"), "cannot be followed"),
    ],
)
def test_what_is_wrong(options: tuple[str, ...], message: str, tmp_path: Path) -> None:
    """What has no probability gives one clear error."""
    check_mistake("clearance", "reliability", *options, said=message, folder=tmp_path)
