"""The scene, the parts and the grippers of cell files: what they mean, and what is said of their mistakes."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.errors import FileFormatError, MeshWarning
from armwright.spatial.shapes import Box, Cylinder, Mesh, Sphere, centroid, inertia

ARM = """[arms.ARM_1]
hand = [1,0,0, 0,-1,0, 0,0,-1, 0.45,0,0.25]
"""
HERE = "[1,0,0, 0,1,0, 0,0,1, 0.5,0.1,0.2]"
PART = f"[parts.{{}}]\nsize_mm = [1, 1, 1]\nmass_kg = 1\nat = {HERE}\n"


def cell(folder: Path, text: str) -> Cell:
    (folder / "cell.toml").write_text(f"{ARM}{text}", encoding="utf-8")
    return read_cell(folder / "cell.toml")


def test_a_scene(tmp_path: Path) -> None:
    """A table is a box whose top is where it says; other bodies are about their poses, in metres."""
    fixtures = cell(
        tmp_path,
        f"""[scene]
table = {{ z = 0.03, from = [0.15, 0.7], to = [1.35, -0.5], thickness_mm = 40 }}
boxes = [{{ name = "nest", at = {HERE}, size_mm = [24, 30, 100], friction = 0.3 }}]
cylinders = [{{ name = "POST", at = {HERE}, diameter_mm = 60, length_mm = 800 }}]
spheres = [{{ name = "BALL", at = {HERE}, diameter_mm = 50 }}]
""",
    ).fixtures

    assert list(fixtures) == ["TABLE", "NEST", "POST", "BALL"]
    table, nest = fixtures["TABLE"], fixtures["NEST"]
    assert isinstance(table.shape, Box)
    assert isinstance(nest.shape, Box)
    np.testing.assert_allclose(table.shape.size, (1.2, 1.2, 0.04), atol=1e-15)
    np.testing.assert_allclose(table.pose[:3, 3], (0.75, 0.1, 0.01), atol=1e-15)
    np.testing.assert_allclose(nest.shape.size, (0.024, 0.03, 0.1), atol=1e-15)
    np.testing.assert_array_equal(nest.pose[:3, 3], (0.5, 0.1, 0.2))
    assert (table.friction, nest.friction) == (0.8, 0.3)
    assert fixtures["POST"].shape == Cylinder(radius=0.03, length=0.8)
    assert fixtures["BALL"].shape == Sphere(radius=0.025)


def test_parts(tmp_path: Path) -> None:
    """A part has mass, friction, grasp, marker and symmetry; the camera answers with it."""
    read = cell(
        tmp_path,
        f"""[parts.Block]
