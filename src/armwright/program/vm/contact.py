"""Arms that are stopped on their path: within their limits, along their paths, and what they press on meanwhile."""

import math
from typing import NoReturn

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.hardware import PeakContact
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.limited import braked
from armwright.motion.plan import tool_path_length
from armwright.motion.trajectory import Trajectory, hold, join
from armwright.program.language.source import Span
from armwright.program.vm.collisions import check_others
from armwright.program.vm.machine import Machine
from armwright.program.vm.process import Motion, Process, StoppedOn
from armwright.program.vm.recording import ToolWrenches, TrajectorySegment, peak_efforts, trajectory_efforts

# A duration so little too short is rounding.
_ROUNDING = 1e-9
# A speed that is advised leaves this part of the depth in hand.
_DEPTH_RESERVE = 0.8
_MIN_SPEED = 1.0


def stop_arm(machine: Machine, process: Process, span: Span) -> int:
    """Stop the arm of a process under control; return when it is at rest [ticks].

    The frame table holds the pose where it comes to rest from now on. An arm that is being stopped already is left to
    it.
    """
    motion, period = process.motion, machine.cell.period
    assert motion is not None  # noqa: S101 - asked for only then
    if motion.rest_tick is None:
        record_contact(machine, motion)
        runs = machine.state.segments[motion.arm]
        local = machine.now - runs[-1].t0 if runs else 0.0
        motion.rest_tick = machine.state.ticks
        if runs and local < runs[-1].duration - _ROUNDING:
            motion.rest_tick += _stop_during_stage(machine, motion, local)
            check_others(machine, motion.arm)
        else:
            if runs:
                motion.stopped = StoppedOn(runs[-1].trajectory, runs[-1].trajectory.duration)
            _send_and_watch(machine, motion, hold(machine.hardware.sent_configuration(motion.arm, machine.now), period))
    end = max(motion.rest_tick, machine.state.ticks)
    machine.update_hand_pose(motion.arm, span, tick=end)
    return end


def rest_tick(machine: Machine, arm: str | None) -> int:
    """Return when an arm is at rest that nobody moves [ticks]: it may still brake after an error that was recovered."""
    is_busy = arm is None or arm in machine.state.following or machine.moving_process(arm) is not None
    runs = () if arm is None or is_busy else machine.state.segments.get(arm, ())
    end = math.ceil((runs[-1].t0 + runs[-1].duration) / machine.cell.period - _ROUNDING) if runs else 0
    return max(end, machine.state.ticks)


def _stop_during_stage(machine: Machine, motion: Motion, local: float) -> int:
    """Stop an arm in the middle of its stage; return how many ticks it takes."""
    arm, runs, period = machine.cell.arms[motion.arm].arm, machine.state.segments[motion.arm], machine.cell.period
    last = runs[-1]
    stop = braked(arm, last.trajectory, local, period=period)
    braking, course = stop.trajectory, motion.course
    motion.stopped = StoppedOn(last.trajectory, stop.reached) if course is None else course.stopped(stop.reached)
    loaded = machine.loaded_arm(motion.arm)
    tau = trajectory_efforts(loaded, braking, period, _send_and_watch(machine, motion, braking))
    runs[-1] = attrs.evolve(last, duration=local)
    runs.append(TrajectorySegment(t0=machine.now, trajectory=braking, duration=braking.duration, tau=tau))
    if motion.stage_index >= 0:
        stage = machine.state.stages[motion.stage_index]
        executed = join([stage.motion.until(machine.now - stage.t0), braking])
        efforts_before = [] if last.tau is None else [last.tau[: round(local / period)]]
        peak, when = peak_efforts(arm, np.concatenate([*efforts_before, tau]), period)
        length = tool_path_length(arm, executed)
        machine.state.stages[motion.stage_index] = attrs.evolve(
            stage, motion=executed, length=length, peak_effort=peak, peak_time=when, stopped=True
        )
    return math.ceil(braking.duration / period - _ROUNDING)


def _send_and_watch(machine: Machine, motion: Motion, trajectory: Trajectory) -> ToolWrenches:
    push = send_trajectory(machine, motion, trajectory)
    update_depth_alarm(machine, motion)
    return push


def send_trajectory(machine: Machine, motion: Motion, trajectory: Trajectory) -> ToolWrenches:
    """Let the arm of a motion follow a trajectory instead of what it does now; return what will push on its hand."""
    machine.hardware.start_motion(
        motion.arm, trajectory, machine.now, motion.X_HM, guarded=any(guard.reads_force for guard in motion.guards)
    )
    return _record_wrenches(machine, motion.arm)


def _record_wrenches(machine: Machine, arm: str) -> ToolWrenches:
    """Check what pushes on the gripper of an arm from now on, and remember it."""
    push = ToolWrenches(machine.now, machine.hardware.tool_wrenches(arm, machine.now))
    machine.state.tool_wrenches[arm].append(push)
    return push


