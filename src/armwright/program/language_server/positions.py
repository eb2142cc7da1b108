"""Positions and edits in the words of the Language Server Protocol: lines and columns instead of offsets."""

from collections.abc import Iterable

from lsprotocol import types as lsp

from armwright.program.language.position_codec import PositionCodec
from armwright.program.language.source import Span
from armwright.program.language.text_edits import TextEdit


def span_range(codec: PositionCodec, span: Span) -> lsp.Range:
    """Return a span as lines and columns."""
    return lsp.Range(position(codec, span.start), position(codec, span.end))


def position(codec: PositionCodec, offset: int) -> lsp.Position:
    """Return the line and the column of an offset."""
    return lsp.Position(*codec.line_and_column(offset))


def offset_of(codec: PositionCodec, position: lsp.Position) -> int:
    """Return the offset of a position."""
    return codec.offset(position.line, position.character)


def span_of(codec: PositionCodec, range_: lsp.Range) -> Span:
    """Return the span between two positions."""
    start = offset_of(codec, range_.start)
    return Span(start, max(start, offset_of(codec, range_.end)))


def text_edits(codec: PositionCodec, edits: Iterable[TextEdit]) -> list[lsp.TextEdit]:
    """Return changes of a text."""
    return [lsp.TextEdit(span_range(codec, edit.span), edit.text) for edit in edits]