size_mm = [40, 40, 40]
mass_kg = 0.2
at = {HERE}
spread_mm = 30
spread_deg = 90
grasp = [1,0,0, 0,-1,0, 0,0,-1, 0,0,0.01]
marker = {{ id = 3, size_mm = 30, at = [1,0,0, 0,1,0, 0,0,1, 0,0,0.02] }}
symmetry = 4
[visions]
OBJ = {{ part = "block" }}
OLD = [{HERE}]
""",
    )
    block = read.parts["BLOCK"]

    assert (block.mass, block.friction, block.symmetry) == (0.2, 0.8, 4)
    assert (block.spread.position, block.spread.yaw) == (0.03, pytest.approx(np.pi / 2))
    assert block.grasp[2, 3] == 0.01
    assert block.marker is not None
    assert (block.marker.number, block.marker.size, block.marker.pose[2, 3]) == (3, 0.03, 0.02)
    assert read.seen_parts == {"OBJ": "BLOCK"}
    assert list(read.visions) == ["OLD"]


def test_grippers(tmp_path: Path) -> None:
    """A gripper has a kind, a force and an opening; without the table nothing is known of it."""
    (tmp_path / "one").mkdir()

    gripper = (
        cell(tmp_path, '[arms.ARM_1.gripper]\nkind = "suction"\nforce_N = 45\nopening_mm = 60\n').arms["ARM_1"].gripper
    )

    assert gripper is not None
    assert (gripper.kind, gripper.force, gripper.opening, gripper.friction) == ("suction", 45, 0.06, 1.0)
    assert cell(tmp_path / "one", "").arms["ARM_1"].gripper is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[scene]\ntable = { z = 0, from = [0, 0], to = [0, 1] }\n", "to: the corners of a table must differ in x and"),
        ("[scene]\ntable = { from = [0, 0], to = [1, 1] }\n", "scene, table, z: missing, expected a number"),
        (f'[scene]\nboxes = [{{ name = "A", at = {HERE} }}]\n', "boxes 1: missing, expected size_mm or size_m"),
        (f'[scene]\nspheres = [{{ name = "A B", at = {HERE}, diameter_mm = 1 }}]\n', "'A B' cannot name a frame"),
        ("[scene]\nboxs = []\n", "boxs: unknown key; did you mean 'boxes'?"),
        (f"[parts.A]\nsize_mm = [1, 1, 1]\nat = {HERE}\n", "parts, A, mass_kg: missing, expected a number"),
        ('[parts.A]\nshape = "ball"\n', "expected one of box, cylinder, mesh, sphere, got the text 'ball'"),
        (
            "\n".join(
                f"[parts.{name}]\nsize_mm = [1, 1, 1]\nmass_kg = 1\nat = {HERE}\n"
                f"marker = {{ id = 7, size_mm = 9, at = {HERE} }}"
                for name in "AB"
            ),
            "parts, B, marker, id: the parts A and B have the same marker 7",
        ),
        (
            f"[parts.A]\nsize_mm = [1e-3, 1e-3, 1e-3]\nmass_kg = 1e-6\nat = {HERE}\n",
            "parts, A, mass_kg: too small for such a shape; about an axis its moment of inertia is 1.67e-19 kg m²",
        ),
        (
            f"[parts.A]\nsize_mm = [1, 1, 1]\nmass_kg = 1\nat = {HERE}\nsymmetry = 1.5\n",
            "symmetry: expected a whole number, got 1.5",
        ),
        ('[visions]\nOBJ = { part = "BLOK" }\n', "OBJ, part: BLOK is not a part of the cell"),
        (
            f'[scene]\nspheres = [{{ name = "Post", at = {HERE}, diameter_mm = 1 }}]\n{PART.format("POST")}',
            "parts, POST: POST is the name of a body or a marker of the scene too; rename one of them",
        ),
        (
            f"[scene]\ntable = {{ z = 0, from = [0, 0], to = [1, 1] }}\n{PART.format('table')}",
            "parts, table: TABLE is the name of a body",
        ),
        (
            f'[scene]\nmarkers = [{{ name = "A", id = 3, size_mm = 9, at = {HERE} }}]\n{PART.format("A")}',
            "parts, A: A is the name of a body or a marker",
        ),
        (
            f'[scene]\nspheres = [{{ name = "arm-01", at = {HERE}, diameter_mm = 1 }}]\n',
            "ARM_1 cannot name a body or a marker of the scene",
        ),
        (
            f'[scene]\nmarkers = [{{ name = "World", id = 3, size_mm = 9, at = {HERE} }}]\n',
            "WORLD cannot name a body or a marker of the scene",
        ),
        ("[arms.ARM_1.sensors]\nencoder_counts = 1e-320\n", "encoder_counts: expected 1 or more, or 0 for exact"),
        ("[arms.ARM_1.gripper]\nforce_N = 0\n", "gripper, force_N: expected 0.001 to 100000, got 0"),
    ],
)
def test_mistakes(text: str, message: str, tmp_path: Path) -> None:
    """Every mistake is told with its table and its key."""
    with pytest.raises(FileFormatError) as caught:
        cell(tmp_path, text)

    assert message in str(caught.value)


def write_block(folder: Path, name: str = "block.stl", *, opened: bool = False) -> trimesh.Trimesh:
    """Write a plate of 40 x 20 x 10 mm in millimetres, beside the origin, and return it in metres."""
    plate = trimesh.creation.box((40, 20, 10)).apply_translation((30, 0, 0))
    if opened:
        plate.update_faces(np.arange(len(plate.faces)) != 3)
    plate.export(folder / name)
    return plate.apply_scale(1e-3)


def test_meshes(tmp_path: Path) -> None:
    """Parts and fixtures are meshes of files below the folder of the cell, in the unit that it says."""
    (tmp_path / "cad").mkdir()
    oracle = write_block(tmp_path / "cad")
    read = cell(
        tmp_path,
        f"""[scene]
