"""Arms of the catalogue against the papers that they come from, and against what can be worked out by hand."""

import math

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import STANDARD_GRAVITY, Arm
from armwright.arrays import Array
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.kinematics.forward_kinematics import forward, link_poses
from armwright.kinematics.inverse_kinematics.solution import Outcome
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.spatial.poses import homogeneous
from oracles.arms import random_configurations
from samples import Sample

INCH = 0.0254
ROUNDING = 1e-12
THREE_DIGITS = 5e-3  # to how many the cylinders of the UR5 are written


def column(arm: Arm, name: str) -> Array:
    """One column of the Denavit-Hartenberg table, angles in degrees."""
    values = np.array([getattr(joint, name) for joint in arm.joints])
    return np.degrees(values) if name in ("theta", "alpha") else values


def holding(arm: Arm, q: Array) -> Array:
    """The efforts that hold an arm still."""
    return inverse_dynamics(arm, q, np.zeros_like(q), np.zeros_like(q))


TABLES = {
    # Twists in degrees, lengths along x and along z in metres, fixed angles in degrees.
    "puma560": ((-90, 0, 90, -90, 90, 0), (0, 0.432, -0.02, 0, 0, 0), (0, 0, 0.149, 0.433, 0, 0), 0),
    "puma560-seed": ((-90, 0, 90, -90, 90, 0), (0, 0.432, -0.02, 0, 0, 0), (0, 0, 0.149, 0.433, 0, 0), 0),
    "stanford": ((-90, 90, 0, -90, 90, 0), 0, (16.24 * INCH, 6.05 * INCH, 0, 0, 0, 10.35 * INCH), (0, 0, -90, 0, 0, 0)),
    "stanford-jpl": ((-90, 90, 0, -90, 90, 0), 0, (0.3556, 0.1619, 0, 0, 0, 0.2477), (0, 0, -90, 0, 0, 0)),
    "ntu-3r": ((90, 0, 90), (0, 0.4, 0), (0.076, 0, -0.012), (0, 90, 0)),
    "ur5": ((90, 0, 0, 90, -90, 0), (0, -0.425, -0.39225, 0, 0, 0), (0.089159, 0, 0, 0.10915, 0.09465, 0.0823), 0),
}


@pytest.mark.parametrize("name", TABLES)
def test_geometry(name: str) -> None:
    """The tables are the published ones; what the report prints as centimetres of the Stanford arm are inches."""
    arm = load_arm(name)

    for key, values in zip(("alpha", "a", "d", "theta"), TABLES[name], strict=True):
        np.testing.assert_allclose(column(arm, key), np.broadcast_to(values, arm.n), atol=5e-6)
    kinds = [joint.kind for joint in arm.joints]
    assert kinds.count("prismatic") == ("stanford" in name)


def test_fixed_joint_of_the_thesis(rng: np.random.Generator) -> None:
    """The tool of the NTU arm stands where the fourth row of the thesis, its joint at 0, puts it."""
    arm = load_arm("ntu-3r")
    row = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0.3543], [0, 0, 0, 1]])  # Tz(.3543) Rx(90 deg)
    q = rng.uniform(-3, 3, size=3)

    np.testing.assert_allclose(forward(arm, q), link_poses(arm, q)[-2] @ row, atol=ROUNDING)


def test_limits_of_the_puma() -> None:
    """Positions are those of Fu, Gonzalez & Lee; rates are Lin, Chang & Luh's; torques Armstrong and others'."""
    arm = load_arm("puma560")

    np.testing.assert_allclose(np.degrees(arm.limits.lower), (-160, -225, -45, -110, -100, -266))
    np.testing.assert_allclose(np.degrees(arm.limits.upper), (160, 45, 225, 170, 100, 266))
    # From stop to stop as the maker's manual has it, but for what differs between its editions.
    turns = np.degrees(arm.limits.upper - arm.limits.lower)
    np.testing.assert_allclose(turns, (320, 266, 284, 280, 200, 532), atol=15)
    np.testing.assert_allclose(np.degrees(arm.limits.speed), (100, 95, 100, 150, 130, 110))
    np.testing.assert_allclose(np.degrees(arm.limits.acceleration), (45, 40, 75, 70, 90, 80))
    np.testing.assert_array_equal(arm.limits.effort, (97.6, 186.4, 89.4, 24.2, 20.1, 21.3))


def test_the_puma_of_the_project() -> None:
    """The arm of the PUMA trajectory project has its limits, without its slips, and is the PUMA in all else."""
    seed, arm = load_arm("puma560-seed"), load_arm("puma560")

    np.testing.assert_allclose(np.degrees(seed.limits.upper), (160, 125, 135, 140, 100, 260))
    np.testing.assert_array_equal(seed.limits.lower, -seed.limits.upper)
    stops = [
        attrs.evolve(mine, limits=attrs.evolve(mine.limits, lower=real.limits.lower, upper=real.limits.upper))
        for mine, real in zip(seed.joints, arm.joints, strict=True)
    ]
    named = {"name": arm.name, "title": arm.title, "source": arm.source}
    assert attrs.evolve(seed, joints=stops, **named) == arm


