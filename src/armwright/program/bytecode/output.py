"""Code of PRINT."""

from armwright.program.bytecode.context import Context, Generators
from armwright.program.bytecode.instructions import Op
from armwright.program.syntax import tree


def print_(context: Context, node: tree.Print) -> None:
    """Generate one PRINT."""
    context.out.emit(Op.PRINT, *map(context.out.value, node.items), span=node.span)


GENERATORS: Generators = {tree.Print: print_}
