"""Type checking of expressions: the type of each, and whether it is the one that its position requires."""

import math
from collections.abc import Callable

import attrs

from armwright.errors import counted
from armwright.program.language.diagnostic import labels
from armwright.program.language.kinds import VariableType
from armwright.program.language.units import Dimension
from armwright.program.language.words import Standard
from armwright.program.semantics import array_elements, builtins, operators
from armwright.program.semantics.builtins import FUNCTIONS, WITH_NAME
from armwright.program.semantics.cell_symbols import WORLD
from armwright.program.semantics.expression_types import (
    ACCEPTED_TYPES,
    TYPE_OF_KIND,
    ExpressionType,
    declared_type_phrase,
    expression_text,
    quote_expression,
    variable_keys,
    variable_phrase,
)
from armwright.program.semantics.quantities import check_unit
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.symbols import ProcedureSymbols
from armwright.program.syntax import pose_literals, tree

# The types of values of the language; the others are numbers.
_VALUE_TYPES = {
    "TRUE": ExpressionType.CONDITION,
    "FALSE": ExpressionType.CONDITION,
    "MESSAGE": ExpressionType.TEXT,
}


def infer_type(names: NameResolver, node: tree.Expression) -> ExpressionType | None:
    """Return the type of an expression; None where it is unknown, the reason being reported.

    Args:
        names: the names, and where errors are reported.
        node: any expression.
    """
    return _TYPE_RULES[type(node)](names, node)


def check_any(names: NameResolver, node: tree.Expression) -> None:
    """Check an expression where any type will do, and a whole array too."""
    if isinstance(node, tree.Name):
        names.type(node)
    else:
        infer_type(names, node)


def is_world(node: tree.Expression) -> bool:
    """Whether this is the root of all frames."""
    return isinstance(node, tree.Name) and node.key == WORLD


def report_world_assignment(names: NameResolver, node: tree.Expression) -> None:
    """Report that the root of all frames cannot be assigned a value."""
    names.report("E218", f"{quote_expression(node)} cannot be assigned a value", node.span, "the root of all frames")


def report_constant_assignment(names: NameResolver, node: tree.Name) -> None:
    """Report that a constant keeps its value."""
    names.scope.table(node.key).used.add(node.key)
    text, label = f"`{node.text}` is a constant and keeps its value", "a constant"
    advice = f"declare it with VAR instead of CONST, and write `{node.text} = ...` after BEGIN"
    here = names.declaration_labels(node.key)
    names.report_once("E218", text, node.span, label, [node.key], secondary=here, advice=advice)


def require_type(
    names: NameResolver,
    node: tree.Expression,
    required: ExpressionType,
    code: str,
    what: str,
    *,
    note: str = "",
    advice: Callable[[ExpressionType], str] | None = None,
) -> bool:
    """Report an expression that is not of the type that its position requires; a plain name is not reported again.

    Args:
        names: the names, and where errors are reported.
        node: the expression.
        required: the type.
        code: of the diagnostic.
        what: the first half of the message, such as ``AT needs a TRANS``.
        note: of the diagnostic.
        advice: what to write instead, by the type that the expression has; empty for none.

    Returns:
        Whether it is of that type.
    """
    actual = infer_type(names, node)
    if actual is None or actual in ACCEPTED_TYPES[required]:
        return actual is not None
    names.poison(*variable_keys(node))
    names.report_type(code, node, actual, what, note=note, advice=advice(actual) if advice else "")
    return False


def require_quantity(names: NameResolver, node: tree.Expression, expected: Dimension, what: str) -> bool:
    """Report an expression that is not a number of the right dimension; return whether it is one.

    Args:
        names: the names, and where errors are reported.
        node: the expression.
        expected: what a number with a unit must measure.
        what: the first half of the message, such as ``PAUSE needs a time``.
    """
    return require_type(names, node, ExpressionType.SCALAR, "E216", what) and check_unit(names, node, expected, what)


def require_condition(names: NameResolver, node: tree.Expression, who: str) -> None:
    """Report an expression that is not a condition; a number is not one."""
    _check_condition(names, node, infer_type(names, node), who)


