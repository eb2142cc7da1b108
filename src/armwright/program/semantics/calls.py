"""Calls of procedures: as many arguments as there are parameters, each of the right kind, and fit to be changed."""

import attrs

from armwright.program.language.diagnostic import Fix, Label, labels
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.source import Span
from armwright.program.language.words import FOREIGN_STATEMENTS, UNSUPPORTED_STATEMENTS
from armwright.program.semantics import type_check
from armwright.program.semantics.builtins import FUNCTIONS
from armwright.program.semantics.cell_symbols import WORLD
from armwright.program.semantics.expression_types import OF_KIND, a_type, called
from armwright.program.semantics.scopes import Names
from armwright.program.semantics.symbols import ProcedureSymbols
from armwright.program.syntax import tree

# What a misspelt call with parentheses may have been meant as, beside a procedure.
_STATEMENTS = ("PRINT", "LOCK")
_NUMBERS_OF_A_PLACE = 12


@attrs.frozen
class _Passed:
    """An argument that the procedure sees itself, not a copy of it."""

    caller: ProcedureSymbols | None
    argument: tree.Name | tree.ArmName
    procedure: ProcedureSymbols
    parameter: str


class Calls:
    """The calls of a program so far, and which parameters procedures change."""

    def __init__(self, names: Names) -> None:
        """Start without calls."""
        self._names = names
        self._passed: list[_Passed] = []
        self._changed: dict[tuple[int, str], Span] = {}

    def check(self, node: tree.Call, caller: ProcedureSymbols | None) -> None:
        """Check one call."""
        names, arguments = self._names, node.arguments
        procedure = names.call(node.name.key)
        if procedure is None:
            _unknown(names, node)
        if procedure is None or len(arguments) != len(procedure.parameters):
            for argument in arguments:
                _look(names, argument)
            if procedure is not None:
                _wrong_count(names, node, procedure)
            return
        for position, (argument, parameter) in enumerate(zip(arguments, procedure.parameters, strict=True)):
            kind = procedure.types.get(parameter)
            if kind is None or procedure.parameters.index(parameter) != position:
                # Something has been said of this parameter.
                _look(names, argument)
                continue
            _fits(names, argument, procedure, parameter, kind)
            if kind == VariableType(VariableKind.FRAME) and isinstance(argument, tree.Name | tree.ArmName):
                self._passed.append(_Passed(caller, argument, procedure, parameter))

    def changes(self, node: tree.Expression, inside: ProcedureSymbols | None, span: Span) -> None:
        """Take note that a statement gives a value to a variable, or hangs it elsewhere."""
        if inside is not None and isinstance(node, tree.Name) and node.key in inside.parameters:
            self._changed.setdefault((id(inside), node.key), span)

    def finish(self) -> None:
        """Say which arguments can be changed by nobody, though the procedure changes them."""
        self._follow()
        for passed_ in self._passed:
            changed = self._changed.get((id(passed_.procedure), passed_.parameter))
            argument = passed_.argument
            fixed = isinstance(argument, tree.ArmName) or (
                argument.key == WORLD and (passed_.caller is None or WORLD not in passed_.caller.types)
            )
            if changed is None or not fixed:
                continue
            procedure, parameter = passed_.procedure.node.name.text, _text(passed_.procedure, passed_.parameter)
            text = f"`{procedure}` changes its parameter `{parameter}`, and `{argument.text}` cannot be changed"
            label = "an arm" if isinstance(argument, tree.ArmName) else "the root of all frames"
            here = labels(changed, "changed here")
            note = "a FRAME is passed by reference: the procedure changes the frame itself"
            self._names.report("E220", text, argument.span, label, secondary=here, note=note)

    def _follow(self) -> None:
        """A parameter that is handed on to where it is changed is changed too."""
        callers = [
            passed_ for passed_ in self._passed if passed_.caller and passed_.argument.key in passed_.caller.parameters
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


def _look(names: Names, argument: tree.Expression) -> None:
    """Check an argument of which nothing is known: an array may be whole."""
    if isinstance(argument, tree.Name):
        names.type(argument)
    else:
        type_check.sort(names, argument)


def _fits(
    names: Names, argument: tree.Expression, procedure: ProcedureSymbols, parameter: str, kind: VariableType
) -> None:
    what = f"parameter `{_text(procedure, parameter)}` of `{procedure.node.name.text}` is "
    if not kind.sizes:
        takes = OF_KIND[kind.kind]
        type_check.need(names, argument, takes, "E220", what + takes.value)
        return
    if not isinstance(argument, tree.Name):
        is_one = type_check.sort(names, argument)
        if is_one is not None:
            text = f"{what}an {kind}, but {called(argument)} is {is_one.value}"
            names.report("E220", text, argument.span, "no array")
        return
    argument_type = names.type(argument)
    if argument_type is None or argument_type == kind:
        return
    message = f"{what}an {kind}, but `{argument.text}` is {a_type(argument_type)}"
    names.report("E220", message, argument.span, f"{argument_type}", secondary=names.where_declared(argument.key))


def _text(procedure: ProcedureSymbols, parameter: str) -> str:
    return procedure.declared[parameter].text


def _wrong_count(names: Names, node: tree.Call, procedure: ProcedureSymbols) -> None:
    takes, given = len(procedure.parameters), len(node.arguments)
    listed = ", ".join(
        f"{', '.join(name.text for name in declaration.names)} : {declaration.type.text}"
        for declaration in procedure.node.parameters
    )
    text = f"`{node.name.text}` takes {takes} argument{'s' * (takes != 1)}, not {given}"
    head, advice = labels(procedure.node.head, "declared here"), f"its parameters are ({listed})" if takes else ""
    names.report("E220", text, node.span, f"{given} given here", secondary=head, advice=advice)


def _unknown(names: Names, node: tree.Call) -> None:
    name = node.name
    if not names.first("E227", name.key):
        return
    kind = names.peek(name.key)
    secondary: tuple[Label, ...] = ()
    fixes: tuple[Fix, ...] = ()
    if kind is not None:
        names.use([name.key])
        message, label = f"`{name.text}` is {a_type(kind)} and no procedure", "no procedure"
        secondary = names.where_declared(name.key)
        help_ = f"elements are written in `[ ]`: `{name.text}[...]`" if kind.sizes else ""
        if not kind.sizes and node.arguments:
            # No other statement begins with a variable.
            help_ = f"to give it a value write `{name.text} = ...`"
            numbers = (1,) if kind.kind is VariableKind.SCALAR else (1, _NUMBERS_OF_A_PLACE)
            fixes = (Fix(Span(name.span.end, name.span.end), " ="),) if len(node.arguments) in numbers else ()
    elif name.key in FUNCTIONS:
        message, label = f"`{name.key}` is a function and no statement", "its value is not used"
        help_ = f"assign its value: `... = {name.text}(...)`"
    else:
        near = FOREIGN_STATEMENTS.get(name.key) or names.near(name.text, lambda: [*_spelled(names), *_STATEMENTS])
        message, label = f"unknown procedure `{name.text}`", "unknown procedure"
        otherwise = UNSUPPORTED_STATEMENTS.get(name.key, "declare it with PROCEDURE before BEGIN")
        help_ = f"did you mean `{near}`?" if near else otherwise
    names.report("E227", message, name.span, label, secondary=secondary, advice=help_, fixes=fixes)


def _spelled(names: Names) -> list[str]:
    return [procedure.node.name.text for procedure in names.symbols.procedures.values()]
