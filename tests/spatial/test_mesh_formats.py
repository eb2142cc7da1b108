"""One solid out of files of every format: its volume and tensor, against closed forms and trimesh."""

import base64
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from armwright.errors import MeshWarning
from armwright.spatial.meshes.hulls import hull_messages, hull_volume
from armwright.spatial.meshes.reader import read_assembly, read_mesh
from armwright.spatial.shapes import Box, Mesh, centroid, collision_shapes, inertia, is_closed, open_edges, volume
from oracles.gltf_texts import glb, gltf
from samples import Sample

# Written by Open CASCADE 8.0: a plate of 100 x 60 x 40 mm with a hole of 24 mm, in millimetres and in inches; a
# cylinder of 40 mm and 80 mm of length; a torus of radii 50 and 12 mm; an assembly of plate and cylinders.
STEP = Path(__file__).parent / "step_files"
# Relative error of numbers in single precision, and that of round surfaces as triangles.
SINGLE, ROUND = 3e-6, 5e-3
# A circle as this many corners has 1e-5 less area.
CORNERS = 800


def plate(size: Any, radius: float, corners: int) -> trimesh.Trimesh:
    """Return a box about its centre with a hole along z, as triangles between a circle and the outline."""
    # A multiple of eight has the diagonals among its angles, which are those of the corners of the box.
    angles = 2 * np.pi * np.arange(corners) / corners
    angles = np.arctan2(np.sin(angles) * size[1], np.cos(angles) * size[0])
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    half = np.asarray(size[:2]) / 2
    outline = circle / np.abs(circle / half).max(axis=1, keepdims=True)
    k = len(angles)
    rings = [(radius * circle, -1), (outline, -1), (outline, 1), (radius * circle, 1)]
    vertices = np.concatenate([np.insert(ring, 2, side * size[2] / 2, axis=1) for ring, side in rings])
    here = np.arange(k)
    there = (here + 1) % k
    faces = []
    for ring in range(4):
        a, b = ring * k, (ring + 1) % 4 * k
        faces += [np.stack([a + here, b + there, b + here], 1), np.stack([a + here, a + there, b + there], 1)]
    mesh = trimesh.Trimesh(vertices, np.concatenate(faces), process=False)
    if mesh.volume < 0:
        mesh.invert()
    return mesh


def of_plate(size: Any, radius: float) -> tuple[float, np.ndarray]:
    """Return the volume of a box with a hole, and its tensor for 1 kg."""
    box, hole = np.prod(size), math.pi * radius**2 * size[2]
    squares = np.square(size) / 12
    across = (3 * radius**2 + size[2] ** 2) / 12
    whole = box * (squares.sum() - squares) - hole * np.array([across, across, radius**2 / 2])
    return box - hole, whole / (box - hole)


def of_cylinder(radius: float, length: float) -> tuple[float, np.ndarray]:
    """Return the volume of a cylinder, and its tensor for 1 kg."""
    across = (3 * radius**2 + length**2) / 12
    return math.pi * radius**2 * length, np.array([across, across, radius**2 / 2])


def of_torus(large: float, small: float) -> tuple[float, np.ndarray]:
    """Return the volume of a torus, and its tensor for 1 kg."""
    across = large**2 / 2 + 5 / 8 * small**2
    return 2 * math.pi**2 * large * small**2, np.array([across, across, large**2 + 3 / 4 * small**2])


def write(mesh: trimesh.Trimesh, path: Path, *, text: bool = False) -> None:
    mesh.export(path, file_type="stl_ascii" if text else None)


