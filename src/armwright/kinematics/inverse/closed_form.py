"""Inverse kinematics: in closed form where the arm has one, else step by step; judged and sorted."""

from functools import partial

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import known_arm, one_posture, positions
from armwright.arrays import Array, ArrayLike, Flags
from armwright.errors import ShapeError
from armwright.kinematics.forward import per_joint, stack
from armwright.kinematics.inverse.branches import BRANCHES, Branches, branches, merged, one_branch
from armwright.kinematics.inverse.family import moved_inside, turned_inside
from armwright.kinematics.inverse.judge import EDGE, Candidate, clean_pose, judge, typed_poses
from armwright.kinematics.inverse.numeric import numeric_inverse
from armwright.kinematics.inverse.reach import nearest_centre
from armwright.kinematics.inverse.recognise import closed_form_of, shoulder_of
from armwright.kinematics.inverse.shoulder import Shoulder, Sign, turned
from armwright.kinematics.inverse.solution import InverseSolution, violations
from armwright.kinematics.inverse.turns import middle, nearest_image
from armwright.tracing.scalar import select

# Joint positions closer than this are one posture met twice.
_SAME_POSTURE = 1e-9
# Which joints move together, from 1, where a choice is left open: the turn of joint 1, the raising of joint 2, the
# wrist; and the joint that then chooses.
_FREE = {
    "spherical": ((1, 4, 5, 6), (2, 4, 5, 6), (4, 6)),
    "parallel": ((1, 2, 3, 4, 5, 6), (2, 4), (2, 3, 4, 6)),
}
_CHOOSERS = {"spherical": (1, 2, 4), "parallel": (1, 2, 6)}


def inverse_branches(arm: Arm, X_BT: ArrayLike, near: ArrayLike | None = None) -> tuple[Array, Flags]:
    """Return all eight postures of many poses at once, unjudged.

    Args:
        arm: an arm of 6 joints with a closed form: see ``shoulder_of``.
        X_BT: (..., 4, 4) tool poses in the base frame.
        near: (..., 6) joint positions; angles come back within half a turn of it, and a free joint takes its
            value from it; the middle of the limits when left out.

    Returns:
        q: (..., 8, 6) joint positions, branches in the order of ``BRANCHES``. Where a pose has some of them only, the
            others repeat the first that it has; a pose out of reach gives the postures that stretch towards it.
        singular: (..., 8) whether a joint is free there.

    Raises:
        KindError: ``arm`` is no arm, or an array something else than real numbers.
        UnsupportedArmError: the arm has no closed form.
        ShapeError: a shape does not fit.
        InvalidValueError: a number is not finite, or a pose none.
    """
    shoulder = closed_form_of(known_arm(arm))
    X_BT, near = typed_poses(X_BT), middle(arm) if near is None else positions(arm, near, "near")
    lead, found = _branches(arm, shoulder, X_BT, near)
    q, singular = merged(found)
    return np.stack([stack(row, lead) for row in q], axis=-2), stack(singular, lead) > 0


def inverse(arm: Arm, X_BT: ArrayLike, near: ArrayLike | None = None) -> InverseSolution:
    """Return the postures that put the tool at one pose, judged and sorted.

    With a closed form, see ``shoulder_of``, these are all there are. Any other arm is solved step by step from many
    starting postures, see ``numeric_inverse``.

    Args:
        arm: any arm, with n joints.
        X_BT: (4, 4) tool pose in the base frame; a rotation typed with few digits is made one.
        near: (n,) the present joint positions: of the images of an angle the nearest allowed one is taken, and
            branches come nearest first; the middle of the limits when left out.

    Returns:
        The branches, each labelled, with its limit violations and its residual, and the answer on the whole.

    Raises:
        KindError: ``arm`` is no arm, or an array something else than real numbers.
        ShapeError: a shape does not fit.
        InvalidValueError: a number is not finite, or the pose is none, not even one typed with two digits.

    Source:
        Paul (1981) ch. 3; Hawkins (2013) for three parallel axes; spec of this project, mechanics §3.2.
    """
    X = clean_pose(X_BT)
    reference = middle(known_arm(arm)) if near is None else one_posture(arm, near, "near")
    shoulder = shoulder_of(arm)
    return numeric_inverse(arm, X, reference) if shoulder is None else _closed(arm, shoulder, X, reference)


