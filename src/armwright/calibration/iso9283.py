"""A measurement in the terms of ISO 9283: AP and AD of a model, RP of the arm itself.

The position of the model's tool is the command, the measured one is attained. A configuration that was measured once
has an AP all the same, with n = 1; the standard asks for 30 cycles, and their number is reported.

Source:
    ISO 9283:1998, 7.2.1, 7.2.2, 7.3.2.
"""

from __future__ import annotations

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
        AP: mean pose accuracy over all configurations [m].
        AP_largest: the largest [m].
        AD: mean size of the distance accuracy between successive configurations [m].
        AD_largest: the largest [m].
    """

    AP: float
    AP_largest: float
    AD: float
    AD_largest: float


class Repeatability(NamedTuple):
    """How closely an arm comes back.

    Attributes:
        RP: mean pose repeatability over the configurations that were measured more than once [m].
        RP_largest: the largest [m].
        floor: root mean square distance of an attained pose from the mean of its configuration [m].
        configurations: how many were measured more than once.
        cycles: how often at least.
    """

    RP: float
    RP_largest: float
    floor: float
    configurations: int
    cycles: int


def accuracy(measured: Readings, positions: Array) -> Accuracy | None:
    """Return AP and AD of points in the measuring frame; None where there are not two configurations.

    Args:
        measured: m readings.
        positions: (m, 3) of the model's tool in them [m].
    """
    groups = _rows_by_configuration(measured)
    if len(groups) < 2:
        return None
    goals = [positions[rows].mean(axis=0) for rows in groups]
    clouds = [measured.points[rows] for rows in groups]
    ap = np.array([pose_accuracy(cloud, goal, few=True).position for cloud, goal in zip(clouds, goals, strict=True)])
    ad = np.array(
        [
            # Cycles of two configurations are not pairs: their barycentres are.
            distance_accuracy(a.mean(axis=0)[None], b.mean(axis=0)[None], p, q, few=True).distance
            for (a, b), (p, q) in zip(pairwise(clouds), pairwise(goals), strict=True)
        ]
    )
    return Accuracy(float(ap.mean()), float(ap.max()), float(np.abs(ad).mean()), float(np.abs(ad).max()))


def repeatability(measured: Readings) -> Repeatability | None:
    """Return RP of configurations that were measured more than once; None where none was."""
    clouds = [measured.points[rows] for rows in _rows_by_configuration(measured) if len(rows) > 1]
    if not clouds:
        return None
    radii = np.array([pose_repeatability(cloud, few=True).radius for cloud in clouds])
    square = sum(float(np.sum((cloud - cloud.mean(axis=0)) ** 2)) for cloud in clouds)
    degrees_of_freedom = sum(len(cloud) - 1 for cloud in clouds)
    return Repeatability(
        RP=float(radii.mean()),
        RP_largest=float(radii.max()),
        floor=float(np.sqrt(square / degrees_of_freedom)),
        configurations=len(clouds),
        cycles=min(map(len, clouds)),
    )


def _rows_by_configuration(measured: Readings) -> list[Array]:
    """Return by configuration, and payload in it, the rows with a point in the measuring frame."""
    rows = np.flatnonzero(measured.with_point & (measured.frame == 0))
    poses = np.hstack([measured.q, measured.payload])[rows]
    configuration = distinct_configurations(poses) if len(rows) else np.zeros(0, dtype=np.intp)
    return [rows[configuration == i] for i in range(int(configuration.max(initial=-1)) + 1)]
