"""Rattling on paths: where journals leave their walls, how the tip shakes, and laws of motion that are quieter."""

import attrs
import numpy as np
import pytest

from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import TEST_PATHS, Path, straight_path, thesis_path
from armwright.clearance.predictability import perturb_clearances
from armwright.clearance.scenario import prepare_scenario
from armwright.clearance.settings import Settings
from armwright.clearance.simulation import simulate
from armwright.clearance.vibration import move_law
from armwright.clearance.vibration.assessment import QUANTITIES, RattlingAssessment
from armwright.clearance.vibration.move_law import aim_for_least_loss, straight_move
from armwright.clearance.vibration.rattling import Rattling, rattle
from armwright.errors import InvalidValueError
from clearance.arms import beginning

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

SMALL, RUBBING = np.array((0.252e-3, 0.099e-3, 0.1e-3)), 0.12
# The steps of the tests that do not look at the first impacts alone [s].
COARSE = Settings(step=2e-5)


def flights(linkage: Linkage, path: Path) -> list[tuple[float, str, float]]:
    """Return when each journal leaves its wall [s], its pin, and for how long [s]."""
    scenario = prepare_scenario(linkage, path, Settings(sample=1e-5))
    run = simulate(scenario, SMALL, frictions=RUBBING)
    found = []
    for i, pin in enumerate(linkage.pins):
        edges = np.diff(np.concatenate([[0], (run.depths[:, i] < 0).astype(int), [0]]))
        starts, ends = np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)
        found += [(float(run.time[a]), pin.name, 1e-5 * float(b - a)) for a, b in zip(starts, ends, strict=True)]
    return sorted(found)


def test_no_rattling_on_y5(five_bar: Linkage) -> None:
    """On y5 with a friction of 0.12, J3 hops for half a millisecond at 0.0502 s; then nothing flies until 0.2 s."""
    hops = flights(five_bar, beginning(thesis_path("y5"), 0.2005))

    early = [flight for flight in hops if flight[0] < 0.19]
    assert {pin for _, pin, _ in early} == {"J3"}
    assert round(early[0][0], 4) == 0.0502
    assert early[-1][0] + early[-1][2] - early[0][0] == pytest.approx(0.5e-3, abs=0.15e-3)
    assert hops[len(early)][0] == pytest.approx(0.2, abs=2e-4)


def test_no_rattling_on_a_diagonal(five_bar: Linkage) -> None:
    """On a diagonal nothing flies either, but for the hop as it stops speeding up, until it brakes at 0.289 s."""
    path = straight_path("diagonal", (-0.18, -0.68), (0.18, -0.44))

    times = [time for time, _, _ in flights(five_bar, beginning(path, 0.2895))]

    later = [time for time in times if time > 0.0515]
    assert round(later[0], 3) == 0.289


@pytest.fixture(scope="module")
def rattling(five_bar: Linkage) -> Rattling:
    """The first 210 ms of y1, a predictable motion that ends among impacts; then the drives are locked."""
    return rattle(five_bar, beginning(thesis_path("y1"), 0.21), np.full(3, 0.5e-3), COARSE, dwell=0.01)


def test_numbers_of_a_simulation(five_bar: Linkage, rattling: Rattling) -> None:
    """Impacts, flight, loss and acceleration are those of the sixteen runs, and of the dwell there is more."""
    scenario = prepare_scenario(five_bar, rattling.path, attrs.evolve(COARSE, sample=2e-5))
    runs = simulate(scenario, perturb_clearances(np.full(3, 0.5e-3)))

    assert rattling.window == pytest.approx((0.05, 0.2))
    assert rattling.loss.shape == (16,)
    assert np.all(rattling.loss > runs.works["impact loss"][:, -1])
    assert np.all(rattling.impacts >= runs.impacts)
    flown = (runs.depths < 0).sum(axis=1)
    total = len(runs.time) + 501
    assert np.all(rattling.flight >= flown / total)
    assert np.all(rattling.flight <= (flown + 501) / total)
    # By second differences of positions, where the motion is smooth.
    error = runs.error[:, (runs.time > 0.07) & (runs.time < 0.19)]
    expected = np.linalg.norm(np.diff(error, n=2, axis=1), axis=-1).max() / 4e-10
    smooth = rattle(five_bar, beginning(thesis_path("y1"), 0.19), np.full(3, 0.5e-3), COARSE, dwell=0.0)
    assert smooth.dwell == 0
    assert np.all(np.isnan(smooth.dwell_rms))
    assert smooth.motion_peak.max() >= expected * (1 - 1e-6)


def test_what_is_chance(rattling: Rattling) -> None:
    """Before it brakes all runs are one; after it they are not."""
    assert rattling.motion_rms.std() < 1e-4 * rattling.motion_rms.mean()
    assert rattling.dwell_rms.std() > 1e-3 * rattling.dwell_rms.mean()
    assert rattling.goal.mean() > 1e-4


def test_bad_dwell(five_bar: Linkage) -> None:
    with pytest.raises(InvalidValueError, match="dwell: expected at most 1 s, got 2 s"):
        rattle(five_bar, thesis_path("y1"), np.full(3, 0.5e-3), dwell=2.0)


