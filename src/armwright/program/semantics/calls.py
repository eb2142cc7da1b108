"""Calls of procedures: as many arguments as there are parameters, each of the right kind, and fit to be changed."""

import attrs

from armwright.program.language.diagnostic import Fix, Label, labels
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.source import Span
from armwright.program.language.words import FOREIGN_STATEMENTS, UNSUPPORTED_STATEMENTS
from armwright.program.semantics import type_check
from armwright.program.semantics.builtins import FUNCTIONS
from armwright.program.semantics.cell_symbols import WORLD
from armwright.program.semantics.expression_types import TYPE_OF_KIND, declared_type_phrase, quote_expression
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.symbols import ProcedureSymbols
from armwright.program.syntax import tree

# What a misspelt call with parentheses may have been meant as, beside a procedure.
_STATEMENTS = ("PRINT", "LOCK")
_POSE_NUMBERS = 12


@attrs.frozen
class _ReferenceArgument:
    """An argument that the procedure sees itself, not a copy of it."""

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

    def check(self, node: tree.Call, caller: ProcedureSymbols | None) -> None:
        """Check one call."""
        names, arguments = self._names, node.arguments
        procedure = names.resolve_call(node.name.key)
        if procedure is None:
            _report_unknown_procedure(names, node)
        if procedure is None or len(arguments) != len(procedure.parameters):
            for argument in arguments:
                _check_unknown_argument(names, argument)
            if procedure is not None:
                _report_wrong_count(names, node, procedure)
            return
        for position, (argument, parameter) in enumerate(zip(arguments, procedure.parameters, strict=True)):
            kind = procedure.types.get(parameter)
            if kind is None or procedure.parameters.index(parameter) != position:
                # Something has been said of this parameter.
                _check_unknown_argument(names, argument)
                continue
            _check_argument(names, argument, procedure, parameter, kind)
            if kind == VariableType(VariableKind.FRAME) and isinstance(argument, tree.Name | tree.ArmName):
                self._reference_arguments.append(_ReferenceArgument(caller, argument, procedure, parameter))

    def note_change(self, node: tree.Expression, inside: ProcedureSymbols | None, span: Span) -> None:
        """Take note that a statement gives a value to a variable, or hangs it elsewhere."""
        if inside is not None and isinstance(node, tree.Name) and node.key in inside.parameters:
            self._changed.setdefault((id(inside), node.key), span)

    def report_fixed_arguments(self) -> None:
        """Say which arguments can be changed by nobody, though the procedure changes them."""
        self._propagate_changes()
        for passed_ in self._reference_arguments:
            changed = self._changed.get((id(passed_.procedure), passed_.parameter))
            argument = passed_.argument
            fixed = isinstance(argument, tree.ArmName) or (
                argument.key == WORLD and (passed_.caller is None or WORLD not in passed_.caller.types)
            )
            if changed is None or not fixed:
                continue
            procedure, parameter = (
                passed_.procedure.node.name.text,
                _parameter_text(passed_.procedure, passed_.parameter),
            )
            text = f"`{procedure}` changes its parameter `{parameter}`, and `{argument.text}` cannot be changed"
            label = "an arm" if isinstance(argument, tree.ArmName) else "the root of all frames"
            here = labels(changed, "changed here")
            note = "a FRAME is passed by reference: the procedure changes the frame itself"
            self._names.report("E220", text, argument.span, label, secondary=here, note=note)

    def _propagate_changes(self) -> None:
        """A parameter that is handed on to where it is changed is changed too."""
        callers = [
            passed_
            for passed_ in self._reference_arguments
            if passed_.caller and passed_.argument.key in passed_.caller.parameters
        ]
        news = True
        while news:
            news = False
            for passed_ in callers:
                key = (id(passed_.caller), passed_.argument.key)
                changed = self._changed.get((id(passed_.procedure), passed_.parameter))
                if changed is not None and key not in self._changed:
                    self._changed[key] = changed
                    news = True


