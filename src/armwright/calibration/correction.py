"""The arm with its errors taken in, in the forms that users need: an arm of this package, tables, URDF."""

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
from armwright.arm.urdf.writer import urdf_text
from armwright.arrays import Array, ArrayLike
from armwright.calibration.chain import Chain, Element, chain_of
from armwright.calibration.fitting import Calibration
from armwright.errors import InvalidValueError, UnknownNameError
from armwright.spatial.euler import to_rpy
from armwright.spatial.poses import inverse, pose
from armwright.spatial.rotations import rotation_from_vector

# The numbers of a link in the Denavit-Hartenberg convention.
_NUMBERS = ("theta", "d", "a", "alpha")


def corrected_arm(calibration: Calibration) -> Arm:
    """Return the arm with the errors that were found and how well they are known.

    Its base is in the frame of the measurements, and so is gravity, which points where it did as seen from the arm.

    Raises:
        InvalidValueError: a turn about y was fitted, which a Denavit-Hartenberg table cannot hold without axes that
            meet a kilometre away, or a bend of a joint; calibrate ``without=("beta",)`` and without bends.
    """
    arm = calibration.chain.arm
    tilted = [name for name in calibration.names if name.endswith(".beta")]
    if tilted:
        raise InvalidValueError(
            f"{arm.name}: {', '.join(tilted)} turns about y, which a Denavit-Hartenberg table has no number for; "
            f'calibrate without=("beta",)'
        )
    corrected = _corrected(calibration)
    return attrs.evolve(corrected, uncertainty=_uncertainty(calibration, corrected))


def corrected_urdf(calibration: Calibration) -> str:
    """Return the arm with all errors that were found as the text of a URDF file, turns about y and all.

    Raises:
        InvalidValueError: a bend of a joint was fitted, or the arm's name has characters that XML cannot hold.
    """
    return urdf_text(_corrected(calibration), _tilts(calibration))


def corrected_tables(calibration: Calibration) -> dict[str, str]:
    """Return the corrected arm as tables of numbers, CSV by convention: standard, modified, hayati.

    A row for the base, one for each joint, one for the tool. With turns about y there is the last alone, whose rows
    are Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta).

    Raises:
        InvalidValueError: a bend of a joint was fitted.
    """
    arm, tilts = _corrected(calibration), _tilts(calibration)
    tables = {"hayati": _table(arm.base, arm.joints, arm.tool, tilts)}
    if not any(tilts):
        rows, last = to_modified(arm.joints)
        tables = {
            "standard": _table(arm.base, arm.joints, arm.tool),
            "modified": _table(arm.base, rows, last @ arm.tool),
        }
    return tables


def position_covariance(arm: Arm, q: ArrayLike) -> Array:
    """Return (m, 3, 3) the covariance of where an arm has its tool, from how well its dimensions are known [m²].

    Args:
        arm: that was calibrated, with n joints.
        q: (m, n) joint positions [rad] or [m].

    Raises:
        InvalidValueError: nothing is known of the arm's errors.
        UnknownNameError: an error is told that the arm cannot have.
        ShapeError: ``q`` does not fit.
    """
    if arm.uncertainty is None:
        raise InvalidValueError(f"{arm.name}: it is not said how well its dimensions are known; calibrate it")
    chain = chain_of(arm)
    for name in arm.uncertainty.errors:
        if name not in chain.names:
            raise UnknownNameError("error", name, chain.names)
    J = chain.reach(q).by_position[:, :, [chain.names.index(name) for name in arm.uncertainty.errors]]
    return np.asarray(J @ arm.uncertainty.covariance @ J.swapaxes(1, 2), dtype=np.float64)


# ---- inside --------------------------------------------------------------------------------------------------------


