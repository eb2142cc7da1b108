"""The chain in a URDF file: from a base link to a tip link, and what hangs on every link of it."""

from __future__ import annotations

from collections.abc import Iterator

import attrs
import numpy as np

from armwright.arm.dh import carry
from armwright.arm.model import Link
from armwright.arm.urdf.robot import Robot, UrdfJoint, axis_of, body_of
from armwright.arrays import Array
from armwright.errors import one_of
from armwright.files.limits import limit, limit_message

# Of links and joints, a message lists this many.
_MAX_LISTED = 50


@attrs.frozen(kw_only=True, eq=False)
class Moving:
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
        notes: sentences on what was chosen.
    """

    base: str
    tip: str
    moving: tuple[Moving, ...]
    X_BT: Array
    X_RB: Array
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
        tip, notes = _only_end(robot, base)
    one_of("link", tip, robot.links)
    route = _route(robot, base, tip)
    for joint in route:
        joint.require_serial()
    stops = [joint for joint in route if not joint.fixed]
    if not stops:
        raise robot.error(f"no joint moves between the links '{base}' and '{tip}'")
    if len(stops) > limit("joints"):
        raise robot.error(f"too many joints between '{base}' and '{tip}': {limit_message('joints', len(stops))}")
    X, moving = np.eye(4), []
    beside: list[UrdfJoint] = []
    for joint in route:
        X = X @ joint.origin
        if not joint.fixed:
            bodies = tuple(_rigid_with(robot, joint.child, X, beside))
            moving.append(Moving(joint=joint, X_BJ=X, axis=X[:3, :3] @ axis_of(joint), bodies=bodies))
    _refuse_loads(robot, [joint for joint in beside if joint not in stops])
    X_RB = np.eye(4)
    for joint in _route(robot, _top(robot, base), base):
        X_RB = X_RB @ joint.origin
    return Chain(base=base, tip=tip, moving=tuple(moving), X_BT=X, X_RB=X_RB, notes=notes)


def _root(robot: Robot) -> str:
    roots = [name for name in robot.links if name not in robot.above]
    if len(roots) > 1:
        raise robot.error(f"the base link is ambiguous: it could be {_listed(roots)}; specify one as base (--base)")
    return roots[0]


def _top(robot: Robot, link: str) -> str:
    while link in robot.above:
        link = robot.above[link].parent
    return link


def _only_end(robot: Robot, base: str) -> tuple[str, tuple[str, ...]]:
    """Return the only link that ends a chain, and notes; one that is fixed to the base ends none.

    Where several ends are fixed to one another, the link that carries all of them is the end: it moves as they do.
    """
    ends = []
    pending = [(base, False)]
    while pending:
        link, moves = pending.pop()
        pending += [(joint.child, moves or not joint.fixed) for joint in reversed(robot.below[link])]
        if moves and not robot.below[link]:
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
    return carrier, (
        f"the tool is '{carrier}', which carries {_listed(ends)}; each moves as it does and may be the tip (--tip)",
    )


def _carrier(robot: Robot, base: str, ends: list[str]) -> str | None:
    """Return the last link that all ends hang on, if no joint moves between it and them, else None."""
    routes = [_route(robot, base, end) for end in ends]
    common = [row[0] for row in zip(*routes, strict=False) if all(joint is row[0] for joint in row)]
    rigid = all(joint.fixed for route in routes for joint in route[len(common) :])
    return common[-1].child if common and rigid else None


def _route(robot: Robot, base: str, tip: str) -> list[UrdfJoint]:
    """Return the joints from the base to the tip."""
    route: list[UrdfJoint] = []
    link = tip
    while link != base:
        if link not in robot.above:
            raise robot.error(f"link '{tip}' is not below link '{base}'")
        route.append(robot.above[link])
        link = robot.above[link].parent
    return route[::-1]


def _rigid_with(robot: Robot, link: str, X_BL: Array, beside: list[UrdfJoint]) -> Iterator[Link]:
    """Walk through the bodies that are fixed to a link and to one another, in the frame of the base.

    Joints that move and hang on one of them are put into ``beside``.
    """
    pending = [(link, X_BL)]
    while pending:
        name, X = pending.pop()
        yield carry(body_of(robot.links[name]), X)
        for joint in robot.below[name]:
            if joint.fixed:
                pending.append((joint.child, X @ joint.origin))
            else:
                beside.append(joint)


def _refuse_loads(robot: Robot, beside: list[UrdfJoint]) -> None:
    """Refuse joints beside the chain that carry something: how that moves, a serial arm does not know."""
    loaded = [joint for joint in beside if _carries(robot, joint)]
    if loaded:
        one, names = len(loaded) == 1, [joint.name for joint in loaded]
        does = "joint lies beside the chain, moves and has" if one else "joints lie beside the chain, move and have"
        raise loaded[0].element.error(
            "",
            f"{len(loaded)} {does} mass to carry: {_listed(names)}. An arm has no branches: choose another tip, or "
            f"lock {'it' if one else 'them'}, at 0 or elsewhere: lock={names} (--lock {','.join(names)})",
        )


def _carries(robot: Robot, joint: UrdfJoint) -> bool:
    pending = [joint.child]
    while pending:
        name = pending.pop()
        body = body_of(robot.links[name])
        if body.mass or body.inertia.any() or body.unknown:
            return True
        pending += [below.child for below in robot.below[name]]
    return False


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - _MAX_LISTED:,} more" if len(names) > _MAX_LISTED else ""
    return ", ".join(f"'{name}'" for name in names[:_MAX_LISTED]) + more