@pytest.mark.share(0.07)
@pytest.mark.parametrize("ending", ["stl", "text.stl", "obj", "glb", "gltf"])
@pytest.mark.drawn(0.4)
def test_solids_of_known_form(ending: str, sample: Sample, tmp_path: Path) -> None:
    """A plate with a hole, a cylinder and a torus, anywhere, keep volume and tensor in every format and unit."""
    worst = 0.0
    for rng in sample.cases(30):
        a, b, c, small = rng.uniform(0.02, 0.1, 4)
        solids = [
            (plate((a, b, c), 0.3 * min(a, b), CORNERS), of_plate((a, b, c), 0.3 * min(a, b))),
            (trimesh.creation.cylinder(a, b, sections=CORNERS), of_cylinder(a, b)),
            (trimesh.creation.torus(0.2, small, major_sections=CORNERS // 2, minor_sections=60), of_torus(0.2, small)),
        ]
        mesh, (expected, tensor) = solids[rng.integers(3)]
        R, p = Rotation.random(rng=rng).as_matrix(), rng.uniform(-0.5, 0.5, 3)
        mesh.apply_transform(np.block([[R, p[:, None]], [np.zeros((1, 3)), 1.0]]))
        mesh.density = 1 / mesh.volume
        unit = None if ending.startswith("gl") else str(rng.choice(["m", "mm", "cm", "in"]))
        oracle = mesh.copy()
        mesh.apply_scale({"m": 1, "mm": 1e3, "cm": 1e2, "in": 1 / 0.0254, None: 1}[unit])
        path = tmp_path / f"solid.{ending}"
        if ending == "gltf":
            for name, data in trimesh.exchange.gltf.export_gltf(trimesh.Scene(mesh)).items():
                (tmp_path / name.replace("model.gltf", path.name)).write_bytes(data)
        else:
            write(mesh, path, text="text" in ending)

        read = read_mesh(path, unit=unit)

        assert is_closed(read)
        assert volume(read) == pytest.approx(expected, rel=2e-3)
        np.testing.assert_allclose(R.T @ inertia(read) @ R, np.diag(tensor), atol=2e-3 * tensor.max())
        # A float of STL and glTF is this far from 1, and so are positions from those of the oracle.
        reach = np.abs(oracle.vertices).max() / min(oracle.extents) * 20 * SINGLE
        assert volume(read) == pytest.approx(oracle.volume, rel=reach)
        np.testing.assert_allclose(centroid(read), oracle.center_mass, atol=2e-6)
        np.testing.assert_allclose(inertia(read), oracle.moment_inertia, atol=reach * tensor.max())
        worst = max(worst, abs(volume(read) / oracle.volume - 1))
    sample.record(f"solids in {ending}", sample.case + 1, 0, worst_volume=worst)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("plate", of_plate((0.1, 0.06, 0.04), 0.012)),
        ("plate_inch", of_plate((0.1, 0.06, 0.04), 0.012)),
        ("cylinder", of_cylinder(0.02, 0.08)),
        ("torus", of_torus(0.05, 0.012)),
    ],
)
@pytest.mark.drawn(0.34)
def test_step(name: str, expected: tuple[float, np.ndarray]) -> None:
    """STEP is in the unit that it says, its faces are joined to a closed mesh, and round surfaces are near."""
    pytest.importorskip("cascadio")
    mesh = read_mesh(STEP / f"{name}.step")

    assert is_closed(mesh)
    assert volume(mesh) == pytest.approx(expected[0], rel=ROUND)
    np.testing.assert_allclose(centroid(mesh), 0.0, atol=1e-6)
    np.testing.assert_allclose(inertia(mesh), np.diag(expected[1]), atol=ROUND * expected[1].max())


def test_components_of_step() -> None:
    """An assembly in STEP has the names and the places of its components, those of nested ones included."""
    pytest.importorskip("cascadio")
    assembly = read_assembly(STEP / "fixture.step").components

    names = ["Fixture", "Base plate", "Nest", "Pin", "Pin", "2nd nest, rear", "Pin", "Pin"]
    assert [(each.name, each.parent) for each in assembly] == list(zip(names, (None, 0, 0, 2, 2, 0, 5, 5), strict=True))
    places = [(0, 0, 0), (0, 0, 20), (200, 100, 0), (200, 70, 50), (200, 130, 50)]
    places += [(-200, 100, 0), (-230, 100, 50), (-170, 100, 50)]
    np.testing.assert_allclose([each.pose[:3, 3] * 1e3 for each in assembly], places, atol=1e-4)
    # The nest is turned about z by a right angle, and in it the second pin about y.
    np.testing.assert_allclose(assembly[4].pose[:3, :3], [[0, -1, 0], [0, 0, 1], [-1, 0, 0]], atol=1e-7)
    total = read_mesh(STEP / "fixture.step")
    assert volume(total) == pytest.approx(
        of_plate((0.1, 0.06, 0.04), 0.012)[0] + 4 * of_cylinder(0.02, 0.08)[0], rel=ROUND
    )


CUBE = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float32)
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
TRIANGLES = np.array([(q[0], q[k], q[k + 1]) for q in QUADS for k in (1, 2)])


