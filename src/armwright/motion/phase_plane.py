"""The fastest run along a piece of a path: bounds on s'' and s'² point by point.

With x = s'² and u = s'', speeds, accelerations and efforts of the joints are

    qd² = q'² x,    qdd = q' u + q'' x,    tau = M q' u + (M q'' + h(q, q')) x + gravity + friction

linear in u and x but for the viscous friction, which goes with the root of x, and for friction that is no polynomial of
the speed: Stribeck's is taken as it is at the last solution, that by the cube root as a viscous one that is as large
there. On every interval of the grid u is
constant, so x at a later position of it is x + 2 u (s - s_i), linear too: the bounds hold at its start, its middle and
its end.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from armwright.arrays import Array
from armwright.dynamics.drives import coulomb_friction, drive_speeds, efforts_at_joints, friction_law
from armwright.errors import IncapableArmError
from armwright.motion.efforts import check_lasting, is_uneven, uneven_friction
from armwright.motion.forward_backward import UNBOUNDED, Bounds, by_toppra, largest_squares
from armwright.motion.joint_path import Grid
from armwright.motion.limited import limited_efforts, limited_positions
from armwright.motion.solver import Solver

SolverName: TypeAlias = Literal["armwright", "toppra"]

# Parts of an interval at which the bounds hold.
_PARTS = (0.0, 0.5, 1.0)
# So far inside of an interval a joint that starts or ends there moves.
_EDGE = 1e-3
# The root of x is replaced by its tangent at the last solution: at x no smaller than this part of the largest.
_FLOOR = 1e-6
# Between those parts a limit may be passed. There the bounds are drawn tighter by as much as is seen at these parts,
# and all is solved again: so many times at most, until no limit is passed by more than this and the time stays. Efforts
# cost more and are seen at every fourth.
_SAMPLED = np.linspace(0.0, 1.0, 33)
_EVERY = 4
_ROUNDS, _PASSED, _SETTLED = 8, 1e-4, 1e-5
# More than this part of a limit taken by gravity and dry friction is all of it.
_ALL = 1 - 1e-6


class _Rows(NamedTuple):
    """Bounds |a u + b x + c| <= 1 on every interval, (N, rows) each, and what goes with the root of x.

    Attributes:
        a: of u.
        b: of x.
        c: constant.
        viscous: of the root of x at the position of the row.
        ahead: (N, rows) how far that position is from the start of the interval, twice: x there is x + ahead u.
    """

    a: Array
    b: Array
    c: Array
    viscous: Array
    ahead: Array

    def by_tangent(self, x: Array, lengths: Array) -> Bounds:
        """Put a tangent in the position of the root of x: at a solution (N + 1,), or where standing still keeps it."""
        u = np.diff(x) / (2 * lengths)
        there = np.sqrt(np.maximum(x[:-1, None] + self.ahead * u[:, None], _FLOOR * x.max()))
        weight = np.abs(self.viscous)
        room = 2 * (_ALL - np.sign(self.viscous) * self.c)
        root = np.where(weight * there > room, room / np.where(weight > 0, weight, 1.0), there)
        slope = self.viscous / (2 * root)
        return Bounds(self.a + slope * self.ahead, self.b + slope, self.c + self.viscous * root / 2)


def fastest(
    solver: Solver,
    grid: Grid,
    rests: tuple[bool, bool],
    locate: Callable[[float], str],
    *,
    efforts: bool,
    method: SolverName,
) -> Array:
    """Return s' at the ends of the N intervals of a grid, (N + 1,), for the fastest run from rest to rest.

    Args:
        solver: the arm.
        grid: of the path.
        rests: whether the joints stand at the start and at the end whatever s' is, so that it need not be 0.
        locate: says where a parameter, as it was given, is on the path.
        efforts: whether the efforts count.
        method: who solves it.

    Raises:
        IncapableArmError: no run however slow keeps the efforts, or any run however fast.
        MissingExtraError: toppra is not installed.
    """
    solve = by_toppra if method == "toppra" else partial(largest_squares, run=solver.run)
    rows = _rows(solver, grid, locate, efforts=efforts)
    bounds = Bounds(rows.a, rows.b, rows.c)  # the root of x left out
    x = solve(bounds, grid.lengths, rests)
    for k in np.flatnonzero(x[1:-1] > UNBOUNDED / 2):
        raise IncapableArmError(f"{locate(float(grid.origins[k + 1]))} no limit bounds the joint velocities")
    before, uneven = 0.0, is_uneven(friction_law(solver.arm))
    for _ in range(_ROUNDS if uneven or rows.viscous.any() else 0):
        if uneven:
            rows = _rows(solver, grid, locate, efforts=efforts, x=x)
        bounds = rows.by_tangent(x, grid.lengths)
        x = solve(bounds, grid.lengths, rests)
        duration = float((2 * grid.lengths / (np.sqrt(x[1:]) + np.sqrt(x[:-1]))).sum())
        if abs(duration - before) <= _SETTLED * duration:
            break
        before = duration
    for _ in range(_ROUNDS):
        use = _use(solver, grid, x, efforts=efforts)[:, None]
        if use.max() <= 1 + _PASSED:
            break
        tighter = np.maximum(use, 1.0)
        bounds = bounds._replace(a=bounds.a * tighter, b=bounds.b * tighter)
        x = solve(bounds, grid.lengths, rests)
    return np.sqrt(x)


def _use(solver: Solver, grid: Grid, x: Array, *, efforts: bool) -> Array:
    """Return by how much the limits are used on every interval (N,), 1 for just, at x (N + 1,)."""
    arm, limits = solver.arm, solver.arm.all_limits
    u = np.diff(x) / (2 * grid.lengths)
    x = x[:-1]
    use = np.zeros(len(x))
    for number, part in enumerate(_SAMPLED):
        there = np.maximum(x + 2 * part * grid.lengths * u, 0.0)[:, None]
        rate, bend = grid.at(part, 1), grid.at(part, 2)
        qd, qdd = rate * np.sqrt(there), rate * u[:, None] + bend * there
        uses = [
            (limited_positions(arm, qd) / limits.speed) ** 2,
            np.abs(limited_positions(arm, qdd)) / limits.acceleration,
        ]
        if efforts and number % _EVERY == 0 and np.isfinite(limits.effort).any():
            tau = np.asarray(solver.inverse_dynamics(grid.at(part, 0), qd, qdd))
            uses.append(np.abs(limited_efforts(arm, tau)) / limits.effort)
        use = np.maximum(use, np.max(uses, axis=(0, 2)))
    return use


def _rows(
    solver: Solver, grid: Grid, locate: Callable[[float], str], *, efforts: bool, x: Array | None = None
) -> _Rows:
    """Write down the bounds of all limits that there are.

    Args:
        solver: the arm.
        grid: of the path.
        locate: says where a parameter is on the path.
        efforts: whether the efforts count.
        x: a solution (N + 1,), at which friction that is no polynomial of the speed is taken; it is left out without.
    """
    arm, law = solver.arm, friction_law(solver.arm)
    smooth, fading = law._replace(stribeck=None), law._replace(cube_root=None)
    speed, acceleration, effort = arm.all_limits.speed, arm.all_limits.acceleration, arm.all_limits.effort
    viscous = arm.motor_values("viscous")

    def limited(efforts: Array) -> Array:
        return limited_efforts(arm, np.asarray(efforts))

    def resisted(efforts: Array) -> Array:
        return limited_efforts(arm, efforts_at_joints(arm, np.asarray(efforts)))

    # The least and the most that dry friction takes of all that has limits on the intervals.
    frictions = np.stack([limited(coulomb_friction(arm, grid.at(part, 1))) for part in (_EDGE, 0.5, 1 - _EDGE)])
    least, most = frictions.min(axis=0), frictions.max(axis=0)
    limits: list[_Rows] = []
    for part in _PARTS:
        rate, bend = grid.at(part, 1), grid.at(part, 2)
        rates, bends = limited_positions(arm, rate), limited_positions(arm, bend)
        ahead = np.broadcast_to((2 * part * grid.lengths)[:, None], rates.shape)
        none, still = np.zeros_like(rates), np.zeros_like(rate)
        limits.append(_limited(speed**2, _Rows(none, rates**2, none, none, ahead)))
        limits.append(_limited(acceleration, _Rows(rates, bends, none, none, ahead)))
        if efforts and np.isfinite(effort).any():
            q, driven = grid.at(part, 0), drive_speeds(arm, rate)
            gravity = limited(solver.inverse_dynamics(q, still, still))
            a = limited(solver.inverse_dynamics(q, still, rate)) - gravity
            resisting = resisted(viscous * driven)
            b = limited(solver.inverse_dynamics(q, rate, bend)) - gravity - resisting
            b = b - limited(coulomb_friction(arm, rate))
            if is_uneven(law):
                b = b - resisted(uneven_friction(law, driven, driven))
            if is_uneven(law) and x is not None:
                # At s' there.
                there = _speeds(x, part)
                gravity = gravity + resisted(uneven_friction(fading, driven * there, driven))
                resisting = resisting + resisted(uneven_friction(smooth, driven * there, driven)) / there
            lasting = gravity + np.where(gravity > 0, most, least)
            check_lasting(arm, lasting, _ALL, grid.origins, locate)
            # Where a joint reverses on an interval, its dry friction is either; so much less is left on both sides.
            margin = effort - (most - least) / 2
            limits.append(_limited(margin, _Rows(a, b, gravity + (most + least) / 2, resisting, ahead)))
    return _Rows(*(np.concatenate(arrays, axis=1) for arrays in zip(*limits, strict=True)))


def _speeds(x: Array, part: float) -> Array:
    """Return s' (N, 1) at a part of every interval, at a solution; above 0."""
    there = (1 - part) * x[:-1] + part * x[1:]
    return np.asarray(np.sqrt(np.maximum(there, _FLOOR * x.max()))[:, None])


def _limited(limits: Array, rows: _Rows) -> _Rows:
    """Return the bounds of the joints that have a limit, in parts of it, for x at the start of the intervals.

    Args:
        limits: (n,) or (N, n) of the joints.
        rows: what is limited, (N, n) each, for x at the position of the row.
    """
    has = np.isfinite(limits).reshape(-1, limits.shape[-1])[0]
    a, b, c, viscous = ((array / limits)[:, has] for array in rows[:4])
    ahead = rows.ahead[:, has]
    return _Rows(a + b * ahead, b, c, viscous, ahead)
