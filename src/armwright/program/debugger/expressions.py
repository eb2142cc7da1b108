"""Expressions of the language, worked out in a run that stands still: by its own parser, checker and operations."""

import copy
from collections.abc import Mapping, Sequence

import attrs

from armwright.errors import ArmwrightError
from armwright.program.bytecode.emitter import Emitter
from armwright.program.bytecode.instructions import Op, Operand
from armwright.program.debugger.snapshot import StackFrame
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.source import Source, Span
from armwright.program.semantics import type_check
from armwright.program.semantics.expression_types import ACCEPTED_TYPES, TYPE_OF_KIND, ExpressionType, type_texts
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.symbols import PREDECLARED, ProcedureSymbols, Scope
from armwright.program.syntax import tree
from armwright.program.syntax.expressions import expression
from armwright.program.syntax.lexer import Token, TokenKind, scan
from armwright.program.syntax.nodes import walk
from armwright.program.syntax.token_stream import PanicModeError, TokenStream
from armwright.program.vm.calls import evaluate_instructions
from armwright.program.vm.machine import Machine, RunError
from armwright.program.vm.process import Activation, Process, Value


class ExpressionError(ArmwrightError, ValueError):
    """What was asked for has no value here; the text says why."""


@attrs.frozen(kw_only=True)
class CheckedExpression:
    """An expression that makes sense where it was asked for.

    Attributes:
        source: its text.
        node: what it says.
        type: what its value is; None for a whole array or record.
        scope: the names it was checked with.
        record: the type of a whole record, or of an array of records; empty for anything else.
    """

    source: Source
    node: tree.Expression
    type: ExpressionType | None
    scope: Scope
    record: str = ""


def visible_names(machine: Machine, procedure: str | None) -> dict[str, VariableType]:
    """Return what can be named: frames of the cell, arms aside, names of the program, and of the procedure if any."""
    frames = (name for name in machine.state.tree if not name.endswith(".BASE") and not set(name) & set("'["))
    local = {} if procedure is None else machine.code.procedures[procedure].types
    declared = {**PREDECLARED, **machine.code.types, **local}
    known = {*declared, *machine.cell.arms}
    return {**{name: VariableType(VariableKind.FRAME) for name in frames if name not in known}, **declared}


def parse_expression(text: str, machine: Machine, procedure: str | None) -> CheckedExpression:
    """Read an expression and check what it is made of.

    Args:
        text: in RLO-2, whatever the program is written in; a word that names something is a name all the same.
        machine: whose names it may use.
        procedure: whose own names it may use; None for those of the program alone.

    Raises:
        ExpressionError: it makes no sense.
    """
    source, types = Source("expression", text), visible_names(machine, procedure)
    scanned = scan(source, text)
    _raise_errors(scanned.diagnostics)
    tokens = TokenStream(source, _named(scanned.tokens, types, machine, procedure), {})
    try:
        node = expression(tokens)
    except PanicModeError:
        node = None
    _raise_errors(tokens.diagnostics)
    if node is None or not tokens.is_at_end:
        raise ExpressionError(f"`{tokens.current.text}` does not belong here")
    names = NameResolver(None)
    names.symbols.types = dict(types)
    names.symbols.units = machine.code.units
    names.symbols.procedures = _procedures(machine)
    if isinstance(node, tree.Name) and node.key in types and types[node.key].sizes:
        return CheckedExpression(source=source, node=node, type=None, scope=names.scope)
    name = node.name if isinstance(node, tree.Index) else node
    records = visible_records(machine, procedure)
    if isinstance(name, tree.Name) and name.key in records:
        # Of an element the index is checked, with one of its fields.
        if isinstance(node, tree.Index):
            type_check.infer_type(names, next(field for _, field in _fields(node, names.scope)))
            _raise_errors(names.diagnostics)
        return CheckedExpression(source=source, node=node, type=None, scope=names.scope, record=records[name.key])
    _require_fields(node, records)
    sort = type_check.infer_type(names, node)
    _raise_errors(names.diagnostics)
    if sort is None:
        raise ExpressionError(f"`{text}` has no value")
    return CheckedExpression(source=source, node=node, type=sort, scope=names.scope)


def visible_records(machine: Machine, procedure: str | None) -> dict[str, str]:
    """Return the records and arrays of records that can be named, with their types."""
    if procedure is None:
        return dict(machine.code.records)
    own = machine.code.procedures[procedure]
    return {**{key: kind for key, kind in machine.code.records.items() if key not in own.types}, **own.records}


