"""Natural frequencies and mode shapes of a linkage with elastic rods, its drives locked and its pins closed.

Journals stay where they touch: a pin with clearance is a pivot in its contact. Weight, loads and the forces in the rods
count, so that a rod under tension vibrates faster, and one near buckling slowly.

``vibration/contact_modes`` has the modes of a linkage on the springs of its contacts.
"""

from __future__ import annotations

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, of_shape
from armwright.clearance.equations import free_forces
from armwright.clearance.ideal import closure, effects, mass_matrices, place_bodies, solve, solve_columns, stack
from armwright.clearance.linkage import Linkage
from armwright.errors import InvalidValueError

# Differences of coordinates from which stiffness follows [m].
_DIFFERENCE = 1e-6


@attrs.frozen(kw_only=True, eq=False)
class NaturalModes:
    """The natural modes of a linkage, the slowest first.

    Attributes:
        frequencies: (..., e) [Hz].
        shapes: (..., n, e) coordinates of each mode in columns, with a modal mass of 1 kg [rad, m].
    """

    frequencies: Array
    shapes: Array


def natural_modes(linkage: Linkage, q: ArrayLike) -> NaturalModes:
    """Return the natural modes of a linkage about an equilibrium; damping is left out.

    Args:
        linkage: with n coordinates, e of them of elastic rods.
        q: (..., n) coordinates of the equilibrium; see ``find_static_equilibrium``.

    Raises:
        InvalidValueError: it has no elastic rod, or the equilibrium is not stable.
        ShapeError: the coordinates are not n.
    """
    m, n = len(linkage.rigid_coordinates), len(linkage.coordinates)
    if n == m:
        raise InvalidValueError(f"{linkage.name} has no elastic body: expected one at least")
    q = of_shape(q, (n,), "q")
    placement = place_bodies(linkage, q)
    lead, C = q.shape[:-1], closure(placement, by_tip=False)
    followed = -solve_columns(C[..., :m], C[..., m:])
    Z = np.concatenate([followed, np.broadcast_to(np.eye(n - m), (*lead, n - m, n - m))], axis=-2)
    loads = solve(effects(placement)[..., :m, :], -stack(lead, free_forces(placement))[..., :m])
    # Of the coordinates that the linkage has left, one after the other is displaced to either side.
    displaced = _DIFFERENCE * np.swapaxes(Z, -1, -2)
    above, below = (_forces(linkage, q[..., None, :] + side * displaced, loads[..., None, :]) for side in (1, -1))
    K = -(above - below) @ Z / (2 * _DIFFERENCE)
    M = np.swapaxes(Z, -1, -2) @ mass_matrices(placement) @ Z
    inverse = np.linalg.inv(np.linalg.cholesky(M))
    squares, vectors = np.linalg.eigh(inverse @ ((K + np.swapaxes(K, -1, -2)) / 2) @ np.swapaxes(inverse, -1, -2))
    if not np.all(squares > 0):
        raise InvalidValueError(f"{linkage.name} is not stable in this configuration: a rod buckles")
    return NaturalModes(frequencies=np.sqrt(squares) / (2 * np.pi), shapes=Z @ np.swapaxes(inverse, -1, -2) @ vectors)


def _forces(linkage: Linkage, q: Array, loads: Array) -> Array:
    """Return (..., n) the forces on the coordinates under given efforts and reactions (..., d + 2 p)."""
    placement = place_bodies(linkage, q)
    return np.asarray(stack(q.shape[:-1], free_forces(placement)) + (effects(placement) @ loads[..., None])[..., 0])
