"""What a writer returns: a file, and what it could only approximate."""

import hashlib
from collections.abc import Iterator

import attrs

from armwright.export.statements import ControllerProgram, MoveJoints, MoveLines, Say
from armwright.export.writers.text import LINE_OF_TEXT, plain_lines
from armwright.version import __version__


@attrs.frozen(kw_only=True)
class ControllerFile:
    """A program in the language of a controller.

    Attributes:
        name: of the file.
        text: of it.
        approximations: what differs from the plan, in words.
        others: names and texts of files that belong to it.
    """

    name: str
    text: str
    approximations: tuple[str, ...]
    others: tuple[tuple[str, str], ...] = ()

    @property
    def files(self) -> dict[str, str]:
        """All texts by name, its own first."""
        return {self.name: self.text, **dict(self.others)}


def heading(program: ControllerProgram) -> str:
    """Return what the comment of a file says: version, hash and count, and nothing that others have written."""
    digest = hashlib.sha256(program.source.text.encode("utf-8", errors="backslashreplace")).hexdigest()
    return f"armwright {__version__}, plan mode, program sha256 {digest}, {len(program.statements)} statements"


def common_approximations(program: ControllerProgram, replaced: str, longest: int = LINE_OF_TEXT) -> Iterator[str]:
    """Give in words what differs from the plan on every controller.

    Args:
        program: what was written.
        replaced: characters that the language cannot hold in texts, beside those that no controller shows.
        longest: of the lines of a text.
    """
    statements = program.statements
    if any(isinstance(one, MoveJoints | MoveLines) for one in statements):
        yield "speeds within a motion: the controller has its own profile for the time or the speed of the plan"
    if any(isinstance(one, MoveLines) and len(one.poses) > 1 for one in statements):
        yield "shape of rounded corners: that of the controller, begun no farther from a corner than in the plan"
    if any(isinstance(one, Say) and plain_lines(one.text, replaced, longest) != [one.text] for one in statements):
        yield "characters that the controller cannot show are shown as ? or ', and longer texts in several lines"
