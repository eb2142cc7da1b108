"""MOVE: the arm that moves, what it carries, and where it arrives."""

from armwright.errors import closest, counted
from armwright.program.flow_analysis import plausibility
from armwright.program.flow_analysis.context import Context, Steps
from armwright.program.flow_analysis.definite_assignment import require_indices, require_value
from armwright.program.flow_analysis.facts import UNKNOWN
from armwright.program.flow_analysis.frames import warn_of_implicit_unfix
from armwright.program.flow_analysis.state import LAST, FlowState
from armwright.program.language.diagnostic import Label, Severity, did_you_mean, labels
from armwright.program.language.names import is_any_element, is_arm
from armwright.program.language.units import HIGHEST_SPEED, LOWEST_SPEED, dimension
from armwright.program.semantics.builtins import is_joints, joint_target
from armwright.program.semantics.cell_symbols import WORLD
from armwright.program.semantics.expression_types import expression_text
from armwright.program.semantics.move import SPEED_NOTE, no_flat_line, no_flexible_gear
from armwright.program.syntax import tree

# Clauses whose value is a number.
_VALUED = (tree.Blend, tree.Duration, *tree.TOOL_LIMITS, tree.Correction, tree.Bound, tree.Rate)

# Ways along straight lines, which flat feedforward does not shape.
_LINES = (tree.Straightly, tree.Departure, tree.Approach)


def move(context: Context, node: tree.Move) -> None:
    """Analyse a MOVE; its actions may run or not while the arm moves."""
    state = context.state
    arm = _start_move(state, node)
    guards = [clause for clause in node.clauses if isinstance(clause, tree.On)]
    for guard in guards:
        require_value(state, guard.condition)
        effects = context.side_effects(guard.action)
        if not state.is_first_pass:
            mark = state.facts.checkpoint()
            if arm is None:
                state.forget_arms(grasps=False)
            else:
                state.table.arrive(arm, UNKNOWN, None)
            with state.conditional():
                context.follow(guard.action)
            state.facts.roll_back(mark)
            state.ended = False
        message, advice = "it gets a value in this action, which may not run", "give it a value before the MOVE"
        state.forget_undone(effects, state.divergence(guard.head, message, advice))
    halted = context.braked or any(context.side_effects(guard.action).halts for guard in guards)
    _end_move(state, node, arm, halted=halted)


def _start_move(state: FlowState, node: tree.Move) -> str | None:
    """Check what a MOVE needs to begin; return the arm, None where it is unknown."""
    state.note_arms(node.moved)
    require_indices(state, node.moved)
    moved = state.frame(node.moved)
    arm, implied = (moved, False) if moved is not None and is_arm(moved) else _arm_of_frame(state, node, moved)
    state.record(node, arm, implied=implied)
    targets = _targets(node)
    require_value(state, *targets)
    if isinstance(node.goal, tree.Function) and is_joints(state.now.scope, node.goal):
        _check_joints(state, node.goal, arm)
    plausibility.check_lengths(state, *targets)
    for clause in node.clauses:
        if isinstance(clause, tree.Speed):
            check_speed(state, clause.value)
        elif isinstance(clause, _VALUED):
            require_value(state, clause.value)
        elif isinstance(clause, tree.Tracking):
            _check_tracking(state, clause)
        elif isinstance(clause, tree.Smoothly):
            _check_smooth(state, node, clause, arm)
    if arm is None:
        return None
    _warn_of_released_frame(state, node, arm)
    state.note_arm_use(arm, node.span.to(node.moved.span), moves=True, affixed_at=_affix_labels(state, moved, arm))
    goal = state.frame(node.goal)
    if goal is not None and not state.table.is_parent_unknown(goal) and state.table.carrying_arm(goal) == arm:
        _note_relative_goal(state, node, arm)
    return arm


