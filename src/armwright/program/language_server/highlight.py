"""Colours for programs: a Pygments lexer, and the groups of words that every editor colours alike."""

import re
from collections import deque
from collections.abc import Collection, Iterable, Iterator
from typing import ClassVar

from pygments.lexer import RegexLexer, default, include
from pygments.token import Comment, Error, Keyword, Name, Number, Operator, Punctuation, String, Whitespace, _TokenType

from armwright.program.language.source import Source
from armwright.program.language.units import UNITS
from armwright.program.language.words import (
    HEADERS_IN_CONTEXT,
    PARAMETER_MODES,
    PLAIN_CLAUSES_IN_CONTEXT,
    RLO_2_TYPES,
    SENSORS,
    STATEMENT_PHRASES,
    STATEMENTS_ALONE,
    STATEMENTS_BEFORE_NAME,
    STATEMENTS_BEFORE_TEXT,
    TYPES_IN_CONTEXT,
    VOCABULARIES,
    WITH_CLAUSES_IN_CONTEXT,
    WORDS_IN_CONTEXT,
    Standard,
)
from armwright.program.semantics.builtins import FUNCTIONS
from armwright.program.semantics.symbols import PREDECLARED
from armwright.program.syntax.line_numbers import blank_line_numbers

_VOCABULARY = VOCABULARIES[Standard.RLO_2]

# Every reserved word is in one of these four.
DECLARATIONS = frozenset(_VOCABULARY.headers)
TYPES = frozenset((*_VOCABULARY.types, *RLO_2_TYPES)) - WORDS_IN_CONTEXT
OPERATORS = frozenset(("AND", "OR", "NOT"))
KEYWORDS = _VOCABULARY.reserved - DECLARATIONS - TYPES - OPERATORS

# A reserved word; and what is none, one blank or more behind a word; in the dialect of all editors.
RESERVED_WORDS = rf"(?:{'|'.join(sorted(_VOCABULARY.reserved))})(?!\w)"
_BEFORE_NAME = rf"(?=[ \t]+(?!{RESERVED_WORDS})[A-Z])"
_BEFORE_VALUE = rf"(?=[ \t]+(?:NOT(?!\w)|(?!{RESERVED_WORDS})[A-Z0-9\"]))"
_AT_END = r"(?!\w)(?=[ \t]*(?:;|[\r\n]|$|END(?!\w)|ELSE(?!\w)))"
# Where a line or a statement begins.
_AT_START = r"(?:^|(?<=;)|(?<=[;\t0-9] )|(?<=  )|(?<=BEGIN )|(?<=THEN )|(?<=ELSE )|(?<=DO ))"


def _words(words: Iterable[str]) -> str:
    return f"(?:{'|'.join(sorted(words))})"


def _not_behind(words: Iterable[str]) -> str:
    """Return a pattern for a place that is not one blank behind any of some words, of which names may follow."""
    by_length: dict[int, list[str]] = {}
    for word in sorted(words):
        by_length.setdefault(len(word), []).append(word)
    return "".join(rf"(?<!\b(?:{'|'.join(some)}) )" for some in by_length.values())


