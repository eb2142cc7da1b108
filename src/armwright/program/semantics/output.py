"""PRINT and LOG."""

from armwright.errors import counted
from armwright.program.language.diagnostic import labels
from armwright.program.language.names import LOG_NAME
from armwright.program.semantics.context import Checks, Context
from armwright.program.semantics.expression_types import ExpressionType, expression_text
from armwright.program.semantics.type_check import infer_type
from armwright.program.syntax import tree

_COLUMNS = frozenset((ExpressionType.SCALAR, ExpressionType.CONDITION, ExpressionType.TEXT))


def print_(context: Context, node: tree.Print) -> None:
    """Check what is printed: anything but an EVENT."""
    for item in node.items:
        if infer_type(context.names, item) is ExpressionType.EVENT:
            context.names.report_event(item, "printed")


def log(context: Context, node: tree.Log) -> None:
    """Check the name of a log, that it has the same columns everywhere, and its values."""
    names, name = context.names, node.name
    if not LOG_NAME.fullmatch(name.value):
        text, note = f'"{name.value}" cannot be the name of a log', "the rows are written to the file log-NAME.csv"
        advice = "write up to 41 letters, digits, `_` and `-`, a letter first"
        names.report("E235", text, name.span, "not a name", note=note, advice=advice)
    first = names.logs.setdefault(name.value.lower(), node)
    if len(first.items) != len(node.items):
        columns = counted(len(first.items), "column")
        text = f'log "{name.value}" has {columns}, not {len(node.items)}'
        here = labels(first.span, "first written here")
        advice = "give the other rows a log of their own"
        names.report("E235", text, node.span, counted(len(node.items), "value"), secondary=here, advice=advice)
    for item in node.items:
        actual = infer_type(names, item)
        if actual is ExpressionType.EVENT:
            names.report_event(item, "logged")
        elif actual is not None and actual not in _COLUMNS:
            written = expression_text(item)
            advice = f"write its numbers: `X({written}), Y({written}), Z({written})`"
            names.report_type("E216", item, actual, "LOG writes numbers, conditions and texts", advice=advice)


CHECKS: Checks = {tree.Print: print_, tree.Log: log}
