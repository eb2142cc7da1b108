"""Events: signalled and waited for, and nothing else."""

from armwright.program.semantics.expression_types import quote_expression, variable_keys
from armwright.program.semantics.scopes import NameResolver
from armwright.program.syntax import tree

_NOTE = "an EVENT counts signals; SIGNAL adds one, WAIT takes one"


def report_event_as_value(names: NameResolver, node: tree.Expression, what: str = "computed with") -> None:
    """Say once that an EVENT is no value."""
    keys = variable_keys(node)
    if names.is_first_report("E223", *keys):
        text = f"{quote_expression(node)} is an EVENT and cannot be {what}"
        names.report("E223", text, node.span, "EVENT", secondary=names.declaration_labels(*keys), note=_NOTE)
