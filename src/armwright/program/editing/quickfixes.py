"""Cures of diagnostics as an editor offers them: one at a time where the cursor is, or all that are certain."""

from collections.abc import Iterable

import attrs

from armwright.program.editing.analysis import Analysis
from armwright.program.editing.fixing import apart
from armwright.program.editing.places import Edit
from armwright.program.messages.diagnostics import Diagnostic
from armwright.program.text.source import Source, Span

# A longer text is not repeated in a title.
_LONGEST_SHOWN = 30


@attrs.frozen
class QuickFix:
    """A cure.

    Attributes:
        title: what it does.
        edits: how.
        diagnostic: what it cures.
    """

    title: str
    edits: tuple[Edit, ...]
    diagnostic: Diagnostic


def quickfixes(analysis: Analysis, span: Span) -> tuple[QuickFix, ...]:
    """Return the cures of what is wrong in a stretch of text."""
    return tuple(
        QuickFix(_title(one, analysis.compiled.source), _edits(one), one)
        for one in analysis.compiled.diagnostics
        if one.fixes and any(_touch(place, span) for place in (one.span, *(fix.span for fix in one.fixes)))
    )


def all_fixes(diagnostics: Iterable[Diagnostic]) -> tuple[Edit, ...]:
    """Return all certain cures that can be made at once, in the order of the text; of two that touch the first."""
    made = [edit for one in apart([one for one in diagnostics if one.fixes]) for edit in _edits(one)]
    return tuple(sorted(made, key=lambda edit: edit.span.start))


def _edits(diagnostic: Diagnostic) -> tuple[Edit, ...]:
    return tuple(Edit(fix.span, fix.replacement) for fix in diagnostic.fixes)


def _touch(one: Span, other: Span) -> bool:
    return one.start <= other.end and other.start <= one.end


def _title(diagnostic: Diagnostic, source: Source) -> str:
    fix = diagnostic.fixes[0]
    old, new = source.slice(fix.span), fix.replacement
    if len(diagnostic.fixes) > 1 or len(old) > _LONGEST_SHOWN or len(new) > _LONGEST_SHOWN:
        return (diagnostic.helps or (f"correct this: {diagnostic.message}",))[0].partition("\n")[0]
    if not new.strip():
        return f"leave `{old.strip()}` out"
    return f"insert `{new.strip()}`" if not old.strip() else f"write `{new.strip()}` instead of `{old.strip()}`"
