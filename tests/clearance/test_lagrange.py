"""The five-bar with play beside the same in Cartesian coordinates with Lagrange multipliers, integrated by SciPy."""

import attrs
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import thesis_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import Scenario, prepare_scenario
from armwright.clearance.settings import Settings, contact_stiffness
from armwright.clearance.simulation import Simulation, simulate
from clearance.arms import beginning
from clearance.lagrange import Wall, motion

# What RK4 at 10 µs and SciPy at 12 digits may differ by in 40 ms, in flight [m, rad].
IN_FLIGHT = 1e-9
# In contact the journals swing in their walls with 14,000 rad/s, where RK4 at 2 µs is good to 4 digits of 0.3 µm.
IN_CONTACT = 2e-9


@pytest.fixture(scope="module")
def five_bar() -> Linkage:
    linkage = load_linkage("five-bar")
    # The other road has no law for what a blow loses.
    return attrs.evolve(linkage, material=attrs.evolve(linkage.material, restitution=1.0))


def beside(task: Scenario, run: Simulation, wall: Wall) -> np.ndarray:
    """The same motion on the other road, in the coordinates of the linkage."""
    ideal = task.ideal
    torques = CubicSpline(np.arange(len(ideal.efforts)) * task.h, ideal.efforts)
    q, v = cartesian(run.q[0]), cartesian(run.qd[0], speeds_at=run.q[0])
    other = motion(q, v, torques, wall, run.time)
    return other[:, [2, 3, 4, 5, 6, 7, 8, 11]]


def cartesian(q: np.ndarray, speeds_at: np.ndarray | None = None) -> np.ndarray:
    """(12) x, y, θ of the links from the eight coordinates, or their speeds."""
    angles = q if speeds_at is None else speeds_at
    cranks = []
    for k, base in ((0, -0.1), (7, 0.1)):
        axis = np.array((np.sin(angles[k]), -np.cos(angles[k])))
        centre = 0.15 * axis + (base, 0.0) if speeds_at is None else 0.15 * q[k] * np.array((-axis[1], axis[0]))
        cranks.append([*centre, q[k]])
    return np.array([*cranks[0], *q[1:7], *cranks[1]])


def test_without_contact(five_bar: Linkage) -> None:
    """While journals fly, links tied by multipliers follow the same path as links that hang in trees."""
    settings = Settings(step=1e-5, sample=2e-3, start="centred")
    task = prepare_scenario(five_bar, beginning(thesis_path("y1"), 0.04), settings)
    run = simulate(task, [0.1] * 3)

    assert run.depths.max() < -0.03
    other = beside(task, run, Wall(clearance=0.1, stiffness=1.0))
    assert np.ptp(other[:, 0]) > 0.01
    np.testing.assert_allclose(run.q, other, rtol=0, atol=IN_FLIGHT)


@pytest.mark.parametrize("friction", [0.0, 0.05])
@pytest.mark.drawn(0.34)
def test_in_contact(five_bar: Linkage, friction: float) -> None:
    """With journals on their walls and friction, both follow the same path too: the levers and signs are right."""
    settings = Settings(step=2e-6, sample=1e-3)
    task = prepare_scenario(five_bar, beginning(thesis_path("y1"), 0.006), settings)
    run = simulate(task, frictions=friction)

    K = float(contact_stiffness(five_bar, np.full(3, 5e-4))[0])
    other = beside(task, run, Wall(5e-4, K, friction, settings.threshold))
    assert np.ptp(other[:, 3]) > 1e-4
    np.testing.assert_allclose(run.q, other, rtol=0, atol=IN_CONTACT)
