"""Control flow, MOVE, outputs, waits and texts."""

import math

from armwright.cell.outputs import Output
from armwright.export.translation.code import (
    Choice,
    Count,
    FunctionCall,
    Halt,
    Loop,
    MoveTo,
    Number,
    Pause,
    Pose,
    Print,
    Procedure,
    Return,
    Statement,
    Switch,
    Truth,
    Value,
    WaitUntil,
)
from armwright.export.translation.context import Context, Translators
from armwright.export.translation.frame_statements import hang, place_frame
from armwright.export.translation.frames import Hanging
from armwright.export.translation.values import (
    frame_of,
    is_pose,
    number_of,
    operate,
    plain_variable,
    require_arm,
    simplified,
    value_of,
)
from armwright.program.bytecode.instructions import MotionKind, stages_of
from armwright.program.bytecode.move import form_of
from armwright.program.language.names import is_arm
from armwright.program.language.units import HIGHEST_SPEED, NORMAL_SPEED
from armwright.program.syntax import tree

# Clauses of MOVE that are translated; any other is refused.
_CLAUSES = (tree.Directly, tree.Straightly, tree.Via, tree.Approach, tree.Departure, tree.Speed, tree.Blend)
# Durations of the passages of one stage that are this near are the same [s].
_SAME_TIME = 1.5e-3


# ---- control flow --------------------------------------------------------------------------------------------------


def block(context: Context, node: tree.Block) -> None:
    """Translate the statements of a block."""
    context.translate(*node.statements)


def choice(context: Context, node: tree.If) -> None:
    """Translate an IF."""
    condition, before = value_of(context, node.condition), context.attachments.copy()
    then = context.block(node.then)
    after, context.attachments = context.attachments, before
    otherwise = () if node.otherwise is None else context.block(node.otherwise)
    context.attachments = after.join(context.attachments)
    context.out.append(Choice(span=node.span, condition=condition, then=then, otherwise=otherwise))


def loop(context: Context, node: tree.While) -> None:
    """Translate a WHILE: its condition is looked at with frames as they hang behind the block too."""
    while True:
        before = context.attachments.copy()
        condition, body = value_of(context, node.condition), context.block(node.body)
        context.attachments = before.join(context.attachments)
        if context.attachments == before:
            break
    context.out.append(Loop(span=node.span, condition=condition, body=body))


def repeat(context: Context, node: tree.Repeat) -> None:
    """Translate a REPEAT."""
    while True:
        before = context.attachments.copy()
        body = context.block(*node.body)
        after = context.attachments
        context.attachments = before.join(after)
        if context.attachments == before:
            break
    context.attachments = after
    condition = operate(context, "not", value_of(context, node.condition), node=node)
    context.out.append(Loop(span=node.span, condition=condition, body=body, at_end=True))


def count(context: Context, node: tree.For) -> None:
    """Translate a FOR; its step has to be constant, so that its sign is known."""
    if not isinstance(node.variable, tree.Name):
        context.refuse_construct(node)
    step = 1.0 if node.step is None else number_of(context, node.step)
    if not step:
        context.refuse_construct(node)
    first, last = value_of(context, node.first), value_of(context, node.last)
    variable = plain_variable(context, node.variable)
    counter, limit = context.declare(f"{variable.key} NEXT", "number"), None
    if not isinstance(last, Number):
        limit = context.declare(f"{variable.key} LAST", "number")
    context.written |= {variable.key, counter.key}
    body = context.repeated(node.body)
    context.out.append(
        Count(
            span=node.span,
            variable=variable,
            counter=counter,
            limit=limit,
            first=first,
            last=last,
            step=step,
            body=body,
        )
    )


def return_(context: Context, node: tree.Return) -> None:
    """Translate a RETURN."""
    context.out.append(Return(span=node.span, value=value_of(context, node.value)))
    context.end_way()


def halt(context: Context, node: tree.Halt) -> None:
    """Translate a HALT: devices are switched off, and the program ends."""
    context.out.append(Halt(span=node.span))
    context.end_way()


# ---- MOVE ----------------------------------------------------------------------------------------------------------


