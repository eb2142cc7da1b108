"""Joint moves and Cartesian moves through poses, by straight segments with blends: of the joints, or of the tool."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import single_configuration
from armwright.arm.reach import tool_speed_of
from armwright.arrays import Array, ArrayLike, floats, of_shape, one_or_each
from armwright.errors import InvalidValueError, RotationWarning, ShapeError, one_of
from armwright.kinematics.inverse_kinematics.candidates import typed_poses
from armwright.kinematics.inverse_kinematics.revolutions import joint_distance, mid_range
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.blends import Ends, blend_timing, blended, via_distances
from armwright.motion.branch_selection import configurations_at, configurations_through
from armwright.motion.certificate import BindingLimit, Certificate
from armwright.motion.certified_motion import certificate_of, limit_peaks
from armwright.motion.detour import Detour, DetourMethod, line_or_detour
from armwright.motion.limit_utilization import slowing_for_limits
from armwright.motion.limited import limited_positions
from armwright.motion.obstruction import PathError, cause_of
from armwright.motion.path import NEGLIGIBLE, Path
from armwright.motion.solver import AnyArm, Solver, solver_of
from armwright.motion.tolerance import Tolerance, tolerance
from armwright.motion.tool_path import Orientation, ToolPath, tool_path
from armwright.motion.tracking import Task, Tracking, track
from armwright.motion.trajectory import Trajectory, join
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import nearest_rotation

# A matrix this far from a rotation is not worth a warning.
_ROUNDING = 1e-9
# Knots to begin with: so far apart [s], and so many in each blend and on each straight segment; and at most.
_STEP, _MIN_KNOTS, _MAX_KNOTS = 0.02, 4, 500_000
# Blends without a time of their own take this part of the shortest time between two poses.
_BLEND = 0.2


@attrs.frozen(kw_only=True, eq=False)
class Move:
    """A move through poses.

    Attributes:
        arm: the arm.
        poses: (k, 4, 4) poses of the tool, their rotations made exact.
        times: (k,) when they are passed [s].
        configurations: (k, n) joint positions at the poses.
        label: branch of the configurations; several, joined by arrows, where it changes from pose to pose.
        trajectory: of the joints.
        passing_distances: (k,) shortest distance at which the planned path passes each pose: of the tool [m] for a
            Cartesian move, in joint space for a joint move; 0 at the ends and at poses that are stopped at.
        tool_path: where the tool is planned to be; None where no path of it is planned.
        certificate: how near the tool keeps to that, and which part of the limits is used; None where none is planned.
        detours: the segments from pose to pose of a move that stops at each of them; else none.
    """

    arm: Arm
    poses: Array
    times: Array
    configurations: Array
    label: str
    trajectory: Trajectory
    passing_distances: Array
    tool_path: ToolPath | None = None
    certificate: Certificate | None = None
    detours: tuple[Detour, ...] = ()

    def slowed(self, factor: float, because: BindingLimit | None = None) -> Move:
        """Return the same move run ``factor`` times slower, for a limit of a joint, from 0, if for any."""
        slow = self.trajectory.slowed(factor)
        certificate = self.certificate
        if certificate is not None:
            certificate = certificate.run_slower(factor, limit_peaks(self.arm, slow), because or certificate.because)
        return attrs.evolve(
            self,
            times=self.times * factor,
            trajectory=slow,
            tool_path=None if self.tool_path is None else self.tool_path.slowed(factor),
            certificate=certificate,
        )


def joint_move(
    arm: AnyArm,
    poses: ArrayLike,
    times: ArrayLike | None = None,
    *,
    blend: ArrayLike | None = None,
    near: ArrayLike | None = None,
    ends: Ends = "rest",
) -> Move:
    """Plan a move on which every joint goes straight from pose to pose, with blends.

    One branch is kept through all poses where it is inside the limits there; otherwise the configurations are those of
    the shortest path.

    Args:
        arm: the arm, or a compiled one.
        poses: (k, 4, 4) two or more tool poses; rotations typed with a few digits are made exact, with a warning.
        times: (k,) when they are passed, rising from 0 [s], whatever the limits say; as fast as the limits of speed,
            acceleration and effort allow when left out.
        blend: how long before and after each pose the joints are away from their straight segments [s], one number or
            (k,); a fifth of the shortest time between two poses when left out. Only with ``times``.
        near: (n,) present joint positions, for the choice of the first configuration; the middle of the limits when
            left out.
        ends: ``rest`` starts and stops, ``running`` begins and ends at full speed.

    Raises:
        PathError: a pose has no configuration inside the limits.
        ArmwrightError: poses, times or blends are none, or blends overlap.

    Source:
        Paul (1981) ch. 5; the project on the PUMA's trajectories, section 3.1.
    """
    solver = solver_of(arm)
    X = exact_poses(poses)
    configurations = configurations_through(solver.arm, X, _near(solver.arm, near))
    q = np.array([configuration.q for configuration in configurations])
    if times is None:
        if blend is not None:
            raise InvalidValueError(
                "blend: allowed only with times; without times the acceleration limits determine the blends"
            )
        limits = solver.arm.all_limits
        t, b = blend_timing(limited_positions(solver.arm, q), limits.speed, limits.acceleration, ends=ends)
    else:
        t, b = _timing(times, blend, len(X))
    move = Move(
        arm=solver.arm,
        poses=X,
        times=t,
        configurations=q,
        label=_joined_label([configuration.label for configuration in configurations]),
        trajectory=blended(t, q, b, ends=ends),
        passing_distances=via_distances(t, q, b, ends=ends),
    )
    return move if times is not None else _inside_limits(arm, move)


def cartesian_move(
    arm: AnyArm,
    poses: ArrayLike,
    times: ArrayLike | None = None,
    *,
    blend: ArrayLike | None = None,
    near: ArrayLike | None = None,
    ends: Ends = "rest",
    orientation: Orientation = "geodesic",
    deviation: float = 1e-4,
) -> Move:
    """Plan a move on which the tool goes straight from pose to pose, with blends.

    Positions and orientations are planned, the joints solved on them and joined by the X-spline whose acceleration is
    continuous, with as many knots as the deviation asks for. The branch is chosen once and kept: of the configurations
    inside the limits at the first pose the nearest that carries through.

    Args:
        arm: the arm, or a compiled one, which plans faster.
        poses: (k, 4, 4) two or more tool poses; rotations typed with a few digits are made exact, with a warning.
        times: (k,) when they are passed, rising from 0 [s], whatever the limits say; when left out, by the arm's speed
            of the tool, slower where the limits of speed, acceleration and effort ask for it.
        blend: how long before and after each pose the tool is away from its straight segments [s], one number or (k,);
            a fifth of the shortest time between two poses when left out.
        near: (n,) present joint positions, for the choice of the first configuration; the middle of the limits when
            left out.
        ends: ``rest`` starts and stops, ``running`` begins and ends at full speed.
        orientation: ``geodesic`` rotates about one fixed axis from pose to pose, ``zyz`` blends the ZYZ Euler angles.
        deviation: allowed distance of the tool from where it is planned to be [m]; the orientation may deviate by 5
            mrad for each mm of it.

    Raises:
        PathError: no branch carries through: what stops each of them, with the time, the position, and the joint.
        ArmwrightError: poses, times or blends are none, or blends overlap.

    Source:
        Paul (1981) ch. 5; the project on the PUMA's trajectories, section 3.2.
    """
    one_of("orientation", orientation, ("geodesic", "zyz"))
    solver, X = solver_of(arm), exact_poses(poses)
    t, b = _timing(_tool_times(solver.arm, X) if times is None else times, blend, len(X))
    path = tool_path(X, t, b, ends=ends, orientation=orientation)
    move = along(arm, X, path, t, b, near=near, ends=ends, deviation=deviation)
    return move if times is not None else _inside_limits(arm, move)


def along(
    arm: AnyArm,
    X: Array,
    path: ToolPath,
    times: Array,
    blend: ArrayLike,
    *,
    near: ArrayLike | None = None,
    ends: Ends = "rest",
    deviation: float = 1e-4,
) -> Move:
    """Return the move along a path of the tool, with its certificate; arguments and errors as of ``cartesian_move``."""
    solver, allowed = solver_of(arm), tolerance(deviation)
    label, tracked = _followed(solver, path, _near(solver.arm, near), allowed, rest=ends == "rest")
    certificate = certificate_of(arm, tracked.trajectory, tracked.error, allowed)
    return Move(
        arm=solver.arm,
        poses=X,
        times=times,
        configurations=tracked.trajectory(times),
        label=label,
        trajectory=tracked.trajectory,
        passing_distances=via_distances(times, X[:, :3, 3], blend, ends=ends),
        tool_path=path,
        certificate=attrs.evolve(certificate, worst_position=path(certificate.worst_time)[:3, 3]),
    )


def stopping_move(
    arm: AnyArm,
    poses: ArrayLike,
    *,
    method: DetourMethod = "via",
    near: ArrayLike | None = None,
    deviation: float = 1e-3,
    speed: float = 100.0,
) -> Move:
    """Plan certified straight lines from pose to pose with a stop at each, and detours where an obstacle stops a line.

    Args:
        arm: the arm, or a compiled one, which plans faster.
        poses: (k, 4, 4) two or more tool poses; rotations typed with a few digits are made exact, with a warning.
        method: ``via`` or ``damped``, as for ``line_or_detour``.
        near: (n,) present joint positions, for the choice of the first configuration; the middle of the limits when
            left out.
        deviation: allowed distance of the tool from a line [m].
        speed: 1 to 120, 100 is normal.

    Returns:
        The move; its ``detours`` describe every segment how it is run, and at which price.

    Raises:
        PathError: there is no path between two poses, from no configuration at the first one: what stops the nearest.
        ArmwrightError: poses, ``by``, deviation or speed are none, or all poses are the same.
    """
    solver, X = solver_of(arm), exact_poses(poses)
    if Path(poses=X).lengths().max() <= NEGLIGIBLE:
        raise InvalidValueError("poses: all of them coincide, so there is no path")
    errors: list[PathError] = []
    for start in configurations_at(solver.arm, X[:1], _near(solver.arm, near))[0]:
        try:
            legs = _legs(arm, start.q, X, method=method, deviation=deviation, speed=speed)
        except PathError as error:
            errors.append(error)
        else:
            return _stopping(solver.arm, X, start.q, legs)
    raise errors[0]


def exact_poses(poses: ArrayLike) -> Array:
    """Return poses (k, 4, 4), two at least, with exact rotations; a warning names those typed with few digits.

    Raises:
        KindError: they are something else than real numbers.
        ShapeError: they are not (k, 4, 4), or fewer than two.
        InvalidValueError: one is no pose, not even one typed with two digits.
    """
    X = of_shape(poses, (4, 4), "poses")
    if X.ndim != 3 or len(X) < 2:
        raise ShapeError(f"poses: expected two or more poses, shape (k, 4, 4), got {X.shape}")
    for i, pose in enumerate(X, 1):
        try:
            typed_poses(pose)
        except InvalidValueError as error:
            raise InvalidValueError(f"pose {i}: {str(error).removeprefix('pose: ')}") from None
    R = nearest_rotation(X[:, :3, :3])
    changes = np.abs(R - X[:, :3, :3]).max(axis=(1, 2))
    for i in np.flatnonzero(changes > _ROUNDING).tolist():
        warnings.warn(
            f"pose {i + 1}: its rotation matrix is not orthonormal (error {changes[i]:.2g}); the nearest rotation is "
            "used",
            RotationWarning,
            stacklevel=3,
        )
    return homogeneous(R, X[:, :3, 3])


def _near(arm: Arm, near: ArrayLike | None) -> Array:
    return mid_range(arm) if near is None else single_configuration(arm, near, "near")


def _timing(times: ArrayLike, blend: ArrayLike | None, count: int) -> tuple[Array, Array]:
    t = floats(times, "times")
    if t.shape != (count,):
        raise ShapeError(f"times: expected {count}, one per pose, got shape {t.shape}")
    if blend is None:
        return t, np.full(count, _BLEND * max(float(np.diff(t).min()), 0.0))
    return t, one_or_each(blend, count, "blend", "pose")


def _tool_times(arm: Arm, X: Array) -> Array:
    """Return when poses are passed at the arm's speed of the tool."""
    lengths = Path(poses=X).lengths()
    for i in np.flatnonzero(lengths <= NEGLIGIBLE):
        raise InvalidValueError(f"poses {i + 1} and {i + 2} coincide; omit one, or specify times")
    return np.concatenate([[0.0], np.cumsum(lengths / tool_speed_of(arm))])


