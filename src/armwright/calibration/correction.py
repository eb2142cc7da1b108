"""The corrected arm in the forms that users need: an arm of this package, tables, URDF."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence

import attrs
import numpy as np

from armwright.arm.dh import to_modified
from armwright.arm.gravity import felt_gravity
from armwright.arm.model import Arm, Joint
from armwright.arm.uncertainty import Uncertainty
from armwright.arm.universal_robots.calibration_conf import calibration_conf
from armwright.arm.universal_robots.joint_frames import joint_transforms, with_near_frames
from armwright.arm.universal_robots.kinematics_yaml import kinematics_yaml
from armwright.arm.urdf.writer import urdf_text
from armwright.arrays import Array, ArrayLike
from armwright.calibration.chain import Chain, kinematic_chain
from armwright.calibration.fitting import Calibration
from armwright.errors import InvalidValueError, UnknownNameError, UnsupportedArmError
from armwright.spatial.euler import to_rpy
from armwright.spatial.poses import homogeneous, inverse
from armwright.spatial.rotations import rotation_from_vector

# The numbers of a link in the Denavit-Hartenberg convention.
_DH_PARAMETERS = ("theta", "d", "a", "alpha")


def corrected_arm(calibration: Calibration) -> Arm:
    """Return the arm with its estimated errors and their covariance.

    Its base is in the frame of the measurements, and so is gravity, which points where it did as seen from the arm.

    Raises:
        InvalidValueError: a rotation about y was fitted, which a Denavit-Hartenberg table cannot hold without axes that
            meet a kilometre away, or an error model of a joint; calibrate ``without=("beta",)`` and joint errors.
    """
    arm = calibration.chain.arm
    tilted = [name for name in calibration.names if name.endswith(".beta")]
    if tilted:
        raise InvalidValueError(
            f"{arm.name}: {', '.join(tilted)} is a rotation about y, which a Denavit-Hartenberg table has no number "
            f'for; calibrate without=("beta",)'
        )
    corrected = _corrected_without_tilts(calibration)
    return attrs.evolve(corrected, uncertainty=_corrected_uncertainty(calibration, corrected))


def corrected_urdf(calibration: Calibration) -> str:
    """Return the arm with all estimated errors as the text of a URDF file, rotations about y included.

    Raises:
        InvalidValueError: an error model of a joint was fitted, or the arm's name has characters that XML cannot hold.
    """
    return urdf_text(_corrected_without_tilts(calibration), _tilts(calibration))


def corrected_tables(calibration: Calibration) -> dict[str, str]:
    """Return the corrected arm as tables of numbers, CSV by convention: standard, modified, hayati.

    A row for the base, one for each joint, one for the tool. With rotations about y there is the last alone, whose rows
    are Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta).

    Raises:
        InvalidValueError: an error model of a joint was fitted.
    """
    arm, tilts = _corrected_without_tilts(calibration), _tilts(calibration)
    if any(tilts):
        return {"hayati": _csv_table(arm.base, arm.joints, arm.tool, tilts)}
    rows, last = to_modified(arm.joints)
    standard = _csv_table(arm.base, arm.joints, arm.tool)
    return {"standard": standard, "modified": _csv_table(arm.base, rows, last @ arm.tool)}


def robot_files(calibration: Calibration) -> dict[str, str]:
    """Return the files by which the makers of an arm keep its calibration, all estimated errors of its joints included.

    There are such files of arms of Universal Robots: ``calibration.conf`` and ``kinematics.yaml`` for ROS 2. Poses of
    base and tool are not in them.

    Raises:
        InvalidValueError: an error model of a joint was fitted.
    """
    arm, model = _corrected_without_tilts(calibration), calibration.chain.arm
    if any(joint.fixed is not None or not joint.revolute for joint in model.joints):
        return {}
    near = with_near_frames(model, np.array([np.eye(4), *joint_transforms(arm, _tilts(calibration))]))
    try:
        return {"calibration.conf": calibration_conf(near, model), "kinematics.yaml": kinematics_yaml(near)}
    except UnsupportedArmError:
        return {}


def position_covariance(arm: Arm, q: ArrayLike) -> Array:
    """Return (m, 3, 3) the covariance of the position of an arm's tool that follows from that of its dimensions [m²].

    Args:
        arm: that was calibrated, with n joints.
        q: (m, n) joint positions [rad] or [m].

    Raises:
        InvalidValueError: the arm has no covariance.
        UnknownNameError: the covariance is of an error that the arm cannot have.
        ShapeError: ``q`` does not fit.
    """
    if arm.uncertainty is None:
        raise InvalidValueError(f"{arm.name}: its dimensions have no covariance; calibrate it")
    chain = kinematic_chain(arm)
    for name in arm.uncertainty.errors:
        if name not in chain.names:
            raise UnknownNameError("error", name, chain.names)
    J = chain.forward(q).position_jacobian[:, :, [chain.names.index(name) for name in arm.uncertainty.errors]]
    return np.asarray(J @ arm.uncertainty.covariance @ J.swapaxes(1, 2), dtype=np.float64)


# ---- inside --------------------------------------------------------------------------------------------------------


def _corrected_without_tilts(calibration: Calibration) -> Arm:
    """Return the arm with all estimated errors but for rotations about y."""
    chain, arm = calibration.chain, calibration.chain.arm
    if chain.joint_errors:
        names = ", ".join(error.name for error in chain.joint_errors)
        raise InvalidValueError(
            f"{arm.name}: {names} depend on the configuration, which no table holds; calibrate without joint errors"
        )
    by_name = dict(zip(chain.names, calibration.arm_errors.tolist(), strict=True))
    joints = [
        attrs.evolve(joint, **{key: getattr(joint, key) + by_name[f"joint{i}.{key}"] for key in _DH_PARAMETERS})
        for i, joint in enumerate(arm.joints, 1)
    ]
    base = chain.base @ _error_pose(chain, by_name, "base")
    return attrs.evolve(
        arm,
        joints=tuple(joints),
        base=base @ arm.base,
        gravity=felt_gravity(inverse(base), arm.gravity),
        tool=arm.tool @ homogeneous(chain.target_rotation, np.zeros(3)) @ _error_pose(chain, by_name, "tool"),
        title=f"{arm.title or arm.name}, calibrated",
    )


def _tilts(calibration: Calibration) -> list[float]:
    by_name = dict(zip(calibration.chain.names, calibration.arm_errors.tolist(), strict=True))
    return [by_name.get(f"joint{i + 1}.beta", 0.0) for i in range(calibration.chain.arm.n)]


def _error_pose(chain: Chain, by_name: dict[str, float], part: str) -> Array:
    """Return the pose that the six errors of a part make."""
    X = np.eye(4)
    for element in chain.elements:
        if element.name.startswith(f"{part}."):
            vector, zero = by_name[element.name] * np.eye(3)[element.axis], np.zeros(3)
            moves = element.kind == "translation"
            X = X @ homogeneous(rotation_from_vector(zero if moves else vector), vector if moves else zero)
    return X


def _corrected_uncertainty(calibration: Calibration, corrected: Arm) -> Uncertainty:
    """Return the covariance of the corrected arm: errors of base and tool count from where these are now."""
    chain, now = calibration.chain, kinematic_chain(corrected)
    q = np.zeros((1, corrected.n))
    then_tool, now_tool = chain.forward(q, calibration.arm_errors), now.forward(q)
    M = np.eye(len(now.names))
    for part in ("base.", "tool."):
        own = [i for i, name in enumerate(now.names) if name.startswith(part)]
        theirs = [chain.names.index(now.names[i]) for i in own]
        moved = np.vstack([then_tool.position_jacobian[0][:, theirs], then_tool.rotation_jacobian[0][:, theirs]])
        moving = np.vstack([now_tool.position_jacobian[0][:, own], now_tool.rotation_jacobian[0][:, own]])
        M[np.ix_(own, own)] = np.linalg.solve(moving, moved)
    fitted = [i for i, name in enumerate(calibration.names) if name in now.names]
    columns = [now.names.index(calibration.names[i]) for i in fitted]
    # An error of base or tool that was fixed is the mixture that the others of its part make of it.
    rows = np.flatnonzero(np.abs(M[:, columns]).max(axis=1) > 0)
    N = M[rows][:, columns]
    covariance = N @ calibration.covariance[np.ix_(fitted, fitted)] @ N.T
    return Uncertainty(
        errors=[now.names[i] for i in rows], covariance=(covariance + covariance.T) / 2, noise=calibration.noise.length
    )


def _csv_table(base: Array, joints: Sequence[Joint], tool: Array, tilts: Iterable[float] | None = None) -> str:
    """Return rows of a table as CSV."""
    text = io.StringIO()
    angles = ["theta_deg", "d_mm", "a_mm", "alpha_deg", *(["beta_deg"] if tilts is not None else [])]
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["part", "kind", *angles, "x_mm", "y_mm", "z_mm", "roll_deg", "pitch_deg", "yaw_deg"])
    none = [""] * len(angles)
    writer.writerow(["base", "", *none, *_position_and_rpy(base)])
    for i, (joint, tilt) in enumerate(zip(joints, tilts or [0.0] * len(joints), strict=True), 1):
        numbers = [math.degrees(joint.theta), joint.d * 1e3, joint.a * 1e3, math.degrees(joint.alpha)]
        more = [math.degrees(tilt)] if tilts is not None else []
        fixed = [""] * 6 if joint.fixed is None else _position_and_rpy(joint.fixed)
        writer.writerow([f"joint_{i}", joint.kind, *numbers, *more, *fixed])
    writer.writerow(["tool", "", *none, *_position_and_rpy(tool)])
    return text.getvalue()


def _position_and_rpy(X: Array) -> list[float]:
    """Return position [mm] and roll, pitch, yaw [deg] of a pose."""
    return [*(X[:3, 3] * 1e3).tolist(), *np.degrees(to_rpy(X[:3, :3])).tolist()]
