"""What a run leaves: every effect with its location in the program, every stage, every servo tick of every arm."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeAlias

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.cell.frames import FrameTree
from armwright.cell.model import Cell, CellArm
from armwright.cell.observations import MeasuredStream, Observations, Picture
from armwright.cell.part_poses import PartTrack
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.files.csv_text import csv_line
from armwright.motion.efforts import without_rounding
from armwright.motion.limited import by_joint, limited_efforts
from armwright.motion.plan import PlannedStage
from armwright.motion.trajectory import Trajectory
from armwright.notebook import html_table
from armwright.program.bytecode.instructions import Code
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.source import Span

if TYPE_CHECKING:
    from armwright.physics.collisions import CheckedBodies, StageClearance
    from armwright.physics.planner import PlannedPath

# Rows that are computed and written together.
_CHUNK_ROWS = 16384
# A time this part of a period behind a tick is on it.
_TICK_TOLERANCE = 1e-6

# Of statements that take time, and take effect at its end.
TimedKind: TypeAlias = Literal["OPEN", "GRASP", "OPERATE", "READ", "PAUSE"]
_MotionKind: TypeAlias = Literal["PLACE", "AFFIX", "UNFIX", "MOVE", "STOP", "BRAKE", "RESUME", "QUEUE", "PUT"]
EffectKind: TypeAlias = (
    TimedKind | _MotionKind | Literal["ZERO", "SIGNAL", "WAIT", "WHEN", "TIMER", "LOCK", "PRINT", "LOG", "ERROR", "END"]
)
# Not of the trace: assignments, locks and the end of the text.
_SILENT = ("PLACE", "LOCK", "END")


@attrs.frozen(kw_only=True)
class Effect:
    """One thing a program did.

    Attributes:
        t0: when it began [s].
        t1: when it was done [s].
        kind: what it was.
        span: the statement in the program.
        text: one line of the trace, such as ``ARM_1 [obj1] MOVE: PTP obj2 @100``.
        process: that did it, as people call it: ``program``, ``branch 2``.
        order: counts all that has begun; of the same time, what began first has the smaller number.
        arm: the arm that did it, or None.
        data: further facts by name, as JSON can carry them.
    """

    t0: float
    t1: float
    kind: EffectKind
    span: Span
    text: str
    process: str = "program"
    order: int = 0
    arm: str | None = None
    data: Mapping[str, Any] = attrs.field(factory=dict)


@attrs.frozen(kw_only=True, eq=False)
class RunStage:
    """One stage of a MOVE, as it was run.

    Attributes:
        t0: when it began [s].
        arm: the arm that made it.
        span: the MOVE in the program.
        goal_names: the frames it went to, as the program spells them.
        speed: that was asked for, 100 being normal.
        stage: as it was planned, with what was found about its path.
        motion: of the joints as it was run: all of the plan, or as far as it came before it was stopped, and its stop.
            A stop keeps to the path of the plan, so the path deviation of the plan holds for it too.
        length: of the path that the gripper went [m].
        peak_effort: (n,) largest efforts on the servo ticks of that motion, with what pushes on the gripper [N m] or
            [N]; (2 n,) with those of the drives behind, where coupled drives have limits: see ``Arm.all_limits``.
        peak_time: (n,) or (2 n,) when, since it began [s].
        stopped: whether it was stopped on its path.
        clearance: how near it was to come to other bodies; None where that is not looked at.
        path: that was planned past other bodies; None where the straight one of the joints was free.
    """

    t0: float
    arm: str
    span: Span
    goal_names: tuple[str, ...]
    speed: float
    stage: PlannedStage
    motion: Trajectory
    length: float
    peak_effort: Array
    peak_time: Array
    stopped: bool = False
    clearance: StageClearance | None = None
    path: PlannedPath | None = None

    def effort_shares(self, arm: Arm) -> Array:
        """Return (n,) which part of its limit of effort each joint of the arm, or its drive, was asked for at most."""
        return by_joint(arm, self.peak_effort / arm.all_limits.effort)

    @property
    def duration(self) -> float:
        """How long it ran [s]."""
        return self.motion.duration

    @property
    def t1(self) -> float:
        """When it ended [s]."""
        return self.t0 + self.duration


@attrs.frozen(kw_only=True, eq=False)
class TrajectorySegment:
    """What one arm did for a while: a trajectory, as far as it came.

    Attributes:
        t0: when it began [s].
        trajectory: from then on.
        duration: how long the arm followed it [s]; then it rested.
        tau: (k, n) efforts on its first servo ticks, as far as they are known [N m] or [N].
    """

    t0: float
    trajectory: Trajectory
    duration: float
    tau: Array | None = None


class ToolWrenches(NamedTuple):
    """What pushes on the tool of an arm from some time on.

    Attributes:
        t0: from when [s].
        wrenches: (k, 6) forces [N] and moments [N m] at the tool point, along the axes of the base, on this and the
            following servo ticks; the last one stays.
    """

    t0: float
    wrenches: Array

    def sample(self, ticks: int) -> Array:
        """Return the wrenches (ticks, 6) on so many servo ticks from then on."""
        return self.wrenches[np.minimum(np.arange(ticks), len(self.wrenches) - 1)]


@attrs.frozen(kw_only=True, eq=False)
class Stream:
    """What one arm does at every servo tick.

    Attributes:
        arm: its name.
        t: (N,) [s].
        q: (N, n) joint positions [rad] or [m].
        qd: (N, n) speeds.
        qdd: (N, n) accelerations; at a tick where they jump, those just after it.
        tau: (N, n) efforts by inverse dynamics, drives and what pushes on the gripper included [N m] or [N].
    """

    arm: str
    t: Array
    q: Array
    qd: Array
    qdd: Array
    tau: Array


@attrs.frozen(kw_only=True)
class Failure:
    """Why a run did not come to its end.

    Attributes:
        diagnostic: what happened, at which statement.
        time: when [s]; the arms came to rest after it.
        arm: the arm that was to move; None where none was.
        process: in which it happened, as people call it.
    """

    diagnostic: Diagnostic
    time: float
    arm: str | None = None
    process: str = "program"


@attrs.frozen(kw_only=True, eq=False)
class Recording:
    """A run.

    Attributes:
        code: the program.
        cell: in which it ran.
        duration: [s], a whole number of servo periods.
        effects: in the order in which they began.
        stages: in the order in which they began.
        streams: one per arm.
        trees: the frame tree at the start and after each change, with the time of the change [s]; of very many
            changes the last in every two-thousandth of the run.
        configurations: by arm, the configuration (n,) at the end.
        observations: what the cell left beside: where its parts were, measurements and pictures.
        checked: what was looked at for collisions; None where nothing was, because the cell has nothing to run into.
        failure: why it did not come to its end; None where it did.
    """

    code: Code
    cell: Cell
    duration: float
    effects: tuple[Effect, ...]
    stages: tuple[RunStage, ...]
    streams: tuple[Stream, ...]
    trees: tuple[tuple[float, FrameTree], ...]
    configurations: Mapping[str, Array]
    observations: Observations = attrs.field(factory=Observations)
    checked: CheckedBodies | None = None
    failure: Failure | None = None

    @property
    def parts(self) -> Mapping[str, PartTrack]:
        """Where each part of the cell was, by name."""
        return self.observations.parts

    @property
    def measured(self) -> tuple[MeasuredStream, ...]:
        """What the servos measured, one stream per arm; none of a cell without physics."""
        return self.observations.measured

    @property
    def pictures(self) -> tuple[Picture, ...]:
        """The pictures that cameras took, in order."""
        return self.observations.pictures

    @property
    def processes(self) -> tuple[str, ...]:
        """The processes that did anything, in the order in which they began."""
        return tuple(dict.fromkeys(effect.process for effect in self.effects))

    @property
    def tree(self) -> FrameTree:
        """The frame tree at the end."""
        return self.trees[-1][1]

    def traced_effects(self) -> list[Effect]:
        """Return the effects of which the trace has a line each."""
        return [effect for effect in self.effects if effect.kind not in _SILENT]

    def trace(self) -> list[str]:
        """Return the lines of the trace."""
        return [effect.text for effect in self.traced_effects()]

    def _repr_html_(self) -> str:
        """Show what happened, effect by effect."""
        rows = ((effect.t0, effect.t1, effect.process, effect.text) for effect in self.effects)
        return html_table(f"{self.duration:.6g} s in {self.cell.name}", ("from s", "to s", "process", "effect"), rows)


def sort_effects(effects: Iterable[Effect]) -> tuple[Effect, ...]:
    """Return effects in the order in which they began."""
    return tuple(sorted(effects, key=lambda effect: (effect.t0, effect.order)))


def thin_trees(trees: Sequence[tuple[float, FrameTree]], gap: float) -> list[tuple[float, FrameTree]]:
    """Return the frame tree at the start, and the last of those that began within the same gap.

    Args:
        trees: with the time from which on each holds [s], in order.
        gap: [s].
    """
    sampled = {int(time / gap): (time, tree) for time, tree in trees[1:]}
    return [trees[0], *sampled.values()]


def sample_stream(
    name: str,
    cell_arm: CellArm,
    segments: Sequence[TrajectorySegment],
    tool_wrenches: Sequence[ToolWrenches],
    *,
    end_tick: int,
    period: float,
    loads: Sequence[tuple[float, Arm]],
) -> Stream:
    """Sample what an arm does at every servo tick.

    Args:
        name: of the arm in the cell.
        cell_arm: its model, and its configuration at the start.
        segments: in order; the arm rests between.
        tool_wrenches: in order; each counts until the next.
        end_tick: the last of the whole run.
        period: of the servo [s].
        loads: the arm with what it held, each with the time from which on that was so [s].
    """
    arm, ticks = cell_arm.arm, end_tick + 1
    q = np.empty((ticks, arm.n))
    qd, qdd = np.zeros((ticks, arm.n)), np.zeros((ticks, arm.n))
    tau, is_known = np.empty((ticks, arm.n)), np.zeros(ticks, dtype=bool)
    first, configuration = 0, cell_arm.start
    for run in segments:
        # A run that was stopped by an obstacle ends between two ticks.
        begin, end = round(run.t0 / period), math.ceil((run.t0 + run.duration) / period - _TICK_TOLERANCE)
        # One that is under way has been followed as far as time has gone.
        begin, end = min(begin, ticks), min(end, ticks)
        q[first:begin] = configuration
        local = np.arange(end - begin) * period
        q[begin:end], qd[begin:end], qdd[begin:end] = (run.trajectory(local, order) for order in range(3))
        if run.tau is not None:
            count = min(end - begin, len(run.tau))
            tau[begin : begin + count], is_known[begin : begin + count] = run.tau[:count], True
        first, configuration = end, run.trajectory(run.duration)
    q[first:] = configuration
    t: Array = np.arange(ticks, dtype=np.float64) * period
    wrench = np.zeros((ticks, 6))
    for push in tool_wrenches:
        begin = round(push.t0 / period)
        wrench[begin:] = push.sample(max(ticks - begin, 0))
    begins = [round(time / period) for time, _ in loads]
    for (_, loaded), begin, end in zip(loads, begins, [*begins[1:], ticks], strict=True):
        missing = begin + np.flatnonzero(~is_known[begin:end])
        tau[missing] = _efforts(loaded, (q[missing], qd[missing], qdd[missing]), wrench[missing])
    return Stream(arm=name, t=t, q=q, qd=qd, qdd=qdd, tau=tau)


def trajectory_efforts(
    arm: Arm, trajectory: Trajectory, period: float, tool_wrenches: ToolWrenches, ticks: int | None = None
) -> Array:
    """Return the efforts (k, n) on the servo ticks of a trajectory, the last tick included.

    Args:
        arm: that follows it.
        trajectory: on whole servo periods.
        period: of the servo [s].
        tool_wrenches: what pushes on the gripper from the start of it on.
        ticks: how far; to its end when left out.
    """
    ticks = round(trajectory.duration / period) if ticks is None else ticks
    t: Array = np.arange(ticks + 1, dtype=np.float64) * period
    return _efforts(arm, (trajectory(t), trajectory(t, 1), trajectory(t, 2)), tool_wrenches.sample(len(t)))


def _efforts(arm: Arm, states: tuple[Array, Array, Array], wrench: Array) -> Array:
    """Return the efforts (k, n) of positions, speeds and accelerations (k, n), with wrenches (k, 6) on the tool."""
    q, qd, qdd = states
    qd = without_rounding(qd, float(np.abs(qd).max(initial=0.0)))
    tau = np.empty_like(q)
    for rows in _chunks(len(tau)):
        push = wrench[rows] if wrench[rows].any() else None
        tau[rows] = inverse_dynamics(arm, q[rows], qd[rows], qdd[rows], wrench=push)
    return tau


def peak_efforts(arm: Arm, tau: Array, period: float) -> tuple[Array, Array]:
    """Return the largest efforts of all that has limits, and when [s], from those of joints (k, n) on servo ticks."""
    sizes = np.abs(limited_efforts(arm, tau))
    return sizes.max(axis=0), sizes.argmax(axis=0) * period


def motion_csv_lines(streams: Iterable[Stream], sampled: slice = slice(None)) -> Iterable[str]:
    """Give the lines of motion.csv: time, arm, and per joint position, speed, acceleration and effort, in SI.

    Args:
        streams: one per arm.
        sampled: which ticks of each.
    """
    tables = [(s.arm, s.t, {"q": s.q, "qd": s.qd, "qdd": s.qdd, "tau": s.tau}) for s in streams]
    return _csv_lines(tables, sampled)


def log_csv_lines(effects: Iterable[Effect]) -> dict[str, list[str]]:
    """Return the lines of what LOG has written, by the name of the log: the time [s], then the values.

    Args:
        effects: of a run, in order.
    """
    logs: dict[str, list[str]] = {}
    spelling: dict[str, str] = {}
    for effect in effects:
        if effect.kind == "LOG":
            name = spelling.setdefault(str(effect.data["log"]).lower(), str(effect.data["log"]))
            lines = logs.setdefault(name, [f"t,{effect.data['titles']}\n"])
            lines.append(f"{effect.t0:.12g},{csv_line(map(_csv_value, effect.data['values']))}\n")
    return logs


def _csv_value(value: bool | float | str) -> str:  # noqa: FBT001 - what is written
    if isinstance(value, bool):
        return str(value).lower()
    return value if isinstance(value, str) else f"{value:.12g}"


def measured_csv_lines(streams: Iterable[MeasuredStream], sampled: slice = slice(None)) -> Iterable[str]:
    """Give the lines of measured.csv: time, arm, per joint position, speed, effort and where it was sent, the opening.

    Args:
        streams: one per arm.
        sampled: which ticks of each.
    """
    tables = [(s.arm, s.t, {"q": s.q, "qd": s.qd, "tau": s.tau, "sent": s.sent}, s.opening) for s in streams]
    return _csv_lines(tables, sampled)


def _csv_lines(
    streams: Sequence[tuple[str, Array, Mapping[str, Array]] | tuple[str, Array, Mapping[str, Array], Array]],
    sampled: slice,
) -> Iterator[str]:
    """Give the lines of a table of arms: their names, times (k,), tables (k, n) by quantity, and openings (k,)."""
    joints = max((table.shape[1] for stream in streams for table in stream[2].values()), default=0)
    quantities = list(streams[0][2]) if streams else []
    openings = ["opening"] if streams and len(streams[0]) > 3 else []
    columns = [f"{quantity}{i + 1}" for quantity in quantities for i in range(joints)]
    yield ",".join(["t", "arm", *columns, *openings]) + "\n"
    for arm, t, tables, *opening in streams:
        n = tables[quantities[0]].shape[1]
        # Twelve digits hold a position to 1e-12, so that differences over a tick still show the speed.
        cell = ",".join(["%.12g"] * n) + "," * (joints - n)
        line = ",".join(["%.12g", arm, *[cell] * len(tables), *["%.12g"] * len(opening)]) + "\n"
        first, end, _ = sampled.indices(len(t))
        for part in _chunks(end - first):
            rows = slice(first + part.start, min(first + part.stop, end))
            singles = [column[rows, None] for column in opening]
            block = np.concatenate([t[rows, None], *(table[rows] for table in tables.values()), *singles], axis=1)
            # Adding 0 turns -0 into 0, which reads better.
            yield from (line % tuple(row) for row in (block + 0.0).tolist())


def _chunks(count: int) -> Iterator[slice]:
    """Cut so many rows into pieces that a long run needs no more memory than its own arrays."""
    return (slice(first, first + _CHUNK_ROWS) for first in range(0, count, _CHUNK_ROWS))
