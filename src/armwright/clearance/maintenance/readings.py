"""What readings of the resting tip of a linkage say of its clearances.

Source:
    Spec of the life, 5.
"""

from __future__ import annotations

import numpy as np

from armwright.arrays import Array
from armwright.clearance.ideal import close_pins, tip_position
from armwright.clearance.linkage import Linkage
from armwright.clearance.maintenance.belief import Measured
from armwright.clearance.maintenance.wear_history import Places, WornGaps, WornShifts

# How far friction moves a journal depends much on its worn wall: the mean is over so many samples.
_FRICTION_SAMPLES = 50


def read_offsets(  # noqa: PLR0917 - what a check consists of
    linkage: Linkage,
    poses: Places,
    gaps: WornGaps,
    offsets: Array,
    readings: Array,
    noise: float,
    believed: tuple[Array, Array],
) -> list[Measured]:
    """Return what the offsets of the resting tip of n linkages say of their clearances.

    The shifts of the pins are added, with the full kinematics of what was believed before. Errors are those of the
    readings, and of friction, which holds each journal anywhere in its cone at every approach.

    Args:
        linkage: that was measured.
        poses: k of them.
        gaps: of its pins there while they wear.
        offsets: (n, k, 2) of the tip, means of the readings [m].
        readings: (k,) numbers of readings.
        noise: standard deviation of a coordinate of one reading [m].
        believed: (n, p) mean clearances of the new pins before, and (n, s, p) samples of their growths [m].
    """
    count, shifts = len(poses.q), gaps.shifts(poses)
    new, samples = believed
    # Growths beyond the life that is tabulated are believed where next to nothing is known; they may be metres.
    samples = np.minimum(samples, gaps.growths[-2])
    growths = samples.mean(axis=1)
    tilts = np.array([-1.0, 0.0, 0.0, 1.0])[:, None, None, None]
    resting = gaps.at(new, growths, np.broadcast_to(tilts, (4, len(new), count, new.shape[1]))).mean(axis=0)
    tips = tips_of(linkage, poses.q, resting)
    across = shifts.at(samples[:, :_FRICTION_SAMPLES])[2]
    # Even chances between -1 and 1 have the variance of a third.
    friction = np.einsum("nskip,nskjp->nkij", across, across) / (3 * across.shape[1])
    rows = []
    for offset, tip, error, *mean in zip(offsets, tips - poses.tip, friction, new, growths, strict=True):
        covariance = np.zeros((count, 2, count, 2))
        for k in range(count):
            covariance[k, :, k] = (error[k] + noise**2 * np.eye(2)) / readings[k]
        linear = _Linear(gaps.clearances, shifts)
        rows.append(
            Measured(
                predicted=linear,
                values=(offset - tip).ravel() + linear(*mean),
                covariance=covariance.reshape(2 * count, 2 * count),
            )
        )
    return rows


def tips_of(linkage: Linkage, q: Array, gaps: Array) -> Array:
    """Return (..., m, 2) positions of the tip with drives as in q (..., m, n) and gaps (..., m, p, 2) of the pins."""
    return tip_position(linkage, close_pins(linkage, q, drives=q[..., list(linkage.driven)], gaps=gaps))


class _Linear:
    """Offsets of the tip at poses, as the sum of those by each pin."""

    def __init__(self, clearances: Array, shifts: WornShifts) -> None:
        self._clearances, self._shifts = clearances, shifts

    def __call__(self, new: Array, growths: Array) -> Array:
        """Return (..., 2 k) offsets [m]."""
        along, by_clearance, _ = self._shifts.at(growths)
        offsets = (along + by_clearance * (new - self._clearances)[..., None, None, :]).sum(axis=-1)
        return np.asarray(offsets.reshape(*offsets.shape[:-2], -1))
