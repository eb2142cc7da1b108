"""Colours by meaning: what each word of a program is, line by line, so that a change touches its lines alone."""

from collections.abc import Sequence

from armwright.program.language.kinds import VariableKind
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language.source import Source, Span
from armwright.program.language.units import UNITS
from armwright.program.language.words import LATER_TYPES, TYPES
from armwright.program.language_server.analysis import Analysis, View
from armwright.program.language_server.edit_map import EditMap
from armwright.program.language_server.symbol_index import Occurrence, What, occurrences
from armwright.program.syntax.lexer import Token, TokenKind, scan
from armwright.program.syntax.line_numbers import without_numbers

KINDS = (
    *("keyword", "type", "variable", "parameter", "event", "function"),
    *("property", "enumMember", "number", "string", "comment", "operator"),
)
MODIFIERS = (
    *("declaration", "modification", "readonly", "defaultLibrary"),
    *("frame", "trans", "scalar", "array", "arm"),
)
_KEYWORD, _TYPE, _NUMBER, _STRING, _COMMENT, _OPERATOR = (
    KINDS.index(kind) for kind in ("keyword", "type", "number", "string", "comment", "operator")
)
_TYPES = frozenset((*TYPES, *LATER_TYPES, *UNITS))
_BIT = {name: 1 << at for at, name in enumerate(MODIFIERS)}
_WHATS = {
    What.PROCEDURE: ("function", 0),
    What.FUNCTION: ("function", _BIT["defaultLibrary"]),
    What.ARM: ("variable", _BIT["readonly"] | _BIT["defaultLibrary"] | _BIT["arm"] | _BIT["frame"]),
    What.DEVICE: ("property", 0),
    What.UNIT: ("type", _BIT["defaultLibrary"]),
    What.SENSOR: ("keyword", 0),
    What.AXIS: ("enumMember", _BIT["readonly"]),
}

# One stretch of a line: where it starts and how long it is, in columns; its kind and modifiers as numbers.
Stretch = tuple[int, int, int, int]


def line_stretches(analysis: Analysis, encoding: str) -> list[list[Stretch]]:
    """Return the coloured stretches of each line of a program."""
    ruler = PositionCodec(analysis.text, encoding)
    compiled = analysis.compiled
    lines: list[list[Stretch]] = [[] for _ in ruler.starts]
    _put(lines, ruler, compiled.tokens, analysis.occurrences, analysis)
    for comment in compiled.comments:
        _put_comment(lines, ruler, comment)
    for comment in compiled.comments:
        lines[ruler.line_of(comment.start)].sort()
        lines[ruler.line_of(comment.end)].sort()
    return lines


def patched(view: View, known: Sequence[list[Stretch]], encoding: str) -> Sequence[list[Stretch]]:
    """Return the stretches of a text that has changed: the lines that have are read anew, the others are known.

    A comment that was opened or closed shows its effect on other lines when all is worked out again.
    """
    if view.fresh:
        return known
    change = _whole_line_ends(view)
    old, new = PositionCodec(view.analysis.text, encoding), PositionCodec(view.text, encoding)
    first, last = new.line_of(change.start), new.line_of(change.new_end)
    above, below = known[: old.line_of(change.start)], known[old.line_of(change.old_end) + 1 :]
    start, end = new.starts[first], new.line_end(last)
    if _in_comment(view, change, old):
        lengths = (new.width(new.starts[line], new.line_end(line)) for line in range(first, last + 1))
        return (*above, *([(0, length, _COMMENT, 0)] for length in lengths), *below)
    text = view.text[start:end]
    blanked, _ = without_numbers(Source("", text)) if _numbered(view.text) else (text, [])
    scanned = scan(Source("", text), blanked, view.analysis.compiled.standard)
    names = occurrences(scanned.tokens, view.analysis.extents, place=view.old(start) or change.start)
    lines: list[list[Stretch]] = [[] for _ in range(first, last + 1)]
    _put(lines, _Part(new, start, first), scanned.tokens, names, view.analysis)
    for comment in scanned.comments:
        _put_comment(lines, _Part(new, start, first), comment)
    for line in lines:
        line.sort()
    return (*above, *lines, *below)


def _whole_line_ends(view: View) -> EditMap:
    """Return what has changed, with the other half of a line end that the change begins or ends in."""
    change, text = view.drift, view.text
    halved = text[change.start - 1 : change.start] == "\r"
    more = text[change.new_end : change.new_end + 1] == "\n"
    return EditMap(change.start - halved, change.old_end + more, change.new_end + more)


def _in_comment(view: View, change: EditMap, old: PositionCodec) -> bool:
    """Whether the lines that have changed lie in one comment, which goes on above and below them."""
    start = old.starts[old.line_of(change.start)]
    end = old.line_end(old.line_of(change.old_end))
    if "}" in view.text[change.start : change.new_end]:
        return False
    return any(comment.start < start and end < comment.end for comment in view.analysis.compiled.comments)


