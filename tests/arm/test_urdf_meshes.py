"""Meshes of URDF files: where they are looked for, what they are, and what is said of those that are not read."""

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import trimesh

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arm.urdf.reader import load_urdf, read_urdf
from armwright.cell.reader import read_cell
from armwright.errors import FileFormatError, KindError
from armwright.kinematics.forward_kinematics import link_poses
from armwright.spatial.shapes import Mesh, Solid, Sphere, centroid, volume
from cli_calls import armwright
from urdf_texts import LIMIT, MASS, joint, link, robot


def shape(name: str, scale: str = "", tag: str = "collision") -> str:
    scale = f' scale="{scale}"' if scale else ""
    origin = '<origin xyz="0.1 0.2 0.3" rpy="0.3 -0.4 1"/>'
    return f'<{tag}>{origin}<geometry><mesh filename="{name}"{scale}/></geometry></{tag}>'


def write(path: Path, hand: str, base: str = "") -> Path:
    turn = joint("turn", "revolute", "base", "hand", f'<axis xyz="0 0 1"/><origin xyz="0 0 1"/>{LIMIT}')
    path.write_text(robot(link("base", base), link("hand", hand + MASS), turn), encoding="utf-8")
    return path


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a block of 40 x 20 x 10 mm in millimetres, beside the origin."""
    (tmp_path / "here" / "meshes").mkdir(parents=True)
    (tmp_path / "elsewhere" / "meshes").mkdir(parents=True)
    block = trimesh.creation.box((40, 20, 10)).apply_translation((30, 0, 0))
    for name in ("here/meshes/block.stl", "here/meshes/block.obj", "elsewhere/meshes/other.stl"):
        block.export(tmp_path / name)
    return tmp_path / "here"


def only(arm: Arm) -> Solid:
    """Return the solid of the hand."""
    (solid,) = arm.links[0].solids
    return solid


@pytest.mark.parametrize(
    "name",
    [
        "meshes/block.stl",
        "meshes/block.obj",
        "package://robot/meshes/block.stl",
        "package://meshes/block.stl",
        "model://meshes/block.stl",
        "file://{folder}/meshes/block.stl",
        "package://other_robot/meshes/other.stl",
    ],
)
def test_where_meshes_are(name: str, folder: Path) -> None:
    """A mesh is found below the folder of its file or of a package, and is scaled to metres where its link is."""
    path = write(folder / "arm.urdf", shape(name.format(folder=folder), "0.001 0.001 0.001"))

    arm = load_urdf(path, packages={"other_robot": folder.parent / "elsewhere"})

    solid = only(arm)
    assert isinstance(solid.shape, Mesh)
    assert volume(solid.shape) == pytest.approx(0.04 * 0.02 * 0.01)
    np.testing.assert_allclose(centroid(solid.shape), (0.03, 0, 0), atol=1e-9)


def test_as_pinocchio_has_them(folder: Path) -> None:
    """The corners of a mesh, with its scale along each axis, are in the base frame where Pinocchio has them."""
    path = write(
        folder / "arm.urdf", shape("meshes/block.stl", "0.001 -0.002 0.003"), shape("meshes/block.stl", "0.002 " * 3)
    )
    arm = load_urdf(path)
    model = pin.buildModelFromUrdf(str(path))
    known = pin.buildGeomFromUrdf(model, str(path), pin.GeometryType.COLLISION, package_dirs=str(folder))
    data, placed = model.createData(), known.createData()
    q = np.array([0.7])
    pin.updateGeometryPlacements(model, data, known, placed, q)

    X_BL = link_poses(arm, q)[1]
    seen = [(Solid(shape=it.shape, pose=X_BL @ it.pose)) for it in arm.links[0].solids]
    for solids, name in ((seen, "hand_0"), (arm.base_solids, "base_0")):
        number = known.getGeometryId(name)
        geometry, X = known.geometryObjects[number], placed.oMg[number].homogeneous
        expected = geometry.geometry.vertices() @ X[:3, :3].T + X[:3, 3]
        (solid,) = solids
        assert isinstance(solid.shape, Mesh)
        corners = solid.shape.vertices @ solid.pose[:3, :3].T + solid.pose[:3, 3]
        for point in corners:
            assert np.linalg.norm(expected - point, axis=1).min() < 1e-7
        assert volume(solid.shape) > 0


def test_what_is_drawn(folder: Path) -> None:
    """Of a link without <collision>, the meshes of <visual> count."""
    path = write(folder / "arm.urdf", shape("meshes/block.stl", "1e-3 1e-3 1e-3", "visual"))
    assert isinstance(only(load_arm(path)).shape, Mesh)
    ball = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    write(path, shape("meshes/block.stl", tag="visual") + ball)
    assert isinstance(only(load_arm(path)).shape, Sphere)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("meshes/none.stl", "no such file below {folder}"),
        (
            "package://other/meshes/other.stl",
            "name the folder of its package: packages={{'other': DIR}} (--package other=DIR)",
        ),
        ("../elsewhere/meshes/other.stl", "expected the name of a file below this folder"),
        ("package://robot/../../elsewhere/meshes/other.stl", "expected the name of a file below this folder"),
        ("package://known/../../here/meshes/block.stl", "expected the name of a file below this folder"),
        ("package://robot/%2e%2e/%2e%2e/elsewhere/meshes/other.stl", "expected the name of a file below this folder"),
        ("file:///etc/passwd.stl", "expected the name of a file below this folder"),
        ("/etc/passwd.stl", "expected the name of a file below this folder"),
        ("link.stl", "expected the name of a file below this folder"),
        ("http://example.org/x.stl", "nothing is fetched from 'http'"),
        ("meshes/block.dae", "expected a name that ends in one of .stl, .obj, .gltf, .glb, .step, .stp"),
    ],
)
def test_meshes_that_are_not_read(name: str, said: str, folder: Path) -> None:
    """A mesh that is not there, lies elsewhere or is of another format is noted, and the arm is read without it."""
    (folder / "link.stl").symlink_to(folder.parent / "elsewhere" / "meshes" / "other.stl")
    path = write(folder / "arm.urdf", shape(name))

    reading = read_urdf(path, packages={"known": folder.parent / "elsewhere" / "meshes"})

    assert not reading.arm.links[0].solids
    (note,) = reading.notes
    assert name[-20:] in note
    assert said.format(folder=folder) in note


def test_many_that_are_not_read(folder: Path) -> None:
    """Of many meshes that are not there, some are named, once for each reason, by the ends of their names."""
    names = [f"package://robot_description/meshes/visual/of/this/robot/link{k}.stl" for k in range(30)]
    (note,) = read_urdf(write(folder / "arm.urdf", "".join(map(shape, names)))).notes
    assert note.startswith("the meshes '...")
    assert "/link0.stl', '..." in note
    assert "/link9.stl' and 20 more are not read: no such file below" in note
    assert note.count("--package robot_description=DIR") == 1

    reading = read_urdf(write(folder / "arm.urdf", "".join(shape(f"x{k}://a.stl") for k in range(12))))
    assert reading.notes[0] == "the mesh 'x0://a.stl' is not read: nothing is fetched from 'x0'"
    assert reading.notes[10:] == ("2 more are not read for other reasons",)


@pytest.mark.parametrize(
    ("name", "scale", "said"),
    [
        ("meshes/block.stl", "", "filename: {folder}/meshes/block.stl: 40 m long, probably in another unit; unit = "),
        ("broken.stl", "", "filename: {folder}/broken.stl: no STL"),
        ("meshes/block.stl", "1 0 1", "scale: expected numbers other than 0"),
        ("meshes/block.stl", "1 1", "scale: expected 3 numbers, got 2"),
    ],
)
def test_broken_meshes(name: str, scale: str, said: str, folder: Path) -> None:
    """A mesh that is there and broken, or in another unit, is refused with the link that it is of."""
    (folder / "broken.stl").write_bytes(b"")
    with pytest.raises(FileFormatError) as error:
        load_urdf(write(folder / "arm.urdf", shape(name, scale)))
    assert "link 'hand', collision, geometry, mesh" in str(error.value)
    assert said.format(folder=folder) in str(error.value)


def test_packages(folder: Path) -> None:
    """Packages are named in Python, on the command line and in cells."""
    wrong: Any = ["x"]
    path = write(folder / "arm.urdf", shape("package://x/meshes/other.stl", "1e-3 1e-3 1e-3"))
    with pytest.raises(KindError, match=r"packages: expected folders by the names of packages, got \['x'\]"):
        load_urdf(path, packages=wrong)
    with pytest.raises(KindError, match="packages: expected the path of a folder for 'x', got 3"):
        load_urdf(path, packages={"x": 3})  # type: ignore[dict-item]
    for value in ("x", "=a", "x=", f"x={folder / 'nothing'}"):
        done = armwright("convert", path, "-o", folder / "new.urdf", "--package", value)
        assert done.returncode == 2
    without = armwright("convert", path, "-o", folder / "new.urdf")
    done = armwright("convert", path, "-o", folder / "new.urdf", "--package", f"x={folder.parent / 'elsewhere'}")
    assert "--package x=DIR" in without.stdout
    assert "is not read" not in done.stdout
    assert "link 1: its meshes are not in the file" in done.stdout
    refused = armwright("convert", "puma560", "-o", folder / "new.urdf", "--package", f"x={folder}")
    assert refused.returncode == 2


def test_packages_of_a_cell(folder: Path) -> None:
    """An arm of a cell has the meshes of the packages that the cell names, from its own folder."""
    example = Path(__file__).parents[2] / "examples" / "seven_joints.urdf"
    text = example.read_text(encoding="utf-8")
    at = text.index("<inertial>")
    (folder / "seven.urdf").write_text(
        text[:at] + shape("package://x/meshes/other.stl", "1e-3 1e-3 1e-3") + text[at:], encoding="utf-8"
    )
    cell = "[arms.ARM_1]\nmodel = 'seven.urdf'\njoint_positions = [0, 0.5, 0, 1, 0, 0.5, 0]\n"
    found = {}
    for packages in ("", "packages = { x = '../elsewhere' }\n"):
        (folder / "cell.toml").write_text(cell + packages, encoding="utf-8")
        arm = read_cell(folder / "cell.toml").arms["ARM_1"].arm
        solids = [solid for row in (arm.base_solids, *(it.solids for it in arm.links)) for solid in row]
        found[packages] = [solid for solid in solids if isinstance(solid.shape, Mesh)]
    assert [len(meshes) for meshes in found.values()] == [0, 1]
