"""Intermediate code: one instruction is one effect on the frame table, one part of a motion, or one step to it."""

import enum
import json
from collections.abc import Mapping
from functools import cached_property
from typing import Self, TypeAlias

import attrs

from armwright.program.language.kinds import VariableType
from armwright.program.language.source import Source, Span
from armwright.program.language.units import UnitSystem
from armwright.program.language.words import Standard


class Op(enum.StrEnum):
    """What an instruction does, and what its operands are; docs/code.md explains both.

    The operands have a letter each: N a number, P a pose or transformation, T a truth value, W a text, v any value, t
    any value or characters, x any argument, s characters; F, S and E the name of a FRAME, a SCALAR or an EVENT, n any
    name, C a counter; k and K a constant of one and of twelve numbers, j a jump target; a an axis, of a moment with M
    in front, o ON or OFF, b TRUE or FALSE, r RIGIDLY, w any word. What is in brackets may be left out, + stands for any
    number more of the last. In front of `=` is what the result is, which goes to the first operand.

    Attributes:
        signature: the letters of its operands.
    """

    _value_: str
    signature: str

    def __new__(cls, name: str, signature: str) -> Self:
        """Return the operation of a name, with the letters of its operands."""
        op = str.__new__(cls, name)
        op._value_, op.signature = name, signature
        return op

    # values
    LOADM = "LOADM", "P=K"  # to, constant: the twelve numbers
    LOADS = "LOADS", "N=k"  # to, constant: the number
    LOADB = "LOADB", "T=b"  # to, TRUE or FALSE
    COPY = "COPY", "nt"  # to, value
    MATX = "MATX", "P=NNNNNNNNNNNN"  # to, twelve values: n, o, a, p
    MUL = "MUL", "nvv"  # to, left, right: numbers, or places and steps
    DIV = "DIV", "N=NN"
    ADD = "ADD", "N=NN"
    SUB = "SUB", "N=NN"
    NEG = "NEG", "N=N"  # to, value
    INV = "INV", "P=P"  # to, place or step
    LT = "LT", "T=NN"  # to, left, right: a truth value
    LE = "LE", "T=NN"
    EQ = "EQ", "T=tt"  # of texts too
    NE = "NE", "T=tt"
    GE = "GE", "T=NN"
    GT = "GT", "T=NN"
    NOT = "NOT", "T=T"  # to, truth value
    XYZ = "XYZ", "P=NNN"  # to, x, y, z: a step without a turn
    ROTX = "ROTX", "P=N"  # to, angle: a turn
    ROTY = "ROTY", "P=N"
    ROTZ = "ROTZ", "P=N"
    TEXT = "TEXT", "W=t+"  # to, values and texts: the text that PRINT would write
    DIST = "DIST", "N=PP"  # to, frame, frame
    RPY = "RPY", "P=NNN"  # to, roll, pitch, yaw: a turn
    ROT = "ROT", "P=NNNN"  # to, three components of an axis, angle: a turn
    X = "X", "N=P"  # to, place or step: a coordinate
    Y = "Y", "N=P"
    Z = "Z", "N=P"
    ROLL = "ROLL", "N=P"  # to, place or step: an angle about a fixed axis, x, then y, then z
    PITCH = "PITCH", "N=P"
    YAW = "YAW", "N=P"
    ANGLE = "ANGLE", "N=P"  # to, place or step: the angle of its turn
    AXISX = "AXISX", "N=P"  # to, place or step: a component of the axis of its turn
    AXISY = "AXISY", "N=P"
    AXISZ = "AXISZ", "N=P"
    ABS = "ABS", "N=N"  # to, value
    SQRT = "SQRT", "N=N"
    ROUND = "ROUND", "N=N"
    SIN = "SIN", "N=N"  # to, angle
    COS = "COS", "N=N"
    TAN = "TAN", "N=N"
    ASIN = "ASIN", "N=N"  # to, value: an angle
    ACOS = "ACOS", "N=N"
    ATAN2 = "ATAN2", "N=NN"  # to, y, x: an angle
    MOD = "MOD", "N=NN"  # to, dividend, divisor: the remainder
    MIN = "MIN", "N=NN+"  # to, values: the smallest
    MAX = "MAX", "N=NN+"
    MESSAGE = "MESSAGE", "W="  # to: of the error that was recovered last
    TIME = "TIME", "N="  # to: the time on the clock of the cell
    FORCE = "FORCE", "N=a"  # to, axis
    INPUT = "INPUT", "T=w"  # to, input: whether it is on
    ANALOG = "ANALOG", "N=w"  # to, input: its number
    OUTPUT = "OUTPUT", "T=w"  # to, device: whether it is on
    SETTING = "SETTING", "N=w"  # to, device: what it is set to
    TIMER = "TIMER", "N=w"  # to, timer: its seconds
    QUEUED = "QUEUED", "N=w"  # to, arm: how many frames of its queue are ahead of it
    CAPACITY = "CAPACITY", "N=w"  # to, arm: how many there may be
    AWAITED = "AWAITED", "P=wN"  # to, arm, number: one of them, 1 for the next
    ELEM = "ELEM", "nwN+"  # to, array, indices: the element itself, to be read and written
    # frames
    AFFIX = "AFFIX", "FF(r)"  # child, parent[, RIGIDLY]: hang on, where both stand now
    AFFAT = "AFFAT", "FFP(r)"  # child, parent, step[, RIGIDLY]: hang on, at a step from the parent
    UNFIX = "UNFIX", "F(F)"  # child[, parent]: cut; the child keeps its place
    # tools and sensors
    OPEN = "OPEN", "w(N)"  # arm[, width]: open the fingers
    GRASP = "GRASP", "(w)"  # [arm]: close the fingers; without an arm, of the one named or moved last
    OPER = "OPER", "wo"  # device, ON or OFF
    OPSET = "OPSET", "wN"  # device, number
    PULSE = "PULSE", "wN"  # device, seconds
    TIMSW = "TIMSW", "wo"  # timer, ON or OFF
    TIMSET = "TIMSET", "wN"  # timer, seconds
    READV = "READV", "F"  # frame: ask the vision system
    READS = "READS", "w"  # arm: read the joint sensors
    ZEROF = "ZEROF", "w"  # arm: its present force and moment count as zero
    # motion
    MVBEG = "MVBEG", "FP"  # moved, goal: a motion begins
    MVDIR = "MVDIR", ""  # the shortest way in joint space
    MVSTR = "MVSTR", ""  # one straight line
    MVCIR = "MVCIR", ""  # one arc through the frame of MVVIA
    MVSMO = "MVSMO", ""  # shaped, against vibrations on flexible gears
    MVJNT = "MVJNT", "N+"  # numbers: the goal is these joint positions, whatever MVBEG says of it
    MVTGT = "MVTGT", "w"  # joint target of the cell: the goal is that
    MVVIA = "MVVIA", "P+"  # frames: through these without a stop
    MVAPP = "MVAPP", "P"  # frame: approach point
    MVDEP = "MVDEP", "P"  # frame: departure point
    MVSPD = "MVSPD", "N"  # number: speed
    MVBLD = "MVBLD", "N"  # number: how far from via points corners may be rounded
    MVDUR = "MVDUR", "N"  # number: how long it shall take
    MVVEL = "MVVEL", "N"  # number: largest speed of the tool point
    MVROT = "MVROT", "N"  # number: largest angular speed of the tool
    MVACC = "MVACC", "N"  # number: largest change of the speed of the tool point
    MVTRK = "MVTRK", "F"  # frame of the cell that moves: its goal goes with that
    MVCOR = "MVCOR", "jn"  # code of a value, the value: how far beside its line the path is to be
    MVBND = "MVBND", "N"  # number: how far it may be
    MVRAT = "MVRAT", "N"  # number: how fast it may move sideways
    MVON = "MVON", "jnj"  # condition, truth value, action: look at every tick, act once
    MVEND = "MVEND", ""  # go
    MVHLT = "MVHLT", ""  # in an action: end the motion
    QUEUE = "QUEUE", "wNNNN"  # arm, capacity, speed, velocity, blend, -1 for none: its queue is opened
    PUT = "PUT", "wP(j)"  # arm, frame[, place when the queue is full]: one frame more
    QUEND = "QUEND", "w"  # arm: stop at the last frame, and close the queue
    # control
    JMP = "JMP", "j"  # place
    JZ = "JZ", "Tj"  # truth value, place: go there when it is false
    FOR = "FOR", "SCNNNj"  # variable, count so far, first, last, step, place: next pass, or go there
    CALL = "CALL", "w(x+)"  # procedure, arguments
    CALLF = "CALLF", "nw(x+)"  # to, function, arguments: its value
    RETV = "RETV", "t"  # value of a function, which ends with it
    NORET = "NORET", ""  # the end of a function, which has not returned a value
    RET = "RET", ""  # end of a procedure, a condition or an action
    FORK = "FORK", "j(N)"  # place[, priority]: a process begins there
    JOIN = "JOIN", ""  # wait for the processes begun here
    QUIT = "QUIT", ""  # end of a process
    SIG = "SIG", "E"  # event
    WAIT = "WAIT", "E"  # event
    AWAIT = "AWAIT", "EjN"  # event, place when it is too late, seconds
    UNTIL = "UNTIL", "jnj(N)"  # condition, truth value, place when it is too late[, seconds]: look at every tick
    LATE = "LATE", ""  # a WAIT UNTIL has lasted too long
    PAUSE = "PAUSE", "N"  # seconds
    WHEN = "WHEN", "jnjN(w)"  # condition, truth value, action, priority[, name]: look at every tick, act when it holds
    WHSET = "WHSET", "wo"  # name of a WHEN, ON or OFF
    DISARM = "DISARM", "j+"  # WHENs of a block that ends
    BRAKE = "BRAKE", ""  # in the action of a WHEN: stop the motion that it interrupts
    RESUME = "RESUME", ""  # and let it go on
    LOCK = "LOCK", "n+"  # variables or elements
    UNLK = "UNLK", "n+"  # the same
    TRY = "TRY", "j(w+)"  # place of the recovery[, kinds of errors]
    RAISE = "RAISE", "w(W)"  # kind of an error[, text]
    ENDT = "ENDT", "j"  # place behind the recovery; nothing went wrong
    ENDR = "ENDR", ""  # end of a recovery
    RETRY = "RETRY", ""  # from the start of the TRY again
    HALT = "HALT", ""  # the program ends here
    STOP = "STOP", ""  # end of the text
    PRINT = "PRINT", "t+"  # values and texts
    LOG = "LOG", "sst+"  # name, titles of the columns as a line of CSV, values and texts


