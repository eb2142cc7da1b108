"""Inverse kinematics: in closed form where the arm has one, else step by step; ranked."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import known_arm, positions, single_configuration
from armwright.arrays import Array, ArrayLike, Flags, leading_axes
from armwright.kinematics.forward_kinematics import per_joint, stack
from armwright.kinematics.inverse_kinematics.branches import BRANCHES, Branches, branches, merged, single_branch
from armwright.kinematics.inverse_kinematics.candidates import POSE_TOLERANCE, Candidate, exact_pose, rank, typed_poses
from armwright.kinematics.inverse_kinematics.geometry import ClosedFormGeometry, Signs, rotated_about_y
from armwright.kinematics.inverse_kinematics.numeric import numeric_inverse
from armwright.kinematics.inverse_kinematics.reach import nearest_wrist_centre
from armwright.kinematics.inverse_kinematics.recognise import closed_form_geometry, find_geometry
from armwright.kinematics.inverse_kinematics.revolutions import mid_range, nearest_equivalent
from armwright.kinematics.inverse_kinematics.self_motion import counter_rotate_within_limits, search_within_limits
from armwright.kinematics.inverse_kinematics.solution import InverseSolution, violations
from armwright.tracing.scalar import select

# Joint positions closer than this are the same configuration.
_SAME_CONFIGURATION = 1e-9
# Which joints move together, from 1, where a choice is left open: the turn of joint 1, the raising of joint 2, the
# wrist; and the joint that then chooses.
_FREE = {"spherical": ((1, 4, 5, 6), (2, 4, 5, 6), (4, 6)), "parallel": ((1, 2, 3, 4, 5, 6), (2, 4), (2, 3, 4, 6))}
_CHOOSERS = {"spherical": (1, 2, 4), "parallel": (1, 2, 6)}


def inverse_branches(arm: Arm, X_BT: ArrayLike, near: ArrayLike | None = None) -> tuple[Array, Flags]:
    """Return all eight IK branches of many poses at once, without ranking them.

    Args:
        arm: an arm of 6 joints with a closed form: see ``find_geometry``.
        X_BT: (..., 4, 4) tool poses in the base frame.
        near: (..., 6) joint positions; angles come back within 180 deg of it, and a free joint takes its
            value from it; the middle of the limits when left out.

    Returns:
        q: (..., 8, 6) joint positions, branches in the order of ``BRANCHES``. Where a pose has some of them only, the
            others repeat the first that it has; a pose out of reach gives the configurations that stretch towards it.
        singular: (..., 8) whether a joint is free there.

    Raises:
        KindError: ``arm`` is no arm, or an array something else than real numbers.
        UnsupportedArmError: the arm has no closed form.
        ShapeError: a shape does not fit.
        InvalidValueError: a number is not finite, or a pose none.
    """
    geometry = closed_form_geometry(known_arm(arm))
    X_BT, near = typed_poses(X_BT), mid_range(arm) if near is None else positions(arm, near, "near")
    lead, solutions = _branches(arm, geometry, X_BT, near)
    q, singular = merged(solutions)
    return np.stack([stack(row, lead) for row in q], axis=-2), stack(singular, lead) > 0


def inverse(arm: Arm, X_BT: ArrayLike, near: ArrayLike | None = None) -> InverseSolution:
    """Return the configurations that put the tool at one pose, ranked.

    With a closed form, see ``find_geometry``, these are all there are. Any other arm is solved step by step from many
    starting configurations, see ``numeric_inverse``.

    Args:
        arm: any arm, with n joints.
        X_BT: (4, 4) tool pose in the base frame; a rotation typed with few digits is made one.
        near: (n,) the present joint positions: an angle is wrapped to the nearest value inside its limits, and
            branches come nearest first; the middle of the limits when left out.

    Returns:
        The branches, each labelled, with its limit violations and its residual, and the outcome on the whole.

    Raises:
        KindError: ``arm`` is no arm, or an array something else than real numbers.
        ShapeError: a shape does not fit.
        InvalidValueError: a number is not finite, or the pose is none, not even one typed with two digits.

    Source:
        Paul (1981) ch. 3; Hawkins (2013) for three parallel axes; spec of this project, mechanics §3.2.
    """
    X = exact_pose(X_BT)
    reference = mid_range(known_arm(arm)) if near is None else single_configuration(arm, near, "near")
    geometry = find_geometry(arm)
    return numeric_inverse(arm, X, reference) if geometry is None else _closed(arm, geometry, X, reference)


def label(geometry: ClosedFormGeometry, signs: Signs, angles: Array | Sequence[float]) -> str:
    """Name a branch: arm, elbow or slide, wrist.

    The elbow is up where it is above the line from joint 2 to the end of the forearm, above as the axis of joint 1
    points. The wrist of a ``parallel`` arm is up where the angle 5 of its build is positive.
    """
    side, second, flip = signs
    arm = "left" if side > 0 else "right"
    if geometry.family == "stanford":
        return f"{arm}, {'out' if second > 0 else 'back'}, {'no-flip' if flip > 0 else 'flip'}"
    upper, _ = rotated_about_y(angles[1], geometry.upper_arm, 0.0)
    fore, _ = rotated_about_y(angles[1] + angles[2], *geometry.forearm)
    # With the wrist behind joint 2, as it is with the arm to the right, elbow above and elbow below change places.
    elbow = "up" if second * (upper + fore) > 0 else "down"
    if geometry.family == "parallel":
        return f"shoulder {arm}, elbow {elbow}, wrist {'up' if flip > 0 else 'down'}"
    return f"{arm}, {elbow}, {'no-flip' if flip > 0 else 'flip'}"


def _branches(arm: Arm, geometry: ClosedFormGeometry, X_BT: Array, near: Array) -> tuple[tuple[int, ...], Branches]:
    """Return the leading axes that poses (..., 4, 4) and joint positions (..., 6) share, and the branches."""
    lead = leading_axes("pose, near", (X_BT, near), (X_BT.shape[:-2], near.shape[:-1]))
    X_BT, near = np.broadcast_to(X_BT, (*lead, 4, 4)), np.broadcast_to(near, (*lead, arm.n))
    R = [per_joint(X_BT[..., i, :3]) for i in range(3)]
    return lead, branches(arm, geometry, R, per_joint(X_BT[..., :3, 3]), per_joint(near))


def _configurations(arm: Arm, geometry: ClosedFormGeometry, X_BT: Array, near: Array) -> tuple[Array, Array, Array]:
    """Return eight configurations (..., 8, 6), which choices are free (..., 8, 3), and reach errors (..., 8) [m]."""
    lead, solutions = _branches(arm, geometry, X_BT, near)
    free = [stack([select(choice, 1.0, 0.0) for choice in choices], lead) > 0 for choices in solutions.free]
    q = np.stack([stack(each, lead) for each in solutions.q], axis=-2)
    return q, np.stack(free, axis=-2), stack(solutions.reach_error, lead)


def _closed(arm: Arm, geometry: ClosedFormGeometry, X: Array, near: Array) -> InverseSolution:
    target, X_near = X, None
    configurations, free, errors = _configurations(arm, geometry, X, near)
    if errors.min() > POSE_TOLERANCE:
        target = _nearest_pose(geometry, X)
        configurations, free, errors = _configurations(arm, geometry, target, near)
        X_near = target if np.linalg.norm(target[:3, 3] - X[:3, 3]) > POSE_TOLERANCE else None
    kind = "parallel" if geometry.family == "parallel" else "spherical"
    candidates = []
    for i in np.flatnonzero(errors <= max(POSE_TOLERANCE, errors.min())):
        q = nearest_equivalent(arm, configurations[i], near)
        together = [joints for joints, is_free in zip(_FREE[kind], free[i], strict=True) if is_free]
        moving = {joint for joints in together for joint in joints}
        choosers = [joint for joint, is_free in zip(_CHOOSERS[kind], free[i], strict=True) if is_free]
        members = partial(_members, arm, geometry, target, int(i))
        for joint in choosers:
            outside = {fault.joint for fault in violations(arm, q)}
            # A joint outside its limits that does not move with the free one stays there, whatever that does.
            if not outside or outside - moving:
                break
            if kind == "spherical" and joint == _CHOOSERS[kind][-1] and len(together) == 1:
                q = counter_rotate_within_limits(arm, q, near, members, joint=joint, other=_FREE[kind][-1][-1])
            else:
                q = search_within_limits(arm, q, near, members, joint=joint)
        angles = np.array(geometry.angles(q.tolist()))
        candidates.append(Candidate(q, label(geometry, BRANCHES[i], angles), tuple(sorted(moving))))
    return rank(arm, X, candidates, near, apart=_SAME_CONFIGURATION, X_near=X_near)


def _members(arm: Arm, geometry: ClosedFormGeometry, X_BT: Array, branch: int, near: Array) -> Array:
    """Return the configurations (k, 6) of one branch near joint positions (k, 6), where a joint is free."""
    R = [X_BT[i, :3].tolist() for i in range(3)]
    return stack(single_branch(arm, geometry, R, X_BT[:3, 3].tolist(), per_joint(near), branch=branch), near.shape[:-1])


def _nearest_pose(geometry: ClosedFormGeometry, X_BT: Array) -> Array:
    """Return X_BT translated, not rotated, so that the wrist centre comes into reach."""
    R_BS, p_BS = geometry.X_BS[:3, :3], geometry.X_BS[:3, 3]
    R_ST = R_BS.T @ X_BT[:3, :3]
    p = R_BS.T @ (X_BT[:3, 3] - p_BS) + R_ST @ geometry.p_TW
    X = X_BT.copy()
    X[:3, 3] += R_BS @ (nearest_wrist_centre(geometry, p, R_ST @ geometry.R_T6) - p)
    return X
