"""The syntax tree: what a program says, and where it says it."""

from typing import TypeAlias

import attrs

from armwright.program.language.source import Span
from armwright.program.syntax.nodes import (
    ArmName,
    Binary,
    Expression,
    Function,
    Index,
    Matrix,
    Mobile,
    Name,
    Node,
    Number,
    Poison,
    String,
    Unary,
    Variable,
    child_nodes,
    dump,
    operation_chain,
    walk,
)

# What the nodes of values are called here too.
__all__ = ["ArmName", "Binary", "Expression", "Function", "Index", "Matrix", "Mobile", "Name", "Node", "Number"]
__all__ += ["Poison", "String", "Unary", "Variable", "child_nodes", "dump", "operation_chain", "walk"]


@attrs.frozen
class Assign(Node):
    """``variable = value``."""

    target: Variable | ArmName
    value: Expression


@attrs.frozen
class Affix(Node):
    """``AFFIX child TO parent [AT step] [RIGIDLY]``; ``link`` reaches from AFFIX to the parent."""

    link: Span
    child: Mobile
    parent: Mobile
    at: Expression | None
    rigid: bool = False


@attrs.frozen
class Unfix(Node):
    """``UNFIX child FROM parent``; the parent is missing where it was left out."""

    child: Mobile
    parent: Mobile | None


FrameStatement: TypeAlias = Assign | Affix | Unfix


@attrs.frozen
class Open(Node):
    """``OPEN arm [TO width]``."""

    arm: Mobile
    width: Expression | None = None


@attrs.frozen
class Grasp(Node):
    """``GRASP [arm]``."""

    arm: Mobile | None


@attrs.frozen
class Operate(Node):
    """``OPERATE device [ON | OFF]``, or ``OPERATE device TO value``."""

    device: Mobile
    on: bool = True
    value: Expression | None = None


@attrs.frozen
class Pulse(Node):
    """``PULSE device FOR seconds``."""

    device: Mobile
    duration: Expression


@attrs.frozen
class SetTimer(Node):
    """``TIMER name ON | OFF``, or ``TIMER name TO value``."""

    name: Name
    on: bool = True
    value: Expression | None = None


@attrs.frozen
class ReadVisions(Node):
    """``READ VISIONS (frame, frame)``."""

    targets: tuple[Mobile, ...]


@attrs.frozen
class ReadSystem(Node):
    """``READ SYSTEM (arm)``."""

    arm: Mobile


@attrs.frozen
class ZeroForce(Node):
    """``ZERO FORCE arm``."""

    arm: Mobile


DeviceStatement: TypeAlias = Open | Grasp | Operate | Pulse | SetTimer | ReadVisions | ReadSystem | ZeroForce


@attrs.frozen
class Directly(Node):
    """The shortest path for the joints."""


@attrs.frozen
class Straightly(Node):
    """One straight line."""


@attrs.frozen
class Circularly(Node):
    """One arc of a circle, through the one frame of VIA."""


@attrs.frozen
class Smoothly(Node):
    """Shaped, so that an arm with flexible gears does not vibrate at the end."""


@attrs.frozen
class Via(Node):
    """``VIA (points)``."""

    points: tuple[Expression, ...]


@attrs.frozen
class Approach(Node):
    """``WITH APPROACH = point``."""

    point: Expression


@attrs.frozen
class Departure(Node):
    """``WITH DEPARTURE = point``."""

    point: Expression


@attrs.frozen
class Speed(Node):
    """``WITH SPEED = value``."""

    value: Expression


@attrs.frozen
class Blend(Node):
    """``WITH BLEND = distance``: how far from a via point its corner may be rounded."""

    value: Expression


@attrs.frozen
class Duration(Node):
    """``WITH DURATION = seconds``."""

    value: Expression


@attrs.frozen
class Velocity(Node):
    """``WITH VELOCITY = length per second``: the largest speed of the tool point."""

    value: Expression


@attrs.frozen
class Rotation(Node):
    """``WITH ROTATION = angle per second``: the largest angular speed of the tool."""

    value: Expression


@attrs.frozen
class Acceleration(Node):
    """``WITH ACCELERATION = length per second squared``: how fast the speed of the tool point may change."""

    value: Expression


@attrs.frozen
class Tracking(Node):
    """``WITH TRACKING = frame``: a frame of the cell that moves, with which the goal goes."""

    point: Expression


@attrs.frozen
class Correction(Node):
    """``WITH CORRECTION = length``: how far beside its line the path is to be, looked at while the arm moves."""

    value: Expression


@attrs.frozen
class Bound(Node):
    """``WITH BOUND = length``: how far beside its line a path may be at most."""

    value: Expression


@attrs.frozen
class Rate(Node):
    """``WITH RATE = length per second``: how fast a path may move sideways."""

    value: Expression


@attrs.frozen
class Capacity(Node):
    """``WITH CAPACITY = number``: how many frames a queue holds."""

    value: Expression


@attrs.frozen
class On(Node):
    """``ON condition DO action``; ``head`` reaches from ON to the end of the condition."""

    head: Span
    condition: Expression
    action: "Statement"


