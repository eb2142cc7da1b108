"""Arm files: what their keys mean, and what every mistake in them is answered with."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from scipy.spatial.transform import Rotation

from armwright.arm import load
from armwright.arm.limits import Limits
from armwright.arm.load import arm_names, load_arm, read_arm
from armwright.arm.model import STANDARD_GRAVITY, Arm, Link, Motor
from armwright.errors import FileFormatError, UnknownNameError
from armwright.spatial.rotations import exact_cosine, exact_sine

ROUNDING = 1e-15  # a unit more or less in the last digit, where a unit is converted

TURN = '[[joint]]\nkind = "revolute"\n'
SLIDE = '[[joint]]\nkind = "prismatic"\n'


@pytest.fixture
def read(tmp_path: Path) -> Callable[[str], Arm]:
    """Write a text into a file and read it as an arm."""

    def write(text: str) -> Arm:
        (tmp_path / "arm.toml").write_text(text, encoding="utf-8")
        return read_arm(tmp_path / "arm.toml")

    return write


def test_what_is_left_out(read: Callable[[str], Arm]) -> None:
    """A joint without numbers has no length, no limits and no weight, and the arm stands upright."""
    arm = read(TURN)

    assert (arm.name, arm.title, arm.source, arm.n) == ("arm", "", "", 1)
    joint = arm.joints[0]
    assert (joint.theta, joint.d, joint.a, joint.alpha, joint.limits) == (0, 0, 0, 0, Limits())
    assert arm.links == (Link(),)
    assert arm.motors == (Motor(),)
    np.testing.assert_array_equal(arm.base, np.eye(4))
    np.testing.assert_array_equal(arm.tool, np.eye(4))
    np.testing.assert_array_equal(arm.gravity, (0, 0, -STANDARD_GRAVITY))
    assert (arm.reach, arm.tool_speed) == (math.inf, math.inf)


UNITS = (
    (
        TURN
        + "theta_deg = 30\nd_mm = 250\na_cm = -4\nalpha_deg = -90\n[joint.limits]\nlower_deg = -180\nupper_deg = 90\n"
        "speed_deg_per_s = 120\nacceleration_deg_per_s2 = 60\neffort_Nm = 5\n[joint.link]\ncom_mm = [1, 2, 3]\n",
        TURN + f"theta_rad = {math.pi / 6}\nd_m = 0.25\na_m = -0.04\nalpha_rad = {-math.pi / 2}\n[joint.limits]\n"
        f"lower_rad = {-math.pi}\nupper_rad = {math.pi / 2}\nspeed_rad_per_s = {2 * math.pi / 3}\n"
        f"acceleration_rad_per_s2 = {math.pi / 3}\neffort_Nm = 5\n[joint.link]\ncom_m = [0.001, 0.002, 0.003]\n",
    ),
    (
        "[tool]\nxyz_cm = [1, 2, 3]\nrpy_deg = [10, 20, 30]\n[hand]\nreach_mm = 900\nspeed_mm_per_s = 500\n"
        + SLIDE
        + "[joint.limits]\nlower_mm = 140\nupper_cm = 111.76\nspeed_mm_per_s = 750\nacceleration_cm_per_s2 = 300\n",
        f"[tool]\nxyz_m = [0.01, 0.02, 0.03]\nrpy_rad = {np.radians([10, 20, 30]).tolist()}\n"
        "[hand]\nreach_m = 0.9\nspeed_m_per_s = 0.5\n"
        + SLIDE
        + "[joint.limits]\nlower_m = 0.14\nupper_m = 1.1176\nspeed_m_per_s = 0.75\nacceleration_m_per_s2 = 3\n",
    ),
)


@pytest.mark.parametrize("pair", UNITS, ids=("a turn", "a slide"))
def test_units(pair: tuple[str, str], read: Callable[[str], Arm]) -> None:
    """Degrees, millimetres and centimetres are other names for radians and metres."""
    one, other = map(read, pair)

    for name in ("lower", "upper", "speed", "acceleration", "effort"):
        np.testing.assert_allclose(getattr(one.limits, name), getattr(other.limits, name), rtol=ROUNDING)
    for a, b in zip(one.joints, other.joints, strict=True):
        np.testing.assert_allclose((a.theta, a.d, a.a, a.alpha), (b.theta, b.d, b.a, b.alpha), rtol=ROUNDING)
    np.testing.assert_allclose(one.links[0].com, other.links[0].com, rtol=ROUNDING)
    np.testing.assert_allclose(one.tool, other.tool, atol=ROUNDING)
    np.testing.assert_allclose((one.reach, one.tool_speed), (other.reach, other.tool_speed), rtol=ROUNDING)


def test_right_angles_are_exact(read: Callable[[str], Arm]) -> None:
    """A twist or a turn of the base by right angles leaves zeros and ones, no rounding."""
    arm = read("[base]\nrpy_deg = [90, -90, 180]\n" + TURN + "alpha_deg = -90\ntheta_deg = 270\n")

    assert set(arm.base.ravel()) <= {-1.0, 0.0, 1.0}
    joint = arm.joints[0]
    for angle in (joint.alpha, joint.theta):
        assert (exact_cosine(angle), exact_sine(angle)) == (0, -1)


def test_turn_of_a_pose(read: Callable[[str], Arm], rng: np.random.Generator) -> None:
    """Roll, pitch and yaw are about the fixed axes x, y and z in that order, as in SciPy."""
    for angles in rng.uniform(-180, 180, size=(5, 3)):
        arm = read(f"[base]\nrpy_deg = {angles.tolist()}\nxyz_m = [1, 2, 3]\n" + TURN)

        expected = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
        np.testing.assert_allclose(arm.base[:3, :3], expected, atol=10 * ROUNDING)
        np.testing.assert_array_equal(arm.base[:3, 3], (1, 2, 3))


def test_rows_of_a_pose(read: Callable[[str], Arm]) -> None:
    """A rotation given as rows stands as it is; one typed with two digits is made exact."""
    arm = read("[tool]\nrotation = [[0, 0, 1], [1, 0, 0], [0, 1, 0]]\n" + TURN)
    typed = read("[tool]\nrotation = [[0.71, -0.71, 0], [0.71, 0.71, 0], [0, 0, 1]]\n" + TURN)

    np.testing.assert_allclose(arm.tool[:3, :3], [[0, 0, 1], [1, 0, 0], [0, 1, 0]], atol=ROUNDING)
    np.testing.assert_allclose(typed.tool[:3, :3], Rotation.from_euler("z", 45, degrees=True).as_matrix(), atol=1e-12)


def test_tensor(read: Callable[[str], Arm]) -> None:
    """A rod of 3 kg and 2 m whose frame is at its end has 4 kg m² about that end and 1 kg m² about its middle."""
    rod = TURN + "[joint.link]\nmass_kg = 3\ncom_m = [1, 0, 0]\n"

    about_end = read(rod + 'inertia_kgm2 = [0, 4, 4]\ninertia_about = "frame"\n').links[0]
    about_middle = read(rod + "inertia_kgm2 = [0, 1, 1]\n").links[0]

    np.testing.assert_allclose(about_end.inertia, np.diag([0, 1, 1]), atol=ROUNDING)
    np.testing.assert_array_equal(about_middle.inertia, np.diag([0, 1, 1]))


def test_order_of_the_six(read: Callable[[str], Arm]) -> None:
    """The six numbers of a tensor are xx, yy, zz, xy, xz, yz."""
    link = read(TURN + "[joint.link]\ninertia_kgm2 = [5, 6, 7, 0.1, 0.2, 0.3]\n").links[0]

    np.testing.assert_array_equal(link.inertia, [[5, 0.1, 0.2], [0.1, 6, 0.3], [0.2, 0.3, 7]])


def test_motor(read: Callable[[str], Arm]) -> None:
    """A rotor counts the square of its gear ratio at the joint, be that a turn or a slide."""
    arm = read(
        f"{TURN}[joint.motor]\nrotor_inertia_kgm2 = 2e-4\ngear_ratio = 100\nviscous_Nms = 0.5\n"
        f"coulomb_forward_Nm = 6\ncoulomb_backward_Nm = 5\n"
        f"{SLIDE}[joint.motor]\nrotor_inertia_kgm2 = 2e-4\ngear_ratio = 50\nviscous_Ns_per_m = 2\n"
        f"coulomb_forward_N = 3\ncoulomb_backward_N = 4\n"
        f"{SLIDE}[joint.motor]\ninertia_kg = 0.782\n"
    )

    turn, slide, plain = arm.motors
    assert turn.inertia == pytest.approx(2.0)  # kg m²
    assert slide.inertia == pytest.approx(0.5)  # kg
    assert (turn.gear_ratio, turn.viscous, turn.coulomb_forward, turn.coulomb_backward) == (100, 0.5, 6, 5)
    assert (slide.gear_ratio, slide.viscous, slide.coulomb_forward, slide.coulomb_backward) == (50, 2, 3, 4)
    assert plain == Motor(inertia=0.782)


def test_on_the_ceiling(read: Callable[[str], Arm]) -> None:
    """An arm that hangs from the ceiling says so with its gravity."""
    np.testing.assert_array_equal(read("[gravity]\nm_per_s2 = [0, 0, 9.81]\n" + TURN).gravity, (0, 0, 9.81))


def test_json(tmp_path: Path) -> None:
    """An arm may be written by a program, as JSON with the same keys."""
    (tmp_path / "arm.json").write_text('{"title": "one", "joint": [{"kind": "revolute", "d_mm": 250}]}')
    arm = load_arm(tmp_path / "arm.json")

    assert (arm.name, arm.title, arm.joints[0].d) == ("arm", "one", 0.25)


NO_BODY = (
    " kg m² about its centre of mass: none may be negative, or exceed the sum of the other two; "
    "check inertia_about and com"
)
MISTAKES = {
    "no joint": ("title = 'x'\n", " joint: missing, expected one or more tables [[joint]]"),
    "no kind": ("\n[[joint]]\nd_m = 1\n", "2: joint 1, kind: missing, expected one of prismatic, revolute"),
    "a kind that is none": (
        '[[joint]]\nkind = "rotational"\n',
        "2: joint 1, kind: expected one of prismatic, revolute, got the text 'rotational'",
    ),
    "a convention that is none": (
        "convention = 'modifed'\n" + TURN,
        "1: convention: expected one of modified, standard, urdf, got the text 'modifed'; did you mean 'modified'?",
    ),
    "a joint without an axis": (
        "convention = 'urdf'\n" + TURN,
        "2: joint 1, axis: missing, expected a list of 3 numbers",
    ),
    "an axis of no length": (
        "convention = 'urdf'\n" + TURN + "axis = [0, 0, 0]\n",
        "4: joint 1, axis: expected a direction, got a vector of length 0",
    ),
    "a row among frames": (
        "convention = 'urdf'\n" + TURN + "axis = [0, 0, 1]\na_m = 1\n",
        "5: joint 1, a_m: unknown key; known keys: ",
    ),
    "a document without a title": (
        "[[document]]\npath = 'x'\n" + TURN,
        "1: document 1, title: missing, expected a text in quotes",
    ),
    "a document that gives what is none": (
        "[[document]]\ntitle = 'x'\ngives = ['geometry', 'sped']\n" + TURN,
        (
            "3: document 1, gives 2: expected some of geometry, positions, speeds, accelerations, efforts, masses, "
            "inertias, drives, coupling, solids, hand, got 'sped'; did you mean 'speeds'?"
        ),
    ),
    "a misspelt key": (TURN + "alhpa_deg = 90\n", "3: joint 1, alhpa_deg: unknown key; did you mean 'alpha_deg'?"),
    "a key of the second joint": (
        TURN + "\n" + TURN + "[joint.link]\nmass = 1\n",
        "7: joint 2, link, mass: unknown key; did you mean 'mass_kg'?",
    ),
    "an angle without its unit": (
        TURN + "alpha = 90\n",
        "3: joint 1, alpha: the key must contain the unit: alpha_deg or alpha_rad",
    ),
    "a length in an angle's place": (
        TURN + "[joint.limits]\nlower_m = 0.1\n",
        "4: joint 1, limits, lower_m: unknown key; known keys: ",
    ),
    "an angle in a length's place": (
        SLIDE + "[joint.limits]\nupper_deg = 90\n",
        "4: joint 1, limits, upper_deg: unknown key; known keys: ",
    ),
    "a torque of a slide": (
        SLIDE + "[joint.limits]\neffort_Nm = 90\n",
        "4: joint 1, limits, effort_Nm: unknown key; did you mean 'effort_N'?",
    ),
    "a length twice": (TURN + "d_m = 1\nd_mm = 1000\n", "4: joint 1, d_mm: d is specified twice, in m and in mm"),
    "limits the wrong way round": (
        TURN + "[joint.limits]\nlower_deg = 90\nupper_deg = -90\n",
        "3: joint 1, limits: the lower limit must be below the upper, got 90° and -90°",
    ),
    "limits of a slide the wrong way round": (
        SLIDE + "[joint.limits]\nlower_m = 1\nupper_mm = 140\n",
        "3: joint 1, limits: the lower limit must be below the upper, got 1000 mm and 140 mm",
    ),
    "no speed at all": (
        TURN + "[joint.limits]\nspeed_deg_per_s = 0\n",
        "4: joint 1, limits, speed_deg_per_s: expected a number above 0, got 0",
    ),
    "a number that is none": (TURN + "d_m = nan\n", "3: joint 1, d_m: expected a finite number, got nan"),
    "negative mass": (
        TURN + "[joint.link]\nmass_kg = -1\n",
        "4: joint 1, link, mass_kg: expected 0 or more, got -1",
    ),
    "a flat place": (
        TURN + "[joint.link]\ncom_m = [0, 1]\n",
        "4: joint 1, link, com_m: expected 3 numbers, got 2",
    ),
    "four moments": (
        TURN + "[joint.link]\ninertia_kgm2 = [1, 1, 1, 0]\n",
        "4: joint 1, link, inertia_kgm2: expected 3 or 6 numbers, got 4",
    ),
    "one moment above the two others": (
        TURN + "[joint.link]\ninertia_kgm2 = [1, 1, 3]\n",
        "4: joint 1, link, inertia_kgm2: a body cannot have the principal moments 1, 1, 3" + NO_BODY,
    ),
    "a moment below none": (
        TURN + "[joint.link]\ninertia_kgm2 = [1, 1, 1, 2, 0, 0]\n",
        "4: joint 1, link, inertia_kgm2: a body cannot have the principal moments -1, 1, 3" + NO_BODY,
    ),
    "less inertia about the frame than its distance makes": (
        TURN + "[joint.link]\nmass_kg = 3\ncom_m = [1, 0, 0]\ninertia_kgm2 = [0, 1, 1]\ninertia_about = 'frame'\n",
        "6: joint 1, link, inertia_kgm2: a body cannot have the principal moments -2, -2, 0" + NO_BODY,
    ),
    "inertia about something else": (
        TURN + "[joint.link]\ninertia_about = 'con'\n",
        "4: joint 1, link, inertia_about: expected one of com, frame, got the text 'con'; did you mean 'com'?",
    ),
    "two motor inertias": (
        TURN + "[joint.motor]\ninertia_kgm2 = 1\nrotor_inertia_kgm2 = 1\n",
        "5: joint 1, motor, rotor_inertia_kgm2: specify the inertia at the load side or that of the rotor, not both",
    ),
    "a gear that turns the other way": (
        TURN + "[joint.motor]\ngear_ratio = -62\n",
        "4: joint 1, motor, gear_ratio: expected a number above 0, got -62",
    ),
    "a turn twice": (
        "[tool]\nrpy_deg = [0, 0, 90]\nrotation = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n" + TURN,
        "3: tool, rotation: the rotation is specified twice, as rpy and as rotation",
    ),
    "a turn three ways": (
        "[tool]\nquaternion_wxyz = [1, 0, 0, 0]\nzyz_deg = [0, 0, 90]\nrpy_rad = [0, 0, 1]\n" + TURN,
        "3: tool, zyz_deg: the rotation is specified twice, as rpy and as zyz",
    ),
    "a long quaternion": (
        "[tool]\nquaternion_wxyz = [1, 1, 0, 0]\n" + TURN,
        "2: tool, quaternion_wxyz: expected a quaternion of length 1, got one of length 1.41",
    ),
    "two rows": (
        "[base]\nrotation = [[1, 0, 0], [0, 1, 0]]\n" + TURN,
        "2: base, rotation: expected 3 rows of 3 numbers, got 2",
    ),
    "a mirror": (
        "[base]\nrotation = [[1, 0, 0], [0, 1, 0], [0, 0, -1]]\n" + TURN,
        "2: base, rotation: expected the rows of a rotation matrix, got an orthonormality error of 2",
    ),
    "a covariance of other errors": (
        TURN + "[uncertainty]\nerrors = ['joint1.a', 'tool.x']\ncovariance = [[1, 0]]\n",
        "3: uncertainty: uncertainty: expected (2, 2) for 2 errors, got (1, 2)",
    ),
    "a variance below none": (
        TURN + "[uncertainty]\nerrors = ['joint1.a', 'tool.x']\ncovariance = [[1, 2], [2, 1]]\n",
        "3: uncertainty: uncertainty: expected a covariance matrix, symmetric and with variances of 0 or more",
    ),
    "an error twice": (
        TURN + "[uncertainty]\nerrors = ['tool.x', 'tool.x']\ncovariance = [[1, 0], [0, 1]]\n",
        "3: uncertainty: uncertainty: expected different names of errors, got one twice",
    ),
    "errors that are no texts": (
        TURN + "[uncertainty]\nerrors = [1, 2]\ncovariance = [[1, 0], [0, 1]]\n",
        "4: uncertainty, errors: expected a list of texts in quotes, got a list of 2",
    ),
    "no covariance": (
        TURN + "[uncertainty]\nerrors = ['tool.x']\n",
        "3: uncertainty, covariance: missing, expected a list of lists of 1 numbers",
    ),
    "an unknown table": ("[tol]\nxyz_m = [0, 0, 1]\n" + TURN, "1: tol: unknown key; did you mean 'tool'?"),
    "one joint as a table": (
        '[joint]\nkind = "revolute"\n',
        "1: joint: expected one or more tables [[joint]], got a table",
    ),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_mistakes(case: str, read: Callable[[str], Arm]) -> None:
    """A mistake in an arm file is told with line, joint and key, with what was expected and what was got."""
    text, said = MISTAKES[case]

    with pytest.raises(FileFormatError) as caught:
        read(text)

    place, _, told = str(caught.value).partition("arm.toml:")
    assert place.endswith("/")
    assert told.startswith(said) if said.endswith(": ") else told == said


def test_unknown_arm() -> None:
    """A misspelt arm is answered with the nearest name, a maker with its arms, and both with how to list them all."""
    with pytest.raises(UnknownNameError) as caught:
        load_arm("pumma560")

    everything = f"All {len(arm_names())}: armwright arms."
    assert str(caught.value) == f"no arm 'pumma560'. Did you mean 'puma560'? {everything}"
    with pytest.raises(LookupError) as caught_maker:
        load_arm("staubli")
    assert str(caught_maker.value) == f"no arm 'staubli'. Similar: rx160, tx2-60, tx2-90. {everything}"
    with pytest.raises(LookupError) as caught_many:
        load_arm("kuka")
    assert len(str(caught_many.value)) < 200


def test_name_or_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A slash or the ending .toml makes a path of a name, even of one that the catalogue has."""
    (tmp_path / "ur5.toml").write_text(SLIDE)
    (tmp_path / "plain").write_text(SLIDE)
    monkeypatch.chdir(tmp_path)

    assert load_arm("ur5.toml").n == 1
    assert load_arm("./plain").name == "plain"
    assert load_arm(Path("plain")).n == 1
    assert load_arm("ur5").n == 6
    with pytest.raises(FileFormatError, match=r"ur6\.toml: no such file; did you mean 'ur5\.toml'\?$"):
        load_arm("ur6.toml")