# What may stand between MVBEG and MVEND.
MOVE_PARTS = frozenset(
    (
        *(Op.MVDIR, Op.MVSTR, Op.MVCIR, Op.MVSMO, Op.MVJNT, Op.MVTGT, Op.MVVIA, Op.MVAPP, Op.MVDEP),
        *(Op.MVSPD, Op.MVBLD, Op.MVDUR, Op.MVVEL, Op.MVROT, Op.MVACC, Op.MVTRK, Op.MVON),
        *(Op.MVCOR, Op.MVBND, Op.MVRAT),
    )
)


# What stands for a clause of QUEUE that is left out.
LEFT_OUT = -1.0


@attrs.frozen
class Constant:
    """An operand: the constant of that number."""

    index: int

    def __str__(self) -> str:
        return f"c{self.index}"


@attrs.frozen
class JumpTarget:
    """An operand: the instruction of that number."""

    index: int

    def __str__(self) -> str:
        return f"@{self.index:04d}"


@attrs.frozen
class Text:
    """An operand: characters to print."""

    value: str

    def __str__(self) -> str:
        return json.dumps(self.value, ensure_ascii=False)


# A name in upper case (a variable, an arm, a device, a procedure, a word such as RIGIDLY), a value in passing
# (``%3``), a number, or one of the above.
Operand: TypeAlias = str | float | Constant | JumpTarget | Text


