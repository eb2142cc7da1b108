"""What a measurement says of an arm in the words of ISO 9283: AP and AD of a model, RP of the arm itself.

Where the model has the tool is what is commanded, where it was measured is what is attained. A posture that was
measured once has an AP all the same, as it has with n = 1; the standard asks for 30 cycles, and the number is told.

Source:
    ISO 9283:1998, 7.2.1, 7.2.2, 7.3.2.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from armwright.accuracy.distance import distance_accuracy
from armwright.accuracy.pose import pose_accuracy, pose_repeatability
from armwright.arrays import Array
from armwright.calibration.cross_validation import distinct_configurations
from armwright.calibration.readings import Readings


class Accuracy(NamedTuple):
    """How far attained poses are from commanded ones.

    Attributes:
        AP: mean pose accuracy over all postures [m].
        AP_largest: the largest [m].
        AD: mean size of the distance accuracy between postures that follow one another [m].
        AD_largest: the largest [m].
    """

    AP: float
    AP_largest: float
    AD: float
    AD_largest: float


class Repeatability(NamedTuple):
    """How closely an arm comes back.

    Attributes:
        RP: mean pose repeatability over the postures that were measured more than once [m].
        RP_largest: the largest [m].
        floor: root mean square distance of an attained pose from the mean of its posture [m].
        configurations: how many were measured more than once.
        cycles: how often at least.
    """

    RP: float
    RP_largest: float
    floor: float
    configurations: int
    cycles: int


def accuracy(seen: Readings, places: Array) -> Accuracy | None:
    """Return AP and AD of points in the measuring frame; None where there are not two postures.

    Args:
        seen: m readings.
        places: (m, 3) where a model has the tool in them [m].
    """
    groups = _groups(seen)
    if len(groups) < 2:
        return None
    goals = [places[rows].mean(axis=0) for rows in groups]
    clouds = [seen.points[rows] for rows in groups]
    ap = np.array([pose_accuracy(cloud, goal, few=True).position for cloud, goal in zip(clouds, goals, strict=True)])
    ad = np.array(
        [
            # Cycles of two postures are not pairs: their barycentres are.
            distance_accuracy(a.mean(axis=0)[None], b.mean(axis=0)[None], p, q, few=True).distance
            for (a, b), (p, q) in zip(pairwise(clouds), pairwise(goals), strict=True)
        ]
    )
    return Accuracy(float(ap.mean()), float(ap.max()), float(np.abs(ad).mean()), float(np.abs(ad).max()))


def repeatability(seen: Readings) -> Repeatability | None:
    """Return RP of postures that were measured more than once; None where none was."""
    clouds = [seen.points[rows] for rows in _groups(seen) if len(rows) > 1]
    if not clouds:
        return None
    radii = np.array([pose_repeatability(cloud, few=True).radius for cloud in clouds])
    square = sum(float(np.sum((cloud - cloud.mean(axis=0)) ** 2)) for cloud in clouds)
    freedom = sum(len(cloud) - 1 for cloud in clouds)
    return Repeatability(
        RP=float(radii.mean()),
        RP_largest=float(radii.max()),
        floor=float(np.sqrt(square / freedom)),
        configurations=len(clouds),
        cycles=min(map(len, clouds)),
    )


def _groups(seen: Readings) -> list[Array]:
    """Return by posture the rows that tell a point in the measuring frame."""
    rows = np.flatnonzero(seen.with_point & (seen.frame == 0))
    posture = distinct_configurations(seen.q[rows]) if len(rows) else np.zeros(0, dtype=np.intp)
    return [rows[posture == i] for i in range(int(posture.max(initial=-1)) + 1)]
