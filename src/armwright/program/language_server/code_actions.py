"""Cures of diagnostics as an editor offers them: one at a time where the cursor is, or all that are certain."""

import re
from collections.abc import Iterable
from itertools import chain

import attrs

from armwright.program.diagnostics.fixes import apart
from armwright.program.language.diagnostic import Diagnostic, Fix
from armwright.program.language.source import Source, Span
from armwright.program.language.text_edits import Edit
from armwright.program.language_server.analysis import Analysis

# A longer text is not repeated in a title.
_MAX_SHOWN_LENGTH = 30
_DID_YOU_MEAN = re.compile(r"did you mean `([A-Za-z][\w-]*)`")
# The place of a misspelt word is the word, or ends with it: `WITH SPED`.
_LAST_WORD = re.compile(r"(?<![\w-])[^\W\d_][\w-]*\Z")


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
    """Return the cures of what is wrong in a stretch of text: those that are certain, and names that were meant."""
    source = analysis.compiled.source
    pairs = [(_meant(diagnostic, source), diagnostic) for diagnostic in analysis.compiled.diagnostics]
    return tuple(
        QuickFix(_title(cured, source), _edits(cured), diagnostic)
        for cured, diagnostic in pairs
        if cured.fixes and any(_touch(part, span) for part in (cured.span, *(fix.span for fix in cured.fixes)))
    )


def _meant(diagnostic: Diagnostic, source: Source) -> Diagnostic:
    """Return a diagnostic that asks whether another word was meant with that word as its cure.

    It is no certain one, so that an editor offers it and `armwright fix` leaves it alone.
    """
    word = next((match[1] for help_ in diagnostic.helps if (match := _DID_YOU_MEAN.match(help_))), None)
    if diagnostic.fixes or word is None:
        return diagnostic
    written = _LAST_WORD.search(source.slice(diagnostic.span))
    if written is None:
        return diagnostic
    start = diagnostic.span.start + written.start()
    return attrs.evolve(diagnostic, fixes=(Fix(Span(start, diagnostic.span.end), word),))


def all_fixes(diagnostics: Iterable[Diagnostic]) -> tuple[Edit, ...]:
    """Return all certain cures that can be made at once, in the order of the text; of two that touch the first."""
    curable = apart([diagnostic for diagnostic in diagnostics if diagnostic.fixes])
    edits = chain.from_iterable(map(_edits, curable))
    return tuple(sorted(edits, key=lambda edit: edit.span.start))


def _edits(diagnostic: Diagnostic) -> tuple[Edit, ...]:
    return tuple(Edit(fix.span, fix.replacement) for fix in diagnostic.fixes)


def _touch(span: Span, other: Span) -> bool:
    return span.start <= other.end and other.start <= span.end


def _title(diagnostic: Diagnostic, source: Source) -> str:
    fix = diagnostic.fixes[0]
    old, new = source.slice(fix.span), fix.replacement
    if len(diagnostic.fixes) > 1 or len(old) > _MAX_SHOWN_LENGTH or len(new) > _MAX_SHOWN_LENGTH:
        return (diagnostic.helps or (f"correct this: {diagnostic.message}",))[0].partition("\n")[0]
    if not new.strip():
        return f"leave `{old.strip()}` out"
    return f"insert `{new.strip()}`" if not old.strip() else f"write `{new.strip()}` instead of `{old.strip()}`"