class MotionKind(enum.StrEnum):
    """The basic trajectories.

    ``PTP``: all joints at once, at rest at both ends. ``LINE``: the moved frame on a straight line.
    ``SPLINE``: past frames without a stop, at rest at the last; straight between corners that are rounded as far as
    the cell allows, or through the frames by the report's X-spline in RLO-83. ``BLEND``: the same, rounded from a
    distance on that the program tells. ``ARC``: the moved frame on an arc of a circle through a frame. ``TRACK``: to a
    frame that moves, and on with it.
    """

    PTP = "PTP"
    LINE = "LINE"
    SPLINE = "SPLINE"
    BLEND = "BLEND"
    ARC = "ARC"
    TRACK = "TRACK"


@attrs.frozen(kw_only=True)
class Form:
    """The form of a MOVE: what it goes to, by the names or expressions of the program.

    Attributes:
        goal: what to come to.
        via: what lies on the way, without a stop.
        approach: whence the goal is approached in a straight line.
        departure: where the start is left to in a straight line.
        straight: one straight line.
        blend: whether the corners at via points are rounded.
        circular: one arc through what lies on the way.
        jointwise: the joints go straight from one configuration to the next, and past what lies on the way.
        tracking: the goal goes with a frame that moves.
        smooth: each stage is shaped against vibrations.
    """

    goal: str
    via: tuple[str, ...] = ()
    approach: str | None = None
    departure: str | None = None
    straight: bool = False
    blend: bool = False
    circular: bool = False
    jointwise: bool = False
    tracking: bool = False
    smooth: bool = False

    @property
    def direct(self) -> bool:
        """Whether there is neither a line nor a point on the way."""
        return not (self.straight or self.via or self.approach or self.departure)


