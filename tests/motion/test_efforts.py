"""What a motion asks of the motors, and the least slowing that lets them give it."""

import attrs
import numpy as np
import pytest

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm
from armwright.arm.model import STANDARD_GRAVITY, Arm, Joint, Link, Motor, Spring
from armwright.arrays import Array
from armwright.compiled.arm import compile_arm
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.errors import ArmwrightError, InvalidValueError, KindError, ShapeError
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.efforts import _largest_part, _Shares, effort_peaks, slowing_for_efforts
from armwright.motion.quintic_polynomials import PEAK_ACCELERATION, quintic
from armwright.motion.straight import straight_line
from armwright.motion.trajectory import Trajectory, hold
from armwright.motion.xspline_path import xspline
from armwright.program.vm.recording import ToolWrenches, trajectory_efforts
from armwright.spatial import pose
from samples import Sample

PUMA = load_arm("puma560-seed")
# Looks are so close that a peak between them is missed by no more than this part of it.
SEEN = 1e-3
ROUNDING = 1e-9


def block(effort: float, **motor: float) -> Arm:
    """2 kg on a level rail."""
    return Arm(
        name="block",
        joints=[Joint(kind="prismatic", limits=Limits(effort=effort))],
        links=[Link(mass=2.0)],
        motors=[Motor(**motor)],
        gravity=(0.0, -STANDARD_GRAVITY, 0.0),
    )


def lift(effort: float) -> Arm:
    """3 kg on an upward slide."""
    return Arm(
        name="lift", joints=[Joint(kind="prismatic", limits=Limits(effort=effort))], links=[Link(mass=3.0)]
    )  # fmt: skip


def wild(rng: np.random.Generator, duration: float) -> Trajectory:
    """An X-spline of the PUMA through twelve random places."""
    return xspline(np.linspace(0, duration, 12), rng.uniform(-0.8, 0.8, (12, 6)))


def test_a_block_is_pushed() -> None:
    """The largest force on a block that slides without friction is its mass by the largest acceleration."""
    peaks, times = effort_peaks(block(np.inf), quintic([0.0], [3.0], 2.0))

    assert peaks[0] == pytest.approx(2 * PEAK_ACCELERATION * 3 / 2**2, rel=1e-9)
    # The acceleration of a quintic peaks at (1 ± 1/sqrt 3)/2 of its time.
    assert abs(times[0] / 2 - 0.5) == pytest.approx(1 / np.sqrt(12), abs=1e-3)


def test_acceleration_that_jumps_is_seen_from_both_sides() -> None:
    """Where the acceleration jumps from 1 to -3 m/s², the force is 6 N, just after the jump and to the end."""
    stops = Trajectory(times=(0.0, 3.0, 4.0), coefficients=np.array([[[0], [0], [0.5]], [[4.5], [3], [-1.5]]]))

    assert effort_peaks(block(np.inf), stops).peaks[0] == pytest.approx(6.0)
    assert effort_peaks(lift(np.inf), stops).peaks[0] == pytest.approx(3 * (STANDARD_GRAVITY + 1))


def test_standing_costs_no_friction() -> None:
    """At the end of a motion, where only rounding is left of the speed, dry friction takes nothing."""
    brake = Trajectory(times=(0.0, 1.0), coefficients=np.array([[[0.1], [0.3], [-0.15]]]))
    last = np.nextafter(1.0, 2.0)
    past = attrs.evolve(brake, times=(0.0, last))

    assert effort_peaks(block(np.inf, coulomb_backward=5.0), past).peaks[0] == pytest.approx(2 * 0.3)


def test_peaks_of_an_arm(rng: np.random.Generator) -> None:
    """Twenty thousand samples of a PUMA's motion find nothing larger, but for a thousandth."""
    for _ in range(5):
        move = wild(rng, 6.0)
        t = np.linspace(0, move.duration, 20001)[1:-1]
        dense = np.abs(inverse_dynamics(PUMA, move(t), move(t, 1), move(t, 2))).max(axis=0)

        np.testing.assert_array_less(dense, effort_peaks(PUMA, move).peaks * (1 + SEEN))