def move(context: Context, node: tree.Move) -> None:
    """Translate a MOVE into its stages."""
    _refuse_clauses(context, node)
    clauses = {type(clause): clause for clause in node.clauses}
    grip = _grip(context, node)
    points = [node.goal]
    for clause in node.clauses:
        if isinstance(clause, tree.Approach | tree.Departure):
            points.append(clause.point)
        elif isinstance(clause, tree.Via):
            points += clause.points
    form = form_of(node, lambda point: next(str(i) for i, one in enumerate(points) if one is point))
    places = {str(i): _tool_at(context, point, grip) for i, point in enumerate(points)}
    speed: Value = Number(NORMAL_SPEED)
    if isinstance(given := clauses.get(tree.Speed), tree.Speed):
        speed = value_of(context, given.value)
    timed = tree.Duration in clauses
    for number, stage in enumerate(stages_of(form)):
        passages = context.run.passages(node.span.start, number, len(stage.frames))
        context.reached[node.span.start] = passages.reached
        duration = None
        if timed and passages.reached:
            if len(passages.durations) and float(passages.durations.max() - passages.durations.min()) > _SAME_TIME:
                text = (
                    "the time of a stage of this MOVE depends on where it goes, and its DURATION is that of the whole"
                )
                context.refuse(node.span, text, "on this MOVE", "give a SPEED, or a MOVE for each stage")
            duration = float(passages.durations.max())
        context.out.append(
            MoveTo(
                span=node.span,
                straight=stage.kind is not MotionKind.PTP,
                targets=tuple(places[frame] for frame in stage.frames),
                passages=passages,
                speed=Number(HIGHEST_SPEED) if timed else speed,
                duration=duration,
            )
        )
    context.move_hand(places[form.goal], node.span)


def _refuse_clauses(context: Context, node: tree.Move) -> None:
    """Refuse a MOVE with a clause that has no counterpart."""
    for clause in node.clauses:
        if isinstance(clause, tree.On):
            text = "a MOVE that ends by its guard has no counterpart that a proof can run"
            context.refuse(node.span, text, "this MOVE is guarded", "leave the ON out of this MOVE", code="E611")
        if isinstance(clause, tree.Blend) and not any(isinstance(other, tree.Via) for other in node.clauses):
            text = "which MOVE this one goes over into is known while the program runs"
            advice = "write one MOVE, with these frames in VIA", "export the run by `--mode plan`"
            context.refuse(clause.span, text, "BLEND into the next MOVE", *advice)
        if not isinstance(clause, (*_CLAUSES, tree.Duration)):
            context.refuse_construct(clause)


def _grip(context: Context, node: tree.Move) -> Value | None:
    """Return where what is moved is on the tool; None for the tool itself."""
    require_arm(context, node.moved)
    moved = node.moved
    if isinstance(moved, tree.ArmName) or (isinstance(moved, tree.Name) and is_arm(moved.key)):
        return None
    name, variable = frame_of(context, moved)
    flow = context.compiled.flow
    if flow is not None and node.span.start in flow.implied:
        hang(context, node, name, variable, Hanging(frozenset({context.arm}), context.arm))
    with context.at(node):
        if context.attachments.carried_by(name) != context.arm:
            text = f"that an arm carries `{context.compiled.source.slice(moved.span)}` is known on no way to this MOVE"
            advice = f"write AFFIX ... TO {context.arm} before"
            context.refuse(node.span, text, "it is moved here", advice, code="E620")
    return variable


def _tool_at(context: Context, point: tree.Expression, grip: Value | None) -> Value:
    """Return the pose of the tool where what is moved is at a point."""
    goal = value_of(context, point)
    return goal if grip is None else simplified("compose", (goal, simplified("inverse", (grip,))))


# ---- outputs, waits and texts --------------------------------------------------------------------------------------


def fingers(context: Context, node: tree.Open | tree.Grasp) -> None:
    """Translate OPEN and GRASP."""
    if node.arm is not None:
        require_arm(context, node.arm)
    if isinstance(node, tree.Open) and node.width is not None:
        text = f"an output switches the gripper of {context.arm}, and cannot open it to a width"
        context.refuse(node.span, text, "a width is asked for", f"write `OPEN {context.arm}`", code="E616")
    placed, closed = context.placed, isinstance(node, tree.Grasp)
    output = placed.controller.gripper_output
    if output is None:
        text = f"the cell file does not say which output of the controller switches the gripper of {context.arm}"
        advice = f"write `[arms.{context.arm}]` `gripper_output = {{ output = 1 }}`"
        context.refuse(node.span, text, "it is switched here", advice, code="E615")
    context.out.append(Switch(span=node.span, name=context.arm, address=output, on=closed))
    seconds = placed.grasp_time if closed else placed.open_time
    if seconds:
        ticks = math.ceil(seconds / context.cell.period - 1e-6)
        context.out.append(Pause(span=node.span, seconds=Number(ticks * context.cell.period)))


