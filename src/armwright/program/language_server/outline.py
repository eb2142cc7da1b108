"""The shape of a program: what it declares, and what can be folded away."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import attrs
from lsprotocol.types import SymbolKind

from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.source import Source, Span
from armwright.program.language_server.analysis import Analysis
from armwright.program.language_server.hover import signature
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import Token, TokenKind


@attrs.frozen
class Entry:
    """Something that a program declares.

    Attributes:
        name: as declared.
        kind: what it is.
        detail: its type or parameters.
        span: all of it.
        place: its name.
        inside: what it declares in turn.
    """

    name: str
    kind: SymbolKind
    detail: str
    span: Span
    place: Span
    inside: tuple["Entry", ...] = ()


_KINDS = {VariableKind.FRAME: SymbolKind.Struct, VariableKind.EVENT: SymbolKind.Event}


def outline(analysis: Analysis) -> tuple[Entry, ...]:
    """Return what a program declares, in the order of the text."""
    symbols = analysis.compiled.symbols
    entries: list[Entry] = []
    for header in analysis.compiled.tree.headers:
        if isinstance(header, tree.Declaration):
            entries += _variables(header, symbols.types)
        elif isinstance(header, tree.Procedure):
            own = symbols.procedures.get(header.name.key)
            types = {} if own is None else own.types
            inside = [entry for part in header.parameters for entry in _variables(part, types, parameter=True)]
            inside += [entry for part in header.declarations for entry in _variables(part, types)]
            _, opening, parameters = signature(header)[0].partition("(")
            name = _within(header.name.span, header.span)
            kind, detail = SymbolKind.Function, opening + parameters
            entries.append(Entry(header.name.text, kind, detail, header.span, name, tuple(inside)))
    return tuple(sorted(entries, key=lambda entry: entry.span.start))


def _variables(
    declaration: tree.Declaration, types: Mapping[str, VariableType | None], *, parameter: bool = False
) -> list[Entry]:
    entries = []
    for name in declaration.names:
        type_, kind = types.get(name.key), SymbolKind.Variable
        if type_ is not None and not parameter:
            kind = SymbolKind.Array if type_.sizes else _KINDS.get(type_.kind, kind)
        detail = declaration.type.text if type_ is None else str(type_)
        entries.append(Entry(name.text, kind, detail, name.span, name.span))
    return entries


def _within(inner: Span, outer: Span) -> Span:
    """Return a span that is not outside of another: a name that is missing may stand anywhere."""
    return inner if outer.start <= inner.start and inner.end <= outer.end else outer


@attrs.frozen
class Fold:
    """Lines that can be folded away, from 1, both included; of comments or of the program."""

    first: int
    last: int
    comment: bool = False


_OPENING = frozenset(("BEGIN", "COBEGIN", "TRY", "REPEAT"))
_CLOSING = frozenset(("END", "COEND", "UNTIL"))


def folds(analysis: Analysis) -> tuple[Fold, ...]:
    """Return what can be folded away: blocks, declarations, statements and comments of several lines."""
    source, tokens = analysis.compiled.source, analysis.compiled.tokens
    found = {*_blocks(source, tokens), *_parts(source, tokens), *_comments(source, analysis.compiled.comments)}
    for statement in analysis.statements:
        found.add(Fold(source.line(statement.span.start), source.line(statement.span.end)))
    longest: dict[int, Fold] = {}
    for fold in found:
        if fold.last > fold.first and fold.last > longest.get(fold.first, Fold(0, 0)).last:
            longest[fold.first] = fold
    return tuple(longest[first] for first in sorted(longest))


def _blocks(source: Source, tokens: Sequence[Token]) -> list[Fold]:
    found, opened = [], []
    for token in tokens:
        if token.kind is not TokenKind.KEYWORD:
            continue
        if token.key in _OPENING:
            opened.append(token)
        elif token.key == "RECOVER" and opened:
            found.append(Fold(source.line(opened.pop().start), source.line(token.start) - 1))
            opened.append(token)
        elif token.key in _CLOSING and opened:
            found.append(Fold(source.line(opened.pop().start), source.line(token.end)))
    return found


def _parts(source: Source, tokens: Sequence[Token]) -> list[Fold]:
    """Return VAR parts and procedures."""
    found = []
    part: Token | None = None
    head: Token | None = None
    depth = 0
    for before, token in pairwise(tokens):
        if token.kind is not TokenKind.KEYWORD and before.kind is not TokenKind.KEYWORD:
            continue
        if part is not None and token.key in ("VAR", "BEGIN", "PROCEDURE", "IMPORT", "UNITS"):
            found.append(Fold(source.line(part.start), source.line(before.end)))
            part = None
        part = before if before.key == "VAR" else part
        if before.key == "PROCEDURE" and depth == 0:
            head = before
        depth += (before.key in _OPENING) - (before.key in _CLOSING)
        if before.key == "END" and depth <= 0 and head is not None:
            found.append(Fold(source.line(head.start), source.line(before.end)))
            head = None
    return found


def _comments(source: Source, comments: Sequence[Span]) -> list[Fold]:
    found: list[Fold] = []
    for comment in comments:
        fold = Fold(source.line(comment.start), source.line(comment.end), comment=True)
        alone = source.text[source.line_starts[fold.first - 1] : comment.start].isspace()
        alone = alone or source.column(comment.start) == 1
        if found and alone and found[-1].last + 1 == fold.first:
            fold = Fold(found.pop().first, fold.last, comment=True)
        if alone or fold.last > fold.first:
            found.append(fold)
    return found
