"""What a certificate says of a motion, and of several that follow each other: held against what they do."""

from typing import Literal

import attrs
import numpy as np
import pytest

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, Link
from armwright.compiled.arm import compile_arm
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.branch_selection import nearest_configurations
from armwright.motion.certified_motion import CertifiedMotion, joined, limit_peaks
from armwright.motion.solver import AnyArm
from armwright.motion.straight import straight_line
from armwright.motion.trajectory import Trajectory

PUMA = load_arm("puma560-seed")
START = np.array([0.6, 0.2, 0.6, 0.3, 0.9, 0.1])


def line(arm: Arm, shift: tuple[float, float, float], start: np.ndarray = START, **manner: float) -> CertifiedMotion:
    X = forward(arm, start).copy()
    X[:3, 3] += shift
    return straight_line(arm, start, X, **manner)


def with_limit(arm: Arm, joint: int, **limits: float) -> Arm:
    """Return an arm one joint of which has other limits."""
    joints = [
        attrs.evolve(each, limits=attrs.evolve(each.limits, **limits)) if i == joint else each
        for i, each in enumerate(arm.joints)
    ]
    return attrs.evolve(arm, joints=joints)


@pytest.mark.parametrize("joint", [0, 1, 2])
@pytest.mark.parametrize("name", ["speed", "acceleration"])
def test_the_limit_that_binds(name: Literal["speed", "acceleration"], joint: int) -> None:
    """A joint that hardly moves, or hardly gathers speed, is what slows the motion, by that limit, which is used up."""
    free = line(PUMA, (0.1, -0.4, -0.28))
    least = float(free.certificate.peaks[name][joint]) / 20

    slowed = line(with_limit(PUMA, joint, **{name: least}), (0.1, -0.4, -0.28)).certificate

    assert slowed.because == (name, joint)
    assert slowed.factor > 1
    assert slowed.peaks[name][joint] == pytest.approx(least, rel=0.1)
    assert slowed.holds


def test_motions_one_after_the_other() -> None:
    """Of all that follow each other what is counted is added, and of what is measured the worst is said, in its place.

    The farthest position is where the whole motion has the tool at the time that is given.
    """
    first = line(PUMA, (0.05, -0.2, -0.14), deviation=1e-5)
    there = first.trajectory(first.trajectory.duration)
    second = line(PUMA, (0.1, -0.2, -0.14), there, deviation=1e-3)
    back = line(PUMA, (-0.1, 0.2, 0.14), second.trajectory(second.trajectory.duration), deviation=1e-4)
    # None of these lines turns back, and the one that strays most rotates most; as if it were not so.
    motions = [
        attrs.evolve(each, certificate=attrs.evolve(each.certificate, backward=backward, rotation=rotation))
        for each, backward, rotation in ((first, 1e-9, 2e-5), (second, 3e-9, 1e-5), (back, 2e-9, 3e-5))
    ]
    parts = [each.certificate for each in motions]

    whole = joined(motions)

    said = whole.certificate
    assert said.knots == sum(each.knots for each in parts)
    assert said.samples == sum(each.samples for each in parts)
    for name in ("deviation", "deviation_sampled", "rotation", "rotation_sampled", "backward", "factor"):
        assert getattr(said, name) == max(getattr(each, name) for each in parts)
    assert said.because == max(parts, key=lambda each: each.factor).because
    assert first.trajectory.duration < said.worst_time < whole.trajectory.duration
    place = forward(PUMA, whole.trajectory(said.worst_time))[:3, 3]
    np.testing.assert_allclose(said.worst_position, place, atol=1e-9)
    np.testing.assert_allclose(said.peaks["speed"], whole.trajectory.peaks(1), rtol=1e-9)
    np.testing.assert_allclose(said.peaks["acceleration"], whole.trajectory.peaks(2), rtol=1e-9)


def test_whole_ticks_of_a_certificate() -> None:
    """A motion slowed to a whole number of servo periods is certified as it is run then."""
    free = line(PUMA, (0.1, -0.4, -0.28))

    slowed = free.on_ticks(0.5)

    stretch = slowed.trajectory.duration / free.trajectory.duration
    assert stretch > 1
    assert slowed.trajectory.duration / 0.5 == pytest.approx(round(slowed.trajectory.duration / 0.5))
    np.testing.assert_allclose(slowed.certificate.peaks["speed"], slowed.trajectory.peaks(1), rtol=1e-9)
    np.testing.assert_allclose(slowed.certificate.peaks["acceleration"], slowed.trajectory.peaks(2), rtol=1e-9)
    place = forward(PUMA, slowed.trajectory(slowed.certificate.worst_time))[:3, 3]
    np.testing.assert_allclose(slowed.certificate.worst_position, place, atol=1e-9)


def test_efforts_in_the_middle_of_a_short_segment() -> None:
    """A jolt that begins and ends without force, and is over before the next of even samples, is seen."""
    mass, length = 3.0, 1e-3
    lift = Arm(
        name="block",
        joints=[Joint(kind="prismatic", limits=Limits(effort=1e9))],
        links=[Link(mass=mass)],
        gravity=(0.0, 0.0, 0.0),
    )
    # t³ (T - t)³, the size of which makes its largest acceleration, in the middle, that of free fall; then rest.
    jolt = np.polynomial.Polynomial([0, 0, 0, 1]) * np.polynomial.Polynomial([length, -1]) ** 3
    jolt *= 9.81 / abs(jolt.deriv(2)(length / 2))
    terms = np.zeros((2, 7, 1))
    terms[0, :, 0] = jolt.coef
    trajectory = Trajectory(times=np.array([0.0, length, 1.0]), coefficients=terms)

    effort = limit_peaks(lift, trajectory)["effort"]

    np.testing.assert_allclose(effort, [mass * 9.81], rtol=1e-9)


def test_configurations_nearest_first(rng: np.random.Generator) -> None:
    """Configurations of a pose come in the order of how far the joints are, each by its speed, the own one first."""
    arm = load_arm("ur5")
    for _ in range(20):
        q = rng.uniform(-3, 3, 6)
        found = nearest_configurations(inverse(arm, forward(arm, q), np.zeros(6)), q)

        away = [float((((each - q) / arm.limits.speed) ** 2).sum()) for each in found]
        assert len(found) > 1
        assert (np.diff(away) >= -1e-9).all()
        np.testing.assert_allclose(found[0], q, atol=1e-6)


@pytest.mark.parametrize("arm", [PUMA, compile_arm(PUMA)], ids=["plain", "compiled"])
def test_joints_that_stand_have_no_friction(arm: AnyArm) -> None:
    """The velocities of joints that stand are rounding, whose sign would give them Coulomb friction."""
    turned = np.zeros((1, 4, PUMA.n))
    turned[0, 0] = START
    turned[0, 2:, 4] = 0.3, -0.2
    trembling = turned.copy()
    trembling[0, 1, :4] = 1e-16, -1e-15, 1e-16, 1e-14
    still, rounded = (
        limit_peaks(arm, Trajectory(times=[0.0, 1.0], coefficients=each))["effort"] for each in (turned, trembling)
    )

    np.testing.assert_allclose(rounded, still, rtol=1e-9)
