"""Calls of procedures: the slots of parameters and local variables, and the analysis of bodies at each call."""

from collections.abc import Callable

from armwright.program.flow_analysis import plausibility
from armwright.program.flow_analysis.definite_assignment import require_indices, require_value
from armwright.program.flow_analysis.lattice import EVERYTHING, Uncertainty
from armwright.program.flow_analysis.state import LAST, Activation, Called, FlowState
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.source import Span
from armwright.program.semantics.symbols import ProcedureSymbols
from armwright.program.syntax import tree

# Deepest call chain that is analysed, and the number of statements of procedures in all.
_MAX_DEPTH, _MAX_STATEMENTS = 6, 20_000
_BY_VALUE = (VariableKind.SCALAR, VariableKind.TRANS)


class CallAnalysis:
    """Analyses the bodies of procedures at their calls, up to a budget."""

    def __init__(self, state: FlowState, follow: Callable[[tuple[tree.Statement, ...]], None]) -> None:
        """Start outside of all procedures.

        Args:
            state: the abstract state.
            follow: analyses the statements of a procedure.
        """
        self._state, self._follow = state, follow
        self._count = 0
        self._budget = _MAX_STATEMENTS
        # Procedures that were analysed at a call, and those that were skipped at one.
        self._followed: set[str] = set()
        self._skipped: set[str] = set()

    def count_statement(self) -> None:
        """Count one statement."""
        if self._state.calls:
            self._budget -= 1

    def call(self, node: tree.Call, *, follow: bool) -> None:
        """Analyse one call, or invalidate what it may change."""
        state = self._state
        procedure = state.symbols.procedures.get(node.name.key)
        if procedure is None:
            require_value(state, *(argument for argument in node.arguments if not isinstance(argument, tree.Name)))
            return
        key = procedure.node.name.key
        self._require_arguments(procedure, node)
        plausibility.check_lengths(state, *node.arguments)
        deep = len(state.calls) >= _MAX_DEPTH or self._budget <= 0 or any(call.name == key for call in state.calls)
        if deep or not follow or len(node.arguments) != len(procedure.parameters):
            self.skip_body(key)
            effects = state.side_effects.effects_of_call(node, state.now.scope)
            self._budget -= len(effects.names)
            state.forget(effects)
            return
        self._followed.add(key)
        activation = self._activation(procedure, node)
        with state.in_procedure(activation, Called(key, node.name.text, node.span)):
            self._follow(procedure.node.body.statements)
        if not state.ended:
            self._remove_local_frames(procedure, activation)

    def skip_body(self, key: str) -> None:
        """Record a call whose procedure is not analysed there."""
        self._skipped.add(key)

    def follow_uncalled(self) -> None:
        """Analyse the procedures that were skipped at a call once more, with unknown arguments."""
        state = self._state
        done: set[str] = set()
        while waiting := sorted(
            key for key in state.symbols.procedures if key not in done and not self._is_followed(key)
        ):
            for key in waiting:
                done.add(key)
                self._follow_unknown(state.symbols.procedures[key])

    def _is_followed(self, key: str) -> bool:
        return key in self._followed and key not in self._skipped

    def _follow_unknown(self, procedure: ProcedureSymbols) -> None:
        state, facts = self._state, self._state.facts
        mark = facts.checkpoint()
        facts.invalidate(EVERYTHING)
        activation = self._activation(procedure, None)
        own = [
            name for key in procedure.types if (name := activation.bindings[key]) and key not in procedure.parameters
        ]
        # Parameters may alias other frames, so that all but local variables may change at any time.
        facts.uncertainties = (
            Uncertainty(everything=True, excepted=frozenset((LAST, *own)), moves_frames=True, aliases=True),
        )
        with state.in_procedure(activation):
            self._follow(procedure.node.body.statements)
        facts.uncertainties, state.ended = (), False
        facts.roll_back(mark)

    # ---- parameters --------------------------------------------------------------------------------------------------

    def _require_arguments(self, procedure: ProcedureSymbols, node: tree.Call) -> None:
        """Report arguments without a value, except variables that are passed by reference."""
        state = self._state
        for parameter, argument in zip(procedure.parameters, node.arguments, strict=False):
            kind = procedure.types.get(parameter)
            by_value = kind is not None and not kind.sizes and kind.kind in _BY_VALUE
            if by_value or not isinstance(argument, tree.Name | tree.Index):
                require_value(state, argument)
            else:
                require_indices(state, argument)

    def _activation(self, procedure: ProcedureSymbols, node: tree.Call | None) -> Activation:
        """Return the activation of a procedure; ``node`` is None for an unknown call."""
        state = self._state
        self._count += 1
        arguments = dict(zip(procedure.parameters, node.arguments, strict=True)) if node else {}
        bindings: dict[str, str | None] = {}
        for key, kind in procedure.types.items():
            own = f"{procedure.node.name.key}.{key}'{self._count}"
            argument = arguments.get(key)
            bindings[key] = own
            if key not in procedure.parameters:
                state.table.mark_unassigned(own)
                state.table.links.set(own, None)
            elif argument is None:
                state.table.mark_assigned(own)
            else:
                bindings[key] = self._parameter_slot(argument, kind, own, node.span if node else argument.span)
        return Activation(scope=state.symbols.scope(procedure.node.name.key), bindings=bindings)

    def _parameter_slot(self, argument: tree.Expression, kind: VariableType | None, own: str, span: Span) -> str | None:
        """Return the slot of a parameter: that of its argument, or one of its own."""
        state = self._state
        if kind is None:
            return None
        if kind.sizes or kind.kind is VariableKind.EVENT:
            return state.slot_of(argument.key) if isinstance(argument, tree.Name) else None
        if kind.kind is VariableKind.FRAME:
            if isinstance(argument, tree.Name | tree.Index | tree.ArmName | tree.Poison):
                return state.frame(argument)
            state.table.mark_assigned(own)
            state.table.links.set(own, None)
            return own
        state.set_number(own, state.number(argument) if kind.kind is VariableKind.SCALAR else None, span)
        return own

    def _remove_local_frames(self, procedure: ProcedureSymbols, activation: Activation) -> None:
        """Remove the local frames of a procedure."""
        for key, kind in procedure.types.items():
            slot = activation.bindings[key]
            if slot is not None and "'" in slot and kind is not None and kind.kind is VariableKind.FRAME:
                self._state.table.remove(slot, array=bool(kind.sizes))
