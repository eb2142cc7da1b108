"""Words, numbers and signs."""

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from armwright.program.source import Source
from armwright.program.tokens import Token, TokenKind, scan


def tokens_of(text: str) -> list[Token]:
    return scan(Source("t.rlo", text), text)[0][:-1]


def codes_of(text: str) -> list[str]:
    return [one.code for one in scan(Source("t.rlo", text), text)[1]]


@pytest.mark.parametrize("text", ["ARM-1", "arm-1", "ARM_1", "Arm_01", "arm-001"])
def test_arm_is_one_token(text: str) -> None:
    """An arm is one token, with a hyphen or a low line, and compares as ARM_1."""
    (token,) = tokens_of(text)

    assert (token.kind, token.key, token.text) == (TokenKind.ARM, "ARM_1", text)


@pytest.mark.parametrize("text", ["ARM - 1", "ARM 1", "ARM -1", "arm_ 1", "ARM"])
def test_arm_with_blanks(text: str) -> None:
    """An arm torn apart is taken for what it was meant to be, and reported once."""
    (token,) = tokens_of(text)

    assert (token.kind, token.key, token.damaged) == (TokenKind.ARM, "ARM_1", True)
    assert codes_of(text) == ["E106"]


@pytest.mark.parametrize("text", ["ARM1", "ARMS", "FARM_1", "ARM_1A", "ARMY-1"])
def test_names_like_arms(text: str) -> None:
    """A name may look like an arm."""
    assert tokens_of(text)[0].kind is TokenKind.NAME
    assert codes_of(text) == []


def test_keywords_in_any_case() -> None:
    """Keywords are reserved in any case, and only as whole words."""
    kinds = [(token.kind, token.key) for token in tokens_of("move Move MOVE movex visions")]

    assert kinds == [
        (TokenKind.KEYWORD, "MOVE"),
        (TokenKind.KEYWORD, "MOVE"),
        (TokenKind.KEYWORD, "MOVE"),
        (TokenKind.NAME, "MOVEX"),
        (TokenKind.NAME, "VISIONS"),
    ]


@pytest.mark.parametrize("text", ["0", "12", "0.5", "12.50", "1e5", "1E+5", "2.5e-3"])
def test_numbers(text: str) -> None:
    """Decimal numbers may have a fraction and an exponent."""
    (token,) = tokens_of(text)

    assert token.kind is TokenKind.NUMBER
    assert float(token.key) == float(text)
    assert codes_of(text) == []


@pytest.mark.parametrize("text", [".5", "5.", "1e", "1.2.3", "12abc", "1_000", "1e999"])
def test_no_numbers(text: str) -> None:
    """What only looks like a number is one token, reported once."""
    (token,) = tokens_of(text)

    assert token.damaged
    assert codes_of(text) == ["E113"]


def test_unit() -> None:
    """A unit that touches its number is part of the token, for RLO-2."""
    (token,) = tokens_of("120mm")

    assert (token.kind, token.text, token.key) == (TokenKind.NUMBER, "120mm", "120")


def test_comments_leave_nothing() -> None:
    """Comments of both kinds vanish, with whatever is in them."""
    assert [token.text for token in tokens_of("a { b ; // } c // d { e\nf")] == ["a", "c", "f"]


@pytest.mark.parametrize(
    ("text", "meant"),
    [("；", ";"), ("，", ","), ("（", "("), ("）", ")"), ("：", ":"), ("＝", "="), ("−", "-"), ("。", ".")],
)
def test_look_alikes(text: str, meant: str) -> None:
    """A mark of another keyboard counts as the one it looks like, and is reported with the change that cures it."""
    found, odd = scan(Source("t.rlo", text), text)

    assert found[0].key == meant
    assert [(one.code, one.fixes[0].replacement) for one in odd] == [("E101", meant)]


def test_look_alikes_once() -> None:
    """The same wrong mark is reported once, with all its places to change."""
    text = "a；b；c；"
    _, (odd,) = scan(Source("t.rlo", text), text)

    assert len(odd.fixes) == 3
    assert odd.notes == ("it stands in 3 places",)


@settings(deadline=None)
@given(st.text(max_size=60))
def test_tokens_lie_in_the_text(text: str) -> None:
    """Of any text whatever the tokens lie one behind the other, and end at its end."""
    found, odd = scan(Source("t.rlo", text), text)

    assert all(before.end <= after.start for before, after in pairwise(found))
    assert found[-1].start == len(text)
    assert all(0 <= one.span.start <= one.span.end <= len(text) for one in odd)


def test_word_in_place() -> None:
    """A token shows its text as written."""
    text = "VAR größe, ＡＢ : FRAME"

    assert [text[token.start : token.end] for token in tokens_of(text)] == ["VAR", "größe", ",", "ＡＢ", ":", "FRAME"]
