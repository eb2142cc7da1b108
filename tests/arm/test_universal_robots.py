"""The calibration of one robot of Universal Robots: read as its controller and ROS mean it, and written back."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import attrs
import numpy as np
import pinocchio
import pytest
from scipy.spatial.transform import Rotation

from armwright.arm import Arm, calibrated_arm, calibration_conf, kinematics_yaml, load_arm
from armwright.arrays import Array
from armwright.errors import FileFormatError, InvalidValueError, UnsupportedArmError
from armwright.kinematics import forward
from samples import Sample

FILES = Path(__file__).with_name("universal_robots")
# Numbers d of hundreds of metres that cancel, in double precision [m] and [rad].
EXACT = 1e-9
# Half a hundredth of a degree in each of six joints, at arm's length [m].
DISPLAYED = 1.5e-4

# The tables of models, by the maker's parameters for kinematics: a and d [m].
TABLES = {
    "ur5": ((0, -0.425, -0.39225, 0, 0, 0), (0.089159, 0, 0, 0.10915, 0.09465, 0.0823)),
    "ur5e": ((0, -0.425, -0.3922, 0, 0, 0), (0.1625, 0, 0, 0.1333, 0.0997, 0.0996)),
    "ur10": ((0, -0.612, -0.5723, 0, 0, 0), (0.1273, 0, 0, 0.163941, 0.1157, 0.0922)),
}
# What makes real robots out of a UR10, as the tests of ur_calibration have it (BSD-3-Clause).
FACTORY: Sequence[Mapping[str, Sequence[float]]] = (
    {
        "d": (0.00065609212979853, 1.4442162376284788, 0.854147723854608, -2.2989425877563705, -1.573498686836816e-05,
              1.9072435590711256e-05),
        "a": (4.6311376834935676e-05, -0.00012568315331862312, 0.00186216581161458, 9.918593870679266e-05,
              4.215462720453189e-06, 0),
        "theta": (-7.290070070824746e-05, -0.01713897289704999, -0.03707159413492756, 0.054279462160583214,
                  1.488984257025741e-07, 1.551499479707493e-05),
        "alpha": (0.000211987863869334, -0.0072553625957652995, -0.013483226769541364, 0.0013495820227329425,
                  -0.001263136163679901, 0),
    },
    {
        "d": (-0.000144894975118076141, 303.469135666158195, -309.88394307789747, 6.41459904397394975,
              -4.48232900190081995e-05, -0.00087071402790364627),
        "a": (0.000108651068627930392, 0.240324175250532346, 0.00180628180213493472, 2.63076149165684402e-05,
              3.96638632500012715e-06, 0),
        "theta": (1.59613525316931737e-07, -0.917209621528830232, 7.12936131346499469, 0.0710299029424392298,
                  -1.64258976526054923e-06, 9.17286101034808787e-08),
        "alpha": (-0.000444781952841921679, -0.00160215112531214153, 0.00631917793331091861, -0.00165055247340828437,
                  0.000763682515545038854, 0),
    },
    {
        "d": (-0.000160188285741325043, 439.140974079900957, -446.027059806332147, 6.88618689642360149,
              -3.86588496858186748e-05, -0.00087908274257374186),
        "a": (2.12234865571205891e-05, 0.632017132627700651, 0.00229833638891230319, -4.61409023720933908e-05,
              -6.39280053471801522e-05, 0),
        "theta": (-2.41478068943590252e-07, 1.60233952386694556, -1.68607190752171299, 0.0837331147700118711,
                  -1.01260355871157781e-07, 3.91986209186123702e-08),
        "alpha": (-0.000650246557584166496, 0.00139416666825590402, 0.00693818880325995126, -0.000811641562390219562,
                  0.000411120504570705592, 0),
    },
)  # fmt: skip
# Table and file of one robot, as its owner published both: issue 457 of Universal_Robots_ROS_Driver.
PAIR = {
    "theta": (-9.62699668632896e-06, -1.43707039992005, 2.02543119975016, -0.588254688694989, 4.13647390228702e-05,
              8.1737464953645e-06),
    "a": (0.000279332356195598, -0.0566854832098269, -0.32646702272051, 1.49388687216263e-05, 2.23692592990586e-07, 0),
    "d": (0.0888794492754001, 574.241384579456, -507.363402098168, -66.7676839353205, 0.0949734691141216,
          0.0825625014554953),
    "alpha": (1.57033858830411, -0.000733893428160216, 0.00325607356326439, 1.57040005185553, -1.57101000328584, 0),
}  # fmt: skip


def model(name: str) -> Arm:
    """Return a model with the maker's table, all else that of the UR5."""
    arm = load_arm("ur5")
    rows = [attrs.evolve(joint, a=a, d=d) for joint, a, d in zip(arm.joints, *TABLES[name], strict=True)]
    return attrs.evolve(arm, name=name, joints=rows)


