"""Colours of programs in Pygments."""

import importlib
import tomllib
from pathlib import Path

import pytest
from hypothesis import assume, example, given, settings, strategies as st
from pygments.token import Comment, Error, Keyword, Name, Number, Operator, Punctuation, String, Whitespace, _TokenType

from armwright.program.language.position_codec import PositionCodec
from armwright.program.language.source import Source
from armwright.program.language.units import UNITS
from armwright.program.language.words import SENSORS, VOCABULARIES, WORDS_IN_CONTEXT, Standard
from armwright.program.language_server.analysis import Settings, analyse
from armwright.program.language_server.cell_lookup import CellCache
from armwright.program.language_server.highlight import DECLARATIONS, KEYWORDS, OPERATORS, TYPES, RloLexer
from armwright.program.language_server.symbol_index import NameKind
from armwright.program.semantics.builtins import FUNCTIONS
from armwright.program.semantics.symbols import PREDECLARED
from armwright.program.syntax.lexer import TokenKind, scan
from armwright.program.syntax.line_numbers import blank_line_numbers
from program.shelf import ACCEPTED, CORPUS
from samples import examples

PROGRAMS = [*sorted(CORPUS.glob("*.rlo")), *ACCEPTED]
RESERVED = VOCABULARIES[Standard.RLO_2].reserved

# What the translator calls a token, and what its colour may be.
COLOURS = {
    TokenKind.NAME: (Name, Keyword.Pseudo, Keyword.Type),
    TokenKind.KEYWORD: (Keyword, Operator.Word),
    TokenKind.ARM: (Name.Builtin.Pseudo,),
    TokenKind.NUMBER: (Number,),
    TokenKind.STRING: (String,),
    TokenKind.SYMBOL: (Operator, Punctuation),
}

# Texts that look like programs more often than chance would have it.
_SCRAPS = (
    *(RESERVED | WORDS_IN_CONTEXT | UNITS.keys() | FUNCTIONS.keys() | frozenset(SENSORS)),
    *("ARM_1", "arm-2", "ARM", "x", "a_1", "1", "0.5", "1E5", "2mm", "10 ", "\r\n100 ", '"text"', "{ a }", "// b\n"),
    *("<=", "<>", ">=", *" \t\n;,.:=()[]+-*/<>#'{}"),
)
PIECES = st.lists(st.sampled_from(sorted(_SCRAPS)), max_size=30).map("".join)


def coloured(text: str) -> list[tuple[_TokenType, str]]:
    """Return kind and text of everything but blanks."""
    return [(kind, value) for _, kind, value in RloLexer().get_tokens_unprocessed(text) if kind is not Whitespace]


@given(st.one_of(st.text(max_size=80), PIECES))
def test_text_comes_back(text: str) -> None:
    """Colouring changes no character of any text, and says of each where it stands."""
    pieces = list(RloLexer().get_tokens_unprocessed(text))

    assert "".join(value for *_, value in pieces) == text
    assert all(value and text.startswith(value, start) for start, _, value in pieces)


@pytest.mark.parametrize("word", sorted(RESERVED))
def test_reserved_words(word: str) -> None:
    """Every reserved word is a keyword in any case, and the beginning of a longer name is not."""
    for written in (word, word.lower(), word.capitalize()):
        ((kind, value),) = coloured(written)
        assert kind in Keyword or kind is Operator.Word
        assert value == written
    assert coloured(f"{word}x {word}_ {word}1") == [(Name, f"{word}x"), (Name, f"{word}_"), (Name, f"{word}1")]


def test_every_word_in_one_group() -> None:
    """The four groups of words share none, and together are the reserved words."""
    groups = (DECLARATIONS, TYPES, OPERATORS, KEYWORDS)

    assert frozenset().union(*groups) == RESERVED
    assert sum(map(len, groups)) == len(RESERVED)


@pytest.mark.parametrize("text", ["ARM-1", "arm_1", "Arm-012"])
def test_arm_is_one_token(text: str) -> None:
    """An arm is one token, with a hyphen or a low line, and no subtraction."""
    assert coloured(text) == [(Name.Builtin.Pseudo, text)]


@pytest.mark.parametrize(
    "text", ["ARM - 1", "ARM 1", "ARM", "12abc", "5.", ".5", "1.2.3", '"open', "größe", "==", "#", "}"]
)
def test_what_is_no_token(text: str) -> None:
    """What the translator refuses as a token is shown as wrong, in one piece."""
    assert coloured(text) == [(Error, text)]


@pytest.mark.parametrize("unit", sorted(UNITS))
def test_units(unit: str) -> None:
    """A unit that touches its number is shown as one; alone it is a name."""
    assert coloured(f"1.5E-3{unit}") == [(Number, "1.5E-3"), (Keyword.Type, unit)]
    assert coloured(f"20{unit.lower()};") == [(Number, "20"), (Keyword.Type, unit.lower()), (Punctuation, ";")]
    assert coloured(unit) == [(Name, unit)]