Clause: TypeAlias = (
    Directly
    | Straightly
    | Circularly
    | Smoothly
    | Via
    | Approach
    | Departure
    | Speed
    | Blend
    | Duration
    | Velocity
    | Rotation
    | Acceleration
    | Tracking
    | Correction
    | Bound
    | Rate
    | Capacity
    | On
)
# Clauses that limit the tool.
TOOL_LIMITS = (Velocity, Rotation, Acceleration)


def clause_word(kind: type) -> str:
    """Return the word by which the clauses of a kind begin, behind WITH."""
    return kind.__name__.upper()


@attrs.frozen
class Move(Node):
    """``MOVE moved TO goal clauses``."""

    moved: Mobile
    goal: Expression
    clauses: tuple[Clause, ...]


# The clauses of a queue.
QUEUE_CLAUSES = (Capacity, Speed, Velocity, Blend)
QUEUE_WORDS = tuple(clause_word(kind) for kind in QUEUE_CLAUSES)


@attrs.frozen
class Queue(Node):
    """``QUEUE arm clauses DO statement``; ``head`` reaches up to DO."""

    head: Span
    arm: Mobile
    clauses: tuple[Clause, ...]
    body: "Statement"


@attrs.frozen
class Put(Node):
    """``PUT frame TO arm [ELSE statement]``; ``head`` reaches up to ELSE."""

    head: Span
    frame: Expression
    arm: Mobile
    otherwise: "Statement | None" = None


QueueStatement: TypeAlias = Queue | Put


@attrs.frozen
class Block(Node):
    """``BEGIN statements END``; ``end`` is its END."""

    statements: tuple["Statement", ...]
    end: Span

    @property
    def is_assignment(self) -> bool:
        """Whether it stands for the assignment of a record, field by field, which is one statement."""
        return self.end == self.span


@attrs.frozen
class If(Node):
    """``IF condition THEN statement [ELSE statement]``; ``head`` reaches up to THEN."""

    head: Span
    condition: Expression
    then: "Statement"
    otherwise: "Statement | None"

    @property
    def else_if_chain(self) -> tuple[list["If"], "Statement | None"]:
        """This IF and all that follow it with ELSE IF, and the statement behind the last ELSE."""
        conditionals, last = [self], self.otherwise
        while isinstance(last, If):
            conditionals.append(last)
            last = last.otherwise
        return conditionals, last

    @property
    def statements(self) -> "tuple[Statement, ...]":
        """The statements of its chain of which one is done."""
        conditionals, last = self.else_if_chain
        return (*(conditional.then for conditional in conditionals), *(() if last is None else (last,)))


@attrs.frozen
class While(Node):
    """``WHILE condition DO statement``; ``head`` reaches up to DO."""

    head: Span
    condition: Expression
    body: "Statement"


@attrs.frozen
class Repeat(Node):
    """``REPEAT statements UNTIL condition``; ``tail`` reaches from UNTIL to the end."""

    body: tuple["Statement", ...]
    tail: Span
    condition: Expression


@attrs.frozen
class For(Node):
    """``FOR variable = first TO last [STEP step] DO statement``; ``head`` reaches up to DO."""

    head: Span
    variable: Name | Poison
    first: Expression
    last: Expression
    step: Expression | None
    body: "Statement"


@attrs.frozen
class Branch(Node):
    """``[PRIORITY number :] BEGIN ... END``; ``head`` is its first line's words up to BEGIN."""

    head: Span
    priority: Number | None
    body: Block


@attrs.frozen
class Cobegin(Node):
    """``COBEGIN branches COEND``; ``end`` is its COEND."""

    branches: tuple[Branch, ...]
    end: Span


@attrs.frozen
class Signal(Node):
    """``SIGNAL event``."""

    event: Variable


@attrs.frozen
class Wait(Node):
    """``WAIT event [WITHIN seconds [ELSE statement]]``; ``head`` reaches up to ELSE."""

    head: Span
    event: Variable
    limit: "Expression | None" = None
    otherwise: "Statement | None" = None


@attrs.frozen
class WaitUntil(Node):
    """``WAIT UNTIL condition [WITHIN seconds [ELSE statement]]``; ``head`` reaches up to ELSE."""

    head: Span
    condition: Expression
    limit: Expression | None = None
    otherwise: "Statement | None" = None


@attrs.frozen
class Pause(Node):
    """``PAUSE seconds``."""

    duration: Expression


@attrs.frozen
class When(Node):
    """``WHEN [name:] [PRIORITY number:] condition DO action``; ``head`` reaches up to DO."""

    head: Span
    name: Name | None
    priority: Number | None
    condition: Expression
    action: "Statement"


@attrs.frozen
class WatchSwitch(Node):
    """``WHEN name ON | OFF``."""

    name: Name
    on: bool


@attrs.frozen
class Brake(Node):
    """``BRAKE``."""


@attrs.frozen
class Resume(Node):
    """``RESUME``."""


@attrs.frozen
class Lock(Node):
    """``LOCK (variables) DO statement``; ``head`` reaches up to DO."""

    head: Span
    targets: tuple[Variable, ...]
    body: "Statement"


