"""Stages of a move that are shaped, so that an arm with flexible gears vibrates little where each of them ends.

By flat feedforward the motors begin and end where the stage does, as all that a program knows are the motors; the links
go from where they stand on their gears at its start to where they will stand at its end.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.dynamics.flexible_joints import links_at_rest
from armwright.errors import ArmwrightError, IncapableArmError, InvalidValueError
from armwright.motion.certificate import BindingLimit, slower
from armwright.motion.certified_motion import certificate_of
from armwright.motion.deviation import distance_from_line, half_sines, path_deviation
from armwright.motion.flat_feedforward import FlatMotion, flat_motion, ninth
from armwright.motion.limit_utilization import ROUNDING, slowing_for_limits
from armwright.motion.mode_shaping import LONGEST, ModeShaping, StageShaping, mode_shaper
from armwright.motion.plan import PlannedStage, tool_path_length
from armwright.motion.shaping import Shaper, shaped
from armwright.motion.solver import AnyArm, solver_of
from armwright.motion.tolerance import tolerance
from armwright.motion.tool_limits import ToolLimits
from armwright.motion.trajectory import Trajectory

# Rounds in which a stage is slowed until it keeps its limits when it is shaped, and what more it is slowed by.
_ROUNDS, _MORE = 30, 1e-3
# What a number of servo periods may be off a whole one.
_TICK = 1e-6
# A line that is shorter only turns the tool, if it turns it [m].
_TURN = 1e-6


class LeftLineError(ArmwrightError, ValueError):
    """A straight line that would be left by more than is allowed when it is shaped.

    Attributes:
        stage: which stage, from 0.
        only_turns: whether the tool only turns on it, which no slower motion changes.
    """

    def __init__(self, stage: int, text: str, *, only_turns: bool = False) -> None:
        """Keep the stage."""
        self.stage, self.only_turns = stage, only_turns
        super().__init__(text)


class ShapedMotion(NamedTuple):
    """A motion that is the sum of its delayed parts.

    Attributes:
        motors: the motion.
    """

    motors: Trajectory

    @property
    def moving(self) -> tuple[Trajectory, ...]:
        """All that moves."""
        return (self.motors,)

    def slowing(self, arm: AnyArm) -> tuple[float, BindingLimit | None]:
        """Return how many times slower it must run to keep all limits, and for which: see ``slowing_for_limits``."""
        return slowing_for_limits(arm, self.motors)


class SmoothingLaw(NamedTuple):
    """How a stage becomes smooth.

    Attributes:
        command: the motion of the motors for a leg.
        delay: how much longer than the leg it takes [s].
        frequencies: (k,) that are shaped [Hz]; none by flat feedforward.
    """

    command: Callable[[Trajectory], ShapedMotion | FlatMotion]
    delay: float
    frequencies: Array


@attrs.frozen(kw_only=True, eq=False)
class SmoothStage:
    """A stage that is shaped, and keeps all limits.

    Attributes:
        planned: the stage as it was.
        leg: what is shaped, slowed where limits ask for that, so that it ends on a tick when it is; by flat feedforward
            the motion of the links.
        law: how it is shaped.
        motion: what comes of that.
        factor: how many times slower the leg is than it was, for a limit.
        because: which limit, and which joint, from 0; None for none.
    """

    planned: PlannedStage
    leg: Trajectory
    law: SmoothingLaw
    motion: ShapedMotion | FlatMotion
    factor: float = 1.0
    because: BindingLimit | None = None

    @property
    def trajectory(self) -> Trajectory:
        """The motion of the motors."""
        return self.motion.motors

    def lasting(self, duration: float) -> SmoothStage:
        """Return the stage as it is when it takes a duration [s], which no limit asks for."""
        leg = self.leg.retimed(duration - self.law.delay)
        return attrs.evolve(self, leg=leg, motion=self.law.command(leg), factor=1.0, because=None)


def smooth_stages(
    arm: AnyArm, stages: Sequence[PlannedStage], shaping: ModeShaping, period: float, *, tool: ToolLimits | None = None
) -> list[SmoothStage]:
    """Return the stages of a move, each shaped for itself, as fast as the limits allow.

    Point to point shapers keep the path of the joints exactly, since all of them follow one law of time.

    Args:
        arm: the arm, or a compiled one, with n joints, of which some have flexible gears.
        stages: ``PTP`` to one pose, and, but for flat feedforward, ``LINE`` without a detour.
        shaping: how, and of how many modes.
        period: of the servo [s].
        tool: limits of the tool; None for none.

    Raises:
        UnsupportedArmError: no gear is flexible, drives are coupled, or the mass of a link is unknown.
        InvalidValueError: the shaper takes longer than a minute.
        IncapableArmError: no slowing keeps the limits, or the gears do not carry the arm.
    """
    return [_smooth(arm, stage, shaping, period, tool) for stage in stages]


def _smooth(
    arm: AnyArm, stage: PlannedStage, shaping: ModeShaping, period: float, tool: ToolLimits | None
) -> SmoothStage:
    planned, factor, because = stage.trajectory, 1.0, None
    if not planned.duration:
        law = SmoothingLaw(ShapedMotion, 0.0, np.zeros(0))
        return SmoothStage(planned=stage, leg=planned, law=law, motion=law.command(planned))
    model = solver_of(arm).arm
    leg, law = _law(model, planned, shaping)
    for _ in range(_ROUNDS):
        ticks = math.ceil((leg.duration + law.delay) / period - _TICK)
        leg = leg.retimed(ticks * period - law.delay)
        motion = law.command(leg)
        slower_by, limit = motion.slowing(arm)
        if tool is not None:
            slower_by = max(slower_by, *(tool.slowing(model, each) for each in motion.moving))
        if slower_by <= 1 + ROUNDING:
            return SmoothStage(planned=stage, leg=leg, law=law, motion=motion, factor=factor, because=because)
        because = limit or because
        leg, factor = leg.slowed(slower_by * (1 + _MORE)), factor * slower_by * (1 + _MORE)
        if shaping.kind == "flat" and leg.duration > planned.duration + max(LONGEST, planned.duration):
            raise InvalidValueError(
                f"flat feedforward would add {leg.duration - planned.duration:.3g} s to the move; expected {LONGEST:g} "
                "s at most: check stiffness and damping of the gears"
            )
    raise IncapableArmError("no slower motion keeps its limits when it is shaped")


def _law(arm: Arm, planned: Trajectory, shaping: ModeShaping) -> tuple[Trajectory, SmoothingLaw]:
    """Return the leg that is shaped to begin with, and how."""
    if shaping.kind == "flat":
        start, end = (links_at_rest(arm, planned(t)) for t in (0.0, planned.duration))
        return ninth(start, end, planned.duration), SmoothingLaw(partial(flat_motion, arm), 0.0, np.zeros(0))
    by, frequencies = mode_shaper(arm, planned, shaping.kind, count=shaping.count, tolerance=shaping.tolerance)
    return planned, SmoothingLaw(partial(_shaped, by), by.duration, frequencies)


def _shaped(by: Shaper, leg: Trajectory) -> ShapedMotion:
    return ShapedMotion(shaped(leg, by))


def lasting(stages: Sequence[SmoothStage], duration: float, period: float) -> list[SmoothStage]:
    """Return stages slowed so that they take a duration together [s], rounded up to a tick; none is run faster."""
    moving = [stage for stage in stages if stage.leg.duration]
    least = sum(round(stage.trajectory.duration / period) for stage in moving)
    more = max(0, math.ceil(duration / period - _TICK) - least)
    ends = np.cumsum([stage.leg.duration for stage in moving])
    shares = np.diff(np.round(more * ends / ends[-1]), prepend=0.0) if moving else np.zeros(0)
    extra = iter(shares.tolist())
    return [
        stage.lasting(stage.trajectory.duration + next(extra) * period) if stage.leg.duration else stage
        for stage in stages
    ]


def certified(
    arm: AnyArm, stages: Sequence[SmoothStage], shaping: ModeShaping, deviation: float, *, fixed: bool = False
) -> list[PlannedStage]:
    """Return the stages with what they keep.

    Args:
        arm: the arm, or a compiled one.
        stages: of a move.
        shaping: by which they were shaped.
        deviation: of the tool from straight lines that is allowed [m].
        fixed: whether their duration was asked for.

    Raises:
        LeftLineError: a straight line would be left by more.
        IncapableArmError: the limits are not kept in the duration that was asked for.
    """
    return [_certified(arm, k, stage, shaping, deviation, fixed=fixed) for k, stage in enumerate(stages)]


def _certified(
    arm: AnyArm, number: int, stage: SmoothStage, shaping: ModeShaping, deviation: float, *, fixed: bool
) -> PlannedStage:
    planned, motion, model = stage.planned, stage.trajectory, solver_of(arm).arm
    if not motion.duration:
        return planned
    if fixed and stage.motion.slowing(arm)[0] > 1 + ROUNDING:
        raise IncapableArmError("in this time its limits are not kept")
    is_slow = stage.because is not None
    slowed = slower(model, stage.factor, stage.because) if stage.because is not None else planned.slowed
    certificate, away, length = None, 0.0, planned.length
    if shaping.kind == "flat":
        away, length = path_deviation(arm, planned.trajectory, motion), tool_path_length(arm, motion)
    if planned.kind == "LINE":
        start, end = (solver_of(arm).forward(planned.trajectory(t)) for t in (0.0, planned.trajectory.duration))
        allowed = tolerance(deviation)
        turn = 2 * math.asin(min(1.0, float(half_sines(start[:3, :3], end[:3, :3]))))
        if np.linalg.norm(end[:3, 3] - start[:3, 3]) < _TURN and turn > allowed.orientation:
            text = "on this line the tool only turns, and the path of a turn is not certified"
            raise LeftLineError(number, text, only_turns=True)
        error = distance_from_line(arm, motion, start, end)
        found = error.largest
        # Running back along the line is leaving it too.
        off = max(found.position, error.backward or 0.0)
        if off > allowed.position or found.orientation > allowed.orientation:
            raise LeftLineError(
                number,
                f"shaped by {shaping.kind}, the line would be left by up to {off * 1e3:.3g} mm and "
                f"{found.orientation * 1e3:.3g} mrad; {allowed.position * 1e3:g} mm and "
                f"{allowed.orientation * 1e3:g} mrad are allowed",
            )
        old = planned.certificate
        factor, because = (1.0, None) if fixed or old is None else (old.factor * stage.factor, old.because)
        certificate = certificate_of(
            arm, motion, error, allowed, factor=factor, because=stage.because if is_slow else because
        )
        slowed, away = certificate.slowed, found.position
    return attrs.evolve(
        planned,
        trajectory=motion,
        length=length,
        certificate=certificate,
        deviation=None if certificate is None else away,
        slowed="" if fixed else slowed,
        unmet=None if fixed else planned.unmet,
        shaping=StageShaping(
            kind=shaping.kind,
            frequencies=stage.law.frequencies,
            added=0.0 if fixed else motion.duration - planned.trajectory.duration,
            deviation=away,
        ),
    )
