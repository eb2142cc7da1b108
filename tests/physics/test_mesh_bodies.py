"""Meshes in collisions: their hulls, against another library, and the convex pieces that take their place."""

from pathlib import Path

import coal
import numpy as np
import pytest
import trimesh

from armwright.cell.part_poses import PartPoses
from armwright.cell.reader import read_cell
from armwright.errors import MeshWarning
from armwright.physics.distances import Distances
from armwright.physics.placed_bodies import CellBodies
from armwright.spatial.shapes import Mesh, Sphere
from oracles.arms import random_pose
from oracles.solids import coal_pose
from samples import Sample

ARM = "[arms.ARM_1]\nhand = [1,0,0, 0,-1,0, 0,0,-1, 0.45,0,0.25]\n"
# Distances of convex solids are found by iteration, and MuJoCo has vertices in single precision.
NEAR = 1e-5


def as_mesh(mesh: trimesh.Trimesh) -> Mesh:
    return Mesh(vertices=mesh.vertices, faces=np.array(mesh.faces))


@pytest.mark.parametrize("opened", ["closed", "open"])
def test_hulls(opened: str, sample: Sample) -> None:
    """The distance of a mesh is that of its hull, as coal finds it, whether the mesh is closed or not."""
    worst = 0.0
    for rng in sample.cases(200):
        mesh = trimesh.creation.torus(*np.sort(rng.uniform(0.02, 0.2, 2))[::-1], major_sections=12, minor_sections=8)
        if opened == "open":
            mesh.update_faces(rng.permutation(len(mesh.faces)) > 20)
            mesh.remove_unreferenced_vertices()
        hull, radius = mesh.convex_hull, rng.uniform(0.01, 0.1)
        X, Y = random_pose(rng), random_pose(rng)
        Y[:3, 3] = X[:3, 3] + rng.normal(size=3) * 0.4
        distances = Distances([as_mesh(mesh), Sphere(radius=radius)])
        distances.set_pose(0, X)
        distances.set_pose(1, Y)
        vertices, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
        vertices.extend(list(hull.vertices))
        faces.extend([coal.Triangle(*map(int, face)) for face in hull.faces])
        poses = [coal_pose(X), coal_pose(Y)]
        convex = coal.Convex(vertices, faces)
        expected = coal.distance(
            convex, poses[0], coal.Sphere(radius), poses[1], coal.DistanceRequest(), coal.DistanceResult()
        )
        if expected > 0:
            worst = max(worst, abs(distances.between(0, 1, 10.0) - expected))
        else:
            assert distances.between(0, 1, 10.0) < NEAR
    assert worst < NEAR
    sample.record(f"hulls of {opened} meshes against coal", sample.case + 1, 0, worst_m=worst)


def nest(folder: Path, pieces: str) -> float:
    """Return the distance of a peg of 20 mm between the walls, 60 mm apart, of a nest of three boxes."""
    boxes = [
        ((0.1, 0.1, 0.02), (0, 0, 0.01)),
        ((0.02, 0.1, 0.1), (-0.04, 0, 0.05)),
        ((0.02, 0.1, 0.1), (0.04, 0, 0.05)),
    ]
    solids = [trimesh.creation.box(size).apply_translation(at) for size, at in boxes]
    for number, solid in enumerate(solids):
        solid.export(folder / f"{number}.stl")
    # The outline of the nest, seen along y, as one closed mesh.
    x, z = [0.05, 0.05, 0.03, 0.03, -0.03, -0.03, -0.05, -0.05], [0, 0.1, 0.1, 0.02, 0.02, 0.1, 0.1, 0]
    ring = np.stack([np.array(x), np.full(8, -0.05), np.array(z)], axis=1)
    there, k = ring + np.array((0, 0.1, 0)), np.arange(8)
    sides = [(a, b + 8, b) for a, b in zip(k, (k + 1) % 8, strict=True)]
    sides += [(a, a + 8, b + 8) for a, b in zip(k, (k + 1) % 8, strict=True)]
    front = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 7), (7, 4, 5), (7, 5, 6)]
    back = [(c + 8, b + 8, a + 8) for a, b, c in front]
    whole = trimesh.Trimesh(
        np.concatenate([ring, there]), [*sides, *[f[::-1] for f in front], *[f[::-1] for f in back]]
    )
    trimesh.repair.fix_normals(whole)
    assert whole.is_watertight
    whole.export(folder / "nest.stl")
    at = "[1,0,0, 0,1,0, 0,0,1, 0.5,0.4,0.0]"
    (folder / "cell.toml").write_text(
        f"""{ARM}[scene]
meshes = [{{ name = "NEST", mesh = "nest.stl", unit = "m", at = {at}{pieces} }}]
[parts.PEG]
shape = "cylinder"
diameter_mm = 20
length_mm = 40
mass_kg = 0.1
at = [1,0,0, 0,1,0, 0,0,1, 0.51,0.4,0.05]
""",
        encoding="utf-8",
    )
    cell = read_cell(folder / "cell.toml")
    bodies = CellBodies(cell)
    arranged = bodies.arranged(PartPoses(cell))
    assert len(arranged) == len(bodies.roles)
    distances = Distances([body.solid.shape for body in arranged])
    for number, body in enumerate(arranged):
        distances.set_pose(number, body.solid.pose)
    peg = [body.name for body in arranged].index("PEG")
    others = [number for number, body in enumerate(arranged) if body.name == "NEST"]
    return min(distances.between(number, peg, 1.0) for number in others)


def test_pieces(tmp_path: Path) -> None:
    """In the hull of a nest there is no room for a peg; between its pieces there is, as much as there is in it."""
    with pytest.warns(MeshWarning, match=r"NEST \(1\.92 times\)"):
        inside = nest(tmp_path, "")
    beside = nest(tmp_path, ', pieces = ["0.stl", "1.stl", "2.stl"]')

    # 0.1 x 0.1 of a hull, and 0.1 x 0.02 + 2 x 0.02 x 0.08 of the nest: 1.92 times.
    assert inside < -0.02
    # The peg is 10 mm from the middle: 30 - 10 - 10 mm from the wall, and 30 - 20 mm above the floor.
    assert beside == pytest.approx(0.01, abs=NEAR)
