"""What arms, tools and sensors do in the course of a program: who carries what, and whether it can be moved."""

from armwright.errors import closest
from armwright.program import tree
from armwright.program.code import HIGHEST_SPEED, LOWEST_SPEED, Kind
from armwright.program.course import Course
from armwright.program.diagnostics import Label, Severity
from armwright.program.hanging import is_arm
from armwright.program.known import WORLD
from armwright.program.moves import SPEED_NOTE
from armwright.program.source import Span


def grasp(course: Course, grasp: tree.Grasp) -> None:
    """Close the fingers of an arm; say which when no arm is named."""
    course.mention(grasp.arm)
    arm = grasp.arm.key if isinstance(grasp.arm, tree.ArmName) else course.last_arm
    if grasp.arm is not None and not isinstance(grasp.arm, tree.ArmName):
        return
    if arm is None or course.arm_unknown:
        if not course.arm_unknown:
            help_ = f"write `GRASP {course.some_arm()}`"
            text = "GRASP does not say which arm, and none has been used yet"
            course.found.say("E307", text, grasp.span, "which arm?", helps=(help_,))
        return
    course.arms[course.index] = arm
    hand = course.table.hand(arm)
    _closed_on_arrival(course, arm)
    hand.open, hand.holds, hand.grasp = False, hand.at, grasp.span


def _closed_on_arrival(course: Course, arm: str) -> None:
    """Point at a hand that came to its object without room for it between the fingers."""
    hand = course.table.hand(arm)
    opened_late = hand.arrived_open is None and hand.opened is not None
    never_opened = hand.arrived_open is False and hand.opened is None
    if hand.arrival is None or hand.at is None or not (opened_late or never_opened):
        return
    course.found.say(
        "L301",
        f"{arm} {'may come' if opened_late else 'comes'} to `{course.name(hand.at)}` with closed fingers",
        hand.arrival,
        "it arrives here",
        secondary=(Label(hand.opened, "they open only here"),) if hand.opened else (),
        helps=(f"write `OPEN {arm}` before this MOVE",),
        severity=Severity.WARNING,
    )


def read(course: Course, target: tree.Name, span: Span) -> None:
    """Ask the camera for a frame."""
    if course.symbols.frame(target) is None or target.key == WORLD:
        return
    visions = course.cell.visions if course.cell else None
    if visions is not None and target.key not in visions and target.key not in course.settled:
        course.settled.add(target.key)
        near = closest(target.text, visions)
        course.found.say(
            "W601",
            f"the camera of the cell has no answer for `{target.text}`",
            target.span,
            "will not be found",
            helps=(f"did you mean `{near}`?",) if near else (),
            severity=Severity.WARNING,
        )
    course.table.assign(target.key, course.index, span)


def operate(course: Course, device: tree.Name) -> None:
    """Switch a device on."""
    devices = course.cell.devices if course.cell else None
    if devices is None or device.key in (known := {name.upper() for name in devices}):
        return
    near = closest(device.text, known)
    listed = ", ".join(sorted(known)) or "none"
    course.found.say(
        "R602",
        f"the cell has no device `{device.text}`",
        device.span,
        "no such device",
        notes=(f"devices of the cell: {listed}",),
        helps=(f"did you mean `{near}`?",) if near else (),
    )


def move(course: Course, move: tree.Move) -> None:
    """Move an arm and what hangs on it."""
    course.mention(move.moved)
    moved, goal = course.symbols.frame(move.moved), course.symbols.frame(move.goal)
    arm = moved if moved and is_arm(moved) else _carrier(course, move, moved)
    for node in _places(move):
        course.need_value(node)
    for clause in move.clauses:
        if isinstance(clause, tree.Speed):
            _speed(course, clause.value)
    if arm is None or moved is None:
        # An arm has moved, but nobody knows which: that is no reason to say that none has been used.
        lost = moved is None or course.table.unknown(moved)
        course.arm_unknown = course.arm_unknown or (lost and course.last_arm is None)
        return
    course.arms[course.index] = arm
    course.last_arm, course.arm_unknown = arm, False
    if goal and course.table.carrier(goal) == arm and not course.table.unknown(goal):
        _relative(course, move, goal, arm)
    course.table.arrive(arm, goal if moved == arm else moved, move.span if moved == arm else None)


