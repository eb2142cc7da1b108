"""What a run did, in the first and the last of it."""

from hypothesis import given, strategies as st

from armwright.program.vm.excerpt import excerpt, omission_text, shorten_line, shorten_list


@given(st.lists(st.integers(), max_size=30), st.integers(2, 20))
def test_all_are_counted(items: list[int], most: int) -> None:
    """What is shown and what is left out are all there is, in order, and no more is shown than was asked for."""
    first, last, left_out = found = excerpt(items, most)

    assert len(first) + left_out + len(last) == len(items)
    assert list(first) == items[: len(first)]
    assert list(last) == items[len(items) - len(last) :]
    assert len(found.join()) <= most
    assert (left_out > 0) == (len(items) > most)
    assert found.join(-1) == [*first, *([-1] if left_out else []), *last]
    assert found.map(str).join() == [str(one) for one in found.join()]


def test_in_words() -> None:
    """In place of what is left out stands how much it is, and where it is."""
    assert omission_text(299_000) == "... and 299,000 more; all in events.jsonl"
    assert shorten_list(["a", "b", "c", "d", "e"], 2, "see there") == ["a", "... and 3 more; see there", "e"]
    assert shorten_list(["a", "b"], 2) == ["a", "b"]
    assert shorten_line("a" * 1000) == "a" * 1000
    assert shorten_line("a" * 1001 + "b" * 500) == f"{'a' * 500} {omission_text(501)} {'b' * 500}"
