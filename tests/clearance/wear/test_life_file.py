"""Worn surfaces in wear.json: what a simulation takes up of a life, and what is refused."""

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import constant_speed_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.wear.life import WearLife, wear_life
from armwright.clearance.wear.life_file import read_worn_surfaces, surfaces_data
from armwright.clearance.wear.worn_stroke import Stroke
from armwright.clearance.wear.worn_surfaces import WearLaw
from armwright.errors import FileFormatError, InvalidValueError


@pytest.fixture(scope="module")
def life() -> WearLife:
    path = constant_speed_path("turn", 0.3, 60.0, 0.1)
    stroke = Stroke.of(load_linkage("four-bar"), path, moments=21)
    return wear_life(stroke, WearLaw(coefficient=1e-14, bins=36), steps=3, max_step=0.1)


def written(folder: Path, surfaces: Any) -> Path:
    path = folder / "wear.json"
    path.write_text(json.dumps({"surfaces": surfaces}))
    return path


def test_surfaces_come_back(life: WearLife, tmp_path: Path) -> None:
    """The last state, and one between two, are those of the life to six digits."""
    path = written(tmp_path, surfaces_data(life))
    between = float(0.3 * life.strokes[1] + 0.7 * life.strokes[2])

    last, strokes = read_worn_surfaces(path, life.stroke.linkage)
    middle, _ = read_worn_surfaces(path, life.stroke.linkage, between)

    assert strokes == life.strokes[-1]
    np.testing.assert_allclose(last.bearing, life.surfaces[-1].bearing, rtol=1e-5)
    np.testing.assert_allclose(last.journal, life.surfaces[-1].journal, rtol=1e-5)
    np.testing.assert_allclose(middle.bearing, life.surfaces_after(between).bearing, rtol=2e-5)
    expected = 0.3 * life.surfaces[1].journal + 0.7 * life.surfaces[2].journal
    np.testing.assert_allclose(middle.journal, expected, rtol=2e-5)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda data: data.pop("strokes"),
        lambda data: data["bearing"].update(B=[[0.0] * 36] * 2),
        lambda data: data["journal"]["B"][1].__setitem__(3, -1e-6),
        lambda data: data["strokes"].reverse(),
        lambda data: data["bearing"]["B"][0].__setitem__(0, "deep"),
        lambda data: data["bearing"].pop("B"),
    ],
)
def test_what_is_no_life(life: WearLife, spoil: Callable[[Any], object], tmp_path: Path) -> None:
    """A file with something missing, negative or out of order is refused, and the message says what is expected."""
    data = copy.deepcopy(surfaces_data(life))
    spoil(data)

    with pytest.raises(FileFormatError, match=r"expected wear\.json, as `armwright clearance wear -o` writes it"):
        read_worn_surfaces(written(tmp_path, data), life.stroke.linkage)


def other_clearance(linkage: Linkage) -> Linkage:
    return linkage.with_clearances({"B": 1e-4})


def test_other_pins_and_strokes(life: WearLife, tmp_path: Path) -> None:
    """Pins of other clearances, and strokes beyond the life, are refused with what was expected."""
    path, linkage = written(tmp_path, surfaces_data(life)), life.stroke.linkage

    with pytest.raises(FileFormatError, match=r"expected the pins of four-bar, B 0\.1 mm, got B "):
        read_worn_surfaces(path, other_clearance(linkage))
    with pytest.raises(InvalidValueError, match=r"strokes: expected 0 to .*, got 1e\+30"):
        read_worn_surfaces(path, linkage, 1e30)
    with pytest.raises(InvalidValueError, match="strokes: expected at most"):
        life.surfaces_after(1e30)
