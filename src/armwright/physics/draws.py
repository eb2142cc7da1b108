"""What is drawn for a world: where parts and frames are that have a spread."""

from __future__ import annotations

from collections.abc import Mapping

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.frames import WORLD
from armwright.cell.model import Cell
from armwright.cell.scene import Fixture, Part, Spread
from armwright.spatial.poses import homogeneous, inverse
from armwright.spatial.rotations import rotation_from_vector


def drawn_parts(cell: Cell, rng: np.random.Generator) -> dict[str, Part]:
    """Return the parts of a cell where they stand in a world: each drawn from its spread."""
    parts = {}
    for name, part in cell.parts.items():
        parts[name] = attrs.evolve(part, pose=drawn_pose(part.pose, part.spread, rng))
    return parts


def drawn_frames(cell: Cell, rng: np.random.Generator) -> dict[str, Array]:
    """Return where the frames of a cell are in a world, (4, 4): each drawn from its spread, others move with it."""
    tree = cell.tree()
    poses = {WORLD: np.eye(4)}
    for name in tree:
        if name == WORLD:
            continue
        parent = tree.ancestors(name)[0]
        poses[name] = poses[parent] @ tree.relation(name, parent)
        if name in cell.spreads:
            poses[name] = drawn_pose(poses[name], cell.spreads[name], rng)
    return poses


def drawn_pose(X: Array, spread: Spread, rng: np.random.Generator) -> Array:
    """Return a pose (4, 4) in the world near another one."""
    x, y, yaw = rng.uniform(-1.0, 1.0, 3) * (spread.position, spread.position, spread.yaw)
    turned = rotation_from_vector(np.array([0.0, 0.0, yaw])) @ X[:3, :3]
    if spread.tilt:
        direction, tilt = rng.uniform(-np.pi, np.pi), spread.tilt * rng.uniform(-1.0, 1.0)
        turned = rotation_from_vector(tilt * np.array([np.cos(direction), np.sin(direction), 0.0])) @ turned
    return homogeneous(turned, X[:3, 3] + (x, y, 0.0))


def placed_fixtures(cell: Cell, frames: Mapping[str, Array]) -> dict[str, Fixture]:
    """Return the bodies of a scene where they stand in a world whose frames are there."""
    tree, fixtures = cell.tree(), {}
    for name, fixture in cell.fixtures.items():
        X = frames[fixture.on] @ inverse(tree.world(fixture.on)) @ fixture.pose
        fixtures[name] = attrs.evolve(fixture, pose=X)
    return fixtures
