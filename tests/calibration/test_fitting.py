"""Errors found from simulated points, against the errors that the simulation had."""

from itertools import count
from typing import Any, NamedTuple

import attrs
import numpy as np
import pytest
from scipy.stats import norm, t as student

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.calibration import fitting
from armwright.calibration.chain import Chain, kinematic_chain
from armwright.calibration.fitting import Calibration, calibrate_points
from armwright.calibration.initial_guess import register_base
from armwright.errors import ContradictionError, InvalidValueError, ShapeError, UnknownNameError
from armwright.spatial.rotations import angle_between
from calibration.simulated import configurations, random_arm, random_errors, random_pose, seen

# Noise of a good and of a poor laser tracker's or camera's coordinate [m].
NOISES = (2e-5, 5e-5, 1e-4)
ARMS, POINTS = 18, 80
# What rounding leaves of an arm of a metre that is found from points without noise [m].
EXACT = 1e-8


class Trial(NamedTuple):
    """A calibration of a simulated arm whose errors are known."""

    chain: Chain
    true: Array
    noise: float
    found: Calibration
    expected: tuple[int, ...]


def trial(seed: int) -> Trial:
    """Calibrate an arm of 3 to 7 joints, some of them parallel, that has those errors which its points can tell."""
    rng = np.random.default_rng(seed)
    arm = random_arm(rng, 3 + seed % 5, slides=seed % 3 == 0)
    chain, noise = kinematic_chain(arm), NOISES[seed % len(NOISES)]
    q = configurations(rng, arm, POINTS)
    none, true = np.zeros(len(chain.names)), np.zeros(len(chain.names))
    expected = calibrate_points(arm, q, seen(chain, q, none, noise, rng), base=np.eye(4)).identifiability.fitted
    true[list(expected)] = random_errors(rng, chain)[list(expected)]
    found = calibrate_points(arm, q, seen(chain, q, true, noise, rng), base=np.eye(4))
    return Trial(chain, true, noise, found, expected)


@pytest.fixture(scope="module")
def trials() -> list[Trial]:
    return [trial(seed) for seed in range(ARMS)]


def deviating(trials: list[Trial]) -> Array:
    """Return by how many of its stated deviations each error is missed, where the errors of the simulation are fitted.

    In a few arms, errors make of two that are nearly one the other the better known: there they are not comparable.
    """
    same = [one for one in trials if one.found.identifiability.fitted == one.expected]
    assert len(same) > 0.9 * ARMS
    return np.concatenate(
        [(one.found.values - one.true[list(one.expected)]) / one.found.standard_errors for one in same]
    )


@pytest.fixture
def ur5() -> Arm:
    return load_arm("ur5")


def measured(arm: Arm, rng: np.random.Generator, noise: float, m: int = 60) -> tuple[Array, Array, Array]:
    """Return configurations, what is seen of an arm with errors, and where its tool really is."""
    chain = kinematic_chain(arm)
    q, errors = configurations(rng, arm, m), random_errors(rng, chain)
    return q, seen(chain, q, errors, noise, rng), seen(chain, q, errors, 0.0, rng)


# ---- simulated arms ------------------------------------------------------------------------------------------------


def test_every_error_within_three_deviations(trials: list[Trial]) -> None:
    """Every error that can be told is found within three of its stated deviations, in 99 of 100 cases."""
    off = np.abs(deviating(trials))

    assert len(off) > 200
    assert np.mean(off < 3.0) >= 0.99


def test_intervals_cover(trials: list[Trial]) -> None:
    """An interval that should have an error in it with 90 % has it in about 90 %; with 50 %, in about 50 %."""
    off = np.abs(deviating(trials))

    for part in (0.5, 0.9):
        covered = np.mean(off < norm.ppf((1 + part) / 2))
        # Errors of one arm are correlated: five times what independent ones would vary by.
        assert covered == pytest.approx(part, abs=5 * np.sqrt(part * (1 - part) / len(off)))


