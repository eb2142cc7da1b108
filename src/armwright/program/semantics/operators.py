"""What the operations make of numbers, conditions, poses and steps."""

from collections.abc import Mapping

from armwright.program.language.words import COMPARISONS
from armwright.program.semantics import events
from armwright.program.semantics.expression_types import ExpressionType, expression_text, type_phrase, without_article
from armwright.program.semantics.scopes import NameResolver
from armwright.program.syntax import tree

_PRODUCTS: Mapping[tuple[ExpressionType, ExpressionType], ExpressionType] = {
    (ExpressionType.FRAME, ExpressionType.TRANS): ExpressionType.FRAME,
    (ExpressionType.FRAME, ExpressionType.MATRIX): ExpressionType.FRAME,
    (ExpressionType.TRANS, ExpressionType.TRANS): ExpressionType.TRANS,
    (ExpressionType.TRANS, ExpressionType.MATRIX): ExpressionType.TRANS,
    (ExpressionType.MATRIX, ExpressionType.TRANS): ExpressionType.MATRIX,
    (ExpressionType.MATRIX, ExpressionType.MATRIX): ExpressionType.MATRIX,
    (ExpressionType.INVERSE, ExpressionType.FRAME): ExpressionType.TRANS,
    (ExpressionType.INVERSE, ExpressionType.MATRIX): ExpressionType.TRANS,
}
_POSES = frozenset((ExpressionType.FRAME, ExpressionType.MATRIX))
_TRANSFORMATIONS = frozenset((ExpressionType.TRANS, ExpressionType.MATRIX))


def result_type(
    names: NameResolver, node: tree.Binary, left: ExpressionType | None, right: ExpressionType | None
) -> ExpressionType | None:
    """Return what an operation other than AND and OR gives; say that it has no meaning between these two."""
    operation = node.operation
    comparison = operation in COMPARISONS
    if left is ExpressionType.SCALAR and right is ExpressionType.SCALAR:
        return ExpressionType.CONDITION if comparison else ExpressionType.SCALAR
    if left is None or right is None:
        # A comparison is a condition whatever it compares.
        return ExpressionType.CONDITION if comparison else None
    if operation == "*" and (left, right) in _PRODUCTS:
        return _PRODUCTS[left, right]
    if ExpressionType.EVENT in (left, right):
        events.report_event_as_value(names, node.left if left is ExpressionType.EVENT else node.right)
    else:
        _report_wrong_operands(names, node, left, right)
    return ExpressionType.CONDITION if comparison else None


def negated_type(names: NameResolver, node: tree.Unary, operand_type: ExpressionType | None) -> ExpressionType | None:
    """Return what a minus in front of an expression gives: only numbers have one."""
    if operand_type is ExpressionType.EVENT:
        events.report_event_as_value(names, node.operand)
    elif operand_type not in (None, ExpressionType.SCALAR):
        what, is_pose = type_phrase(node.operand, operand_type), operand_type in _POSES | _TRANSFORMATIONS
        advice = f"for the inverse transformation write `INV({expression_text(node.operand)})`" if is_pose else ""
        _report_once(names, node, f"`-` takes a number, but this is {what}", without_article(what), advice)
    return operand_type if operand_type is ExpressionType.SCALAR else None


def _report_wrong_operands(names: NameResolver, node: tree.Binary, left: ExpressionType, right: ExpressionType) -> None:
    left_text, other = type_phrase(node.left, left), type_phrase(node.right, right)
    message = f"`{node.operation}` has no meaning between {left_text} and {other}"
    label = f"{without_article(left_text)} {node.operation} {without_article(other)}"
    _report_once(names, node, message, label, _operand_advice(node, left, right))


def _report_once(names: NameResolver, node: tree.Unary | tree.Binary, message: str, label: str, help_: str) -> None:
    """Speak of an operation, unless the same was said of the same variables."""
    operands = (node.operand,) if isinstance(node, tree.Unary) else (node.left, node.right)
    variables = [operand.key for operand in operands if isinstance(operand, tree.Name)]
    if not names.is_first_report("E221", *variables):
        return
    secondary = names.declaration_labels(*dict.fromkeys(variables))
    names.report("E221", message, node.span, label, secondary=secondary, advice=help_)


def _operand_advice(node: tree.Binary, left: ExpressionType, right: ExpressionType) -> str:
    """Return what was probably meant, empty where nobody knows."""
    left_text, other = expression_text(node.left), expression_text(node.right)
    if ExpressionType.CONDITION in (left, right):
        return "a condition is not a number; combine conditions with AND and OR"
    if node.operation in COMPARISONS:
        return f"for their distance write `DIST({left_text}, {other})`" if {left, right} <= _POSES else ""
    if node.operation in ("*", "/"):
        return _product_advice(node, left, right)
    if left in _POSES | _TRANSFORMATIONS and right in _TRANSFORMATIONS:
        back = other if node.operation == "+" else f"INV({other})"
        return f"transformations are composed by `*`: write `{left_text} * {back}`"
    if {left, right} <= _POSES and node.operation == "-":
        return f"for the transformation from {other} to {left_text} write `INV({other}) * {left_text}`"
    return ""


def _product_advice(node: tree.Binary, left: ExpressionType, right: ExpressionType) -> str:
    left_text, other = expression_text(node.left), expression_text(node.right)
    if node.operation == "/":
        return (
            f"for the inverse transformation write `{left_text} * INV({other})`"
            if right in _TRANSFORMATIONS and left is not ExpressionType.SCALAR
            else ""
        )
    match left, right:
        case ExpressionType.FRAME, ExpressionType.FRAME:
            return f"for the transformation from {left_text} to {other} write `INV({left_text}) * {other}`"
        case ((ExpressionType.TRANS | ExpressionType.MATRIX), ExpressionType.FRAME):
            return f"write the transformation after the pose to which it applies: `{other} * {left_text}`"
        case (ExpressionType.INVERSE, _) | (_, ExpressionType.INVERSE):
            return "INV of a FRAME goes in front of another FRAME, such as `INV(f) * g`"
        case (ExpressionType.SCALAR, _) | (_, ExpressionType.SCALAR):
            return "a transformation is made from numbers by XYZ, ROTX, ROTY and ROTZ"
        case _:
            return ""
