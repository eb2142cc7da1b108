"""What is certain at one moment of a program: facts that can be forgotten, taken back, and joined where paths meet."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import reduce
from typing import Any, Generic, TypeVar

import attrs

from armwright.program.language.names import array_name

V = TypeVar("V")

# What stands for every name there is.
EVERYTHING = "*"


def base(name: str) -> str:
    """Return the array of an element, as a name for any of its elements: ``SLOT[]``; else the name itself."""
    return f"{array_name(name)}[]" if "[" in name else name


@attrs.frozen(kw_only=True)
class Uncertainty:
    """What others change at any time, so that nothing can be known of it.

    Attributes:
        names: of variables and arms; ``SLOT[]`` for any element.
        arms: whether it may be any arm.
        everything: whether it may be anything.
        excepted: names of which neither is true.
        places: whether frames may be given other poses through what hangs on them rigidly.
        aliases: whether a name that is covered may be another name of something else.
    """

    names: frozenset[str] = frozenset()
    arms: bool = False
    everything: bool = False
    excepted: frozenset[str] = frozenset()
    places: bool = False
    aliases: bool = False

    def covers(self, name: str) -> bool:
        """Whether nothing can be known of a name."""
        if name in self.names or base(name) in self.names:
            return True
        any_name = self.everything or (self.arms and name.startswith("ARM_"))
        return any_name and array_name(name) not in self.excepted


@attrs.frozen
class Outcome:
    """How a path through a part of a program ended: what it changed, and which names it forgot when."""

    changed: Mapping[tuple["FactTable[Any]", str], Any]
    wipes: Mapping[str, int]


class Facts:
    """All books of one course, which are forgotten and put back together."""

    def __init__(self) -> None:
        """Start without facts."""
        self.tick = 0
        self.wipes: dict[str, int] = {}
        self.shaky: tuple[Uncertainty, ...] = ()
        # What each entry was that has changed, for the way back.
        self.changes: list[tuple[FactTable[Any] | None, str, Any]] = []

    # ---- forgetting ------------------------------------------------------------------------------------------------

    def wipe(self, name: str) -> None:
        """Forget all that is known of a name: ``SLOT[]`` for every element, ``*`` for all there is."""
        self.tick += 1
        self.changes.append((None, name, self.wipes.get(name)))
        self.wipes[name] = self.tick

    def is_shaky(self, name: str) -> bool:
        """Whether others may change something of a name at any time."""
        return any(value.covers(name) for value in self.shaky)

    def may_be_another(self, name: str) -> bool:
        """Whether a name may be another name of something else."""
        return any(value.aliases and value.covers(name) for value in self.shaky)

    # ---- paths that part and meet -----------------------------------------------------------------------------------

    def checkpoint(self) -> int:
        """Return what to go back to later."""
        return len(self.changes)

    def outcome(self, mark: int) -> Outcome:
        """Return what has been changed since a mark."""
        keys = dict.fromkeys((book, key) for book, key, _ in self.changes[mark:] if book is not None)
        return Outcome({(book, key): book[key] for book, key in keys}, dict(self.wipes))

    def take_back(self, mark: int) -> None:
        """Put everything back as it was at a mark."""
        while len(self.changes) > mark:
            book, key, old = self.changes.pop()
            if book is not None:
                book.restore(key, old)
            elif old is None:
                del self.wipes[key]
            else:
                self.wipes[key] = old

    def join(self, outcomes: Sequence[Outcome], *, together: bool = False) -> None:
        """Go on where paths meet that parted here.

        Args:
            outcomes: of the paths; at least one.
            together: whether all of them were gone, side by side, and not one of them.
        """
        joined: list[tuple[FactTable[Any], str, Any]] = []
        for book, key in dict.fromkeys(entry for outcome in outcomes for entry in outcome.changed):
            values = [
                outcome.changed[book, key] if (book, key) in outcome.changed else book.under(key, outcome.wipes)
                for outcome in outcomes
                if not together or (book, key) in outcome.changed
            ]
            joined.append((book, key, reduce(book.joined, values)))
        for name in dict.fromkeys(name for outcome in outcomes for name in outcome.wipes):
            last = max(outcome.wipes.get(name, 0) for outcome in outcomes)
            if last != self.wipes.get(name):
                self.changes.append((None, name, self.wipes.get(name)))
                self.wipes[name] = last
        for book, key, value in joined:
            book.put(key, value)


class FactTable(Generic[V]):
    """One kind of fact, by name."""

    def __init__(
        self,
        facts: Facts,
        *,
        default: V,
        unknown: V,
        joined: Callable[[V, V], V],
        group: str = "",
        watch: Callable[[V, int], None] | None = None,
    ) -> None:
        """Open a book.

        Args:
            facts: all books.
            default: what holds of names that nothing was written of.
            unknown: what is written where one cannot know.
            joined: gives what holds where two paths meet.
            group: a name that, wiped, wipes the whole book.
            watch: told with 1 of each value that is written and with -1 of each that is overwritten.
        """
        self._facts, self._group, self._watch = facts, group, watch
        self.default, self.unknown, self.joined = default, unknown, joined
        self._none = (default, 0)
        self._entries: dict[str, tuple[V, int]] = {}

    def __getitem__(self, key: str) -> V:
        """Return what holds of a name."""
        wipes = self._facts.wipes
        if wipes:
            return self.under(key, wipes)
        return self._entries.get(key, self._none)[0]

    def under(self, key: str, wipes: Mapping[str, int]) -> V:
        """Return what holds of a name if these names have been forgotten."""
        value, tick = self._entries.get(key, self._none)
        array_name, bracket, _ = key.partition("[")
        wiped = wipes.get(f"{array_name}[]" if bracket else key, 0)
        if tick < wiped or tick < wipes.get(EVERYTHING, 0) or tick < wipes.get(self._group, 0):
            return self.unknown
        return value

    def items(self) -> Iterator[tuple[str, V]]:
        """Give what was written, as it holds now."""
        for key in list(self._entries):
            yield key, self[key]

    def put(self, key: str, value: V) -> None:
        """Write what holds of a name from now on."""
        facts = self._facts
        if facts.shaky and facts.is_shaky(key):
            value = self.unknown
        old = self._entries.get(key)
        facts.changes.append((self, key, old))
        self._write(key, old, (value, facts.tick))

    def restore(self, key: str, old: tuple[V, int] | None) -> None:
        """Put an entry back."""
        self._write(key, self._entries.get(key), old)

    def _write(self, key: str, old: tuple[V, int] | None, new: tuple[V, int] | None) -> None:
        if self._watch is not None:
            if old is not None:
                self._watch(old[0], -1)
            if new is not None:
                self._watch(new[0], 1)
        if new is None:
            del self._entries[key]
        else:
            self._entries[key] = new


def same(value: V | None, other: V | None) -> V | None:
    """Return what both paths agree on; None where they differ."""
    return value if value == other else None
