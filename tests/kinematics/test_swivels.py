"""Seven joints: all branches at a swivel, the swivels within the limits, and which of them is taken."""

from collections.abc import Callable

import attrs
import numpy as np
import pytest

from armwright.arm.coupling import Coupling
from armwright.arm.model import Arm, Limits
from armwright.errors import InvalidValueError, KindError, UnsupportedArmError
from armwright.kinematics.forward_kinematics import forward, link_poses
from armwright.kinematics.inverse_kinematics.redundancy import swivel_intervals, swivel_of
from armwright.kinematics.inverse_kinematics.solution import Outcome
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.spatial.poses import homogeneous
from oracles.arms import random_configurations, random_pose
from oracles.published_arms import iiwa14, panda, xarm6
from samples import Sample

RESIDUAL = 1e-10
ARMS = [iiwa14, panda]


def _elsewhere(make: Callable[[], Arm], rng: np.random.Generator) -> Arm:
    return attrs.evolve(make(), base=random_pose(rng), tool=random_pose(rng))


@pytest.mark.parametrize("make", ARMS)
@pytest.mark.share(0.1)
def test_a_configuration_is_found_at_its_swivel(make: Callable[[], Arm], sample: Sample) -> None:
    """At the swivel of a configuration it is one of eight, each named otherwise, with that swivel and on the pose."""
    for rng in sample.cases(100):
        arm = _elsewhere(make, rng)
        q = random_configurations(arm, rng, 1)[0]
        swivel = float(swivel_of(arm, q))

        solution = inverse(arm, forward(arm, q), swivel=swivel)

        assert min(np.abs(branch.q - q).max() for branch in solution) < 1e-6
        assert len({branch.label for branch in solution}) == len(solution.branches) <= 8
        for branch in solution:
            assert branch.swivel == pytest.approx(swivel)
            assert np.cos(swivel_of(arm, branch.q) - swivel) == pytest.approx(1)
            assert max(branch.position_error, branch.rotation_error) < RESIDUAL
    sample.record(f"configurations of {make.__name__} found at their swivels", sample.count(100), 0)


def test_the_swivel_is_the_angle_of_the_elbow(rng: np.random.Generator) -> None:
    """Measured by the places of shoulder, elbow and wrist: from the plane of the first axis, about the line between."""
    arm = iiwa14()
    for q in random_configurations(arm, rng, 20):
        places = link_poses(arm, q)[:, :3, 3]
        shoulder, elbow, wrist = places[2], places[3], places[5]
        line = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
        above = np.array((0, 0, 1.0)) - line[2] * line
        beside = elbow - shoulder - line * ((elbow - shoulder) @ line)
        angle = np.arctan2(line @ np.cross(above, beside), above @ beside)

        assert np.cos(angle - swivel_of(arm, q)) == pytest.approx(1)


@pytest.mark.parametrize("make", ARMS)
@pytest.mark.share(0.1)
def test_intervals_are_the_swivels_within_the_limits(make: Callable[[], Arm], sample: Sample) -> None:
    """Of 200 swivels of each branch those in the intervals are within the limits, and no others."""
    tried = 0
    for rng in sample.cases(30):
        arm = _elsewhere(make, rng)
        X = forward(arm, random_configurations(arm, rng, 1)[0])
        intervals = swivel_intervals(arm, X)
        assert intervals
        last = arm.joints[6].limits
        low, high = (-np.pi, np.pi) if make is iiwa14 else (last.lower, last.upper)
        for swivel in rng.uniform(low, high, size=25):
            allowed = {branch.label for branch in inverse(arm, X, swivel=swivel).allowed}
            images = (swivel - 2 * np.pi, swivel, swivel + 2 * np.pi) if make is iiwa14 else (swivel,)
            inside = {one.label for one in intervals if any(one.lower <= x <= one.upper for x in images)}
            assert allowed == inside
            tried += 8
    sample.record(f"swivels of {make.__name__} in and out of intervals", tried, 0)


@pytest.mark.share(0.2)
def test_intervals_are_the_swivels_within_the_limits_of_drives(sample: Sample) -> None:
    """Of an arm with a geared wrist, whose last drive has limits: inside an interval it keeps them, outside not."""
    arm, C = iiwa14(), np.eye(7)
    C[6, 5] = -1.0
    drive = Limits(lower=-0.6, upper=0.8)
    arm = attrs.evolve(arm, coupling=Coupling(matrix=C, limits=[*[Limits()] * 6, drive]))
    for rng in sample.cases(20):
        q = random_configurations(arm, rng, 1)[0]
        q[6] = rng.uniform(drive.lower, drive.upper) - q[5]
        if abs(q[6]) > arm.limits.upper[6]:
            continue
        X = forward(arm, q)

        intervals = swivel_intervals(arm, X, q)

        here = float(swivel_of(arm, q))
        assert any(one.lower - 1e-6 <= here <= one.upper + 1e-6 for one in intervals)
        for word in ("nearest", "middle", "farthest"):
            assert inverse(arm, X, q, swivel=word).allowed
        for swivel in rng.uniform(-np.pi, np.pi, size=10):
            if min(abs(swivel - end) for one in intervals for end in (one.lower, one.upper)) > 1e-3:
                inside = {one.label for one in intervals if one.lower <= swivel <= one.upper}
                assert {branch.label for branch in inverse(arm, X, q, swivel=swivel).allowed} == inside