def test_intervals_by_student(ur5: Arm, rng: np.random.Generator) -> None:
    """With few numbers to spare an interval is wider than the normal distribution has it, by Student's t."""
    q, points, _ = measured(ur5, rng, 3e-5, m=11)
    found = calibrate_points(ur5, q, points)

    lower, upper = found.intervals(0.9).T

    assert found.degrees_of_freedom < 12
    np.testing.assert_allclose((lower + upper) / 2, found.values, atol=EXACT)
    half = (upper - lower) / 2 / found.standard_errors
    np.testing.assert_allclose(half, student.ppf(0.95, found.degrees_of_freedom))
    assert half[0] > 1.05 * norm.ppf(0.95)
    with pytest.raises(InvalidValueError, match="confidence: expected between 0 and 1, got 95"):
        found.intervals(95)


def test_noise_is_found(trials: list[Trial]) -> None:
    """The noise that is told is that of the measurement; from 240 numbers by their median, to a third."""
    ratios = np.array([one.found.noise.length / one.noise for one in trials])

    assert np.all(np.abs(ratios - 1) < 1 / 3)
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.05)


def test_corrected_arms_are_right_elsewhere() -> None:
    """With all errors, told or not, a corrected arm is right in configurations never measured, as well as it says."""
    off, far = [], []
    for seed in range(15):
        rng = np.random.default_rng(1000 + seed)
        arm = random_arm(rng, 3 + seed % 5, slides=seed % 3 == 0)
        chain, noise = kinematic_chain(arm), NOISES[seed % len(NOISES)]
        errors, q, elsewhere = random_errors(rng, chain), configurations(rng, arm, POINTS), configurations(rng, arm, 50)
        found = calibrate_points(arm, q, seen(chain, q, errors, noise, rng), base=np.eye(4))

        missed = found.predict(elsewhere) - chain.forward(elsewhere, errors).position
        kept = list(found.identifiability.fitted)
        J = chain.forward(elsewhere, found.errors).position_jacobian[:, :, kept]
        stated = np.sqrt(np.einsum("mik,kl,mil->mi", J, found.covariance, J))
        off.append(np.abs(missed / stated).ravel())
        far.append(np.sqrt(np.mean(missed**2)) / noise)

    assert np.mean(np.concatenate(off) < norm.ppf(0.95)) == pytest.approx(0.9, abs=0.06)
    # Of 240 numbers, some 27 are used up by the errors.
    assert np.mean(far) < 1.5 * np.sqrt(27 / (3 * POINTS))


@pytest.mark.parametrize("seed", range(12))
def test_nearly_dependent_errors(seed: int) -> None:
    """In arms whose axes are all parallel, the tool's height is the base's but for small tilts; neither runs away.

    What one of two such errors could explain in place of the other, by growing to metres, is left where it is.
    """
    rng = np.random.default_rng(seed)
    arm = random_arm(rng, 3 + seed % 3)
    arm = attrs.evolve(arm, joints=[attrs.evolve(joint, alpha=0.0) for joint in arm.joints])
    chain, noise = kinematic_chain(arm), NOISES[seed % len(NOISES)]
    errors, q, elsewhere = random_errors(rng, chain), configurations(rng, arm, POINTS), configurations(rng, arm, 50)

    found = calibrate_points(arm, q, seen(chain, q, errors, noise, rng), base=np.eye(4))

    assert np.abs(found.errors).max() < 0.05
    assert found.noise.length == pytest.approx(noise, rel=0.25)
    missed = found.predict(elsewhere) - chain.forward(elsewhere, errors).position
    assert np.sqrt(np.mean(missed**2)) < 0.6 * noise


def test_no_noise(ur5: Arm, rng: np.random.Generator) -> None:
    """From points without noise, an arm is found to rounding."""
    q, points, _ = measured(ur5, rng, 0.0)

    found = calibrate_points(ur5, q, points, base=np.eye(4))

    assert found.before.distance.mean() > 1e-3
    assert found.after.distance.max() < EXACT


# ---- outliers ------------------------------------------------------------------------------------------------------


