"""Arrays and their elements: an index for each dimension, an integer within the size of the array."""

from collections.abc import Sequence

from armwright.program.language.kinds import VariableType
from armwright.program.semantics.expression_types import TYPE_OF_KIND, ExpressionType
from armwright.program.semantics.quantities import check_unit
from armwright.program.semantics.scopes import NameResolver
from armwright.program.syntax import tree


def variable_type(names: NameResolver, name: tree.Name, kind: VariableType) -> ExpressionType | None:
    """Return the type of a variable named without an index; report an array once."""
    if not kind.sizes:
        return TYPE_OF_KIND[kind.kind]
    text = f"`{name.text}` is an {kind} and needs an index"
    advice = f"write `{name.text}[{','.join('1' * len(kind.sizes))}]` for the first element"
    names.report_once("E222", text, name.span, "which element?", [name.key], advice=advice)
    return None


def element_type(
    names: NameResolver, node: tree.Index, index_types: Sequence[ExpressionType | None]
) -> ExpressionType | None:
    """Return the type of an element, and report what is wrong with its indices.

    Args:
        names: the names, and where errors are reported.
        node: the element.
        index_types: types of its indices.
    """
    name = node.name
    kind = names.type(name)
    if kind is None:
        return None
    if not kind.sizes:
        text = f"`{name.text}` is {TYPE_OF_KIND[kind.kind].value} and has no index"
        advice = f"write `{name.text}` alone, or declare it as an ARRAY"
        names.report_once("E222", text, node.span, "no array", [name.key], advice=advice)
        return None
    if len(node.indices) != len(kind.sizes):
        text = f"`{name.text}` has {_index_count_text(len(kind.sizes))}, not {len(node.indices)}"
        label, here = f"{_index_count_text(len(node.indices))} here", names.declaration_labels(name.key)
        names.report("E222", text, node.span, label, secondary=here, note=f"it is an {kind}")
        return TYPE_OF_KIND[kind.kind]
    for index, index_type, size in zip(node.indices, index_types, kind.sizes, strict=True):
        _check_index(names, name, index, index_type, size)
    return TYPE_OF_KIND[kind.kind]


def _index_count_text(count: int) -> str:
    return f"{count} {'indices' if count > 1 else 'index'}"


def _check_index(
    names: NameResolver, array: tree.Name, index: tree.Expression, index_type: ExpressionType | None, size: int
) -> None:
    if index_type not in (None, ExpressionType.SCALAR):
        names.report_type("E222", index, index_type, "an index must be a number", secondary=())
    elif isinstance(index, tree.Number) and check_unit(names, index, None, "an index has no unit"):
        value = index.value
        if value < 1 or value > size:
            text = f"index {index.text} is outside 1..{size}"
            names.report("E222", text, index.span, "no such element", secondary=names.declaration_labels(array.key))
        elif value % 1 > 0:
            names.report("E222", f"an index must be an integer, not {index.text}", index.span, "not whole")
