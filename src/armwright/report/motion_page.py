"""The page of a motion that was planned of no file, as notebooks show it."""

from __future__ import annotations

import numpy as np

from armwright.arm.model import Arm
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.errors import ShapeError
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.moves import Move
from armwright.motion.poses_file import PosesFile
from armwright.motion.trajectory import Trajectory
from armwright.report.move_page import move_page
from armwright.report.page import RunPage

# Between samples of the motion [s].
_PERIOD = 0.01


def motion_page(move: Move) -> RunPage:
    """Return the page of a move, its poses with the names P1, P2 and so on."""
    names = tuple(f"P{number}" for number in range(1, len(move.poses) + 1))
    text = "".join(f"{name} at {t:.3f} s\n" for name, t in zip(names, move.times.tolist(), strict=True))
    lines = tuple(range(1, len(names) + 1))
    file = PosesFile(text=text, title="", names=names, poses=move.poses, times=None, blend=None, lines=lines, notes=())
    samples = move.trajectory.sampled(_PERIOD)
    tau = inverse_dynamics(move.arm, samples.q, samples.qd, samples.qdd)
    title = f"{move.arm.name} through {len(names)} poses"
    return move_page(move, file, samples, tau, title=title, name="", command="", notes=())


def along_trajectory(arm: Arm, trajectory: Trajectory) -> Move:
    """Return the move of an arm along a trajectory of its joints, from its first pose to its last.

    Raises:
        ShapeError: the trajectory has another number of joints.
    """
    times = np.array([0.0, trajectory.duration])
    q = np.asarray(trajectory(times))
    if q.shape != (2, arm.n):
        raise ShapeError(f"expected a trajectory of {arm.n} joints, got {q.shape[-1]}")
    return Move(
        arm=arm,
        poses=forward(arm, q),
        times=times,
        configurations=q,
        label="",
        trajectory=trajectory,
        passing_distances=np.zeros(2),
    )