def assessed(five_bar: Linkage, means: dict[str, float], quantity: str, spread: float) -> RattlingAssessment:
    """An assessment of paths whose losses have these means and this spread."""
    runs = spread * np.tile((-1.0, 1.0), 8) / np.sqrt(16 / 15)

    def one(name: str, mean: float) -> Rattling:
        values, pins = mean + runs, np.outer(mean + runs, np.ones(3)) / 3
        names = ("motion_rms", "motion_peak", "dwell_rms", "dwell_peak", "loss", "goal")
        return Rattling(
            path=thesis_path(name),
            window=(0.05, 0.2),
            dwell=0.05,
            sample=1e-5,
            force=pins,
            impacts=pins,
            flight=pins,
            **dict.fromkeys(names, values),
        )

    rattlings = tuple(one(name, mean) for name, mean in means.items())
    return RattlingAssessment(linkage=five_bar, clearances=np.ones(3), rattlings=rattlings, quantity=quantity)


@pytest.mark.parametrize("quantity", ["loss", "impacts"])
def test_ranking(five_bar: Linkage, quantity: str) -> None:
    """Paths are sorted by a quantity; neighbours whose spreads overlap are alike, others are not."""
    assessment = assessed(five_bar, {"y1": 3.0, "x1": 1.0, "x2": 1.15, "y9": 3.3}, quantity, 0.1)

    ranking = assessment.ranking()

    assert [ranked.rattling.path.name for ranked in ranking] == ["x1", "x2", "y1", "y9"]
    assert [ranked.alike for ranked in ranking] == [("x2",), ("x1",), (), ()]
    assert ranking[0].spread == pytest.approx(0.1)
    data = assessment.as_data()
    assert data["paths"][1]["alike"] == ["x1"]
    assert set(data["paths"][0]) >= {name.replace("-", "_") for name in QUANTITIES}


@pytest.mark.parametrize("law", ["jumps", "smooth"])
@pytest.mark.parametrize("ramp", [0.03, 0.125])
def test_move_laws(law: move_law.Law, ramp: float) -> None:
    """A move law comes to its goal in time, at rest, with the speed and acceleration that its ramp needs."""
    start, goal = TEST_PATHS["y1"]
    path = straight_move("y1", start, goal, duration=0.25, ramp=ramp, law=law)
    state = path.evaluate(np.linspace(0.0, 0.25, 5001))

    speed = 0.3 / (0.25 - ramp)
    np.testing.assert_allclose(path.evaluate([0.0, 0.25]).position, [start, goal], atol=1e-12)
    np.testing.assert_allclose(path.evaluate([0.0, 0.25]).velocity, 0.0, atol=1e-12)
    assert np.linalg.norm(state.velocity, axis=-1).max() == pytest.approx(speed)
    largest = (1.5 if law == "smooth" else 1.0) * speed / ramp
    assert np.linalg.norm(state.acceleration, axis=-1).max() == pytest.approx(largest, rel=1e-4)
    if law == "smooth":
        ends = path.halves(2500)
        np.testing.assert_allclose(ends[0].acceleration, ends[1].acceleration, atol=1e-9 * largest)
    else:
        own = straight_path("y1", start, goal, speed=speed, ramp=ramp)
        np.testing.assert_allclose(state.position, own.evaluate(np.linspace(0.0, 0.25, 5001)).position, atol=1e-12)


def test_least_loss_that_reaches_the_goal(five_bar: Linkage, monkeypatch: pytest.MonkeyPatch) -> None:
    """Candidates accelerate no more than the path; of those that reach the goal the one with least loss is chosen."""

    def losing(_linkage: Linkage, path: Path, *_: object, **__: object) -> Rattling:
        state = path.evaluate(np.linspace(0, path.duration, 999))
        loss = np.full(16, np.linalg.norm(state.velocity, axis=-1).min() + 1 / len(path.knots) + path.knots[1])
        return attrs.evolve(assessed(five_bar, {"x1": 1.0}, "loss", 0.1).rattlings[0], path=path, loss=loss)

    misses = iter((1e-3, 1e-6))

    class Corrected:
        def __init__(self, path: Path) -> None:
            self.path, self.after = path, np.full((16, 2), next(misses))

    monkeypatch.setattr(move_law, "rattle", losing)
    monkeypatch.setattr(move_law, "correct_path", lambda _linkage, path, *_, **__: Corrected(path))

    aim = aim_for_least_loss(five_bar, "y1", np.full(3, 0.5e-3))

    own, *others = aim.candidates
    assert own.acceleration == pytest.approx(30.0)
    assert all(move.acceleration <= own.acceleration * (1 + 1e-9) for move in others)
    assert {move.law for move in others} == {"jumps", "smooth"}
    assert aim.passed_over == 1
    assert aim.move.loss == pytest.approx(sorted(move.loss for move in aim.candidates)[1])
    monkeypatch.setattr(move_law, "correct_path", lambda _linkage, path, *_, **__: Corrected(path))
    misses = iter(np.full(99, 1e-3))
    with pytest.raises(InvalidValueError, match="with no move law the tip comes nearer to its goal than 1 mm"):
        aim_for_least_loss(five_bar, "y1", np.full(3, 0.5e-3))


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize("name", ["y1", "y8", "x4"])
def test_smooth_law_loses_less(five_bar: Linkage, name: str) -> None:
    """A smooth law of the same duration loses less than a tenth of what the path itself does."""
    own, clearances = thesis_path(name), np.full(3, 0.5e-3)
    smooth = straight_move(name, *TEST_PATHS[name], duration=own.duration, ramp=own.duration / 2, law="smooth")

    losses = [rattle(five_bar, path, clearances, COARSE, dwell=0.02).loss for path in (own, smooth)]

    assert losses[1].mean() < 0.1 * losses[0].mean()
