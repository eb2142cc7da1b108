"""Hover texts: names with their types and poses, keywords, numbers with units."""

from collections.abc import Sequence
from itertools import takewhile
from typing import TypeAlias

from lsprotocol import types as lsp

from armwright.arrays import Array
from armwright.cell.model import base_name
from armwright.program.language.error_kinds import KINDS
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.names import is_arm
from armwright.program.language.units import UNITS, UnitSystem, convert, dimension
from armwright.program.language_server.analysis import Analysis
from armwright.program.language_server.keyword_docs import word_doc
from armwright.program.language_server.positions import span_range
from armwright.program.language_server.records import field_declared, field_of_element, module_at, type_named
from armwright.program.language_server.symbol_index import NameKind, Occurrence
from armwright.program.records.layout import RecordType
from armwright.program.semantics.builtins import FUNCTIONS
from armwright.program.semantics.symbols import PREDECLARED
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import Token, TokenKind
from armwright.program.vm.value_text import value_text

# Words that a statement can start with and that a word of the same statement is looked up by.
_STATEMENT_STARTS = frozenset(("MOVE", "AFFIX", "OPEN", "FOR", "OPERATE", "WHEN", "TIMER"))


# What something is, as the language would write it; and what there is to say about it, a sentence or fact each.
_Description: TypeAlias = tuple[str, Sequence[str]]


def hover(analysis: Analysis, offset: int, *, markdown: bool) -> lsp.Hover | None:
    """Return the hover text of a position; None where there is none.

    Args:
        analysis: of the program.
        offset: the position.
        markdown: whether the editor shows Markdown.
    """
    item = analysis.occurrence_at(offset) or analysis.token_at(offset)
    if item is None:
        return None
    span, module = item.span, module_at(analysis, offset)
    if module is not None:
        span, names, file = module
        described: _Description | None = (
            f"MODULE {analysis.text[span.start : span.end]}",
            [f"file {file}", f"gives {', '.join(names)}"],
        )
    else:
        described = _describe_name(analysis, item) if isinstance(item, Occurrence) else _describe_token(analysis, item)
    if described is None:
        return None
    code, lines = described
    if markdown:
        content = lsp.MarkupContent(lsp.MarkupKind.Markdown, "\n\n".join((f"```rlo\n{code}\n```", *lines)))
    else:
        content = lsp.MarkupContent(lsp.MarkupKind.PlainText, "\n".join((code, *lines)).replace("`", ""))
    return lsp.Hover(content, span_range(analysis.codec, span))


def _describe_token(analysis: Analysis, token: Token) -> _Description | None:
    """Return what there is to say about a word of the language or a number with a unit."""
    if token.kind is TokenKind.NUMBER:
        return _describe_number(token, analysis.compiled.symbols.units)
    word = word_doc(token.key, _statement_word(analysis, token)) if token.kind is TokenKind.KEYWORD else None
    return None if word is None else (word.syntax, [word.text])


def signature(procedure: tree.Procedure) -> tuple[str, tuple[tuple[int, int], ...]]:
    """Return the head of a procedure on one line, and where its parameters stand in that."""
    word = "PROCEDURE" if procedure.result is None else "FUNCTION"
    text, spans, separator = f"{word} {procedure.name.text}", [], " ("
    for declaration in procedure.parameters:
        mode = f"{declaration.mode} " if declaration.mode else ""
        for name in declaration.names:
            text += separator + mode + name.text
            mode = ""
            spans.append((len(text) - len(name.text), len(text)))
            separator = ", "
        text += f" : {_type_text(declaration.type)}"
    text += ")" * bool(spans)
    return text if procedure.result is None else f"{text} : {_type_text(procedure.result)}", tuple(spans)


def _type_text(written: tree.TypeName) -> str:
    sizes = ",".join(number.text for number in written.sizes)
    name = written.key or written.text
    return f"ARRAY [{sizes}] OF {name}" if sizes else name


def _statement_word(analysis: Analysis, token: Token) -> str:
    """Return the word that starts the statement that a token stands in."""
    statement = takewhile(lambda before: before.key != ";", analysis.tokens_before(token.start))
    keywords = (before.key for before in statement if before.kind is TokenKind.KEYWORD)
    return next((word for word in keywords if word in _STATEMENT_STARTS), "")


