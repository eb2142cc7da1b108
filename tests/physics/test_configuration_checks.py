"""The nearest bodies of a cell at configurations of its arms: of all pairs, and as far apart as coal says."""

from pathlib import Path

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.part_poses import PartPoses
from armwright.kinematics.forward_kinematics import link_poses
from armwright.physics.cell_bodies import Body
from armwright.physics.collisions import CellCollisions
from armwright.physics.placed_bodies import CellBodies
from armwright.spatial.shapes import Mesh
from oracles.arms import random_configurations
from oracles.solids import coal_distance, coal_shape
from oracles.stocked_cell import stocked_cell
from samples import Sample

# Distances of round solids are found by iteration, here and in coal [m].
ITERATED = 1e-5


def test_nearest_of_all_pairs(tmp_path: Path, sample: Sample) -> None:
    """Of all pairs the nearest is found, or the one that is deepest; None stands for none so near."""
    cell = stocked_cell(tmp_path)
    checks = CellCollisions(cell).at_configurations(PartPoses(cell))
    deep = none = wrong = 0
    for rng in sample.cases(900):
        q = {name: random_configurations(arm.arm, rng, 1)[0] for name, arm in cell.arms.items()}
        within = 10 ** rng.uniform(-3, -0.3)

        found = checks.nearest(q, within)
        least = checks.distances_of(q, within).min()

        deep, none = deep + (least < 0), none + (found is None)
        wrong += not np.isclose(within if found is None else found.distance, least, rtol=0, atol=1e-6)
    sample.record("nearest bodies of two arms, of all pairs", sample.count(900), wrong)
    assert deep > 0
    assert none > 0
    assert wrong == 0


def coal_nearest(cell: Cell, bodies: list[Body], pairs: list[tuple[int, int]], q: dict[str, Array]) -> float:
    """The least distance of all pairs without meshes, by coal."""
    frames = {name: arm.base @ link_poses(arm.arm, q[name]) for name, arm in cell.arms.items()}
    solids = [None if isinstance(body.solid.shape, Mesh) else coal_shape(body.solid.shape) for body in bodies]
    poses = [body.solid.pose if body.arm is None else frames[body.arm][body.link] @ body.solid.pose for body in bodies]
    return min(coal_distance(solids[a], poses[a], solids[b], poses[b]) for a, b in pairs if solids[a] and solids[b])


def test_nearest_by_coal(tmp_path: Path, sample: Sample) -> None:
    """Where no bodies overlap, the nearest are as far apart as coal says."""
    cell = stocked_cell(tmp_path)
    cell = attrs.evolve(cell, parts={name: it for name, it in cell.parts.items() if not isinstance(it.shape, Mesh)})
    checks, placed = CellCollisions(cell).at_configurations(PartPoses(cell)), CellBodies(cell)
    bodies = placed.arranged(PartPoses(cell))
    apart, worst = 0, 0.0
    for rng in sample.cases(300):
        q = {name: random_configurations(arm.arm, rng, 1)[0] for name, arm in cell.arms.items()}
        by_coal = coal_nearest(cell, bodies, placed.pairs(bodies), q)
        if by_coal <= 0:
            continue
        apart += 1
        found = checks.nearest(q, 1.0)
        assert found is not None
        worst = max(worst, abs(found.distance - by_coal))
    sample.record("nearest bodies of two arms, by coal", apart, 0, worst=worst)
    assert apart > 0
    assert worst < ITERATED
