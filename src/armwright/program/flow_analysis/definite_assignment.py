"""What has no value where it needs one, certainly or on some of the paths that lead there."""

from armwright.program.flow_analysis.facts import Divergence
from armwright.program.flow_analysis.state import FlowState
from armwright.program.language.diagnostic import Label
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import is_any_element, is_arm
from armwright.program.semantics.expression_types import expression_text
from armwright.program.syntax import tree


def need(state: FlowState, *nodes: tree.Expression | None) -> None:
    """Say of each name in expressions that has certainly no value, once, that it needs one."""
    waiting = [node for node in reversed(nodes) if node is not None]
    while waiting:
        node = waiting.pop()
        if isinstance(node, tree.Name):
            _need_variable(state, node)
        elif isinstance(node, tree.Matrix):
            waiting += [item for item in reversed(node.items) if not isinstance(item, tree.Number)]
        elif isinstance(node, tree.Binary):
            # AND and OR check the right side only where it matters.
            waiting += [node.left] if node.operation in ("AND", "OR") else [node.right, node.left]
        elif isinstance(node, tree.Index):
            need(state, *node.indices)
            _need_variable(state, node)
        elif isinstance(node, tree.Function):
            waiting += reversed(node.arguments if node.name.key != "FORCE" else ())
        elif isinstance(node, tree.ArmName):
            state.look_up(node.key, node.span)
        elif isinstance(node, tree.Unary):
            waiting.append(node.operand)


def need_indices(state: FlowState, *nodes: object) -> None:
    """Say what is needed to find the variables that are written or named."""
    for node in nodes:
        if isinstance(node, tree.Index):
            need(state, *node.indices)


def _kind(state: FlowState, node: tree.Expression) -> VariableKind | None:
    key = node.name.key if isinstance(node, tree.Index) else getattr(node, "key", "")
    kind = state.now.scope.type(key)
    return None if kind is None or kind.kind is VariableKind.EVENT else kind.kind


def _need_variable(state: FlowState, node: tree.Name | tree.Index) -> None:
    name = state.variable(node)
    if name is None or is_any_element(name) or is_arm(name):
        return
    if state.table.valued[name]:
        parting = state.table.sure[name]
        if isinstance(parting, Divergence) and state.conditions <= parting.depth:
            _uncertain(state, node, name, parting)
        return
    head = node.name if isinstance(node, tree.Index) else node
    scope, kind = state.now.scope, _kind(state, node)
    slot = state.bound(head.key)
    if slot is None or kind is None or scope.is_poisoned(head.key) or not state.settle(slot):
        return
    secondary = scope.declaration_labels(head.key)
    if kind is VariableKind.FRAME:
        _no_place(state, node, secondary, from_cell=slot == head.key and head is node)
        return
    text = f"`{expression_text(node)}` is used before it has a value"
    advice = (
        f"write `{expression_text(node)} = {'100' if kind is VariableKind.SCALAR else '( twelve numbers )'} ;` before"
    )
    state.report("E303", text, node.span, "no value here", secondary=secondary, advice=advice)


def _uncertain(state: FlowState, node: tree.Name | tree.Index, name: str, parting: Divergence) -> None:
    """Warn of a variable that has a value on one path here and none on the other.

    Where the use depends on a condition too, nothing is said: that may be the one on which it has the value.
    """
    open_cell = state.cell is None and _kind(state, node) is VariableKind.FRAME
    if open_cell or not state.settle(name):
        return
    text = f"`{expression_text(node)}` may have no value here"
    state.report(
        "W207", text, node.span, "needs a value", secondary=(Label(parting.span, parting.says),), advice=parting.help
    )


def _no_place(state: FlowState, node: tree.Name | tree.Index, secondary: tuple[Label, ...], *, from_cell: bool) -> None:
    """Say that a frame has no value; a cell file may give one to the frames of the program, and to no others."""
    code, note = "E304", ""
    if state.cell is None and from_cell:
        code, note = "W204", "no cell was given; a cell file may give it one"
    elif state.table.is_empty:
        note = "a frame gets its value from `=`, AFFIX ... AT, READ VISIONS or an imported cell file"
        secondary = ()
    text = f"frame `{expression_text(node)}` is used before it has a value"
    state.report(code, text, node.span, "no value here", secondary=secondary, note=note)
