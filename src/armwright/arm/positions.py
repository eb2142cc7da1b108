"""Joint positions at the door of a public function: one per joint, and a warning where they look like degrees."""

from __future__ import annotations

import inspect
import math
import warnings

import numpy as np

from armwright.arm.model import Arm, Joint
from armwright.arrays import Array, ArrayLike, joint_array
from armwright.errors import KindError, ShapeError, UnitWarning, shown

_REVOLUTION = 2 * math.pi
# Joints without limits are tried within so much either way [rad], [m].
_FREE, _FREE_SLIDE = math.pi, 1.0
_PACKAGE = __name__.partition(".")[0]


def positions(arm: Arm, q: ArrayLike, what: str = "q", *, callers: int = 1) -> Array:
    """Return joint positions as read-only float64 of shape (..., n).

    A rotation by more than a revolution, on a joint whose limits do not go so far, is taken for degrees: there is one
    warning, at the line outside of this package that has called. A public function that another part of the package
    calls says nothing: the positions of a motion, or images of an angle, may be anything.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        what: how the array is called in a message.
        callers: how many calls up from here the public function is.

    Raises:
        KindError: ``arm`` is no arm, or ``q`` is something else than real numbers.
        ShapeError: the last axis is not n long.
        InvalidValueError: a number is NaN or infinite.

    Warns:
        UnitWarning: the positions look like degrees.
    """
    array = joint_array(q, known_arm(arm).n, what)
    if array.size and np.abs(array).max() > _REVOLUTION:
        ask_for_degrees(arm, array, what, callers + 1)
    return array


def single_configuration(arm: Arm, q: ArrayLike, what: str = "q", *, callers: int = 1) -> Array:
    """Return the joint positions (n,) of one configuration; all else as ``positions``.

    Raises:
        ShapeError: the shape is not (n,).
    """
    array = positions(arm, q, what, callers=callers + 1)
    if array.ndim != 1:
        raise ShapeError(f"{what}: expected shape ({arm.n},), got {array.shape}")
    return array


def known_arm(arm: Arm) -> Arm:
    """Return ``arm`` if it is one.

    Raises:
        KindError: it is something else, such as a name.
    """
    if not isinstance(arm, Arm):
        raise KindError(f"arm: expected an Arm, such as load_arm('puma560') returns, got {shown(arm)}")
    return arm


def admitted(arm: Arm) -> Array:
    """Return how far every joint may be from 0 before its position looks like degrees, (n,) [rad]; slides always."""
    ends = np.abs([arm.limits.lower, arm.limits.upper])
    farthest = np.where(np.isfinite(ends), ends, _REVOLUTION).max(axis=0, initial=_REVOLUTION)
    return np.where(arm.revolute, farthest, np.inf)


def ranges(arm: Arm) -> tuple[Array, Array]:
    """Return (n,) between what each joint is tried where its whole range is to be seen [rad], [m].

    These are its limits. Of a joint that may turn more than once, one turn about where it is nearest to 0 tells all; of
    a slide without an end, a metre either way is taken.
    """
    ends = np.array([_range(joint) for joint in arm.joints])
    return ends[:, 0], ends[:, 1]


def degrees_by_mistake(arm: Arm, q: Array) -> str:
    """Say of joint positions (..., n) that they look like degrees, by the first such joint; empty if none does."""
    rows = np.abs(q.reshape(-1, arm.n))
    suspects = np.flatnonzero((rows > admitted(arm) * (1 + 1e-9)).any(axis=0))
    if not len(suspects):
        return ""
    i = int(suspects[0])
    value = float(q.reshape(-1, arm.n)[rows[:, i].argmax(), i])
    return (
        f"{arm.joint_label(i)} of '{arm.name}' is at {value:g} rad, {abs(value) / _REVOLUTION:.1f} revolutions. If "
        f"degrees are meant, {value:g} degrees are {math.radians(value):.6g} rad"
    )


def _range(joint: Joint) -> tuple[float, float]:
    lower, upper = joint.limits.lower, joint.limits.upper
    free = _FREE if joint.revolute else _FREE_SLIDE
    if upper - lower <= 2 * free or (math.isfinite(upper - lower) and not joint.revolute):
        return lower, upper
    middle = min(max(0.0, lower + free), upper - free)
    return middle - free, middle + free


def ask_for_degrees(arm: Arm, q: Array, what: str, callers: int) -> None:
    """Warn of positions that look like degrees, unless the package itself has called the public function.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions.
        what: how they are called in the message.
        callers: how many calls up from here the public function is.
    """
    frame = inspect.currentframe()
    for _ in range(callers + 1):
        frame = frame.f_back if frame else None
    if frame is None or frame.f_globals.get("__name__", "").partition(".")[0] == _PACKAGE:
        return
    suspicion = degrees_by_mistake(arm, q)
    if suspicion:
        warnings.warn(
            f"{what}: {suspicion}: give numpy.deg2rad(...). If the joint really rotates so far, set its limits; or "
            "silence this: warnings.simplefilter('ignore', armwright.errors.UnitWarning)",
            UnitWarning,
            stacklevel=callers + 2,
        )