def test_names_are_sorted() -> None:
    """The catalogue lists its arms in the order of the alphabet."""
    assert list(arm_names()) == sorted(arm_names())


CATALOGUE = Path(load.__file__).parent / "catalogue"
# Slips that leave most of a file as it was, so that all of the reader is reached.
SLIPS = ("", "0", "-", '"', "[", "]", "x", "nan", "1e300", "true", "joint", "_mm", " = ", "\n", "[[joint]]", "frame")


@given(
    name=st.sampled_from(arm_names()),
    at=st.floats(0, 1, exclude_max=True),
    gone=st.integers(0, 8),
    slip=st.sampled_from(SLIPS),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_slip(name: str, at: float, gone: int, slip: str, tmp_path: Path) -> None:
    """Whatever is mistyped in an arm file, it is an arm or refused as a file: nothing else goes wrong."""
    text = (CATALOGUE / f"{name}.toml").read_text(encoding="utf-8")
    place = int(at * len(text))
    (tmp_path / "arm.toml").write_text(text[:place] + slip + text[place + gone :], encoding="utf-8")

    try:
        arm = read_arm(tmp_path / "arm.toml")
    except FileFormatError as error:
        assert "arm.toml:" in str(error)  # noqa: PT017 - either way is right
    else:
        assert len(arm.links) == len(arm.motors) == arm.n


def test_turns_written_differently(read: Callable[[str], Arm]) -> None:
    """Roll, pitch and yaw, ZYZ angles, rows and a quaternion say the same turn: z to x, by a right angle about y."""
    ways = (
        "rpy_deg = [0, 90, 0]",
        "zyz_deg = [0, 90, 0]",
        "zyz_rad = [0, 1.5707963267948966, 0]",
        "rotation = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]",
        "quaternion_wxyz = [0.71, 0, 0.71, 0]",
    )

    for way in ways:
        tool = read(f"[tool]\n{way}\n" + TURN).tool
        np.testing.assert_allclose(tool[:3, :3], [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], atol=1e-12)
