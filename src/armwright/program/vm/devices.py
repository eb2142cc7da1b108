"""OPEN, GRASP, OPERATE and READ."""

from collections.abc import Mapping

import numpy as np

from armwright.cell.hardware import DeviceError
from armwright.program.bytecode.instructions import Instruction, Op
from armwright.program.vm.contact import look_out, note_contact, pushed_otherwise
from armwright.program.vm.machine import Handler, Machine
from armwright.program.vm.process import Pending, Process
from armwright.spatial.poses import to_noap


def _gripper(machine: Machine, process: Process, step: Instruction) -> None:
    closed = step.op is Op.GRASP
    arm = machine.name(process, step.operands[0]) if step.operands else process.last_arm
    if arm is None:
        known = min(machine.cell.arms, default="ARM_1")
        text = "GRASP does not say which arm, and none has been used yet"
        raise machine.error(process, "E307", text, step.span, "which arm?", helps=[f"write `GRASP {known}`"])
    machine.claim(process, arm, step.span)
    width = machine.number(process, step.operands[1], step) if len(step.operands) > 1 else None
    metres = None if width is None else width * machine.code.units.metres
    if metres is not None and not 0 <= metres <= 1:
        text = f"the fingers cannot open to {width:g} {machine.code.units.length.lower()}"
        raise machine.error(process, "E231", text, step.span, "expected 0 to 1 m")
    hand = machine.state.hands[arm]
    hand.holds = hand.at if closed else None
    motions = [process.motion for process in machine.state.processes if process.motion and process.motion.arm == arm]
    for motion in motions:
        note_contact(machine, motion)
    time = machine.hardware.fingers(arm, closed=closed, width=metres)
    pushed_otherwise(machine, arm, [motion.record for motion in motions if motion.record >= 0])
    for motion in motions:
        # What is released does not press any more.
        look_out(machine, motion)
    text = f"{arm} {step.op}" + (f" TO {width:g}" if width is not None else "")
    machine.take_time(
        process,
        time,
        Pending(kind="GRASP" if closed else "OPEN", text=text, since=machine.starts(), span=step.span, arm=arm),
    )


def _operate(machine: Machine, process: Process, step: Instruction) -> None:
    device, state = str(step.operands[0]), str(step.operands[1])
    try:
        time = machine.hardware.operate(device, on=state == "ON")
    except DeviceError as error:
        raise machine.error(process, "R602", str(error), step.span, "the device is asked here") from None
    text = f"{machine.spelled(device)} {state}"
    machine.take_time(process, time, Pending(kind="OPERATE", text=text, since=machine.starts(), span=step.span))


def _read_visions(machine: Machine, process: Process, step: Instruction) -> None:
    name = machine.name(process, step.operands[0])
    try:
        X_WF, time = machine.hardware.look(name)
    except DeviceError as error:
        raise machine.error(process, "R601", str(error), step.span, "the camera is asked here") from None
    text = f"READ VISIONS {machine.spelled(name)}"
    reading = (name, np.asarray(X_WF))
    data: dict[str, object] = {"frame": name, "pose": to_noap(reading[1]).tolist()}
    pending = Pending(kind="READ", text=text, since=machine.starts(), span=step.span, place=reading, data=data)
    machine.take_time(process, time, pending)


def _read_system(machine: Machine, process: Process, step: Instruction) -> None:
    arm = machine.name(process, step.operands[0])
    machine.claim(process, arm, step.span)
    machine.set_hand(arm, step.span)
    data: dict[str, object] = {"frame": arm, "pose": to_noap(machine.state.tree.world(arm)).tolist()}
    machine.effect(process, "READ", f"READ SYSTEM {arm}", step.span, arm=arm, data=data)


HANDLERS: Mapping[Op, Handler] = {
    Op.OPEN: _gripper,
    Op.GRASP: _gripper,
    Op.OPER: _operate,
    Op.READV: _read_visions,
    Op.READS: _read_system,
}
