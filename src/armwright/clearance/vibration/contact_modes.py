"""Natural frequencies of a linkage at rest on the contacts of its pins, its drives held.

A journal at rest indents its wall, and a little more force indents it a little more: across the wall a pin is a spring,
the slope of the Hertz force. Along the wall a journal rolls like a pendulum as long as the clearance. The frequencies
are those of the linkage on these springs, with its weights; friction, which hinders the rolling, is left out.
``natural_modes`` has those of elastic rods between pins that stay closed.

    H v = ω² M v,    H = ∂²V / ∂q²

with the energy V of weights, loads and contacts, and the coordinates that the drives do not hold.
"""

from __future__ import annotations

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, floats
from armwright.clearance.equations import free_forces
from armwright.clearance.ideal import gap_derivatives, mass_matrices, place_bodies, stack
from armwright.clearance.linkage import Linkage
from armwright.clearance.placement import Placement
from armwright.clearance.plane_vectors import perpendicular
from armwright.clearance.settings import contact_stiffness
from armwright.clearance.static_equilibrium import find_static_equilibrium

# The change of a coordinate in the difference quotients of what turns with the bodies, smooth over their size [rad, m].
_STEP = 1e-5
# A smaller eigenvalue, as a part of the largest, is that of a body that nothing holds.
_NOTHING = 1e-12


@attrs.frozen(kw_only=True, eq=False)
class ContactModes:
    """Modes of a linkage at rest in m configurations; f of its n coordinates are not held by drives.

    Attributes:
        q: (m, n) coordinates at rest [rad, m].
        frequencies: (m, f) in ascending order [Hz]; 0 where nothing holds a body, NaN where it would topple.
        shapes: (m, n, f) displacements of the coordinates, each shape with vᵀ M v = 1; those of the drives are 0.
        stiffness: (m, p) slope of the force of each contact [N/m].
        depths: (m, p) indentation of each journal [m].
    """

    q: Array
    frequencies: Array
    shapes: Array
    stiffness: Array
    depths: Array


def contact_modes(linkage: Linkage, closed: ArrayLike, clearances: ArrayLike | None = None) -> ContactModes:
    """Return the modes of a linkage at rest on its contacts.

    Args:
        linkage: with n coordinates and p pins.
        closed: (m, n) coordinates with closed pins, at which the drives are held.
        clearances: (p,) [m]; those of the linkage when left out.

    Raises:
        InvalidValueError: a pin carries no force, so that its journal may lie anywhere; a clearance is not above 0.
    """
    from scipy.linalg import eigh  # noqa: PLC0415 - a slow import

    c = linkage.clearance_array(clearances)
    K = contact_stiffness(linkage, c)
    rest = find_static_equilibrium(linkage, floats(closed, "closed"), c, K)
    size = np.linalg.norm(rest.gaps, axis=-1)
    depths = size - c
    slopes = 1.5 * K * np.sqrt(depths)
    forces = K * depths**1.5
    free = [i for i in range(rest.q.shape[-1]) if i not in linkage.driven]
    H = _stiffness_matrix(linkage, rest.q, rest.gaps, forces, slopes)
    M = mass_matrices(place_bodies(linkage, rest.q))
    frequencies = np.zeros((len(rest.q), len(free)))
    shapes = np.zeros((*rest.q.shape, len(free)))
    for k in range(len(rest.q)):
        squares, vectors = eigh(H[k][np.ix_(free, free)], M[k][np.ix_(free, free)])
        squares[np.abs(squares) < _NOTHING * squares[-1]] = 0.0
        with np.errstate(invalid="ignore"):
            frequencies[k] = np.sqrt(squares) / (2 * np.pi)
        shapes[k, free] = vectors
    return ContactModes(q=rest.q, frequencies=frequencies, shapes=shapes, stiffness=slopes, depths=depths)


def _stiffness_matrix(linkage: Linkage, q: Array, gaps: Array, forces: Array, slopes: Array) -> Array:
    """Return (m, n, n) second derivatives of the energy of weights, loads and contacts at rest."""
    outward = gaps / np.linalg.norm(gaps, axis=-1, keepdims=True)
    along = perpendicular(outward)
    G = _gap_jacobians(place_bodies(linkage, q))
    tension = (forces / np.linalg.norm(gaps, axis=-1))[..., None, None]
    springs = slopes[..., None, None] * _outer(outward) + tension * _outer(along)
    H = np.einsum("mpai,mpab,mpbj->mij", G, springs, G)
    # What is left turns with the bodies: forces of constant size and direction on arms that rotate.
    for j in range(q.shape[-1]):
        step = np.zeros(q.shape[-1])
        step[j] = _STEP
        ahead, behind = (_gradient(linkage, x, outward * forces[..., None]) for x in (q + step, q - step))
        H[..., j] += (ahead - behind) / (2 * _STEP)
    return np.asarray((H + np.swapaxes(H, -1, -2)) / 2)


def _outer(vectors: Array) -> Array:
    return np.asarray(vectors[..., :, None] * vectors[..., None, :])


def _gradient(linkage: Linkage, q: Array, pushes: Array) -> Array:
    """Return (m, n) the generalised forces needed against weights, loads and pushes (m, p, 2) of the journals."""
    placement = place_bodies(linkage, q)
    own = stack(q.shape[:-1], free_forces(placement))
    return np.asarray(np.einsum("mpai,mpa->mi", _gap_jacobians(placement), pushes) - own)


def _gap_jacobians(placement: Placement) -> Array:
    """Return (m, p, 2, n) derivatives of the gaps, from bearing to journal, by the coordinates."""
    J = gap_derivatives(placement)
    return J.reshape(len(J), -1, 2, J.shape[-1])
