"""How often the standard asks for each measure to be repeated, and what happens where a test has fewer."""

from collections.abc import Sequence
from typing import Literal, TypeAlias

from armwright.errors import TooFewError

PoseKind: TypeAlias = Literal["pose", "multidirectional", "distance", "drift", "exchangeability", "compliance"]
PathKind: TypeAlias = Literal["settling", "posing", "path", "reorientation", "cornering", "velocity", "weaving"]
Kind: TypeAlias = PoseKind | PathKind
# Cycles that the standard asks for, by the name of the test.
REQUIRED_CYCLES: dict[Kind, int] = {
    "pose": 30,
    "multidirectional": 30,
    "distance": 30,
    "settling": 3,
    "posing": 3,
    "drift": 10,
    "exchangeability": 30,
    "path": 10,
    "reorientation": 10,
    "cornering": 3,
    "velocity": 10,
    "compliance": 3,
    "weaving": 3,
}
# Directions of approach, robots to be exchanged for one another, and loads in steps of 10 % up to the rated one.
DIRECTIONS, ROBOTS, LOADS = 3, 5, 10


def check_cycles(kind: Kind, counts: Sequence[int], *, few: bool, least: int) -> int:
    """Return the smallest number of cycles of a test, if it is enough.

    Args:
        kind: name of the test.
        counts: cycles of each of its parts, such as of every direction of approach.
        few: take fewer than the standard asks for.
        least: what no formula can do without.

    Raises:
        TooFewError: there are fewer than ``least``, or than the standard asks for without ``few``.
    """
    return _check_count(kind, min(counts, default=0), REQUIRED_CYCLES[kind], few=few, least=least, what="cycles")


def check_parts(kind: Kind, count: int, required: int, *, few: bool, what: str) -> None:
    """Refuse too few parts of a test: directions of approach, robots, or loads.

    Raises:
        TooFewError: there are fewer than two, or than the standard asks for without ``few``.
    """
    _check_count(kind, count, required, few=few, least=2, what=what)


def _check_count(kind: Kind, count: int, required: int, *, few: bool, least: int, what: str) -> int:
    if count < least:
        raise TooFewError(f"{kind}: expected at least {least} {what}, got {count}")
    if count < required and not few:
        raise TooFewError(f"{kind}: ISO 9283 requires {required} {what}, got {count}; few=True accepts fewer")
    return count
