"""The command convert."""

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.mjcf.reader import load_mjcf
from armwright.arm.urdf.reader import load_urdf
from armwright.kinematics.forward_kinematics import forward
from cli_calls import armwright

EXAMPLES = Path(__file__).parents[2] / "examples"
EXAMPLE, DESK, CELL = (EXAMPLES / name for name in ("seven_joints.urdf", "desk_arm.xml", "two_arms.toml"))


def test_catalogue_to_urdf(tmp_path: Path) -> None:
    """An arm of the catalogue becomes a URDF file, and what URDF cannot hold is said."""
    done = armwright("convert", "puma560", "-o", tmp_path / "new" / "puma.urdf")

    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert lines[0] == f"puma560: 6 joints written to {tmp_path / 'new' / 'puma.urdf'}"
    assert "  joint 1: the inertia of the drive, 1.14 kg m², is not in the file" in lines
    q = np.linspace(-1, 1, 6)
    again = load_urdf(tmp_path / "new" / "puma.urdf")
    np.testing.assert_allclose(forward(again, q), forward(load_arm("puma560"), q), atol=1e-12)
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["puma.urdf"]


def test_urdf_to_arm_file(tmp_path: Path) -> None:
    """A URDF file becomes an arm file that is the same arm, and with --json the summary is data."""
    done = armwright("convert", EXAMPLE, "-o", tmp_path / "seven.toml", "--json")

    assert json.loads(done.stdout) == {
        "written": str(tmp_path / "seven.toml"),
        "name": "seven_joints",
        "joints": 7,
        "notes": [],
        "lost": [],
    }
    assert load_arm(tmp_path / "seven.toml") == load_urdf(EXAMPLE)


def test_catalogue_to_mjcf(tmp_path: Path) -> None:
    """An arm of the catalogue becomes an MJCF file; what that cannot hold is said, and stands in the file too."""
    done = armwright("convert", "puma560", "-o", tmp_path / "puma.xml")

    assert (done.returncode, done.stderr) == (0, "")
    lost = [line.strip() for line in done.stdout.splitlines()[1:]]
    comments = (tmp_path / "puma.xml").read_text(encoding="utf-8").splitlines()
    assert all(f"<!-- Not represented: {sentence}. -->" in comments for sentence in lost)
    assert sum("no body has a mass of" in sentence for sentence in lost) == 2
    assert lost[-1].startswith("the mass matrix of the file differs by up to 0.000")
    q = np.linspace(-1, 1, 6)
    np.testing.assert_allclose(forward(load_arm(tmp_path / "puma.xml"), q), forward(load_arm("puma560"), q), atol=1e-12)


def test_printed() -> None:
    """Without -o the text is printed, and nothing is written; what is lost is on the standard error."""
    done = armwright("convert", "ur5", "--to", "mjcf")

    assert done.returncode == 0
    assert done.stdout.startswith("<?xml")
    assert done.stdout.endswith("</mujoco>\n")
    assert "joint 1: the maximum speed, 3.14159 rad/s, is not in the file\n" in done.stderr


def test_mjcf_to_arm_file(tmp_path: Path) -> None:
    """An MJCF file becomes an arm file, its fingers locked in millimetres."""
    part = ("--tip", "pinch", "--lock", "left=20,right=20")

    done = armwright("convert", DESK, "-o", tmp_path / "desk.toml", *part, "--json")

    data = json.loads(done.stdout)
    assert (data["name"], data["joints"], data["lost"]) == ("desk_arm", 6, [])
    expected = load_mjcf(DESK, tip="pinch", lock={"left": 0.02, "right": 0.02})
    assert load_arm(tmp_path / "desk.toml") == expected


def test_cell_to_mjcf(tmp_path: Path) -> None:
    """A cell becomes an MJCF file that MuJoCo loads."""
    done = armwright("convert", CELL, "--to", "mjcf", "-o", tmp_path / "cell.xml")

    assert (done.returncode, done.stderr) == (0, "")
    assert ": 2 arms, " in done.stdout.splitlines()[0]
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "cell.xml"))
    assert model.body("ARM_2/link6").id > 0


