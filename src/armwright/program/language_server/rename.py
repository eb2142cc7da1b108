"""Renaming of a variable or a procedure everywhere in a program, so that the program goes on meaning the same."""

import re

from armwright.errors import InvalidValueError
from armwright.program.language.text_edits import TextEdit
from armwright.program.language.words import VOCABULARIES, is_reserved_in_rlo_2_only
from armwright.program.language_server.analysis import Analysis
from armwright.program.language_server.symbol_index import NameKind, Occurrence
from armwright.program.semantics.builtins import FUNCTIONS
from armwright.program.semantics.symbols import PREDECLARED

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_ARM = re.compile(r"ARM(_[0-9]+)?", re.IGNORECASE)
_NOT_RENAMEABLE = {
    NameKind.ARM: "an arm, whose name is defined by the cell",
    NameKind.DEVICE: "a device, whose name is defined by the cell",
    NameKind.TARGET: "a joint target, whose name is defined by the cell",
    NameKind.FUNCTION: "a function of the language",
    NameKind.UNIT: "a unit",
    NameKind.SENSOR: "a reserved word",
    NameKind.AXIS: "an axis",
    NameKind.ERROR: "a kind of error",
    NameKind.WATCH: "the name of a WHEN",
    NameKind.TIMER: "a timer",
}


def renameable_occurrence(analysis: Analysis, offset: int) -> Occurrence:
    """Return the name at a position, which can be changed.

    Raises:
        InvalidValueError: there is none; the text says what is there.
    """
    occurrence = analysis.occurrence_at(offset)
    if occurrence is None:
        token = analysis.token_at(offset)
        subject = f"`{token.text}` is no name" if token is not None else "here is no name"
        raise InvalidValueError(f"{subject}; only variables and procedures can be renamed")
    text = analysis.text[occurrence.start : occurrence.end]
    if occurrence.kind in _NOT_RENAMEABLE:
        raise InvalidValueError(f"`{text}` is {_NOT_RENAMEABLE[occurrence.kind]} and cannot be renamed")
    if "." in occurrence.key or analysis.record(occurrence) is not None:
        raise InvalidValueError(f"`{text}` is a record or a part of something and cannot be renamed")
    declared, source = analysis.declaration(occurrence), analysis.compiled.source
    if declared is not None and (file := source.file_number(declared.span.start)):
        raise InvalidValueError(f"`{text}` is declared in {source.file_path(file)} and cannot be renamed here")
    undeclared = occurrence.kind is NameKind.UNKNOWN or declared is None
    if undeclared or (occurrence.kind is NameKind.VARIABLE and occurrence.owner is None):
        if occurrence.key in analysis.compiled.symbols.imported:
            raise InvalidValueError(f"`{text}` is imported and cannot be renamed here")
        if occurrence.key in PREDECLARED:
            raise InvalidValueError(f"`{text}` is predeclared and cannot be renamed")
        if undeclared:
            raise InvalidValueError(f"`{text}` is not declared and cannot be renamed")
        origin = _cell_source(analysis, occurrence.key)
        if origin is not None:
            raise InvalidValueError(f"`{text}` {origin} by this name; rename it there first")
    return occurrence


def _cell_source(analysis: Analysis, key: str) -> str | None:
    """Return how the cell knows a frame by its name; None where it does not."""
    cell = analysis.cell
    if cell is not None and key in cell.frames:
        return f"gets its pose from {cell.name}"
    return f"is found by the camera of {cell.name}" if cell is not None and key in cell.seen_frames else None


def rename(analysis: Analysis, offset: int, new: str) -> tuple[TextEdit, ...]:
    """Return the changes that rename what stands at a position.

    Args:
        analysis: the program.
        offset: a position in the name.
        new: its new name.

    Raises:
        InvalidValueError: the name cannot be changed, the new one is none, or it has another meaning somewhere.
    """
    occurrence = renameable_occurrence(analysis, offset)
    _require_valid_name(analysis, new)
    if new.upper() != occurrence.key:
        _require_unused(analysis, occurrence, new)
    return tuple(TextEdit(other.span, new) for other in analysis.same_occurrences(occurrence))


def _require_valid_name(analysis: Analysis, new: str) -> None:
    """Refuse what is no name in the language of the program."""
    words = VOCABULARIES[analysis.compiled.standard]
    if not _NAME.fullmatch(new):
        raise InvalidValueError(f"'{new}' is no name: a letter comes first, then letters A to Z, digits and `_`")
    if len(new) > words.longest_name:
        longest = f"{words.longest_name} characters in {words.name}"
        raise InvalidValueError(f"'{new}' has {len(new)} characters; names have at most {longest}")
    if _ARM.fullmatch(new):
        raise InvalidValueError(f"'{new}' is the name of an arm")
    if new.upper() in words.reserved:
        standard = " of RLO-2" if is_reserved_in_rlo_2_only(new.upper()) else ""
        raise InvalidValueError(f"'{new}' is a reserved word{standard}")


def _require_unused(analysis: Analysis, occurrence: Occurrence, new: str) -> None:
    """Refuse a name that has a meaning where the renamed thing is known."""
    symbols, key = analysis.compiled.symbols, new.upper()
    if occurrence.owner is None:
        _require_unused_globally(analysis, occurrence, new)
        return
    procedure = symbols.procedures[occurrence.owner]
    if key in PREDECLARED:
        raise InvalidValueError(f"'{new}' is a frame that is predeclared")
    if key in procedure.types:
        raise InvalidValueError(f"procedure `{procedure.node.name.text}` already has a name '{new}'")
    span = procedure.node.span
    if any(other.key == key and span.start <= other.start < span.end for other in _referring_occurrences(analysis)):
        name = procedure.node.name.text
        raise InvalidValueError(f"procedure `{name}` uses the '{new}' of the program, which would then be hidden")


def _require_unused_globally(analysis: Analysis, occurrence: Occurrence, new: str) -> None:
    symbols, key = analysis.compiled.symbols, new.upper()
    cell = analysis.cell
    if key in PREDECLARED or key in symbols.imported:
        raise InvalidValueError(f"'{new}' is a frame that is {'predeclared' if key in PREDECLARED else 'imported'}")
    if key in symbols.declared or key in symbols.procedures:
        raise InvalidValueError(f"the program already has a name '{new}'")
    if key in FUNCTIONS:
        raise InvalidValueError(f"'{new}' is a function of the language")
    if cell is not None and occurrence.kind is NameKind.VARIABLE and (key in cell.frames or key in cell.seen_frames):
        raise InvalidValueError(f"{cell.name} has a frame '{new}', which this would become")
    if any(other.key == key and other.owner is None for other in _referring_occurrences(analysis)):
        raise InvalidValueError(f"the program uses '{new}' already, though it is not declared")
    for other in analysis.same_occurrences(occurrence):
        procedure = analysis.scopes.scope_at(other.start).procedure
        if procedure is not None and key in procedure.types:
            name = procedure.node.name.text
            raise InvalidValueError(f"procedure `{name}` has a '{new}' of its own, which would hide this one there")


def _referring_occurrences(analysis: Analysis) -> tuple[Occurrence, ...]:
    """Return the occurrences whose meaning depends on their name, not on their position in a statement."""
    fixed = {NameKind.UNIT, NameKind.SENSOR, NameKind.AXIS, NameKind.DEVICE, NameKind.TARGET}
    fixed |= {NameKind.VALUE, NameKind.ERROR, NameKind.WATCH, NameKind.TIMER}
    return tuple(occurrence for occurrence in analysis.occurrences if occurrence.kind not in fixed)