def recompute_efforts(machine: Machine, arm: str, stage_index: int | None) -> None:
    """Work out anew what the motors of an arm give from now on: what it pressed with, or held, may be released.

    Args:
        machine: that runs the program.
        arm: its name.
        stage_index: number of the stage that it is on; None where it is on none.
    """
    presses = any(push.wrenches.any() for push in machine.state.tool_wrenches[arm])
    if not (presses or machine.cell.parts) or not machine.state.segments[arm]:
        return
    push, period, last = _record_wrenches(machine, arm), machine.cell.period, machine.state.segments[arm][-1]
    done_ticks = round((machine.now - last.t0) / period)
    if last.tau is None or done_ticks >= len(last.tau):
        return
    remaining_wrenches = ToolWrenches(last.t0, np.concatenate([np.zeros((done_ticks, 6)), push.wrenches]))
    loaded = machine.loaded_arm(arm)
    tau = trajectory_efforts(loaded, last.trajectory, period, remaining_wrenches, len(last.tau) - 1)
    tau[:done_ticks] = last.tau[:done_ticks]
    machine.state.segments[arm][-1] = attrs.evolve(last, tau=tau)
    if stage_index is not None:
        peak, when = peak_efforts(loaded, tau, period)
        stage = machine.state.stages[stage_index]
        machine.state.stages[stage_index] = attrs.evolve(stage, peak_effort=peak, peak_time=when)


# ---- contact -------------------------------------------------------------------------------------------------------


def update_depth_alarm(machine: Machine, motion: Motion) -> None:
    """See when an arm presses too deep by what it has begun to do, if it ever does."""
    deep = machine.hardware.excess_depth_time(motion.arm)
    tick = None if deep is None else math.ceil(deep / machine.cell.period - _ROUNDING)
    motion.alarm_tick = None if tick is None else max(machine.state.ticks, tick)


def record_contact(machine: Machine, motion: Motion, tick: int | None = None) -> None:
    """Remember how hard an arm has pressed by now, or by a later tick, before it begins something else."""
    pressed = machine.hardware.peak_contact(motion.arm, machine.now if tick is None else tick * machine.cell.period)
    if pressed.depth > motion.deepest_contact.depth:
        motion.deepest_contact = pressed


def contact_report(motion: Motion) -> tuple[str, dict[str, object]]:
    """Return what the trace says of the contact of a motion, and its facts [m] and [N]; nothing without one."""
    depth, force, _ = motion.deepest_contact
    if depth <= 0:
        return "", {}
    return f"; pressed {_depth_text(motion.deepest_contact)}", {"contact": {"depth": depth, "force": force}}


def _depth_text(pressed: PeakContact) -> str:
    return f"{pressed.depth * 1e3:.3g} mm deep, {pressed.force:.3g} N"


def stop_too_deep(machine: Machine, process: Process, motion: Motion) -> NoReturn:
    """Stop an arm that presses deeper than the cell allows, and say so.

    Raises:
        RunError: always.
    """
    motion.alarm_tick = None
    end = stop_arm(machine, process, motion.span)
    record_contact(machine, motion, end)
    # On its path to rest it may come deeper; that is said now.
    motion.alarm_tick = None
    allowed = machine.cell.contact.max_depth
    min_depth = _minimum_depth(machine, motion)
    notes = [f"the arm brakes within its limits; at rest it is pressed {_depth_text(motion.deepest_contact)}"]
    helps = ["end the MOVE at a smaller force, or use a lower speed"]
    if min_depth is not None and min_depth > allowed:
        text = "at this speed that is unavoidable: even if it brakes from the first contact on, the depth is"
        notes.append(f"{text} {min_depth * 1e3:.3g} mm")
        helps = _speed_advice(motion, allowed / min_depth)
    elif min_depth is not None:
        notes.append(f"if it brakes from the first contact on, the depth is {min_depth * 1e3:.3g} mm")
    surface = _surface_text(machine, motion.deepest_contact)
    message = f"`{machine.spelling(motion.moved)}` presses into {surface} deeper than {allowed * 1e3:g} mm"
    raise machine.error(process, "E404", message, motion.span, "this MOVE is stopped there", notes=notes, helps=helps)


def _speed_advice(motion: Motion, share: float) -> list[str]:
    """Advise a speed for a depth that is this share of the least there is: the depth grows with its square."""
    speed = math.floor(motion.speed * math.sqrt(_DEPTH_RESERVE * share))
    return ["end this MOVE above the plane" if speed < _MIN_SPEED else f"use a lower speed: `WITH SPEED = {speed}`"]


def _minimum_depth(machine: Machine, motion: Motion) -> float | None:
    """Return how deep a stop from the first servo tick in contact on presses [m]; None where nothing came down."""
    if motion.first_contact is None or machine.cell.contact.height is None:
        return None
    trajectory, local = motion.first_contact
    cell_arm, period = machine.cell.arms[motion.arm], machine.cell.period
    tick = min(math.ceil(local / period - _ROUNDING) * period, trajectory.duration)
    braking = braked(cell_arm.arm, trajectory, tick, period=period).trajectory
    q: Array = braking(np.arange(round(braking.duration / period) + 1) * period)
    X_WT = machine.base_pose(motion.arm) @ forward(cell_arm.arm, q) @ motion.X_HM
    return machine.cell.contact.height - float(X_WT[:, 2, 3].min())


def refuse_contact(machine: Machine, process: Process, motion: Motion, goal: str, pressed: PeakContact) -> NoReturn:
    """Refuse a stage that would come down on something, or press too deep into it, where no ON looks out for that.

    Raises:
        RunError: always.
    """
    text = f"`{machine.spelling(motion.moved)}` would enter {_surface_text(machine, pressed)} on its path to `{goal}`"
    label, helps = "this MOVE has no ON that ends it at the contact", ["guard the motion: `ON FORCE(Z) > 10 DO HALT`"]
    raise machine.error(process, "E404", text, motion.span, label, helps=helps)


def _surface_text(machine: Machine, pressed: PeakContact) -> str:
    plane = machine.cell.contact.height
    return pressed.body or ("the plane" if plane is None else f"the plane at z = {plane * 1e3:g} mm")
