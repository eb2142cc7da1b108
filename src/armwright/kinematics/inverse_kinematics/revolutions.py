"""Joint positions that are equal but for whole revolutions, and the distance between joint configurations."""

from __future__ import annotations

import math

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import known_arm
from armwright.arrays import Array, ArrayLike, joint_array, one_per_joint
from armwright.kinematics.inverse_kinematics.solution import violations

_TURN = 2 * math.pi
# An angle this far beyond a limit is on it [rad].
_ON_LIMIT = 1e-9
# Of one configuration so many equivalents are listed: of joints with room for more turns those nearest to it.
_MAX_EQUIVALENTS = 4096


def joint_distance(arm: Arm, q_from: ArrayLike, q_to: ArrayLike) -> float:
    """Return how far apart two configurations are: the root of the summed squares of each joint's time at top speed."""
    return float(joint_distances(arm, joint_array(q_from, arm.n), joint_array(q_to, arm.n)))


def joint_distances(arm: Arm, q_from: Array, q_to: Array) -> Array:
    """Return ``joint_distance`` (...) of configurations (..., n)."""
    speed = arm.limits.speed
    weight = 1.0 / np.where(np.isfinite(speed), speed, 1.0)
    return np.asarray(np.linalg.norm((q_to - q_from) * weight, axis=-1))


def nearest_equivalent(arm: Arm, q: ArrayLike, near: ArrayLike) -> Array:
    """Return ``q`` (n,) with every angle wrapped to the equivalent inside the limits nearest to ``near``.

    An angle with no equivalent inside the limits takes the one that passes its limit least. Where the result passes a
    limit of coupled drives, the nearest of the equivalents that pass none is taken, if there is one.
    """
    starts = joint_array(near, arm.n, "near").tolist()
    choices = _equivalents(arm, q, starts)
    nearest = np.array([min(turns, key=lambda x: abs(x - x0)) for turns, x0 in zip(choices, starts, strict=True)])
    if arm.coupling is None or not arm.coupling.limits or not violations(arm, nearest):
        return nearest
    inside = equivalent_configurations(arm, nearest)
    return inside[joint_distances(arm, np.array(starts), inside).argmin()] if len(inside) else nearest


def equivalent_configurations(arm: Arm, q: ArrayLike) -> Array:
    """Return the equivalents of one configuration by whole revolutions inside the limits, (k, n); k is 0 if none is.

    A joint without limits has endless equivalents; it stays where it is. Where limits leave room for very many, those
    nearest to the configuration are returned, some thousand.
    """
    values = one_per_joint(q, known_arm(arm).n).tolist()
    rows = np.stack(np.meshgrid(*_few(_equivalents(arm, q, values), values), indexing="ij"), axis=-1).reshape(-1, arm.n)
    inside = [row for row in rows if not violations(arm, row)]
    return np.array(inside).reshape(len(inside), arm.n)


def wrapped_near(arm: Arm, q: Array, near: Array) -> Array:
    """Shift angles (..., n) by whole revolutions to within 180 deg of ``near``, whatever the limits."""
    return np.asarray(np.where(arm.revolute, q + _TURN * np.round((near - q) / _TURN), q))


def same_configuration(arm: Arm, a: Array, b: Array, tolerance: float) -> bool:
    """Whether two configurations (n,) differ by whole revolutions only."""
    return float(np.abs(wrapped_near(arm, a, b) - b).max()) < tolerance


def mid_range(arm: Arm) -> Array:
    """Return the middle of the limits of every joint (n,); 0 where there are none."""
    return midpoints(arm.limits.lower, arm.limits.upper, np.zeros(arm.n))


def midpoints(lower: Array, upper: Array, otherwise: Array) -> Array:
    """Return the middle between bounds (n,), and what it is ``otherwise`` (n,) where one of them is infinite."""
    bounded = np.isfinite(lower) & np.isfinite(upper)
    return np.where(bounded, (np.where(bounded, lower, 0) + np.where(bounded, upper, 0)) / 2, otherwise)


def _few(choices: list[list[float]], values: list[float]) -> list[list[float]]:
    """Leave out, where there are too many combinations, the values farthest from ``values`` of joints with the most."""
    most = max(map(len, choices))
    while math.prod(min(len(turns), most) for turns in choices) > _MAX_EQUIVALENTS:
        most -= 1
    joints = zip(choices, values, strict=True)
    return [sorted(sorted(turns, key=lambda x: abs(x - value))[:most]) for turns, value in joints]


def _equivalents(arm: Arm, q: ArrayLike, starts: list[float]) -> list[list[float]]:
    """List, joint by joint, the equivalents inside the limits; where there is none, the one least outside.

    Of very many those are listed that are nearest to ``starts``.
    Of the endless equivalents of a joint with a limit missing only the one next to ``starts`` is listed.
    """
    result = []
    for joint, value, start in zip(arm.joints, joint_array(q, arm.n).tolist(), starts, strict=True):
        lower, upper = joint.limits.lower, joint.limits.upper
        if not joint.revolute:
            result.append([value])
        elif math.isfinite(upper - lower):
            first = math.ceil((lower - _ON_LIMIT - value) / _TURN)
            last = math.floor((upper + _ON_LIMIT - value) / _TURN)
            # As many on either side as there may be in all, around the one nearest to the start.
            nearest = min(max(round((start - value) / _TURN), first), last)
            first, last = max(first, nearest - _MAX_EQUIVALENTS), min(last, nearest + _MAX_EQUIVALENTS)
            least = value + _TURN * round(((lower + upper) / 2 - value) / _TURN)
            result.append([value + k * _TURN for k in range(first, last + 1)] or [least])
        else:
            image = value + _TURN * round((start - value) / _TURN)
            image += _TURN * math.ceil(max(lower - _ON_LIMIT - image, 0.0) / _TURN)
            image -= _TURN * math.ceil(max(image - upper - _ON_LIMIT, 0.0) / _TURN)
            result.append([image])
    return result
