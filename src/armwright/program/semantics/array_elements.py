"""Arrays and their elements: indices where they belong, as many as there are, and inside the array."""

from collections.abc import Sequence

from armwright.program.language.kinds import VariableType
from armwright.program.semantics.expression_types import (
    TYPE_OF_KIND,
    ExpressionType,
    quote_expression,
    type_phrase,
    without_article,
)
from armwright.program.semantics.quantities import check_unit
from armwright.program.semantics.scopes import NameResolver
from armwright.program.syntax import tree


def variable_type(names: NameResolver, name: tree.Name, kind: VariableType) -> ExpressionType | None:
    """Return the sort of a variable named without an index; say once when it is an array."""
    if not kind.sizes:
        return TYPE_OF_KIND[kind.kind]
    if names.is_first_report("E222", name.key):
        first = ",".join("1" * len(kind.sizes))
        text = f"`{name.text}` is an {kind} and needs an index"
        advice = f"write `{name.text}[{first}]` for the first element"
        names.report(
            "E222", text, name.span, "which element?", secondary=names.declaration_labels(name.key), advice=advice
        )
    return None


def element_type(
    names: NameResolver, node: tree.Index, argument_types: Sequence[ExpressionType | None]
) -> ExpressionType | None:
    """Return the type of an element, and report what is wrong with its indices.

    Args:
        names: for what is found.
        node: the element.
        argument_types: types of its indices.
    """
    name = node.name
    kind = names.type(name)
    if kind is None:
        return None
    if not kind.sizes:
        what = TYPE_OF_KIND[kind.kind].value
        if names.is_first_report("E222", name.key):
            text = f"`{name.text}` is {what} and has no index"
            advice = f"write `{name.text}` alone, or declare it as an ARRAY"
            names.report(
                "E222", text, node.span, "no array", secondary=names.declaration_labels(name.key), advice=advice
            )
        return None
    if len(node.indices) != len(kind.sizes):
        text = f"`{name.text}` has {_index_count_text(len(kind.sizes))}, not {len(node.indices)}"
        label, here = f"{_index_count_text(len(node.indices))} here", names.declaration_labels(name.key)
        names.report("E222", text, node.span, label, secondary=here, note=f"it is an {kind}")
        return TYPE_OF_KIND[kind.kind]
    for index, argument_type, size in zip(node.indices, argument_types, kind.sizes, strict=True):
        _check_index(names, name, index, argument_type, size)
    return TYPE_OF_KIND[kind.kind]


def _index_count_text(count: int) -> str:
    return f"{count} {'indices' if count > 1 else 'index'}"


def _check_index(
    names: NameResolver, name: tree.Name, index: tree.Expression, argument_type: ExpressionType | None, size: int
) -> None:
    if argument_type not in (None, ExpressionType.SCALAR):
        what = type_phrase(index, argument_type)
        text = f"an index must be a number, but {quote_expression(index)} is {what}"
        names.report("E222", text, index.span, without_article(what))
    elif isinstance(index, tree.Number) and check_unit(names, index, None, "an index has no unit"):
        value = index.value
        if value < 1 or value > size:
            text = f"index {index.text} is outside 1..{size}"
            names.report("E222", text, index.span, "no such element", secondary=names.declaration_labels(name.key))
        elif value % 1 > 0:
            names.report("E222", f"an index must be an integer, not {index.text}", index.span, "not whole")
