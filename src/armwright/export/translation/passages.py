"""What the run of a program says of each stage of its MOVEs: configurations, speeds, rounded corners."""

from collections.abc import Sequence

import numpy as np

from armwright.arrays import Array
from armwright.cell.model import CellArm
from armwright.compiled.arm import planning_arm
from armwright.export.plan_mode import blend_zones, run_events
from armwright.export.refusals import refusal
from armwright.export.translation.code import Passages
from armwright.motion.solver import Solver, solver_of
from armwright.program.language.units import NORMAL_SPEED
from armwright.program.vm.recording import Recording, RunStage
from armwright.spatial.poses import from_noap
from armwright.spatial.rotations import angle_between

# Points of a stage at which the speed of the tool is looked at.
_LOOKS = 65
# A way of the tool point that is none [m].
_SHORT = 1e-6
# Of the speed that the joints bear, what is asked for; parts of their limits that are none.
_BORNE, _AT_REST = 0.95, 1e-6
# Of a MOVE that the run does not reach: part of the speed limits, of the tool [m/s], [rad/s], [m/s²].
_SLOW_PART, _SLOW, _SLOW_TURN, _SLOW_ACCELERATION = 0.1, 0.1, 0.2, 0.5
# Of the joints, as long as they take to reach their speed [s].
_RAMP = 0.5


class Run:
    """The stages that a run has passed, by the MOVE that they belong to."""

    def __init__(self, recording: Recording, arm: str) -> None:
        """Gather the stages of an arm."""
        self._recording = recording
        self._placed: CellArm = recording.cell.arms[arm]
        self._solver = solver_of(planning_arm(self._placed.arm))
        self._stages: dict[tuple[int, int], list[RunStage]] = {}
        for _, _, effect, stages in run_events(recording):
            for number, stage in enumerate(stages):
                self._stages.setdefault((effect.span.start, number), []).append(stage)

    def seen(self, frame: str) -> list[Array]:
        """Return the poses (4, 4) in the world at which the camera has found a frame, without those that are alike."""
        found: list[Array] = []
        for effect in self._recording.effects:
            if effect.kind == "READ" and effect.data.get("frame") == frame:
                X = from_noap(effect.data["pose"])
                if not any(np.allclose(X, other, rtol=0, atol=1e-9) for other in found):
                    found.append(X)
        return found

    def passages(self, span_start: int, number: int, legs: int) -> Passages:
        """Return what a stage of the MOVE that begins there did.

        Args:
            span_start: where the MOVE begins in the program.
            number: of the stage, from 0.
            legs: how many targets it has.

        Raises:
            ExportError: it goes round an obstacle.
        """
        stages = self._stages.get((span_start, number), [])
        if not stages:
            return self._never(legs)
        for stage in stages:
            goal = stage.stage.goal
            if goal is not None and goal.kind == "SPLINE" and goal.corner is None:
                source = self._recording.code.source
                text = "the X-spline of RLO-83 is no line with rounded corners, which is what controllers know"
                raise refusal(source, "E619", text, stage.span, "on this MOVE", helps=["export it by `--mode plan`"])
            if stage.path is not None or stage.stage.detour is not None:
                source = self._recording.code.source
                text = "this MOVE goes round an obstacle, and the way round is that of one run alone"
                helps = ["export the run by `--mode plan`, or give the way by frames"]
                raise refusal(source, "E619", text, stage.span, "on this MOVE", helps=helps)
        return self._reached(stages, legs)

    def _never(self, legs: int) -> Passages:
        limits, q = self._placed.arm.limits.speed, self._placed.start
        slowest = float(limits.min())
        return Passages(
            reached=False,
            start=q[None],
            q=np.broadcast_to(q, (1, legs, len(q))),
            near=q,
            joint_speed=_SLOW_PART * slowest,
            joint_acceleration=_SLOW_PART * slowest / _RAMP,
            speed_part=_SLOW_PART,
            speed=_SLOW,
            turn_speed=_SLOW_TURN,
            acceleration=_SLOW_ACCELERATION,
            durations=np.zeros(0),
            zones=np.zeros(legs),
            turns_only=False,
        )

    def _reached(self, stages: Sequence[RunStage], legs: int) -> Passages:
        limits = self._placed.arm.limits.speed
        moving = [stage for stage in stages if stage.duration]
        ends = np.array([_leg_ends(stage, self._solver, legs) for stage in stages])
        last = ends[:, -1]
        rates = [(stage.motion.peaks(1), stage.motion.peaks(2), NORMAL_SPEED / stage.speed) for stage in moving]
        tools = [(*_tool_rates(stage, self._solver, limits), NORMAL_SPEED / stage.speed) for stage in moving]
        zones = [_zones(stage, self._solver, legs) for stage in stages]
        return Passages(
            reached=True,
            start=np.array([stage.motion(0.0) for stage in stages]),
            q=ends,
            near=(last.min(axis=0) + last.max(axis=0)) / 2,
            joint_speed=max((float(v.max()) * scale for v, _, scale in rates), default=float(limits.min())),
            joint_acceleration=max((float(a.max()) * scale for _, a, scale in rates), default=1.0),
            speed_part=max((float((v / limits).max()) * scale for v, _, scale in rates), default=1.0),
            speed=min((v * scale for v, _, _, scale in tools if v > _SHORT), default=_SLOW),
            turn_speed=min((w * scale for _, w, _, scale in tools if w > _SHORT), default=_SLOW_TURN),
            acceleration=min((a * scale for _, _, a, scale in tools if a > _SHORT), default=_SLOW_ACCELERATION),
            durations=np.array([stage.duration for stage in stages]),
            zones=np.min(zones, axis=0),
            turns_only=bool(moving) and all(v <= _SHORT for v, _, _, _ in tools),
        )


