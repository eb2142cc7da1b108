"""The cameras of cell files and what they look for: what they mean, and what is said of mistakes."""

from pathlib import Path

import numpy as np
import pytest

from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.cell.simulator import Simulator
from armwright.errors import FileFormatError

ARM = """[arms.ARM_1]
hand = [1,0,0, 0,-1,0, 0,0,-1, 0.45,0,0.25]
"""
DOWN = "[1,0,0, 0,-1,0, 0,0,-1, 0.5,0,0.9]"
SCENE = """[scene]
table = { z = 0.03, from = [0.15, -0.7], to = [1.35, 0.7] }
markers = [{ name = "goal", id = 7, size_mm = 60, at = [0,1,0, -1,0,0, 0,0,1, 0.6,0.2,0.03] }]
"""
# A block lies on its side: its y axis points up, and 30 mm of it is above its centre.
BLOCK = """[parts.BLOCK]
size_mm = [40, 60, 80]
mass_kg = 0.2
at = [1,0,0, 0,0,1, 0,-1,0, 0.5,0.1,0.06]
grasp = [1,0,0, 0,-1,0, 0,0,-1, 0,0,0.01]
marker = { id = 3, size_mm = 30, at = [1,0,0, 0,1,0, 0,0,1, 0,0,0.04] }
"""
TOP = f"[cameras.Top]\npose = {DOWN}\nwidth = 640\nheight = 480\nfovy_deg = 42\n"


def cell(folder: Path, text: str) -> Cell:
    (folder / "cell.toml").write_text(f"{text}{ARM}", encoding="utf-8")
    return read_cell(folder / "cell.toml")


def test_cameras(tmp_path: Path) -> None:
    """A camera stands in the world or is carried by an arm; a measured lens has a focal length for each axis."""
    read = cell(
        tmp_path,
        f"""[camera]
pose = {DOWN}
width = 320
height = 240
fovy_deg = 90
noise = 2
light = 0.5
[cameras.wrist]
on = "arm-1"
pose = [1,0,0, 0,1,0, 0,0,1, 0,0.05,-0.1]
width = 640
height = 480
focal_px = [600, 610]
centre_px = [310, 250]
distortion = [-0.1, 0.02, 0.001, -0.001, 0]
""",
    )
    main, wrist = read.cameras["CAMERA"], read.cameras["WRIST"]

    assert (main.on, main.noise, main.light, main.lens.width, main.lens.height) == (None, 2, 0.5, 320, 240)
    np.testing.assert_allclose(main.lens.focal, 120)  # half the height is seen under 45 degrees
    np.testing.assert_array_equal(main.pose, read.camera)
    assert (wrist.on, wrist.noise, wrist.light) == ("ARM_1", 0, 1)
    np.testing.assert_array_equal(wrist.lens.matrix, [[600, 0, 310], [0, 610, 250], [0, 0, 1]])
    np.testing.assert_array_equal(wrist.lens.distortion, [-0.1, 0.02, 0.001, -0.001, 0])


def test_a_camera_without_pictures(tmp_path: Path) -> None:
    """A camera of which only the pose is known takes no pictures."""
    read = cell(tmp_path, f"[camera]\npose = {DOWN}\n")

    assert not read.cameras
    assert read.camera[2, 3] == 0.9


def test_what_cameras_look_for(tmp_path: Path) -> None:
    """Parts and markers are at the height where they begin, unless the file names another, or that none is known."""
    read = cell(
        tmp_path,
        f"""{SCENE}{BLOCK}{TOP}[visions]
OBJ = {{ part = "block" }}
LOW = {{ part = "BLOCK", on = "table" }}
HIGH = {{ part = "BLOCK", on = 0.1, camera = "top" }}
ANY = {{ part = "BLOCK", on = "free" }}
GOAL = {{ marker = "GOAL", at = [1,0,0, 0,-1,0, 0,0,-1, 0,0,0.05] }}
""",
    )

    heights = {name: sight.height for name, sight in read.sights.items()}
    assert heights == {"OBJ": pytest.approx(0.03), "LOW": pytest.approx(0.03), "HIGH": 0.1, "ANY": None, "GOAL": 0.03}
    assert {sight.camera for sight in read.sights.values()} == {"TOP"}
    assert (read.sights["OBJ"].kind, read.sights["OBJ"].name) == ("part", "BLOCK")
    np.testing.assert_array_equal(read.sights["OBJ"].relation, read.parts["BLOCK"].grasp)
    assert read.seen_parts == dict.fromkeys(("OBJ", "LOW", "HIGH", "ANY"), "BLOCK")
    assert (read.markers["GOAL"].number, read.markers["GOAL"].size) == (7, 0.06)


