"""The interpreter: intermediate code acts on the frame tree and on a cell, and leaves a recording."""

import math
from collections.abc import Callable, Sequence
from typing import NoReturn

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.cell.frames import FrameTree
from armwright.cell.hardware import DeviceError, Hardware
from armwright.cell.model import Cell, base_name
from armwright.errors import ArmwrightError
from armwright.kinematics.forward import forward
from armwright.motion.plan import Manner, Obstacle, Stage, StageError, StageGoal, plan
from armwright.motion.trajectory import Trajectory
from armwright.program.code import (
    HIGHEST_SPEED,
    LOWEST_SPEED,
    Code,
    Instruction,
    Kind,
    Move,
    Op,
    StagePlan,
    stages_of,
    stages_text,
)
from armwright.program.diagnostics import Diagnostic, Label, Severity
from armwright.program.obstacles import CODES, detour_warning, stopped, ways_round, where_and_why
from armwright.program.recording import Effect, EffectKind, Recording, RunStage, efforts, stream
from armwright.program.source import Span
from armwright.spatial.poses import from_noap, inverse

# Called before each instruction: how many are done, how many there are, the line of the next.
Progress = Callable[[int, int, int], None]

# A place this many times farther than the arm reaches was probably typed in millimetres.
_MILLIMETRES = 50.0


class RunError(ArmwrightError, RuntimeError):
    """A program could not go on.

    Attributes:
        diagnostic: what happened, where.
        tree: the frame tree at that moment.
        time: of the cell's clock [s].
    """

    def __init__(self, diagnostic: Diagnostic, tree: FrameTree, time: float) -> None:
        """Keep the circumstances; the text is the diagnostic's message."""
        self.diagnostic, self.tree, self.time = diagnostic, tree, time
        super().__init__(diagnostic.message)


def interpret(code: Code, cell: Cell, hardware: Hardware, progress: Progress | None = None) -> Recording:
    """Run a program in a cell.

    Args:
        code: translated without errors against this cell.
        cell: arms, frames, servo period and deviation.
        hardware: the cell at work, simulated or real.
        progress: told before each instruction.

    Returns:
        All that happened, tick by tick.

    Raises:
        RunError: a goal is out of reach, a joint would pass its limits, the camera found nothing, a device is
            missing, a speed is out of range. The devices are switched off then, as at the end.
    """
    run = _Run(code, cell, hardware)
    try:
        run.all(progress)
    finally:
        for device in sorted(hardware.running()):
            hardware.operate(device, on=False)
    return run.recording()


def warnings(recording: Recording) -> tuple[Diagnostic, ...]:
    """Return a warning for every straight line that was gone round, and for every joint asked for too much effort."""
    found = []
    for stage in recording.stages:
        detour = detour_warning(stage)
        found += [] if detour is None else [detour]
        arm = recording.cell.arms[stage.arm].arm
        over = stage.peak_effort / arm.limit("effort")
        if (over <= 1).all():
            continue
        t, tau = efforts(arm, stage.stage.trajectory, recording.cell.period)
        found += [_effort_warning(stage, arm, joint, t, tau[:, joint]) for joint in np.flatnonzero(over > 1).tolist()]
    return tuple(found)


def _effort_warning(stage: RunStage, arm: Arm, joint: int, t: Array, tau: Array) -> Diagnostic:
    worst = int(np.abs(tau).argmax())
    unit = "N m" if arm.joints[joint].revolute else "N"
    limit = arm.joints[joint].limits.effort
    return Diagnostic(
        code="W401",
        severity=Severity.WARNING,
        message=f"joint {joint + 1} of {stage.arm} would need {abs(tau[worst]):.1f} {unit}, "
        f"{(abs(tau[worst]) / limit - 1) * 100:.0f} % more than its {limit:g} {unit}",
        span=stage.span,
        label=f"at {stage.t0 + t[worst]:.3f} s, in {stage.stage.kind} to {stage.to[-1]}",
        helps=(f"a lower speed than {stage.speed:g} asks for less where it is motion and not weight that costs",),
    )


