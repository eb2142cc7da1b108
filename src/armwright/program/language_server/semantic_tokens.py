"""Colours by meaning: what each word of a program is, line by line, so that only lines that differ are sent again."""

from collections.abc import Sequence
from functools import lru_cache

from armwright.program.language.kinds import VariableKind
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language.source import Span
from armwright.program.language.units import UNITS
from armwright.program.language.words import RLO_2_TYPES, TYPES, TYPES_IN_CONTEXT
from armwright.program.language_server.analysis import Analysis
from armwright.program.language_server.symbol_index import NameKind, Occurrence
from armwright.program.syntax.lexer import Token, TokenKind

_NAMES = ("variable", "parameter", "event", "function", "property", "enumMember")
KINDS = ("keyword", "type", *_NAMES, "number", "string", "comment", "operator")
MODIFIERS = (
    "declaration",
    "modification",
    "readonly",
    "defaultLibrary",
    "frame",
    "trans",
    "scalar",
    "array",
    "arm",
    "boolean",
    "text",
)
_COMMENT = KINDS.index("comment")
_TOKEN_STYLES = {
    TokenKind.NUMBER: (KINDS.index("number"), 0),
    TokenKind.STRING: (KINDS.index("string"), 0),
    TokenKind.SYMBOL: (KINDS.index("operator"), 0),
}
_OPERATORS = frozenset(("+", "-", "*", "/", "=", "<", ">", "<=", ">=", "<>"))
_TYPES = frozenset((*TYPES, *RLO_2_TYPES, *TYPES_IN_CONTEXT, *UNITS))
_BIT = {name: 1 << at for at, name in enumerate(MODIFIERS)}
_NAME_STYLES = {
    NameKind.PROCEDURE: ("function", 0),
    NameKind.FUNCTION: ("function", _BIT["defaultLibrary"]),
    NameKind.ARM: ("variable", _BIT["readonly"] | _BIT["defaultLibrary"] | _BIT["arm"] | _BIT["frame"]),
    NameKind.DEVICE: ("property", 0),
    NameKind.TARGET: ("property", 0),
    NameKind.UNIT: ("type", _BIT["defaultLibrary"]),
    NameKind.SENSOR: ("keyword", 0),
    NameKind.ERROR: ("enumMember", 0),
    NameKind.WATCH: ("enumMember", 0),
    NameKind.TIMER: ("variable", 0),
    NameKind.AXIS: ("enumMember", _BIT["readonly"]),
    NameKind.VALUE: ("variable", _BIT["readonly"] | _BIT["defaultLibrary"] | _BIT["scalar"]),
}

# A token in a line: its start and length in columns; its kind and modifiers as numbers.
SemanticToken = tuple[int, int, int, int]


# An editor asks for the colours of what it shows and for those of the whole, of the same text.
@lru_cache(maxsize=4)
def line_tokens(analysis: Analysis) -> list[list[SemanticToken]]:
    """Return the semantic tokens of each line of a program."""
    codec, compiled = analysis.codec, analysis.compiled
    lines: list[list[SemanticToken]] = [[] for _ in codec.line_starts]
    names = {name.start: name for name in analysis.occurrences}
    for token in compiled.tokens:
        name = names.get(token.start)
        style = _token_style(token) if name is None else _name_style(name, analysis)
        if style is not None:
            line, column = codec.line_and_column(token.start)
            lines[line].append((column, codec.width(token.start, token.end), *style))
    for comment in compiled.comments:
        _add_comment(lines, codec, comment)
    for comment in compiled.comments:
        lines[codec.line_of(comment.start)].sort()
        lines[codec.line_of(comment.end)].sort()
    return lines


def _token_style(token: Token) -> tuple[int, int] | None:
    if token.kind is TokenKind.KEYWORD:
        return KINDS.index("type" if token.key in _TYPES else "keyword"), 0
    if token.kind is TokenKind.SYMBOL and token.key not in _OPERATORS:
        return None
    return _TOKEN_STYLES.get(token.kind)


def _name_style(name: Occurrence, analysis: Analysis) -> tuple[int, int] | None:
    modifiers = _BIT["declaration"] * name.declares | _BIT["modification"] * (name.writes and not name.declares)
    if name.kind in _NAME_STYLES:
        kind, bits = _NAME_STYLES[name.kind]
        return KINDS.index(kind), bits | modifiers
    if name.kind is not NameKind.VARIABLE:
        return None
    symbols, kind, bits = analysis.compiled.symbols, "variable", modifiers
    if name.owner is not None and name.key in symbols.procedures[name.owner].parameters:
        kind = "parameter"
    elif name.owner is None and name.key not in symbols.declared:
        bits |= _BIT["defaultLibrary"]
    if name.type is not None:
        if name.type.kind is VariableKind.EVENT:
            kind = "event" if kind == "variable" else kind
        else:
            bits |= _BIT[name.type.kind.value.lower()]
        bits |= _BIT["array"] * bool(name.type.sizes)
    return KINDS.index(kind), bits


def _add_comment(lines: list[list[SemanticToken]], codec: PositionCodec, comment: Span) -> None:
    """Add a comment to each of its lines."""
    start = comment.start
    for line in range(codec.line_of(comment.start), codec.line_of(comment.end) + 1):
        end = min(comment.end, codec.line_end(line))
        if end > start:
            lines[line].append((codec.line_and_column(start)[1], codec.width(start, end), _COMMENT, 0))
        start = max(start, end)
        while start < comment.end and codec.line_of(start) == line:
            start += 1


def encode(lines: Sequence[list[SemanticToken]], first: int = 0, last: int | None = None, start: int = 0) -> list[int]:
    """Return tokens in the encoding of the protocol: five numbers each, positions relative to the token before.

    Args:
        lines: the tokens of each line.
        first: the first line that is wanted.
        last: the last one.
        start: the line of the token before.
    """
    numbers: list[int] = []
    line_before = start
    for line in range(first, len(lines) if last is None else min(len(lines), last + 1)):
        column_before = 0
        for column, length, kind, bits in lines[line]:
            numbers += (line - line_before, column - column_before, length, kind, bits)
            line_before, column_before = line, column
    return numbers


def token_edit(old: Sequence[list[SemanticToken]], new: Sequence[list[SemanticToken]]) -> tuple[int, int, list[int]]:
    """Return what makes the numbers of new lines out of those of old ones: where, how many go, and what comes."""
    common_head = next((at for at, (one, other) in enumerate(zip(old, new, strict=False)) if one != other), None)
    if common_head is None:
        common_head = min(len(old), len(new))
    limit = min(len(old), len(new)) - common_head
    common_tail = next((at for at in range(limit) if old[-1 - at] != new[-1 - at]), limit)
    # The line of the first token after the change is relative to the one before, so it is sent again.
    while common_tail and not old[-common_tail]:
        common_tail -= 1
    common_tail -= common_tail > 0
    start = 5 * sum(map(len, old[:common_head]))
    deleted = 5 * sum(map(len, old[common_head : len(old) - common_tail]))
    line_before = next((line for line in range(common_head - 1, -1, -1) if new[line]), 0)
    return start, deleted, encode(new, common_head, len(new) - common_tail - 1, line_before)
