"""Messages about records: in the words of the program, and one for a record where every field would have one."""

import re
from collections.abc import Iterable, Mapping

import attrs

from armwright.program.language.diagnostic import Diagnostic
from armwright.program.records.layout import RecordVariable

# Indices, and in them those of other arrays.
_INDICES = r"\[(?:[^\[\]]|\[[^\[\]]*\])*\]"


def in_terms_of_records(
    diagnostics: Iterable[Diagnostic], records: Mapping[str, Mapping[str, RecordVariable]]
) -> list[Diagnostic]:
    """Return diagnostics of a program whose records have been laid out, as its author sees them.

    An element of a field is called ``a[2].place``. What is wrong with several fields of a record at one place is told
    once, of the record.

    Args:
        diagnostics: of the program.
        records: those of the program and of each procedure, by key.
    """
    told = list(diagnostics)
    variables = [variable for group in records.values() for variable in group.values()]
    if not variables or not told:
        return told
    owners, fields = (
        "|".join(sorted({re.escape(name.text) for name in names}, key=len, reverse=True))
        for names in (
            (variable.name for variable in variables),
            (field for variable in variables for field in variable.type.names.values()),
        )
    )
    field = re.compile(rf"(?<![\w.])((?:\w+\.)?(?:{owners}))\.({fields})\b({_INDICES})?", re.IGNORECASE)
    groups: dict[object, list[Diagnostic]] = {}
    for diagnostic in told:
        key = (diagnostic.code, diagnostic.span, field.sub(r"\1\3", diagnostic.message))
        groups.setdefault(key, []).append(diagnostic)
    return [_joined([_reworded(one, field, single=len(group) == 1) for one in group]) for group in groups.values()]


def _reworded(diagnostic: Diagnostic, field: re.Pattern[str], *, single: bool) -> Diagnostic:
    """Return a diagnostic with fields as the program writes them, or, where it is not the only one, their record."""

    def words(text: str) -> str:
        return field.sub(r"\1\3.\2" if single else r"\1\3", text)

    return attrs.evolve(
        diagnostic,
        message=words(diagnostic.message),
        label=words(diagnostic.label),
        secondary=tuple(attrs.evolve(one, text=words(one.text)) for one in diagnostic.secondary),
        notes=map(words, diagnostic.notes),
        helps=map(words, diagnostic.helps),
        # What cures one of several fields does not cure the record.
        fixes=tuple(attrs.evolve(fix, replacement=words(fix.replacement)) for fix in diagnostic.fixes if single),
    )


def _joined(group: list[Diagnostic]) -> Diagnostic:
    """Return what diagnostics have in common that differ in the field alone."""
    first, others = group[0], group[1:]

    def common(part: str) -> tuple[str, ...]:
        return tuple(text for text in getattr(first, part) if all(text in getattr(other, part) for other in others))

    return attrs.evolve(first, notes=common("notes"), helps=common("helps"))
