"""Facts of a course: taken back, forgotten, and joined where ways meet."""

import pytest

from armwright.program.flow_analysis.lattice import Facts, FactTable, Uncertainty, same


def book(facts: Facts) -> FactTable[int | None]:
    """Return a book of numbers, -1 where nobody knows."""
    return FactTable(facts, default=None, unknown=-1, joined=lambda one, other: one if one == other else -1)


def test_taken_back() -> None:
    """What was written and forgotten behind a mark is as it was at the mark."""
    facts = Facts()
    numbers = book(facts)
    numbers.put("A", 1)
    mark = facts.checkpoint()
    numbers.put("A", 2)
    numbers.put("B", 3)
    facts.wipe("S[]")
    facts.take_back(mark)

    assert (numbers["A"], numbers["B"], numbers["S[1]"]) == (1, None, None)


@pytest.mark.parametrize(("wiped", "gone"), [("S[]", {"S[1]"}), ("*", {"A", "S[1]", "T[1]"}), ("A", set())])
def test_wiped(wiped: str, gone: set[str]) -> None:
    """Forgetting an array forgets its elements and nothing else; what is written afterwards is known again."""
    facts = Facts()
    numbers = book(facts)
    for name in ("A", "S[1]", "T[1]"):
        numbers.put(name, 1)
    facts.wipe(wiped)

    assert {name for name in ("S[1]", "T[1]") if numbers[name] == -1} == gone - {"A"}
    numbers.put("S[1]", 5)
    assert numbers["S[1]"] == 5


def test_joined() -> None:
    """Where ways meet, what they agree on stays; what one of them has forgotten is unknown."""
    facts = Facts()
    numbers = book(facts)
    for name in ("A", "B", "C", "S[1]", "S[2]"):
        numbers.put(name, 0)
    ways = []
    mark = facts.checkpoint()
    for way in (1, 2):
        numbers.put("A", 7)
        numbers.put("B", way)
        if way == 1:
            facts.wipe("S[]")
            numbers.put("S[2]", 4)
        else:
            numbers.put("S[1]", 0)
            numbers.put("S[2]", 4)
        ways.append(facts.outcome(mark))
        facts.take_back(mark)
    facts.join(ways)

    assert [numbers[name] for name in ("A", "B", "C", "S[1]", "S[2]", "S[3]")] == [7, -1, 0, -1, 4, -1]


def test_gone_together() -> None:
    """Where all ways were gone side by side, what only one of them wrote is as that one wrote it."""
    facts = Facts()
    numbers = book(facts)
    numbers.put("A", 0)
    ways = []
    mark = facts.checkpoint()
    for name in ("A", "B"):
        numbers.put(name, 9)
        ways.append(facts.outcome(mark))
        facts.take_back(mark)
    facts.join(ways, together=True)

    assert (numbers["A"], numbers["B"]) == (9, 9)


def test_shaky() -> None:
    """What others may change at any time stays unknown whatever is written."""
    facts = Facts()
    numbers = book(facts)
    facts.shaky = (Uncertainty(names=frozenset({"A", "S[]"}), arms=True, excepted=frozenset({"ARM_1"})),)
    for name in ("A", "B", "S[1]", "ARM_1", "ARM_10"):
        numbers.put(name, 1)

    assert [numbers[name] for name in ("A", "B", "S[1]", "ARM_1", "ARM_10")] == [-1, 1, -1, 1, -1]


def test_same() -> None:
    """Two ways agree on what is equal."""
    assert same(1, 1) == 1
    assert same(1, 2) is None
