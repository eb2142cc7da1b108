"""Facts of a path: rolled back, invalidated, and joined where paths merge."""

import pytest

from armwright.program.flow_analysis.lattice import Facts, FactTable, Uncertainty, agreed_value


def fact_table(facts: Facts) -> FactTable[int | None]:
    """Return a table of numbers, -1 where they are unknown."""
    return FactTable(facts, default=None, unknown=-1, joined=lambda one, other: one if one == other else -1)


def test_taken_back() -> None:
    """What was written and forgotten behind a mark is as it was at the mark."""
    facts = Facts()
    numbers = fact_table(facts)
    numbers.set("A", 1)
    mark = facts.checkpoint()
    numbers.set("A", 2)
    numbers.set("B", 3)
    facts.invalidate("S[]")
    facts.roll_back(mark)

    assert (numbers["A"], numbers["B"], numbers["S[1]"]) == (1, None, None)


@pytest.mark.parametrize(("wiped", "gone"), [("S[]", {"S[1]"}), ("*", {"A", "S[1]", "T[1]"}), ("A", set())])
def test_wiped(wiped: str, gone: set[str]) -> None:
    """Forgetting an array forgets its elements and nothing else; what is written afterwards is known again."""
    facts = Facts()
    numbers = fact_table(facts)
    for name in ("A", "S[1]", "T[1]"):
        numbers.set(name, 1)
    facts.invalidate(wiped)

    assert {name for name in ("S[1]", "T[1]") if numbers[name] == -1} == gone - {"A"}
    numbers.set("S[1]", 5)
    assert numbers["S[1]"] == 5


def test_joined() -> None:
    """Where ways meet, what they agree on stays; what one of them has forgotten is unknown."""
    facts = Facts()
    numbers = fact_table(facts)
    for name in ("A", "B", "C", "S[1]", "S[2]"):
        numbers.set(name, 0)
    ways = []
    mark = facts.checkpoint()
    for way in (1, 2):
        numbers.set("A", 7)
        numbers.set("B", way)
        if way == 1:
            facts.invalidate("S[]")
            numbers.set("S[2]", 4)
        else:
            numbers.set("S[1]", 0)
            numbers.set("S[2]", 4)
        ways.append(facts.outcome(mark))
        facts.roll_back(mark)
    facts.join(ways)

    assert [numbers[name] for name in ("A", "B", "C", "S[1]", "S[2]", "S[3]")] == [7, -1, 0, -1, 4, -1]


def test_gone_together() -> None:
    """Where all ways were gone side by side, what only one of them wrote is as that one wrote it."""
    facts = Facts()
    numbers = fact_table(facts)
    numbers.set("A", 0)
    ways = []
    mark = facts.checkpoint()
    for name in ("A", "B"):
        numbers.set(name, 9)
        ways.append(facts.outcome(mark))
        facts.roll_back(mark)
    facts.join(ways, concurrent=True)

    assert (numbers["A"], numbers["B"]) == (9, 9)


def test_uncertain() -> None:
    """What others may change at any time stays unknown whatever is written."""
    facts = Facts()
    numbers = fact_table(facts)
    facts.uncertainties = (Uncertainty(names=frozenset({"A", "S[]"}), arms=True, excepted=frozenset({"ARM_1"})),)
    for name in ("A", "B", "S[1]", "ARM_1", "ARM_10"):
        numbers.set(name, 1)

    assert [numbers[name] for name in ("A", "B", "S[1]", "ARM_1", "ARM_10")] == [-1, 1, -1, 1, -1]


def test_agreed_value() -> None:
    """Two ways agree on what is equal."""
    assert agreed_value(1, 1) == 1
    assert agreed_value(1, 2) is None
