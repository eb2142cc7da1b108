"""Types of expressions, those of variables among them, and how a message names a type or an expression."""

import enum

from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.words import COMPARISONS, PRECEDENCE, PRECEDENCE_OF_NOT
from armwright.program.syntax import tree

# A longer expression is not repeated in a message, which marks it in the text anyway.
_MAX_SHOWN_LENGTH = 32
# In advice it is repeated up to here.
_MAX_WRITTEN_LENGTH = 100
# A minus in front binds tighter than all operations, and what is no operation tighter still.
_MINUS, _ATOM = 7, 8


class ExpressionType(enum.Enum):
    """The type of the value of an expression.

    ``MATRIX`` is twelve numbers that may be a FRAME or a TRANS, ``INVERSE`` what INV makes of a FRAME: the step
    from it back to the world, which makes sense in front of another FRAME only.
    """

    SCALAR = "a SCALAR"
    TRANS = "a TRANS"
    FRAME = "a FRAME"
    EVENT = "an EVENT"
    CONDITION = "a condition"
    TEXT = "a TEXT"
    MATRIX = "a matrix"
    INVERSE = "the inverse of a FRAME"


# The kinds of variables as types.
TYPE_OF_KIND = {
    kind: ExpressionType.CONDITION if kind is VariableKind.BOOLEAN else ExpressionType[kind.name]
    for kind in VariableKind
}
KIND_OF_TYPE = {expression_type: kind for kind, expression_type in TYPE_OF_KIND.items()}
# What each kind of variable, parameter or operand takes.
ACCEPTED_TYPES = {expression_type: frozenset({expression_type}) for expression_type in ExpressionType} | {
    ExpressionType.FRAME: frozenset({ExpressionType.FRAME, ExpressionType.MATRIX}),
    ExpressionType.TRANS: frozenset({ExpressionType.TRANS, ExpressionType.MATRIX}),
}


def type_texts(node: tree.Expression, expression_type: ExpressionType) -> tuple[str, str]:
    """Return how a message and its label name the type of an expression: ``a FRAME`` and ``FRAME``, or ``an arm``."""
    names = {tree.ArmName: "an arm", tree.Number: "a number", tree.String: "a text"}
    phrase = names.get(type(node), expression_type.value)
    last = phrase.split(" ", 1)[1]
    return phrase, last if last.isupper() else phrase


def variable_phrase(expression_type: ExpressionType) -> str:
    """Return what a message calls a variable that holds values of a type: ``a BOOLEAN`` holds conditions."""
    return f"a {VariableKind.BOOLEAN}" if expression_type is ExpressionType.CONDITION else expression_type.value


def declared_type_phrase(kind: VariableType) -> str:
    """Return a type with its article, such as ``an ARRAY [2,3] OF FRAME``."""
    return f"{'an' if kind.sizes or kind.kind is VariableKind.EVENT else 'a'} {kind}"


def variable_keys(node: tree.Expression) -> tuple[str, ...]:
    """Return the key of a plain name; nothing for any other expression."""
    return (node.key,) if isinstance(node, tree.Name) else ()


def quote_expression(node: tree.Expression) -> str:
    """Return how a message calls an expression: as it is written, when it is short."""
    if isinstance(node, tree.Matrix):
        return "this"
    text = expression_text(node)
    return f"`{text}`" if len(text) <= _MAX_SHOWN_LENGTH else "this"


def expression_text(node: tree.Expression) -> str:
    """Return an expression as one would write it, with no more parentheses than it takes; of a long one the start."""
    text = _text_and_precedence(node)[0]
    return text if len(text) <= _MAX_WRITTEN_LENGTH else f"{text[:_MAX_WRITTEN_LENGTH].rpartition(' ')[0]} ..."


def _text_and_precedence(node: tree.Expression) -> tuple[str, int]:
    """Return the text and how tightly its outermost operation binds."""
    match node:
        case tree.Unary(operation=operation, operand=operand):
            strength, gap = (PRECEDENCE_OF_NOT, " ") if operation == "NOT" else (_MINUS, "")
            return f"{operation}{gap}{_operand_text(operand, strength)}", strength
        case tree.Binary():
            first, chain = tree.operation_chain(node)
            text, own = _text_and_precedence(first)
            for link in chain:
                strength = PRECEDENCE[link.operation]
                left_text = text if own >= strength + (link.operation in COMPARISONS) else f"({text})"
                text, own = f"{left_text} {link.operation} {_operand_text(link.right, strength + 1)}", strength
            return text, own
        case tree.Name(text=text) | tree.ArmName(text=text) | tree.Number(text=text):
            pass
        case tree.String(value=value):
            text = f'"{value}"'
        case tree.Index(name=name, indices=items):
            text = f"{name.text}[{','.join(map(expression_text, items))}]"
        case tree.Function(name=name, arguments=items):
            text = f"{name.text}({', '.join(map(expression_text, items))})"
        case tree.Matrix(items=items):
            text = f"({', '.join(map(expression_text, items))})"
        case _:
            text = "..."
    return text, _ATOM


def _operand_text(node: tree.Expression, strength: int) -> str:
    text, own = _text_and_precedence(node)
    return text if own >= strength else f"({text})"
