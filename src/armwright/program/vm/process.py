"""What a running program consists of: processes, the procedures they are in, the motions they make."""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeAlias

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.cell.hardware import PeakContact
from armwright.motion.plan import PlannedStage
from armwright.motion.trajectory import Trajectory
from armwright.program.language.source import Span
from armwright.program.vm.recording import TimedKind

if TYPE_CHECKING:
    from armwright.motion.corrected_line import CorrectedLine
    from armwright.motion.frame_queue import FrameQueue, Pace
    from armwright.physics.collisions import Collision, StageClearance
    from armwright.physics.planner import PlannedPath
    from armwright.program.vm.move_request import MoveRequest


@attrs.frozen
class StartTime:
    """When something began.

    Attributes:
        tick: of the servo.
        order: counts all that has begun; of the same tick, what began first has the smaller number.
    """

    tick: int
    order: int


@attrs.frozen
class ElementReference:
    """An element of an array, or a variable, as a value in passing: what it names is read and written."""

    name: str


# Numbers, truth values, texts, poses and steps (4, 4), elements.
Value: TypeAlias = float | bool | str | Array | ElementReference


@attrs.frozen
class TryBlock:
    """A TRY that a process is in.

    Attributes:
        start: its first instruction.
        recovery: of its RECOVER part.
        recovering: whether that part is running.
        lock_count: how many locks the process held when it began.
        kinds: of the errors that it recovers from; empty for all.
        watch_count: how many WHENs the process had armed or disarmed when it began.
        queue_count: how many queues it had opened.
    """

    start: int
    recovery: int
    recovering: bool
    lock_count: int
    kinds: tuple[str, ...] = ()
    watch_count: int = 0
    queue_count: int = 0

    def recovers_from(self, kind: str) -> bool:
        """Whether it recovers from a kind of error: not where it has failed already."""
        return not self.recovering and (not self.kinds or kind in self.kinds)


@attrs.define
class Activation:
    """One run of a procedure, of the main program, of a condition or action inside a motion, or of that of a WHEN.

    Attributes:
        kind: what it is.
        name: of the procedure; empty for others.
        bindings: where the procedure's own names are kept.
        temporaries: values in passing, by name.
        temporary_spans: the part of the program that gave each of them.
        return_address: the instruction to go on with afterwards.
        try_blocks: the TRYs it is in, innermost last.
        call_span: the statement that called it; of an action, its MOVE; of that of a WHEN, what it interrupts.
        local_slots: where its own variables are kept, gone with it.
        lock_count: how many locks the process held when it began.
        result: where the value of a function goes.
        interrupted: what the action of a WHEN has interrupted; None for others.
    """

    kind: Literal["main", "procedure", "condition", "action", "watch"]
    name: str = ""
    bindings: dict[str, str] = attrs.field(factory=dict)
    temporaries: dict[str, Value] = attrs.field(factory=dict)
    temporary_spans: dict[str, Span] = attrs.field(factory=dict)
    return_address: int = -1
    try_blocks: list[TryBlock] = attrs.field(factory=list)
    call_span: Span | None = None
    local_slots: tuple[str, ...] = ()
    lock_count: int = 0
    result: str = ""
    interrupted: Interruption | None = None

    def create_nested(self, kind: Literal["condition", "action", "watch"], **fields: Any) -> Activation:
        """Return the activation of a condition or an action, which has the names of this one."""
        names, temporaries, spans = self.bindings, self.temporaries, self.temporary_spans
        return Activation(kind=kind, bindings=names, temporaries=temporaries, temporary_spans=spans, **fields)


@attrs.define
class Guard:
    """``ON condition DO action`` of a motion running.

    Attributes:
        condition: first instruction of the condition.
        result: the value in passing that it leaves.
        action: first instruction of the action.
        reads_pose: whether the condition checks poses, and not only at forces and numbers.
        reads_force: whether it checks forces.
        triggered: whether the action has been begun.
    """

    condition: int
    result: str
    action: int
    reads_pose: bool
    reads_force: bool = False
    triggered: bool = False


@attrs.define
class Watch:
    """A ``WHEN condition DO action`` that a process has armed.

    Attributes:
        start: its instruction, which tells it from others.
        name: that the program gives it; empty where it has none.
        title: for people: with its name, or else as it is written.
        priority: the larger is served first, and interrupts the smaller.
        condition: first instruction of the condition.
        result: the value in passing that it leaves.
        action: first instruction of the action.
        activation: whose names it sees.
        depth: how many activations its process had when it was armed.
        reads_pose: whether the condition checks poses.
        reads_outside: whether it reads what changes by itself: the time, inputs, outputs, forces.
        armed: whether it is judged.
        holds: whether its condition held when it was judged last.
        due: whether its action is to be run.
    """

    start: int
    name: str
    title: str
    priority: float
    condition: int
    result: str
    action: int
    activation: Activation
    depth: int
    reads_pose: bool
    reads_outside: bool
    armed: bool = True
    holds: bool = False
    due: bool = False