def label(shoulder: Shoulder, signs: tuple[Sign, Sign, Sign], angles: Array) -> str:
    """Name a branch: arm, elbow or slide, wrist.

    The elbow is up where it is above the line from joint 2 to the end of the forearm, above as the axis of joint 1
    points. The wrist of a ``parallel`` arm is up where the angle 5 of its build is positive.
    """
    side, second, flip = signs
    arm = "left" if side > 0 else "right"
    if shoulder.family == "stanford":
        return f"{arm}, {'out' if second > 0 else 'back'}, {'no-flip' if flip > 0 else 'flip'}"
    upper, _ = turned(angles[1], shoulder.upper, 0.0)
    fore, _ = turned(angles[1] + angles[2], *shoulder.fore)
    # With the wrist behind joint 2, as it is with the arm to the right, elbow above and elbow below change places.
    elbow = "up" if second * (upper + fore) > 0 else "down"
    if shoulder.family == "parallel":
        return f"shoulder {arm}, elbow {elbow}, wrist {'up' if flip > 0 else 'down'}"
    return f"{arm}, {elbow}, {'no-flip' if flip > 0 else 'flip'}"


def _branches(arm: Arm, shoulder: Shoulder, X_BT: Array, near: Array) -> tuple[tuple[int, ...], Branches]:
    """Return the leading axes that poses (..., 4, 4) and places of the arm (..., 6) share, and the postures."""
    try:
        lead = np.broadcast_shapes(X_BT.shape[:-2], near.shape[:-1])
    except ValueError as error:
        raise ShapeError(
            f"pose, near: leading axes must fit together, got shapes {X_BT.shape} and {near.shape}"
        ) from error
    X_BT, near = np.broadcast_to(X_BT, (*lead, 4, 4)), np.broadcast_to(near, (*lead, arm.n))
    R = [per_joint(X_BT[..., i, :3]) for i in range(3)]
    return lead, branches(arm, shoulder, R, per_joint(X_BT[..., :3, 3]), per_joint(near))


def _postures(arm: Arm, shoulder: Shoulder, X_BT: Array, near: Array) -> tuple[Array, Array, Array]:
    """Return the eight postures (..., 8, 6), which of three choices are free (..., 8, 3), and misses (..., 8) [m]."""
    lead, found = _branches(arm, shoulder, X_BT, near)
    free = [stack([select(choice, 1.0, 0.0) for choice in choices], lead) > 0 for choices in found.free]
    return np.stack([stack(q, lead) for q in found.q], axis=-2), np.stack(free, axis=-2), stack(found.miss, lead)


def _closed(arm: Arm, shoulder: Shoulder, X: Array, near: Array) -> InverseSolution:
    target, X_near = X, None
    postures, free, miss = _postures(arm, shoulder, X, near)
    if miss.min() > EDGE:
        target = _nearest_pose(shoulder, X)
        postures, free, miss = _postures(arm, shoulder, target, near)
        X_near = target if np.linalg.norm(target[:3, 3] - X[:3, 3]) > EDGE else None
    kind = "parallel" if shoulder.family == "parallel" else "spherical"
    candidates = []
    for i in np.flatnonzero(miss <= max(EDGE, miss.min())):
        q = nearest_image(arm, postures[i], near)
        together = [joints for joints, is_free in zip(_FREE[kind], free[i], strict=True) if is_free]
        moving = {joint for joints in together for joint in joints}
        choosers = [joint for joint, is_free in zip(_CHOOSERS[kind], free[i], strict=True) if is_free]
        members = partial(_members, arm, shoulder, target, int(i))
        for joint in choosers:
            outside = {fault.joint for fault in violations(arm, q)}
            # A joint outside its limits that does not move with the free one stays there, whatever that does.
            if not outside or outside - moving:
                break
            if kind == "spherical" and joint == _CHOOSERS[kind][-1] and len(together) == 1:
                q = turned_inside(arm, q, near, members, joint=joint, other=_FREE[kind][-1][-1])
            else:
                q = moved_inside(arm, q, near, members, joint=joint)
        angles = np.array(shoulder.angles(q.tolist()))
        candidates.append(Candidate(q, label(shoulder, BRANCHES[i], angles), tuple(sorted(moving))))
    return judge(arm, X, candidates, near, apart=_SAME_POSTURE, X_near=X_near)


def _members(arm: Arm, shoulder: Shoulder, X_BT: Array, branch: int, near: Array) -> Array:
    """Return the postures (k, 6) of one branch that places of the arm (k, 6) lead to, where a joint is free."""
    R = [X_BT[i, :3].tolist() for i in range(3)]
    return stack(one_branch(arm, shoulder, R, X_BT[:3, 3].tolist(), per_joint(near), branch=branch), near.shape[:-1])


def _nearest_pose(shoulder: Shoulder, X_BT: Array) -> Array:
    """Return X_BT moved, not turned, so that the wrist centre comes into reach."""
    R_BS, p_BS = shoulder.X_BS[:3, :3], shoulder.X_BS[:3, 3]
    R_ST = R_BS.T @ X_BT[:3, :3]
    p = R_BS.T @ (X_BT[:3, 3] - p_BS) + R_ST @ shoulder.p_TW
    X = X_BT.copy()
    X[:3, 3] += R_BS @ (nearest_centre(shoulder, p, R_ST @ shoulder.R_T6) - p)
    return X
