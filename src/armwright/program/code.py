"""Intermediate code: one instruction is one effect on the frame table, or one part of a motion."""

import enum
from collections.abc import Iterator, Mapping

import attrs

from armwright.program.source import Source, Span

NORMAL_SPEED = 100.0
LOWEST_SPEED, HIGHEST_SPEED = 1.0, 120.0


class Op(enum.StrEnum):
    """What an instruction does. Operands in brackets; names are canonical (upper case, ``ARM_1``)."""

    LOADM = "LOADM"  # (frame or trans, constant): give it the twelve numbers
    LOADS = "LOADS"  # (scalar, constant): give it the number
    AFFIX = "AFFIX"  # (child, parent): hang on, where both stand now
    AFFAT = "AFFAT"  # (child, parent, trans): hang on, at a step from the parent
    UNFIX = "UNFIX"  # (child, parent): cut; the child keeps its place
    OPEN = "OPEN"  # (arm): open the fingers
    GRASP = "GRASP"  # (arm): close the fingers
    OPER = "OPER"  # (device): start a tool
    READV = "READV"  # (frame): ask the vision system
    READS = "READS"  # (arm): read the joint sensors
    MVBEG = "MVBEG"  # (moved, goal): a motion begins
    MVDIR = "MVDIR"  # (): the shortest way in joint space
    MVSTR = "MVSTR"  # (): one straight line
    MVVIA = "MVVIA"  # (frame, ...): through these without a stop
    MVAPP = "MVAPP"  # (frame): approach point
    MVDEP = "MVDEP"  # (frame): departure point
    MVSPD = "MVSPD"  # (number or scalar): speed
    MVEND = "MVEND"  # (): go; the instruction's ``move`` says all
    STOP = "STOP"  # (): end of the program


class Kind(enum.StrEnum):
    """What a name stands for."""

    SCALAR = "SCALAR"
    TRANS = "TRANS"
    FRAME = "FRAME"


class Trajectory(enum.StrEnum):
    """The three basic trajectories.

    ``PTP``: all joints at once, at rest at both ends. ``LINE``: the moved frame on a straight line.
    ``SPLINE``: through frames without a stop, at rest at the last.
    """

    PTP = "PTP"
    LINE = "LINE"
    SPLINE = "SPLINE"


@attrs.frozen(kw_only=True)
class Move:
    """One MOVE.

    Attributes:
        moved: the arm or the frame that shall come to the goal.
        arm: the arm that moves.
        implied: whether ``moved`` is hung on ``arm`` only now, because the hand has grasped it and no AFFIX says so.
        goal: the frame to come to.
        via: frames on the way, without a stop.
        approach: the frame from which the goal is approached in a straight line.
        departure: the frame to which the start is left in a straight line.
        straight: one straight line.
        direct: neither line nor points on the way.
        speed: 1..120, or the name of a scalar that has to hold such a number when the motion starts.
    """

    moved: str
    arm: str
    implied: bool = False
    goal: str
    via: tuple[str, ...] = ()
    approach: str | None = None
    departure: str | None = None
    straight: bool = False
    direct: bool = False
    speed: float | str = NORMAL_SPEED

    @property
    def frames(self) -> tuple[str, ...]:
        """Every frame that must have a value when the motion starts, goal first."""
        return (self.goal, *self.via, *(name for name in (self.approach, self.departure) if name))


@attrs.frozen(kw_only=True)
class StagePlan:
    """One stage of a motion: a basic trajectory and the frames it leads to, the last being its end."""

    kind: Trajectory
    frames: tuple[str, ...]


def stages_of(move: Move) -> tuple[StagePlan, ...]:
    """Return the stages that make up a motion, in order.

    Source:
        TR-83-008, third paper: twelve forms of MOVE; approach and departure together by the same logic.
    """
    stages = []
    if move.departure:
        stages.append(StagePlan(kind=Trajectory.LINE, frames=(move.departure,)))
    end = move.approach or move.goal
    gross = Trajectory.LINE if move.straight else Trajectory.SPLINE if move.via else Trajectory.PTP
    stages.append(StagePlan(kind=gross, frames=(*move.via, end)))
    if move.approach:
        stages.append(StagePlan(kind=Trajectory.LINE, frames=(move.goal,)))
    return tuple(stages)


@attrs.frozen(kw_only=True)
class Instruction:
    """One step.

    Attributes:
        op: what to do.
        operands: names, or numbers; a constant is given by its index.
        span: the part of the program that asks for it.
        move: on MVEND the whole motion, elsewhere None.
        comment: a word to the reader of a listing.
    """

    op: Op
    operands: tuple[str | int | float, ...] = ()
    span: Span
    move: Move | None = None
    comment: str = ""


@attrs.frozen(kw_only=True)
class Code:
    """A translated program.

    Attributes:
        instructions: in order; the last is STOP.
        constants: n, o, a, p (twelve numbers, column by column, lengths in [m]) or one number each.
        spelling: how the program first writes each canonical name.
        kinds: what each declared or predeclared name stands for (arms, WORLD and STATION are frames).
        source: the program text.
    """

    instructions: tuple[Instruction, ...]
    constants: tuple[tuple[float, ...] | float, ...] = ()
    spelling: Mapping[str, str] = attrs.field(factory=dict)
    kinds: Mapping[str, Kind] = attrs.field(factory=dict)
    source: Source

    def spelled(self, name: str) -> str:
        """Return a canonical name as the program writes it."""
        return self.spelling.get(name, name)

    def line(self, instruction: Instruction) -> int:
        """Return the line of the program, from 1, that asks for an instruction."""
        return self.source.line(instruction.span.start)


def stages_text(code: Code, move: Move) -> str:
    """Return the stages in a word each, such as ``PTP apf1 / LINE obj1``."""
    return " / ".join(
        " ".join((stage.kind.value, *(code.spelled(name) for name in stage.frames))) for stage in stages_of(move)
    )


def listing(code: Code) -> str:
    """Return the code for people: number, line, operation, operands, remarks; then the constants."""
    width = max(3, len(str(code.line(code.instructions[-1]))))
    rows = [f"{'line':>{width + 7}}  op     operands"]
    rows += [_row(code, at, step, width) for at, step in enumerate(code.instructions)]
    if code.constants:
        rows += ["", *(f"c{index:<4} {_number_list(value)}" for index, value in enumerate(code.constants))]
    return "\n".join(rows) + "\n"


def _row(code: Code, at: int, step: Instruction, width: int) -> str:
    operands = " ".join(_operands(code, step))
    row = f"{at:04d} {code.line(step):>{width}}    {step.op.value:<6} {operands}".rstrip()
    return f"{row:<37} ; {step.comment}" if step.comment else row


def _operands(code: Code, step: Instruction) -> Iterator[str]:
    for index, operand in enumerate(step.operands):
        if isinstance(operand, str):
            yield code.spelled(operand)
        elif step.op in (Op.LOADM, Op.LOADS) and index == 1:
            yield f"c{operand}"
        else:
            yield f"{operand:.12g}"


def _number_list(value: tuple[float, ...] | float) -> str:
    numbers = value if isinstance(value, tuple) else (value,)
    triples = [numbers[i : i + 3] for i in range(0, len(numbers), 3)]
    return ", ".join(",".join(f"{number:.12g}" for number in triple) for triple in triples)