# Where an adverb follows a name, and where nothing but another clause, or the end, follows it.
_ADVERBS = ("DIRECTLY", "STRAIGHTLY", *PLAIN_CLAUSES_IN_CONTEXT)
_BEHIND_NAME = rf"(?<=[A-Z0-9_] ){_not_behind((_VOCABULARY.reserved | WORDS_IN_CONTEXT) - set(_ADVERBS))}"
_BEFORE_CLAUSE = rf"(?:{_AT_END}|(?=,[ \t]*(?:[\r\n]|$)|,?[ \t]+(?:WITH|ON|VIA|{'|'.join(_ADVERBS)})(?!\w)))"
# Clauses of queues and of corrected paths.
_MORE_CLAUSES = ("BOUND", "CAPACITY", "CORRECTION", "RATE")
# Words that programs may use as names, where what is around them tells that they are words of the language: the kind
# of each group, and a pattern that a variable of that name matches in no program, or in none that is formatted.
CONTEXT_PATTERNS = (
    ("declaration", rf"FUNCTION{_BEFORE_NAME}"),
    ("declaration", rf"{_words(set(HEADERS_IN_CONTEXT) - {'FUNCTION'})}{_BEFORE_NAME}"),
    ("declaration", rf'(?:(?<=")|(?<=" ))AS{_BEFORE_NAME}'),
    ("type", rf"(?:(?<=[:])|(?<=: )|(?<=OF )){_words(TYPES_IN_CONTEXT)}(?=[ \t]*[;)])"),
    ("keyword", rf"{_words(PARAMETER_MODES)}{_BEFORE_NAME}"),
    ("keyword", rf"{_words({*STATEMENTS_BEFORE_NAME, 'PUT', 'QUEUE'})}{_BEFORE_NAME}"),
    ("keyword", rf'{_words(STATEMENTS_BEFORE_TEXT)}(?=[ \t]*")'),
    ("keyword", rf"{_AT_START}{_words(STATEMENTS_ALONE)}{_AT_END}"),
    ("keyword", rf"(?<=WITH ){_words({*WITH_CLAUSES_IN_CONTEXT, *_MORE_CLAUSES})}(?=[ \t]*=)"),
    ("keyword", rf"(?<!\bTO ){_words(PLAIN_CLAUSES_IN_CONTEXT)}(?!\w)(?=[ \t]*,?[ \t]*VIA(?!\w))"),
    ("keyword", rf"(?:(?<=[)\]])|(?<=[)\]] )|(?<=[)\]], )){_words(PLAIN_CLAUSES_IN_CONTEXT)}{_BEFORE_CLAUSE}"),
    ("keyword", rf"{_BEHIND_NAME}{_words(PLAIN_CLAUSES_IN_CONTEXT)}{_BEFORE_CLAUSE}"),
    ("keyword", rf"(?<=LY, ){_words(PLAIN_CLAUSES_IN_CONTEXT)}{_BEFORE_CLAUSE}"),
    ("keyword", rf"(?:RETURN|WITHIN|WHEN){_BEFORE_VALUE}"),
    ("keyword", r"WHEN(?=[ \t]+PRIORITY(?!\w))"),
)
_KINDS = {"declaration": Keyword.Declaration, "type": Keyword.Type, "keyword": Keyword}

_PART = r"(?a:[A-Z]\w*)"
_NAME = rf"{_PART}(?!\w)"
# The name of a module or a record, and what is behind its point; behind a keyword the point ends the program.
_QUALIFIED = rf"(?!(?a:{RESERVED_WORDS})){_PART}(?:\.{_PART})+(?!\w)"
_NUMBER = r"[0-9]+(?:\.[0-9]+)?(?a:E[+-]?[0-9]+)?"


def _any_of(words: Collection[str]) -> str:
    """Return a pattern for one of some words, in any case and not as the beginning of a longer one."""
    return rf"(?a:{'|'.join(sorted(words))})(?!\w)"


def _alone(words: Collection[str]) -> str:
    """Return a pattern for one of some words, not as the first part of a qualified name either."""
    return rf"{_any_of(words)}(?!\.[^\W\d_])"


def _phrases() -> Iterator[tuple[str, _TokenType, str]]:
    """Yield the rules of words that start a statement in front of another one."""
    for one, other in STATEMENT_PHRASES.items():
        yield rf"(?a:{one}(?=[ \t]+{_alone([other])}))", Keyword.Pseudo, "phrase"


def _context_rules() -> Iterator[tuple[str, _TokenType] | tuple[str, _TokenType, str]]:
    """Yield the rules of words in context; the name behind FUNCTION is that of a function."""
    for kind, pattern in CONTEXT_PATTERNS:
        rule = rf"(?a:{pattern})", _KINDS[kind]
        yield (*rule, "procedure") if pattern.startswith("FUNCTION") else rule


