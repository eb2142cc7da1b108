"""How far the tool leaves its path: an upper bound that holds between the samples as well.

The tool is sampled so often on every interval between two knots. Between two samples a time d apart a curve leaves its
chord by no more than d²/8 times its greatest second derivative. How much the tool may accelerate follows from the
speeds and accelerations of the joints, which are known exactly on every interval, and the levers of the arm.
"""

from __future__ import annotations

import math
from functools import cache, lru_cache
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from armwright.arm.model import Arm
from armwright.arrays import Array, read_only
from armwright.motion.polynomials import evaluate
from armwright.motion.solver import AnyArm, Solver, solver_of
from armwright.motion.tolerance import Tolerance
from armwright.motion.trajectory import Trajectory
from armwright.spatial.rotations import rotation_from_vector, rotation_vector
from armwright.tracing.loops import Loops, Runner, Table
from armwright.tracing.scalar import Scalar, larger, select, smaller, sqrt
from armwright.tracing.vectors import Matrix, dot

# What a bound may add to what is seen, in parts of what is allowed; samples are taken so densely that it does not
# exceed it, but no fewer and no more on an interval than these.
_ADDED = 0.25
_SAMPLES = (4, 200)
# Of the distance from legs: samples on every interval to begin with and at most; doubled while more than this part is
# added to what they show.
_LEG_SAMPLES, _MAX_LEG_SAMPLES, _LEG_ADDED = 8, 128, 0.1
# A distance below this is not sampled more closely [m].
_SMALL = 1e-9
# A turn that may be a half one, the other way round too [rad].
_HALF_TURN = np.pi - 1e-6
# Of the distance of any polynomials from a line: samples are so dense that they miss no more than this [m], [rad], but
# there are no more than so many on an interval.
_LINE_MISSED, _MAX_LINE_SAMPLES = 1e-6, 1000
# Configurations at which the paths of two motions are compared.
_COMPARED = 501
# Positions of the tool and entries of its rotation are computed to so many roundings.
ROUNDINGS = 64 * float(np.finfo(np.float64).eps)


class ToolBounds(NamedTuple):
    """Upper bounds of how the tool moves on m intervals, (m,) each.

    Attributes:
        acceleration: of its origin [m/s²].
        angular_speed: of the tool [rad/s].
        angular_acceleration: of the tool [rad/s²].
    """

    acceleration: Array
    angular_speed: Array
    angular_acceleration: Array


class ErrorBounds(NamedTuple):
    """Upper bounds on m intervals, (m,) each, of what makes an error larger between two samples than at them.

    Attributes:
        position: second derivative of the distance that is measured [m/s²].
        orientation: second derivative of the sine of half the angle [1/s²].
        progress: what the motion has found out of itself on the intervals, for its ``error``.
    """

    position: Array
    orientation: Array
    progress: Any = None


class ToolSamples(NamedTuple):
    """Where the tool is, k + 1 times on each of m intervals.

    Attributes:
        times: (m, k + 1) [s].
        poses: (m, k + 1, 4, 4).
        step: (m,) between two of them [s].
        tool: how the tool moves on the intervals.
        bounds: of the error between samples.
        solver: evaluates equations of many samples, and runs routines.
    """

    times: Array
    poses: Array
    step: Array
    tool: ToolBounds
    bounds: ErrorBounds
    solver: Solver


class TrackingError(NamedTuple):
    """How far the tool is from its path on m intervals between knots, (m,) each.

    Attributes:
        position: upper bound of the distance [m].
        orientation: upper bound of the angle [rad].
        sampled_position: the largest distance at the samples [m].
        sampled_orientation: the largest angle at the samples [rad].
        times: when the largest distance was sampled [s].
        samples: how often the tool was sampled on an interval.
        backward: upper bound of how far the tool runs backwards along a straight line [m]; None for other paths.
    """

    position: Array
    orientation: Array
    sampled_position: Array
    sampled_orientation: Array
    times: Array
    samples: int
    backward: float | None = None

    @property
    def worst_time(self) -> float:
        """When the largest distance of all was sampled [s]."""
        return float(self.times[self.sampled_position.argmax()])

    @property
    def largest(self) -> Tolerance:
        """Upper bounds of distance and angle on all intervals."""
        return Tolerance(float(self.position.max()), float(self.orientation.max()))