def test_tool_down_in_front(sample: Sample) -> None:
    """Where a PUMA reaches with its tool down in front of it, its limits let it in nine of ten places.

    With the limits of the project it is little more than half.
    """
    allowed = {"puma560": 0, "puma560-seed": 0}
    reached = 0
    for rng in sample.cases(1000):
        X = homogeneous(np.diag((1.0, -1.0, -1.0)), rng.uniform((0.3, -0.4, -0.6), (0.8, 0.4, 0.4)))
        found = {name: inverse(load_arm(name), X) for name in allowed}
        reached += found["puma560"].outcome is not Outcome.OUT_OF_REACH
        for name, solution in found.items():
            allowed[name] += bool(solution.allowed)
    sample.record("tool-down poses in front of a PUMA that its limits allow", reached, reached - allowed["puma560"])
    # Of 575 such poses of a grid 532, with the project's 319; a tenth of the sample strays by some hundredths.
    assert allowed["puma560"] > 0.84 * reached
    assert allowed["puma560"] > 1.1 * allowed["puma560-seed"]


@pytest.mark.parametrize("name", ["stanford", "stanford-jpl"])
def test_limits_of_the_stanford_arm(name: str) -> None:
    """Positions are those of table A-2, the boom's in centimetres; efforts and motors those of appendix II."""
    arm = load_arm(name)
    turns = [0, 1, 3, 4, 5]

    np.testing.assert_allclose(np.degrees(arm.limits.upper[turns]), (175, 175, 175, 110, 175))
    np.testing.assert_array_equal(arm.limits.lower[turns], -arm.limits.upper[turns])
    boom = arm.joints[2].limits
    np.testing.assert_allclose((boom.lower, boom.upper), (0.14, 1.1176), rtol=ROUNDING)
    np.testing.assert_array_equal(arm.limits.effort, (91.8, 303, 198, 10.15, 10.15, 7.15))
    np.testing.assert_array_equal([m.inertia for m in arm.motors], (0.953, 2.193, 0.782, 0.106, 0.097, 0.02))


@pytest.mark.parametrize("name", ["stanford", "stanford-jpl"])
def test_bodies_of_the_stanford_arm(name: str) -> None:
    """Moved back to the origin of its frame, every tensor is the one that appendix II prints."""
    printed = np.array(
        (
            (0.276, 0.255, 0.071),
            (0.108, 0.018, 0.1),
            (2.51, 2.51, 0.006),
            (0.002, 0.001, 0.001),
            (0.003, 0.003, 0.0004),
            (0.005, 0.005, 0.0003),
        )
    )

    for link, diagonal in zip(load_arm(name).links, printed, strict=True):
        c = link.com
        about_frame = link.inertia + link.mass * (c @ c * np.eye(3) - np.outer(c, c))
        np.testing.assert_allclose(about_frame, np.diag(diagonal), atol=ROUNDING)


def test_stanford_boom_upright() -> None:
    """With its boom upright the arm holds the 6.47 kg of links 3 to 6 with the slide, and nothing with the shoulder."""
    arm = load_arm("stanford-jpl")

    tau = holding(arm, np.array((0.4, 0, 0.8, 0, 0, 0)))

    assert tau[2] == pytest.approx((4.25 + 1.08 + 0.63 + 0.51) * STANDARD_GRAVITY)
    # The few millimetres by which the bodies stand off the boom are all that the shoulder feels.
    assert abs(tau[1]) < 0.01 * 6.47 * STANDARD_GRAVITY


def test_stanford_boom_level() -> None:
    """With its boom level the slide holds nothing, and the shoulder what mass times distance makes."""
    arm = load_arm("stanford-jpl")
    q3 = 0.8
    # Moments about the shoulder: links 2 and 3 as they are, y of link 4 back along the boom, the hand d6 further out.
    moment = 5.505 * -0.0079 + 4.25 * (q3 - 0.6447) + 1.08 * (q3 - 0.0092)
    moment += 0.63 * (q3 + 0.0566) + 0.51 * (q3 + 0.2477 - 0.0922)

    tau = holding(arm, np.array((0.4, math.pi / 2, q3, 0, 0, 0)))

    assert tau[2] == pytest.approx(0, abs=ROUNDING)
    assert tau[1] == pytest.approx(-moment * STANDARD_GRAVITY)  # a positive turn lowers the boom


@pytest.mark.parametrize("name", ["stanford", "stanford-jpl"])
def test_speed_rule_of_the_stanford_arm(name: str) -> None:
    """Boom and hand stretched out to their limit take the hand just as far from the base axis as the reach says."""
    arm = load_arm(name)
    stretched = forward(arm, np.array((0.3, math.pi / 2, 1.1176, 0, 0, 0)))

    assert math.hypot(*stretched[:2, 3]) == pytest.approx(arm.reach, abs=1e-4)