def test_outliers(ur5: Arm, rng: np.random.Generator) -> None:
    """Five points of sixty that are off by centimetres are named, and spoil a robust fit a tenth as much."""
    q, points, real = measured(ur5, rng, 3e-5)
    wrong = [3, 14, 25, 36, 47]
    points[wrong] += rng.uniform(0.01, 0.03, (5, 3)) * rng.choice([-1, 1], (5, 3))

    robust = calibrate_points(ur5, q, points, base=np.eye(4))
    plain = calibrate_points(ur5, q, points, base=np.eye(4), robust=False)

    miss = [float(np.linalg.norm(one.predict(q) - real, axis=1).mean()) for one in (robust, plain)]
    assert list(robust.outliers) == wrong
    assert miss[0] < 1e-4
    assert miss[0] < miss[1] / 10
    assert robust.noise.length == pytest.approx(3e-5, rel=0.5)


@pytest.mark.parametrize("seed", range(6))
def test_many_outliers(seed: int) -> None:
    """One point in five may be off by centimetres: all are named, and the arm is right to twice the noise."""
    rng = np.random.default_rng(seed)
    arm = random_arm(rng, 3 + seed % 5)
    chain = kinematic_chain(arm)
    errors, q, elsewhere = random_errors(rng, chain), configurations(rng, arm, 100), configurations(rng, arm, 50)
    points = seen(chain, q, errors, 5e-5, rng)
    points[:20] += rng.uniform(0.005, 0.02, (20, 3)) * rng.choice([-1, 1], (20, 3))

    found = calibrate_points(arm, q, points, base=np.eye(4))

    assert found.outliers == tuple(range(20))
    assert np.sqrt(np.mean((found.predict(elsewhere) - chain.forward(elsewhere, errors).position) ** 2)) < 2 * 5e-5


def test_outliers_do_not_count() -> None:
    """With one point in five off by centimetres, errors are missed by as much as is stated, and noise is what it was.

    Counted as little as soft L1 has it, so many outliers move errors by twice their stated deviations.
    """
    misses, noises = [], []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        arm = random_arm(rng, 3 + seed % 5)
        chain, q = kinematic_chain(arm), configurations(rng, arm, POINTS)
        none, true = np.zeros(len(chain.names)), np.zeros(len(chain.names))
        told = list(calibrate_points(arm, q, seen(chain, q, none, 5e-5, rng), base=np.eye(4)).identifiability.fitted)
        true[told] = random_errors(rng, chain)[told]
        points = seen(chain, q, true, 5e-5, rng)
        points[:16] += rng.uniform(0.005, 0.03, (16, 3)) * rng.choice([-1, 1], (16, 3))
        found = calibrate_points(arm, q, points, base=np.eye(4))
        assert found.degrees_of_freedom == 3 * (POINTS - 16) - len(found.names)
        noises.append(found.noise.length / 5e-5)
        if list(found.identifiability.fitted) == told:
            misses.append((found.values - true[told]) / found.standard_errors)

    assert len(misses) >= 8
    assert np.sqrt(np.mean(np.concatenate(misses) ** 2)) == pytest.approx(1.0, abs=0.3)
    assert np.mean(noises) == pytest.approx(1.0, abs=0.05)


def test_no_outliers(ur5: Arm, rng: np.random.Generator) -> None:
    """Points with nothing but noise have no outliers, and both fits find the same but for a part of the noise."""
    q, points, _ = measured(ur5, rng, 5e-5, m=100)

    robust = calibrate_points(ur5, q, points, base=np.eye(4))
    plain = calibrate_points(ur5, q, points, base=np.eye(4), robust=False)

    assert robust.outliers == ()
    np.testing.assert_allclose(robust.predict(q), plain.predict(q), atol=5e-5)


# ---- frames, and what is fitted ------------------------------------------------------------------------------------


@pytest.mark.parametrize("robust", [False, True])
def test_any_measuring_frame(robust: bool, ur5: Arm, rng: np.random.Generator) -> None:  # noqa: FBT001
    """A tracker that stands anywhere sees the same arm."""
    q, points, _ = measured(ur5, rng, 3e-5)
    X = random_pose(rng, 5.0)

    here = calibrate_points(ur5, q, points, robust=robust)
    there = calibrate_points(ur5, q, points @ X[:3, :3].T + X[:3, 3], robust=robust)

    assert here.names == there.names
    np.testing.assert_allclose(here.after.distance, there.after.distance, atol=EXACT)


