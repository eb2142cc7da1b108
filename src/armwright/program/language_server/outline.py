"""The shape of a program: what it declares, and what can be folded away."""

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import TypeAlias

from lsprotocol.types import DocumentSymbol, FoldingRange, FoldingRangeKind, SymbolKind

from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language_server.analysis import Analysis
from armwright.program.language_server.hover import signature
from armwright.program.language_server.positions import span_range
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import Token, TokenKind

_KINDS = {VariableKind.FRAME: SymbolKind.Struct, VariableKind.EVENT: SymbolKind.Event}


def document_symbols(analysis: Analysis) -> list[DocumentSymbol]:
    """Return what a program declares, in the order of the text."""
    symbols, codec = analysis.compiled.symbols, analysis.codec
    declared: list[DocumentSymbol] = []
    for header in analysis.compiled.tree.headers:
        if isinstance(header, tree.Declaration):
            declared += _variable_symbols(codec, header, symbols.types)
        elif isinstance(header, tree.Record):
            fields = [symbol for field in header.fields for symbol in _variable_symbols(codec, field, {})]
            symbol_range, name = span_range(codec, header.span), span_range(codec, header.name.span)
            declared.append(DocumentSymbol(header.name.text, SymbolKind.Struct, symbol_range, name, children=fields))
        elif isinstance(header, tree.Procedure):
            procedure = symbols.procedures.get(header.name.key)
            types = {} if procedure is None else procedure.types
            parts = (*header.parameters, *header.declarations)
            children = [symbol for part in parts for symbol in _variable_symbols(codec, part, types)]
            for parameter in children[: sum(len(part.names) for part in header.parameters)]:
                parameter.kind = SymbolKind.Variable
            symbol_range, name = span_range(codec, header.span), span_range(codec, header.name.span)
            # A name that is missing may stand anywhere.
            name = name if symbol_range.start <= name.start and name.end <= symbol_range.end else symbol_range
            _, opening, parameters = signature(header)[0].partition("(")
            symbol = DocumentSymbol(header.name.text or "?", SymbolKind.Function, symbol_range, name)
            symbol.detail, symbol.children = opening + parameters or None, children or None
            declared.append(symbol)
    return sorted(declared, key=lambda symbol: (symbol.range.start.line, symbol.range.start.character))


def _variable_symbols(
    codec: PositionCodec, declaration: tree.Declaration, types: Mapping[str, VariableType | None]
) -> Iterator[DocumentSymbol]:
    for name in declaration.names:
        type_, kind = types.get(name.key), SymbolKind.Variable
        if type_ is not None:
            kind = SymbolKind.Array if type_.sizes else _KINDS.get(type_.kind, kind)
        detail = declaration.type.text if type_ is None else str(type_)
        name_range = span_range(codec, name.span)
        yield DocumentSymbol(name.text or "?", kind, name_range, name_range, detail or None)


# ---- folding -------------------------------------------------------------------------------------------------------

# The first and the last line of a range, from 0.
_Lines: TypeAlias = tuple[int, int]
_OPENING = frozenset(("BEGIN", "COBEGIN", "TRY", "REPEAT"))
_CLOSING = frozenset(("END", "COEND", "UNTIL"))


def folding_ranges(analysis: Analysis) -> list[FoldingRange]:
    """Return what can be folded away: blocks, declarations, statements and comments of several lines."""
    line_of = analysis.codec.line_of
    comments = _comment_lines(analysis)
    ranges = {*_block_lines(analysis), *_declaration_lines(analysis), *comments}
    ranges |= {(line_of(node.span.start), line_of(node.span.end)) for node in analysis.hinted_statements}
    # Of those that begin in one line the longest comes last.
    longest = dict(sorted(ranges))
    kinds = dict.fromkeys(comments, FoldingRangeKind.Comment)
    return [FoldingRange(*lines, kind=kinds.get(lines)) for lines in longest.items() if lines[0] < lines[1]]


def _block_lines(analysis: Analysis) -> Iterator[_Lines]:
    line_of, opened = analysis.codec.line_of, []
    for before, token in pairwise(analysis.compiled.tokens):
        # The UNTIL of a WAIT closes nothing.
        if token.kind is not TokenKind.KEYWORD or (before.key, token.key) == ("WAIT", "UNTIL"):
            continue
        if token.key in _OPENING:
            opened.append(token)
        elif token.key == "RECOVER" and opened:
            yield line_of(opened.pop().start), line_of(token.start) - 1
            opened.append(token)
        elif token.key in _CLOSING and opened:
            yield line_of(opened.pop().start), line_of(token.end)


def _declaration_lines(analysis: Analysis) -> Iterator[_Lines]:
    """Give VAR parts and procedures."""
    line_of = analysis.codec.line_of
    part: Token | None = None
    head: Token | None = None
    depth = 0
    for before, token in pairwise(analysis.compiled.tokens):
        if token.kind is not TokenKind.KEYWORD and before.kind is not TokenKind.KEYWORD:
            continue
        if part is not None and token.key in ("VAR", "BEGIN", "PROCEDURE", "FUNCTION", "CONST", "IMPORT", "UNITS"):
            yield line_of(part.start), line_of(before.end)
            part = None
        part = before if before.key == "VAR" else part
        if before.key in ("PROCEDURE", "FUNCTION") and depth == 0:
            head = before
        depth += (before.key in _OPENING) - (before.key in _CLOSING)
        if before.key == "END" and depth <= 0 and head is not None:
            yield line_of(head.start), line_of(before.end)
            head = None


def _comment_lines(analysis: Analysis) -> list[_Lines]:
    """Return the lines of comments, those that follow one another together."""
    line_of, source = analysis.codec.line_of, analysis.compiled.source
    comments: list[_Lines] = []
    for comment in analysis.compiled.comments:
        first, last = line_of(comment.start), line_of(comment.end)
        alone = not source.text[source.line_starts[first] : comment.start].strip()
        if comments and alone and comments[-1][1] + 1 == first:
            first, _ = comments.pop()
        if alone or last > first:
            comments.append((first, last))
    return comments
