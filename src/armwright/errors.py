"""The errors for callers: a tree of classes, each also a subclass of the built-in error that it resembles.

A message names the object, the expected and the actual value, and the nearest valid choice if there is one.
"""

import enum
from collections.abc import Iterable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import ClassVar

# Glyphs that are easily confused in a scan or a listing.
_CONFUSABLE = str.maketrans({"I": "1", "L": "1", "O": "0", "-": "_", "S": "5", "B": "8"})
# A longer word is not compared with names, as this takes time quadratic in the length.
_MAX_NAME_LENGTH = 100
# Known names that a message lists at most.
_MAX_LISTED = 100
# Of names that a command lists, a message has so many at most.
_MAX_SIMILAR = 8
# Characters of an invalid value that a message shows at most.
_MAX_SHOWN_LENGTH = 60
# Characters at the beginning and at the end of a message that is shortened.
_BEGINNING, _ENDING = 4000, 500


class ExitStatus(enum.IntEnum):
    """The exit status of a command (docs/exit_status.md)."""

    DONE = 0
    PROGRAM_ERRORS = 1
    USAGE = 2
    INFEASIBLE = 3
    FILE = 4
    CHECK_FAILED = 5
    INTERNAL_ERROR = 70
    HANGUP = 129
    INTERRUPTED = 130
    BROKEN_PIPE = 141
    TERMINATED = 143


class ArmwrightError(Exception):
    """The base class of errors that a caller can cause; the message has the cause and a remedy.

    Attributes:
        exit_status: exit status of a command that raises the error; subclasses override it.
    """

    exit_status: ClassVar[ExitStatus] = ExitStatus.INFEASIBLE

    def __str__(self) -> str:
        """Return the message, without the middle of a very long one."""
        return shortened(super().__str__())


class KindError(ArmwrightError, TypeError):
    """A value has the wrong type: a text instead of numbers, or a name instead of an arm."""

    exit_status = ExitStatus.USAGE


class ShapeError(ArmwrightError, ValueError):
    """An array has the wrong shape."""

    exit_status = ExitStatus.USAGE


class InvalidValueError(ArmwrightError, ValueError):
    """A value has the right type and is invalid."""

    exit_status = ExitStatus.USAGE


class TooFewError(InvalidValueError):
    """There are too few measurements for a standard, or for the estimated parameters."""

    exit_status = ExitStatus.INFEASIBLE


class IncapableArmError(InvalidValueError):
    """An arm cannot execute a motion at any speed: its joints are too weak, or their limits are unknown."""

    exit_status = ExitStatus.INFEASIBLE


class UnknownNameError(ArmwrightError, LookupError):
    """A name is unknown; the message lists the known names."""

    exit_status = ExitStatus.USAGE

    def __init__(
        self, kind: str, name: object, known: Iterable[str], *, similar: Iterable[str] = (), all_by: str = ""
    ) -> None:
        """Compose the message with the nearest and all known names.

        Args:
            kind: kind of the named object, for the message.
            name: the unknown name.
            known: the known names.
            similar: those that may be meant where none is nearly the same.
            all_by: the command that lists them, for those that are too many for a message.
        """
        name, choices = str(name), sorted(known)
        near = closest(name, choices)
        hint = f" Did you mean '{near}'?" if near else ""
        if all_by and len(choices) > _MAX_SIMILAR:
            listing = f" Similar: {listed(tuple(similar), _MAX_SIMILAR)}." if similar and not near else ""
            super().__init__(f"no {kind} '{_cut(name)}'.{hint}{listing} All {len(choices)}: {all_by}.")
            return
        more = f" and {len(choices) - _MAX_LISTED:,} more" if len(choices) > _MAX_LISTED else ""
        listing = f" Known: {', '.join(choices[:_MAX_LISTED])}{more}." if choices else " There is none."
        super().__init__(f"no {kind} '{_cut(name)}'.{hint}{listing}")


class FileFormatError(ArmwrightError, ValueError):
    """The content of a file is invalid; the message names file, line and key."""

    exit_status = ExitStatus.FILE

    def __init__(self, path: Path | str, line: int | None, key: str, message: str) -> None:
        """Compose the message from its location, the ``key`` in ``line`` of ``path``, and the error."""
        self.path, self.line, self.key = Path(path), line, key
        location = f"{path}:{line}" if line else f"{path}"
        super().__init__(f"{location}: {key}: {message}" if key else f"{location}: {message}")


class ContradictionError(ArmwrightError, ValueError):
    """Measurements contradict the model: no values of its parameters explain the data."""


class DoubtfulError(ContradictionError):
    """A result is complete, but the data contradict its model; the message has the reasons."""


class CheckFailedError(ArmwrightError, ValueError):
    """A check has failed after a complete computation; the message has the failed checks."""

    exit_status = ExitStatus.CHECK_FAILED


class UnsupportedArmError(ArmwrightError, ValueError):
    """The method does not apply to this arm."""