def _written_names(machine: Machine, procedure: str | None) -> Mapping[str, str]:
    """Return the names that the file of a procedure, or of the program, writes otherwise than the whole program."""
    code = machine.code
    first = 0 if procedure is None else code.procedures[procedure].start
    file = 0 if procedure is None else code.source.file_number(code.instructions[first].span.start)
    # What the program calls a name of a module is understood in every file.
    qualified = {key: name for key, name in code.names.get(0, {}).items() if "." in key}
    return {**qualified, **code.names.get(file, {})}


def names_to_write(machine: Machine, procedure: str | None) -> list[str]:
    """Return the names of variables, frames and records that an expression may write, as it may write them."""
    types, records, code = visible_names(machine, procedure), visible_records(machine, procedure), machine.code
    # Of an array of records the field stands behind the index.
    single = [key for key, kind in types.items() if not kind.sizes or key.rpartition(".")[0] not in records]
    keys = {*single, *records}
    local = frozenset[str]() if procedure is None else frozenset(code.procedures[procedure].types)
    written = {name: key for name, key in _written_names(machine, procedure).items() if key in keys - local}
    qualified = [name.lower() for name in written if "." in name]
    return [*map(code.spelled, keys), *qualified]


def _named(
    tokens: Sequence[Token], types: Mapping[str, VariableType], machine: Machine, procedure: str | None
) -> list[Token]:
    """Return the tokens of an expression with names as the whole program knows them, where a file writes others."""
    own = None if procedure is None else machine.code.procedures[procedure]
    local = frozenset[str]() if own is None else frozenset(own.types) | frozenset(own.records)
    written, named = _written_names(machine, procedure), []
    for before, token in zip([None, *tokens], tokens, strict=False):
        key = token.key
        is_field = before is not None and before.key == "."
        if token.kind is TokenKind.NAME and not is_field and key not in local and key.partition(".")[0] not in local:
            # Of a record of a module, a field stands behind its name.
            record, point, field = key.rpartition(".")
            key = written.get(key, f"{written[record]}.{field}" if point and record in written else key)
        named.append(attrs.evolve(token, key=key, kind=TokenKind.NAME if key in types else token.kind))
    return named


def _require_fields(node: tree.Expression, records: Mapping[str, str]) -> None:
    """Refuse a whole record in an expression."""
    for part in walk(node):
        if isinstance(part, tree.Name) and part.key in records:
            kind = records[part.key]
            raise ExpressionError(f"`{part.text}` is a record of the type {kind}, and one of its fields is needed here")


def _fields(node: tree.Expression, scope: Scope) -> list[tuple[str, tree.Expression]]:
    """Return the fields of a whole record, each with its name."""
    name = node.name if isinstance(node, tree.Index) else node
    assert isinstance(name, tree.Name)  # noqa: S101 - a record is a name or an element of one
    fields: list[tuple[str, tree.Expression]] = []
    for key in scope.symbols.types:
        record, _, field = key.rpartition(".")
        if record == name.key:
            part = attrs.evolve(name, text=f"{name.text}.{field.lower()}", key=key)
            fields.append((field, attrs.evolve(node, name=part) if isinstance(node, tree.Index) else part))
    return fields


def _procedures(machine: Machine) -> dict[str, ProcedureSymbols]:
    """Return the procedures and functions of a program, as far as its code knows them."""
    nowhere = Span(0, 0)
    body, none = tree.Block(nowhere, (), nowhere), tree.TypeName(nowhere, "", None)
    return {
        key: ProcedureSymbols(
            node=tree.Procedure(
                nowhere,
                nowhere,
                tree.Name(nowhere, machine.spelling(key), key),
                (),
                (),
                body,
                None if code.result is None else none,
            ),
            parameters=code.parameters,
            types=dict(code.types),
            declared={name: tree.Name(nowhere, machine.spelling(name), name) for name in code.types},
            inout=code.inout,
            result=code.result,
        )
        for key, code in machine.code.procedures.items()
    }


