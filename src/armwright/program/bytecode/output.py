"""Code of PRINT."""

from armwright.program.bytecode.context import Context, Generators
from armwright.program.bytecode.instructions import Op, Text
from armwright.program.syntax import tree


def print_(context: Context, node: tree.Print) -> None:
    """Generate one PRINT."""
    items = [Text(item.value) if isinstance(item, tree.String) else context.out.value(item) for item in node.items]
    context.out.emit(Op.PRINT, *items, span=node.span)


GENERATORS: Generators = {tree.Print: print_}
