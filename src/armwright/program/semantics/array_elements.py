"""Arrays and their elements: indices where they belong, as many as there are, and inside the array."""

from collections.abc import Sequence

from armwright.program.language.kinds import VariableType
from armwright.program.semantics.expression_types import OF_KIND, ExpressionType, bare, called, is_what
from armwright.program.semantics.quantities import measure
from armwright.program.semantics.scopes import Names
from armwright.program.syntax import tree


def single(names: Names, name: tree.Name, kind: VariableType) -> ExpressionType | None:
    """Return the sort of a variable named without an index; say once when it is an array."""
    if not kind.sizes:
        return OF_KIND[kind.kind]
    if names.first("E222", name.key):
        first = ",".join("1" * len(kind.sizes))
        text = f"`{name.text}` is an {kind} and needs an index"
        advice = f"write `{name.text}[{first}]` for the first element"
        names.report("E222", text, name.span, "which element?", secondary=names.where_declared(name.key), advice=advice)
    return None


def element(names: Names, node: tree.Index, sorts: Sequence[ExpressionType | None]) -> ExpressionType | None:
    """Return the sort of an element; say what is wrong with its indices.

    Args:
        names: for what is found.
        node: the element.
        sorts: of its indices.
    """
    name = node.name
    kind = names.type(name)
    if kind is None:
        return None
    if not kind.sizes:
        what = OF_KIND[kind.kind].value
        if names.first("E222", name.key):
            text = f"`{name.text}` is {what} and has no index"
            advice = f"write `{name.text}` alone, or declare it as an ARRAY"
            names.report("E222", text, node.span, "no array", secondary=names.where_declared(name.key), advice=advice)
        return None
    if len(node.indices) != len(kind.sizes):
        text = f"`{name.text}` has {_indices(len(kind.sizes))}, not {len(node.indices)}"
        label, here = f"{_indices(len(node.indices))} here", names.where_declared(name.key)
        names.report("E222", text, node.span, label, secondary=here, note=f"it is an {kind}")
        return OF_KIND[kind.kind]
    for index, sort, size in zip(node.indices, sorts, kind.sizes, strict=True):
        _index(names, name, index, sort, size)
    return OF_KIND[kind.kind]


def _indices(count: int) -> str:
    return f"{count} {'indices' if count > 1 else 'index'}"


def _index(names: Names, name: tree.Name, index: tree.Expression, sort: ExpressionType | None, size: int) -> None:
    if sort not in (None, ExpressionType.SCALAR):
        what = is_what(index, sort)
        text = f"an index must be a number, but {called(index)} is {what}"
        names.report("E222", text, index.span, bare(what))
    elif isinstance(index, tree.Number) and measure(names, index, None, "an index has no unit"):
        value = index.value
        if value < 1 or value > size:
            text = f"index {index.text} is outside 1..{size}"
            names.report("E222", text, index.span, "no such element", secondary=names.where_declared(name.key))
        elif value % 1 > 0:
            names.report("E222", f"an index must be an integer, not {index.text}", index.span, "not whole")