def _inside_limits(arm: AnyArm, move: Move) -> Move:
    """Return a move slowed as much as its limits ask for."""
    factor, because = slowing_for_limits(arm, move.trajectory)
    return move if factor == 1 else move.slowed(factor, because)


def _followed(solver: Solver, path: ToolPath, near: Array, allowed: Tolerance, *, rest: bool) -> tuple[str, Tracking]:
    """Return a branch, and the joints that follow a path of the tool on it.

    The branch is chosen once and kept: of the configurations inside the limits at the start the nearest that leads to
    the end inside them.

    Raises:
        PathError: no branch does: what stops each of them, where.
    """
    arm, X = solver.arm, path(0.0)
    solution = inverse(arm, X, near)
    if not solution.allowed:
        raise PathError(cause_of(solution), 0, 0.0, f"pose 1: {solution.explain()}")
    knots = path.first_knots(_STEP, _MIN_KNOTS)
    errors: dict[str, PathError] = {}
    for branch in sorted(solution.allowed, key=lambda branch: joint_distance(arm, near, branch.q)):
        task = Task(solver, path, branch.q, allowed, allowed, rest=rest, whole_turns=True, max_knots=_MAX_KNOTS)
        try:
            return branch.label, track(task, knots)
        except PathError as error:
            errors[branch.label] = error
    nearest = next(iter(errors.values()))
    reasons = "; ".join(f"{label}: {error}" for label, error in errors.items())
    raise nearest.restated(
        nearest.segment, f"no single branch of the inverse kinematics can be followed to the last pose. {reasons}"
    )


