"""What is not geometry: found where it is, and refused where it is not."""

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.calibration.chain import JointErrorModel, kinematic_chain
from armwright.calibration.correction import corrected_arm
from armwright.calibration.cross_validation import random_folds
from armwright.calibration.fitting import calibrate
from armwright.calibration.joint_errors import compliances, largest_gravity_loads, transmission_errors
from armwright.calibration.nongeometric import calibrate_nongeometric, compare_held_out
from armwright.calibration.readings import Readings, readings
from armwright.dynamics.shares import gravity_efforts
from armwright.errors import InvalidValueError
from calibration.simulated import configurations, random_arm, random_errors

pytestmark = [pytest.mark.early, pytest.mark.part(0.1)]

NOISE = 3e-5
# What joints give under the largest effort of gravity, and half the swing of gears [rad].
SAG, SWING = 1e-3, 5e-4


@pytest.fixture
def puma() -> Arm:
    return load_arm("puma560")


def measured(
    arm: Arm, rng: np.random.Generator, bends: tuple[JointErrorModel, ...], by: float, m: int = 200
) -> tuple[Readings, Array]:
    """Return points seen of an arm whose joints bend, and by how much each does."""
    chain = kinematic_chain(arm, joint_errors=bends)
    errors = random_errors(rng, chain)
    bent = by * rng.uniform(0.5, 1.0, len(bends))
    errors[len(errors) - len(bends) :] = bent
    q = configurations(rng, arm, m)
    return readings(q, chain.forward(q, errors).position + NOISE * rng.standard_normal((m, 3))), np.asarray(bent)


def test_springs_are_found(puma: Arm, rng: np.random.Generator) -> None:
    """Joints that give under their load are told from geometry, and how much they give; gears that run true are not."""
    seen, bent = measured(puma, rng, compliances(puma), SAG, m=90)

    found = calibrate_nongeometric(puma, seen, folds=3)

    kept = {one.name for one in found.comparisons if one.accepted}
    assert kept == {"geometry", "joint compliance under gravity"}
    fitted = found.calibration
    values = dict(zip(fitted.names, zip(fitted.values, fitted.standard_errors, strict=True), strict=True))
    for bend, true in zip(compliances(puma), bent, strict=True):
        if bend.name in values:
            value, deviation = values[bend.name]
            assert abs(value - true) < 4 * deviation
    assert "joint2.sag" in values
    assert found.held_out.distance.mean() < 2.5 * NOISE
    assert found.comparisons[0].held_out is not None
    assert found.comparisons[0].held_out > 3 * NOISE


def test_gears_are_found(puma: Arm, rng: np.random.Generator) -> None:
    """Gears that run out of true once a turn are told, and springs that are not there are not."""
    seen, _ = measured(puma, rng, transmission_errors(puma, 1), SWING, m=90)

    found = calibrate_nongeometric(puma, seen, folds=3)

    assert [one.name for one in found.comparisons if one.accepted] == ["geometry", "transmission error, first harmonic"]
    assert {"joint2.sin1", "joint3.cos1"} <= set(found.calibration.names)
    assert found.held_out.distance.mean() < 2.5 * NOISE


def test_what_is_left_is_learnt(puma: Arm, rng: np.random.Generator) -> None:
    """What no model of ours has, such as a link that bends with the configuration, is learnt as far as points show."""
    seen, _ = measured(puma, rng, (), 0.0, m=130)
    q = seen.q
    strange = 4e-4 * np.stack([np.sin(q[:, 1]) * np.cos(q[:, 2]), np.cos(q[:, 1] + q[:, 3]), np.sin(2 * q[:, 0])], 1)
    seen = attrs.evolve(seen, points=seen.points + strange)

    found = calibrate_nongeometric(puma, seen, folds=3)

    first, last = found.comparisons[0].held_out, found.comparisons[-1]
    assert last.accepted
    assert last.held_out is not None
    assert first is not None
    assert last.held_out < 0.5 * first
    assert np.linalg.norm(found.predict(q) - seen.points, axis=1).mean() < last.held_out