def test_registered(ur5: Arm, rng: np.random.Generator) -> None:
    """Points of a perfect arm tell its base to rounding; what a mirror shows is brought near by a turn all the same."""
    chain, X = kinematic_chain(ur5), random_pose(rng, 5.0)
    q = configurations(rng, ur5, 10)
    points = chain.forward(q).position @ X[:3, :3].T + X[:3, 3]

    base = register_base(chain, q, points)

    np.testing.assert_allclose(base[:3, 3], X[:3, 3], atol=EXACT)
    assert angle_between(base[:3, :3], X[:3, :3]) < EXACT
    assert np.linalg.det(register_base(chain, q, points * (1, 1, -1))[:3, :3]) == pytest.approx(1.0)


def test_only(ur5: Arm, rng: np.random.Generator) -> None:
    """Only the errors that are asked for are fitted; a part such as base means all of it."""
    q, points, _ = measured(ur5, rng, 3e-5)

    found = calibrate_points(ur5, q, points, base=np.eye(4), only=["base", "joint3.a"])

    assert found.names == ("base.x", "base.y", "base.z", "base.rx", "base.ry", "base.rz", "joint3.a")
    assert all(found.errors[i] == 0.0 for i in range(len(found.errors)) if i not in found.identifiability.fitted)
    assert found.after.distance.mean() < found.before.distance.mean()


def test_one_kind_of_all_joints(ur5: Arm, rng: np.random.Generator) -> None:
    """A kind of error means that of all joints: only lengths of links, or all but the turns about y."""
    q, points, _ = measured(ur5, rng, 3e-5)

    lengths = calibrate_points(ur5, q, points, base=np.eye(4), only=["base", "a", "d"])
    without = calibrate_points(ur5, q, points, base=np.eye(4), without=["beta", "joint2.a"])

    assert {name.partition(".")[2] for name in lengths.names if name.startswith("joint")} == {"a", "d"}
    assert not [name for name in without.names if name.endswith("beta") or name == "joint2.a"]
    assert "joint3.a" in without.names


def test_without_what_there_is_not(rng: np.random.Generator) -> None:
    """Turns about y may be left out of an arm that has none; what no arm has may not."""
    arm = load_arm("puma560")
    none = attrs.evolve(arm, joints=[attrs.evolve(joint, alpha=1.0) for joint in arm.joints])
    q = configurations(rng, none, 40)
    points = seen(kinematic_chain(none), q, np.zeros(36), 3e-5, rng)

    assert calibrate_points(none, q, points, without=["beta"]).names
    with pytest.raises(UnknownNameError, match=r"no error 'thata'\. Did you mean 'theta'\?"):
        calibrate_points(none, q, points, without=["thata"])


def test_only_what_there_is_not(ur5: Arm, rng: np.random.Generator) -> None:
    """An error that there is not is refused with the nearest that there is."""
    q, points, _ = measured(ur5, rng, 3e-5)

    with pytest.raises(UnknownNameError, match=r"no error 'joint3\.aplha'\. Did you mean 'joint3\.alpha'\?"):
        calibrate_points(ur5, q, points, only=["joint3.aplha"])


def test_progress(ur5: Arm, rng: np.random.Generator) -> None:
    """What is being done is told as it is done."""
    q, points, _ = measured(ur5, rng, 3e-5)
    said: list[str] = []

    found = calibrate_points(ur5, q, points, progress=said.append)

    assert said[-1] == f"fitting {len(found.names)} errors to 60 readings"


def test_joint_that_never_moved(ur5: Arm, rng: np.random.Generator) -> None:
    """An arm of which one joint never moved is right in the configurations in which it stands like that."""
    chain = kinematic_chain(ur5)
    q, errors = configurations(rng, ur5, 80), random_errors(rng, chain)
    q[:, 3] = 0.7

    found = calibrate_points(ur5, q[:60], seen(chain, q[:60], errors, 3e-5, rng), base=np.eye(4))

    missed = np.linalg.norm(found.predict(q[60:]) - chain.forward(q[60:], errors).position, axis=1)
    assert missed.max() < 5 * 3e-5