class ToolMotion(Protocol):
    """A motion of the tool that the joints are to follow."""

    def __call__(self, t: Array) -> Array:
        """Return the poses (k, 4, 4) at times (k,), from 0 to the end."""

    def poses_for(self, solver: Solver, t: Array) -> Array:
        """Return the same, evaluated as a solver evaluates equations."""

    def bounds(self, times: Array, tool: ToolBounds, run: Runner) -> ErrorBounds:
        """Return bounds of the error on the intervals between times (m + 1,), where the tool moves as described."""

    def error(self, samples: ToolSamples) -> TrackingError:
        """Return how far a sampled tool is from this motion."""

    def where(self, t: float) -> tuple[int, float, str]:
        """Return on which path between two poses, from 0, a time is, at which fraction of it, and that in words."""


def tracking_error(
    solver: Solver, motion: ToolMotion, trajectory: Trajectory, tool: ToolBounds, allowed: Tolerance
) -> TrackingError:
    """Return how far a motion of the joints leaves the motion of the tool that it follows.

    Args:
        solver: the arm, with n joints.
        motion: where the tool should be.
        trajectory: where the joints are, cubics on m segments.
        tool: how the tool moves on them at most.
        allowed: the errors that matter; they decide how often the tool is sampled.
    """
    h = trajectory.lengths
    bounds = motion.bounds(trajectory.times, tool, solver.run)
    needed = np.maximum(bounds.position / allowed.position, 2 * bounds.orientation / allowed.orientation)
    count = math.ceil(float((np.sqrt(needed) * h).max()) / math.sqrt(8 * _ADDED))
    count = min(max(count, _SAMPLES[0]), _SAMPLES[1])
    m, _, n = trajectory.coefficients.shape
    inputs = [trajectory.times, trajectory.coefficients]
    times, q = solver.run(_even_samples, inputs, (m, count + 1), (m, count + 1, n))
    return motion.error(ToolSamples(times, np.asarray(solver.forward(q)), h / count, tool, bounds, solver))


def _even_samples(loops: Loops, *tables: Table) -> None:
    """Write times, and where the joints are then, at even parts of every interval of cubics; read those and times."""
    starts, terms, times, q = tables
    (m, samples), joints = times.shape, q.shape[2]
    end = starts[m]

    def local(i: Scalar, k: Scalar) -> Scalar:
        return (starts[i + 1] - starts[i]) * (loops.number(k) / (samples - 1))

    (parts,) = loops.each([m, samples], lambda i, k: [local(i, k)])
    loops.fill([times], [m, samples], lambda i, k: [smaller(starts[i] + parts[i, k], end)])

    def position(i: Scalar, k: Scalar, j: Scalar) -> list[Scalar]:
        c0, c1, c2, c3 = (terms[i, power, j] for power in range(4))
        t = parts[i, k]
        return [((c3 * t + c2) * t + c1) * t + c0]

    loops.fill([q], [m, samples, joints], position)


def error_of(samples: ToolSamples, errors: Array, half: Array) -> TrackingError:
    """Return the error from what is measured at the samples.

    Args:
        samples: of the tool, (m, k + 1).
        errors: (m, k + 1) distances from the path [m].
        half: (m,) the largest sines of half the angles from its orientation.
    """
    between = samples.step**2 / 8
    largest = errors.max(axis=1)
    bound = half + between * samples.bounds.orientation
    rounding = ROUNDINGS * (1.0 + float(np.abs(samples.poses[..., :3, 3]).max()))
    return TrackingError(
        position=largest + between * samples.bounds.position + rounding,
        orientation=2 * np.arcsin(np.minimum(bound, 1.0)) + ROUNDINGS,
        sampled_position=largest,
        sampled_orientation=2 * np.arcsin(np.minimum(half, 1.0)),
        times=samples.times[np.arange(len(largest)), errors.argmax(axis=1)],
        samples=errors.shape[1] - 1,
    )


def half_sines(R_A: Array, R_B: Array) -> Array:
    """Return sin(angle / 2) (...) of the rotations from rotations (..., 3, 3) to others, small ones to all digits."""
    Q = np.swapaxes(R_A, -1, -2) @ R_B
    return np.asarray(half_sine([[Q[..., i, j] for j in range(3)] for i in range(3)]))


