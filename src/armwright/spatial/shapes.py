"""Solids: boxes, cylinders, spheres, capsules and closed meshes, each about its own origin."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TypeAlias

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arrays import Array, ArrayLike, exact_shape, floats, positive, read_only, reduce_by_fields
from armwright.errors import InvalidValueError, KindError, ShapeError
from armwright.spatial.poses import one_pose

# No solid of a robot's surroundings is larger [m].
LARGEST_SIZE = 1e3


def _size(value: ArrayLike) -> Array:
    size = exact_shape(value, (3,), "size", LARGEST_SIZE)
    if not (size > 0).all():
        raise InvalidValueError(f"size: expected three lengths above 0, got {size.tolist()}")
    return size


def _length(value: float, attribute: str) -> float:
    length = positive(value, attribute, "m")
    if length > LARGEST_SIZE:
        raise InvalidValueError(f"{attribute}: expected no more than {LARGEST_SIZE:g} m, got {length:g}")
    return length


def _radius(value: float) -> float:
    return _length(value, "radius")


def _height(value: float) -> float:
    return _length(value, "length")


@attrs.frozen(kw_only=True, eq=False)
class Box:
    """A box about its centre.

    Attributes:
        size: (3,) lengths along x, y and z [m].
    """

    size: Array = attrs.field(converter=_size)

    __reduce__ = reduce_by_fields


@attrs.frozen(kw_only=True)
class Cylinder:
    """A cylinder about its centre, its axis along z.

    Attributes:
        radius: [m].
        length: along its axis [m].
    """

    radius: float = attrs.field(converter=_radius)
    length: float = attrs.field(converter=_height)


@attrs.frozen(kw_only=True)
class Capsule:
    """A cylinder about its centre, its axis along z, with half a sphere on either end.

    Attributes:
        radius: [m].
        length: of the cylinder, without the ends [m].
    """

    radius: float = attrs.field(converter=_radius)
    length: float = attrs.field(converter=_height)


@attrs.frozen(kw_only=True)
class Sphere:
    """A sphere about its centre.

    Attributes:
        radius: [m].
    """

    radius: float = attrs.field(converter=_radius)


def _vertices(value: ArrayLike) -> Array:
    vertices = floats(value, "vertices", LARGEST_SIZE)
    if vertices.ndim != 2 or vertices.shape[1] != 3 or len(vertices) < 4:
        raise ShapeError(f"vertices: expected at least 4 points (k, 3), got {vertices.shape}")
    return read_only(vertices)


def _faces(value: npt.ArrayLike) -> npt.NDArray[np.int32]:
    faces = np.array(value)
    if faces.dtype.kind not in "iu":
        raise KindError(f"faces: expected numbers of vertices, got {faces.dtype}")
    if faces.ndim != 2 or faces.shape[1] != 3 or len(faces) < 4:
        raise ShapeError(f"faces: expected at least 4 triangles (m, 3), got {faces.shape}")
    faces = faces.astype(np.int32)
    faces.setflags(write=False)
    return faces


def _pieces(value: Iterable[Mesh]) -> tuple[Mesh, ...]:
    pieces = tuple(value)
    if not all(isinstance(piece, Mesh) for piece in pieces):
        raise KindError("pieces: expected meshes")
    return pieces


@attrs.frozen(kw_only=True, eq=False)
class Mesh:
    """A solid between triangles, each of which is seen counterclockwise from outside.

    Attributes:
        vertices: (k, 3) [m].
        faces: (m, 3) the numbers of the vertices of each triangle, from 0.
        name: of its file; empty where it has none.
        pieces: convex meshes that together fill it, which count in collisions; none where its convex hull counts.
    """

    vertices: Array = attrs.field(converter=_vertices)
    faces: npt.NDArray[np.int32] = attrs.field(converter=_faces)
    name: str = ""
    pieces: tuple[Mesh, ...] = attrs.field(default=(), converter=_pieces)

    __reduce__ = reduce_by_fields

    def __attrs_post_init__(self) -> None:
        """Refuse triangles of vertices that there are not."""
        if not (self.faces.min() >= 0 and self.faces.max() < len(self.vertices)):
            last = len(self.vertices) - 1
            raise InvalidValueError(f"faces: expected numbers of vertices, from 0 to {last}, got {self.faces.max()}")


Shape: TypeAlias = Box | Cylinder | Capsule | Sphere | Mesh


@attrs.frozen(kw_only=True, eq=False)
class Solid:
    """A shape at a pose of some frame.

    Attributes:
        shape: its form.
        pose: (4, 4) of the shape in the frame.
        guessed: whether the shape is a guess, made where no drawing is at hand.
    """

    shape: Shape
    pose: Array = attrs.field(factory=lambda: np.eye(4), converter=one_pose)
    guessed: bool = False

    __reduce__ = reduce_by_fields

    def moved(self, X: Array) -> Solid:
        """Return the solid seen from another frame, in which this one has the pose X (4, 4)."""
        return attrs.evolve(self, pose=X @ self.pose)


def is_closed(mesh: Mesh) -> bool:
    """Whether the triangles of a mesh enclose a solid: every edge belongs to two of them, once in either direction."""
    return open_edges(mesh) == 0


def open_edges(mesh: Mesh) -> int:
    """Return how many edges of a mesh do not belong to two triangles, once in either direction."""
    edges = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
    low, high = edges.min(axis=1), edges.max(axis=1)
    _, numbers = np.unique(low * len(mesh.vertices) + high, return_inverse=True)
    there = np.bincount(numbers, edges[:, 0] == low)
    return int(((there != 1) | (np.bincount(numbers) != 2)).sum())


def collision_shapes(shape: Shape) -> tuple[Shape, ...]:
    """Return the convex solids that count in collisions: a shape itself, whose hull counts, or the pieces of a mesh."""
    return shape.pieces if isinstance(shape, Mesh) and shape.pieces else (shape,)


def convex_solids(solids: Iterable[Solid]) -> list[Solid]:
    """Return solids with the pieces of meshes instead of those that have some; see ``collision_shapes``."""
    return [attrs.evolve(solid, shape=shape) for solid in solids for shape in collision_shapes(solid.shape)]


def farthest(shape: Shape) -> float:
    """Return the largest distance of a point of a solid from its origin [m]."""
    match shape:
        case Box(size=size):
            return float(np.linalg.norm(size)) / 2
        case Cylinder(radius=radius, length=length):
            return math.hypot(radius, length / 2)
        case Capsule(radius=radius, length=length):
            return radius + length / 2
        case Sphere(radius=radius):
            return radius
        case Mesh(vertices=vertices):
            return float(np.linalg.norm(vertices, axis=1).max())


def box_about(shape: Shape) -> tuple[Array, float]:
    """Return a box (3,) about the origin, as half its lengths, and a radius: all of a solid is that near to it [m]."""
    match shape:
        case Box(size=size):
            return size / 2, 0.0
        case Cylinder(radius=radius, length=length):
            return np.array((radius, radius, length / 2)), 0.0
        case Capsule(radius=radius, length=length):
            return np.array((0.0, 0.0, length / 2)), radius
        case Sphere(radius=radius):
            return np.zeros(3), radius
        case Mesh(vertices=vertices):
            return np.abs(vertices).max(axis=0), 0.0


def support(shape: Shape, direction: Array) -> float:
    """Return how far a solid reaches from its origin in a direction (3,) of length 1 [m]."""
    match shape:
        case Box(size=size):
            return float(np.abs(direction) @ size) / 2
        case Cylinder(radius=radius, length=length):
            return float(radius * math.hypot(direction[0], direction[1]) + length / 2 * abs(direction[2]))
        case Capsule(radius=radius, length=length):
            return float(radius + length / 2 * abs(direction[2]))
        case Sphere(radius=radius):
            return radius
        case Mesh(vertices=vertices):
            return float((vertices @ direction).max())


def contains(shape: Shape, points: Array) -> npt.NDArray[np.bool_]:
    """Return which of some points (k, 3) are inside a solid; a mesh must be closed.

    Source:
        for meshes, Van Oosterom & Strackee (1983), The solid angle of a plane triangle, eq. (8): all triangles together
        fill the whole solid angle as seen from inside, and nothing of it from outside.
    """
    across = np.hypot(points[:, 0], points[:, 1])
    match shape:
        case Box(size=size):
            return np.asarray((np.abs(points) < size / 2).all(axis=1))
        case Cylinder(radius=radius, length=length):
            return np.asarray((across < radius) & (np.abs(points[:, 2]) < length / 2))
        case Capsule(radius=radius, length=length):
            beyond = np.maximum(np.abs(points[:, 2]) - length / 2, 0.0)
            return np.asarray(np.hypot(across, beyond) < radius)
        case Sphere(radius=radius):
            return np.asarray(np.linalg.norm(points, axis=1) < radius)
        case Mesh(vertices=vertices, faces=faces):
            return np.array([_solid_angle(vertices[faces] - point) > 2 * math.pi for point in points])


def _solid_angle(triangles: Array) -> float:
    """Return the solid angle of triangles (m, 3, 3) seen from the origin: 4 pi from inside of what they enclose."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    la, lb, lc = np.linalg.norm(triangles, axis=2).T
    above = np.einsum("ki,ki->k", a, np.cross(b, c))
    below = la * lb * lc + (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la + (c * a).sum(axis=1) * lb
    return float(2 * np.arctan2(above, below).sum())


def volume(shape: Shape) -> float:
    """Return the volume of a solid [m³]; that of a mesh means something where it is closed."""
    match shape:
        case Box(size=size):
            return float(np.prod(size))
        case Cylinder(radius=radius, length=length):
            return math.pi * radius**2 * length
        case Capsule(radius=radius, length=length):
            return math.pi * radius**2 * (length + 4 / 3 * radius)
        case Sphere(radius=radius):
            return 4 / 3 * math.pi * radius**3
        case Mesh():
            return float(_tetrahedra(shape)[0].sum())


def centroid(shape: Shape) -> Array:
    """Return the centre of mass (3,) of a solid of one density [m]."""
    if not isinstance(shape, Mesh):
        return np.zeros(3)
    volumes, corners = _tetrahedra(shape)
    return np.asarray(volumes @ corners.sum(axis=1) / 4 / volumes.sum())


def inertia(shape: Shape) -> Array:
    """Return the inertia tensor (3, 3) of a solid of 1 kg and one density about its centre of mass [m²].

    Source:
        Tonon (2004), Explicit exact formulas for the 3-D tetrahedron inertia tensor in terms of its vertex coordinates.
    """
    match shape:
        case Box(size=size):
            squares = size**2 / 12
            return np.diag(squares.sum() - squares)
        case Cylinder(radius=radius, length=length):
            across = (3 * radius**2 + length**2) / 12
            return np.diag([across, across, radius**2 / 2])
        case Capsule(radius=radius, length=length):
            return _of_capsule(radius, length)
        case Sphere(radius=radius):
            return np.eye(3) * (2 / 5 * radius**2)
        case Mesh():
            volumes, corners = _tetrahedra(shape)
            corners = corners - centroid(shape)
            total = corners.sum(axis=1)
            second = (np.einsum("ka,kb->kab", total, total) + np.einsum("kia,kib->kab", corners, corners)) / 20
            moments = np.einsum("k,kab->ab", volumes, second) / volumes.sum()
            return np.asarray(np.trace(moments) * np.eye(3) - moments)


def _of_capsule(radius: float, length: float) -> Array:
    """Return the tensor of a capsule of 1 kg."""
    tube, ball = length, 4 / 3 * radius  # their volumes by the area of the tube
    along = tube * radius**2 / 2 + ball * 2 / 5 * radius**2
    # Half a ball has its centre of mass 3/8 of the radius beyond the end of the tube.
    beyond = length / 2 + 3 / 8 * radius
    across = tube * (3 * radius**2 + length**2) / 12 + ball * (83 / 320 * radius**2 + beyond**2)
    return np.diag([across, across, along]) / (tube + ball)


def _tetrahedra(mesh: Mesh) -> tuple[Array, Array]:
    """Return the signed volumes (m,) and the corners (m, 4, 3) of tetrahedra from a corner of a mesh to its faces."""
    apex = mesh.vertices[0]
    faces = mesh.vertices[mesh.faces]
    a, b, c = np.moveaxis(faces - apex, 1, 0)
    corners = np.concatenate([np.broadcast_to(apex, (len(faces), 1, 3)), faces], axis=1)
    return np.einsum("ki,ki->k", a, np.cross(b, c)) / 6, corners
