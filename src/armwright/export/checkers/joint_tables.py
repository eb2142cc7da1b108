"""Reading trajectories of ROS 2 and tables of drives, and comparing them with the stages of a run."""

import io
import json
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.cell.outputs import Encoders
from armwright.export.checkers.actions import CheckError
from armwright.export.proof import Comparison
from armwright.program.vm.recording import Recording, RunStage

# What is allowed: of joint positions [rad] or [m], of limits of speed as a part.
_ANGLE, _ROUNDING = 1e-5, 1e-3
# Looks between two points of a trajectory.
_BETWEEN = 6


def compare_trajectory(trajectory: str, goal: str, recording: Recording, arm_name: str) -> tuple[Comparison, ...]:
    """Return how the files for ROS 2 differ from a run: quintic splines through their points beside the plan.

    Raises:
        CheckError: a file is no trajectory.
    """
    data, inside = json.loads(trajectory), json.loads(goal)["trajectory"]
    arm, points = recording.cell.arms[arm_name].arm, data["points"]
    if len(data["joint_names"]) != arm.n or len(set(data["joint_names"])) != arm.n:
        raise CheckError(f"expected {arm.n} names of joints, got {data['joint_names']}")
    stamps = [point["time_from_start"] for point in points]
    times = np.array([stamp["sec"] + stamp["nanosec"] * 1e-9 for stamp in stamps])
    q, qd, qdd = (np.array([point[name] for point in points]) for name in ("positions", "velocities", "accelerations"))
    if not (q.shape == qd.shape == qdd.shape == (len(points), arm.n)):
        raise CheckError("expected positions, velocities and accelerations of all joints at every point")
    coefficients = _quintics(np.diff(times), q, qd, qdd)
    parts = np.linspace(0.0, 1.0, _BETWEEN, endpoint=False)
    local = np.diff(times)[:, None] * parts
    looks = (times[:-1, None] + local).ravel()
    powers = local[..., None] ** np.arange(6)
    spline = np.einsum("mkp,mpj->mkj", powers, coefficients).reshape(-1, arm.n)
    derived = coefficients[:, 1:] * np.arange(1, 6)[:, None]
    speeds = np.einsum("mkp,mpj->mkj", powers[..., :5], derived).reshape(-1, arm.n)
    mine = [stage for stage in recording.stages if stage.arm == arm_name]
    plan = _plan(looks, mine, recording.cell.arms[arm_name].start)
    ends = np.array([stage.t1 for stage in mine])
    at_ends = _at(ends, times, coefficients) if len(points) > 1 else np.repeat(q[:1], len(ends), axis=0)
    targets = [np.abs(x - stage.motion(stage.motion.duration)).max() for x, stage in zip(at_ends, mine, strict=True)]
    return (
        _comparison("points whose time does not grow", len(points), int((np.diff(times) <= 0).sum()), 0),
        _comparison("goal of the action that is not the trajectory", 1, int(inside != data), 0),
        _comparison("joints at the ends of stages", len(targets), max(targets, default=0.0), _ANGLE, "rad or m"),
        _comparison("joints between the points", len(looks), _largest(spline - plan), _ANGLE, "rad or m"),
        _comparison("joint speeds, of the limits", len(looks), _largest(speeds / arm.limits.speed), 1 + _ROUNDING),
        _comparison("joint speeds at the end", 1, _largest(qd[-1:]), _ANGLE, "rad/s or m/s"),
        _comparison("duration", 1, abs(float(times[-1]) - recording.duration), 1e-8, "s"),
    )