def output_of(context: Context, node: tree.Node, device: tree.Name) -> Output:
    """Return the output of the controller that switches a device.

    Raises:
        ExportError: the cell file does not say.
    """
    found = context.cell.output_of(device.key)
    if found is None:
        text = f"the cell file does not say which output of the controller switches {device.key}"
        advice = f"write `[devices]` `{device.key} = {{ output = 1 }}`"
        context.refuse(node.span, text, "it is switched here", advice, code="E615")
    return found


def operate_device(context: Context, node: tree.Operate) -> None:
    """Translate an OPERATE."""
    if node.value is not None or not isinstance(node.device, tree.Name):
        context.refuse_construct(node)
    address = output_of(context, node, node.device)
    context.outputs.setdefault(node.device.key, address)
    context.out.append(Switch(span=node.span, name=node.device.key, address=address, on=node.on))


def pulse(context: Context, node: tree.Pulse) -> None:
    """Translate a PULSE."""
    if not isinstance(node.device, tree.Name):
        context.refuse_construct(node)
    address = output_of(context, node, node.device)
    context.outputs.setdefault(node.device.key, address)
    seconds = value_of(context, node.duration)
    context.out.append(Switch(span=node.span, name=node.device.key, address=address, on=True, pulse=seconds))


def read_system(context: Context, node: tree.ReadSystem) -> None:
    """READ SYSTEM says where the arm is, which the program knows anyway."""
    require_arm(context, node.arm)


def read_visions(context: Context, node: tree.ReadVisions) -> None:
    """Translate READ VISIONS: a function for each frame, which answers as in the run until it asks a real camera."""
    for target in node.targets:
        name, variable = frame_of(context, target)
        seen = context.run.seen(variable.key)
        if len(seen) != 1 or variable.indices:
            text = "the function that stands for the camera has one answer, and the run had several, or none"
            context.refuse(node.span, text, "the camera is asked here", "export the run by `--mode plan`", code="E620")
        key = f"CAMERA {variable.key}"
        if all(one.key != key for one in context.procedures):
            answer = Return(span=node.span, value=Pose(seen[0]))
            context.procedures.append(Procedure(key=key, parameters=(), result="pose", body=(answer,)))
        line = context.compiled.source.place(node.span.start)
        note = f"line {line}: a function answers for the camera as in the run: let it ask the camera of the controller"
        context.notes.setdefault(note)
        place_frame(context, node, name, variable, FunctionCall(key, ()))


def pause(context: Context, node: tree.Pause) -> None:
    """Translate a PAUSE."""
    context.out.append(Pause(span=node.span, seconds=value_of(context, node.duration)))


def wait_until(context: Context, node: tree.WaitUntil) -> None:
    """Translate a WAIT UNTIL; without ELSE, what is too late ends the program."""
    condition = value_of(context, node.condition)
    limit = None if node.limit is None else value_of(context, node.limit)
    before = context.attachments.copy()
    late: tuple[Statement, ...] = ()
    if node.otherwise is not None:
        late = context.block(node.otherwise)
    elif limit is not None:
        line = context.compiled.source.place(node.span.start)
        late = (Print(span=node.span, items=(f"line {line}: too late",)), Halt(span=node.span))
    context.attachments = before.join(context.attachments)
    context.out.append(WaitUntil(span=node.span, condition=condition, limit=limit, late=late))


def print_(context: Context, node: tree.Print) -> None:
    """Translate a PRINT of texts, numbers and conditions."""
    items: list[str | Value] = []
    for item in node.items:
        if isinstance(item, tree.String):
            items.append(item.value)
            continue
        constant = context.constants.get(item.key) if isinstance(item, tree.Name) else None
        if isinstance(constant, str):
            items.append(constant)
            continue
        value = value_of(context, item)
        if is_pose(context, value):
            context.refuse(item.span, "controllers show texts and numbers, and no poses", "a pose", "print its X, Y, Z")
        if isinstance(value, Number | Truth):
            items.append(_shown(value))
        else:
            items.append(value)
    context.out.append(Print(span=node.span, items=tuple(items)))


def _shown(value: Number | Truth) -> str:
    return str(value.value).lower() if isinstance(value, Truth) else f"{value.value + 0.0:.6g}"


TRANSLATORS: Translators = {
    tree.Block: block,
    tree.If: choice,
    tree.While: loop,
    tree.Repeat: repeat,
    tree.For: count,
    tree.Return: return_,
    tree.Halt: halt,
    tree.Move: move,
    tree.Open: fingers,
    tree.Grasp: fingers,
    tree.Operate: operate_device,
    tree.Pulse: pulse,
    tree.ReadSystem: read_system,
    tree.ReadVisions: read_visions,
    tree.Pause: pause,
    tree.WaitUntil: wait_until,
    tree.Print: print_,
}
