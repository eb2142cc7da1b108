"""The figure of an arm on a page: its solids, or guessed ones, its joints and its gripper."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arm.reach import stretched_length
from armwright.arrays import Array
from armwright.cell.scene import Gripper
from armwright.physics.cell_bodies import Body as SolidBody, arm_bodies, has_solids
from armwright.physics.hand_solids import gripper_length, gripper_solids
from armwright.report.animation import ArmFigure, Body, ChainJoint
from armwright.report.shape_table import ShapeTable
from armwright.spatial.poses import homogeneous, to_noap
from armwright.spatial.rotations import rotation_with_z
from armwright.spatial.shapes import Box, Capsule, Cylinder, Shape, Sphere, support

# Where nothing is checked for collisions, guessed links are drawn slimmer, towards the tool more so.
_SLIM = (0.8, 0.45)
# Radius and length of the drum of a joint, by the radius of its link; that of a link as it is checked is a cap.
_DRUM, _CAP = (1.35, 2.05), (0.8, 2.25)
# Radius of what holds a slide, by the radius of its link.
_ROD = 0.7
# Length of the fingers by the length of the arm, and at most by the way from the last link to the tool.
_FINGER, _FINGER_OF_TOOL = 0.06, 0.9
# A base above the floor stands on a column if its axis is as upright as this.
_UPRIGHT = 0.9


class Placed(NamedTuple):
    """An arm where it stands.

    Attributes:
        arm: the arm, with n joints.
        base: (4, 4) pose of its base frame in the world.
        floor: height of what it stands on [m].
        gripper: what it holds parts with; None where nothing is known of it.
        as_checked: whether guessed links are drawn as they are checked for collisions.
    """

    arm: Arm
    base: Array = np.eye(4)
    floor: float = 0.0
    gripper: Gripper | None = None
    as_checked: bool = False


def arm_figure(name: str, placed: Placed, q: Array, grip: Array | None, shapes: ShapeTable) -> ArmFigure:
    """Return the figure of an arm.

    Args:
        name: its name.
        placed: the arm and where it stands.
        q: (M, n) joint positions at the instants of the animation [rad] or [m].
        grip: (M,) opening of the fingers, 0 to 1; None of an arm without a gripper.
        shapes: collects the shapes of the page.
    """
    arm = placed.arm
    opening = opening_of(placed)
    drawn = [*_links(name, placed), *(() if grip is None else _gripper(name, placed, opening))]
    return ArmFigure(
        q=q,
        base=to_noap(placed.base @ arm.base),
        joints=[
            ChainJoint(revolute=joint.revolute, theta=joint.theta, d=joint.d, behind=to_noap(joint.behind))
            for joint in arm.joints
        ],
        tool=to_noap(arm.tool),
        bodies=[attrs.evolve(body, shape=shapes.number(shape)) for body, shape in drawn],
        grip=grip,
        opening=opening,
    )


def opening_of(placed: Placed) -> float:
    """Return the distance between the open fingers of an arm [m]; where nothing is known, one that fits its length."""
    return _finger_length(placed.arm) if placed.gripper is None else placed.gripper.opening


def _links(name: str, placed: Placed) -> Iterator[tuple[Body, Shape]]:
    arm = placed.arm
    solids = arm_bodies(name, arm, placed.gripper)
    if has_solids(arm):
        for body in solids:
            yield _body(body.name, body.solid.pose, body.link, "base" if body.link == 0 else "link"), body.solid.shape
    else:
        yield from _guessed(name, placed, solids)
    yield from _column(name, placed)


def _guessed(name: str, placed: Placed, solids: list[SolidBody]) -> Iterator[tuple[Body, Shape]]:
    """Yield the guessed links of an arm with a drum on the axis of every joint, and what leads to its tool."""
    arm = placed.arm
    radii = np.zeros(arm.n + 1)
    shares = np.ones(arm.n + 1) if placed.as_checked else np.array([1.0, *np.linspace(*_SLIM, arm.n)])
    for body in solids:
        shape = body.solid.shape
        if isinstance(shape, Capsule | Sphere):
            shape = attrs.evolve(shape, radius=shape.radius * shares[body.link])
            radii[body.link] = max(radii[body.link], shape.radius)
        yield _body(body.name, body.solid.pose, body.link, "base" if body.link == 0 else "link"), shape
    radius, length = _CAP if placed.as_checked else _DRUM
    for i in range(1, arm.n + 1):
        # A link without length has no body; its joint is as wide as the link before it.
        radii[i] = radii[i] or radii[i - 1] or radii.max()
    for i in range(arm.n):
        shape = Cylinder(radius=radius * radii[i + 1], length=length * radii[i + 1])
        yield _body(f"{name} joint {i + 1}", np.eye(4), i, "joint"), shape
        if not arm.joints[i].revolute:
            rod = _body(f"{name} slide {i + 1}", homogeneous(np.eye(3), [0.0, 0.0, 0.5]), i, "link")
            yield attrs.evolve(rod, stretches=True), Cylinder(radius=_ROD * radii[i + 1], length=1.0)
    way = float(np.linalg.norm(arm.tool[:3, 3]))
    if way > radii[-1]:
        # From the origin of the last link towards the tool, as far as the palm.
        behind = _finger_length(arm) if placed.gripper is None else gripper_length(placed.gripper)
        length = max(way - behind, 0.2 * way)
        z = arm.tool[:3, 3] / way
        pose = homogeneous(rotation_with_z(z), z * length / 2)
        yield _body(f"{name} tool", pose, arm.n, "link"), Cylinder(radius=0.8 * radii[-1], length=length)


def _column(name: str, placed: Placed) -> Iterator[tuple[Body, Shape]]:
    """Yield the column below a base that stands above the floor: from the floor to its lowest solid, or its origin."""
    X = placed.base @ placed.arm.base
    solids = [(placed.base @ solid.pose, solid.shape) for solid in placed.arm.base_solids]
    bottoms = [float(Y[2, 3]) - support(shape, -Y[2, :3]) for Y, shape in solids]
    high = min(bottoms, default=float(X[2, 3])) - placed.floor
    if X[2, 2] > _UPRIGHT and high > 1e-3:
        radius = 0.05 * stretched_length(placed.arm)
        pose = np.linalg.inv(X) @ homogeneous(np.eye(3), [X[0, 3], X[1, 3], placed.floor + high / 2])
        yield _body(f"{name} column", pose, 0, "base"), Cylinder(radius=radius, length=high)


def _gripper(name: str, placed: Placed, opening: float) -> Iterator[tuple[Body, Shape]]:
    """Yield fingers that point along a of the tool and open along o, or a cup; the tool is between their tips."""
    tool, finger = placed.arm.n + 1, _finger_length(placed.arm)
    if placed.gripper is not None:
        # As it is checked for collisions; closed fingers are half their own thickness aside.
        for it in gripper_solids(placed.gripper, 0.0):
            body = _body(f"{name} {it.name}", it.pose, tool, "joint" if it.grips else "link")
            if it.name == "finger":
                body = attrs.evolve(body, slide=1 if it.pose[1, 3] > 0 else -1)
            yield body, it.shape
        return
    thick = 0.14 * finger
    palm = Box(size=[0.34 * finger, opening + 2 * thick, 0.2 * finger])
    yield _body(f"{name} palm", homogeneous(np.eye(3), [0.0, 0.0, -1.08 * finger]), tool, "link"), palm
    for side in (-1, 1):
        pose = homogeneous(np.eye(3), [0.0, side * thick / 2, -0.45 * finger])
        body = _body(f"{name} finger", pose, tool, "joint")
        yield attrs.evolve(body, slide=side), Box(size=[0.26 * finger, thick, 1.1 * finger])


def _body(name: str, pose: Array, frame: int, tint: str) -> Body:
    return Body(name=name, shape=0, pose=to_noap(pose), frame=frame, tint=tint)  # type: ignore[arg-type]


def _finger_length(arm: Arm) -> float:
    wanted, way = _FINGER * stretched_length(arm), float(np.linalg.norm(arm.tool[:3, 3]))
    return min(wanted, _FINGER_OF_TOOL * way) if way > 0.3 * wanted else wanted
