"""Random solids, and what coal makes of them."""

from typing import Any

import coal
import numpy as np

from armwright.arrays import Array
from armwright.spatial.shapes import Box, Capsule, Cylinder, Mesh, Shape, Sphere


def random_shape(rng: np.random.Generator) -> Shape:
    kinds: list[Shape] = [
        Box(size=rng.uniform(0.002, 0.3, 3)),
        Cylinder(radius=rng.uniform(0.02, 0.1), length=rng.uniform(0.05, 0.4)),
        Capsule(radius=rng.uniform(0.02, 0.1), length=rng.uniform(0.05, 0.4)),
        Sphere(radius=rng.uniform(0.02, 0.15)),
    ]
    return kinds[rng.integers(len(kinds))]


def coal_shape(shape: Shape) -> Any:
    match shape:
        case Box(size=size):
            return coal.Box(*size)
        case Cylinder(radius=radius, length=length):
            return coal.Cylinder(radius, length)
        case Capsule(radius=radius, length=length):
            return coal.Capsule(radius, length)
        case Sphere(radius=radius):
            return coal.Sphere(radius)
        case Mesh():
            raise NotImplementedError


def coal_pose(X: Array) -> Any:
    return coal.Transform3s(np.ascontiguousarray(X[:3, :3]), X[:3, 3])


def coal_distance(a: Any, X: Array, b: Any, Y: Array) -> float:
    """The distance of two solids at poses, by coal."""
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    return float(coal.distance(a, coal_pose(X), b, coal_pose(Y), request, result))
