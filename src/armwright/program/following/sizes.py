"""Lengths that cannot be meant: places in another unit than the program counts in, hands far from what they take.

Only places given by twelve numbers are known here, of frames that hang on nothing.
"""

import math

from armwright.program.following.course import Course
from armwright.program.following.hanging import UNKNOWN, is_any, is_arm
from armwright.program.meaning.units import convert
from armwright.program.messages.diagnostics import Label, Severity
from armwright.program.syntax import tree

_UNITS = {"M": "metres", "MM": "millimetres", "CM": "centimetres", "IN": "inches"}
_NUMBERS = 12
# A place this many times farther than an arm reaches is out of every robot's world.
_FAR = 50.0
# A place nearer to WORLD than this part of the reach that would be one in metres was typed in metres.
_NEAR, _LEAST, _MOST = 0.02, 0.05, 3.0
# No hand holds what is so far from it [m].
_AWAY = 0.2


def placed(course: Course, frame: str, node: tree.Assign) -> None:
    """Take note of a place that is given in numbers, and warn of one that cannot be meant."""
    value = node.value
    if not isinstance(value, tree.Matrix) or len(value.items) != _NUMBERS or is_any(frame):
        return
    numbers = [one for one in value.items[9:] if isinstance(one, tree.Number) and not math.isnan(one.value)]
    if len(numbers) < 3:
        return
    units = course.symbols.units
    p = tuple(convert(one, units) * units.metres for one in numbers)
    if course.table.links[frame] is None and not course.writing.rigid:
        course.table.spots.put(frame, p)
    reach = course.cell.reach if course.cell else None
    if reach is None:
        return
    away, typed = math.hypot(*p), math.hypot(*(one.value for one in numbers))
    bare = units.length != "M" and not any(one.unit for one in numbers)
    broken = any(one.value % 1 for one in numbers)
    near = bare and broken and 0 < away < _NEAR * reach and _LEAST * reach < typed < _MOST * reach
    if not near and away <= _FAR * reach:
        return
    span = numbers[0].span.to(numbers[-1].span)
    name = course.name(frame)
    course.say(
        "W208",
        f"`{name}` would be {_length(away)} from WORLD, in a cell whose arm reaches {_length(reach)}",
        span,
        f"{_UNITS[units.length]}",
        notes=(f"lengths in this program are {_UNITS[units.length]}",),
        helps=(_advice(course, numbers, near=near),),
        severity=Severity.WARNING,
    )


def _advice(course: Course, numbers: list[tree.Number], *, near: bool) -> str:
    if near:
        return f"write the lengths in {_UNITS[course.symbols.units.length]}, or with their unit: `{numbers[0].text}m`"
    if course.symbols.units.length == "M":
        return "put `UNITS MM ;` in front of BEGIN if they are millimetres, or write them with their unit"
    return f"write the lengths in {_UNITS[course.symbols.units.length]}"


def _length(metres: float) -> str:
    return f"{metres:.3g} m" if metres >= 1 else f"{metres * 1e3:.3g} mm"


def grasped(course: Course, node: tree.Affix, child: str, arm: str) -> None:
    """Warn of a frame that is hung on a hand which has closed at quite another place."""
    table = course.table
    if not is_arm(arm) or is_any(child) or table.grips[arm] is None:
        return
    at = table.hands[arm].at
    if at is None or at in (UNKNOWN, child) or is_any(at) or is_arm(at):
        return
    here, there = table.spots[at], table.spots[child]
    if here is None or there is None or table.links[at] is not None or table.links[child] is not None:
        return
    away = math.dist(here, there)
    if away <= _AWAY:
        return
    name, hand = course.name, table.hands[arm]
    course.say(
        "W210",
        f"`{name(child)}` is {_length(away)} away from the hand of {arm}",
        node.link,
        f"the hand stands at {name(at)}",
        secondary=(Label(hand.arrival, f"it came to {name(at)} here"),) if hand.arrival else (),
        helps=(f"write `AFFIX {name(at)} TO {arm}`, or move the arm to {name(child)} first",),
        severity=Severity.WARNING,
    )
