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
from armwright.program.vm.recording import Effect, Push, Run, RunStage


@attrs.define
class Hand:
    """The fingers of an arm: at which frame the gripper arrived last, and what they closed on."""

    at: str | None = None
    holds: str | None = None

    def forget(self, name: str) -> None:
        """Know nothing any more of a frame that there is no more."""
        self.at = None if self.at == name else self.at
        self.holds = None if self.holds == name else self.holds


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
        idle: instructions since time went by.
        activations: procedures called so far.
        begun: what takes time and was begun so far.
        over: whether the program has ended.
        written: where each frame last got its pose or its parent.
        effects: what happened.
        stages: of motions begun so far.
        runs: trajectories of each arm.
        pushes: what pushed on the tool of each arm.
        trees: frame trees, each from a time [s] on.
        program: the process that is the program itself.
        processes: all that run.
    """

    types: dict[str, VariableType]
    tree: FrameTree
    hands: dict[str, Hand]
    runs: dict[str, list[Run]]
    pushes: dict[str, list[Push]]
    trees: list[tuple[float, FrameTree]]
    program: Process
    processes: list[Process]
    values: dict[str, float | Array] = attrs.field(factory=dict)
    events: dict[str, int] = attrs.field(factory=dict)
    locks: dict[str, Process] = attrs.field(factory=dict)
    owners: dict[str, list[Process]] = attrs.field(factory=dict)
    written: dict[str, Span] = attrs.field(factory=dict)
    effects: list[Effect] = attrs.field(factory=list)
    stages: list[RunStage] = attrs.field(factory=list)
    ticks: int = 0
    idle: int = 0
    activations: int = 0
    begun: int = 0
    over: bool = False

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
            runs={name: [] for name in cell.arms},
            pushes={name: [] for name in cell.arms},
            trees=[(0.0, tree)],
            program=program,
            processes=[program],
        )

    @property
    def stuck(self) -> list[Process]:
        """The processes that wait for an event or for locks, in the order of the text."""
        waiting = (process for process in self.processes if process.waiting and process.waiting.what != "branches")
        return sorted(waiting, key=lambda process: process.path)

    def copy(self) -> "MachineState":
        """Return the same state; what is done to one of them changes nothing in the other.

        What never changes is shared: frame trees, trajectories, effects, spans, poses.
        """
        names: dict[int, dict[str, Any]] = {}
        twins: dict[int, Process] = {}

        def shared(own: dict[str, Any]) -> dict[str, Any]:
            """An action has the names of the activation that it interrupts: both have the same copy."""
            return names.setdefault(id(own), dict(own))

        def twin(process: Process) -> Process:
            """Processes know one another, so the copy of each is made once."""
            if id(process) not in twins:
                copied = twins[id(process)] = process.copy(shared)
                copied.parent = None if process.parent is None else twin(process.parent)
                copied.branches = [twin(branch) for branch in process.branches]
            return twins[id(process)]

        return attrs.evolve(
            self,
            types=dict(self.types),
            hands={name: attrs.evolve(hand) for name, hand in self.hands.items()},
            runs={name: list(runs) for name, runs in self.runs.items()},
            pushes={name: list(pushes) for name, pushes in self.pushes.items()},
            trees=list(self.trees),
            program=twin(self.program),
            processes=[twin(process) for process in self.processes],
            values=dict(self.values),
            events=dict(self.events),
            locks={name: twin(process) for name, process in self.locks.items()},
            owners={arm: [twin(process) for process in owners] for arm, owners in self.owners.items()},
            written=dict(self.written),
            effects=list(self.effects),
            stages=list(self.stages),
        )
