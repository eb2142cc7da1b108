"""The linkage without play: where its bodies go when a path is followed, what its drives give, what its pins carry.

All pins are closed. Positions come of Newton's iteration on the closure of the loops, speeds and accelerations of its
derivatives, drives and reactions of the balance of every body; all for many moments at once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, floats
from armwright.clearance.equations import drive_weights, free_forces, mass_matrix
from armwright.clearance.linkage import Linkage, Place
from armwright.clearance.placement import Placement, Point
from armwright.errors import InvalidValueError, ShapeError, counted
from armwright.tracing.scalar import Scalar

# Newton's iteration ends when no coordinate moves by more [rad, m].
_CLOSED = 1e-13
_MOST_ITERATIONS = 50
# A step of a coordinate is cut to this, so that another assembly is not jumped to [rad, m].
_LONGEST_STEP = 0.3
# So many moments are worked on together: what they need stays near the processor.
_TOGETHER = 8192


@attrs.frozen(eq=False)
class IdealMotion:
    """A motion without play.

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


def closed(
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
        tip: (..., 2) where its tip is to be [m]; or else
        drives: (..., d) the driven coordinates [rad, m].
        gaps: (..., p, 2) from bearing to journal [m], for pins that are to be open.

    Returns:
        (..., n) coordinates.

    Raises:
        InvalidValueError: that place cannot be reached, or only through a singular configuration.
    """
    goal = _goal(linkage, tip=tip, drives=drives)
    given = floats(guess, "guess")
    lead = np.broadcast_shapes(given.shape[:-1], goal.shape[:-1], np.shape(gaps)[:-2])
    n, p = len(linkage.coordinates), len(linkage.pins)
    q = np.array(np.broadcast_to(given, (*lead, n))).reshape(-1, n)
    goals = np.broadcast_to(goal, (*lead, goal.shape[-1])).reshape(len(q), goal.shape[-1])
    apart = np.broadcast_to(gaps, (*lead, p, 2)).reshape(len(q), 2 * p)
    for some in _pieces(len(q)):
        worst = _close(linkage, q[some], goals[some], apart[some], by_tip=tip is not None)
        if worst is not None:
            what = "the path" if tip is not None else "the drives"
            raise InvalidValueError(
                f"{linkage.name}: {what} cannot be followed: at moment {some.start + worst} the loops do not close "
                f"(out of reach, or at a singular configuration)"
            )
    return q.reshape(*lead, n)


def _close(linkage: Linkage, q: Array, goal: Array, apart: Array, *, by_tip: bool) -> int | None:
    """Close the loops of some configurations (s, n) where they stand; return which is farthest from it, if one is."""
    done = np.zeros((len(q), 1), dtype=bool)
    for _ in range(_MOST_ITERATIONS):
        placement = _placed(linkage, q)
        misses = _misses(placement, goal, by_tip=by_tip)
        misses[..., : apart.shape[-1]] -= apart
        with np.errstate(invalid="ignore"):
            step = _solved(_closure(placement, by_tip), -misses)
        size = np.abs(step).max(axis=-1, keepdims=True, initial=0.0)
        step *= np.minimum(1.0, _LONGEST_STEP / np.maximum(size, 1e-300))
        q += np.where(done, 0.0, step)
        if not np.all(np.isfinite(q)):
            break
        # One that is closed stays as it is, however long others take: its bits are its own.
        done |= size < _CLOSED
        if np.all(done):
            return None
    return int(np.nan_to_num(np.abs(misses).max(axis=-1), nan=np.inf).argmax())


def ideal_motion(
    linkage: Linkage, q: ArrayLike, velocity: ArrayLike, acceleration: ArrayLike, *, by_tip: bool
) -> IdealMotion:
    """Return speeds, accelerations, drives and reactions of a linkage whose pins are closed.

    Args:
        linkage: with n coordinates, as many freedoms as drives.
        q: (..., n) closed coordinates.
        velocity: (..., 2) of the tip [m/s], or (..., d) of the driven coordinates.
        acceleration: likewise.
        by_tip: which of both.

    Raises:
        InvalidValueError: a configuration is singular, or the freedoms are not as many as the drives.
    """
    q = floats(q, "q")
    lead = q.shape[:-1]
    motions = [np.broadcast_to(floats(x, "motion"), (*lead, np.shape(x)[-1])) for x in (velocity, acceleration)]
    flat = [x.reshape(math.prod(lead), x.shape[-1]) for x in (q, *motions)]
    found = [_moving(linkage, *(x[some] for x in flat), by_tip=by_tip) for some in _pieces(len(flat[0]))]
    joined = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return IdealMotion(*(x.reshape(*lead, *x.shape[1:]) for x in joined))


def _moving(linkage: Linkage, q: Array, speeds: Array, pulls: Array, *, by_tip: bool) -> tuple[Array, ...]:
    """Return the parts of ``IdealMotion`` for configurations (s, n)."""
    lead = q.shape[:-1]
    still = [np.zeros((*lead, 2 * len(linkage.pins)))]
    A = _closure(_placed(linkage, q), by_tip)
    qd = _solved(A, np.concatenate([*still, speeds], axis=-1))
    moving = _placed(linkage, q, qd)
    bias = [_gap(moving, i).bias for i in range(len(linkage.pins))] + (
        [moving.point(linkage.tip).bias] if by_tip else []
    )
    against = _stacked(lead, [x for pair in bias for x in pair])
    against = against if by_tip else np.concatenate([against, np.zeros((*lead, len(linkage.drives)))], axis=-1)
    qdd = _solved(A, np.concatenate([*still, pulls], axis=-1) - against)
    efforts, reactions = balance(linkage, q, qd, qdd)
    return q, qd, qdd, efforts, reactions


def balance(linkage: Linkage, q: Array, qd: Array, qdd: Array) -> tuple[Array, Array]:
    """Return the drives and reactions with which a linkage moves as it does.

    Args:
        linkage: with n coordinates, d drives and p pins.
        q: (..., n) coordinates; the journals may lie beside the middles of their bearings.
        qd: (..., n) speeds.
        qdd: (..., n) accelerations.

    Returns:
        (..., d) efforts [N m, N], and (..., p, 2) the force on each bearing, in its middle [N].

    Raises:
        InvalidValueError: the freedoms are not as many as the drives, or the configuration is singular.
    """
    n, p, d = len(linkage.coordinates), len(linkage.pins), len(linkage.drives)
    if n != d + 2 * p:
        raise InvalidValueError(
            f"{linkage.name}: expected one drive for each freedom, got {d} drives for {n - 2 * p} freedoms"
        )
    lead = q.shape[:-1]
    moving = _placed(linkage, q, qd)
    need = -_stacked(lead, free_forces(moving))
    for (i, j), entry in mass_matrix(moving).items():
        need[..., i] += entry * qdd[..., j]
        if i != j:
            need[..., j] += entry * qdd[..., i]
    A = np.zeros((*lead, n, n))
    for k, drive in enumerate(linkage.drives):
        for i, weight in drive_weights(linkage, drive.body).items():
            A[..., i, k] = weight
    for k in range(p):
        for i, partial in _gap(moving, k).partials.items():
            A[..., i, d + 2 * k] = -partial.x
            A[..., i, d + 2 * k + 1] = -partial.y
    found = _solved(A, need)
    return found[..., :d], found[..., d:].reshape(*lead, p, 2)


def tip_of(linkage: Linkage, q: Array) -> Array:
    """Return (..., 2) where the tip is [m] at coordinates (..., n)."""
    return _stacked(q.shape[:-1], list(_placed(linkage, q).point(linkage.tip).at))


def point_of(linkage: Linkage, place: Place, q: Array) -> Array:
    """Return (..., 2) where a place of a body is [m] at coordinates (..., n)."""
    return _stacked(q.shape[:-1], list(_placed(linkage, q).point(place).at))


def gaps_of(linkage: Linkage, q: Array) -> Array:
    """Return (..., p, 2) from the middle of each bearing to that of its journal [m] at coordinates (..., n)."""
    placed = _placed(linkage, q)
    p = len(linkage.pins)
    gaps = [x for i in range(p) for x in _gap(placed, i).at]
    return _stacked(q.shape[:-1], gaps).reshape(*q.shape[:-1], p, 2)


def sensitivity(linkage: Linkage, q: ArrayLike) -> Array:
    """Return how the tip shifts with the gaps of the pins while the drives are held.

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
    placement = _placed(linkage, q)
    A = _closure(placement, by_tip=False)
    inverse = _divided(A, np.eye(q.shape[-1])[:, : 2 * p])
    tip = _jacobian(lead, [placement.point(linkage.tip)], q.shape[-1])
    return (tip @ inverse).reshape(*lead, 2, p, 2)


# ---- inside --------------------------------------------------------------------------------------------------------


def _pieces(count: int) -> list[slice]:
    """Part so many moments, at least one piece, into those that are worked on together."""
    return [slice(start, min(start + _TOGETHER, count)) for start in range(0, max(count, 1), _TOGETHER)]


def _placed(linkage: Linkage, q: Array, qd: Array | None = None) -> Placement:
    """Place the bodies for many configurations at once, at rest where no speeds are given."""
    n = q.shape[-1]
    speeds = [0.0] * n if qd is None else [qd[..., i] for i in range(n)]
    return Placement(linkage, [q[..., i] for i in range(n)], speeds)


def _gap(placement: Placement, number: int) -> Point:
    """Return a pin's gap, from bearing to journal, as a point that moves."""
    pin = placement.linkage.pins[number]
    journal, bearing = placement.point(pin.journal), placement.point(pin.bearing)
    partials = dict(journal.partials)
    for i, partial in bearing.partials.items():
        partials[i] = partials[i].minus(partial) if i in partials else partial.times(-1.0)
    return Point(
        journal.at.minus(bearing.at),
        partials,
        journal.velocity.minus(bearing.velocity),
        journal.bias.minus(bearing.bias),
    )


def _goal(linkage: Linkage, *, tip: ArrayLike | None, drives: ArrayLike | None) -> Array:
    """Return (..., 2) where the tip is to be, or (..., d) what the driven coordinates are to be."""
    if (tip is None) == (drives is None):
        raise ShapeError("expected either where the tip is to be, or the driven coordinates")
    goal = floats(tip if tip is not None else drives, "tip" if tip is not None else "drives")  # type: ignore[arg-type]
    size = 2 if tip is not None else len(linkage.drives)
    if goal.ndim == 0 or goal.shape[-1] != size:
        raise ShapeError(f"expected {size} numbers on the last axis, got shape {goal.shape}")
    return goal


def _misses(placement: Placement, goal: Array, *, by_tip: bool) -> Array:
    """Return by how much the loops are open and the goal is missed."""
    linkage = placement.linkage
    reached = placement.point(linkage.tip).at if by_tip else [placement.q[i] for i in linkage.driven]
    misses = [x for i in range(len(linkage.pins)) for x in _gap(placement, i).at]
    misses += [x - goal[..., i] for i, x in enumerate(reached)]
    return _stacked(np.shape(placement.q[0]), misses)


def _closure(placement: Placement, by_tip: bool) -> Array:  # noqa: FBT001 - of two kinds of equations
    """Return the partial derivatives of gaps and tip, or of gaps and driven coordinates."""
    linkage, n = placement.linkage, len(placement.linkage.coordinates)
    lead = np.shape(placement.q[0])
    rows = [_jacobian(lead, [_gap(placement, i) for i in range(len(linkage.pins))], n)]
    if by_tip:
        rows.append(_jacobian(lead, [placement.point(linkage.tip)], n))
    else:
        picked = np.zeros((*lead, len(linkage.drives), n))
        for k, i in enumerate(linkage.driven):
            picked[..., k, i] = 1.0
        rows.append(picked)
    A = np.concatenate(rows, axis=-2)
    if A.shape[-2] != n:
        freedoms = n - 2 * len(linkage.pins)
        what = "a place of the tip tells 2" if by_tip else f"its drives tell {len(linkage.drives)}"
        raise InvalidValueError(
            f"{linkage.name}: with its pins closed it has {counted(freedoms, 'freedom')}, and {what}; expected as many"
        )
    return A


def _jacobian(lead: tuple[int, ...], points: Sequence[Point], n: int) -> Array:
    J = np.zeros((*lead, 2 * len(points), n))
    for k, point in enumerate(points):
        for i, partial in point.partials.items():
            J[..., 2 * k, i], J[..., 2 * k + 1, i] = partial
    return J


def _stacked(lead: tuple[int, ...], numbers: Sequence[Scalar]) -> Array:
    stacked = np.zeros((*lead, len(numbers)))
    for i, x in enumerate(numbers):
        stacked[..., i] = x
    return stacked


def _solved(A: Array, right: Array) -> Array:
    """Return A⁻¹ b of many systems; errors as of ``_divided``."""
    return np.asarray(_divided(A, right[..., None])[..., 0], dtype=np.float64)


def _divided(A: Array, columns: Array) -> Array:
    """Return A⁻¹ B of many systems.

    Raises:
        InvalidValueError: one of them is singular.
    """
    try:
        return np.asarray(np.linalg.solve(A, columns), dtype=np.float64)
    except np.linalg.LinAlgError as error:
        raise InvalidValueError("the linkage is in a singular configuration") from error
