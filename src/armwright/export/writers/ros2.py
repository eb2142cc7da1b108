"""ROS 2: JointTrajectory, and the goal of FollowJointTrajectory, both in YAML that is JSON as well."""

import json

import numpy as np

from armwright.arm.names import distinct_names
from armwright.arrays import Array
from armwright.export.arm_motion import arm_motion
from armwright.export.conventions import find_convention
from armwright.export.writers.controller_file import ControllerFile
from armwright.motion.trajectory import Trajectory
from armwright.program.vm.recording import Recording

# How far the quintic splines between the points may be off the plan [rad] or [m]: a tenth of what the proof allows.
_ALLOWED = 1e-6
# Where between two points that is looked at, and how often a part is halved at most.
_LOOKS = np.linspace(0.1, 0.9, 5)
_ROUNDS = 24
_DIGITS = 9
_NANO = 1_000_000_000


def write(recording: Recording, arm_name: str) -> list[ControllerFile]:
    """Return the trajectory of an arm, and the goal of an action with it."""
    placed = recording.cell.arms[arm_name]
    convention = find_convention(placed.arm, placed.controller.convention)
    own = [joint.name for joint in placed.arm.joints]
    notes = [
        "controllers that interpolate without velocities and accelerations leave the path",
        "outputs and texts are not part of a trajectory: events.json has them with their times",
    ]
    if convention is not None and len(convention.ros_joints) == placed.arm.n:
        names = list(convention.ros_joints)
    else:
        names = distinct_names(own, [f"joint_{i}" for i in range(1, placed.arm.n + 1)])
        if not all(own):
            notes.append(f"{arm_name} names not all of its joints: names such as {names[0]} are chosen")
    motion = arm_motion(recording, arm_name)
    trajectory = _text(motion, _times(motion), names)
    goal = f'{{"trajectory": {trajectory}, "goal_time_tolerance": {{"sec": 0, "nanosec": 0}}}}\n'
    return [
        ControllerFile(name=f"{arm_name}.trajectory.yaml", text=f"{trajectory}\n", approximations=tuple(notes)),
        ControllerFile(name=f"{arm_name}.goal.yaml", text=goal, approximations=()),
    ]


def _text(motion: Trajectory, times: Array, names: list[str]) -> str:
    """Return a trajectory, one point a line."""
    rows = np.concatenate([motion(times, order) for order in range(3)], axis=1) + 0.0
    numbers = ", ".join([f"%.{_DIGITS}f"] * len(names))
    line = f'{{"positions": [{numbers}], "velocities": [{numbers}], "accelerations": [{numbers}], '
    line += '"time_from_start": {"sec": %d, "nanosec": %d}}'
    ticks = np.rint(times * _NANO).astype(np.int64)
    points = ",\n".join(
        line % (*row, tick // _NANO, tick % _NANO) for row, tick in zip(rows.tolist(), ticks.tolist(), strict=True)
    )
    return f'{{"joint_names": {json.dumps(names)}, "points": [\n{points}\n]}}'


def _times(motion: Trajectory) -> Array:
    """Return the times of points (k,) [s], between which quintic splines are the plan but for what is allowed."""
    times = np.unique(np.rint(np.linspace(0.0, motion.duration, 2 + int(motion.duration)) * _NANO)) / _NANO
    for _ in range(_ROUNDS):
        far = _deviations(motion, times) > _ALLOWED
        if not far.any():
            break
        middles = np.rint((times[:-1] + times[1:])[far] / 2 * _NANO) / _NANO
        finer = np.unique(np.append(times, middles))
        if len(finer) == len(times):
            break
        times = finer
    return times


def _deviations(motion: Trajectory, times: Array) -> Array:
    """Return how far the splines are off the plan between each two points (k - 1,)."""
    h = np.diff(times)[:, None, None]
    (p0, p1), (v0, v1), (a0, a1) = ((x[:-1, None], x[1:, None]) for x in (motion(times, order) for order in range(3)))
    s = _LOOKS[None, :, None]
    v0, v1, a0, a1 = v0 * h, v1 * h, a0 * h * h, a1 * h * h
    # Bernstein form of the quintic with these ends.
    control = [p0, p0 + v0 / 5, p0 + 2 * v0 / 5 + a0 / 20, p1 - 2 * v1 / 5 + a1 / 20, p1 - v1 / 5, p1]
    binomials = (1, 5, 10, 10, 5, 1)
    spline = sum(
        count * s**i * (1 - s) ** (5 - i) * point
        for i, (count, point) in enumerate(zip(binomials, control, strict=True))
    )
    plan = motion(times[:-1, None] + h[..., 0] * _LOOKS)
    return np.asarray(np.abs(spline - plan).max(axis=(1, 2)))
