"""What can go wrong for a caller: one tree of errors, each also the built-in error it resembles.

A message says what, what was got, what was expected and, where there is one, the nearest valid choice.
"""

import enum
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import ClassVar

# Glyphs that a scan, a listing or a tired eye takes for one another.
_CONFUSABLE = str.maketrans({"I": "1", "L": "1", "O": "0", "-": "_", "S": "5", "B": "8"})
# A longer word is no misspelt name, and comparing two such takes the square of their length.
_LONGEST_NAME = 100
# Of the names that are known, a message lists this many.
_MOST_LISTED = 100
# Of a value that is not what was expected, a message shows this many characters.
_LONGEST_SHOWN = 60
# Of a message so many characters are kept at its beginning, and so many at its end.
_BEGINNING, _ENDING = 4000, 500


class ExitStatus(enum.IntEnum):
    """How a command of the command line ended (docs/exit_status.md)."""

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
    """The caller asked for something that cannot be; the text says what and what to do.

    Attributes:
        exit_status: with which a command ends that raises it; each class has its own.
    """

    exit_status: ClassVar[ExitStatus] = ExitStatus.INFEASIBLE

    def __str__(self) -> str:
        """Return the text, without the middle of a name or value that is a page long."""
        return shortened(super().__str__())


class KindError(ArmwrightError, TypeError):
    """A value is of the wrong kind: a text where numbers belong, a name where an arm does."""

    exit_status = ExitStatus.USAGE


class ShapeError(ArmwrightError, ValueError):
    """An array has the wrong shape."""

    exit_status = ExitStatus.USAGE


class InvalidValueError(ArmwrightError, ValueError):
    """A value is of the right kind but has no meaning here."""

    exit_status = ExitStatus.USAGE


class TooFewError(InvalidValueError):
    """Too little was measured: fewer cycles than a standard asks for, or too few readings for what is sought."""

    exit_status = ExitStatus.INFEASIBLE


class IncapableArmError(InvalidValueError):
    """An arm cannot make a motion at any speed: its joints are too weak, or its file leaves open what they may do."""

    exit_status = ExitStatus.INFEASIBLE


class UnknownNameError(ArmwrightError, LookupError):
    """A name stands for nothing; the text lists what there is."""

    exit_status = ExitStatus.USAGE

    def __init__(self, kind: str, name: object, known: Iterable[str]) -> None:
        """Say that no ``kind`` is called ``name``, and what is known instead."""
        name, choices = str(name), sorted(known)
        near = closest(name, choices)
        hint = f" Did you mean '{near}'?" if near else ""
        more = f" and {len(choices) - _MOST_LISTED:,} more" if len(choices) > _MOST_LISTED else ""
        listing = f" Known: {', '.join(choices[:_MOST_LISTED])}{more}." if choices else " There is none."
        name = name if len(name) <= _LONGEST_NAME else f"{name[:_LONGEST_NAME]}..."
        super().__init__(f"no {kind} '{name}'.{hint}{listing}")


class FileFormatError(ArmwrightError, ValueError):
    """A file does not say what it should; the text names file, line and key."""

    exit_status = ExitStatus.FILE

    def __init__(self, path: Path | str, line: int | None, key: str, message: str) -> None:
        """Point at ``key`` in ``line`` of ``path`` and say what is wrong there."""
        self.path, self.line, self.key = Path(path), line, key
        place = f"{path}:{line}" if line else f"{path}"
        super().__init__(f"{place}: {key}: {message}" if key else f"{place}: {message}")


class ContradictionError(ArmwrightError, ValueError):
    """What was measured contradicts the model: no values of its parameters explain the data."""


class DoubtfulError(ContradictionError):
    """All was done and told, and the data contradict the model all the same; the text says by what."""


class CheckFailedError(ArmwrightError, ValueError):
    """All was done, and what was to be checked does not hold; the text says what."""

    exit_status = ExitStatus.CHECK_FAILED


class UnsupportedArmError(ArmwrightError, ValueError):
    """The method does not fit this arm."""


class MissingExtraError(ArmwrightError, ImportError):
    """Something needs a library that the core does not install; the text says how to get it."""


class OutputError(ArmwrightError, OSError):
    """A result could not be written; nothing half-written was left behind."""

    exit_status = ExitStatus.FILE


class GravityWarning(UserWarning):
    """An arm states a gravity of its own, and stands in a cell, whose gravity counts."""


class RotationWarning(UserWarning):
    """A matrix typed as a rotation is nearly one; the nearest rotation has been taken."""


class UnitWarning(UserWarning):
    """A number looks as if it were in another unit: degrees where radians belong."""


class IncompleteRowsWarning(UserWarning):
    """Rows of a table were left out as asked, since cells are empty."""


class CacheWarning(UserWarning):
    """The cache folder cannot be trusted and is not used; every start compiles anew."""


def one_of(kind: str, name: str, known: Iterable[str]) -> str:
    """Return ``name`` if it is one of those known.

    Args:
        kind: what is named, as a message calls it.
        name: what was asked for.
        known: what there is.

    Raises:
        UnknownNameError: there is nothing of that name; the nearest is told.
    """
    choices = tuple(known)
    if not isinstance(name, str) or name not in choices:
        raise UnknownNameError(kind, name, choices)
    return name


def shown(value: object) -> str:
    """Write a value for a message: on one line, not too long."""
    text = " ".join(repr(value).split())
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}..."


def counted(count: int, thing: str) -> str:
    """Return how many there are of a thing, such as ``1 move`` and ``2 moves``."""
    return f"{count} {thing}{'' if count == 1 else 's'}"


def shortened(text: str) -> str:
    """Return a message without its middle where it is longer than anybody reads: it repeats what was given."""
    if len(text) <= _BEGINNING + _ENDING:
        return text
    return f"{text[:_BEGINNING]} ... {text[-_ENDING:]}"


def closest(name: str, known: Iterable[str], limit: int = 2) -> str | None:
    """Return the known name that ``name`` was most likely meant to be.

    Letters of either case count as equal. Names that differ only in glyphs easily confused (l, 1, I; O, 0;
    - and _) come before all others; then the smallest edit distance wins, a swap of neighbours counting one.

    Args:
        name: what was written.
        known: what could have been meant.
        limit: the largest edit distance still taken for a slip.

    Returns:
        The nearest name, or None when none is near.
    """
    if len(name) > _LONGEST_NAME:
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
        # A slip changes less than half of a word: "A" is not a misspelt "B".
        if distance <= limit and 2 * distance < max(len(word), len(other)) and (best is None or distance < best[0]):
            best = (distance, choice)
    return best[1] if best else None


@lru_cache(maxsize=4096)
def edit_distance(a: str, b: str) -> int:
    """Count the insertions, deletions, changes and neighbour swaps that turn ``a`` into ``b``.

    Source:
        Damerau (1964), restricted form: no part is edited twice.
    """
    # What both begin or end with costs nothing.
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
