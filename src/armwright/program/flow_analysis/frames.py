"""AFFIX, UNFIX and assignments: what has a value, and what hangs on what."""

from collections.abc import Mapping

from armwright.program.flow_analysis import plausibility, poses
from armwright.program.flow_analysis.context import Step, of_state
from armwright.program.flow_analysis.definite_assignment import need, need_indices
from armwright.program.flow_analysis.state import Course
from armwright.program.language.diagnostic import Label, Severity
from armwright.program.language.kinds import VariableKind
from armwright.program.language.names import is_any, is_arm
from armwright.program.language.source import Span
from armwright.program.semantics.cell_symbols import WORLD
from armwright.program.semantics.expression_types import written
from armwright.program.syntax import tree


def assign(course: Course, node: tree.Assign) -> None:
    """Give a variable a value."""
    need(course, node.value)
    need_indices(course, node.target)
    target = node.target
    frame = course.frame(target)
    if frame is not None:
        plausibility.lengths(course, node.value)
        stands = poses.certain(course, node.value)
        place(course, frame, target, node.span)
        course.table.stand(frame, stands)
        plausibility.placed(course, frame, node.value)
        return
    if (name := course.variable(target, VariableKind.SCALAR)) is not None:
        course.give(name, course.number(node.value), node.span)
    elif (name := course.variable(target, VariableKind.TRANS)) is not None:
        plausibility.lengths(course, node.value)
        step = poses.certain(course, node.value)
        course.give(name, None, node.span)
        if not is_any(name):
            course.steps.put(name, step)


def place(course: Course, frame: str, node: tree.Expression, span: Span) -> None:
    """Give a frame another place; say that nothing can, where it hangs rigidly on what no value moves."""
    if is_arm(frame) or frame == WORLD:
        return
    leader = frame if is_any(frame) else course.table.leader(frame)
    if leader is not None and leader != frame and (is_arm(leader) or leader == WORLD):
        link = course.table.links[frame]
        name = written(node)
        course.say(
            "E310",
            f"`{name}` hangs rigidly on {course.name(leader)}, which no value moves",
            node.span,
            "cannot be placed",
            secondary=(Label(link.span, "hung rigidly here"),) if link and link.span else (),
            helps=(f"leave RIGIDLY out, or write `UNFIX {name}` before this",),
        )
        return
    course.table.assign(frame, span)


# ---- AFFIX ---------------------------------------------------------------------------------------------------------


def affix(course: Course, node: tree.Affix) -> None:
    """Hang a frame on another."""
    course.mention(node.child, node.parent)
    plausibility.lengths(course, node.at)
    child, parent = course.frame(node.child), course.frame(node.parent)
    if node.at is None:
        need(course, node.child)
    else:
        need_indices(course, node.child)
        need(course, node.at)
    need(course, node.parent)
    if child is None or is_arm(child) or child == WORLD:
        return
    if parent is None:
        course.table.forget(child)
        return
    if course.table.would_ring(child, parent):
        _ring(course, node, child, parent)
        return
    leaves(course, child, parent, node.span)
    step = course.table.step(child, parent) if node.at is None else poses.certain(course, node.at)
    if is_any(child):
        course.table.forget(child)
        return
    if node.at is None:
        _late(course, node, child, parent)
        plausibility.grasped(course, node, child, parent)
    else:
        course.table.displace(child)
    course.table.hang(child, parent, node.link, rigid=node.rigid, step=step)


def leaves(course: Course, child: str, parent: str, span: Span) -> None:
    """Warn when a frame leaves the one it hangs on without UNFIX."""
    link = None if is_any(child) else course.table.links[child]
    if link is None or link.parent is None or link.parent == parent or _may_be(course, parent, link.parent):
        return
    name = course.name
    course.say(
        "W203",
        f"`{name(child)}` still hangs on `{name(link.parent)}`",
        span,
        f"from here on it hangs on {name(parent)}",
        secondary=(Label(link.span, f"affixed to {name(link.parent)} here"),) if link.span else (),
        notes=() if link.span else (f"in the cell it hangs on {name(link.parent)}",),
        helps=(f"write `UNFIX {name(child)} FROM {name(link.parent)}` first to say so",),
        severity=Severity.WARNING,
    )


def _may_be(course: Course, one: str, other: str) -> bool:
    """Whether two different names may be names of one frame: parameters of a call of which nothing is known."""
    if is_any(one) or is_any(other):
        return True
    alias = course.facts.may_be_another
    return (alias(one) and not is_arm(one)) or (alias(other) and not is_arm(other))


def _ring(course: Course, node: tree.Affix, child: str, parent: str) -> None:
    name = course.name
    chain = []
    for below in (parent, *course.table.above(parent)):
        if below == child:
            break
        link = course.table.links[below]
        if link and link.span and link.parent:
            chain.append(Label(link.span, f"{name(below)} hangs on {name(link.parent)}"))
    on = "itself" if child == parent else name(parent)
    course.say(
        "E305",
        "this AFFIX would close a ring",
        node.link,
        f"{name(child)} cannot hang on {on}",
        secondary=tuple(chain),
        notes=("frames form a tree; each hangs on one other and in the end on WORLD",),
    )


def _late(course: Course, node: tree.Affix, child: str, parent: str) -> None:
    """Point at a parent that was moved after the child got its place, but before it hung there."""
    above, below = course.table.assigned[parent], course.table.assigned[child]
    if above is None or below is None or not above.moved or above.order < below.order:
        return
    name = course.name
    course.say(
        "L303",
        f"`{name(parent)}` was moved before `{name(child)}` hung on it",
        node.link,
        f"{name(child)} follows only from here on",
        secondary=(Label(above.span, f"{name(child)} did not follow this"),),
        helps=("put the AFFIX before the assignment, or give the step with AT",),
        severity=Severity.WARNING,
    )


# ---- UNFIX ---------------------------------------------------------------------------------------------------------


def unfix(course: Course, node: tree.Unfix) -> None:
    """Cut a frame loose."""
    course.mention(node.parent)
    need_indices(course, node.child, node.parent)
    child, table = course.frame(node.child), course.table
    if child is None or is_arm(child) or child == WORLD:
        return
    parent = None if node.parent is None else course.frame(node.parent)
    if parent is not None and not is_any(child):
        link = table.links[child]
        above = WORLD if link is None else link.parent
        if above not in (None, parent) and not _may_be(course, parent, above or WORLD):
            _not_affixed(course, node, child)
            return
    if node.parent is None or parent == WORLD:
        need(course, node.child)
    table.cut(child)


def _not_affixed(course: Course, node: tree.Unfix, child: str) -> None:
    assert node.parent is not None  # noqa: S101 - it has a name in the frame table
    link, name = course.table.links[child], course.name
    on = link.parent if link else None
    where = Label(link.span, f"{name(child)} was affixed to {name(on)} here") if link and link.span and on else None
    instead = f"write `UNFIX {name(child)} FROM {name(on)}`" if on else "leave this UNFIX out"
    course.say(
        "E306",
        f"`{name(child)}` is not affixed to `{written(node.parent)}`",
        node.parent.span,
        "not the frame it hangs on" if on else f"{name(child)} hangs on nothing",
        secondary=(where,) if where else (),
        helps=(instead,),
    )


STEPS: Mapping[type, Step] = {tree.Assign: of_state(assign), tree.Affix: of_state(affix), tree.Unfix: of_state(unfix)}
