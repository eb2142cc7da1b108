"""The longest error that deviations within their tolerances can make."""

from __future__ import annotations

import numpy as np

from armwright.arrays import Array

# What is smaller than this part of the longest generator is zero.
_ZERO = 1e-10
# So often a sum is made longer by pointing every generator its way.
_ASCENTS = 20
# Factors of the corners of a segment, and of a parallelogram.
_SIDES = (np.ones((1, 0)), np.array([[1.0], [-1.0]]), np.array([[1.0, 1], [1, -1], [-1, 1], [-1, -1]]))


def longest_sum(generators: Array, offset: Array | None = None, *, exact: bool = True) -> tuple[float, Array]:
    """Return the length of the longest sum of generators, each with a factor from -1 to 1, and these factors.

    The sums fill a zonotope, and the longest one is a corner of it. Factors change their signs across the planes that
    are normal to generators: the directions in which such planes meet lead to every face, and the corners of a face are
    those of a zonotope of one dimension less.

    Args:
        generators: (d, k), d to 3.
        offset: (d,) that is added to every sum; zero when left out.
        exact: whether all corners are looked at; otherwise those to which one climbs from the generators' directions.

    Returns:
        The length, and (k,) factors of -1 and 1.

    Source:
        Ziegler (1995), chapter 7: zonotopes and arrangements of hyperplanes.
    """
    # In units of the longest of all, products of three of them neither overflow nor vanish.
    unit = float(np.abs(generators if offset is None else np.column_stack([generators, offset])).max(initial=0.0))
    if not unit:
        return 0.0, np.ones(generators.shape[1])
    generators = generators / unit
    start = np.zeros(len(generators)) if offset is None else offset / unit
    signs = np.where(np.sign(_spread(generators) @ generators) < 0, -1.0, 1.0)
    for _ in range(_ASCENTS):
        sums = start + signs @ generators.T
        longer = np.where(sums @ generators < 0, -1.0, 1.0)
        if (longer == signs).all():
            break
        signs = longer
    if exact:
        signs = np.concatenate([signs, _corners(generators, both=offset is not None)])
    lengths = np.linalg.norm(start + signs @ generators.T, axis=-1)
    best = int(lengths.argmax())
    return float(lengths[best]) * unit, signs[best]


def _spread(generators: Array) -> Array:
    """Return the directions of the generators and both ways along each axis, (c, d)."""
    axes = np.eye(len(generators))
    return np.concatenate([generators.T, -generators.T, axes, -axes])


def _corners(G: Array, *, both: bool, most: int = 3) -> Array:
    """Return the factors (c, k) of the corners; of two that are opposite only one, unless both are asked for.

    Generators of a face fill it alone: beyond ``most`` dimensions they reach by rounding only.
    """
    lengths = np.linalg.norm(G, axis=0)
    small = _ZERO * max(float(lengths.max(initial=0.0)), np.finfo(float).tiny)
    axes, sizes, _ = np.linalg.svd(G, full_matrices=False)
    rank = min(int((sizes > small).sum()), most)
    within = axes[:, :rank].T @ G
    if rank < 2:
        found = np.where(within[:1] < 0, -1.0, 1.0) if rank else np.ones((1, G.shape[1]))
    else:
        normals = _normals(within[:, lengths > small])
        long = np.linalg.norm(normals, axis=1)
        normals = normals[long > small * float(lengths.max()) ** (rank - 2)]
        heights = normals @ within
        flat = np.abs(heights) <= small * np.linalg.norm(normals, axis=1)[:, None]
        # Generators of one face lead to it in pairs, each of which would give its corners again.
        _, first = np.unique(flat, axis=0, return_index=True)
        signs, flat = np.where(heights[first] < 0, -1.0, 1.0), flat[first]
        counts = flat.sum(axis=1)
        simple = counts == rank - 1
        parts = [_of_simple_faces(signs[simple], flat[simple], rank - 1)]
        parts += [_of_face(G, signs[i], flat[i], rank - 1) for i in np.flatnonzero(~simple)]
        found = np.concatenate(parts)
    return np.concatenate([found, -found]) if both else found


def _of_simple_faces(signs: Array, flat: Array, count: int) -> Array:
    """Return the factors of the corners of faces in which lie as many generators as they have dimensions."""
    corners = np.repeat(signs, len(_SIDES[count]), axis=0)
    _, columns = np.nonzero(flat)
    rows = np.arange(len(corners)).reshape(len(signs), len(_SIDES[count]))
    corners[rows[:, :, None], columns.reshape(len(signs), 1, count)] = _SIDES[count]
    return corners


def _of_face(G: Array, signs: Array, flat: Array, count: int) -> Array:
    """Return the factors of the corners of a face, the generators in which are flat."""
    sides = _corners(G[:, flat], both=True, most=count)
    factors = np.tile(signs, (len(sides), 1))
    factors[:, flat] = sides
    return factors


def _normals(vectors: Array) -> Array:
    """Return what is normal to each vector of the plane, or to each pair of vectors of space: one in a row."""
    if len(vectors) == 2:
        return np.stack([-vectors[1], vectors[0]], axis=-1)
    first, second = np.triu_indices(vectors.shape[1], 1)
    return np.cross(vectors[:, first].T, vectors[:, second].T)
