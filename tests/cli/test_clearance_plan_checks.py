"""``armwright clearance plan-checks`` from the outside."""

import json
from pathlib import Path

import pytest

from cli_calls import armwright, check_mistake

CHECKS = str(Path(__file__).parents[2] / "examples" / "five_bar_checks.csv")
NEW = ("--clearance", "J2=0.1", "--clearance", "J3=0.1", "--clearance", "J4=0.1")
BAR = ("five-bar", "--path", "pick-and-place", "--k", "1e-4", "--limit", "0.1", *NEW)
SMALL = ("--horizon", "1e7", "--lives", "2", "--json")


def test_plan_after_two_checks(tmp_path: Path) -> None:
    """What two checks of a known life tell holds its wear coefficients; the page shows when the third is due."""
    done = armwright(
        "clearance", "plan-checks", *BAR, *SMALL, "--measurements", CHECKS, "-o", str(tmp_path / "plan"),
        "--strokes-per-day", "20000",
    )  # fmt: skip

    data = json.loads(done.stdout)
    assert [round(known["strokes"]) for known in data["history"]] == [0, 2_600_000, 9_000_000]
    for pin, k in (("J2", 1.4e-13), ("J3", 0.9e-13), ("J4", 0.8e-13)):
        low, _, high = data["history"][-1]["wear_coefficients"][pin]
        assert low < k < high
    assert len(data["poses"]) == 3
    assert data["next_check"] is None or data["next_check"] > 9e6
    assert data["corrections"][0]["strokes"] == 9e6
    files = {path.name for path in (tmp_path / "plan").iterdir()}
    assert files >= {
        "report.html", "plan.json", "corrections.csv", "timeline.svg", "clearances.svg", "stops.svg"
    }  # fmt: skip


def test_plan_of_a_crank() -> None:
    """A linkage with a single drive has a plan for its one pin, with poses of its crank, that keeps the limit."""
    done = armwright(
        "clearance", "plan-checks", "four-bar", "--speed-rpm", "60", "--k", "1e-6", "--limit", "1.0", *SMALL
    )  # fmt: skip

    data = json.loads(done.stdout)
    assert [len(pose["drives"]) for pose in data["poses"]] == [1, 1, 1]
    assert list(data["history"][0]["clearances"]) == ["B"]
    assert data["plan"]["outside"]["mean"] < 0.05


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((*BAR, "--horizon", "1e7", "--alpha", "0.9"), "alpha: expected 0.001 to 0.5, got 0.9"),
        ((*BAR, "--horizon", "1e7", "--pin-factor", "J9=2"), "no pin 'J9'"),
        ((*BAR, "--horizon", "1e7", "--readings", "0"), "readings: expected"),
    ],
)
def test_what_is_wrong(options: tuple[str, ...], message: str, tmp_path: Path) -> None:
    """What cannot be planned gives one clear error."""
    check_mistake("clearance", "plan-checks", *options, said=message, folder=tmp_path)
