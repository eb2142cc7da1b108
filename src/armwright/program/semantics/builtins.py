"""The functions of the language: what they take and what they give."""

from collections.abc import Mapping, Sequence

import attrs

from armwright.program.language.units import Dimension
from armwright.program.semantics import events
from armwright.program.semantics.expression_types import FITTING, ExpressionType, bare, called, is_what, plain_keys
from armwright.program.semantics.quantities import measure
from armwright.program.semantics.scopes import Names
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

    takes: str
    count: int
    sorts: frozenset[ExpressionType]
    gives: ExpressionType
    dimension: Dimension | None = None


_SCALARS = FITTING[ExpressionType.SCALAR]
_TURN = Signature(takes="one angle", count=1, sorts=_SCALARS, gives=ExpressionType.TRANS, dimension="angle")
FUNCTIONS: Mapping[str, Signature] = {
    "XYZ": Signature(takes="three lengths", count=3, sorts=_SCALARS, gives=ExpressionType.TRANS, dimension="length"),
    "ROTX": _TURN,
    "ROTY": _TURN,
    "ROTZ": _TURN,
    "INV": Signature(
        takes="one TRANS or FRAME",
        count=1,
        sorts=FITTING[ExpressionType.TRANS] | {ExpressionType.FRAME, ExpressionType.INVERSE},
        gives=ExpressionType.TRANS,
    ),
    "DIST": Signature(takes="two FRAMEs", count=2, sorts=FITTING[ExpressionType.FRAME], gives=ExpressionType.SCALAR),
    "FORCE": Signature(takes="one axis, X, Y or Z", count=1, sorts=frozenset(), gives=ExpressionType.SCALAR),
}
_INVERSES = {ExpressionType.FRAME: ExpressionType.INVERSE, ExpressionType.INVERSE: ExpressionType.FRAME}


def result(names: Names, node: tree.Function, sorts: Sequence[ExpressionType | None]) -> ExpressionType | None:
    """Return what a function of the language gives; say what is wrong with its arguments.

    Args:
        names: for what is found.
        node: a call of one of ``FUNCTIONS``.
        sorts: of the arguments; not asked for where the argument is an axis.
    """
    signature = FUNCTIONS[node.name.key]
    if len(node.arguments) != signature.count:
        plural = "s" * (len(node.arguments) != 1)
        text = f"{node.name.key} takes {signature.takes}, not {len(node.arguments)} argument{plural}"
        names.report("E220", text, node.span, f"{len(node.arguments)} argument{plural} here")
        return signature.gives if node.name.key != "INV" else None
    if node.name.key == "FORCE":
        _axis(names, node.arguments[0])
        return signature.gives
    for argument, sort in zip(node.arguments, sorts, strict=True):
        if sort is None:
            continue
        if sort not in signature.sorts:
            _misfit(names, node, argument, sort)
        elif signature.dimension is not None:
            measure(names, argument, signature.dimension, f"{node.name.key} takes {signature.takes}")
    if node.name.key != "INV":
        return signature.gives
    return None if sorts[0] not in signature.sorts else _INVERSES.get(sorts[0], sorts[0])


def _axis(names: Names, node: tree.Expression) -> None:
    if isinstance(node, tree.Poison) or (isinstance(node, tree.Name) and node.key in AXES):
        return
    names.use(plain_keys(node))
    names.report(
        "E220", f"FORCE takes one axis, X, Y or Z, not {called(node)}", node.span, "no axis", advice="write `FORCE(Z)`"
    )


def _misfit(names: Names, node: tree.Function, argument: tree.Expression, sort: ExpressionType) -> None:
    if sort is ExpressionType.EVENT:
        events.refuse(names, argument)
        return
    what, takes = is_what(argument, sort), FUNCTIONS[node.name.key].takes
    text = f"{node.name.key} takes {takes}, but {called(argument)} is {what}"
    names.report("E220", text, argument.span, bare(what), secondary=names.where_declared(*plain_keys(argument)))
