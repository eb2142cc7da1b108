"""Which frame hangs where at a statement: known while a program is translated, so that no controller has to know it."""

from collections.abc import Iterator, Mapping

import attrs

from armwright.cell.frames import WORLD


@attrs.frozen
class Hanging:
    """Where a frame hangs.

    Attributes:
        parents: all that it may hang on; none before it has a value.
        root: the arm that carries it, or WORLD; None where that depends on the way of the program.
        rigid: whether its parent moves too when it is assigned a pose.
    """

    parents: frozenset[str] = frozenset()
    root: str | None = WORLD
    rigid: bool = False

    def join(self, other: "Hanging") -> "Hanging":
        """Return what holds on both ways; a frame without a value on one of them is not used behind it."""
        if not self.parents or not other.parents:
            return self if self.parents else other
        root = self.root if self.root == other.root else None
        return Hanging(self.parents | other.parents, root, self.rigid or other.rigid)


IN_THE_WORLD = Hanging(frozenset({WORLD}))


class AmbiguousFrameError(Exception):
    """A frame hangs here or there, depending on the way of the program; it has the name of the frame."""


class Attachments:
    """Where all frames hang."""

    def __init__(self, frames: Mapping[str, Hanging]) -> None:
        """Start with the frames of the cell."""
        self._frames = dict(frames)

    def __getitem__(self, frame: str) -> Hanging:
        """Return where a frame hangs."""
        return self._frames.get(frame, Hanging())

    def names(self) -> Iterator[str]:
        """Give the names of the frames that hang somewhere."""
        return iter(self._frames)

    def copy(self) -> "Attachments":
        """Return the same, to go on from."""
        return Attachments(self._frames)

    def __eq__(self, other: object) -> bool:
        """Whether all frames hang alike."""
        return isinstance(other, Attachments) and self._frames == other._frames

    def __hash__(self) -> int:
        """Return the same number for the same frames."""
        return hash(frozenset(self._frames.items()))

    def join(self, other: "Attachments") -> "Attachments":
        """Return what holds on both ways."""
        names = {*self.names(), *other.names()}
        return Attachments({name: self[name].join(other[name]) for name in sorted(names)})

    def set(self, frame: str, hanging: Hanging) -> None:
        """Hang a frame somewhere; of an array, one of its elements, the others staying where they are."""
        self._frames[frame] = self[frame].join(hanging) if is_array(frame) else hanging

    def replace(self, frame: str, hanging: Hanging) -> None:
        """Hang a frame, or all elements of an array, somewhere."""
        self._frames[frame] = hanging

    def drop(self, prefix: str) -> None:
        """Forget the frames of a procedure that has been left; no frame of others hangs on them any more."""
        self._frames = {name: where for name, where in self._frames.items() if not name.startswith(prefix)}

    def carried_by(self, frame: str) -> str:
        """Return the arm that carries a frame, or WORLD.

        Raises:
            AmbiguousFrameError: it depends on the way of the program.
        """
        root = self[frame].root
        if root is None:
            raise AmbiguousFrameError(frame)
        return root

    def descendants(self, frame: str) -> Iterator[str]:
        """Give the frames that hang on a frame, each behind its parent.

        Raises:
            AmbiguousFrameError: one may hang on it.
        """
        for name, where in self._frames.items():
            if frame in where.parents and name != frame:
                if len(where.parents) > 1 or is_array(frame):
                    raise AmbiguousFrameError(name)
                yield name
                yield from self.descendants(name)

    def rigid_root(self, frame: str) -> str:
        """Return the topmost frame that moves when a frame is assigned a pose.

        Raises:
            AmbiguousFrameError: it depends on the way of the program.
        """
        while self[frame].rigid:
            if len(self[frame].parents) > 1:
                raise AmbiguousFrameError(frame)
            (frame,) = self[frame].parents
        return frame


def is_array(frame: str) -> bool:
    """Whether a name stands for all elements of an array."""
    return frame.endswith("[]")
