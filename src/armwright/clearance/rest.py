"""How a linkage with play lies at rest: drives held, journals leaning where gravity and loads press them.

Without friction the force in each pin goes through the middles of bearing and journal. So a journal leans in the
direction of the force that it carries, as deep in the wall as that force asks for; the direction changes the geometry
a little and the geometry the direction, and a few rounds settle it.

Source:
    Spec of the clearance, 0.1 and 4.3.
"""

from __future__ import annotations

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, floats
from armwright.clearance.ideal import balance, closed, gaps_of, tip_of
from armwright.clearance.linkage import Linkage
from armwright.errors import InvalidValueError, ShapeError

_MOST_ROUNDS = 60
# The rounds end when no coordinate moves by more [rad, m].
_SETTLED = 1e-14
# What rounding keeps in motion beyond that is no movement; this is [rad, m].
_RESTLESS = 1e-9
# A pin that carries less has no side on which its journal leans [N].
_NO_FORCE = 1e-9


@attrs.frozen(kw_only=True, eq=False)
class Rest:
    """A linkage with play at rest.

    Attributes:
        q: (..., n) coordinates [rad, m].
        tip: (..., 2) where its tip is [m].
        gaps: (..., p, 2) from the middle of each bearing to that of its journal [m].
        forces: (..., p) with which they press on one another [N].
    """

    q: Array
    tip: Array
    gaps: Array
    forces: Array


def at_rest(
    linkage: Linkage, ideal: ArrayLike, clearances: ArrayLike | None = None, stiffness: ArrayLike | None = None
) -> Rest:
    """Return how a linkage lies at rest with its drives held where they would be without play.

    Args:
        linkage: with n coordinates and p pins.
        ideal: (..., n) coordinates with closed pins, which tell where the drives are held.
        clearances: (..., p) [m]; those of the linkage when left out.
        stiffness: (..., p) of the contacts [N/m^1.5]; rigid ones when left out.

    Raises:
        InvalidValueError: a pin carries no force, so that its journal may lie anywhere, or the linkage is singular.
        ShapeError: an array does not fit.
    """
    start = floats(ideal, "ideal")
    own = list(linkage.clearances.values())
    c = floats(own if clearances is None else clearances, "clearances")
    if c.shape[-1:] != (len(own),):
        raise ShapeError(f"clearances: expected {len(own)} on the last axis, one per pin, got shape {c.shape}")
    if np.any(c < 0):
        raise InvalidValueError(f"clearances: expected none below 0, got {c.min() * 1e3:g} mm")
    K = np.inf if stiffness is None else floats(stiffness, "stiffness")
    lead = np.broadcast_shapes(start.shape[:-1], c.shape[:-1])
    q = np.array(np.broadcast_to(start, (*lead, start.shape[-1])))
    held = q[..., list(linkage.driven)]
    still = np.zeros_like(q)
    settled = np.zeros((*lead, 1), dtype=bool)
    for _ in range(_MOST_ROUNDS):
        _, reactions = balance(linkage, q, still, still)
        size = forces_of(linkage, reactions)
        gaps = reactions * ((c + (size / K) ** (2 / 3)) / size)[..., None]
        new = closed(linkage, q, drives=held, gaps=gaps)
        moved = np.abs(new - q).max(axis=-1, keepdims=True)
        q = np.where(settled, q, new)
        # One that lies stays as it is, however long others take.
        settled |= moved < _SETTLED
        if np.all(settled):
            break
    if np.any(~settled & (moved > _RESTLESS)):
        raise InvalidValueError(
            f"{linkage.name} does not come to rest: after {_MOST_ROUNDS} rounds it still moves by {moved.max():.2g}; "
            f"expected drives held away from singular configurations"
        )
    return Rest(q=q, tip=tip_of(linkage, q), gaps=gaps_of(linkage, q), forces=size)


def forces_of(linkage: Linkage, reactions: Array) -> Array:
    """Return (..., p) how large the reactions (..., p, 2) of the pins at rest are [N].

    Raises:
        InvalidValueError: a pin carries no force, so that its journal has no side to lean on.
    """
    size = np.asarray(np.linalg.norm(reactions, axis=-1), dtype=np.float64)
    if not np.all(size > _NO_FORCE):
        pin = linkage.pins[int(np.argwhere(~(size > _NO_FORCE))[0][-1])].name
        raise InvalidValueError(f"pin {pin} of {linkage.name} carries no force at rest: its journal may lie anywhere")
    return size