@attrs.frozen
class Try(Node):
    """``TRY statements RECOVER statements END``; ``recover`` and ``end`` are its words, or where they are missing.

    It recovers from the ``kinds`` of errors behind RECOVER, or from all where there are none.
    """

    body: tuple["Statement", ...]
    recover: Span
    recovery: tuple["Statement", ...]
    end: Span
    kinds: tuple[Name | Poison, ...] = ()


@attrs.frozen
class Retry(Node):
    """``RETRY``."""


@attrs.frozen
class Halt(Node):
    """``HALT``."""


@attrs.frozen
class Raise(Node):
    """``RAISE kind [WITH text]``."""

    kind: Name
    text: Expression | None = None


@attrs.frozen
class Return(Node):
    """``RETURN value``."""

    value: Expression


@attrs.frozen
class Call(Node):
    """``name (arguments)``."""

    name: Name
    arguments: tuple[Expression, ...]


ControlStatement: TypeAlias = (
    Block
    | If
    | While
    | Repeat
    | For
    | Cobegin
    | Signal
    | Wait
    | WaitUntil
    | Pause
    | When
    | WatchSwitch
    | Brake
    | Resume
    | Lock
    | Try
    | Retry
    | Halt
    | Raise
    | Return
    | Call
)


@attrs.frozen
class Print(Node):
    """``PRINT (values and strings)``."""

    items: tuple[Expression, ...]


@attrs.frozen
class Log(Node):
    """``LOG "name" (values)``."""

    name: String
    items: tuple[Expression, ...]


OutputStatement: TypeAlias = Print | Log

# What a FUNCTION is made of: it works out a value, and does nothing else.
FUNCTION_STATEMENTS = (Assign, Block, If, While, Repeat, For, Raise, Return, Poison)

Statement: TypeAlias = (
    FrameStatement | DeviceStatement | Move | QueueStatement | ControlStatement | OutputStatement | Poison
)


@attrs.frozen
class TypeName(Node):
    """The type of a declaration.

    Attributes:
        span: where it stands.
        text: as written.
        key: such as SCALAR; None when it is none of the types.
        sizes: of an array, one for each index; empty for a single thing.
        record: the name of a RECORD, where the type is one; its key is None then.
    """

    text: str
    key: str | None
    sizes: tuple[Number, ...] = ()
    record: Name | None = None


@attrs.frozen
class Declaration(Node):
    """``a, b : TYPE``, in a VAR part or as a parameter; ``mode`` is IN or INOUT where the program says which."""

    names: tuple[Name, ...]
    type: TypeName
    mode: str = ""


@attrs.frozen
class Record(Node):
    """``RECORD name ; fields END``: a type whose variables have fields of their own."""

    name: Name
    fields: tuple[Declaration, ...]


@attrs.frozen
class Constant(Node):
    """``name = value`` behind CONST."""

    name: Name
    value: Expression


@attrs.frozen
class Module(Node):
    """``MODULE name``, the first line of a module."""

    name: Name


@attrs.frozen
class Import(Node):
    """``IMPORT "file" [AS name]``; behind AS stands what a module is called in this file."""

    path: String
    alias: Name | None = None


@attrs.frozen
class Units(Node):
    """``UNITS unit, unit``."""

    units: tuple[Name, ...]


@attrs.frozen
class Procedure(Node):
    """``PROCEDURE name (parameters) ; VAR ... BEGIN ... END``; ``head`` reaches up to the closing parenthesis.

    A FUNCTION has the type of its ``result`` behind the parenthesis.
    """

    head: Span
    name: Name
    parameters: tuple[Declaration, ...]
    declarations: tuple[Declaration, ...]
    body: Block
    result: TypeName | None = None


Header: TypeAlias = Module | Record | Declaration | Constant | Import | Units | Procedure


@attrs.frozen
class Program(Node):
    """A whole program.

    Attributes:
        span: from the first token to the last.
        headers: declarations, constants, imports, units and procedures, in the order of the text.
        statements: in order.
        end: the closing END.
    """

    headers: tuple[Header, ...]
    statements: tuple[Statement, ...]
    end: Span

    @property
    def module(self) -> Module | None:
        """The line that makes a module of the program; None where it is none."""
        return next((header for header in self.headers if isinstance(header, Module)), None)

    @property
    def imports(self) -> tuple[Import, ...]:
        """The imports."""
        return tuple(header for header in self.headers if isinstance(header, Import))

    @property
    def records(self) -> tuple[Record, ...]:
        """The types of records."""
        return tuple(header for header in self.headers if isinstance(header, Record))

    @property
    def declarations(self) -> tuple[Declaration, ...]:
        """The declarations of the VAR parts."""
        return tuple(header for header in self.headers if isinstance(header, Declaration))

    @property
    def constants(self) -> tuple[Constant, ...]:
        """The constants."""
        return tuple(header for header in self.headers if isinstance(header, Constant))

    @property
    def procedures(self) -> tuple[Procedure, ...]:
        """The procedures."""
        return tuple(header for header in self.headers if isinstance(header, Procedure))