@attrs.frozen(kw_only=True)
class StagePlan:
    """One stage of a motion: a basic trajectory and the frames it leads to, the last being its end."""

    kind: MotionKind
    frames: tuple[str, ...]


def stages_of(form: Form) -> tuple[StagePlan, ...]:
    """Return the stages that make up a motion, in order.

    Source:
        TR-83-008, third paper: twelve forms of MOVE; approach and departure together by the same logic.
    """
    if form.tracking:
        return (StagePlan(kind=MotionKind.TRACK, frames=(form.goal,)),)
    stages = []
    if form.departure:
        stages.append(StagePlan(kind=MotionKind.LINE, frames=(form.departure,)))
    end = form.approach or form.goal
    past = MotionKind.ARC if form.circular else MotionKind.BLEND if form.blend else MotionKind.SPLINE
    past = MotionKind.PTP if form.jointwise else past
    gross = past if form.via else MotionKind.LINE if form.straight else MotionKind.PTP
    stages.append(StagePlan(kind=gross, frames=(*form.via, end)))
    if form.approach:
        stages.append(StagePlan(kind=MotionKind.LINE, frames=(form.goal,)))
    return tuple(stages)


def stages_text(form: Form) -> str:
    """Return the stages in a word each, such as ``PTP apf1 / LINE obj1``, and whether they are shaped."""
    text = " / ".join(" ".join((stage.kind.value, *stage.frames)) for stage in stages_of(form))
    return f"{text} smoothly" if form.smooth else text


@attrs.frozen(kw_only=True)
class Instruction:
    """One step.

    Attributes:
        op: what to do.
        operands: in the order of the operation.
        span: the part of the program that asks for it.
        begins: whether it is the first of a statement.
        comment: a word to the reader of a listing; it means nothing.
    """

    op: Op
    operands: tuple[Operand, ...] = ()
    span: Span
    begins: bool = False
    comment: str = attrs.field(default="", eq=False)


@attrs.frozen(kw_only=True)
class ProcedureCode:
    """A procedure.

    Attributes:
        start: its first instruction.
        parameters: names, in order.
        types: of parameters and own variables, by name.
        inout: parameters that are other names of the variables given for them, though of a kind passed by value.
        result: of a function, what its value is.
        records: its records and arrays of records, by name, with their types; their fields are among its ``types``.
    """

    start: int
    parameters: tuple[str, ...]
    types: Mapping[str, VariableType]
    inout: frozenset[str] = frozenset()
    result: VariableType | None = None
    records: Mapping[str, str] = attrs.field(factory=dict)


