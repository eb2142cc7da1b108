"""Programs in a cell with physics: they place parts, and what goes wrong is told to them."""

import hashlib
import subprocess
import sys
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.scene import Part
from armwright.cell.simulator import Simulator
from armwright.errors import InvalidValueError
from armwright.physics.servo import Reference
from armwright.physics.world import PhysicsCell, drawn_parts
from armwright.program.debugger.history import Timeline
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.machine import RunError
from armwright.program.vm.recording import Recording
from oracles.benches import ARMS, PROGRAM, bench, compiled, drawn_bench, flat_pose, placing_error, without_pictures
from samples import Sample

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

# The block is found where the file says, without pictures.
NO_CAMERA = (("width = 640\nheight = 480\nfovy_deg = 42\n", ""),)
RETRIED = PROGRAM.replace("BEGIN\n", "BEGIN\n  TRY\n", 1).replace(
    "  MOVE ARM_1 TO stop WITH DEPARTURE = apg ;\n",
    """  RECOVER
    OPEN ARM_1 ;
    MOVE ARM_1 TO stop ;
    RETRY ;
  END ;
  MOVE ARM_1 TO stop WITH DEPARTURE = apg ;
""",
)


def blind(folder: Path, *changes: tuple[str, str], arm: str = "stanford") -> Cell:
    """A bench whose camera answers with what is true."""
    return without_pictures(bench(folder, arm, *changes))


def run(cell: Cell, program: str = PROGRAM, hardware: Any = None, **options: Any) -> Recording:
    hardware = PhysicsCell(cell, **options) if hardware is None else hardware
    return interpret(compiled(cell, program).code, cell, hardware)


def moved(cell: Cell, x: float, y: float) -> dict[str, Part]:
    """The parts of a world in which the block stands elsewhere than in the file."""
    block = cell.parts["BLOCK"]
    return {**cell.parts, "BLOCK": attrs.evolve(block, pose=flat_pose(*(block.pose[:2, 3] + (x, y)), 0.05, 0.0))}


# ---- parts are placed ------------------------------------------------------------------------------------------------


@pytest.mark.drawn(0.34)
@pytest.mark.share(0.02)
@pytest.mark.parametrize("arm", ARMS)
def test_placed_by_vision(arm: str, sample: Sample, tmp_path: Path) -> None:
    """Anywhere on the table and turned anyhow, a block is seen, taken, and set down where another marker is seen."""
    pytest.importorskip("cv2")
    cell = bench(tmp_path, arm)
    code = compiled(cell).code
    off, tips, slips, rejected = [], [], [], 0
    for number, rng in enumerate(sample.cases(100)):
        drawn, parts, goal, refused = drawn_bench(cell, arm, rng)
        rejected += refused
        world = PhysicsCell(drawn, seed=number, parts=parts)
        recording = interpret(code, drawn, world)
        off.append(placing_error(world.true_pose("BLOCK"), goal))
        tips.append(recording.observations.facts["tip"]["ARM_1"])
        slips.append(recording.observations.facts["slip"]["ARM_1"])
        same_trace(attrs.evolve(drawn, parts=parts), code, recording)
    distances = np.array(off)[:, 0]
    sample.record(
        f"blocks placed by {arm}",
        len(off),
        int((distances > 2e-3).sum()),
        worst=distances.max(),
        tip=max(tips),
        slip=max(slips),
        rejected=rejected,
    )
    assert distances.max() < 2e-3
    assert np.quantile(distances, 0.95) < 1e-3
    assert max(angle for _, angle in off) < np.radians(2.0)
    assert max(tips) < 1e-3
    assert max(slips) < 3e-4


def same_trace(cell: Cell, code: Any, recording: Recording) -> None:
    """A kinematic cell with the same answers of its camera leaves the same trace: kinds, texts, times to 5 ms."""
    answers: dict[str, list[Array]] = {}
    for effect in recording.effects:
        if effect.kind == "READ":
            X = np.eye(4)
            X[:3] = np.reshape(effect.data["pose"], (4, 3)).T
            answers.setdefault(str(effect.data["frame"]), []).append(np.linalg.inv(cell.camera) @ X)
    kinematic = attrs.evolve(cell, sights={}, visions={name: tuple(poses) for name, poses in answers.items()})
    other = interpret(code, kinematic, Simulator(kinematic))
    assert [(e.kind, e.text) for e in other.effects] == [(e.kind, e.text) for e in recording.effects]
    for mine, its in zip(recording.effects, other.effects, strict=True):
        # What the program computes from measured poses of the hand may take a few ticks more or less.
        assert (mine.t0, mine.t1) == pytest.approx((its.t0, its.t1), abs=5.5 * cell.period)


