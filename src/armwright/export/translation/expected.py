"""What a run of the program did, statement by statement: what a controller has to do when it runs the translation."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from armwright.export.plan_mode import SWITCHING, run_events, switching
from armwright.export.statements import (
    ControllerProgram,
    MoveJoints,
    MoveLines,
    PulseOutput,
    Say,
    SetOutput,
    Statement,
    Wait,
)
from armwright.export.translation.code import ProgramCode
from armwright.program.vm.recording import Effect, Recording, RunStage


class Expected(NamedTuple):
    """What is to be done, and when each of it was over in the run.

    Attributes:
        program: the statements.
        ends: when each thing is over that takes part in it and is no text, one for each straight line [s].
    """

    program: ControllerProgram
    ends: tuple[float, ...]


def expected(code: ProgramCode, recording: Recording) -> Expected:
    """Return what the controller of a translated program has to do in the cell of a run."""
    found = list(_statements(code, recording))
    program = ControllerProgram(
        name=code.name,
        source=code.source,
        arm_name=code.arm_name,
        placed=code.placed,
        mapped=code.mapped,
        start=code.placed.start,
        deviation=recording.cell.deviation,
        statements=tuple(statement for statement, _ in found),
    )
    ends = [
        end
        for statement, end in found
        if not isinstance(statement, Say)
        for _ in range(len(statement.poses) if isinstance(statement, MoveLines) else 1)
    ]
    return Expected(program, (0.0, *ends))


def _statements(code: ProgramCode, recording: Recording) -> Iterator[tuple[Statement, float]]:
    for begin, end, effect, stages in run_events(recording):
        if effect.kind == "MOVE":
            for stage in stages:
                yield _motion(stage), stage.t1
        elif effect.kind in SWITCHING:
            yield from ((one, begin if isinstance(one, SetOutput) else end) for one in _switched(effect, recording))
        elif effect.kind == "PAUSE":
            yield Wait(span=effect.span, seconds=end - begin), end
        elif effect.kind == "PRINT":
            yield Say(span=effect.span, text=str(effect.data["printed"])), end
    last = next(effect for effect in recording.effects if effect.kind == "END")
    for name, address in code.outputs:
        yield SetOutput(span=last.span, device=name, output=address, on=False), last.t1


def _switched(effect: Effect, recording: Recording) -> list[Statement]:
    if "seconds" in effect.data:
        name = str(effect.data["device"])
        output = recording.cell.output_of(name)
        assert output is not None  # noqa: S101 - the translation has refused others
        return [PulseOutput(span=effect.span, device=name, output=output, seconds=float(effect.data["seconds"]))]
    return switching(effect, recording)


def _motion(stage: RunStage) -> Statement:
    """Return the statement of a stage, also where the arm is there already."""
    goal, motion = stage.stage.goal, stage.motion
    assert goal is not None  # noqa: S101 - planned for one
    end = motion(motion.duration)
    if goal.kind == "PTP":
        return MoveJoints(span=stage.span, stage=stage, q=end, duration=motion.duration, speed_part=1.0)
    count = len(goal.poses)
    return MoveLines(
        span=stage.span,
        stage=stage,
        poses=goal.poses,
        q=np.broadcast_to(end, (count, len(end))),
        zones=np.zeros(count),
        duration=motion.duration,
        speed=0.0,
        turn_speed=0.0,
        acceleration=0.0,
    )
