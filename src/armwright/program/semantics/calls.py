"""Calls of procedures: an argument for each parameter, of its type, and a variable where the procedure changes it."""

import attrs

from armwright.program.language.diagnostic import Fix, Label, labels
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.source import Span
from armwright.program.language.words import FOREIGN_STATEMENTS, UNSUPPORTED_STATEMENTS
from armwright.program.semantics import type_check
from armwright.program.semantics.aliases import AliasChecker
from armwright.program.semantics.builtins import FUNCTIONS
from armwright.program.semantics.cell_symbols import WORLD
from armwright.program.semantics.expression_types import declared_type_phrase, expression_text
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.symbols import ProcedureSymbols
from armwright.program.syntax import tree

# What a misspelt call with parentheses may have been meant as, beside a procedure.
_STATEMENTS = ("PRINT", "LOCK")
_POSE_NUMBERS = 12
_ROOT = "the root of all frames"


@attrs.frozen
class _ReferenceArgument:
    """An argument passed by reference."""

    caller: ProcedureSymbols | None
    argument: tree.Name | tree.ArmName
    procedure: ProcedureSymbols
    parameter: str


class CallChecker:
    """The calls of a program so far, and which parameters procedures change."""

    def __init__(self, names: NameResolver) -> None:
        """Start without calls."""
        self._names = names
        self._reference_arguments: list[_ReferenceArgument] = []
        self._changed: dict[tuple[int, str], Span] = {}
        self._aliases = AliasChecker(names)

    def check(self, node: tree.Call, caller: ProcedureSymbols | None) -> None:
        """Check one call."""
        names, arguments = self._names, node.arguments
        procedure = names.resolve_call(node.name.key)
        if procedure is None or len(arguments) != len(procedure.parameters):
            if procedure is None:
                _report_unknown_procedure(names, node)
            else:
                type_check.report_wrong_count(names, node, procedure)
            for argument in arguments:
                type_check.check_any(names, argument)
            return
        if procedure.is_function:
            text, label = f"`{node.name.text}` is a FUNCTION, whose value is not used here", "no statement"
            names.report(
                "E227",
                text,
                node.name.span,
                label,
                advice=f"use its value: `... = {expression_text(tree.Function(node.span, node.name, node.arguments))}`",
            )
        for argument, parameter in type_check.check_arguments(names, node, procedure):
            kind = procedure.types[parameter]
            if kind == VariableType(VariableKind.FRAME) and isinstance(argument, tree.Name | tree.ArmName):
                self._reference_arguments.append(_ReferenceArgument(caller, argument, procedure, parameter))
        self._aliases.check(node, procedure)

    def note_change(self, node: tree.Expression, inside: ProcedureSymbols | None, span: Span) -> None:
        """Note that a statement assigns a value to a variable, or affixes or unfixes it."""
        if inside is not None and isinstance(node, tree.Name) and node.key in inside.parameters:
            self._changed.setdefault((id(inside), node.key), span)

    def report_fixed_arguments(self) -> None:
        """Report arms and WORLD as arguments of a procedure that changes the parameter."""
        self._aliases.report_globals()
        self._propagate_changes()
        for reference in self._reference_arguments:
            changed = self._changed.get((id(reference.procedure), reference.parameter))
            argument, caller = reference.argument, reference.caller
            is_arm = isinstance(argument, tree.ArmName)
            is_world = argument.key == WORLD and (caller is None or WORLD not in caller.types)
            if changed is None or not (is_arm or is_world):
                continue
            parameter = type_check.parameter_text(reference.procedure, reference.parameter)
            changes = f"`{reference.procedure.node.name.text}` changes its parameter `{parameter}`"
            text, label = f"{changes}, and `{argument.text}` cannot be changed", "an arm" if is_arm else _ROOT
            note = "a FRAME is passed by reference: the procedure changes the frame itself"
            self._names.report("E220", text, argument.span, label, secondary=labels(changed, "changed here"), note=note)

    def _propagate_changes(self) -> None:
        """Note that a parameter is changed if it is passed on to a procedure that changes it."""
        count = -1
        while len(self._changed) > count:
            count = len(self._changed)
            for reference in self._reference_arguments:
                changed = self._changed.get((id(reference.procedure), reference.parameter))
                if changed is not None:
                    self.note_change(reference.argument, reference.caller, changed)


def _report_unknown_procedure(names: NameResolver, node: tree.Call) -> None:
    name = node.name
    if not names.is_first_report("E227", name.key):
        return
    kind = names.scope.type(name.key)
    secondary: tuple[Label, ...] = ()
    fixes: tuple[Fix, ...] = ()
    if kind is not None:
        names.mark_used([name.key])
        message, label = f"`{name.text}` is {declared_type_phrase(kind)} and no procedure", "no procedure"
        secondary = names.declaration_labels(name.key)
        advice = f"elements are written in `[ ]`: `{name.text}[...]`" if kind.sizes else ""
        if not kind.sizes and node.arguments:
            # No other statement begins with a variable.
            advice = f"to give it a value write `{name.text} = ...`"
            numbers = (1,) if kind.kind is VariableKind.SCALAR else (1, _POSE_NUMBERS)
            fixes = (Fix(Span(name.span.end, name.span.end), " ="),) if len(node.arguments) in numbers else ()
    elif name.key in FUNCTIONS:
        message, label = f"`{name.key}` is a function and no statement", "its value is not used"
        advice = f"assign its value: `... = {name.text}(...)`"
    else:
        procedures = names.symbols.procedures.values()
        near = FOREIGN_STATEMENTS.get(name.key) or names.closest_name(
            name.text, lambda: [*(procedure.node.name.text for procedure in procedures), *_STATEMENTS]
        )
        message, label = f"unknown procedure `{name.text}`", "unknown procedure"
        otherwise = UNSUPPORTED_STATEMENTS.get(name.key, "declare it with PROCEDURE before BEGIN")
        advice = f"did you mean `{near}`?" if near else otherwise
    names.report("E227", message, name.span, label, secondary=secondary, advice=advice, fixes=fixes)
