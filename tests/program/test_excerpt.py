"""What a run did, in the first and the last of it."""

from hypothesis import given, strategies as st

from armwright.program.vm.excerpt import excerpt, listed, more, one_line


@given(st.lists(st.integers(), max_size=30), st.integers(2, 20))
def test_all_are_counted(items: list[int], most: int) -> None:
    """What is shown and what is left out are all there is, in order, and no more is shown than was asked for."""
    first, last, left_out = found = excerpt(items, most)

    assert len(first) + left_out + len(last) == len(items)
    assert list(first) == items[: len(first)]
    assert list(last) == items[len(items) - len(last) :]
    assert len(found.joined()) <= most
    assert (left_out > 0) == (len(items) > most)
    assert found.joined(-1) == [*first, *([-1] if left_out else []), *last]
    assert found.mapped(str).joined() == [str(one) for one in found.joined()]


def test_in_words() -> None:
    """In place of what is left out stands how much it is, and where it is."""
    assert more(299_000) == "... and 299,000 more; all in events.jsonl"
    assert listed(["a", "b", "c", "d", "e"], 2, "see there") == ["a", "... and 3 more; see there", "e"]
    assert listed(["a", "b"], 2) == ["a", "b"]
    assert one_line("a" * 1000) == "a" * 1000
    assert one_line("a" * 1001 + "b" * 500) == f"{'a' * 500} {more(501)} {'b' * 500}"
