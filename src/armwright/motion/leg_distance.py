"""How far the tool gets from straight legs: an upper bound that is hardly above the largest sampled distance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from armwright.arrays import Array
from armwright.motion.deviation import cubic_peaks, hand_bounds
from armwright.motion.polynomials import evaluate
from armwright.motion.solver import Solver
from armwright.motion.trajectory import Trajectory

# Samples on every interval to begin with and at most; doubled while more than this part is added to what they show.
_SAMPLES, _MAX_SAMPLES, _ADDED = 8, 128, 0.1
# A distance below this is not sampled more closely [m].
_SMALL = 1e-9


class LegDistance(NamedTuple):
    """How far a tool gets from its straight legs.

    Attributes:
        bound: upper bound [m].
        sampled: the largest at the samples and on the chords between them [m].
        time: when that is, to an interval between two knots [s].
    """

    bound: float
    sampled: float
    time: float


def farthest_from_legs(solver: Solver, trajectory: Trajectory, positions: Array, times: Array) -> LegDistance:
    """Return how far the tool gets from its straight legs, each of which counts only while it is followed.

    Up to the middle of the first leg behind a corner, and from the middle of the leg before it, the nearer of these two
    legs counts. The tool is sampled on every interval between two knots. Between two samples a time d apart it leaves
    its chord by no more than d²/8 times its greatest acceleration, and the distance from a leg is convex, so that on
    the chord it is no larger than at the samples.

    Args:
        solver: the arm, with n joints.
        trajectory: of the joints, cubics on m segments.
        positions: (k, 3) the ends of the legs, one after the other [m].
        times: (k,) when the trajectory passes them [s].
    """
    h = np.diff(trajectory.times)
    bounds = hand_bounds(solver.arm, trajectory.coefficients, h, *cubic_peaks(trajectory.coefficients, h))
    middles_of_legs = (times[1:] + times[:-1]) / 2
    leg = np.searchsorted(middles_of_legs[1:-1], (trajectory.times[1:] + trajectory.times[:-1]) / 2)
    samples = _SAMPLES
    while True:
        part = (np.arange(samples + 1) / samples)[:, None]
        q = np.stack([evaluate(trajectory.coefficients, (p * h)[:, None]) for p in part])
        distance = _chord_distances(solver.forward(q)[..., :3, 3], positions, leg)
        bound = float((distance + (h / samples) ** 2 / 8 * bounds.pull).max())
        if samples == _MAX_SAMPLES or bound <= (1 + _ADDED) * float(distance.max()) + _SMALL:
            worst = int(distance.max(axis=0).argmax())
            return LegDistance(bound, float(distance.max()), float(trajectory.times[worst]))
        samples *= 2


def _chord_distances(p: Array, positions: Array, leg: npt.NDArray[np.intp]) -> Array:
    """Return the largest distances (l, m) of chords from the legs that count there.

    A chord from beside one leg to beside the next is cut where it is nearest to the corner between them.

    Args:
        p: (l + 1, m, 3) positions of the tool.
        positions: (k, 3) ends of the legs.
        leg: (m,) the first of the two legs that count.
    """
    A = positions[leg]
    if len(positions) == 2:
        distance = _leg_distance(p, A, positions[leg + 1])
        return np.asarray(np.maximum(distance[1:], distance[:-1]))
    corner, B = positions[leg + 1], positions[leg + 2]
    first, second = _leg_distance(p, A, corner), _leg_distance(p, corner, B)
    start, chord = p[:-1], p[1:] - p[:-1]
    square = np.einsum("lmi,lmi->lm", chord, chord)
    part = np.einsum("lmi,lmi->lm", corner - start, chord) / np.where(square > 0, square, 1.0)
    cut = start + np.clip(part, 0.0, 1.0)[..., None] * chord
    at_cut = np.maximum(_leg_distance(cut, A, corner), _leg_distance(cut, corner, B))
    around = np.maximum(np.maximum(first[:-1], at_cut), second[1:])
    return np.asarray(np.minimum(around, np.minimum(*(np.maximum(each[1:], each[:-1]) for each in (first, second)))))


def _leg_distance(p: Array, A: Array, B: Array) -> Array:
    """Return the distances (l, m) of positions (l, m, 3) from straight legs between others (m, 3)."""
    leg = B - A
    square = np.einsum("mi,mi->m", leg, leg)
    along = np.clip(np.einsum("lmi,mi->lm", p - A, leg) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    return np.asarray(np.linalg.norm(p - A - along[..., None] * leg, axis=-1))
