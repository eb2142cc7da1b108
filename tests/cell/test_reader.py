"""Cell files: what they mean, and what is said of their mistakes."""

import json
import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from armwright.cell.frames import WORLD
from armwright.cell.model import Cell, base_name
from armwright.cell.reader import read_cell
from armwright.errors import FileFormatError
from armwright.kinematics.forward_kinematics import forward
from armwright.program import Source, compile as compile_program, known_cell

CORPUS = Path(__file__).parent / "corpus"
EXAMPLES = Path(__file__).parents[2] / "examples"
# Poses go through an inverse and a forward solution; this much of a metre is rounding.
ROUNDING = 1e-9

# Line 1 of every faulty cell below is the first of these three.
ARM = """[arms.ARM_1]
base = [1,0,0, 0,1,0, 0,0,1, 0,0,0]
hand = [1,0,0, 0,-1,0, 0,0,-1, 0.45,0,0.25]
"""
IDENTITY = "[1,0,0, 0,1,0, 0,0,1, 0,0,0]"


def cell(tmp_path: Path, text: str, name: str = "cell.toml") -> Cell:
    (tmp_path / name).write_text(text, encoding="utf-8")
    return read_cell(tmp_path / name)


def toml_of(value: Any) -> str:
    """Write a value of JSON as TOML, all on one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {toml_of(below)}" for key, below in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml_of, value)) + "]"
    return json.dumps(value)


def assert_same(a: Cell, b: Cell) -> None:
    assert a.arms.keys() == b.arms.keys()
    for name, arm in a.arms.items():
        assert arm.arm == b.arms[name].arm
        np.testing.assert_array_equal(arm.base, b.arms[name].base)
        np.testing.assert_array_equal(arm.start, b.arms[name].start)
    assert list(a.tree()) == list(b.tree())
    for frame in a.tree():
        np.testing.assert_array_equal(a.tree().world(frame), b.tree().world(frame))
    assert a.visions.keys() == b.visions.keys()
    for name, answers in a.visions.items():
        np.testing.assert_array_equal(answers, b.visions[name])
    assert (a.contact.height, a.devices, a.period, a.deviation) == (b.contact.height, b.devices, b.period, b.deviation)


@pytest.mark.parametrize("name", ["cell1", "cell2", "jam", "seat"])
def test_toml_and_json_say_the_same(name: str, tmp_path: Path) -> None:
    """A cell of the corpus, rewritten in TOML, is the same cell."""
    data = json.loads((CORPUS / f"{name}.json").read_text())
    text = "\n".join(f"{key} = {toml_of(value)}" for key, value in data.items())

    assert_same(read_cell(CORPUS / f"{name}.json"), cell(tmp_path, text))


def test_one_stanford_arm() -> None:
    """Cell C1: the hand of a Stanford arm points down, 0.45 m in front of its base and 0.25 m up; STOP is there too."""
    place = read_cell(CORPUS / "cell1.json")
    tree = place.tree()

    down = np.array([[1, 0, 0, 0.45], [0, -1, 0, 0], [0, 0, -1, 0.25], [0, 0, 0, 1]])
    np.testing.assert_allclose(tree.world("ARM_1"), down, atol=ROUNDING)
    np.testing.assert_allclose(tree.world("STOP"), down, atol=ROUNDING)
    np.testing.assert_allclose(tree.world("STATION")[:3, 3], (0.45, 0, 0), atol=ROUNDING)
    assert place.name == "cell1.json"
    assert place.arms["ARM_1"].arm.name == "stanford"
    assert {name: len(answers) for name, answers in place.visions.items()} == {"OBJ1": 1, "OBJ2": 1}
    assert (place.contact.height, place.devices) == (None, None)


def test_two_arms_face_each_other() -> None:
    """Cell C2: the second base is turned half round at 1.10 m, and its hand is 0.45 m in front of it."""
    place = read_cell(CORPUS / "cell2.json")

    one, two = place.arms["ARM_1"], place.arms["ARM_2"]
    np.testing.assert_allclose(one.start, two.start, atol=1e-12)
    np.testing.assert_allclose(two.base @ forward(two.arm, two.start), place.tree().world("ARM_2"), atol=ROUNDING)
    np.testing.assert_allclose(place.tree().world("ARM_2")[:3, 3], (0.65, 0, 0.25), atol=ROUNDING)
    np.testing.assert_allclose(place.tree().world(base_name("ARM_2"))[:3, 3], (1.10, 0, 0), atol=ROUNDING)


@pytest.mark.parametrize(("name", "height"), [("jam", 0.045), ("seat", 0.022)])
def test_contact(name: str, height: float) -> None:
    """The plane that stops the peg stands at the height that the cell file tells."""
    assert read_cell(CORPUS / f"{name}.json").contact.height == height


@pytest.mark.parametrize("name", ["puma_cell.toml", "stanford_cell.toml"])
def test_examples(name: str) -> None:
    """The cells of the examples are read, and every start configuration is inside its limits."""
    for arm in read_cell(EXAMPLES / name).arms.values():
        assert (arm.start >= arm.arm.limits.lower).all()
        assert (arm.start <= arm.arm.limits.upper).all()


def test_defaults(tmp_path: Path) -> None:
    """What a cell file leaves out: the report's arm at the origin of the world, a servo of 1 ms, deviations of 1 mm."""
    place = cell(tmp_path, "[arms.ARM_1]\njoint_positions = [0, 0, 0.3, 0, 0, 0]\n")
    arm = place.arms["ARM_1"]

    assert (place.period, place.deviation, place.vision_time) == (1e-3, 1e-3, 0.1)
    assert place.around is None
    assert (arm.arm.name, arm.open_time, arm.grasp_time) == ("stanford", 0.3, 0.3)
    np.testing.assert_array_equal(arm.base, np.eye(4))
    np.testing.assert_array_equal(arm.start, (0, 0, 0.3, 0, 0, 0))
    np.testing.assert_array_equal(place.camera, np.eye(4))
    assert set(place.tree()) == {WORLD, "STATION", "ARM_1", base_name("ARM_1")}


