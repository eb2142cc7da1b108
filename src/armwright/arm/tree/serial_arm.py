"""The serial arm that a chain of links is."""

from __future__ import annotations

import math
from collections.abc import Sequence

import attrs
import numpy as np

from armwright.arm.dh import carry
from armwright.arm.gravity import felt_gravity, vector_text
from armwright.arm.model import UPRIGHT_GRAVITY, Arm, GravityFrom, Joint, JointKind, Link
from armwright.arm.tensors import impossible_moments
from armwright.arm.tree.axes import Frames, cleared, cleared_pose, frames_of, length_of
from armwright.arm.tree.chain import Chain, chain_of
from armwright.arm.tree.kinematic_tree import Tree
from armwright.arrays import Array
from armwright.spatial.poses import inverse
from armwright.spatial.shapes import Solid

# Axes that are this near to parallel were meant to be [rad]: a half turn typed as 3.1416 is 0.7e-5 rad off.
_MEANT_PARALLEL = 1e-4
# A joint that turns farther, or an arm that is longer, is probably given in another unit [rad], [m].
_TURNED_FAR, _LONG = 4 * math.pi, 200.0


@attrs.frozen(kw_only=True)
class Reading:
    """What a file of links and joints gives.

    Attributes:
        arm: the arm.
        notes: sentences on what was not taken as it stands.
    """

    arm: Arm
    notes: tuple[str, ...]


def serial_arm(
    tree: Tree, base: str | None, tip: str | None, gravity: Array, gravity_from: GravityFrom = "root"
) -> Reading:
    """Return the serial arm between two links of a tree.

    Args:
        tree: the links and joints.
        base: name of the link that stands still; the tree's own when left out.
        tip: name of the link that is the tool; see ``chain_of`` for what it is when left out.
        gravity: (3,) acceleration of free fall along the axes of the root link [m/s²].
        gravity_from: who says so.

    Raises:
        UnknownNameError: there is no link of that name.
        FileFormatError: there is no such arm.
    """
    chain = chain_of(tree, base, tip)
    poses = [each.X_BJ for each in chain.moving]
    size = length_of(poses, chain.X_BT)
    frames = frames_of(poses, [each.axis for each in chain.moving], chain.X_BT, size)
    joints, links, motors, notes = [], [], [], [*chain.notes, *_leaning(chain, frames)]
    for moving, row, X in zip(chain.moving, frames.rows, frames.poses, strict=True):
        limits, unknown = moving.joint.limits()
        motor, ignored = moving.joint.motor()
        spring, not_linear = moving.joint.spring()
        kind: JointKind = "prismatic" if moving.joint.prismatic else "revolute"
        joints.append(Joint(kind=kind, **attrs.asdict(row), limits=limits, spring=spring, name=moving.joint.name))
        links.append(attrs.evolve(_link(moving.bodies, X, size), name=moving.joint.child))
        motors.append(motor)
        notes += [*unknown, *not_linear, *ignored]
    arm = Arm(
        name=tree.name,
        joints=joints,
        links=links,
        motors=motors,
        base=cleared_pose(frames.first, size),
        tool=cleared_pose(inverse(frames.poses[-1]) @ chain.X_BT, size),
        gravity=felt_gravity(chain.X_RB, gravity),
        gravity_from=gravity_from,
        base_solids=chain.base_solids,
        base_link=chain.base,
        tool_link=chain.tip,
        source=f"{tree.path.name}, link '{chain.base}' to link '{chain.tip}'",
    )
    if not np.array_equal(arm.gravity, UPRIGHT_GRAVITY):
        says = "gravity points downwards in the root link of the file" if gravity_from == "root" else "gravity"
        notes.append(f"{says}: {vector_text(arm.gravity)} along the axes of '{chain.base}'")
    return Reading(arm=arm, notes=(*notes, *_doubtful_units(arm, size)))


def _doubtful_units(arm: Arm, size: float) -> list[str]:
    """Say what is so large that it may be in degrees or millimetres."""
    notes = [f"the arm is {size:g} m long; are its lengths in millimetres?"] if size > _LONG else []
    for i, joint in enumerate(arm.joints):
        farthest = max((abs(x) for x in (joint.limits.lower, joint.limits.upper) if math.isfinite(x)), default=0.0)
        if joint.revolute and farthest > _TURNED_FAR:
            turns = farthest / math.tau
            notes.append(
                f"{arm.joint_label(i)} goes to {farthest:g} rad, {turns:.1f} revolutions; are its limits in degrees?"
            )
    return notes


def _link(bodies: Sequence[Link], X_BL: Array, size: float) -> Link:
    """Weld bodies that are given in the frame of the base, and see them from the frame of a link."""
    X_LB = inverse(X_BL)
    solids = [_cleared(solid.moved(X_LB), size) for body in bodies for solid in body.solids]
    unknown = [body for body in bodies if body.unknown]
    if unknown:
        return attrs.evolve(unknown[0], solids=solids)
    whole = _welded([body for body in bodies if body.mass or body.inertia.any()])
    seen = carry(attrs.evolve(whole, solids=()), X_LB)
    # What has no mass has no centre of mass either; it is put at the origin.
    com = cleared(seen.com, size) if seen.mass else np.zeros(3)
    inertia = cleared(seen.inertia, float(np.abs(seen.inertia).max()))
    known = impossible_moments(seen.mass, com, inertia) is None
    return Link(mass=seen.mass, com=com, inertia=inertia, complete=known, solids=solids)


def _cleared(solid: Solid, size: float) -> Solid:
    return attrs.evolve(solid, pose=cleared_pose(solid.pose, size))


def _welded(bodies: Sequence[Link]) -> Link:
    """Return bodies that are given in one frame as one."""
    if len(bodies) == 1:
        return bodies[0]
    mass = sum(body.mass for body in bodies)
    com = sum((body.mass * body.com for body in bodies), start=np.zeros(3)) / (mass or 1.0)
    inertia = np.zeros((3, 3))
    for body in bodies:
        r = body.com - com
        inertia += body.inertia + body.mass * ((r @ r) * np.eye(3) - np.outer(r, r))
    return Link(mass=mass, com=com, inertia=inertia, complete=False)


def _leaning(chain: Chain, frames: Frames) -> list[str]:
    """Say which axes are nearly parallel, and so were probably meant to be."""
    return [
        f"joints '{first.joint.name}' and '{second.joint.name}': their axes deviate by {angle:.1e} rad from "
        "parallel, which is preserved; if they should be parallel, write their angles with more digits"
        for first, second, angle in zip(chain.moving, chain.moving[1:], frames.leaning, strict=False)
        if 0 < angle < _MEANT_PARALLEL
    ]
