"""Definite assignment: variables without a value where one is needed, on all paths or on some."""

from armwright.program.flow_analysis.facts import Divergence
from armwright.program.flow_analysis.state import FlowState
from armwright.program.language.diagnostic import Label
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import is_any_element, is_arm
from armwright.program.semantics.expression_types import expression_text
from armwright.program.syntax import tree


def require_value(state: FlowState, *nodes: tree.Expression | None) -> None:
    """Report each variable in expressions that has no value, once."""
    waiting = [node for node in reversed(nodes) if node is not None]
    while waiting:
        node = waiting.pop()
        if isinstance(node, tree.Name):
            _require_variable(state, node)
        elif isinstance(node, tree.Matrix):
            waiting += [item for item in reversed(node.items) if not isinstance(item, tree.Number)]
        elif isinstance(node, tree.Binary):
            # AND and OR check the right side only where it matters.
            waiting += [node.left] if node.operation in ("AND", "OR") else [node.right, node.left]
        elif isinstance(node, tree.Index):
            require_value(state, *node.indices)
            _require_variable(state, node)
        elif isinstance(node, tree.Function):
            waiting += reversed(node.arguments if node.name.key != "FORCE" else ())
        elif isinstance(node, tree.ArmName):
            state.check_arm(node.key, node.span)
        elif isinstance(node, tree.Unary):
            waiting.append(node.operand)


def require_indices(state: FlowState, *nodes: object) -> None:
    """Report the indices without a value of variables that are assigned or named."""
    for node in nodes:
        if isinstance(node, tree.Index):
            require_value(state, *node.indices)


def _kind(state: FlowState, node: tree.Expression) -> VariableKind | None:
    key = node.name.key if isinstance(node, tree.Index) else getattr(node, "key", "")
    kind = state.now.scope.type(key)
    return None if kind is None or kind.kind is VariableKind.EVENT else kind.kind


def _require_variable(state: FlowState, node: tree.Name | tree.Index) -> None:
    name = state.variable(node)
    if name is None or is_any_element(name) or is_arm(name):
        return
    if state.table.may_be_assigned[name]:
        divergence = state.table.definitely_assigned[name]
        if isinstance(divergence, Divergence) and state.conditions <= divergence.depth:
            _warn_of_divergence(state, node, name, divergence)
        return
    head = node.name if isinstance(node, tree.Index) else node
    scope, kind = state.now.scope, _kind(state, node)
    slot = state.slot_of(head.key)
    if slot is None or kind is None or scope.is_poisoned(head.key) or not state.is_first_report(slot):
        return
    secondary = scope.declaration_labels(head.key)
    if kind is VariableKind.FRAME:
        _report_no_pose(state, node, secondary, from_cell=slot == head.key and head is node)
        return
    text = f"`{expression_text(node)}` is used before it has a value"
    advice = (
        f"write `{expression_text(node)} = {'100' if kind is VariableKind.SCALAR else '( twelve numbers )'} ;` before"
    )
    state.report("E303", text, node.span, "no value here", secondary=secondary, advice=advice)


def _warn_of_divergence(state: FlowState, node: tree.Name | tree.Index, name: str, divergence: Divergence) -> None:
    """Warn of a variable that is assigned on some of the paths to here only.

    Where the use is conditional too, there is no warning: the condition may be the same.
    """
    open_cell = state.cell is None and _kind(state, node) is VariableKind.FRAME
    if open_cell or not state.is_first_report(name):
        return
    text = f"`{expression_text(node)}` may have no value here"
    state.report(
        "W207",
        text,
        node.span,
        "needs a value",
        secondary=(Label(divergence.span, divergence.message),),
        advice=divergence.advice,
    )


def _report_no_pose(
    state: FlowState, node: tree.Name | tree.Index, secondary: tuple[Label, ...], *, from_cell: bool
) -> None:
    """Report a frame without a value; a cell file may give one to the frames of the program, and to no others."""
    code, note = "E304", ""
    if state.cell is None and from_cell:
        code, note = "W204", "no cell was given; a cell file may give it one"
    elif state.table.is_empty:
        note = "a frame gets its value from `=`, AFFIX ... AT, READ VISIONS or an imported cell file"
        secondary = ()
    text = f"frame `{expression_text(node)}` is used before it has a value"
    state.report(code, text, node.span, "no value here", secondary=secondary, note=note)
