"""Paths that a sensor corrects: what it says is looked at while the arm moves along its line."""

from __future__ import annotations

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.corrected_line import CorrectedLine, CorrectionError
from armwright.motion.plan import PlannedStage, tool_path_length
from armwright.motion.trajectory import join, whole_ticks
from armwright.program.language.source import Span
from armwright.program.vm.calls import evaluate_instructions
from armwright.program.vm.collisions import refuse_collision
from armwright.program.vm.contact import refuse_contact, send_trajectory, update_depth_alarm
from armwright.program.vm.machine import Machine
from armwright.program.vm.process import Correction, Motion, Process
from armwright.program.vm.recording import TrajectorySegment, peak_efforts, trajectory_efforts

# A correction is looked at as often as this [s], and what the arm would run into so far ahead [s].
CONTROL, _AHEAD = 0.02, 0.5
# A line that is to be corrected takes so many times as long, to leave room for that.
_ROOM = 1.25
# A line has a side where its direction is farther than this from that of the tool.
_NO_SIDE = 1e-3
# What a bound may be passed by: rounding.
_ROUNDING = 1e-9


def with_room(machine: Machine, stage: PlannedStage, duration: float | None) -> PlannedStage:
    """Return the line of a MOVE with room for a correction; one whose duration is fixed has none besides."""
    slow = stage.trajectory
    if duration is None and slow.duration:
        slow = whole_ticks(slow.slowed(_ROOM), machine.cell.period)
    return attrs.evolve(stage, kind="SENSED", trajectory=slow, certificate=None, deviation=None, unmet=None)


def side_of(machine: Machine, process: Process, arm: str, stage: PlannedStage, span: Span) -> Array:
    """Return where a correction leads (3,): y, where x is along the line and z that of the tool at its end.

    Raises:
        RunError: the line goes along z, or is none.
    """
    model, line = machine.cell.arms[arm].arm, stage.trajectory
    X_BA, X_BB = forward(model, line(0.0)), forward(model, line(line.duration))
    way = X_BB[:3, 3] - X_BA[:3, 3]
    side = np.cross(X_BB[:3, 2], way / max(float(np.linalg.norm(way)), _ROUNDING))
    if np.linalg.norm(side) < _NO_SIDE:
        text = f"{arm} has no side to be corrected to: its line leads along the z axis of the tool"
        raise machine.error(process, "E412", text, span, "sideways of what?")
    return np.asarray(side / np.linalg.norm(side))


def begin_correction(machine: Machine, motion: Motion) -> None:
    """Begin to look at a correction: its line begins now."""
    correction, run = motion.correction, machine.state.segments[motion.arm][-1]
    assert correction is not None  # noqa: S101 - asked for only then
    line = CorrectedLine.along(run.trajectory, run.t0, correction.side, rate=correction.rate, bound=correction.bound)
    motion.correction = attrs.evolve(correction, line=line, tick=machine.state.ticks)


def correct(machine: Machine, process: Process, motion: Motion) -> None:
    """Look at the correction of a MOVE, where it is time for that, and let the arm follow it.

    Raises:
        RunError: it is outside of its bound, or the arm cannot follow it.
    """
    from armwright.program.vm.move import planner_of  # noqa: PLC0415 - MOVE knows this module

    correction, now, period = motion.correction, machine.now, machine.cell.period
    assert correction is not None and correction.line is not None  # noqa: S101, PT018 - it has begun
    if machine.state.ticks < correction.tick:
        return
    line = correction.line
    next_tick = machine.state.ticks + max(1, round(CONTROL / period))
    motion.correction = attrs.evolve(correction, tick=next_tick)
    if next_tick * period > line.start + line.line.duration:
        # The offset comes to rest with the line.
        return
    asked = _measured(machine, process, motion, correction)
    if abs(asked) > correction.bound * (1 + _ROUNDING):
        unit = machine.code.units
        text = (
            f"the correction of {motion.arm} is {asked / unit.metres:.6g} {unit.length.lower()}, outside of its bound"
        )
        label = f"the bound is {correction.bound / unit.metres:g} {unit.length.lower()}"
        raise machine.error(process, "E411", text, motion.span, label, helps=["RECOVER (MOTION) goes on from there"])
    try:
        moved = line.toward(planner_of(machine, motion.arm), asked, now, period)
    except CorrectionError as error:
        text = f"{motion.arm} cannot follow the correction to {asked * 1e3:.4g} mm: {error}"
        helps = ["use another RATE, or another SPEED of the MOVE"]
        raise machine.error(process, "E412", text, motion.span, "it stops there", helps=helps) from None
    if moved is not line:
        largest = max(correction.largest, abs(asked))
        motion.correction = attrs.evolve(motion.correction, line=moved, largest=largest)
        _run_on(machine, process, motion, moved)