def conf_text(deltas: Mapping[str, Sequence[float]]) -> str:
    """Return the text of a calibration.conf."""
    return "[mounting]\n" + "".join(f"delta_{key} = [ {', '.join(map(repr, row))}]\n" for key, row in deltas.items())


def yaml_frames(text: str, order: str) -> Array:
    """Return the frames of a kinematics file (6, 4, 4), read by a pattern, its angles by SciPy in some order."""
    numbers = np.array([float(value) for value in re.findall(r"(?:x|y|z|roll|pitch|yaw): (\S+)", text)]).reshape(6, 6)
    X = np.tile(np.eye(4), (6, 1, 1))
    X[:, :3, 3], X[:, :3, :3] = numbers[:, :3], Rotation.from_euler(order, numbers[:, 3:]).as_matrix()
    return X


def chain(frames: Array, q: Array) -> Array:
    """Return the poses (m, 4, 4) of the last of some frames, each of which rotates about its z axis."""
    X = np.eye(4)
    for frame, angles in zip(frames, q.T, strict=True):
        turned = np.tile(np.eye(4), (len(q), 1, 1))
        turned[:, :3, :3] = Rotation.from_euler("z", angles[:, None]).as_matrix()
        X = X @ frame @ turned
    return np.asarray(X)


def random_positions(rng: np.random.Generator) -> Array:
    """Return joint positions (40, 6)."""
    return rng.uniform(-np.pi, np.pi, (40, 6))


def test_controller_of_a_real_robot() -> None:
    """With its calibration a UR5e is where its controller displays it; without, a millimetre beside."""
    nominal = model("ur5e")
    arm, notes = calibrated_arm(nominal, FILES / "ur5e.conf")
    table = np.loadtxt(FILES / "ur5e_poses.csv", delimiter=",", skiprows=1)
    q, displayed = np.radians(table[:, 1:7]), table[:, 7:] * 1e-3

    def distances(one: Arm) -> Array:
        return np.asarray(np.linalg.norm(forward(one, q)[:, :3, 3] - displayed, axis=1))

    assert distances(arm).max() < DISPLAYED
    assert distances(nominal).min() > 4 * DISPLAYED
    assert notes == []


@pytest.mark.parametrize("deltas", FACTORY, ids=["1 m", "300 m", "440 m"])
def test_factory_calibrations(deltas: Mapping[str, Sequence[float]], tmp_path: Path, sample: Sample) -> None:
    """The poses of the tool are those of the table plus its differences, and both files bring them back."""
    nominal = model("ur10")
    (tmp_path / "robot.conf").write_text(conf_text(deltas), encoding="utf-8")
    arm, _ = calibrated_arm(nominal, tmp_path / "robot.conf")
    (tmp_path / "again.conf").write_text(calibration_conf(arm, nominal), encoding="utf-8")
    (tmp_path / "again.yaml").write_text(kinematics_yaml(arm), encoding="utf-8")
    again = [calibrated_arm(nominal, tmp_path / name)[0] for name in ("again.conf", "again.yaml")]
    rows = [
        attrs.evolve(joint, **{key: getattr(joint, key) + row[i] for key, row in deltas.items()})
        for i, joint in enumerate(nominal.joints)
    ]
    for rng in sample.cases(50):
        q = random_positions(rng)
        expected = forward(attrs.evolve(nominal, joints=rows), q)
        for one in (arm, *again):
            np.testing.assert_allclose(forward(one, q), expected, rtol=0, atol=EXACT)


def test_links_stay_where_they_are() -> None:
    """Masses and solids hold for the calibrated arm: its frames are a few millimetres from those of the model."""
    nominal = load_arm("ur5")
    arm, _ = calibrated_arm(nominal, FILES / "ur5.yaml")

    before, now = (np.array([joint.behind[:3, 3] + (0, 0, joint.d) for joint in one.joints]) for one in (nominal, arm))

    np.testing.assert_allclose(now, before, rtol=0, atol=2e-3)
    assert arm.links == nominal.links
    assert "calibrated by ur5.yaml" in arm.title


