"""How far the hand strays from its path: an upper bound that holds between the looks as well.

The hand is looked at so often on every interval between two knots. Between two looks a time d apart a curve cannot
leave its chord by more than d²/8 times its greatest acceleration; the distance from a straight way is convex, so it
is on the chord no more than at the looks. And how much the hand may accelerate follows from the speeds and
accelerations of the joints, which are known exactly on every interval, and the levers of the arm.

The orientation is held against that which belongs to the planned progress on the way, and, on a single line, against
that which belongs to the position nearest to the hand as well: a hand that lags behind its progress while it turns
would otherwise be turned too far for where it is. On a line shorter than the allowed distance every position is near
enough, and the progress alone counts.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array

# What the bound may add to what was seen, in parts of what is allowed; looks are taken so often that it does not
# exceed it, but no more often than the second.
_ADDED = 0.25
_LOOKS = (4, 200)
# Positions of the hand and entries of its rotation are computed to so many roundings.
_ROUNDINGS = 64 * float(np.finfo(np.float64).eps)


class Ways(NamedTuple):
    """The straight way that belongs to every one of m intervals: from A, by ``shift``, turning by ``turn``.

    Attributes:
        p_A: (m, 3) place at its start [m].
        R_A: (m, 3, 3) orientation at its start.
        shift: (m, 3) from start to end [m].
        turn: (m, 3) rotation vector from start to end, in the axes at the start [rad].
    """

    p_A: Array
    R_A: Array
    shift: Array
    turn: Array

    @staticmethod
    def of_one(A: Array, B: Array, turn: Array, intervals: int) -> Ways:
        """Return one way, from pose A to pose B, for all intervals."""
        parts = A[:3, 3], A[:3, :3], B[:3, 3] - A[:3, 3], turn
        return Ways(*(np.broadcast_to(part, (intervals, *part.shape)) for part in parts))


class Spline(NamedTuple):
    """Joints, and the progress on the way that belongs to them, as cubics of the time since an interval began.

    Attributes:
        lengths: (m,) of the intervals [s].
        joints: (m, 4, n) coefficients of the joint positions.
        progress: (m, 4) coefficients of the fraction of the way.
    """

    lengths: Array
    joints: Array
    progress: Array


class Deviation(NamedTuple):
    """How far the hand strays on each of m intervals.

    Attributes:
        place: (m,) upper bound of the distance from the way [m].
        turn: (m,) upper bound of the angle from the orientation that belongs to the progress on the way, and, where
            that was asked for, to the position on it [rad].
        backward: upper bound of how far the hand runs backwards along a single line [m]; 0 where not asked for.
        seen: (m,) the largest distance that was seen [m].
        seen_turn: (m,) the largest angle that was seen [rad].
        speed: (m, n) the largest speeds of the joints, exactly.
        acceleration: (m, n) the same of their accelerations.
        worst: (m,) where the largest distance was seen, as a part of the interval.
        looks: how often the hand was looked at on an interval.
    """

    place: Array
    turn: Array
    backward: float
    seen: Array
    seen_turn: Array
    speed: Array
    acceleration: Array
    worst: Array
    looks: int


def deviation_of(
    arm: Arm,
    forward: object,
    ways: Ways,
    spline: Spline,
    *,
    allowed: float,
    allowed_turn: float,
    by_position: bool = False,
) -> Deviation:
    """Return how far a motion strays from straight ways.

    Args:
        arm: the arm, with n joints.
        forward: tool poses (..., 4, 4) of joint positions (..., n).
        ways: where the hand should be.
        spline: where it is.
        allowed: the distance that matters [m]; it decides how often the hand is looked at.
        allowed_turn: the angle that matters [rad].
        by_position: whether all intervals are of one line, on which the orientation is held against the position of
            the hand too, and running backwards is looked for.
    """
    qd, qdd = cubic_peaks(spline.joints, spline.lengths)
    hand = hand_bounds(arm, spline.joints, spline.lengths, qd, qdd)
    sd, sdd = (peaks[:, 0] for peaks in cubic_peaks(spline.progress[..., None], spline.lengths))
    angle = np.sqrt(np.einsum("mi,mi->m", ways.turn, ways.turn))
    spin = _spin_of(hand, angle * sdd, angle * sd)
    size = np.sqrt(np.einsum("mi,mi->m", ways.shift, ways.shift))
    placed = by_position and bool(size[0] > allowed)
    # As an estimate the hand moves along the line as was planned; the bound below does without.
    most = np.maximum(spin, _spin_of(hand, angle * hand.pull / size, angle * sd)) if placed else spin
    wanted = np.sqrt(np.maximum(hand.pull / allowed, 2 * most / allowed_turn) / (8 * _ADDED)) * spline.lengths
    looks = int(min(max(math.ceil(wanted.max()), _LOOKS[0]), _LOOKS[1]))
    part = np.linspace(0.0, 1.0, looks + 1)
    t = part * spline.lengths[:, None]
    c = spline.joints
    q = ((c[:, None, 3] * t[..., None] + c[:, None, 2]) * t[..., None] + c[:, None, 1]) * t[..., None] + c[:, None, 0]
    X = forward(q)  # type: ignore[operator]
    along = _along(ways, X)
    off = _distances(ways, X, along)
    s = spline.progress
    done = ((s[:, 3, None] * t + s[:, 2, None]) * t + s[:, 1, None]) * t + s[:, 0, None]
    half = _half_sines(ways, done, X).max(axis=1)
    step = spline.lengths / looks
    between = step**2 / 8
    bound, backward = half + between * spin, 0.0
    if placed:
        # Of the position on the line: how fast it can change, from where it is seen, and how far beyond the ends it is.
        hurry = hand.pull / size
        rate = np.abs(np.diff(along, axis=1)).max(axis=1) / step + step * hurry
        beyond = np.maximum(np.maximum(-along, along - 1).max(axis=1) + between * hurry, 0.0)
        seen_half = _half_sines(ways, along, X).max(axis=1)
        by_place = seen_half + between * _spin_of(hand, angle * hurry, angle * rate) + angle * beyond / 2
        half, bound = np.maximum(half, seen_half), np.maximum(bound, by_place)
        backward = _backward(along * size[:, None], between * hand.pull)
    seen = off.max(axis=1)
    return Deviation(
        place=seen + between * hand.pull + _ROUNDINGS * (1.0 + np.abs(ways.p_A).max()),
        turn=2 * np.arcsin(np.minimum(bound, 1.0)) + _ROUNDINGS,
        backward=backward,
        seen=seen,
        seen_turn=2 * np.arcsin(np.minimum(half, 1.0)),
        speed=qd,
        acceleration=qdd,
        worst=part[off.argmax(axis=1)],
        looks=looks,
    )


def _backward(along: Array, between: Array) -> float:
    """Return how far a hand at most runs back along its line, from looks (m, k) [m] and what lies between them (m,)."""
    farthest = np.maximum.accumulate(along.ravel()).reshape(along.shape)
    back = (farthest - along).max(axis=1)
    # Between two looks the hand is off the chord by so much at most, before it turns back and after. Where the chord
    # rises by four times that, the hand never turns back.
    rising = np.diff(along, axis=1).min(axis=1) > 4 * between
    return float(np.where(rising & (back <= 0), 0.0, back + 2 * between.max()).max())


def turned(turn: Array, fraction: Array) -> Array:
    """Return the rotations (m, k, 3, 3) by fractions (m, k) of rotation vectors (m, 3)."""
    angle = np.sqrt(np.einsum("mi,mi->m", turn, turn))
    x, y, z = (turn / np.where(angle > 0, angle, 1.0)[:, None]).T
    o = np.zeros_like(x)
    K = np.stack([o, -z, y, z, o, -x, -y, x, o], axis=-1).reshape(-1, 1, 3, 3)
    phase = (angle[:, None] * fraction)[..., None, None]
    return np.asarray(np.eye(3) + np.sin(phase) * K + (2 * np.sin(phase / 2) ** 2) * (K @ K))


def _along(ways: Ways, X: Array) -> Array:
    """Return the fractions (m, k) of their ways, or of what goes on beyond them, that hands (m, k, 4, 4) are at."""
    come = X[..., :3, 3] - ways.p_A[:, None]
    square = np.einsum("mi,mi->m", ways.shift, ways.shift)
    return np.asarray((come @ ways.shift[:, :, None])[..., 0] / np.where(square > 0, square, 1.0)[:, None])


def _distances(ways: Ways, X: Array, along: Array) -> Array:
    """Return the distances (m, k) of hands (m, k, 4, 4) from their ways."""
    come = X[..., :3, 3] - ways.p_A[:, None]
    off = come - np.clip(along, 0.0, 1.0)[..., None] * ways.shift[:, None]
    return np.asarray(np.sqrt(np.einsum("mki,mki->mk", off, off)))


def _half_sines(ways: Ways, done: Array, X: Array) -> Array:
    """Return sin(angle / 2) of the turn (m, k) from the orientation on the way to that of the hand."""
    return half_sines(ways.R_A[:, None] @ turned(ways.turn, done), X[..., :3, :3])


def half_sines(R_A: Array, R_B: Array) -> Array:
    """Return sin(angle / 2) (...) of the turns from rotations (..., 3, 3) to others, small ones to all digits."""
    Q = np.swapaxes(R_A, -1, -2) @ R_B
    w = np.sqrt(np.maximum(1 + Q[..., 0, 0] + Q[..., 1, 1] + Q[..., 2, 2], 1e-12)) / 2
    a, b, c = Q[..., 2, 1] - Q[..., 1, 2], Q[..., 0, 2] - Q[..., 2, 0], Q[..., 1, 0] - Q[..., 0, 1]
    return np.asarray(np.sqrt(a * a + b * b + c * c) / (4 * w))


def _spin_of(hand: HandBounds, change: Array, rate: Array) -> Array:
    """Return an upper bound (m,) of the acceleration of half the turn of the hand off an orientation that turns itself.

    The turn off it is a unit quaternion; the second derivative of its vector part is at most half the angular
    acceleration and a quarter of the squared angular speed.

    Args:
        hand: how the hand moves.
        change: (m,) angular acceleration of that orientation, at most [rad/s²].
        rate: (m,) its angular speed, at most [rad/s].
    """
    return np.asarray((hand.spin_change + change + hand.spin * rate) / 2 + (hand.spin + rate) ** 2 / 4)


class HandBounds(NamedTuple):
    """Upper bounds of how the hand moves on m intervals, (m,) each.

    Attributes:
        pull: acceleration [m/s²].
        spin: angular speed [rad/s].
        spin_change: angular acceleration [rad/s²].
    """

    pull: Array
    spin: Array
    spin_change: Array


def hand_bounds(arm: Arm, joints: Array, lengths: Array, qd: Array, qdd: Array) -> HandBounds:
    """Return upper bounds of how the hand moves on intervals.

    The hand accelerates by sum J_i qdd_i + sum H_ij qd_i qd_j, where |J_i| is at most the lever r_i of joint i and
    |H_ij| at most that of the later of two joints that turn.

    Args:
        arm: the arm, with n joints.
        joints: (m, 4, n) coefficients of the joint positions.
        lengths: (m,) of the intervals [s].
        qd: (m, n) the largest speeds of the joints on them.
        qdd: (m, n) the largest accelerations.
    """
    turns = np.array([joint.revolute for joint in arm.joints])
    lever = np.where(turns, _levers(arm, joints, lengths), 1.0)
    n = arm.n
    later = np.maximum(np.arange(n)[:, None], np.arange(n))
    both = turns[:, None] & turns
    # A slide is turned by the joints before it; those beyond it do not change its direction.
    carried = turns[np.minimum(np.arange(n)[:, None], np.arange(n))] & ~turns[later]
    H = np.where(both, lever[later], np.where(carried & ~np.eye(n, dtype=bool), 1.0, 0.0))
    pull = qdd @ lever + np.einsum("mi,ij,mj->m", qd, H, qd)
    spin_change = qdd @ turns + np.einsum("mi,ij,mj->m", qd, np.triu(both, 1).astype(np.float64), qd)
    return HandBounds(np.asarray(pull), np.asarray(qd @ turns), np.asarray(spin_change))


def cubic_peaks(c: Array, lengths: Array) -> tuple[Array, Array]:
    """Return the largest speeds and accelerations (m, n) of cubics (m, 4, n), exactly."""
    h = lengths[:, None]
    start, bend, end = c[:, 1], 2 * c[:, 2], c[:, 1] + (2 * c[:, 2] + 3 * c[:, 3] * h) * h
    bend_end = bend + 6 * c[:, 3] * h
    speed = np.maximum(np.abs(start), np.abs(end))
    # The speed has its own peak where the acceleration changes its sign.
    inside = bend * bend_end < 0
    vertex = start - bend**2 / np.where(inside, 12 * c[:, 3], 1.0)
    speed = np.where(inside, np.maximum(speed, np.abs(vertex)), speed)
    return speed, np.maximum(np.abs(bend), np.abs(bend_end))


def turning_points(c: Array, lengths: Array) -> Array:
    """Return the times (2, m, n) at which cubics (m, 4, n) turn round, exactly; an end where there is no such time."""
    a, b, start = 3 * c[:, 3], c[:, 2], c[:, 1]
    root = np.sqrt(np.maximum(b * b - a * start, 0.0))
    # Of a t² + 2 b t + start = 0 the root of larger size without cancellation, and the other by their product.
    large = -b - np.copysign(root, b)
    with np.errstate(divide="ignore", invalid="ignore"):
        times = np.stack([large / a, start / large])
    return np.clip(np.nan_to_num(times, nan=0.0, posinf=0.0, neginf=0.0), 0.0, lengths[:, None])


def _levers(arm: Arm, joints: Array, lengths: Array) -> Array:
    """Return the largest distance (n,) of the tool from the frame before each joint, slides as far out as they go."""
    h = lengths[:, None]
    c = np.abs(joints)
    farthest = (((c[:, 3] * h + c[:, 2]) * h + c[:, 1]) * h + c[:, 0]).max(axis=0)
    parts = [joint.span(0.0 if joint.revolute else farthest[i]) for i, joint in enumerate(arm.joints)]
    tool = float(np.linalg.norm(arm.tool[:3, 3]))
    return np.asarray(np.cumsum([tool, *parts[::-1]])[:0:-1])
