"""``armwright clearance vibration`` from the outside."""

import json
from pathlib import Path

import pytest

from cli_calls import armwright, check_mistake

FIVE_BAR = ("five-bar", "--path", "y1")


def test_vibration_of_one_path(tmp_path: Path) -> None:
    """Of one path there are the numbers of each pin, the modes along it, and a page where they swing."""
    done = armwright("clearance", "vibration", "four-bar", "--speed-rpm", "6000", "--json", "-o", str(tmp_path / "out"))

    data = json.loads(done.stdout)
    (path,) = data["paths"]
    assert set(path["pins"]) == {"B"}
    assert path["loss"]["mean"] > 0
    assert len(data["modes"]["frequencies"][0]) == 2
    assert data["aim"] is None
    page = (tmp_path / "out/report.html").read_text()
    assert page.count("<animate ") >= 4
    assert {f"mode-{i}.svg" for i in (1, 2)} <= {one.name for one in (tmp_path / "out").iterdir()}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((*FIVE_BAR, "--by", "los"), "no quantity 'los'. Did you mean 'loss'?"),
        ((*FIVE_BAR, "--path", "x1", "--aim"), "expected a single --path, got 2 paths"),
        ((*FIVE_BAR, "--path", "y1"), "expected each path once"),
        (("slider-crank",), "use --speed-rpm"),
    ],
)
def test_what_is_wrong(options: tuple[str, ...], message: str, tmp_path: Path) -> None:
    """What cannot be measured gives one clear error."""
    check_mistake("clearance", "vibration", *options, said=message, folder=tmp_path)