@pytest.mark.parametrize("make", ARMS)
def test_intervals_end_where_a_joint_is_at_its_limit(make: Callable[[], Arm], rng: np.random.Generator) -> None:
    """A hair beyond the end of an interval a joint is outside its limits or the branch is gone; a hair before, not."""
    arm = make()
    for q in random_configurations(arm, rng, 3):
        X = forward(arm, q)
        every = swivel_intervals(arm, X)
        for interval in (one for one in every if one.upper - one.lower > 1e-3):
            for end, hair in ((interval.lower, 1e-4), (interval.upper, -1e-4)):
                inside = {branch.label for branch in inverse(arm, X, swivel=end + hair).allowed}
                outside = {branch.label for branch in inverse(arm, X, swivel=end - hair).allowed}
                whole = interval.upper - interval.lower > 2 * np.pi - 1e-9
                touching = any(
                    one is not interval
                    and one.label == interval.label
                    and np.cos(one.lower - end) + np.cos(one.upper - end) > 2 - 1e-7
                    for one in every
                )
                assert interval.label in inside
                assert interval.label not in outside or whole or touching


@pytest.mark.parametrize("make", ARMS)
def test_which_swivel_is_taken(make: Callable[[], Arm], rng: np.random.Generator) -> None:
    """The nearest moves no farther than it must, the middle is the middle, the farthest has the most room of all."""
    arm = make()

    def room(q: np.ndarray) -> float:
        half = (arm.limits.upper - arm.limits.lower) / 2
        return float(((half - np.abs(q - (arm.limits.upper + arm.limits.lower) / 2)) / half).min())

    for q in random_configurations(arm, rng, 2):
        X = forward(arm, q)
        intervals = swivel_intervals(arm, X, q)

        here = inverse(arm, X, q)
        np.testing.assert_allclose(here.best.q, q, atol=1e-6)
        for branch in inverse(arm, X, q, swivel="middle").allowed:
            widest = max((one for one in intervals if one.label == branch.label), key=lambda one: one.upper - one.lower)
            assert np.cos(branch.swivel - (widest.lower + widest.upper) / 2) == pytest.approx(1)
        most = max(room(branch.q) for branch in inverse(arm, X, q, swivel="farthest").allowed)
        for one in intervals:
            for swivel in np.linspace(one.lower, one.upper, 7)[1:-1]:
                other = next(b for b in inverse(arm, X, q, swivel=float(swivel)) if b.label == one.label)
                assert most >= room(other.q) - 1e-6


def test_limits_that_a_swivel_passes_are_kept() -> None:
    """Where the present swivel takes joint 3 past its limit the elbow swivels until it is at the limit, and no more."""
    arm = iiwa14()
    q = np.array([0.2, 0.6, 0.5, -1.2, 0.3, 0.9, 0.1])
    narrow = Limits(lower=-0.4, upper=0.4)
    joints = [attrs.evolve(joint, limits=narrow) if i == 2 else joint for i, joint in enumerate(arm.joints)]
    arm = attrs.evolve(arm, joints=joints)

    best = inverse(arm, forward(arm, q), q).best

    assert best.q[2] == pytest.approx(0.4)
    np.testing.assert_allclose(forward(arm, best.q), forward(arm, q), atol=RESIDUAL)


def test_an_arm_stretched_out() -> None:
    """Shoulder, elbow and wrist on one line: the edge of the reach, exactly, and 100 mm beyond it out of reach."""
    arm = iiwa14()
    q = np.array([0.2, 0.6, 0.5, 0.0, 0.3, 0.9, 0.1])
    X = forward(arm, q)

    solution = inverse(arm, X, q)

    assert solution.outcome is Outcome.SOLVED
    assert all(branch.position_error < RESIDUAL for branch in solution)
    places = link_poses(arm, q)[:, :3, 3]
    beyond = X.copy()
    beyond[:3, 3] += 0.1 * (places[5] - places[2]) / np.linalg.norm(places[5] - places[2])
    assert inverse(arm, beyond, q).outcome is Outcome.OUT_OF_REACH


def test_wrist_above_the_first_axis(rng: np.random.Generator) -> None:
    """With the wrist straight above the shoulder the swivel counts from another plane, and the pose is held."""
    arm = iiwa14()
    X = homogeneous(np.eye(3), (0.0, 0.0, 0.36 + 0.6 + 0.126))

    solution = inverse(arm, X, rng.normal(scale=0.3, size=7))

    assert solution.outcome is Outcome.SOLVED
    assert all(branch.position_error < RESIDUAL for branch in solution)


def test_what_is_no_swivel() -> None:
    """Another word, a number that is none, and an arm without a joint too many are told what is expected."""
    arm = iiwa14()
    X = forward(arm, [0.2, 0.6, 0.5, -1.0, 0.3, 0.9, 0.1])
    with pytest.raises(InvalidValueError, match="swivel: expected a number or one of nearest, middle, farthest, got"):
        inverse(arm, X, swivel="best")  # type: ignore[arg-type]
    with pytest.raises(InvalidValueError, match="swivel: expected a finite number, got nan"):
        inverse(arm, X, swivel=float("nan"))
    with pytest.raises(KindError, match="swivel: expected a"):
        inverse(arm, X, swivel=None)  # type: ignore[arg-type]
    for ask in (lambda: swivel_of(xarm6(), np.zeros(6)), lambda: swivel_intervals(xarm6(), np.eye(4))):
        with pytest.raises(UnsupportedArmError, match="'xarm6' has no swivel; expected an arm of 7 joints"):
            ask()
