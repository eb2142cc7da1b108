"""Lives of joints: makers' figures, plain simulation of repeatability, coverage of updated rates."""

import numpy as np
import pytest
from scipy.stats import norm

from armwright.arm.load import load_arm
from armwright.arm.positions import ranges
from armwright.errors import InvalidValueError, ShapeError
from armwright.kinematics.jacobians import jacobian
from armwright.reliability.play_life import PlayLife, WearRates, play_life, repeatability_factors
from armwright.reliability.reducer_life import BALLS, ROLLERS, Rating, joint_speed, life_hours, load_of
from armwright.reliability.wear_update import RatePosterior, updated_rate
from samples import Sample

PUMA = load_arm("puma560")
# A cycle of a published selection of a strain wave gear: start, run, stop, rest.
TIME = [0, 0.2, 0.2 + 1e-9, 3.2, 3.2 + 1e-9, 3.5]
EFFORT, SPEED = [150, 150, 82, 82, 130, 130], np.array([10, 10, 20, 20, 10, 10]) * 2 * np.pi / 60


def rate_after(first: float, cycles: object, plays: object, errors: object) -> RatePosterior:
    """What measurements leave of a prior with the median 1e-11."""
    return updated_rate(median=1e-11, spread=0.5, first=first, cycles=cycles, plays=plays, errors=errors)


def test_published_selection() -> None:
    """The mean torque is the published one, 89 N m, and the mean speed that of the cycle with its rest."""
    load = load_of(TIME, SPEED, EFFORT, dwell=0.2)
    assert load.mean_effort == pytest.approx(89, abs=0.5)
    assert load.mean_effort == pytest.approx(np.cbrt((2 * 150**3 + 60 * 82**3 + 3 * 130**3) / 65), rel=1e-6)
    assert load.mean_speed == pytest.approx(65 / 3.7 * 2 * np.pi / 60, rel=1e-6)
    assert load.largest_effort == 150
    assert load.rms_effort == pytest.approx(np.sqrt((0.2 * 150**2 + 3 * 82**2 + 0.3 * 130**2) / 3.7), rel=1e-6)


def test_law_of_life() -> None:
    """Half the torque gives eight times the life, half the speed twice, and rollers ten thirds as exponent."""
    rating = Rating(effort=100.0, speed=joint_speed(2000, 100), hours=35_000)
    at_rating = load_of([0, 1], [joint_speed(2000, 100)] * 2, [100, 100])
    half = load_of([0, 1], [joint_speed(2000, 100)] * 2, [50, -50])
    slow = load_of([0, 1], [-joint_speed(1000, 100)] * 2, [100, 100])
    assert life_hours(rating, at_rating) == pytest.approx(35_000)
    assert life_hours(rating, half) == pytest.approx(8 * 35_000)
    assert life_hours(rating, slow) == pytest.approx(2 * 35_000)
    rollers = Rating(effort=100.0, speed=1.0, hours=1000, exponent=ROLLERS)
    assert life_hours(rollers, load_of([0, 1], [1, 1], [50, 50], exponent=ROLLERS)) == pytest.approx(
        1000 * 2 ** (10 / 3)
    )
    assert life_hours(rating, load_of([0, 1], [0, 0], [50, 50])) == np.inf


@pytest.mark.parametrize(("exponent", "life_factor", "speed_factor"), [(BALLS, 5.4, 0.082), (ROLLERS, 4.6, 0.106)])
def test_scales_of_a_catalogue(exponent: float, life_factor: float, speed_factor: float) -> None:
    """At 60 000 rev/min a bearing whose C/P is the life factor by the speed factor lives 80 000 h.

    The factors are read off the printed scales of NTN's catalogue of rolling bearings, table 3.1, to their digits. The
    load rating C is for a million revolutions: 500 h at 33.3 rev/min.
    """
    rating = Rating(effort=life_factor / speed_factor, speed=joint_speed(100, 3), hours=500, exponent=exponent)
    load = load_of([0, 1], [joint_speed(60_000, 1)] * 2, [1, 1], exponent=exponent)
    assert life_hours(rating, load) == pytest.approx(80_000, rel=0.05)


def test_repeatability_of_play(rng: np.random.Generator) -> None:
    """The factor times the root of the trace is RP of simulated visits by the characteristics of ISO 9283."""
    q, play = rng.uniform(*ranges(PUMA), size=(3, 6)), rng.uniform(0, 1e-4, 6)
    factors = repeatability_factors(PUMA, q, play)
    for pose, factor in zip(q, factors, strict=True):
        J = jacobian(PUMA, pose)[:3]
        visits = rng.uniform(-0.5, 0.5, (20_000, 6)) * play @ J.T
        trace = np.trace(J @ np.diag(play**2 / 12) @ J.T)
        centred = np.linalg.norm(visits - visits.mean(axis=0), axis=1)
        assert factor * np.sqrt(trace) == pytest.approx(centred.mean() + 3 * centred.std(ddof=1), rel=0.02)
        assert 1.7 < factor < 2.4


