"""``armwright clearance compare`` as a user calls it."""

import json
from pathlib import Path

from cli_calls import armwright, check_mistake


def test_smaller_clearances_are_better(tmp_path: Path) -> None:
    """With half of all clearances the errors are half as large everywhere; the map and its table are written."""
    half = [part for name in ("J2", "J3", "J4") for part in ("--other-clearance", f"{name}=0.25")]
    done = armwright(
        "clearance", "compare", "five-bar", "five-bar", *half, "--cells", "8", "--json", "-o", tmp_path / "out"
    )

    data = json.loads(done.stdout)
    assert data["second_better"] == 1.0
    assert abs(data["errors"][1]["mean"] / data["errors"][0]["mean"] - 0.5) < 0.01
    assert {"report.html", "map.csv", "map.svg", "compare.json"} <= {path.name for path in (tmp_path / "out").iterdir()}


def test_what_cannot_be_compared(tmp_path: Path) -> None:
    """Only five-bars are compared."""
    check_mistake("clearance", "compare", "five-bar", "four-bar", said="is no five-bar", folder=tmp_path)
