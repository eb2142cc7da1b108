"""Inverse kinematics: in closed form where the arm has one, else step by step; ranked."""

from __future__ import annotations

from functools import partial

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import known_arm, positions, single_configuration
from armwright.arrays import Array, ArrayLike, Flags, leading_axes
from armwright.errors import UnsupportedArmError
from armwright.kinematics.forward_kinematics import forward, per_joint, stack
from armwright.kinematics.inverse_kinematics.branches import Branches, ClosedForm, merged
from armwright.kinematics.inverse_kinematics.builds import OfBuild, wrist_pose
from armwright.kinematics.inverse_kinematics.candidates import (
    POSE_TOLERANCE,
    Candidate,
    exact_pose,
    pose_errors,
    rank,
    typed_poses,
)
from armwright.kinematics.inverse_kinematics.closed_forms import closed_form_of, find_closed_form
from armwright.kinematics.inverse_kinematics.decompositions import Scara
from armwright.kinematics.inverse_kinematics.every_solution import every_solution
from armwright.kinematics.inverse_kinematics.geometry import ClosedFormGeometry
from armwright.kinematics.inverse_kinematics.numeric import descend_from, free_joints, numeric_inverse
from armwright.kinematics.inverse_kinematics.reach import nearest_wrist_centre
from armwright.kinematics.inverse_kinematics.redundancy import Choice, checked_swivel, redundant_candidates
from armwright.kinematics.inverse_kinematics.redundant import Redundant
from armwright.kinematics.inverse_kinematics.revolutions import mid_range, nearest_equivalent
from armwright.kinematics.inverse_kinematics.self_motion import counter_rotate_within_limits, search_within_limits
from armwright.kinematics.inverse_kinematics.solution import InverseSolution, violations
from armwright.tracing.scalar import select

# Joint positions closer than this are the same configuration; of an arm whose closed form finds the place of the tool
# without its orientation, or is polished afterwards, at the edge of the reach half of the digits are gone.
_SAME_CONFIGURATION, _SAME_POLISHED = 1e-9, 1e-6
# A configuration whose tool is between these distances from its pose is polished [m], [rad].
_EXACT, _CLOSE = 1e-12, 1e-3


def inverse_branches(arm: Arm, X_BT: ArrayLike, near: ArrayLike | None = None) -> tuple[Array, Flags]:
    """Return all k IK branches of many poses at once, without ranking them: eight of six joints.

    Args:
        arm: an arm of n joints with a closed form: see ``find_closed_form``.
        X_BT: (..., 4, 4) tool poses in the base frame.
        near: (..., n) joint positions; angles come back within 180 deg of it, and a free joint takes its
            value from it; the middle of the limits when left out. Of an arm of seven joints the branches are those
            with its swivel, or with its position of the joint that is held.

    Returns:
        q: (..., k, n) joint positions, branches in the order of their signs. Where a pose has some of them only, the
            others repeat the first that it has; a pose out of reach gives the configurations that stretch towards it.
        singular: (..., k) whether a joint is free there.

    Raises:
        KindError: ``arm`` is no arm, or an array something else than real numbers.
        UnsupportedArmError: the arm has no closed form.
        ShapeError: a shape does not fit.
        InvalidValueError: a number is not finite, or a pose none.
    """
    form = closed_form_of(known_arm(arm))
    X_BT, near = typed_poses(X_BT), mid_range(arm) if near is None else positions(arm, near, "near")
    lead, solutions = _branches(arm, form, X_BT, near)
    q, singular = merged(solutions)
    return np.stack([stack(row, lead) for row in q], axis=-2), stack(singular, lead) > 0


def inverse(
    arm: Arm, X_BT: ArrayLike, near: ArrayLike | None = None, *, swivel: float | Choice = "nearest"
) -> InverseSolution:
    """Return the configurations that put the tool at one pose, ranked.

    With a closed form, see ``find_closed_form``, these are all there are, and so they are of any other arm of six
    joints, see ``every_solution``. What remains, arms of fewer or more joints without a closed form, is solved step by
    step from many starting configurations, see ``numeric_inverse``.

    Of an arm of seven joints with a closed form the branches at one swivel are returned: the angle of the elbow about
    the line from shoulder to wrist, see ``swivel_of``, or the position of the joint that is held in its place.

    Args:
        arm: any arm, with n joints.
        X_BT: (4, 4) tool pose in the base frame; a rotation typed with few digits is made one.
        near: (n,) the present joint positions: an angle is wrapped to the nearest value inside its limits, and
            branches come nearest first; the middle of the limits when left out.
        swivel: of an arm of seven joints: a value [rad] or [m], or for each branch one inside the limits: of those next
            to that of ``near`` the one which the joints reach soonest (``nearest``), the ``middle`` of the widest
            interval, or the one ``farthest`` from all limits.

    Returns:
        The branches, each labelled, with its limit violations and its residual, and the outcome on the whole.

    Raises:
        KindError: ``arm`` is no arm, or an array something else than real numbers.
        ShapeError: a shape does not fit.
        InvalidValueError: a number is not finite, or the pose is none, not even one typed with two digits.
        UnsupportedArmError: a swivel is given for an arm that has none.

    Source:
        Paul (1981) ch. 3; Hawkins (2013) for three parallel axes; Elias & Wen (2022) for decomposition into
        subproblems; Shimizu et al. (2008) for swivels; spec of this project, mechanics §3.2.
    """
    X = exact_pose(X_BT)
    reference = mid_range(known_arm(arm)) if near is None else single_configuration(arm, near, "near")
    form, chosen = find_closed_form(arm), checked_swivel(swivel)
    if isinstance(form, Redundant):
        candidates = redundant_candidates(arm, form, X, reference, chosen)
        if not candidates:
            return numeric_inverse(arm, X, reference)
        X_near = forward(arm, candidates[0].q)
        met = len(candidates) > 1 or max(pose_errors(arm, candidates[0].q, X)) <= POSE_TOLERANCE
        return rank(arm, X, candidates, reference, apart=_SAME_POLISHED, X_near=None if met else X_near)
    if chosen != "nearest":
        raise UnsupportedArmError(
            f"arm '{arm.name}' has no swivel; expected an arm of 7 joints with a closed-form inverse"
        )
    if form is not None:
        return _closed(arm, form, X, reference)
    return every_solution(arm, X, reference) if arm.n == 6 else numeric_inverse(arm, X, reference)


