"""Arms from URDF files."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

import attrs
import numpy as np

from armwright.arm.dh import carry
from armwright.arm.gravity import felt_gravity, vector_text
from armwright.arm.model import UPRIGHT_GRAVITY, Arm, Joint, JointKind, Link
from armwright.arm.tensors import impossible_moments
from armwright.arm.urdf.axes import Frames, cleared, cleared_pose, frames_of
from armwright.arm.urdf.chain import Chain, chain_of
from armwright.arm.urdf.robot import limits_of, motor_of, read_robot
from armwright.arrays import Array, number
from armwright.errors import KindError, shown
from armwright.files.inputs import file_path
from armwright.spatial.poses import inverse
from armwright.spatial.shapes import Solid

# Axes that are this near to parallel were meant to be [rad]: a half turn typed as 3.1416 is 0.7e-5 rad off.
_MEANT_PARALLEL = 1e-4


# Joints that are held: their names, or their positions by their names [rad] or [m].
Lock: TypeAlias = Collection[str] | Mapping[str, float]


@attrs.frozen(kw_only=True)
class Reading:
    """What a URDF file gives.

    Attributes:
        arm: the arm.
        notes: sentences on what was not taken as it stands.
    """

    arm: Arm
    notes: tuple[str, ...]


def load_urdf(
    path: Path | str,
    *,
    base: str | None = None,
    tip: str | None = None,
    lock: Lock = (),
    packages: Mapping[str, Path | str] | None = None,
) -> Arm:
    """Return the serial arm between two links of a URDF file.

    Positions of the arm are those of the joints in the file; the base is the frame of the base link, the tool that of
    the tip link. Fixed joints weld links together. Gravity points down in the root link of the file.

    Args:
        path: the file; what is read of it is in docs/arms.md.
        base: name of the link that stands still; the one that hangs on nothing when left out.
        tip: name of the link that is the tool; when left out the only one at the end of moving joints, or the link
            that carries all of them.
        lock: names of joints that are held at 0, as if they were fixed, such as those of a gripper; or where joints
            are held by their names [rad] or [m].
        packages: folders of packages, by name, in which the meshes are that the file names as ``package://NAME/...``;
            others are looked for below the folder of the file.

    Raises:
        KindError: ``path`` is no path, ``packages`` no mapping, ``lock`` one text, or a position no number.
        InvalidValueError: a joint is to be held where its limits do not let it.
        MissingExtraError: lxml is not installed.
        UnknownNameError: there is no link, or no joint, of that name.
        FileFormatError: the file is missing, broken, or has no such arm; the text has file, line and key.
    """
    return read_urdf(path, base=base, tip=tip, lock=lock, packages=packages).arm


def read_urdf(
    path: Path | str,
    *,
    base: str | None = None,
    tip: str | None = None,
    lock: Lock = (),
    packages: Mapping[str, Path | str] | None = None,
) -> Reading:
    """Return the serial arm between two links of a URDF file, and what was not taken as it stands.

    Arguments and errors are those of ``load_urdf``.
    """
    if not isinstance(path, str | Path):
        raise KindError(f"path: expected the path of a URDF file, got {shown(path)}")
    if isinstance(lock, str):
        raise KindError(f"lock: expected a list of names of joints, or positions by names, got {shown(lock)}")
    if packages is not None and not isinstance(packages, Mapping):
        raise KindError(f"packages: expected folders by the names of packages, got {shown(packages)}")
    path = file_path(path)
    locked = lock if isinstance(lock, Mapping) else dict.fromkeys(lock, 0.0)
    robot = read_robot(path, {name: number(q, f"lock, '{name}'") for name, q in locked.items()}, packages)
    chain = chain_of(robot, base, tip)
    # The distance of the joints and the tip from the base, or 1 m where all are at one point.
    origins = np.array([*(each.X_BJ[:3, 3] for each in chain.moving), chain.X_BT[:3, 3]])
    size = float(np.linalg.norm(origins, axis=-1).max()) or 1.0
    frames = frames_of([each.X_BJ for each in chain.moving], [each.axis for each in chain.moving], size)
    joints, links, motors, notes = [], [], [], [*chain.notes, *_leaning(chain, frames)]
    for moving, row, X in zip(chain.moving, frames.rows, frames.poses, strict=True):
        limits, unknown = limits_of(moving.joint)
        kind: JointKind = "prismatic" if moving.joint.kind == "prismatic" else "revolute"
        joints.append(Joint(kind=kind, **attrs.asdict(row), limits=limits, name=moving.joint.name))
        links.append(attrs.evolve(_link(moving.bodies, X, size), name=moving.joint.child))
        motors.append(motor_of(moving.joint))
        notes += unknown
    arm = Arm(
        name=robot.name,
        joints=joints,
        links=links,
        motors=motors,
        base=cleared_pose(frames.first, size),
        tool=cleared_pose(inverse(frames.poses[-1]) @ chain.X_BT, size),
        gravity=felt_gravity(chain.X_RB, UPRIGHT_GRAVITY),
        gravity_from="root",
        base_solids=chain.base_solids,
        base_link=chain.base,
        tool_link=chain.tip,
        source=f"{path.name}, link '{chain.base}' to link '{chain.tip}'",
    )
    if not np.array_equal(arm.gravity, UPRIGHT_GRAVITY):
        down = vector_text(arm.gravity)
        notes.append(f"gravity points downwards in the root link of the file: {down} along the axes of '{chain.base}'")
    return Reading(arm=arm, notes=tuple(notes))


def _link(bodies: Sequence[Link], X_BL: Array, size: float) -> Link:
    """Weld bodies that are given in the frame of the base, and see them from the frame of a link."""
    unknown = [body for body in bodies if body.unknown]
    X_LB = inverse(X_BL)
    solids = [_cleared(solid.moved(X_LB), size) for body in bodies for solid in body.solids]
    if unknown:
        return attrs.evolve(unknown[0], solids=solids)
    whole = _welded([body for body in bodies if body.mass or body.inertia.any()])
    seen = carry(whole, X_LB)
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
