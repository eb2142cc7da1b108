"""glTF files, as JSON or binary: nodes with poses in a tree, and their triangles, in metres.

Nothing is fetched, and of other files only buffers below the folder of the file are opened. Materials, textures,
cameras, skins and animations are skipped.

Source:
    Khronos Group (2021), glTF 2.0 Specification.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.errors import FileFormatError, shown
from armwright.files.document import Document, Table
from armwright.files.inputs import decode
from armwright.files.limits import limit, limit_message
from armwright.spatial.meshes.gltf_arrays import Arrays, index_in, tables_in
from armwright.spatial.meshes.triangles import Triangles, joined, refuse_too_many
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_quaternion

_MAGIC = b"glTF"
_HEADER, _CHUNK_HEADER = 12, 8
# Extensions without which a file can be read: they are about looks.
_HARMLESS = ("KHR_materials", "KHR_texture", "KHR_lights", "EXT_texture")
_TRIANGLES, _STRIP, _FAN = 4, 5, 6


@attrs.frozen(kw_only=True, eq=False)
class Component:
    """A node of an assembly.

    Attributes:
        name: as in the file; empty where it has none.
        parent: the number of the component that it belongs to, which comes before it; None for none.
        pose: (4, 4) in the file; its columns have other lengths than 1 where the node is scaled.
        mesh: the number of its mesh; None for none.
    """

    name: str
    parent: int | None
    pose: Array
    mesh: int | None


@attrs.frozen(kw_only=True, eq=False)
class Assembly:
    """The nodes of a file.

    Attributes:
        components: each after the one that it belongs to.
        triangles: returns those of all components, in metres.
    """

    components: tuple[Component, ...]
    triangles: Callable[[], Triangles]


def read_gltf(path: Path, data: bytes) -> Assembly:
    """Return the nodes of the scene of a glTF file.

    Args:
        path: of the file, for messages and for buffers beside it.
        data: what the file holds.

    Raises:
        FileFormatError: the file is broken, beyond a limit, or has an extension that is not read.
    """
    text, binary = _chunks(path, data) if data[:4] == _MAGIC else (data, None)
    root = _root(path, text)
    components = _components(root)

    def triangles() -> Triangles:
        return _triangles(path, root, binary, components)

    return Assembly(components=components, triangles=triangles)


def _chunks(path: Path, data: bytes) -> tuple[bytes, bytes | None]:
    """Return the JSON and the buffer of a binary file."""
    version, length = (int.from_bytes(data[k : k + 4], "little") for k in (4, 8))
    if version != 2:
        raise FileFormatError(path, None, "", f"expected glTF of version 2, got version {version}")
    if length != len(data):
        raise FileFormatError(path, None, "", f"expected the {length:,} bytes announced, got {len(data):,}")
    chunks: dict[bytes, bytes] = {}
    offset = _HEADER
    while offset < len(data):
        size, kind = int.from_bytes(data[offset : offset + 4], "little"), data[offset + 4 : offset + _CHUNK_HEADER]
        offset += _CHUNK_HEADER
        if size > len(data) - offset:
            raise FileFormatError(path, None, "", f"a chunk of {size:,} bytes goes beyond the end of the file")
        # Chunks of other kinds are skipped; of JSON and BIN there is one each, the first.
        if kind in {b"JSON", b"BIN\x00"}:
            chunks.setdefault(kind, data[offset : offset + size])
        offset += size
    if b"JSON" not in chunks:
        raise FileFormatError(path, None, "", "expected a chunk of JSON, got none")
    return chunks[b"JSON"], chunks.get(b"BIN\x00")


def _root(path: Path, data: bytes) -> Table:
    """Parse the JSON of a file, of bounded size, and check what the file needs."""
    # Values need more memory than their text, so they are counted before.
    values = sum(data.count(mark) for mark in (b",", b"[", b"{"))
    if values > limit("gltf_values"):
        raise FileFormatError(path, None, "", f"too many values: {limit_message('gltf_values', values)}")
    root = Document.parse(path, decode(data, path), is_json=True).root
    version = root.table("asset", required=True).text("version")
    if not version.startswith("2."):
        raise root.table("asset").error("version", f"expected glTF of version 2, got {shown(version)}")
    for name in root.texts("extensionsRequired") if "extensionsRequired" in root else ():
        if not name.startswith(_HARMLESS):
            raise root.error("extensionsRequired", f"{shown(name)} is not read; export the file without it")
    return root


def _components(root: Table) -> tuple[Component, ...]:
    """Return the nodes of the scene, each after its parent."""
    nodes = tables_in(root, "nodes")
    meshes = len(tables_in(root, "meshes"))
    children = [_children(node, len(nodes)) for node in nodes]
    tops = _tops(root, children)
    components: list[Component] = []
    known: set[int] = set()
    waiting: list[tuple[int, int | None, Array, int]] = [(number, None, np.eye(4), 0) for number in reversed(tops)]
    while waiting:
        number, parent, X, depth = waiting.pop()
        node = nodes[number]
        if number in known:
            raise node.error(None, "is a child of two nodes, or of itself")
        if depth > limit("nesting"):
            raise node.error(None, f"nested too deeply: {limit_message('nesting')}")
        known.add(number)
        pose = X @ _pose(node)
        if not np.isfinite(pose).all():
            raise node.error(None, "its pose is too large for any number")
        mesh = index_in(node, "mesh", meshes) if "mesh" in node else None
        components.append(Component(name=node.text("name", default=""), parent=parent, pose=pose, mesh=mesh))
        waiting += [(child, len(components) - 1, pose, depth + 1) for child in reversed(children[number])]
    return tuple(components)


def _tops(root: Table, children: list[list[int]]) -> list[int]:
    """Return the nodes at the top of the scene that the file shows."""
    scenes = tables_in(root, "scenes")
    if not scenes:
        below = {child for row in children for child in row}
        tops = [number for number in range(len(children)) if number not in below]
        if children and not tops:
            raise root.error("nodes", "every node is a child of another; expected one at the top")
        return tops
    scene = scenes[index_in(root, "scene", len(scenes)) if "scene" in root else 0]
    return _indices(scene, "nodes", len(children))


def _children(node: Table, count: int) -> list[int]:
    return _indices(node, "children", count)


def _indices(table: Table, key: str, count: int) -> list[int]:
    """Return a list of numbers of nodes, none where the key is missing."""
    numbers = table.numbers(key) if key in table else np.zeros(0)
    wrong = [number for number in numbers if not (0 <= number < count and number == int(number))]
    if wrong:
        raise table.error(key, f"expected numbers of the {count:,} nodes, from 0, got {wrong[0]:g}")
    return [int(number) for number in numbers]


def _pose(node: Table) -> Array:
    """Return the pose (4, 4) of a node on its parent, scale included."""
    if "matrix" in node:
        X = node.vector("matrix", 16).reshape(4, 4).T
        if not np.array_equal(X[3], (0.0, 0.0, 0.0, 1.0)):
            raise node.error("matrix", "expected 0, 0, 0, 1 in the last row")
        return X
    x, y, z, w = node.vector("rotation", 4, default=(0.0, 0.0, 0.0, 1.0))
    if abs(np.linalg.norm((x, y, z, w)) - 1) > 1e-2:
        raise node.error("rotation", "expected a quaternion of length 1")
    R = rotation_from_quaternion(np.array((w, x, y, z)))
    scale = node.vector("scale", 3, default=np.ones(3))
    return homogeneous(R * scale, node.vector("translation", 3, default=np.zeros(3)))


def _triangles(path: Path, root: Table, binary: bytes | None, components: tuple[Component, ...]) -> Triangles:
    """Return the triangles of all components at their poses."""
    arrays = Arrays(path, root, binary)
    primitives = [tables_in(mesh, "primitives") for mesh in tables_in(root, "meshes")]
    instances = [(component.mesh, component.pose) for component in components if component.mesh is not None]
    # Counted before any is made: a mesh may belong to many nodes.
    counts = {mesh: sum(_count(arrays, each) for each in primitives[mesh]) for mesh, _ in instances}
    refuse_too_many(path, sum(counts[mesh] for mesh, _ in instances))
    made = {mesh: joined([_primitive(arrays, each) for each in primitives[mesh]]) for mesh in counts}
    parts = []
    for mesh, X in instances:
        vertices, faces = made[mesh]
        R, p = X[:3, :3], X[:3, 3]
        # A mirrored node turns triangles inside out.
        parts.append(Triangles(vertices @ R.T + p, faces[:, ::-1] if np.linalg.det(R) < 0 else faces))
    return joined(parts)


def _mode(primitive: Table) -> int:
    return int(primitive.number("mode", default=_TRIANGLES))


def _count(arrays: Arrays, primitive: Table) -> int:
    """Return how many triangles, or unused vertices by three, a primitive has at most."""
    if _mode(primitive) not in {_TRIANGLES, _STRIP, _FAN}:
        return 0
    vertices = arrays.count(primitive.table("attributes", required=True), "POSITION")
    corners = arrays.count(primitive, "indices") if "indices" in primitive else vertices
    return max(corners // 3 if _mode(primitive) == _TRIANGLES else corners, vertices // 3)


def _primitive(arrays: Arrays, primitive: Table) -> Triangles:
    """Return the triangles of a primitive; none where it has points or lines."""
    mode = _mode(primitive)
    if mode not in {_TRIANGLES, _STRIP, _FAN}:
        return joined([])
    vertices = arrays.read(primitive.table("attributes"), "POSITION", "VEC3")
    if "indices" in primitive:
        corners = arrays.read(primitive, "indices", "SCALAR")[:, 0].astype(np.int64)
        if len(corners) and corners.max() >= len(vertices):
            raise primitive.error("indices", f"expected numbers of {len(vertices):,} vertices, got {corners.max():,}")
    else:
        corners = np.arange(len(vertices))
    if mode == _TRIANGLES:
        if len(corners) % 3:
            raise primitive.error(None, f"expected three corners for each triangle, got {len(corners):,} in all")
        return Triangles(vertices, corners.reshape(-1, 3))
    first = corners[:-2] if mode == _STRIP else np.full(max(len(corners) - 2, 0), corners[0] if len(corners) else 0)
    faces = np.stack([first, corners[1:-1], corners[2:]], axis=1)
    if mode == _STRIP:
        faces[1::2, :2] = faces[1::2, 1::-1]  # every other triangle of a strip is seen from behind
    return Triangles(vertices, faces)
