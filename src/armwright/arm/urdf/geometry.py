"""The solids of the links of a URDF file: the shapes in <collision>, or in <visual> where a link has no such."""

from __future__ import annotations

import numpy as np

from armwright.arm.urdf.elements import Element, origin_of
from armwright.arm.urdf.meshes import MeshFiles
from armwright.spatial.poses import homogeneous
from armwright.spatial.shapes import LARGEST_SIZE, Box, Capsule, Cylinder, Mesh, Shape, Solid, Sphere

# Of a link without <collision>, what is drawn of it is taken.
_TAGS = ("collision", "visual")


def solids_of(link: Element, meshes: MeshFiles) -> tuple[Solid, ...]:
    """Return the solids of a link in the frame of the link; none where it has none, or only such as are not read.

    Args:
        link: the element.
        meshes: where its meshes are; those that are not read are noted there.

    Raises:
        FileFormatError: a length, or an origin, is no number, or the file of a mesh is broken.
    """
    solids = []
    for element, geometry in _shape_elements(link):
        shape = _shape(geometry, meshes)
        if shape is not None:
            solids.append(Solid(shape=shape, pose=origin_of(element)))
    return tuple(solids)


def has_unread_shapes(link: Element, meshes: MeshFiles) -> bool:
    """Whether a link has shapes other than meshes that are not read, such as primitives without an extent."""
    geometries = [geometry for _, geometry in _shape_elements(link) if geometry.find("mesh") is None]
    return any(_shape(geometry, meshes) is None for geometry in geometries)


def _shape_elements(link: Element) -> list[tuple[Element, Element]]:
    """Return the elements of the shapes of a link, each with its <geometry>."""
    for tag in _TAGS:
        pairs = [(element, element.find("geometry")) for element in link.find_all(tag)]
        found = [(element, geometry) for element, geometry in pairs if geometry is not None and geometry.children]
        if found:
            return found
    return []


def _shape(geometry: Element, meshes: MeshFiles) -> Shape | None:
    """Return the shape that a <geometry> describes; None of one that is not read."""
    for element in geometry.children:
        match element.tag:
            case "box":
                size = element.vector("size")
                return Box(size=size) if _is_solid(*size) else None
            case "cylinder" | "capsule":
                radius, length = element.number("radius"), element.number("length")
                kind = Cylinder if element.tag == "cylinder" else Capsule
                return kind(radius=radius, length=length) if _is_solid(radius, length) else None
            case "sphere":
                radius = element.number("radius")
                return Sphere(radius=radius) if _is_solid(radius) else None
            case "mesh":
                return meshes.mesh(element)
    return None


def _is_solid(*lengths: float) -> bool:
    """Whether all lengths are those of a solid: files have cylinders of no length, and floors of many kilometres."""
    return all(0 < length <= LARGEST_SIZE for length in lengths)


def primitives(solid: Solid) -> list[Solid]:
    """Return a solid as those that URDF has: a capsule as a cylinder and two spheres, a mesh as none."""
    if isinstance(solid.shape, Mesh):
        return []
    if not isinstance(solid.shape, Capsule):
        return [solid]
    radius, length = solid.shape.radius, solid.shape.length
    ends = [homogeneous(np.eye(3), (0.0, 0.0, side * length / 2)) for side in (-1, 1)]
    balls = [Solid(shape=Sphere(radius=radius), pose=solid.pose @ X) for X in ends]
    return [Solid(shape=Cylinder(radius=radius, length=length), pose=solid.pose), *balls]