@pytest.mark.parametrize("name", ["puma560", "stanford", "stanford-jpl", "ur5"])
def test_reach(name: str, rng: np.random.Generator) -> None:
    """No configuration takes the hand further from the base axis than the published or the computed reach."""
    arm = load_arm(name)
    places = forward(arm, random_configurations(arm, rng, 5000))[:, :3, 3]

    farthest = np.hypot(places[:, 0], places[:, 1]).max()

    # The maker of the UR5 counts to the middle of the wrist, 94.65 mm before the flange.
    beyond = 0.1 if name == "ur5" else 1e-3
    assert 0.85 * arm.reach < farthest < arm.reach + beyond


@pytest.mark.parametrize("name", ["puma560", "stanford", "stanford-jpl", "ur5"])
def test_motors_are_strong_enough(name: str, rng: np.random.Generator) -> None:
    """In any configuration the motors give what all joints ask that speed up or slow down together at their limits."""
    arm = load_arm(name)
    q = random_configurations(arm, rng, 2000)
    forward_or_back = rng.choice((-1.0, 1.0), size=(2, *q.shape))

    tau = inverse_dynamics(arm, q, forward_or_back[0] * arm.limits.speed, forward_or_back[1] * arm.limits.acceleration)

    assert (np.abs(tau) < arm.limits.effort).all()


def test_gravity_of_the_puma(rng: np.random.Generator) -> None:
    """The published explicit model of the PUMA has the same gravity: its five constants, its law.

    Source:
        Armstrong, Khatib & Burdick (1986), gravity constants g1 to g5 [N m] and torques G2 to G5. Their lengths
        are a2 = 431.8, a3 = -20.3 and d4 = 433.1 mm, and their gravity 9.81 m/s²; hence two percent.
    """
    q = rng.uniform(-3, 3, size=(50, 6))
    c2, s2, c23, s23 = np.cos(q[:, 1]), np.sin(q[:, 1]), np.cos(q[:, 1] + q[:, 2]), np.sin(q[:, 1] + q[:, 2])
    s4, c4, s5, c5 = np.sin(q[:, 3]), np.cos(q[:, 3]), np.sin(q[:, 4]), np.cos(q[:, 4])
    wrist = s23 * c5 + c23 * c4 * s5
    none = np.zeros(50)
    # Rows: joints 1 to 6; columns: what g1 to g5 are multiplied by.
    law = np.array(
        (
            (none, none, none, none, none),
            (c2, s23, s2, c23, wrist),
            (none, s23, none, c23, wrist),
            (none, none, none, none, -s23 * s4 * s5),
            (none, none, none, none, c23 * s5 + s23 * c4 * c5),
            (none, none, none, none, none),
        )
    )
    tau = holding(load_arm("puma560"), q)

    constants, *_ = np.linalg.lstsq(law.transpose(2, 0, 1).reshape(-1, 5), tau.ravel(), rcond=None)

    np.testing.assert_allclose(np.einsum("jkn,k->nj", law, constants), tau, atol=1e-10)
    np.testing.assert_allclose(constants, (-37.2, -8.44, 1.02, 0.249, -0.0282), rtol=0.02)


def test_ur5_stretched_out() -> None:
    """At zero the UR5 is stretched out level: its shoulder and elbow hold what mass times distance makes."""
    tau = holding(load_arm("ur5"), np.zeros(6))
    wrist = 1.219 + 1.219 + 0.1879
    elbow = 2.33 * (0.39225 - 0.15) + wrist * 0.39225
    geometry = 8.393 * (0.425 - 0.2125) + elbow + (2.33 + wrist) * 0.425

    # The arm points along -x, so that a positive turn of either joint lowers it.
    np.testing.assert_allclose(tau[1:3], (-geometry * STANDARD_GRAVITY, -elbow * STANDARD_GRAVITY), rtol=ROUNDING)


def test_cylinders_of_the_ur5() -> None:
    """The tensors of the wrist are those of uniform cylinders, 75 mm across and 100 or 37 mm long."""
    for link, length in zip(load_arm("ur5").links[3:], (0.1, 0.1, 0.037), strict=True):
        radius = 0.0375
        across = link.mass * (3 * radius**2 + length**2) / 12
        along = link.mass * radius**2 / 2
        np.testing.assert_allclose(np.diag(link.inertia), (across, across, along), rtol=THREE_DIGITS)


def test_the_thesis_weighs_nothing() -> None:
    """The thesis gives no masses, so nothing is needed to hold its arm."""
    np.testing.assert_array_equal(holding(load_arm("ntu-3r"), np.array((0.1, 0.2, 0.3))), np.zeros(3))