def test_everything_at_once(tmp_path: Path) -> None:
    """Each key of a cell file reaches its place, in SI units."""
    text = f"""
name = "all of it"
[arms.arm-2]
model = "puma560"
joint_positions = [0, 0.5, 0.5, 0, 0.5, 0]
tool = [1,0,0, 0,1,0, 0,0,1, 0,0,0.12]
open_s = 0.25
grasp_s = 0.5
[camera]
pose = [1,0,0, 0,-1,0, 0,0,-1, 0,0,2]
time_s = 0.2
[devices]
press = {{}}
Lamp = {{}}
[contact]
z = -0.1
[motion]
servo_ms = 4
deviation_mm = 0.5
around = "via"
[frames]
"Table" = {IDENTITY}
[joint_targets.home]
joint_positions = [0, 0.6, 0.6, 0, 0.6, 0]
"""
    place = cell(tmp_path, text)
    arm = place.arms["ARM_2"]

    assert (place.name, place.period, place.deviation, place.vision_time) == ("all of it", 0.004, 0.0005, 0.2)
    assert place.around == "via"
    assert (arm.arm.name, arm.open_time, arm.grasp_time, arm.arm.tool[2, 3]) == ("puma560", 0.25, 0.5, 0.12)
    assert set(place.devices or ()) == {"PRESS", "LAMP"}
    assert list(place.joint_targets) == ["HOME"]
    assert place.joint_targets["HOME"].arm == "ARM_2"
    np.testing.assert_array_equal(place.joint_targets["HOME"].q, (0, 0.6, 0.6, 0, 0.6, 0))
    assert place.contact.height == -0.1
    assert place.camera[2, 3] == 2
    np.testing.assert_allclose(place.tree().world("ARM_2"), forward(arm.arm, arm.start))
    np.testing.assert_array_equal(place.tree().world("TABLE"), np.eye(4))


