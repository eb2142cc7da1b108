"""What the statements do to the frames, one after the other, without any numbers: values, affixments, arms."""

import math
from collections.abc import Mapping

import attrs

from armwright.program import handling, tree
from armwright.program.code import Kind
from armwright.program.course import Course
from armwright.program.diagnostics import Diagnostic, Label, Severity
from armwright.program.hanging import is_arm
from armwright.program.known import WORLD, KnownCell
from armwright.program.names import Symbols


@attrs.frozen(kw_only=True)
class Flow:
    """What the translator wants to know of each statement, by its index.

    Attributes:
        arms: the arm that a MOVE moves or a GRASP closes.
        implied: MOVEs that hang the grasped frame on its arm first.
    """

    arms: Mapping[int, str]
    implied: frozenset[int]


def check(
    program: tree.Program,
    symbols: Symbols,
    spelling: Mapping[str, str],
    cell: KnownCell | None = None,
    *,
    strict: bool = False,
) -> tuple[Flow, list[Diagnostic]]:
    """Follow a program from statement to statement.

    Args:
        program: without errors of syntax.
        symbols: its names.
        spelling: how it writes them.
        cell: what it will act on; without one, frames may get their values later.
        strict: whether an AFFIX that is only implied is an error.

    Returns:
        What the translator needs, and what is wrong.
    """
    course = Course(symbols, spelling, cell, strict=strict)
    for index, statement in enumerate(program.statements):
        course.index = index
        _step(course, statement)
    return Flow(arms=course.arms, implied=frozenset(course.implied)), course.found


def _step(course: Course, statement: tree.Statement) -> None:
    match statement:
        case tree.Init():
            _init(course, statement)
        case tree.Affix():
            _affix(course, statement)
        case tree.Unfix():
            _unfix(course, statement)
        case tree.Move():
            handling.move(course, statement)
        case tree.Poison(names=names):
            course.table.forget(names)
            course.arm_unknown = course.arm_unknown or any(is_arm(name) for name in names)
            course.scalars.update(dict.fromkeys(names, (None, statement.span)))
            course.steps |= names
        case _:
            _tool_or_sensor(course, statement)


def _tool_or_sensor(course: Course, statement: tree.Statement) -> None:
    match statement:
        case tree.Open(arm=tree.ArmName() as arm):
            course.use_arm(arm)
            hand = course.table.hand(arm.key)
            hand.open, hand.opened, hand.holds = True, statement.span, None
        case tree.Grasp():
            handling.grasp(course, statement)
        case tree.ReadSystem(arm=tree.ArmName() as arm):
            course.use_arm(arm)
            # The sensors may find the arm elsewhere, and with it what hangs on it.
            course.table.displace(arm.key, by=arm.key)
        case tree.ReadVisions(target=tree.Name() as target):
            handling.read(course, target, statement.span)
        case tree.ReadVisions(target=tree.Poison(names=names)):
            course.table.forget(names)
        case tree.Operate(device=tree.Name() as device):
            handling.operate(course, device)
        case _:
            pass


def _init(course: Course, init: tree.Init) -> None:
    key = init.name.key
    kind = course.symbols.kinds.get(key)
    if kind is Kind.FRAME and key != WORLD and isinstance(init.name, tree.Name):
        course.table.assign(key, course.index, init.span)
    elif kind is Kind.TRANS:
        course.steps.add(key)
    elif kind is Kind.SCALAR:
        # What was reported before, an expression or a number with a unit, has no known value.
        value = init.value.value if isinstance(init.value, tree.Number) else math.nan
        course.scalars[key] = (None if math.isnan(value) else value, init.span)


def _affix(course: Course, affix: tree.Affix) -> None:
    course.mention(affix.child, affix.parent)
    child, parent = course.symbols.frame(affix.child), course.symbols.frame(affix.parent)
    if affix.at is None:
        course.need_value(affix.child)
    else:
        course.need_number(affix.at, Kind.TRANS)
    course.need_value(affix.parent)
    if child is None or is_arm(child) or child == WORLD:
        return
    if parent is None:
        course.table.forget([child])
        return
    if course.table.would_ring(child, parent):
        _ring(course, affix, child, parent)
        return
    handling.leaves(course, child, parent, affix.span)
    if affix.at is None:
        _late(course, affix, child, parent)
    else:
        course.table.displace(child)
    course.table.hang(child, parent, affix.link)


def _ring(course: Course, affix: tree.Affix, child: str, parent: str) -> None:
    name = course.name
    chain = []
    for below in (parent, *course.table.above(parent)):
        if below == child:
            break
        link = course.table.links[below]
        if link.span:
            chain.append(Label(link.span, f"{name(below)} hangs on {name(link.parent)}"))
    on = "itself" if child == parent else name(parent)
    course.found.say(
        "E305",
        "this AFFIX would close a ring",
        affix.link,
        f"{name(child)} cannot hang on {on}",
        secondary=tuple(chain),
        notes=("frames form a tree; each hangs on one other and in the end on WORLD",),
    )


def _late(course: Course, affix: tree.Affix, child: str, parent: str) -> None:
    """Point at a parent that was moved after the child got its place, but before it hung there."""
    above, below = course.table.assigned.get(parent), course.table.assigned.get(child)
    if above is None or below is None or not above.moved or above.order < below.order:
        return
    name = course.name
    course.found.say(
        "L303",
        f"`{name(parent)}` was moved before `{name(child)}` hung on it",
        affix.link,
        f"{name(child)} follows only from here on",
        secondary=(Label(above.span, f"{name(child)} did not follow this"),),
        helps=("put the AFFIX before the assignment, or give the step with AT",),
        severity=Severity.WARNING,
    )


def _unfix(course: Course, unfix: tree.Unfix) -> None:
    course.mention(unfix.parent)
    child, parent = course.symbols.frame(unfix.child), course.symbols.frame(unfix.parent)
    if child is None or is_arm(child) or child == WORLD:
        return
    link = course.table.links.get(child)
    if unfix.parent is None or (parent is not None and link is not None and link.parent == parent):
        course.table.cut(child)
    elif parent is not None and not course.table.unknown(child):
        _not_affixed(course, unfix, child)


def _not_affixed(course: Course, unfix: tree.Unfix, child: str) -> None:
    assert isinstance(unfix.parent, tree.Name | tree.ArmName)  # noqa: S101 - it has a name in the frame table
    link, name = course.table.links.get(child), course.name
    where = Label(link.span, f"{name(child)} was affixed to {name(link.parent)} here") if link and link.span else None
    instead = f"write `UNFIX {name(child)} FROM {name(link.parent)}`" if link else "leave this UNFIX out"
    course.found.say(
        "E306",
        f"`{name(child)}` is not affixed to `{unfix.parent.text}`",
        unfix.parent.span,
        "not the frame it hangs on" if link else f"{name(child)} hangs on nothing",
        secondary=(where,) if where else (),
        helps=(instead,),
    )