def _branches(arm: Arm, form: ClosedForm, X_BT: Array, near: Array) -> tuple[tuple[int, ...], Branches]:
    """Return the leading axes that poses (..., 4, 4) and joint positions (..., n) share, and the branches."""
    lead = leading_axes("pose, near", (X_BT, near), (X_BT.shape[:-2], near.shape[:-1]))
    X_BT, near = np.broadcast_to(X_BT, (*lead, 4, 4)), np.broadcast_to(near, (*lead, arm.n))
    R = [per_joint(X_BT[..., i, :3]) for i in range(3)]
    return lead, form.branches(arm, R, per_joint(X_BT[..., :3, 3]), per_joint(near))


def _configurations(arm: Arm, form: ClosedForm, X_BT: Array, near: Array) -> tuple[Array, Array, Array]:
    """Return configurations (..., k, n), which choosers are free (..., k, c), and reach errors (..., k) [m]."""
    lead, solutions = _branches(arm, form, X_BT, near)
    free = [stack([select(choice, 1.0, 0.0) for choice in choices], lead) > 0 for choices in solutions.free]
    q = np.stack([stack(each, lead) for each in solutions.q], axis=-2)
    return q, np.stack(free, axis=-2), stack(solutions.reach_error, lead)


def _closed(arm: Arm, form: ClosedForm, X: Array, near: Array) -> InverseSolution:
    target, X_near = X, None
    configurations, free, errors = _configurations(arm, form, X, near)
    if not isinstance(form, OfBuild):
        configurations, errors = _polished(arm, X, configurations, errors)
    if errors.min() > POSE_TOLERANCE:
        if not isinstance(form, OfBuild | Scara):
            return numeric_inverse(arm, X, near)
        target = _nearest_pose(form.geometry, X) if isinstance(form, OfBuild) else form.nearest_pose(X)
        configurations, free, errors = _configurations(arm, form, target, near)
        X_near = target if max(pose_errors(arm, configurations[errors.argmin()], X)) > POSE_TOLERANCE else None
    candidates = []
    for i in np.flatnonzero(errors <= max(POSE_TOLERANCE, errors.min())):
        q = nearest_equivalent(arm, configurations[i], near)
        together = form.moving(free[i].tolist())
        moving = set(free_joints(arm, X, q)) if together is None else together
        choosers = [joint for joint, is_free in zip(form.choosers, free[i], strict=True) if is_free]
        members = partial(_members, arm, form, target, int(i))
        for joint in choosers:
            outside = {fault.joint for fault in violations(arm, q)}
            # A joint outside its limits that does not move with the free one stays there, whatever that does.
            if not outside or outside - moving:
                break
            if moving == {4, 6} and isinstance(form, OfBuild):
                q = counter_rotate_within_limits(arm, q, near, members, joint=joint, other=6)
            else:
                q = search_within_limits(arm, q, near, members, joint=joint)
        candidates.append(Candidate(q, form.label(int(i), q), tuple(sorted(moving))))
    apart = _SAME_CONFIGURATION if isinstance(form, OfBuild) else _SAME_POLISHED
    return rank(arm, X, candidates, near, apart=apart, X_near=X_near)


def _polished(arm: Arm, X: Array, q: Array, errors: Array) -> tuple[Array, Array]:
    """Bring configurations (k, n) that miss a pose by a little, ``errors`` (k,), on to where they miss it least."""
    rough = np.flatnonzero((errors > _EXACT) & (errors < _CLOSE))
    if len(rough):
        q, errors = q.copy(), errors.copy()
        closer = descend_from(arm, X, q[rough])
        distances, angles = pose_errors(arm, closer, X)
        better = np.maximum(distances, angles) < errors[rough]
        q[rough[better]], errors[rough[better]] = closer[better], np.maximum(distances, angles)[better]
    return q, errors


def _members(arm: Arm, form: ClosedForm, X_BT: Array, branch: int, near: Array) -> Array:
    """Return the configurations (k, n) of one branch near joint positions (k, n), where a joint is free."""
    R = [X_BT[i, :3].tolist() for i in range(3)]
    return stack(form.branch(arm, R, X_BT[:3, 3].tolist(), per_joint(near), branch).q, near.shape[:-1])


def _nearest_pose(geometry: ClosedFormGeometry, X_BT: Array) -> Array:
    """Return X_BT translated, not rotated, so that the wrist centre comes into reach."""
    p, R = (np.array(x) for x in wrist_pose(geometry, X_BT[:3, :3].tolist(), X_BT[:3, 3].tolist()))
    X = X_BT.copy()
    X[:3, 3] += geometry.X_BS[:3, :3] @ (nearest_wrist_centre(geometry, p, R) - p)
    return X