class RloLexer(RegexLexer):
    """A Pygments lexer for RLO-2, which holds RLO-83.

    Line numbers of a numbered listing are labels. What the translator would refuse as a token is an error; anything
    else is coloured, whether or not it makes sense where it stands.
    """

    name = "RLO"
    aliases: ClassVar[list[str]] = ["rlo"]
    filenames: ClassVar[list[str]] = ["*.rlo"]
    flags = re.IGNORECASE | re.MULTILINE
    tokens: ClassVar[dict[str, list[object]]] = {
        "root": [
            include("blank"),
            (_any_of(["READ"]), Keyword, "sensor"),
            *_phrases(),
            (_any_of(["UNITS"]), Keyword.Declaration, "units"),
            (_any_of(["PROCEDURE"]), Keyword.Declaration, "procedure"),
            *_context_rules(),
            include("reserved"),
            include("operand"),
            include("sign"),
            # Whatever is left belongs to no program.
            (r"[^\W\d_]\w*", Error),
            (r".", Error),
        ],
        "blank": [
            (r"[ \t\r\n\f\v]+", Whitespace),
            (r"\{[^}]*(?:\}|\Z)", Comment.Multiline),
            (r"//[^\r\n]*", Comment.Single),
        ],
        "reserved": [
            (_any_of(DECLARATIONS), Keyword.Declaration),
            (_any_of(TYPES), Keyword.Type),
            (_any_of(OPERATORS), Operator.Word),
            (_any_of(KEYWORDS), Keyword),
        ],
        "operand": [
            (r"(?a:ARM[-_][0-9]+)(?!\w)", Name.Builtin.Pseudo),
            (r"(?a:ARM)(?:(?:[ \t]*[-_][ \t]*|[ \t]+)[0-9]+)?(?!\w)", Error),
            (_QUALIFIED, Name),
            (rf"{_NUMBER}(?={_any_of(UNITS)}(?!\.))", Number, "unit"),
            (rf"{_NUMBER}(?![\w.])", Number),
            (r"\.?[0-9](?:[\w.]|(?<=E)[+-](?=[0-9]))*", Error),
            (r'"[^"\r\n]*"', String.Double),
            (r'"[^\r\n]*', Error),
            (rf"{_any_of(FUNCTIONS)}(?=[ \t]*\()", Name.Builtin),
            (rf"{_NAME}(?=[ \t]*\()", Name.Function),
            (_any_of(PREDECLARED), Name.Builtin.Pseudo),
            (_NAME, Name),
        ],
        "sign": [
            # The comments and signs of other languages.
            (r"\(\*|/\*|:=|==|!=|&&|\|\||=<|=>", Error),
            (r"<=|>=|<>|[=<>+*/-]", Operator),
            (r"[;,:.()\[\]]", Punctuation),
        ],
        "sensor": [include("blank"), (_alone(SENSORS), Keyword.Pseudo, "#pop"), default("#pop")],
        "phrase": [include("blank"), (_alone(STATEMENT_PHRASES.values()), Keyword.Pseudo, "#pop")],
        "units": [include("blank"), (_alone(UNITS), Keyword.Type), (r",", Punctuation), default("#pop")],
        "unit": [(_any_of(UNITS), Keyword.Type, "#pop")],
        "procedure": [
            include("blank"),
            (_QUALIFIED, Name.Function, "#pop"),
            (rf"(?!{_any_of(_VOCABULARY.reserved)}){_NAME}", Name.Function, "#pop"),
            default("#pop"),
        ],
    }

    def get_tokens_unprocessed(
        self, text: str, stack: Iterable[str] = ("root",)
    ) -> Iterator[tuple[int, _TokenType, str]]:
        """Yield start, kind and text of every token; line numbers divide the tokens around them."""
        blanked, _ = blank_line_numbers(Source("", text))
        numbers = deque(match.span() for match in re.finditer(r"[0-9]+", text) if blanked[match.start()] == " ")
        for start, kind, value in super().get_tokens_unprocessed(blanked, stack):
            start_, end = start, start + len(value)
            while numbers and numbers[0][0] < end:
                first, last = numbers.popleft()
                if start_ < first:
                    yield start_, kind, text[start_:first]
                yield first, Name.Label, text[first:last]
                start_ = last
            if start_ < end:
                yield start_, kind, text[start_:end]
