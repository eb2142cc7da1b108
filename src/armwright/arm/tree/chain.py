"""The chain in a tree of links: from a base link to a tip link, and what hangs on every link of it."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from itertools import takewhile

import attrs
import numpy as np

from armwright.arm.dh import carry
from armwright.arm.model import Link
from armwright.arm.tree.kinematic_tree import MAX_LISTED, Tree, TreeJoint, quoted, resting_position
from armwright.arrays import Array
from armwright.errors import listed, one_of
from armwright.files.limits import limit, limit_message
from armwright.spatial.poses import homogeneous
from armwright.spatial.shapes import Solid

# A finger of a gripper has so many joints at most.
_FINGER_JOINTS = 2


@attrs.frozen(kw_only=True, eq=False)
class MovingJoint:
    """A joint of the chain that moves, in the frame of the base link, all joints at 0.

    Attributes:
        joint: the joint.
        X_BJ: (4, 4) a frame on its axis.
        axis: (3,) its axis, a unit vector.
        bodies: of all links that it moves and no later joint does.
    """

    joint: TreeJoint
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
        base_solids: what of the base meets other bodies, in its frame.
        notes: sentences on what was chosen.
    """

    base: str
    tip: str
    moving: tuple[MovingJoint, ...]
    X_BT: Array
    X_RB: Array
    base_solids: tuple[Solid, ...]
    notes: tuple[str, ...] = ()


def chain_of(tree: Tree, base: str | None = None, tip: str | None = None) -> Chain:
    """Return the chain between two links.

    Args:
        tree: the file.
        base: name of the first link; the tree's own when left out.
        tip: name of the last link; when left out the only one at the end of moving joints, or the link that carries
            all of them.

    Raises:
        UnknownNameError: there is no link of that name.
        FileFormatError: it is not clear which link is meant, nothing moves between them, or a joint is none of an arm.
    """
    base = tree.default_base() if base is None else one_of("link", base, tree.links)
    notes: tuple[str, ...] = ()
    if tip is None:
        tip, notes = _default_tip(tree, base)
    one_of("link", tip, tree.links)
    path = _joint_path(tree, base, tip)
    for joint in path:
        joint.require_serial()
    movable = [joint for joint in path if not joint.fixed]
    if not movable:
        raise tree.error(f"no joint moves between the links '{base}' and '{tip}'")
    if len(movable) > limit("joints"):
        raise tree.error(f"too many joints between '{base}' and '{tip}': {limit_message('joints', len(movable))}")
    beside = _Beside(tree, frozenset(joint.name for joint in movable))
    X, moving = np.eye(4), []
    # What moves beside the chain and hangs on the base is no load of the arm.
    standing = list(_welded_links(tree, base, X))
    links = [link for link, _ in standing]
    for joint in path:
        X = X @ joint.origin
        if not joint.fixed:
            welded = list(_welded_links(tree, joint.child, X, beside))
            links += [link for link, _ in welded]
            bodies = tuple(carry(tree.body(link), X_BL) for link, X_BL in welded)
            X_BJ = X @ homogeneous(np.eye(3), joint.anchor)
            moving.append(MovingJoint(joint=joint, X_BJ=X_BJ, axis=X[:3, :3] @ joint.axis, bodies=bodies))
    beside.refuse_loads()
    X_RB, root = np.eye(4), base
    while root in tree.parent_joints:
        root = tree.parent_joints[root].parent
    for joint in _joint_path(tree, root, base):
        X_RB = X_RB @ joint.origin
    solids = [solid.moved(X_BL) for link, X_BL in standing for solid in tree.solids(link)]
    notes += (*beside.notes(), *tree.left_out(links))
    return Chain(base=base, tip=tip, moving=tuple(moving), X_BT=X, X_RB=X_RB, base_solids=tuple(solids), notes=notes)


def _default_tip(tree: Tree, base: str) -> tuple[str, tuple[str, ...]]:
    """Return the only link that ends a chain, and notes; one that is fixed to the base ends none.

    Where several ends are fixed to one another, the link that carries all of them is the end: it moves as they do.
    """
    ends = []
    pending = [(base, False)]
    while pending:
        link, moves = pending.pop()
        pending += [(joint.child, moves or not joint.fixed) for joint in reversed(tree.child_joints[link])]
        if moves and not tree.child_joints[link]:
            ends.append(link)
    if not ends:
        raise tree.error(f"no joint moves a link below '{base}'")
    if len(ends) == 1:
        return ends[0], ()
    paths = [_joint_path(tree, base, end) for end in ends]
    carrier = _carrier(paths)
    if carrier is None:
        likely = _likely_tip(paths)
        raise tree.error(
            f"the tip link is ambiguous: it could be {quoted(ends)}, or a link before them; specify one as tip: "
            f"{tree.function}(path, tip='{likely}'), or armwright convert {tree.path} --tip {likely} -o arm.toml"
        )
    note = f"the tool is '{carrier}', which carries {quoted(ends)}; each moves as it does and may be the tip (--tip)"
    return carrier, (note,)


