"""What a hand does beside the straight legs that it was asked to follow, seen from outside: from where it was alone."""

from typing import NamedTuple

import numpy as np

from armwright.arrays import Array
from armwright.spatial.rotations import angle_between, rotation_vector

# A distance that rises or falls by less than this, beside one of the size of a corner, is rounding of the joints' path.
HYSTERESIS = 0.002
# A radian of turning counts as so much way [m].
LEVER = 0.2


class OneLeg(NamedTuple):
    """How a hand went along one leg.

    Attributes:
        farthest: largest distance from the leg or from those beside it, whichever is nearer [m], or angle [rad].
        middle: the same in its middle third; 0 where the hand was not seen there.
        turns: how often the distance turned from rising to falling or back, in each half of the leg.
        missed: shortest distance from its end [m], or angle.
    """

    farthest: float
    middle: float
    turns: tuple[int, int]
    missed: float


def beside_legs(X_hand: Array, X: Array, scale: float) -> list[OneLeg]:
    """Return how a hand went along straight legs.

    Args:
        X_hand: (m, 4, 4) where it was, one moment after the other.
        X: (k, 4, 4) poses between which the legs are.
        scale: what counts: the distance of a corner; turns of the distance by less than a part of it do not.
    """
    passed, hand, corners = _moments(X_hand, X, 0.0), X_hand[:, :3, 3], X[:, :3, 3]
    count = len(corners) - 1
    off = [_off(hand, corners[i], corners[i + 1]) for i in range(count)]
    legs = []
    for i in range(count):
        now = slice(passed[i], passed[i + 1] + 1)
        nearest = np.min([off[k][now] for k in range(max(i - 1, 0), min(i + 2, count))], axis=0)
        legs.append(_along(hand[now], corners[i], corners[i + 1], scale, nearest))
    return legs


def turns_beside_legs(X_hand: Array, X: Array, scale: float) -> list[OneLeg | None]:
    """Return the same of orientations, as rotation vectors from the start of a leg; ``scale`` is an angle.

    Legs that turn by less than four corners are None: they have no middle.
    """
    passed, R = _moments(X_hand, X, LEVER), X_hand[:, :3, :3]
    legs: list[OneLeg | None] = []
    for i in range(len(X) - 1):
        home = X[i, :3, :3].T
        end = rotation_vector(home @ X[i + 1, :3, :3])
        now = slice(passed[i], passed[i + 1] + 1)
        seen = rotation_vector(home @ R[now])
        # Angles from the legs beside it, in the axes at their own starts.
        off = [
            _off(
                rotation_vector(X[k, :3, :3].T @ R[now]),
                np.zeros(3),
                rotation_vector(X[k, :3, :3].T @ X[k + 1, :3, :3]),
            )
            for k in range(max(i - 1, 0), min(i + 2, len(X) - 1))
        ]
        leg = None if np.linalg.norm(end) < 4 * scale else _along(seen, np.zeros(3), end, scale, np.min(off, axis=0))
        legs.append(leg)
    return legs


def _moments(X_hand: Array, X: Array, lever: float) -> list[int]:
    """Return when the hand passes each pose: in order, as near as can be to all of them, turns counted by a lever."""
    away = np.linalg.norm(X_hand[:, None, :3, 3] - X[:, :3, 3], axis=-1)
    away = away + lever * angle_between(X_hand[:, None, :3, :3], X[:, :3, :3])
    last = len(X_hand) - 1
    moments, sums = [last], []
    best = np.where(np.arange(len(X_hand)) == 0, 0.0, np.inf)
    for i in range(1, len(X) - 1):
        before = np.minimum.accumulate(best)
        sums.append(before)
        best = np.concatenate([[np.inf], before[:-1]]) + away[:, i]
    for i in range(len(X) - 2, 0, -1):
        upto = moments[-1]
        costs = np.concatenate([[np.inf], sums[i - 1][:-1]]) + away[:, i]
        moments.append(int(costs[:upto].argmin()))
    return [0, *moments[:0:-1], last]


def _part(hand: Array, A: Array, B: Array) -> Array:
    leg = B - A
    return np.asarray((hand - A) @ leg / max(leg @ leg, 1e-30))


def _off(hand: Array, A: Array, B: Array) -> Array:
    return np.asarray(np.linalg.norm(hand - A - np.clip(_part(hand, A, B), 0.0, 1.0)[:, None] * (B - A), axis=-1))


def _along(hand: Array, A: Array, B: Array, scale: float, nearest: Array) -> OneLeg:
    part, off = _part(hand, A, B), _off(hand, A, B)
    middle = off[(part > 1 / 3) & (part < 2 / 3)]
    halves = off[part < 0.5], off[part >= 0.5]
    first, second = (_turns(half, HYSTERESIS * scale) for half in halves)
    missed = float(np.linalg.norm(hand - B, axis=-1).min())
    return OneLeg(float(nearest.max()), float(middle.max(initial=0.0)), (first, second), missed)


def _turns(values: Array, hysteresis: float) -> int:
    """Return how often values turn from rising to falling or back, by more than the hysteresis."""
    turns, way, last = 0, 0, values[0] if len(values) else 0.0
    for value in values:
        if (way >= 0 and value > last) or (way <= 0 and value < last):
            if way == 0:
                if abs(value - last) <= hysteresis:
                    continue
                way = 1 if value > last else -1
            last = value
        elif abs(value - last) > hysteresis:
            turns, way, last = turns + 1, -way, value
    return turns
