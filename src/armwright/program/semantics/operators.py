"""Types of the results of operators, and advice where an operator does not take its operands."""

from collections.abc import Mapping

from armwright.program.language.words import COMPARISONS
from armwright.program.semantics.expression_types import ExpressionType, expression_text, type_texts, variable_keys
from armwright.program.semantics.scopes import NameResolver
from armwright.program.syntax import tree

_POSES = frozenset((ExpressionType.FRAME, ExpressionType.MATRIX))
_TRANSFORMATIONS = frozenset((ExpressionType.TRANS, ExpressionType.MATRIX))
# A pose or transformation with a transformation behind it stays what it is; from frame to frame leads a transformation.
_PRODUCTS: Mapping[tuple[ExpressionType | None, ExpressionType | None], ExpressionType] = {
    **{(left, right): left for left in _POSES | _TRANSFORMATIONS for right in _TRANSFORMATIONS},
    **{(ExpressionType.INVERSE, right): ExpressionType.TRANS for right in _POSES},
}


def result_type(
    names: NameResolver, node: tree.Binary, left: ExpressionType | None, right: ExpressionType | None
) -> ExpressionType | None:
    """Return the type that an operator other than AND and OR gives; report operands that it does not take."""
    result = _PRODUCTS.get((left, right)) if node.operation == "*" else None
    if left is ExpressionType.SCALAR and right is ExpressionType.SCALAR:
        result = ExpressionType.SCALAR
    elif left is right is ExpressionType.TEXT and node.operation in ("=", "<>"):
        result = ExpressionType.CONDITION
    elif ExpressionType.EVENT in (left, right) and None not in (left, right):
        names.report_event(node.left if left is ExpressionType.EVENT else node.right)
    elif left is not None and right is not None and result is None:
        left_phrase, left_label = type_texts(node.left, left)
        right_phrase, right_label = type_texts(node.right, right)
        message = f"`{node.operation}` has no meaning between {left_phrase} and {right_phrase}"
        label = f"{left_label} {node.operation} {right_label}"
        keys = (*variable_keys(node.left), *variable_keys(node.right))
        names.report_once("E221", message, node.span, label, keys, advice=_operand_advice(node, left, right))
    # A comparison is a condition whatever it compares.
    return ExpressionType.CONDITION if node.operation in COMPARISONS else result


def negated_type(names: NameResolver, node: tree.Unary, operand_type: ExpressionType | None) -> ExpressionType | None:
    """Return the type that a minus in front of an expression gives: only numbers have one."""
    if operand_type is ExpressionType.EVENT:
        names.report_event(node.operand)
    elif operand_type not in (None, ExpressionType.SCALAR):
        (phrase, label), is_pose = type_texts(node.operand, operand_type), operand_type in _POSES | _TRANSFORMATIONS
        advice = f"for the inverse transformation write `INV({expression_text(node.operand)})`" if is_pose else ""
        text, keys = f"`-` takes a number, but this is {phrase}", variable_keys(node.operand)
        names.report_once("E221", text, node.span, label, keys, advice=advice)
    return operand_type if operand_type is ExpressionType.SCALAR else None


def _operand_advice(node: tree.Binary, left: ExpressionType, right: ExpressionType) -> str:
    """Return what was probably meant; empty where that cannot be guessed."""
    if ExpressionType.CONDITION in (left, right):
        return _condition_advice(node)
    left_text, right_text = expression_text(node.left), expression_text(node.right)
    if ExpressionType.TEXT in (left, right) and node.operation == "+":
        return f"texts are joined by TEXT: write `TEXT({left_text}, {right_text})`"
    both_poses, advice = {left, right} <= _POSES, ""
    match node.operation:
        case "*":
            advice = _product_advice(left, right, left_text, right_text)
        case "/" if right in _TRANSFORMATIONS and left is not ExpressionType.SCALAR:
            advice = f"for the inverse transformation write `{left_text} * INV({right_text})`"
        case "+" | "-" as operation if left in _POSES | _TRANSFORMATIONS and right in _TRANSFORMATIONS:
            step = right_text if operation == "+" else f"INV({right_text})"
            advice = f"transformations are composed by `*`: write `{left_text} * {step}`"
        case "-" if both_poses:
            advice = f"for the transformation from {right_text} to {left_text} write `INV({right_text}) * {left_text}`"
        case operation if operation in COMPARISONS and both_poses:
            advice = f"for their distance write `DIST({left_text}, {right_text})`"
    return advice


def _condition_advice(node: tree.Binary) -> str:
    """Return what was probably meant where a condition is computed with: TRUE and FALSE are not compared with."""
    for value, condition in ((node.right, node.left), (node.left, node.right)):
        if node.operation in ("=", "<>") and isinstance(value, tree.Name) and value.key in ("TRUE", "FALSE"):
            holds = (value.key == "TRUE") == (node.operation == "=")
            return f"write `{'' if holds else 'NOT '}{expression_text(condition)}`"
    return "a condition is not a number; combine conditions with AND and OR"


def _product_advice(left: ExpressionType, right: ExpressionType, left_text: str, right_text: str) -> str:
    match left, right:
        case ExpressionType.FRAME, ExpressionType.FRAME:
            return f"for the transformation from {left_text} to {right_text} write `INV({left_text}) * {right_text}`"
        case ((ExpressionType.TRANS | ExpressionType.MATRIX), ExpressionType.FRAME):
            return f"write the transformation after the pose to which it applies: `{right_text} * {left_text}`"
        case (ExpressionType.INVERSE, _) | (_, ExpressionType.INVERSE):
            return "INV of a FRAME goes in front of another FRAME, such as `INV(f) * g`"
        case (ExpressionType.SCALAR, _) | (_, ExpressionType.SCALAR):
            return "a transformation is made from numbers by XYZ, ROTX, ROTY and ROTZ"
        case _:
            return ""
