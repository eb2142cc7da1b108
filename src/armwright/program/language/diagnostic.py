"""Diagnostics of the compiler: messages with locations, advice and, where certain, a fix."""

import enum
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any, Self, TypedDict, Unpack

import attrs

from armwright.errors import counted, shortened
from armwright.program.language.source import Source, Span

# Of each code a pass over a program tells so many: else a file of nonsense takes more memory for messages than itself.
MAX_PER_CODE = 10_000


class Severity(enum.StrEnum):
    """How bad it is: with an error there is no code to run."""

    ERROR = "error"
    WARNING = "warning"


def severity_of(code: str) -> Severity:
    """Return how bad it is what a code stands for: W and L warn."""
    return Severity.WARNING if code[0] in "WL" else Severity.ERROR


@attrs.frozen
class Label:
    """A word on a place."""

    span: Span
    text: str = attrs.field(converter=shortened)


def labels(span: Span | None, text: str) -> tuple[Label, ...]:
    """Return a label; none where there is no place for it."""
    return () if span is None else (Label(span, text),)


@attrs.frozen
class Fix:
    """A change of the text that is certainly right: put ``replacement`` where ``span`` is."""

    span: Span
    replacement: str


def _shorten_all(texts: Iterable[str]) -> tuple[str, ...]:
    """Return texts of which none is longer than anybody reads."""
    return tuple(shortened(text) for text in texts)


def did_you_mean(word: str | None) -> str:
    """Return advice to write a word; empty where there is none."""
    return f"did you mean `{word}`?" if word else ""


@attrs.frozen(kw_only=True)
class Diagnostic:
    """One thing to say.

    Attributes:
        code: stable, such as ``E206``; E errors, W warnings, L style of working, R devices.
        severity: error or warning; by its code unless something else is given.
        message: what is wrong, in the user's words.
        span: the place.
        label: what is at that place.
        secondary: other places that matter.
        notes: what one has to know.
        helps: what to write instead.
        fixes: changes that cure it; empty unless they are certain.
    """

    code: str
    severity: Severity = attrs.field()
    message: str = attrs.field(converter=shortened)
    span: Span
    label: str = attrs.field(default="", converter=shortened)
    secondary: tuple[Label, ...] = ()
    notes: tuple[str, ...] = attrs.field(default=(), converter=_shorten_all)
    helps: tuple[str, ...] = attrs.field(default=(), converter=_shorten_all)
    fixes: tuple[Fix, ...] = ()

    @severity.default
    def _severity_of_code(self) -> Severity:
        return severity_of(self.code)

    @property
    def is_error(self) -> bool:
        """Whether it keeps the program from running."""
        return self.severity is Severity.ERROR

    @property
    def remarks(self) -> list[tuple[str, str]]:
        """The notes and what to write instead, each with the word in front of it."""
        return [*(("note", text) for text in self.notes), *(("help", text) for text in self.helps)]

    @property
    def is_syntax(self) -> bool:
        """Whether the parser had to guess, so that what the program does cannot be judged."""
        return self.code.startswith("E1")


class Details(TypedDict, total=False):
    """What ``DiagnosticList.report`` may say of a diagnostic beside its first line.

    Attributes:
        severity: other than that of its code.
        secondary: other places that matter.
        note: what one has to know; empty for none.
        advice: what to write instead; empty for none.
        replacement: what cures it where it stands in place of the span.
        fixes: changes that cure it, where they are others.
    """

    severity: Severity
    secondary: tuple[Label, ...]
    note: str
    advice: str
    replacement: str
    fixes: tuple[Fix, ...]


class DiagnosticList(list[Diagnostic]):
    """What one pass over a program has found so far: of each code so many at most, the last saying that more follow."""

    def __init__(self) -> None:
        """Start with nothing."""
        super().__init__()
        self._counts: Counter[str] = Counter()

    def append(self, one: Diagnostic) -> None:
        """Add one; of a code that was told as often as is allowed, what is added last says so."""
        self._counts[one.code] += 1
        count = self._counts[one.code]
        if count < MAX_PER_CODE:
            super().append(one)
        elif count == MAX_PER_CODE:
            text = f"{MAX_PER_CODE:,} messages have the code {one.code}; later ones are not reported"
            label = "this one, and possibly more"
            super().append(attrs.evolve(one, message=text, label=label, secondary=(), notes=(), helps=(), fixes=()))

    def extend(self, several: Iterable[Diagnostic]) -> None:
        """Add several."""
        for one in several:
            self.append(one)

    def __iadd__(self, several: Iterable[Diagnostic]) -> Self:  # type: ignore[misc,override]
        self.extend(several)
        return self

    def report(self, code: str, message: str, span: Span, label: str, **details: Unpack[Details]) -> None:
        """Add a diagnostic, made of what is given."""
        if self._counts[code] >= MAX_PER_CODE:
            return
        cure = (Fix(span, details["replacement"]),) if "replacement" in details else ()
        self.append(
            Diagnostic(
                code=code,
                severity=details.get("severity", severity_of(code)),
                message=message,
                span=span,
                label=label,
                secondary=details.get("secondary", ()),
                notes=filter(None, (details.get("note"),)),
                helps=filter(None, (details.get("advice"),)),
                fixes=details.get("fixes", cure),
            )
        )


def sort_diagnostics(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Return them sorted by their place in the text."""
    return tuple(sorted(diagnostics, key=lambda diagnostic: diagnostic.span))


def summary_line(diagnostics: Sequence[Diagnostic], source: Source) -> str:
    """Return the last line of a report, such as ``m6.rlo: 3 errors, 1 warning``."""
    errors = sum(diagnostic.is_error for diagnostic in diagnostics)
    return f"{source.name}: {counts_text(errors, len(diagnostics) - errors)}"


def counts_text(errors: int, warnings: int) -> str:
    """Return how many errors and warnings there are, such as ``3 errors, 1 warning``."""
    counts = [(errors, "error"), (warnings, "warning")]
    return ", ".join(counted(count, what) for count, what in counts if count) or "no errors"


def to_json(diagnostic: Diagnostic, source: Source) -> dict[str, Any]:
    """Return a diagnostic as plain data; lines and columns count from 1, offsets from 0, each in its file."""
    return {
        "code": diagnostic.code,
        "severity": diagnostic.severity.value,
        "message": diagnostic.message,
        **_position_data(diagnostic.span, source),
        "label": diagnostic.label,
        "secondary": [{**_position_data(label.span, source), "label": label.text} for label in diagnostic.secondary],
        "notes": list(diagnostic.notes),
        "helps": list(diagnostic.helps),
        "fixes": [{**_position_data(fix.span, source), "replacement": fix.replacement} for fix in diagnostic.fixes],
    }


def _position_data(span: Span, source: Source) -> dict[str, Any]:
    """Return a place; that in a module has the name of its file, and counts from the start of that."""
    first = source.file_start(span.start)
    place = {
        "line": source.line(span.start),
        "column": source.column(span.start),
        "start": span.start - first,
        "end": span.end - first,
    }
    return {**place, "file": source.name_at(span.start)} if first else place
