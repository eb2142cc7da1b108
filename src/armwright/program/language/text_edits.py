"""Changes of a text."""

import attrs

from armwright.program.language.source import Span


@attrs.frozen
class Edit:
    """A change: ``text`` comes where ``span`` was."""

    span: Span
    text: str


def apply_edits(text: str, edits: tuple[Edit, ...]) -> str:
    """Return a text with edits made, all counted in the text as given; of two that overlap the first is made."""
    pieces, done = [], 0
    for edit in sorted(edits, key=lambda one: (one.span.start, one.span.end)):
        if edit.span.start >= done:
            pieces += [text[done : edit.span.start], edit.text]
            done = edit.span.end
    return "".join((*pieces, text[done:]))