def test_units_of_the_program() -> None:
    """Behind UNITS stand units, up to the semicolon."""
    assert coloured("UNITS MM, { turns } deg ; mm") == [
        (Keyword.Declaration, "UNITS"),
        (Keyword.Type, "MM"),
        (Punctuation, ","),
        (Comment.Multiline, "{ turns }"),
        (Keyword.Type, "deg"),
        (Punctuation, ";"),
        (Name, "mm"),
    ]


def test_sensors() -> None:
    """VISIONS and SYSTEM are words behind READ, and names elsewhere."""
    assert coloured("READ VISIONS read system visions") == [
        (Keyword, "READ"),
        (Keyword.Pseudo, "VISIONS"),
        (Keyword, "read"),
        (Keyword.Pseudo, "system"),
        (Name, "visions"),
    ]


def test_zero_force() -> None:
    """ZERO and FORCE are words together, and names or a function elsewhere."""
    assert coloured("zero  force zero force(force") == [
        (Keyword.Pseudo, "zero"),
        (Keyword.Pseudo, "force"),
        (Keyword.Pseudo, "zero"),
        (Keyword.Pseudo, "force"),
        (Punctuation, "("),
        (Name, "force"),
    ]


def test_functions_and_procedures() -> None:
    """What is called is a function; the language's own and what needs no declaration stand out."""
    assert coloured("PROCEDURE place ; xyz (place(world), xyz, station") == [
        (Keyword.Declaration, "PROCEDURE"),
        (Name.Function, "place"),
        (Punctuation, ";"),
        (Name.Builtin, "xyz"),
        (Punctuation, "("),
        (Name.Function, "place"),
        (Punctuation, "("),
        (Name.Builtin.Pseudo, "world"),
        (Punctuation, ")"),
        (Punctuation, ","),
        (Name, "xyz"),
        (Punctuation, ","),
        (Name.Builtin.Pseudo, "station"),
    ]
    assert all(coloured(f"{function}(")[0] == (Name.Builtin, function) for function in FUNCTIONS)
    assert all(coloured(name) == [(Name.Builtin.Pseudo, name)] for name in PREDECLARED)


def test_comments() -> None:
    """A comment goes on over several lines up to its brace, or up to the end of its line."""
    assert coloured("{ MOVE\n\n// 1 } x // BEGIN }\ny { open\nstill") == [
        (Comment.Multiline, "{ MOVE\n\n// 1 }"),
        (Name, "x"),
        (Comment.Single, "// BEGIN }"),
        (Name, "y"),
        (Comment.Multiline, "{ open\nstill"),
    ]


def test_line_numbers() -> None:
    """The numbers of a numbered listing are labels, even inside a comment, but not a number that goes on a matrix."""
    assert coloured("\n 10 BEGIN { a\n20 b }\n30 f = (1,\n0, 1)") == [
        (Name.Label, "10"),
        (Keyword, "BEGIN"),
        (Comment.Multiline, "{ a\n"),
        (Name.Label, "20"),
        (Comment.Multiline, " b }"),
        (Name.Label, "30"),
        (Name, "f"),
        (Operator, "="),
        (Punctuation, "("),
        (Number, "1"),
        (Punctuation, ","),
        (Number, "0"),
        (Punctuation, ","),
        (Number, "1"),
        (Punctuation, ")"),
    ]


def test_no_line_numbers() -> None:
    """In a listing whose first line has no number, numbers are numbers."""
    assert coloured("BEGIN\n20 END.")[1] == (Number, "20")


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.stem)
def test_programs(path: Path) -> None:
    """In programs that are meant well nothing is shown as wrong."""
    wrong = [value for kind, value in coloured(path.read_text(encoding="utf-8")) if kind is Error]

    assert wrong == []


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.stem)
def test_as_the_translator_reads(path: Path) -> None:
    """Where the translator sees a token, its colour is that of its kind."""
    text = path.read_text(encoding="utf-8")
    source = Source(path.name, text)
    kinds = {start: kind for start, kind, _ in RloLexer().get_tokens_unprocessed(text)}

    odd = [
        (token.text, token.kind, kinds.get(token.start))
        for token in scan(source, blank_line_numbers(source)[0]).tokens[:-1]
        if not any(kinds.get(token.start) in colour for colour in COLOURS[token.kind])
        and not (token.key in WORDS_IN_CONTEXT and kinds.get(token.start) in Keyword)
    ]

    assert odd == []


