"""Benches with physics: an arm, a table, a block with a marker, a marker where it is to go, and a camera."""

from pathlib import Path

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.cell.scene import Part
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.program.api import Compilation, compile as compile_program
from armwright.program.language.source import Source
from armwright.spatial.poses import homogeneous, inverse as inverse_pose
from armwright.spatial.rotations import rotation_from_vector

TABLE, SIDE = 0.03, 0.04
DOWN = "1,0,0, 0,-1,0, 0,0,-1"
# By arm: keys of its table, where its tool waits, and the rectangle of the table that it works on.
ARMS = {
    "stanford": ('model = "stanford"', (0.45, 0.0, 0.25), ((0.42, -0.24), (0.62, 0.24))),
    "puma560": (
        'model = "puma560"\nbase = [1,0,0, 0,1,0, 0,0,1, 0,0,0.45]\ntool = [1,0,0, 0,1,0, 0,0,1, 0,0,0.12]',
        (0.45, 0.15, 0.30),
        ((0.42, -0.06), (0.62, 0.30)),
    ),
    "ur5": (
        'model = "ur5"\nbase = [1,0,0, 0,1,0, 0,0,1, 0,0,0.2]\ntool = [1,0,0, 0,1,0, 0,0,1, 0,0,0.15]',
        (0.35, -0.12, 0.30),
        ((0.35, -0.30), (0.55, 0.10)),
    ),
}
CELL = """name = "bench"
[arms.ARM_1]
{arm}
hand = [{down}, {x}, {y}, {z}]
gripper = {{ force_N = 30 }}
[frames]
STOP = [{down}, {x}, {y}, {z}]
[scene]
table = {{ z = 0.03, from = [0.22, -0.7], to = [1.35, 0.7] }}
markers = [{{ name = "SLOT", id = 7, size_mm = 60, at = [1,0,0, 0,1,0, 0,0,1, {sx}, {sy}, 0.03] }}]
[parts.BLOCK]
shape = "box"
size_mm = [40, 40, 40]
mass_kg = 0.2
at = [1,0,0, 0,1,0, 0,0,1, {bx}, {by}, 0.05]
grasp = [{down}, 0, 0, 0]
marker = {{ id = 3, size_mm = 30, at = [1,0,0, 0,1,0, 0,0,1, 0, 0, 0.02] }}
symmetry = 4
[camera]
pose = [0,1,0, 0.843158,0,-0.537666, -0.537666,0,-0.843158, 0.95,0,0.72]
width = 640
height = 480
fovy_deg = 42
[visions]
OBJ = {{ part = "BLOCK", on = "table" }}
GOAL = {{ marker = "SLOT", on = "table", at = [{down}, 0, 0, 0.0205] }}
"""
PROGRAM = """VAR obj, goal, apo, apg, stop : FRAME ;
BEGIN
  READ VISIONS (obj) ;
  READ VISIONS (goal) ;
  AFFIX apo TO obj AT XYZ(0, 0, -0.08) ;
  AFFIX apg TO goal AT XYZ(0, 0, -0.08) ;
  OPEN ARM_1 ;
  MOVE ARM_1 TO obj WITH APPROACH = apo ;
  GRASP ARM_1 ;
  AFFIX obj TO ARM_1 ;
  MOVE obj TO goal WITH DEPARTURE = apo, WITH APPROACH = apg ;
  OPEN ARM_1 ;
  UNFIX obj FROM ARM_1 ;
  MOVE ARM_1 TO stop WITH DEPARTURE = apg ;
END.
"""


# What takes the block and lifts it, in front of a program that goes on with it in the hand.
HOLD = """  READ VISIONS (obj) ;
  AFFIX apo TO obj AT XYZ(0, 0, -0.08) ;
  OPEN ARM_1 ;
  MOVE ARM_1 TO obj WITH APPROACH = apo ;
  GRASP ARM_1 ;
  AFFIX obj TO ARM_1 ;
  MOVE ARM_1 TO apo STRAIGHTLY ;
"""
# Speeds at which an arm stops within 5 mm, which is what a cell allows.
STOPPING_SPEEDS = {"stanford": (3.0, 25.0), "puma560": (3.0, 9.0)}


