"""The kinds of expressions: what each one is, and whether that is what its pose needs."""

import math
from collections.abc import Callable

import attrs

from armwright.program.language.diagnostic import Label
from armwright.program.language.units import Dimension
from armwright.program.language.words import Standard
from armwright.program.semantics import array_elements, builtins, operators
from armwright.program.semantics.builtins import FUNCTIONS
from armwright.program.semantics.cell_symbols import WORLD
from armwright.program.semantics.expression_types import (
    ACCEPTED_TYPES,
    ExpressionType,
    declared_type_phrase,
    expression_text,
    quote_expression,
    type_phrase,
    variable_keys,
    without_article,
)
from armwright.program.semantics.quantities import check_unit
from armwright.program.semantics.scopes import NameResolver
from armwright.program.syntax import pose_literals, tree


def infer_type(names: NameResolver, node: tree.Expression) -> ExpressionType | None:
    """Return what an expression is; None where that is unknown, of which something has been said then.

    Args:
        names: what is known, and for what is found.
        node: any expression.
    """
    return _TYPE_RULES[type(node)](names, node)


def declaration_labels(names: NameResolver, node: tree.Expression) -> tuple[Label, ...]:
    """Return where a variable is declared."""
    if isinstance(node, tree.Index):
        node = node.name
    return names.declaration_labels(*variable_keys(node))


def is_world(node: tree.Expression) -> bool:
    """Whether this is the root of all frames."""
    return isinstance(node, tree.Name) and node.key == WORLD


def report_world_assignment(names: NameResolver, node: tree.Expression) -> None:
    """Say that the root of all frames cannot be assigned a value."""
    names.report("E218", f"{quote_expression(node)} cannot be assigned a value", node.span, "the root of all frames")


def require_type(
    names: NameResolver,
    node: tree.Expression,
    expected: ExpressionType,
    code: str,
    what: str,
    *,
    note: str = "",
    advice: Callable[[ExpressionType], str] | None = None,
) -> bool:
    """Say that an expression is not what its pose needs; of a plain name nothing more is asked then.

    Args:
        names: what is known, and for what is found.
        node: the expression.
        expected: what it must be.
        code: of the diagnostic.
        what: the first half of the message, such as ``AT needs a TRANS``.
        note: of the diagnostic.
        advice: what to write instead, by what the expression is; empty for none.

    Returns:
        Whether it is what is wanted.
    """
    return _check_type(names, node, infer_type(names, node), expected, code, what, note, advice)


def _check_type(  # noqa: PLR0917 - what ``need`` is given, and the sort
    names: NameResolver,
    node: tree.Expression,
    actual: ExpressionType | None,
    expected: ExpressionType,
    code: str,
    what: str,
    note: str = "",
    advice: Callable[[ExpressionType], str] | None = None,
) -> bool:
    """Do what ``need`` does for an expression of which one knows what it is."""
    if actual is expected:
        return True
    if actual is None or actual in ACCEPTED_TYPES[expected]:
        return actual is not None
    for key in variable_keys(node):
        names.poison(key)
    is_one = type_phrase(node, actual)
    names.report(
        code,
        f"{what}, but {quote_expression(node)} is {is_one}",
        node.span,
        without_article(is_one),
        secondary=names.declaration_labels(*variable_keys(node)),
        note=note,
        advice=advice(actual) if advice else "",
    )
    return False


def require_quantity(names: NameResolver, node: tree.Expression, expected: Dimension, what: str) -> bool:
    """Whether an expression is a number of the right dimension; say so if not.

    Args:
        names: what is known, and for what is found.
        node: the expression.
        expected: what a number with a unit must measure.
        what: the first half of the message, such as ``PAUSE needs a time``.
    """
    return require_type(names, node, ExpressionType.SCALAR, "E216", what) and check_unit(names, node, expected, what)


def require_condition(names: NameResolver, node: tree.Expression, who: str) -> None:
    """Say that what should be a condition is none; a number is not one."""
    _check_condition(names, node, infer_type(names, node), who)


def _check_condition(names: NameResolver, node: tree.Expression, actual: ExpressionType | None, who: str) -> None:
    def advice(actual: ExpressionType) -> str:
        if actual is ExpressionType.SCALAR and not isinstance(node, tree.Number):
            return f"write `{expression_text(node)} <> 0`"
        return "a condition compares two numbers, such as `n > 0`"

    _check_type(names, node, actual, ExpressionType.CONDITION, "E219", f"{who} needs a condition", advice=advice)


def _number(_names: NameResolver, node: tree.Number) -> ExpressionType | None:
    # A number that was reported before is NaN; it may have been meant as a name.
    return None if math.isnan(node.value) else ExpressionType.SCALAR


def _name(names: NameResolver, node: tree.Name) -> ExpressionType | None:
    kind = names.type(node)
    return None if kind is None else array_elements.variable_type(names, node, kind)


def _index(names: NameResolver, node: tree.Index) -> ExpressionType | None:
    return array_elements.element_type(names, node, [infer_type(names, index) for index in node.indices])


def _poison(names: NameResolver, node: tree.Poison) -> None:
    names.mark_used(node.names)


def _function(names: NameResolver, node: tree.Function) -> ExpressionType | None:
    name = node.name
    if name.key in FUNCTIONS:
        # An axis has a name but is no variable.
        named = name.key == "FORCE"
        argument_types = [
            None if named and isinstance(argument, tree.Name) else infer_type(names, argument)
            for argument in node.arguments
        ]
        return builtins.result_type(names, node, argument_types)
    for argument in node.arguments:
        # A procedure may be given a whole array, and this may have been meant as a call of one.
        if not isinstance(argument, tree.Name):
            infer_type(names, argument)
        else:
            names.type(argument)
    _report_unknown_function(names, node)
    return None


def _report_unknown_function(names: NameResolver, node: tree.Function) -> None:
    name = node.name
    if not names.is_first_report("E227", name.key):
        return
    kind = names.type_of_key(name.key)
    if names.resolve_call(name.key) is not None:
        message, label = f"`{name.text}` is a procedure and has no value", "a procedure"
        help_ = "call it in a statement of its own, and let it set a parameter that is a FRAME"
    elif kind is not None:
        names.mark_used([name.key])
        message, label = f"`{name.text}` is {declared_type_phrase(kind)} and no function", "no function"
        inner = ",".join(map(expression_text, node.arguments))
        help_ = f"write `{name.text}[{inner}]` for an element" if kind.sizes else ""
    else:
        near = names.closest_name(name.text, lambda: list(FUNCTIONS))
        message, label = f"unknown function `{name.text}`", "unknown function"
        help_ = f"did you mean `{near}`?" if near else f"functions are {', '.join(FUNCTIONS)}"
    names.report("E227", message, name.span, label, advice=help_)


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
            turns = position < 9
            what = "n, o, a of a matrix have no unit" if turns else "the last three numbers of a matrix are lengths"
            check_unit(names, item, None if turns else "length", what)
    return None if fault is not None and fault.is_error else ExpressionType.MATRIX


_TYPE_RULES: dict[type, Callable[..., ExpressionType | None]] = {
    tree.Number: _number,
    tree.ArmName: lambda _names, _node: ExpressionType.FRAME,
    tree.Name: _name,
    tree.Index: _index,
    tree.Poison: _poison,
    tree.Function: _function,
    tree.Unary: _unary,
    tree.Binary: _binary,
    tree.Matrix: _matrix,
}
