"""Free families: where a pose leaves a joint open, the member that is inside the limits."""

from collections.abc import Callable

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.kinematics.inverse.turns import nearest_image

# Places of a free joint that are tried for one inside the limits; then, where none is, the neighbourhoods of those
# that pass the limits least are looked at, each time four times closer: down to 1e-9 of the step.
_TRIED = 721
_LEAST = 8
_CLOSER = 15
_FINER = 4
# Joints that are together this far outside their limits are inside [rad] or [m].
_INSIDE = 1e-10


def moved_inside(arm: Arm, q: Array, near: Array, members: Callable[[Array], Array], *, joint: int) -> Array:
    """Move a free joint on from ``near``, as little as it must, until all joints are inside their limits.

    As little as it must, that is to a step of the search; where no step is inside, because another joint has room for
    a small part of the family only, it is moved to some member of that part.

    Args:
        arm: the arm.
        q: (n,) the member with that joint near, which comes back when no other is inside.
        near: (n,) where the arm is.
        members: returns the members (k, n) of the family that places (k, n) of the arm lead to.
        joint: number of the free joint, from 1.
    """
    limits, start = arm.joints[joint - 1].limits, near[joint - 1]
    lower, upper = max(limits.lower, start - np.pi), min(limits.upper, start + np.pi)
    if lower > upper:
        return q

    def at(places: Array) -> Array:
        starts = np.tile(near, (len(places), 1))
        starts[:, joint - 1] = places
        return members(starts)

    places, width = np.linspace(lower, upper, _TRIED), (upper - lower) / (_TRIED - 1)
    for _ in range(_CLOSER):
        rows = at(places)
        excess = _excess(arm, rows)
        inside = np.flatnonzero(excess < _INSIDE)
        if inside.size:
            return nearest_image(arm, rows[inside[np.abs(places[inside] - start).argmin()]], near)
        around = np.pad(excess, 1, constant_values=np.inf)
        low = np.flatnonzero((excess <= around[:-2]) & (excess <= around[2:]))
        low = low[excess[low].argsort(kind="stable")][:_LEAST]
        fan = np.linspace(-width, width, 2 * _FINER + 1)
        places, width = np.unique(np.clip(places[low][:, None] + fan, lower, upper)), width / _FINER
    return q


def _excess(arm: Arm, q: Array) -> Array:
    """Return how far outside their limits the joints of postures (k, n) are, whole turns aside, summed up (k,)."""
    total = np.zeros(len(q))
    for joint, values in zip(arm.joints, q.T, strict=True):
        lower, upper = joint.limits.lower, joint.limits.upper
        beyond = np.maximum(np.maximum(lower - values, values - upper), 0.0)
        if joint.revolute and np.isfinite(upper - lower):
            aside = np.remainder(values - (lower + upper) / 2 + np.pi, 2 * np.pi) - np.pi
            beyond = np.maximum(np.abs(aside) - (upper - lower) / 2, 0.0)
        elif joint.revolute:
            beyond = np.zeros(len(q))
        total += beyond
    return total