def test_least_slowing(rng: np.random.Generator) -> None:
    """Slowed as it is told, a PUMA just keeps its efforts; a thousandth faster it does not."""
    for _ in range(5):
        move = wild(rng, 3.0)

        found = slowing_for_efforts(PUMA, move)

        assert found.factor > 1
        use = effort_peaks(PUMA, move.slowed(found.factor)).peaks / PUMA.limits.effort
        assert use.max() <= 1 + 2 * ROUNDING
        assert int(use.argmax()) == found.joint
        faster = effort_peaks(PUMA, move.slowed(found.factor / 1.001)).peaks / PUMA.limits.effort
        assert faster.max() > 1


def test_slowing_of_a_block() -> None:
    """Without friction the force falls with the square of the slowing, with viscous friction alone in proportion."""
    move = quintic([0.0], [3.0], 2.0)
    peak = 2 * PEAK_ACCELERATION * 3 / 2**2

    assert slowing_for_efforts(block(peak / 4), move).factor == pytest.approx(2.0, rel=1e-9)
    light = attrs.evolve(block(10.0, viscous=20.0), links=[Link()])
    assert slowing_for_efforts(light, move).factor == pytest.approx(20 * 15 / 8 * 3 / 2 / 10, rel=1e-6)


@pytest.mark.parametrize(
    "friction",
    [
        {"cube_root": 4.0},
        {"stribeck": 3.0, "stribeck_speed": 1.0},
        {
            "stribeck": 3.0,
            "stribeck_speed": 0.3,
            "cube_root": 2.0,
            "viscous": 1.0,
            "offset": 0.5,
            "coulomb_forward": 1.0,
        },
    ],
)
def test_slowing_with_uneven_friction(friction: dict[str, float]) -> None:
    """It is the fastest of a thousand slower motions that keeps the effort, and none of those below it."""
    move = quintic([0.0], [3.0], 2.0)
    free = effort_peaks(block(np.inf, **friction), move).peaks[0]
    arm = block(0.75 * free, **friction)

    found = slowing_for_efforts(arm, move)

    def use(factor: float) -> float:
        slower = move.slowed(factor)
        t = np.linspace(0, slower.duration, 4001)[1:-1]
        efforts = inverse_dynamics(arm, slower(t), slower(t, 1), slower(t, 2))
        return float(np.abs(efforts).max() / arm.limits.effort[0])

    assert found.factor > 1.05
    assert found.joint == 0
    assert use(found.factor) <= 1 + SEEN
    assert all(use(factor) > 1 for factor in np.linspace(1.0, found.factor * (1 - SEEN), 50))


def test_a_spring_in_the_way() -> None:
    """A spring takes as much however slow the motion is: where that is too much, it is told."""
    strained = block(10.0)
    joint = attrs.evolve(strained.joints[0], spring=Spring(stiffness=5.0, rest=0.0))
    strained = attrs.evolve(strained, joints=[joint])
    move = quintic([0.0], [3.0], 1.0)

    with pytest.raises(ArmwrightError, match="gravity, springs and Coulomb friction alone require 15 N of joint 1"):
        slowing_for_efforts(strained, move)
    assert slowing_for_efforts(strained, quintic([0.0], [1.0], 0.8)).factor > 1


def test_nothing_to_slow() -> None:
    """A motion inside the limits stays as it is, and so does one of an arm whose limits are not known."""
    move = quintic([0.0], [3.0], 2.0)

    assert slowing_for_efforts(block(1000.0), move) == (1.0, None, 0.0)
    assert slowing_for_efforts(block(np.inf), move) == (1.0, None, 0.0)
    assert slowing_for_efforts(lift(1000.0), hold([0.0], 1.0)).factor == 1


