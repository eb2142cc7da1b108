"""The regressor: efforts as linear functions of the masses, inertias and drives of an arm."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from armwright.arm.drive import Motor, Spring
from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike
from armwright.dynamics.arguments import Scalars, batch, stack_matrix, weighed
from armwright.dynamics.bodies import body_of
from armwright.dynamics.drives import FrictionLaw, drive_rates, joint_friction_law, unit_cube_root_friction
from armwright.dynamics.joint_frames import joint_steps, lever_behind
from armwright.dynamics.newton_euler import JointMotion, joint_motions, point_accelerations
from armwright.tracing.scalar import Scalar, select
from armwright.tracing.vectors import Matrix, Vector, add, apply, cross, dot, transpose

_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
# The six numbers of an inertia tensor, in their order.
_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
# How many parameters a link has, and the parameters of every joint.
OF_LINK = 10
_OF_JOINT = ("rotor", "viscous", "forward", "backward")
_OF_SPRING = ("stiffness", "preload")


def regressor(arm: Arm, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Array:
    """Return the regressor Y of a motion: tau = Y theta, with the parameters of ``dynamic_parameters``.

    It depends on the geometry of the arm and on gravity, but not on its masses, inertias and drives.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        qd: (..., n) joint velocities.
        qdd: (..., n) joint accelerations.

    Returns:
        Y: (..., n, p), one column for each of the p parameters, 14 n for most arms.

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
    of that frame, not about c [kg m²]. Behind those of all links, for each drive: the rotor inertia, viscous friction,
    and the magnitudes of Coulomb friction in and against the direction of q, as in ``Motor``. Where any joint of the
    arm has them, each joint has its offset, its Stribeck friction (for its ``stribeck_speed``), its friction by the
    cube root of the velocity, and of its spring the stiffness k and k times the position of rest as well, in this
    order: see ``joint_parameters``.

    Args:
        arm: the arm, with n joints.

    Returns:
        theta: (p,), 14 n parameters of an arm that has none of these.

    Raises:
        KindError: ``arm`` is no arm.
        UnsupportedArmError: the mass of a link is unknown.
    """
    bodies = [body_of(link) for link in weighed(arm).links]
    links = [[body.mass, *body.moment, *(body.tensor[a][b] for a, b in _PAIRS)] for body in bodies]
    names = joint_parameters(arm)
    drives = [
        [_of_joint(motor, joint.spring)[name] for name in names]
        for motor, joint in zip(arm.motors, arm.joints, strict=True)
    ]
    return np.array([x for part in (*links, *drives) for x in part], dtype=np.float64)


def joint_parameters(arm: Arm) -> tuple[str, ...]:
    """Return the names of the parameters of each joint, in their order: ``rotor``, ``viscous`` and so on."""
    terms = {
        "offset": any(motor.offset for motor in arm.motors),
        "stribeck": any(motor.stribeck_speed for motor in arm.motors),
        "cube_root": any(motor.cube_root for motor in arm.motors),
        "stiffness": any(joint.spring.stiffness for joint in arm.joints),
        "preload": any(joint.spring.stiffness for joint in arm.joints),
    }
    return (*_OF_JOINT, *(name for name, is_there in terms.items() if is_there))


def parameter_count(arm: Arm) -> int:
    """Return how many parameters ``dynamic_parameters`` has."""
    return (OF_LINK + len(joint_parameters(arm))) * arm.n


def _of_joint(motor: Motor, spring: Spring) -> dict[str, float]:
    return {
        "rotor": motor.inertia,
        "viscous": motor.viscous,
        "forward": motor.coulomb_forward,
        "backward": motor.coulomb_backward,
        "offset": motor.offset,
        "stribeck": motor.stribeck,
        "cube_root": motor.cube_root,
        "stiffness": spring.stiffness,
        "preload": spring.stiffness * spring.rest,
    }


def effort_regressor(arm: Arm, q: Scalars, qd: Scalars, qdd: Scalars) -> Matrix:
    """Return the regressor, n x p, over abstract scalars.

    The effort of a joint is the power of the wrenches on all links beyond it for a unit speed of the joint.

    Args:
        arm: the arm, with n joints.
        q: n joint positions.
        qd: n joint velocities.
        qdd: n joint accelerations.
    """
    n = arm.n
    names = joint_parameters(arm)
    Y: Matrix = [[0.0] * parameter_count(arm) for _ in range(n)]
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
    # A drive acts on joint i with weight T_ki, where m' = T q'; its spring is at the joint itself.
    weights = np.eye(n) if arm.coupling is None else arm.coupling.inverse
    drives = zip(arm.motors, q, drive_rates(arm, qd), drive_rates(arm, qdd), strict=True)
    for k, (motor, *state) in enumerate(drives):
        for name, effort in zip(names, _joint_columns(motor, state, names), strict=True):
            column = OF_LINK * n + len(names) * k + names.index(name)
            if name in _OF_SPRING:
                Y[k][column] = effort
                continue
            for i in np.flatnonzero(weights[k]).tolist():
                weight = float(weights[k, i])
                Y[i][column] = effort if weight == 1 else weight * effort
    return Y


def _joint_columns(motor: Motor, state: Scalars, names: Sequence[str]) -> list[Scalar]:
    """Return the effort of a joint or its drive for a unit of each of its parameters.

    Args:
        motor: the drive.
        state: position of the joint, velocity and acceleration of the drive.
        names: of the parameters.
    """
    q, qd, qdd = state
    forward, backward = select(qd > 0, 1.0, 0.0), select(qd < 0, -1.0, 0.0)
    known: dict[str, Scalar] = {"rotor": qdd, "viscous": qd, "forward": forward, "backward": backward}
    others: dict[str, Callable[[], Scalar]] = {
        "offset": lambda: 1.0,
        "stribeck": lambda: _unit_stribeck(motor).dry(qd, qd),
        "cube_root": lambda: unit_cube_root_friction(qd),
        "stiffness": lambda: q,
        "preload": lambda: -1.0,
    }
    return [known[name] if name in known else others[name]() for name in names]


def _unit_stribeck(motor: Motor) -> FrictionLaw:
    """Return the law of a joint that has nothing but Stribeck friction, 1 at break-away; without a speed, nothing."""
    speed = motor.stribeck_speed
    return joint_friction_law(Motor(stribeck=1.0 if speed else 0.0, stribeck_speed=speed))


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
