"""Stages of a move that are shaped, so that an arm with flexible gears vibrates little where each of them ends."""

from __future__ import annotations

import math
from collections.abc import Sequence

import attrs
import numpy as np

from armwright.errors import ArmwrightError, IncapableArmError
from armwright.motion.certificate import BindingLimit, slower
from armwright.motion.certified_motion import certificate_of
from armwright.motion.deviation import distance_from_line
from armwright.motion.limit_utilization import ROUNDING, slowing_for_limits
from armwright.motion.mode_shaping import ModeShaper, ModeShaping, StageShaping, mode_shaper
from armwright.motion.plan import PlannedStage
from armwright.motion.shaping import shaped
from armwright.motion.solver import AnyArm, solver_of
from armwright.motion.tolerance import tolerance
from armwright.motion.tool_limits import ToolLimits
from armwright.motion.trajectory import Trajectory

# Rounds in which a stage is slowed until it keeps its limits when it is shaped, and what more it is slowed by.
_ROUNDS, _MORE = 30, 1e-3
# What a number of servo periods may be off a whole one.
_TICK = 1e-6
# A line that is shorter only turns the tool [m].
_TURN = 1e-6


class LeftLineError(ArmwrightError, ValueError):
    """A straight line that would be left by more than is allowed when it is shaped.

    Attributes:
        stage: which stage, from 0.
    """

    def __init__(self, stage: int, text: str) -> None:
        """Keep the stage."""
        self.stage = stage
        super().__init__(text)


@attrs.frozen(kw_only=True, eq=False)
class SmoothStage:
    """A stage that is shaped, and keeps all limits.

    Attributes:
        planned: the stage as it was.
        leg: its motion, slowed where limits ask for that, so that it ends on a tick when it is shaped.
        mode: the shaper and its frequencies; None where the stage stands.
        factor: how many times slower the leg is than it was, for a limit.
        because: which limit, and which joint, from 0; None for none.
    """

    planned: PlannedStage
    leg: Trajectory
    mode: ModeShaper | None
    factor: float = 1.0
    because: BindingLimit | None = None

    @property
    def trajectory(self) -> Trajectory:
        """The motion."""
        return self.leg if self.mode is None else shaped(self.leg, self.mode.shaper)


def smooth_stages(
    arm: AnyArm, stages: Sequence[PlannedStage], shaping: ModeShaping, period: float, *, tool: ToolLimits | None = None
) -> list[SmoothStage]:
    """Return the stages of a move, each shaped for itself, as fast as the limits allow.

    Point to point the joints keep their path exactly, since all of them follow one law of time.

    Args:
        arm: the arm, or a compiled one, with n joints, of which some have flexible gears.
        stages: ``PTP`` to one pose, and ``LINE`` without a detour.
        shaping: which shaper, and of how many modes.
        period: of the servo [s].
        tool: limits of the tool; None for none.

    Raises:
        UnsupportedArmError: no gear is flexible, drives are coupled, or the mass of a link is unknown.
        InvalidValueError: the shaper takes longer than a minute.
        IncapableArmError: no slowing keeps the limits.
    """
    return [_smooth(arm, stage, shaping, period, tool) for stage in stages]


def _smooth(
    arm: AnyArm, stage: PlannedStage, shaping: ModeShaping, period: float, tool: ToolLimits | None
) -> SmoothStage:
    leg, factor, because = stage.trajectory, 1.0, None
    if not leg.duration:
        return SmoothStage(planned=stage, leg=leg, mode=None)
    model = solver_of(arm).arm
    mode = mode_shaper(model, leg, shaping)
    delay = mode.shaper.duration
    for _ in range(_ROUNDS):
        ticks = math.ceil((leg.duration + delay) / period - _TICK)
        leg = leg.retimed(ticks * period - delay)
        found = SmoothStage(planned=stage, leg=leg, mode=mode, factor=factor, because=because)
        motion = found.trajectory
        slower_by, limit = slowing_for_limits(arm, motion)
        if tool is not None:
            slower_by = max(slower_by, tool.slowing(model, motion))
        if slower_by <= 1 + ROUNDING:
            return found
        because = limit or because
        leg, factor = leg.slowed(slower_by * (1 + _MORE)), factor * slower_by * (1 + _MORE)
    raise IncapableArmError("no slower motion keeps its limits when it is shaped")


def lasting(stages: Sequence[SmoothStage], duration: float, period: float) -> list[SmoothStage]:
    """Return stages slowed so that they take a duration together [s], rounded up to a tick; none is run faster."""
    moving = [stage for stage in stages if stage.mode is not None]
    least = sum(round(stage.trajectory.duration / period) for stage in moving)
    more = max(0, math.ceil(duration / period - _TICK) - least)
    ends = np.cumsum([stage.leg.duration for stage in moving])
    shares = np.diff(np.round(more * ends / ends[-1]), prepend=0.0) if moving else np.zeros(0)
    extra = iter(shares.tolist())
    return [
        stage
        if stage.mode is None
        else attrs.evolve(
            stage, leg=stage.leg.retimed(stage.leg.duration + next(extra) * period), factor=1.0, because=None
        )
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
    planned, mode = stage.planned, stage.mode
    if mode is None:
        return planned
    motion, model = stage.trajectory, solver_of(arm).arm
    if fixed and slowing_for_limits(arm, motion)[0] > 1 + ROUNDING:
        raise IncapableArmError("in this time its limits are not kept")
    is_slow = stage.because is not None
    slowed = slower(model, stage.factor, stage.because) if stage.because is not None else planned.slowed
    certificate, away = None, 0.0
    if planned.kind == "LINE":
        start, end = (solver_of(arm).forward(planned.trajectory(t)) for t in (0.0, planned.trajectory.duration))
        if np.linalg.norm(end[:3, 3] - start[:3, 3]) < _TURN:
            raise LeftLineError(number, "on this line the tool only turns, and the path of a turn is not certified")
        error, allowed = distance_from_line(arm, motion, start, end), tolerance(deviation)
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
        certificate=certificate,
        deviation=None if certificate is None else away,
        slowed="" if fixed else slowed,
        unmet=None if fixed else planned.unmet,
        shaping=StageShaping(
            kind=shaping.kind,
            frequencies=mode.frequencies,
            added=0.0 if fixed else motion.duration - planned.trajectory.duration,
            deviation=away,
        ),
    )
