"""Definite assignment: variables without a value where one is needed, on all paths or on some."""

from armwright.errors import closest
from armwright.program.flow_analysis.facts import Divergence
from armwright.program.flow_analysis.state import FlowState
from armwright.program.language.diagnostic import did_you_mean, labels
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import is_any_element, is_arm
from armwright.program.semantics.builtins import WITH_DEVICE, WITH_INPUT, WITH_NAME, is_joints, joint_target
from armwright.program.semantics.expression_types import expression_text
from armwright.program.syntax import tree

# What a value of each kind may be.
_EXAMPLES = {VariableKind.SCALAR: "100", VariableKind.BOOLEAN: "TRUE", VariableKind.TEXT: '"text"'}


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
            if node.name.key in WITH_DEVICE and node.name.key not in state.symbols.procedures:
                _check_signal(state, node)
            scope = state.now.scope
            has_names = node.name.key in WITH_NAME or (is_joints(scope, node) and joint_target(scope, node) is not None)
            waiting += reversed(() if has_names else node.arguments)
        elif isinstance(node, tree.ArmName):
            state.check_arm(node.key, node.span)
        elif isinstance(node, tree.Unary):
            waiting.append(node.operand)


def _check_signal(state: FlowState, node: tree.Function) -> None:
    """Report an input or a device that the cell does not have, or that is of another kind than the function reads."""
    function, name, cell = node.name.key, node.arguments[0] if node.arguments else None, state.cell
    if cell is None or not isinstance(name, tree.Name):
        return
    what = "input" if function in WITH_INPUT else "device"
    known = cell.inputs if function in WITH_INPUT else cell.devices
    if known is None:
        return
    if name.key not in known:
        listed = ", ".join(sorted(known)) or "none"
        text, note = f"the cell has no {what} `{name.text}`", f"{what}s of the cell: {listed}"
        code = "R608" if function in WITH_INPUT else "R602"
        advice = did_you_mean(closest(name.text, known))
        state.report(code, text, name.span, f"no such {what}", note=note, advice=advice)
    elif function in WITH_INPUT and (name.key in cell.analogue) is not (function == "ANALOG"):
        kind, other = ("analogue", "ANALOG") if function == "INPUT" else ("digital", "INPUT")
        text = f"input `{name.text}` of the cell is {kind}"
        state.report("R608", text, name.span, kind, advice=f"read it by `{other}({name.text})`")


def require_indices(state: FlowState, *nodes: object) -> None:
    """Report the indices without a value of variables that are assigned or named."""
    for node in nodes:
        if isinstance(node, tree.Index):
            require_value(state, *node.indices)


def _require_variable(state: FlowState, node: tree.Name | tree.Index) -> None:
    name = state.variable(node)
    if name is None or is_any_element(name) or is_arm(name):
        return
    is_assigned, divergence = state.table.may_be_assigned[name], state.table.definitely_assigned[name]
    if is_assigned and not isinstance(divergence, Divergence):
        return
    key, text = node.name.key if isinstance(node, tree.Index) else node.key, expression_text(node)
    scope, slot, kind = state.now.scope, state.slot_of(key), state.now.scope.type(key)
    is_frame = kind is not None and kind.kind is VariableKind.FRAME
    if is_assigned and isinstance(divergence, Divergence):
        # Where the use is conditional too, there is no warning: the condition may be the same.
        is_certain = state.conditions <= divergence.depth and not (is_frame and state.cell is None)
        if is_certain and state.is_first_report(name):
            here, message = labels(divergence.span, divergence.message), f"`{text}` may have no value here"
            state.report("W207", message, node.span, "needs a value", secondary=here, advice=divergence.advice)
        return
    if slot is None or scope.is_poisoned(key) or not state.is_first_report(slot):
        return
    code, note, advice, here = "E304", "", "", scope.declaration_labels(key)
    if not is_frame:
        value = "( twelve numbers )" if kind is None else _EXAMPLES.get(kind.kind, "( twelve numbers )")
        code, advice = "E303", f"write `{text} = {value} ;` before"
    elif state.cell is None and state.symbols.scope(None).type(slot) is not None and isinstance(node, tree.Name):
        # A cell file may give a value to the frames of the program, and to no others.
        code, note = "W204", "no cell was given; a cell file may give it one"
    elif state.table.is_empty:
        here, note = (), "a frame gets its value from `=`, AFFIX ... AT, READ VISIONS or an imported cell file"
    message = f"{'frame ' * is_frame}`{text}` is used before it has a value"
    state.report(code, message, node.span, "no value here", secondary=here, note=note, advice=advice)