@pytest.mark.parametrize("back", ["from the first", "from the last"])
def test_polygons_of_obj(back: str, tmp_path: Path) -> None:
    """Polygons are cut into triangles; numbers below 0 count back; what is about looks is skipped, not opened."""
    lines = [f"v {x} {y} {z} 0.5 0.5 0.5" for x, y, z in CUBE]
    faces = [
        " ".join(f"{corner - 8 if back == 'from the last' else corner + 1}/1/1" for corner in quad) for quad in QUADS
    ]
    text = ["mtllib /dev/zero", "o cube", *lines, "vt 0 0", "vn 0 0 1", "usemtl x", "s off", *(f"f {f}" for f in faces)]
    (tmp_path / "cube.obj").write_text("\n".join(text), encoding="utf-8")

    mesh = read_mesh(tmp_path / "cube.obj", unit="in")

    assert (len(mesh.vertices), len(mesh.faces), is_closed(mesh), mesh.name) == (8, 12, True, "cube.obj")
    assert volume(mesh) == pytest.approx(0.0254**3)


def test_stl_that_begins_as_a_text(tmp_path: Path) -> None:
    """A binary file may begin with the word of text files; a text may have several solids."""
    cube = trimesh.Trimesh(CUBE, TRIANGLES, process=False)
    data = trimesh.exchange.stl.export_stl(cube)
    (tmp_path / "binary.stl").write_bytes(b"solid" + data[5:])
    text = trimesh.exchange.stl.export_stl_ascii(cube)
    far = trimesh.exchange.stl.export_stl_ascii(cube.copy().apply_translation((3, 0, 0)))
    (tmp_path / "text.stl").write_text(f"\n{text.upper()}\n{far}\n", encoding="utf-8")

    assert volume(read_mesh(tmp_path / "binary.stl", unit="m")) == pytest.approx(1)
    assert volume(read_mesh(tmp_path / "text.stl", unit="m")) == pytest.approx(2)


def test_inside_out_and_mirrored(tmp_path: Path) -> None:
    """A closed mesh that is inside out is turned; a mirrored scale keeps it outside out."""
    for order in (TRIANGLES, TRIANGLES[:, ::-1]):
        trimesh.Trimesh(CUBE, order, process=False).export(tmp_path / "cube.stl")
        for scale in ((1, 1, 1), (1, -2, 1), (-1, -1, -1)):
            mesh = read_mesh(tmp_path / "cube.stl", unit="m", scale=scale)
            assert volume(mesh) == pytest.approx(abs(np.prod(scale)))
            np.testing.assert_allclose(centroid(mesh), np.array(scale) / 2, atol=1e-12)


def as_trimesh(path: Path) -> trimesh.Trimesh:
    mesh = trimesh.load(path, force="mesh")
    mesh.merge_vertices()
    return mesh


@pytest.mark.parametrize("kind", ["uint8", "uint16", "uint32", "none"])
@pytest.mark.parametrize("place", ["text", "binary", "file"])
def test_gltf_nodes(kind: str, place: str, tmp_path: Path, rng: np.random.Generator) -> None:
    """Poses of nested nodes, scaled and mirrored ones included, and all kinds of arrays are as trimesh reads them."""
    quaternion = Rotation.random(rng=rng).as_quat()
    arrays: list[np.ndarray] = (
        [CUBE * np.float32(0.1)] if kind != "none" else [CUBE[TRIANGLES.ravel()] * np.float32(0.1)]
    )
    primitive: dict[str, Any] = {"attributes": {"POSITION": 0}, "mode": 4}
    if kind != "none":
        arrays.append(TRIANGLES.astype(kind).ravel())
        primitive["indices"] = 1
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = Rotation.random(rng=rng).as_matrix(), (0.1, 0.2, 0.3)
    nodes = [
        {"name": "top", "children": [1, 2], "translation": [1, 2, 3], "rotation": quaternion.tolist()},
        {"name": "a", "mesh": 0, "scale": [1, -2, 0.5], "translation": [0.5, 0, 0]},
        {"name": "b", "mesh": 0, "matrix": matrix.T.ravel().tolist()},
        {"name": "not shown", "mesh": 0},
    ]
    content = gltf(arrays, [[primitive, {"attributes": {"POSITION": 0}, "mode": 0}]], nodes)
    content |= {"scenes": [{"nodes": [3]}, {"nodes": [0]}], "scene": 1}
    path = tmp_path / ("cubes.glb" if place == "binary" else "cubes.gltf")
    binary = None
    if place != "text":
        binary = base64.b64decode(content["buffers"][0].pop("uri").partition(",")[2])
    if place == "file":
        for name in ("a b.bin", "a%20b.bin"):  # trimesh takes the name as it is
            (tmp_path / name).write_bytes(binary or b"")
        content["buffers"][0]["uri"] = "a%20b.bin"
    path.write_bytes(glb(content, binary) if place == "binary" else json.dumps(content).encode())

    mesh = read_mesh(path)

    oracle = as_trimesh(path)
    assert len(mesh.faces) == len(oracle.faces) == 24
    assert is_closed(mesh)
    assert volume(mesh) == pytest.approx(2e-3, rel=1e-5)
    assert volume(mesh) == pytest.approx(oracle.volume, rel=1e-5)
    np.testing.assert_allclose([mesh.vertices.min(0), mesh.vertices.max(0)], oracle.bounds, atol=1e-6)
    np.testing.assert_allclose(inertia(mesh) * volume(mesh), oracle.moment_inertia, atol=1e-8)


