"""Facts about one frame or one gripper at a point of a program."""

import attrs

from armwright.program.flow_analysis.lattice import agreed_value
from armwright.program.language.source import Span

# The frame at a gripper, or in it, where it is unknown.
UNKNOWN = "?"
# Keys that invalidate the states of all grippers, and what they hold.
GRIPPERS, GRIPS = "(hands)", "(grips)"


@attrs.frozen
class Link:
    """One affixment.

    Attributes:
        parent: the parent frame; None where it is unknown whether there is one.
        span: the AFFIX that made it; None where the cell did.
        rigid: whether the parent moves too when this frame is assigned a pose.
    """

    parent: str | None
    span: Span | None = None
    rigid: bool = False


@attrs.frozen
class Assignment:
    """One assignment of a frame: its order, its statement, and whether the frame had a pose before."""

    order: int
    span: Span
    moved: bool


@attrs.frozen
class Divergence:
    """The statement that assigns a variable on one path and not on the other.

    Attributes:
        span: its head.
        depth: number of conditions around it.
        message: why there may be no value.
        advice: what to do.
    """

    span: Span
    depth: int
    message: str
    advice: str


@attrs.frozen
class GripperState:
    """Facts about one gripper, without what it holds.

    Attributes:
        open: whether the fingers are open; None at the start of a program.
        doubtful: whether it is unknown what the program did to the fingers.
        at: the frame at which the gripper is.
        arrival: the MOVE of the arm itself that ended there.
        arrived_open: whether the fingers were open then.
        opened: the OPEN since then.
        left: the frame that the fingers release while it hung on the arm, and the OPEN that did it.
    """

    open: bool | None = None
    doubtful: bool = False
    at: str | None = None
    arrival: Span | None = None
    arrived_open: bool | None = None
    opened: Span | None = None
    left: tuple[str, Span] | None = None


@attrs.frozen
class Grip:
    """What a gripper holds: the frame at which the fingers closed, and the GRASP that closed them."""

    frame: str
    span: Span | None = None


ANY_LINK = Link(None)
ANY_GRIPPER = GripperState(doubtful=True, at=UNKNOWN)
ANY_GRIP = Grip(UNKNOWN)


def join_links(link: Link | None, other: Link | None) -> Link | None:
    """Return the fact about an affixment where two paths merge."""
    if link == other:
        return link
    if link is None or other is None or (link.parent, link.rigid) != (other.parent, other.rigid):
        return ANY_LINK
    return link


def join_grippers(link: GripperState, other: GripperState) -> GripperState:
    """Return the fact about a gripper where two paths merge."""
    if link == other:
        return link
    return GripperState(
        open=agreed_value(link.open, other.open),
        doubtful=link.doubtful or other.doubtful or link.open != other.open,
        at=link.at if link.at == other.at else UNKNOWN,
    )


def join_grips(link: Grip | None, other: Grip | None) -> Grip | None:
    """Return the fact about the held frame where two paths merge."""
    if link is None or other is None or link.frame != other.frame:
        return link if link == other else ANY_GRIP
    return link
