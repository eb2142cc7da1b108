"""All that has limits in a motion: the joints, and behind them coupled drives that have limits of their own.

Number k belongs to joint k % n or its drive, as in ``Arm.all_limits``; without such drives everything is as it was.
"""

from __future__ import annotations

from collections.abc import Iterator

import attrs
import numpy as np

from armwright.arm.coupling import Coupling
from armwright.arm.model import Arm
from armwright.arrays import LARGEST, Array
from armwright.kinematics.inverse_kinematics.solution import Violation, violations_of_all
from armwright.motion.controlled_stop import Resumption, Stop, resume, stop_on_path
from armwright.motion.trajectory import Trajectory


def limited_positions(arm: Arm, q: Array) -> Array:
    """Return positions, speeds or accelerations (..., k) of all that has limits, from those of the joints (..., n)."""
    coupling = _with_limits(arm)
    return q if coupling is None else np.concatenate([q, coupling.drives(q)], axis=-1)


def limited_efforts(arm: Arm, tau: Array) -> Array:
    """Return the efforts (..., k) of all that has limits, from those at the joints (..., n)."""
    coupling = _with_limits(arm)
    return tau if coupling is None else np.concatenate([tau, coupling.drive_efforts(tau)], axis=-1)


def limited_motion(arm: Arm, trajectory: Trajectory) -> Trajectory:
    """Return the motion of all that has limits, from that of the joints."""
    if _with_limits(arm) is None:
        return trajectory
    return attrs.evolve(trajectory, coefficients=limited_positions(arm, trajectory.coefficients))


def braked(arm: Arm, running: Trajectory, t: float, *, period: float) -> Stop:
    """Return the motion that stops an arm along its path within its limits of acceleration: see ``brake``."""
    stop = stop_on_path(limited_motion(arm, running), t, _accelerations(arm), period=period)
    return attrs.evolve(stop, trajectory=_of_joints(arm, stop.trajectory))


def resumed(arm: Arm, running: Trajectory, t: float, *, period: float) -> Resumption:
    """Return the rest of a motion of an arm that stands on its path, within its limits: see ``resume``."""
    rest = resume(limited_motion(arm, running), t, _accelerations(arm), period=period)
    return attrs.evolve(rest, trajectory=_of_joints(arm, rest.trajectory))


def _accelerations(arm: Arm) -> Array:
    """Return the largest accelerations (k,) of all that has limits."""
    if _with_limits(arm) is None:
        return arm.limits.acceleration
    limits = arm.all_limits.acceleration
    # A drive whose acceleration has no limit brakes as its joints do.
    return np.where(np.isfinite(limits) | (np.arange(len(limits)) < arm.n), limits, LARGEST)


def _of_joints(arm: Arm, trajectory: Trajectory) -> Trajectory:
    """Return the motion of the joints (n,) out of that of all that has limits."""
    return attrs.evolve(trajectory, coefficients=trajectory.coefficients[:, :, : arm.n])


def passed_limits(arm: Arm, trajectory: Trajectory) -> Iterator[Violation]:
    """Give the position limits that a motion passes, of joints and of drives."""
    for extreme in limited_motion(arm, trajectory).extremes(0):
        yield from violations_of_all(arm, extreme.tolist())


def by_joint(arm: Arm, values: Array) -> Array:
    """Return (..., n) the larger one of what a joint and its drive have, from (..., k) of all that has limits."""
    return values if _with_limits(arm) is None else values.reshape(*values.shape[:-1], 2, arm.n).max(axis=-2)


def limited_label(arm: Arm, number: int) -> str:
    """Return how messages call what has limits, from 0: a joint, or the drive of one."""
    label = arm.joint_label(number % arm.n)
    return label if number < arm.n else f"the drive of {label}"


def _with_limits(arm: Arm) -> Coupling | None:
    return arm.coupling if arm.coupling is not None and arm.coupling.limits else None