def test_an_arm_of_a_cell_in_mjcf(tmp_path: Path) -> None:
    """Of the MJCF file of a cell an arm is converted, and a note says that this is not all, and what reads all."""
    armwright("convert", CELL, "-o", tmp_path / "cell.xml")

    part = ("--base", "ARM_2/base", "--tip", "ARM_2/tool", "--lock", "ARM_2/left,ARM_2/right")
    done = armwright("convert", tmp_path / "cell.xml", *part, "-o", tmp_path / "arm.toml")

    assert done.returncode == 0, done
    assert load_arm(tmp_path / "arm.toml").n == 6
    assert "the file is a cell, of which ARM_2 alone is read; armwright.physics.read_cell_mjcf" in done.stdout


def test_part_of_a_chain(tmp_path: Path) -> None:
    """Base, tip and locked joints are named on the command line."""
    part = ("--base", "upper_arm", "--tip", "gripper", "--lock", "forearm_roll,wrist_tilt")

    done = armwright("convert", EXAMPLE, "-o", tmp_path / "part.toml", *part)

    assert done.returncode == 0
    assert load_arm(tmp_path / "part.toml") == load_urdf(
        EXAMPLE, base="upper_arm", tip="gripper", lock=["forearm_roll", "wrist_tilt"]
    )
    assert load_arm(tmp_path / "part.toml").n == 3


def test_joints_held_elsewhere(tmp_path: Path) -> None:
    """A joint is held where the command line says, in degrees, or in millimetres if it slides; at 0 without a word."""
    part = ("--lock", "forearm_roll=30,wrist_tilt,hand_roll=-12.5")

    done = armwright("convert", EXAMPLE, "-o", tmp_path / "part.toml", *part)

    assert done.returncode == 0
    held = {"forearm_roll": np.radians(30), "wrist_tilt": 0.0, "hand_roll": np.radians(-12.5)}
    arm = load_arm(tmp_path / "part.toml")
    assert arm == load_urdf(EXAMPLE, lock=held)
    q = np.array([0.1, 0.2, 0.3, 0.4])
    whole = forward(load_urdf(EXAMPLE), [*q, *held.values()])
    np.testing.assert_allclose(forward(arm, q), whole, atol=1e-12)


