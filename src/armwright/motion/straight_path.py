"""Straight segments of the tool over time: one line at even speed, or several past frames as the report times them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TypeAlias

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.motion.deviation import (
    ROUNDINGS,
    ErrorBounds,
    ToolBounds,
    ToolSamples,
    TrackingError,
    half_angle_bound,
    half_sine,
)
from armwright.motion.knots import segments_at
from armwright.motion.path import NEGLIGIBLE, Path, place_knots
from armwright.motion.rows import Evaluator, on_arrays
from armwright.motion.solver import Solver
from armwright.motion.trajectory import Trajectory
from armwright.motion.xspline_path import xspline
from armwright.spatial.poses import position_text
from armwright.spatial.rotations import rotation_vector
from armwright.tracing.loops import Loops, Runner, Table
from armwright.tracing.scalar import Scalar, larger, select, sin, smaller, sqrt
from armwright.tracing.vectors import Matrix, Vector, dot

SegmentNumbers: TypeAlias = npt.NDArray[np.intp]

# The acceleration rises during this part of a ramp, and falls during as much of it.
_RISE = 0.2


@attrs.frozen(kw_only=True, eq=False)
class StraightPath:
    """A motion of the tool along straight segments from pose to pose.

    The distance of a tool from it is that from its segment, wherever on it the tool should be. The orientation is held
    against that which belongs to the time, and on a single line against that which belongs to the position nearest to
    the tool as well: a tool that is late while it rotates would otherwise be rotated too far for where it is. On a line
    shorter than ``near`` every position is near enough, and the time alone counts.

    Attributes:
        poses: (k + 1, 4, 4) at which segments begin and end.
        rotations: (k, 3) rotation vector of each segment, in the axes at its start [rad].
        corners: (k + 1,) when the poses are passed, from 0 [s].
        progress: on which segment, from 0, and at which fraction of it, as one number over time.
        numbers: (k) which segments of the path that was asked for they are, without those of no length.
        near: positions on the line that are so near are all the same [m].
    """

    poses: Array
    rotations: Array
    corners: Array
    progress: Trajectory
    numbers: tuple[int, ...]
    near: float

    @property
    def duration(self) -> float:
        """From start to end [s]."""
        return float(self.corners[-1])

    @cached_property
    def shifts(self) -> Array:
        """From the start to the end of each segment, (k, 3) [m]."""
        return np.asarray(self.poses[1:, :3, 3] - self.poses[:-1, :3, 3])

    def __call__(self, t: Array) -> Array:
        """Return the poses (k, 4, 4) at times (k,)."""
        return self.at(*self._along(t))

    def poses_for(self, solver: Solver, t: Array) -> Array:
        """Return the poses (k, 4, 4) at times (k,), evaluated as a solver evaluates equations."""
        return _poses(self._references(solver.run, t[:, None]), solver.rows)

    def at(self, segment: SegmentNumbers | int, fraction: Array) -> Array:
        """Return the poses (k, 4, 4) at fractions (k,) of segments (k,), or of one segment."""
        references = np.empty((len(fraction), 21))
        references[:, :20], references[:, 20] = self._segments[segment], fraction
        return _poses(references, on_arrays)

    def _references(self, run: Runner, times: Array) -> Array:
        """Return what ``_pose`` and ``_tool_error`` take of this path at times (m, k) on its segments, (m k, 21)."""
        progress = [self.progress.times, self.progress.coefficients[:, :, 0]]
        return run(_references, [times, self._segments, self.corners, *progress], (times.size, 21))[0]

    @cached_property
    def _axes(self) -> Array:
        """Of the rotations on the segments, (k, 3)."""
        return np.asarray(self.rotations / np.where(self._angles > 0, self._angles, 1.0)[:, None])

    def _along(self, t: Array) -> tuple[SegmentNumbers, Array]:
        """Return the numbers of the segments (...) at times (...), and the fractions of them."""
        segment = segments_at(self.corners, t, len(self.numbers))
        starts, inside = self.progress.times, np.minimum(np.maximum(t, 0.0), self.progress.duration)
        piece = segments_at(starts, inside, len(self.progress.coefficients))
        c0, c1, c2, c3 = self.progress.coefficients[piece, :, 0].T
        local = inside - starts[piece]
        return segment, ((c3 * local + c2) * local + c1) * local + c0 - segment

    def where(self, t: float) -> tuple[int, float, str]:
        """Return on which segment a time is, at which fraction of it, and that in words."""
        segment, fraction = (each[0] for each in self._along(np.array([t])))
        text = f"on the line near {position_text(self(np.array([t]))[0, :3, 3])}"
        return self.numbers[segment], float(np.clip(fraction, 0.0, 1.0)), text

    def bounds(self, times: Array, tool: ToolBounds, run: Runner) -> ErrorBounds:
        """Return bounds of the error on the intervals between times: the distance from a straight segment is convex."""
        m = len(times) - 1
        inputs = [times, *tool, self._on_line, self.corners, self._angles, self.progress.times]
        rotation, *progress = run(_bounds, [*inputs, self.progress.coefficients[:, :, 0]], *[(m,)] * 4)
        return ErrorBounds(tool.acceleration, rotation, progress)

    def error(self, samples: ToolSamples) -> TrackingError:
        """Return how far a sampled tool is from its segments."""
        m, each = samples.times.shape
        solver, references = samples.solver, self._references(samples.solver.run, samples.times)
        sampled = solver.rows(_tool_error, [], [samples.poses.reshape(-1, 16), references])[0].reshape(m, each, 4)
        inputs = [samples.times, samples.poses, sampled, samples.step, *samples.tool, *samples.bounds.progress]
        position, angles, largest, times, facts = solver.run(
            _errors, [*inputs, self._on_line], (m,), (2, m), (m,), (m,), (1,)
        )
        bound, half = 2 * np.arcsin(np.minimum(angles, 1.0))
        backward = float(facts[0]) if self._by_position else None
        return TrackingError(position, bound + ROUNDINGS, largest, half, times, each - 1, backward)

    @property
    def _on_line(self) -> Array:
        """Return the length of a line where orientations belong to positions on it, else 0."""
        return np.array([self._length if self._by_position else 0.0])

    @cached_property
    def _segments(self) -> Array:
        """Return the segments as ``_pose`` and ``_tool_error`` take them, (k, 20)."""
        segments = np.empty((len(self.shifts), 20))
        squares = np.add.reduce(self.shifts * self.shifts, axis=1)
        squares[squares == 0] = 1.0
        segments[:, :3], segments[:, 3:12] = self.poses[:-1, :3, 3], self.poses[:-1, :3, :3].reshape(-1, 9)
        segments[:, 12:15], segments[:, 15] = self.shifts, squares
        segments[:, 16:19], segments[:, 19] = self._axes, self._angles
        return segments

    @cached_property
    def _angles(self) -> Array:
        """Of the rotations on the segments, (k,) [rad]."""
        return np.asarray(np.sqrt(np.add.reduce(self.rotations * self.rotations, axis=1)))

    @cached_property
    def _length(self) -> float:
        return float(np.linalg.norm(self.shifts[0]))

    @property
    def _by_position(self) -> bool:
        return len(self.numbers) == 1 and self._length > self.near


def _at(loops: Loops, times: Table, terms: Table, t: Scalar) -> tuple[list[Scalar], Scalar]:
    """Return the coefficients of the cubic that a time is in, and when that begins."""
    piece = loops.segment(times, t, terms.shape[0])
    return [terms[piece, power] for power in range(4)], times[piece]


def _bounds(loops: Loops, *tables: Table) -> None:
    """Write bounds of the error on intervals: see ``StraightPath.bounds``.

    Written are a bound of the second derivative of the sine of half the angle; and upper bounds of the rate of progress
    and its change, and the angle of the rotation on the segment. Each interval lies within one cubic of the progress,
    whose second derivative is largest at an end of the interval.
    """
    times, a_tool, omega, alpha, on_line, corners, angles, starts, terms, *written = tables
    m, line = written[0].shape[0], on_line[0]

    def of_interval(i: Scalar) -> list[Scalar]:
        middle, h = (times[i + 1] + times[i]) / 2, times[i + 1] - times[i]
        segment = loops.segment(corners, middle, angles.shape[0])
        (_, c1, c2, c3), start = _at(loops, starts, terms, middle)
        t = middle - start
        first, second, third = abs((3 * c3 * t + 2 * c2) * t + c1), abs(6 * c3 * t + 2 * c2), abs(6 * c3)
        bend = second + third * h / 2
        fast, angle = first + bend * h / 2, angles[segment]
        planned = half_angle_bound(omega[i], alpha[i], angle * bend, angle * fast)
        # As an estimate the tool moves along the line as was planned; ``error`` does without.
        by_tool = a_tool[i] / select(line > 0, line, 1.0)
        nearest = half_angle_bound(omega[i], alpha[i], angle * by_tool, angle * fast)
        both = select(line > 0, larger(planned, nearest), planned)
        return [both, fast, bend, angle]

    loops.fill(written, [m], of_interval)


def _references(loops: Loops, *tables: Table) -> None:
    """Write the segment and the fraction of it at times (m, k), of which each row is on one segment and one cubic."""
    times, segments, corners, starts, terms, references = tables
    m, each = times.shape
    rows = references.shaped(m, each, 21)

    def of_row(i: Scalar) -> list[Scalar]:
        middle = (times[i, 0] + times[i, each - 1]) / 2
        segment = loops.segment(corners, middle, segments.shape[0])
        return [loops.number(segment), loops.number(loops.segment(starts, middle, terms.shape[0]))]

    numbers, pieces = loops.each([m], of_row, 2)

    def planned(i: Scalar, k: Scalar) -> list[Scalar]:
        piece = loops.whole(pieces[i])
        c0, c1, c2, c3 = (terms[piece, power] for power in range(4))
        t = times[i, k] - starts[piece]
        return [((c3 * t + c2) * t + c1) * t + c0 - numbers[i]]

    loops.fill([rows], [m, each, 20], lambda i, k, c: [segments[loops.whole(numbers[i]), c] + 0.0 * times[i, k]])
    loops.fill([rows.part(2, 20)], [m, each], planned)


def _errors(loops: Loops, *tables: Table) -> None:
    """Write how far a tool is from segments, from what is measured at samples: see ``StraightPath.error``.

    Written are bounds of the distance, bounds of the sine of half the angle and the largest one at the samples, the
    largest distance there, when that is, and how far the tool runs back.
    """
    times, poses, sampled, steps, a_tool, omega, alpha, rates, changes, angles, on_line = tables[:11]
    position, sines, largest, at, facts = tables[11:]
    (m, each), line = times.shape, on_line[0]
    length = select(line > 0, line, 1.0)
    rows = poses.shaped(m * each, 16)
    farthest = loops.largest(m * each, lambda k: larger(abs(rows[k, 3]), larger(abs(rows[k, 7]), abs(rows[k, 11]))))
    rounding = ROUNDINGS * (1.0 + farthest)
    distance, along, travel = loops.each(
        [m, each], lambda i, k: [sampled[i, k, 0], sampled[i, k, 1], sampled[i, k, 1] * length], 3
    )

    def of_interval(i: Scalar) -> list[Scalar]:
        between, angle = steps[i] * steps[i] / 8, angles[i]
        half = loops.largest(each, lambda k: sampled[i, k, 2])
        by_position = loops.largest(each, lambda k: sampled[i, k, 3])
        planned = half + between * half_angle_bound(omega[i], alpha[i], angle * changes[i], angle * rates[i])
        # Of the position on the line: how fast it can change, from the samples, and how far beyond the ends it is.
        change = a_tool[i] / length
        rate = loops.largest(each - 1, lambda k: abs(along[i, k + 1] - along[i, k])) / steps[i] + steps[i] * change
        outside = loops.largest(each, lambda k: larger(-along[i, k], along[i, k] - 1))
        beyond = larger(outside + between * change, 0.0)
        bound = by_position + between * half_angle_bound(omega[i], alpha[i], angle * change, angle * rate)
        bound = bound + angle * beyond / 2
        away = loops.largest(each, lambda k: distance[i, k])
        return [
            away + between * a_tool[i] + rounding,
            select(line > 0, larger(planned, bound), planned),
            select(line > 0, larger(half, by_position), half),
            away,
        ]

    loops.fill([position, sines.part(0, 0), sines.part(0, 1), largest], [m], of_interval)

    def latest(i: Scalar) -> tuple[()]:
        row = distance.row(i)
        at[i] = times.row(i)[loops.first_largest(each, lambda k: row[k])[1]]
        return ()

    loops.walk(m, (), latest)
    facts[0] = _backward(loops, travel, lambda i: steps[i] * steps[i] / 8 * a_tool[i], rounding)


def _backward(loops: Loops, travel: Table, between: Callable[[Scalar], Scalar], rounding: Scalar) -> Scalar:
    """Return how far a tool at most runs back along its line, from samples (m, k) [m] and what lies between."""
    m, each = travel.shape
    flat = travel.shaped(m * each)
    farthest = loops.highest(m * each, lambda k: flat[k]).shaped(m, each)
    most = loops.largest(m, between)

    def of_interval(i: Scalar) -> list[Scalar]:
        back = loops.largest(each, lambda k: farthest[i, k] - travel[i, k])
        # Between two samples the tool is away from the chord by so much at most, before it reverses and after. Its
        # speed differs from the slope of the chord by four times that over the step at most, so that where the chord
        # rises by more, the tool never reverses.
        rises = loops.least(each - 1, lambda k: travel[i, k + 1] - travel[i, k]) > 4 * between(i)
        # The end of an interval is the start of the next, but for the rounding of a position of the tool: the position
        # on the line is computed from that.
        return [select(select(rises, back <= rounding, False), 0.0, back + 2 * most)]

    (backs,) = loops.each([m], of_interval)
    return loops.largest(m, lambda i: backs[i])


def _poses(references: Array, rows: Evaluator) -> Array:
    """Return the poses (k, 4, 4) that belong to segments and fractions (k, 21)."""
    X = np.zeros((len(references), 4, 4))
    X[:, :3] = rows(_pose, [], [references])[0].reshape(-1, 3, 4)
    X[:, 3, 3] = 1.0
    return X


def _pose(where: list[Scalar]) -> list[list[Scalar]]:
    """Return the first three rows of the pose (4, 4) at a fraction of a segment: see ``_tool_error``."""
    start, R_A, shift, axis, angle, fraction = (
        where[:3], where[3:12], where[12:15], where[16:19], where[19], where[20]
    )  # fmt: skip
    R = _rotation(axis, angle * fraction)
    rows = [
        [dot(R_A[3 * i : 3 * i + 3], [R[k][j] for k in range(3)]) for j in range(3)] + [start[i] + fraction * shift[i]]
        for i in range(3)
    ]
    return [[x for row in rows for x in row]]


def _tool_error(X: list[Scalar], segment: list[Scalar]) -> list[list[Scalar]]:
    """Return how far one pose of the tool is from a straight segment.

    Args:
        X: (16,) the pose.
        segment: (21,) its start, the orientation there, the vector to its end and the square of its length, axis
            and angle of the rotation on it, and at which fraction of it the tool should be.

    Returns:
        The distance, the fraction nearest to the tool, and the sines of half the angles from the orientations that
        belong to the planned fraction and to the nearest one.
    """
    start, R_A, shift, square, axis, angle = (
        segment[:3],
        segment[3:12],
        segment[12:15],
        segment[15],
        segment[16:19],
        segment[19],
    )
    come = [X[4 * i + 3] - start[i] for i in range(3)]
    along = dot(come, shift) / square
    inside = smaller(larger(along, 0.0), 1.0)
    away = [come[i] - inside * shift[i] for i in range(3)]
    # The orientation of the tool in the axes at the start.
    Q = [[R_A[i] * X[j] + R_A[3 + i] * X[4 + j] + R_A[6 + i] * X[8 + j] for j in range(3)] for i in range(3)]
    halves = [_half_sine_between(_rotation(axis, angle * fraction), Q) for fraction in (segment[20], along)]
    return [[sqrt(dot(away, away)), along, *halves]]


def _half_sine_between(R: Matrix, Q: Matrix) -> Scalar:
    """Return sin(angle / 2) of the rotation from one orientation (3, 3) to another, small ones to all digits."""
    return half_sine([[R[0][i] * Q[0][j] + R[1][i] * Q[1][j] + R[2][i] * Q[2][j] for j in range(3)] for i in range(3)])


def _rotation(axis: Vector, angle: Scalar) -> Matrix:
    """Return the rotation (3, 3) by an angle about an axis (Rodrigues), that by 0 without an axis."""
    x, y, z = axis
    sine, half = sin(angle), sin(angle / 2)
    versed = 2 * half * half
    xy, xz, yz = versed * x * y, versed * x * z, versed * y * z
    return [
        [1 - versed * (y * y + z * z), xy - sine * z, xz + sine * y],
        [xy + sine * z, 1 - versed * (x * x + z * z), yz - sine * x],
        [xz - sine * y, yz + sine * x, 1 - versed * (x * x + y * y)],
    ]


def line(A: Array, B: Array, rotation: Array, even: float, *, near: float, ramp: float = 0.0) -> StraightPath:
    """Return the straight line of the tool from A to B.

    Args:
        A: (4, 4) pose at the start.
        B: (4, 4) pose at the end.
        rotation: (3,) rotation vector from start to end, in the axes at the start [rad].
        even: how long it takes at full speed throughout [s].
        near: as for ``StraightPath``.
        ramp: part of the duration that gathers speed, and that loses it again; at full speed from end to end if 0.
    """
    duration = even / (1 - ramp)
    even_progress = Trajectory.of_planner(np.array([0.0, duration]), np.array([[[0.0], [1 / duration], [0.0], [0.0]]]))
    return StraightPath(
        poses=np.array([A, B]),
        rotations=rotation[None],
        corners=np.array([0.0, duration]),
        progress=s_curve(duration, ramp) if ramp else even_progress,
        numbers=(0,),
        near=near,
    )


def s_curve(duration: float, ramp: float) -> Trajectory:
    """Return the fraction of a line over time, from rest to rest, with continuous acceleration.

    Args:
        duration: [s].
        ramp: which part of it gathers speed, and which part again loses it: 0.5 at most.
    """
    rising = ramp * duration
    rise = _RISE * rising
    v = 1 / (duration - rising)
    a = v / (rising - rise)
    lengths = np.array([rise, rising - 2 * rise, rise, duration - 2 * rising, rise, rising - 2 * rise, rise])
    jerks = np.array([1, 0, -1, 0, -1, 0, 1]) * a / rise
    accelerations, speeds = np.array([0, a, a, 0, 0, -a, -a]), np.zeros(7)
    speeds[1:] = np.cumsum((accelerations + jerks * lengths / 2) * lengths)[:-1]
    ways = ((jerks * lengths / 6 + accelerations / 2) * lengths + speeds) * lengths
    starts = np.concatenate([[0.0], np.cumsum(ways)[:-1]])
    there = lengths > 1e-9 * duration  # a line of two ramps has nothing between them
    times = np.concatenate([[0.0], np.cumsum(lengths[there])])
    times[-1] = duration
    terms = np.stack([starts, speeds, accelerations / 2, jerks / 6], axis=1)
    return Trajectory(times=times, coefficients=terms[there][..., None])


def report_path(arm: Arm, path: Path, *, deviation: float, speed: float, finer: int = 1) -> StraightPath:
    """Return the straight segments of a path, run past its corners without a stop as the report's rule times them.

    Args:
        arm: the arm; its reach and the speed of its tool scale the speed.
        path: the segments; those without length are left out.
        deviation: that the rule sets knots for [m].
        speed: 1 to 120.
        finer: how many times more knots than the rule asks for.

    Raises:
        ArmwrightError: as for ``place_knots``.

    Source:
        TR-83-008, "continuous motion".
    """
    knots = place_knots(arm, path, deviation=deviation, speed=speed, finer=finer)
    numbers = tuple(np.flatnonzero(path.lengths() > NEGLIGIBLE).tolist())
    segments = np.searchsorted(numbers, knots.segments)
    last = np.append(np.flatnonzero(np.diff(segments)), len(segments) - 1)
    poses = np.stack([path.poses[numbers[0]], *(path.poses[i + 1] for i in numbers)])
    R = poses[:, :3, :3]
    return StraightPath(
        poses=poses,
        rotations=rotation_vector(np.swapaxes(R[:-1], -1, -2) @ R[1:]),
        corners=np.append(0.0, knots.times[last]),
        progress=xspline(knots.times, (segments + knots.fractions)[:, None]),
        numbers=numbers,
        near=np.inf,
    )
