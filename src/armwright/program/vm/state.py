"""The state of a running program: clock, frames, values, processes, and what it has left so far."""

import copy
from typing import Any

import attrs

from armwright.arrays import Array
from armwright.cell.frames import FrameTree
from armwright.cell.model import Cell
from armwright.program.bytecode.instructions import Code
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.source import Span
from armwright.program.vm.process import Activation, Guard, Interruption, Motion, Process, RingQueue, Watch
from armwright.program.vm.recording import Effect, RunStage, ToolWrenches, TrajectorySegment


@attrs.define
class Hand:
    """The fingers of an arm: at which frame the gripper arrived last, and what they closed on.

    Attributes:
        reached_frame: where it arrived.
        held_frame: what they closed on.
        beside: the parts that they may touch: those that they went to, or released.
        pressed: whether a force ends, or ended, its latest MOVE, so that it may press on something.
    """

    reached_frame: str | None = None
    held_frame: str | None = None
    beside: frozenset[str] = frozenset()
    pressed: bool = False

    def forget_frame(self, name: str) -> None:
        """Know nothing any more of a frame that there is no more."""
        self.reached_frame = None if self.reached_frame == name else self.reached_frame
        self.held_frame = None if self.held_frame == name else self.held_frame


@attrs.define(eq=False, kw_only=True)
class MachineState:
    """All that changes while a program runs: one value that can be copied, so that a run can be gone back in.

    Attributes:
        types: what each variable holds, those of running procedures included.
        tree: where frames are, and what they hang on.
        values: of variables that are no frames.
        events: how often each was signalled and not yet waited for.
        timers: of each timer its seconds, and since which tick it runs; None where it is stopped.
        following: the arms that follow a frame that moves, each with the MOVE that has come to it.
        queues: the open queue of each arm that has one.
        locks: which process holds each variable that is locked.
        owners: the processes that use each arm.
        hands: the gripper of each arm.
        ticks: the time, in servo periods.
        idle_steps: instructions since time went by.
        step_tick: when the last instruction was done [ticks].
        activation_count: procedures called so far.
        start_count: what takes time and was begun so far.
        has_ended: whether the program has ended.
        pose_origins: where each frame last got its pose or its parent.
        effects: what happened.
        stages: of motions begun so far.
        segments: trajectories of each arm.
        tool_wrenches: what pushed on the tool of each arm.
        trees: frame trees, each from a time [s] on.
        program: the process that is the program itself.
        processes: all that run.
    """

    types: dict[str, VariableType]
    tree: FrameTree
    hands: dict[str, Hand]
    segments: dict[str, list[TrajectorySegment]]
    tool_wrenches: dict[str, list[ToolWrenches]]
    trees: list[tuple[float, FrameTree]]
    program: Process
    processes: list[Process]
    values: dict[str, float | bool | str | Array] = attrs.field(factory=dict)
    events: dict[str, int] = attrs.field(factory=dict)
    timers: dict[str, tuple[float, int | None]] = attrs.field(factory=dict)
    following: dict[str, Motion] = attrs.field(factory=dict)
    queues: dict[str, RingQueue] = attrs.field(factory=dict)
    locks: dict[str, Process] = attrs.field(factory=dict)
    owners: dict[str, list[Process]] = attrs.field(factory=dict)
    pose_origins: dict[str, Span] = attrs.field(factory=dict)
    effects: list[Effect] = attrs.field(factory=list)
    stages: list[RunStage] = attrs.field(factory=list)
    ticks: int = 0
    idle_steps: int = 0
    step_tick: int = 0
    activation_count: int = 0
    start_count: int = 0
    has_ended: bool = False

    @classmethod
    def initial(cls, code: Code, cell: Cell) -> "MachineState":
        """Return the state in front of the first instruction."""
        tree = cell.tree()
        for name, kind in code.types.items():
            if kind == VariableType(VariableKind.FRAME):
                tree = tree.declare(name)
        program = Process()
        return cls(
            types=dict(code.types),
            tree=tree,
            hands={name: Hand() for name in cell.arms},
            segments={name: [] for name in cell.arms},
            tool_wrenches={name: [] for name in cell.arms},
            trees=[(0.0, tree)],
            program=program,
            processes=[program],
        )

    @property
    def blocked_processes(self) -> list[Process]:
        """The processes that wait for an event or for locks, in the order of the text."""
        waiting = (process for process in self.processes if process.waiting and process.waiting.kind != "branches")
        return sorted(waiting, key=lambda process: process.path)

    def copy(self) -> "MachineState":
        """Return the same state; what is done to one of them changes nothing in the other.

        What never changes is shared: frame trees, trajectories, effects, spans, poses.
        """
        copied: MachineState = _copy(self, {})
        return copied


# What changes while a program runs.
_MUTABLE = (MachineState, Process, Activation, Watch, Interruption, Motion, Guard, Hand, list, dict)


def _copy(value: Any, copies: dict[int, Any]) -> Any:
    """Return a copy of what changes, with copies of its parts; of what is met twice there is one copy.

    Args:
        value: of one of the types that change; the items of a container are all of one type.
        copies: made so far, by the identity of what they are copies of.
    """
    if id(value) in copies:
        return copies[id(value)]
    copied = copies[id(value)] = copy.copy(value)
    if isinstance(value, dict | list):
        for key in value if isinstance(value, dict) else range(len(value)):
            if not isinstance(value[key], _MUTABLE):
                break
            copied[key] = _copy(value[key], copies)
    else:
        for field in attrs.fields(type(value)):
            if isinstance(part := getattr(value, field.name), _MUTABLE):
                setattr(copied, field.name, _copy(part, copies))
    return copied
