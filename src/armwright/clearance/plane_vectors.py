"""Many vectors of the plane at once: rotated, and perpendicular."""

from __future__ import annotations

import numpy as np

from armwright.arrays import Array


def rotate(vectors: Array, angles: Array) -> Array:
    """Return vectors (..., 2) rotated by angles (...) [rad]."""
    c, s = np.cos(angles), np.sin(angles)
    return np.stack([c * vectors[..., 0] - s * vectors[..., 1], s * vectors[..., 0] + c * vectors[..., 1]], axis=-1)


def perpendicular(vectors: Array) -> Array:
    """Return vectors (..., 2) rotated by a right angle, counter-clockwise."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)
