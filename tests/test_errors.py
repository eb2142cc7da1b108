"""What a name was meant to be, and what is wrong with a number."""

import math
from collections.abc import Callable

import pytest

from armwright.arrays import not_negative, positive
from armwright.errors import InvalidValueError, closest, edit_distance


@pytest.mark.parametrize(
    ("a", "b", "slips"),
    [
        ("", "", 0),
        ("arm", "arm", 0),
        ("arm", "rm", 1),
        ("arm", "arms", 1),
        ("arm", "ram", 1),
        ("puma", "pumma", 1),
        ("approach", "appraoch", 1),
        ("kitten", "sitting", 3),
        ("xabcx", "xacbx", 1),
        ("aab", "ab", 1),
        ("abab", "baba", 2),
        ("", "frame", 5),
    ],
)
def test_slips(a: str, b: str, slips: int) -> None:
    """A letter dropped, added or changed is one slip, and so are two neighbours swapped."""
    assert edit_distance(a, b) == edit_distance(b, a) == slips


@pytest.mark.parametrize(
    ("name", "known", "meant"),
    [
        ("objl", ["obj2", "obj1"], "obj1"),
        ("0bj", ["obs", "OBJ"], "OBJ"),
        ("arm-1", ["arm_2", "arm_1"], "arm_1"),
        ("Ilo", ["ilk", "110"], "110"),
    ],
)
def test_glyphs_that_look_alike(name: str, known: list[str], meant: str) -> None:
    """What a scan takes for one another comes before any other slip, whatever the order."""
    assert closest(name, known) == closest(name, known[::-1]) == meant


@pytest.mark.parametrize(
    ("name", "known", "meant"),
    [
        ("pumma560", ["stanford", "puma560"], "puma560"),
        ("APPRAOCH", ["SPEED", "approach"], "approach"),
        ("a", ["b"], None),
        ("cup", ["spout"], None),
        ("lid", [], None),
    ],
)
def test_nearest(name: str, known: list[str], meant: str | None) -> None:
    """The nearest name is meant, unless more than half of it would have to change."""
    assert closest(name, known) == meant


@pytest.mark.parametrize("check", [positive, not_negative])
def test_numbers_out_of_range(check: Callable[[float, str, str], float]) -> None:
    """A message on a number says which end of its range it is beyond."""
    assert check(2.5, "length", "m") == 2.5
    with pytest.raises(InvalidValueError, match=r"^length: expected no more than 1e\+100 m, got inf$"):
        check(math.inf, "length", "m")
    with pytest.raises(InvalidValueError, match=r"^length: expected (more than 0 m|0 m or more), got -1.0$"):
        check(-1.0, "length", "m")
    with pytest.raises(InvalidValueError, match="got nan"):
        check(math.nan, "length", "")
