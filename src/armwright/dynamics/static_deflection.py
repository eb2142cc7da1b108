"""Static deflection of an arm whose joints yield about three axes: its own and the two lateral ones.

The axes of a joint are those of its frame on the link before it, frame i-1: z is the axis of the joint, and about x and
y bend its bearing and the link before it. A joint yields about x, then y, then z, each by its compliance times the load
about that axis, which is what weight, payload and wrench of all that is behind the joint make there. A prismatic joint
yields along z and about x and y. Loads and deflections depend on each other: they are iterated to the equilibrium.

Source:
    Judd & Knasinski (1990) for springs at joints.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import positions
from armwright.arrays import Array, ArrayLike, exact_shape, floats
from armwright.dynamics.arguments import weighed
from armwright.errors import InvalidValueError, ShapeError
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.jacobians import jacobian
from armwright.spatial.rotations import rotation_vector

_MAX_ITERATIONS = 100
# Iterations end when no deflection changes by more [rad], [m].
_CONVERGED = 1e-12
# A joint that yields farther is none that springs back, or its compliance is in another unit [rad], [m].
_MAX_DEFLECTION = 0.5
# Corrections end when every tool is within this of its goal [m], [rad]; no joint moves farther in one of them.
_CORRECTED, _MAX_STEP, _MAX_CORRECTIONS = 1e-10, 0.1, 20
# Singular values below this part of the largest are taken for zero.
_RCOND = 1e-6


class StaticDeflection(NamedTuple):
    """An arm that yields at rest in m configurations.

    Attributes:
        joints: (m, n, 3) how far each joint yields about x, y and z of its frame [rad]; prismatic ones along z [m].
        loads: (m, n, 3) the load about each of these [N m]; of prismatic joints along z [N].
        tool: (m, 4, 4) pose of the tool.
        displacement: (m, 3) of the tool from where it is in the rigid arm [m].
        shares: (m, n) the part of the length of this displacement that each joint makes, to first order [m].
    """

    joints: Array
    loads: Array
    tool: Array
    displacement: Array
    shares: Array


class _Frames(NamedTuple):
    """Where the joints of a deflected arm are.

    Attributes:
        origins: (m, n, 3) of the joints [m].
        axes: (m, n, 3, 3) in rows, the three axes about which each yields.
        links: (m, n, 4, 4) frames of the links.
        tool: (m, 4, 4) its pose.
    """

    origins: Array
    axes: Array
    links: Array
    tool: Array


def joint_loads(
    arm: Arm,
    q: ArrayLike,
    *,
    payload: ArrayLike | None = None,
    wrench: ArrayLike | None = None,
    deflections: ArrayLike | None = None,
) -> Array:
    """Return the static loads about three axes of every joint: by weight, payload, wrench and springs at the joints.

    About the axis of a joint, it is the opposite of the effort that holds the arm: ``gravity_efforts``.

    Args:
        arm: with n joints.
        q: (m, n) joint positions [rad] or [m].
        payload: (4,) or (m, 4) mass and centre of mass in the frame of the tool [kg], [m]; none when left out.
        wrench: (6,) or (m, 6) force and moment on the tool, along the axes of the base [N], [N m]; none when left out.
        deflections: (m, n, 3) how far the joints have yielded [rad] or [m]; not at all when left out.

    Returns:
        (m, n, 3) moments about x, y and z of the frames of the joints [N m]; of prismatic joints the force along z [N].

    Raises:
        ShapeError: an array does not fit.
        InvalidValueError: a number is not finite, or a mass is negative.
    """
    configurations = np.atleast_2d(positions(weighed(arm), q))
    m, n = configurations.shape
    yielded = np.zeros((m, n, 3)) if deflections is None else exact_shape(deflections, (m, n, 3), "deflections")
    return _loads(arm, configurations, yielded, _frames(arm, configurations, yielded), _on_tool(m, payload, wrench))


def static_deflection(
    arm: Arm,
    compliance: ArrayLike,
    q: ArrayLike,
    *,
    payload: ArrayLike | None = None,
    wrench: ArrayLike | None = None,
) -> StaticDeflection:
    """Return where an arm comes to rest whose motors hold and whose joints yield.

    Args:
        arm: with n joints.
        compliance: (n, 3) of each joint about x, y and z of its frame, 0 where it is rigid [rad/(N m)]; of prismatic
            joints along z [m/N].
        q: (m, n) joint positions of the motors [rad] or [m].
        payload: see ``joint_loads``.
        wrench: see ``joint_loads``.

    Raises:
        ShapeError: an array does not fit.
        InvalidValueError: a number is not finite, a compliance or a mass is negative, a joint yields by more than
            0.5 rad or m, or the arm does not come to rest.
    """
    configurations = np.atleast_2d(positions(weighed(arm), q))
    m, n = configurations.shape
    C = exact_shape(compliance, (n, 3), "compliance")
    if C.min() < 0:
        raise InvalidValueError(f"compliance: expected numbers of 0 or more, got {C.min():g}")
    on_tool = _on_tool(m, payload, wrench)
    yielded = np.zeros((m, n, 3))
    for _ in range(_MAX_ITERATIONS):
        frames = _frames(arm, configurations, yielded)
        loads = _loads(arm, configurations, yielded, frames, on_tool)
        change = C * loads - yielded
        yielded = yielded + change
        if not np.abs(yielded).max(initial=0.0) <= _MAX_DEFLECTION:
            worst = int(np.unravel_index(np.abs(yielded).argmax(), yielded.shape)[1])
            raise InvalidValueError(
                f"{arm.joint_label(worst)} of {arm.name} yields by more than {_MAX_DEFLECTION} rad or m: is its "
                "stiffness in N m/rad or N/m, and are the loads right?"
            )
        if np.abs(change).max(initial=0.0) < _CONVERGED:
            break
    else:
        raise InvalidValueError(f"{arm.name} does not come to rest: its joints yield too far for its loads")
    rigid = _frames(arm, configurations, np.zeros((m, n, 3)))
    displacement = frames.tool[:, :3, 3] - rigid.tool[:, :3, 3]
    length = np.linalg.norm(displacement, axis=1, keepdims=True)
    direction = np.divide(displacement, length, out=np.zeros((m, 3)), where=length > 0)
    levers = rigid.tool[:, None, :3, 3] - rigid.origins
    moved = np.cross(rigid.axes, levers[:, :, None])
    slides = [not joint.revolute for joint in arm.joints]
    moved[:, slides, 2] = rigid.axes[:, slides, 2]
    shares = np.einsum("mnak,mna,mk->mn", moved, yielded, direction)
    return StaticDeflection(yielded, loads, frames.tool, displacement, shares)


class CompensatedPositions(NamedTuple):
    """Joint positions that bring the tool of an arm that yields to where that of the rigid arm is.

    Attributes:
        q: (m, n) positions of the motors [rad] or [m].
        residual: (m,) distance of the tool from its goal that remains; rounding where that can be reached [m].
    """

    q: Array
    residual: Array


def compensated_positions(
    arm: Arm,
    compliance: ArrayLike,
    q: ArrayLike,
    *,
    payload: ArrayLike | None = None,
    wrench: ArrayLike | None = None,
) -> CompensatedPositions:
    """Return joint positions at which the tool is at rest where the rigid arm has it in given ones.

    Arms of six joints or more reach its position and orientation, others its position, as near as they can.

    Args:
        arm: with n joints.
        compliance: see ``static_deflection``.
        q: (m, n) joint positions of the rigid arm [rad] or [m].
        payload: see ``joint_loads``.
        wrench: see ``joint_loads``.

    Raises:
        ShapeError: see ``static_deflection``.
        InvalidValueError: see ``static_deflection``.
    """
    there = np.atleast_2d(positions(weighed(arm), q))
    goals, rows = forward(arm, there), 6 if arm.n >= 6 else 3
    best, least = there, np.full(len(there), np.inf)
    for _ in range(_MAX_CORRECTIONS):
        tool = static_deflection(arm, compliance, there, payload=payload, wrench=wrench).tool
        error = np.hstack(
            [goals[:, :3, 3] - tool[:, :3, 3], rotation_vector(goals[:, :3, :3] @ tool[:, :3, :3].swapaxes(1, 2))]
        )[:, :rows]
        size = np.linalg.norm(error, axis=1)
        nearer = size < least
        best, least = np.where(nearer[:, None], there, best), np.fmin(size, least)
        if np.all(least < _CORRECTED):
            break
        inverse = np.linalg.pinv(jacobian(arm, there)[:, :rows], rcond=_RCOND)
        there = there + np.clip(np.einsum("mnr,mr->mn", inverse, error), -_MAX_STEP, _MAX_STEP)
    reached = static_deflection(arm, compliance, best, payload=payload, wrench=wrench).tool
    return CompensatedPositions(best, np.linalg.norm(goals[:, :3, 3] - reached[:, :3, 3], axis=1))


# ---- inside --------------------------------------------------------------------------------------------------------


def _on_tool(m: int, payload: ArrayLike | None, wrench: ArrayLike | None) -> tuple[Array, Array]:
    """Return payloads (m, 4) and wrenches (m, 6)."""
    body, push = (
        np.zeros((m, width)) if values is None else _one_or_each(values, m, width, name)
        for values, width, name in ((payload, 4, "payload"), (wrench, 6, "wrench"))
    )
    if m and body[:, 0].min() < 0:
        raise InvalidValueError(f"payload: expected a mass of 0 kg or more, got {body[:, 0].min():g}")
    return body, push


def _one_or_each(values: ArrayLike, m: int, width: int, name: str) -> Array:
    given = floats(values, name)
    if given.shape not in {(width,), (m, width)}:
        raise ShapeError(f"{name}: expected shape ({width},) or ({m}, {width}), got {given.shape}")
    return np.broadcast_to(given, (m, width))


def _frames(arm: Arm, q: Array, yielded: Array) -> _Frames:
    """Return the frames of an arm in configurations (m, n) whose joints yield by (m, n, 3)."""
    m, n = q.shape
    X = np.tile(arm.base, (m, 1, 1))
    origins, axes, links = np.empty((m, n, 3)), np.empty((m, n, 3, 3)), np.empty((m, n, 4, 4))
    for i, joint in enumerate(arm.joints):
        position = q[:, i] + yielded[:, i, 2]
        turn, slide = joint.theta + joint.revolute * position, joint.d + (not joint.revolute) * position
        if not joint.revolute:
            X = X @ _rotations(2, turn)
        origins[:, i] = X[:, :3, 3]
        for axis in range(2):
            axes[:, i, axis] = X[:, :3, axis]
            X = X @ _rotations(axis, yielded[:, i, axis])
        axes[:, i, 2] = X[:, :3, 2]
        if joint.revolute:
            X = X @ _rotations(2, turn)
        X[:, :3, 3] += X[:, :3, 2] * np.broadcast_to(slide, m)[:, None]
        X = links[:, i] = X @ joint.behind
    return _Frames(origins, axes, links, X @ arm.tool)


def _rotations(axis: int, angles: Array | float) -> Array:
    """Return rotations (m, 4, 4) or (4, 4) about an axis."""
    c, s = np.cos(angles), np.sin(angles)
    R = np.zeros((*np.shape(c), 4, 4))
    u, v = (axis + 1) % 3, (axis + 2) % 3
    R[..., axis, axis] = R[..., 3, 3] = 1.0
    R[..., u, u] = R[..., v, v] = c
    R[..., v, u], R[..., u, v] = s, -s
    return R


def _loads(arm: Arm, q: Array, yielded: Array, frames: _Frames, on_tool: tuple[Array, Array]) -> Array:
    """Return the loads (m, n, 3) in a deflected configuration."""
    R, p = frames.tool[:, :3, :3], frames.tool[:, :3, 3]
    payload, wrench = on_tool
    weight = payload[:, :1] * arm.gravity
    force = weight + wrench[:, :3]
    # Moments about the origin of the base, from the tool inwards.
    moment = np.cross(p + np.einsum("mij,mj->mi", R, payload[:, 1:]), weight) + np.cross(p, wrench[:, :3])
    moment = moment + wrench[:, 3:]
    loads = np.empty((*q.shape, 3))
    for i in reversed(range(arm.n)):
        link, joint = arm.links[i], arm.joints[i]
        weight = link.mass * arm.gravity
        force = force + weight
        moment = moment + np.cross(frames.links[:, i, :3, :3] @ link.com + frames.links[:, i, :3, 3], weight)
        about_joint = moment - np.cross(frames.origins[:, i], force)
        loads[:, i] = np.einsum("maj,mj->ma", frames.axes[:, i], about_joint)
        if not joint.revolute:
            loads[:, i, 2] = np.einsum("mj,mj->m", frames.axes[:, i, 2], force)
        loads[:, i, 2] -= joint.spring.stiffness * (q[:, i] + yielded[:, i, 2] - joint.spring.rest)
    return loads
