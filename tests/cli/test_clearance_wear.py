"""``armwright clearance wear`` from the outside."""

import json
from pathlib import Path

import pytest

from cli_calls import armwright, check_mistake

SMALL = ("four-bar", "--speed-rpm", "600", "--k", "1e-5", "--steps", "1")


def test_wear_of_the_four_bar(tmp_path: Path) -> None:
    """A life has balanced volumes, growing depths, a page with profiles, and quantiles of the strokes to a limit."""
    done = armwright("clearance", "wear", *SMALL, "--limit-ap", "0.001", "--json", "-o", str(tmp_path / "worn"))

    data = json.loads(done.stdout)
    assert data["volume_imbalance"] < 1e-12
    assert [pin["pin"] for pin in data["pins"]] == ["B"]
    # The new linkage is beyond such a limit.
    assert data["lives"][0]["strokes"] == {"5 %": 0.0, "50 %": 0.0, "95 %": 0.0}
    files = {path.name for path in (tmp_path / "worn").iterdir()}
    assert {"report.html", "wear.json", "life.csv", "profiles.csv", "profiles.svg", "life.svg"} <= files
    new, worn = data["simulated"]
    assert (new["strokes"], worn["strokes"]) == (0.0, data["strokes"][-1])

    # The worn pins are those of a simulation.
    run = armwright(
        "clearance", "simulate", *SMALL[:3], "--revolutions", "0.2", "--worn", str(tmp_path / "worn" / "wear.json"),
        "--strokes", "1e3", "--json",
    )  # fmt: skip
    told = json.loads(run.stdout)
    assert told["worn_strokes"] == 1e3
    assert 0 < told["pins"]["B"]["wall_growth"] < data["pins"][0]["bearing_depth"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("five-bar", "--path", "y1", "--k", "0"), "wear coefficient: expected 1e-15 to 1e+09"),
        (("five-bar", "--k", "1e-5"), "expected either --path or --speed-rpm"),
        ((*SMALL, "--bearing-share", "2"), "bearing share: expected 0 to 1, got 2"),
    ],
)
def test_what_is_wrong(options: tuple[str, ...], message: str, tmp_path: Path) -> None:
    """What cannot be worn gives one clear error."""
    check_mistake("clearance", "wear", *options, said=message, folder=tmp_path)