@pytest.mark.parametrize("mode", [5, 6])
def test_strips_and_fans(mode: int, tmp_path: Path) -> None:
    """Strips and fans are triangles seen from one side."""
    # A tetrahedron as a strip of four triangles; or one as a fan about a corner and a single triangle.
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=np.float32)
    rows = [[0, 1, 2, 3, 0, 1]] if mode == 5 else [[3, 0, 1, 2, 0], [0, 2, 1]]
    arrays = [corners, *(np.array(row, dtype=np.uint8) for row in rows)]
    primitives = [{"attributes": {"POSITION": 0}, "indices": k + 1, "mode": mode} for k in range(len(rows))]
    (tmp_path / "t.glb").write_bytes(glb(gltf(arrays, [primitives], [{"mesh": 0}])))

    mesh = read_mesh(tmp_path / "t.glb")

    assert is_closed(mesh)
    assert volume(mesh) == pytest.approx(1 / 6)


def test_hulls(rng: np.random.Generator) -> None:
    """The volume of a hull is that of trimesh; open edges are counted as edges without a triangle on either side."""
    torus = trimesh.creation.torus(0.2, 0.05)
    mesh = Mesh(vertices=torus.vertices, faces=np.array(torus.faces), name="torus.stl")
    keep = np.ones(len(torus.faces), dtype=bool)
    keep[[3, 700]] = False
    opened = Mesh(vertices=torus.vertices, faces=np.array(torus.faces)[keep])
    turned = np.array(torus.faces)
    turned[5] = turned[5, ::-1]
    points = trimesh.convex.convex_hull(rng.normal(size=(50, 3)))
    hull = Mesh(vertices=points.vertices, faces=np.array(points.faces))
    ratio = torus.convex_hull.volume / torus.volume

    assert hull_volume(mesh) == pytest.approx(torus.convex_hull.volume)
    assert (open_edges(mesh), open_edges(opened)) == (0, 6)
    assert open_edges(Mesh(vertices=torus.vertices, faces=turned)) == 3
    assert hull_messages([("A", hull), ("B", Box(size=(1, 1, 1)))]) == []
    first, second = hull_messages([("A", hull), ("RING", mesh), ("OPEN", opened)])
    assert f"RING ({ratio:.3g} times)" in first
    assert "OPEN (6 open edges)" in second
    assert issubclass(MeshWarning, UserWarning)


def test_pieces_of_a_mesh() -> None:
    """Convex pieces stand for a mesh in collisions, and are told of as those."""
    boxes = [
        trimesh.creation.box((0.1, 0.1, 0.1)).apply_translation(at) for at in ((0, 0, 0), (0.1, 0, 0), (0, 0.1, 0))
    ]
    pieces = [Mesh(vertices=box.vertices, faces=np.array(box.faces)) for box in boxes]
    torus = trimesh.creation.torus(0.2, 0.05)
    mesh = Mesh(vertices=torus.vertices, faces=np.array(torus.faces), pieces=pieces)

    assert collision_shapes(mesh) == tuple(pieces)
    assert collision_shapes(pieces[0]) == (pieces[0],)
    assert hull_messages([("RING", mesh)]) == []