class _Part:
    """A ruler for some lines of a text: offsets and lines count from their start."""

    def __init__(self, whole: PositionCodec, start: int, line: int) -> None:
        self._whole, self._start, self._line = whole, start, line

    def place(self, offset: int) -> tuple[int, int]:
        line, column = self._whole.place(offset + self._start)
        return line - self._line, column

    def line_of(self, offset: int) -> int:
        return self._whole.line_of(offset + self._start) - self._line

    def line_end(self, line: int) -> int:
        return self._whole.line_end(line + self._line) - self._start

    def width(self, start: int, end: int) -> int:
        return self._whole.width(start + self._start, end + self._start)


def _numbered(text: str) -> bool:
    return text[:200].lstrip("\ufeff \t\r\n")[:1].isdigit()


def _put(
    lines: list[list[Stretch]],
    ruler: "PositionCodec | _Part",
    tokens: Sequence[Token],
    names: Sequence[Occurrence],
    analysis: Analysis,
) -> None:
    """Add the stretches of tokens to their lines."""
    name_at = iter((*names, None))
    name = next(name_at)
    for token in tokens:
        what = _plain(token)
        if name is not None and name.start == token.start:
            what, name = _named(name, analysis), next(name_at)
        if what is not None:
            line, column = ruler.place(token.start)
            lines[line].append((column, ruler.width(token.start, token.end), *what))


def _plain(token: Token) -> tuple[int, int] | None:
    kind = token.kind
    if kind is TokenKind.KEYWORD:
        return (_TYPE if token.key in _TYPES else _KEYWORD), 0
    if kind is TokenKind.NUMBER:
        return _NUMBER, 0
    if kind is TokenKind.STRING:
        return _STRING, 0
    if kind is TokenKind.SYMBOL and token.key in _OPERATORS:
        return _OPERATOR, 0
    return None


_OPERATORS = frozenset(("+", "-", "*", "/", "=", "<", ">", "<=", ">=", "<>"))


def _named(one: Occurrence, analysis: Analysis) -> tuple[int, int] | None:
    own = _BIT["declaration"] * one.declares | _BIT["modification"] * (one.writes and not one.declares)
    if one.what in _WHATS:
        kind, bits = _WHATS[one.what]
        return KINDS.index(kind), bits | own
    if one.what is not What.VARIABLE:
        return None
    symbols = analysis.compiled.symbols
    word = "variable"
    bits = own
    if one.owner is not None and one.key in symbols.procedures[one.owner].parameters:
        word = "parameter"
    elif one.owner is None and one.key not in symbols.declared:
        bits |= _BIT["defaultLibrary"]
    if one.type is not None:
        if one.type.kind is VariableKind.EVENT:
            word = "event" if word == "variable" else word
        else:
            bits |= _BIT[one.type.kind.value.lower()]
        bits |= _BIT["array"] * bool(one.type.sizes)
    return KINDS.index(word), bits


def _put_comment(lines: list[list[Stretch]], ruler: "PositionCodec | _Part", comment: Span) -> None:
    """Add a comment to each of its lines."""
    start = comment.start
    for line in range(ruler.line_of(comment.start), ruler.line_of(comment.end) + 1):
        end = min(comment.end, ruler.line_end(line))
        if end > start:
            lines[line].append((ruler.place(start)[1], ruler.width(start, end), _COMMENT, 0))
        start = max(start, end)
        while start < comment.end and ruler.line_of(start) == line:
            start += 1


def encoded(lines: Sequence[list[Stretch]], first: int = 0, last: int | None = None, start: int = 0) -> list[int]:
    """Return stretches as the protocol wants them: five numbers each, places counted from the stretch before.

    Args:
        lines: the stretches of each line.
        first: the first line that is wanted.
        last: the last one.
        start: the line of the stretch before.
    """
    found: list[int] = []
    before = start
    for line in range(first, len(lines) if last is None else min(len(lines), last + 1)):
        column_before = 0
        for column, length, kind, bits in lines[line]:
            found += (line - before, column - column_before, length, kind, bits)
            before, column_before = line, column
    return found


def difference(old: Sequence[list[Stretch]], new: Sequence[list[Stretch]]) -> tuple[int, int, list[int]]:
    """Return what makes the numbers of new lines out of those of old ones: where, how many go, and what comes."""
    above = next((at for at, (one, other) in enumerate(zip(old, new, strict=False)) if one != other), None)
    if above is None:
        above = min(len(old), len(new))
    limit = min(len(old), len(new)) - above
    below = next((at for at in range(limit) if old[-1 - at] != new[-1 - at]), limit)
    # The first stretch below the change counts its line from the one above, and is told again.
    while below and not old[-below]:
        below -= 1
    below -= below > 0
    start = 5 * sum(map(len, old[:above]))
    gone = 5 * sum(map(len, old[above : len(old) - below]))
    before = next((line for line in range(above - 1, -1, -1) if new[line]), 0)
    return start, gone, encoded(new, above, len(new) - below - 1, before)