def _carrier(paths: Sequence[Sequence[TreeJoint]]) -> str | None:
    """Return the last link that all ends of paths hang on, if no joint moves between it and them, else None."""
    common = _common(paths)
    rigid = all(joint.fixed for path in paths for joint in path[len(common) :])
    return common[-1].child if common and rigid else None


def _likely_tip(paths: Sequence[Sequence[TreeJoint]]) -> str:
    """Return the link that is most likely meant: where a longest path ends, or where the fingers of its gripper begin.

    Fingers are branches of one or two moving joints.
    """
    moving = [[joint for joint in path if not joint.fixed] for path in paths]
    longest = max(range(len(paths)), key=lambda i: len(moving[i]))
    most, first = len(moving[longest]), moving[longest][0]
    common = _common([p for p, its in zip(paths, moving, strict=True) if its[0] is first and len(its) >= most - 1])
    fingers = most - sum(not joint.fixed for joint in common)
    return common[-1].child if fingers <= _FINGER_JOINTS else paths[longest][-1].child


def _common(paths: Sequence[Sequence[TreeJoint]]) -> list[TreeJoint]:
    """Return the joints with which all paths begin."""
    return [row[0] for row in takewhile(lambda row: all(joint is row[0] for joint in row), zip(*paths, strict=False))]


def _joint_path(tree: Tree, base: str, tip: str) -> list[TreeJoint]:
    """Return the joints from the base to the tip."""
    path: list[TreeJoint] = []
    link = tip
    while link != base:
        if link not in tree.parent_joints:
            raise tree.error(f"link '{tip}' is not below link '{base}'")
        path.append(tree.parent_joints[link])
        link = tree.parent_joints[link].parent
    return path[::-1]


def _welded_links(tree: Tree, link: str, X_BL: Array, beside: _Beside | None = None) -> Iterator[tuple[str, Array]]:
    """Walk through the links that are fixed to a link and to one another, with their poses in the frame of the base.

    Joints beside the chain that move are held where ``beside`` has them; without it, what they carry is left out.
    """
    pending = [(link, X_BL)]
    while pending:
        name, X = pending.pop()
        yield name, X
        for joint in tree.child_joints[name]:
            held = joint if joint.fixed or beside is None else beside.held(joint)
            if held.fixed:
                pending.append((joint.child, X @ held.origin))


class _Beside:
    """The joints that move, are not on the chain and hang on a link of it: an arm has them where they are held."""

    def __init__(self, tree: Tree, chain: Collection[str]) -> None:
        self._tree, self._chain = tree, chain
        self._joints = {joint.name: joint for joint in tree.parent_joints.values()}
        self._positions: dict[str, float] = {}
        self._loose: list[TreeJoint] = []

    def held(self, joint: TreeJoint) -> TreeJoint:
        """Return a joint as one that is held; as it is if it is on the chain, or nothing holds it."""
        if joint.name in self._chain:
            return joint
        position = self._position(joint)
        if position is None:
            self._loose.append(joint)
            return joint
        self._positions[joint.name] = position
        return joint.held(position)

    def _position(self, joint: TreeJoint) -> float | None:
        """Return where a joint is held, a follower where it follows to; None where nothing holds it."""
        leader = joint if joint.mimic is None else self._joints[joint.mimic.joint]
        if leader.name in self._chain or not joint.holdable or not (leader.holdable or leader.fixed):
            return None
        position = 0.0 if leader.fixed else resting_position(leader.limits()[0])
        return position if joint.mimic is None else joint.mimic.position(position)

    def refuse_loads(self) -> None:
        """Refuse joints that nothing holds and that carry something: how that moves, a serial arm does not know.

        Raises:
            FileFormatError: there is one.
        """
        loaded = [joint for joint in self._loose if _carries_mass(self._tree, joint)]
        if loaded:
            single, names = len(loaded) == 1, [joint.name for joint in loaded]
            does = "joint lies beside the chain, has" if single else "joints lie beside the chain, have"
            moves = "moves with other joints or freely" if single else "move with other joints or freely"
            raise loaded[0].error(
                f"{len(loaded)} {does} mass to carry and {moves}: {quoted(names)}. An arm has no branches: choose "
                f"another tip, or lock {'it' if single else 'them'}, at 0 or elsewhere: lock={names} "
                f"(--lock {','.join(names)})",
            )

    def notes(self) -> list[str]:
        """Return a sentence on the joints that are held, and where."""
        where = [f"'{name}' at {position:g}" for name, position in self._positions.items()]
        if not where:
            return []
        held = listed(where, MAX_LISTED)
        return [f"joints beside the chain are held, with what they carry: {held} rad or m (--lock)"]


def _carries_mass(tree: Tree, joint: TreeJoint) -> bool:
    pending = [joint.child]
    while pending:
        name = pending.pop()
        body = tree.body(name)
        if body.mass or body.inertia.any() or body.unknown:
            return True
        pending += [child_joint.child for child_joint in tree.child_joints[name]]
    return False
