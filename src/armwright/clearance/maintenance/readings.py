"""What readings of the resting tip of a linkage say of its clearances.

Source:
    Spec of the life, 5.
"""

from __future__ import annotations

import numpy as np

from armwright.arrays import Array
from armwright.clearance.maintenance.belief import Measured
from armwright.clearance.maintenance.maintained_linkage import MaintainedLinkage, Places
from armwright.clearance.settings import contact_stiffness
from armwright.clearance.static_equilibrium import find_static_equilibrium


def read_offsets(  # noqa: PLR0917 - what a check consists of
    machine: MaintainedLinkage, poses: Places, offsets: Array, readings: Array, noise: float, believed: Array
) -> list[Measured]:
    """Return what the offsets of the resting tip of n linkages say of their clearances.

    The equations are linear about what was believed before; their errors are those of the readings, and of friction,
    which holds each journal anywhere in its cone at every approach.

    Args:
        machine: that was measured.
        poses: k of them.
        offsets: (n, k, 2) of the tip, means of the readings [m].
        readings: (k,) numbers of readings.
        noise: standard deviation of a coordinate of one reading [m].
        believed: (n, p) mean clearances before [m].
    """
    linkage, count = machine.linkage, len(poses.q)
    about = believed[:, None]
    rest = find_static_equilibrium(linkage, poses.q, about, contact_stiffness(linkage, about))
    design = poses.along.reshape(2 * count, -1)
    rows = []
    for offset, tip, c in zip(offsets, rest.tip - poses.tip, believed, strict=True):
        errors = poses.friction_covariance(c, machine.cone) + noise**2 * np.eye(2)
        covariance = np.zeros((count, 2, count, 2))
        for k in range(count):
            covariance[k, :, k] = errors[k] / readings[k]
        values = (offset - tip).ravel() + design @ c
        rows.append(Measured(design=design, values=values, covariance=covariance.reshape(2 * count, 2 * count)))
    return rows
