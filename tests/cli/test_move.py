"""``armwright move`` as a user calls it."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.kinematics.forward_kinematics import forward
from armwright.motion import detour
from cli_calls import armwright

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

EXAMPLES = Path(__file__).parents[2] / "examples"
POSES = EXAMPLES / "puma_poses.toml"
POST = EXAMPLES / "round_the_post.toml"
FILES = {"motion.csv", "move.json", "report.html", "joints.svg", "hand.svg", "path.svg", "run.json"}


def test_joint_move(tmp_path: Path) -> None:
    """A joint move writes its files and a film; the motion starts and ends at rest at the first and the last pose."""
    image = pytest.importorskip("PIL.Image")

    done = armwright("move", "joint", "puma560-seed", POSES, "-o", tmp_path / "out")

    assert done.returncode == 0, done.stderr
    assert {path.name for path in (tmp_path / "out").iterdir()} - {"move.mp4"} == FILES | {"move.gif"}
    with image.open(tmp_path / "out" / "move.gif") as film:
        assert film.n_frames >= 20
    assert "left, down, no-flip -> left, down, no-flip -> left, down, flip" in " ".join(done.stdout.split())
    assert "line 10: the rotation matrix of pose A is not orthonormal (error 0.00096); the nearest" in done.stderr
    assert (
        "the limits require a motion 5.81 times slower, limited by the acceleration of joint 2; --keep" in done.stderr
    )
    rows = np.loadtxt(tmp_path / "out" / "motion.csv", delimiter=",", skiprows=1)
    assert rows.shape == (501, 25)
    hand = forward(load_arm("puma560-seed"), rows[[0, -1], 1:7])[:, :3, 3]
    np.testing.assert_allclose(hand, [[0.05, -0.55, -0.6], [0.6, 0.15, -0.3]], atol=1e-9)
    np.testing.assert_allclose(rows[[0, -1], 7:13], 0, atol=1e-9)
    summary = json.loads((tmp_path / "out" / "move.json").read_text())
    assert [pose["name"] for pose in summary["poses"]] == ["A", "B", "C"]
    assert max(summary["of_limits"]["acceleration"]) == pytest.approx(5.81**2, rel=1e-2)


def test_limits_kept() -> None:
    """With --keep-limits the move runs just so much slower that no limit is passed."""
    done = armwright("move", "joint", "puma560-seed", POSES, "--keep-limits", "--json")

    found = json.loads(done.stdout)
    largest = max(max(parts) for parts in found["of_limits"].values())
    assert largest == pytest.approx(1.0, abs=1e-6)
    assert found["duration"] == pytest.approx(5.811, abs=1e-3)


def test_cartesian_move(tmp_path: Path) -> None:
    """A Cartesian move keeps the hand where it says, on one branch, and inside the limits without times."""
    done = armwright("move", "cartesian", "puma560-seed", POST, "-o", tmp_path, "--no-film", "--deviation-mm", "0.05")

    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert "certificate holds: tool within 0.0" in done.stdout
    assert (FILES - {path.name for path in tmp_path.iterdir()}) == set()
    assert not [*tmp_path.glob("move.*4"), *tmp_path.glob("*.gif")]
    summary = json.loads((tmp_path / "move.json").read_text())
    assert summary["branch"] == "left, down, no-flip"
    assert 0 < summary["certificate"]["deviation"] <= 0.05e-3
    assert summary["certificate"]["holds"]
    assert max(max(parts) for parts in summary["of_limits"].values()) <= 1 + 1e-9


def test_no_branch(tmp_path: Path) -> None:
    """Where no branch carries through it is said why, in one line and with a way out, and nothing is written."""
    done = armwright("move", "cartesian", "puma560-seed", POSES, "-o", tmp_path / "out")

    assert done.returncode == 3
    assert done.stdout == ""
    assert (
        "no single branch of the inverse kinematics can be followed to the last pose. left, down, no-flip: "
        in done.stderr
    )
    assert "between poses 2 and 3" in done.stderr
    assert done.stderr.endswith("`--around damped` and `--around via` search for a detour\n")
    assert not (tmp_path / "out").exists()


def test_the_other_way_round_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no pose beside the line helps, damped rates are named: they do, as the tutorial on two moves shows."""
    monkeypatch.setattr(detour, "_SCATTER", ())
    done = armwright("move", "cartesian", "puma560-seed", POSES, "--around", "via")

    assert done.returncode == 3
    assert "from pose 2 to pose 3: on the line near (" in done.stderr
    assert done.stderr.endswith("`--around damped` searches for another detour\n")


def test_a_servo_slower_than_the_move(tmp_path: Path) -> None:
    """With a servo period as long as the move, start and end are written, and figures drawn from the two of them."""
    done = armwright("move", "joint", "puma560-seed", POSES, "-o", tmp_path, "--no-film", "--servo-ms", "1000")

    assert done.returncode == 0, done.stderr
    assert np.loadtxt(tmp_path / "motion.csv", delimiter=",", skiprows=1).shape == (2, 25)


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (("joint", "puma56", POSES), 2, "no arm 'puma56'. Did you mean 'puma560'?"),
        (("joint", "puma560-seed", EXAMPLES / "puma_pose.toml"), 4, "no such file; did you mean "),
        (("slide", "puma560-seed", POSES), 2, "'slide' is not one of 'joint', 'cartesian'"),
        (("joint", "puma560-seed", POSES, "--orientation", "zyz"), 2, "expected a cartesian move for this option"),
        (("joint", "puma560-seed", POSES, "--near", "1,2"), 2, "expected 6 finite numbers, got 2"),
        (("joint", "puma560-seed", POSES, "--servo-ms", "0"), 2, "expected 0.01 to 1000, got 0"),
        (("cartesian", "puma560-seed", POST, "--deviation-mm", "-1"), 2, "expected 0.0001 to 100, got -1"),
        (
            ("cartesian", "puma560-seed", POST, "--around", "via", "--orientation", "zyz"),
            2,
            "rotate about a fixed axis",
        ),
    ],
)
def test_mistakes(arguments: tuple[Any, ...], status: int, said: str) -> None:
    """A mistake gets one message that says what to do, and no traceback."""
    done = armwright("move", *arguments, columns=200)

    assert done.returncode == status
    assert said in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr
