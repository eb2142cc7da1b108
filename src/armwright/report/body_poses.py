"""Where the bodies of a view are over time: what carries them, and what changes them there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from armwright.arrays import Array
from armwright.report.animation import Animation, ArmFigure, Body, MovedPart
from armwright.spatial.poses import between, from_noap

# What stretches has at least this length [m].
_FLAT = 1e-6


class PlacedBody(NamedTuple):
    """A body of a view over time.

    Attributes:
        name: its name.
        shape: its number among the shapes of the animation.
        tint: what colours it: ``fixture``, ``part``, or as in ``Body``.
        whose: number of its arm, or of the part.
        poses: (M, 4, 4) in the world, or (1, 4, 4) where it stands; what stretches is scaled along its z axis.
    """

    name: str
    shape: int
    tint: str
    whose: int
    poses: Array


def placed_bodies(animation: Animation) -> Iterator[PlacedBody]:
    """Yield all bodies of a view: what stands, the parts, and those of the arms."""
    for body in animation.fixtures:
        yield PlacedBody(body.name, body.shape, body.tint, 0, from_noap(body.pose)[None])
    frames = {name: frame_poses(figure) for name, figure in animation.arms.items()}
    tools = {name: poses[-1] for name, poses in frames.items()}
    for number, part in enumerate(animation.parts):
        yield PlacedBody(part.name, part.shape, "part", number, part_poses(part, animation.t, tools))
    for number, (name, figure) in enumerate(animation.arms.items()):
        for body in figure.bodies:
            X = frames[name][body.frame] @ body_change(body, figure) @ from_noap(body.pose)
            yield PlacedBody(body.name, body.shape, body.tint, number, X)


def body_change(body: Body, figure: ArmFigure) -> Array:
    """Return how a body is changed in the frame that carries it, (M, 4, 4).

    Fingers are moved by the opening; a rod is as long as its joint has shifted its link.
    """
    X = np.tile(np.eye(4), (len(figure.q), 1, 1))
    if body.slide and figure.grip is not None:
        X[:, 1, 3] = body.slide * figure.grip * figure.opening / 2
    if body.stretches:
        shift = figure.joints[body.frame].d + figure.q[:, body.frame]
        # It reaches from the frame to there, also backwards, and is not turned inside out, nor quite flat.
        X[:, 2, 2] = np.maximum(np.abs(shift), _FLAT)
        X[:, 2, 3] += np.minimum(shift, 0.0)
    return X


def frame_poses(figure: ArmFigure) -> list[Array]:
    """Return the poses (M, 4, 4) of the frames 0 to n of an arm and of its tool in the world, over time."""
    X = np.tile(from_noap(figure.base), (len(figure.q), 1, 1))
    poses = [X]
    for joint, values in zip(figure.joints, figure.q.T, strict=True):
        angle = joint.theta + (values if joint.revolute else 0.0)
        step = np.tile(np.eye(4), (len(values), 1, 1))
        c, s = np.cos(angle), np.sin(angle)
        step[:, 0, 0], step[:, 0, 1], step[:, 1, 0], step[:, 1, 1] = c, -s, s, c
        step[:, 2, 3] = joint.d + (0.0 if joint.revolute else values)
        X = X @ step @ from_noap(joint.behind)
        poses.append(X)
    return [*poses, X @ from_noap(figure.tool)]


def part_poses(part: MovedPart, t: Array, tools: Mapping[str, Array]) -> Array:
    """Return the poses (M, 4, 4) of a part in the world, over time."""
    rows = np.maximum(np.searchsorted(part.times, t + 1e-6, side="right") - 1, 0)
    poses = np.empty((len(t), 4, 4))
    for i, row in enumerate(rows.tolist()):
        X, arm = from_noap(part.poses[row]), part.arms[row]
        if arm is None and part.changes_evenly and part.arms[row + 1 : row + 2] == [None]:
            begin, end = part.times[row : row + 2]
            X = between(X, from_noap(part.poses[row + 1]), np.clip((t[i] - begin) / (end - begin), 0.0, 1.0))
        poses[i] = X if arm is None else tools[arm][i] @ X
    return poses