def test_slides_held_elsewhere(tmp_path: Path) -> None:
    """Where a slide is held is said in millimetres."""
    slide = EXAMPLE.read_text(encoding="utf-8").replace(
        '<joint name="elbow_tilt" type="revolute">', '<joint name="elbow_tilt" type="prismatic">'
    )
    (tmp_path / "slide.urdf").write_text(slide, encoding="utf-8")

    done = armwright("convert", "slide.urdf", "-o", "held.toml", "--lock", "elbow_tilt=20", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    expected = load_urdf(tmp_path / "slide.urdf", lock={"elbow_tilt": 0.02})
    np.testing.assert_allclose(
        forward(load_arm(tmp_path / "held.toml"), np.zeros(6)), forward(expected, np.zeros(6)), atol=1e-12
    )


def test_notes(tmp_path: Path) -> None:
    """What was not taken as it stands in a URDF file is said."""
    text = EXAMPLE.read_text(encoding="utf-8").replace('velocity="3.6"', 'velocity="0"')
    (tmp_path / "slow.urdf").write_text(text, encoding="utf-8")

    said = armwright("convert", tmp_path / "slow.urdf", "-o", tmp_path / "slow.toml").stdout

    assert "\n  joint 'hand_roll': a maximum velocity of 0 is interpreted as unknown\n" in said


def test_other_commands_read_urdf() -> None:
    """A path of a URDF file stands wherever an arm is asked for."""
    q = "10,20,30,40,50,60,70"

    data = json.loads(armwright("forward", EXAMPLE, "-q", q, "--json").stdout)

    expected = forward(load_urdf(EXAMPLE), np.radians([10, 20, 30, 40, 50, 60, 70]))
    np.testing.assert_allclose(data["pose"], expected, atol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (("puma560",), 2, "-o: missing; specify the file to write, or the format as --to, which is printed then"),
        (("puma560", "-o", "puma.yml"), 2, "a name that ends in .urdf, .xml, .toml, .conf or .yaml, got puma.yml"),
        (("puma560", "--to", "mjfc"), 2, "'mjfc' is not one of 'urdf', 'mjcf', 'toml'"),
        (("ntu-3r", "-o", "ntu.xml"), 3, "specify mass and inertia of link 3"),
        ((CELL, "-o", "cell.urdf"), 2, "is a cell; expected mjcf, as the other formats hold a single arm"),
        (
            ("puma560", "-o", "puma.toml", "--tip", "hand"),
            2,
            "expected a URDF or MJCF file, whose links and joints have names",
        ),
        (
            ("puma560", "-o", "puma.toml", "--lock", "j1"),
            2,
            "expected a URDF or MJCF file, whose links and joints have names",
        ),
        (("pumma560", "-o", "puma.toml"), 2, "Did you mean 'puma560'?"),
        ((EXAMPLE, "-o", "seven.toml", "--tip", "tool_pont"), 2, "no link 'tool_pont'. Did you mean 'tool_point'?"),
        ((EXAMPLE, "-o", "seven.toml", "--lock", "waist=x"), 2, "--lock: expected J1,J2=30, got 'x' for waist"),
        ((EXAMPLE, "-o", "seven.toml", "--lock", "waist=nan"), 2, "waist"),
        ((EXAMPLE, "-o", "seven.toml", "--lock", "waist=1e300"), 2, "waist"),
        ((EXAMPLE, "-o", "seven.toml", "--lock", "waist=400"), 2, "waist"),
        ((EXAMPLE, "-o", "seven.toml", "--lock", "waits"), 2, "no joint 'waits'. Did you mean 'waist'?"),
        (("no.urdf", "-o", "no.toml"), 4, "no.urdf: no such file"),
    ],
)
def test_mistakes(arguments: tuple[str | Path, ...], status: int, said: str, tmp_path: Path) -> None:
    """A call that cannot be understood ends with status 2, a file that does not exist with 4; nothing is written."""
    done = armwright("convert", *arguments, cwd=tmp_path, columns=400)

    assert done.returncode == status
    assert said in " ".join(done.stderr.replace("│", " ").split())
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_the_file_that_is_read_is_not_replaced(tmp_path: Path) -> None:
    """A URDF file may hold more than an arm: its shapes would be lost."""
    (tmp_path / "seven.urdf").write_bytes(EXAMPLE.read_bytes())

    done = armwright("convert", "seven.urdf", "-o", tmp_path / "seven.urdf", cwd=tmp_path)

    assert done.returncode == 2
    assert "expected another file than the input" in " ".join(done.stderr.replace("│", " ").split())
    assert (tmp_path / "seven.urdf").read_bytes() == EXAMPLE.read_bytes()


def test_cannot_be_written(tmp_path: Path) -> None:
    """Where a folder has the name of the file, the message says so."""
    (tmp_path / "puma.toml").mkdir()

    done = armwright("convert", "puma560", "-o", tmp_path / "puma.toml")

    assert done.returncode == 4
    assert done.stderr.startswith(f"armwright: cannot write '{tmp_path / 'puma.toml'}': ")
    assert [path.name for path in tmp_path.iterdir()] == ["puma.toml"]


def test_calibration_of_one_robot(tmp_path: Path) -> None:
    """The calibration of one robot makes an arm file of its model, and comes out of that in both forms."""
    own = Path(__file__).parents[1] / "arm" / "universal_robots" / "ur5.yaml"
    done = armwright("convert", "ur5", "--calibration", own, "-o", tmp_path / "mine.toml")
    assert (done.returncode, done.stderr) == (0, "")
    assert "read as ur_calibration writes them" in done.stdout
    missing = armwright("convert", tmp_path / "mine.toml", "-o", tmp_path / "mine.conf")
    assert missing.returncode == 2
    assert "--model" in missing.stderr

    q, mine = np.linspace(-1, 1, 6), load_arm(tmp_path / "mine.toml")
    for name, more in (("mine.conf", ("--model", "ur5")), ("mine.yaml", ())):
        assert armwright("convert", tmp_path / "mine.toml", *more, "-o", tmp_path / name).returncode == 0
        assert armwright("convert", "ur5", "--calibration", tmp_path / name, "-o", tmp_path / "a.toml").returncode == 0
        np.testing.assert_allclose(forward(load_arm(tmp_path / "a.toml"), q), forward(mine, q), atol=1e-9)


def test_calibration_of_a_cell() -> None:
    """A cell has no calibration of one robot."""
    done = armwright("convert", CELL, "--calibration", "mine.conf", "-o", "cell.xml")

    assert done.returncode == 2
    assert "expected an arm, got the cell" in done.stderr
