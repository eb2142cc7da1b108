"""A cell with all that stands and lies in one: two arms, a table, boxes, a cylinder, a ball, a part that is a mesh."""

from pathlib import Path

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.cell.simulator import Simulator
from armwright.program import Source, compile as translate, known_cell
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.recording import Recording
from armwright.spatial.shapes import Box, Capsule, Mesh, Solid

CELL = """name = "Stocked cell"
[arms.ARM_1]
joint_positions = [0.3, 1.2, 0.35, 0.1, 0.8, 0.2]
gripper = { opening_mm = 90 }
[arms.ARM_2]
base = [-1,0,0, 0,-1,0, 0,0,1, 1.25,0.1,0]
joint_positions = [-0.4, 1.3, 0.30, 0.1, 0.8, 0.2]
gripper = { kind = "suction" }
[scene]
table = { z = 0, from = [0.22, -0.45], to = [1.02, 0.45], thickness_mm = 40 }
boxes = [
  { name = "NEST", at = [1,0,0, 0,1,0, 0,0,1, 0.55,0.28,0.03], size_mm = [120, 90, 60] },
  { name = "WALL", at = [0.8,0.6,0, -0.6,0.8,0, 0,0,1, 0.80,-0.30,0.10], size_mm = [20, 220, 200] },
]
cylinders = [{ name = "POST", at = [1,0,0, 0,1,0, 0,0,1, 0.32,0.36,0.15], diameter_mm = 50, length_mm = 300 }]
spheres = [{ name = "BALL", at = [1,0,0, 0,1,0, 0,0,1, 0.72,0.33,0.05], diameter_mm = 100 }]
[parts.BLOCK]
size_mm = [60, 40, 50]
mass_kg = 0.2
at = [1,0,0, 0,1,0, 0,0,1, 0.45,-0.10,0.025]
grasp = [1,0,0, 0,-1,0, 0,0,-1, 0,0,0]
[parts.ROD]
shape = "cylinder"
diameter_mm = 40
length_mm = 80
mass_kg = 0.2
at = [1,0,0, 0,1,0, 0,0,1, 0.60,-0.25,0.04]
[parts.WEDGE]
size_mm = [60, 60, 60]
mass_kg = 0.1
at = [0.8,0.6,0, -0.6,0.8,0, 0,0,1, 0.75,-0.02,0.03]
[frames]
nest = [1,0,0, 0,-1,0, 0,0,-1, 0.55,0.28,0.086]
rest = [1,0,0, 0,-1,0, 0,0,-1, 0.45,0.0,0.25]
[visions]
block = { part = "BLOCK" }
"""
PROGRAM = """VAR block, high, nest, over, rest : FRAME ; up : TRANS ;
BEGIN
  READ VISIONS (block) ;
  up = (1,0,0, 0,1,0, 0,0,1, 0,0,-0.10) ;
  AFFIX high TO block AT up ;
  AFFIX over TO nest AT up ;
  OPEN ARM_1 ;
  MOVE ARM_1 TO block WITH APPROACH = high ;
  GRASP ARM_1 ;
  AFFIX block TO ARM_1 ;
  MOVE block TO nest WITH DEPARTURE = high, WITH APPROACH = over ;
  OPEN ARM_1 ;
  UNFIX block FROM ARM_1 ;
  MOVE ARM_1 TO rest WITH DEPARTURE = over ;
END.
"""


def wedge() -> Mesh:
    """A prism over a triangle, 60 mm long."""
    ends = [(-0.03, 0.0, -0.03), (0.03, 0.0, -0.03), (-0.03, 0.0, 0.03)]
    vertices = np.array([(x, y, z) for y in (-0.03, 0.03) for x, _, z in ends])
    faces = np.array([(0, 1, 2), (3, 5, 4), (0, 3, 4), (0, 4, 1), (1, 4, 5), (1, 5, 2), (2, 5, 3), (2, 3, 0)])
    return Mesh(vertices=vertices, faces=faces, name="wedge.stl")


def torus(around: int, across: int) -> Mesh:
    """A ring of 100 mm, of as many triangles as wanted."""
    u, v = np.meshgrid(np.arange(around) * 2 * np.pi / around, np.arange(across) * 2 * np.pi / across, indexing="ij")
    r = 0.05 + 0.02 * np.cos(v)
    vertices = np.stack([r * np.cos(u), r * np.sin(u), 0.02 * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    a, b = i * across + j, (i + 1) % around * across + j
    c, d = (i + 1) % around * across + (j + 1) % across, i * across + (j + 1) % across
    faces = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]).reshape(-1, 3)
    return Mesh(vertices=vertices, faces=faces, name="ring.stl")


def with_solids(arm: Arm) -> Arm:
    """Give an arm solids of its own."""

    def along_z(size: tuple[float, float, float], at: tuple[float, float, float]) -> Solid:
        pose: Array = np.eye(4)
        pose[:3, 3] = at
        return Solid(shape=Box(size=np.array(size)), pose=pose)

    links = list(arm.links)
    links[1] = attrs.evolve(links[1], solids=(along_z((0.1, 0.1, 0.2), (0, 0, 0)),))
    links[2] = attrs.evolve(links[2], solids=(Solid(shape=Capsule(radius=0.04, length=0.4)),))
    return attrs.evolve(arm, links=tuple(links), base_solids=(along_z((0.2, 0.2, 0.3), (0, 0, 0.15)),))


def stocked_cell(folder: Path) -> Cell:
    """Return the cell; its part WEDGE is a mesh."""
    (folder / "cell.toml").write_text(CELL, encoding="utf-8")
    cell = read_cell(folder / "cell.toml")
    parts = {**cell.parts, "WEDGE": attrs.evolve(cell.parts["WEDGE"], shape=wedge())}
    return attrs.evolve(cell, parts=parts)


def stocked_run(folder: Path) -> Recording:
    """Return the run of a program in it, in which ARM_1 puts the block into the nest."""
    cell = stocked_cell(folder)
    compiled = translate(Source("stocked.rlo", PROGRAM), known_cell(cell))
    assert compiled.code is not None, [(one.code, one.message) for one in compiled.diagnostics]
    return interpret(compiled.code, cell, Simulator(cell))
