"""Conventions of controllers: joints, poses and configurations that others have published."""

import re
import tomllib
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from armwright import load_arm
from armwright.errors import UnknownNameError, UnsupportedArmError
from armwright.export.checkers.comparison import Model
from armwright.export.checkers.posture import PostureReader
from armwright.export.conventions import ControllerArm, controller_arm, conventions, find_convention
from armwright.export.writers.posture import Posture, confdata, postures, status_and_turn
from armwright.kinematics import forward, inverse
from export.cases import HERE, mapped_arm, six_axes, wrist_arm
from samples import Sample

PUBLISHED: dict[str, list[dict[str, Any]]] = tomllib.loads((HERE / "published.toml").read_text(encoding="utf-8"))
UR5E = six_axes(
    [(0, 162.5, 0, 90), (0, 0, -425, 0), (0, 0, -392.2, 0), (0, 133.3, 0, 90), (0, 99.7, 0, -90), (0, 99.6, 0, 0)],
    "ur5e",
)
IRB4600 = wrist_arm((495, 175, 1095, 175, 1230.5, 85), "irb4600")
IRB1660 = wrist_arm((486.5, 150, 700, 110, 678, 135), "irb1660")
# Published positions end with hundredths of a millimetre.
HUNDREDTH = 0.008


def posture(mapped: ControllerArm, q: np.ndarray) -> Posture:
    """The posture at joint positions (6,) of the arm."""
    return postures(mapped, q[None])[0]


def flange(mapped: ControllerArm, shown: list[float]) -> np.ndarray:
    """The flange, seen from the base frame of the controller, at joint positions that it shows [deg]."""
    q = Model(mapped).joints(np.radians(shown))
    return np.linalg.inv(mapped.X_BC) @ forward(mapped.arm, q) @ np.linalg.inv(mapped.X_CT)


@pytest.mark.parametrize("case", PUBLISHED["ur"], ids=lambda case: case["source"][:20])
def test_waypoints_of_universal_robots(case: dict[str, Any]) -> None:
    """The pose of a waypoint is that of its joints; the orientation of calibrated arms to 6 mrad."""
    mapped = controller_arm(UR5E, conventions()["universal-robots"])
    X = flange(mapped, np.degrees(case["q"]).tolist())

    R = Rotation.from_rotvec(case["p"][3:]).as_matrix()
    apart = Rotation.from_matrix(X[:3, :3].T @ R).magnitude()
    if case["exact"]:
        np.testing.assert_allclose(X[:3, 3], case["p"][:3], atol=1e-9)
        assert apart < 1e-9
    else:
        assert apart < 6e-3


def test_zero_pose_of_kuka() -> None:
    """The flange of a KR 6 R900 at zero is where those who compared it with the controller say."""
    case = PUBLISHED["kuka_pose"][0]
    X = flange(mapped_arm("krl"), case["q"])

    np.testing.assert_allclose(X[:3, 3] * 1e3, case["position"], atol=1e-9)
    w, *xyz = case["quaternion"]
    np.testing.assert_allclose(X[:3, :3], Rotation.from_quat([*xyz, w]).as_matrix(), atol=1e-9)


def test_turn_of_kuka() -> None:
    """The turn has a bit for each negative axis."""
    case = PUBLISHED["kuka_turn"][0]
    mapped = mapped_arm("krl")
    q = Model(mapped).joints(np.radians(case["q"]))

    assert status_and_turn(posture(mapped, q))[1] == case["T"]
    assert PostureReader(mapped).words(mapped.joints(q))["T"] >= {case["T"]}


@pytest.mark.parametrize("case", PUBLISHED["kuka_word"], ids=lambda case: f"S {case['S']}, T {case['T']}")
def test_taught_points_of_kuka(case: dict[str, Any]) -> None:
    """In taught points, bit 2 of S is that of axis 5 in T, and bit 1 is set where axis 3 is positive and large."""
    bits = [case["T"] >> i & 1 for i in range(6)]
    q = np.radians([-60.0 if bit else 60.0 for bit in bits])
    mapped = mapped_arm("krl")

    status, turn = status_and_turn(posture(mapped, Model(mapped).joints(q)))

    assert turn == case["T"]
    assert (status & 6, not bits[2]) == (case["S"] & 6, True)


