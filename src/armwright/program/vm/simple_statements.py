"""What the instructions do to values, frames, tools and sensors."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from armwright.cell.frames import WORLD
from armwright.cell.hardware import DeviceError
from armwright.program.bytecode.instructions import Constant, Instruction, JumpTarget, Op, Text
from armwright.program.language.diagnostic import Label
from armwright.program.language.names import is_arm
from armwright.program.vm.contact import look_out, note_contact, pushed_otherwise
from armwright.program.vm.machine import Machine
from armwright.program.vm.operators import IN_UNITS, PLAIN, ValueFault
from armwright.program.vm.process import Element, Pending, Process
from armwright.program.vm.value_text import shown
from armwright.spatial.poses import to_noap

Handler = Callable[[Machine, Process, Instruction], None]

_AXES = {"X": 0, "Y": 1, "Z": 2}
# An index this near to a whole number is that number.
_WHOLE = 1e-9


# ---- values --------------------------------------------------------------------------------------------------------


def _load(run: Machine, process: Process, step: Instruction) -> None:
    constant = step.operands[1]
    assert isinstance(constant, Constant)  # noqa: S101 - the translator gives one
    run.write(process, step.operands[0], run.constants[constant.index], step)


def _copy(run: Machine, process: Process, step: Instruction) -> None:
    run.write(process, step.operands[0], run.read(process, step.operands[1], step), step)


def _compute(run: Machine, process: Process, step: Instruction) -> None:
    given = [run.read(process, operand, step) for operand in step.operands[1:]]
    try:
        value = PLAIN[step.op](*given) if step.op in PLAIN else IN_UNITS[step.op](*given, run.code.units)
    except ValueFault as fault:
        run.fail(process, fault.code, fault.message, step.span, fault.label)
    run.write(process, step.operands[0], value, step)


def _element(run: Machine, process: Process, step: Instruction) -> None:
    """Find an element; a value in passing becomes it, not what it holds."""
    array = run.name(process, step.operands[1])
    sizes = run.types[array].sizes
    indices = []
    for number, (operand, size) in enumerate(zip(step.operands[2:], sizes, strict=True), 1):
        value = run.number(process, operand, step)
        index = round(value)
        if abs(value - index) > _WHOLE or not 1 <= index <= size:
            which = f"index {number}" if len(sizes) > 1 else "the index"
            text = f"{which} of `{run.spelled(array)}` is {value:g}, not a whole number from 1 to {size}"
            run.fail(process, "E222", text, step.span, "no such element")
        indices.append(index)
    to = step.operands[0]
    assert isinstance(to, str)  # noqa: S101 - the translator gives a value in passing
    process.now.passing[to] = Element(f"{array}[{','.join(map(str, indices))}]")
    process.now.wrote[to] = step.span


def _force(run: Machine, process: Process, step: Instruction) -> None:
    arm = process.motion.arm if process.motion else process.last_arm
    value = 0.0
    if arm is not None:
        value = float(run.hardware.force(arm, run.now)[_AXES[str(step.operands[1])]])
    run.write(process, step.operands[0], value, step)


# ---- frames --------------------------------------------------------------------------------------------------------


def _affix(run: Machine, process: Process, step: Instruction) -> None:
    operands = [operand for operand in step.operands if operand != "RIGIDLY"]
    rigid = len(operands) < len(step.operands)
    child, parent = run.name(process, operands[0]), run.name(process, operands[1])
    spelled = run.spelled
    if is_arm(child) or child == WORLD:
        text = "an arm cannot be affixed to a frame" if is_arm(child) else f"`{WORLD}` cannot be affixed"
        run.fail(process, "E308" if is_arm(child) else "E309", text, step.span, "cannot hang on anything")
    if is_arm(parent):
        process.last_arm = parent
    step_X = run.pose(process, operands[2], step) if step.op is Op.AFFAT else None
    run.held(parent, step, process)
    if step_X is None:
        run.held(child, step, process)
    if run.tree.would_ring(child, parent):
        note = "frames form a tree; each hangs on one other and in the end on WORLD"
        label = f"{spelled(child)} cannot hang on {'itself' if child == parent else spelled(parent)}"
        chain = [one for one in (parent, *run.tree.ancestors(parent)) if one != child and one in run.written]
        hung = [Label(run.written[one], f"{spelled(one)} got its place here") for one in chain[:3]]
        run.fail(process, "E305", "this AFFIX would close a ring", step.span, label, secondary=hung, notes=[note])
    run.grow(run.tree.affix(child, parent, step_X, rigid=rigid), child, step.span)
    run.effect(
        process,
        "AFFIX",
        f"AFFIX {spelled(child)} -> {spelled(parent)}",
        step.span,
        data={"child": child, "parent": parent, "rigidly": rigid},
    )


def _unfix(run: Machine, process: Process, step: Instruction) -> None:
    child = run.name(process, step.operands[0])
    spelled = run.spelled
    if is_arm(child) or child == WORLD:
        text = f"`{spelled(child)}` cannot be unfixed"
        run.fail(process, "E308" if is_arm(child) else "E309", text, step.span, "hangs on nothing that could be cut")
    run.held(child, step, process)
    above = run.tree.parent(child)
    if len(step.operands) > 1 and (parent := run.name(process, step.operands[1])) != above:
        hangs = above is not None and above != WORLD
        instead = f"write `UNFIX {spelled(child)} FROM {spelled(above or WORLD)}`" if hangs else "leave this UNFIX out"
        text = f"`{spelled(child)}` is not affixed to `{spelled(parent)}`"
        label = f"hangs on {spelled(above or WORLD)}"
        where = [Label(run.written[child], "here it got its place")] if child in run.written else []
        run.fail(process, "E306", text, step.span, label, secondary=where, helps=[instead])
    run.grow(run.tree.unfix(child), child, step.span)
    run.effect(process, "UNFIX", f"UNFIX {spelled(child)}", step.span, data={"child": child, "parent": above})


# ---- tools and sensors ---------------------------------------------------------------------------------------------


def _fingers(run: Machine, process: Process, step: Instruction) -> None:
    closed = step.op is Op.GRASP
    arm = run.name(process, step.operands[0]) if step.operands else process.last_arm
    if arm is None:
        known = min(run.cell.arms, default="ARM_1")
        text = "GRASP does not say which arm, and none has been used yet"
        run.fail(process, "E307", text, step.span, "which arm?", helps=[f"write `GRASP {known}`"])
    run.claim(process, arm, step.span)
    width = run.number(process, step.operands[1], step) if len(step.operands) > 1 else None
    metres = None if width is None else width * run.code.units.metres
    if metres is not None and not 0 <= metres <= 1:
        text = f"the fingers cannot open to {width:g} {run.code.units.length.lower()}"
        run.fail(process, "E231", text, step.span, "expected 0 to 1 m")
    hand = run.hands[arm]
    hand.holds = hand.at if closed else None
    motions = [one.motion for one in run.processes if one.motion and one.motion.arm == arm]
    for motion in motions:
        note_contact(run, motion)
    time = run.hardware.fingers(arm, closed=closed, width=metres)
    pushed_otherwise(run, arm, [motion.record for motion in motions if motion.record >= 0])
    for motion in motions:
        # What is let go does not press any more.
        look_out(run, motion)
    text = f"{arm} {step.op}" + (f" TO {width:g}" if width is not None else "")
    run.take_time(
        process,
        time,
        Pending(kind="GRASP" if closed else "OPEN", text=text, since=run.starts(), span=step.span, arm=arm),
    )


def _operate(run: Machine, process: Process, step: Instruction) -> None:
    device, state = str(step.operands[0]), str(step.operands[1])
    try:
        time = run.hardware.operate(device, on=state == "ON")
    except DeviceError as error:
        run.fail(process, "R602", str(error), step.span, "the device is asked here")
    text = f"{run.spelled(device)} {state}"
    run.take_time(process, time, Pending(kind="OPERATE", text=text, since=run.starts(), span=step.span))


def _look(run: Machine, process: Process, step: Instruction) -> None:
    name = run.name(process, step.operands[0])
    try:
        X_WF, time = run.hardware.look(name)
    except DeviceError as error:
        run.fail(process, "R601", str(error), step.span, "the camera is asked here")
    text = f"READ VISIONS {run.spelled(name)}"
    place = (name, np.asarray(X_WF))
    data: dict[str, object] = {"frame": name, "pose": to_noap(place[1]).tolist()}
    pending = Pending(kind="READ", text=text, since=run.starts(), span=step.span, place=place, data=data)
    run.take_time(process, time, pending)


def _read_arm(run: Machine, process: Process, step: Instruction) -> None:
    arm = run.name(process, step.operands[0])
    run.claim(process, arm, step.span)
    run.set_hand(arm, step.span)
    data: dict[str, object] = {"frame": arm, "pose": to_noap(run.tree.world(arm)).tolist()}
    run.effect(process, "READ", f"READ SYSTEM {arm}", step.span, arm=arm, data=data)


# ---- words for people ----------------------------------------------------------------------------------------------


def _print(run: Machine, process: Process, step: Instruction) -> None:
    line = " ".join(
        operand.value if isinstance(operand, Text) else shown(run.read(process, operand, step), run.code.units)
        for operand in step.operands
    )
    run.effect(process, "PRINT", f'PRINT "{line}"', step.span, data={"printed": line})


HANDLERS: Mapping[Op, Handler] = {
    Op.LOADM: _load,
    Op.LOADS: _load,
    Op.COPY: _copy,
    **dict.fromkeys((*PLAIN, *IN_UNITS), _compute),
    Op.ELEM: _element,
    Op.FORCE: _force,
    Op.AFFIX: _affix,
    Op.AFFAT: _affix,
    Op.UNFIX: _unfix,
    Op.OPEN: _fingers,
    Op.GRASP: _fingers,
    Op.OPER: _operate,
    Op.READV: _look,
    Op.READS: _read_arm,
    Op.PRINT: _print,
}


def work_out(run: Machine, process: Process, steps: Sequence[Instruction], at: int = 0) -> None:
    """Do instructions that only give values, up to RET or the last: those of a condition or an expression."""
    while at < len(steps) and (step := steps[at]).op is not Op.RET:
        at += 1
        if step.op is Op.JZ:
            # AND and OR jump forwards; nothing else in an expression jumps.
            target = step.operands[1]
            assert isinstance(target, JumpTarget)  # noqa: S101 - the translator lands them
            at = at if run.read(process, step.operands[0], step) else target.index
        else:
            HANDLERS[step.op](run, process, step)
