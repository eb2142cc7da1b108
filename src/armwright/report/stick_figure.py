"""The stick figure of an arm on the page, and the data of its joints."""

import math

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.limited import limited_efforts, limited_positions
from armwright.report.limit_spans import limit_spans
from armwright.report.page import ArmRecord, JointInfo

# Rows of the charts at most, which suffice for a screen.
_CHART_ROWS = 1500


def arm_record(
    name: str, arm: Arm, motion: tuple[Array, Array, Array, Array, Array | None], base: Array | None = None
) -> ArmRecord:
    """Return the motion of an arm for the page, at as many instants as a chart shows.

    Args:
        name: its name in the program.
        arm: the arm, with n joints.
        motion: (k,) times [s]; (k, n) positions, speeds, accelerations and efforts of its joints, which may be unknown.
        base: (4, 4) pose of the arm in the world; the world itself when left out.
    """
    t, q, qd, qdd, tau = motion
    known = None if tau is None else limited_efforts(arm, tau)
    of_all = (t, limited_positions(arm, q), limited_positions(arm, qd), limited_positions(arm, qdd), known)
    at_limits = [attrs.evolve(span, joint=span.joint % arm.n) for span in limit_spans(arm.all_limits, of_all)]
    rows = thinned_rows(len(t))
    t, q, qd, qdd, tau = t[rows], q[rows], qd[rows], qdd[rows], None if tau is None else tau[rows]
    joints = [
        JointInfo(name=f"joint {i}", kind=joint.kind, **attrs.asdict(joint.limits))
        for i, joint in enumerate(arm.joints, 1)
    ]
    poses = forward(arm, q) if base is None else base @ forward(arm, q)
    hand = poses[:, :3, 3]
    return ArmRecord(
        name=name, model=arm.name, joints=joints, t=t, q=q, qd=qd, qdd=qdd, tau=tau, hand=hand, at_limits=at_limits
    )


def skeleton_points(arm: Arm, poses: Array) -> Array:
    """Draw an arm along its Denavit-Hartenberg transforms: first along z, then along x, so that offsets are visible.

    Args:
        arm: the arm, with n joints.
        poses: (M, n + 2, 4, 4) poses of its frames in the world, by ``link_poses``.

    Returns:
        (M, K, 3) the corners of the figure, from the floor to the tool [m].
    """
    origins, z_axes = poses[:, :, :3, 3], poses[:, :, :3, 2]
    points = [_floor_points(origins[:, 0]), origins[:, 0]]
    for i in range(1, arm.n + 1):
        before, after, z = origins[:, i - 1], origins[:, i], z_axes[:, i - 1]
        along = np.sum((after - before) * z, axis=-1, keepdims=True)
        points += [before + along * z, after]
    points.append(origins[:, -1])
    return np.stack(points, axis=1)


def thinned_rows(count: int, most: int = _CHART_ROWS) -> npt.NDArray[np.intp]:
    """Return the indices of the rows that a chart shows of this many, at most so many and the last."""
    stride = max(1, math.ceil(count / most))
    return np.unique(np.append(np.arange(0, count, stride), count - 1))


def _floor_points(origin: Array) -> Array:
    """Return the point on the floor below a raised base, from which the figure is drawn."""
    foot = origin.copy()
    foot[:, 2] = np.minimum(origin[:, 2], 0.0)
    return foot
