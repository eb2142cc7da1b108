"""MOVE: which arm moves what, whether it can, and where it arrives."""

from collections.abc import Mapping

from armwright.program.flow_analysis import plausibility
from armwright.program.flow_analysis.context import Context, Step
from armwright.program.flow_analysis.definite_assignment import need, need_indices
from armwright.program.flow_analysis.facts import UNKNOWN
from armwright.program.flow_analysis.frames import leaves
from armwright.program.flow_analysis.state import Course
from armwright.program.language.diagnostic import Label, Severity
from armwright.program.language.names import is_any, is_arm
from armwright.program.language.units import HIGHEST_SPEED, LOWEST_SPEED
from armwright.program.semantics.cell_symbols import WORLD
from armwright.program.semantics.expression_types import written
from armwright.program.semantics.move import SPEED_NOTE
from armwright.program.syntax import tree


def move(context: Context, node: tree.Move) -> None:
    """Follow a MOVE; what its actions do may happen or not, while the arm is on its way."""
    course = context.course
    arm = _begin(course, node)
    guards = [clause for clause in node.clauses if isinstance(clause, tree.On)]
    for guard in guards:
        need(course, guard.condition)
        writes = context.writes(guard.action)
        if not course.first:
            mark = course.facts.mark()
            if arm is None:
                course.lose_arms(grasps=False)
            else:
                course.table.arrive(arm, UNKNOWN, None)
            with course.perhaps():
                context.follow(guard.action)
            course.facts.take_back(mark)
            course.over = False
        says, advice = "it gets one in this action, which may not happen", "give it a value before the MOVE"
        course.forget_undone(writes, course.parting(guard.head, says, advice))
    halted = any(context.writes(guard.action).halts for guard in guards)
    _end(course, node, arm, halted=halted)


def _begin(course: Course, node: tree.Move) -> str | None:
    """Look at what a MOVE needs to begin; return the arm, None where it is unknown."""
    course.mention(node.moved)
    need_indices(course, node.moved)
    moved = course.frame(node.moved)
    implied = False
    if moved is not None and is_arm(moved):
        arm: str | None = moved
    else:
        arm, implied = _carrier(course, node, moved)
    course.record(node, arm, implied=implied)
    need(course, *_places(node))
    plausibility.lengths(course, *_places(node))
    for clause in node.clauses:
        if isinstance(clause, tree.Speed):
            _speed(course, clause.value)
        elif isinstance(clause, tree.Blend | tree.Duration):
            need(course, clause.value)
    if arm is None:
        return None
    _left_hanging(course, node, arm)
    course.use(arm, node.span.to(node.moved.span), moves=True, hung=_hung(course, moved, arm))
    goal = course.frame(node.goal)
    if goal is not None and not course.table.unknown(goal) and course.table.carrier(goal) == arm:
        _relative(course, node, arm)
    return arm


def _end(course: Course, node: tree.Move, arm: str | None, *, halted: bool) -> None:
    """Take note of where a MOVE has brought what.

    Args:
        course: the state.
        node: the MOVE.
        arm: as ``_begin`` gave it.
        halted: whether an action may have ended the motion on the way.
    """
    moved = course.frame(node.moved)
    if arm is None or moved is None:
        if moved is None or course.table.unknown(moved) or course.table.holder(moved) == UNKNOWN:
            # An arm has moved, but nobody knows which: that is no reason to say that none has been used.
            course.lose_arms(grasps=False)
            if moved is not None:
                course.table.forget(moved)
        return
    at: str | None = moved
    if moved == arm:
        goal = course.frame(node.goal)
        at = UNKNOWN if halted or (goal is not None and is_any(goal)) else goal
        if goal is None and not isinstance(node.goal, tree.Binary | tree.Matrix | tree.Function):
            # Something was reported of the goal, or it is given to a procedure in a way that is not followed.
            at = UNKNOWN
    course.table.arrive(arm, at, node.span if moved == arm else None)