# ---- what goes wrong -------------------------------------------------------------------------------------------------


def failure(cell: Cell, program: str = PROGRAM, hardware: Any = None, **options: Any) -> RunError:
    with pytest.raises(RunError) as caught:
        run(cell, program, hardware, **options)
    return caught.value


def test_fingers_close_on_nothing(tmp_path: Path) -> None:
    """A block that was shoved after the look is not between the fingers: R603; a program that looks again takes it."""

    class Shoved(PhysicsCell):
        looks = 0

        def locate(self, frame: str, now: float) -> tuple[Array, float]:
            pose, time = super().locate(frame, now)
            self.looks += frame == "OBJ"
            if frame == "OBJ" and self.looks == 1:
                pose = pose.copy()
                pose[0, 3] -= 0.1
            return pose, time

    cell = blind(tmp_path)
    error = failure(cell, hardware=Shoved(cell))
    assert error.diagnostic.code == "R603"
    assert error.diagnostic.message == "ARM_1 closed on nothing: BLOCK is 100 mm away"

    world = Shoved(cell)
    recording = run(cell, RETRIED, world)
    assert world.looks == 2
    assert [effect.data["code"] for effect in recording.effects if effect.kind == "ERROR"] == ["R603"]
    assert placing_error(world.true_pose("BLOCK"), cell.markers["SLOT"].pose)[0] < 1e-3


OBSTACLE = """[parts.POST]
size_mm = [40, 40, 200]
mass_kg = 8
at = [1,0,0, 0,1,0, 0,0,1, 0.9, 0.5, 0.13]
[parts.BLOCK]"""


def test_a_part_too_heavy(tmp_path: Path) -> None:
    """Two fingers of 30 N hold 6.1 kg: 5 kg are carried, 7 kg are lost, R605, and a TRY goes on from there."""
    light = blind(tmp_path, ("mass_kg = 0.2", "mass_kg = 4.5"))
    world = PhysicsCell(light)
    run(light, hardware=world)
    assert placing_error(world.true_pose("BLOCK"), light.markers["SLOT"].pose)[0] < 2e-3

    heavy = blind(tmp_path, ("mass_kg = 0.2", "mass_kg = 7"))
    error = failure(heavy)
    assert (error.diagnostic.code, error.diagnostic.message) == ("R605", "ARM_1 has lost BLOCK")
    assert "holds 6.12 kg" in error.diagnostic.helps[0]
    given_up = RETRIED.replace("    RETRY ;\n", "    HALT ;\n")
    recording = run(heavy, given_up)
    assert [effect.data["code"] for effect in recording.effects if effect.kind == "ERROR"] == ["R605"]


def test_things_inside_each_other(tmp_path: Path) -> None:
    """A table through the base of an arm, and a part inside a part, are refused by their names."""
    apart = r"(TABLE and ARM_1 .*|ARM_1 .* and TABLE) stand inside each other at the start"
    with pytest.raises(InvalidValueError, match=apart):
        PhysicsCell(blind(tmp_path, ("z = 0.03, from = [0.22", "z = 0.40, from = [-0.3")))
    inside = OBSTACLE.replace("0.9, 0.5, 0.13", "0.52, 0.10, 0.13")
    with pytest.raises(InvalidValueError, match=r"(POST and BLOCK|BLOCK and POST) stand inside each other"):
        PhysicsCell(blind(tmp_path, ("[parts.BLOCK]", inside)))


# ---- the same every time ---------------------------------------------------------------------------------------------


def digest(world: PhysicsCell) -> str:
    data = world._data
    return hashlib.sha256(np.concatenate([data.qpos, data.qvel, data.ctrl]).tobytes()).hexdigest()


