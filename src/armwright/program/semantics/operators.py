"""What the operations make of numbers, conditions, places and steps."""

from collections.abc import Mapping

from armwright.program.semantics import events
from armwright.program.semantics.expression_types import Sort, bare, is_what, written
from armwright.program.semantics.scopes import Names
from armwright.program.syntax import tree

_ARITHMETIC = frozenset("+-*/")
_COMPARISONS = frozenset(("<", "<=", "=", "<>", ">=", ">"))
_PRODUCTS: Mapping[tuple[Sort, Sort], Sort] = {
    (Sort.FRAME, Sort.TRANS): Sort.FRAME,
    (Sort.FRAME, Sort.MATRIX): Sort.FRAME,
    (Sort.TRANS, Sort.TRANS): Sort.TRANS,
    (Sort.TRANS, Sort.MATRIX): Sort.TRANS,
    (Sort.MATRIX, Sort.TRANS): Sort.MATRIX,
    (Sort.MATRIX, Sort.MATRIX): Sort.MATRIX,
    (Sort.INVERSE, Sort.FRAME): Sort.TRANS,
    (Sort.INVERSE, Sort.MATRIX): Sort.TRANS,
}
_PLACES = frozenset((Sort.FRAME, Sort.MATRIX))
_STEPS = frozenset((Sort.TRANS, Sort.MATRIX))


def result(names: Names, node: tree.Binary, left: Sort | None, right: Sort | None) -> Sort | None:
    """Return what an operation other than AND and OR gives; say that it has no meaning between these two."""
    operation = node.operation
    comparison = operation in _COMPARISONS
    if left is Sort.SCALAR and right is Sort.SCALAR:
        return Sort.CONDITION if comparison else Sort.SCALAR
    if left is None or right is None:
        # A comparison is a condition whatever it compares.
        return Sort.CONDITION if comparison else None
    if operation == "*" and (left, right) in _PRODUCTS:
        return _PRODUCTS[left, right]
    if Sort.EVENT in (left, right):
        events.refuse(names, node.left if left is Sort.EVENT else node.right)
    else:
        _refuse(names, node, left, right)
    return Sort.CONDITION if comparison else None


def negative(names: Names, node: tree.Unary, sort: Sort | None) -> Sort | None:
    """Return what a minus in front of an expression gives: only numbers have one."""
    if sort is Sort.EVENT:
        events.refuse(names, node.operand)
    elif sort not in (None, Sort.SCALAR):
        turned = sort in (Sort.TRANS, Sort.FRAME, Sort.MATRIX)
        _say(
            names,
            node,
            f"`-` takes a number, but this is {is_what(node.operand, sort)}",
            bare(is_what(node.operand, sort)),
            f"for the way back write `INV({written(node.operand)})`" if turned else "",
        )
    return None if sort is not Sort.SCALAR else Sort.SCALAR


def _refuse(names: Names, node: tree.Binary, left: Sort, right: Sort) -> None:
    one, other = is_what(node.left, left), is_what(node.right, right)
    message = f"`{node.operation}` has no meaning between {one} and {other}"
    label = f"{bare(one)} {node.operation} {bare(other)}"
    _say(names, node, message, label, _advice(node, left, right))


def _say(
    names: Names,
    node: tree.Unary | tree.Binary,
    message: str,
    label: str,
    help_: str,
) -> None:
    """Speak of an operation, unless the same was said of the same variables."""
    operands = (node.operand,) if isinstance(node, tree.Unary) else (node.left, node.right)
    variables = [one.key for one in operands if isinstance(one, tree.Name)]
    if not names.first("E221", *variables):
        return
    secondary = tuple(label for key in dict.fromkeys(variables) for label in names.where_declared(key))
    names.found.say("E221", message, node.span, label, secondary=secondary, helps=(help_,) if help_ else ())


def _advice(node: tree.Binary, left: Sort, right: Sort) -> str:
    """Return what was probably meant, empty where nobody knows."""
    one, other = written(node.left), written(node.right)
    if Sort.CONDITION in (left, right):
        return "a condition is no number; conditions are joined by AND and OR"
    if node.operation in _COMPARISONS:
        return f"for how far apart they are write `DIST({one}, {other})`" if {left, right} <= _PLACES else ""
    if node.operation in ("*", "/"):
        return _advice_on_product(node, left, right)
    if left in _PLACES | _STEPS and right in _STEPS:
        back = other if node.operation == "+" else f"INV({other})"
        return f"steps follow one another by `*`: write `{one} * {back}`"
    if {left, right} <= _PLACES and node.operation == "-":
        return f"for the step from {other} to {one} write `INV({other}) * {one}`"
    return ""


def _advice_on_product(node: tree.Binary, left: Sort, right: Sort) -> str:
    one, other = written(node.left), written(node.right)
    if node.operation == "/":
        return f"for the way back write `{one} * INV({other})`" if right in _STEPS and left is not Sort.SCALAR else ""
    match left, right:
        case Sort.FRAME, Sort.FRAME:
            return f"for the step from {one} to {other} write `INV({one}) * {other}`"
        case ((Sort.TRANS | Sort.MATRIX), Sort.FRAME):
            return f"a step comes behind the place it starts from: write `{other} * {one}`"
        case (Sort.INVERSE, _) | (_, Sort.INVERSE):
            return "INV of a FRAME goes in front of another FRAME, such as `INV(f) * g`"
        case (Sort.SCALAR, _) | (_, Sort.SCALAR):
            return "a step is made from numbers by XYZ, ROTX, ROTY and ROTZ"
        case _:
            return ""
