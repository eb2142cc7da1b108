"""The static equilibrium of a linkage with clearance: drives locked, journals pressed to their walls by loads.

Without friction the force in each pin acts through the centres of bearing and journal. So a journal is displaced in the
direction of the force that it carries, and indents the wall as that force requires; direction and geometry depend a
little on each other, and a few iterations find both. On a worn wall it lies where the wall is normal to the force.

Source:
    Spec of the clearance, 0.1 and 4.3.
"""

from __future__ import annotations

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, floats
from armwright.clearance.ideal import close_pins, inverse_dynamics, pin_gaps, tip_position
from armwright.clearance.linkage import Linkage
from armwright.clearance.worn_walls import WornWalls
from armwright.errors import InvalidValueError

_MAX_ITERATIONS = 60
# The iteration ends when no coordinate changes by more [rad, m].
_CONVERGED = 1e-14
# Changes below this are rounding; an iteration that ends with larger ones has not converged [rad, m].
_ROUNDING = 1e-9
# A pin that carries less force has no contact direction [N].
_NO_FORCE = 1e-9


@attrs.frozen(kw_only=True, eq=False)
class StaticEquilibrium:
    """A linkage with clearance at rest.

    Attributes:
        q: (..., n) coordinates [rad, m].
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
) -> StaticEquilibrium:
    """Return the equilibrium of a linkage with its drives locked at the coordinates without clearance.

    Args:
        linkage: with n coordinates and p pins.
        ideal: (..., n) coordinates with closed pins, at which the drives are locked.
        clearances: (..., p) [m]; those of the linkage when left out.
        stiffness: (..., p) of the contacts [N/m^1.5]; rigid ones when left out.
        worn: walls of pins of these clearances, where they are worn.

    Raises:
        InvalidValueError: a pin carries no force, so that its journal may lie anywhere, or the linkage is singular.
        ShapeError: an array does not fit.
    """
    start = floats(ideal, "ideal")
    c = linkage.clearance_array(clearances)
    if np.any(c < 0):
        raise InvalidValueError(f"clearances: expected none below 0, got {c.min() * 1e3:g} mm")
    K = np.inf if stiffness is None else floats(stiffness, "stiffness")
    lead = np.broadcast_shapes(start.shape[:-1], c.shape[:-1])
    q = np.array(np.broadcast_to(start, (*lead, start.shape[-1])))
    drives = q[..., list(linkage.driven)]
    still = np.zeros_like(q)
    converged = np.zeros((*lead, 1), dtype=bool)
    for _ in range(_MAX_ITERATIONS):
        _, reactions = inverse_dynamics(linkage, q, still, still)
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
        raise InvalidValueError(
            f"{linkage.name} has no equilibrium: after {_MAX_ITERATIONS} iterations it still moves by "
            f"{moved.max():.2g}; expected drives locked away from singular configurations"
        )
    return StaticEquilibrium(q=q, tip=tip_position(linkage, q), gaps=pin_gaps(linkage, q), forces=size)


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
