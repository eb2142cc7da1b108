"""AFFIX, UNFIX and assignments: values of variables and parents of frames."""

from itertools import takewhile

from armwright.program.flow_analysis import plausibility, poses
from armwright.program.flow_analysis.context import Steps, of_state
from armwright.program.flow_analysis.definite_assignment import require_indices, require_value
from armwright.program.flow_analysis.state import FlowState
from armwright.program.language.diagnostic import Label, labels
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import is_any_element, is_arm
from armwright.program.language.source import Span
from armwright.program.semantics.cell_symbols import WORLD
from armwright.program.semantics.expression_types import expression_text
from armwright.program.syntax import tree


def assign(state: FlowState, node: tree.Assign) -> None:
    """Record the assignment of a variable."""
    require_value(state, node.value)
    require_indices(state, node.target)
    target = node.target
    if (frame := state.frame(target)) is not None:
        plausibility.check_lengths(state, node.value)
        pose = poses.constant_pose(state, node.value)
        set_pose(state, frame, target, node.span)
        state.table.set_world_pose(frame, pose)
        plausibility.check_placement(state, frame, node.value)
    elif (name := state.variable(target, VariableKind.SCALAR)) is not None:
        state.set_number(name, state.number(node.value), node.span)
    elif (name := state.variable(target, VariableKind.TRANS)) is not None:
        plausibility.check_lengths(state, node.value)
        step = poses.constant_pose(state, node.value)
        state.set_number(name, None, node.span)
        if not is_any_element(name):
            state.steps.set(name, step)
    elif (name := state.variable(target)) is not None:
        state.set_number(name, None, node.span)


def is_moved_by_cell(state: FlowState, frame: str, span: Span) -> bool:
    """Whether the cell moves a frame, which is reported: it cannot be placed or attached."""
    if state.cell is None or frame not in (state.cell.moving or ()):
        return False
    name = state.name(frame)
    text, advice = (
        f"`{name}` is moved by the cell, and cannot be placed or attached",
        f"affix another frame to `{name}`",
    )
    state.report("E249", text, span, "moves by itself", advice=advice)
    return True


def set_pose(state: FlowState, frame: str, node: tree.Expression, span: Span) -> None:
    """Record the pose of a frame; report one that is rigidly affixed to an arm or WORLD, or moves by itself."""
    if is_moved_by_cell(state, frame, span):
        return
    if is_arm(frame) or frame == WORLD:
        return
    root = frame if is_any_element(frame) else state.table.rigid_root(frame)
    if root is not None and root != frame and (is_arm(root) or root == WORLD):
        name, here = expression_text(node), state.table.affix_labels(frame, "rigidly attached here")
        text = f"`{name}` is rigidly attached to {state.name(root)}, which an assignment cannot move"
        advice = f"remove RIGIDLY, or write `UNFIX {name}` before this"
        state.report("E310", text, node.span, "cannot be assigned a pose", secondary=here, advice=advice)
        return
    state.table.assign(frame, span)


# ---- AFFIX ---------------------------------------------------------------------------------------------------------


def affix(state: FlowState, node: tree.Affix) -> None:
    """Record an AFFIX."""
    state.note_arms(node.child, node.parent)
    plausibility.check_lengths(state, node.at)
    child, parent = state.frame(node.child), state.frame(node.parent)
    if node.at is None:
        require_value(state, node.child)
    else:
        require_indices(state, node.child)
    require_value(state, node.at, node.parent)
    if child is None or is_arm(child) or child == WORLD or is_moved_by_cell(state, child, node.span):
        return
    if parent is None:
        state.table.forget(child)
        return
    if state.table.would_close_cycle(child, parent):
        _report_cycle(state, node, child, parent)
        return
    warn_of_implicit_unfix(state, child, parent, node.span)
    step = state.table.relative_pose(child, parent) if node.at is None else poses.constant_pose(state, node.at)
    if is_any_element(child):
        state.table.forget(child)
        return
    if node.at is None:
        _note_late_affix(state, node, child, parent)
        plausibility.check_grasp(state, node, child, parent)
    else:
        state.table.displace(child)
    state.table.affix(child, parent, node.link, rigid=node.rigid, step=step)