def bench_text(arm: str = "stanford") -> str:
    """The text of the cell file of a bench."""
    entries, (x, y, z), (low, high) = ARMS[arm]
    middle = np.mean((low, high), axis=0)
    # The block and where it goes to begin on either side of the middle.
    beside = np.array([0.0, 0.09])
    (bx, by), (sx, sy) = middle + beside, middle - beside
    numbers = {
        name: f"{value:g}" for name, value in {"x": x, "y": y, "z": z, "bx": bx, "by": by, "sx": sx, "sy": sy}.items()
    }
    return CELL.format(arm=entries, down=DOWN, **numbers)


def bench(folder: Path, arm: str = "stanford", *changes: tuple[str, str]) -> Cell:
    """The cell of a bench, with changes of its text."""
    text = bench_text(arm)
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    path = folder / "bench.toml"
    path.write_text(text, encoding="utf-8")
    return read_cell(path)


def without_pictures(cell: Cell) -> Cell:
    """A cell whose camera answers with what is true, without pictures."""
    sights = {name: attrs.evolve(sight, camera=None) for name, sight in cell.sights.items()}
    return attrs.evolve(cell, cameras={}, sights=sights)


def compiled(cell: Cell, program: str = PROGRAM) -> Compilation:
    """A program for a bench."""
    result = compile_program(Source("bench.rlo", program), cell)
    assert result.code is not None, [diagnostic.message for diagnostic in result.diagnostics]
    return result


def flat_pose(x: float, y: float, z: float, yaw: float) -> Array:
    """A pose that is rotated about the vertical."""
    return homogeneous(rotation_from_vector(np.array([0.0, 0.0, yaw])), (x, y, z))


def reachable(cell: Cell, X: Array) -> bool:
    """Whether one branch of the arm reaches a block at a pose, in one of its four equal orientations, and above it."""
    arm = cell.arms["ARM_1"]
    start, nominal = cell.parts["BLOCK"].pose, np.arctan2(X[1, 0], X[0, 0])
    turn = (nominal + np.pi / 4) % (np.pi / 2) - np.pi / 4
    folded = flat_pose(*X[:3, 3], turn) @ cell.parts["BLOCK"].grasp
    assert np.allclose(start[:3, :3], np.eye(3))
    names: set[str] | None = None
    for above in (0.0, 0.08):
        lifted = homogeneous(np.eye(3), (0, 0, above)) @ folded
        branches = {solution.label for solution in inverse(arm.arm, inverse_pose(arm.base) @ lifted).allowed}
        names = branches if names is None else names & branches
    return bool(names)


def drawn_bench(cell: Cell, arm: str, rng: np.random.Generator) -> tuple[Cell, dict[str, Part], Array, int]:
    """A bench with the block and its goal anywhere that the arm reaches, the goal, and how many poses were rejected."""
    low, high = ARMS[arm][2]
    rejected = 0
    while True:
        (bx, by), (gx, gy) = rng.uniform(low, high), rng.uniform(low, high)
        block, goal = (
            flat_pose(bx, by, TABLE + SIDE / 2, rng.uniform(-np.pi, np.pi)),
            flat_pose(gx, gy, TABLE, rng.uniform(-0.6, 0.6)),
        )
        above = homogeneous(np.eye(3), (0, 0, SIDE / 2)) @ goal
        if np.hypot(bx - gx, by - gy) > 0.13 and reachable(cell, block) and reachable(cell, above):
            break
        rejected += 1
    marker = attrs.evolve(cell.markers["SLOT"], pose=goal)
    parts = {"BLOCK": attrs.evolve(cell.parts["BLOCK"], pose=block)}
    return attrs.evolve(cell, markers={"SLOT": marker}), parts, goal, rejected


def placing_error(X: Array, goal: Array) -> tuple[float, float]:
    """How far a block is from a goal: the distance in the plane [m], and the angle to the nearest equal one [rad]."""
    turn = np.arctan2(X[1, 0], X[0, 0]) - np.arctan2(goal[1, 0], goal[0, 0])
    return float(np.hypot(*(X[:2, 3] - goal[:2, 3]))), float(abs((turn + np.pi / 4) % (np.pi / 2) - np.pi / 4))