def test_the_tool_is_what_reaches_the_hand_pose(tmp_path: Path) -> None:
    """With a gripper 0.1 m long, the flange stays 0.1 m behind the pose of the hand."""
    low = ARM.replace("0.25]", "0.15]")
    bare, held = cell(tmp_path, low), cell(tmp_path, low + "tool = [1,0,0, 0,1,0, 0,0,1, 0,0,0.1]\n")

    np.testing.assert_allclose(held.tree().world("ARM_1"), bare.tree().world("ARM_1"), atol=ROUNDING)
    flange = forward(bare.arms["ARM_1"].arm, held.arms["ARM_1"].start)
    assert flange[2, 3] == pytest.approx(0.25)


def test_frames_that_hang_on_others(tmp_path: Path) -> None:
    """A frame is placed as seen from what it hangs on, be that listed before or after it, a hand or STATION."""
    text = f"""{ARM}
[frames]
bolt = {{ on = "plate", at = [1,0,0, 0,1,0, 0,0,1, 0.1,0,0] }}
plate = {{ on = "Station", at = [0,1,0, -1,0,0, 0,0,1, 0,0,0.2] }}
station = [1,0,0, 0,1,0, 0,0,1, 1,2,0]
nut = {{ on = "ARM-1", at = {IDENTITY} }}
loose = {{ at = {IDENTITY} }}
"""
    tree = cell(tmp_path, text).tree()

    # PLATE is turned a quarter to the left, so 0.1 m along its x axis is 0.1 m along y of the world.
    np.testing.assert_allclose(tree.world("BOLT")[:3, 3], (1, 2.1, 0.2), atol=ROUNDING)
    np.testing.assert_allclose(tree.world("NUT"), tree.world("ARM_1"), atol=ROUNDING)
    parents = {name: tree.parent(name) for name in ("BOLT", "PLATE", "STATION", "NUT", "LOOSE")}
    assert parents == {"BOLT": "PLATE", "PLATE": "STATION", "STATION": WORLD, "NUT": "ARM_1", "LOOSE": WORLD}


@pytest.mark.parametrize(
    ("written", "name"), [("ARM_01", "ARM_1"), ("arm-007", "ARM_7"), ("ARM_10", "ARM_10"), ("ARM_00", "ARM_0")]
)
def test_leading_zeros_make_no_other_arm(written: str, name: str, tmp_path: Path) -> None:
    """An arm of a cell has the name that a program finds it by, and so has what a frame hangs on."""
    tail = f"[frames]\nnut = {{ on = '{written}', at = {IDENTITY} }}\n"
    place = cell(tmp_path, ARM.replace("ARM_1", written) + tail)
    program = Source(
        "t.rlo", f"VAR nut : FRAME ; BEGIN OPEN {written} ; GRASP {name} ; UNFIX nut FROM {written} ; END."
    )

    assert (set(place.arms), place.tree().parent("NUT")) == ({name}, name)
    assert compile_program(program, known_cell(place)).diagnostics == ()


