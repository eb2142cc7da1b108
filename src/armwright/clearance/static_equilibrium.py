"""The static equilibrium of a linkage with clearance: drives locked, journals pressed to their walls by loads.

Without friction the force in each pin acts through the centres of bearing and journal. So a journal is displaced in the
direction of the force that it carries, and indents the wall as that force requires; direction and geometry depend a
little on each other, and a few iterations find both. On a worn wall it lies where the wall is normal to the force.
Where rods are elastic, all this and the balance of their springs are solved together by Newton's method.

Source:
    Spec of the clearance, 0.1 and 4.3.
"""

from __future__ import annotations

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, floats
from armwright.clearance.elastic_rod import refuse_rods
from armwright.clearance.equations import free_forces, rod_springs
from armwright.clearance.ideal import (
    close_pins,
    effects,
    inverse_dynamics,
    pin_gaps,
    place_bodies,
    solve,
    stack,
    tip_position,
)
from armwright.clearance.linkage import Linkage
from armwright.clearance.worn_walls import WornWalls
from armwright.errors import InvalidValueError

_MAX_ITERATIONS = 60
# The iteration ends when no coordinate changes by more [rad, m].
_CONVERGED = 1e-14
# Changes below this are rounding; an iteration that ends with larger ones has not converged [rad, m].
_ROUNDING = 1e-9
# Differences of coordinates from which derivatives follow [rad, m].
_DIFFERENCE = 1e-6
# A pin that carries less force has no contact direction [N].
_NO_FORCE = 1e-9


@attrs.frozen(kw_only=True, eq=False)
class StaticEquilibrium:
    """A linkage with clearance at rest.

    Attributes:
        q: (..., n) coordinates, those of elastic rods among them [rad, m].
        tip: (..., 2) position of its tip [m].
        gaps: (..., p, 2) from the centre of each bearing to that of its journal [m].
        forces: (..., p) normal force of each contact [N].
    """

    q: Array
    tip: Array
    gaps: Array
    forces: Array


def find_static_equilibrium(
    linkage: Linkage,
    ideal: ArrayLike,
    clearances: ArrayLike | None = None,
    stiffness: ArrayLike | None = None,
    worn: WornWalls | None = None,
    *,
    payload: ArrayLike | None = None,
) -> StaticEquilibrium:
    """Return the equilibrium of a linkage with its drives locked at the coordinates without clearance.

    Args:
        linkage: with p pins, and n coordinates without those of elastic rods.
        ideal: (..., n) coordinates with closed pins, at which the drives are locked.
        clearances: (..., p) [m]; those of the linkage when left out.
        stiffness: (..., p) of the contacts [N/m^1.5]; rigid ones when left out.
        worn: walls of pins of these clearances, where they are worn.
        payload: (...) masses at the tip [kg].

    Raises:
        InvalidValueError: a pin carries no force, so that its journal may lie anywhere; the linkage is singular; walls
            are worn, or there is a payload, and bodies elastic.
        ShapeError: an array does not fit.
    """
    if worn is not None:
        refuse_rods("worn walls", linkage.rods)
    if payload is not None:
        refuse_rods("payloads", linkage.rods)
    start = floats(ideal, "ideal")
    c = linkage.clearance_array(clearances)
    if np.any(c < 0):
        raise InvalidValueError(f"clearances: expected none below 0, got {c.min() * 1e3:g} mm")
    K = np.inf if stiffness is None else floats(stiffness, "stiffness")
    lead = np.broadcast_shapes(start.shape[:-1], c.shape[:-1])
    q = np.array(np.broadcast_to(start, (*lead, start.shape[-1])))
    drives = q[..., list(linkage.driven)]
    still = np.zeros_like(q)
    mass = None if payload is None else np.broadcast_to(floats(payload, "payload"), lead)
    converged = np.zeros((*lead, 1), dtype=bool)
    for _ in range(_MAX_ITERATIONS):
        _, reactions = inverse_dynamics(linkage, q, still, still, mass)
        size = force_magnitudes(linkage, reactions)
        if worn is None:
            gaps = reactions * ((c + (size / K) ** (2 / 3)) / size)[..., None]
        else:
            gaps = worn.resting_gaps(linkage, q, reactions, c, K)
        new = close_pins(linkage, q, drives=drives, gaps=gaps)
        moved = np.abs(new - q).max(axis=-1, keepdims=True)
        q = np.where(converged, q, new)
        # A converged configuration stays unchanged while others are iterated.
        converged |= moved < _CONVERGED
        if np.all(converged):
            break
    if np.any(~converged & (moved > _ROUNDING)):
        raise _no_equilibrium(linkage, moved)
    if linkage.rods:
        q, size = _with_elastic_rods(linkage, q, drives, c, np.broadcast_to(np.asarray(K), c.shape))
    return StaticEquilibrium(q=q, tip=tip_position(linkage, q), gaps=pin_gaps(linkage, q), forces=size)


