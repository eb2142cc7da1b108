"""The chain in a URDF file: from a base link to a tip link, and what hangs on every link of it."""

from __future__ import annotations

from collections.abc import Iterator

import attrs
import numpy as np

from armwright.arm.dh import carry
from armwright.arm.model import Link
from armwright.arm.urdf.geometry import has_unread_shapes, solids_of
from armwright.arm.urdf.robot import Robot, UrdfJoint, axis_of, body_of
from armwright.arrays import Array
from armwright.errors import one_of
from armwright.files.limits import limit, limit_message
from armwright.spatial.shapes import LARGEST_SIZE, Solid

# Of links and joints, a message lists this many.
_MAX_LISTED = 50


@attrs.frozen(kw_only=True, eq=False)
class MovingJoint:
    """A joint of the chain that moves, in the frame of the base link, all joints at 0.

    Attributes:
        joint: the joint.
        X_BJ: (4, 4) the frame of the joint.
        axis: (3,) its axis, a unit vector.
        bodies: of all links that it moves and no later joint does.
    """

    joint: UrdfJoint
    X_BJ: Array
    axis: Array
    bodies: tuple[Link, ...]


@attrs.frozen(kw_only=True, eq=False)
class Chain:
    """The chain from one link to another, all joints at 0.

    Attributes:
        base: name of the first link.
        tip: name of the last link.
        moving: the joints that move, from the base to the tip.
        X_BT: (4, 4) the tip seen from the base.
        X_RB: (4, 4) the base seen from the root of the tree.
        base_solids: of all links that are fixed to the base, in its frame.
        notes: sentences on what was chosen.
    """

    base: str
    tip: str
    moving: tuple[MovingJoint, ...]
    X_BT: Array
    X_RB: Array
    base_solids: tuple[Solid, ...] = ()
    notes: tuple[str, ...] = ()


def chain_of(robot: Robot, base: str | None = None, tip: str | None = None) -> Chain:
    """Return the chain between two links.

    Args:
        robot: the file.
        base: name of the first link; the one that hangs on nothing when left out.
        tip: name of the last link; when left out the only one at the end of moving joints, or the link that carries
            all of them.

    Raises:
        UnknownNameError: there is no link of that name.
        FileFormatError: it is not clear which link is meant, nothing moves between them, or a joint is none of an arm.
    """
    base = _root(robot) if base is None else one_of("link", base, robot.links)
    notes: tuple[str, ...] = ()
    if tip is None:
        tip, notes = _default_tip(robot, base)
    one_of("link", tip, robot.links)
    path = _joint_path(robot, base, tip)
    for joint in path:
        joint.require_serial()
    movable = [joint for joint in path if not joint.fixed]
    if not movable:
        raise robot.error(f"no joint moves between the links '{base}' and '{tip}'")
    if len(movable) > limit("joints"):
        raise robot.error(f"too many joints between '{base}' and '{tip}': {limit_message('joints', len(movable))}")
    X, moving = np.eye(4), []
    branches: list[UrdfJoint] = []
    unread: list[str] = []
    # What moves beside the chain and hangs on the base is no load of the arm.
    standing = list(_rigid_bodies(robot, base, X, [], unread))
    for joint in path:
        X = X @ joint.origin
        if not joint.fixed:
            bodies = tuple(_rigid_bodies(robot, joint.child, X, branches, unread))
            moving.append(MovingJoint(joint=joint, X_BJ=X, axis=X[:3, :3] @ axis_of(joint), bodies=bodies))
    _refuse_loads(robot, [joint for joint in branches if joint not in movable])
    X_RB, root = np.eye(4), base
    while root in robot.parent_joints:
        root = robot.parent_joints[root].parent
    for joint in _joint_path(robot, root, base):
        X_RB = X_RB @ joint.origin
    if unread:
        kinds = f"boxes, cylinders, spheres and capsules up to {LARGEST_SIZE:g} m"
        notes += (f"of shapes, {kinds} are read; links with others: {_listed(unread)}",)
    notes += tuple(robot.meshes.notes())
    solids = tuple(solid for body in standing for solid in body.solids)
    return Chain(base=base, tip=tip, moving=tuple(moving), X_BT=X, X_RB=X_RB, base_solids=solids, notes=notes)