def test_same_bits(tmp_path: Path) -> None:
    """The same run gives the same bits, in this process and in another with another hash seed."""
    cell = blind(tmp_path, ("symmetry = 4", "symmetry = 4\nspread_mm = 20\nspread_deg = 30"))
    worlds = [PhysicsCell(cell, seed=3) for _ in range(2)]
    for world in worlds:
        run(cell, hardware=world)
    assert digest(worlds[0]) == digest(worlds[1])

    here = Path(__file__).parent
    text = (
        f"import sys; sys.path[:0] = [{str(here.parent)!r}, {str(here)!r}]\n"
        "from pathlib import Path\n"
        "from test_world import blind, digest, run\n"
        "from armwright.physics.world import PhysicsCell\n"
        f"cell = blind(Path({str(tmp_path)!r}), ('symmetry = 4', 'symmetry = 4\\nspread_mm = 20\\nspread_deg = 30'))\n"
        "world = PhysicsCell(cell, seed=3)\n"
        "run(cell, hardware=world)\n"
        "print(digest(world))\n"
    )
    import os

    environment = {**os.environ, "PYTHONHASHSEED": "77", "PYTHONPATH": os.pathsep.join(sys.path)}
    other = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True, env=environment)
    assert other.stdout.strip() == digest(worlds[0])


def test_back_in_the_debugger(tmp_path: Path) -> None:
    """A run that has been taken back and goes on again comes to the same bits."""
    cell = blind(tmp_path)
    timeline = Timeline(compiled(cell).code, cell, hardware=PhysicsCell)

    def go(steps: int) -> None:
        while timeline.step_count < steps:
            timeline.advance()

    go(24)
    first = digest(timeline.machine.hardware)
    timeline.seek(12)
    timeline.seek(24)
    assert digest(timeline.machine.hardware) == first


def test_drawn_parts(tmp_path: Path) -> None:
    """A part is drawn within its spread, by the seed."""
    cell = blind(tmp_path, ("symmetry = 4", "symmetry = 4\nspread_mm = 20\nspread_deg = 30"))
    nominal = cell.parts["BLOCK"].pose
    poses = [drawn_parts(cell, np.random.default_rng(seed))["BLOCK"].pose for seed in range(200)]
    shifts = np.array([X[:3, 3] - nominal[:3, 3] for X in poses])
    angles = np.array([np.arctan2(X[1, 0], X[0, 0]) for X in poses])

    assert np.abs(shifts[:, :2]).max() <= 0.02
    assert np.abs(shifts[:, :2]).max() > 0.018
    assert not shifts[:, 2].any()
    assert 0.45 < np.abs(angles).max() <= np.radians(30)


# ---- servo and forces ------------------------------------------------------------------------------------------------


def test_a_law_of_its_own(tmp_path: Path) -> None:
    """A user's controller is asked at every tick; one that holds nothing lets the arm fall, which is told."""
    cell, asked = blind(tmp_path), []

    def limp(t: float, q: Array, qd: Array, reference: Reference) -> Array:  # noqa: ARG001 - what a law is given
        asked.append((t, reference.q - q))
        return np.zeros_like(q)

    error = failure(cell, laws={"ARM_1": limp})

    assert error.diagnostic.code == "R606"
    np.testing.assert_allclose([t for t, _ in asked[:3]], [0.0, 1e-3, 2e-3])
    with pytest.raises(InvalidValueError, match="ARM_2 is no arm of cell 'bench'; did you mean ARM_1"):
        PhysicsCell(cell, laws={"ARM_2": limp})


def test_sensors_of_forces_and_efforts(tmp_path: Path) -> None:
    """A sensor of forces gives one reading in each of its periods; measured efforts have the noise of the file."""
    entries = "force = { rate_hz = 100, noise_N = 1, bias_N = 0.5 }\nsensors = { effort_noise_pct = 1 }\n"
    cell = blind(tmp_path, ("gripper = { force_N = 30 }\n", f"gripper = {{ force_N = 30 }}\n{entries}"))
    world = PhysicsCell(cell, seed=1)
    readings = []
    for tick in range(1, 1001):
        world.advance(tick * cell.period)
        readings.append(world.contact_wrench("ARM_1", tick * cell.period))

    changes = np.flatnonzero(np.diff(np.array(readings)[:, 2])) + 2
    assert (np.diff(changes) == 10).all()
    np.testing.assert_allclose(np.mean(readings, axis=0)[:3], 0.5, atol=0.5)
    assert 0.8 < np.std(np.array(readings)[::10, :3]) < 1.2
    tau = world.observations().measured[0].tau[200:]
    limits = cell.arms["ARM_1"].arm.limits.effort
    np.testing.assert_allclose(tau.std(axis=0), 0.01 * limits, rtol=0.2)
