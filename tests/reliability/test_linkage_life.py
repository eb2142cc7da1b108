"""Lives of linkages that wear: closed forms, a grid posterior, complete wear, and the coverage of intervals."""

from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm

from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import named_path
from armwright.clearance.poses import closed_at_tips
from armwright.clearance.reader import load_linkage
from armwright.clearance.wear.life import wear_life
from armwright.clearance.wear.worn_stroke import Stroke
from armwright.clearance.wear.worn_surfaces import WearLaw
from armwright.errors import FileFormatError, InvalidValueError
from armwright.reliability.linkage_errors import RandomClearances, RandomLinkage
from armwright.reliability.linkage_life import LinkageLife
from armwright.reliability.linkage_wear import GapGrowth, WearingLinkage
from armwright.reliability.wear_measurements import (
    WearMeasurement,
    measured_residuals,
    read_wear_measurements,
)
from armwright.reliability.wear_update import updated_rate
from armwright.reliability.weighted_draws import draw
from samples import Sample

# Of the published life: median and spread of k, and force times sliding distance of J2.
K, SPREAD, WORK, WIDTH = 1e-14, 0.5, 0.185, 0.02
MEAN = np.array([0.328, 0.171, 0.483]) * 1e-3
# Of the simulated lives; written before they were simulated for the first time.
SEED = 20_261_127


@cache
def five_bar() -> Linkage:
    return load_linkage("five-bar")


def wearing(
    deviation: float = 0.0, *, spread: float = SPREAD, each: bool = False, work: tuple[float, ...] = (WORK, 0.0, 0.0)
) -> WearingLinkage:
    """The five-bar at Q1, whose pins wear evenly on an arc of 1 rad."""
    clearances = RandomClearances(mean=MEAN, covariance=np.eye(3) * deviation**2)
    random = RandomLinkage.at(five_bar(), closed_at_tips(five_bar(), [(-0.18, -0.6)]), clearances)
    growth = GapGrowth.even(random, np.array(work), arc=1.0, width=WIDTH)
    return WearingLinkage(random=random, growth=growth, median=K, spread=spread, each=each)


def test_published_life() -> None:
    """0.05 mm of J2 are worn after 5.405e6 strokes in the median, and after 2.848e6 by one in ten: a lognormal life."""
    linkage = wearing()
    worn = MEAN + np.array([5e-5, 0, 0])
    limit = float(np.linalg.norm(linkage.random.errors(worn[None], np.zeros((1, 0)))))

    life = LinkageLife.of(linkage, "error", limit, draw(linkage.size, samples=16_384))

    exact = linkage.lives("error", limit, np.zeros((1, 4)))[0]
    assert exact == pytest.approx(5.405e6, rel=1e-4)
    assert linkage.lives("error", limit, np.array([[0, 0, 0, norm.isf(0.1)]]))[0] == pytest.approx(2.848e6, rel=2e-4)
    for part in (0.05, 0.1, 0.5, 0.9, 0.95):
        expected = exact * np.exp(SPREAD * norm.ppf(part))
        error = life.draws.quantile_error(life.strokes, part)
        assert life.quantile(part) == pytest.approx(expected, abs=5 * error)
        assert error < 5e-3 * expected
    # The probability of early failures, by the draws and by importance sampling into the tail.
    probability, error = life.probability(float(exact * np.exp(-3 * SPREAD)))
    assert probability == pytest.approx(norm.sf(3), abs=5 * error)
    for away in (3, 5.6):
        found = linkage.error_after(float(exact * np.exp(-away * SPREAD))).path_probability(limit, samples=5000)
        assert found.probability == pytest.approx(norm.sf(away), abs=5 * found.standard_error)
        assert found.standard_error < 0.05 * found.probability
    assert life.pin_parts() == pytest.approx([1, 0, 0])
    np.testing.assert_allclose(life.values(np.array([exact]))[1], limit, rtol=1e-3)


