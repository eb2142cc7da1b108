"""Records, their types and fields, and modules, at positions of a program."""

from bisect import bisect_left
from collections.abc import Sequence

from armwright.program.language.source import Span
from armwright.program.language_server.analysis import Analysis
from armwright.program.language_server.symbol_index import Occurrence
from armwright.program.records.layout import RecordType, RecordVariable
from armwright.program.syntax.lexer import Token

# Tokens of an element of an array at most.
_LONGEST_ELEMENT = 1000


def array_before_point(tokens: Sequence[Token]) -> Token | None:
    """Return the array of whose element a field follows, where tokens end with ``]`` and a point; None elsewhere."""
    if len(tokens) < 2 or tokens[-1].key != "." or tokens[-2].key != "]":
        return None
    depth = 0
    for at in range(len(tokens) - 2, 0, -1):
        depth += (tokens[at].key == "]") - (tokens[at].key == "[")
        if not depth:
            return tokens[at - 1]
    return None


def field_of_element(analysis: Analysis, name: Occurrence) -> tuple[RecordVariable, str] | None:
    """Return the array of records of whose element a name is the field, with the key of the field."""
    array = array_before_point(_tokens_before(analysis, name))
    record = None if array is None else analysis.record_named(array.key, array.start)
    return None if record is None or name.key not in record.type.fields else (record, name.key)


def field_declared(analysis: Analysis, name: Occurrence) -> tuple[RecordType, str] | None:
    """Return the type in whose RECORD a name is declared as a field, with the key of the field."""
    written = analysis.text[name.start : name.end].upper()
    for kind in analysis.compiled.record_types.values():
        if (field := kind.names.get(written)) is not None and field.span.start == name.start:
            return kind, written
    return None


def type_named(analysis: Analysis, name: Occurrence) -> RecordType | None:
    """Return the record type that a name is behind ``:``, OF or RECORD."""
    before = _tokens_before(analysis, name)
    if not before or before[-1].key not in (":", "OF", "RECORD"):
        return None
    return analysis.compiled.record_types.get(name.key)


def module_at(analysis: Analysis, offset: int) -> tuple[Span, list[str], str] | None:
    """Return the module whose name stands at a position.

    Returns:
        Where the name stands, the names that the module gives, and its file; None where there is no module.
    """
    tokens, brought = analysis.compiled.tokens, analysis.compiled.brought
    index = bisect_left(tokens, offset + 1, key=lambda token: token.start) - 1
    if index < 0 or offset >= tokens[index].end:
        return None
    token = tokens[index]
    module, point, _ = token.key.partition(".")
    span = Span(token.start, token.start + len(module))
    is_alias = index > 0 and tokens[index - 1].key == "AS"
    if not (point or is_alias) or offset >= span.end or analysis.scopes.scope_at(token.start).is_local(module):
        return None
    symbols, source = analysis.compiled.symbols, analysis.compiled.source
    keys = [key for written, key in brought.items() if written.partition(".")[0] == module and "." in written]
    declared = {key: symbols.declared.get(key) for key in keys}
    declared |= {key: symbols.procedures[key].node.name for key in keys if key in symbols.procedures}
    declared |= {key: kind.name for key, kind in analysis.compiled.record_types.items() if key in declared}
    names = [name for name in declared.values() if name is not None]
    if not names:
        return None
    return span, [name.text for name in names], source.name_at(names[0].span.start)


def _tokens_before(analysis: Analysis, name: Occurrence) -> Sequence[Token]:
    """Return the tokens in front of a name, which is not a long way back to the array that it may be a field of."""
    tokens = analysis.compiled.tokens
    index = bisect_left(tokens, name.start, key=lambda token: token.start)
    return tokens[max(0, index - _LONGEST_ELEMENT) : index]
