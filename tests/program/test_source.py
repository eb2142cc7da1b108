"""Texts as editors leave them: line ends, marks at the start, numbers in front."""

import pytest
from hypothesis import given, strategies as st

from armwright.program import Source, compile as translate
from armwright.program.language.source import Span
from armwright.program.syntax.line_numbers import blank_line_numbers


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_line_ends(end: str) -> None:
    """A line ends with a line feed, a carriage return, or both."""
    source = Source("t.rlo", end.join(["BEGIN", "", "END."]))
    last = source.text.index("END")

    assert [source.line_text(line) for line in (1, 2, 3)] == ["BEGIN", "", "END."]
    assert (source.line(last), source.column(last)) == (3, 1)


def test_only_line_ends_end_a_line() -> None:
    """Form feeds and the separators of Unicode are characters of a line, as in an editor."""
    source = Source("t.rlo", "a\x0c\u2028b\nc")

    assert source.line(source.text.index("b")) == 1
    assert source.line(source.text.index("c")) == 2


def test_many_lines_of_either_end() -> None:
    """A million lines that end with returns alone take as long as they are many, not the square of it."""
    assert Source("t.rlo", "\r" * 1_000_000).line_starts == tuple(range(1_000_001))
    assert Source("t.rlo", "\ufeff\r\n\n\r\ra").line_starts == (1, 3, 4, 5, 6)


def test_byte_order_mark() -> None:
    """A mark at the start of the file is no character of the first line."""
    source = Source("t.rlo", "\ufeffBEGIN END.")

    assert source.line_text(1) == "BEGIN END."
    assert source.column(source.text.index("BEGIN")) == 1
    assert translate(source).diagnostics == ()


@given(st.text(alphabet="ab \t\r\n", max_size=30))
def test_every_character_has_a_place(text: str) -> None:
    """Line and column of a character lead back to it."""
    source = Source("t.rlo", text)
    for offset in range(len(text)):
        line, column = source.line(offset), source.column(offset)
        if text[offset] not in "\r\n":
            assert source.line_text(line)[column - 1] == text[offset]


@pytest.mark.parametrize("text", ["", "\n", "// nothing\n", "{ nothing }", "\ufeff", "10", "10\n20\n", "\r\n \t \r\n"])
def test_no_program(text: str) -> None:
    """A text without a program is said to be one, and nothing else."""
    compilation = translate(Source("t.rlo", text))

    assert [one.code for one in compilation.diagnostics] in (["E115"], ["E115", "W101"])
    assert compilation.code is None


def test_numbers_are_blanked_out() -> None:
    """Line numbers leave blanks, so that every other character stays where it was."""
    source = Source("t.rlo", "100   BEGIN\n 200\tEND.\n300\n")
    text, odd = blank_line_numbers(source)

    assert text == "      BEGIN\n    \tEND.\n   \n"
    assert odd == []


def test_digits_are_no_line_numbers_elsewhere() -> None:
    """In a text whose first line has no number, leading digits belong to the program."""
    text = "VAR f : FRAME ;\nBEGIN f = (1,0,0,\n0 ,1,0, 0,0,\n1 , 0,0,0) ; READ VISIONS (f) ; END."
    compilation = translate(Source("t.rlo", text))

    assert blank_line_numbers(compilation.source)[0] == text
    assert compilation.diagnostics == ()


def test_numbered_and_plain_are_the_same_program() -> None:
    """Numbers in front of the lines change places in the text and nothing else."""
    plain = "VAR f : FRAME ;\nBEGIN\nREAD VISIONS (f) ;\nOPEN ARM-1 ;\nMOVE ARM-1 TO f ;\nEND."
    numbered = "\n".join(f"{10 * (index + 1)} {line}" for index, line in enumerate(plain.splitlines()))
    steps = [
        [(step.op, step.operands) for step in code.instructions]
        for text in (plain, numbered)
        if (code := translate(Source("t.rlo", text)).code)
    ]

    assert len(steps) == 2
    assert steps[0] == steps[1]


def test_backwards_number_is_marked() -> None:
    """The number that goes backwards is marked, not the statement behind it."""
    source = Source("t.rlo", "10 BEGIN\n30 OPEN ARM_1 ;\n20 END.")
    (warning,) = translate(source).diagnostics

    assert source.slice(warning.span) == "20"
    assert warning.message == "line number 20 comes after 30"


def test_span_to_span() -> None:
    """A stretch may be drawn from one place to another."""
    assert Span(2, 4).to(Span(7, 9)) == Span(2, 9)