# ---- bad input -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("factor", "words"),
    [(1e3, "millimetres read as metres"), (1e-3, "metres read as millimetres"), (1 / 0.0254, "inches")],
)
def test_other_units(factor: float, words: str, ur5: Arm, rng: np.random.Generator) -> None:
    """Points in another unit are refused with a question."""
    q, points, _ = measured(ur5, rng, 3e-5)

    with pytest.raises(ContradictionError, match=rf"as far as ur5 reaches in these configurations: are they .*{words}"):
        calibrate_points(ur5, q, points * factor)


def test_degrees_for_radians(ur5: Arm, rng: np.random.Generator) -> None:
    """Joint positions in degrees put the tool somewhere else; that is refused with a question."""
    q, points, _ = measured(ur5, rng, 3e-5)

    with pytest.raises(ContradictionError, match="are these its joints, in this order and these units"):
        calibrate_points(ur5, np.degrees(q), points)


def test_another_arm(ur5: Arm, rng: np.random.Generator) -> None:
    """Points that another arm of six joints has touched are refused."""
    q, points, _ = measured(ur5, rng, 3e-5)

    with pytest.raises(ContradictionError, match=r"median distance of the points from the tool of puma560 is .* mm"):
        calibrate_points(load_arm("puma560"), q, points)


@pytest.mark.parametrize("m", [1, 2, 5, 8])
def test_too_few(m: int, ur5: Arm, rng: np.random.Generator) -> None:
    """As few numbers as errors tell nothing of noise; more points are asked for, or fewer errors."""
    q, points, _ = measured(ur5, rng, 3e-5, m=m)

    with pytest.raises(InvalidValueError, match=rf"{3 * m} numbers for {3 * m} errors; measure more"):
        calibrate_points(ur5, q, points, base=np.eye(4))


def test_shapes(ur5: Arm) -> None:
    """As many points as configurations, each of three coordinates, and as many joints as the arm has."""
    with pytest.raises(ShapeError, match=r"points: expected \(5, 3\) points or \(5, 4, 4\) poses .* got \(4, 3\)"):
        calibrate_points(ur5, np.zeros((5, 6)), np.zeros((4, 3)))
    with pytest.raises(ShapeError, match="expected readings of 6 joints, as ur5 has, got 7"):
        calibrate_points(ur5, np.zeros((5, 7)), np.zeros((5, 3)))


@pytest.mark.parametrize(
    ("base", "words"),
    [
        (np.eye(3), r"base: expected a shape ending in \(4, 4\), got \(3, 3\)"),
        (np.ones((4, 4)), "base: expected a homogeneous transformation"),
    ],
)
def test_no_base(base: Array, words: str, ur5: Arm, rng: np.random.Generator) -> None:
    """Where the arm stands is a pose."""
    q, points, _ = measured(ur5, rng, 3e-5)

    with pytest.raises(ValueError, match=words):
        calibrate_points(ur5, q, points, base=base)


def test_not_numbers(ur5: Arm) -> None:
    """What is no number is refused."""
    points = np.zeros((5, 3))
    points[2, 1] = np.nan

    with pytest.raises(InvalidValueError, match=r"points: every number must be finite, got nan at \(2, 1\)"):
        calibrate_points(ur5, np.zeros((5, 6)), points)


def test_round_that_leaves_less_is_kept(monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator) -> None:
    """Where what is left hides errors, and what is not fitted is left, rounds lead away: the best of them counts."""
    arm = random_arm(rng, 5)
    chain = kinematic_chain(arm)
    q, errors = configurations(rng, arm, 60), random_errors(rng, chain)
    points = seen(chain, q, errors, 3e-5, rng)
    fitted, rounds = fitting._fit, count()

    def worse(*arguments: Any, **named: Any) -> Array:
        found = fitted(*arguments, **named)
        return found if next(rounds) == 0 else found + 0.005

    monkeypatch.setattr(fitting, "_fit", worse)
    found = calibrate_points(arm, q, points, robust=False)

    assert next(rounds) > 2
    assert found.after.distance.mean() < 1e-4
