"""Worlds that cannot begin, and torque laws whose efforts are none."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from armwright.cell.model import Cell
from armwright.cell.observations import Picture
from armwright.cell.reader import read_cell
from armwright.errors import ArmwrightError, InvalidValueError, KindError, ShapeError
from armwright.physics import world
from armwright.physics.servo import Reference
from armwright.physics.world import PhysicsCell

# The column of the Stanford arm stands on its base frame and is 292 mm high; a box of 100 mm is somewhere.
BOX = """[arms.ARM_1]
joint_positions = [0, -1.5, 0.4, 0, 0.5, 0]

[scene]
boxes = [{{ name = "BOX", size_mm = [100, 100, 100], at = [1,0,0, 0,1,0, 0,0,1, {x}, 0, {z}] }}]
"""


def boxed(folder: Path, x: float = 1.0, z: float = 0.1) -> Cell:
    path = folder / "boxed.toml"
    path.write_text(BOX.format(x=x, z=z), encoding="utf-8")
    return read_cell(path)


@pytest.mark.parametrize(("z", "depth"), [(0.1, None), (-0.05, None), (-0.0505, None), (-0.047, 3.0), (-0.03, 20.0)])
def test_an_arm_stands_on_a_box_and_not_in_it(z: float, depth: float | None, tmp_path: Path) -> None:
    """The base of an arm may stand on what stands, to a millimetre; inside it, both are named, with the depth."""
    cell = boxed(tmp_path, 0.0 if depth or z < 0 else 1.0, z)
    if depth is None:
        PhysicsCell(cell)
        return
    with pytest.raises(InvalidValueError, match="ARM_1 base and BOX stand inside each other at the start") as error:
        PhysicsCell(cell)
    found = re.search(r"(\S+) mm deep", str(error.value))
    assert found is not None
    assert float(found[1]) == pytest.approx(depth, abs=0.05)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"seed": -1}, InvalidValueError, "seed: expected an integer of at least 0, got -1"),
        ({"seed": 1.5}, KindError, "seed: expected an integer, got 1.5"),
        ({"seed": None}, KindError, "seed: expected an integer, got None"),
        ({"laws": len}, KindError, "laws: expected functions by the name of an arm, got <built-in"),
        ({"laws": {"ARM_1": 3}}, KindError, "laws: expected a function of t, q, qd and reference for 'ARM_1', got 3"),
        ({"laws": {1: len}}, KindError, "for 1, got <built-in function len>"),
        (
            {"parts": {"BLOCK": None}},
            InvalidValueError,
            "parts: expected those of cell 'boxed.toml' by name (none)",
        ),
        ({"parts": 3}, InvalidValueError, "parts: expected those of"),
    ],
)
def test_arguments_of_a_world(
    options: dict[str, Any], error: type[ArmwrightError], message: str, tmp_path: Path
) -> None:
    """What a world cannot be made of is refused by its name."""
    with pytest.raises(error, match=re.escape(message)):
        PhysicsCell(boxed(tmp_path), **options)
    with pytest.raises(KindError, match=r"cell: expected a Cell, such as read_cell returns, got 'boxed\.toml'"):
        PhysicsCell("boxed.toml")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("law", "error", "message"),
    [
        (lambda *_: np.full(6, np.nan), InvalidValueError, "every number must be finite, got nan at (0,)"),
        (lambda *_: 1.0, ShapeError, "(6,), got ()"),
        (lambda *_: [1.0], ShapeError, "(6,), got (1,)"),
        (lambda *_: np.zeros(7), ShapeError, "(6,), got (7,)"),
        (lambda *_: np.zeros((6, 1)), ShapeError, "(6,), got (6, 1)"),
        (lambda *_: None, KindError, "expected numbers, got None"),
        (lambda *_: "full", KindError, "expected numbers, got 'full'"),
        (lambda *_: np.zeros(6) + 1j, KindError, "expected numbers, got array("),
    ],
)
def test_laws_that_return_no_efforts(
    law: Callable[..., Any], error: type[ArmwrightError], message: str, tmp_path: Path
) -> None:
    """A law of a user's own returns a finite number for each joint; anything else is told, with its time."""
    world = PhysicsCell(boxed(tmp_path), laws={"ARM_1": lambda t, *rest: law(t, *rest) if t else np.zeros(6)})

    with pytest.raises(error, match=r"efforts of the torque law of 'stanford' at 0\.001 s: ") as caught:
        world.advance(0.01)

    assert message in str(caught.value)


def test_a_law_changes_nothing_but_efforts(tmp_path: Path) -> None:
    """A law that writes into what it is given moves neither the arm nor where it is sent."""

    def writes(_t: float, q: Any, qd: Any, reference: Reference) -> Any:
        q[:], qd[:], reference.q[:] = 5.0, 5.0, 5.0
        return np.zeros(6)

    cell = boxed(tmp_path)
    world, plain = (PhysicsCell(cell, laws={"ARM_1": law}) for law in (writes, lambda *_: np.zeros(6)))
    for each in (world, plain):
        each.advance(0.01)

    np.testing.assert_array_equal(world.configuration("ARM_1", 0.01), plain.configuration("ARM_1", 0.01))


def test_the_latest_pictures_are_kept() -> None:
    """Of more pictures than are kept, and of larger ones, the last ones stay."""
    small = [Picture(time=float(k), camera="C", frame="F", png=b"x", found=True, text="") for k in range(502)]
    large = [attrs.evolve(picture, png=bytes(80_000_000)) for picture in small[:3]]

    assert [picture.time for picture in world._latest(tuple(small))] == list(range(2, 502))
    assert [picture.time for picture in world._latest(tuple(large))] == [1.0, 2.0]