def test_what_no_slowing_helps() -> None:
    """What gravity and dry friction take they take at any speed: joint, time, effort and limit are named."""
    with pytest.raises(
        InvalidValueError,
        match=r"at \d\.\d{3} s gravity and Coulomb friction alone require 29\.42 N of joint 1, 29 N are allowed",
    ):
        slowing_for_efforts(lift(29.0), quintic([0.0], [1.0], 1.0))
    with pytest.raises(InvalidValueError, match="require 6 N of joint 1, 5 N are allowed"):
        slowing_for_efforts(block(5.0, coulomb_forward=6.0), quintic([0.0], [1.0], 1.0))


def test_the_way_back_of_a_lift() -> None:
    """A lift falls on its way down: fast enough it must be pulled down, beyond -limit as well as beyond limit."""
    down = quintic([1.0], [0.0], 0.2)

    found = slowing_for_efforts(lift(40.0), down)

    # The push down at the start, 3 (a - g), and the catch at the end, 3 (a + g): the catch decides.
    allowed = 40 / 3 - STANDARD_GRAVITY
    assert found.factor == pytest.approx(np.sqrt(PEAK_ACCELERATION / 0.2**2 / allowed), rel=1e-9)
    assert found.time == pytest.approx(0.2 * (0.5 + 1 / np.sqrt(12)), abs=1e-3)


def test_largest_part_of_the_speed(rng: np.random.Generator) -> None:
    """Of random shares: at the part found all limits hold, and no part of a thousand above it holds them all."""
    for _ in range(300):
        shares = _Shares(*(rng.normal(size=(4, 3)) * size for size in (0.4, 3.0, 3.0)))
        shares = shares._replace(lasting=np.clip(shares.lasting, -0.95, 0.95))
        limits = np.ones(3)

        part, binding = _largest_part(PUMA, shares, limits)

        assert np.abs(shares.at(part)).max() <= 1 + 1e-8
        for above in np.linspace(part, 1.0, 1000)[1:]:
            assert part == 1 or np.abs(shares.at(above)).max() > 1
        if binding is not None:
            assert abs(shares.at(part)[binding]) == pytest.approx(1)


def test_compiled_arms_give_the_same(rng: np.random.Generator) -> None:
    """A compiled arm finds the same peaks and the same slowing."""
    move = wild(rng, 3.0)
    plain, compiled = (slowing_for_efforts(arm, move) for arm in (PUMA, compile_arm(PUMA)))

    assert compiled.factor == pytest.approx(plain.factor, rel=1e-9)
    assert compiled.joint == plain.joint


def with_efforts(arm: Arm, efforts: Array) -> Arm:
    """Return an arm with other limits of its efforts."""
    joints = [
        attrs.evolve(joint, limits=attrs.evolve(joint.limits, effort=float(effort)))
        for joint, effort in zip(arm.joints, efforts, strict=True)
    ]
    return attrs.evolve(arm, joints=joints)


def largest_efforts(arm: Arm, motion: Trajectory) -> Array:
    """Return the largest efforts at 20,001 samples of a motion; a joint that stands has no dry friction."""
    q, qd, qdd = (motion(np.linspace(0.0, motion.duration, 20_001), order) for order in range(3))
    qd = np.where(np.abs(qd) > 1e-9 * np.abs(qd).max(axis=0), qd, 0.0)
    return np.abs(inverse_dynamics(arm, q, qd, qdd)).max(axis=0)


