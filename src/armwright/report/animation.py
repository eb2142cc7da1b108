"""The data of the three-dimensional view of a page: bodies, what moves them, and frames."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import attrs

from armwright.arrays import Array
from armwright.report.markup import EXACT


@attrs.frozen(kw_only=True, eq=False)
class Body:
    """A solid of the view.

    Attributes:
        name: of what it is part of, such as ``TABLE`` or ``ARM_1 link 2``.
        shape: its number among the shapes of the animation.
        pose: (12,) columns n, o, a, p of the solid in the frame that carries it.
        frame: of an arm: 0 to n, and n + 1 is the tool; 0, the world, of a body that stands.
        tint: what colours it.
        slide: 1 or -1 of a finger, which is moved along y by half the opening.
        stretches: whether it is as long along z as the next joint has shifted its link, from a length of 1 m.
    """

    name: str
    shape: int
    pose: Array
    frame: int = 0
    tint: Literal["link", "base", "joint", "fixture"] = "fixture"
    slide: Literal[-1, 0, 1] = 0
    stretches: bool = False


@attrs.frozen(kw_only=True, eq=False)
class ChainJoint:
    """A joint of the chain of an arm, and what is behind it.

    Attributes:
        revolute: whether it rotates; otherwise it slides.
        theta: fixed part of the angle about z [rad].
        d: fixed part of the shift along z [m].
        behind: (12,) columns n, o, a, p of the frame of its link behind the rotation and the shift.
    """

    revolute: bool
    theta: float = attrs.field(metadata=EXACT)
    d: float = attrs.field(metadata=EXACT)
    behind: Array = attrs.field(metadata=EXACT)


@attrs.frozen(kw_only=True, eq=False)
class ArmFigure:
    """The bodies of an arm, and the chain that moves them, at the M instants of the animation.

    Attributes:
        q: (M, n) joint positions [rad] or [m], measured where they were.
        planned: (M, n) joint positions that were planned, where others were measured; None without.
        base: (12,) columns n, o, a, p of frame 0 in the world.
        joints: n joints from base to hand.
        tool: (12,) the tool in the last frame.
        bodies: what is drawn.
        grip: (M,) 0 closed to 1 open; None of an arm without a gripper.
        opening: distance between the open fingers [m].
    """

    q: Array
    base: Array = attrs.field(metadata=EXACT)
    joints: Sequence[ChainJoint]
    tool: Array = attrs.field(metadata=EXACT)
    bodies: Sequence[Body]
    grip: Array | None
    opening: float
    planned: Array | None = None


@attrs.frozen(kw_only=True, eq=False)
class MovedPart:
    """A part and where it was; from each time on the pose beside it holds, or changes evenly into the next.

    Attributes:
        name: its name.
        shape: its number among the shapes of the animation.
        times: (k,) [s], from 0.
        arms: the arm on whose hand it was; None where it was in the world.
        poses: k poses (12,), columns n, o, a, p, relative to the tool of the arm or to the world.
        changes_evenly: whether it moved from each pose to the next one; otherwise it stays where it is until then.
    """

    name: str
    shape: int
    times: Sequence[float]
    arms: Sequence[str | None]
    poses: Sequence[Array]
    changes_evenly: bool = False


@attrs.frozen(kw_only=True, eq=False)
class FrameTrack:
    """The poses of a frame at the M instants of the animation.

    Attributes:
        name: its name as the program spells it.
        poses: (M, 12) columns n, o, a, p in the world; rows before ``visible_from`` are finite but not shown.
        visible_from: first row at which the frame has a value.
    """

    name: str
    poses: Array
    visible_from: int = 0


@attrs.frozen(kw_only=True)
class TreeChange:
    """A frame gets another parent; its first parent has t = 0.

    Attributes:
        t: time [s].
        child: the frame.
        parent: its new parent: ``WORLD``, an arm, or a frame.
    """

    t: float
    child: str
    parent: str


@attrs.frozen(kw_only=True, eq=False)
class Animation:
    """The data of the three-dimensional view.

    Attributes:
        fps: instants per second.
        t: (M,) instants [s], at least one.
        arms: figures of the arms by name.
        frames: frames in the order in which they are drawn.
        tree: changes of the frame tree in order of time.
        shapes: the shapes of all bodies, as of ``shape_table``.
        fixtures: bodies that stand.
        parts: bodies that are moved.
        contact_plane: height of the plane of contact of the cell [m]; None without one.
    """

    fps: float
    t: Array
    arms: Mapping[str, ArmFigure] = attrs.field(factory=dict)
    frames: Sequence[FrameTrack] = ()
    tree: Sequence[TreeChange] = ()
    shapes: Sequence[Mapping[str, Any]] = ()
    fixtures: Sequence[Body] = ()
    parts: Sequence[MovedPart] = ()
    contact_plane: float | None = None
