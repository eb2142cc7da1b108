"""Exporting a motion of the joints that no program made, such as one that excites the dynamics of an arm."""

import attrs
import numpy as np

from armwright.cell.frames import FrameTree
from armwright.cell.model import Cell, CellArm
from armwright.errors import InvalidValueError
from armwright.export.api import ExportedProgram, export_run
from armwright.export.targets import Target
from armwright.motion.plan import PlannedStage
from armwright.motion.trajectory import Trajectory
from armwright.program.bytecode.instructions import Code
from armwright.program.language.source import Source, Span
from armwright.program.vm.recording import Effect, Recording, RunStage

_ARM = "ARM_1"
# What holds positions in time. The others choose the speed between two points by themselves.
_IN_TIME: tuple[Target, ...] = ("ros2", "csv", "urscript")
_INSTEAD = {
    "krl": "KRL gives no times to the points of a path; stream it by the Robot Sensor Interface",
    "rapid": "RAPID gives no times to points that are passed; stream it by Externally Guided Motion",
    "fanuc": "a program of the pendant gives no times to points that are passed; stream it by its Stream Motion",
}


def export_motion(target: Target, motion: Trajectory, placed: CellArm, name: str) -> ExportedProgram:
    """Return a motion of the joints for a controller that keeps to its times.

    Args:
        target: ``ros2``, ``csv`` or ``urscript``.
        motion: of the n joints, from rest to rest.
        placed: the arm, with what is known of its controller: encoders for ``csv``, a convention for ``urscript``.
        name: of the exported program.

    Returns:
        The files, with their proof.

    Raises:
        InvalidValueError: the target does not keep to times.
        ExportError: nothing is known of the encoders, or no convention; the motion is too long.
        CheckFailedError: the files differ from the motion.
        MissingExtraError: Lark is not installed, and the target needs it.
    """
    require_times(target)
    return export_run(target, _as_run(motion, placed, name), name)


def require_times(target: Target) -> None:
    """Refuse a target that does not keep to the times of a motion.

    Raises:
        InvalidValueError: it is one.
    """
    if target not in _IN_TIME:
        raise InvalidValueError(
            f"export: expected {', '.join(_IN_TIME)}, got {target}, which does not hold the motion: {_INSTEAD[target]}"
        )


def _as_run(motion: Trajectory, placed: CellArm, name: str) -> Recording:
    """Return a run in which an arm makes one motion, and nothing else happens."""
    source = Source(name=name, text=f"{{ {name} }}")
    span = Span(0, len(source.text))
    start, end = motion(0.0), motion(motion.duration)
    cell = Cell(name=name, arms={_ARM: attrs.evolve(placed, start=start)})
    stage = RunStage(
        t0=0.0,
        arm=_ARM,
        span=span,
        goal_names=(),
        speed=100.0,
        stage=PlannedStage(kind="SPLINE", trajectory=motion, length=0.0),
        motion=motion,
        length=0.0,
        peak_effort=np.zeros(len(start)),
        peak_time=np.zeros(len(start)),
    )
    effect = Effect(t0=0.0, t1=motion.duration, kind="MOVE", span=span, text=f"{_ARM} MOVE: {name}", arm=_ARM)
    return Recording(
        code=Code(instructions=(), source=source),
        cell=cell,
        duration=motion.duration,
        effects=(effect,),
        stages=(stage,),
        streams=(),
        trees=((0.0, FrameTree()),),
        configurations={_ARM: end},
    )