def test_typed_rotations_are_made_exact(tmp_path: Path) -> None:
    """A rotation typed with two digits, here of the PUMA project's pose C, is read as the nearest true one."""
    text = f"{ARM}[frames]\nC = [0.41,0.69,-0.60, -0.29,0.71,0.64, 0.87,-0.09,0.49, 0.60,0.15,-0.30]\n"
    X = cell(tmp_path, text).tree().world("C")

    np.testing.assert_allclose(X[:3, :3].T @ X[:3, :3], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(X[:3, 2], (0.87, -0.09, 0.49), atol=0.005)
    np.testing.assert_array_equal(X[:3, 3], (0.60, 0.15, -0.30))


def test_every_rotation_of_two_digits_is_read(tmp_path: Path, rng: np.random.Generator) -> None:
    """Rounding a rotation to two digits never makes it one that is refused."""
    turns = np.linalg.qr(rng.normal(size=(200, 3, 3)))[0]
    turns *= np.linalg.det(turns)[:, None, None]
    rows = [f"F{i} = {[*np.round(R.T, 2).ravel().tolist(), 0, 0, 0]}" for i, R in enumerate(turns)]

    tree = cell(tmp_path, ARM + "[frames]\n" + "\n".join(rows)).tree()

    for i, R in enumerate(turns):
        np.testing.assert_allclose(tree.world(f"F{i}")[:3, :3], R, atol=0.01)


def test_arm_file_beside_the_cell(tmp_path: Path) -> None:
    """The file of an arm is looked for from the folder of the cell, not from where the command was started."""
    (tmp_path / "arms").mkdir()
    copy = (Path(__file__).parents[2] / "src/armwright/arm/catalogue/stanford.toml").read_text()
    (tmp_path / "arms" / "mine.toml").write_text(copy)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    before = Path.cwd()
    os.chdir(elsewhere)
    try:
        place = cell(tmp_path, '[arms.ARM_1]\nmodel = "arms/mine.toml"\njoint_positions = [0,0,0.3,0,0,0]\n')
    finally:
        os.chdir(before)

    assert place.arms["ARM_1"].arm.name == "mine"


FAULTS = {
    "no arms": ("", None, "arms: missing, expected a table"),
    "no arm among the arms": ("[arms]\n", 1, "arms: expected at least one arm, such as [arms.ARM_1]"),
    "an arm by another name": ("[arms.ROBOT]\n", 1, "arms, ROBOT: expected the name of an arm, such as ARM_1"),
    "arms that differ in spelling": (
        ARM + "[arms.arm-1]\njoint_positions = [0,0,0.3,0,0,0]\n",
        4,
        "arms, arm-1: ARM_1 occurs twice",
    ),
    "arms that differ in leading zeros": (
        ARM + "[arms.ARM_01]\njoint_positions = [0,0,0.3,0,0,0]\n",
        4,
        "arms, ARM_01: ARM_1 occurs twice; case, - and _, and leading zeros are ignored",
    ),
    "unknown model": (
        '[arms.ARM_1]\nmodel = "pumma560"\n',
        2,
        "arms, ARM_1, model: no arm 'pumma560'. Did you mean 'puma560'? All ",
    ),
    "missing arm file": ('[arms.ARM_1]\nmodel = "no/arm.toml"\n', 2, r"no/arm.toml: no such file"),
    "model without an inverse": (
        '[arms.ARM_1]\nmodel = "ntu-3r"\n',
        2,
        "arms, ARM_1, model: 'ntu-3r' has 3 joints; an arm in a cell needs four or more",
    ),
    "no start": ("[arms.ARM_1]\n", 1, "arms, ARM_1, hand: missing; specify the initial pose of the gripper, or the jo"),
    "two starts": (
        ARM + "joint_positions = [0,0,0.3,0,0,0]\n",
        3,
        "hand: the start is specified twice, as hand and as joint_positions",
    ),
    "start out of reach": (
        '[arms.ARM_1]\nmodel = "puma560"\nhand = [1,0,0, 0,1,0, 0,0,1, 3,0,0]\n',
        3,
        # The PUMA reaches hypot(432 + hypot(20, 433), 149) mm from its shoulder, here at the origin.
        f"hand: the pose is {3000 - np.hypot(432 + np.hypot(20, 433), 149):.1f} mm out of reach of 'puma560'; the near",
    ),
    "start outside the limits": (
        "[arms.ARM_1]\nhand = [1,0,0, 0,-1,0, 0,0,-1, 5,0,0]\n",
        2,
        "arms, ARM_1, hand: no configuration of 'stanford' is inside the joint limits; in the closest, joint 3 would",
    ),
    "configuration outside the limits": (
        "[arms.ARM_1]\njoint_positions = [0, 0, 1.2, 0, 0, 0]\n",
        2,
        "arms, ARM_1, joint_positions: joint 3 would be at 1200.0 mm, 82.4 mm beyond its limit 1117.6 mm",
    ),
    "configuration too short": (
        "[arms.ARM_1]\njoint_positions = [0, 0]\n",
        2,
        "arms, ARM_1, joint_positions: expected 6 numbers, got 2",
    ),
    "configuration in degrees": (
        '[arms.ARM_1]\nmodel = "ur5"\njoint_positions = [10, -90, 90, -90, -90, 0]\n',
        3,
        "arms, ARM_1, joint_positions: joint 1",
    ),
    "joint target beyond a limit": (
        ARM + "[joint_targets.HOME]\njoint_positions = [0, 0, 1.2, 0, 0, 0]\n",
        5,
        "joint_targets, HOME, joint_positions: joint 3 would be at 1200.0 mm, 82.4 mm beyond its limit 1117.6 mm",
    ),
    "joint target of no arm": (
        ARM + "[joint_targets.HOME]\narm = 'ARM_3'\njoint_positions = [0, 0, 0.3, 0, 0, 0]\n",
        5,
        "joint_targets, HOME, arm: ARM_3 is not an arm of the cell; did you mean ARM_1?",
    ),
    "joint target with the name of a frame": (
        ARM + "[frames]\nA = [1,0,0, 0,1,0, 0,0,1, 0,0,0]\n[joint_targets.a]\njoint_positions = [0, 0, 0.3, 0, 0, 0]\n",
        6,
        "joint_targets, a: A is a frame of the cell already",
    ),
    "key without its unit": (
        ARM + "[motion]\ncorner = 3\n",
        5,
        "motion, corner: unknown key; did you mean 'corner_mm'?",
    ),
    "misspelt key": (ARM + "grasp_sec = 1\n", 4, "arms, ARM_1, grasp_sec: unknown key; did you mean 'grasp_s'?"),
    "minutes to grasp": (ARM + "grasp_s = 900\n", 4, "arms, ARM_1, grasp_s: expected 0 to 600, got 900"),
    "pose too short": (ARM + "[frames]\nA = [1,0,0]\n", 5, "frames, A: expected 12 numbers, got 3"),
    "a word in a pose": (
        ARM + "[frames]\nA = [1,0,0, 0,1,0,\n 0,0,'1', 0,0,0]\n",
        6,
        "frames, A 9: expected a number, got the text '1'",
    ),
    "no rotation": (
        ARM + "[frames]\nA = [1,0,0, 0,1,0, 0,0,2, 0,0,0]\n",
        5,
        "frames, A: the first nine numbers are not a rotation (error 3)",
    ),
    "a mirror image": (
        ARM + "[frames]\nA = [1,0,0, 0,1,0, 0,0,-1, 0,0,0]\n",
        5,
        "frames, A: the first nine numbers are not a rotation (error 2)",
    ),
    "a pose by rows": (
        ARM + "[frames]\nA = [1,0,0,0.4, 0,1,0,0.1, 0,0,1,0.2]\n",
        5,
        "; they look like rows: write the columns n, o, a, p",
    ),
    "twins": (
        ARM + f"[frames]\nBox = {IDENTITY}\nBOX = {IDENTITY}\n",
        6,
        "frames, BOX: BOX occurs twice; case does not distinguish names",
    ),
    "frame on an unknown frame": (
        ARM + f"[frames]\nTABLE = {IDENTITY}\n[frames.CUP]\nat = {IDENTITY}\non = 'TABEL'\n",
        8,
        "frames, CUP, on: CUP is attached to TABEL, which is not a frame of the cell; did you mean TABLE?",
    ),
    "frame on an arm that does not exist": (
        ARM + f"[frames.CUP]\non = 'ARM_2'\nat = {IDENTITY}\n",
        5,
        "frames, CUP, on: CUP is attached to ARM_2, which is not a frame of the cell; did you mean ARM_1?",
    ),
    "frame on itself": (
        ARM + f"[frames.CUP]\non = 'cup'\nat = {IDENTITY}\n",
        5,
        "frames, CUP, on: CUP is attached to itself",
    ),
    "a ring": (
        ARM + "[frames]\n" + "".join(f"{a} = {{ on = '{b}', at = {IDENTITY} }}\n" for a, b in ("XA", "AC", "CB", "BA")),
        6,
        "frames, A, on: A is attached to itself by way of C, B",
    ),
    "WORLD as a frame": (ARM + f"[frames]\nworld = {IDENTITY}\n", 5, "frames, world: 'world' cannot name a frame"),
    "an arm as a frame": (ARM + f"[frames]\nARM_1 = {IDENTITY}\n", 5, "frames, ARM_1: 'ARM_1' cannot name a frame"),
    "a name no program can write": (ARM + f"[frames]\n'my box' = {IDENTITY}\n", 5, "'my box' cannot name a frame"),
    "a letter no program can write": (ARM + f"[frames]\n'ma\u00df' = {IDENTITY}\n", 5, "'ma\u00df' cannot name a"),
    "an empty name": (ARM + f"[frames]\n'' = {IDENTITY}\n", 5, "frames, '': '' cannot name a frame or device"),
    "a parent that is no name": (ARM + f"[frames.A]\non = 'x y'\nat = {IDENTITY}\n", 5, "frames, A, on: 'x y' cannot"),
    "a frame without a place": (ARM + "[frames.A]\non = 'WORLD'\n", 4, "frames, A, at: missing, expected a list of 12"),
    "a misspelt key of a frame": (
        ARM + f"[frames.A]\nat = {IDENTITY}\nparent = 'WORLD'\n",
        6,
        "frames, A, parent: unknown key; known keys: at, moves, on",
    ),
    "a vision that is not a list of poses": (
        ARM + f"[visions]\nA = {IDENTITY}\n",
        5,
        "visions, A 1: expected a list of 12 numbers, got 1",
    ),
    "a second answer that is no rotation": (
        ARM + f"[visions]\nA = [{IDENTITY},\n [2,0,0, 0,1,0, 0,0,1, 0,0,0]]\n",
        6,
        "visions, A 2: the first nine numbers are not a rotation (error 3)",
    ),
    "devices as a list": (
        ARM.replace("[arms", "devices = ['PRESS']\n[arms"),
        1,
        "devices: expected a table, got a list",
    ),
    "a device with a setting": (
        ARM + "[devices]\nPRESS = { v = 1 }\n",
        5,
        "devices, PRESS, v: unknown key; known keys: analogue, output, signal",
    ),
    "servo out of range": (ARM + "[motion]\nservo_ms = 0.05\n", 5, "motion, servo_ms: expected 0.1 to 100, got 0.05"),
    "no way round": (
        ARM + '[motion]\naround = "dampd"\n',
        5,
        "motion, around: expected one of damped, none, via, got the text 'dampd'; did you mean 'damped'?",
    ),
    "no corner": (ARM + "[motion]\ncorner_mm = 0\n", 5, "motion, corner_mm: expected 0.01 to 1000, got 0"),
    "no deviation": (ARM + "[motion]\ndeviation_mm = 0\n", 5, "motion, deviation_mm: expected 0.001 to 1000, got 0"),
    "a misspelt table": (ARM + "[motions]\nservo_ms = 1\n", 4, "motions: unknown key; did you mean 'motion'?"),
    "a misspelt table below": (ARM + "[device]\nPRESS = {}\n", 4, "device: unknown key; did you mean 'devices'?"),
    "camera without a list": (ARM + "[camera]\npose = 1\n", 5, "camera, pose: expected a list of 12 numbers, got 1"),
    "camera that needs hours": (ARM + "[camera]\ntime_s = 3600\n", 5, "camera, time_s: expected 0 to 600, got 3600"),
    "camera that goes on with something": (
        ARM + "[camera]\nafter_last = 'first'\n",
        5,
        "camera, after_last: expected one of nothing, same, got the text 'first'",
    ),
    "contact that gives way too far": (
        ARM + "[contact]\nz = 0\ndeepest_mm = 0\n",
        6,
        "contact, deepest_mm: expected 0.001 to 1000, got 0",
    ),
    "two arms on one base": (
        ARM + ARM.replace("ARM_1", "ARM_2").replace("0,0,0]", "0,0,0.009]", 1),
        5,
        "arms, ARM_2, base: ARM_2 and ARM_1 have bases 9 mm apart; two arms need 10 mm or more",
    ),
    "contact that is no height": (
        ARM + "[contact]\nz = 'low'\n",
        5,
        "contact, z: expected a number, got the text 'low'",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_mistakes(fault: str, tmp_path: Path) -> None:
    """Every mistake in a cell file is told with file, line and key."""
    text, line, message = FAULTS[fault]
    place = f"{tmp_path / 'cell.toml'}:{line}: " if line else f"{tmp_path / 'cell.toml'}: "

    with pytest.raises(FileFormatError, match=re.escape(message)) as caught:
        cell(tmp_path, text)

    assert str(caught.value).startswith(place)
    assert "\n" not in str(caught.value)


def test_mistake_in_json(tmp_path: Path) -> None:
    """In JSON, too, the line of the pose that is wrong is told, and a name given twice is seen."""
    good = json.loads((CORPUS / "cell1.json").read_text())
    good["frames"]["stop"][0] = 7
    lines = json.dumps(good, indent=1).split("\n")
    with pytest.raises(FileFormatError, match="frames, stop: the first nine numbers are not a rotation") as caught:
        cell(tmp_path, "\n".join(lines), "cell.json")
    assert lines[caught.value.line - 1].strip() == '"stop": ['

    with pytest.raises(FileFormatError, match=r"cell.json:2: arms, ARM_1: this key occurs twice"):
        cell(tmp_path, '{"arms": {"ARM_1": {},\n "ARM_1": {}}}', "cell.json")


def test_mistake_in_the_file_of_an_arm(tmp_path: Path) -> None:
    """A mistake in an arm file is told with its line there and the line of the cell that asked for it."""
    (tmp_path / "arm.toml").write_text('[[joint]]\nkind = "rotary"\n')

    with pytest.raises(FileFormatError, match=r"cell.toml:2: arms, ARM_1, model: .*arm.toml:2: joint 1, kind: expect"):
        cell(tmp_path, '[arms.ARM_1]\nmodel = "arm.toml"\n')


def test_a_long_chain(tmp_path: Path) -> None:
    """A thousand frames, each on the one before, are read; one more than the limit is refused with its line."""
    rows = (f"F{at} = {{ on = '{f'F{at - 1}' if at else 'WORLD'}', at = {IDENTITY} }}\n" for at in range(1000))
    text = f"{ARM}[frames]\n{''.join(rows)}"

    assert len(cell(tmp_path, text).frames) == 1000
    with pytest.raises(FileFormatError, match=r"F1000 is too deep in the frame tree: the limit is 1,000 frames"):
        cell(tmp_path, f"{text}F1000 = {{ on = 'F999', at = {IDENTITY} }}\n")


# Slips that leave most of a file as it was, so that all of the reader is reached.
SLIPS = ("", "0", "-", '"', "[", "]", "x", "nan", "1e99", "-1e300", "true", "{}", "'WORLD'", " = ", "\n", "5")
WHOLE = (EXAMPLES / "puma_cell.toml").read_text(encoding="utf-8")


@given(at=st.floats(0, 1, exclude_max=True), gone=st.integers(0, 8), slip=st.sampled_from(SLIPS))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_slip(at: float, gone: int, slip: str, tmp_path: Path) -> None:
    """Whatever is mistyped in a cell file, it is a cell or refused as a file: nothing else goes wrong."""
    place = int(at * len(WHOLE))
    said = f"{tmp_path / 'cell.toml'}:"
    try:
        assert set(cell(tmp_path, WHOLE[:place] + slip + WHOLE[place + gone :]).arms)
    except FileFormatError as error:
        said = str(error)

    assert said.startswith(f"{tmp_path / 'cell.toml'}:")
    assert "\n" not in said