@pytest.mark.parametrize("name", ["ur5", "ur5e"])
def test_files_of_ur_calibration(name: str, tmp_path: Path, sample: Sample) -> None:
    """What ur_calibration writes are rotations about moving axes, and the difference to URDF is told."""
    path = FILES / f"{name}.yaml"
    nominal = model(name)
    arm, notes = calibrated_arm(nominal, path)
    (tmp_path / "again.conf").write_text(calibration_conf(arm, nominal), encoding="utf-8")
    again, _ = calibrated_arm(nominal, tmp_path / "again.conf")
    for rng in sample.cases(50):
        q = random_positions(rng)
        expected = chain(yaml_frames(path.read_text(encoding="utf-8"), "XYZ"), q)
        np.testing.assert_allclose(forward(arm, q), expected, rtol=0, atol=EXACT)
        np.testing.assert_allclose(forward(again, q), expected, rtol=0, atol=EXACT)
    assert len(notes) == 1
    assert "about moving axes" in notes[0]


def test_published_pair(tmp_path: Path) -> None:
    """The frames that ur_calibration wrote for a robot follow from that robot's table, digit by digit."""
    nominal = model("ur5")
    deltas = {
        key: [value - getattr(joint, key) for value, joint in zip(row, nominal.joints, strict=True)]
        for key, row in PAIR.items()
    }
    (tmp_path / "robot.conf").write_text(conf_text(deltas), encoding="utf-8")
    arm, _ = calibrated_arm(nominal, tmp_path / "robot.conf")

    shoulder, upper_arm = yaml_frames(kinematics_yaml(arm), "xyz")[:2]

    np.testing.assert_allclose(shoulder[:3, 3], (0, 0, 0.08887944927540013), atol=1e-15)
    np.testing.assert_allclose(Rotation.from_matrix(shoulder[:3, :3]).as_rotvec()[2], -9.626996686328957e-06, rtol=1e-9)
    np.testing.assert_allclose(upper_arm[:3, 3], (0.0002793323561955981, 0, 0), atol=1e-15)
    roll, pitch, yaw = Rotation.from_matrix(upper_arm[:3, :3]).as_euler("XYZ")
    assert roll == pytest.approx(1.570338588304109, abs=1e-14)
    assert pitch == pytest.approx(0.0, abs=1e-14)
    assert f"{yaw:.9e}".startswith("2.1588")


def test_robot_description(tmp_path: Path, sample: Sample) -> None:
    """A robot description that takes our file as ROS does, origins of URDF, has its tool where the arm has it."""
    arm, _ = calibrated_arm(model("ur5e"), FILES / "ur5e.conf")
    numbers = re.findall(r"(?:x|y|z|roll|pitch|yaw): (\S+)", kinematics_yaml(arm))
    joints = "".join(
        f'<link name="l{i + 1}"/><joint name="j{i}" type="continuous"><parent link="l{i}"/><child link="l{i + 1}"/>'
        f'<origin xyz="{" ".join(numbers[6 * i : 6 * i + 3])}" rpy="{" ".join(numbers[6 * i + 3 : 6 * i + 6])}"/>'
        '<axis xyz="0 0 1"/></joint>'
        for i in range(6)
    )
    (tmp_path / "ur.urdf").write_text(f'<robot name="ur"><link name="l0"/>{joints}</robot>', encoding="utf-8")
    description = pinocchio.buildModelFromUrdf(str(tmp_path / "ur.urdf"))
    data, tip = description.createData(), description.getFrameId("l6")
    for rng in sample.cases(50):
        q = random_positions(rng)
        for positions, expected in zip(q, forward(arm, q), strict=True):
            circle = np.column_stack([np.cos(positions), np.sin(positions)]).ravel()
            pinocchio.framesForwardKinematics(description, data, circle)
            np.testing.assert_allclose(data.oMf[tip].homogeneous, expected, rtol=0, atol=EXACT)


def test_axes_that_are_parallel(tmp_path: Path) -> None:
    """A model is its own calibration: all differences are 0, and both files leave it as it is."""
    nominal = load_arm("ur5")
    text = calibration_conf(nominal, nominal)
    (tmp_path / "own.yaml").write_text(kinematics_yaml(nominal), encoding="utf-8")
    (tmp_path / "own.conf").write_text(text, encoding="utf-8")

    assert text.count("[ 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]") == 4
    for name in ("own.yaml", "own.conf"):
        arm, notes = calibrated_arm(nominal, tmp_path / name)
        np.testing.assert_allclose(forward(arm, np.ones(6)), forward(nominal, np.ones(6)), atol=1e-15)
        assert notes == []


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("puma560", "the axis behind joint 1 is 180 degrees from where it is there"),
        ("stanford", "joint 3 is prismatic"),
        ("ntu-3r", "it has 3 joints"),
    ],
)
def test_other_structures(name: str, message: str) -> None:
    """An arm that is built otherwise is refused, whichever file is asked for."""
    for refused in (
        lambda: calibrated_arm(load_arm(name), FILES / "ur5.yaml"),
        lambda: calibrated_arm(load_arm(name), FILES / "ur5e.conf"),
        lambda: calibration_conf(load_arm(name), load_arm("ur5")),
        lambda: kinematics_yaml(load_arm(name)),
    ):
        with pytest.raises(UnsupportedArmError, match=message):
            refused()