@attrs.frozen(kw_only=True)
class Code:
    """A translated program.

    Attributes:
        instructions: in order; execution begins with the first.
        constants: n, o, a, p (twelve numbers, column by column, lengths in [m]) or one number each.
        types: what each declared or predeclared name stands for.
        procedures: by name.
        units: what numbers count at run time.
        spelling: how the program first writes each canonical name that is not in upper case.
        standard: which RLO it was read as; motion past VIA points is that of the report in RLO-83.
        records: the records and arrays of records of the program, by name, with their types, as of procedures.
        names: of each file, by its number, the canonical names of what it writes otherwise: names of its modules.
        source: the program text.
    """

    instructions: tuple[Instruction, ...]
    constants: tuple[tuple[float, ...] | float, ...] = ()
    types: Mapping[str, VariableType] = attrs.field(factory=dict)
    procedures: Mapping[str, ProcedureCode] = attrs.field(factory=dict)
    units: UnitSystem = attrs.field(factory=UnitSystem)
    spelling: Mapping[str, str] = attrs.field(factory=dict)
    standard: Standard = Standard.RLO_2
    records: Mapping[str, str] = attrs.field(factory=dict)
    names: Mapping[int, Mapping[str, str]] = attrs.field(factory=dict)
    source: Source

    def spelled(self, name: str) -> str:
        """Return a canonical name as the program writes it; of an element or a local variable too."""
        if name in self.spelling:
            return self.spelling[name]
        base, bracket, indices = name.partition("[")
        base = base.partition("'")[0]
        spelled = self.spelling.get(base, base)
        if bracket and self._is_field(base):
            record, _, field = spelled.rpartition(".")
            return f"{record}[{indices}.{field}"
        return f"{spelled}{bracket}{indices}"

    def _is_field(self, name: str) -> bool:
        """Whether a name is that of a field of a record."""
        record = name.rpartition(".")[0]
        return bool(record) and any(record in own for own in (self.records, *self._procedure_records))

    @cached_property
    def _procedure_records(self) -> tuple[Mapping[str, str], ...]:
        return tuple(procedure.records for procedure in self.procedures.values() if procedure.records)

    def line(self, instruction: Instruction) -> int:
        """Return the line of the program, from 1, that asks for an instruction."""
        return self.source.line(instruction.span.start)


def listing(code: Code) -> str:
    """Return the code for people: number, line, operation, operands, remarks; then the constants."""
    places = [code.source.place(step.span.start) for step in code.instructions]
    width = max(3, *map(len, places))
    starts = {procedure.start: name for name, procedure in code.procedures.items()}
    rows = [f"{'line':>{width + 7}}  op     operands"]
    for at, (step, place) in enumerate(zip(code.instructions, places, strict=True)):
        if at in starts:
            rows.append(f"{'':{width + 9}}{code.spelled(starts[at])}:")
        row = f"{at:04d} {place:>{width}}    {step.op:<6} {' '.join(shown_operands(code, step))}".rstrip()
        rows.append(f"{row:<37} ; {step.comment}" if step.comment else row)
    if code.constants:
        rows += ["", *(f"c{index:<4} {_number_list(value)}" for index, value in enumerate(code.constants))]
    return "\n".join(rows) + "\n"


def shown_operands(code: Code, step: Instruction) -> list[str]:
    """Return the operands of an instruction as a listing writes them."""
    operands = (code.spelled(operand) if isinstance(operand, str) else operand for operand in step.operands)
    return [f"{operand:.12g}" if isinstance(operand, float | int) else str(operand) for operand in operands]


def _number_list(value: tuple[float, ...] | float) -> str:
    """Return a constant for people."""
    numbers = value if isinstance(value, tuple) else (value,)
    triples = [numbers[i : i + 3] for i in range(0, len(numbers), 3)]
    return ", ".join(",".join(f"{number:.12g}" for number in triple) for triple in triples)
