"""MOVE SMOOTHLY: the stages are shaped, so that an arm with flexible gears does not vibrate at their ends."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armwright.errors import IncapableArmError, InvalidValueError, UnsupportedArmError
from armwright.motion.plan import PlannedStage
from armwright.motion.smooth_stages import LeftLineError, certified, lasting, smooth_stages
from armwright.motion.solver import AnyArm
from armwright.program.bytecode.instructions import stages_of
from armwright.program.semantics.move import no_flat_line, no_flexible_gear
from armwright.program.vm.machine import Machine
from armwright.program.vm.move_request import MoveRequest
from armwright.program.vm.process import Process


def smoothed_stages(
    machine: Machine,
    process: Process,
    request: MoveRequest,
    stages: Sequence[PlannedStage],
    *,
    arm: str,
    planner: AnyArm,
) -> list[PlannedStage]:
    """Return the stages of a MOVE SMOOTHLY, shaped, in the time that was asked for where one was.

    Args:
        machine: that runs the program.
        process: with the MOVE.
        request: the MOVE.
        stages: as they were planned.
        arm: name of the arm.
        planner: what they were planned with.

    Raises:
        RunError: the arm has rigid gears, a straight line would be left or is none for flat feedforward, or no slower
            motion keeps the limits.
    """
    cell, span = machine.cell, request.span
    shaping = cell.arms[arm].smooth
    if not np.isfinite(cell.arms[arm].arm.motor_values("stiffness")).any():
        text, advice = no_flexible_gear(arm)
        raise machine.error(process, "E259", text, span, "nothing vibrates", helps=[advice])
    if shaping.kind == "flat" and any(stage.kind == "LINE" for stage in stages):
        text, advice = no_flat_line(arm)
        raise machine.error(process, "E258", text, span, "goes along a straight line", helps=[advice])
    fixed = request.duration is not None
    try:
        smooth = smooth_stages(planner, stages, shaping, cell.period, tool=request.tool)
        if request.duration is not None:
            shortest = sum(stage.trajectory.duration for stage in smooth)
            if request.duration < shortest - cell.period:
                text = f"this MOVE is infeasible in {request.duration:g} s"
                raise machine.error(process, "E405", text, span, f"shaped, it takes {shortest:.3f} s or more")
            smooth = lasting(smooth, request.duration, cell.period)
        return certified(planner, smooth, shaping, cell.deviation, fixed=fixed)
    except LeftLineError as error:
        goal = stages_of(request.form)[error.stage].frames[-1]
        text = f"{arm} would leave the straight line to `{goal}`"
        helps = [
            "a slower MOVE keeps nearer to the line: write a lower SPEED or VELOCITY",
            "the cell file may allow more by `deviation_mm` of [motion], or shape less by `shaper` and `modes`",
        ]
        if error.only_turns:
            helps = ["leave STRAIGHTLY out, or SMOOTHLY"]
        raise machine.error(process, "E413", text, span, "asked for here", notes=[str(error)], helps=helps) from None
    except (UnsupportedArmError, InvalidValueError, IncapableArmError) as error:
        text = f"{arm} cannot make this MOVE smoothly: {error}"
        raise machine.error(process, "E414", text, span, "asked for here") from None
