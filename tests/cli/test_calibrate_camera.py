"""``armwright calibrate-camera`` as a user calls it."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from armwright.arm.load import load_arm
from armwright.calibration.arm_readings import ArmAccuracy
from armwright.calibration.camera_tables import read_lens
from armwright.files.document import Document
from armwright.spatial.poses import from_noap
from calibration.boards import CHARUCO, Scene, photographed, random_scene
from cli_calls import armwright

pytest.importorskip("cv2")

EXAMPLES = Path(__file__).parents[2] / "examples"
CORNERS, JOINTS = EXAMPLES / "board_corners.csv", EXAMPLES / "board_joints.csv"
BOARD = ("--squares", "9x7", "--square-mm", "30", "--marker-mm", "22")
TABLE = (str(CORNERS), "--size", "640x480", *BOARD)
ARM = ("--arm", "ur5", "--joints", str(JOINTS))


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Return a camera beside an arm that moves a board."""
    return random_scene(np.random.default_rng(4), load_arm("ur5"), 8, eye_in_hand=False, accuracy=ArmAccuracy())


@pytest.fixture(scope="module")
def folder(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with pictures and joint positions of the scene, and one picture without a board."""
    folder, rng = tmp_path_factory.mktemp("pictures"), np.random.default_rng(5)
    rows = [",".join(["picture", *(f"joint_{i}_rad" for i in range(1, 7))])]
    for k, (X, q) in enumerate(zip(scene.seen, scene.readings.q, strict=True)):
        Image.fromarray(photographed(rng, CHARUCO, scene.lens, X, 2.0)).save(folder / f"p{k}.png")
        rows.append(",".join([f"p{k}", *map(repr, map(float, q))]))
    Image.fromarray(np.full((480, 640), 90, dtype=np.uint8)).save(folder / "empty.png")
    (folder / "joints.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    return folder


def test_pictures_of_a_camera_beside_the_arm(scene: Scene, folder: Path, tmp_path: Path) -> None:
    """The lines for a cell file hold the true pose and lens to their errors; the page shows a picture with corners."""
    out = tmp_path / "out"
    done = armwright(
        "calibrate-camera", folder, *BOARD, "--arm", "ur5", "--joints", folder / "joints.csv", "--setup", "eye-to-hand",
        "--name", "overhead", "-o", out, columns=120,
    )  # fmt: skip

    assert done.returncode == 0, done.stderr
    assert "left out: empty.png: the board is not found" in done.stdout
    files = {"camera.toml", "errors.json", "corners.csv", "report.html", "run.json"}
    assert {path.name for path in out.iterdir()} == files | {
        "residuals.svg",
        "figure-pictures.svg",
        "figure-corners.svg",
    }
    camera = Document.read(out / "camera.toml").root.table("cameras").table("overhead")
    X = from_noap(camera.vector("pose", 12))
    data = json.loads((out / "errors.json").read_text(encoding="utf-8"))
    errors = [value["standard_error"] for value in data["hand_eye"]["errors"].values()]
    assert np.all(np.abs(X[:3, 3] - scene.camera[:3, 3]) < 5 * np.array(errors[:3]))
    assert "on" not in camera
    lens = read_lens(out / "camera.toml")
    lens_errors = [value["standard_error"] for value in data["lens"].values()]
    assert np.all(np.abs(lens.numbers - scene.lens.numbers) < 5 * np.array(lens_errors))
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.count("<figure>") == 3
    assert f"<b>{data['sigma_px']:.3g} px</b>" in page
    assert set(re.findall(r'<a href="([^"]*)" download>', page)) == {path.name for path in out.iterdir()} - {
        "report.html",
        "run.json",
    }
    assert "http://" not in page

    # The corners that were written give the same, as does the lens that was written, with the corners alone.
    again = armwright(
        "calibrate-camera", out / "corners.csv", "--size", "640x480", *BOARD, "--arm", "ur5", "--joints",
        folder / "joints.csv", "--setup", "eye-to-hand", "--json",
    )  # fmt: skip
    assert again.returncode == 0, again.stderr
    same = json.loads(again.stdout)["hand_eye"]
    np.testing.assert_allclose(same["camera"], data["hand_eye"]["camera"], atol=1e-6)
    known = armwright(
        "calibrate-camera", out / "corners.csv", "--size", "640x480", *BOARD, "--arm", "ur5", "--joints",
        folder / "joints.csv", "--setup", "eye-to-hand", "--lens", out / "camera.toml", "--json",
    )  # fmt: skip
    assert known.returncode == 0, known.stderr
    data = json.loads(known.stdout)
    np.testing.assert_allclose(data["hand_eye"]["camera"], same["camera"], atol=2e-4)
    assert not any(value["standard_error"] for value in data["lens"].values())


def test_the_lens_alone() -> None:
    """Without an arm, the lens is printed with its standard errors."""
    done = armwright("calibrate-camera", *TABLE, "--distortion", "2", columns=120)

    assert done.returncode == 0, done.stderr
    assert "Lens of camera, 640 x 480 pixels" in done.stdout
    assert "14 pictures with 618 corners" in done.stdout
    assert "Board in the" not in done.stdout


def test_a_camera_on_the_hand() -> None:
    """The camera of the example is 70 mm beside the flange and 40 mm before it."""
    done = armwright("calibrate-camera", *TABLE, *ARM, "--json")

    assert done.returncode == 0, done.stderr
    errors = json.loads(done.stdout)["hand_eye"]["errors"]
    for name, truth in (("camera.x", 0.07), ("camera.y", 0.0), ("camera.z", 0.04)):
        assert abs(errors[name]["value"] - truth) < 4 * errors[name]["standard_error"] < 2e-3


def test_joints_have_standard_deviations_too() -> None:
    """Errors of the joints stand for those of the hand; a tenth of them contradicts the pictures, with status 3."""
    good = armwright("calibrate-camera", *TABLE, *ARM, "--joint-sigmas", "0.03", "--json")
    doubtful = armwright("calibrate-camera", *TABLE, *ARM, "--joint-sigmas", "1e-3,1e-3,1e-3,1e-3,1e-3,1e-3", "--json")

    assert good.returncode == 0, good.stderr
    assert doubtful.returncode == 3
    assert "the pictures contradict the arm" in doubtful.stderr
    data = json.loads(doubtful.stdout)
    assert data["hand_eye"]["disagreement"] > 2
    assert "standard deviations of the joints" in data["contradictions"][0]


@pytest.mark.parametrize(
    ("arguments", "status", "says"),
    [
        ((str(CORNERS), *BOARD), 2, "expected the size of the pictures with a table of corners"),
        ((*TABLE, "--arm", "ur5"), 2, "expected both --arm and --joints, or neither"),
        ((*TABLE, "--arm", "ur55", "--joints", str(JOINTS)), 2, "no arm 'ur55'. Did you mean 'ur"),
        ((*TABLE, "--arm", "ntu-3r", "--joints", str(JOINTS)), 4, "joint_4_deg"),
        ((*TABLE, *ARM, "--setup", "hand"), 2, "expected eye-in-hand or eye-to-hand, got hand"),
        ((*TABLE, *ARM, "--setup", "eye-to-hand"), 3, "beside the arm"),
        ((*TABLE, "--name", "a b"), 2, "expected letters, digits, _ and -, got 'a b'"),
        ((*TABLE, "--distortion", "3"), 2, "expected 0, 2, 4 or 5, got 3"),
        ((*TABLE, *ARM, "--arm-mm", "0"), 2, "position: expected more than 0 m"),
        ((*TABLE, *ARM, "--joint-sigmas", "1,2"), 2, "expected 6 finite numbers, got 2"),
        ((*TABLE, *ARM, "--pixel-sigma", "-1"), 2, "sigma: expected more than 0 px"),
        ((str(CORNERS), "--size", "640", *BOARD), 2, "expected two numbers such as 9x7, got '640'"),
        ((str(CORNERS), "--size", "320x240", *BOARD), 2, "is outside of a picture of 320 x 240 pixels"),
        ((str(CORNERS), "--size", "640x480", "--squares", "7x9", "--square-mm", "30"), 2, "mirror image"),
        ((str(EXAMPLES), *BOARD), 4, "the folder has no pictures"),
        ((str(EXAMPLES / "weld.rlo"), *BOARD), 4, "expected a picture as PNG or JPEG"),
        (("nowhere.png", *BOARD), 4, "no such file"),
    ],
)
def test_mistakes(arguments: tuple[str, ...], status: int, says: str) -> None:
    """A mistake is told in a line, without a traceback."""
    done = armwright("calibrate-camera", *arguments, columns=250)

    assert says in done.stderr
    assert done.returncode == status
    assert "Traceback" not in done.stderr
    assert not done.stdout


def test_a_chessboard_that_looks_the_same_upside_down(folder: Path) -> None:
    """For a pose, a chessboard must have an odd and an even number of squares."""
    done = armwright("calibrate-camera", folder, "--squares", "9x7", "--square-mm", "30", *ARM)

    assert done.returncode == 2
    assert "a chessboard of 9 x 7 squares looks the same upside down" in done.stderr


def test_a_missing_library_is_told_in_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without OpenCV the command says what to install."""
    monkeypatch.setitem(__import__("sys").modules, "cv2", None)
    done = armwright("calibrate-camera", *TABLE)

    assert done.returncode == 3
    assert "pip install 'armwright[physics]'" in done.stderr