def _corrected(calibration: Calibration) -> Arm:
    """Return the arm with all errors that were found but for turns about y."""
    chain, arm = calibration.chain, calibration.chain.arm
    if chain.bends:
        names = ", ".join(bend.name for bend in chain.bends)
        raise InvalidValueError(f"{arm.name}: {names} bend with the posture, which no table holds; calibrate without")
    by_name = dict(zip(chain.names, calibration.own.tolist(), strict=True))
    joints = [
        attrs.evolve(joint, **{key: getattr(joint, key) + by_name[f"joint{i}.{key}"] for key in _NUMBERS})
        for i, joint in enumerate(arm.joints, 1)
    ]
    base = chain.base @ _pose_of(chain, by_name, "base")
    return attrs.evolve(
        arm,
        joints=tuple(joints),
        base=base @ arm.base,
        gravity=felt_gravity(inverse(base), arm.gravity),
        tool=arm.tool @ pose(chain.hand, np.zeros(3)) @ _pose_of(chain, by_name, "tool"),
        title=f"{arm.title or arm.name}, calibrated",
    )


def _tilts(calibration: Calibration) -> list[float]:
    by_name = dict(zip(calibration.chain.names, calibration.own.tolist(), strict=True))
    return [by_name.get(f"joint{i + 1}.beta", 0.0) for i in range(calibration.chain.arm.n)]


def _pose_of(chain: Chain, by_name: dict[str, float], part: str) -> Array:
    """Return the pose that the six errors of a part make."""
    X = np.eye(4)
    for element in chain.elements:
        if element.name.startswith(f"{part}."):
            X = X @ _moved(element, by_name[element.name])
    return X


def _moved(element: Element, by: float) -> Array:
    along = by * np.eye(3)[element.axis]
    return pose(np.eye(3), along) if element.kind == "shift" else pose(rotation_from_vector(along), np.zeros(3))


def _uncertainty(calibration: Calibration, corrected: Arm) -> Uncertainty:
    """Return how well the corrected arm is known: the errors of base and tool count from where these are now."""
    chain, now = calibration.chain, chain_of(corrected)
    q = np.zeros((1, corrected.n))
    then_reached, now_reached = chain.reach(q, calibration.own), now.reach(q)
    M = np.eye(len(now.names))
    for part in ("base.", "tool."):
        own = [i for i, name in enumerate(now.names) if name.startswith(part)]
        theirs = [chain.names.index(now.names[i]) for i in own]
        moved = np.vstack([then_reached.by_position[0][:, theirs], then_reached.by_turn[0][:, theirs]])
        moving = np.vstack([now_reached.by_position[0][:, own], now_reached.by_turn[0][:, own]])
        M[np.ix_(own, own)] = np.linalg.solve(moving, moved)
    fitted = [i for i, name in enumerate(calibration.names) if name in now.names]
    columns = [now.names.index(calibration.names[i]) for i in fitted]
    # An error of base or tool that was held is told as the mixture that the others of its part make of it.
    told = np.flatnonzero(np.abs(M[:, columns]).max(axis=1) > 0)
    N = M[told][:, columns]
    covariance = N @ calibration.covariance[np.ix_(fitted, fitted)] @ N.T
    return Uncertainty(
        errors=[now.names[i] for i in told],
        covariance=(covariance + covariance.T) / 2,
        noise=calibration.noise.length,
    )


def _table(base: Array, joints: Sequence[Joint], tool: Array, tilts: Iterable[float] | None = None) -> str:
    """Return rows of a table as CSV."""
    text = io.StringIO()
    angles = ["theta_deg", "d_mm", "a_mm", "alpha_deg", *(["beta_deg"] if tilts is not None else [])]
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["part", "kind", *angles, "x_mm", "y_mm", "z_mm", "roll_deg", "pitch_deg", "yaw_deg"])
    none = [""] * len(angles)
    writer.writerow(["base", "", *none, *_six(base)])
    for i, (joint, tilt) in enumerate(zip(joints, tilts or [0.0] * len(joints), strict=True), 1):
        numbers = [math.degrees(joint.theta), joint.d * 1e3, joint.a * 1e3, math.degrees(joint.alpha)]
        more = [math.degrees(tilt)] if tilts is not None else []
        fixed = [""] * 6 if joint.fixed is None else _six(joint.fixed)
        writer.writerow([f"joint_{i}", joint.kind, *numbers, *more, *fixed])
    writer.writerow(["tool", "", *none, *_six(tool)])
    return text.getvalue()


def _six(X: Array) -> list[float]:
    """Return place [mm] and roll, pitch, yaw [deg] of a pose."""
    return [*(X[:3, 3] * 1e3).tolist(), *np.degrees(to_rpy(X[:3, :3])).tolist()]