def test_the_simulator_answers_with_markers(tmp_path: Path) -> None:
    """Without physics, a camera finds a marker of the scene where it is, again and again."""
    simulator = Simulator(
        cell(tmp_path, f'{SCENE}[visions]\nGOAL = {{ marker = "GOAL", at = [1,0,0, 0,-1,0, 0,0,-1, 0.01,0,0.05] }}\n')
    )

    for _ in range(2):
        pose, time = simulator.locate("GOAL", 0.0)
        # x of the marker is y of the world.
        np.testing.assert_allclose(pose[:3, 3], (0.6, 0.21, 0.08), atol=1e-12)
        np.testing.assert_allclose(pose[:3, 2], (0, 0, -1), atol=1e-12)
        assert time == 0.1


HIDDEN = BLOCK.replace("0,0,0.04", "0,0,0.039")
INWARD = BLOCK.replace("at = [1,0,0, 0,1,0, 0,0,1, 0,0,0.04]", "at = [1,0,0, 0,-1,0, 0,0,-1, 0,0,0.04]")
BELOW = BLOCK.replace("at = [1,0,0, 0,1,0, 0,0,1, 0,0,0.04]", "at = [1,0,0, 0,0,1, 0,-1,0, 0,-0.03,0]")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[camera]\nnoise = 2\n", "camera, noise: it is a key of cameras that take pictures, which need width and hei"),
        (TOP.replace("width = 640", "width = 640.5"), "Top, width: expected a whole number, got 640.5"),
        (TOP.replace("640", "4000").replace("480", "4000"), "expected no more than 4,194,304 pixels, got 4000 times"),
        (
            "".join(TOP.replace("640", "2048").replace("480", "2048").replace("Top", f"C{i}") for i in range(5)),
            "C4, width: expected no more than 16,777,216 pixels of all cameras together",
        ),
        (TOP.replace("fovy_deg = 42", "fovy_deg = 170"), "fovy_deg: expected 1 to 150, got 170"),
        (TOP.replace("fovy_deg = 42\n", ""), "Top, fovy_deg: missing, expected a number"),
        (f"{TOP}focal_px = [600, 600]\n", "fovy_deg: the lens is specified twice, by fovy_deg and by focal_px"),
        (
            f"{TOP}distortion = [-0.9, 0, 0, 0, 0]\n".replace("42", "70"),
            "the field of view is too wide for it: its edge",
        ),
        (f"{TOP}distortion = [1, 2]\n", "distortion: expected 5 numbers, got 2"),
        (f'{TOP}on = "ARM_2"\n', "Top, on: ARM_2 is not an arm of the cell; did you mean ARM_1?"),
        (TOP.replace(f"pose = {DOWN}\n", ""), "cameras, Top, pose: missing, expected a list of 12 numbers"),
        (f"{TOP}fov = 3\n", "cameras, Top, fov: unknown key"),
        (
            f'{SCENE}[visions]\nG = {{ marker = "GAOL" }}\n',
            "G, marker: GAOL is not a marker of the cell; did",
        ),
        (f'{SCENE}{BLOCK}{TOP}[visions]\nO = {{ part = "BLOCK", camera = "TOPP" }}\n', "did you mean TOP?"),
        (f'{BLOCK}[visions]\nO = {{ part = "BLOCK", on = "table" }}\n', "O, on: the scene has no table"),
        (f'{BLOCK}[visions]\nO = {{ part = "BLOCK", on = "tabel" }}\n', "did you mean 'table'?"),
        (
            f'{SCENE}{BLOCK}[visions]\nO = {{ part = "BLOCK", marker = "GOAL" }}\n',
            "finds a part or a marker of the scene, not both",
        ),
        (
            f'{BLOCK}{TOP}{TOP.replace("Top", "SIDE")}[visions]\nO = {{ part = "BLOCK" }}\n',
            "O, camera: missing; the cameras are TOP, SIDE",
        ),
        (
            f"{SCENE.replace('id = 7', 'id = 3')}{BLOCK}",
            "markers 1, id: BLOCK and GOAL have the same",
        ),
        (f"{SCENE.replace('0.2,0.03', '0.2,0.029')}", "at: marker 7 of GOAL is hidden: TABLE is in front of it"),
        (HIDDEN, "BLOCK, marker, at: marker 3 of BLOCK is hidden: the part itself is in front of it"),
        (INWARD, "BLOCK, marker, at: marker 3 of BLOCK is hidden: the part itself is in front of it"),
        (f"{SCENE}{BELOW}", "BLOCK, marker, at: marker 3 of BLOCK is hidden: TABLE is in front of it"),
    ],
)
def test_mistakes(text: str, message: str, tmp_path: Path) -> None:
    """Every mistake is told with its table and its key."""
    with pytest.raises(FileFormatError) as caught:
        cell(tmp_path, text)

    assert message in str(caught.value)


def test_a_marker_over_the_table(tmp_path: Path) -> None:
    """A marker that looks down is hidden by the table only as long as its part stands on it."""
    above = BELOW.replace("0.5,0.1,0.06", "0.5,0.1,0.08")

    assert cell(tmp_path, f"{SCENE}{above}").parts["BLOCK"].marker is not None