meshes = [{{ name = "NEST", mesh = "cad/block.stl", unit = "cm", at = {HERE} }}]
[parts.BLOCK]
mesh = "cad/block.stl"
unit = "mm"
mass_kg = 0.2
at = {HERE}
""",
    )
    nest, part = read.fixtures["NEST"].shape, read.parts["BLOCK"]

    assert isinstance(nest, Mesh)
    assert isinstance(part.shape, Mesh)
    assert part.shape.name == "block.stl"
    np.testing.assert_allclose(nest.vertices.max(0), (0.5, 0.1, 0.05), atol=1e-7)
    np.testing.assert_array_equal(part.pose[:3, 3], (0.5, 0.1, 0.2))
    np.testing.assert_allclose(centroid(part.shape), (0.03, 0, 0), atol=1e-9)
    oracle.density = 0.2 / oracle.volume
    np.testing.assert_allclose(part.mass * inertia(part.shape), oracle.moment_inertia, atol=1e-12)


def test_hulls_that_lie(tmp_path: Path) -> None:
    """A mesh whose hull is much larger is warned of with its name, not where it has pieces; an open one too."""
    ring = trimesh.creation.torus(0.1, 0.02)
    ring.export(tmp_path / "ring.stl")
    trimesh.creation.box((0.05, 0.05, 0.05)).export(tmp_path / "piece.stl")
    write_block(tmp_path, "open.stl", opened=True)
    ratio = ring.convex_hull.volume / ring.volume
    text = f'meshes = [{{ name = "RING", mesh = "ring.stl", unit = "m", at = {HERE}'

    with pytest.warns(
        MeshWarning, match=rf"cell 'cell.toml': in collisions, .* much larger: RING \({ratio:.3g} times\)"
    ):
        cell(tmp_path, f"[scene]\n{text} }}]")
    read = cell(tmp_path, f'[scene]\n{text}, pieces = ["piece.stl", "piece.stl"] }}]')
    with pytest.warns(MeshWarning, match=r"meshes that are not closed .*: LID \(3 open edges\)"):
        cell(tmp_path, f'[scene]\nmeshes = [{{ name = "LID", mesh = "open.stl", unit = "mm", at = {HERE} }}]')

    shape = read.fixtures["RING"].shape
    assert isinstance(shape, Mesh)
    assert len(shape.pieces) == 2


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ('mesh = "block.stl"', "unit: missing, as STL files have none; expected one of m, mm, cm, in"),
        ('mesh = "block.stl"\nunit = "inch"', "unit: expected one of cm, in, m, mm, got the text 'inch'"),
        ('mesh = "block.stl"\nunit = "m"', "40 m long, probably in another unit"),
        ('mesh = "blok.stl"\nunit = "mm"', "no such file; did you mean"),
        ('mesh = "../block.stl"\nunit = "mm"', "mesh: {folder}: expected the name of a file below this folder"),
        ('mesh = "/etc/passwd"\nunit = "mm"', "expected the name of a file below this folder"),
        (
            'mesh = "open.stl"\nunit = "mm"',
            "mesh: open.stl is not closed (3 edges without one triangle on either",
        ),
        ('mesh = "block.stl"\nunit = "mm"\nsize_mm = [1, 1, 1]', "size_mm: unknown key"),
        ('mesh = "block.stl"\nshape = "box"\nsize_mm = [1, 1, 1]', "mesh: unknown key"),
        ('shape = "mesh"', "mesh: missing, expected a text in quotes"),
        ('mesh = "block.stl"\nunit = "mm"\npieces = ["none.stl"]', "pieces: {folder}/none.stl: no such file"),
        ('mesh = "block.stl"\nunit = "mm"\npieces = 3', "pieces: expected a list of texts in quotes, got 3"),
    ],
)
def test_mistakes_of_meshes(keys: str, said: str, tmp_path: Path) -> None:
    """A mesh of a part that cannot be read, lies elsewhere, has no unit, or encloses no mass is refused."""
    write_block(tmp_path)
    write_block(tmp_path, "open.stl", opened=True)
    with pytest.raises(FileFormatError) as error:
        cell(tmp_path, f"[parts.BLOCK]\n{keys}\nmass_kg = 0.2\nat = {HERE}\n")
    assert said.replace("{folder}", str(tmp_path)) in str(error.value)


def test_a_body_on_a_frame(tmp_path: Path) -> None:
    """Its pose refers to the frame, wherever that hangs; the frame has its spread, and the body its hardness."""
    read = cell(
        tmp_path,
        f"""[frames]