def _check_condition(names: NameResolver, node: tree.Expression, actual: ExpressionType | None, who: str) -> None:
    if actual is None or actual is ExpressionType.CONDITION:
        return
    advice = "a condition compares two numbers, such as `n > 0`"
    if actual is ExpressionType.SCALAR and not isinstance(node, tree.Number):
        advice = f"write `{expression_text(node)} <> 0`"
    names.poison(*variable_keys(node))
    names.report_type("E219", node, actual, f"{who} needs a condition", advice=advice)


# ---- arguments -----------------------------------------------------------------------------------------------------


def check_arguments(
    names: NameResolver, node: tree.Call | tree.Function, procedure: ProcedureSymbols
) -> list[tuple[tree.Expression, str]]:
    """Check the arguments of a call; return each with its parameter, where the types of both are known."""
    if len(node.arguments) != len(procedure.parameters):
        report_wrong_count(names, node, procedure)
        for argument in node.arguments:
            check_any(names, argument)
        return []
    pairs = []
    for position, (argument, parameter) in enumerate(zip(node.arguments, procedure.parameters, strict=True)):
        kind = procedure.types.get(parameter)
        if kind is None or procedure.parameters.index(parameter) != position:
            # Its declaration has been reported.
            check_any(names, argument)
            continue
        check_argument(names, argument, procedure, parameter, kind)
        pairs.append((argument, parameter))
    return pairs


def _check_variable(names: NameResolver, node: tree.Expression, what: str) -> None:
    """Check that an argument can be given a value."""
    if isinstance(node, tree.Name) and names.scope.is_constant(node.key):
        report_constant_assignment(names, node)
    elif not isinstance(node, tree.Name | tree.Index | tree.ArmName | tree.Poison):
        text = f"{what}INOUT and needs a variable, but {quote_expression(node)} is a value"
        advice = "assign it to a variable first, and give that"
        names.report("E220", text, node.span, "no variable", advice=advice)


def check_argument(
    names: NameResolver, argument: tree.Expression, procedure: ProcedureSymbols, parameter: str, kind: VariableType
) -> None:
    """Check that an argument is of the type of its parameter, and a variable where the parameter is INOUT."""
    what = f"parameter `{parameter_text(procedure, parameter)}` of `{procedure.node.name.text}` is "
    if not kind.sizes:
        required = TYPE_OF_KIND[kind.kind]
        if parameter in procedure.inout:
            _check_variable(names, argument, what)
        require_type(names, argument, required, "E220", what + variable_phrase(required))
    elif not isinstance(argument, tree.Name):
        if (actual := infer_type(names, argument)) is not None:
            text = f"{what}an {kind}, but {quote_expression(argument)} is {actual.value}"
            names.report("E220", text, argument.span, "no array")
    elif (array := names.type(argument)) is not None and array != kind:
        text = f"{what}an {kind}, but `{argument.text}` is {declared_type_phrase(array)}"
        names.report("E220", text, argument.span, f"{array}", secondary=names.declaration_labels(argument.key))


def parameter_text(procedure: ProcedureSymbols, parameter: str) -> str:
    """Return a parameter as its procedure declares it."""
    return procedure.declared[parameter].text


def report_wrong_count(names: NameResolver, node: tree.Call | tree.Function, procedure: ProcedureSymbols) -> None:
    """Report a call with too many arguments, or too few."""
    declared = ((", ".join(name.text for name in part.names), part.type.text) for part in procedure.node.parameters)
    listed = ", ".join(f"{parameters} : {kind}" for parameters, kind in declared)
    count = len(node.arguments)
    text = f"`{node.name.text}` takes {counted(len(procedure.parameters), 'argument')}, not {count}"
    head = labels(procedure.node.head, "declared here")
    advice = f"its parameters are ({listed})" if procedure.parameters else ""
    names.report("E220", text, node.span, f"{count} given here", secondary=head, advice=advice)


# ---- rules ---------------------------------------------------------------------------------------------------------


def _number(_names: NameResolver, node: tree.Number) -> ExpressionType | None:
    # A number that was reported before is NaN; it may have been meant as a name.
    return None if math.isnan(node.value) else ExpressionType.SCALAR


def _name(names: NameResolver, node: tree.Name) -> ExpressionType | None:
    if names.scope.is_value(node.key):
        return _VALUE_TYPES.get(node.key, ExpressionType.SCALAR)
    kind = names.type(node)
    return None if kind is None else array_elements.variable_type(names, node, kind)


