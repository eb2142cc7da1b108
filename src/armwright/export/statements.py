"""What a controller is to do, in the words of none: statements that every writer prints in the language of its own."""

from typing import TypeAlias

import attrs
import numpy as np

from armwright.arrays import Array, read_only
from armwright.cell.model import CellArm
from armwright.cell.outputs import Output
from armwright.export.conventions import ControllerArm
from armwright.program.language.source import Source, Span
from armwright.program.vm.recording import RunStage


@attrs.frozen(kw_only=True, eq=False)
class MoveJoints:
    """All joints straight to a configuration, at rest at its end.

    Attributes:
        span: the MOVE in the program.
        stage: of the run.
        q: (n,) joint positions at its end.
        duration: of the plan [s].
        speed_part: the largest part of the speed limit of a joint that the plan takes, 1 for all of it.
    """

    span: Span
    stage: RunStage
    q: Array = attrs.field(converter=read_only)
    duration: float
    speed_part: float


@attrs.frozen(kw_only=True, eq=False)
class MoveLines:
    """The tool along one straight line, or along several without a stop at the corners between them.

    Attributes:
        span: the MOVE in the program.
        stage: of the run.
        poses: (k, 4, 4) ends of the lines: the tool, seen from the base frame of the arm.
        q: (k, n) joint positions there; those at corners are near the corner where it is rounded.
        zones: (k,) how far from the end of a line a corner may be rounded [m]; 0 at the last one.
        duration: of the plan [s].
        speed: the largest of the tool point in the plan [m/s].
        turn_speed: the largest of its rotation [rad/s].
        acceleration: the largest of the tool point along its path [m/s²].
    """

    span: Span
    stage: RunStage
    poses: Array = attrs.field(converter=read_only)
    q: Array = attrs.field(converter=read_only)
    zones: Array = attrs.field(converter=read_only)
    duration: float
    speed: float
    turn_speed: float
    acceleration: float


@attrs.frozen(kw_only=True, eq=False)
class MoveKnots:
    """Joint positions one after the other without a stop: a path that is neither straight in joints nor in space.

    Attributes:
        span: the MOVE in the program.
        stage: of the run.
        times: (k,) of the knots since the stage began [s], the end included.
        q: (k, n) joint positions there.
        speed_part: the largest part of the speed limit of a joint that the plan takes, 1 for all of it.
    """

    span: Span
    stage: RunStage
    times: Array = attrs.field(converter=read_only)
    q: Array = attrs.field(converter=read_only)
    speed_part: float


@attrs.frozen(kw_only=True)
class SetOutput:
    """A digital output is switched.

    Attributes:
        span: the statement in the program.
        device: whose output it is, such as ``LAMP`` or ``ARM_1``.
        output: of the controller.
        on: its new state.
    """

    span: Span
    device: str
    output: Output
    on: bool


@attrs.frozen(kw_only=True)
class PulseOutput:
    """A digital output is on for a time [s], while the program goes on."""

    span: Span
    device: str
    output: Output
    seconds: float


@attrs.frozen(kw_only=True)
class Wait:
    """Nothing happens for a time [s]."""

    span: Span
    seconds: float


@attrs.frozen(kw_only=True)
class Say:
    """A text is shown to the operator."""

    span: Span
    text: str


Statement: TypeAlias = MoveJoints | MoveLines | MoveKnots | SetOutput | PulseOutput | Wait | Say


@attrs.frozen(kw_only=True, eq=False)
class ControllerProgram:
    """What one controller is to do, one statement after the other.

    Attributes:
        name: of the program, as its file is called.
        source: text of the program.
        arm_name: of the arm in the cell.
        placed: the arm in the cell.
        mapped: the arm with the convention of its controller.
        start: (n,) joint positions before the first statement.
        deviation: how far the path between knots may be off that of the plan [m].
        statements: in order.
        notes: what of the run is fixed in the statements, such as answers of a camera.
    """

    name: str
    source: Source
    arm_name: str
    placed: CellArm
    mapped: ControllerArm
    start: Array = attrs.field(converter=read_only)
    deviation: float
    statements: tuple[Statement, ...]
    notes: tuple[str, ...] = ()

    def straight_ends(self) -> Array:
        """Return the joint positions (k, n) at the ends of all straight lines, in order."""
        ends = [one.q for one in self.statements if isinstance(one, MoveLines)]
        return np.concatenate(ends) if ends else np.empty((0, len(self.start)))