def test_other_model() -> None:
    """The frames of a UR5e are not taken for those of a UR5."""
    with pytest.raises(FileFormatError, match=r"74 mm and 0\.00 rad from that of 'ur5'.*another one\?"):
        calibrated_arm(load_arm("ur5"), FILES / "ur5e.yaml")


def test_differences_need_a_table() -> None:
    """Differences are counted from the table of a model, not from the poses of a calibrated arm."""
    arm, _ = calibrated_arm(load_arm("ur5"), FILES / "ur5.yaml")
    with pytest.raises(InvalidValueError, match="its rows are poses"):
        calibration_conf(arm, arm)


CONF = (FILES / "ur5e.conf").read_text(encoding="utf-8")
YAML = (FILES / "ur5.yaml").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"\[mounting\]: no such section; sections of the file: none"),
        (CONF.replace("[mounting]", "[Mounting]"), r"no such section; sections of the file: \[Mounting\]"),
        ("delta_a = [ 0]\n", "1: expected lines such as"),
        (CONF.replace("delta_a =", "delta_b ="), "delta_a: no such key"),
        (CONF.replace("-204.077105406530421, ", ""), "delta_d: expected a list of six numbers in brackets, got"),
        (CONF.replace("-204.077105406530421", "nan"), "delta_d: joint 2: expected up to 100000, got nan"),
        (CONF.replace("-204.077105406530421", "1e9"), r"joint 2: expected up to 100000, got 1e\+09"),
        (CONF.replace("-204.077105406530421", "__import__('os')"), "expected a list of six numbers"),
    ],
)
def test_mistakes_in_calibration_conf(text: str, message: str, tmp_path: Path) -> None:
    """One line says what is wrong, and where."""
    (tmp_path / "robot.conf").write_text(text, encoding="utf-8")
    with pytest.raises(FileFormatError, match=message):
        calibrated_arm(model("ur5e"), tmp_path / "robot.conf")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"kinematics\.shoulder: missing; expected the links shoulder, upper_arm"),
        (YAML.replace("forearm", "fore_arm"), r"16: fore_arm: expected one of .*did you mean 'forearm'\?"),
        (YAML.replace("    pitch: 0\n", "", 1), r"kinematics\.shoulder\.pitch: missing"),
        (YAML.replace("roll: -0", "rol: -0"), r"6: shoulder\.rol: expected one of .*did you mean 'roll'\?"),
        (YAML.replace("z: 0.089201138580847966", "z: .inf"), r"5: z: expected a number up to 100, got '\.inf'"),
        (YAML.replace("z: 0.089201138580847966", "z: *a"), r"5: z: expected a number up to 100, got '\*a'"),
        (YAML.replace("    y: 0\n", "    x: 0\n", 1), "4: x: this key occurs twice"),
        ("kinematics: {shoulder: {x: 0}}\n", "1: kinematics: expected links and their numbers on lines of"),
        ("kinematics\n", "expected a key and a number"),
        (YAML.replace("  forearm:", "   forearm:"), r"16: upper_arm\.forearm: expected one of x, y"),
    ],
)
def test_mistakes_in_kinematics_yaml(text: str, message: str, tmp_path: Path) -> None:
    """One line says what is wrong, and where."""
    (tmp_path / "robot.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(FileFormatError, match=message):
        calibrated_arm(load_arm("ur5"), tmp_path / "robot.yaml")


def test_other_settings_in_the_same_file(tmp_path: Path) -> None:
    """Comments, the mark of a document and settings beside the kinematics are passed over."""
    text = f"---\n# of cell 4\nother:\n  shoulder:\n    x: 1\n{YAML}after: 3\n".replace("x: 0\n", "x: 0  # none\n")
    (tmp_path / "robot.yaml").write_text(text, encoding="utf-8")

    arm, _ = calibrated_arm(load_arm("ur5"), tmp_path / "robot.yaml")

    assert attrs.evolve(arm, title="") == attrs.evolve(calibrated_arm(load_arm("ur5"), FILES / "ur5.yaml")[0], title="")
