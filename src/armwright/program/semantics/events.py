"""Events: signalled and waited for, and nothing else."""

from armwright.program.semantics.expression_types import called, plain_keys
from armwright.program.semantics.scopes import Names
from armwright.program.syntax import tree

_NOTE = "an EVENT counts signals; SIGNAL adds one, WAIT takes one"


def refuse(names: Names, node: tree.Expression, what: str = "computed with") -> None:
    """Say once that an EVENT is no value."""
    keys = plain_keys(node)
    if names.first("E223", *keys):
        text = f"{called(node)} is an EVENT and cannot be {what}"
        names.report("E223", text, node.span, "EVENT", secondary=names.where_declared(*keys), note=_NOTE)