def test_lognormal_life() -> None:
    """One joint that wears from zero has a lognormal life, its median where RP of the median rate meets the limit."""
    q = np.array([0.3, -0.4, 0.5, 0.1, 0.7, 0.2])
    rates = WearRates(median=np.array([0, 2e-11, 0, 0, 0, 0]), spread=np.full(6, 0.5))
    life = play_life(PUMA, q, 0.0, rates, 1e-4, samples=200_000, seed=1)
    factor = repeatability_factors(PUMA, q, rates.median)[0]
    arm_length = np.linalg.norm(jacobian(PUMA, q)[:3, 1])
    median = 1e-4 / (factor * arm_length / np.sqrt(12) * 2e-11)
    assert life.quantile(0.5) == pytest.approx(median, rel=0.01)
    assert life.quantile(0.1) == pytest.approx(median * np.exp(0.5 * norm.ppf(0.1)), rel=0.01)
    np.testing.assert_allclose(life.shares, [0, 1, 0, 0, 0, 0])


def test_published_life() -> None:
    """Clearance that grows by k F s / (R b) per stroke reaches 0.05 mm as published: 5.405e6 and 2.848e6 strokes."""
    rng = np.random.default_rng(0)
    rates = WearRates(median=np.array([1e-5 * 0.185 / (10 * 20)]), spread=np.array([0.5])).sample(400_000, rng)
    strokes = 0.05 / rates[:, 0]
    assert np.median(strokes) == pytest.approx(5.405e6, rel=5e-3)
    assert np.quantile(strokes, 0.1) == pytest.approx(2.848e6, rel=5e-3)


def test_ends_of_life() -> None:
    """A new arm beyond the limit has no cycles; one that does not wear lives for ever."""
    q, none = np.array([0.3, -0.4, 0.5, 0.1, 0.7, 0.2]), WearRates(median=np.zeros(6), spread=np.zeros(6))
    assert (play_life(PUMA, q, 1e-3, none, 1e-4).cycles == 0).all()
    assert (play_life(PUMA, q, 1e-6, none, 1e-4).cycles == np.inf).all()
    assert (play_life(PUMA, q, 0.0, none, 1e-4).cycles == np.inf).all()


@pytest.mark.proof
@pytest.mark.share(0.1)
def test_updated_rates_cover(sample: Sample) -> None:
    """Intervals of ninety per cent hold the rate of 88 to 92 % of random joints, their plays measured three times."""
    held = 0
    for rng in sample.cases(3000):
        rate = 1e-11 * np.exp(0.5 * rng.normal())
        cycles, errors = np.array([1e6, 2e6, 4e6]), np.full(3, 10 ** rng.uniform(-7, -4.5))
        plays = 20e-6 + rate * cycles + errors * rng.normal(size=3)
        found = rate_after(20e-6, cycles, plays, errors)
        held += found.quantile(0.05) <= rate <= found.quantile(0.95)
    count = sample.count(3000)
    sample.record("intervals of ninety per cent that hold the wear rate", count, count - held)
    assert abs(held / count - 0.9) < 0.02 + 4 * np.sqrt(0.09 / count) * (not sample.whole)


def test_measurements_sharpen_a_rate() -> None:
    """Exact measurements give the rate, none leave the prior."""
    prior = rate_after(0.0, [], [], [])
    assert prior.median == pytest.approx(1e-11, rel=1e-3)
    assert prior.spread == pytest.approx(0.5, rel=1e-3)
    sharp = rate_after(1e-6, [1e7], [1e-6 + 3e-11 * 1e7], [1e-9])
    assert sharp.median == pytest.approx(3e-11, rel=1e-4)
    assert sharp.spread == pytest.approx(1e-9 / 3e-4, rel=0.01)


def test_bad_numbers() -> None:
    """What no motion, no wear and no measurement has is refused."""
    with pytest.raises(InvalidValueError, match="times that increase"):
        load_of([0, 0], [1, 1], [1, 1])
    with pytest.raises(ShapeError):
        load_of([0, 1], [1], [1, 1])
    with pytest.raises(InvalidValueError, match="dwell"):
        load_of([0, 1], [1, 1], [1, 1], dwell=-1)
    with pytest.raises(InvalidValueError, match="wear rates"):
        WearRates(median=np.array([-1.0]), spread=np.array([0.1]))
    with pytest.raises(ShapeError, match="wear rates"):
        WearRates(median=[1e-9, 1e-9], spread=0.1)
    with pytest.raises(ShapeError, match="one per joint, 6, got 2"):
        play_life(PUMA, np.zeros(6), 1e-6, WearRates(median=[1e-9, 1e-9], spread=[0.1, 0.1]), 1e-4)
    with pytest.raises(InvalidValueError, match="play"):
        play_life(PUMA, np.zeros(6), -1e-6, WearRates(median=np.zeros(6), spread=np.zeros(6)), 1e-4)
    with pytest.raises(InvalidValueError, match="first"):
        rate_after(-1.0, [], [], [])
    life = PlayLife(np.ones(3), *[np.ones(1)] * 3, 0, np.ones((3, 1)))
    for quantile in (rate_after(0.0, [], [], []).quantile, life.quantile):
        with pytest.raises(InvalidValueError, match="expected 0 to 1, got nan"):
            quantile(np.nan)
    with pytest.raises(InvalidValueError, match="peak: expected more than 0"):
        Rating(effort=1, speed=1, hours=1, peak=-1)
    with pytest.raises(InvalidValueError, match="errors above 0"):
        rate_after(0.0, [1.0], [1.0], [0.0])