@pytest.mark.parametrize("each", [False, True])
def test_intervals_for_the_wear_coefficient(*, each: bool) -> None:
    """Ends of the 90 % interval of a quantile are that quantile with the coefficient at its 95 and its 5 % quantile."""
    linkage = wearing(1e-5, each=each)
    worn = MEAN + np.array([5e-5, 0, 0])
    limit = float(np.linalg.norm(linkage.random.errors(worn[None], np.zeros((1, 0)))))
    life = LinkageLife.of(linkage, "error", limit, draw(linkage.size, samples=16_384))
    # Only J2 wears, so that its coefficient is the one that counts.
    z = np.random.default_rng(1).normal(size=(20_000, linkage.size))
    z[:, 3:] = 0
    strokes = linkage.lives("error", limit, z)
    for part in (0.1, 0.5, 0.95):
        expected = np.quantile(strokes, part) * np.exp(SPREAD * norm.ppf([0.05, 0.95]))
        np.testing.assert_allclose(life.interval(part), expected, rtol=0.05)


def test_measures_at_the_end_of_lives(rng: np.random.Generator) -> None:
    """Where a life ends the measure is its limit; before it no pose is beyond it."""
    linkage = wearing(2e-5, each=True, work=(0.14, 0.015, 0.09))
    z = rng.normal(size=(200, linkage.size))
    for name, limit in (("error", 7e-4), ("RP", 4e-5)):
        lives = linkage.lives(name, limit, z)  # type: ignore[arg-type]
        values = linkage.measure(name, z, lives).max(axis=1)  # type: ignore[arg-type]
        np.testing.assert_allclose(values[lives > 0], limit, rtol=1e-6)
        assert (linkage.measure(name, z, 0.9 * lives).max(axis=1) < limit)[lives > 0].all()  # type: ignore[arg-type]
    assert (linkage.lives("error", 1e-4, z) == 0).all()
    assert np.isinf(linkage.lives("error", 1e15, z)).all()


def test_repeatability() -> None:
    """RP of the new linkage is that of thirty thousand visits, with journals anywhere in their friction cones."""
    linkage = wearing()
    random = linkage.random
    cone = np.arctan(five_bar().material.friction)
    tilts = np.random.default_rng(5).uniform(-cone, cone, (30_000, 3))
    tips = (tilts * MEAN) @ random.across[0].T
    sizes = np.linalg.norm(tips - tips.mean(axis=0), axis=1)
    expected = sizes.mean() + 3 * sizes.std(ddof=1)
    assert linkage.repeatability(np.zeros((1, 4)), np.zeros(1))[0, 0] == pytest.approx(expected, rel=0.01)


def test_update_of_one_rate() -> None:
    """Measured clearances of one pin give the posterior of a grid over the rate."""
    linkage = wearing(spread=1.0)
    rate = K * WORK / (0.01 * WIDTH)
    measured = [WearMeasurement(n, "J2", MEAN[0] + 1.6 * rate * n, 4e-6) for n in (1e6, 3e6)]

    draws = draw(linkage.size, partial(measured_residuals, linkage, measured))

    exact = updated_rate(
        median=rate,
        spread=1.0,
        first=MEAN[0],
        cycles=[each.strokes for each in measured],
        plays=[each.value for each in measured],
        errors=[each.error for each in measured],
    )
    found = linkage.coefficients(draws.z)[:, 0] * WORK / (0.01 * WIDTH)
    for part in (0.05, 0.5, 0.95):
        assert draws.quantile(found, part) == pytest.approx(exact.quantile(part), rel=5e-3)
    assert draws.effective > 0.5 * len(draws.z)


def test_every_measure_tells() -> None:
    """AP, RP or clearances of a worn linkage, exactly measured, lead to its wear coefficient."""
    linkage, truth = wearing(1e-6, work=(0.14, 0.015, 0.09)), 1.3
    z = np.array([[0.0, 0, 0, truth]])
    strokes = np.array([3e6])
    values = {
        "AP": linkage.errors(z, strokes).max(),
        "RP": linkage.repeatability(z, strokes).max(),
        "J4": linkage.worn_clearances(z, strokes)[0, 2],
    }
    for name, value in values.items():
        measured = [WearMeasurement(3e6, name, float(value), 1e-7)]
        draws = draw(linkage.size, partial(measured_residuals, linkage, measured), samples=1024)
        assert draws.weights @ draws.z[:, 3] == pytest.approx(truth, abs=0.15)
        assert np.sqrt(draws.weights @ (draws.z[:, 3] - truth) ** 2) < 0.5


