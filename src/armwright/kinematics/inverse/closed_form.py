"""Closed-form inverse kinematics of arms with a spherical wrist: PUMA-like and Stanford-like."""

import math

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, joint_array, of_shape
from armwright.errors import InvalidValueError, UnsupportedArmError
from armwright.kinematics.forward import forward, link_frames, per_joint, stack
from armwright.kinematics.inverse.shoulder import Shoulder, Sign, first_three, nearest_wrist, shoulder_of
from armwright.kinematics.inverse.solution import Answer, Branch, InverseSolution, violations
from armwright.kinematics.inverse.wrist import last_three
from armwright.spatial.poses import inverse as inverse_pose
from armwright.spatial.poses import pose
from armwright.spatial.rotations import angle_between, nearest_rotation, orthonormality_error
from armwright.tracing.vectors import product, transpose

_SIGNS: tuple[Sign, Sign] = (1, -1)
# The order of the branches: arm, elbow (or slide), wrist.
BRANCHES: tuple[tuple[Sign, Sign, Sign], ...] = tuple((a, e, w) for a in _SIGNS for e in _SIGNS for w in _SIGNS)

# A pose typed with a few digits is turned into a rotation up to this error; beyond it is a mistake.
_TYPED_ROTATION = 2e-2
# A place this far outside counts as the edge of the reach: six typed digits of a metre [m].
_EDGE = 2e-6
# Joint positions closer than this are one posture met twice.
_SAME_POSTURE = 1e-9


def inverse_branches(arm: Arm, X_BT: ArrayLike, near: ArrayLike | None = None) -> tuple[Array, Array]:
    """Return all eight postures of many poses at once, unjudged.

    Args:
        arm: a PUMA-like or Stanford-like arm of 6 joints.
        X_BT: (..., 4, 4) tool poses in the base frame.
        near: (..., 6) joint positions; angles come back within half a turn of it, and a free joint 4 takes its
            value from it; the middle of the limits when left out.

    Returns:
        q: (..., 8, 6) joint positions, branches in the order of ``BRANCHES``. A pose out of reach gives the
            posture that stretches towards it.
        singular: (..., 8) whether the wrist is singular there.

    Raises:
        UnsupportedArmError: the arm is neither PUMA-like nor Stanford-like.
        ShapeError: a shape does not fit.
    """
    shoulder = _shoulder(arm)
    X_06 = inverse_pose(arm.base) @ of_shape(X_BT, (4, 4), "pose") @ inverse_pose(arm.tool)
    reference = joint_array(_middle(arm) if near is None else near, arm.n, "near")
    lead = np.broadcast_shapes(X_06.shape[:-2], reference.shape[:-1])
    X_06 = np.broadcast_to(X_06, (*lead, 4, 4))
    reference = np.broadcast_to(reference, (*lead, arm.n))
    fixed = [joint.theta if joint.revolute else joint.d for joint in arm.joints]
    R_06 = [per_joint(X_06[..., i, :3]) for i in range(3)]
    p_wrist = per_joint(X_06[..., :3, 3] - shoulder.hand * X_06[..., :3, 2])
    theta_4_free = reference[..., 3] + fixed[3]
    found, loose = [], []
    for side, elbow, flip in BRANCHES:
        first = [v - f for v, f in zip(first_three(shoulder, p_wrist, side, elbow), fixed[:3], strict=True)]
        R_B3, _ = link_frames(arm, first)[-1]
        R_03 = product(transpose(arm.base[:3, :3].tolist()), R_B3)
        last, singular = last_three(product(transpose(R_03), R_06), flip, theta_4_free)
        last = [v - f for v, f in zip(last, fixed[3:], strict=True)]
        found.append(stack([*first, *last], lead))
        loose.append(np.broadcast_to(np.asarray(singular), lead))
    q = _nearest_turn(arm, np.stack(found, axis=-2), reference[..., None, :])
    return q, np.stack(loose, axis=-1)


def inverse(arm: Arm, X_BT: ArrayLike, near: ArrayLike | None = None) -> InverseSolution:
    """Return every posture that puts the tool at one pose, judged and sorted.

    Args:
        arm: a PUMA-like or Stanford-like arm of 6 joints.
        X_BT: (4, 4) tool pose in the base frame; a rotation typed with few digits is made one.
        near: (6,) the present joint positions: of the images of an angle the nearest allowed one is taken, and
            branches come nearest first; the middle of the limits when left out.

    Returns:
        The branches, each labelled, with its limit violations and its residual, and the answer on the whole.

    Raises:
        UnsupportedArmError: the arm is neither PUMA-like nor Stanford-like.
        ShapeError: a shape does not fit.
        InvalidValueError: the rotation part is no rotation, not even one typed with two digits.

    Source:
        Paul (1981) ch. 3; spec of this project, mechanics §3.2.
    """
    shoulder = _shoulder(arm)
    X = _clean_pose(X_BT)
    reference = joint_array(_middle(arm) if near is None else near, arm.n, "near")
    X_near = _nearest_pose(arm, shoulder, X)
    distance = float(np.linalg.norm(X_near[:3, 3] - X[:3, 3]))
    in_reach = distance <= _EDGE
    postures, singular = inverse_branches(arm, X_near, reference)
    branches: list[Branch] = []
    for q, loose, signs in zip(postures, singular, BRANCHES, strict=True):
        q = nearest_image(arm, q, reference)  # noqa: PLW2901
        if any(np.abs(q - other.q).max() < _SAME_POSTURE for other in branches):
            continue
        X_q = forward(arm, q)
        branches.append(
            Branch(
                q=q,
                label=label(shoulder, signs),
                violations=violations(arm, q),
                free=(4, 6) if loose else (),
                position_error=float(np.linalg.norm(X_q[:3, 3] - X[:3, 3])),
                rotation_error=float(angle_between(X[:3, :3], X_q[:3, :3])),
            )
        )
    branches.sort(key=lambda branch: (not branch.allowed, travel(arm, reference, branch.q)))
    allowed = [branch for branch in branches if branch.allowed]
    if not in_reach:
        answer = Answer.OUT_OF_REACH
    elif not allowed:
        answer = Answer.OUT_OF_LIMITS
    else:
        answer = Answer.SINGULAR if all(branch.free for branch in allowed) else Answer.SOLVED
    return InverseSolution(
        arm=arm,
        answer=answer,
        branches=tuple(branches),
        distance=0.0 if in_reach else distance,
        nearest_pose=X if in_reach else X_near,
    )