def _end_move(state: FlowState, node: tree.Move, arm: str | None, *, halted: bool) -> None:
    """Record what a MOVE has moved, and where to.

    Args:
        state: the abstract state.
        node: the MOVE.
        arm: that moves; None where it is unknown.
        halted: whether an action may have ended the motion meanwhile.
    """
    moved = state.frame(node.moved)
    if arm is None or moved is None:
        if moved is None or state.table.is_parent_unknown(moved) or state.table.holding_arm(moved) == UNKNOWN:
            # An unknown arm has moved: that is no reason to report that none has been used.
            state.forget_arms(grasps=False)
            if moved is not None:
                state.table.forget(moved)
        return
    frame: str | None = moved
    if moved == arm:
        goal = state.frame(node.goal)
        frame = UNKNOWN if halted or (goal is not None and is_any_element(goal)) else goal
        if goal is None and not isinstance(node.goal, tree.Binary | tree.Matrix | tree.Function):
            # The goal has an error, or is a parameter of a procedure that is not analysed.
            frame = UNKNOWN
    state.table.arrive(arm, frame, node.span if moved == arm else None)


def _warn_of_released_frame(state: FlowState, node: tree.Move, arm: str) -> None:
    """Warn of a frame that the gripper has released and that still moves with the arm."""
    released = state.table.grippers[arm].left
    if released is None:
        return
    frame, opened = released
    link, name = state.table.links[frame], state.name(frame)
    if link is None or link.parent != arm:
        return
    text = f"`{name}` is still attached to {arm}, whose gripper has released it"
    here = (Label(opened, "they open here"), *labels(link.span, "affixed here"))
    advice = f"write `UNFIX {name} FROM {arm}` after OPEN"
    state.report("W209", text, node.span, f"{name} moves along", secondary=here, advice=advice)


def _affix_labels(state: FlowState, moved: str | None, arm: str) -> tuple[Label, ...]:
    """Return labels on the AFFIX that attached a moved frame, or an ancestor, to its arm; none for the arm itself."""
    if moved is None or is_arm(moved):
        return ()
    for name in (moved, *state.table.ancestors(moved)):
        link = state.table.links[name]
        if link is not None and link.parent == arm:
            return labels(link.span, f"{state.name(name)} was affixed to {arm} here")
    return ()


def _arm_of_frame(state: FlowState, node: tree.Move, moved: str | None) -> tuple[str | None, bool]:
    """Return the arm that carries a moved frame; where none does, affix it to the arm that has grasped it.

    Returns:
        The arm, None where it is unknown, and whether the AFFIX is implied.
    """
    if moved is None or state.table.is_parent_unknown(moved):
        return None, False
    if (arm := state.table.carrying_arm(moved)) is not None:
        return arm, False
    holder = state.table.holding_arm(moved)
    if holder is None:
        _report_not_carried(state, node, moved)
    if holder in (None, UNKNOWN):
        return None, False
    _imply_affix(state, node, moved, holder)
    return holder, True


def _imply_affix(state: FlowState, node: tree.Move, moved: str, arm: str) -> None:
    name, grip = state.name(moved), state.table.grips[arm]
    text, implied = f"`{name}` is moved, but no AFFIX attaches it to {arm}", f"`AFFIX {name} TO {arm}`"
    here, advice = labels(grip.span if grip else None, f"{arm} grasped it here"), f"write {implied} after GRASP"
    severity = Severity.ERROR if state.strict else Severity.WARNING
    label = f"{implied} is implied"
    state.report("W201", text, node.span, label, secondary=here, advice=advice, severity=severity)
    warn_of_implicit_unfix(state, moved, arm, node.span)
    state.table.affix(moved, arm, node.span)


def _report_not_carried(state: FlowState, node: tree.Move, moved: str) -> None:
    link, name, here = state.table.links[moved], state.name(moved), state.table.affix_labels(moved, "affixed here")
    parent = state.name(link.parent) if link and link.parent else WORLD
    text, label = f"`{name}` cannot be moved: it is not affixed to an arm", f"is attached to {parent}, not to an arm"
    last = state.last[LAST]
    arm = state.some_arm() if last in (None, UNKNOWN) else last
    advice = "" if moved == WORLD else f"grasp it and write `AFFIX {name} TO {arm}` first"
    state.report("E301", text, node.moved.span, label, secondary=here, advice=advice)


def _note_relative_goal(state: FlowState, node: tree.Move, arm: str) -> None:
    text = f"the goal `{expression_text(node.goal)}` is attached to {arm} and moves with it"
    note = "the pose of the goal at the start of the motion is used, so the motion is relative to the tool"
    state.report("L302", text, node.goal.span, f"is attached to {arm}", note=note)


