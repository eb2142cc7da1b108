"""What a FUNCTION may be made of: it works out a value and does no more."""

import re
from collections.abc import Iterator
from typing import get_args

from armwright.program.language.diagnostic import labels
from armwright.program.language.kinds import BY_VALUE, VariableKind
from armwright.program.semantics.expression_types import declared_type_phrase, expression_text
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.symbols import ProcedureSymbols
from armwright.program.syntax import tree

_PURE = "a FUNCTION works out a value from its arguments and the variables of the program, and changes nothing else"
_STATEMENTS = get_args(tree.Statement)


def check_function(names: NameResolver, procedure: ProcedureSymbols) -> None:
    """Check that a FUNCTION does nothing but work out a value; its names are looked up already."""
    node = procedure.node
    _check_head(names, procedure)
    for statement in _statements(node.body):
        if not isinstance(statement, tree.FUNCTION_STATEMENTS):
            word = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", type(statement).__name__).upper()
            word = f"the call of `{statement.name.text}`" if isinstance(statement, tree.Call) else word
            advice = "write a PROCEDURE, which may give results in INOUT parameters"
            text = f"{word} cannot stand in a FUNCTION"
            names.report("E232", text, statement.span, "this does more than compute", note=_PURE, advice=advice)
        elif isinstance(statement, tree.Assign | tree.For):
            target = statement.target if isinstance(statement, tree.Assign) else statement.variable
            _check_target(names, procedure, target)


def _check_head(names: NameResolver, procedure: ProcedureSymbols) -> None:
    node, result = procedure.node, procedure.result
    assert node.result is not None  # noqa: S101 - it is a FUNCTION
    if result is not None and (result.sizes or result.kind is VariableKind.EVENT):
        text = f"the value of a FUNCTION cannot be {declared_type_phrase(result)}"
        advice = "let a PROCEDURE set an INOUT parameter of this type"
        names.report("E232", text, node.result.span, "no value", advice=advice)
    for declaration in node.parameters:
        if declaration.mode == "INOUT":
            text, label = "a FUNCTION has no INOUT parameters", "INOUT"
            names.report("E232", text, declaration.span, label, note=_PURE, advice="write a PROCEDURE")
    for declaration in node.declarations:
        kind = procedure.types.get(declaration.names[0].key) if declaration.names else None
        if kind is not None and kind.kind not in BY_VALUE:
            text = f"a FUNCTION has no {kind.kind}s of its own"
            advice = "compute with a TRANS, such as `INV(WORLD) * f`" if kind.kind is VariableKind.FRAME else ""
            names.report("E232", text, declaration.span, str(kind), note=_PURE, advice=advice)


def _statements(body: tree.Block) -> Iterator[tree.Statement]:
    """Give the statements of a FUNCTION, those inside of what does not belong there left out."""
    waiting: list[tree.Statement] = [*reversed(body.statements)]
    while waiting:
        statement = waiting.pop()
        yield statement
        if isinstance(statement, tree.FUNCTION_STATEMENTS):
            inner = (part for part in tree.child_nodes(statement) if isinstance(part, _STATEMENTS))
            waiting += reversed([*inner])


def _check_target(names: NameResolver, procedure: ProcedureSymbols, target: tree.Expression) -> None:
    """Check that a FUNCTION gives a value only to what is its own."""
    name = target.name if isinstance(target, tree.Index) else target
    if not isinstance(name, tree.Name):
        return
    kind = procedure.types.get(name.key)
    own = name.key in procedure.types
    if own and (kind is None or (kind.kind in BY_VALUE and not (kind.sizes and name.key in procedure.parameters))):
        return
    where = "a parameter that belongs to the caller" if own else "a variable of the program"
    text = f"a FUNCTION cannot change `{expression_text(target)}`, {where}"
    here = labels(declared.span, "declared here") if (declared := names.scope.declared(name.key)) else ()
    names.report("E232", text, target.span, "changed here", secondary=here, note=_PURE)
