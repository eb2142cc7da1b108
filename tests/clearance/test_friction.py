"""A block that slides on the wall of so large a hole that it is a floor, against what one works out by hand.

Along the floor the block moves with its cross, 2 kg; down on it presses only the block, 1 kg.
"""

import attrs
import numpy as np
import pytest

from armwright.clearance.contact import Bristles
from armwright.clearance.equations import FrictionModel
from armwright.clearance.linkage import Linkage
from armwright.clearance.scenario import Scenario
from armwright.clearance.settings import Settings, contact_stiffness
from armwright.clearance.simulation import Simulation, simulate
from clearance.mechanisms import GRAVITY, block, imbalance, thrown

# Ten kilometres: over 10 mm the floor rises by 5 nm, which is 1e-6 of what friction takes.
FLAT = 1e4
SPEED, MASS = 0.1, 2.0
FRICTIONS = np.array((0.05, 0.1, 0.2, 0.4))
BRAKING = FRICTIONS * GRAVITY / MASS
# What the floor's curve, a rounding of 1e-12 m of where it is, and the step leave.
CLOSE = 1e-4


def floor(**options: float) -> Linkage:
    return block(gravity=GRAVITY, clearance=FLAT, **options)


def laid(linkage: Linkage, settings: Settings, duration: float, speed: float = 0.0) -> Scenario:
    """The block below the middle of the hole, as deep in the floor as its weight presses it."""
    task = thrown(linkage, attrs.evolve(settings, start="centred"), duration, (speed, 0.0))
    K = float(contact_stiffness(linkage, np.array([FLAT]))[0])
    q = task.ideal.q.copy()
    q[0, 1] = -FLAT - (-linkage.gravity[1] / K) ** (2 / 3)
    return attrs.evolve(task, ideal=attrs.evolve(task.ideal, q=q))


def slope(tangent: float) -> Linkage:
    """A floor that falls to the right."""
    lean = np.arctan(tangent)
    return attrs.evolve(floor(), gravity=GRAVITY * np.array((np.sin(lean), -np.cos(lean))))


@pytest.fixture(scope="module")
def run() -> Simulation:
    return simulate(laid(floor(), Settings(sample=1e-3), 0.85, SPEED), frictions=FRICTIONS)


class TestBraking:
    """Thrown along the floor with 0.1 m/s."""

    def test_stops(self, run: Simulation) -> None:
        """It stops after (v² + s²) / 2a: friction takes all down to the threshold s, and in proportion below it."""
        threshold = run.scenario.settings.threshold
        # Below the threshold it would never stop; after half a second of the slowest only 1e-11 of it is left.
        way = (SPEED**2 + threshold**2) / (2 * BRAKING)
        np.testing.assert_allclose(run.q[:, -1, 0], way, rtol=CLOSE)

    def test_slows_down(self, run: Simulation) -> None:
        """Until then its speed falls along a straight line, by μ g m / M."""
        falling = run.qd[..., 0] > 2 * run.scenario.settings.threshold
        line = SPEED - BRAKING[:, None] * run.time
        np.testing.assert_allclose(run.qd[..., 0][falling], line[falling], rtol=0, atol=CLOSE * SPEED)

    def test_heat(self, run: Simulation) -> None:
        """All its energy, a hundredth of a joule, goes into friction, and nothing into impacts."""
        np.testing.assert_allclose(run.works["friction loss"][:, -1], MASS * SPEED**2 / 2, rtol=CLOSE)
        assert np.abs(run.works["impact loss"]).max() < 1e-9
        assert np.abs(imbalance(run)).max() < CLOSE * MASS * SPEED**2 / 2


def test_slope() -> None:
    """On a slope it speeds up by g (sin α - μ cos α m / M), or creeps at the part of the threshold that holds it."""
    tangent, frictions = 0.2, np.array((0.0, 0.1, 0.3, 0.5, 0.8))
    run = simulate(laid(slope(tangent), Settings(sample=1e-3), 0.1), frictions=frictions)

    down, up = GRAVITY * np.sin(np.arctan(tangent)), frictions * GRAVITY * np.cos(np.arctan(tangent)) / MASS
    slides = frictions < MASS * tangent
    speeding = np.ptp(run.qd[:, 50:, 0], axis=-1) / np.ptp(run.time[50:])
    np.testing.assert_allclose(speeding[slides], (down - up)[slides], rtol=CLOSE)
    creeping = run.scenario.settings.threshold * (down / up[~slides])
    np.testing.assert_allclose(run.qd[~slides, -1, 0], creeping, rtol=CLOSE)


def test_brushes_hold() -> None:
    """On brushes it creeps by -(g/σ0) ln(1 - F / N g) while they bend, and then lies still."""
    tangent, frictions = 0.02, np.array((0.1, 0.2))
    settings = Settings(friction=FrictionModel(law="lugre"), sample=1e-3)
    run = simulate(laid(slope(tangent), settings, 0.1), frictions=frictions)

    limit = Bristles.static_ratio * frictions
    creep = -limit / Bristles.stiffness * np.log(1 - MASS * tangent / limit)
    # Where it creeps fastest, 0.1 mm/s, Stribeck's curve is a hundredth below its top.
    np.testing.assert_allclose(run.q[:, -1, 0], creep, rtol=1e-2)
    assert np.abs(run.q[:, -1, 0] - run.q[:, 60, 0]).max() < 1e-3 * creep.min()