def _with_elastic_rods(
    linkage: Linkage, rigid: Array, drives: Array, clearances: Array, K: Array
) -> tuple[Array, Array]:
    """Return (..., n) coordinates with elastic rods, and (..., p) the forces of the pins.

    Args:
        linkage: with elastic rods.
        rigid: (..., m) coordinates of the equilibrium with rigid rods.
        drives: (..., d) of them, where they are locked.
        clearances: (..., p) [m].
        K: (..., p) stiffness of the contacts [N/m^1.5].
    """
    m, n = rigid.shape[-1], len(linkage.coordinates)
    q = np.concatenate([rigid, np.zeros((*rigid.shape[:-1], n - m))], axis=-1)
    steps = _DIFFERENCE * np.eye(n)
    converged = np.zeros((*q.shape[:-1], 1), dtype=bool)
    for _ in range(_MAX_ITERATIONS):
        residuals, _ = _elastic_residuals(linkage, q, drives, clearances, K)
        rows = [np.expand_dims(x, -2) for x in (q, drives, clearances, K)]
        above, below = (_elastic_residuals(linkage, rows[0] + side * steps, *rows[1:])[0] for side in (1, -1))
        change = solve(np.swapaxes(above - below, -1, -2) / (2 * _DIFFERENCE), -residuals)
        moved = np.abs(change).max(axis=-1, keepdims=True)
        q = np.where(converged, q, q + change)
        converged |= moved < _CONVERGED
        if np.all(converged):
            break
    if not np.all(converged | (moved < _ROUNDING)):
        raise _no_equilibrium(linkage, moved)
    return q, _elastic_residuals(linkage, q, drives, clearances, K)[1]


def _elastic_residuals(linkage: Linkage, q: Array, drives: Array, clearances: Array, K: Array) -> tuple[Array, Array]:
    """Return (..., n) what is left of the equations of an equilibrium [m, rad], and (..., p) the forces of the pins.

    The forces on the coordinates of the bodies determine the reactions. Then gaps have to point along these, drives to
    be where they are locked, and the springs of the rods to be in balance with what bends them.
    """
    lead, d, m = q.shape[:-1], len(linkage.drives), len(linkage.rigid_coordinates)
    placement = place_bodies(linkage, q)
    force, matrix = stack(lead, free_forces(placement)), effects(placement)
    loads = solve(matrix[..., :m, :], -force[..., :m])
    reactions = loads[..., d:].reshape(*lead, len(linkage.pins), 2)
    size = force_magnitudes(linkage, reactions)
    gaps = reactions * ((clearances + (size / K) ** (2 / 3)) / size)[..., None]
    apart = (pin_gaps(linkage, q) - gaps).reshape(*lead, -1)
    unbalanced = force[..., m:] + (matrix[..., m:, :] @ loads[..., None])[..., 0]
    stiffness = [k for _, k, _ in rod_springs(placement)]
    return np.concatenate([apart, q[..., list(linkage.driven)] - drives, unbalanced / stiffness], axis=-1), size


def _no_equilibrium(linkage: Linkage, moved: Array) -> InvalidValueError:
    return InvalidValueError(
        f"{linkage.name} has no equilibrium: after {_MAX_ITERATIONS} iterations it still moves by "
        f"{moved.max():.2g}; expected drives locked away from singular configurations, and rods that do not buckle"
    )


def force_magnitudes(linkage: Linkage, reactions: Array) -> Array:
    """Return (..., p) the magnitudes of the reactions (..., p, 2) of the pins at rest [N].

    Raises:
        InvalidValueError: a pin carries no force, so that its contact has no direction.
    """
    size = np.asarray(np.linalg.norm(reactions, axis=-1), dtype=np.float64)
    if not np.all(size > _NO_FORCE):
        pin = linkage.pins[int(np.argwhere(~(size > _NO_FORCE))[0][-1])].name
        raise InvalidValueError(f"pin {pin} of {linkage.name} carries no force at rest: its journal may lie anywhere")
    return size