def travel(arm: Arm, q_from: ArrayLike, q_to: ArrayLike) -> float:
    """Return how far apart two postures are: the root of the summed squares of each joint's time at top speed."""
    speed = arm.limit("speed")
    weight = 1.0 / np.where(np.isfinite(speed), speed, 1.0)
    return float(np.linalg.norm((joint_array(q_to, arm.n) - joint_array(q_from, arm.n)) * weight))


def nearest_image(arm: Arm, q: ArrayLike, near: ArrayLike) -> Array:
    """Return ``q`` (n,) with every angle turned by whole turns to the image inside the limits nearest to ``near``.

    An angle with no image inside the limits takes the one that passes its limit least.
    """
    starts = joint_array(near, arm.n, "near").tolist()
    return np.array([min(turns, key=lambda x: abs(x - x0)) for turns, x0 in zip(_images(arm, q), starts, strict=True)])


def images(arm: Arm, q: ArrayLike) -> Array:
    """Return all images of one posture by whole turns that are inside the limits, (k, n); k is 0 if none is."""
    rows = np.stack(np.meshgrid(*_images(arm, q), indexing="ij"), axis=-1).reshape(-1, arm.n)
    inside = [row for row in rows if not violations(arm, row)]
    return np.array(inside).reshape(len(inside), arm.n)


def label(shoulder: Shoulder, signs: tuple[Sign, Sign, Sign]) -> str:
    """Name a branch: arm, elbow or slide, wrist."""
    side, elbow, flip = signs
    words = ("up", "down") if shoulder.family == "puma" else ("out", "back")
    # PUMA: with the arm to the left, elbow above and elbow below change places.
    above = side * elbow > 0 if shoulder.family == "puma" else elbow > 0
    return ", ".join(
        ("left" if side > 0 else "right", words[0] if above else words[1], "no-flip" if flip > 0 else "flip")
    )


def _shoulder(arm: Arm) -> Shoulder:
    shoulder = shoulder_of(arm)
    if shoulder is None:
        raise UnsupportedArmError(
            f"arm '{arm.name}': no closed-form inverse kinematics; expected an arm built like puma560 or stanford "
            "(6 joints, spherical wrist)"
        )
    return shoulder


def _clean_pose(X_BT: ArrayLike) -> Array:
    X = of_shape(X_BT, (4, 4), "pose")
    error = float(orthonormality_error(X[:3, :3]))
    if X.shape != (4, 4) or error > _TYPED_ROTATION:
        raise InvalidValueError(
            f"pose: expected one (4, 4) pose whose rotation is orthonormal to {_TYPED_ROTATION}, "
            f"got shape {X.shape}, error {error:.3g}"
        )
    return pose(nearest_rotation(X[:3, :3]), X[:3, 3])


def _nearest_pose(arm: Arm, shoulder: Shoulder, X_BT: Array) -> Array:
    """Return X_BT moved, not turned, so that the wrist centre comes into reach."""
    X_06 = inverse_pose(arm.base) @ X_BT @ inverse_pose(arm.tool)
    p_wrist = X_06[:3, 3] - shoulder.hand * X_06[:3, 2]
    shift = np.array(nearest_wrist(shoulder, p_wrist.tolist())) - p_wrist
    X = X_BT.copy()
    X[:3, 3] += arm.base[:3, :3] @ shift
    return X


def _middle(arm: Arm) -> Array:
    lower, upper = arm.limit("lower"), arm.limit("upper")
    bounded = np.isfinite(lower) & np.isfinite(upper)
    return np.where(bounded, (np.where(bounded, lower, 0) + np.where(bounded, upper, 0)) / 2, 0.0)


def _nearest_turn(arm: Arm, q: Array, near: Array) -> Array:
    """Turn angles by whole turns to within half a turn of ``near``."""
    revolute = np.array([joint.revolute for joint in arm.joints])
    turns = np.round((near - q) / (2 * math.pi))
    return np.asarray(np.where(revolute, q + 2 * math.pi * turns, q))


def _images(arm: Arm, q: ArrayLike) -> list[list[float]]:
    """List, joint by joint, the images inside the limits; where there is none, the one least outside."""
    turn = 2 * math.pi
    result = []
    for joint, value in zip(arm.joints, joint_array(q, arm.n).tolist(), strict=True):
        lower, upper = joint.limits.lower, joint.limits.upper
        if not joint.revolute or not (math.isfinite(lower) and math.isfinite(upper)):
            result.append([value])
            continue
        slack = 1e-9
        first, last = math.ceil((lower - slack - value) / turn), math.floor((upper + slack - value) / turn)
        least = value + turn * round(((lower + upper) / 2 - value) / turn)
        result.append([value + k * turn for k in range(first, last + 1)] or [least])
    return result
