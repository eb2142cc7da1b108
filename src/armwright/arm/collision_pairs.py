"""Pairs of bodies of one arm that its file adds to those that may not meet, or takes away."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, TypeAlias

import attrs

from armwright.errors import InvalidValueError, KindError, UnknownNameError, shown
from armwright.files.document import Table

# Two bodies by their numbers, the smaller one first: 0 is the base, 1 to n are the links, n + 1 is what the tool holds.
Pair: TypeAlias = tuple[int, int]

BASE, TOOL = "base", "tool"


def _pairs(value: Iterable[Sequence[int]]) -> tuple[Pair, ...]:
    try:
        rows = [tuple(row) for row in value]
    except TypeError as error:
        raise KindError(f"expected pairs of numbers of bodies, got {shown(value)}") from error
    pairs = []
    for row in rows:
        if len(row) != 2 or not all(isinstance(number, int) for number in row):
            raise KindError(f"expected a pair of numbers of bodies, got {shown(row)}")
        if row[0] == row[1] or min(row) < 0:
            raise InvalidValueError(f"expected two bodies, numbered from 0, got {row}")
        pairs.append((min(row), max(row)))
    return tuple(dict.fromkeys(pairs))


@attrs.frozen(kw_only=True)
class CollisionPairs:
    """What an arm file says about pairs of bodies of the arm; all other pairs follow the rule.

    Attributes:
        leave_out: pairs that are not checked.
        check: pairs that are checked, also where they are neighbours or always touch.
    """

    leave_out: tuple[Pair, ...] = attrs.field(default=(), converter=_pairs)
    check: tuple[Pair, ...] = attrs.field(default=(), converter=_pairs)

    def __attrs_post_init__(self) -> None:
        """Refuse a pair that is to be checked and left out."""
        both = sorted(set(self.leave_out) & set(self.check))
        if both:
            raise InvalidValueError(f"the pair of bodies {both[0]} is both to be checked and to be left out")


def of_its_bodies(arm: Any, _attribute: object, value: CollisionPairs) -> None:
    """Refuse pairs of bodies that an arm does not have."""
    if not isinstance(value, CollisionPairs):
        raise KindError(f"arm '{arm.name}': collisions: expected CollisionPairs, got {shown(value)}")
    last = max((b for _, b in value.leave_out + value.check), default=0)
    if last > arm.n + 1:
        known = f"from 0 (the base) to {arm.n + 1} (the tool)"
        raise InvalidValueError(f"arm '{arm.name}': collisions: expected numbers of bodies {known}, got {last}")


def body_names(joints: int) -> list[str]:
    """Return what the bodies of an arm are called by their numbers, in files and in tables."""
    return [BASE, *(f"link {number}" for number in range(1, joints + 1)), TOOL]


def collision_pairs_in(table: Table, links: Sequence[str]) -> CollisionPairs:
    """Read the pairs of a file: lists of two names of bodies each.

    A body is called ``base``, ``tool``, ``link 2`` or by the name of its link.

    Args:
        table: with the keys ``leave_out`` and ``check``, both optional.
        links: the names of the links; empty where they have none.

    Raises:
        FileFormatError: a name is unknown, a body is paired with itself, or a pair is in both lists.
    """
    numbers = {name: number for number, name in enumerate(body_names(len(links)))}
    for number, name in enumerate(links, 1):
        if name:
            numbers.setdefault(name, number)
    lists: dict[str, list[Pair]] = {}
    for key in ("leave_out", "check"):
        lists[key] = []
        for index, names in enumerate(table.text_rows(key, 2)):
            unknown = next((name for name in names if name not in numbers), None)
            if unknown is not None:
                raise table.error(key, str(UnknownNameError("body", unknown, numbers)), index)
            a, b = (numbers[name] for name in names)
            if a == b:
                raise table.error(key, f"expected two bodies, got '{names[0]}' and '{names[1]}'", index)
            if key == "check" and (min(a, b), max(a, b)) in lists["leave_out"]:
                raise table.error(key, f"the pair of '{names[0]}' and '{names[1]}' is also in leave_out", index)
            lists[key].append((min(a, b), max(a, b)))
    table.refuse_unknown_keys()
    return CollisionPairs(**lists)
