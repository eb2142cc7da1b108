"""The linkage without clearance: its motion on a path, the efforts of its drives, and the reactions in its pins.

All pins are closed. Positions follow from Newton's iteration on the closure of the loops, speeds and accelerations from
its derivatives, efforts and reactions from the balance of every body; all for many samples at once. Elastic rods are
straight and rigid here, and their coordinates are left out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, floats, of_shape
from armwright.clearance.equations import drive_weights, free_forces, mass_matrix
from armwright.clearance.linkage import BodyPoint, Linkage
from armwright.clearance.placement import Placement, Point
from armwright.errors import InvalidValueError, ShapeError, counted
from armwright.tracing.scalar import Scalar

# Newton's iteration ends when no coordinate moves by more [rad, m].
_CLOSED = 1e-13
_MAX_ITERATIONS = 50
# A Newton step is limited to this, so that it does not jump to another assembly [rad, m].
_MAX_STEP = 0.3
# Samples per block: the arrays of a block fit the cache of the processor.
_BLOCK = 8192


@attrs.frozen(eq=False)
class IdealMotion:
    """A motion without clearance.

    Attributes:
        q: (..., n) coordinates [rad, m].
        qd: (..., n) their speeds.
        qdd: (..., n) their accelerations.
        efforts: (..., d) of the drives [N m, N].
        reactions: (..., p, 2) force on the bearing of each pin [N].
    """

    q: Array
    qd: Array
    qdd: Array
    efforts: Array
    reactions: Array


def close_pins(
    linkage: Linkage,
    guess: ArrayLike,
    *,
    tip: ArrayLike | None = None,
    drives: ArrayLike | None = None,
    gaps: ArrayLike = 0.0,
) -> Array:
    """Return the coordinates at which all pins are closed, in the assembly nearest to a guess.

    Args:
        linkage: with n coordinates and d drives.
        guess: (..., n) coordinates to start from.
        tip: (..., 2) position of its tip [m]; or else
        drives: (..., d) the driven coordinates [rad, m].
        gaps: (..., p, 2) from bearing to journal [m], for open pins.

    Returns:
        (..., n) coordinates.

    Raises:
        InvalidValueError: the position cannot be reached, or only through a singular configuration.
    """
    goal = _goal_array(linkage, tip=tip, drives=drives)
    start = floats(guess, "guess")
    lead = np.broadcast_shapes(start.shape[:-1], goal.shape[:-1], np.shape(gaps)[:-2])
    n, p = len(linkage.rigid_coordinates), len(linkage.pins)
    q = np.array(np.broadcast_to(start, (*lead, n))).reshape(-1, n)
    goals = np.broadcast_to(goal, (*lead, goal.shape[-1])).reshape(len(q), goal.shape[-1])
    apart = np.broadcast_to(gaps, (*lead, p, 2)).reshape(len(q), 2 * p)
    for block in _blocks(len(q)):
        worst = _close_loops(linkage, q[block], goals[block], apart[block], by_tip=tip is not None)
        if worst is not None:
            what = "the path" if tip is not None else "the drives"
            raise InvalidValueError(
                f"{linkage.name}: {what} cannot be followed: at sample {block.start + worst} the loops do not close "
                f"(out of reach, or at a singular configuration)"
            )
    return q.reshape(*lead, n)


def _close_loops(linkage: Linkage, q: Array, goal: Array, apart: Array, *, by_tip: bool) -> int | None:
    """Close the loops of configurations (s, n) in place; return the index of the worst, if any stays open."""
    done = np.zeros((len(q), 1), dtype=bool)
    for _ in range(_MAX_ITERATIONS):
        placement = place_bodies(linkage, q)
        residuals = _residuals(placement, goal, by_tip=by_tip)
        residuals[..., : apart.shape[-1]] -= apart
        with np.errstate(invalid="ignore"):
            step = solve(closure(placement, by_tip), -residuals)
        size = np.abs(step).max(axis=-1, keepdims=True, initial=0.0)
        step *= np.minimum(1.0, _MAX_STEP / np.maximum(size, 1e-300))
        q += np.where(done, 0.0, step)
        if not np.all(np.isfinite(q)):
            break
        # A closed configuration stays unchanged while others are iterated: its bits depend on it alone.
        done |= size < _CLOSED
        if np.all(done):
            return None
    return int(np.nan_to_num(np.abs(residuals).max(axis=-1), nan=np.inf).argmax())


def ideal_motion(
    linkage: Linkage, q: ArrayLike, velocity: ArrayLike, acceleration: ArrayLike, *, by_tip: bool
) -> IdealMotion:
    """Return speeds, accelerations, drives and reactions of a linkage whose pins are closed.

    Args:
        linkage: with n coordinates, as many freedoms as drives.
        q: (..., n) closed coordinates.
        velocity: (..., 2) of the tip [m/s], or (..., d) of the driven coordinates.
        acceleration: likewise.
        by_tip: whether both are those of the tip.

    Raises:
        InvalidValueError: a configuration is singular, or the freedoms are not as many as the drives.
    """
    q = floats(q, "q")
    lead = q.shape[:-1]
    motions = [np.broadcast_to(floats(x, "motion"), (*lead, np.shape(x)[-1])) for x in (velocity, acceleration)]
    flat = [x.reshape(math.prod(lead), x.shape[-1]) for x in (q, *motions)]
    blocks = [_block_motion(linkage, *(x[rows] for x in flat), by_tip=by_tip) for rows in _blocks(len(flat[0]))]
    joined = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    return IdealMotion(*(x.reshape(*lead, *x.shape[1:]) for x in joined))


def _block_motion(
    linkage: Linkage, q: Array, speeds: Array, accelerations: Array, *, by_tip: bool
) -> tuple[Array, ...]:
    """Return the parts of ``IdealMotion`` for configurations (s, n)."""
    lead = q.shape[:-1]
    still = [np.zeros((*lead, 2 * len(linkage.pins)))]
    A = closure(place_bodies(linkage, q), by_tip)
    qd = solve(A, np.concatenate([*still, speeds], axis=-1))
    moving = place_bodies(linkage, q, qd)
    points = [_gap(moving, i) for i in range(len(linkage.pins))] + ([moving.point(linkage.tip)] if by_tip else [])
    biases = [x for point in points for x in point.bias] + [0.0] * (0 if by_tip else len(linkage.drives))
    qdd = solve(A, np.concatenate([*still, accelerations], axis=-1) - stack(lead, biases))
    efforts, reactions = inverse_dynamics(linkage, q, qd, qdd)
    return q, qd, qdd, efforts, reactions


def inverse_dynamics(
    linkage: Linkage, q: Array, qd: Array, qdd: Array, payload: Array | None = None
) -> tuple[Array, Array]:
    """Return the efforts and reactions that belong to a motion.

    Args:
        linkage: with n coordinates, d drives and p pins.
        q: (..., n) coordinates; the journals may be eccentric in their bearings.
        qd: (..., n) speeds.
        qdd: (..., n) accelerations.
        payload: (...) masses at the tip [kg].

    Returns:
        (..., d) efforts [N m, N], and (..., p, 2) the force on each bearing, in its middle [N].

    Raises:
        InvalidValueError: the freedoms are not as many as the drives, or the configuration is singular.
    """
    n, p, d = len(linkage.rigid_coordinates), len(linkage.pins), len(linkage.drives)
    if n != d + 2 * p:
        raise InvalidValueError(
            f"{linkage.name}: expected one drive for each freedom, got {d} drives for {n - 2 * p} freedoms"
        )
    lead = q.shape[:-1]
    moving = place_bodies(linkage, q, qd)
    need = -stack(lead, free_forces(moving, payload))
    for (i, j), entry in mass_matrix(moving, payload).items():
        need[..., i] += entry * qdd[..., j]
        if i != j:
            need[..., j] += entry * qdd[..., i]
    solution = solve(effects(moving), need)
    return solution[..., :d], solution[..., d:].reshape(*lead, p, 2)


def effects(placement: Placement) -> Array:
    """Return (..., n, d + 2 p) the generalised forces of unit efforts, and of unit forces on the bearings."""
    linkage, n = placement.linkage, len(placement.q)
    d, p = len(linkage.drives), len(linkage.pins)
    A = np.zeros((*np.shape(placement.q[0]), n, d + 2 * p))
    for k, drive in enumerate(linkage.drives):
        for i, weight in drive_weights(linkage, drive.body).items():
            # Straight rods have no coordinates.
            if i < n:
                A[..., i, k] = weight
    for k in range(p):
        for i, partial in _gap(placement, k).partials.items():
            A[..., i, d + 2 * k] = -partial.x
            A[..., i, d + 2 * k + 1] = -partial.y
    return A


def gap_derivatives(placement: Placement) -> Array:
    """Return (..., 2 p, n) the derivatives of the gaps, from bearing to journal, by the coordinates."""
    return _derivatives(placement, [_gap(placement, i) for i in range(len(placement.linkage.pins))])


def point_derivatives(placement: Placement, point: BodyPoint) -> Array:
    """Return (..., 2, n) the derivatives of a point of a body by the coordinates."""
    return _derivatives(placement, [placement.point(point)])


def mass_matrices(placement: Placement) -> Array:
    """Return (..., n, n) the mass matrix of the linkage in its coordinates."""
    n = len(placement.q)
    M = np.zeros((*np.shape(placement.q[0]), n, n))
    for (i, j), entry in mass_matrix(placement).items():
        M[..., i, j] = M[..., j, i] = entry
    return M


def tip_position(linkage: Linkage, q: Array) -> Array:
    """Return (..., 2) the position of the tip [m] at coordinates (..., n)."""
    return point_position(linkage, linkage.tip, q)


def point_position(linkage: Linkage, point: BodyPoint, q: Array) -> Array:
    """Return (..., 2) the position of a point of a body [m] at coordinates (..., n)."""
    return stack(q.shape[:-1], place_bodies(linkage, q).point(point).position)


def pin_gaps(linkage: Linkage, q: Array) -> Array:
    """Return (..., p, 2) from the centre of each bearing to that of its journal [m] at coordinates (..., n)."""
    placement, p = place_bodies(linkage, q), len(linkage.pins)
    gaps = [x for i in range(p) for x in _gap(placement, i).position]
    return stack(q.shape[:-1], gaps).reshape(*q.shape[:-1], p, 2)


def tip_sensitivity(linkage: Linkage, q: ArrayLike) -> Array:
    """Return the derivative of the tip position with respect to the gaps of the pins, with locked drives.

    Args:
        linkage: with p pins.
        q: (..., n) closed coordinates.

    Returns:
        (..., 2, p, 2): shift of the tip by the gap of each pin.

    Raises:
        InvalidValueError: a configuration is singular, or the freedoms are not as many as the drives.

    Source:
        Spec of the clearance, 4.3.
    """
    q = floats(q, "q")
    lead, p = q.shape[:-1], len(linkage.pins)
    placement = place_bodies(linkage, q)
    A = closure(placement, by_tip=False)
    inverse = solve_columns(A, np.eye(q.shape[-1])[:, : 2 * p])
    return (point_derivatives(placement, linkage.tip) @ inverse).reshape(*lead, 2, p, 2)


# ---- inside --------------------------------------------------------------------------------------------------------


def _blocks(count: int) -> list[slice]:
    """Split samples into blocks, at least one."""
    return [slice(start, min(start + _BLOCK, count)) for start in range(0, max(count, 1), _BLOCK)]


def place_bodies(linkage: Linkage, q: Array, qd: Array | None = None) -> Placement:
    """Return the bodies in many configurations at once, at rest without speeds."""
    speeds = [0.0] * q.shape[-1] if qd is None else list(np.moveaxis(qd, -1, 0))
    return Placement(linkage, list(np.moveaxis(q, -1, 0)), speeds)


def _gap(placement: Placement, number: int) -> Point:
    """Return a pin's gap, from bearing to journal, as a point that moves."""
    pin = placement.linkage.pins[number]
    journal, bearing = placement.point(pin.journal), placement.point(pin.bearing)
    partials = dict(journal.partials)
    for i, partial in bearing.partials.items():
        partials[i] = partials[i].minus(partial) if i in partials else partial.times(-1.0)
    return Point(
        journal.position.minus(bearing.position),
        partials,
        journal.velocity.minus(bearing.velocity),
        journal.bias.minus(bearing.bias),
    )