def test_contradicted() -> None:
    """Measurements that nothing explains are refused, or have a misfit without probability."""
    linkage = wearing(spread=0.1)
    wrong = [WearMeasurement(1e6, "J2", MEAN[0] + 5e-5 * i, 1e-7) for i in range(4)]
    draws = draw(linkage.size, partial(measured_residuals, linkage, wrong), samples=1024)
    assert draws.misfit > 1e4
    with pytest.raises(InvalidValueError, match="part: expected 0 to 1"):
        draws.quantile(draws.z[:, 0], 1.5)


def test_worn_walls() -> None:
    """A life by the growth of gaps is that of complete wear: AP passes its limit after as many strokes."""
    linkage = load_linkage("five-bar")
    path = named_path("pick-and-place")
    worn = wear_life(Stroke.of(linkage, path, moments=21), WearLaw(coefficient=K, bins=72), steps=2, max_step=0.1)
    ap = worn.measures()["AP"][0]
    limit = float(ap[0] + 0.6 * (ap[-1] - ap[0]))
    clearances = RandomClearances(mean=list(linkage.clearances.values()), covariance=np.zeros((3, 3)))
    random = RandomLinkage.at(linkage, closed_at_tips(linkage, path.evaluate(worn.stroke.goals).position), clearances)

    growing = WearingLinkage(random=random, growth=GapGrowth.worn(random, worn), median=K, spread=0.0)

    offset = growing.errors(np.zeros((1, 4)), np.zeros(1)).max() - ap[0]
    found = growing.lives("error", limit + offset, np.zeros((1, 4)))[0]
    assert found == pytest.approx(worn.strokes_to("AP", limit), rel=0.02)


@pytest.mark.proof
@pytest.mark.share(0.01)
def test_intervals_of_lives_cover(sample: Sample) -> None:
    """From 5 to 95 % lie the lives of about nine in ten linkages, which were measured three times while they wore."""
    linkage = wearing(2e-5, work=(0.14, 0.015, 0.09), each=True)
    count, covered = sample.count(200), 0
    for number in range(count):
        rng = np.random.default_rng([SEED, number])
        truth = rng.normal(size=(1, linkage.size))
        measured = [
            WearMeasurement(n, name, max(value + error * rng.normal(), 0.0), error)
            for n in (5e5, 1e6, 2e6)
            for name, value, error in (
                *(
                    (pin, linkage.worn_clearances(truth, np.array([n]))[0, i], 1e-5)
                    for i, pin in enumerate(("J2", "J3", "J4"))
                ),
                ("AP", float(linkage.errors(truth, np.array([n])).max()), 1e-5),
            )
        ]
        draws = draw(linkage.size, partial(measured_residuals, linkage, measured), samples=1024, seed=number)
        low, high = draws.quantile(linkage.lives("error", 9e-4, draws.z), (0.05, 0.95))
        covered += low <= linkage.lives("error", 9e-4, truth)[0] <= high
    sample.record(f"lives of linkages, seed {SEED} fixed beforehand", count, 0, covered=covered / count)
    assert abs(covered / count - 0.9) <= (0.05 if count == 200 else 0.4)


def test_table_of_measurements(tmp_path: Path) -> None:
    """Measurements are read with their units."""
    file = tmp_path / "measured.csv"
    file.write_text("strokes,measure,value_um,standard_error_um\n1e6,J2,360,4\n2e6,AP,700,5\n", encoding="utf-8")
    first, second = read_wear_measurements(file, ("J2", "J3"))
    assert first == (1e6, "J2", pytest.approx(3.6e-4), pytest.approx(4e-6))
    assert second.measure == "AP"


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("1e6,J22,0.3,0.01", "did you mean 'J2'"),
        ("-1,J2,0.3,0.01", "expected 0 to 1e"),
        ("1e6,J2,0.3,0", "expected 1e-06 to 1000 mm, got 0 mm"),
        ("1e6,J2,0.3,1e-308", "expected 1e-06 to 1000 mm, got 1e-308 mm"),
        ("1e6,J2,1e9,0.1", "expected 0 to 1000 mm"),
        ("", "no rows"),
    ],
)
def test_wrong_measurements(tmp_path: Path, row: str, said: str) -> None:
    """Each is one message with file and line."""
    file = tmp_path / "measured.csv"
    file.write_text(f"strokes,measure,value_mm,standard_error_mm\n{row}\n", encoding="utf-8")
    with pytest.raises(FileFormatError, match=said):
        read_wear_measurements(file, ("J2", "J3"))
