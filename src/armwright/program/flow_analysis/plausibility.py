"""Implausible lengths: poses in another unit than the program's, grippers far from what they hold."""

import math
from collections.abc import Iterator

from armwright.program.flow_analysis.facts import UNKNOWN
from armwright.program.flow_analysis.state import FlowState
from armwright.program.language.diagnostic import labels
from armwright.program.language.names import is_any_element, is_arm
from armwright.program.language.units import LENGTHS, convert
from armwright.program.syntax import tree

# A position or translation this many times the reach of the arm is implausible.
_FAR = 50.0
# A position this near to WORLD, in parts of the reach, that would be within reach in metres was typed in metres.
_NEAR, _LEAST, _MAX_SIZE = 0.02, 0.05, 3.0
# No gripper holds what is so far from it [m].
_MAX_GRASP_DISTANCE = 0.2


def check_placement(state: FlowState, frame: str, value: tree.Expression) -> None:
    """Warn of a frame at an implausible pose, near to WORLD."""
    reach = state.cell.reach if state.cell else None
    pose = None if is_any_element(frame) else state.table.world_pose(frame)
    units = state.symbols.units
    if reach is None or pose is None or units.length == "M":
        return
    away = math.hypot(*pose[9:])
    for numbers in _typed_lengths(value):
        size = math.hypot(*(number.value for number in numbers))
        bare, broken = not any(number.unit for number in numbers), any(number.value % 1 for number in numbers)
        if bare and broken and 0 < away < _NEAR * reach and _LEAST * reach < size < _MAX_SIZE * reach:
            unit = LENGTHS[units.length]
            advice = f"write the lengths in {unit}, or with their unit: `{numbers[0].text}m`"
            _warn(state, f"`{state.name(frame)}` would be {_length(away)} from WORLD", numbers, reach, advice)
            return


def check_lengths(state: FlowState, *nodes: tree.Expression | None) -> None:
    """Warn of positions and translations far out of reach."""
    reach = state.cell.reach if state.cell else None
    units = state.symbols.units
    if reach is None:
        return
    for node in nodes:
        for numbers in () if node is None else _typed_lengths(node):
            away = math.hypot(*(convert(number.value, number.unit, units) * units.metres for number in numbers))
            if away > _FAR * reach:
                what = f"this translation is {_length(away)} long"
                if isinstance(node, tree.Matrix):
                    what = f"this position is {_length(away)} from its origin"
                advice = f"write the lengths in {LENGTHS[units.length]}"
                if units.length == "M":
                    advice = "write `UNITS MM ;` before BEGIN if they are in millimetres, or write each with its unit"
                _warn(state, what, numbers, reach, advice)


def _typed_lengths(node: tree.Expression) -> Iterator[list[tree.Number]]:
    """Yield the literal positions in an expression: the last three of twelve numbers, and those of XYZ."""
    waiting: list[tree.Expression] = [] if isinstance(node, tree.Name) else [node]
    while waiting:
        frame = waiting.pop()
        three: tuple[tree.Expression, ...] = ()
        if isinstance(frame, tree.Binary):
            waiting += [frame.right, frame.left]
        elif isinstance(frame, tree.Matrix) and len(frame.items) == 12:
            three = frame.items[9:]
        elif isinstance(frame, tree.Function) and frame.name.key == "XYZ":
            three = frame.arguments
        elif isinstance(frame, tree.Function):
            waiting += reversed(frame.arguments)
        numbers = [each for each in three if isinstance(each, tree.Number) and not math.isnan(each.value)]
        if len(numbers) == 3:
            yield numbers


def _warn(state: FlowState, what: str, numbers: list[tree.Number], reach: float, advice: str) -> None:
    unit = LENGTHS[state.symbols.units.length]
    text = f"{what}, in a cell whose arm reaches {_length(reach)}"
    note = f"lengths in this program are {unit}"
    state.report("W208", text, numbers[0].span.to(numbers[-1].span), unit, note=note, advice=advice)


def _length(metres: float) -> str:
    return f"{metres:.3g} m" if metres >= 1 else f"{metres * 1e3:.3g} mm"


def check_grasp(state: FlowState, node: tree.Affix, child: str, arm: str) -> None:
    """Warn of a frame that is affixed to a gripper which has closed elsewhere."""
    table = state.table
    if not is_arm(arm) or is_any_element(child) or table.grips[arm] is None:
        return
    frame = table.grippers[arm].at
    if frame is None or frame in (UNKNOWN, child) or is_any_element(frame) or is_arm(frame):
        return
    at_pose, pose = table.world_pose(frame), table.world_pose(child)
    if at_pose is None or pose is None or (away := math.dist(at_pose[9:], pose[9:])) <= _MAX_GRASP_DISTANCE:
        return
    name, there = state.name(child), state.name(frame)
    text = f"`{name}` is {_length(away)} away from the gripper of {arm}"
    arrival = labels(table.grippers[arm].arrival, f"it moved to {there} here")
    advice = f"write `AFFIX {there} TO {arm}`, or move the arm to {name} first"
    state.report("W210", text, node.link, f"the gripper is at {there}", secondary=arrival, advice=advice)
