"""Curing what is certain: the changes that diagnostics offer are made, round after round, as long as they help."""

from bisect import bisect_left, bisect_right, insort
from collections.abc import Callable, Iterable, Sequence
from itertools import accumulate
from typing import TypeAlias

import attrs

from armwright.program.api import Compilation
from armwright.program.language.diagnostic import Diagnostic, Fix
from armwright.program.language.source import Source, Span
from armwright.program.language.text_edits import TextEdit, apply_edits

# How often a program is looked at again: one cure may bring the next slip to light.
MAX_ROUNDS = 10
# How often a program is translated at most to find out which changes help, in one round.
_MAX_TRIALS = 200
# A longer text is not shown whole.
_MAX_SHOWN_LENGTH = 30

Compile: TypeAlias = Callable[[Source], Compilation]


@attrs.frozen
class AppliedFix:
    """A change that was made.

    Attributes:
        source: the program before its round.
        diagnostic: what it cures.
    """

    source: Source
    diagnostic: Diagnostic

    @property
    def description(self) -> str:
        """What was done, such as ``put in `;```."""
        return " and ".join(dict.fromkeys(_description(fix, self.source) for fix in self.diagnostic.fixes))


@attrs.frozen(kw_only=True)
class FixResult:
    """A program after all that is certain has been cured.

    Attributes:
        applied: what was done, in order.
        compilation: of the program as it is now; what is left is in its diagnostics.
    """

    applied: tuple[AppliedFix, ...]
    compilation: Compilation

    @property
    def text(self) -> str:
        """The program as it is now."""
        return self.compilation.source.main.text


def apply_fixes(source: Source, compile_source: Compile, *, rounds: int = MAX_ROUNDS) -> FixResult:
    """Make the changes that diagnostics offer.

    In each round all changes are made that do not touch one another. Where one does not make its message go away, or
    brings a new slip of syntax, it is left alone. A text with zero bytes is that of no program, and left alone.

    Args:
        source: the program.
        compile_source: how to find out what is wrong.
        rounds: how often to look again at most.
    """
    current = compile_source(source)
    cures: list[AppliedFix] = []
    rejected: set[tuple[str, str]] = set()
    for _ in range(rounds if "\0" not in source.text else 0):
        offered = [
            one
            for one in current.diagnostics
            if one.fixes
            and not current.source.file_number(one.span.start)
            and _message_id(one, current.source) not in rejected
        ]
        selected = select_disjoint(offered)
        if not selected:
            break
        after = compile_source(_apply(current.source, selected))
        if not _improves(selected, current, after):
            selected, after = _select_improving(selected, current, compile_source)
            rejected |= {_message_id(one, current.source) for one in offered if one not in selected}
        cures += [AppliedFix(current.source, one) for one in selected]
        current = after
    return FixResult(applied=tuple(cures), compilation=current)


def select_disjoint(diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Return those whose changes can be made at once: of two that touch, the first."""
    disjoint: list[Diagnostic] = []
    taken: list[Span] = []
    for diagnostic in sorted(diagnostics, key=lambda diagnostic: min(fix.span.start for fix in diagnostic.fixes)):
        spans = [fix.span for fix in diagnostic.fixes]
        if not any(_touches(span, taken) for span in spans):
            disjoint.append(diagnostic)
            for span in spans:
                insort(taken, span)
    return disjoint


def _touches(span: Span, taken: Sequence[Span]) -> bool:
    """Whether a span touches one of some, which are in order and do not touch one another."""
    index = bisect_right(taken, span)
    return any(other.start <= span.end and span.start <= other.end for other in taken[max(0, index - 1) : index + 1])


def _apply(source: Source, diagnostics: Iterable[Diagnostic]) -> Source:
    """Return a program with the changes made that diagnostics offer."""
    edits = tuple(TextEdit(fix.span, fix.replacement) for diagnostic in diagnostics for fix in diagnostic.fixes)
    return Source(source.name, apply_edits(source.main.text, edits))


def _improves(selected: Sequence[Diagnostic], before: Compilation, after: Compilation) -> bool:
    """Whether changes have made their messages go away, and have brought no other slip of syntax.

    What else is said afterwards was hidden by them: what a program does is looked at when its syntax is right, and
    of two slips at one place that can be cured one is told at a time.
    """
    changes = _OffsetMap(selected)
    repeated = {(one.code, one.message, index) for one in selected for index in changes.map_offset(one.span.start)}
    syntax_errors = [one for one in before.diagnostics if one.is_syntax]
    known = {(one.code, index) for one in syntax_errors for index in changes.map_offset(one.span.start)}
    known -= {(code, index) for code, _, index in repeated}
    for one in after.diagnostics:
        index = one.span.start
        is_new = one.is_syntax and (one.code, index) not in known
        if (one.code, one.message, index) in repeated or (is_new and not (one.fixes and index in changes.ends)):
            return False
    return True


class _OffsetMap:
    """How places move when changes are made."""

    def __init__(self, selected: Iterable[Diagnostic]) -> None:
        spans = sorted((*fix.span, len(fix.replacement)) for diagnostic in selected for fix in diagnostic.fixes)
        self._starts = [start for start, _, _ in spans]
        self._shifts = [0, *accumulate(longer - (end - start) for start, end, longer in spans)]
        self.ends = {end + longer for (_, end, _), longer in zip(spans, self._shifts[1:], strict=True)}

    def map_offset(self, offset: int) -> tuple[int, int]:
        """Return where a place is afterwards: in front of what is put in there, and behind it."""
        first, last = bisect_left(self._starts, offset), bisect_right(self._starts, offset)
        return offset + self._shifts[first], offset + self._shifts[last]


def _select_improving(
    selected: Sequence[Diagnostic], before: Compilation, compile_source: Compile
) -> tuple[list[Diagnostic], Compilation]:
    """Return the changes that help together, and what becomes of the program.

    Few do not as a rule, so that changes are tried many at a time, and half of them where those are too many.
    """
    accepted: list[Diagnostic] = []
    after = before
    groups = [list(selected)]
    for _ in range(_MAX_TRIALS):
        if not groups:
            break
        group = groups.pop()
        trial = [*accepted, *group]
        compilation = compile_source(_apply(before.source, trial))
        if _improves(trial, before, compilation):
            accepted, after = trial, compilation
        elif len(group) > 1:
            half = len(group) // 2
            groups += [group[half:], group[:half]]
    return accepted, after


def _message_id(diagnostic: Diagnostic, source: Source) -> tuple[str, str]:
    """Return a key, the message and the text of its line, that identifies it after other lines have changed."""
    return diagnostic.message, source.line_at(diagnostic.span.start)


def _description(fix: Fix, source: Source) -> str:
    old, new = (" ".join(text.split()) for text in (source.slice(fix.span), fix.replacement))
    old, new = (text if len(text) <= _MAX_SHOWN_LENGTH else f"{text[:_MAX_SHOWN_LENGTH]}..." for text in (old, new))
    if not new:
        return f"removed `{old}`"
    return f"replaced `{old}` by `{new}`" if old else f"inserted `{new}`"
