"""Blows of a block in a round hole, as the compiled simulation makes them, against the closed forms."""

import math

import numpy as np
import pytest

from armwright.clearance.contact import IMPACT_LAWS, SLOWEST_IMPACT, ImpactLaw, damping, restitution_of_damping
from armwright.clearance.settings import Settings, contact_stiffness
from armwright.clearance.simulation import Simulation, simulate
from clearance.mechanisms import block, imbalance, thrown

SPEED = 1.0
MASS = 1.0
# A step of a micrometre's way at 1 m/s: a hundredth of the indentation.
FINE = 1e-6
# What is left of a speed or of a depth at that step, of the whole; it falls with the square of the step.
AT_FINE = 3e-5
# Energy that a blow of half a joule may lose or gain at that step, for the force has a bend where it begins [J].
LEAK = 1e-6
ELASTIC_TIME = 2.94328


def struck(
    restitution: float = 0.9,
    *,
    impact: ImpactLaw = "lankarani-nikravesh",
    speed: float = SPEED,
    step: float = FINE,
    located: bool = False,
) -> Simulation:
    """The block falls on the wall below it, once, at a speed, without weight."""
    linkage = block(restitution=restitution)
    settings = Settings(step=step, sample=step, impact=impact, start="centred", located=located)
    # Half a millimetre there, and back at half the speed or more, without reaching the other wall.
    task = thrown(linkage, settings, 0.0014 * SPEED / speed, (0.0, -speed))
    return simulate(task)


def rebound(run: Simulation) -> float:
    return float(run.qd[..., 1].max() / -run.qd[0, 1])


def stiffness() -> float:
    linkage = block()
    return float(contact_stiffness(linkage, np.array([linkage.pins[0].clearance]))[0])


@pytest.mark.drawn(0.4)
@pytest.mark.parametrize("restitution", [0.6, 0.8, 0.9, 1.0])
@pytest.mark.parametrize("law", IMPACT_LAWS)
def test_blows_rebound_by_the_closed_form(law: ImpactLaw, restitution: float) -> None:
    """A block that hits a wall at 1 m/s leaves it with 1 + e = ln[(1 + χ) / (1 - χ e)] / χ, whatever the law."""
    run = struck(restitution, impact=law)

    e, chi = rebound(run), damping(law, restitution)
    assert run.impacts.tolist() == [1]
    if chi == 0:
        assert e == pytest.approx(1.0, abs=AT_FINE)
    else:
        assert math.log((1 + chi) / (1 - chi * e)) / chi == pytest.approx(1 + e, rel=3 * AT_FINE)
    assert e == pytest.approx(restitution_of_damping(chi), rel=AT_FINE)


@pytest.mark.parametrize("restitution", [0.6, 0.75, 0.9])
def test_exact_law_gives_back_what_is_asked(restitution: float) -> None:
    """With the exact law the speed after the blow is the asked part of the speed before it."""
    assert rebound(struck(restitution, impact="exact")) == pytest.approx(restitution, rel=AT_FINE)


@pytest.mark.parametrize("law", IMPACT_LAWS)
def test_depth_of_blows(law: ImpactLaw) -> None:
    """The journal goes as deep into the wall as δ_max = [5 m v² (χ - ln(1 + χ)) / (2 K χ²)]^0.4."""
    run = struck(0.7, impact=law)

    chi = damping(law, 0.7)
    by_hand = (2.5 * MASS * SPEED**2 / stiffness() * (chi - math.log1p(chi)) / chi**2) ** 0.4
    assert run.depths.max() == pytest.approx(by_hand, rel=AT_FINE)


@pytest.mark.parametrize("speed", [0.1, 0.5, 1.0])
def test_time_of_elastic_blows(speed: float) -> None:
    """A blow without loss lasts 2.94328 δ_max / v and presses with K δ_max^1.5, δ_max = (5 m v² / 4 K)^0.4."""
    run = struck(1.0, speed=speed)

    depth = (1.25 * MASS * speed**2 / stiffness()) ** 0.4
    depths, time = run.depths[:, 0], run.time
    down = np.flatnonzero((depths[:-1] <= 0) & (depths[1:] > 0))[0]
    up = np.flatnonzero((depths[:-1] > 0) & (depths[1:] <= 0))[0]
    # Between samples the journal goes straight on: outside the wall its speed is constant.
    first = time[down] + FINE * -depths[down] / (speed * FINE)
    last = time[up + 1] - depths[up + 1] / -speed
    assert last - first == pytest.approx(ELASTIC_TIME * depth / speed, rel=1e-4)
    assert run.peaks[0] == pytest.approx(stiffness() * depth**1.5, rel=1e-3)


