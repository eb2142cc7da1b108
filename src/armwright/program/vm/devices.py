"""OPEN, GRASP, OPERATE and READ."""

from collections.abc import Mapping

from armwright.cell.hardware import DeviceError
from armwright.program.bytecode.instructions import Instruction, Op
from armwright.program.vm.contact import look_out, note_contact, pushed_otherwise
from armwright.program.vm.machine import Handler, Machine, pose_data
from armwright.program.vm.process import Pending, Process
from armwright.program.vm.recording import TimedKind


def _gripper(machine: Machine, process: Process, step: Instruction) -> None:
    closed = step.op is Op.GRASP
    arm = machine.name(process, step.operands[0]) if step.operands else process.last_arm
    if arm is None:
        known = min(machine.cell.arms, default="ARM_1")
        text = "GRASP names no arm, and no arm has been used before"
        raise machine.error(process, "E307", text, step.span, "which arm?", helps=[f"write `GRASP {known}`"])
    machine.claim(process, arm, step.span)
    width = machine.number(process, step.operands[1], step) if len(step.operands) > 1 else None
    metres = None if width is None else width * machine.code.units.metres
    if metres is not None and not 0 <= metres <= 1:
        text = f"the fingers cannot open to {width:g} {machine.code.units.length.lower()}"
        raise machine.error(process, "E231", text, step.span, "expected 0 to 1 m")
    hand = machine.state.hands[arm]
    hand.holds = hand.at if closed else None
    mover = machine.mover(arm)
    motion = None if mover is None else mover.motion
    if motion is not None:
        note_contact(machine, motion)
    time = machine.hardware.fingers(arm, closed=closed, width=metres)
    pushed_otherwise(machine, arm, None if motion is None or motion.record < 0 else motion.record)
    if motion is not None:
        # What is released does not press any more.
        look_out(machine, motion)
    text = f"{arm} {step.op}" + (f" TO {width:g}" if width is not None else "")
    kind: TimedKind = "GRASP" if closed else "OPEN"
    machine.take_time(process, time, Pending(kind=kind, text=text, since=machine.starts(), span=step.span, arm=arm))


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
    data, since = pose_data(name, X_WF), machine.starts()
    pending = Pending(kind="READ", text=text, since=since, span=step.span, place=(name, X_WF), data=data)
    machine.take_time(process, time, pending)


def _read_system(machine: Machine, process: Process, step: Instruction) -> None:
    arm = machine.name(process, step.operands[0])
    machine.claim(process, arm, step.span)
    machine.set_hand(arm, step.span)
    data = pose_data(arm, machine.state.tree.world(arm))
    machine.effect(process, "READ", f"READ SYSTEM {arm}", step.span, arm=arm, data=data)


HANDLERS: Mapping[Op, Handler] = {
    Op.OPEN: _gripper,
    Op.GRASP: _gripper,
    Op.OPER: _operate,
    Op.READV: _read_visions,
    Op.READS: _read_system,
}
