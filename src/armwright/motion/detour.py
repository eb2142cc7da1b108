"""Detours of straight lines: by a via pose beside the line, or along it by damped rates; and their cost."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from typing import Literal, TypeAlias

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import single_configuration
from armwright.arrays import Array, ArrayLike
from armwright.compiled.arm import can_be_compiled, compile_arm
from armwright.errors import IncapableArmError, one_of
from armwright.kinematics.damped_least_squares import damped_rates
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.candidates import exact_pose
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.branch_selection import nearest_configurations
from armwright.motion.certified_motion import CertifiedMotion
from armwright.motion.deviation import curve_bounds, tracking_error
from armwright.motion.limit_utilization import slowing_for_limits
from armwright.motion.limited import limited_efforts, limited_motion
from armwright.motion.obstruction import PathError
from armwright.motion.solver import AnyArm, Solver, solver_of
from armwright.motion.straight import certified_line, requested_line
from armwright.motion.straight_path import StraightPath
from armwright.motion.tolerance import ROTATION_PER_METRE, Tolerance, tolerance
from armwright.motion.trajectory import Trajectory, join
from armwright.motion.xspline_path import xspline
from armwright.spatial.poses import position_text
from armwright.spatial.rotations import rotation_from_vector, rotation_vector

DetourMethod: TypeAlias = Literal["via", "damped"]

# Via poses that are tried: distances beside the line [m], directions at each, and rotations of the tool [rad].
_BESIDE = (0.02, 0.05, 0.1, 0.2, 0.4)
_DIRECTIONS = 8
_TURNS = (0.1, 0.3, 0.6)
# Poses of the joint moves between the ends that are tried: fractions of the path, and joint moves, the shortest first.
_ON_THE_WAY = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
_JOINT_MOVES = 3
# Then what lies round the shortest one is tried: rings of so many, joints off by so much, in parts of the path.
_SCATTERED, _SCATTER, _PARTS = 16, (0.1, 0.1, 0.2, 0.2), (0.3, 0.9)
# A detour that takes longer than the line by so many times its duration is worth looking for another.
_LONG = 2.0
# A line that takes so many times its duration, and so much longer [s], is crawled along. A detour is searched for
# then too, and taken where it needs no more than this part of the time.
_CRAWL, _WAIT, _BETTER = 10.0, 1.0, 0.5
# A via pose stands no nearer to the ends of the line than this part of it.
_MARGIN = 0.1
# Damped rates: steps of the path, how fast what is missing is made up for [1/s], and how long after the end, at most.
_STEPS = 600
_MAKE_UP = 20.0
_AFTER = 1.0
_LITTLE = 0.1
# Where a joint rushes the path is run slower: so often, over so many intervals to either side.
_EASINGS, _AROUND = 3, 20
# How far damped rates leave the line is found to a part of this [m].
_LOOKED_AT = 1e-3
# The end is met to this [m], a rotation counted as ``ROTATION_PER_METRE`` says.
_ARRIVED = 1e-6
# The price of a detour is that of so many poses of it, and of its via pose.
_PRICE_SAMPLES = 201
# Efforts at rest are compared with their limits to this part.
_ROUNDING = 1e-6


@attrs.frozen(kw_only=True)
class Price:
    """Cost of a detour.

    Attributes:
        distance: largest distance of the tool from the straight line [m].
        rotation: largest angle from the orientation that belongs to the line [rad].
        time: how much longer it takes than the line by the report's rule would [s]; 0 for a line that is run, if it is
            no crawl.
    """

    distance: float
    rotation: float
    time: float

    def __str__(self) -> str:
        """Say it in mm, mrad and s."""
        return f"{self.distance * 1e3:.1f} mm off the line, {self.rotation * 1e3:.1f} mrad, {self.time:+.2f} s"


@attrs.frozen(kw_only=True, eq=False)
class Detour:
    """A motion from the start of a line to its end.

    Attributes:
        trajectory: of the joints, at rest at both ends.
        method: ``line`` where the straight line itself can be run, ``via`` or ``damped`` otherwise.
        obstacle: what stopped the line, or made it a crawl; None where the line is run.
        via: (4, 4) the pose that it stops at on the path; None unless by ``via``.
        price: what it costs.
        legs: the certified lines it is made of; none by ``damped`` rates, which follow no line.
    """

    trajectory: Trajectory
    method: Literal["line", "via", "damped"]
    obstacle: PathError | None = None
    via: Array | None = None
    price: Price
    legs: tuple[CertifiedMotion, ...] = ()


def line_or_detour(
    arm: AnyArm,
    q_start: ArrayLike,
    X_goal: ArrayLike,
    *,
    method: DetourMethod = "via",
    deviation: float = 1e-3,
    speed: float = 100.0,
    damping: float = 0.05,
) -> Detour:
    """Plan a straight line, and where it cannot be run, a detour.

    By ``via``: a stop at a pose beside the line, at the same point with the tool rotated, or on or near a joint move
    between the ends, that two certified lines lead to and from; the nearest that is found. By ``damped``: along the
    line, where the configuration is nearly singular with joint rates that stay bounded, so that the tool leaves the
    line there and comes back. A line that could only be crawled along, at a tenth of its speed, is bypassed too, where
    that takes less than half the time.

    Args:
        arm: an arm, or a compiled one, which plans faster; a detour is searched for with a compiled one anyway.
        q_start: (n,) present joint positions [rad] or [m].
        X_goal: (4, 4) pose at the end of the line.
        method: ``via`` or ``damped``.
        deviation: allowed distance of the tool from a line [m].
        speed: 1 to 120, 100 is normal.
        damping: singular value at which damping begins [m]; see ``damped_rates``.

    Raises:
        PathError: there is no detour either; the obstacle of the line itself, with position and cause.
        InvalidValueError: ``by``, deviation, speed or damping are none.
        IncapableArmError: gravity alone takes more than a joint may give.
    """
    one_of("detour", method, ("via", "damped"))
    solver = solver_of(arm)
    q, B = single_configuration(solver.arm, q_start, "q_start"), exact_pose(X_goal)
    allowed = tolerance(deviation)
    requested = requested_line(solver.arm, np.asarray(solver.forward(q)), B, speed)
    straight: Detour | None = None
    try:
        line = certified_line(arm, q, B, allowed, speed=speed)
    except PathError as error:
        obstacle = error
    else:
        slower = 0.0 if requested is None else line.trajectory.duration - requested.duration
        crawls = requested is not None and slower > max((_CRAWL - 1) * requested.duration, _WAIT)
        certificate = line.certificate
        price = Price(distance=certificate.deviation, rotation=certificate.rotation, time=slower if crawls else 0.0)
        straight = Detour(trajectory=line.trajectory, method="line", price=price, legs=(line,))
        if requested is None or not crawls:
            return straight
        obstacle = _crawl(requested, line)
    if requested is None or (method == "damped" and obstacle.cause == "reach"):
        raise obstacle
    # So many poses are asked for in a search that it is worth compiling the arm for it.
    arm = compile_arm(solver.arm) if isinstance(arm, Arm) and can_be_compiled() else arm
    detour = _damped(arm, requested, q, damping, obstacle) if method == "damped" else None
    if method == "via":
        detour = _by_via(arm, requested, q, obstacle, allowed=allowed, speed=speed)
    if straight is not None and (detour is None or detour.trajectory.duration > _BETTER * straight.trajectory.duration):
        return straight
    if detour is None:
        raise obstacle
    return detour


def _crawl(requested: StraightPath, line: CertifiedMotion) -> PathError:
    """Return what makes a line a crawl: the joint for which it is slowed most, and where that is."""
    factor, because = line.certificate.factor, line.certificate.because
    assert because is not None  # noqa: S101 - nothing is slowed for nothing
    order = {"speed": 1}.get(because[0], 2)  # efforts rise where accelerations do
    worst = int(line.trajectory.segment_peaks(order)[:, because[1]].argmax())
    arm = line.certificate.arm
    s = float(_nearest_fraction(requested, forward(arm, line.trajectory(line.trajectory.times[worst]))))
    joint = arm.joint_label(because[1])
    reason = f"for the {because[0]} of {joint} the line would have to be run {factor:.0f} times slower"
    message = f"near {position_text(requested.at(0, np.array([s]))[0, :3, 3])} {reason}"
    return PathError("singular", 0, s, message, joint=because[1] + 1, reason=reason)


def _by_via(
    arm: AnyArm, line: StraightPath, q: Array, obstacle: PathError, *, allowed: Tolerance, speed: float
) -> Detour | None:
    """Return the fastest path by one of the nearest via poses; None where none is found."""
    solver = solver_of(arm)
    if _exceeds_efforts_at_start(solver, q):
        return None
    candidates: list[tuple[Trajectory, Array, tuple[CertifiedMotion, CertifiedMotion]]] = []
    for ring in chain(_rings(line, obstacle.fraction), _on_joint_moves(solver, q, line.poses[-1])):
        for via in ring:
            try:
                there = certified_line(arm, q, via, allowed, speed=speed, diagnose=False)
                at_via = there.trajectory(there.trajectory.duration)
                back = certified_line(arm, at_via, line.poses[-1], allowed, speed=speed, diagnose=False)
            # A leg on which gravity alone takes more than a joint may give is no detour either.
            except (PathError, IncapableArmError):
                continue
            candidates.append((join([there.trajectory, back.trajectory]), via, (there, back)))
        # Near the obstacle a detour may still be slow; farther off it is searched for only then.
        if any(motion.duration - line.duration < _LONG * line.duration for motion, _, _ in candidates):
            break
    if not candidates:
        return None
    motion, via, legs = min(candidates, key=lambda candidate: candidate[0].duration - line.duration)
    sampled = np.asarray(solver.forward(motion(np.linspace(0.0, motion.duration, _PRICE_SAMPLES))))
    distance, rotation = _largest_deviation(line, np.concatenate([sampled, via[None]]))
    price = Price(distance=distance, rotation=rotation, time=motion.duration - line.duration)
    return Detour(trajectory=motion, method="via", obstacle=obstacle, via=via, price=price, legs=legs)


def _exceeds_efforts_at_start(solver: Solver, q: Array) -> bool:
    """Whether gravity alone takes more than a joint may give where a motion begins, so that none keeps the efforts."""
    limits = solver.arm.all_limits.effort
    if not np.isfinite(limits).any():
        return False
    at_rest = np.abs(limited_efforts(solver.arm, solver.inverse_dynamics(q, np.zeros(len(q)), np.zeros(len(q)))))
    return bool((at_rest > limits * (1 + _ROUNDING)).any())


def _rings(line: StraightPath, fraction: float) -> Iterator[list[Array]]:
    """Give via poses for a position on the line, the nearest first: rotated on the spot, then beside it."""
    s = min(max(fraction, _MARGIN), 1 - _MARGIN)
    X = line.at(0, np.array([s]))[0]
    way = line.shifts[0]
    length = float(np.linalg.norm(way))
    along = way / length if length > 0 else np.array((1.0, 0.0, 0.0))
    across = np.cross(along, np.eye(3)[np.abs(along).argmin()])
    across /= np.linalg.norm(across)
    third = np.cross(along, across)
    angles = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    directions = np.cos(angles)[:, None] * across + np.sin(angles)[:, None] * third
    for number, distance in enumerate(_BESIDE):
        ring = [_moved(X, distance * direction, np.zeros(3)) for direction in directions]
        if number < len(_TURNS):
            axes = (*directions, along, -along)
            ring += [_moved(X, np.zeros(3), _TURNS[number] * axis) for axis in axes]
        yield ring


def _on_joint_moves(solver: Solver, q: Array, X_goal: Array) -> Iterator[list[Array]]:
    """Give poses through which joint moves to the goal bring the tool, then poses round the shortest such move.

    Joint moves pass where no line near the straight one does: from one branch to the other through a singular
    configuration. The poses round it are the same in every call.
    """
    arm = solver.arm
    ends = nearest_configurations(inverse(arm, X_goal, q), q)[:_JOINT_MOVES]
    if not ends:
        return
    yield [np.asarray(solver.forward(q + part * (end - q))) for end in ends for part in _ON_THE_WAY]
    chance = np.random.default_rng(2)
    for scatter in _SCATTER:
        parts = chance.uniform(*_PARTS, size=(_SCATTERED, 1))
        offsets = scatter * chance.standard_normal((_SCATTERED, arm.n))
        # A slide is not moved by radians.
        yield list(solver.forward(q + parts * (ends[0] - q) + np.where(arm.revolute, offsets, 0.0)))


def _moved(X: Array, shift: Array, rotation: Array) -> Array:
    Y = X.copy()
    Y[:3, :3] = rotation_from_vector(rotation) @ X[:3, :3]
    Y[:3, 3] += shift
    return Y


def _largest_deviation(line: StraightPath, X: Array) -> tuple[float, float]:
    """Return the largest distance of poses (k, 4, 4) from a line, and their largest rotation from its orientation."""
    on = line.at(0, _nearest_fraction(line, X))
    rotations = rotation_vector(np.swapaxes(on[:, :3, :3], -1, -2) @ X[:, :3, :3])
    distances = np.linalg.norm(X[:, :3, 3] - on[:, :3, 3], axis=-1)
    return float(distances.max()), float(np.linalg.norm(rotations, axis=-1).max())


def _nearest_fraction(line: StraightPath, X: Array) -> Array:
    """Return the fractions (...) of a line nearest to poses (..., 4, 4); the middle if it has no length."""
    shift = line.shifts[0]
    square = float(shift @ shift)
    along = (X[..., :3, 3] - line.poses[0, :3, 3]) @ shift
    return np.clip(along / square, 0.0, 1.0) if square else np.full(along.shape, 0.5)


def _damped(arm: AnyArm, line: StraightPath, q: Array, damping: float, obstacle: PathError) -> Detour | None:
    """Follow the line by damped rates; None where the end is not met, or a joint cannot keep its limits."""
    solver = solver_of(arm)
    times, configurations = _integrated(solver, line, q, damping)
    if configurations is None:
        return None
    fractions = line.progress(np.minimum(times, line.duration))
    for _ in range(_EASINGS):
        trajectory = xspline(times, configurations)
        times = np.append(0.0, np.cumsum(np.diff(times) * _easing(solver.arm, trajectory)))
    trajectory = xspline(times, configurations)
    lowest, highest = limited_motion(solver.arm, trajectory).extremes(0)
    if (lowest < solver.arm.all_limits.lower).any() or (highest > solver.arm.all_limits.upper).any():
        return None
    eased = attrs.evolve(line, corners=times[[0, -1]], progress=xspline(times, fractions), near=np.inf)
    tool = curve_bounds(solver, trajectory).tool
    error = tracking_error(solver, eased, trajectory, tool, tolerance(_LOOKED_AT))
    try:
        factor, _ = slowing_for_limits(arm, trajectory)
    except IncapableArmError:  # where gravity alone takes more than a joint may give there is no detour either
        return None
    trajectory = trajectory.slowed(factor)
    distance, rotation = float(error.position.max()), float(error.orientation.max())
    price = Price(distance=distance, rotation=rotation, time=trajectory.duration - line.duration)
    return Detour(trajectory=trajectory, method="damped", obstacle=obstacle, price=price)


def _easing(arm: Arm, trajectory: Trajectory) -> Array:
    """Return how many times longer each interval of a motion should last, changing slowly along it (m,)."""
    need = np.maximum(
        (trajectory.segment_peaks(1) / arm.limits.speed).max(axis=1),
        np.sqrt((trajectory.segment_peaks(2) / arm.limits.acceleration).max(axis=1)),
    )
    # The largest need of the neighbourhood, averaged over it: nowhere less than is needed.
    wide = np.pad(np.maximum(need, 1.0), _AROUND, mode="edge")
    largest = np.lib.stride_tricks.sliding_window_view(wide, 2 * _AROUND + 1).max(axis=-1)
    weights = np.hanning(2 * _AROUND + 3)[1:-1]
    smooth = np.convolve(np.pad(largest, _AROUND, mode="edge"), weights / weights.sum(), mode="valid")
    return np.asarray(smooth)


def _integrated(solver: Solver, line: StraightPath, q: Array, damping: float) -> tuple[Array, Array | None]:
    """Return times (k,) and configurations (k, n) from the start to where the end is met.

    No configurations where it is not met, or where a joint passes a limit before.
    """
    h = line.duration / _STEPS
    lower, upper = solver.arm.limits.lower, solver.arm.limits.upper
    configurations, t = [q], 0.0
    while t < line.duration * (1 + _AFTER) and not ((q < lower) | (q > upper)).any():
        ahead = line(np.minimum([t, t + h], line.duration))
        twist = np.concatenate([ahead[1, :3, 3] - ahead[0, :3, 3], _turn(ahead[0], ahead[1])]) / h
        missing = _missing(solver.forward(q), ahead[0])
        if t >= line.duration and np.abs(missing * np.repeat((1.0, 1 / ROTATION_PER_METRE), 3)).max() < _ARRIVED:
            return np.asarray(h * np.arange(len(configurations))), np.array(configurations)
        # What is missing at the end is little, so that bounded rates need no more than a little damping there.
        damping_now = damping if t < line.duration else _LITTLE * damping
        rates = damped_rates(solver.arm, q, twist + min(_MAKE_UP, 0.5 / h) * missing, damping=damping_now).rates
        # The middle of the step, so that the path is kept to second order.
        middle = q + rates * h / 2
        missing = _missing(solver.forward(middle), line(np.minimum([t + h / 2], line.duration))[0])
        rates = damped_rates(solver.arm, middle, twist + min(_MAKE_UP, 0.5 / h) * missing, damping=damping_now).rates
        q = q + rates * h
        t += h
        configurations.append(q)
    return np.empty(0), None


def _missing(X: Array, X_asked: Array) -> Array:
    return np.concatenate([X_asked[:3, 3] - X[:3, 3], _turn(X, X_asked)])


def _turn(X_from: Array, X_to: Array) -> Array:
    """Return the rotation vector from one orientation to another, expressed in the base frame."""
    return np.asarray(rotation_vector(X_to[:3, :3] @ X_from[:3, :3].T))
