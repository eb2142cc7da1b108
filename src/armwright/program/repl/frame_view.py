"""Views of a session: the frame tree with positions and orientations, and the arms with their joints and grippers."""

import math
from collections.abc import Sequence

import numpy as np

from armwright.arrays import Array
from armwright.cell.frames import WORLD
from armwright.program.repl.session import Session
from armwright.program.vm.value_text import frames_with_depth

# Where the middle one of three angles is this near to a right angle, the other two rotate about the same axis.
_SAME_AXIS = 1e-9
# Decimals of positions: a hundredth of a millimetre.
_DIGITS = {"M": 5, "MM": 2, "CM": 3, "IN": 3}


def frame_table_lines(session: Session) -> list[str]:
    """Return the frame tree as lines: each frame under the one it hangs on, seen from the world."""
    units, machine = session.state.symbols.units, session.state.machine
    rows = [["frame", "x", "y", "z", units.length.lower(), "z", "y", "x", "deg"]]
    for name, depth in frames_with_depth(machine.state.tree):
        rigid = name != WORLD and machine.state.tree.nodes[name].rigid
        shown = "  " * depth + machine.spelling(name) + (" (rigidly)" if rigid else "")
        if not machine.has_pose(name):
            rows.append([shown, "no value yet"])
            continue
        X = machine.state.tree.world(name)
        position = [f"{value:z.{_DIGITS[units.length]}f}" for value in X[:3, 3] / units.metres]
        rows.append([shown, *position, "", *map(_degrees_text, zyx_angles(X[:3, :3]).tolist()), ""])
    return _align_columns(rows)


def zyx_angles(R: Array) -> Array:
    """Return the ZYX Euler angles (3,) [rad]: about z, then about the new y, then about the newest x.

    Where the second is a right angle the third is taken as 0.
    """
    across = math.hypot(R[0, 0], R[1, 0])
    if across < _SAME_AXIS:
        return np.array([math.atan2(-R[0, 1], R[1, 1]), math.atan2(-R[2, 0], across), 0.0])
    return np.array([math.atan2(R[1, 0], R[0, 0]), math.atan2(-R[2, 0], across), math.atan2(R[2, 1], R[2, 2])])


def arm_lines(session: Session) -> list[str]:
    """Return the arms as lines: joint positions [deg] or [mm], and the frames at the gripper and in it."""
    machine, lines = session.state.machine, []
    for name, arm in machine.cell.arms.items():
        q = machine.hardware.configuration(name, machine.now)
        shown = [
            f"{_degrees_text(value)} deg" if joint.revolute else f"{value * 1e3:z.2f} mm"
            for joint, value in zip(arm.arm.joints, q.tolist(), strict=True)
        ]
        hand = machine.state.hands[name]
        location = f"at {machine.spelling(hand.reached_frame)}" if hand.reached_frame else "at no frame"
        holds = f", closed on {machine.spelling(hand.held_frame)}" if hand.held_frame else ""
        hanging = [machine.spelling(frame) for frame, node in machine.state.tree.nodes.items() if node.parent == name]
        carries = f", carries {', '.join(hanging)}" if hanging else ""
        lines += [f"{name}  {arm.arm.name}", f"  joints  {', '.join(shown)}", f"  hand    {location}{holds}{carries}"]
    return lines or ["no arms: begin with `--cell`, or with an IMPORT of a cell"]


def visible_names(session: Session) -> list[str]:
    """Return the names that an input can use, as they are spelled: variables, frames, procedures, arms."""
    symbols, machine = session.state.symbols, session.state.machine
    return [*map(machine.spelling, (*symbols.types, *symbols.procedures)), *machine.cell.arms]


def _degrees_text(angle: float) -> str:
    text = f"{math.degrees(angle):z.2f}"
    return "180.00" if text == "-180.00" else text


def _align_columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows as lines, the first column to the left and numbers to the right; a row may have words instead."""
    complete = [row[1:] for row in rows if len(row) == len(rows[0])]
    widths = [max(map(len, column)) for column in zip(*complete, strict=True)]
    name_width = max(len(row[0]) for row in rows)
    lines = []
    for name, *cells in rows:
        padding = widths if len(cells) == len(widths) else [0]
        aligned = (f"{cell:>{width}}" for cell, width in zip(cells, padding, strict=True))
        lines.append("  ".join((f"{name:<{name_width}}", *aligned)).rstrip())
    return lines
