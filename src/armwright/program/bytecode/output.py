"""Code of PRINT and LOG."""

from armwright.files.csv_text import csv_line
from armwright.program.bytecode.context import Context, Generators
from armwright.program.bytecode.instructions import Op, Text
from armwright.program.syntax import tree


def print_(context: Context, node: tree.Print) -> None:
    """Generate one PRINT."""
    context.out.emit(Op.PRINT, *map(context.out.value, node.items), span=node.span)


def log(context: Context, node: tree.Log) -> None:
    """Generate one LOG: its name, the titles of its columns as the program writes them, and the values."""
    titles = Text(csv_line(context.text(item) for item in node.items))
    context.out.emit(Op.LOG, Text(node.name.value), titles, *map(context.out.value, node.items), span=node.span)


GENERATORS: Generators = {tree.Print: print_, tree.Log: log}
