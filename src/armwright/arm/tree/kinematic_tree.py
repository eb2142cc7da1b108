"""What a file says of links and joints, whatever its format: a tree, with every joint at 0."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, Protocol, TypeAlias

from armwright.arm.drive import Motor, Spring
from armwright.arm.limits import Limits
from armwright.arm.model import Link
from armwright.arrays import Array, number
from armwright.errors import FileFormatError, InvalidValueError, KindError, listed, shown
from armwright.spatial.shapes import Solid

# So many names are in a message.
MAX_LISTED = 50
# Joints that are held: their names, or their positions by their names [rad] or [m].
Lock: TypeAlias = Collection[str] | Mapping[str, float]


class Mimic(NamedTuple):
    """What a joint follows: its position is multiplier x + offset for the position x of another joint.

    Attributes:
        joint: the name of the other joint.
        multiplier: by which its position is multiplied.
        offset: what is added [rad] or [m].
    """

    joint: str
    multiplier: float
    offset: float

    def position(self, leading: float) -> float:
        """Return the position for one of the other joint."""
        return self.multiplier * leading + self.offset


class TreeJoint(Protocol):
    """A joint of a tree, between the link it hangs on and the link it carries."""

    @property
    def name(self) -> str:
        """As in the file."""

    @property
    def parent(self) -> str:
        """The link it hangs on."""

    @property
    def child(self) -> str:
        """The link it carries."""

    @property
    def fixed(self) -> bool:
        """Whether it welds its links together."""

    @property
    def prismatic(self) -> bool:
        """Whether it slides."""

    @property
    def origin(self) -> Array:
        """Pose (4, 4) of the child in the frame of the parent, the joint at 0."""

    @property
    def anchor(self) -> Array:
        """A point (3,) of the axis in the frame of the child [m]."""

    @property
    def axis(self) -> Array:
        """Unit vector (3,) in the frame of the child."""

    def limits(self) -> tuple[Limits, list[str]]:
        """Return its limits, and sentences on what was not taken as it stands."""

    def motor(self) -> tuple[Motor, list[str]]:
        """Return its drive, and sentences on what was not taken as it stands."""

    def spring(self) -> tuple[Spring, list[str]]:
        """Return its spring, and sentences on what was not taken as it stands."""

    @property
    def mimic(self) -> Mimic | None:
        """What it follows, a joint that follows none or is held; None of one that is free."""

    @property
    def holdable(self) -> bool:
        """Whether it can be held at a position: not where it has none, or where something else moves it."""

    def held(self, position: float) -> TreeJoint:
        """Return it as one that is held at a position [rad] or [m]."""

    def require_serial(self) -> None:
        """Refuse a joint that is no part of a serial arm.

        Raises:
            FileFormatError: it is none.
        """

    def error(self, message: str) -> FileFormatError:
        """Return the error that says ``message`` of the joint."""


class Tree(Protocol):
    """The links and joints of a file."""

    @property
    def path(self) -> Path:
        """The file."""

    @property
    def name(self) -> str:
        """Of the robot."""

    @property
    def function(self) -> str:
        """The function that reads such files, in messages."""

    @property
    def links(self) -> Collection[str]:
        """Names, in the order of the file."""

    @property
    def parent_joints(self) -> Mapping[str, TreeJoint]:
        """By the name of a link: the joint that carries it."""

    @property
    def child_joints(self) -> Mapping[str, Sequence[TreeJoint]]:
        """By the name of a link: the joints that hang on it."""

    def default_base(self) -> str:
        """Return the link that is the base where none is named.

        Raises:
            FileFormatError: it is not clear which one that is.
        """

    def body(self, link: str) -> Link:
        """Return the body of a link, in its frame, with its solids.

        Raises:
            FileFormatError: the file does not say it as it should.
        """

    def solids(self, link: str) -> tuple[Solid, ...]:
        """Return what of a link meets other bodies, in its frame."""

    def left_out(self, links: Sequence[str]) -> list[str]:
        """Return sentences on what of links is not read, once they have been read."""

    def error(self, message: str) -> FileFormatError:
        """Return the error that says ``message`` of the whole file."""


def quoted(names: Sequence[str]) -> str:
    """Return names in quotes for a message, not more than some of them."""
    return listed([f"'{name}'" for name in names], MAX_LISTED)


def locked_positions(lock: Lock) -> dict[str, float]:
    """Return where joints are held by their names [rad] or [m].

    Raises:
        KindError: it is one text, or a position is no number.
    """
    if isinstance(lock, str):
        raise KindError(f"lock: expected a list of names of joints, or positions by names, got {shown(lock)}")
    positions = lock if isinstance(lock, Mapping) else dict.fromkeys(lock, 0.0)
    return {name: number(q, f"lock, '{name}'") for name, q in positions.items()}


def resting_position(limits: Limits) -> float:
    """Return where a joint is held that nobody says anything of: at 0, or in the middle if its limits exclude 0."""
    if limits.lower <= 0 <= limits.upper:
        return 0.0
    if math.isfinite(limits.upper - limits.lower):
        return limits.lower + (limits.upper - limits.lower) / 2
    return limits.lower if limits.lower > 0 else limits.upper


def check_lock(name: str, kind: str, position: float, limits: Limits | None) -> None:
    """Refuse to hold a joint where it cannot be.

    Args:
        name: of the joint.
        kind: as in the file.
        position: where it is to be held [rad] or [m].
        limits: of the joint; None of one that has no position.

    Raises:
        InvalidValueError: it cannot be there.
    """
    if position and not (limits and math.isfinite(position) and limits.lower <= position <= limits.upper):
        ends = f"it goes from {limits.lower:g} to {limits.upper:g}" if limits else f"it is {kind}"
        raise InvalidValueError(f"lock: joint '{name}' cannot be locked at {position:g} (rad or m): {ends}")