def test_blows_lose_what_the_ledger_says() -> None:
    """A blow at 1 m/s on 1 kg loses (1 - e²) / 2 joule, and the ledger closes at every moment."""
    run = struck(0.8, impact="hu-guo")

    e = restitution_of_damping(damping("hu-guo", 0.8))
    assert run.works["impact loss"][-1] == pytest.approx((1 - e * e) / 2, rel=2 * AT_FINE)
    assert np.abs(imbalance(run)).max() < LEAK


def test_slow_blows_count_as_blows_of_a_millimetre_a_second() -> None:
    """At 0.1 mm/s the damping is that of 1 mm/s: a tenth of χ, so the blow is nearly elastic."""
    speed = 1e-4
    linkage = block(restitution=0.6, clearance=5e-7)
    settings = Settings(step=FINE, sample=FINE, impact="hu-guo", start="centred")
    run = simulate(thrown(linkage, settings, 0.0095, (0.0, -speed)))

    chi = damping("hu-guo", 0.6) * speed / SLOWEST_IMPACT
    assert run.impacts.tolist() == [1]
    assert rebound(run) == pytest.approx(restitution_of_damping(chi), rel=AT_FINE)


def test_side_wall_is_struck_by_both_masses() -> None:
    """From side to side block and cross come together, 2 kg: the same rebound, and 2^0.4 times the depth."""
    settings = Settings(step=FINE, sample=FINE, start="centred")
    below = struck(0.7)
    beside = simulate(thrown(block(restitution=0.7), settings, 0.0014, (-SPEED, 0.0)))

    assert beside.qd[..., 0].max() == pytest.approx(rebound(below), rel=AT_FINE)
    assert beside.depths.max() == pytest.approx(2**0.4 * below.depths.max(), rel=AT_FINE)


class TestLocated:
    """Where in a step the journal comes to its wall."""

    # As the thesis has it: at 1 m/s the journal goes 10 µm in a step, a fifth of the indentation.
    STEP = 1e-5

    def rebounds(self, *, located: bool, runs: int = 16) -> np.ndarray:
        """Rebounds of blows that come at different moments of a step."""
        settings = Settings(step=self.STEP, sample=self.STEP, impact="exact", start="centred", located=located)
        task = thrown(block(restitution=0.5), settings, 0.0022, (0.0, -SPEED))
        run = simulate(task, np.linspace(4.96e-4, 5.06e-4, runs)[:, None])
        assert np.all(run.impacts == 1)
        return np.asarray(run.qd[..., 1].max(axis=-1))

    def test_blows_of_long_steps_come_nearer_to_the_closed_form(self) -> None:
        """At steps of 10 µs a blow of 1 m/s gives back 0.5 of its speed ten times better if its moment is located."""
        without = np.abs(self.rebounds(located=False) - 0.5)
        located = np.abs(self.rebounds(located=True) - 0.5)

        assert without.mean() > 1e-3
        assert located.mean() < 0.1 * without.mean()
        assert located.max() < 0.1 * without.max()

    def test_runs_beside_keep_their_bits(self) -> None:
        """A run is the same alone and beside fifteen whose blows come in other steps."""
        settings = Settings(step=self.STEP, sample=self.STEP, start="centred", located=True)
        task = thrown(block(restitution=0.5), settings, 0.004, (0.3, -SPEED))
        clearances = np.linspace(1e-4, 9e-4, 19)[:, None]
        together = simulate(task, clearances, threads=2)

        for i in (0, 3, 15, 18):
            alone = simulate(task, clearances[i])
            np.testing.assert_array_equal(alone.qd, together.qd[i])
            np.testing.assert_array_equal(alone.impacts, together.impacts[i])
        assert len(np.unique(together.impacts)) > 2

    def test_ledger_closes(self) -> None:
        """What is made in two parts is added up in two parts: no energy comes from nowhere."""
        settings = Settings(step=FINE, sample=1e-4, start="centred", located=True)
        run = simulate(thrown(block(restitution=0.7), settings, 0.01, (0.3, -SPEED)))

        assert run.impacts[0] > 3
        assert np.abs(imbalance(run)).max() < run.impacts[0] * LEAK