def evaluate(machine: Machine, frame: StackFrame, parsed: CheckedExpression) -> Value:
    """Return the value of an expression; of an event, how often it was signalled and not yet taken.

    Args:
        machine: as it is seen now; nothing in it is changed.
        frame: the level of a stack whose names it uses.
        parsed: no whole array.

    Raises:
        ExpressionError: something in it has no value.
    """
    evaluator, process, operand = _execute(machine, frame, parsed)
    if parsed.type is ExpressionType.EVENT:
        return float(evaluator.state.events.get(evaluator.resolve_name(process, operand), 0))
    try:
        return evaluator.read(process, operand, parsed.node.span)
    except RunError as error:
        raise ExpressionError(str(error)) from None


def find_slot(machine: Machine, frame: StackFrame, parsed: CheckedExpression) -> str | None:
    """Return where an expression is kept, if it is a variable, an element or an arm; None for anything else.

    Raises:
        ExpressionError: an index of it has no value, or the cell has no such arm.
    """
    node = parsed.node
    if isinstance(node, tree.ArmName) and node.key not in machine.cell.arms:
        raise ExpressionError(f"the cell has no arm {node.key}")
    if isinstance(node, tree.Name | tree.ArmName):
        is_value = isinstance(node, tree.Name) and parsed.scope.is_value(node.key)
        return None if is_value else frame.activation.bindings.get(node.key, node.key)
    if not isinstance(node, tree.Index):
        return None
    evaluator, process, operand = _execute(machine, frame, parsed)
    return evaluator.resolve_name(process, operand)


def find_field_slots(machine: Machine, frame: StackFrame, parsed: CheckedExpression) -> dict[str, str]:
    """Return where each field of a whole record is kept, by its key.

    Raises:
        ExpressionError: an index has no value, or there is no such element.
    """
    parts = ((field, attrs.evolve(parsed, node=node)) for field, node in _fields(parsed.node, parsed.scope))
    slots = ((field, find_slot(machine, frame, part)) for field, part in parts)
    return {field: slot for field, slot in slots if slot is not None}


def evaluate_as(machine: Machine, frame: StackFrame, text: str, kind: VariableKind) -> Value:
    """Return the value of an expression that a variable of some kind shall get.

    Raises:
        ExpressionError: it makes no sense, has no value, or is of another kind.
    """
    parsed = parse_expression(text, machine, frame.procedure)
    expected = TYPE_OF_KIND[kind]
    if parsed.type not in ACCEPTED_TYPES[expected]:
        whole = "a record" if parsed.record else "an array"
        actual = whole if parsed.type is None else type_texts(parsed.node, parsed.type)[0]
        raise ExpressionError(f"expected {expected.value}, but `{text}` is {actual}")
    return evaluate(machine, frame, parsed)


def parse_condition(text: str, machine: Machine, procedure: str | None) -> CheckedExpression:
    """Read a condition, or a number that may be 0.

    Raises:
        ExpressionError: it is neither.
    """
    parsed = parse_expression(text, machine, procedure)
    if parsed.type not in (ExpressionType.CONDITION, ExpressionType.SCALAR):
        raise ExpressionError(f"expected a condition, such as `n > 0`, but `{text}` is not one")
    return parsed


def _execute(machine: Machine, frame: StackFrame, parsed: CheckedExpression) -> tuple[Machine, Process, Operand]:
    """Do the steps of an expression: they give values in passing, and nothing else.

    Returns:
        A machine and a process that know these values, and the operand that has the last one.

    Raises:
        ExpressionError: something in it has no value.
    """
    emitter = Emitter(parsed.source, parsed.scope)
    # Functions of the program are called where they stand.
    emitter.instructions, emitter.constants = list(machine.code.instructions), list(machine.code.constants)
    start = len(emitter.instructions)
    operand = emitter.value(parsed.node)
    steps, constants = tuple(emitter.instructions), tuple(emitter.constants)
    code = attrs.evolve(machine.code, instructions=steps, constants=constants, source=parsed.source)
    evaluator, process = machine.with_code(code), copy.copy(frame.process)
    if any(step.op is Op.CALLF for step in steps[start:]):
        evaluator.state = machine.state.copy()
    process.stack = [Activation(kind="condition", bindings=frame.activation.bindings)]
    try:
        evaluate_instructions(evaluator, process, steps, start)
    except RunError as error:
        raise ExpressionError(str(error)) from None
    return evaluator, process, operand


def _raise_errors(diagnostics: Sequence[Diagnostic]) -> None:
    for diagnostic in diagnostics:
        if diagnostic.is_error:
            raise ExpressionError("; ".join((diagnostic.message, *diagnostic.helps[:1])))
