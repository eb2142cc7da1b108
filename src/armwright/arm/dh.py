"""Modified Denavit-Hartenberg tables: an input format, turned into the one convention used inside.

The modified convention (Craig) puts frame i on joint i and carries the link's twist and length in front:

    T_i = Rx(alpha_{i-1}) Tx(a_{i-1}) Rz(theta_i) Tz(d_i)

Taken apart behind Tz(d_i) instead of in front of Rx, the same product is a standard table: the first twist and
length become part of the base, and each row takes over those of the next. Link frames move with it.
"""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from armwright.arm.model import Joint, Link
from armwright.arrays import Array
from armwright.spatial.poses import homogeneous, inverse
from armwright.spatial.rotations import elementary_rotation


def twist(alpha: float, a: float) -> Array:
    """Return the pose Tx(a) Rx(alpha), (4, 4); the two may be swapped."""
    return homogeneous(elementary_rotation(0, alpha), (a, 0.0, 0.0))


def from_modified(joints: Sequence[Joint], links: Sequence[Link]) -> tuple[Array, list[Joint], list[Link]]:
    """Turn a modified table, and links described in its frames, into the standard one.

    Args:
        joints: n rows; ``a`` and ``alpha`` of row i are those that stand in front of joint i.
        links: n links in the modified frames.

    Returns:
        The pose (4, 4) to put behind the base, n standard rows, n links in the standard frames.

    Source:
        Craig (1986) ch. 3.
    """
    behind = [(joint.alpha, joint.a) for joint in joints[1:]] + [(0.0, 0.0)]
    rows = [attrs.evolve(joint, alpha=alpha, a=a) for joint, (alpha, a) in zip(joints, behind, strict=True)]
    carried = [carry(link, inverse(twist(alpha, a))) for link, (alpha, a) in zip(links, behind, strict=True)]
    return twist(joints[0].alpha, joints[0].a), rows, carried


def to_modified(joints: Sequence[Joint]) -> tuple[list[Joint], Array]:
    """Turn a standard table into the modified one.

    Args:
        joints: n standard rows.

    Returns:
        n modified rows, ``a`` and ``alpha`` of which stand in front of their joints, and the pose (4, 4) to put before
        the tool. Fixed transforms stay behind the shift along z.

    Source:
        Craig (1986) ch. 3.
    """
    before = [(0.0, 0.0), *((joint.alpha, joint.a) for joint in joints[:-1])]
    rows = [attrs.evolve(joint, alpha=alpha, a=a) for joint, (alpha, a) in zip(joints, before, strict=True)]
    return rows, twist(joints[-1].alpha, joints[-1].a)


def carry(link: Link, X_NM: Array) -> Link:
    """Describe a link of frame M in frame N instead, X_NM (4, 4) being the pose of M seen from N."""
    R, p = X_NM[:3, :3], X_NM[:3, 3]
    solids = [solid.moved(X_NM) for solid in link.solids]
    # What has no mass has no centre of mass to move.
    com = R @ link.com + p if link.mass else link.com
    return attrs.evolve(link, com=com, inertia=R @ link.inertia @ R.T, solids=solids)


def about_com(inertia: Array, mass: float, com: Array) -> Array:
    """Return the tensor (3, 3) about the centre of mass of one that is about the frame origin.

    Source:
        Parallel axis theorem (Steiner).
    """
    return np.asarray(inertia - mass * ((com @ com) * np.eye(3) - np.outer(com, com)))
