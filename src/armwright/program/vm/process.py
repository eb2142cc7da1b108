"""What a running program consists of: processes, the procedures they are in, the motions they make."""

import enum
from collections.abc import Callable
from typing import Any, Literal, TypeAlias

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.hardware import Press
from armwright.motion.plan import PlannedStage
from armwright.motion.trajectory import Trajectory
from armwright.program.language.source import Span
from armwright.program.vm.recording import TimedKind


@attrs.frozen
class Start:
    """When something began.

    Attributes:
        tick: of the servo.
        order: counts all that has begun; of the same tick, what began first has the smaller number.
    """

    tick: int
    order: int


@attrs.frozen
class Element:
    """An element of an array, or a variable, as a value in passing: what it names is read and written."""

    name: str


# Numbers, truth values, poses and steps (4, 4), elements.
Value: TypeAlias = float | bool | Array | Element


@attrs.frozen
class Attempt:
    """A TRY that a process is in.

    Attributes:
        start: its first instruction.
        recovery: of its RECOVER part.
        recovering: whether that part is running.
        locks: how many locks the process held when it began.
    """

    start: int
    recovery: int
    recovering: bool
    locks: int


@attrs.define
class Activation:
    """One run of a procedure, of the main program, or of a condition or action inside a motion.

    Attributes:
        kind: what it is.
        name: of the procedure; empty for others.
        bindings: where the procedure's own names are kept.
        passing: values in passing, by name.
        wrote: the part of the program that gave each of them.
        back: the instruction to go on with afterwards.
        attempts: the TRYs it is in, innermost last.
        called: the statement that called it; of an action, its MOVE.
        own: where its own variables are kept, gone with it.
        locks: how many locks the process held when it began.
    """

    kind: Literal["main", "procedure", "condition", "action"]
    name: str = ""
    bindings: dict[str, str] = attrs.field(factory=dict)
    passing: dict[str, Value] = attrs.field(factory=dict)
    wrote: dict[str, Span] = attrs.field(factory=dict)
    back: int = -1
    attempts: list[Attempt] = attrs.field(factory=list)
    called: Span | None = None
    own: tuple[str, ...] = ()
    locks: int = 0

    def inner(self, kind: Literal["condition", "action"], **own: Any) -> "Activation":
        """Return the activation of a condition or an action, which has the names of this one."""
        return Activation(kind=kind, bindings=self.bindings, passing=self.passing, wrote=self.wrote, **own)

    def copy(self, shared: Callable[[dict[str, Any]], dict[str, Any]]) -> "Activation":
        """Return a copy; ``shared`` copies names, and the same names once."""
        return attrs.evolve(
            self,
            bindings=shared(self.bindings),
            passing=shared(self.passing),
            wrote=shared(self.wrote),
            attempts=list(self.attempts),
        )


@attrs.define
class Guard:
    """``ON condition DO action`` of a motion running.

    Attributes:
        condition: first instruction of the condition.
        truth: the value in passing that it leaves.
        action: first instruction of the action.
        looks: whether the condition checks poses, and not only at forces and numbers.
        done: whether the action has been begun.
    """

    condition: int
    truth: str
    action: int
    looks: bool
    done: bool = False


class EarlyEnd(enum.StrEnum):
    """What ends a motion before its goal."""

    HALTED = "halted"  # HALT in an action of it, or another MOVE
    BRAKED = "braked"  # an error, or the end of the program


@attrs.define
class Motion:
    """A MOVE running.

    Attributes:
        arm: the arm that moves.
        moved: the frame that shall come to the goal; the arm itself or what hangs on it.
        tip: (4, 4) that frame seen from the gripper.
        span: the statement.
        goal: the frame to come to, or the expression of it.
        implied: whether what is moved hangs on the arm only since this MOVE.
        text: what the trace says of it.
        stages: what is still to do after the present stage, with the names of where they lead.
        speed: as asked for.
        depth: how many activations its process had when it began; those after them belong to its actions.
        begun: when the MOVE began.
        since: when the present stage began [ticks].
        until: when it will end [ticks].
        guards: to be looked at on every tick.
        hands: (k, 4, 4) poses of the gripper in the world on the ticks of the present stage, for guards that look.
        record: number of the present stage among those recorded.
        rest: when the arm is at rest [ticks], once it is being stopped; None before.
        alarm: when the arm presses deeper than the cell allows [ticks], if it goes on as it does; None if it does not.
        touch: the trajectory of a stage that comes into contact, and when on it [s]; None before.
        pressed: the deepest contact so far.
        ended: what ended it before its goal; None where nothing did.
    """

    arm: str
    moved: str
    tip: Array
    span: Span
    goal: str
    implied: bool
    text: str
    stages: list[tuple[PlannedStage, tuple[str, ...]]]
    speed: float
    depth: int
    begun: Start
    guards: list[Guard]
    since: int = 0
    until: int = 0
    hands: Array = attrs.field(factory=lambda: np.empty((0, 4, 4)))
    record: int = -1
    rest: int | None = None
    alarm: int | None = None
    touch: tuple[Trajectory, float] | None = None
    pressed: Press = attrs.field(factory=lambda: Press(0.0, 0.0))
    ended: "EarlyEnd | None" = None

    @property
    def trace(self) -> str:
        """What the trace says of it, with what ended it early."""
        return self.text if self.ended is None else f"{self.text}; {self.ended}"

    @property
    def data(self) -> dict[str, object]:
        """Further facts for the events."""
        ended = {} if self.ended is None else {self.ended.value: True}
        return {"moved": self.moved, "goal": self.goal, "speed": self.speed, "implied_affix": self.implied, **ended}

    def copy(self) -> "Motion":
        """Return a copy; what never changes is shared."""
        return attrs.evolve(self, stages=list(self.stages), guards=[attrs.evolve(guard) for guard in self.guards])


