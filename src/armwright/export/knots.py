"""Joint positions on a path, so near to each other that straight ways in joint space between them keep to it."""

import numpy as np

from armwright.arrays import Array
from armwright.motion.solver import Solver
from armwright.motion.trajectory import Trajectory

# Parts between two knots at which the path is looked at, and how often a part is halved at most.
_LOOKS = np.array([0.25, 0.5, 0.75])
_ROUNDS = 16


def path_knots(motion: Trajectory, solver: Solver, deviation: float) -> Array:
    """Return the times (k,) of knots on a motion [s], its end included and its start left out.

    Args:
        motion: of the joints.
        solver: functions of the arm.
        deviation: how far the tool may be from its path where the joints run straight from knot to knot [m].
    """
    times = np.linspace(0.0, motion.duration, 3)
    for _ in range(_ROUNDS):
        far = _deviations(motion, times, solver) > deviation
        if not far.any():
            break
        times = np.sort(np.append(times, (times[:-1] + times[1:])[far] / 2))
    return times[1:]


def _deviations(motion: Trajectory, times: Array, solver: Solver) -> Array:
    """Return how far the tool is from its path between each two knots (k - 1,) [m]."""
    looks = times[:-1, None] + np.diff(times)[:, None] * _LOOKS
    q, ends = motion(looks), motion(times)
    chords = np.diff(ends, axis=0)[:, None]
    lengths = np.maximum((chords**2).sum(axis=-1), np.finfo(float).tiny)
    part = np.clip(((q - ends[:-1, None]) * chords).sum(axis=-1) / lengths, 0.0, 1.0)
    straight = ends[:-1, None] + part[..., None] * chords
    apart = solver.forward(q)[..., :3, 3] - solver.forward(straight)[..., :3, 3]
    return np.asarray(np.linalg.norm(apart, axis=-1).max(axis=-1))
