"""The fastest run along a given path: always some joint at a limit of speed, acceleration or effort."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import get_args

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import positions
from armwright.arrays import Array, ArrayLike, integer
from armwright.errors import IncapableArmError, InvalidValueError, ShapeError, one_of
from armwright.motion.certificate import LIMITS, LimitName, stretched_peaks
from armwright.motion.efforts import checked, effort_peaks, slowing_for_efforts
from armwright.motion.joint_path import Grid, gridded, pieces_of, through_knots
from armwright.motion.limited import by_joint, limited_efforts, limited_motion, limited_positions, passed_limits
from armwright.motion.phase_plane import SolverName, fastest
from armwright.motion.polynomials import composed
from armwright.motion.rows import on_arrays
from armwright.motion.solver import AnyArm, Solver, solver_of
from armwright.motion.trajectory import Trajectory, hold, join

# A joint that uses this part of a limit is at it.
_BINDS = 0.98
# Times of a motion at which it is asked which limit binds.
_LOOKS = 2000
_MIN_INTERVALS, _MAX_INTERVALS = 10, 20_000


@attrs.frozen(kw_only=True)
class Binding:
    """A limit that keeps a motion from being faster.

    Attributes:
        limit: speed, acceleration or effort.
        joint: whose, from 0.
        share: of the time in which it binds, 0 to 1.
    """

    limit: LimitName
    joint: int
    share: float


@attrs.frozen(kw_only=True, eq=False)
class TimeOptimal:
    """The fastest run along a path.

    Attributes:
        arm: the arm.
        trajectory: on exactly the same path, from rest to rest; accelerations jump.
        duration_before: of the motion that gave the path [s]; None where knots did.
        stops: number of positions on the path at which the arm stands: corners of the path, and rests of a given
            motion.
        peaks: of each limit the largest value of all that has limits, (n,) for most arms, see ``Arm.all_limits``:
            speeds and accelerations exactly, efforts at the samples of ``effort_peaks``.
        bindings: which limit of which joint, or its drive, binds for which share of the time, largest share first.
        factor: how many times slower it is than the run on the grid, so that the limits hold in between as well.
    """

    arm: Arm
    trajectory: Trajectory
    duration_before: float | None
    stops: int
    peaks: dict[LimitName, Array]
    bindings: tuple[Binding, ...]
    factor: float

    def share(self, limit: LimitName) -> float:
        """Return the share of the time in which a limit binds, of whatever joint."""
        return sum(binding.share for binding in self.bindings if binding.limit == limit)

    def __str__(self) -> str:
        """Say it in a few lines."""
        before = "" if self.duration_before is None else f" instead of {self.duration_before:.3f} s"
        stops = f", with {self.stops} stops on the path" if self.stops else ""
        text = f"{self.trajectory.duration:.3f} s{before}{stops}"
        for binding in self.bindings:
            text += f"\n{binding.share:.0%} of the time: {binding.limit} of {self.arm.joint_label(binding.joint)}"
        return text


def time_optimal(
    arm: AnyArm,
    path: Trajectory | ArrayLike,
    *,
    efforts: bool = True,
    intervals: int = 300,
    method: SolverName = "armwright",
) -> TimeOptimal:
    """Return the fastest run along a path of the joints, from rest to rest, inside all limits.

    Only the points of a given motion count, not its times. With s' the speed along the path, the largest s' is found
    that keeps the limits on a grid, s'' constant between its points; q(s(t)) is then a polynomial of twice the degree
    on every interval, on exactly the same path. By what the limits are still passed between the positions that were
    sampled, all of it is run slower. Accelerations jump: let the servo smooth them, or allow it less than it can.

    Args:
        arm: the arm, or a compiled one, which is faster on fine grids.
        path: a motion of its n joints; or (k, n) knots to pass through on an X-spline, two at least.
        efforts: whether the limits of the efforts count.
        intervals: of the grid, on all of the path; twice as many come half as near to the shortest time there is.
        method: who finds the largest s' on the grid: ``armwright``, or ``toppra``, which gives up on some paths.

    Returns:
        The motion, what binds it, and its durations. Where the path has a corner, or a given motion jumps in its
        rates, the arm stops.

    Raises:
        KindError: the path is neither a trajectory nor numbers.
        ShapeError: it is not one of n joints, or there are fewer than two knots.
        InvalidValueError: a joint passes its range or jumps, two knots are the same.
        IncapableArmError: a joint that moves has no limit that counts; gravity and dry friction alone take more than
            a joint may give.
        UnknownNameError: nobody of that name finds it.
        ArmwrightError: toppra gave up.
        MissingExtraError: toppra was asked for and is not installed.

    Source:
        Bobrow, Dubowsky & Gibson (1985); Pham & Pham, "A new approach to time-optimal path parameterization based on
        reachability analysis" (2018).
    """
    solver = solver_of(arm)
    geometry, locate = _geometry(solver.arm, path)
    intervals = integer(intervals, "intervals", least=0)
    if not _MIN_INTERVALS <= intervals <= _MAX_INTERVALS:
        raise InvalidValueError(f"intervals: expected {_MIN_INTERVALS} to {_MAX_INTERVALS}, got {intervals}")
    one_of("solver", method, get_args(SolverName))
    pieces = pieces_of(solver.arm, geometry)
    _check_path(solver.arm, geometry, efforts=efforts)
    before = path.duration if isinstance(path, Trajectory) else None
    total = sum(piece.path.duration for piece in pieces)
    runs = []
    for piece in pieces:
        grid = gridded(solver.arm, piece, math.ceil(intervals * piece.path.duration / total))
        runs.append(_composed(grid, fastest(solver, grid, piece.rests, locate, efforts=efforts, method=method)))
    run = join(runs) if runs else hold(geometry(0.0), 0.0)
    limited, limits = limited_motion(solver.arm, run), solver.arm.all_limits
    speeds, accelerations = limited.peaks(1), limited.peaks(2)
    by_acceleration = math.sqrt(float((accelerations / limits.acceleration).max()))
    factor = max(1.0, float((speeds / limits.speed).max()), by_acceleration)
    if efforts:
        factor *= slowing_for_efforts(arm, run.slowed(factor)).factor
    run = run.slowed(factor)
    efforts_found = effort_peaks(arm, run).peaks
    return TimeOptimal(
        arm=solver.arm,
        trajectory=run,
        duration_before=before,
        stops=max(0, len(pieces) - 1),
        peaks=stretched_peaks(speeds, accelerations, efforts_found, factor),
        bindings=_bindings(solver, run, efforts=efforts) if runs else (),
        factor=factor,
    )


def _geometry(arm: Arm, path: Trajectory | ArrayLike) -> tuple[Trajectory, Callable[[float], str]]:
    """Return a path as a trajectory, and what says where one of its parameters is."""
    if isinstance(path, Trajectory):
        checked(arm, path, "path")
        return path, lambda s: f"at {s:.3f} s of the original motion"
    knots = positions(arm, path, "path", callers=2)
    if knots.ndim != 2 or len(knots) < 2:
        raise ShapeError(f"path: expected a Trajectory, or (k, {arm.n}) knots with k at least 2, got {knots.shape}")
    spline = through_knots(arm, knots)

    def between(s: float) -> str:
        knot = min(int(np.searchsorted(spline.times, s, side="right")), len(knots) - 1)
        return f"between knots {knot} and {knot + 1}"

    return spline, between


def _check_path(arm: Arm, path: Trajectory, *, efforts: bool) -> None:
    """Refuse a path that leaves the range of a joint, and joints that nothing limits."""
    for fault in passed_limits(arm, path):
        raise InvalidValueError(f"path: {fault}")
    counting = LIMITS if efforts else LIMITS[:2]
    limited = np.any([np.isfinite(getattr(arm.all_limits, name)) for name in counting if name != "speed"], axis=0)
    if arm.coupling is not None and len(limited) > arm.n:  # a limit of a drive is one of all joints that it moves
        limited = limited[: arm.n] | (limited[arm.n :, None] & (arm.coupling.inverse != 0)).any(axis=0)
    for j in np.flatnonzero(~limited & (np.ptp(path.extremes(0), axis=0) > 0)):
        raise IncapableArmError(
            f"arm '{arm.name}': {arm.joint_label(int(j))} moves and has no limit of {' or '.join(counting[1:])}, so "
            "the fastest motion is undefined"
        )


def _composed(grid: Grid, sd: Array) -> Trajectory:
    """Return q(s(t)) with s' as given at the ends of the intervals and s'' constant on each."""
    durations = 2 * grid.lengths / (sd[1:] + sd[:-1])
    inner = np.stack([np.zeros_like(durations), sd[:-1], np.diff(sd) / durations / 2], axis=1)
    terms = on_arrays(composed, [grid.local], [inner])[0]
    return Trajectory(times=np.concatenate([[0.0], np.cumsum(durations)]), coefficients=terms)


def _bindings(solver: Solver, run: Trajectory, *, efforts: bool) -> tuple[Binding, ...]:
    """Return which limits bind, by looking at the motion at even times."""
    t = (np.arange(_LOOKS) + 0.5) / _LOOKS * run.duration
    states = run(t), run(t, 1), run(t, 2)
    arm = solver.arm
    values = {"speed": limited_positions(arm, states[1]), "acceleration": limited_positions(arm, states[2])}
    if efforts:
        values["effort"] = limited_efforts(arm, np.asarray(solver.inverse_dynamics(*states)))
    uses = np.stack([by_joint(arm, np.abs(values[name]) / getattr(arm.all_limits, name)) for name in values], axis=1)
    flat = uses.reshape(_LOOKS, -1)
    counts = np.bincount(flat.argmax(axis=1)[flat.max(axis=1) >= _BINDS], minlength=flat.shape[1])
    return tuple(
        Binding(limit=LIMITS[k // solver.arm.n], joint=int(k % solver.arm.n), share=float(counts[k] / _LOOKS))
        for k in np.argsort(-counts, kind="stable")
        if counts[k]
    )