@attrs.frozen
class Waiting:
    """Why a process does not go on.

    Attributes:
        what: for an event, for locks, or for the processes that it has begun.
        names: of the event or the locked variables.
        span: the statement.
        since: when it began to wait.
    """

    what: Literal["event", "locks", "branches"]
    names: tuple[str, ...]
    span: Span
    since: Start


@attrs.frozen(kw_only=True)
class Pending:
    """What takes effect when the time of a statement is over.

    Attributes:
        kind: of the effect.
        text: of the trace.
        since: when it began.
        span: the statement.
        arm: the arm that does it, or None.
        place: a frame that gets a pose then, and the pose.
        data: further facts for the events.
    """

    kind: TimedKind
    text: str
    since: Start
    span: Span
    arm: str | None = None
    place: tuple[str, Array] | None = None
    data: dict[str, object] = attrs.field(factory=dict)


@attrs.define(eq=False)
class Process:
    """One thread of a program.

    Attributes:
        path: its position among the branches of the text: ``()`` for the program, ``(1,)`` for the second branch.
        priority: served first when larger.
        at: the next instruction.
        wake: when it goes on [ticks].
        stack: activations, the present one last.
        parent: the process that began it.
        waiting: why it does not go on; None when only the clock holds it.
        unmet: the event or the locks that it has not got yet, also while it is about to look again.
        motion: the MOVE running.
        pending: what takes effect at ``wake``.
        last_arm: named or moved last.
        locks: the variables it has locked, in the order of taking.
        branches: processes begun and not yet joined.
        done: whether it has ended.
    """

    path: tuple[int, ...] = ()
    priority: float = 0.0
    at: int = 0
    wake: int = 0
    stack: list[Activation] = attrs.field(factory=lambda: [Activation(kind="main")])
    parent: "Process | None" = None
    waiting: Waiting | None = None
    unmet: Waiting | None = None
    motion: Motion | None = None
    pending: Pending | None = None
    last_arm: str | None = None
    locks: list[str] = attrs.field(factory=list)
    branches: list["Process"] = attrs.field(factory=list)
    done: bool = False

    @property
    def now(self) -> Activation:
        """The present activation."""
        return self.stack[-1]

    @property
    def due(self) -> int | None:
        """When it is served next [ticks], or its arm has to be stopped; None where it waits for others."""
        alarm = None if self.motion is None else self.motion.alarm
        wake = None if self.waiting is not None else self.wake
        return min((tick for tick in (alarm, wake) if tick is not None), default=None)

    @property
    def title(self) -> str:
        """How people call it: ``program``, or ``branch 2``, ``branch 2.1``."""
        return f"branch {'.'.join(str(number + 1) for number in self.path)}" if self.path else "program"

    @property
    def follows(self) -> Motion | None:
        """The MOVE that is followed now; None in an action of it, or in a procedure that an action calls."""
        motion = self.motion
        if motion is None or any(activation.kind == "action" for activation in self.stack[motion.depth :]):
            return None
        return motion

    def copy(self, shared: Callable[[dict[str, Any]], dict[str, Any]]) -> "Process":
        """Return a copy that still has the parent and the branches of this one.

        Args:
            shared: copies names, and the same names once.
        """
        return attrs.evolve(
            self,
            stack=[activation.copy(shared) for activation in self.stack],
            motion=None if self.motion is None else self.motion.copy(),
            locks=list(self.locks),
        )

    def descends_from(self, other: "Process") -> bool:
        """Whether another process began this one, directly or through others, or is this one."""
        return self.path[: len(other.path)] == other.path