@pytest.mark.drawn(0.2)
@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.stem)
def test_names_are_no_words(path: Path) -> None:
    """What the compiler takes for a variable, a procedure or a device never has the colour of a word."""
    text = path.read_text(encoding="utf-8")
    analysis = analyse(path.name, PositionCodec(text), path.parent, CellCache(), Settings())
    kinds = {start: kind for start, kind, _ in RloLexer().get_tokens_unprocessed(text)}
    named = (NameKind.VARIABLE, NameKind.PROCEDURE, NameKind.DEVICE, NameKind.TIMER, NameKind.ERROR)

    assert [it.key for it in analysis.occurrences if it.kind in named and kinds[it.start] in Keyword] == []


def test_words_in_context() -> None:
    """Words that may be names have the colour of words where they are words, and of names where they are names."""
    text = """\
CONST a = 1 ; { CONST RECORD RECORD }
RECORD part ; w : TEXT ; END ;
FUNCTION twice(IN n : SCALAR, INOUT m : BOOLEAN) : SCALAR ; BEGIN RETURN 2 * n END ;
BEGIN
  WHEN door : x > 3 DO BEGIN BRAKE ; RESUME END ;
  WHEN PRIORITY 2 : NOT y DO BRAKE ;
  TIMER t ON ; LOG "a" (n) ; PULSE v FOR 3 ; RAISE jam WITH "x" ;
  MOVE ARM_1 TO f CIRCULARLY, VIA (b), WITH VELOCITY = 3, WITH TRACKING = belt ;
  MOVE ARM_1 TO f SMOOTHLY ; MOVE ARM_1 TO f STRAIGHTLY, SMOOTHLY, WITH SPEED = 3 ;
  MOVE ARM_1 TO f SMOOTHLY,
       WITH SPEED = 3,
       WITH APPROACH = g ;
  WAIT UNTIL x WITHIN 3 ELSE HALT ;
END.
"""
    words = [word for kind, word in coloured(text) if kind in Keyword and word in WORDS_IN_CONTEXT]
    assert words == [
        *("CONST", "RECORD", "TEXT", "FUNCTION", "IN", "INOUT", "BOOLEAN", "RETURN", "WHEN", "BRAKE", "RESUME"),
        *("WHEN", "BRAKE", "TIMER", "LOG", "PULSE", "RAISE", "CIRCULARLY", "VELOCITY", "TRACKING"),
        *("SMOOTHLY", "SMOOTHLY", "SMOOTHLY", "WITHIN"),
    ]
    for word in sorted(WORDS_IN_CONTEXT | {"MODULE", "AS"}):
        uses = (
            f"VAR a,\n    {word},\n    b, {word} : SCALAR ;\nBEGIN\n"
            f"  {word} = 1 ;\n  a = {word} ;\n  a = 2 * {word} + {word} ;\n"
            f"  IF {word} > 1 AND {word} = 3 THEN {word} = 2 ELSE a = {word} ;\n  WHILE a < {word} DO {word}(a) ;\n"
            f"  PRINT({word}, {word}[2], a, {word}) ;\n  MOVE ARM_1 TO {word} ;\n  LOCK ({word}) DO SIGNAL {word} ;\n"
            f"  PAUSE {word} ; WAIT {word} ; FOR {word} = {word} TO {word} STEP {word} DO ;\nEND.\n"
        )
        names = [kind for kind, found in coloured(uses) if found == word and kind in Keyword]
        assert names == [], word


@settings(max_examples=examples(300))
@given(PIECES)
@example("ABS.ABS. a.b.. A.IF IF.a ARM_1.x PROCEDURE a.b")
@example("BRAKEEND\nRESUMEELSE )SMOOTHLYEND SMOOTHLYVIA(")
@example("READ SYSTEM.x ZERO FORCE.y UNITS MM.z")
def test_cut_like_the_translator(text: str) -> None:
    """Of any text without damage the lexer and the translator see the same tokens."""
    source = Source("t.rlo", text)
    scanned = scan(source, blank_line_numbers(source)[0])
    assume(not scanned.diagnostics)
    pieces = list(RloLexer().get_tokens_unprocessed(text))

    starts = [
        start
        for i, (start, kind, _) in enumerate(pieces)
        if kind not in Comment
        and kind not in (Whitespace, Name.Label)
        and not (kind is Keyword.Type and i and pieces[i - 1][1] is Number)
    ]

    assert starts == [token.start for token in scanned.tokens[:-1]]


def test_registered() -> None:
    """The package offers Pygments its lexer under the name rlo."""
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    module, _, name = project["entry-points"]["pygments.lexers"]["rlo"].partition(":")

    lexer = getattr(importlib.import_module(module), name)

    assert lexer is RloLexer
    assert (lexer.aliases, lexer.filenames) == (["rlo"], ["*.rlo"])
