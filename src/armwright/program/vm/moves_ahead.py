"""MOVEs that go over into the next one: what may be done while one waits for it, and all of them as one MOVE."""

from __future__ import annotations

import numpy as np

from armwright.arrays import Array
from armwright.program.bytecode.instructions import MOVE_PARTS, Form, Instruction, Op
from armwright.program.vm.move_request import Goal, MoveRequest
from armwright.program.vm.process import MovesAhead, Process

# As many lines at most are run without a stop between them.
MOST_AHEAD = 50
# What has another result, or another meaning, when the arm is somewhere else or at another time.
_OF_THE_MOMENT = {Op.TIME, Op.MESSAGE, Op.FORCE, Op.INPUT, Op.ANALOG, Op.OUTPUT, Op.SETTING, Op.QUEUED, Op.AWAITED}
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
    return request.blend is not None and _is_one_stage(request)


def fits(ahead: MovesAhead, request: MoveRequest, moved: str) -> bool:
    """Whether a MOVE goes on from those that wait for it: in the same way, of the same thing, at the same speed."""
    first = ahead.requests[0]
    is_alike = _is_one_stage(request) and request.form.straight is first.form.straight
    is_same = (moved, request.speed, request.tool) == (ahead.moved, first.speed, first.tool)
    return is_alike and is_same and len(ahead.requests) < MOST_AHEAD


def _is_one_stage(request: MoveRequest) -> bool:
    """Whether a MOVE is one LINE or one PTP, whose end nothing but its goal tells."""
    if request.tracked is not None or request.correction is not None or request.form.smooth:
        return False
    return (request.form.straight or request.form.direct) and not request.guards and request.duration is None


def merged(ahead: MovesAhead) -> MoveRequest:
    """Return MOVEs that wait for one another as one, which goes past the goals of all but the last."""
    requests = ahead.requests
    goals: dict[str, Goal] = {}
    fixed: dict[str, Array] = {}
    fixed_joints: dict[str, Array] = {}
    for request, pose, joints in zip(requests, ahead.poses, ahead.joints, strict=True):
        goal = request.goals[request.form.goal]
        label = goal.label
        while label in goals:
            label += "'"
        goals[label], fixed[label] = goal._replace(label=label), pose
        if joints is not None:
            fixed_joints[label] = joints
    *past, last = goals
    straight = requests[0].form.straight
    return requests[-1]._replace(
        form=Form(goal=last, via=tuple(past), blend=bool(past), straight=straight and not past, jointwise=not straight),
        goals=goals,
        blend=np.array([request.blend for request in requests[:-1]]) if past else None,
        joints=None,
        fixed=fixed,
        fixed_joints=fixed_joints,
    )