def _legs(arm: AnyArm, q: Array, X: Array, *, method: DetourMethod, deviation: float, speed: float) -> list[Detour]:
    """Return a segment from every pose to the next, from rest to rest."""
    legs: list[Detour] = []
    for i, goal in enumerate(X[1:]):
        try:
            legs.append(line_or_detour(arm, q, goal, method=method, deviation=deviation, speed=speed))
        except PathError as error:
            raise error.restated(i, f"from pose {i + 1} to pose {i + 2}: {error}") from error
        q = legs[-1].trajectory(legs[-1].trajectory.duration)
    return legs


def _joined_label(labels: Sequence[str]) -> str:
    """Return the label of configurations: that of all of them, or all labels where they differ."""
    return labels[0] if len(set(labels)) == 1 else " -> ".join(labels)


def _stopping(arm: Arm, X: Array, q_start: Array, legs: Sequence[Detour]) -> Move:
    times = np.concatenate([[0.0], np.cumsum([leg.trajectory.duration for leg in legs])])
    configurations = np.array([q_start, *(leg.trajectory(leg.trajectory.duration) for leg in legs)])
    return Move(
        arm=arm,
        poses=X,
        times=times,
        configurations=configurations,
        label=_joined_label([inverse(arm, pose, q).best.label for pose, q in zip(X, configurations, strict=True)]),
        trajectory=join([leg.trajectory for leg in legs]),
        passing_distances=np.zeros(len(X)),
        detours=tuple(legs),
    )