@pytest.mark.parametrize("case", PUBLISHED["abb_pose"], ids=lambda case: str(case["q"][0]))
def test_poses_of_abb(case: dict[str, Any]) -> None:
    """The pose of tool0 of an IRB 4600 is that of its joints."""
    X = flange(controller_arm(IRB4600, conventions()["abb"]), case["q"])

    np.testing.assert_allclose(X[:3, 3] * 1e3, case["position"], atol=HUNDREDTH)
    R = Rotation.from_euler("xyz", case["angles"], degrees=True).as_matrix()
    assert Rotation.from_matrix(X[:3, :3].T @ R).magnitude() < np.radians(0.01)


@pytest.mark.parametrize("case", PUBLISHED["irb120"], ids=lambda case: str(case["q"][0]))
def test_targets_of_an_irb120(case: dict[str, Any]) -> None:
    """The pose of a joint target is the published one, and one of its configurations is, too."""
    mapped = mapped_arm("rapid")
    X = flange(mapped, case["q"])
    w, *xyz = case["quaternion"]
    R = Rotation.from_quat([*xyz, w]).as_matrix()

    np.testing.assert_allclose(X[:3, 3] * 1e3, case["position"], atol=HUNDREDTH)
    assert Rotation.from_matrix(X[:3, :3].T @ R).magnitude() < 1e-4
    if "confdata" in case:
        q = Model(mapped).joints(np.radians(case["q"]))
        assert list(confdata(posture(mapped, q))) == case["confdata"]
        reached = inverse(mapped.arm, forward(mapped.arm, q)).branches
        assert sum(list(confdata(posture(mapped, branch.q))) == case["confdata"] for branch in reached) == 1


@pytest.mark.parametrize("case", PUBLISHED["abb_cfx"], ids=lambda case: f"cfx {case['cfx']}")
def test_cfx_of_an_irb1660(case: dict[str, Any]) -> None:
    """The configuration of published joints is the published one, by both ways of computing it."""
    mapped = controller_arm(IRB1660, conventions()["abb"])
    for shown in case["q"]:
        q = Model(mapped).joints(np.radians(shown))

        assert confdata(posture(mapped, q))[3] == case["cfx"]
        assert PostureReader(mapped).words(mapped.joints(q))["cfx"] == {case["cfx"]}


def test_all_eight_configurations_differ() -> None:
    """The eight ways in which an IRB 120 or a KR 6 reaches a pose have eight words."""
    rng = np.random.default_rng(5)
    for target, word in (("rapid", lambda p: confdata(p)[3]), ("krl", lambda p: status_and_turn(p)[0])):
        mapped = mapped_arm(target)
        for _ in range(20):
            q = Model(mapped).joints(rng.uniform(-0.6, 0.6, 6) + np.radians([0, -60, 80, 0, 40, 0]))
            branches = [branch.q for branch in inverse(mapped.arm, forward(mapped.arm, q), q).branches]

            assert len({word(posture(mapped, branch)) for branch in branches}) == len(branches)


@pytest.mark.share(0.02)
@pytest.mark.parametrize("target", ["krl", "rapid"])
def test_configuration_words_by_two_ways(target: str, sample: Any) -> None:
    """The words from the frames of the arm are those from plane trigonometry."""
    mapped, reader = mapped_arm(target), PostureReader(mapped_arm(target))
    count = sample.count(10_000)
    for rng in sample.cases(count):
        q = rng.uniform(mapped.arm.limits.lower, mapped.arm.limits.upper)
        words = reader.words(mapped.joints(q))
        named = dict(zip(("cf1", "cf4", "cf6", "cfx"), confdata(posture(mapped, q)), strict=True))
        status, turn = status_and_turn(posture(mapped, q))

        assert all(value in words[name] for name, value in {**named, "S": status, "T": turn}.items()), q
        assert -np.pi <= posture(mapped, q).bend <= np.pi
    sample.record(f"configuration words of {target}", count, 0)


@pytest.mark.parametrize("case", PUBLISHED["fanuc"], ids=lambda case: f"{case['q'][0]:.1f}")
def test_poses_of_fanuc(case: dict[str, Any]) -> None:
    """The flange of an LR Mate 200iD is where the controller has it, joint 3 being coupled with joint 2."""
    mapped = controller_arm(load_arm(str(HERE / "arms" / "lrmate200id.toml")), conventions()["fanuc"])
    X = flange(mapped, case["q"])

    np.testing.assert_allclose(X[:3, :4].T.ravel() * [*[1] * 9, *[1e3] * 3], case["pose"], atol=1e-6)


