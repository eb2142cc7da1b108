"""Calls of procedures: the slots of parameters and local variables, and the analysis of bodies at each call."""

from armwright.program.flow_analysis import plausibility
from armwright.program.flow_analysis.context import MAX_DEPTH, Context
from armwright.program.flow_analysis.definite_assignment import require_indices, require_value
from armwright.program.flow_analysis.lattice import EVERYTHING, Uncertainty
from armwright.program.flow_analysis.state import LAST, Activation, Called, FlowState
from armwright.program.language.diagnostic import labels
from armwright.program.language.kinds import BY_VALUE, VariableKind, VariableType
from armwright.program.language.source import Span
from armwright.program.semantics.symbols import ProcedureSymbols
from armwright.program.syntax import tree

# Longest chain of calls that is analysed.
_MAX_CALLS = 6


def call(context: Context, node: tree.Call) -> None:
    """Analyse the body of a procedure at a call, or invalidate what it may change."""
    state = context.state
    procedure = state.symbols.procedures.get(node.name.key)
    if procedure is None:
        require_value(state, *(argument for argument in node.arguments if not isinstance(argument, tree.Name)))
        return
    key = procedure.node.name.key
    _require_arguments(state, procedure, node)
    plausibility.check_lengths(state, *node.arguments)
    is_deep = context.depth >= MAX_DEPTH or len(state.calls) >= _MAX_CALLS or context.budget <= 0
    is_recursive = any(active.name == key for active in state.calls)
    if is_deep or is_recursive or len(node.arguments) != len(procedure.parameters):
        context.skipped.add(key)
        effects = state.side_effects.effects_of_call(node, state.now.scope)
        context.budget -= len(effects.names)
        state.forget(effects)
        return
    context.followed.add(key)
    activation = _activation(context, procedure, node)
    with state.in_procedure(activation, Called(key, node.name.text, node.span)):
        context.follow(*procedure.node.body.statements)
    if not state.ended:
        _remove_local_frames(state, procedure, activation)


def follow_uncalled(context: Context) -> None:
    """Analyse the procedures that were skipped at a call once more, with unknown arguments."""
    procedures = context.state.symbols.procedures
    done: set[str] = set()
    while waiting := sorted(procedures.keys() - done - (context.followed - context.skipped)):
        done.update(waiting)
        for key in waiting:
            _follow_unknown(context, procedures[key])


def _follow_unknown(context: Context, procedure: ProcedureSymbols) -> None:
    state, facts = context.state, context.state.facts
    mark = facts.checkpoint()
    facts.invalidate(EVERYTHING)
    activation = _activation(context, procedure, None)
    own = (activation.bindings[key] or "" for key in procedure.types if key not in procedure.parameters)
    # Parameters may alias other frames, so that all but local variables may change at any time.
    excepted = frozenset((LAST, *own))
    facts.uncertainties = (Uncertainty(everything=True, excepted=excepted, moves_frames=True, aliases=True),)
    with state.in_procedure(activation):
        context.follow(*procedure.node.body.statements)
        if procedure.is_function and not state.ended:
            _report_missing_return(state, procedure)
    facts.uncertainties, state.ended = (), False
    facts.roll_back(mark)


def _report_missing_return(state: FlowState, procedure: ProcedureSymbols) -> None:
    node = procedure.node
    text = f"FUNCTION `{node.name.text}` may end without a value"
    here, advice = labels(node.head, "declared here"), "write a RETURN in front of this END"
    state.report("E234", text, node.body.end, "no RETURN leads past here", secondary=here, advice=advice)


# ---- parameters ------------------------------------------------------------------------------------------------------


def _require_arguments(state: FlowState, procedure: ProcedureSymbols, node: tree.Call) -> None:
    """Report arguments without a value, except variables that are passed by reference."""
    for parameter, argument in zip(procedure.parameters, node.arguments, strict=False):
        kind = procedure.types.get(parameter)
        by_value = kind is not None and not kind.sizes and kind.kind in BY_VALUE and parameter not in procedure.inout
        if by_value or not isinstance(argument, tree.Name | tree.Index):
            require_value(state, argument)
        else:
            require_indices(state, argument)


def _activation(context: Context, procedure: ProcedureSymbols, node: tree.Call | None) -> Activation:
    """Return the activation of a procedure; ``node`` is None for an unknown call."""
    state = context.state
    context.activations += 1
    arguments = dict(zip(procedure.parameters, node.arguments, strict=True)) if node else {}
    bindings: dict[str, str | None] = {}
    for key, kind in procedure.types.items():
        own = f"{procedure.node.name.key}.{key}'{context.activations}"
        argument = arguments.get(key)
        bindings[key] = own
        if key not in procedure.parameters:
            state.table.mark_unassigned(own)
            state.table.links.set(own, None)
        elif argument is None:
            state.table.mark_assigned(own)
        else:
            span = node.span if node else argument.span
            if key in procedure.inout and kind is not None and not kind.sizes and kind.kind in BY_VALUE:
                bindings[key] = state.variable(argument)
            else:
                bindings[key] = _parameter_slot(state, argument, kind, own, span)
    return Activation(scope=state.symbols.scope(procedure.node.name.key), bindings=bindings)


def _parameter_slot(
    state: FlowState, argument: tree.Expression, kind: VariableType | None, own: str, span: Span
) -> str | None:
    """Return the slot of a parameter: that of its argument, or one of its own."""
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


def _remove_local_frames(state: FlowState, procedure: ProcedureSymbols, activation: Activation) -> None:
    """Remove the local frames of a procedure."""
    for key, kind in procedure.types.items():
        slot = activation.bindings[key]
        if slot is not None and "'" in slot and kind is not None and kind.kind is VariableKind.FRAME:
            state.table.remove(slot, array=bool(kind.sizes))
