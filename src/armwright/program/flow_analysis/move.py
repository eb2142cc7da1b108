"""MOVE: which arm moves what, whether it can, and where it arrives."""

from armwright.program.flow_analysis import plausibility
from armwright.program.flow_analysis.context import Context, Steps
from armwright.program.flow_analysis.definite_assignment import need, need_indices
from armwright.program.flow_analysis.facts import UNKNOWN
from armwright.program.flow_analysis.frames import leaves
from armwright.program.flow_analysis.state import FlowState
from armwright.program.language.diagnostic import Label, Severity, labels
from armwright.program.language.names import is_any_element, is_arm
from armwright.program.language.units import HIGHEST_SPEED, LOWEST_SPEED
from armwright.program.semantics.cell_symbols import WORLD
from armwright.program.semantics.expression_types import expression_text
from armwright.program.semantics.move import SPEED_NOTE
from armwright.program.syntax import tree


def move(context: Context, node: tree.Move) -> None:
    """Follow a MOVE; what its actions do may happen or not, while the arm moves."""
    state = context.state
    arm = _begin(state, node)
    guards = [clause for clause in node.clauses if isinstance(clause, tree.On)]
    for guard in guards:
        need(state, guard.condition)
        writes = context.writes(guard.action)
        if not state.first:
            mark = state.facts.checkpoint()
            if arm is None:
                state.lose_arms(grasps=False)
            else:
                state.table.arrive(arm, UNKNOWN, None)
            with state.perhaps():
                context.follow(guard.action)
            state.facts.take_back(mark)
            state.over = False
        says, advice = "it gets a value in this action, which may not run", "give it a value before the MOVE"
        state.forget_undone(writes, state.parting(guard.head, says, advice))
    halted = any(context.writes(guard.action).halts for guard in guards)
    _end(state, node, arm, halted=halted)


def _begin(state: FlowState, node: tree.Move) -> str | None:
    """Check what a MOVE needs to begin; return the arm, None where it is unknown."""
    state.mention(node.moved)
    need_indices(state, node.moved)
    moved = state.frame(node.moved)
    implied = False
    if moved is not None and is_arm(moved):
        arm: str | None = moved
    else:
        arm, implied = _carrier(state, node, moved)
    state.record(node, arm, implied=implied)
    need(state, *_targets(node))
    plausibility.lengths(state, *_targets(node))
    for clause in node.clauses:
        if isinstance(clause, tree.Speed):
            _speed(state, clause.value)
        elif isinstance(clause, tree.Blend | tree.Duration):
            need(state, clause.value)
    if arm is None:
        return None
    _left_hanging(state, node, arm)
    state.use(arm, node.span.to(node.moved.span), moves=True, hung=_hung(state, moved, arm))
    goal = state.frame(node.goal)
    if goal is not None and not state.table.unknown(goal) and state.table.carrier(goal) == arm:
        _relative(state, node, arm)
    return arm


def _end(state: FlowState, node: tree.Move, arm: str | None, *, halted: bool) -> None:
    """Take note of where a MOVE has brought what.

    Args:
        state: the state.
        node: the MOVE.
        arm: as ``_begin`` gave it.
        halted: whether an action may have ended the motion meanwhile.
    """
    moved = state.frame(node.moved)
    if arm is None or moved is None:
        if moved is None or state.table.unknown(moved) or state.table.holder(moved) == UNKNOWN:
            # An arm has moved, but nobody knows which: that is no reason to say that none has been used.
            state.lose_arms(grasps=False)
            if moved is not None:
                state.table.forget(moved)
        return
    frame: str | None = moved
    if moved == arm:
        goal = state.frame(node.goal)
        frame = UNKNOWN if halted or (goal is not None and is_any_element(goal)) else goal
        if goal is None and not isinstance(node.goal, tree.Binary | tree.Matrix | tree.Function):
            # Something was reported of the goal, or it is given to a procedure that is not followed.
            frame = UNKNOWN
    state.table.arrive(arm, frame, node.span if moved == arm else None)


