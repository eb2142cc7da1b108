"""OPEN, GRASP, OPERATE, TIMER, READ and ZERO FORCE."""

from collections.abc import Mapping

import numpy as np

from armwright.cell.hardware import DeviceError
from armwright.program.bytecode.instructions import Instruction, Op
from armwright.program.vm.collisions import held_parts, note_released, refuse_collision
from armwright.program.vm.contact import recompute_efforts, record_contact, update_depth_alarm
from armwright.program.vm.machine import MAX_PAUSE, Handler, Machine, pose_data
from armwright.program.vm.process import PendingEffect, Process
from armwright.program.vm.recording import TimedKind
from armwright.program.vm.tracking import rest_of_following


def _move_fingers(machine: Machine, process: Process, step: Instruction) -> None:
    closed = step.op is Op.GRASP
    arm = machine.resolve_name(process, step.operands[0]) if step.operands else process.last_arm
    if arm is None:
        example = min(machine.cell.arms, default="ARM_1")
        text = "GRASP names no arm, and no arm has been used before"
        raise machine.error(process, "E307", text, step.span, "which arm?", helps=[f"write `GRASP {example}`"])
    machine.claim_arm(process, arm, step.span)
    width = machine.read_number(process, step.operands[1], step.span) if len(step.operands) > 1 else None
    metres = None if width is None else width * machine.code.units.metres
    if metres is not None and not 0 <= metres <= 1:
        text = f"the fingers cannot open to {width:g} {machine.code.units.length.lower()}"
        raise machine.error(process, "E231", text, step.span, "expected 0 to 1 m")
    hand = machine.state.hands[arm]
    hand.held_frame = hand.reached_frame if closed else None
    mover = machine.moving_process(arm)
    motion = None if mover is None else mover.motion
    if motion is not None:
        record_contact(machine, motion)
    held = held_parts(machine)
    time = machine.hardware.move_fingers(arm, machine.now, closed=closed, width=metres, frame=hand.held_frame)
    note_released(machine, held)
    recompute_efforts(machine, arm, None if motion is None or motion.stage_index < 0 else motion.stage_index)
    if motion is not None:
        # What is released does not press any more.
        update_depth_alarm(machine, motion)
    if (queue := machine.state.queues.get(arm)) is not None and (rest := rest_of_following(machine, arm)) is not None:
        # What it holds now, or no longer, was not looked at when these frames were put in.
        refuse_collision(machine, process, arm, rest, (queue.labels[-1], step.span))
    text = f"{arm} {step.op}" + (f" TO {width:g}" if width is not None else "")
    kind: TimedKind = "GRASP" if closed else "OPEN"
    pending = PendingEffect(kind=kind, text=text, start=machine.next_start(), span=step.span, arm=arm)
    machine.schedule_effect(process, time, pending)


def _operate(machine: Machine, process: Process, step: Instruction) -> None:
    device, state = str(step.operands[0]), str(step.operands[1])
    try:
        time = machine.hardware.operate(device, on=state == "ON")
    except DeviceError as error:
        raise machine.error(process, "R602", str(error), step.span, "the device is asked here") from None
    text = f"{machine.spelling(device)} {state}"
    pending = PendingEffect(kind="OPERATE", text=text, start=machine.next_start(), span=step.span)
    machine.schedule_effect(process, time, pending)


def _set_output(machine: Machine, process: Process, step: Instruction) -> None:
    device, value = str(step.operands[0]), machine.read_number(process, step.operands[1], step.span)
    try:
        machine.hardware.set_output(device, value)
    except DeviceError as error:
        raise machine.error(process, "R602", str(error), step.span, "the device is asked here") from None
    text = f"{machine.spelling(device)} TO {value:.6g}"
    machine.record_effect(process, "OPERATE", text, step.span, data={"device": device, "value": value})


def _pulse(machine: Machine, process: Process, step: Instruction) -> None:
    device, seconds = str(step.operands[0]), machine.read_number(process, step.operands[1], step.span)
    if not 0 < seconds <= MAX_PAUSE:
        text = f"a pulse of {seconds:g} s is not possible"
        raise machine.error(process, "E231", text, step.span, f"expected more than 0, and at most {MAX_PAUSE:g} s")
    try:
        machine.hardware.pulse(device, seconds)
    except DeviceError as error:
        raise machine.error(process, "R602", str(error), step.span, "the device is asked here") from None
    text = f"{machine.spelling(device)} PULSE {seconds:.6g}"
    machine.record_effect(process, "OPERATE", text, step.span, data={"device": device, "seconds": seconds})


def _switch_timer(machine: Machine, process: Process, step: Instruction) -> None:
    """Let a timer run on, or stop it; it keeps its seconds."""
    name, timers = str(step.operands[0]), machine.state.timers
    timers[name] = machine.timer(name), machine.state.ticks if step.operands[1] == "ON" else None
    _record_timer(machine, process, step, str(step.operands[1]))


def _set_timer(machine: Machine, process: Process, step: Instruction) -> None:
    """Give a timer other seconds; it runs on from there, or stands there."""
    name, timers = str(step.operands[0]), machine.state.timers
    seconds = machine.read_number(process, step.operands[1], step.span)
    _, since = timers.get(name, (0.0, None))
    timers[name] = seconds, None if since is None else machine.state.ticks
    _record_timer(machine, process, step, f"TO {seconds:.6g}")


def _record_timer(machine: Machine, process: Process, step: Instruction, change: str) -> None:
    name = str(step.operands[0])
    data = {"timer": name, "seconds": machine.timer(name), "running": machine.state.timers[name][1] is not None}
    machine.record_effect(process, "TIMER", f"TIMER {machine.spelling(name)} {change}", step.span, data=data)


def _read_visions(machine: Machine, process: Process, step: Instruction) -> None:
    name = machine.resolve_name(process, step.operands[0])
    try:
        X_WF, time = machine.hardware.locate(name, machine.now)
    except DeviceError as error:
        raise machine.error(process, "R601", str(error), step.span, "the camera is asked here") from None
    text = f"READ VISIONS {machine.spelling(name)}"
    data, since = pose_data(name, X_WF), machine.next_start()
    pending = PendingEffect(kind="READ", text=text, start=since, span=step.span, frame_pose=(name, X_WF), data=data)
    machine.schedule_effect(process, time, pending)


def _read_system(machine: Machine, process: Process, step: Instruction) -> None:
    arm = machine.resolve_name(process, step.operands[0])
    machine.claim_arm(process, arm, step.span)
    machine.update_hand_pose(arm, step.span)
    data = pose_data(arm, machine.state.tree.world(arm))
    machine.record_effect(process, "READ", f"READ SYSTEM {arm}", step.span, arm=arm, data=data)


def _zero_force(machine: Machine, process: Process, step: Instruction) -> None:
    arm = machine.resolve_name(process, step.operands[0])
    machine.claim_arm(process, arm, step.span)
    force, torque = np.split(machine.hardware.zero_force(arm, machine.now), 2)
    data = {"force": force.tolist(), "torque": torque.tolist()}
    machine.record_effect(process, "ZERO", f"ZERO FORCE {arm}", step.span, arm=arm, data=data)


HANDLERS: Mapping[Op, Handler] = {
    Op.OPEN: _move_fingers,
    Op.GRASP: _move_fingers,
    Op.OPER: _operate,
    Op.OPSET: _set_output,
    Op.PULSE: _pulse,
    Op.TIMSW: _switch_timer,
    Op.TIMSET: _set_timer,
    Op.READV: _read_visions,
    Op.READS: _read_system,
    Op.ZEROF: _zero_force,
}
