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
    FITTING,
    ExpressionType,
    a_type,
    bare,
    called,
    is_what,
    plain_keys,
    written,
)
from armwright.program.semantics.quantities import measure
from armwright.program.semantics.scopes import Names
from armwright.program.syntax import pose_literals, tree


def sort(names: Names, node: tree.Expression) -> ExpressionType | None:
    """Return what an expression is; None where that is unknown, of which something has been said then.

    Args:
        names: what is known, and for what is found.
        node: any expression.
    """
    return _SORTS[type(node)](names, node)


def declared(names: Names, node: tree.Expression) -> tuple[Label, ...]:
    """Return where a variable is declared."""
    if isinstance(node, tree.Index):
        node = node.name
    return names.where_declared(*plain_keys(node))


def is_world(node: tree.Expression) -> bool:
    """Whether this is the root of all frames."""
    return isinstance(node, tree.Name) and node.key == WORLD


def refuse_world(names: Names, node: tree.Expression) -> None:
    """Say that the root of all frames cannot be assigned a value."""
    names.report("E218", f"{called(node)} cannot be assigned a value", node.span, "the root of all frames")


def need(
    names: Names,
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
    return _fits(names, node, sort(names, node), expected, code, what, note, advice)


def _fits(  # noqa: PLR0917 - what ``need`` is given, and the sort
    names: Names,
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
    if actual is None or actual in FITTING[expected]:
        return actual is not None
    for key in plain_keys(node):
        names.poison(key)
    is_one = is_what(node, actual)
    names.report(
        code,
        f"{what}, but {called(node)} is {is_one}",
        node.span,
        bare(is_one),
        secondary=names.where_declared(*plain_keys(node)),
        note=note,
        advice=advice(actual) if advice else "",
    )
    return False


def quantity(names: Names, node: tree.Expression, expected: Dimension, what: str) -> bool:
    """Whether an expression is a number of the right dimension; say so if not.

    Args:
        names: what is known, and for what is found.
        node: the expression.
        expected: what a number with a unit must measure.
        what: the first half of the message, such as ``PAUSE needs a time``.
    """
    return need(names, node, ExpressionType.SCALAR, "E216", what) and measure(names, node, expected, what)


def condition(names: Names, node: tree.Expression, who: str) -> None:
    """Say that what should be a condition is none; a number is not one."""
    _is_condition(names, node, sort(names, node), who)


def _is_condition(names: Names, node: tree.Expression, actual: ExpressionType | None, who: str) -> None:
    def advice(actual: ExpressionType) -> str:
        if actual is ExpressionType.SCALAR and not isinstance(node, tree.Number):
            return f"write `{written(node)} <> 0`"
        return "a condition compares two numbers, such as `n > 0`"

    _fits(names, node, actual, ExpressionType.CONDITION, "E219", f"{who} needs a condition", advice=advice)


def _number(_names: Names, node: tree.Number) -> ExpressionType | None:
    # A number that was reported before is NaN; it may have been meant as a name.
    return None if math.isnan(node.value) else ExpressionType.SCALAR


def _name(names: Names, node: tree.Name) -> ExpressionType | None:
    kind = names.type(node)
    return None if kind is None else array_elements.single(names, node, kind)


def _index(names: Names, node: tree.Index) -> ExpressionType | None:
    return array_elements.element(names, node, [sort(names, index) for index in node.indices])


def _poison(names: Names, node: tree.Poison) -> None:
    names.use(node.names)


def _function(names: Names, node: tree.Function) -> ExpressionType | None:
    name = node.name
    if name.key in FUNCTIONS:
        # An axis has a name but is no variable.
        named = name.key == "FORCE"
        sorts = [
            None if named and isinstance(argument, tree.Name) else sort(names, argument) for argument in node.arguments
        ]
        return builtins.result(names, node, sorts)
    for argument in node.arguments:
        # A procedure may be given a whole array, and this may have been meant as a call of one.
        if not isinstance(argument, tree.Name):
            sort(names, argument)
        else:
            names.type(argument)
    _no_function(names, node)
    return None


def _no_function(names: Names, node: tree.Function) -> None:
    name = node.name
    if not names.first("E227", name.key):
        return
    kind = names.peek(name.key)
    if names.call(name.key) is not None:
        message, label = f"`{name.text}` is a procedure and has no value", "a procedure"
        help_ = "call it in a statement of its own, and let it set a parameter that is a FRAME"
    elif kind is not None:
        names.use([name.key])
        message, label = f"`{name.text}` is {a_type(kind)} and no function", "no function"
        inner = ",".join(map(written, node.arguments))
        help_ = f"write `{name.text}[{inner}]` for an element" if kind.sizes else ""
    else:
        near = names.near(name.text, lambda: list(FUNCTIONS))
        message, label = f"unknown function `{name.text}`", "unknown function"
        help_ = f"did you mean `{near}`?" if near else f"functions are {', '.join(FUNCTIONS)}"
    names.report("E227", message, name.span, label, advice=help_)


def _unary(names: Names, node: tree.Unary) -> ExpressionType | None:
    if node.operation == "NOT":
        condition(names, node.operand, "NOT")
        return ExpressionType.CONDITION
    return operators.negative(names, node, sort(names, node.operand))


def _binary(names: Names, node: tree.Binary) -> ExpressionType | None:
    first, chain = tree.operation_chain(node)
    actual = sort(names, first)
    for link in chain:
        if link.operation in ("AND", "OR"):
            _is_condition(names, link.left, actual, link.operation)
            condition(names, link.right, link.operation)
            actual = ExpressionType.CONDITION
        else:
            actual = operators.result(names, link, actual, sort(names, link.right))
    return actual


def _matrix(names: Names, node: tree.Matrix) -> ExpressionType | None:
    fault = pose_literals.check(node, names.symbols.units)
    if fault is not None:
        if len(node.items) == 3 and names.symbols.std is Standard.RLO_2:
            fault = attrs.evolve(fault, helps=(f"for a translation write `XYZ{written(node)}`",))
        names.diagnostics.append(fault)
    for position, item in enumerate(node.items):
        if not isinstance(item, tree.Number):
            need(names, item, ExpressionType.SCALAR, "E216", "a matrix is made of numbers")
        elif item.unit is not None and fault is None:
            turns = position < 9
            what = "n, o, a of a matrix have no unit" if turns else "the last three numbers of a matrix are lengths"
            measure(names, item, None if turns else "length", what)
    return None if fault is not None and fault.is_error else ExpressionType.MATRIX


_SORTS: dict[type, Callable[..., ExpressionType | None]] = {
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