@attrs.define
class _Gathered:
    """The instructions of one MOVE, as they come in."""

    begin: Instruction
    parts: list[Instruction] = attrs.field(factory=list)

    def span_of(self, frame: str) -> Span:
        """Return the place in the program that names a frame of this MOVE."""
        for part in self.parts:
            if frame in part.operands:
                return part.span
        return self.begin.span


class _Run:
    """A program on its way: its values, its clock, and what it has left so far."""

    def __init__(self, code: Code, cell: Cell, hardware: Hardware) -> None:
        self._code, self._cell, self._hardware = code, cell, hardware
        self._tree = cell.tree()
        for name, kind in code.kinds.items():
            if kind is Kind.FRAME:
                self._tree = self._tree.declare(name)
        self._trans: dict[str, Array] = {}
        self._scalars: dict[str, float] = {}
        self._written: dict[str, Span] = {}  # where each frame last got its place or its parent
        self._ticks = 0
        self._move: _Gathered | None = None
        self._effects: list[Effect] = []
        self._stages: list[RunStage] = []
        self._runs: dict[str, list[tuple[float, Trajectory]]] = {name: [] for name in cell.arms}
        self._trees = [(0.0, self._tree)]

    @property
    def _now(self) -> float:
        return self._ticks * self._cell.period

    def all(self, progress: Progress | None) -> None:
        steps = self._code.instructions
        for done, step in enumerate(steps):
            if progress:
                progress(done, len(steps), self._code.line(step))
            try:
                self._step(step)
            except DeviceError as error:
                missing = "the camera" if step.op is Op.READV else "the device"
                self._fail("R601" if step.op is Op.READV else "R602", str(error), step.span, f"{missing} is asked here")

    def recording(self) -> Recording:
        cell = self._cell
        return Recording(
            cell=cell,
            duration=self._now,
            effects=tuple(self._effects),
            stages=tuple(self._stages),
            streams=tuple(
                stream(name, arm.arm, arm.start, self._runs[name], duration=self._now, period=cell.period)
                for name, arm in cell.arms.items()
            ),
            trees=tuple(self._trees),
            postures={name: self._hardware.posture(name) for name in cell.arms},
        )

    # ---- one instruction -------------------------------------------------------------------------------------------

    def _step(self, step: Instruction) -> None:
        match step.op:
            case Op.LOADM | Op.LOADS:
                self._load(step)
            case Op.AFFIX | Op.AFFAT:
                self._affix(step)
            case Op.UNFIX:
                child = str(step.operands[0])
                self._grow(self._tree.unfix(child), child, step.span)
                self._effect(step, "UNFIX", f"UNFIX {self._spelled(child)}")
            case Op.OPEN | Op.GRASP:
                arm = str(step.operands[0])
                time = self._hardware.fingers(arm, closed=step.op is Op.GRASP)
                self._effect(step, "GRASP" if step.op is Op.GRASP else "OPEN", f"{arm} {step.op}", time, arm=arm)
            case Op.OPER:
                device = str(step.operands[0])
                time = self._hardware.operate(device, on=True)
                self._effect(step, "OPERATE", f"{self._spelled(device)} ON", time)
            case Op.READV | Op.READS:
                self._read(step)
            case Op.MVBEG:
                self._move = _Gathered(step)
            case Op.MVEND:
                self._end_move(step)
            case Op.STOP:
                self._stop(step)
            case _:
                assert self._move is not None  # noqa: S101 - the translator opens every MOVE with MVBEG
                self._move.parts.append(step)

    def _load(self, step: Instruction) -> None:
        name, index = str(step.operands[0]), int(step.operands[1])
        constant = self._code.constants[index]
        kind = self._code.kinds[name]
        if kind is Kind.SCALAR:
            assert isinstance(constant, float | int)  # noqa: S101 - checked by the translator
            self._scalars[name] = float(constant)
        elif kind is Kind.TRANS:
            self._trans[name] = from_noap(constant)
        else:
            self._grow(self._tree.place(name, from_noap(constant)), name, step.span)
        self._effect(step, "PLACE", f"{self._spelled(name)} =")

    def _affix(self, step: Instruction) -> None:
        child, parent = str(step.operands[0]), str(step.operands[1])
        relation = self._trans[str(step.operands[2])] if step.op is Op.AFFAT else None
        self._grow(self._tree.affix(child, parent, relation), child, step.span)
        self._effect(step, "AFFIX", f"AFFIX {self._spelled(child)} -> {self._spelled(parent)}")

    def _read(self, step: Instruction) -> None:
        name = str(step.operands[0])
        if step.op is Op.READV:
            X_WF, time = self._hardware.look(name)
            self._effect(step, "READ", f"READ VISIONS {self._spelled(name)}", time)
            self._grow(self._tree.place(name, X_WF), name, step.span)
        else:
            self._set_hand(name, self._hardware.posture(name), step.span)
            self._effect(step, "READ", f"READ SYSTEM {name}", arm=name)

    def _stop(self, step: Instruction) -> None:
        off = sorted(self._hardware.running())
        for device in off:
            self._hardware.operate(device, on=False)
        words = "".join(f"; {self._spelled(device)} OFF" for device in off)
        self._effect(step, "END", f"END{words}", data={"switched_off": off})

    # ---- motion ----------------------------------------------------------------------------------------------------

    def _end_move(self, step: Instruction) -> None:
        move, gathered = step.move, self._move
        assert move is not None  # noqa: S101 - the translator puts the move on MVEND
        assert gathered is not None  # noqa: S101 - and opens it with MVBEG
        self._move = None
        if move.implied:
            self._grow(self._tree.affix(move.moved, move.arm), move.moved, step.span)
        speed = self._speed(move, gathered)
        plans = stages_of(move)
        goals = [StageGoal(kind=one.kind.value, poses=self._hand_goals(move, one.frames)) for one in plans]
        cell = self._cell
        manner = Manner(speed=speed, deviation=cell.deviation, period=cell.period, around=cell.around)
        try:
            stages = plan(cell.arms[move.arm].arm, self._hardware.posture(move.arm), goals, manner)
        except StageError as error:
            self._fail_move(error.obstacle, move, plans[error.stage], gathered)
        begun = self._now
        for one, stage in zip(plans, stages, strict=True):
            self._run_stage(move.arm, stage, [self._spelled(name) for name in one.frames], speed, step.span)
        self._set_hand(move.arm, self._hardware.posture(move.arm), step.span)
        who = move.arm if move.moved == move.arm else f"{move.arm} [{self._spelled(move.moved)}]"
        text = f"{who} MOVE: {stages_text(self._code, move).replace(' / ', '; ')} @{speed:g}"
        data = {"moved": move.moved, "goal": move.goal, "speed": speed, "implied_affix": move.implied}
        self._effect(step, "MOVE", text, since=begun, arm=move.arm, data=data)

    def _hand_goals(self, move: Move, frames: Sequence[str]) -> Array:
        """Return where the hand must be, seen from the base of its arm, so that ``moved`` comes to each frame.

        Source:
            TR-83-008, third paper: ARM-1' = Base^-1 f2 f1^-1, where f1 is the relation from the arm to it.
        """
        X_BW = inverse(self._tree.world(base_name(move.arm)))
        X_MH = inverse(self._tree.relation(move.moved, move.arm))
        return np.stack([X_BW @ self._tree.world(frame) @ X_MH for frame in frames])

    def _speed(self, move: Move, gathered: _Gathered) -> float:
        speed = self._scalars.get(move.speed, math.nan) if isinstance(move.speed, str) else move.speed
        if not LOWEST_SPEED <= speed <= HIGHEST_SPEED:
            name = str(move.speed)
            span = gathered.span_of(name)
            value = "no value" if math.isnan(speed) else f"{speed:g}"
            message = f"speed {self._spelled(name)} = {value} is outside {LOWEST_SPEED:g}..{HIGHEST_SPEED:g}"
            self._fail("E207", message, span, "out of range")
        return speed

    def _run_stage(self, arm: str, stage: Stage, to: list[str], speed: float, span: Span) -> None:
        period = self._cell.period
        _, tau = efforts(self._cell.arms[arm].arm, stage.trajectory, period)
        self._stages.append(
            RunStage(
                t0=self._now,
                arm=arm,
                span=span,
                to=tuple(to),
                speed=speed,
                stage=stage,
                peak_effort=np.abs(tau).max(axis=0),
            )
        )
        self._runs[arm].append((self._now, stage.trajectory))
        self._hardware.run(arm, stage.trajectory)
        self._ticks += round(stage.trajectory.duration / period)

    def _set_hand(self, arm: str, q: Array, span: Span) -> None:
        X_BH = forward(self._cell.arms[arm].arm, q)
        self._grow(self._tree.place(arm, self._tree.world(base_name(arm)) @ X_BH), arm, span)

    # ---- what is left behind ---------------------------------------------------------------------------------------

    def _spelled(self, name: str) -> str:
        return self._code.spelled(name)

    def _grow(self, tree: FrameTree, name: str, span: Span) -> None:
        self._tree = tree
        self._written[name] = span
        self._trees.append((self._now, tree))

    def _effect(
        self,
        step: Instruction,
        kind: EffectKind,
        text: str,
        time: float = 0.0,
        *,
        since: float | None = None,
        arm: str | None = None,
        data: dict[str, object] | None = None,
    ) -> None:
        begun = self._now if since is None else since
        self._ticks += math.ceil(time / self._cell.period - 1e-9)
        self._effects.append(
            Effect(t0=begun, t1=self._now, kind=kind, span=step.span, text=text, arm=arm, data=data or {})
        )

    def _fail_move(self, obstacle: Obstacle, move: Move, stage: StagePlan, gathered: _Gathered) -> NoReturn:
        frame = stage.frames[min(obstacle.pose, len(stage.frames) - 1)]
        spelled, kind = self._spelled(frame), stage.kind.value
        to = [self._spelled(name) for name in stage.frames]
        secondary = [Label(self._written[frame], f"`{spelled}` got its place here")] if frame in self._written else []
        self._fail(
            CODES[obstacle.cause],
            stopped(obstacle, spelled, move.arm),
            gathered.span_of(frame),
            "cannot be reached",
            secondary=secondary,
            notes=(where_and_why(obstacle, kind, to, move.arm),),
            helps=(*self._metres(frame, move.arm), *ways_round(obstacle, kind, self._cell.around)),
        )

    def _metres(self, frame: str, arm: str) -> tuple[str, ...]:
        """Say that lengths are metres, where a place so far off can only be meant in millimetres."""
        X_BW = inverse(self._tree.world(base_name(arm)))
        away = np.linalg.norm((X_BW @ self._tree.world(frame))[:3, 3])
        meant = away > _MILLIMETRES * self._cell.arms[arm].arm.reach
        return (f"`{self._spelled(frame)}` is {away:.4g} m away: lengths in a program are metres",) if meant else ()

    def _fail(
        self,
        code: str,
        message: str,
        span: Span,
        label: str,
        *,
        secondary: Sequence[Label] = (),
        notes: Sequence[str] = (),
        helps: Sequence[str] = (),
    ) -> NoReturn:
        diagnostic = Diagnostic(
            code=code,
            message=message,
            span=span,
            label=label,
            secondary=tuple(secondary),
            notes=tuple(notes),
            helps=tuple(helps),
        )
        raise RunError(diagnostic, self._tree, self._now)
