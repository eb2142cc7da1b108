"""How far the hand gets off straight legs: an upper bound that is hardly above what is seen."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from armwright.arrays import Array
from armwright.motion.deviation import cubic_peaks, hand_bounds
from armwright.motion.polynomials import evaluate
from armwright.motion.solver import Solver
from armwright.motion.trajectory import Trajectory

# Looks on every interval to begin with and at most; doubled while more than this part is added to what is seen.
_LOOKS, _MOST, _ADDED = 8, 128, 0.1
# A distance below this is not looked at more closely [m].
_SMALL = 1e-9


class LegDistance(NamedTuple):
    """How far a hand gets off its straight legs.

    Attributes:
        bound: upper bound [m].
        sampled: the largest at the samples and on the chords between them [m].
        time: when that is, to an interval between two knots [s].
    """

    bound: float
    sampled: float
    time: float


def farthest_from_legs(solver: Solver, trajectory: Trajectory, places: Array) -> LegDistance:
    """Return how far the hand gets from the nearest of its straight legs.

    The hand is looked at on every interval between two knots. Between two looks a time d apart it leaves its chord by
    no more than d²/8 times its greatest acceleration, and the distance from a leg is convex, so that on the chord it is
    no larger than at the looks.

    Args:
        solver: the arm, with n joints.
        trajectory: of the joints, cubics on m segments.
        places: (k, 3) the ends of the legs, one after the other [m].
    """
    h = np.diff(trajectory.times)
    bounds = hand_bounds(solver.arm, trajectory.coefficients, h, *cubic_peaks(trajectory.coefficients, h))
    looks = _LOOKS
    while True:
        part = (np.arange(looks + 1) / looks)[:, None]
        q = np.stack([evaluate(trajectory.coefficients, (p * h)[:, None]) for p in part])
        off = _off_chords(solver.forward(q)[..., :3, 3], places)
        most = float((off + (h / looks) ** 2 / 8 * bounds.pull).max())
        if looks == _MOST or most <= (1 + _ADDED) * float(off.max()) + _SMALL:
            return LegDistance(most, float(off.max()), float(trajectory.times[int(off.max(axis=0).argmax())]))
        looks *= 2


def _off_chords(p: Array, places: Array) -> Array:
    """Return the largest distances (l, m) of the chords between places of the hand (l + 1, m, 3) from their legs.

    A chord from beside one leg to beside the next is cut where it is nearest to the corner between them.
    """
    off = [_off_leg(p, A, B) for A, B in pairwise(places)]
    nearest = np.min([np.maximum(each[1:], each[:-1]) for each in off], axis=0)
    start, way = p[:-1], p[1:] - p[:-1]
    square = np.einsum("lmi,lmi->lm", way, way)
    for i, corner in enumerate(places[1:-1]):
        part = np.einsum("lmi,lmi->lm", corner - start, way) / np.where(square > 0, square, 1.0)
        cut = start + np.clip(part, 0.0, 1.0)[..., None] * way
        at_cut = np.maximum(_off_leg(cut, *places[i : i + 2]), _off_leg(cut, *places[i + 1 : i + 3]))
        nearest = np.minimum(nearest, np.maximum(np.maximum(off[i][:-1], at_cut), off[i + 1][1:]))
    return np.asarray(nearest)


def _off_leg(p: Array, A: Array, B: Array) -> Array:
    """Return the distances (...) of places (..., 3) from the straight leg between two others."""
    way = B - A
    square = float(way @ way)
    along = np.clip((p - A) @ way / square, 0.0, 1.0) if square else np.zeros(p.shape[:-1])
    return np.asarray(np.linalg.norm(p - A - along[..., None] * way, axis=-1))
