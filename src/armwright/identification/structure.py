"""How many parameters motions can identify, by a structural rule: spans of velocities, without random states.

Link by link from the base, a change of its ten parameters and of its rotor inertia cannot be seen if its share of the
energies depends neither on the position nor on the velocity of its own joint: the link before can then make up for it.
What its energies depend on is spanned by products of velocities that its frame can have, and by what gravity is in it;
both spans follow from those of the link before and the axis of the joint.

Source:
    Wensing, Niemeyer & Slotine (2024), A geometric characterization of observability in inertial parameter
    identification; the count follows Gautier & Khalil (1990), whose closed rules it contains.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armwright.arm.model import Arm, Joint
from armwright.arrays import Array
from armwright.dynamics.regressors import OF_LINK
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import elementary_rotation

# A direction of a span that is no longer than this part of the longest is rounding.
_ROUNDING = 1e-9


def structural_count(arm: Arm, terms: Sequence[str]) -> int:
    """Return the number of base parameters of an arm whose motors each move their own joint.

    Args:
        arm: the arm; its masses and drives are not used.
        terms: of its drives, each independent of the others: see ``model.TERMS``.
    """
    # Angular before linear velocity, in the frame of the link.
    velocities, products = np.zeros((0, 6)), np.zeros((0, 36))
    # What the potential energy is per mass and first moment: at positions 0, and how it varies.
    start, varying = np.array([0.0, *arm.gravity]), np.zeros((0, 4))
    X = arm.base
    count = 0
    for joint in arm.joints:
        X = X @ homogeneous(elementary_rotation(2, joint.theta), (0.0, 0.0, joint.d))
        Ad, G = _velocity_transform(X), _gravity_transform(X)
        velocities, products = velocities @ Ad.T, products @ np.kron(Ad, Ad).T
        start, varying = G @ start, varying @ G.T
        axis, turn, tilt = _axis(joint), _velocity_generator(joint), _gravity_generator(joint)
        both = np.kron(turn, np.eye(6)) + np.kron(np.eye(6), turn)
        velocities = _closure(velocities, turn)
        crossed = np.array([np.outer(axis, v) + np.outer(v, axis) for v in velocities]).reshape(-1, 36)
        own = np.outer(axis, axis).reshape(1, 36)
        swept, fallen = _closure(products @ both.T, both), _closure(varying @ tilt.T, tilt)
        count += _own_count(joint, terms, (own, np.vstack([crossed, swept])), (tilt @ start, fallen, tilt))
        products = _span(np.vstack([products, swept, crossed, own]))
        varying = _span(np.vstack([varying, fallen, _closure((tilt @ start)[None], tilt)]))
        velocities = _span(np.vstack([velocities, axis]))
        X = joint.behind
    return count


def _own_count(
    joint: Joint, terms: Sequence[str], kinetic: tuple[Array, Array], potential: tuple[Array, Array, Array]
) -> int:
    """Return how many combinations of the parameters of a link and its joint can be identified.

    Args:
        joint: the joint.
        terms: of the drive.
        kinetic: products of velocities that go with the square of its own speed, and those that go with others.
        potential: how that at positions 0 changes with its own position, how the rest of it does, and the generator.
    """
    own, others = kinetic
    start, fallen, tilt = potential
    rows = []
    # Beside the ten of the link stand those of rotor and offset.
    rows += [[*_kinetic_row(S), float("rotor" in terms), 0.0] for S in own]
    rows += [[*_kinetic_row(S), 0.0, 0.0] for S in others]
    rows += [[*_potential_row(h), 0.0, 0.0] for h in fallen]
    has_offset = "offset" in terms
    if joint.revolute:
        rows += [[*_potential_row(h), 0.0, 0.0] for h in _closure(start[None], tilt)]
        rows += [[0.0] * (OF_LINK + 1) + [1.0]] * has_offset
    else:
        # A weight that does not change along a slide acts as an offset of its drive does.
        rows.append([*_potential_row(start), 0.0, float(has_offset)])
    independent = sum(term not in ("rotor", "offset") for term in terms)
    return len(_span(np.array(rows))) + independent


def _axis(joint: Joint) -> Array:
    return np.asarray(np.eye(6)[2 if joint.revolute else 5])


def _velocity_transform(X: Array) -> Array:
    """Return the transform of velocities (6, 6) into a frame at X, angular before linear."""
    R, p = X[:3, :3], X[:3, 3]
    across = np.array(((0.0, -p[2], p[1]), (p[2], 0.0, -p[0]), (-p[1], p[0], 0.0)))
    return np.block([[R.T, np.zeros((3, 3))], [-R.T @ across, R.T]])


def _gravity_transform(X: Array) -> Array:
    """Return the transform (4, 4) of gravity times the position of a frame, and gravity in it, into a frame at X."""
    return np.block([[np.ones((1, 1)), X[None, :3, 3]], [np.zeros((3, 1)), X[:3, :3].T]])


def _velocity_generator(joint: Joint) -> Array:
    """Return the derivative of the transform of velocities by the position of the joint, at 0."""
    A = np.zeros((6, 6))
    if joint.revolute:
        A[0, 1] = A[3, 4] = 1.0
        A[1, 0] = A[4, 3] = -1.0
    else:
        # The origin moves along z: v becomes v - z x w.
        A[3, 1], A[4, 0] = 1.0, -1.0
    return A


def _gravity_generator(joint: Joint) -> Array:
    A = np.zeros((4, 4))
    if joint.revolute:
        A[1, 2], A[2, 1] = 1.0, -1.0
    else:
        A[0, 3] = 1.0
    return A


def _kinetic_row(products: Array) -> list[float]:
    """Return the energy of a product of velocities for a unit of each of the ten parameters of a link."""
    S = products.reshape(6, 6)
    w, v, wv = S[:3, :3], S[3:, 3:], S[:3, 3:]
    # The energy is (w I w + 2 c . (v x w) m + m v v) / 2; here all is doubled.
    moment = [2 * (wv[(k + 2) % 3, (k + 1) % 3] - wv[(k + 1) % 3, (k + 2) % 3]) for k in range(3)]
    tensor = [w[0, 0], 2 * w[0, 1], 2 * w[0, 2], w[1, 1], 2 * w[1, 2], w[2, 2]]
    return [float(np.trace(v)), *moment, *tensor]


def _potential_row(h: Array) -> list[float]:
    return [*h.tolist(), *[0.0] * 6]


def _closure(vectors: Array, A: Array) -> Array:
    """Return a basis of all that A makes of vectors, applied any number of times."""
    basis = _span(vectors)
    while True:
        larger = _span(np.vstack([basis, basis @ A.T]))
        if len(larger) == len(basis):
            return basis
        basis = larger


def _span(vectors: Array) -> Array:
    """Return an orthonormal basis (r, k) of the span of vectors (m, k)."""
    if not vectors.size:
        return vectors[:0]
    lengths = np.linalg.norm(vectors, axis=1)
    vectors = vectors[lengths > _ROUNDING * max(1.0, lengths.max())]
    if not len(vectors):
        return vectors
    _, sizes, basis = np.linalg.svd(vectors / np.linalg.norm(vectors, axis=1)[:, None], full_matrices=False)
    return np.asarray(basis[sizes > _ROUNDING * sizes[0]])