@attrs.define
class Interruption:
    """What the action of a WHEN has interrupted, to go on with afterwards.

    Attributes:
        title: of the WHEN, for people.
        priority: of the WHEN.
        wake_tick: when the process was to go on [ticks].
        waiting: why it did not go on.
        unfulfilled_wait: the event, the locks or the condition that it had not got.
        pending_effect: what was to take effect at ``wake_tick``.
        last_arm: named or moved last.
        motion: the MOVE that was put aside for a MOVE of the action; None where none was.
        braked: whether the action has braked the MOVE, and not resumed it.
        held: the arms whose queues it has braked, and not resumed.
    """

    title: str
    priority: float
    wake_tick: int
    waiting: WaitReason | None
    unfulfilled_wait: WaitReason | None
    pending_effect: PendingEffect | None
    last_arm: str | None
    motion: Motion | None = None
    braked: bool = False
    held: tuple[str, ...] = ()


class StoppedOn(NamedTuple):
    """Where a stage was stopped: its trajectory, and the time on that whose position the arm comes to rest at [s]."""

    trajectory: Trajectory
    reached: float


class Course(NamedTuple):
    """How a resumed stage follows its path: the trajectory as it was planned, and the time on that at each time [s]."""

    planned: Trajectory
    clock: Trajectory

    def stopped(self, t: float) -> StoppedOn:
        """Return where on the planned trajectory the resumed stage is at a time [s]."""
        return StoppedOn(self.planned, float(np.clip(self.clock(t)[0], 0.0, self.planned.duration)))


class PendingStage(NamedTuple):
    """A stage of a MOVE that has not begun.

    Attributes:
        planned: the stage.
        goal_names: the frames it goes to, as the program spells them.
        start_tick: when it is to begin [ticks].
        clearance: how near it comes to other bodies; None where that is not looked at.
        path: that was planned past other bodies; None where the straight one of the joints was free.
        course: of a stage that was stopped and is resumed; None of others.
    """

    planned: PlannedStage
    goal_names: tuple[str, ...]
    start_tick: int
    clearance: StageClearance | None = None
    path: PlannedPath | None = None
    course: Course | None = None


class Threat(NamedTuple):
    """What a running MOVE would run into, because another arm was stopped.

    Attributes:
        tick: when that was [ticks].
        collision: what would happen.
        stopped: the other arm.
    """

    tick: int
    collision: Collision
    stopped: str