def _left_hanging(course: Course, node: tree.Move, arm: str) -> None:
    """Warn of a frame that the fingers have let go, and that follows the arm all the same."""
    left = course.table.hands[arm].left
    if left is None:
        return
    frame, opened = left
    link, name = course.table.links[frame], course.name(frame)
    if link is None or link.parent != arm:
        return
    course.say(
        "W209",
        f"`{name}` still hangs on {arm}, whose fingers have let it go",
        node.span,
        f"{name} goes along",
        secondary=(Label(opened, "they open here"), *((Label(link.span, "affixed here"),) if link.span else ())),
        helps=(f"write `UNFIX {name} FROM {arm}` behind OPEN",),
        severity=Severity.WARNING,
    )


def _hung(course: Course, moved: str | None, arm: str) -> tuple[Label, ...]:
    """Return where what is moved, or what it hangs on, was hung on its arm; nothing for the arm itself."""
    if moved is None or is_arm(moved):
        return ()
    for name in (moved, *course.table.above(moved)):
        link = course.table.links[name]
        if link is not None and link.parent == arm:
            return (Label(link.span, f"{course.name(name)} was affixed to {arm} here"),) if link.span else ()
    return ()


def _carrier(course: Course, node: tree.Move, moved: str | None) -> tuple[str | None, bool]:
    """Return the arm that carries what is moved; hang it on the arm that has grasped it, if nothing else does.

    Returns:
        The arm, None where it is unknown, and whether the frame hangs there only from now on.
    """
    if moved is None or course.table.unknown(moved):
        return None, False
    if (arm := course.table.carrier(moved)) is not None:
        return arm, False
    holder = course.table.holder(moved)
    if holder == UNKNOWN:
        return None, False
    if holder is None:
        _not_carried(course, node, moved)
    else:
        _imply(course, node, moved, holder)
    return holder, holder is not None


def _imply(course: Course, node: tree.Move, moved: str, arm: str) -> None:
    name, grip = course.name(moved), course.table.grips[arm]
    course.say(
        "W201",
        f"`{name}` is moved, but no AFFIX hangs it on {arm}",
        node.span,
        f"`AFFIX {name} TO {arm}` is implied",
        secondary=(Label(grip.span, f"{arm} grasped it here"),) if grip and grip.span else (),
        helps=(f"write `AFFIX {name} TO {arm}` after GRASP",),
        severity=Severity.ERROR if course.strict else Severity.WARNING,
    )
    leaves(course, moved, arm, node.span)
    course.table.hang(moved, arm, node.span)


def _not_carried(course: Course, node: tree.Move, moved: str) -> None:
    link, name = course.table.links[moved], course.name(moved)
    course.say(
        "E301",
        f"`{name}` cannot be moved: it is not affixed to an arm",
        node.moved.span,
        f"hangs on {course.name(link.parent) if link and link.parent else WORLD}, not on an arm",
        secondary=(Label(link.span, "affixed here"),) if link and link.span else (),
        helps=(f"grasp it and write `AFFIX {name} TO {course.last_arm() or course.some_arm()}` first",)
        if moved != WORLD
        else (),
    )


def _relative(course: Course, node: tree.Move, arm: str) -> None:
    course.say(
        "L302",
        f"`{written(node.goal)}` moves together with {arm}, which is to come to it",
        node.goal.span,
        f"hangs on {arm}",
        notes=("the goal is taken where it is when the motion starts, so this is a relative motion",),
        severity=Severity.WARNING,
    )


def _speed(course: Course, node: tree.Expression) -> None:
    need(course, node)
    known = course.number(node)
    if isinstance(node, tree.Number) or known is None or not isinstance(node, tree.Name):
        return
    value, span = known
    kept = course.bound(node.key)
    if LOWEST_SPEED <= value <= HIGHEST_SPEED or kept is None or course.now.scope.is_poisoned(node.key):
        return
    if course.settle(kept):
        course.say(
            "E207",
            f"speed `{node.text}` = {value:.12g} is outside {LOWEST_SPEED:g}..{HIGHEST_SPEED:g}",
            node.span,
            "out of range",
            secondary=(Label(span, f"{node.text} gets its value here"),),
            notes=(SPEED_NOTE,),
        )


def _places(node: tree.Move) -> list[tree.Expression]:
    """Return every frame that a MOVE comes to."""
    places = [node.goal]
    for clause in node.clauses:
        if isinstance(clause, tree.Via):
            places += clause.points
        elif isinstance(clause, tree.Approach | tree.Departure):
            places.append(clause.point)
    return places


STEPS: Mapping[type, Step] = {tree.Move: move}
