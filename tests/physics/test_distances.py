"""Distances of solids that MuJoCo alone gets wrong, by geometry."""

from itertools import product

import numpy as np
from scipy.spatial import ConvexHull

from armwright.physics.distances import Distances
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector
from armwright.spatial.shapes import Box, Capsule
from samples import Sample

ROUNDING = 1e-12


def test_a_capsule_through_a_box(sample: Sample) -> None:
    """Where the axis goes through the box, the two overlap by what the hull of all differences of their points says."""
    for rng in sample.cases(500):
        size = rng.uniform((0.001, 0.02, 0.02), (0.05, 0.5, 0.5))
        capsule = Capsule(radius=rng.uniform(0.001, 0.08), length=rng.uniform(0.02, 0.5))
        R = rotation_from_vector(rng.normal(scale=2, size=3))
        # A point of the box near an edge of it, on the axis.
        inside = size / 2 * rng.choice([-1, 1], size=3) * (1 - 10 ** rng.uniform(-4, 0, size=3))
        centre = inside + R[:, 2] * rng.uniform(-0.5, 0.5) * capsule.length
        distances = Distances([Box(size=size), capsule])
        X = homogeneous(rotation_from_vector(rng.normal(size=3)), rng.normal(size=3))
        distances.set_pose(0, X)
        distances.set_pose(1, X @ homogeneous(R, centre))

        ends = [centre + R[:, 2] * side * capsule.length / 2 for side in (-1, 1)]
        corners = np.array(list(product(*((-x / 2, x / 2) for x in size))))
        differences = ConvexHull(np.concatenate([corners - end for end in ends]))
        # The origin is as deep in it as the face that is nearest to it is away.
        depth = -differences.equations[:, 3].max() + capsule.radius
        assert abs(distances.between(0, 1, 1.0) + depth) < ROUNDING
        nearest = distances.nearest(1, 0, 1.0)
        assert abs(nearest.distance + depth) < ROUNDING
        assert (np.abs((nearest.points[0] - X[:3, 3]) @ X[:3, :3]) <= size / 2 + ROUNDING).all()