def half_sine(Q: Matrix) -> Scalar:
    """Return sin(angle / 2) of a rotation (3, 3), over abstract scalars; a small one to all digits."""
    # Near half a turn the cosine of half the angle is lost in rounding, but not 0.
    w = sqrt(larger(1 + Q[0][0] + Q[1][1] + Q[2][2], 1e-12)) / 2
    v = [Q[2][1] - Q[1][2], Q[0][2] - Q[2][0], Q[1][0] - Q[0][1]]
    return sqrt(dot(v, v)) / (4 * w)


def half_angle_bound(omega: Scalar, alpha: Scalar, change: Scalar, rate: Scalar) -> Scalar:
    """Return an upper bound of the acceleration of half the rotation between the tool and a rotating orientation.

    This rotation is a unit quaternion; the second derivative of its vector part is at most half the angular
    acceleration and a quarter of the squared angular speed.

    Args:
        omega: the largest angular speed of the tool [rad/s].
        alpha: its largest angular acceleration [rad/s²].
        change: angular acceleration of that orientation, at most [rad/s²].
        rate: its angular speed, at most [rad/s].
    """
    return (alpha + change + omega * rate) / 2 + (omega + rate) * (omega + rate) / 4


class CurveBounds(NamedTuple):
    """What is exactly known of cubics on m intervals, and of the tool that they move.

    Attributes:
        speed: (m, n) the largest speeds of the joints.
        acceleration: (m, n) their largest accelerations.
        turning: (2, m, n) positions where they reverse; at an end of an interval where they do not.
        tool: upper bounds of how the tool moves.
    """

    speed: Array
    acceleration: Array
    turning: Array
    tool: ToolBounds


def curve_bounds(solver: Solver, trajectory: Trajectory) -> CurveBounds:
    """Return bounds of how joints and tool move on cubics.

    The tool accelerates by sum J_i qdd_i + sum H_ij qd_i qd_j, where |J_i| is at most the lever r_i of joint i and
    |H_ij| at most that of the later of two joints that rotate.

    Args:
        solver: the arm, with n joints.
        trajectory: of the joints, cubics on m segments.
    """
    arm, terms = solver.arm, trajectory.coefficients
    m, _, n = terms.shape
    levers = _levers(arm, terms, trajectory.lengths)
    inputs = [trajectory.times, terms, *_rotating(tuple(arm.revolute.tolist())), levers]
    speed, acceleration, turning, a_tool, omega, change = solver.run(
        _curve_bounds, inputs, (m, n), (m, n), (2, m, n), (m,), (m,), (m,)
    )
    return CurveBounds(speed, acceleration, turning, ToolBounds(a_tool, omega, change))


def _curve_bounds(loops: Loops, *tables: Table) -> None:
    """Write ``CurveBounds``, given times, cubics, which joints rotate, alone and in pairs, and their levers."""
    times, terms, rotates, pairs, lever, speed, acceleration, turning, a_tool, omega, alpha = tables
    m, _, n = terms.shape

    def of_joint(i: Scalar, j: Scalar) -> list[Scalar]:
        cubic, length = [terms[i, power, j] for power in range(4)], times[i + 1] - times[i]
        return [*_cubic_peaks(cubic, length), *_turning_positions(cubic, length)]

    loops.fill([speed, acceleration, turning.part(0, 0), turning.part(0, 1)], [m, n], of_joint)
    # What the speed of each joint adds with those of the others.
    (together,) = loops.each(
        [n, n], lambda j, k: [pairs[0, j, k] * lever[k] + pairs[1, j, k] * lever[j] + pairs[2, j, k]]
    )

    def of_pairs(i: Scalar, k: Scalar) -> list[Scalar]:
        products = loops.total(n, lambda j: speed[i, j] * together[j, k])
        return [products, loops.total(n, lambda j: speed[i, j] * pairs[3, j, k])]

    products, rotation_products = loops.each([m, n], of_pairs, 2)

    def of_tool(i: Scalar) -> list[Scalar]:
        return [
            loops.total(n, lambda j: acceleration[i, j] * lever[j])
            + loops.total(n, lambda j: products[i, j] * speed[i, j]),
            loops.total(n, lambda j: speed[i, j] * rotates[j]),
            loops.total(n, lambda j: acceleration[i, j] * rotates[j])
            + loops.total(n, lambda j: rotation_products[i, j] * speed[i, j]),
        ]

    loops.fill([a_tool, omega, alpha], [m], of_tool)


