"""Where the joints go, whatever the time: paths as pieces without corners, and grids on them.

A path is a trajectory of which only the positions count; its time is a mere parameter s.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.errors import InvalidValueError
from armwright.motion.polynomials import derivative, evaluate, shifted
from armwright.motion.trajectory import Trajectory
from armwright.motion.xspline_path import xspline

# Speeds that differ by this part of the largest one of the path are the same; what is slower stands.
_SAME = 1e-8
# A path is in one piece if nothing jumps farther than this [rad] or [m].
_JUMP = 1e-9
# Samples of a segment to measure its path with; this part of the mean rate is added, for positions where the path
# stands.
_SAMPLES = 129
_EVEN = 0.1
# The first interval out of a position where the joints stand, and the last one into it, are cut at these parts.
_STEEP = 2.0 ** -np.arange(5, 0, -1)


class Piece(NamedTuple):
    """A part of a path that can be passed without a stop.

    Attributes:
        path: of the joints; what it calls time is the parameter s, scaled so that at s' = 1 it is just run at full
            speed in its fastest position.
        origins: (m,) where its segments begin, in the parameter that was given.
        scale: parameters s for one parameter that was given.
        rests: whether the joints stand at its start and at its end whatever s' is.
    """

    path: Trajectory
    origins: Array
    scale: float
    rests: tuple[bool, bool]


class Grid(NamedTuple):
    """A piece cut into N intervals, each inside one polynomial.

    Attributes:
        lengths: (N,) of the intervals in s.
        local: (N, k, n) coefficients of the powers of s since the interval began.
        origins: (N,) where they begin, in the parameter that was given.
    """

    lengths: Array
    local: Array
    origins: Array

    def at(self, part: float, order: int) -> Array:
        """Return positions or derivatives by s (N, n) at a part of every interval."""
        return evaluate(derivative(self.local, order), (part * self.lengths)[:, None])


def through_knots(arm: Arm, knots: Array) -> Trajectory:
    """Return the X-spline through knots (k, n), which runs on at both ends as the parabola of three knots does.

    Raises:
        InvalidValueError: two neighbouring knots are the same point.
    """
    steps = np.abs(np.diff(knots, axis=0) / natural_speeds(arm, knots)).max(axis=1)
    for i in np.flatnonzero(steps <= _JUMP):
        raise InvalidValueError(f"path: knots {i + 1} and {i + 2} coincide; omit one of them")
    times = np.concatenate([[0.0], np.cumsum(steps)])
    slopes = np.diff(knots, axis=0) / steps[:, None]
    if len(knots) == 2:
        return xspline(times, knots, slopes[0], slopes[0])
    curves = np.diff(slopes, axis=0) / (steps[:-1] + steps[1:])[:, None]
    return xspline(times, knots, slopes[0] - steps[0] * curves[0], slopes[-1] + steps[-1] * curves[-1])


def natural_speeds(arm: Arm, points: Array) -> Array:
    """Return for every joint (n,) what is fast for it on a path through positions (k, n), by its limits."""
    with np.errstate(invalid="ignore"):
        by_acceleration = np.sqrt(arm.limits.acceleration * np.ptp(points, axis=0))
    fast = np.fmin(arm.limits.speed, np.where(by_acceleration > 0, by_acceleration, np.inf))
    return np.where(np.isfinite(fast), fast, 1.0)


def pieces_of(arm: Arm, path: Trajectory) -> list[Piece]:
    """Return the pieces of a path, between which the joints stand; none where nothing moves.

    They must stand at corners, and do so where the given motion stands.

    Raises:
        InvalidValueError: a joint jumps.
    """
    lengths = np.diff(path.times)
    moving = (lengths > 0) & (np.abs(path.coefficients[:, 1:]) > 0).any(axis=(1, 2))
    if not moving.any():
        return []
    lengths, terms, origins = lengths[moving], path.coefficients[moving], path.times[:-1][moving]
    speeds = natural_speeds(arm, path(path.times))
    grid = Grid(lengths, terms, origins)
    _check_joined(grid)
    starts, ends = grid.at(0.0, 1) / speeds, grid.at(1.0, 1) / speeds
    top = max(float(np.abs(grid.at(part, 1) / speeds).max()) for part in np.linspace(0.0, 1.0, _SAMPLES))
    corners = np.abs(starts[1:] - ends[:-1]).max(axis=1) > _SAME * top
    stands = np.abs(starts[1:]).max(axis=1) <= _SAME * top
    cuts = (np.flatnonzero(corners | stands) + 1).tolist()
    pieces = []
    for first, last in zip((0, *cuts), (*cuts, len(lengths)), strict=True):
        part = slice(first, last)
        piece = Trajectory(times=np.concatenate([[0.0], np.cumsum(lengths[part])]), coefficients=terms[part])
        rests = tuple(bool(np.abs(rate).max() <= _SAME * top) for rate in (starts[first], ends[last - 1]))
        pieces.append(Piece(piece.slowed(top), origins[part], top, (rests[0], rests[1])))
    return pieces


def gridded(arm: Arm, piece: Piece, intervals: int) -> Grid:
    """Cut a piece into about so many intervals, two at least in each of its segments.

    They are those that a run which gathers speed evenly up to the middle, and loses it again, passes in equal times:
    close to one another at the ends, where it is slow.
    """
    path = piece.path
    lengths = np.diff(path.times)
    full = Grid(lengths, path.coefficients, piece.origins)
    speeds = natural_speeds(arm, path(path.times))
    parts = np.linspace(0.0, 1.0, _SAMPLES)
    rates = np.stack([np.abs(full.at(part, 1) / speeds).max(axis=1) for part in parts], axis=1)
    rates += _EVEN * rates.mean()
    ways = (rates[:, 1:] + rates[:, :-1]) / 2 * (lengths / (_SAMPLES - 1))[:, None]
    done = np.concatenate([[0.0], np.cumsum(ways)])
    done /= done[-1]
    moments = np.where(done < 0.5, np.sqrt(done / 2), 1 - np.sqrt((1 - np.minimum(done, 1.0)) / 2))
    cuts = []
    for k in range(len(lengths)):
        of_segment = moments[k * (_SAMPLES - 1) : (k + 1) * (_SAMPLES - 1) + 1]
        count = max(2, round(intervals * (of_segment[-1] - of_segment[0])))
        cuts.append(np.interp(np.linspace(of_segment[0], of_segment[-1], count + 1), of_segment, parts))
    # Out of a position where the joints stand whatever s' is, s' falls steeply at first.
    if piece.rests[0]:
        cuts[0] = np.concatenate([[0.0], cuts[0][1] * _STEEP, cuts[0][1:]])
    if piece.rests[1]:
        cuts[-1] = np.concatenate([cuts[-1][:-1], 1 - (1 - cuts[-1][-2]) * _STEEP[::-1], [1.0]])
    segments = np.repeat(np.arange(len(lengths)), [len(cut) - 1 for cut in cuts])
    begins = np.concatenate([cut[:-1] for cut in cuts]) * lengths[segments]
    steps = np.concatenate([np.diff(cut) for cut in cuts]) * lengths[segments]
    local = shifted(path.coefficients[segments], begins)
    return Grid(steps, local, piece.origins[segments] + begins / piece.scale)


def _check_joined(grid: Grid) -> None:
    gaps = np.abs(grid.at(0.0, 0)[1:] - grid.at(1.0, 0)[:-1])
    if gaps.size and gaps.max() > _JUMP:
        k, joint = (int(i) for i in np.unravel_index(int(gaps.argmax()), gaps.shape))
        raise InvalidValueError(f"path: joint {joint + 1} jumps by {gaps.max():.3g} at {grid.origins[k + 1]:g} s")