def _goal_array(linkage: Linkage, *, tip: ArrayLike | None, drives: ArrayLike | None) -> Array:
    """Return the goal: (..., 2) position of the tip, or (..., d) driven coordinates."""
    if drives is not None and tip is None:
        return of_shape(drives, (len(linkage.drives),), "drives")
    if tip is None or drives is not None:
        raise ShapeError("expected either the position of the tip, or the driven coordinates")
    return of_shape(tip, (2,), "tip")


def _residuals(placement: Placement, goal: Array, *, by_tip: bool) -> Array:
    """Return the residuals of the closure: gaps of the loops, and distance from the goal."""
    linkage = placement.linkage
    reached = placement.point(linkage.tip).position if by_tip else [placement.q[i] for i in linkage.driven]
    residuals = [x for i in range(len(linkage.pins)) for x in _gap(placement, i).position]
    residuals += [x - goal[..., i] for i, x in enumerate(reached)]
    return stack(np.shape(placement.q[0]), residuals)


def closure(placement: Placement, by_tip: bool) -> Array:  # noqa: FBT001 - of two kinds of equations
    """Return the partial derivatives of gaps and tip, or of gaps and driven coordinates."""
    linkage, n = placement.linkage, len(placement.q)
    lead = np.shape(placement.q[0])
    rows = [gap_derivatives(placement)]
    if by_tip:
        rows.append(point_derivatives(placement, linkage.tip))
    else:
        rows.append(np.broadcast_to(np.eye(n)[list(linkage.driven)], (*lead, len(linkage.drives), n)))
    A = np.concatenate(rows, axis=-2)
    if A.shape[-2] != len(linkage.rigid_coordinates):
        freedoms = len(linkage.rigid_coordinates) - 2 * len(linkage.pins)
        what = "a position of the tip fixes 2" if by_tip else f"its drives fix {len(linkage.drives)}"
        raise InvalidValueError(
            f"{linkage.name}: with its pins closed it has {counted(freedoms, 'freedom')}, and {what}; expected as many"
        )
    return A


def _derivatives(placement: Placement, points: Sequence[Point]) -> Array:
    J = np.zeros((*np.shape(placement.q[0]), 2 * len(points), len(placement.q)))
    for k, point in enumerate(points):
        for i, partial in point.partials.items():
            J[..., 2 * k, i], J[..., 2 * k + 1, i] = partial
    return J


def stack(lead: tuple[int, ...], numbers: Sequence[Scalar]) -> Array:
    """Return numbers and arrays, broadcast to the leading axes, along a last axis."""
    stacked = np.zeros((*lead, len(numbers)))
    for i, x in enumerate(numbers):
        stacked[..., i] = x
    return stacked


def solve(A: Array, right: Array) -> Array:
    """Return A⁻¹ b of many systems; errors as of ``solve_columns``."""
    return np.asarray(solve_columns(A, right[..., None])[..., 0], dtype=np.float64)


def solve_columns(A: Array, columns: Array) -> Array:
    """Return A⁻¹ B of many systems.

    Raises:
        InvalidValueError: one of them is singular.
    """
    try:
        return np.asarray(np.linalg.solve(A, columns), dtype=np.float64)
    except np.linalg.LinAlgError as error:
        raise InvalidValueError("the linkage is in a singular configuration") from error
