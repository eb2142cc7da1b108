"""Literal numbers: units of the dimension that is required, and values in range."""

from armwright.program.language.units import Dimension, dimension
from armwright.program.semantics.scopes import NameResolver
from armwright.program.syntax import tree

_DIMENSION_PHRASES: dict[Dimension, str] = {
    "length": "a length",
    "angle": "an angle",
    "time": "a time",
    "force": "a force",
}


def check_unit(names: NameResolver, node: tree.Expression, expected: Dimension | None, what: str) -> bool:
    """Report a number with a unit of another dimension than is required; return whether the expression is right.

    Args:
        names: the names, and where errors are reported.
        node: any expression; only literal numbers are checked.
        expected: what it has to measure; None for a pure number.
        what: the first half of the message, such as ``XYZ takes three lengths``.
    """
    if not isinstance(node, tree.Number) or node.unit is None or dimension(node.unit) == expected:
        return True
    is_what = _DIMENSION_PHRASES[dimension(node.unit)]
    names.report("E224", f"{what}, but `{node.text}` is {is_what}", node.span, is_what)
    return False


def check_range(names: NameResolver, node: tree.Expression, what: str, *, zero: bool) -> None:
    """Report a number that is negative, or zero where that has no meaning either.

    Args:
        names: the names, and where errors are reported.
        node: any expression; only literal numbers are checked.
        what: the quantity, such as ``a duration``.
        zero: whether it may be zero.
    """
    # A number that was reported before is NaN, and neither positive nor negative.
    if isinstance(node, tree.Number) and (node.value < 0 or (node.value == 0 and not zero)):
        above = "may not be negative" if zero else "must be greater than zero"
        names.report("E231", f"{what} {above}, but this is {node.text}", node.span, "out of range")
