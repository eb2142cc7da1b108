"""Plan mode: a program is run in its cell, and what the arm did becomes the statements of a controller."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.compiled.arm import planning_arm
from armwright.errors import UnsupportedArmError
from armwright.export.conventions import ControllerArm, controller_arm, conventions, find_convention
from armwright.export.knots import path_knots
from armwright.export.refusals import refusal
from armwright.export.statements import (
    ControllerProgram,
    MoveJoints,
    MoveKnots,
    MoveLines,
    Say,
    SetOutput,
    Statement,
    Wait,
)
from armwright.motion.solver import Solver, solver_of
from armwright.program.bytecode.instructions import Code, Op
from armwright.program.language.source import Span
from armwright.program.vm.recording import Effect, Recording, RunStage
from armwright.spatial.rotations import angle_between

# Times that are this near are the same [s]: a part of the shortest servo period.
_SAME_TIME = 1e-6
# Points along a stage at which the speed of the tool is looked at.
_LOOKS = 65
# Corners are rounded from no more than this part of the shorter leg on, so that two roundings never meet.
_PART_OF_LEG = 0.4
SWITCHING = ("OPEN", "GRASP", "OPERATE")
# What takes no part in an export: it changes frames, or orders the branches of a program.
_SILENT = ("PLACE", "AFFIX", "UNFIX", "LOCK", "SIGNAL", "WAIT", "TIMER")
# What reads the cell while the program runs.
_READING = (Op.INPUT, Op.ANALOG, Op.FORCE)

_Event: TypeAlias = tuple[float, float, Effect, tuple[RunStage, ...]]


def plan_statements(recording: Recording, name: str, *, zones: bool = True, streams: bool = True) -> ControllerProgram:
    """Return what the controller of the arm that a program moved is to do.

    Args:
        recording: a run that came to its end.
        name: of the program, as its file is called.
        zones: whether the language of the controller says from where on a corner is rounded; without that, a path with
            rounded corners is given by joint positions along it.
        streams: whether it has positions at the period of the controller, so that a motion runs as it is planned.

    Raises:
        ExportError: the run has what a controller cannot repeat without it: a guarded MOVE, branches that work at the
            same time, a second arm, a device without an output, an arm without a convention.
    """
    refuse_tracking(recording)
    refuse_guards(recording)
    if not streams:
        _refuse_shaping(recording)
    arm_name = only_arm(recording)
    _refuse_parallel(recording)
    placed = recording.cell.arms[arm_name]
    mapped = mapped_arm(recording, arm_name)
    solver = solver_of(planning_arm(placed.arm))
    statements: list[Statement] = []
    busy = 0.0
    for begin, end, effect, stages in run_events(recording):
        if begin > busy + 1.5 * recording.cell.period:
            # An event has been waited for.
            statements.append(Wait(span=effect.span, seconds=begin - busy))
        busy = max(busy, end)
        if effect.kind == "MOVE":
            statements += [
                statement for stage in stages for statement in _motion(stage, recording, solver, zones=zones)
            ]
        elif effect.kind in SWITCHING:
            statements += switching(effect, recording)
        elif effect.kind == "PAUSE":
            statements.append(Wait(span=effect.span, seconds=effect.t1 - effect.t0))
        elif effect.kind == "PRINT":
            statements.append(Say(span=effect.span, text=str(effect.data["printed"])))
        elif effect.kind == "END":
            statements += [
                _set_device(device, on=False, effect=effect, recording=recording)
                for device in effect.data["switched_off"]
            ]
    return ControllerProgram(
        name=name,
        source=recording.code.source,
        arm_name=arm_name,
        placed=placed,
        mapped=mapped,
        start=placed.start,
        deviation=recording.cell.deviation,
        statements=tuple(statements),
        notes=tuple(fixed_notes(recording)),
    )


def fixed_notes(recording: Recording) -> Iterator[str]:
    """Give what of a run is fixed in its export, each with the line of the program."""
    source, told = recording.code.source, set[str]()
    for step in recording.code.instructions:
        if step.op in _READING:
            note = f"line {source.place(step.span.start)}: what inputs and sensors say is that of the run"
            if note not in told:
                told.add(note)
                yield note
    for effect in recording.effects:
        line = source.place(effect.span.start)
        if effect.kind == "READ" and effect.arm is None:
            note = f"line {line}: the answer of the camera is that of the run"
        elif effect.kind == "ERROR":
            note = f"line {line}: the error of the run, and what the program did then, are part of the export"
        elif effect.kind == "LOG":
            note = f"line {line}: the rows of LOG are those of the run, and the controller writes none"
        else:
            continue
        if note not in told:
            told.add(note)
            yield note


def refuse_guards(recording: Recording) -> None:
    """Refuse a run with a MOVE that is guarded or was stopped on its path, or that waits for a condition.

    Raises:
        ExportError: it has one.
    """
    source, guarded, has_guard = recording.code.source, set[Span](), False
    for step in recording.code.instructions:
        has_guard = step.op is Op.MVON or (has_guard and step.op is not Op.MVBEG)
        if step.op is Op.MVEND and has_guard:
            guarded.add(step.span)
    for step in recording.code.instructions:
        if step.op is Op.WHEN:
            text = "what a WHEN does depends on what it meets, and a planned motion is always the same"
            raise refusal(source, "E611", text, step.span, "armed here", helps=["leave the WHEN out of this program"])
    for stage in recording.stages:
        if stage.span in guarded or stage.stopped:
            text = "a MOVE that ends by its guard depends on what it meets, and a planned motion is always the same"
            helps = ["leave the ON out of this MOVE, or end it by a frame"]
            raise refusal(source, "E611", text, stage.span, "this MOVE is guarded", helps=helps)
    for effect in recording.effects:
        if effect.kind == "ZERO":
            text = "ZERO FORCE sets a force sensor, which a planned motion does not read"
            raise refusal(source, "E611", text, effect.span, "no controller is told so", helps=["leave it out"])
        if effect.kind == "WAIT" and "event" not in effect.data:
            text = "a WAIT UNTIL ends when its condition holds, and a planned motion goes on at the same time always"
            helps = ["write PAUSE, or export the parts of the program before and behind it"]
            raise refusal(source, "E611", text, effect.span, "a condition is waited for", helps=helps)


def refuse_tracking(recording: Recording) -> None:
    """Refuse a run with a MOVE that tracks a frame.

    Raises:
        ExportError: it has one.
    """
    for stage in recording.stages:
        if stage.stage.kind == "SENSED":
            text = "the path is corrected by a sensor, and a planned motion is always the same"
            helps = ["export the parts of the program before and behind it"]
            raise refusal(recording.code.source, "E611", text, stage.span, "a sensor corrects this path", helps=helps)
        if stage.stage.kind == "QUEUE":
            text = "frames are put into the queue of an arm while it moves, and a planned motion is known before"
            helps = ["write `MOVE ... VIA (...)` with the frames"]
            raise refusal(recording.code.source, "E611", text, stage.span, "a queue is run along here", helps=helps)
        if stage.stage.kind == "TRACK":
            text = "a frame that moves is tracked by the controller itself, and a planned motion is always the same"
            helps = ["export the parts of the program before and behind it"]
            raise refusal(recording.code.source, "E611", text, stage.span, "a frame is tracked here", helps=helps)


def _refuse_shaping(recording: Recording) -> None:
    """Refuse a run with a MOVE that is shaped: the controller runs its motions by its own profile.

    Raises:
        ExportError: it has one.
    """
    for stage in recording.stages:
        if stage.stage.shaping is not None:
            text = "SMOOTHLY shapes how a motion runs in time, and in this language the controller decides that"
            helps = ["export it to `urscript`, `ros2` or `csv`, which get the positions over time"]
            raise refusal(recording.code.source, "E611", text, stage.span, "shaped here", helps=helps)


def only_arm(recording: Recording) -> str:
    """Return the name of the arm that moved, or whose gripper did; the first of the cell where none did."""
    used: dict[str, Span] = {}
    for effect in recording.effects:
        if effect.kind in ("MOVE", "OPEN", "GRASP") and effect.arm is not None:
            used.setdefault(effect.arm, effect.span)
    if len(used) > 1:
        first, second = list(used)[:2]
        span = used[second]
        text = f"{second} moves beside {first}, and the program of a controller moves one arm"
        helps = ["export the motions of all arms by `armwright export ros2` or `csv`"]
        raise refusal(recording.code.source, "E613", text, span, "a second arm moves here", helps=helps)
    return next(iter(used), min(recording.cell.arms))


def _refuse_parallel(recording: Recording) -> None:
    """Refuse a run in which two things happened at the same time: their order would not be that of the run."""
    last: Effect | None = None
    busy = 0.0
    for begin, end, effect, _ in run_events(recording):
        if last is not None and begin < busy - _SAME_TIME:
            source = recording.code.source
            text = f"{effect.kind} begins while {last.kind} in line {source.place(last.span.start)} is under way"
            helps = ["let the branches of the COBEGIN do one thing after the other"]
            raise refusal(source, "E612", text, effect.span, "at the same time as something else", helps=helps)
        if end > busy:
            last, busy = effect, end


def mapped_arm(recording: Recording, arm_name: str) -> ControllerArm:
    """Return the arm with the convention of its controller.

    Raises:
        ExportError: none is known, or the arm does not fit it.
    """
    placed, source = recording.cell.arms[arm_name], recording.code.source
    span = recording.stages[0].span if recording.stages else Span(0, 0)
    convention = find_convention(placed.arm, placed.controller.convention)
    if convention is None:
        text = f"no source that was read says how the controller of '{placed.arm.name}' counts its joints"
        fitting = _fitting(placed.arm)
        known = ", ".join(sorted(conventions()))
        helps = [
            f'name one in the cell file, as in `[arms.{arm_name}]` `controller = "kuka"`; known: {known}',
            f"the axes of this arm can stand as those of: {', '.join(fitting) or 'none of them'}",
        ]
        raise refusal(source, "E614", text, span, f"{arm_name} moves here", helps=helps)
    try:
        return controller_arm(placed.arm, convention)
    except UnsupportedArmError as error:
        raise refusal(source, "E614", str(error), span, f"{arm_name} moves here") from None


def _fitting(arm: Arm) -> list[str]:
    """Return the names of the conventions as which the axes of an arm can stand."""
    found = []
    for name, convention in sorted(conventions().items()):
        with suppress(UnsupportedArmError):
            controller_arm(arm, convention)
            found.append(name)
    return found


# ---- events --------------------------------------------------------------------------------------------------------


def run_events(recording: Recording) -> Iterator[_Event]:
    """Give what happened, in order: begin, end, effect, and the stages of a MOVE."""
    stages = {name: iter([stage for stage in recording.stages if stage.arm == name]) for name in recording.cell.arms}
    following = {name: next(ones, None) for name, ones in stages.items()}
    counts = _stage_counts(recording.code)
    for effect in recording.effects:
        if effect.kind in _SILENT:
            continue
        mine: list[RunStage] = []
        if effect.kind == "MOVE" and effect.arm is not None:
            count = counts.get(effect.span, 1)
            while len(mine) < count and (stage := following[effect.arm]) is not None and _belongs(stage, effect):
                mine.append(stage)
                following[effect.arm] = next(stages[effect.arm], None)
        yield effect.t0, effect.t1, effect, tuple(mine)


def _stage_counts(code: Code) -> dict[Span, int]:
    """Return how many stages each MOVE has: the same MOVE may begin again when it has just ended."""
    counts: dict[Span, int] = {}
    count = 0
    for step in code.instructions:
        if step.op is Op.MVBEG:
            count = 1
        elif step.op in (Op.MVAPP, Op.MVDEP):
            count += 1
        elif step.op is Op.MVEND:
            counts[step.span] = count
    return counts


def _belongs(stage: RunStage, effect: Effect) -> bool:
    """Whether a stage is one of a MOVE."""
    return stage.span == effect.span and effect.t0 - _SAME_TIME <= stage.t0 <= effect.t1 + _SAME_TIME


def switching(effect: Effect, recording: Recording) -> list[Statement]:
    """Return the statements of an OPEN, a GRASP or an OPERATE."""
    source = recording.code.source
    words = effect.text.split()
    if effect.kind == "OPERATE":
        device, on = words[0].upper(), words[1] == "ON"
        if effect.data:
            text = f"an output switches {device} on or off, and cannot {_beyond_switching(effect)}"
            helps = [f"write `OPERATE {device} ON` and `OPERATE {device} OFF`", "or export it by `--mode program`"]
            raise refusal(source, "E616", text, effect.span, "more than a switch is asked for", helps=helps)
    else:
        device, on = str(effect.arm), effect.kind == "GRASP"
        if "TO" in words:
            text = f"an output switches the gripper of {device}, and cannot open it to a width"
            raise refusal(source, "E616", text, effect.span, "a width is asked for", helps=[f"write `OPEN {device}`"])
    waiting = [Wait(span=effect.span, seconds=effect.t1 - effect.t0)] if effect.t1 > effect.t0 else []
    return [_set_device(device, on=on, effect=effect, recording=recording), *waiting]


def _beyond_switching(effect: Effect) -> str:
    """Return what an OPERATE or a PULSE does that a switch cannot."""
    return "end a PULSE while the program goes on" if "seconds" in effect.data else "set it to a number"


def _set_device(device: str, *, on: bool, effect: Effect, recording: Recording) -> SetOutput:
    """Return the statement that switches a device, or the gripper of an arm."""
    cell = recording.cell
    if device in cell.arms:
        output, where = (
            cell.arms[device].controller.gripper_output,
            f"`[arms.{device}]` `gripper_output = {{ output = 1 }}`",
        )
    else:
        output, where = cell.output_of(device), f"`[devices]` `{device} = {{ output = 1 }}`"
    if output is None:
        subject = f"the gripper of {device}" if device in cell.arms else device
        text = f"the cell file does not say which output of the controller switches {subject}"
        raise refusal(recording.code.source, "E615", text, effect.span, "it is switched here", helps=[f"write {where}"])
    return SetOutput(span=effect.span, device=device, output=output, on=on)


# ---- motions -------------------------------------------------------------------------------------------------------


def _motion(stage: RunStage, recording: Recording, solver: Solver, *, zones: bool) -> list[Statement]:
    """Return the statements of one stage of a MOVE."""
    motion, span, planned = stage.motion, stage.span, stage.stage
    if not motion.duration:
        return []
    end = motion(motion.duration)
    if not np.ptp(motion(np.linspace(0.0, motion.duration, _LOOKS)), axis=0).any():
        return [Wait(span=span, seconds=motion.duration)]
    is_one = planned.goal is None or len(planned.goal.poses) == 1
    if planned.shaping is not None:
        return [_knots(stage, recording, solver)]
    if planned.kind == "PTP" and is_one and stage.path is None:
        part = _speed_part(stage, solver)
        return [MoveJoints(span=span, stage=stage, q=end, duration=motion.duration, speed_part=part)]
    straight = ("LINE", "BLEND") if zones else ("LINE",)
    if planned.kind in straight and planned.detour is None and planned.goal is not None:
        return [_lines(stage, planned.goal.poses, planned.goal.blend, solver)]
    return [_knots(stage, recording, solver)]


def _knots(stage: RunStage, recording: Recording, solver: Solver) -> MoveKnots:
    """Return the statement for joint positions along a stage."""
    times = path_knots(stage.motion, solver, recording.cell.deviation)
    part = _speed_part(stage, solver)
    return MoveKnots(span=stage.span, stage=stage, times=times, q=stage.motion(times), speed_part=part)


def _speed_part(stage: RunStage, solver: Solver) -> float:
    """Return the largest part of the speed limit of a joint that a stage takes."""
    return float((stage.motion.peaks(1) / solver.arm.limits.speed).max())


def _lines(stage: RunStage, poses: Array, blend: float | Array | None, solver: Solver) -> MoveLines:
    """Return the statement for one straight line, or for several with rounded corners."""
    motion = stage.motion
    times = np.linspace(0.0, motion.duration, _LOOKS)
    X = solver.forward(motion(times))
    step = float(times[1])
    speeds = np.linalg.norm(np.diff(X[:, :3, 3], axis=0), axis=-1) / step
    turns = angle_between(X[:-1, :3, :3], X[1:, :3, :3]) / step
    near = [int(np.linalg.norm(X[:, :3, 3] - pose[:3, 3], axis=-1).argmin()) for pose in poses[:-1]]
    stops = blend is None or stage.stage.obstacle is not None
    return MoveLines(
        span=stage.span,
        stage=stage,
        poses=poses,
        q=motion(np.append(times[near], motion.duration)),
        zones=np.zeros(len(poses)) if stops or blend is None else blend_zones(X[0], poses, blend),
        duration=motion.duration,
        speed=float(speeds.max()),
        turn_speed=float(np.max(turns)),
        acceleration=float(np.abs(np.diff(speeds)).max() / step),
    )


def blend_zones(start: Array, poses: Sequence[Array] | Array, blend: float | Array) -> Array:
    """Return from where on each corner is rounded [m]: as far as is asked for, and never beyond 0.4 of a leg."""
    corners = [start, *poses]
    legs = [float(np.linalg.norm(b[:3, 3] - a[:3, 3])) for a, b in pairwise(corners)]
    asked = zip(np.broadcast_to(blend, len(poses) - 1).tolist(), pairwise(legs), strict=True)
    rounded = (min(each, _PART_OF_LEG * a, _PART_OF_LEG * b) for each, (a, b) in asked)
    return np.array([*rounded, 0.0])
