"""Convex hulls of meshes, which replace them in collisions, and where the hulls differ much."""

from __future__ import annotations

from collections.abc import Iterable

from armwright.errors import counted, listed
from armwright.spatial.shapes import Mesh, Shape, collision_shapes, is_closed, open_edges, volume

# Hulls up to so many times the volume of a mesh are near enough to it.
_NEAR = 1.3
_MAX_LISTED = 10


def hull_volume(mesh: Mesh) -> float:
    """Return the volume of the convex hull of a mesh [m³]."""
    from scipy.spatial import ConvexHull  # noqa: PLC0415 - only meshes need it

    return float(ConvexHull(mesh.vertices).volume)


def hull_messages(bodies: Iterable[tuple[str, Shape]]) -> list[str]:
    """Say of which bodies the shape in collisions differs much from their mesh; none where all are near.

    Args:
        bodies: names and shapes.
    """
    larger, unclosed = [], []
    for name, shape in bodies:
        if not isinstance(shape, Mesh):
            continue
        if not is_closed(shape):
            unclosed.append(f"{name} ({counted(open_edges(shape), 'open edge')})")
            continue
        ratio = sum(hull_volume(piece) for piece in collision_shapes(shape) if isinstance(piece, Mesh)) / volume(shape)
        if ratio > _NEAR:
            larger.append(f"{name} ({ratio:.3g} times)")
    messages = []
    if larger:
        messages.append(
            f"in collisions, convex hulls replace meshes, and some are much larger: "
            f"{listed(larger, _MAX_LISTED)}; name convex pieces of such a mesh as its pieces"
        )
    if unclosed:
        messages.append(f"meshes that are not closed are taken as their convex hulls: {listed(unclosed, _MAX_LISTED)}")
    return messages
