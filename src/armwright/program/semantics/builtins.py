"""The functions of the language: what they take and what they give."""

from collections.abc import Mapping, Sequence

import attrs

from armwright.program.language.units import Dimension
from armwright.program.semantics import events
from armwright.program.semantics.expression_types import (
    ACCEPTED_TYPES,
    ExpressionType,
    quote_expression,
    type_phrase,
    variable_keys,
    without_article,
)
from armwright.program.semantics.quantities import check_unit
from armwright.program.semantics.scopes import NameResolver
from armwright.program.syntax import tree

AXES = ("X", "Y", "Z")


@attrs.frozen(kw_only=True)
class Signature:
    """What a function takes and gives.

    Attributes:
        takes: the arguments, as a message says it.
        count: how many.
        sorts: what each argument may be.
        gives: the sort of the value; of INV it depends on the argument.
        dimension: what a number with a unit must measure.
    """

    parameters: str
    count: int
    argument_types: frozenset[ExpressionType]
    result: ExpressionType
    dimension: Dimension | None = None


_SCALARS = ACCEPTED_TYPES[ExpressionType.SCALAR]
_ROTATION = Signature(
    parameters="one angle", count=1, argument_types=_SCALARS, result=ExpressionType.TRANS, dimension="angle"
)
FUNCTIONS: Mapping[str, Signature] = {
    "XYZ": Signature(
        parameters="three lengths", count=3, argument_types=_SCALARS, result=ExpressionType.TRANS, dimension="length"
    ),
    "ROTX": _ROTATION,
    "ROTY": _ROTATION,
    "ROTZ": _ROTATION,
    "INV": Signature(
        parameters="one TRANS or FRAME",
        count=1,
        argument_types=ACCEPTED_TYPES[ExpressionType.TRANS] | {ExpressionType.FRAME, ExpressionType.INVERSE},
        result=ExpressionType.TRANS,
    ),
    "DIST": Signature(
        parameters="two FRAMEs",
        count=2,
        argument_types=ACCEPTED_TYPES[ExpressionType.FRAME],
        result=ExpressionType.SCALAR,
    ),
    "FORCE": Signature(
        parameters="one axis, X, Y or Z", count=1, argument_types=frozenset(), result=ExpressionType.SCALAR
    ),
}
_INVERSES = {ExpressionType.FRAME: ExpressionType.INVERSE, ExpressionType.INVERSE: ExpressionType.FRAME}


def result_type(
    names: NameResolver, node: tree.Function, argument_types: Sequence[ExpressionType | None]
) -> ExpressionType | None:
    """Return the type of the result of a built-in function, and report what is wrong with its arguments.

    Args:
        names: for what is found.
        node: a call of one of ``FUNCTIONS``.
        argument_types: types of the arguments; not used where the argument is an axis.
    """
    signature = FUNCTIONS[node.name.key]
    if len(node.arguments) != signature.count:
        plural = "s" * (len(node.arguments) != 1)
        text = f"{node.name.key} takes {signature.parameters}, not {len(node.arguments)} argument{plural}"
        names.report("E220", text, node.span, f"{len(node.arguments)} argument{plural} here")
        return signature.result if node.name.key != "INV" else None
    if node.name.key == "FORCE":
        _check_axis(names, node.arguments[0])
        return signature.result
    for argument, argument_type in zip(node.arguments, argument_types, strict=True):
        if argument_type is None:
            continue
        if argument_type not in signature.argument_types:
            _report_wrong_argument(names, node, argument, argument_type)
        elif signature.dimension is not None:
            check_unit(names, argument, signature.dimension, f"{node.name.key} takes {signature.parameters}")
    if node.name.key != "INV":
        return signature.result
    return (
        None
        if argument_types[0] not in signature.argument_types
        else _INVERSES.get(argument_types[0], argument_types[0])
    )


def _check_axis(names: NameResolver, node: tree.Expression) -> None:
    if isinstance(node, tree.Poison) or (isinstance(node, tree.Name) and node.key in AXES):
        return
    names.mark_used(variable_keys(node))
    names.report(
        "E220",
        f"FORCE takes one axis, X, Y or Z, not {quote_expression(node)}",
        node.span,
        "no axis",
        advice="write `FORCE(Z)`",
    )


def _report_wrong_argument(
    names: NameResolver, node: tree.Function, argument: tree.Expression, argument_type: ExpressionType
) -> None:
    if argument_type is ExpressionType.EVENT:
        events.report_event_as_value(names, argument)
        return
    what, takes = type_phrase(argument, argument_type), FUNCTIONS[node.name.key].parameters
    text = f"{node.name.key} takes {takes}, but {quote_expression(argument)} is {what}"
    names.report(
        "E220", text, argument.span, without_article(what), secondary=names.declaration_labels(*variable_keys(argument))
    )