# ---- names ---------------------------------------------------------------------------------------------------------


# Names that are not declared and are of no cell.
_UNDECLARED = {
    NameKind.WATCH: "the name of a WHEN, by which it is armed and disarmed",
    NameKind.TIMER: "a timer: TIMER starts, stops and sets it, and TIMER(name) are its seconds",
}


def _describe_name(analysis: Analysis, occurrence: Occurrence) -> _Description | None:
    key, text = occurrence.key, analysis.text[occurrence.start : occurrence.end]
    procedure = analysis.compiled.symbols.procedures.get(key)
    description: _Description | None = None
    match occurrence.kind:
        case NameKind.VARIABLE:
            description = _describe_variable(analysis, occurrence, text)
        case NameKind.ARM:
            description = f"{key} : FRAME", _describe_arm(analysis, key)
        case NameKind.PROCEDURE if procedure is not None:
            line = analysis.compiled.source.place(procedure.node.name.span.start)
            description = signature(procedure.node)[0], [f"declared in line {line}"]
        case NameKind.UNKNOWN:
            description = _describe_of_records(analysis, occurrence)
        case NameKind.DEVICE:
            description = text, [_describe_device(analysis, key)]
        case NameKind.TARGET:
            description = text, [_describe_target(analysis, key)]
        case NameKind.UNIT if key in UNITS:
            description = key, [f"a unit of {dimension(key)}"]
        case NameKind.WATCH | NameKind.TIMER | NameKind.ERROR | NameKind.AXIS:
            description = text, [_UNDECLARED.get(occurrence.kind) or _describe_plain(occurrence.kind, key)]
        case NameKind.FUNCTION | NameKind.SENSOR | NameKind.VALUE if (word := word_doc(key)) is not None:
            value = f" : {FUNCTIONS[key].result.name}" if occurrence.kind is NameKind.FUNCTION else ""
            description = word.syntax + value, [word.text]
    return description


def _describe_plain(kind: NameKind, key: str) -> str:
    """Return what a name is that stands for nothing in the cell or the program."""
    if kind is NameKind.AXIS:
        return f"the {key.lower()} axis"
    own = "a kind of error of the program, which RAISE raises and RECOVER may name"
    return f"a kind of error: {KINDS[key]}" if key in KINDS else own


def _describe_of_records(analysis: Analysis, occurrence: Occurrence) -> _Description | None:
    """Return what there is to say about a record, a type of records or a field; None of anything else."""
    place = analysis.compiled.source.place
    if (element := field_of_element(analysis, occurrence)) is not None:
        record, key = element
        name, kind = record.type.names[key], record.type.fields[key]
        title = f"{record.name.text}[{','.join(size.text for size in record.sizes)}].{name.text} : {kind.text}"
        return title, [f"field of {record.type.name.text}, declared in line {place(name.span.start)}"]
    if (declared := field_declared(analysis, occurrence)) is not None:
        kind_of, key = declared
        return f"{kind_of.names[key].text} : {kind_of.fields[key].text}", [f"field of {kind_of.name.text}"]
    if (named := type_named(analysis, occurrence)) is not None:
        line = place(named.name.span.start)
        return f"RECORD {named.name.text}", [_fields_text(named), f"declared in line {line}"]
    if (whole := analysis.record(occurrence)) is not None:
        line = place(whole.name.span.start)
        return f"{whole.name.text} : {whole}", [_fields_text(whole.type), f"declared in line {line}"]
    return None


def _fields_text(kind: RecordType) -> str:
    return f"fields: {', '.join(f'{kind.names[key].text} : {field.text}' for key, field in kind.fields.items())}"


