"""Words, numbers and signs."""

from itertools import pairwise

import pytest
from hypothesis import given, strategies as st

from armwright.program.language.source import Source, Span
from armwright.program.language.words import VOCABULARIES, Standard
from armwright.program.syntax.lexer import ScannedText, Token, TokenKind, scan


def scanned(text: str, standard: Standard = Standard.RLO_2) -> ScannedText:
    return scan(Source("t.rlo", text), text, standard)


def tokens_of(text: str, standard: Standard = Standard.RLO_2) -> tuple[Token, ...]:
    return scanned(text, standard).tokens[:-1]


def codes_of(text: str, standard: Standard = Standard.RLO_2) -> list[str]:
    return [one.code for one in scanned(text, standard).diagnostics]


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


@pytest.mark.parametrize("text", ["0", "12", "0.5", "12.50", "1e5", "1E+5", "2.5e-3", "1e100"])
def test_numbers(text: str) -> None:
    """Decimal numbers may have a fraction and an exponent."""
    (token,) = tokens_of(text)

    assert token.kind is TokenKind.NUMBER
    assert float(token.key) == float(text)
    assert codes_of(text) == []


@pytest.mark.parametrize("text", [".5", "5.", "1e", "1.2.3", "12abc", "1_000", "1e999", "1e101"])
def test_malformed_numbers(text: str) -> None:
    """What only looks like a number is one token, reported once."""
    (token,) = tokens_of(text)

    assert token.damaged
    assert codes_of(text) == ["E113"]


@pytest.mark.parametrize("standard", Standard)
@pytest.mark.parametrize(("text", "digits"), [("120mm", "120"), ("2.5E3Cm", "2.5E3"), ("1e97m", "1e97"), ("3s", "3")])
def test_unit_is_part_of_its_number(text: str, digits: str, standard: Standard) -> None:
    """A unit that touches its number is part of the token, also for RLO-83, which has none to allow it."""
    (token,) = tokens_of(text, standard)

    assert (token.kind, token.text, token.key, token.damaged) == (TokenKind.NUMBER, text, digits, False)
    assert codes_of(text, standard) == []


@pytest.mark.parametrize("text", ["5mmm", "5metres", "1.5.2mm", "1e999mm", "1e98m", ".5mm"])
def test_malformed_units(text: str) -> None:
    """What only looks like a number with a unit is one token, reported once."""
    (token,) = tokens_of(text)

    assert token.damaged
    assert codes_of(text) == ["E113"]


@pytest.mark.parametrize("word", ["wait", "For", "COEND", "on", "nonrigidly", "blend"])
def test_words_of_rlo_2(word: str) -> None:
    """What RLO-2 adds to the reserved words are names in RLO-83."""
    kinds = [tokens_of(word, standard)[0].kind for standard in Standard]

    assert kinds == [TokenKind.NAME, TokenKind.KEYWORD]


def test_names_of_the_report() -> None:
    """No name that the report uses is reserved, nor what has a meaning in one place only."""
    names = "OBJ1 STOP f1 t1 tool1 apf1 def1 grasp1 lvpoint show station viaf1 n1 visions system mm xyz force x"

    assert {token.kind for token in tokens_of(names)} == {TokenKind.NAME}
    assert [len(VOCABULARIES[standard].reserved) for standard in Standard] == [23, 23 + 36]


@pytest.mark.parametrize("text", ['""', '"seated"', '"a; { b } // c"', '"größe；"', '"\t"'])
def test_strings(text: str) -> None:
    """Between two marks anything is a text, exactly as written."""
    (token,) = tokens_of(text)

    assert (token.kind, token.text) == (TokenKind.STRING, text)
    assert codes_of(text) == []


def test_string_that_is_not_closed() -> None:
    """A text ends with its line at the latest; what was meant to stand behind it still counts."""
    text = 'PRINT("done) ;\nHALT'

    assert [token.key for token in tokens_of(text)] == ["PRINT", "(", '"', ")", ";", "HALT"]
    assert codes_of(text) == ["E120"]


@pytest.mark.parametrize("sign", ["==", "!=", "=<", "=>", "&&", "||", ":="])
def test_signs_of_other_languages(sign: str) -> None:
    """What other languages write is one token, so that the parser can tell what it should be."""
    assert [token.key for token in tokens_of(f"a{sign}b")] == ["A", sign, "B"]


def test_comments_are_kept() -> None:
    """The place of every comment is known, for whoever writes the program anew."""
    text = "a { b } c // d\ne"
    found = scanned(text)

    assert found.comments == (Span(2, 7), Span(10, 14))
    assert [text[span.start : span.end] for span in found.comments] == ["{ b }", "// d"]


def test_comments_leave_nothing() -> None:
    """Comments of both kinds vanish, with whatever is in them."""
    assert [token.text for token in tokens_of("a { b ; // } c // d { e\nf")] == ["a", "c", "f"]


@pytest.mark.parametrize(
    ("text", "meant"),
    [("；", ";"), ("，", ","), ("（", "("), ("）", ")"), ("：", ":"), ("＝", "="), ("−", "-"), ("。", ".")],
)
def test_characters_that_look_like_signs(text: str, meant: str) -> None:
    """A mark of another keyboard counts as the one it looks like, and is reported with the change that cures it."""
    found = scanned(text)

    assert found.tokens[0].key == meant
    assert [(one.code, one.fixes[0].replacement) for one in found.diagnostics] == [("E101", meant)]


def test_wrong_sign_is_reported_once() -> None:
    """The same wrong mark is reported once, with all its places to change."""
    (odd,) = scanned("a；b；c；").diagnostics

    assert len(odd.fixes) == 3
    assert odd.notes == ("it occurs in 3 places",)


@given(st.text(max_size=60), st.sampled_from(Standard))
def test_tokens_lie_in_the_text(text: str, standard: Standard) -> None:
    """Of any text whatever the tokens lie one behind the other, and end at its end."""
    found = scanned(text, standard)

    assert all(before.end <= after.start for before, after in pairwise(found.tokens))
    assert found.tokens[-1].start == len(text)
    assert all(0 <= one.span.start <= one.span.end <= len(text) for one in found.diagnostics)
    assert all(before.end <= after.start for before, after in pairwise(found.comments))


def test_tokens_show_their_text() -> None:
    """A token shows its text as written."""
    text = "VAR größe, ＡＢ : FRAME"

    assert [text[token.start : token.end] for token in tokens_of(text)] == ["VAR", "größe", ",", "ＡＢ", ":", "FRAME"]


def test_many_strange_characters() -> None:
    """A million control characters are one mistake, and take as long as they are many, not the square of it."""
    found = scanned("\x01" * 1_000_000 + "\nPAUSE 1").diagnostics

    assert [diagnostic.code for diagnostic in found] == ["E101"]
    assert found[0].notes == ("it occurs in 1000000 places",)
    between = scanned("\x01a" * 90_000)
    assert [diagnostic.code for diagnostic in between.diagnostics] == ["E101"]
    assert all(token.damaged for token in between.tokens[:-1])


def test_what_stands_behind_a_strange_character() -> None:
    """It has been told of, up to the end of its line; the next line is judged by itself."""
    found = scanned("a \x01 \x01 b c\n\x01\nd e")

    assert [token.text for token in found.tokens if token.damaged] == ["b"]
