"""What is known of one frame or one hand at a moment of a program."""

import attrs

from armwright.program.flow_analysis.lattice import same
from armwright.program.language.source import Span

# Where a gripper stands, or what it holds, when nobody knows.
UNKNOWN = "?"
# Names that wipe where all hands are and what their fingers do, and what they hold.
HANDS, GRIPS = "(hands)", "(grips)"


@attrs.frozen
class Link:
    """One affixment.

    Attributes:
        parent: the frame above; None when nobody knows whether there is one.
        span: the AFFIX that made it; None where the cell did.
        rigid: whether the frame above comes along when this one is given another pose.
    """

    parent: str | None
    span: Span | None = None
    rigid: bool = False


@attrs.frozen
class Assignment:
    """One value given to a frame: in which order, where, and whether the frame stood somewhere before."""

    order: int
    span: Span
    moved: bool


@attrs.frozen
class Divergence:
    """What gives a variable its value on one path and not on the other.

    Attributes:
        span: its head.
        depth: in how many conditions it stands.
        says: how it comes that there may be no value.
        help: what to do.
    """

    span: Span
    depth: int
    says: str
    help: str


@attrs.frozen
class GripperState:
    """What is known of one hand, but for what it holds.

    Attributes:
        open: whether the fingers are open; None at the start of a program.
        doubtful: whether nobody knows what the program did to the fingers.
        at: the frame at which the gripper stands.
        arrival: the MOVE of the arm itself that brought it there.
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
ANY_HAND = GripperState(doubtful=True, at=UNKNOWN)
ANY_GRIP = Grip(UNKNOWN)


def joined_links(link: Link | None, other: Link | None) -> Link | None:
    """Return what holds of an affixment where two paths meet."""
    if link == other:
        return link
    if link is None or other is None or (link.parent, link.rigid) != (other.parent, other.rigid):
        return ANY_LINK
    return link


def joined_hands(link: GripperState, other: GripperState) -> GripperState:
    """Return what holds of a gripper where two paths meet."""
    if link == other:
        return link
    return GripperState(
        open=same(link.open, other.open),
        doubtful=link.doubtful or other.doubtful or link.open != other.open,
        at=link.at if link.at == other.at else UNKNOWN,
    )


def joined_grips(link: Grip | None, other: Grip | None) -> Grip | None:
    """Return what holds of what a gripper holds where two paths meet."""
    if link is None or other is None or link.frame != other.frame:
        return link if link == other else ANY_GRIP
    return link
