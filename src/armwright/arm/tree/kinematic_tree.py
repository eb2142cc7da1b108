"""What a file says of links and joints, whatever its format: a tree, with every joint at 0."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Protocol

from armwright.arm.model import Limits, Link, Motor
from armwright.arrays import Array
from armwright.errors import FileFormatError
from armwright.spatial.shapes import Solid


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

    def error(self, message: str) -> FileFormatError:
        """Return the error that says ``message`` of the whole file."""


def listed(names: Sequence[str], most: int = 50) -> str:
    """Return names for a message, not more than some of them."""
    more = f" and {len(names) - most:,} more" if len(names) > most else ""
    return ", ".join(f"'{name}'" for name in names[:most]) + more
