"""Arms as URDF files: read back they are the same arms, and Pinocchio finds the same in them."""

import math
from collections.abc import Callable
from pathlib import Path

import attrs
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm
from armwright.arm.model import STANDARD_GRAVITY, Arm, Joint, Motor
from armwright.arm.uncertainty import Uncertainty
from armwright.arm.urdf.reader import load_urdf
from armwright.arm.urdf.writer import lost_in_urdf, urdf_text
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.errors import InvalidValueError, ShapeError
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.recognise import find_geometry
from oracles.arms import random_arm, squared
from oracles.catalogue import FEW, NAMES
from oracles.urdf import oracle
from samples import examples

ROUND_TRIP = 1e-12  # in parts of the largest number of the quantity
AGREEMENT = 1e-9

UPRIGHT = np.array((0.0, 0.0, -STANDARD_GRAVITY))


@pytest.fixture
def back(tmp_path: Path) -> Callable[[Arm], Arm]:
    """Write an arm as URDF and read it back."""

    def there_and_back(arm: Arm) -> Arm:
        (tmp_path / "arm.urdf").write_text(urdf_text(arm), encoding="utf-8")
        return load_urdf(tmp_path / "arm.urdf")

    return there_and_back


def near(ours: np.ndarray, theirs: np.ndarray, agreement: float) -> None:
    assert ours.shape == theirs.shape
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=agreement * np.abs(theirs).max())


def some_arm(rng: np.random.Generator, joints: int, *, built: bool) -> Arm:
    """A random arm that stands upright, without what URDF cannot hold."""
    arm = random_arm(rng, joints)
    motors = [Motor(viscous=v, coulomb_forward=c, coulomb_backward=c) for v, c in rng.uniform(0, 3, size=(joints, 2))]
    return attrs.evolve(squared(arm, rng) if built else arm, gravity=UPRIGHT, motors=motors)


@pytest.mark.parametrize("joints", range(1, 13))
@pytest.mark.parametrize("built", [False, True])
def test_there_and_back(joints: int, *, built: bool, rng: np.random.Generator, back: Callable[[Arm], Arm]) -> None:
    """Poses, efforts with friction and the mass matrix are the same to the last digits, at the same joint positions."""
    for _ in range(8):
        arm = some_arm(rng, joints, built=built)
        q, qd, qdd = rng.uniform(-2, 2, size=(3, joints))

        again = back(arm)

        near(forward(again, q), forward(arm, q), ROUND_TRIP)
        near(inverse_dynamics(again, q, qd, qdd), inverse_dynamics(arm, q, qd, qdd), ROUND_TRIP)
        near(mass_matrix(again, q), mass_matrix(arm, q), ROUND_TRIP)
        assert [joint.kind for joint in again.joints] == [joint.kind for joint in arm.joints]
        assert again.motors == arm.motors


@pytest.mark.parametrize("joints", range(1, 13))
@pytest.mark.parametrize("built", [False, True])
def test_pinocchio_reads_it(joints: int, *, built: bool, rng: np.random.Generator) -> None:
    """Another reader finds the same arm in the file: pose of the tool, efforts of the links, mass matrix."""
    arm = some_arm(rng, joints, built=built)
    known = oracle(urdf_text(arm), "tool")
    q, qd, qdd = rng.uniform(-2, 2, size=(3, joints))

    near(forward(arm, q), known.forward(q), AGREEMENT)
    near(inverse_dynamics(arm, q, qd, qdd, drives=False), known.inverse_dynamics(q, qd, qdd), AGREEMENT)
    near(mass_matrix(arm, q, drives=False), known.mass_matrix(q), AGREEMENT)


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", NAMES)
def test_catalogue(name: str, rng: np.random.Generator, back: Callable[[Arm], Arm]) -> None:
    """Every arm of the catalogue survives, with its limits, its bodies and its build."""
    arm = load_arm(name)
    q, qd, qdd = rng.uniform(-1, 1, size=(3, arm.n))

    again = back(arm)

    near(forward(again, q), forward(arm, q), ROUND_TRIP)
    bare, bare_again = (attrs.evolve(one, motors=[Motor()] * arm.n, gravity=UPRIGHT) for one in (arm, again))
    ours, theirs = (inverse_dynamics(one, q, qd, qdd) for one in (bare_again, bare))
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=ROUND_TRIP * max(1.0, np.abs(theirs).max()))
    for limit in ("lower", "upper", "speed", "effort"):
        np.testing.assert_array_equal(getattr(again.limits, limit), getattr(arm.limits, limit))
    families = [geometry.family if (geometry := find_geometry(one)) else None for one in (arm, again)]
    assert families[0] == families[1]


@pytest.mark.parametrize("pitch", [90, -90])
def test_turns_where_roll_and_yaw_are_one(pitch: float, rng: np.random.Generator, back: Callable[[Arm], Arm]) -> None:
    """A tool that points straight up or down keeps its turn to the last digits, whatever its turn about that axis."""
    for angle, off in ((0.0, 0.0), (0.7, 0.0), (-2.9, 1e-9), (3.1, -1e-14), (1.2, 1e-7)):
        c, s, p = math.cos(angle), math.sin(angle), math.radians(pitch) + off
        about_z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        about_y = np.array([[math.cos(p), 0, math.sin(p)], [0, 1, 0], [-math.sin(p), 0, math.cos(p)]])
        X = np.eye(4)
        X[:3, :3] = about_z @ about_y
        arm = attrs.evolve(some_arm(rng, 2, built=False), base=X, tool=X)

        near(forward(back(arm), [0.1, 0.2]), forward(arm, [0.1, 0.2]), ROUND_TRIP)