def compare_counts(text: str, recording: Recording, arm_name: str) -> tuple[Comparison, ...]:
    """Return how a table of counts differs from a run.

    Raises:
        CheckError: it is no such table.
    """
    placed = recording.cell.arms[arm_name]
    arm, encoders = placed.arm, placed.controller.encoders
    first, *_ = text.split("\n", 1)
    words = first.split()
    if words[:2] != ["#", "period"] or encoders is None:
        raise CheckError("line 1: expected the period")
    period = float(words[2])
    counts = np.loadtxt(io.StringIO(text), delimiter=",", skiprows=2, dtype=np.int64, ndmin=2)
    if counts.shape[1] != arm.n:
        raise CheckError(f"line 3: expected {arm.n} columns")
    unit, C = _units(arm, encoders), np.eye(arm.n) if arm.coupling is None else arm.coupling.matrix
    m = (counts - encoders.offset) * unit
    mine = [stage for stage in recording.stages if stage.arm == arm_name]
    times: Array = np.arange(len(counts), dtype=np.float64) * period
    plan = np.linalg.solve(C, _plan(times, mine, placed.start).T).T
    joint_ways, rounded = np.abs(np.diff(m, axis=0) @ C.T), np.abs(C) @ np.abs(unit)
    speeds = np.maximum(joint_ways - rounded, 0.0) / period / arm.limits.speed
    end = mine[-1].motion(mine[-1].motion.duration) if mine else placed.start
    last = np.abs(m[-1] - np.linalg.solve(C, end)) / np.abs(unit)
    return (
        _comparison("positions", counts.size, _largest((m - plan) / unit), 0.5 + _ROUNDING, "counts"),
        _comparison("positions at the end", arm.n, float(last.max()), 0.5 + _ROUNDING, "counts"),
        _comparison("counts beyond 32 bits", counts.size, int((counts != counts.astype(np.int32)).sum()), 0),
        _comparison("joint speeds, of the limits", counts.size, _largest(speeds), 1 + _ROUNDING),
        _comparison("duration beyond that of the run", 1, max(float(times[-1]) - recording.duration, 0.0), period, "s"),
    )


def _comparison(quantity: str, count: int, worst: float, allowed: float, unit: str = "") -> Comparison:
    return Comparison(quantity=quantity, count=count, worst=float(worst), allowed=allowed, unit=unit)


def _largest(values: Array) -> float:
    return float(np.abs(values).max(initial=0.0))


def _units(arm: Arm, encoders: Encoders) -> Array:
    """Return what one count is (n,) [rad] or [m], with its sign."""
    return np.array(
        [
            sign * (2 * np.pi if joint.revolute else 1.0) / counts
            for joint, counts, sign in zip(arm.joints, encoders.counts, encoders.signs, strict=True)
        ]
    )


def _plan(times: Array, stages: Sequence[RunStage], start: Array) -> Array:
    """Return the joint positions (k, n) of a run at times (k,), stage by stage."""
    q = np.tile(np.asarray(start, dtype=float), (len(times), 1))
    firsts = np.searchsorted(times, [stage.t0 for stage in stages])
    for stage, (first, last) in zip(stages, pairwise([*firsts, len(times)]), strict=True):
        q[first:last] = stage.motion(times[first:last] - stage.t0)
    return q


def _quintics(h: Array, q: Array, qd: Array, qdd: Array) -> Array:
    """Return the coefficients (k - 1, 6, n) of the polynomials of degree 5 between points, by linear equations."""
    zero, one = np.zeros_like(h), np.ones_like(h)
    rows = np.stack(
        [
            np.stack([one, zero, zero, zero, zero, zero], axis=-1),
            np.stack([zero, one, zero, zero, zero, zero], axis=-1),
            np.stack([zero, zero, 2 * one, zero, zero, zero], axis=-1),
            np.stack([h**i for i in range(6)], axis=-1),
            np.stack([zero, *(i * h ** (i - 1) for i in range(1, 6))], axis=-1),
            np.stack([zero, zero, *(i * (i - 1) * h ** (i - 2) for i in range(2, 6))], axis=-1),
        ],
        axis=1,
    )
    ends = np.stack([q[:-1], qd[:-1], qdd[:-1], q[1:], qd[1:], qdd[1:]], axis=1)
    return np.asarray(np.linalg.solve(rows, ends))


def _at(moments: Array, times: Array, coefficients: Array) -> Array:
    """Return the positions (k, n) of splines at moments (k,)."""
    part = np.clip(np.searchsorted(times, moments, side="right") - 1, 0, len(coefficients) - 1)
    powers = (moments - times[part])[:, None] ** np.arange(6)
    return np.asarray(np.einsum("kp,kpj->kj", powers, coefficients[part]))