def _left_hanging(state: FlowState, node: tree.Move, arm: str) -> None:
    """Warn of a frame that the fingers have released, and that follows the arm all the same."""
    released = state.table.hands[arm].left
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


def _hung(state: FlowState, moved: str | None, arm: str) -> tuple[Label, ...]:
    """Return where what is moved, or what it hangs on, was hung on its arm; nothing for the arm itself."""
    if moved is None or is_arm(moved):
        return ()
    for name in (moved, *state.table.above(moved)):
        link = state.table.links[name]
        if link is not None and link.parent == arm:
            return labels(link.span, f"{state.name(name)} was affixed to {arm} here")
    return ()


def _carrier(state: FlowState, node: tree.Move, moved: str | None) -> tuple[str | None, bool]:
    """Return the arm that carries what is moved; hang it on the arm that has grasped it, if nothing else does.

    Returns:
        The arm, None where it is unknown, and whether the frame hangs there only from now on.
    """
    if moved is None or state.table.unknown(moved):
        return None, False
    if (arm := state.table.carrier(moved)) is not None:
        return arm, False
    holder = state.table.holder(moved)
    if holder == UNKNOWN:
        return None, False
    if holder is None:
        _not_carried(state, node, moved)
    else:
        _imply(state, node, moved, holder)
    return holder, holder is not None


def _imply(state: FlowState, node: tree.Move, moved: str, arm: str) -> None:
    name, grip = state.name(moved), state.table.grips[arm]
    state.report(
        "W201",
        f"`{name}` is moved, but no AFFIX attaches it to {arm}",
        node.span,
        f"`AFFIX {name} TO {arm}` is implied",
        secondary=labels(grip.span if grip else None, f"{arm} grasped it here"),
        advice=f"write `AFFIX {name} TO {arm}` after GRASP",
        severity=Severity.ERROR if state.strict else Severity.WARNING,
    )
    leaves(state, moved, arm, node.span)
    state.table.hang(moved, arm, node.span)


def _not_carried(state: FlowState, node: tree.Move, moved: str) -> None:
    link, name, here = state.table.links[moved], state.name(moved), state.table.affixed(moved, "affixed here")
    parent = state.name(link.parent) if link and link.parent else WORLD
    text, label = f"`{name}` cannot be moved: it is not affixed to an arm", f"is attached to {parent}, not to an arm"
    arm = state.last_arm() or state.some_arm()
    advice = "" if moved == WORLD else f"grasp it and write `AFFIX {name} TO {arm}` first"
    state.report("E301", text, node.moved.span, label, secondary=here, advice=advice)


def _relative(state: FlowState, node: tree.Move, arm: str) -> None:
    text = f"the goal `{expression_text(node.goal)}` is attached to {arm} and moves with it"
    note = "the pose of the goal at the start of the motion is used, so the motion is relative to the tool"
    state.report("L302", text, node.goal.span, f"is attached to {arm}", note=note)


def _speed(state: FlowState, node: tree.Expression) -> None:
    need(state, node)
    known = state.number(node)
    if isinstance(node, tree.Number) or known is None or not isinstance(node, tree.Name):
        return
    value, span = known
    slot = state.bound(node.key)
    if LOWEST_SPEED <= value <= HIGHEST_SPEED or slot is None or state.now.scope.is_poisoned(node.key):
        return
    if state.settle(slot):
        text = f"speed `{node.text}` = {value:.12g} is outside {LOWEST_SPEED:g}..{HIGHEST_SPEED:g}"
        here = labels(span, f"{node.text} gets its value here")
        state.report("E207", text, node.span, "out of range", secondary=here, note=SPEED_NOTE)


def _targets(node: tree.Move) -> list[tree.Expression]:
    """Return every frame that a MOVE comes to."""
    targets = [node.goal]
    for clause in node.clauses:
        if isinstance(clause, tree.Via):
            targets += clause.points
        elif isinstance(clause, tree.Approach | tree.Departure):
            targets.append(clause.point)
    return targets


STEPS: Steps = {tree.Move: move}
