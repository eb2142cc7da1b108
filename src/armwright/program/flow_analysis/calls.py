"""Calls of procedures in the course of a program: where parameters and own variables are kept."""

from collections.abc import Callable

from armwright.program.flow_analysis import plausibility
from armwright.program.flow_analysis.definite_assignment import need, need_indices
from armwright.program.flow_analysis.lattice import EVERYTHING, Uncertainty
from armwright.program.flow_analysis.state import LAST, Activation, Called, FlowState
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.source import Span
from armwright.program.semantics.symbols import ProcedureSymbols
from armwright.program.syntax import tree

# Calls inside calls that are followed, and statements of procedures that are followed in all.
_MAX_DEPTH, _MAX_STATEMENTS = 6, 20_000
_BY_VALUE = (VariableKind.SCALAR, VariableKind.TRANS)


class Calling:
    """Follows calls, as far as that takes no end."""

    def __init__(self, state: FlowState, follow: Callable[[tuple[tree.Statement, ...]], None]) -> None:
        """Start outside of all procedures.

        Args:
            state: the state.
            follow: follows the statements of a procedure.
        """
        self._state, self._follow = state, follow
        self._count = 0
        self._left = _MAX_STATEMENTS
        # Procedures that are followed at each call, and those of which that is not so.
        self._seen: set[str] = set()
        self._passed_over: set[str] = set()

    def step(self) -> None:
        """Count one statement."""
        if self._state.calls:
            self._left -= 1

    def call(self, node: tree.Call, *, follow: bool) -> None:
        """Follow one call, or forget what it may change."""
        state = self._state
        procedure = state.symbols.procedures.get(node.name.key)
        if procedure is None:
            need(state, *(argument for argument in node.arguments if not isinstance(argument, tree.Name)))
            return
        key = procedure.node.name.key
        self._needs(procedure, node)
        plausibility.lengths(state, *node.arguments)
        deep = len(state.calls) >= _MAX_DEPTH or self._left <= 0 or any(call.name == key for call in state.calls)
        if deep or not follow or len(node.arguments) != len(procedure.parameters):
            self.pass_over(key)
            writes = state.writing.called(node, state.now.scope)
            self._left -= len(writes.names)
            state.forget(writes)
            return
        self._seen.add(key)
        activation = self._activation(procedure, node)
        with state.inside(activation, Called(key, node.name.text, node.span)):
            self._follow(procedure.node.body.statements)
        if not state.over:
            self._leave(procedure, activation)

    def pass_over(self, key: str) -> None:
        """Take note that a procedure is called without being followed."""
        self._passed_over.add(key)

    def others(self) -> None:
        """Follow what was not followed at each call once more, knowing nothing of what it is called with."""
        state = self._state
        done: set[str] = set()
        while waiting := sorted(
            key for key in state.symbols.procedures if key not in done and not self._is_followed(key)
        ):
            for key in waiting:
                done.add(key)
                self._follow_unknown(state.symbols.procedures[key])

    def _is_followed(self, key: str) -> bool:
        return key in self._seen and key not in self._passed_over

    def _follow_unknown(self, procedure: ProcedureSymbols) -> None:
        state, facts = self._state, self._state.facts
        mark = facts.checkpoint()
        facts.wipe(EVERYTHING)
        activation = self._activation(procedure, None)
        own = [
            name for key in procedure.types if (name := activation.bindings[key]) and key not in procedure.parameters
        ]
        # Parameters may be the same frame as another, so that all but own variables may change at any time.
        facts.shaky = (Uncertainty(everything=True, excepted=frozenset((LAST, *own)), places=True, aliases=True),)
        with state.inside(activation):
            self._follow(procedure.node.body.statements)
        facts.shaky, state.over = (), False
        facts.take_back(mark)

    # ---- parameters ------------------------------------------------------------------------------------------------

    def _needs(self, procedure: ProcedureSymbols, node: tree.Call) -> None:
        """Say which arguments need a value and have none: all but variables that are given themselves."""
        state = self._state
        for parameter, argument in zip(procedure.parameters, node.arguments, strict=False):
            kind = procedure.types.get(parameter)
            by_value = kind is not None and not kind.sizes and kind.kind in _BY_VALUE
            if by_value or not isinstance(argument, tree.Name | tree.Index):
                need(state, argument)
            else:
                need_indices(state, argument)

    def _activation(self, procedure: ProcedureSymbols, node: tree.Call | None) -> Activation:
        """Return where a procedure keeps its names; None as the call stands for one that is not known."""
        state = self._state
        self._count += 1
        arguments = dict(zip(procedure.parameters, node.arguments, strict=True)) if node else {}
        bindings: dict[str, str | None] = {}
        for key, kind in procedure.types.items():
            own = f"{procedure.node.name.key}.{key}'{self._count}"
            argument = arguments.get(key)
            bindings[key] = own
            if key not in procedure.parameters:
                state.table.lacks(own)
                state.table.links.put(own, None)
            elif argument is None:
                state.table.has(own)
            else:
                bindings[key] = self._bound(argument, kind, own, node.span if node else argument.span)
        return Activation(scope=state.symbols.scope(procedure.node.name.key), bindings=bindings)

    def _bound(self, argument: tree.Expression, kind: VariableType | None, own: str, span: Span) -> str | None:
        """Return where a parameter is kept: where its argument is, or in storage of its own."""
        state = self._state
        if kind is None:
            return None
        if kind.sizes or kind.kind is VariableKind.EVENT:
            return state.bound(argument.key) if isinstance(argument, tree.Name) else None
        if kind.kind is VariableKind.FRAME:
            if isinstance(argument, tree.Name | tree.Index | tree.ArmName | tree.Poison):
                return state.frame(argument)
            state.table.has(own)
            state.table.links.put(own, None)
            return own
        state.give(own, state.number(argument) if kind.kind is VariableKind.SCALAR else None, span)
        return own

    def _leave(self, procedure: ProcedureSymbols, activation: Activation) -> None:
        """Take the procedure's own frames away."""
        for key, kind in procedure.types.items():
            slot = activation.bindings[key]
            if slot is not None and "'" in slot and kind is not None and kind.kind is VariableKind.FRAME:
                self._state.table.drop(slot, array=bool(kind.sizes))