def _index(names: NameResolver, node: tree.Index) -> ExpressionType | None:
    return array_elements.element_type(names, node, [infer_type(names, index) for index in node.indices])


def _poison(names: NameResolver, node: tree.Poison) -> None:
    names.mark_used(node.names)


def _function(names: NameResolver, node: tree.Function) -> ExpressionType | None:
    key, arguments = node.name.key, node.arguments
    if key in FUNCTIONS and key not in names.symbols.procedures:
        # An axis has a name but is no variable.
        is_axis = [key in WITH_NAME and isinstance(argument, tree.Name) for argument in arguments]
        if builtins.is_joints(names.scope, node) and builtins.joint_target(names.scope, node) is not None:
            is_axis = [True]
        types = [None if axis else infer_type(names, node) for axis, node in zip(is_axis, arguments, strict=True)]
        return builtins.result_type(names, node, types)
    procedure = names.resolve_call(key)
    if procedure is not None and procedure.is_function:
        check_arguments(names, node, procedure)
        return None if procedure.result is None else TYPE_OF_KIND[procedure.result.kind]
    for argument in arguments:
        # A procedure may be given a whole array, and this may have been meant as a call of one.
        check_any(names, argument)
    _report_unknown_function(names, node)
    return None


def _report_unknown_function(names: NameResolver, node: tree.Function) -> None:
    name = node.name
    if not names.is_first_report("E227", name.key):
        return
    kind = names.scope.type(name.key)
    if names.resolve_call(name.key) is not None:
        message, label = f"`{name.text}` is a procedure and has no value", "a procedure"
        advice = "call it in a statement of its own, or declare it as a FUNCTION"
    elif kind is not None:
        names.mark_used([name.key])
        message, label = f"`{name.text}` is {declared_type_phrase(kind)} and no function", "no function"
        indices = ",".join(map(expression_text, node.arguments))
        advice = f"write `{name.text}[{indices}]` for an element" if kind.sizes else ""
    else:
        near = names.closest_name(name.text, lambda: list(FUNCTIONS))
        message, label = f"unknown function `{name.text}`", "unknown function"
        advice = f"did you mean `{near}`?" if near else f"functions are {', '.join(FUNCTIONS)}"
    names.report("E227", message, name.span, label, advice=advice)


def _unary(names: NameResolver, node: tree.Unary) -> ExpressionType | None:
    if node.operation == "NOT":
        require_condition(names, node.operand, "NOT")
        return ExpressionType.CONDITION
    return operators.negated_type(names, node, infer_type(names, node.operand))


def _binary(names: NameResolver, node: tree.Binary) -> ExpressionType | None:
    first, chain = tree.operation_chain(node)
    actual = infer_type(names, first)
    for link in chain:
        if link.operation in ("AND", "OR"):
            _check_condition(names, link.left, actual, link.operation)
            require_condition(names, link.right, link.operation)
            actual = ExpressionType.CONDITION
        else:
            actual = operators.result_type(names, link, actual, infer_type(names, link.right))
    return actual


def _matrix(names: NameResolver, node: tree.Matrix) -> ExpressionType | None:
    fault = pose_literals.check(node, names.symbols.units)
    if fault is not None:
        if len(node.items) == 3 and names.symbols.std is Standard.RLO_2:
            fault = attrs.evolve(fault, helps=(f"for a translation write `XYZ{expression_text(node)}`",))
        names.diagnostics.append(fault)
    for position, item in enumerate(node.items):
        if not isinstance(item, tree.Number):
            require_type(names, item, ExpressionType.SCALAR, "E216", "a matrix is made of numbers")
        elif item.unit is not None and fault is None:
            is_axis = position < 9
            what = "n, o, a of a matrix have no unit" if is_axis else "the last three numbers of a matrix are lengths"
            check_unit(names, item, None if is_axis else "length", what)
    return None if fault is not None and fault.is_error else ExpressionType.MATRIX


_TYPE_RULES: dict[type, Callable[..., ExpressionType | None]] = {
    tree.Number: _number,
    tree.String: lambda _names, _node: ExpressionType.TEXT,
    tree.ArmName: lambda _names, _node: ExpressionType.FRAME,
    tree.Name: _name,
    tree.Index: _index,
    tree.Poison: _poison,
    tree.Function: _function,
    tree.Unary: _unary,
    tree.Binary: _binary,
    tree.Matrix: _matrix,
}
