"""Moves that end on contact, in a world with physics: as in a cell without it, and no harder than they are meant to."""

import re
from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.cell.model import Cell, ContactPlane
from armwright.cell.scene import Fixture
from armwright.physics.kinematic_cell import kinematic_cell
from armwright.physics.world import PhysicsCell
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.recording import Recording
from armwright.spatial.poses import homogeneous
from armwright.spatial.shapes import Box
from oracles.benches import ARMS, HOLD, STOPPING_SPEEDS, TABLE, bench, compiled, without_pictures
from samples import Sample

pytestmark = [pytest.mark.early, pytest.mark.part(0.1)]

# Times of contact differ by this, beside the time in which an arm stops [s].
LATER = 0.06
# What was pressed on, and how hard, is not the same: a table is stiffer in a world with physics.
PRESSED = re.compile(r"; pressed [0-9.e-]+ mm deep, [0-9.e+-]+ N")


def drawn(folder: Path, arm: str, rng: np.random.Generator, *, plane: bool) -> tuple[Cell, tuple[float, float], float]:
    """Return a cell with a box of any height on its table, or a plane; where that is, and how high."""
    cell = without_pictures(bench(folder, arm))
    (x0, y0), (x1, _) = ARMS[arm][2]
    x, y, top = rng.uniform(x0, x1), y0 + 0.04, TABLE + rng.uniform(0.005, 0.06)
    if plane:
        bare = attrs.evolve(cell, fixtures={}, parts={}, sights={}, markers={})
        return attrs.evolve(bare, contact=ContactPlane(height=top)), (x, y), top
    box = Fixture(
        name="BOX",
        shape=Box(size=(0.08, 0.12, top - TABLE)),
        pose=homogeneous(np.eye(3), (x, y, (top + TABLE) / 2)),
        friction=0.5,
    )
    return attrs.evolve(cell, fixtures={**cell.fixtures, "BOX": box}), (x, y), top


def text_of(at: tuple[float, float], top: float, speed: float, force: float, before: str = "") -> str:
    where = f"1,0,0, 0,-1,0, 0,0,-1, {at[0]:.6f},{at[1]:.6f}"
    return (
        "VAR obj, apo, low, up : FRAME ; hit : SCALAR ;\nBEGIN\n  hit = 0 ;\n"
        f"{before}  up = ({where},{top + 0.03:.6f}) ; low = ({where},{top - 0.03:.6f}) ;\n"
        "  MOVE ARM_1 TO up ;\n  ZERO FORCE ARM_1 ;\n"
        f"  MOVE ARM_1 TO low STRAIGHTLY, WITH SPEED = {speed:.3f},\n"
        f'    ON FORCE(Z) > {force:.3f} DO BEGIN hit = 1 ; PRINT("hit") ; HALT END ;\n'
        "  PRINT(hit) ;\n  PAUSE 0.5 ;\n  MOVE ARM_1 TO up STRAIGHTLY ;\nEND.\n"
    )


def both(cell: Cell, program: str) -> tuple[Recording, Recording, PhysicsCell]:
    code = compiled(cell, program).code
    world = PhysicsCell(cell)
    return interpret(code, cell, kinematic_cell(cell)), interpret(code, cell, world), world


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize("plane", [False, True])
@pytest.mark.parametrize("arm", ["stanford", "puma560"])
def test_as_without_physics(arm: str, sample: Sample, tmp_path: Path, *, plane: bool) -> None:
    """A guarded move ends as in a kinematic cell: kinds, texts, times to 60 ms and the time of stopping."""
    late = []
    for rng in sample.cases(20):
        cell, at, top = drawn(tmp_path, arm, rng, plane=plane)
        program = text_of(at, top, rng.uniform(*STOPPING_SPEEDS[arm]), rng.uniform(4, 12))
        plain, physical, _ = both(cell, program)

        assert [e.kind for e in plain.effects] == [e.kind for e in physical.effects]
        assert [PRESSED.sub("", e.text) for e in plain.effects] == [PRESSED.sub("", e.text) for e in physical.effects]
        assert sum("halted; pressed" in e.text for e in physical.effects) == 1
        acted = next(e for e in plain.effects if e.data.get("printed") == "hit")
        stopped = next(e for e in plain.effects if "halted" in e.text)
        held = LATER + stopped.t1 - acted.t0
        for mine, its in zip(plain.effects, physical.effects, strict=True):
            late.append(its.t1 - mine.t1)
            assert abs(late[-1]) < held
    sample.record(f"guarded moves of {arm}", len(late), 0, latest=max(late), earliest=min(late))


# By arm and speed: the largest force that is allowed, and that at rest [N].
@pytest.mark.parametrize(
    ("arm", "speed", "allowed"),
    [("stanford", 5, (10.0, 9.0)), ("stanford", 20, (40.0, 32.0)), ("puma560", 5, (20.0, 20.0))],
)
def test_no_harder_than_meant(
    arm: str, speed: float, allowed: tuple[float, float], sample: Sample, tmp_path: Path
) -> None:
    """Where 8 N are to end a move, little more is pressed with at a low speed; at rest that does not grow."""
    worst, standing = 0.0, 0.0
    for rng in sample.cases(10):
        cell, at, top = drawn(tmp_path, arm, rng, plane=False)
        program = text_of(at, top, speed, 8.0).replace("  MOVE ARM_1 TO up STRAIGHTLY ;\n", "  PAUSE 3 ;\n")
        code = compiled(cell, program).code
        world = PhysicsCell(cell)

        recording = interpret(code, cell, world)

        halted = next(e for e in recording.effects if "halted" in e.text)
        worst = max(worst, float(halted.data["contact"]["force"]))
        standing = max(standing, float(world.contact_wrench("ARM_1", world.now)[2]))
        assert standing > 1
    sample.record(f"pressed by {arm} at SPEED {speed}", 1, 0, peak=worst, rest=standing)
    assert worst < allowed[0]
    assert standing < allowed[1]


def test_with_a_part_in_the_hand(sample: Sample, tmp_path: Path) -> None:
    """A held block that is set down by force touches as early as in a kinematic cell."""
    for rng in sample.cases(10):
        cell, at, top = drawn(tmp_path, "stanford", rng, plane=False)
        plain, physical, _ = both(cell, text_of(at, top + 0.02, rng.uniform(3, 15), 8.0, HOLD))

        assert [PRESSED.sub("", e.text) for e in plain.effects] == [PRESSED.sub("", e.text) for e in physical.effects]
        for mine, its in zip(plain.effects, physical.effects, strict=True):
            assert its.t1 == pytest.approx(mine.t1, abs=2 * LATER)