def _leg_ends(stage: RunStage, solver: Solver, legs: int) -> Array:
    """Return the joint positions (m, n) at the ends of the legs of a stage; at a rounded corner, those next to it."""
    motion = stage.motion
    if legs == 1 or stage.stage.goal is None:
        return np.broadcast_to(motion(motion.duration), (legs, *motion(0.0).shape))
    times = np.linspace(0.0, motion.duration, _LOOKS)
    X = solver.forward(motion(times))
    poses = stage.stage.goal.poses[:-1]
    near = [int(np.linalg.norm(X[:, :3, 3] - pose[:3, 3], axis=-1).argmin()) for pose in poses]
    return np.asarray(motion(np.append(times[near], motion.duration)))


def _tool_rates(stage: RunStage, solver: Solver, limits: Array) -> tuple[float, float, float]:
    """Return the largest speed, speed of rotation and acceleration of the tool in a stage.

    The speeds are no larger than the joints bear where they are the same all along the path.
    """
    times = np.linspace(0.0, stage.motion.duration, _LOOKS)
    q, step = stage.motion(times), float(times[1])
    X = solver.forward(q)
    speeds = np.linalg.norm(np.diff(X[:, :3, 3], axis=0), axis=-1) / step
    turns = np.asarray(angle_between(X[:-1, :3, :3], X[1:, :3, :3])) / step
    loads = (np.abs(np.diff(q, axis=0)) / step / limits).max(axis=-1)
    moving = loads > _AT_REST
    borne = [_BORNE * float((rates[moving] / loads[moving]).min(initial=np.inf)) for rates in (speeds, turns)]
    fastest = [min(float(rates.max()), most) for rates, most in zip((speeds, turns), borne, strict=True)]
    return fastest[0], fastest[1], float(np.abs(np.diff(speeds)).max() / step)


def _zones(stage: RunStage, solver: Solver, legs: int) -> Array:
    """Return from where on the corners of a stage are rounded [m]; nowhere where the arm stopped at them."""
    goal = stage.stage.goal
    if legs == 1 or goal is None or stage.stage.obstacle is not None:
        return np.zeros(legs)
    width = goal.blend if goal.blend is not None else goal.corner or 0.0
    return blend_zones(solver.forward(stage.motion(0.0)), goal.poses, width)