def warn_of_implicit_unfix(state: FlowState, child: str, parent: str, span: Span) -> None:
    """Warn of a frame that gets another parent without UNFIX."""
    link = None if is_any_element(child) else state.table.links[child]
    if link is None or link.parent is None or link.parent == parent or _may_alias(state, parent, link.parent):
        return
    name, old = state.name(child), state.name(link.parent)
    text, label = f"`{name}` is still attached to `{old}`", f"from here on it is attached to {state.name(parent)}"
    here = labels(link.span, f"affixed to {old} here")
    note = "" if link.span else f"in the cell it is attached to {old}"
    advice = f"write `UNFIX {name} FROM {old}` before to make this explicit"
    state.report("W203", text, span, label, secondary=here, note=note, advice=advice)


def _may_alias(state: FlowState, name: str, other: str) -> bool:
    """Whether two names may be aliases of one frame: parameters of an unknown call."""
    if is_any_element(name) or is_any_element(other):
        return True
    alias = state.facts.may_alias
    return (alias(name) and not is_arm(name)) or (alias(other) and not is_arm(other))


def _report_cycle(state: FlowState, node: tree.Affix, child: str, parent: str) -> None:
    name = state.name
    chain: tuple[Label, ...] = ()
    for frame in takewhile(lambda frame: frame != child, (parent, *state.table.ancestors(parent))):
        link = state.table.links[frame]
        if link and link.parent:
            chain += labels(link.span, f"{name(frame)} is attached to {name(link.parent)}")
    label = f"{name(child)} cannot be attached to {'itself' if child == parent else name(parent)}"
    note = "frames form a tree with the root WORLD; each is attached to one parent"
    state.report("E305", "this AFFIX would close a cycle", node.link, label, secondary=chain, note=note)


def _note_late_affix(state: FlowState, node: tree.Affix, child: str, parent: str) -> None:
    """Note a parent that moved after the child got its pose and before it was affixed."""
    moved, posed = state.table.assigned[parent], state.table.assigned[child]
    if moved is None or posed is None or not moved.moved or moved.order < posed.order:
        return
    name, here = state.name(child), labels(moved.span, f"{state.name(child)} did not follow this")
    text = f"`{state.name(parent)}` was moved before `{name}` was attached to it"
    advice = "write the AFFIX before the assignment, or specify the transformation with AT"
    state.report("L303", text, node.link, f"{name} follows only from here on", secondary=here, advice=advice)


# ---- UNFIX ---------------------------------------------------------------------------------------------------------


def unfix(state: FlowState, node: tree.Unfix) -> None:
    """Remove the parent of a frame; it keeps its pose."""
    state.note_arms(node.parent)
    require_indices(state, node.child, node.parent)
    child, table = state.frame(node.child), state.table
    if child is None or is_arm(child) or child == WORLD or is_moved_by_cell(state, child, node.span):
        return
    parent = state.frame(node.parent)
    if node.parent is not None and parent is not None and not is_any_element(child):
        link = table.links[child]
        actual = WORLD if link is None else link.parent
        if actual is not None and actual != parent and not _may_alias(state, parent, actual):
            _report_not_affixed(state, child, node.parent)
            return
    if node.parent is None or parent == WORLD:
        require_value(state, node.child)
    table.unfix(child)


def _report_not_affixed(state: FlowState, child: str, parent: tree.Mobile) -> None:
    link, name = state.table.links[child], state.name(child)
    text = f"`{name}` is not affixed to `{expression_text(parent)}`"
    if link is None or link.parent is None:
        state.report("E306", text, parent.span, f"{name} has no parent", advice="remove this UNFIX")
        return
    actual = state.name(link.parent)
    here, advice = labels(link.span, f"{name} was affixed to {actual} here"), f"write `UNFIX {name} FROM {actual}`"
    state.report("E306", text, parent.span, "not its parent", secondary=here, advice=advice)


STEPS: Steps = {tree.Assign: of_state(assign), tree.Affix: of_state(affix), tree.Unfix: of_state(unfix)}
