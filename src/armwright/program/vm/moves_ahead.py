"""MOVEs that go over into the next one: what may be done while one waits for it, and all of them as one MOVE."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armwright.arrays import Array
from armwright.program.bytecode.instructions import MOVE_PARTS, Form, Instruction, Op
from armwright.program.vm.move_request import Goal, MoveRequest
from armwright.program.vm.process import MovesAhead, Process

# As many lines at most are run without a stop between them.
MOST_AHEAD = 50
# What has another result, or another meaning, when the arm is somewhere else or at another time.
_OF_THE_MOMENT = {Op.TIME, Op.MESSAGE, Op.FORCE, Op.INPUT, Op.ANALOG, Op.OUTPUT, Op.SETTING}
# What is done at once while a MOVE waits for the next one: it works values out and decides what comes next.
_AT_ONCE = {op for op in Op if "=" in op.signature} - _OF_THE_MOMENT
_AT_ONCE |= {Op.COPY, Op.MUL, Op.ELEM, Op.JMP, Op.JZ, Op.FOR, Op.CALL, Op.CALLF, Op.RETV, Op.NORET}
_AT_ONCE |= {Op.MVBEG, Op.MVEND, *MOVE_PARTS}


def is_done_at_once(process: Process, step: Instruction) -> bool:
    """Whether an instruction is done while MOVEs wait for the next one; before all others they are run to their end."""
    if step.op is Op.RET:
        return process.activation.kind == "procedure"
    return step.op in _AT_ONCE


def goes_over(request: MoveRequest) -> bool:
    """Whether a MOVE goes over into the next one."""
    return request.blend is not None and not request.form.via


def fits(ahead: MovesAhead, request: MoveRequest, moved: str) -> bool:
    """Whether a MOVE goes on from those that wait for it: another line, of the same thing, at the same speed."""
    first = ahead.requests[0]
    is_line = request.form.straight and not request.guards and request.duration is None
    is_same = (moved, request.speed, request.tool) == (ahead.moved, first.speed, first.tool)
    return is_line and is_same and len(ahead.requests) < MOST_AHEAD


def merged(requests: Sequence[MoveRequest], poses: Sequence[Array]) -> MoveRequest:
    """Return MOVEs as one, which goes past the goals of all but the last.

    Args:
        requests: the MOVEs, each STRAIGHTLY.
        poses: (4, 4) the pose of the tool at the goal of each, in the base.
    """
    goals: dict[str, Goal] = {}
    fixed: dict[str, Array] = {}
    for request, pose in zip(requests, poses, strict=True):
        goal = request.goals[request.form.goal]
        label = goal.label
        while label in goals:
            label += "'"
        goals[label], fixed[label] = goal._replace(label=label), pose
    *past, last = goals
    return requests[-1]._replace(
        form=Form(goal=last, via=tuple(past), blend=bool(past), straight=not past),
        goals=goals,
        blend=np.array([request.blend for request in requests[:-1]]) if past else None,
        fixed=fixed,
    )