def _describe_variable(analysis: Analysis, occurrence: Occurrence, text: str) -> _Description:
    symbols = analysis.compiled.symbols
    declared = analysis.declaration(occurrence)
    code = f"{declared.text if declared else text} : {occurrence.type or 'of an invalid type'}"
    lines = []
    if declared is not None:
        origin = f"declared in line {analysis.compiled.source.place(declared.span.start)}"
        if occurrence.owner is not None:
            procedure = symbols.procedures[occurrence.owner]
            role = "parameter" if occurrence.key in procedure.parameters else "variable"
            origin = f"{role} of `{procedure.node.name.text}`, {origin}"
        lines.append(origin)
    elif occurrence.key in symbols.imported:
        lines.append("imported")
    elif occurrence.key in PREDECLARED:
        lines.append("predeclared")
    if occurrence.owner is None and occurrence.type == VariableType(VariableKind.FRAME):
        lines += _describe_frame(analysis, occurrence.key)
    return code, lines


def _describe_frame(analysis: Analysis, key: str) -> list[str]:
    """Return where the cell has a frame at the start."""
    cell, frames = analysis.cell, analysis.frames
    if cell is None or frames is None:
        return []
    lines = []
    parent = frames.parent(key) if key in frames else None
    if parent is not None:
        lines.append(f"attached to {_parent_text(parent)} in {cell.name}")
        if frames.has_value(key):
            units = analysis.compiled.symbols.units
            if parent != "WORLD":
                lines.append(f"relative to {_parent_text(parent)}: {pose_text(frames.relation(key, parent), units)}")
            lines.append(f"in the world: {pose_text(frames.world(key), units)}")
    if count := len(cell.visions.get(key, ())):
        lines.append(f"the camera of {cell.name} has {count} answer{'s' * (count > 1)} for it")
    if (part := cell.seen_parts.get(key)) is not None:
        lines.append(f"the camera of {cell.name} finds the part {part} there")
    return lines


def _describe_arm(analysis: Analysis, key: str) -> list[str]:
    """Return what the cell knows of an arm."""
    cell, frames = analysis.cell, analysis.frames
    if cell is None or frames is None:
        return ["an arm; its value is the pose of its gripper"]
    if key not in cell.arms:
        return [f"{cell.name} has no such arm; it has {', '.join(sorted(cell.arms))}"]
    units = analysis.compiled.symbols.units
    return [
        f"{cell.arms[key].arm.name} in {cell.name}; its value is the pose of its gripper",
        f"base: {pose_text(cell.arms[key].base, units)}",
        f"gripper at the start: {pose_text(frames.world(key), units)}",
    ]


def _describe_device(analysis: Analysis, key: str) -> str:
    cell = analysis.cell
    if cell is not None and key in cell.inputs:
        return f"{'an analogue' if cell.inputs[key].analogue else 'a digital'} input of {cell.name}"
    if cell is None or cell.devices is None:
        return "a device"
    return f"a device of {cell.name}" if key in cell.devices else f"{cell.name} has no such device"


def _describe_target(analysis: Analysis, key: str) -> str:
    cell = analysis.cell
    if cell is None:
        return "a joint target of the cell"
    if key not in cell.joint_targets:
        return f"{cell.name} has no such joint target"
    target, units = cell.joint_targets[key], analysis.compiled.symbols.units
    worth = [units.radians if it.revolute else units.metres for it in cell.arms[target.arm].arm.joints]
    positions = ", ".join(f"{q / unit:.6g}" for q, unit in zip(target.q.tolist(), worth, strict=True))
    return f"a joint target of {target.arm} in {cell.name}: JOINTS({positions})"


def _parent_text(frame: str) -> str:
    arm = frame.removesuffix(base_name(""))
    return f"the base of {arm}" if arm != frame and is_arm(arm) else frame


def pose_text(X: Array, units: UnitSystem) -> str:
    """Return a pose (4, 4) as a program writes it: n, o, a, p, lengths in the unit of the program."""
    return f"`{value_text(X, units)}` {units.length.lower()}"


# ---- numbers -------------------------------------------------------------------------------------------------------


def _describe_number(token: Token, units: UnitSystem) -> _Description | None:
    """Return what a number with a unit is worth in the program."""
    unit = token.text[len(token.key) :].upper()
    if unit not in UNITS or token.damaged:
        return None
    value = convert(float(token.key), unit, units)
    quantity = dimension(unit)
    names = {"length": units.length.lower(), "angle": units.angle.lower(), "time": "s", "force": "N"}
    return f"{token.text} = {value:.12g} {names[quantity]}", [f"a {quantity} in the unit of the program"]
