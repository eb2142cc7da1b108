"""The command vibration: its tables, its JSON and its files."""

import json
from pathlib import Path

import numpy as np
import pytest

from cli_calls import armwright

EXAMPLES = Path(__file__).parents[2] / "examples"
TWO_LINKS = EXAMPLES / "two_link_springs.toml"


def test_of_one_configuration() -> None:
    """An arm file with gears, a load and a force need no other option."""
    bare = json.loads(armwright("vibration", TWO_LINKS, "-q", "57.3,68.75", "--json").stdout)
    done = armwright("vibration", TWO_LINKS, "-q", "57.3,68.75", "--load", "2,0,0,0", "--force", "0,-50,0", "--json")
    (before,), (after,) = bare["configurations"], json.loads(done.stdout)["configurations"]

    assert before["frequencies_hz"] == pytest.approx([7.4, 19.2], abs=0.05)
    assert after["frequencies_hz"][0] < before["frequencies_hz"][0]
    assert np.linalg.norm(after["deflection_at_rest_m"]) > np.linalg.norm(before["deflection_at_rest_m"])


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize("arm", ["puma560", "ur5"])
def test_of_a_motion(arm: str, tmp_path: Path) -> None:
    """Arms of the catalogue with gears by option have a page with three figures along a motion."""
    t = np.linspace(0, 1, 5)[:, None]
    q = np.array([0, -0.9, 0.8, 0.1, 0.6, 0]) + 0.3 * t**2
    values = np.hstack([q, np.broadcast_to(0.6 * t, q.shape), np.full_like(q, 0.6)])
    names = [f"{name}{i}" for name in ("q", "qd", "qdd") for i in range(1, 7)]
    rows = [",".join(names), *(",".join(map(str, row)) for row in values.tolist())]
    (tmp_path / "motion.csv").write_text("\n".join(rows), encoding="utf-8")

    done = armwright(
        "vibration", arm, "motion.csv", "--stiffness", "5e4,5e4,3e4,inf,inf,inf", "--damping", "20", "-o", "out",
        cwd=tmp_path, columns=120,
    )  # fmt: skip

    names = {"report.html", "vibration.json", "run.json", "shapes.svg", "frequencies.svg", "deflection.svg"}
    modes = {f"mode-{i}.svg" for i in range(1, 4)}
    assert {path.name for path in (tmp_path / "out").iterdir()} == names | modes
    assert "deflection in motion, mm" in done.stdout
    assert "Rigid gears: joint 4" in " ".join(done.stdout.split())


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((TWO_LINKS,), "expected the configurations, either one as -q or a motion as a table"),
        (("ur5", "-q", "0,0,0,0,0,0"), "specify stiffness_Nm_per_rad in [joint.motor] of its file, or --stiffness"),
        ((TWO_LINKS, "-q", "0,0", "--stiffness", "1,2,3"), "expected one number, or 2, one per joint, got 3"),
        ((TWO_LINKS, "-q", "0,0", "--stiffness", "0"), "expected 0.001 to 1e+12, got 0"),
        ((TWO_LINKS, "-q", "0,0", "--damping", "-1"), "expected 0 to 1e+12, got -1"),
    ],
)
def test_usage(arguments: tuple[str, ...], said: str) -> None:
    """What is missing or out of range is said."""
    done = armwright("vibration", *arguments)
    assert done.returncode
    assert said in " ".join(done.stderr.replace("│", " ").split())
