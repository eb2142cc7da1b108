"""Aliases: two names of one variable in a procedure, of which it may change one, are refused."""

from itertools import combinations

import attrs

from armwright.program.language.diagnostic import labels
from armwright.program.language.kinds import BY_VALUE
from armwright.program.language.names import array_name
from armwright.program.semantics.expression_types import quote_expression
from armwright.program.semantics.scopes import NameResolver
from armwright.program.semantics.symbols import ProcedureSymbols
from armwright.program.syntax import tree

_NOTE = "an INOUT parameter is another name of the variable that is given for it"


@attrs.frozen
class _Passed:
    """A variable that is passed by reference: for an INOUT parameter or another one."""

    parameter: str
    name: str
    argument: tree.Expression


class AliasChecker:
    """The INOUT arguments of a program so far."""

    def __init__(self, names: NameResolver) -> None:
        """Start without calls."""
        self._names = names
        self._globals: list[tuple[ProcedureSymbols, _Passed]] = []

    def check(self, node: tree.Call, procedure: ProcedureSymbols) -> None:
        """Report a variable that is given for two parameters of which one is INOUT."""
        pairs = zip(procedure.parameters, node.arguments, strict=False)
        passed = [found for pair in pairs if (found := self._passed(procedure, *pair)) is not None]
        for first, second in combinations(passed, 2):
            is_inout = {first.parameter, second.parameter} & procedure.inout
            if is_inout and _may_be_same(first.name, second.name):
                what = quote_expression(second.argument)
                certain = first.name == second.name and not first.name.endswith("[]")
                twice = "is" if certain else "may be"
                text = f"{what} {twice} passed twice to `{node.name.text}`, which may change it"
                here = labels(first.argument.span, "passed here too")
                advice = "pass a copy of it for the parameter that is only read"
                self._names.report(
                    "E233", text, second.argument.span, "an alias", secondary=here, note=_NOTE, advice=advice
                )
        for one in passed:
            if one.parameter in procedure.inout and not self._names.scope.is_local(array_name(one.name)):
                self._globals.append((procedure, one))

    def _passed(self, procedure: ProcedureSymbols, parameter: str, argument: tree.Expression) -> _Passed | None:
        kind = procedure.types.get(parameter)
        if kind is None or (kind.kind in BY_VALUE and not kind.sizes and parameter not in procedure.inout):
            return None
        if isinstance(argument, tree.Name):
            return _Passed(parameter, argument.key, argument)
        if not isinstance(argument, tree.Index):
            return None
        indices = [f"{index.value:g}" for index in argument.indices if isinstance(index, tree.Number)]
        which = ",".join(indices) if len(indices) == len(argument.indices) else ""
        return _Passed(parameter, f"{argument.name.key}[{which}]", argument)

    def report_globals(self) -> None:
        """Report variables of the program that are given for an INOUT parameter of a procedure that also uses them."""
        procedures = self._names.symbols.procedures
        used = {key: _used_names(procedure) for key, procedure in procedures.items()}
        reached: dict[str, set[str]] = {}
        for procedure, one in self._globals:
            key = procedure.node.name.key
            if key not in reached:
                reached[key] = _reachable(key, used)
            if array_name(one.name) in reached[key]:
                what = quote_expression(one.argument)
                text = f"{what} is passed to `{procedure.node.name.text}`, which uses it also by its own name"
                advice = "use the parameter alone in the procedure"
                here = labels(procedure.node.head, "declared here")
                self._names.report(
                    "E233", text, one.argument.span, "an alias", secondary=here, note=_NOTE, advice=advice
                )


def _may_be_same(name: str, other: str) -> bool:
    """Whether two names may be of one variable, or of an array and an element of it."""
    if array_name(name) != array_name(other):
        return False
    return name == other or name.endswith("[]") or other.endswith("[]") or ("[" in name) is not ("[" in other)


def _used_names(procedure: ProcedureSymbols) -> set[str]:
    """Return the names that a procedure uses and that are not its own, those of procedures among them."""
    names = (node.key for node in tree.walk(procedure.node.body) if isinstance(node, tree.Name))
    return {key for key in names if key not in procedure.types}


def _reachable(key: str, used: dict[str, set[str]]) -> set[str]:
    """Return the names that a procedure uses, or one that it calls."""
    reached, waiting = set(used[key]), list(used[key])
    while waiting:
        for name in used.get(waiting.pop(), ()):
            if name not in reached:
                reached.add(name)
                waiting.append(name)
    return reached
