"""The elastic rods of the five-bar for Exudyn: as an oracle they are worth what they converge to."""

from functools import cache

import attrs
import numpy as np
import pytest

from armwright.clearance.paths import thesis_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import Scenario, prepare_scenario
from armwright.clearance.settings import Settings, contact_stiffness
from armwright.clearance.simulation import initial_coordinates
from clearance.arms import beginning
from clearance.exudyn_five_bar import efforts_of, simulated
from clearance.exudyn_flexible_five_bar import Rod, simulated_elastic, with_uniform_rods

EVERY = 1e-3
# The clearances [m] and the friction on a path.
ARMS = {"y5": ((0.252e-3, 0.099e-3, 0.1e-3), 0.12), "y1": ((0.5e-3, 0.5e-3, 0.5e-3), 0.05)}
# The torques jump at 0.05 s, and the blows that follow spread what rounding, elements and steps leave.
JUMP = 0.05
BEFORE, AFTER = 1e-6, 5e-6


@cache
def scenario(path: str, duration: float) -> Scenario:
    """The arm with uniform rods on a part of a path."""
    clearances, friction = ARMS[path]
    arm = with_uniform_rods(load_linkage("five-bar"), Rod())
    arm = attrs.evolve(arm, material=attrs.evolve(arm.material, friction=friction))
    arm = arm.with_clearances(dict(zip(arm.clearances, clearances, strict=True)))
    return prepare_scenario(arm, beginning(thesis_path(path), duration), Settings(step=2e-6, sample=EVERY))


def elastic(path: str, rod: Rod, *, duration: float, step: float) -> np.ndarray:
    """(s, 2) the tip of the arm with elastic rods [m]."""
    task = scenario(path, duration + EVERY)
    arm = task.linkage
    K = contact_stiffness(arm, arm.clearance_array(None))
    q = initial_coordinates(task, arm.clearance_array(None), K)
    return simulated_elastic(arm, q, efforts_of(task), K, rod, duration=duration, step=step, every=EVERY)


@pytest.mark.proof
@pytest.mark.drawn(0.5)
@pytest.mark.parametrize("path", ARMS)
def test_stiff_rods_are_rigid(path: str) -> None:
    """Rods that are a hundred times stiffer keep the tip far closer to that of rigid rods."""
    duration, step = 0.01, 4e-6
    task = scenario(path, duration + EVERY)
    arm = task.linkage
    K = contact_stiffness(arm, arm.clearance_array(None))
    q = initial_coordinates(task, arm.clearance_array(None), K)
    rigid = simulated(arm, q, efforts_of(task), K, duration=duration, step=step, every=EVERY)

    apart = []
    for factor in (1, 100):
        rod = Rod(elements=2, bending=424.04 * factor)
        apart.append(np.linalg.norm(elastic(path, rod, duration=duration, step=step) - rigid, axis=-1).max())

    assert apart[0] > 10e-6
    assert apart[1] < apart[0] / 20