def _measured(machine: Machine, process: Process, motion: Motion, correction: Correction) -> float:
    """Return how far beside its line the path is to be, as the program has it now [m]."""
    tree, activation = machine.state.tree, process.activation
    machine.state.tree = tree.set_pose(motion.arm, machine.gripper_pose(motion.arm))
    process.stack.append(activation.create_nested("condition"))
    evaluate_instructions(machine, process, machine.code.instructions, correction.code)
    process.stack.pop()
    machine.state.tree = tree
    value = activation.temporaries[correction.result]
    assert isinstance(value, float | int)  # noqa: S101 - the checker knows the kinds
    return float(value) * machine.code.units.metres


def _run_on(machine: Machine, process: Process, motion: Motion, line: CorrectedLine) -> None:
    """Let an arm run on along its line, which has another offset from now on."""
    arm, now, running = motion.arm, machine.now, line.running
    refuse_collision(machine, process, arm, running, (motion.goal, motion.span), ahead=_AHEAD)
    send_trajectory(machine, motion, running)
    update_depth_alarm(machine, motion)
    if not motion.guards and (machine.hardware.contact_time(arm) is not None or motion.alarm_tick is not None):
        motion.alarm_tick = None
        refuse_contact(machine, process, motion, motion.goal, machine.hardware.peak_contact(arm, now))
    runs, stage = machine.state.segments[arm], machine.state.stages[motion.stage_index]
    local = now - runs[-1].t0
    if local > 0:
        runs[-1] = attrs.evolve(runs[-1], duration=local, tau=None)
    else:
        runs.pop()
    runs.append(TrajectorySegment(t0=now, trajectory=running, duration=running.duration))
    done = now - stage.t0
    whole = join([stage.motion.until(done), running]) if done > 0 else running
    machine.state.stages[motion.stage_index] = attrs.evolve(stage, motion=whole)
    motion.stage_end_tick = machine.state.ticks + round(running.duration / machine.cell.period)
    if any(guard.reads_pose for guard in motion.guards):
        t = np.arange(motion.stage_end_tick - motion.stage_start_tick + 1) * machine.cell.period
        motion.hand_poses = machine.base_pose(arm) @ forward(machine.cell.arms[arm].arm, whole(t))


def finish_correction(machine: Machine, motion: Motion) -> None:
    """Take note of the path that a sensor has corrected, with its efforts."""
    stage, model, period = (
        machine.state.stages[motion.stage_index],
        machine.cell.arms[motion.arm].arm,
        machine.cell.period,
    )
    loaded, ticks = machine.loaded_arm(motion.arm), round(stage.motion.duration / period)
    tau = trajectory_efforts(loaded, stage.motion, period, machine.state.tool_wrenches[motion.arm][-1], ticks)
    peak, when = peak_efforts(model, tau, period)
    length = tool_path_length(model, stage.motion)
    machine.state.stages[motion.stage_index] = attrs.evolve(stage, peak_effort=peak, peak_time=when, length=length)