def test_coupling_of_fanuc() -> None:
    """What the pendant shows for joint 3 is the angle of the driver less joint 2."""
    case = PUBLISHED["fanuc_coupling"][0]
    mapped = controller_arm(load_arm(str(HERE / "arms" / "lrmate200id.toml")), conventions()["fanuc"])
    own = mapped.zeros + mapped.signs * [0, case["joint_2_rad"], case["joint_3_rad"], 0, 0, 0]

    assert np.degrees(mapped.joints(own)[2]) == pytest.approx(case["shown_3"], abs=1e-3)


@pytest.mark.parametrize("target", ["urscript", "krl", "rapid", "fanuc"])
def test_joints_there_and_back(target: str) -> None:
    """The checker's joints of the controller's joints are those of the arm."""
    mapped = mapped_arm(target)
    q = np.random.default_rng(1).uniform(-2, 2, (50, 6))

    np.testing.assert_allclose(Model(mapped).joints(mapped.joints(q)), q, atol=1e-14)


def test_arms_that_do_not_fit() -> None:
    """An arm whose axes stand otherwise, or that has a prismatic joint, has no such controller."""
    for name, convention in (("ur5", "kuka"), ("stanford", "abb"), ("ur5", "fanuc")):
        with pytest.raises(UnsupportedArmError, match=f"the axes of '{name}' cannot stand as"):
            controller_arm(load_arm(name), conventions()[convention])


@pytest.mark.parametrize("name", conventions())
def test_arms_of_a_convention(name: str) -> None:
    """The arms that a convention lists stand as it says, their tools in its flange frame."""
    for arm in conventions()[name].arms:
        mapped = controller_arm(load_arm(arm), conventions()[name])

        np.testing.assert_allclose(mapped.X_CT, np.eye(4), atol=1e-9, err_msg=arm)


@pytest.mark.parametrize(
    ("name", "target"), [("irb120", "rapid"), ("kr6-r900", "krl"), ("lrmate200id", "fanuc")], ids=lambda x: x
)
def test_arms_of_the_catalogue(name: str, target: str, sample: Sample) -> None:
    """The catalogue's files of arms whose poses are published have flanges and joints as those have them."""
    published = mapped_arm(target)
    mine = controller_arm(load_arm(name), published.convention)
    for rng in sample.cases(20):
        shown = np.degrees(rng.uniform(-1.5, 1.5, 6)).tolist()

        np.testing.assert_allclose(flange(mine, shown), flange(published, shown), atol=1e-9)


def test_joint_3_of_an_irb2400() -> None:
    """The controller of an arm with a parallelogram shows where its drives are: joint 3 together with joint 2."""
    arm = load_arm("irb2400-12-155")
    assert arm.coupling is not None
    q = np.array([0.1, 0.2, -0.4, 0.3, 0.5, -0.6])
    convention = find_convention(arm, None)
    assert convention is conventions()["abb-parallelogram"]

    np.testing.assert_allclose(controller_arm(arm, convention).joints(q), [0.1, 0.2, -0.2, 0.3, 0.5, -0.6], atol=1e-15)
    np.testing.assert_allclose(controller_arm(arm, convention).joints(q), arm.coupling.drives(q), atol=1e-15)


def test_names_of_conventions() -> None:
    """An arm of the catalogue has its convention; another one needs a name, and a wrong one is refused."""
    assert find_convention(load_arm("ur5"), None) is conventions()["universal-robots"]
    assert find_convention(load_arm("stanford"), None) is None
    with pytest.raises(UnknownNameError, match="Did you mean 'kuka'"):
        find_convention(load_arm("ur5"), "kukka")


def test_every_convention_has_sources() -> None:
    """A source says what was read in it, and which revision of it was read."""
    for convention in conventions().values():
        assert len(convention.sources) >= 2
        assert all(
            re.search(r"\w", part) for one in convention.sources for part in (one.says, one.document, one.revision)
        )
        assert len(set(convention.ros_joints)) == 6


@pytest.mark.parametrize("name", conventions()["universal-robots"].arms)
def test_arms_of_universal_robots_by_name(name: str) -> None:
    """All arms of the maker in the catalogue count joints as their parameters do: from the same zero, in one sense."""
    convention = find_convention(load_arm(name), None)
    assert convention is not None
    mapped = controller_arm(load_arm(name), convention)

    assert convention.name == "universal-robots"
    np.testing.assert_allclose(mapped.zeros, 0, atol=1e-12)
    assert (mapped.signs == 1).all()
