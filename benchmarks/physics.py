"""Cells with physics, their time in the processor beside the time that they simulate: one arm, two arms, many parts."""

from measure import progress, section, table  # isort: skip - sets the threads first

import statistics
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np

import armwright.program
from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.physics.world import PhysicsCell
from armwright.spatial.poses import homogeneous

EXAMPLES = Path(__file__).parents[1] / "examples"
ROUNDS, SECONDS = 5, 5.0
# One arm takes a part from its place to another one and back again.
ONE_ARM = """
VAR part, there, back, high, above : FRAME ;
    i : SCALAR ;
BEGIN
  part  = (1,0,0, 0,-1,0, 0,0,-1, 0.40, 0.20, 0.05) ;
  there = (1,0,0, 0,-1,0, 0,0,-1, 0.40,-0.20, 0.0505) ;
  back  = part * XYZ(0, 0, -0.0005) ;
  FOR i = 1 TO 4 DO
  BEGIN
    high = part * XYZ(0, 0, -0.08) ;
    above = there * XYZ(0, 0, -0.08) ;
    OPEN ARM_1 ;
    MOVE ARM_1 TO part WITH APPROACH = high ;
    GRASP ARM_1 ;
    AFFIX part TO ARM_1 ;
    MOVE part TO there WITH DEPARTURE = high, WITH APPROACH = above ;
    OPEN ARM_1 ;
    UNFIX part FROM ARM_1 ;
    MOVE ARM_1 TO above STRAIGHTLY ;
    above = there ;
    there = back ;
    back = above ;
  END
END.
"""


def with_more_parts(cell: Cell, count: int) -> Cell:
    """Return a cell with so many parts more, which stand on its table beside the others."""
    part = cell.parts["PART"]
    poses = [homogeneous(np.eye(3), (0.40 + 0.10 * (i // 2), -0.35 if i % 2 else 0.40, 0.05)) for i in range(count)]
    names = [f"SPARE_{i}" for i in range(count)]
    more = {name: attrs.evolve(part, name=name, pose=X) for name, X in zip(names, poses, strict=True)}
    return attrs.evolve(cell, parts={**cell.parts, **more})


def seconds(program: Any, **hardware: Any) -> tuple[float, float]:
    """Return the median time in the processor of a run [s], after one to warm up, and the time that it simulates."""
    taken = []
    for _ in range(ROUNDS + 1):
        start = time.process_time()
        recording = armwright.program.run(program, **hardware)
        taken.append(time.process_time() - start)
    return statistics.median(taken[1:]), recording.duration


def at_rest(cell: Cell) -> float:
    """Return the median time in the processor of a world in which nothing moves, recorded, by the time simulated."""
    taken = []
    for _ in range(ROUNDS):
        world = PhysicsCell(cell)
        world.advance(1.0)
        start = time.process_time()
        world.advance(1.0 + SECONDS)
        taken.append(time.process_time() - start)
    return statistics.median(taken) / SECONDS


def main() -> None:
    """Measure and print."""
    two = read_cell(EXAMPLES / "hand_over_cell.toml")
    one = attrs.evolve(two, arms={"ARM_1": two.arms["ARM_1"]}, fixtures={"TABLE": two.fixtures["TABLE"]})
    hand_over = (EXAMPLES / "hand_over.rlo").read_text(encoding="utf-8")
    works: Mapping[str, tuple[Cell, str]] = {
        "one arm, one part": (one, ONE_ARM),
        "one arm, eight parts": (with_more_parts(one, 7), ONE_ARM),
        "two arms, one part": (two, hand_over),
        "two arms, eight parts": (with_more_parts(two, 7), hand_over),
    }
    rows = []
    for title, (cell, text) in works.items():
        progress(title)
        program = armwright.program.compile(armwright.program.Source("bench.rlo", text), cell)
        planned, _ = seconds(program)
        whole, duration = seconds(program, hardware=PhysicsCell)
        rest = at_rest(cell)
        times = [duration, duration / whole, duration / (whole - planned), 1 / rest]
        rows.append([title, *(f"{number:.1f}" for number in times)])
    section(
        "Cells with physics",
        "Stanford arms that carry parts, with servo ticks and steps of 1 ms, mishaps looked for and everything "
        "recorded; in times real time, by the time of the processor. A whole run plans its moves and checks them for "
        "collisions; the third column is without that, and in the last one nothing moves.",
        table(["world", "simulated, s", "whole run", "without planning", "at rest"], rows),
    )


if __name__ == "__main__":
    main()
