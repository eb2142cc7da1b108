"""The table [trials] of a cell file: what is read, and what is refused."""

from math import radians
from pathlib import Path

import pytest

from armwright.cell.reader import read_cell
from armwright.errors import FileFormatError

CELL = """[arms.ARM_1]
model = "stanford"
hand = [1,0,0, 0,-1,0, 0,0,-1, 0.45, 0.0, 0.25]
[frames]
HOME = [1,0,0, 0,1,0, 0,0,1, 0.5, 0, 0.03]
[scene]
markers = [{ name = "SLOT", id = 7, size_mm = 60, at = [1,0,0, 0,1,0, 0,0,1, 0.5, 0.2, 0.03] }]
[parts.BLOCK]
size_mm = [40, 40, 40]
mass_kg = 0.2
at = [1,0,0, 0,1,0, 0,0,1, 0.5, -0.2, 0.05]
[trials]
"""
GOOD = """friction = [0.4, 1.0]
mass_pct = 20
pose = { BLOCK = { xy_mm = 150, yaw_deg = 180 }, SLOT = { xy_mm = 5 } }
goal = { block = { at = "slot", mm = 2, deg = 3 } }
noise = { pixels = [0, 3], force_N = [0.1, 0.2], effort_pct = [1, 2] }
"""


def _read(folder: Path, text: str) -> object:
    path = folder / "cell.toml"
    path.write_text(CELL + text, encoding="utf-8")
    return read_cell(path).trials


def test_all_keys_are_read(tmp_path: Path) -> None:
    trials = _read(tmp_path, GOOD)
    assert trials.friction == (0.4, 1.0)
    assert trials.mass == pytest.approx(0.2)
    assert trials.poses["BLOCK"].position == pytest.approx(0.15)
    assert trials.poses["BLOCK"].yaw == pytest.approx(radians(180))
    assert trials.poses["SLOT"].yaw == 0.0
    goal = trials.goals["BLOCK"]
    assert (goal.at, goal.distance, goal.angle) == ("SLOT", pytest.approx(2e-3), pytest.approx(radians(3)))
    assert trials.noise.pixels == (0.0, 3.0)
    assert trials.noise.effort == pytest.approx((0.01, 0.02))


def test_without_the_table_nothing_is_drawn(tmp_path: Path) -> None:
    trials = _read(tmp_path, "")
    assert (trials.friction, trials.mass, trials.goals, trials.noise.force) == (None, 0.0, {}, None)


def test_a_frame_may_be_the_place_and_tolerances_have_defaults(tmp_path: Path) -> None:
    goal = _read(tmp_path, 'goal = { BLOCK = { at = "HOME" } }').goals["BLOCK"]
    assert (goal.at, goal.distance, goal.angle) == ("HOME", pytest.approx(2e-3), pytest.approx(radians(3)))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("fricton = [0, 1]", "did you mean 'friction'"),
        ("friction = [1.0, 0.4]", "the lower one first, got [1, 0.4]"),
        ("friction = [0, 11]", "from 0 to 10"),
        ("friction = 0.5", "trials, friction: expected a list of 2 numbers"),
        ("mass_pct = 95", "0 to 90"),
        ("pose = { BLOK = { xy_mm = 1 } }", "BLOK is not a part, frame or marker of the cell; did you mean BLOCK?"),
        ("pose = { BLOCK = { xy = 1 } }", "did you mean 'xy_mm'"),
        ("pose = { BLOCK = { yaw_deg = 181 } }", "0 to 180"),
        ('goal = { SLOT = { at = "BLOCK" } }', "SLOT is not a part of the cell"),
        (
            'goal = { BLOCK = { at = "SLOTT" } }',
            "SLOTT is not a marker, frame or other part of the cell; did you mean SLOT?",
        ),
        ("goal = { BLOCK = { mm = 2 } }", "goal, BLOCK, at: missing"),
        ('goal = { BLOCK = { at = "SLOT", mm = 0 } }', "0.001 to 10000"),
        ("noise = { pixel = [0, 1] }", "did you mean 'pixels'"),
        ("noise = { pixels = [0, 300] }", "from 0 to 255"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(FileFormatError) as error:
        _read(tmp_path, text)
    assert words in str(error.value)