@cache
def _rotating(turns: tuple[bool, ...]) -> tuple[Array, Array]:
    """Return (n,) which joints rotate, and (4, n, n) which pairs of them both do.

    Pairs of which the second one is the later, those of which the first one is, where one carries a slide, and those
    that rotate once each.
    """
    rotates, n = np.array(turns), len(turns)
    rows, columns = np.arange(n)[:, None], np.arange(n)
    both = rotates[:, None] & rotates
    # A slide is rotated by the joints before it; those beyond it do not change its direction.
    carried = rotates[np.minimum(rows, columns)] & ~rotates[np.maximum(rows, columns)] & (rows != columns)
    pairs = np.stack([np.triu(both), np.tril(both, -1), carried, np.triu(both, 1)])
    return rotates.astype(np.float64), pairs.astype(np.float64)


def _cubic_peaks(c: list[Scalar], h: Scalar) -> list[Scalar]:
    """Return the largest speed and the largest acceleration of a cubic, exactly."""
    start, bend, end = c[1], 2 * c[2], c[1] + (2 * c[2] + 3 * c[3] * h) * h
    bend_end = bend + 6 * c[3] * h
    speed = larger(abs(start), abs(end))
    # The speed has its own peak where the acceleration changes its sign.
    inside = bend * bend_end < 0
    vertex = start - bend * bend / select(inside, 12 * c[3], 1.0)
    return [select(inside, larger(speed, abs(vertex)), speed), larger(abs(bend), abs(bend_end))]


