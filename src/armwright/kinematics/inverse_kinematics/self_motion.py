"""Self-motion: where a pose leaves a joint free, the configuration that is inside the limits."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.kinematics.inverse_kinematics.revolutions import midpoints, nearest_equivalent

# The members (k, n) of a family of configurations that joint positions (k, n) to stay near lead to.
Members: TypeAlias = Callable[[Array], Array]

# Positions of a free joint that are tried for one inside the limits; then, where none is, the neighbourhoods of those
# that pass the limits least are looked at, each time four times closer: down to 1e-9 of the step.
_TRIED = 721
_LEAST = 8
_CLOSER = 15
_FINER = 4
# How far a joint is moved to see which way another goes with it [rad].
_PROBE = 0.5
_TURN = 2 * np.pi
# Whole turns by which positions are shifted where another joint reaches a limit.
_WHOLE_TURNS = np.arange(-2, 3)
# Joints that are together this far outside their limits are inside [rad] or [m].
INSIDE = 1e-10


def search_within_limits(arm: Arm, q: Array, near: Array, members: Members, *, joint: int) -> Array:
    """Move a free joint on from ``near``, as little as it must, until all joints are inside their limits.

    As little as it must, that is to a step of the search; where no step is inside, because another joint has room for
    a small part of the family only, it is moved to some member of that part.

    Args:
        arm: the arm.
        q: (n,) the member with that joint near, which comes back when no other is inside.
        near: (n,) where the arm is.
        members: returns the members (k, n) of the family that joint positions (k, n) to stay near lead to.
        joint: number of the free joint, from 1.
    """
    # What lies more than half a turn away is equivalent to what does not, which may be outside the limits.
    for turn in (np.pi, _TURN):
        interval = _interval(arm, near, joint, turn)
        inside_limits = _search(arm, near, members, joint, interval) if interval[0] <= interval[1] else None
        if inside_limits is not None:
            return inside_limits
    return q


def _search(arm: Arm, near: Array, members: Members, joint: int, interval: tuple[float, float]) -> Array | None:
    """Return the member nearest to ``near`` of those with all joints inside that a search of a room finds."""
    (lower, upper), start = interval, near[joint - 1]
    values, width = np.linspace(lower, upper, _TRIED), (upper - lower) / (_TRIED - 1)
    for _ in range(_CLOSER):
        rows = members(_with_joint(near, joint, values))
        beyond = excess(arm, rows)
        inside = np.flatnonzero(beyond < INSIDE)
        if inside.size:
            return nearest_equivalent(arm, rows[inside[np.abs(values[inside] - start).argmin()]], near)
        around = np.pad(beyond, 1, constant_values=np.inf)
        low = np.flatnonzero((beyond <= around[:-2]) & (beyond <= around[2:]))
        low = low[beyond[low].argsort(kind="stable")][:_LEAST]
        fan = np.linspace(-width, width, 2 * _FINER + 1)
        values, width = np.unique(np.clip(values[low][:, None] + fan, lower, upper)), width / _FINER
    return None


def counter_rotate_within_limits(arm: Arm, q: Array, near: Array, members: Members, *, joint: int, other: int) -> Array:
    """Rotate two joints whose axes lie on one line, against each other, until both are inside their limits.

    The members of such a family are known: what one joint rotates, the other rotates back. So the least rotation that
    brings both inside lies at a limit of one of them.

    Args:
        arm: the arm.
        q: (n,) the member with the joint near, which comes back when no other is inside.
        near: (n,) where the arm is.
        members: returns the members (k, n) of the family that joint positions (k, n) to stay near lead to.
        joint: number of the free joint, from 1.
        other: number of the joint that rotates with it.
    """
    lower, upper = _interval(arm, near, joint, _TURN)
    if lower > upper:
        return q
    start, limits = near[joint - 1], arm.joints[other - 1].limits
    here, probed = members(_with_joint(near, joint, start + np.array((0.0, _PROBE))))[:, other - 1]
    way = 1.0 if abs(np.remainder(probed - here + np.pi, _TURN) - np.pi - _PROBE) < _PROBE else -1.0
    ends = [limit for limit in (limits.lower, limits.upper) if np.isfinite(limit)]
    reached = [way * (end - here + _TURN * (_WHOLE_TURNS - np.round((end - here) / _TURN))) for end in ends]
    turns = np.concatenate([[0.0, lower - start, upper - start], *reached])
    turns = turns[(turns >= lower - start) & (turns <= upper - start)]
    turns = turns[np.abs(turns).argsort(kind="stable")]
    rows = members(_with_joint(near, joint, start + turns))
    inside = np.flatnonzero(excess(arm, rows) < INSIDE)
    return nearest_equivalent(arm, rows[inside[0]], near) if inside.size else q


def _with_joint(near: Array, joint: int, values: Array) -> Array:
    """Return where the arm is (k, n), with one joint, from 1, at other values (k,)."""
    rows = np.tile(near, (len(values), 1))
    rows[:, joint - 1] = values
    return rows


def _interval(arm: Arm, near: Array, joint: int, turn: float) -> tuple[float, float]:
    """Return from where to where a free joint may move: inside its limits, by so much at most [rad].

    One that is outside of them is moved inside before it is shifted by a whole revolution.
    """
    limits, start = arm.joints[joint - 1].limits, near[joint - 1]
    if turn == _TURN:
        start = min(max(start, limits.lower), limits.upper)
    return max(limits.lower, start - turn), min(limits.upper, start + turn)


def excess(arm: Arm, q: Array) -> Array:
    """Return the sums (...) by which joints, and coupled drives, of configurations (..., n) exceed limits.

    Angles are shifted by revolutions to where they exceed them least.
    """
    total = np.zeros(q.shape[:-1])
    for joint, values in zip(arm.joints, np.moveaxis(q, -1, 0), strict=True):
        lower, upper = joint.limits.lower, joint.limits.upper
        beyond = np.maximum(np.maximum(lower - values, values - upper), 0.0)
        if joint.revolute and np.isfinite(upper - lower):
            aside = np.remainder(values - (lower + upper) / 2 + np.pi, 2 * np.pi) - np.pi
            beyond = np.maximum(np.abs(aside) - (upper - lower) / 2, 0.0)
        elif joint.revolute:
            beyond = np.zeros(q.shape[:-1])
        total += beyond
    return total if arm.coupling is None or not arm.coupling.limits else total + _drive_excess(arm, q)


def _drive_excess(arm: Arm, q: Array) -> Array:
    """Return the sums (...) by which coupled drives exceed their limits.

    Left out are drives that depend on a joint with room for more than one turn: by another turn they may be inside.
    """
    assert arm.coupling is not None  # noqa: S101 - asked for coupled drives only
    room, limits = arm.limits.upper - arm.limits.lower, arm.coupling.drive_limits
    middle = midpoints(arm.limits.lower, arm.limits.upper, np.zeros(arm.n))
    once = ~arm.revolute | (room <= _TURN)
    q = np.where(arm.revolute & once, middle + np.remainder(q - middle + np.pi, _TURN) - np.pi, q)
    m = arm.coupling.drives(q)
    beyond = np.maximum(np.maximum(limits.lower - m, m - limits.upper), 0.0)
    known = (arm.coupling.inverse[:, ~once] == 0).all(axis=1)
    return np.asarray(np.where(known, beyond, 0.0).sum(axis=-1))
