"""Changes of a text."""

import attrs

from armwright.program.language.source import Span


@attrs.frozen
class TextEdit:
    """A change: ``text`` comes where ``span`` was."""

    span: Span
    text: str


def apply_edits(text: str, edits: tuple[TextEdit, ...]) -> str:
    """Return a text with edits made, all counted in the text as given; of two that overlap the first is made."""
    pieces, done = [], 0
    for edit in sorted(edits, key=lambda edit: edit.span):
        if edit.span.start >= done:
            pieces += [text[done : edit.span.start], edit.text]
            done = edit.span.end
    return "".join((*pieces, text[done:]))


def smallest_edit(before: str, after: str) -> TextEdit:
    """Return the change of one stretch that makes one text out of another."""
    shorter = min(len(before), len(after))
    start = next((at for at in range(shorter) if before[at] != after[at]), shorter)
    rest = shorter - start
    same = next((at for at in range(rest) if before[-1 - at] != after[-1 - at]), rest)
    return TextEdit(Span(start, len(before) - same), after[start : len(after) - same])
