"""PRINT."""

from armwright.program.semantics.context import Checks, Context
from armwright.program.semantics.expression_types import ExpressionType
from armwright.program.semantics.type_check import infer_type
from armwright.program.syntax import tree


def print_(context: Context, node: tree.Print) -> None:
    """Check what is printed: anything but an EVENT."""
    for item in node.items:
        if infer_type(context.names, item) is ExpressionType.EVENT:
            context.names.report_event(item, "printed")


CHECKS: Checks = {tree.Print: print_}