def turning_positions(c: Array, lengths: Array) -> tuple[Array, Array]:
    """Return two positions (m, n) where cubics (m, 4, n) reverse, exactly; at an end where they do not."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        first, second = _turning_positions([c[:, power] for power in range(4)], lengths[:, None])
    return first, second


def _turning_positions(c: list[Scalar], length: Scalar) -> list[Scalar]:
    """Return the two positions where a cubic reverses."""
    a, b, start = 3 * c[3], c[2], c[1]
    root = sqrt(b * b - a * start)
    # Of a t² + 2 b t + start = 0 the root of larger size without cancellation, and the other by their product.
    large = -b - select(b < 0, -root, root)
    positions = []
    for over, under in ((large, a), (start, large)):
        there = abs(under) > 0
        t = select(there, over / select(there, under, 1.0), 0.0)
        t = select(t > 0, smaller(t, length), 0.0)
        positions.append(((c[3] * t + c[2]) * t + c[1]) * t + c[0])
    return positions


def _levers(arm: Arm, joints: Array, lengths: Array) -> Array:
    """Return the largest distance (n,) of the tool from the frame before each joint that rotates; 1 for slides.

    Slides are as far out as they go.
    """
    if arm.revolute.all():
        return _distances(arm, (0.0,) * arm.n)
    farthest = evaluate(np.abs(joints), lengths[:, None]).max(axis=0)
    distances = _distances(arm, tuple(np.where(arm.revolute, 0.0, farthest).tolist()))
    return np.where(arm.revolute, distances, 1.0)


@lru_cache(maxsize=16)
def _distances(arm: Arm, slides: tuple[float, ...]) -> Array:
    """Return how far (n,) the tool may be from the frame before each joint, slides so far out."""
    parts = [joint.span(slide) for joint, slide in zip(arm.joints, slides, strict=True)]
    tool = float(np.linalg.norm(arm.tool[:3, 3]))
    return read_only(np.cumsum([tool, *parts[::-1]])[:0:-1])


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
    h = trajectory.lengths
    tool = curve_bounds(solver, trajectory).tool
    middles_of_legs = (times[1:] + times[:-1]) / 2
    leg = np.searchsorted(middles_of_legs[1:-1], (trajectory.times[1:] + trajectory.times[:-1]) / 2)
    samples = _LEG_SAMPLES
    while True:
        part = (np.arange(samples + 1) / samples)[:, None]
        q = np.stack([evaluate(trajectory.coefficients, (p * h)[:, None]) for p in part])
        distance = _chord_distances(solver.forward(q)[..., :3, 3], positions, leg)
        bound = float((distance + (h / samples) ** 2 / 8 * tool.acceleration).max())
        if samples == _MAX_LEG_SAMPLES or bound <= (1 + _LEG_ADDED) * float(distance.max()) + _SMALL:
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


def distance_from_line(arm: AnyArm, trajectory: Trajectory, A: Array, B: Array) -> TrackingError:
    """Return how far the tool is from a straight line, and from the orientation that belongs there.

    The motion may be polynomials of any degree. Between samples a time d apart position and orientation leave their
    chords by no more than d²/8 times their greatest second derivatives.

    Args:
        arm: with n joints, or a compiled one, which is faster.
        trajectory: of them.
        A: (4, 4) pose of the tool at which the line begins.
        B: (4, 4) pose at which it ends.
    """
    solver = solver_of(arm)
    tool, speed = _tool_bounds(solver.arm, trajectory)
    shift = B[:3, 3] - A[:3, 3]
    length = float(np.linalg.norm(shift))
    turn = rotation_vector(A[:3, :3].T @ B[:3, :3])
    angle = float(np.linalg.norm(turn))
    if angle > _HALF_TURN:
        # It is as far the other way round; the motion tells which way it goes.
        middle = np.asarray(solver.forward(trajectory(trajectory.duration / 2)[None]))[0]
        if rotation_vector(A[:3, :3].T @ middle[:3, :3]) @ turn < 0:
            turn, angle = turn * (1 - 2 * np.pi / angle), 2 * np.pi - angle
    per_metre = angle / length if length > _SMALL else 0.0
    bend = half_angle_bound(
        tool.angular_speed, tool.angular_acceleration, per_metre * tool.acceleration, per_metre * speed
    )
    h = trajectory.lengths
    missed = float((h**2 / 8 * np.maximum(tool.acceleration, 2 * bend)).max())
    count = min(max(_SAMPLES[0], math.ceil(math.sqrt(missed / _LINE_MISSED))), _MAX_LINE_SAMPLES)
    parts = np.arange(count + 1) / count
    along, away, half = np.empty((3, len(parts), len(h)))
    for i, part in enumerate(parts):
        X = np.asarray(solver.forward(evaluate(trajectory.coefficients, (part * h)[:, None])))
        p = X[..., :3, 3] - A[:3, 3]
        along[i] = p @ shift / max(length**2, _SMALL**2)
        away[i] = np.linalg.norm(p - np.clip(along[i], 0, 1)[..., None] * shift, axis=-1)
        half[i] = half_sines(A[:3, :3] @ rotation_from_vector(along[i, :, None] * turn), X[..., :3, :3])
    sines = half.max(axis=0)
    between = (h / count) ** 2 / 8
    way = along.T.ravel() * length
    return TrackingError(
        position=away.max(axis=0) + between * tool.acceleration,
        orientation=2 * np.arcsin(np.minimum(sines + between * bend, 1.0)),
        sampled_position=away.max(axis=0),
        sampled_orientation=2 * np.arcsin(np.minimum(sines, 1.0)),
        times=trajectory.times[:-1] + parts[away.argmax(axis=0)] * h,
        samples=count,
        backward=float((np.maximum.accumulate(way) - way).max() + 2 * (between * tool.acceleration).max()),
    )


def path_deviation(arm: AnyArm, planned: Trajectory, run: Trajectory) -> float:
    """Return the largest distance of the tool from the path of another motion, at samples [m].

    Args:
        arm: the arm, or a compiled one.
        planned: the motion with that path.
        run: the motion that leaves it.
    """
    forward = solver_of(arm).forward
    place, there = (forward(each(np.linspace(0, each.duration, _COMPARED)))[:, :3, 3] for each in (planned, run))
    starts, chords = place[:-1], np.diff(place, axis=0)
    squares = np.maximum((chords**2).sum(axis=1), 1e-300)
    worst = 0.0
    for p in there:
        part = np.clip(((p - starts) * chords).sum(axis=1) / squares, 0, 1)
        worst = max(worst, float(np.linalg.norm(p - starts - part[:, None] * chords, axis=1).min()))
    return worst


def _tool_bounds(arm: Arm, trajectory: Trajectory) -> tuple[ToolBounds, Array]:
    """Return bounds of how the tool moves on polynomials of any degree, and of the speed of its origin, (m,)."""
    lever = _levers(arm, trajectory.coefficients, trajectory.lengths)
    rotates, pairs = _rotating(tuple(arm.revolute.tolist()))
    speed, acceleration = trajectory.segment_peaks(1), trajectory.segment_peaks(2)
    together = pairs[0] * lever + pairs[1] * lever[:, None] + pairs[2]
    a_tool = acceleration @ lever + np.einsum("mj,jk,mk->m", speed, together, speed)
    alpha = acceleration @ rotates + np.einsum("mj,jk,mk->m", speed, pairs[3], speed)
    return ToolBounds(a_tool, speed @ rotates, alpha), speed @ lever