def _check_unknown_argument(names: NameResolver, argument: tree.Expression) -> None:
    """Check an argument of which nothing is known: an array may be whole."""
    if isinstance(argument, tree.Name):
        names.type(argument)
    else:
        type_check.infer_type(names, argument)


def _check_argument(
    names: NameResolver, argument: tree.Expression, procedure: ProcedureSymbols, parameter: str, kind: VariableType
) -> None:
    what = f"parameter `{_parameter_text(procedure, parameter)}` of `{procedure.node.name.text}` is "
    if not kind.sizes:
        takes = TYPE_OF_KIND[kind.kind]
        type_check.require_type(names, argument, takes, "E220", what + takes.value)
        return
    if not isinstance(argument, tree.Name):
        is_one = type_check.infer_type(names, argument)
        if is_one is not None:
            text = f"{what}an {kind}, but {quote_expression(argument)} is {is_one.value}"
            names.report("E220", text, argument.span, "no array")
        return
    argument_type = names.type(argument)
    if argument_type is None or argument_type == kind:
        return
    message = f"{what}an {kind}, but `{argument.text}` is {declared_type_phrase(argument_type)}"
    names.report("E220", message, argument.span, f"{argument_type}", secondary=names.declaration_labels(argument.key))


def _parameter_text(procedure: ProcedureSymbols, parameter: str) -> str:
    return procedure.declared[parameter].text


def _report_wrong_count(names: NameResolver, node: tree.Call, procedure: ProcedureSymbols) -> None:
    takes, given = len(procedure.parameters), len(node.arguments)
    listed = ", ".join(
        f"{', '.join(name.text for name in declaration.names)} : {declaration.type.text}"
        for declaration in procedure.node.parameters
    )
    text = f"`{node.name.text}` takes {takes} argument{'s' * (takes != 1)}, not {given}"
    head, advice = labels(procedure.node.head, "declared here"), f"its parameters are ({listed})" if takes else ""
    names.report("E220", text, node.span, f"{given} given here", secondary=head, advice=advice)


def _report_unknown_procedure(names: NameResolver, node: tree.Call) -> None:
    name = node.name
    if not names.is_first_report("E227", name.key):
        return
    kind = names.type_of_key(name.key)
    secondary: tuple[Label, ...] = ()
    fixes: tuple[Fix, ...] = ()
    if kind is not None:
        names.mark_used([name.key])
        message, label = f"`{name.text}` is {declared_type_phrase(kind)} and no procedure", "no procedure"
        secondary = names.declaration_labels(name.key)
        help_ = f"elements are written in `[ ]`: `{name.text}[...]`" if kind.sizes else ""
        if not kind.sizes and node.arguments:
            # No other statement begins with a variable.
            help_ = f"to give it a value write `{name.text} = ...`"
            numbers = (1,) if kind.kind is VariableKind.SCALAR else (1, _POSE_NUMBERS)
            fixes = (Fix(Span(name.span.end, name.span.end), " ="),) if len(node.arguments) in numbers else ()
    elif name.key in FUNCTIONS:
        message, label = f"`{name.key}` is a function and no statement", "its value is not used"
        help_ = f"assign its value: `... = {name.text}(...)`"
    else:
        near = FOREIGN_STATEMENTS.get(name.key) or names.closest_name(
            name.text, lambda: [*_procedure_names(names), *_STATEMENTS]
        )
        message, label = f"unknown procedure `{name.text}`", "unknown procedure"
        otherwise = UNSUPPORTED_STATEMENTS.get(name.key, "declare it with PROCEDURE before BEGIN")
        help_ = f"did you mean `{near}`?" if near else otherwise
    names.report("E227", message, name.span, label, secondary=secondary, advice=help_, fixes=fixes)


def _procedure_names(names: NameResolver) -> list[str]:
    return [procedure.node.name.text for procedure in names.symbols.procedures.values()]