def test_a_peak_in_a_short_segment() -> None:
    """A line of 28 s whose joint 4 needs most of its effort in the first 0.05 s is slowed for it."""
    arm = load_arm("stanford")
    q = [-0.09116367553301963, 2.5548051222950656, 0.8509637348433636, -0.2192383721565725, 0.0, -0.9985726058719773]
    X = np.array([
        [0.506390447178793, -0.7405468106669546, 0.4417681928535191, 0.6127010789618474],
        [-0.7916464336590081, -0.6023553095365322, -0.10229371998379107, 0.058155257373951906],
        [0.3418547046349309, -0.29792365177029906, -0.891278216178772, -0.5107244693167673],
        [0.0, 0.0, 0.0, 1.0],
    ])  # fmt: skip
    limit = arm.limits.effort.copy()
    limit[3] = 1.1155

    line = straight_line(with_efforts(arm, limit), q, X, deviation=3.03e-3, rotation=1.99e-3, speed=1.0)

    assert largest_efforts(arm, line.trajectory)[3] <= limit[3] * (1 + SEEN)
    assert line.certificate.peaks["effort"][3] == pytest.approx(limit[3], rel=SEEN)


@pytest.mark.share(0.03)
def test_lines_keep_their_efforts(sample: Sample) -> None:
    """Lines of arms whose motors are about as strong as they need keep the limits of efforts between samples, too."""
    arms = [load_arm(name) for name in ("puma560", "stanford", "ur5")]
    worst, run = 0.0, 0
    for rng in sample.cases(1000):
        arm = arms[rng.integers(3)]
        lower, upper = np.maximum(arm.limits.lower, -np.pi), np.minimum(arm.limits.upper, np.pi)
        q = lower + (upper - lower) * rng.uniform(0.05, 0.95, arm.n)
        X = forward(arm, q) @ pose(rpy=rng.uniform(-0.3, 0.3, 3), position=rng.normal(size=3) * 0.15)
        speed = float(rng.choice([1.0, 10.0, 100.0, 120.0]))
        try:
            needs = largest_efforts(arm, straight_line(arm, q, X, speed=speed).trajectory)
            motion = straight_line(with_efforts(arm, needs * rng.uniform(0.75, 1.3)), q, X, speed=speed)
        except ArmwrightError:  # it cannot be followed, or the arm cannot hold itself
            continue
        weak = motion.certificate.arm
        use = (largest_efforts(weak, motion.trajectory) / weak.limits.effort).max()
        run, worst = run + 1, max(worst, float(use))
        assert use <= 1 + SEEN
    sample.record("lines of weak arms, efforts at 20,001 samples", run, 0, largest_part_of_limit=f"{worst:.4f}")


def test_bad_input() -> None:
    """An arm by its name, a motion that is none, a motion of other joints: each is refused by name."""
    move = quintic([0.0], [1.0], 1.0)
    with pytest.raises(KindError, match="arm: expected an Arm"):
        effort_peaks("puma560-seed", move)  # type: ignore[arg-type]
    with pytest.raises(KindError, match="trajectory: expected a Trajectory, got 3"):
        slowing_for_efforts(PUMA, 3)  # type: ignore[arg-type]
    with pytest.raises(ShapeError, match="trajectory: expected one of 6 joints, as 'puma560-seed' has, got one of 1"):
        effort_peaks(PUMA, move)


@pytest.mark.parametrize("rounding", [1e-16, -1e-16, 1e-13])
def test_a_joint_that_stands_has_no_friction_of_motion(rounding: float) -> None:
    """The sign of a speed that is rounding decides no effort: not of the motion, and not of its recording."""
    start, end = np.zeros(6), np.array([0.0, 0.4, 0.0, 0.3, 0.0, 0.2])
    still = quintic(start, end, 1.0)
    noisy = quintic(start, end + np.array([1.0, 0.0, -1.0, 0.0, 1.0, 0.0]) * rounding, 1.0)

    np.testing.assert_allclose(effort_peaks(PUMA, noisy).peaks, effort_peaks(PUMA, still).peaks, rtol=1e-9)
    free = ToolWrenches(0.0, np.zeros((1, 6)))
    recorded, expected = (trajectory_efforts(PUMA, each, 0.01, free) for each in (noisy, still))
    np.testing.assert_allclose(recorded, expected, rtol=0, atol=1e-9)