BENCH = {{ at = [0,1,0, -1,0,0, 0,0,1, 0.6,0,0.1], spread_mm = 2, spread_deg = 90 }}
RIM = {{ on = "BENCH", at = [1,0,0, 0,1,0, 0,0,1, 0,0,0.05], tilt_deg = 3 }}
[scene]
boxes = [{{ name = "WALL", on = "rim", at = {HERE}, size_mm = [1, 1, 1], contact_ms = 4 }}]
""",
    )

    wall = read.fixtures["WALL"]
    np.testing.assert_allclose(wall.pose[:3, 3], [0.6 - 0.1, 0.5, 0.35], atol=1e-12)
    assert (wall.on, wall.contact_time) == ("RIM", pytest.approx(4e-3))
    bench, rim = read.spreads["BENCH"], read.spreads["RIM"]
    assert (bench.position, bench.yaw, bench.tilt) == pytest.approx((2e-3, np.pi / 2, 0))
    assert (rim.position, rim.yaw, rim.tilt) == pytest.approx((0, 0, np.radians(3)))


@pytest.mark.parametrize(
    ("frames", "body", "said"),
    [
        ("", 'on = "BENCK"', "on: BENCK is not a standing frame of the cell; did you mean BENCH?"),
        ("", 'on = "ARM_1"', "on: ARM_1 is not a standing frame of the cell; there is BENCH, STATION, WORLD"),
        ("", 'on = "HELD"', "on: HELD is not a standing frame of the cell; there is BENCH, STATION, WORLD"),
        ("", "contact_ms = 0", "contact_ms: expected 2 to 1000, got 0"),
        ("TIP = { on = 'HELD', at = @, spread_mm = 1 }", "", "TIP: TIP moves with ARM_1; only a frame that stands"),
        ("TIP = { at = @, spread_mm = -1 }", "", "spread_mm: expected 0 to 1e+06, got -1"),
        ("TIP = { at = @, tilt_deg = 100 }", "", "tilt_deg: expected 0 to 90, got 100"),
    ],
)
def test_mistakes_about_frames(frames: str, body: str, said: str, tmp_path: Path) -> None:
    """A body stands on what stands, and only what stands has a spread."""
    text = f"""[frames]
BENCH = {HERE}
HELD = {{ on = "ARM_1", at = {HERE} }}
{frames.replace("@", HERE)}
[scene]
boxes = [{{ name = "WALL", at = {HERE}, size_mm = [1, 1, 1]{"," if body else ""} {body} }}]
"""
    with pytest.raises(FileFormatError) as caught:
        cell(tmp_path, text)
    assert said in str(caught.value)
