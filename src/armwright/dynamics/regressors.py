"""The regressor: efforts as linear functions of the masses, inertias and drives of an arm."""

from __future__ import annotations

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike
from armwright.dynamics.arguments import Scalars, batch, stack_matrix, weighed
from armwright.dynamics.bodies import body_of
from armwright.dynamics.joint_frames import joint_steps, lever_behind
from armwright.dynamics.newton_euler import JointMotion, joint_motions, point_accelerations
from armwright.tracing.scalar import select
from armwright.tracing.vectors import Matrix, Vector, add, apply, cross, dot, transpose

_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
# The six numbers of an inertia tensor, in their order.
_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
# How many parameters a link has, and how many the drive of a joint.
OF_LINK, OF_DRIVE = 10, 4


def regressor(arm: Arm, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Array:
    """Return the regressor Y of a motion: tau = Y theta, with the parameters of ``dynamic_parameters``.

    It depends on the geometry of the arm and on gravity, but not on its masses, inertias and drives.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        qd: (..., n) joint velocities.
        qdd: (..., n) joint accelerations.

    Returns:
        Y: (..., n, 14 n), one column per parameter.

    Raises:
        KindError: ``arm`` is no arm, or an array is something else than real numbers.
        ShapeError: a last axis is not n long, or the leading axes do not fit together.
        InvalidValueError: a number is NaN or infinite.
        UnsupportedArmError: the mass of a link is unknown.

    Source:
        Khalil & Dombre (2002), chapter 12; the columns by partial velocities, Kane & Levinson (1985).
    """
    lead, scalars, _ = batch(arm, q=q, qd=qd, qdd=qdd)
    return stack_matrix(effort_regressor(arm, *scalars), lead)


def dynamic_parameters(arm: Arm) -> Array:
    """Return the parameters of an arm in which its efforts are linear.

    They are, for each link in its order:

        m, m c_x, m c_y, m c_z, I_xx, I_xy, I_xz, I_yy, I_yz, I_zz

    with the mass m [kg], the centre of mass c in the frame of the link [m], and the inertia tensor I about the origin
    of that frame, not about c [kg m²]. Behind those of all links, for each joint: the rotor inertia, viscous friction,
    and the magnitudes of Coulomb friction in and against the direction of q, as in ``Motor``.

    Args:
        arm: the arm, with n joints.

    Returns:
        theta: (14 n,).

    Raises:
        KindError: ``arm`` is no arm.
        UnsupportedArmError: the mass of a link is unknown.
    """
    bodies = [body_of(link) for link in weighed(arm).links]
    links = [[body.mass, *body.moment, *(body.tensor[a][b] for a, b in _PAIRS)] for body in bodies]
    drives = [[m.inertia, m.viscous, m.coulomb_forward, m.coulomb_backward] for m in arm.motors]
    return np.array([x for part in (*links, *drives) for x in part], dtype=np.float64)


def effort_regressor(arm: Arm, q: Scalars, qd: Scalars, qdd: Scalars) -> Matrix:
    """Return the regressor, n x 14 n, over abstract scalars.

    The effort of a joint is the power of the wrenches on all links beyond it for a unit speed of the joint.

    Args:
        arm: the arm, with n joints.
        q: n joint positions.
        qd: n joint velocities.
        qdd: n joint accelerations.
    """
    n = arm.n
    Y: Matrix = [[0.0] * ((OF_LINK + OF_DRIVE) * n) for _ in range(n)]
    steps = joint_steps(arm, q)
    # The velocities of a link, at the joint point, for unit velocities of the joints up to its own.
    unit: list[tuple[Vector, Vector]] = []
    for k, (joint, step, motion) in enumerate(zip(arm.joints, steps, joint_motions(arm, steps, qd, qdd), strict=True)):
        unit = [(step.inward_axes(w), step.inward_axes(add(v, cross(w, step.lever)))) for w, v in unit]
        still, along = [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]
        unit.append((along, still) if joint.revolute else (still, along))
        R, lever = joint.behind[:3, :3].tolist(), lever_behind(joint)
        wrenches = _unit_wrenches(motion, transpose(R), lever)
        for i, (w, v) in enumerate(unit):
            turning, moving = apply(transpose(R), w), apply(transpose(R), add(v, cross(w, lever)))
            columns = [dot(moving, force) + dot(turning, moment) for force, moment in wrenches]
            Y[i][OF_LINK * k : OF_LINK * (k + 1)] = columns
    for i, (speed, acceleration) in enumerate(zip(qd, qdd, strict=True)):
        first = OF_LINK * n + OF_DRIVE * i
        forward, backward = select(speed > 0, 1.0, 0.0), select(speed < 0, -1.0, 0.0)
        Y[i][first : first + OF_DRIVE] = [acceleration, speed, forward, backward]
    return Y


def _unit_wrenches(motion: JointMotion, to_link: Matrix, lever: Vector) -> list[tuple[Vector, Vector]]:
    """Return force and moment, at the origin and along the axes of the link's frame, for a unit of each parameter.

    Args:
        motion: of the link.
        to_link: rotation from the axes of the joint to those of the link.
        lever: from the joint point to the origin of the link's frame, along the axes of the joint.
    """
    w, w_dot = apply(to_link, motion.w), apply(to_link, motion.w_dot)
    v_dot = apply(to_link, add(motion.v_dot, apply(motion.U, lever)))
    still = [0.0, 0.0, 0.0]
    wrenches = [(v_dot, still)]
    wrenches += zip(transpose(point_accelerations(w, w_dot)), (cross(axis, v_dot) for axis in _AXES), strict=True)
    for pair in _PAIRS:
        wrenches.append((still, add(_unit_tensor_times(pair, w_dot), cross(w, _unit_tensor_times(pair, w)))))
    return wrenches


def _unit_tensor_times(pair: tuple[int, int], x: Vector) -> Vector:
    """Return I x, for the symmetric tensor I of which one number is 1, with its mirror image, and all others are 0."""
    a, b = pair
    return [x[b] if i == a else x[a] if i == b else 0.0 for i in range(3)]