def test_nothing_there(puma: Arm, rng: np.random.Generator) -> None:
    """Of an arm that is nothing but geometry, nothing else is kept."""
    seen, _ = measured(puma, rng, (), 0.0, m=100)

    found = calibrate_nongeometric(puma, seen, folds=3)

    assert [one.name for one in found.comparisons if one.accepted] == ["geometry"]
    assert found.residual_model is None
    np.testing.assert_array_equal(found.predict(seen.q), found.calibration.predict(seen.q))


def test_no_choice_has_seen_them(rng: np.random.Generator) -> None:
    """Where readings are predicted, choice included, does not depend on what was measured in them."""
    arm = random_arm(rng, 2)
    seen, _ = measured(arm, rng, transmission_errors(arm, 1), SWING, m=21)
    part = random_folds(seen.q, 3, 0)[0]
    other = attrs.evolve(seen, points=seen.points + 2e-3 * part[:, None] * rng.standard_normal(seen.points.shape))

    first, second = (calibrate_nongeometric(arm, one, folds=3, nested=True).nested for one in (seen, other))

    assert first is not None
    assert second is not None
    np.testing.assert_array_equal(first.positions[part], second.positions[part])
    assert np.isfinite(first.distance).all()
    assert second.distance[part].mean() > 2 * first.distance[part].mean()


def test_two_parts_leave_no_choice(rng: np.random.Generator) -> None:
    """With two parts there is nothing to choose by once one is left out: no figure is told."""
    arm = random_arm(rng, 3)
    seen, _ = measured(arm, rng, (), 0.0, m=30)

    assert calibrate_nongeometric(arm, seen, folds=2, nested=True).nested is None


def test_readings_of_one_configuration_count_once(rng: np.random.Generator) -> None:
    """An arm that is sent to a configuration four times is off by the same each time: chance is no smaller for that."""
    before, after = rng.normal(1e-4, 1e-5, (2, 40))
    once = compare_held_out("", before, after, np.arange(40))
    often = compare_held_out("", *(np.repeat(one, 4) for one in (before, after)), np.repeat(np.arange(40), 4))

    assert once.standard_error == pytest.approx((before - after).std(ddof=1) / np.sqrt(40), rel=1e-9)
    assert often.standard_error == pytest.approx(once.standard_error, rel=1e-9)
    assert often.gain == pytest.approx(once.gain, abs=1e-18)


def test_no_masses(puma: Arm, rng: np.random.Generator) -> None:
    """An arm whose masses are not known has no springs; that is said."""
    bare = attrs.evolve(puma, links=[attrs.evolve(link, mass=0.0, inertia=np.zeros((3, 3))) for link in puma.links])
    seen, _ = measured(bare, rng, (), 0.0, m=80)

    tried = {one.name: one for one in calibrate_nongeometric(bare, seen, folds=3).comparisons}

    assert compliances(bare) == ()
    assert tried["joint compliance under gravity"].reason == "puma560 has no masses"
    assert tried["joint compliance under gravity"].held_out is None


def test_springs_follow_gravity(puma: Arm, rng: np.random.Generator) -> None:
    """A spring gives against the effort that holds its joint; a joint about the vertical has none."""
    q = configurations(rng, puma, 20)
    by_name = {bend.name: bend for bend in compliances(puma)}

    assert "joint1.sag" not in by_name
    expected = -gravity_efforts(puma, q)[:, 1] / largest_gravity_loads(puma)[1, 2]
    np.testing.assert_allclose(by_name["joint2.sag"].law(q, np.zeros((20, 4))), expected, rtol=1e-12)


def test_needs_points(puma: Arm, rng: np.random.Generator) -> None:
    """Without a point there is nothing to see what is left on."""
    q = configurations(rng, puma, 20)

    with pytest.raises(InvalidValueError, match="expected points in the measuring frame"):
        calibrate_nongeometric(puma, readings(q, plane=["table"] * 20))


def test_bends_do_not_fit_a_table(puma: Arm, rng: np.random.Generator) -> None:
    """An arm file has no number for a joint that gives."""
    seen, _ = measured(puma, rng, compliances(puma), SAG)
    found = calibrate(puma, seen, joint_errors=compliances(puma), without=("beta",))

    with pytest.raises(InvalidValueError, match=r"joint2\.sag.* depend on the configuration, which no table holds"):
        corrected_arm(found)