def _check_joints(state: FlowState, goal: tree.Function, arm: str | None) -> None:
    """Check joint positions against the arm, as far as the cell says what that is."""
    cell, name = state.cell, joint_target(state.now.scope, goal)
    if cell is None or arm is None:
        return
    if name is not None:
        if cell.targets is not None and name.key not in cell.targets:
            note = f"joint targets of the cell: {', '.join(sorted(cell.targets)) or 'none'}"
            text, advice = f"the cell has no joint target `{name.text}`", did_you_mean(closest(name.text, cell.targets))
            state.report("E246", text, name.span, "no such joint target", note=note, advice=advice)
        elif cell.targets is not None and cell.targets[name.key] != arm:
            text = f"joint target `{name.text}` is one of {cell.targets[name.key]}, not of {arm}"
            state.report("E246", text, name.span, "of another arm")
        return
    joints = cell.joints.get(arm)
    if joints is None or not goal.arguments:
        return
    if len(joints) != len(goal.arguments):
        text = f"{arm} has {counted(len(joints), 'joint')}, but JOINTS is given {len(goal.arguments)}"
        state.report("E246", text, goal.span, f"expected {len(joints)} positions")
        return
    for number, (argument, letter) in enumerate(zip(goal.arguments, joints, strict=True), 1):
        if isinstance(argument, tree.Number) and argument.unit is not None:
            kind, verb = ("angle", "turns") if letter == "R" else ("length", "slides")
            if dimension(argument.unit) != kind:
                text = f"joint {number} of {arm} {verb}, but `{argument.text}` is no {kind}"
                state.report("E246", text, argument.span, f"expected {'an' if kind == 'angle' else 'a'} {kind}")


def _check_tracking(state: FlowState, clause: tree.Tracking) -> None:
    """Check that a frame which is tracked moves, as far as the cell says so."""
    frame = state.frame(clause.point)
    if frame is None or state.cell is None or state.cell.moving is None or frame in state.cell.moving:
        require_value(state, clause.point)
        return
    if not isinstance(clause.point, tree.Name) or state.now.scope.is_poisoned(clause.point.key):
        return
    note = f"frames of the cell that move: {', '.join(sorted(state.cell.moving)) or 'none'}"
    text = f"`{state.name(frame)}` is no frame of the cell that moves"
    advice = did_you_mean(closest(frame, state.cell.moving))
    state.report("E249", text, clause.point.span, "nothing to track", note=note, advice=advice)


def _check_smooth(state: FlowState, node: tree.Move, clause: tree.Smoothly, arm: str | None) -> None:
    """Check that the vibrations of an arm can be shaped on the way that a MOVE goes, as far as the cell says so."""
    cell = state.cell
    if cell is None or arm is None or arm not in cell.arms:
        return
    if cell.flexible is not None and arm not in cell.flexible:
        text, advice = no_flexible_gear(arm)
        state.report("E259", text, clause.span, "nothing vibrates", advice=advice)
    elif arm in cell.flat and (line := next((it for it in node.clauses if isinstance(it, _LINES)), None)):
        text, advice = no_flat_line(arm)
        here = labels(clause.span, "shaped against vibrations here")
        state.report("E258", text, line.span, "a straight line", secondary=here, advice=advice)


def check_speed(state: FlowState, node: tree.Expression) -> None:
    """Check that a SPEED has a value, one in the range of speeds where it is known."""
    require_value(state, node)
    known = state.number(node)
    if isinstance(node, tree.Number) or known is None or not isinstance(node, tree.Name):
        return
    value, span = known
    slot = state.slot_of(node.key)
    if LOWEST_SPEED <= value <= HIGHEST_SPEED or slot is None or state.now.scope.is_poisoned(node.key):
        return
    if state.is_first_report(slot):
        text = f"speed `{node.text}` = {value:.12g} is outside {LOWEST_SPEED:g}..{HIGHEST_SPEED:g}"
        here = labels(span, f"{node.text} gets its value here")
        state.report("E207", text, node.span, "out of range", secondary=here, note=SPEED_NOTE)


def _targets(node: tree.Move) -> list[tree.Expression]:
    """Return every target of a MOVE."""
    targets = [node.goal]
    for clause in node.clauses:
        if isinstance(clause, tree.Via):
            targets += clause.points
        elif isinstance(clause, tree.Approach | tree.Departure):
            targets.append(clause.point)
    return targets


STEPS: Steps = {tree.Move: move}
