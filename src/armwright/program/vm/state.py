"""The state of a running program: clock, frames, values, processes, and what it has left so far."""

from typing import Any

import attrs

from armwright.arrays import Array
from armwright.cell.frames import FrameTree
from armwright.cell.model import Cell
from armwright.program.bytecode.instructions import Code
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.source import Span
from armwright.program.vm.process import Process
from armwright.program.vm.recording import Effect, RunStage, ToolWrenches, TrajectorySegment


@attrs.define
class Hand:
    """The fingers of an arm: at which frame the gripper arrived last, and what they closed on."""

    reached_frame: str | None = None
    held_frame: str | None = None

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
        locks: which process holds each variable that is locked.
        owners: the processes that use each arm.
        hands: the gripper of each arm.
        ticks: the time, in servo periods.
        idle_steps: instructions since time went by.
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
    values: dict[str, float | Array] = attrs.field(factory=dict)
    events: dict[str, int] = attrs.field(factory=dict)
    locks: dict[str, Process] = attrs.field(factory=dict)
    owners: dict[str, list[Process]] = attrs.field(factory=dict)
    pose_origins: dict[str, Span] = attrs.field(factory=dict)
    effects: list[Effect] = attrs.field(factory=list)
    stages: list[RunStage] = attrs.field(factory=list)
    ticks: int = 0
    idle_steps: int = 0
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
        names: dict[int, dict[str, Any]] = {}
        copies: dict[int, Process] = {}

        def copy_names(bindings: dict[str, Any]) -> dict[str, Any]:
            """An action has the names of the activation that it interrupts: both have the same copy."""
            return names.setdefault(id(bindings), dict(bindings))

        def copy_process(process: Process) -> Process:
            """Processes know one another, so the copy of each is made once."""
            if id(process) not in copies:
                copied = copies[id(process)] = process.copy(copy_names)
                copied.parent = None if process.parent is None else copy_process(process.parent)
                copied.branches = [copy_process(branch) for branch in process.branches]
            return copies[id(process)]

        return attrs.evolve(
            self,
            types=dict(self.types),
            hands={name: attrs.evolve(hand) for name, hand in self.hands.items()},
            segments={name: list(segments) for name, segments in self.segments.items()},
            tool_wrenches={name: list(wrenches) for name, wrenches in self.tool_wrenches.items()},
            trees=list(self.trees),
            program=copy_process(self.program),
            processes=[copy_process(process) for process in self.processes],
            values=dict(self.values),
            events=dict(self.events),
            locks={name: copy_process(process) for name, process in self.locks.items()},
            owners={arm: [copy_process(process) for process in owners] for arm, owners in self.owners.items()},
            pose_origins=dict(self.pose_origins),
            effects=list(self.effects),
            stages=list(self.stages),
        )