def _root(robot: Robot) -> str:
    roots = [name for name in robot.links if name not in robot.parent_joints]
    if len(roots) > 1:
        raise robot.error(f"the base link is ambiguous: it could be {_listed(roots)}; specify one as base (--base)")
    return roots[0]


def _default_tip(robot: Robot, base: str) -> tuple[str, tuple[str, ...]]:
    """Return the only link that ends a chain, and notes; one that is fixed to the base ends none.

    Where several ends are fixed to one another, the link that carries all of them is the end: it moves as they do.
    """
    ends = []
    pending = [(base, False)]
    while pending:
        link, moves = pending.pop()
        pending += [(joint.child, moves or not joint.fixed) for joint in reversed(robot.child_joints[link])]
        if moves and not robot.child_joints[link]:
            ends.append(link)
    if not ends:
        raise robot.error(f"no joint moves a link below '{base}'")
    if len(ends) == 1:
        return ends[0], ()
    carrier = _carrier(robot, base, ends)
    if carrier is None:
        raise robot.error(
            f"the tip link is ambiguous: it could be {_listed(ends)}; specify one as tip: "
            f"load_urdf(path, tip='{ends[0]}'), or armwright convert {robot.path} --tip {ends[0]} -o arm.toml"
        )
    note = f"the tool is '{carrier}', which carries {_listed(ends)}; each moves as it does and may be the tip (--tip)"
    return carrier, (note,)


def _carrier(robot: Robot, base: str, ends: list[str]) -> str | None:
    """Return the last link that all ends hang on, if no joint moves between it and them, else None."""
    paths = [_joint_path(robot, base, end) for end in ends]
    common = [row[0] for row in zip(*paths, strict=False) if all(joint is row[0] for joint in row)]
    rigid = all(joint.fixed for path in paths for joint in path[len(common) :])
    return common[-1].child if common and rigid else None


def _joint_path(robot: Robot, base: str, tip: str) -> list[UrdfJoint]:
    """Return the joints from the base to the tip."""
    path: list[UrdfJoint] = []
    link = tip
    while link != base:
        if link not in robot.parent_joints:
            raise robot.error(f"link '{tip}' is not below link '{base}'")
        path.append(robot.parent_joints[link])
        link = robot.parent_joints[link].parent
    return path[::-1]


def _rigid_bodies(robot: Robot, link: str, X_BL: Array, branches: list[UrdfJoint], unread: list[str]) -> Iterator[Link]:
    """Walk through the bodies that are fixed to a link and to one another, in the frame of the base.

    Joints that move and hang on one of them are put into ``branches``, links with shapes that are not read into
    ``unread``.
    """
    pending = [(link, X_BL)]
    while pending:
        name, X = pending.pop()
        element = robot.links[name]
        unread += [name] if has_unread_shapes(element, robot.meshes) else []
        yield carry(attrs.evolve(body_of(element), solids=solids_of(element, robot.meshes)), X)
        for joint in robot.child_joints[name]:
            if joint.fixed:
                pending.append((joint.child, X @ joint.origin))
            else:
                branches.append(joint)


def _refuse_loads(robot: Robot, branches: list[UrdfJoint]) -> None:
    """Refuse joints beside the chain that carry something: how that moves, a serial arm does not know."""
    loaded = [joint for joint in branches if _carries_mass(robot, joint)]
    if loaded:
        single, names = len(loaded) == 1, [joint.name for joint in loaded]
        does = "joint lies beside the chain, moves and has" if single else "joints lie beside the chain, move and have"
        raise loaded[0].element.error(
            "",
            f"{len(loaded)} {does} mass to carry: {_listed(names)}. An arm has no branches: choose another tip, or "
            f"lock {'it' if single else 'them'}, at 0 or elsewhere: lock={names} (--lock {','.join(names)})",
        )


def _carries_mass(robot: Robot, joint: UrdfJoint) -> bool:
    pending = [joint.child]
    while pending:
        name = pending.pop()
        body = body_of(robot.links[name])
        if body.mass or body.inertia.any() or body.unknown:
            return True
        pending += [child_joint.child for child_joint in robot.child_joints[name]]
    return False


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - _MAX_LISTED:,} more" if len(names) > _MAX_LISTED else ""
    return ", ".join(f"'{name}'" for name in names[:_MAX_LISTED]) + more
