"""Solids: their volumes, centres and tensors, and what none can be."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from armwright.errors import InvalidValueError, KindError, ShapeError
from armwright.spatial.shapes import (
    Box,
    Capsule,
    Cylinder,
    Mesh,
    Shape,
    Sphere,
    centroid,
    contains,
    farthest,
    inertia,
    is_closed,
    support,
    volume,
)

SHAPES = [
    Box(size=(0.2, 0.3, 0.5)),
    Cylinder(radius=0.1, length=0.4),
    Capsule(radius=0.1, length=0.3),
    Sphere(radius=0.2),
]


def inside(shape: Shape, points: np.ndarray) -> np.ndarray:
    """Return which points (k, 3) are in a solid."""
    x, y, z = np.abs(points).T
    match shape:
        case Box(size=size):
            return (np.abs(points) <= size / 2).all(axis=1)
        case Cylinder(radius=radius, length=length):
            return (np.hypot(x, y) <= radius) & (z <= length / 2)
        case Capsule(radius=radius, length=length):
            return np.sqrt(x**2 + y**2 + np.maximum(z - length / 2, 0) ** 2) <= radius
        case Sphere(radius=radius):
            return np.linalg.norm(points, axis=1) <= radius
        case Mesh():
            raise NotImplementedError


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_random_points(shape: Shape, rng: np.random.Generator) -> None:
    """Volume and tensor are those of random points in the solid; none of them is farther out than the farthest."""
    far = farthest(shape)
    points = rng.uniform(-far, far, size=(400_000, 3))
    there = points[inside(shape, points)]
    squares = there.T @ there / len(there)

    assert np.linalg.norm(there, axis=1).max() == pytest.approx(far, rel=0.05)
    assert np.linalg.norm(there, axis=1).max() <= far
    assert volume(shape) == pytest.approx(len(there) / len(points) * (2 * far) ** 3, rel=0.02)
    np.testing.assert_allclose(inertia(shape), np.trace(squares) * np.eye(3) - squares, atol=0.01 * far**2)
    np.testing.assert_array_equal(centroid(shape), 0.0)
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    assert (there @ direction).max() == pytest.approx(support(shape, direction), rel=0.05)
    assert (there @ direction).max() <= support(shape, direction)


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_what_solids_contain(shape: Shape, rng: np.random.Generator) -> None:
    """Random points are inside by their coordinates; in every direction the farthest of them is at its reach."""
    far = farthest(shape)
    points = rng.uniform(-far, far, size=(100_000, 3))
    there = points[inside(shape, points)]

    np.testing.assert_array_equal(contains(shape, points), inside(shape, points))
    for direction in rng.normal(size=(20, 3)):
        unit = direction / np.linalg.norm(direction)
        assert (there @ unit).max() == pytest.approx(support(shape, unit), rel=0.1)
        assert (there @ unit).max() <= support(shape, unit)


def hull(points: np.ndarray) -> Mesh:
    """The convex hull of points as a mesh."""
    found = ConvexHull(points)
    faces = found.simplices.copy()
    a, b, c = (points[faces[:, i]] for i in range(3))
    inwards = np.einsum("ki,ki->k", np.cross(b - a, c - a), a - points.mean(axis=0)) < 0
    faces[inwards] = faces[inwards][:, ::-1]
    return Mesh(vertices=points, faces=faces)


def test_mesh_of_a_box(rng: np.random.Generator) -> None:
    """A box of triangles, moved away from its origin, has the volume, the centre and the tensor of the box."""
    size, away = rng.uniform(0.1, 1.0, 3), rng.normal(size=3)
    corners = np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, -1).T * size + away
    mesh, box = hull(corners), Box(size=size)

    assert is_closed(mesh)
    assert volume(mesh) == pytest.approx(volume(box), rel=1e-12)
    assert volume(mesh) == pytest.approx(ConvexHull(corners).volume, rel=1e-12)
    np.testing.assert_allclose(centroid(mesh), away, atol=1e-12)
    np.testing.assert_allclose(inertia(mesh), inertia(box), atol=1e-12)
    assert support(mesh, np.array([0.0, 0.0, 1.0])) == pytest.approx(away[2] + size[2] / 2)
    assert farthest(mesh) == pytest.approx(np.linalg.norm(corners, axis=1).max())


def test_what_meshes_contain(rng: np.random.Generator) -> None:
    """A point is in a convex mesh where it is below all planes of its faces."""
    points = rng.normal(size=(30, 3))
    planes, tried = ConvexHull(points).equations, 1.5 * rng.normal(size=(1000, 3))
    below = (tried @ planes[:, :3].T + planes[:, 3] < 0).all(axis=1)
    direction = np.array([0.6, 0.0, 0.8])

    np.testing.assert_array_equal(contains(hull(points), tried), below)
    assert 100 < below.sum() < 900
    assert support(hull(points), direction) == (points @ direction).max()


def test_open_meshes(rng: np.random.Generator) -> None:
    """A mesh without one of its triangles, or with one that is turned over, encloses nothing."""
    mesh = hull(rng.normal(size=(30, 3)))
    turned = np.array(mesh.faces)
    turned[0] = turned[0, ::-1]

    assert is_closed(mesh)
    assert not is_closed(Mesh(vertices=mesh.vertices, faces=mesh.faces[1:]))
    assert not is_closed(Mesh(vertices=mesh.vertices, faces=turned))


def test_what_no_solid_is() -> None:
    """Lengths are above 0 and no more than a kilometre; faces are triangles of vertices that there are."""
    corners = np.eye(4, 3)
    with pytest.raises(InvalidValueError, match="size: expected three lengths above 0"):
        Box(size=(1.0, 0.0, 1.0))
    with pytest.raises(InvalidValueError, match="radius: expected more than 0 m"):
        Sphere(radius=-1.0)
    with pytest.raises(InvalidValueError, match="length: expected no more than 1000 m"):
        Cylinder(radius=1.0, length=2000.0)
    with pytest.raises(ShapeError, match=r"faces: expected at least 4 triangles \(m, 3\)"):
        Mesh(vertices=corners, faces=[[0, 1, 2]])
    with pytest.raises(KindError, match="faces: expected numbers of vertices"):
        Mesh(vertices=corners, faces=np.zeros((4, 3)))
    with pytest.raises(InvalidValueError, match="faces: expected numbers of vertices, from 0 to 3, got 4"):
        Mesh(vertices=corners, faces=[[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 4]])
    with pytest.raises(ShapeError, match="vertices: expected at least 4 points"):
        Mesh(vertices=corners[:2], faces=[[0, 1, 2]] * 4)
