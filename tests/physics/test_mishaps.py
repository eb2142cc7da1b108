"""Each thing that can go wrong in a world, without a TRY, where it ends the program, and with one, where it goes on."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import attrs
import numpy as np
import pytest

from armwright.arrays import Array
from armwright.cell.control import Servo
from armwright.cell.hardware import Mishap
from armwright.cell.model import Cell
from armwright.physics.world import PhysicsCell
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.machine import RunError
from armwright.program.vm.recording import Recording
from armwright.spatial.poses import homogeneous
from armwright.spatial.shapes import Box
from oracles.benches import PROGRAM, SIDE, bench, compiled, flat_pose, without_pictures

TRIED = PROGRAM.replace("BEGIN\n", "BEGIN\n  TRY\n", 1).replace(
    "END.\n", '  RECOVER\n    PRINT("recovered") ;\n  END ;\n  PRINT("goes on") ;\nEND.\n'
)
POST = """[parts.POST]
size_mm = [40, 40, 200]
mass_kg = 8
at = [1,0,0, 0,1,0, 0,0,1, 0.9, 0.5, 0.13]
[parts.BLOCK]"""
PRINTED = ['PRINT "recovered"', 'PRINT "goes on"']
OILED = ("gripper = { force_N = 30 }", "gripper = { force_N = 30, friction = 0.02 }")


class Shoved(PhysicsCell):
    """Somebody shoves the block when it has been looked at."""

    def locate(self, frame: str, now: float) -> tuple[Array, float]:
        """Answer, and shove."""
        answer = super().locate(frame, now)
        if frame == "GOAL":
            self._data.joint("BLOCK").qpos[0] += 0.1
        return answer


def taller(cell: Cell) -> PhysicsCell:
    """A world in which the block is 15 mm taller than in the file."""
    block = attrs.evolve(cell.parts["BLOCK"], shape=Box(size=(SIDE, SIDE, SIDE + 0.015)))
    return PhysicsCell(cell, parts={"BLOCK": attrs.evolve(block, pose=raised(block.pose, 0.0075))})


def raised(X: Array, height: float) -> Array:
    """A pose so much higher."""
    return homogeneous(X[:3, :3], X[:3, 3] + (0, 0, height))


def with_a_post(cell: Cell) -> PhysicsCell:
    """A world in which a post stands where the cell has none."""
    post = attrs.evolve(cell.parts["POST"], pose=flat_pose(0.52, 0.0, 0.13, 0.0))
    return PhysicsCell(cell, parts={**cell.parts, "POST": post})


def weak(cell: Cell) -> PhysicsCell:
    """A world whose servo is too weak for an arm that is heavier than believed."""
    placed = cell.arms["ARM_1"]
    links = tuple(attrs.evolve(it, mass=1.5 * it.mass, inertia=1.5 * it.inertia) for it in placed.arm.links)
    servo = Servo(bandwidth=1.0, integral=False, law="pd")
    placed = attrs.evolve(placed, servo=servo, plant=attrs.evolve(placed.arm, links=links))
    return PhysicsCell(attrs.evolve(cell, arms={"ARM_1": placed}))


class WithoutMeaning(PhysicsCell):
    """A world in which a speed is no number from some time on."""

    def advance(self, now: float) -> Mishap | None:  # noqa: D102 - as that of any world
        if now > 0.5:
            self._data.qvel[-1] = np.nan
        return super().advance(now)


class Case(NamedTuple):
    """What goes wrong, how it is set up, and what is said of it."""

    code: str
    message: str
    world: Callable[[Cell], PhysicsCell] = PhysicsCell
    change: tuple[str, str] = ("", "")


CASES = {
    "shoved after the look": Case("R603", "ARM_1 closed on nothing: BLOCK is 100 mm away", Shoved),
    "a post that nobody knew": Case("R604", "hits POST with", with_a_post, ("[parts.BLOCK]", POST)),
    "into the table": Case("R604", "BLOCK hits TABLE with", taller),
    "too heavy": Case("R605", "ARM_1 has lost BLOCK", change=("mass_kg = 0.2", "mass_kg = 7")),
    "oiled pads": Case("R605", "ARM_1 has lost BLOCK", change=OILED),
    "a weak servo": Case("R606", "ARM_1 does not follow its motion: joint", weak),
    "no numbers": Case("R607", "the simulated world has become unstable", WithoutMeaning),
}


def run(case: Case, folder: Path, program: str) -> Recording:
    cell = without_pictures(bench(folder, "stanford", case.change))
    world = case.world(cell)
    return interpret(compiled(cell, program).code, cell, world)


def errors(recording: Recording) -> list[Any]:
    return [effect.data["code"] for effect in recording.effects if effect.kind == "ERROR"]


@pytest.mark.parametrize("name", CASES)
def test_without_try(name: str, tmp_path: Path) -> None:
    """Without a TRY the program ends with the code and the message."""
    case = CASES[name]
    with pytest.raises(RunError) as caught:
        run(case, tmp_path, PROGRAM)

    diagnostic = caught.value.diagnostic
    assert diagnostic.code == case.code
    assert case.message in diagnostic.message


@pytest.mark.parametrize("name", [name for name in CASES if name != "no numbers"])
def test_with_try(name: str, tmp_path: Path) -> None:
    """In a TRY the program goes on with RECOVER, and behind it."""
    case = CASES[name]

    recording = run(case, tmp_path, TRIED)

    assert errors(recording) == [case.code]
    assert [effect.text for effect in recording.effects if effect.kind == "PRINT"] == PRINTED


def test_a_move_into_the_table(tmp_path: Path) -> None:
    """What the file knows to be in the way is not run into, in a world either: the MOVE does not begin."""
    low = PROGRAM.replace("MOVE ARM_1 TO obj WITH", "MOVE ARM_1 TO obj * XYZ(0.15, 0, 0.05) WITH").replace(
        " WITH APPROACH = apo ;\n  GRASP", " ;\n  GRASP"
    )

    with pytest.raises(RunError) as caught:
        run(Case("E406", ""), tmp_path, low)

    assert caught.value.diagnostic.code == "E406"
    assert "would hit TABLE" in caught.value.diagnostic.message


@pytest.mark.parametrize("recovery", ['PRINT("recovered")', "PAUSE 1", "RETRY"])
def test_a_world_without_meaning_ends(recovery: str, tmp_path: Path) -> None:
    """A world that has become unstable stays so: a program that waits for better times, or tries for ever, ends."""
    with pytest.raises(RunError) as caught:
        run(CASES["no numbers"], tmp_path, TRIED.replace('PRINT("recovered")', recovery))

    assert caught.value.diagnostic.code == "R607"
    assert caught.value.recording is not None
    assert errors(caught.value.recording()) == ["R607", "R607"]
