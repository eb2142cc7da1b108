"""The five-bar with play on y1 beside Exudyn's, which has its own contact, friction and integrator."""

import attrs
import numpy as np
import pytest

from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import thesis_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import prepare_scenario
from armwright.clearance.settings import Settings, contact_stiffness
from armwright.clearance.simulation import simulate
from clearance.arms import beginning
from clearance.exudyn_five_bar import efforts_of, simulated

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

CLEARANCE = 5e-4
END, EVERY = 0.15, 1e-3
# The torques jump at 0.05 s, in the middle of what Exudyn takes for one step; from there it is of order 1.
JUMP = 0.05
# Before the jump: what its steps of 10 µs and ours of 2 µs leave. With friction it puts the point of contact in the
# middle of the indentation, and we on the wall of the bearing.
BEFORE, BEFORE_RUBBING = 2e-9, 2e-8
# After it, as the issue asks.
AFTER = 5e-6


@pytest.fixture(scope="module", params=[0.0, 0.05], ids=["smooth", "rubbing"])
def linkage(request: pytest.FixtureRequest) -> Linkage:
    """The arm with friction of the surfaces, or without."""
    five_bar_linkage = load_linkage("five-bar")
    return attrs.evolve(five_bar_linkage, material=attrs.evolve(five_bar_linkage.material, friction=request.param))


@pytest.mark.drawn(0.34)
def test_up_to_the_impacts(linkage: Linkage) -> None:
    """Both tips follow the same path until they slow down, to 5 µm of 1 mm, and the nearer the finer its steps."""
    settings = Settings(step=2e-6, sample=EVERY, impact="carvalho-martins")
    task = prepare_scenario(linkage, beginning(thesis_path("y1"), END + EVERY), settings)
    run = simulate(task, [CLEARANCE] * 3)
    samples = round(END / EVERY) + 1
    torques = efforts_of(task)
    K = contact_stiffness(linkage, np.full(3, CLEARANCE))
    apart = {}
    for step in (1e-5, 5e-6):
        tip = simulated(linkage, run.q[0], torques, K, duration=END, step=step, every=EVERY)
        apart[step] = np.linalg.norm(tip[:samples] - run.tip[:samples], axis=-1)

    before = slice(0, round(JUMP / EVERY) + 1)
    assert run.distance[:samples].min() > 0.7e-3
    assert apart[1e-5][before].max() < (BEFORE if linkage.material.friction == 0 else BEFORE_RUBBING)
    assert apart[1e-5].max() < AFTER
    assert apart[5e-6][-1] == pytest.approx(apart[1e-5][-1] / 2, rel=0.2)
