"""Facts at one point of a program: they can be invalidated, rolled back, and joined where paths merge."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import reduce
from typing import Any, Generic, TypeVar

import attrs

from armwright.program.language.names import array_name

V = TypeVar("V")

# The key that stands for all names.
EVERYTHING = "*"


def any_element_name(name: str) -> str:
    """Return the array of an element, as a name for any of its elements: ``SLOT[]``; else the name itself."""
    return f"{array_name(name)}[]" if "[" in name else name


@attrs.frozen(kw_only=True)
class Uncertainty:
    """What other processes may change at any time, so that no fact about it holds.

    Attributes:
        names: of variables and arms; ``SLOT[]`` for any element.
        arms: whether it may be any arm.
        everything: whether it may be anything.
        excepted: names that are exempt from both.
        moves_frames: whether frames may move with a child that is rigidly affixed to them.
        aliases: whether a name that is covered may be another name of something else.
    """

    names: frozenset[str] = frozenset()
    arms: bool = False
    everything: bool = False
    excepted: frozenset[str] = frozenset()
    moves_frames: bool = False
    aliases: bool = False

    def covers(self, name: str) -> bool:
        """Whether no fact about a name holds."""
        if name in self.names or any_element_name(name) in self.names:
            return True
        any_name = self.everything or (self.arms and name.startswith("ARM_"))
        return any_name and array_name(name) not in self.excepted


@attrs.frozen
class Outcome:
    """The facts at the end of a path: entries that it changed, and names that it invalidated, by version."""

    changed: Mapping[tuple["FactTable[Any]", str], Any]
    invalidated: Mapping[str, int]

    def value(self, table: "FactTable[V]", key: str) -> V:
        """Return the value of a name at the end of the path."""
        entry = table, key
        value: V = self.changed[entry] if entry in self.changed else table.value_after(key, self.invalidated)
        return value


class Facts:
    """All tables of facts, with a log by which they are rolled back together."""

    def __init__(self) -> None:
        """Start without facts."""
        self.version = 0
        self.invalidated: dict[str, int] = {}
        self.uncertainties: tuple[Uncertainty, ...] = ()
        # The former value of each changed entry, for rolling back.
        self.changes: list[tuple[FactTable[Any] | None, str, Any]] = []

    # ---- invalidation ------------------------------------------------------------------------------------------------

    def invalidate(self, name: str) -> None:
        """Invalidate the facts about a name: ``SLOT[]`` for every element, ``*`` for all names."""
        self.version += 1
        self.changes.append((None, name, self.invalidated.get(name)))
        self.invalidated[name] = self.version

    def is_uncertain(self, name: str) -> bool:
        """Whether other processes may change a name at any time."""
        return any(value.covers(name) for value in self.uncertainties)

    def may_alias(self, name: str) -> bool:
        """Whether a name may be another name of something else."""
        return any(value.aliases and value.covers(name) for value in self.uncertainties)

    # ---- branching and merging paths ---------------------------------------------------------------------------------

    def checkpoint(self) -> int:
        """Return a mark to roll back to."""
        return len(self.changes)

    def outcome(self, mark: int) -> Outcome:
        """Return the changes since a mark."""
        keys = dict.fromkeys((table, key) for table, key, _ in self.changes[mark:] if table is not None)
        return Outcome({(table, key): table[key] for table, key in keys}, dict(self.invalidated))

    def roll_back(self, mark: int) -> None:
        """Restore all facts of a mark."""
        while len(self.changes) > mark:
            table, key, old = self.changes.pop()
            if table is not None:
                table.write(key, old)
            elif old is None:
                del self.invalidated[key]
            else:
                self.invalidated[key] = old

    def join(self, outcomes: Sequence[Outcome], *, concurrent: bool = False) -> None:
        """Join the outcomes of paths that branched here.

        Args:
            outcomes: of the paths; at least one.
            concurrent: whether all paths were taken, side by side, and not one of them.
        """
        joined: list[tuple[FactTable[Any], str, Any]] = []
        for table, key in dict.fromkeys(entry for outcome in outcomes for entry in outcome.changed):
            taken = [outcome for outcome in outcomes if not concurrent or (table, key) in outcome.changed]
            joined.append((table, key, reduce(table.joined, (outcome.value(table, key) for outcome in taken))))
        for name in dict.fromkeys(name for outcome in outcomes for name in outcome.invalidated):
            last = max(outcome.invalidated.get(name, 0) for outcome in outcomes)
            if last != self.invalidated.get(name):
                self.changes.append((None, name, self.invalidated.get(name)))
                self.invalidated[name] = last
        for table, key, value in joined:
            table.set(key, value)


@attrs.define(eq=False)
class FactTable(Generic[V]):
    """One kind of fact, by name.

    Attributes:
        facts: all tables.
        default: value of names without an entry.
        unknown: value of invalidated names (the top of the lattice).
        joined: the join of the values of two paths.
        group: a key that invalidates the whole table.
        watch: called with each value that is written and 1, and with each that is overwritten and -1.
    """

    facts: Facts
    default: V
    unknown: V
    joined: Callable[[V, V], V]
    group: str = ""
    watch: Callable[[V, int], None] | None = None
    _entries: dict[str, tuple[V, int]] = attrs.field(factory=dict, init=False)

    def __getitem__(self, key: str) -> V:
        """Return the value of a name."""
        return self.value_after(key, self.facts.invalidated)

    def value_after(self, key: str, invalidated: Mapping[str, int]) -> V:
        """Return the value of a name after these names have been invalidated."""
        value, version = self._entries.get(key) or (self.default, 0)
        if invalidated:
            latest = invalidated.get
            if version < latest(EVERYTHING, 0) or version < latest(self.group, 0):
                return self.unknown
            if version < latest(any_element_name(key), 0):
                return self.unknown
        return value

    def items(self) -> Iterator[tuple[str, V]]:
        """Yield the entries with their present values."""
        for key in list(self._entries):
            yield key, self[key]

    def set(self, key: str, value: V) -> None:
        """Set the value of a name."""
        facts = self.facts
        if facts.uncertainties and facts.is_uncertain(key):
            value = self.unknown
        facts.changes.append((self, key, self._entries.get(key)))
        self.write(key, (value, facts.version))

    def write(self, key: str, entry: tuple[V, int] | None) -> None:
        """Write an entry, or remove it."""
        old = self._entries.pop(key, None) if entry is None else self._entries.get(key)
        if entry is not None:
            self._entries[key] = entry
        if self.watch is not None:
            for value, count in ((old, -1), (entry, 1)):
                if value is not None:
                    self.watch(value[0], count)


def agreed_value(value: V | None, other: V | None) -> V | None:
    """Return what both paths agree on; None where they differ."""
    return value if value == other else None
