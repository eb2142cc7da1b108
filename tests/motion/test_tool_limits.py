"""Limits of the tool: kept by every kind of stage at random times, reached where the arm can, with limits of joints."""

from collections.abc import Mapping

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from armwright import compile_arm
from armwright.arm import load_arm
from armwright.arrays import Array
from armwright.kinematics import forward
from armwright.motion.plan import Manner, PlannedStage, StageError, StageGoal, plan
from armwright.motion.tool_limits import ToolLimits
from armwright.spatial.poses import homogeneous
from samples import Sample

ARM = load_arm("puma560")
PLANNER = compile_arm(ARM)
START = np.array([0.1, 0.3, -0.2, 0.2, 0.9, 0.1])
AT = forward(ARM, START)
# Of a central difference over this time [s].
STEP = 1e-5
KINDS: Mapping[str, Mapping[str, float]] = {
    "PTP": {},
    "LINE": {},
    "ARC": {},
    "SPLINE": {"corner": 0.02},
    "BLEND": {"blend": 0.02},
}


def pose(shift: Array, turn: Array) -> Array:
    return homogeneous(AT[:3, :3] @ Rotation.from_rotvec(turn).as_matrix(), AT[:3, 3] + shift)


def stage(kind: str, poses: Array, limits: ToolLimits, speed: float = 120.0) -> PlannedStage:
    goal = StageGoal(kind=kind, poses=poses, **KINDS[kind])  # type: ignore[arg-type]
    (planned,) = plan(PLANNER, START, [goal], Manner(speed=speed, tool=limits))
    return planned


def measured(planned: PlannedStage, t: Array) -> tuple[Array, Array, Array]:
    """Speed, turning and change of the speed of the tool, by central differences of its pose."""
    X = forward(ARM, planned.trajectory(t[:, None] + STEP * np.array([-2, -1, 0, 1, 2])))
    p = X[..., :3, 3]
    speeds = [np.linalg.norm(p[:, i + 1] - p[:, i - 1], axis=1) / (2 * STEP) for i in (1, 3)]
    turn = Rotation.from_matrix(np.swapaxes(X[:, 1, :3, :3], 1, 2) @ X[:, 3, :3, :3]).magnitude() / (2 * STEP)
    return np.linalg.norm(p[:, 3] - p[:, 1], axis=1) / (2 * STEP), turn, np.abs(speeds[1] - speeds[0]) / (2 * STEP)


@pytest.mark.parametrize("kind", KINDS)
def test_limits_are_kept(kind: str, sample: Sample) -> None:
    """At random times neither the tool passes what was asked for, nor a joint its own limits."""
    tried = failures = 0
    for rng in sample.cases(40):
        count = {"PTP": 1, "LINE": 1, "ARC": 2}.get(kind, 3)
        poses = np.stack([pose(rng.uniform(-0.12, 0.12, 3), rng.uniform(-0.3, 0.3, 3)) for _ in range(count)])
        limits = ToolLimits(
            speed=rng.choice([np.inf, rng.uniform(0.02, 0.5)]),
            rotation=rng.choice([np.inf, rng.uniform(0.1, 1.0)]),
            acceleration=rng.choice([np.inf, rng.uniform(0.1, 2.0)]),
        )
        try:
            planned = stage(kind, poses, limits)
        except StageError:
            continue
        tried += 1
        motion = planned.trajectory
        t = rng.uniform(3 * STEP, motion.duration - 3 * STEP, 300)
        speed, turn, change = measured(planned, t)
        failures += not (
            speed.max() <= limits.speed
            and turn.max() <= limits.rotation
            and change.max() <= limits.acceleration + 1e-4
            and (np.abs(motion(t, 1)) <= ARM.limits.speed * (1 + 1e-9)).all()
            and (np.abs(motion(t, 2)) <= ARM.limits.acceleration * (1 + 1e-9)).all()
            and np.abs(forward(ARM, motion(motion.duration)) - poses[-1]).max() < 1e-6
        )
    sample.record(f"limits of the tool and of the joints, {kind}, at 300 random times", tried, failures)

    assert tried
    assert not failures


@pytest.mark.parametrize("kind", ["LINE", "ARC"])
def test_a_long_middle_part_at_the_speed(kind: str) -> None:
    """A path runs at the speed for most of the time, and takes hardly longer than the trapezoid of the textbook."""
    end = pose(np.array([0.0, 0.16, 0.0]), np.zeros(3))
    poses = np.stack([pose(np.array([0.06, 0.08, 0.0]), np.zeros(3)), end] if kind == "ARC" else [end])
    limits = ToolLimits(speed=0.04, acceleration=0.2)
    planned = stage(kind, poses, limits)
    length, duration = planned.length, planned.trajectory.duration
    speed, _, _ = measured(planned, np.linspace(0.3 * duration, 0.7 * duration, 100))

    assert planned.unmet is None
    assert length / 0.04 + 0.2 < duration < 1.02 * (length / 0.04 + 0.2)
    assert speed.min() > 0.99 * 0.04


def test_what_the_arm_cannot_reach() -> None:
    """A speed beyond the limits is not passed silently: it is told with the speed that is reached."""
    poses = np.stack([pose(np.array([0.0, 0.16, 0.0]), np.zeros(3))])
    planned = stage("LINE", poses, ToolLimits(speed=50.0))

    assert planned.unmet is not None
    asked, reached = planned.unmet
    assert asked.speed == 50.0
    speed, _, _ = measured(planned, np.linspace(1e-3, planned.trajectory.duration - 1e-3, 2000))
    assert speed.max() == pytest.approx(reached.speed, rel=1e-3)
    assert reached.speed <= ARM.tool_speed


def test_speed_of_a_short_line() -> None:
    """Where a line is too short for the speed, nothing is told: no limit of a speed keeps the tool from it."""
    planned = stage("LINE", np.stack([pose(np.array([0.0, 0.002, 0.0]), np.zeros(3))]), ToolLimits(speed=0.25))

    assert planned.unmet is None