class Tracking(NamedTuple):
    """How a MOVE tracks a frame that moves.

    Attributes:
        frame: the frame.
        X_FT: (4, 4) pose of the tool at the goal, in it.
        reached: how long the tool takes to its goal [ticks].
        end: how long it is followed, since the MOVE began [ticks]; None where it stands in the window at last.
        cut: why it is followed no longer; empty where it leaves the window.
    """

    frame: str
    X_FT: Array
    reached: int
    end: int | None
    cut: str


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
        X_HM: (4, 4) that frame seen from the gripper.
        span: the statement.
        goal: the frame to come to, or the expression of it.
        implied_affix: whether what is moved hangs on the arm only since this MOVE.
        text: what the trace says of it.
        stages: what is still to do after the present stage.
        speed: as asked for.
        stack_depth: how many activations its process had when it began; those after them belong to its actions.
        start: when the MOVE began.
        stage_start_tick: when the present stage began [ticks].
        stage_end_tick: when it will end [ticks].
        guards: to be looked at on every tick.
        hand_poses: (k, 4, 4) poses of the gripper in the world on the ticks of the present stage, for guards that look.
        stage_index: number of the present stage among those recorded.
        rest_tick: when the arm is at rest [ticks], once it is being stopped; None before.
        alarm_tick: when the arm presses deeper than the cell allows [ticks] if it continues; None if it never does.
        threat: what it would run into, because another arm was stopped; None where that is not so.
        first_contact: the trajectory of a stage that comes into contact, and when on it [s]; None before.
        deepest_contact: the deepest contact so far.
        paths: the paths past other bodies that were planned for its stages.
        early_end: what ended it before its goal; None where nothing did.
        course: of its present stage, where that was resumed; None where it was not.
        stopped: where its present stage was stopped, which may be its end; None where that runs.
        correction: by a sensor, of its path; None where there is none.
        tracking: of a frame that moves, which the arm follows when the MOVE is over; None where it does not.
    """

    arm: str
    moved: str
    X_HM: Array
    span: Span
    goal: str
    implied_affix: bool
    text: str
    stages: list[PendingStage]
    speed: float
    stack_depth: int
    start: StartTime
    guards: list[Guard]
    stage_start_tick: int = 0
    stage_end_tick: int = 0
    hand_poses: Array = attrs.field(factory=lambda: np.empty((0, 4, 4)))
    stage_index: int = -1
    rest_tick: int | None = None
    alarm_tick: int | None = None
    threat: Threat | None = None
    first_contact: tuple[Trajectory, float] | None = None
    deepest_contact: PeakContact = attrs.field(factory=lambda: PeakContact(0.0, 0.0))
    paths: tuple[PlannedPath, ...] = ()
    early_end: EarlyEnd | None = None
    course: Course | None = None
    stopped: StoppedOn | None = None
    tracking: Tracking | None = None
    correction: Correction | None = None

    @property
    def trace_text(self) -> str:
        """What the trace says of it, with what ended it early."""
        return self.text if self.early_end is None else f"{self.text}; {self.early_end}"

    @property
    def event_data(self) -> dict[str, object]:
        """Further facts for the events."""
        data: dict[str, object] = {
            "moved": self.moved,
            "goal": self.goal,
            "speed": self.speed,
            "implied_affix": self.implied_affix,
        }
        if self.correction is not None:
            data["largest_correction"] = self.correction.largest
        if self.paths:
            data["planned_paths"] = [path.as_data() for path in self.paths]
        return data if self.early_end is None else {**data, self.early_end.value: True}


@attrs.frozen(kw_only=True, eq=False)
class MovesAhead:
    """MOVEs that are to go over into the next one, and have not begun.

    Attributes:
        arm: the arm that is to move.
        moved: the frame that shall come to the goals.
        requests: what they ask for, in order.
        poses: (4, 4) pose of the tool at the goal of each, in the base of the arm.
        joints: (n,) joint positions at the goal of each; None where it is a frame.
        implied_affix: whether what is moved hangs on the arm only since the first of them.
    """

    arm: str
    moved: str
    requests: tuple[MoveRequest, ...] = ()
    poses: tuple[Array, ...] = ()
    joints: tuple[Array | None, ...] = ()
    implied_affix: bool = False


@attrs.frozen(kw_only=True, eq=False)
class Correction:
    """How a sensor corrects the path of a MOVE.

    Attributes:
        code: first instruction of what says how far beside its line the path is to be.
        result: the value in passing that it leaves.
        bound: how far it may be [m].
        rate: how fast the path may move sideways [m/s].
        side: (3,) where it moves, of length 1, in the base of the arm; zeros before the line is known.
        line: that is corrected; None before it begins.
        tick: when it is looked at next [ticks].
        largest: the largest offset that was asked for [m].
    """

    code: int
    result: str
    bound: float
    rate: float
    side: Array = attrs.field(factory=lambda: np.zeros(3))
    line: CorrectedLine | None = None
    tick: int = 0
    largest: float = 0.0


@attrs.frozen(kw_only=True, eq=False)
class RingQueue:
    """The open queue of an arm.

    Attributes:
        arm: the arm.
        span: the statement.
        capacity: how many frames may be ahead of the arm.
        pace: how fast it is run.
        start: when it was opened.
        path: on which the arm runs; None before the first frame.
        labels: of the frames that were put in, as the program writes them, those that are passed too.
        frames: (4, 4) their poses in the world.
    """

    arm: str
    span: Span
    capacity: int
    pace: Pace
    start: StartTime
    path: FrameQueue | None = None
    labels: tuple[str, ...] = ()
    frames: tuple[Array, ...] = ()

    def ahead(self, now: float) -> int:
        """Return how many frames the arm has not passed."""
        return 0 if self.path is None else len(self.labels) - self.path.passed(now)


@attrs.frozen
class WaitReason:
    """Why a process does not go on.

    Attributes:
        kind: for an event, for locks, for the processes that it has begun, or for a condition.
        names: of the event or the locked variables.
        span: the statement.
        start: when it began to wait.
        deadline: of a condition, when it is too late [ticks]; None where it never is.
    """

    kind: Literal["event", "locks", "branches", "condition"]
    names: tuple[str, ...]
    span: Span
    start: StartTime
    deadline: int | None = None


@attrs.frozen(kw_only=True)
class PendingEffect:
    """What takes effect when the time of a statement is over.

    Attributes:
        kind: of the effect.
        text: of the trace.
        start: when it began.
        span: the statement.
        arm: the arm that does it, or None.
        frame_pose: a frame that gets a pose then, and the pose.
        data: further facts for the events.
    """

    kind: TimedKind
    text: str
    start: StartTime
    span: Span
    arm: str | None = None
    frame_pose: tuple[str, Array] | None = None
    data: dict[str, object] = attrs.field(factory=dict)


@attrs.define(eq=False)
class Process:
    """One thread of a program.

    Attributes:
        path: its position among the branches of the text: ``()`` for the program, ``(1,)`` for the second branch.
        priority: served first when larger.
        pc: the next instruction.
        wake_tick: when it goes on [ticks].
        stack: activations, the present one last.
        parent: the process that began it.
        waiting: why it does not go on; None when only the clock holds it.
        unfulfilled_wait: the event or the locks that it has not got yet, also while it is about to look again.
        motion: the MOVE running.
        ahead: MOVEs that wait for the next one, to go over into it.
        pending_effect: what takes effect at ``wake_tick``.
        last_arm: named or moved last.
        locks: the variables it has locked, in the order of taking.
        branches: processes begun and not yet joined.
        done: whether it has ended.
        message: of the error that it recovered from last.
        watches: the WHENs of the blocks that it is in, in the order of arming.
        judged_tick: when it has judged them last [ticks].
        queues: the arms whose queues it has opened, in the order of opening.
    """

    path: tuple[int, ...] = ()
    priority: float = 0.0
    pc: int = 0
    wake_tick: int = 0
    stack: list[Activation] = attrs.field(factory=lambda: [Activation(kind="main")])
    parent: Process | None = None
    waiting: WaitReason | None = None
    unfulfilled_wait: WaitReason | None = None
    motion: Motion | None = None
    ahead: MovesAhead | None = None
    pending_effect: PendingEffect | None = None
    last_arm: str | None = None
    locks: list[str] = attrs.field(factory=list)
    branches: list[Process] = attrs.field(factory=list)
    done: bool = False
    message: str = ""
    watches: list[Watch] = attrs.field(factory=list)
    judged_tick: int = -1
    queues: list[str] = attrs.field(factory=list)

    @property
    def activation(self) -> Activation:
        """The present activation."""
        return self.stack[-1]

    @property
    def due_tick(self) -> int | None:
        """When it is served next [ticks]: to go on, or to judge its WHENs; None where it waits for others."""
        due, judge = self.work_tick, self.judge_tick
        return due if judge is None else judge if due is None else min(due, judge)

    @property
    def judge_tick(self) -> int | None:
        """When it is to judge its WHENs next [ticks]; None where none is armed."""
        return self.judged_tick + 1 if any(watch.armed for watch in self.watches) else None

    @property
    def work_tick(self) -> int | None:
        """When it goes on, or its arm has to be stopped [ticks]; None where it waits for others."""
        motion, wake = self.motion, None if self.waiting is not None else self.wake_tick
        alarm = None if motion is None else motion.alarm_tick
        threat = None if motion is None or motion.threat is None else motion.threat.tick
        return min((tick for tick in (alarm, threat, wake) if tick is not None), default=None)

    @property
    def title(self) -> str:
        """How people call it: ``program``, or ``branch 2``, ``branch 2.1``."""
        return f"branch {'.'.join(str(number + 1) for number in self.path)}" if self.path else "program"

    @property
    def followed_motion(self) -> Motion | None:
        """The MOVE that is followed now; None in an action of it, or in a procedure that an action calls."""
        motion = self.motion
        if motion is None or any(one.kind in ("action", "watch") for one in self.stack[motion.stack_depth :]):
            return None
        return motion

    @property
    def interruption(self) -> Interruption | None:
        """What the innermost action of a WHEN that it is in has interrupted; None outside of such actions."""
        return next((one.interrupted for one in reversed(self.stack) if one.interrupted is not None), None)

    def interruption_of(self, motion: Motion) -> Interruption | None:
        """What interrupts a motion, where that is the action of a WHEN; None where it is one of an ON, or nothing."""
        inner = (one for one in reversed(self.stack[motion.stack_depth :]) if one.kind in ("action", "watch"))
        return next((one.interrupted for one in inner), None)

    def forget_watches(self) -> None:
        """Disarm the WHENs of activations that have been left."""
        if self.watches:
            self.watches = [watch for watch in self.watches if watch.depth <= len(self.stack)]

    def descends_from(self, other: Process) -> bool:
        """Whether another process began this one, directly or through others, or is this one."""
        return self.path[: len(other.path)] == other.path
