"""A path through frames that come in while the arm moves along it, without a stop.

The tool goes straight from frame to frame. A corner is rounded as in ``rounded_corners``: where s is the way from the
frame, in metres, from -d to d, the pose is

    p = p_k + m u_k + n u_(k+1),    R = R_k exp(m w_k) exp(n w_(k+1)),    n = 2 d (h³ - h⁴/2),    m = s - n

with h from 0 to 1, u and w the rates of position and rotation on the legs. The corner at the last frame is open: the
path ends there. A frame that comes in replaces just that end of the path, which the arm has not reached.

The way S(t) along the path is run as fast as the limits allow, the acceleration constant on each interval, to rest at
the end. What the arm runs is its average over the last moments,

    s(t) = 1/w ∫ S from t - w to t

which has a continuous acceleration whatever S does from now on: so S may change at any time. The limits are halved
between the curvature of the path and the acceleration along it, and each holds as far around as S moves in the time w:
then the average keeps what S keeps.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.errors import IncapableArmError
from armwright.motion.averaged_law import SAME_TIME, WINDOW, AveragedLaw, apart, averaged, reached
from armwright.motion.chain import chain
from armwright.motion.controlled_stop import until_a_tick
from armwright.motion.knots import divided, segments_at
from armwright.motion.limited import limited_efforts, limited_motion
from armwright.motion.obstruction import (
    MAX_SLOWDOWN,
    Obstruction,
    PathError,
    beyond_limits,
    nearest_singularity,
    singular,
    unmet,
)
from armwright.motion.path import NEGLIGIBLE, Path, report_speed
from armwright.motion.polynomials import composition, evaluate, shifted
from armwright.motion.solver import AnyArm, Solver, solver_of
from armwright.motion.trajectory import Trajectory, hold
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import angle_between, rotation_from_vector, rotation_vector

# The tool is kept as near as this to the legs and corners [m], [rad]; between two knots where it is looked at, half as
# far at most.
NEAR, _TURNED = 5e-6, 5e-5
# Knots to begin with on a piece of the path, into how many parts a step is divided at most, how often, how many in all.
_KNOTS, _PARTS, _ROUNDS, _MAX_KNOTS = 17, 8, 12, 20_000
# Where an interval is looked at between its knots.
_LOOKS = np.linspace(0.0, 1.0, 6)[1:-1]
# From rest to the full rate of the way takes no less than this [s].
_RAMP = 0.05
# How much of a limit is used, and how much of what is left when efforts are too large is tried next.
_USED, _LESS, _TRIES = 0.999, 0.8, 60
# Speeds at which efforts are looked at, in parts of the largest, and accelerations.
_SPEEDS, _SIGNS = (0.01, 0.5, 1.0), (-1.0, 1.0)
# Ways nearer than this are the same [m].
_SAME = 1e-9
# A rate beyond a bound by this part of it is at it.
_ROUNDING = 1e-9


class Pace(NamedTuple):
    """How fast a queue is run, and how far from its frames corners may be rounded.

    Attributes:
        speed: 1 to 120, as for a straight line.
        velocity: of the tool, instead of that [m/s]; None for none.
        blend: how far from a frame its corner begins at most [m].
    """

    speed: float
    velocity: float | None
    blend: float


class _Corner(NamedTuple):
    """A frame with the legs before and after it: rates of position (3,) and rotation (3,) by the way.

    Attributes:
        X: (4, 4) its pose.
        way: of the frame [m].
        half_width: how far from it the corner is rounded [m].
        before: rates on the leg before.
        after: rates on the leg after.
    """

    X: Array
    way: float
    half_width: float
    before: tuple[Array, Array]
    after: tuple[Array, Array]

    def __call__(self, s: Array) -> Array:
        """Return poses (k, 4, 4) at ways (k,) from the frame."""
        n, d = np.maximum(s, 0.0), self.half_width
        if d > 0:
            h = np.clip((s + d) / (2 * d), 0.0, 1.0)
            n = np.where(np.abs(s) < d, 2 * d * h**3 * (1 - h / 2), n)
        m = (s - n)[:, None]
        n = n[:, None]
        (u, w), (u_next, w_next) = self.before, self.after
        R = self.X[:3, :3] @ rotation_from_vector(m * w) @ rotation_from_vector(n * w_next)
        return homogeneous(R, self.X[:3, 3] + m * u + n * u_next)


@attrs.frozen(eq=False)
class _Piece:
    """Joints along a part of the path.

    Attributes:
        joints: (m cubics) by the way since the piece began, whose ``times`` are ways [m].
        start: where it begins [m].
        most: (m,) the largest rate of the way [m/s].
        changes: (m,) how fast that rate may change [m/s²].
    """

    joints: Trajectory
    start: float
    most: Array
    changes: Array

    @property
    def end(self) -> float:
        """Where it ends [m]."""
        return self.start + self.joints.duration


@attrs.frozen(kw_only=True, eq=False)
class FrameQueue:
    """A path that grows at its end while an arm runs along it; a value: what puts a frame in returns the next one.

    Attributes:
        pace: how fast it is run.
        q_start: (n,) where it begins.
        X_last: (4, 4) pose of its end.
        law: the way by the time.
        rates: of position (3,) and rotation (3,) on the last leg; None before the first one.
        most: the largest rate of the way on the last leg [m/s].
        reach: how much of the last leg a corner at its end may take [m].
        pieces: joints along the path, those behind the arm left out; the last one is what a corner may take.
        marks: where the frames are that were put in [m], those behind the arm too.
        stops: at which ways the arm stops although frames follow [m].
        held: whether the arm brakes, or stands, somewhere on the path until it is resumed.
        stop_count: how often a frame has come too late to go on without a stop.
    """

    pace: Pace
    q_start: Array
    X_last: Array
    law: AveragedLaw
    rates: tuple[Array, Array] | None = None
    most: float = 0.0
    reach: float = 0.0
    pieces: tuple[_Piece, ...] = ()
    marks: tuple[float, ...] = ()
    stops: tuple[float, ...] = ()
    stop_count: int = 0
    held: bool = False

    @classmethod
    def at(cls, arm: AnyArm, q: Array, pace: Pace, now: float) -> FrameQueue:
        """Return the queue of an arm that stands, without frames."""
        X = np.asarray(solver_of(arm).forward(q[None]))[0]
        return cls(pace=pace, q_start=q, X_last=X, law=AveragedLaw(np.array([now]), np.zeros(1), np.zeros(1)))

    @property
    def end(self) -> float:
        """When the arm is at rest [s]."""
        return float(self.law.t[-1]) + (WINDOW if len(self.law.t) > 1 else 0.0)

    @property
    def length(self) -> float:
        """Where the path ends [m]."""
        return self.pieces[-1].end if self.pieces else float(self.law.s[-1])

    def rests(self, now: float) -> bool:
        """Whether the arm stands."""
        return now >= self.end - SAME_TIME

    def travelled(self, now: float) -> float:
        """Return how far the arm has come [m]."""
        return float(self.law.s[-1] if self.rests(now) else averaged(self.law, now)(0.0)[0])

    def passed(self, now: float) -> int:
        """Return how many of its frames the arm has passed."""
        way = self.travelled(now) + _SAME
        return sum(mark <= way for mark in self.marks)

    def when_passed(self, number: int, now: float) -> float:
        """Return when a frame, from 0, is passed that is not yet [s]; never on a path that is held before."""
        way = self.marks[number]
        if way > self.law.s[-1] + _SAME:
            return math.inf
        if way >= self.law.s[-1] - _SAME:
            return self.end
        return now + float(reached(averaged(self.law, now), np.array([way]))[0])

    def put(self, arm: AnyArm, X: Array, now: float) -> FrameQueue:
        """Return the queue with one more frame at its end.

        Where the arm can still go round a corner at the frame that was the last, it does; else it stops there.

        Args:
            arm: the arm.
            X: (4, 4) pose of the tool at the frame, in the base of the arm.
            now: the time [s].

        Raises:
            PathError: the arm cannot follow the leg to the frame.
            IncapableArmError: it cannot run along it at any speed.
        """
        solver, end = solver_of(arm), self.length
        leg = _leg(solver, self.X_last, X, self.pace)
        if leg.length < NEGLIGIBLE:
            return attrs.evolve(self, marks=(*self.marks, end))
        new = attrs.evolve(
            self, X_last=X, rates=leg.rates, most=leg.most, reach=leg.reach, marks=(*self.marks, end + leg.length)
        )
        ahead = self._ahead(now)
        if ahead and (d := self._room(leg, ahead, now)):
            with contextlib.suppress(PathError):
                pieces = (*ahead[:-1], *_round(solver, self, leg, d))
                law = self.law if self.held else _run(pieces, self.law.until(self._begin(now), now), self.stops)
                if law is not None:
                    return attrs.evolve(new, pieces=pieces, law=law)
        pieces = (*ahead, *_straight_on(solver, self, leg, self._joints_at(end)))
        if not ahead:
            law = _run(pieces, self.law.until(now, now), ())
            assert law is not None  # noqa: S101 - it begins at rest
            return attrs.evolve(new, pieces=pieces, law=law, stops=(), stop_count=self.stop_count + bool(self.pieces))
        # It stops first, and the average comes to rest then.
        law = self.law if self.held else _run(pieces, self.law.until(self.end, now), ())
        assert law is not None  # noqa: S101 - it begins at rest
        return attrs.evolve(new, pieces=pieces, law=law, stops=(*self.stops, end), stop_count=self.stop_count + 1)

    def _room(self, leg: _Leg, ahead: tuple[_Piece, ...], now: float) -> float:
        """Return the half-width of a corner at the end [m]; 0 where the arm is too near."""
        d = min(leg.reach, self.reach)
        fastest = max(leg.most, *(float(piece.most.max()) for piece in ahead))
        way, _ = self.law.at(now)
        return d if way + WINDOW * fastest < self.length - d else 0.0

    def _ahead(self, now: float) -> tuple[_Piece, ...]:
        """Return the pieces that the arm has not left behind; none where it stands at the end of the path."""
        if self.rests(now) and not self.held:
            return ()
        way = self.travelled(now)
        return tuple(piece for piece in self.pieces if piece.end > way - _SAME)

    def braked(self, now: float) -> FrameQueue:
        """Return the queue whose arm brakes on its path as hard as it may, and stands there until it is resumed."""
        law, (_, rate) = self.law.until(now, now), self.law.at(now)
        if not rate:
            return attrs.evolve(self, law=law, held=True)
        edges, _, changes = _bounds_along(self.pieces)
        begin, square = float(law.s[-1]), rate**2
        inner = edges[edges > begin + _SAME]
        ways = np.append(begin, inner)
        on = segments_at(edges, (ways[:-1] + ways[1:]) / 2, len(changes))
        lengths, squares = list[float](), [square]
        for length, change in zip(np.diff(ways).tolist(), changes[on].tolist(), strict=True):
            left = squares[-1] - 2 * change * length
            lengths.append(length if left > 0 else squares[-1] / (2 * change))
            squares.append(max(left, 0.0))
            if left <= 0:
                break
        squares[-1] = 0.0
        return attrs.evolve(self, law=law.then(np.array(lengths), np.sqrt(squares)), held=True)

    def resumed(self, now: float) -> FrameQueue:
        """Return the queue whose arm goes on along its path, from rest."""
        pieces, law = self._ahead(now), self.law.until(max(now, self.end), now)
        if law.s[-1] < self.length - _SAME:
            run = _run(pieces, law, self.stops)
            assert run is not None  # noqa: S101 - it begins at rest
            law = run
        return attrs.evolve(self, law=law, held=False)

    def _joints_at(self, way: float) -> Array:
        """Return the joint positions (n,) at a way on the path."""
        if not self.pieces:
            return self.q_start
        piece = next((piece for piece in self.pieces if way <= piece.end), self.pieces[-1])
        return piece.joints(min(max(way - piece.start, 0.0), piece.joints.duration))

    def _begin(self, now: float) -> float:
        """Return from when on the way may be another one [s]: where it rests at a stop, so does the average first."""
        way, rate = self.law.at(now)
        if rate or not any(abs(way - stop) < _SAME for stop in self.stops):
            return now
        return max(now, float(self.law.t[np.flatnonzero(self.law.s <= way + _SAME)[-1]]))

    def trajectory(self, now: float, period: float) -> Trajectory:
        """Return what the joints do from now on, to rest, a whole number of servo periods long.

        Args:
            now: the time, a whole number of periods [s].
            period: of the servo [s].
        """
        if self.rests(now):
            return hold(self._joints_at(float(self.law.s[-1])), period)
        law = averaged(self.law, now)
        edges = np.concatenate([piece.start + piece.joints.times[:-1] for piece in self.pieces])
        cubics = np.concatenate([piece.joints.coefficients for piece in self.pieces])
        inner = edges[(edges > law(0.0)[0] + _SAME) & (edges < self.law.s[-1] - _SAME)]
        times = apart(np.concatenate([law.times, reached(law, inner)]))
        of_law = segments_at(law.times, (times[:-1] + times[1:]) / 2, len(law.coefficients))
        clock = shifted(law.coefficients[of_law], times[:-1] - law.times[of_law])[:, :, 0]
        middles = evaluate(clock[:, :, None], (np.diff(times) / 2)[:, None])[:, 0]
        on = segments_at(edges, middles, len(edges))
        path = shifted(cubics[on], clock[:, 0] - edges[on])
        return until_a_tick(Trajectory(times=times, coefficients=composition(path, clock[:, 1:])), period)


class _Leg(NamedTuple):
    """A straight leg to a new frame.

    Attributes:
        X: (4, 4) pose of its end.
        rates: of position (3,) and of rotation (3,) by the way.
        length: [m].
        most: the largest rate of the way on it [m/s].
        reach: how much of it a corner may take [m].
    """

    X: Array
    rates: tuple[Array, Array]
    length: float
    most: float
    reach: float


def _leg(solver: Solver, A: Array, B: Array, pace: Pace) -> _Leg:
    path = Path(poses=np.stack([A, B]))
    length = float(path.lengths()[0])
    if length < NEGLIGIBLE:
        return _Leg(B, (np.zeros(3), np.zeros(3)), 0.0, 0.0, 0.0)
    shift, turn = B[:3, 3] - A[:3, 3], rotation_vector(A[:3, :3].T @ B[:3, :3])
    most = pace.velocity or report_speed(solver.arm, A[:3, 3], B[:3, 3], pace.speed)
    moved = float(np.linalg.norm(shift)) / length
    reach = min(pace.blend / moved if moved > 0 else math.inf, length / 2)
    return _Leg(B, (shift / length, turn / length), length, most, reach)


def _round(solver: Solver, queue: FrameQueue, leg: _Leg, d: float) -> Iterator[_Piece]:
    """Give the pieces from where the end of a path was open, round a corner, to the new end."""
    assert queue.rates is not None  # noqa: S101 - there is a leg before
    end, last = queue.length, queue.pieces[-1]
    corner = _Corner(queue.X_last, end, d, queue.rates, leg.rates)
    parts = [
        (last.start - end, -d, queue.most),
        (-d, d, min(queue.most, leg.most)),
        (d, leg.length - leg.reach, leg.most),
        (leg.length - leg.reach, leg.length, leg.most),
    ]
    yield from _pieces(solver, corner, parts, last.joints(0.0), last.joints(0.0, 1))


def _straight_on(solver: Solver, queue: FrameQueue, leg: _Leg, q: Array) -> Iterator[_Piece]:
    """Give the pieces of a leg from a stop."""
    still = np.zeros(3)
    corner = _Corner(queue.X_last, queue.length, 0.0, (still, still), leg.rates)
    parts = [(0.0, leg.length - leg.reach, leg.most), (leg.length - leg.reach, leg.length, leg.most)]
    yield from _pieces(solver, corner, parts, q, None)


def _pieces(
    solver: Solver,
    corner: _Corner,
    parts: list[tuple[float, float, float]],
    q: Array,
    slope: Array | None,
) -> Iterator[_Piece]:
    """Give pieces one after the other: each from a way to another, with the largest rate of the way on it.

    Args:
        solver: the arm.
        corner: what they lead round.
        parts: of the way from that on.
        q: (n,) joint positions at the start.
        slope: (n,) their rates by the way there; None where nothing is before.
    """
    for low, high, most in parts:
        if high - low > _SAME:
            joints = _joints(solver, corner, (low, high), q, slope)
            yield _Piece(joints, corner.way + low, *_bounds(solver, joints, most))
            q, slope = joints(joints.duration), joints(joints.duration, 1)


def _joints(
    solver: Solver, corner: _Corner, part: tuple[float, float], q_start: Array, slope: Array | None
) -> Trajectory:
    """Return the joints along a part of the path, as cubics by the way.

    Raises:
        PathError: the arm cannot follow it.
    """
    low, high = part
    knots = np.linspace(0.0, high - low, _KNOTS)
    for _ in range(_ROUNDS):
        X = corner(low + knots)
        q, failed = chain(solver, X, q_start)
        if failed is not None:
            raise _path_error(unmet(solver.arm, X[failed], q[failed - 1], knots[failed], knots[failed - 1]), knots)
        joints = _spline(knots, q, slope)
        t = (knots[:-1, None] + np.diff(knots)[:, None] * _LOOKS).ravel()
        Y, Z = np.asarray(solver.forward(joints(t))), corner(low + t)
        off = np.linalg.norm(Y[:, :3, 3] - Z[:, :3, 3], axis=1) / (NEAR / 2)
        turned = angle_between(Y[:, :3, :3], Z[:, :3, :3]) / (_TURNED / 2)
        worst = np.maximum(off, turned).reshape(-1, len(_LOOKS)).max(axis=1)
        if worst.max() <= 1:
            if (beyond := beyond_limits(solver.arm, joints(t), t)) is not None:
                raise _path_error(beyond, knots)
            return joints
        parts = np.where(worst > 1, np.clip(np.ceil(1.1 * worst**0.25), 2, _PARTS), 1).astype(np.intp)
        if parts.sum() > _MAX_KNOTS:
            break
        knots = divided(knots, parts)
    k = int(worst.argmax())
    near = f"the arm is singular there ({nearest_singularity(solver.arm, q[k])})"
    raise PathError("singular", 0, float(knots[k] / knots[-1]), near)


def _path_error(found: Obstruction, knots: Array) -> PathError:
    return PathError(found.cause, 0, float(found.time / knots[-1]), found.reason, joint=found.joint)


def _spline(knots: Array, q: Array, slope: Array | None) -> Trajectory:
    """Return the cubic spline through configurations (k, n) that begins with a slope (n,), where there is one."""
    from scipy.interpolate import CubicSpline  # noqa: PLC0415 - SciPy takes longer to import than all else

    spline = CubicSpline(knots, q, bc_type=("not-a-knot" if slope is None else (1, slope), "not-a-knot"))
    return Trajectory(times=knots.copy(), coefficients=np.ascontiguousarray(np.moveaxis(spline.c[::-1], 0, 1)))


def _bounds(solver: Solver, joints: Trajectory, most: float) -> tuple[Array, Array]:
    """Return the largest rates of the way (m,), and how fast they may change, so that all limits are kept.

    Raises:
        PathError: a joint would be much too fast, as beside a singularity.
        IncapableArmError: efforts are too large at any speed.
    """
    arm, limits, motion = solver.arm, solver.arm.all_limits, limited_motion(solver.arm, joints)
    rates, bends = motion.segment_peaks(1), motion.segment_peaks(2)
    ratios = most * rates / limits.speed
    if ratios.max() > MAX_SLOWDOWN:
        k = int(ratios.max(axis=1).argmax())
        q = joints(joints.times[k : k + 2])
        raise _path_error(singular(arm, q, joints.times[k : k + 2], ratios[k, : arm.n]), joints.times)
    with np.errstate(divide="ignore", invalid="ignore"):
        by_speed, by_bend = _USED * limits.speed / rates, np.sqrt(_USED * limits.acceleration / bends / 2)
        fastest = np.minimum(most, np.fmin(by_speed, by_bend).min(axis=1))
        fastest = _within_efforts(solver, joints, fastest, np.zeros_like(fastest), 0)
        left = _USED * limits.acceleration - bends * fastest[:, None] ** 2
        changes = np.minimum(most / _RAMP, np.where(rates > 0, left / rates, np.inf).min(axis=1))
    return fastest, _within_efforts(solver, joints, fastest, changes, 1)


def _within_efforts(solver: Solver, joints: Trajectory, most: Array, changes: Array, lowered: int) -> Array:
    """Return the rates of the way (m,), or their changes, lowered until efforts are within their limits.

    Args:
        solver: the arm.
        joints: along a part of the path.
        most: (m,) the largest rates of the way.
        changes: (m,) how fast these may change.
        lowered: what is to be lowered: 0 the rates, 1 the changes.

    Raises:
        IncapableArmError: that is not enough.
    """
    limit = _USED * solver.arm.all_limits.effort
    tried = [most, changes]
    if not np.isfinite(limit).any():
        return tried[lowered]
    ends = np.stack([joints.times[:-1], joints.times[1:] * (1 - 1e-12)], axis=1)
    q, slope, bend = (joints(ends.ravel(), order) for order in range(3))
    for _ in range(_TRIES):
        uses = np.zeros(len(ends))
        for part in _SPEEDS:
            for sign in _SIGNS if lowered else (0.0,):
                rate, change = (np.repeat(x, 2)[:, None] for x in (part * tried[0], sign * tried[1]))
                tau = np.asarray(solver.inverse_dynamics(q, slope * rate, bend * rate**2 + slope * change))
                use = (np.abs(limited_efforts(solver.arm, tau)) / limit).max(axis=1)
                uses = np.maximum(uses, use.reshape(-1, 2).max(axis=1))
        if (uses <= 1).all():
            return tried[lowered]
        tried[lowered] = np.where(uses > 1, _LESS * tried[lowered], tried[lowered])
    text = "takes more effort than a joint may give, however slowly the arm goes along it"
    raise IncapableArmError(f"arm '{solver.arm.name}': the way to the frame {text}")


def _run(pieces: tuple[_Piece, ...], law: AveragedLaw, stops: tuple[float, ...]) -> AveragedLaw | None:
    """Return a way run on as fast as may be along pieces of a path, to rest at their end.

    Args:
        pieces: of the path.
        law: the way up to where it may be another one.
        stops: ways at which it is to rest.

    Returns:
        The way; None where it is too fast already for what comes.
    """
    edges, most, changes = _bounds_along(pieces)
    begin = float(law.s[-1])
    for end in (*(stop for stop in stops if stop > begin + _SAME), float(edges[-1])):
        inner = edges[(edges > begin + _SAME) & (edges < end - _SAME)]
        # From rest to rest it takes two intervals.
        ways = np.concatenate([[begin], inner if len(inner) else [(begin + end) / 2], [end]])
        on = segments_at(edges, (ways[:-1] + ways[1:]) / 2, len(most))
        lengths, squares, room = np.diff(ways), most[on] ** 2, 2 * changes[on] * np.diff(ways)
        slowest = [0.0]
        for square, change in zip(squares[::-1].tolist(), room[::-1].tolist(), strict=True):
            slowest[-1] = min(slowest[-1], square)
            slowest.append(min(slowest[-1] + change, square))
        slowest.reverse()
        fast = [float(law.v[-1]) ** 2]
        if fast[0] > slowest[0] * (1 + _ROUNDING):
            return None
        for change, bound in zip(room.tolist(), slowest[1:], strict=True):
            fast.append(min(fast[-1] + change, bound))
        law = law.then(lengths, np.sqrt(fast))
        if end < edges[-1] - _SAME:
            law = law.rested(WINDOW)
        begin = end
    return law


def _bounds_along(pieces: tuple[_Piece, ...]) -> tuple[Array, Array, Array]:
    """Return ways (m + 1,), and the largest rates between them (m,), and how fast these may change (m,)."""
    edges = np.append(np.concatenate([x.start + x.joints.times[:-1] for x in pieces]), pieces[-1].end)
    most = _least_around(edges, np.concatenate([piece.most for piece in pieces]))
    return edges, most, _least_around(edges, np.concatenate([piece.changes for piece in pieces]), most)


def _least_around(edges: Array, values: Array, most: Array | None = None) -> Array:
    """Return of values (m,) on intervals the least one as far around each as the way may be while it is averaged."""
    # At the largest rates the way passes the edges at these times, and takes no less from one to another.
    times = np.append(0.0, np.cumsum(np.diff(edges) / (values if most is None else most)))
    first = np.searchsorted(times[1:], times[:-1] - WINDOW, side="right")
    last = np.searchsorted(times[:-1], times[1:] + WINDOW, side="left")
    return np.array([values[i:j].min() for i, j in zip(first.tolist(), last.tolist(), strict=True)])