class MissingExtraError(ArmwrightError, ImportError):
    """A function needs a library that the core does not install; the message has the command that installs it."""


class DeviceError(ArmwrightError, RuntimeError):
    """There is no device of CUDA, or something went wrong on it; the message has what its driver reports."""


class OutputError(ArmwrightError, OSError):
    """A result could not be written; incomplete files have been removed."""

    exit_status = ExitStatus.FILE


class GravityWarning(UserWarning):
    """An arm states its own gravity, but is in a cell, whose gravity is used."""


class RotationWarning(UserWarning):
    """A matrix is nearly a rotation; the nearest rotation is used."""


class UnitWarning(UserWarning):
    """A number is probably in another unit: degrees instead of radians."""


class MeshWarning(UserWarning):
    """A mesh is not what collisions are found with: its convex hull is much larger, or it is not closed."""


class IncompleteRowsWarning(UserWarning):
    """Rows of a table with empty cells were omitted on request."""


class CompilerWarning(UserWarning):
    """The system allows no compiled code; equations are evaluated with NumPy, and plans take ten times as long."""


class CacheWarning(UserWarning):
    """The cache folder is not private and is not used; every start compiles again."""


def one_of(kind: str, name: str, known: Iterable[str]) -> str:
    """Return ``name`` if it is a known name.

    Args:
        kind: kind of the named object, for the message.
        name: the requested name.
        known: the known names.

    Raises:
        UnknownNameError: the name is unknown; the message has the nearest known name.
    """
    choices = tuple(known)
    if not isinstance(name, str) or name not in choices:
        raise UnknownNameError(kind, name, choices)
    return name


def shown(value: object) -> str:
    """Return the text of a value for a message: on a single line and of limited length."""
    text = " ".join(repr(value).split())
    return text if len(text) <= _MAX_SHOWN_LENGTH else f"{text[:_MAX_SHOWN_LENGTH]}..."


def counted(count: int, thing: str) -> str:
    """Return a number with a noun, such as ``1 move`` and ``2 moves``."""
    return f"{count} {thing}{'' if count == 1 else 's'}"


def listed(names: Sequence[str], most: int) -> str:
    """Return names for a message, no more than some of them: ``a, b and 3 more``."""
    more = f" and {len(names) - most:,} more" if len(names) > most else ""
    return f"{', '.join(names[:most])}{more}"


def shortened(text: str) -> str:
    """Return a message without its middle if it is very long, as it may repeat an input."""
    if len(text) <= _BEGINNING + _ENDING:
        return text
    return f"{text[:_BEGINNING]} ... {text[-_ENDING:]}"


def closest(name: str, known: Iterable[str], limit: int = 2) -> str | None:
    """Return the known name that ``name`` most likely stands for.

    Letters of either case count as equal. Names that differ only in glyphs easily confused (l, 1, I; O, 0;
    - and _) come before all others; then the smallest edit distance wins, a swap of neighbours counting one.

    Args:
        name: the name as it was written.
        known: the known names.
        limit: the largest edit distance of a misspelling.

    Returns:
        The nearest name, or None when none is near.
    """
    if len(name) > _MAX_NAME_LENGTH:
        return None
    word = name.upper()
    glyphs = word.translate(_CONFUSABLE)
    best: tuple[int, str] | None = None
    for choice in known:
        other = choice.upper()
        if abs(len(word) - len(other)) > limit:
            continue
        if glyphs == other.translate(_CONFUSABLE):
            return choice
        distance = edit_distance(word, other)
        # A misspelling changes less than half of a word: "A" is not a misspelt "B".
        if distance <= limit and 2 * distance < max(len(word), len(other)) and (best is None or distance < best[0]):
            best = (distance, choice)
    return best[1] if best else None


def _cut(name: str) -> str:
    return name if len(name) <= _MAX_NAME_LENGTH else f"{name[:_MAX_NAME_LENGTH]}..."


@lru_cache(maxsize=4096)
def edit_distance(a: str, b: str) -> int:
    """Return the number of insertions, deletions, changes and neighbour swaps between ``a`` and ``b``.

    Source:
        Damerau (1964), restricted form: no part is edited twice.
    """
    # Common beginnings and endings cost nothing.
    while a and b and a[0] == b[0]:
        a, b = a[1:], b[1:]
    while a and b and a[-1] == b[-1]:
        a, b = a[:-1], b[:-1]
    before_last: list[int] = []
    last = list(range(len(b) + 1))
    for i, x in enumerate(a, 1):
        row = [i]
        for j, y in enumerate(b, 1):
            cost = min(last[j] + 1, row[j - 1] + 1, last[j - 1] + (x != y))
            if i > 1 and j > 1 and x == b[j - 2] and a[i - 2] == y:
                cost = min(cost, before_last[j - 2] + 1)
            row.append(cost)
        before_last, last = last, row
    return last[-1]