numbers = st.floats(1e-3, 1e3)
bounds = st.one_of(st.just(math.inf), numbers)


@settings(max_examples=examples(50), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    kind=st.sampled_from(("revolute", "prismatic")),
    lower=bounds,
    upper=bounds,
    speed=bounds,
    effort=bounds,
    dry=numbers,
)
def test_limits(  # noqa: PLR0917 - one argument per limit
    kind: str, lower: float, upper: float, speed: float, effort: float, dry: float, back: Callable[[Arm], Arm]
) -> None:
    """Limits and friction come back to the last bit, those that nobody knows too."""
    limits = Limits(lower=-lower, upper=upper, speed=speed, effort=effort)
    motor = Motor(viscous=dry / 7, coulomb_forward=dry, coulomb_backward=dry)
    arm = Arm(name="any", joints=[Joint(kind=kind, limits=limits)], motors=[motor])

    again = back(arm)

    assert (again.joints[0].limits, again.motors) == (limits, (motor,))


def test_kinds_of_joints() -> None:
    """A turn without stops is continuous, one with a stop on one side revolute; what is not known is 1e30."""
    joints = [Joint(kind="revolute"), Joint(kind="revolute", limits=Limits(lower=-1)), Joint(kind="prismatic")]

    lines = urdf_text(Arm(name="three", joints=joints)).splitlines()

    assert [line.split('type="')[1].split('"')[0] for line in lines if 'name="joint_' in line] == [
        "continuous",
        "revolute",
        "prismatic",
    ]
    assert [line.strip() for line in lines if "<limit" in line] == [
        '<limit lower="-1.0" upper="1e+30" effort="1e+30" velocity="1e+30" />',
        '<limit lower="-1e+30" upper="1e+30" effort="1e+30" velocity="1e+30" />',
    ]


def test_what_is_lost() -> None:
    """What URDF cannot hold is said, one sentence each."""
    arm = Arm(
        name="rich",
        title="An arm",
        source="made up",
        joints=[
            Joint(kind="revolute", limits=Limits(acceleration=2)),
            Joint(kind="prismatic", limits=Limits(acceleration=3)),
        ],
        motors=[
            Motor(inertia=0.5, gear_ratio=100),
            Motor(inertia=1.5, coulomb_forward=3, coulomb_backward=5),
        ],
        gravity=(9.80665, 0, 0),
        reach=0.9,
        tool_speed=0.5,
        uncertainty=Uncertainty(errors=["tool.x"], covariance=[[1e-8]], noise=1e-5),
    )

    assert lost_in_urdf(arm) == [
        "joint 1: the inertia of the drive, 0.5 kg m², is not in the file",
        "joint 1: the gear ratio 100 is not in the file",
        "joint 1: the maximum acceleration, 2 rad/s², is not in the file",
        "joint 2: the inertia of the drive, 1.5 kg, is not in the file",
        "joint 2: Coulomb friction of 3 N forward and 5 N backward is 4 N in both directions in the file",
        "joint 2: the maximum acceleration, 3 m/s², is not in the file",
        "gravity of (9.80665, 0, 0) m/s² is not in the file: in URDF it points downwards along z",
        "the reach of 0.9 m is not in the file",
        "the hand speed of 0.5 m/s is not in the file",
        "the uncertainty of its dimensions is not in the file",
        "the title is not in the file",
        "the source is not in the file",
    ]
    assert 'friction="4.0"' in urdf_text(arm)


def test_as_many_tilts_as_joints(rng: np.random.Generator) -> None:
    """Turns about y are told for every joint or for none."""
    with pytest.raises(ShapeError, match="tilts: expected 4 of them, one for each joint, got 2"):
        urdf_text(some_arm(rng, 4, built=True), [0.0, 0.1])


def test_nothing_is_lost(rng: np.random.Generator, back: Callable[[Arm], Arm]) -> None:
    """Of an arm that was read from URDF, only where it was read from is lost when it is written again."""
    assert lost_in_urdf(back(some_arm(rng, 4, built=True))) == ["the source is not in the file"]


@settings(max_examples=examples(50), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(name=st.text(st.characters(exclude_categories=["Cs", "Cc"], exclude_characters="\ufffe\uffff"), min_size=1))
def test_names(name: str, back: Callable[[Arm], Arm]) -> None:
    """Whatever an arm is called, quotes and brackets too, it is called so when it is read back."""
    assert back(Arm(name=name, joints=[Joint(kind="revolute")])).name == name


@pytest.mark.parametrize("name", ["two\nlines", "a\ttab", "a\rreturn"])
def test_names_with_line_ends(name: str, back: Callable[[Arm], Arm]) -> None:
    """Line ends and tabs in a name are kept."""
    assert back(Arm(name=name, joints=[Joint(kind="revolute")])).name == name


@pytest.mark.parametrize("name", ["\x00", "bell \x07", "\ufffe", "\ud800"])
def test_names_that_xml_cannot_hold(name: str) -> None:
    """XML has no way to write some characters, and a file with them would not be read."""
    with pytest.raises(InvalidValueError, match="XML cannot represent every character of this name"):
        urdf_text(Arm(name=name, joints=[Joint(kind="revolute")]))