def _carrier(course: Course, move: tree.Move, moved: str | None) -> str | None:
    """Return the arm that carries what is moved; hang it on the arm that has grasped it, if nothing else does."""
    if moved is None or course.table.unknown(moved):
        return None
    if (arm := course.table.carrier(moved)) is not None:
        return arm
    for arm, hand in course.table.hands.items():
        if hand.holds == moved:
            _imply(course, move, moved, arm)
            return arm
    _not_carried(course, move, moved)
    return None


def _imply(course: Course, move: tree.Move, moved: str, arm: str) -> None:
    name, grasp = course.name(moved), course.table.hand(arm).grasp
    course.found.say(
        "W201",
        f"`{name}` is moved, but no AFFIX hangs it on {arm}",
        move.span,
        f"`AFFIX {name} TO {arm}` is implied",
        secondary=(Label(grasp, f"{arm} grasped it here"),) if grasp else (),
        helps=(f"write `AFFIX {name} TO {arm}` after GRASP",),
        severity=Severity.ERROR if course.strict else Severity.WARNING,
    )
    leaves(course, moved, arm, move.span)
    course.table.hang(moved, arm, move.span)
    course.implied.add(course.index)


def leaves(course: Course, child: str, parent: str, span: Span) -> None:
    """Warn when a frame leaves the one it hangs on without UNFIX."""
    link = course.table.links.get(child)
    if link is None or link.parent == parent:
        return
    name = course.name
    course.found.say(
        "W203",
        f"`{name(child)}` still hangs on `{name(link.parent)}`",
        span,
        f"from here on it hangs on {name(parent)}",
        secondary=(Label(link.span, f"affixed to {name(link.parent)} here"),) if link.span else (),
        notes=() if link.span else (f"in the cell it hangs on {name(link.parent)}",),
        helps=(f"write `UNFIX {name(child)} FROM {name(link.parent)}` first to say so",),
        severity=Severity.WARNING,
    )


def _not_carried(course: Course, move: tree.Move, moved: str) -> None:
    assert isinstance(move.moved, tree.Name)  # noqa: S101 - an arm carries itself
    link, name = course.table.links.get(moved), course.name(moved)
    course.found.say(
        "E301",
        f"`{name}` cannot be moved: it is not affixed to an arm",
        move.moved.span,
        f"hangs on {course.name(link.parent) if link else WORLD}, not on an arm",
        secondary=(Label(link.span, "affixed here"),) if link and link.span else (),
        helps=(f"grasp it and write `AFFIX {name} TO {course.last_arm or course.some_arm()}` first",)
        if moved != WORLD
        else (),
    )


def _relative(course: Course, move: tree.Move, goal: str, arm: str) -> None:
    course.found.say(
        "L302",
        f"`{course.name(goal)}` moves together with {arm}, which is to come to it",
        move.goal.span,
        f"hangs on {arm}",
        notes=("the goal is taken where it is when the motion starts, so this is a relative motion",),
        severity=Severity.WARNING,
    )


def _speed(course: Course, node: tree.Number | tree.Mobile) -> None:
    if isinstance(node, tree.Number) or not course.need_number(node, Kind.SCALAR):
        return
    assert isinstance(node, tree.Name)  # noqa: S101 - nothing else is a scalar
    value, span = course.scalars.get(node.key, (None, node.span))
    if value is not None and not LOWEST_SPEED <= value <= HIGHEST_SPEED and node.key not in course.settled:
        course.settled.add(node.key)
        course.found.say(
            "E207",
            f"speed `{node.text}` = {value:.12g} is outside {LOWEST_SPEED:g}..{HIGHEST_SPEED:g}",
            node.span,
            "out of range",
            secondary=(Label(span, f"{node.text} gets its value here"),),
            notes=(SPEED_NOTE,),
        )


def _places(move: tree.Move) -> list[tree.Mobile]:
    """Return every frame that a MOVE comes to."""
    places = [move.goal]
    for clause in move.clauses:
        if isinstance(clause, tree.Via):
            places += clause.points
        elif isinstance(clause, tree.Approach | tree.Departure):
            places.append(clause.point)
    return places
