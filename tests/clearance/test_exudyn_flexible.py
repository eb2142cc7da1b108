"""The five-bar with elastic rods beside Exudyn's, which divides them into elements."""

import attrs
import numpy as np
import pytest

from armwright.clearance.linkage import Body
from armwright.clearance.paths import thesis_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import Scenario, prepare_scenario
from armwright.clearance.settings import Settings, contact_stiffness
from armwright.clearance.simulation import simulate
from clearance.arms import beginning
from samples import WHOLE

pytest.importorskip("exudyn", reason="exudyn is not installed")
elastic_rod = pytest.importorskip("armwright.clearance.elastic_rod")
from clearance.exudyn_five_bar import efforts_of  # noqa: E402 - needs exudyn
from clearance.exudyn_flexible_five_bar import RODS, Rod, simulated_elastic, with_uniform_rods  # noqa: E402

EVERY, YOUNG = 1e-3, 207e9
# The clearances [m] and the friction on a path.
ARMS = {"y5": ((0.252e-3, 0.099e-3, 0.1e-3), 0.12), "y1": ((0.5e-3, 0.5e-3, 0.5e-3), 0.05)}
# The torques jump at 0.05 s. The blows that follow make undamped rods vibrate in all their modes, and from there runs
# of Exudyn with more elements or shorter steps differ from one another by up to 9 µm, by 1 µm in the median.
JUMP = 0.05
REST, BEFORE, AFTER, USUALLY = 1e-8, 1e-6, 12e-6, 5e-6


def scenario(path: str, duration: float, *, modes: int, step: float) -> Scenario:
    """The arm with elastic rods without damping on a part of a path."""
    rod, (clearances, friction) = Rod(), ARMS[path]
    arm = with_uniform_rods(load_linkage("five-bar"), rod)

    def elastic(body: Body) -> Body:
        section = {"area": rod.axial / YOUNG, "second_moment": rod.bending / YOUNG, "young": YOUNG}
        beam = elastic_rod.Elasticity(ends=tuple(body.points), modes=modes, damping=0.0, **section)
        return attrs.evolve(body, elastic=beam)

    arm = attrs.evolve(
        arm.with_clearances(dict(zip(arm.clearances, clearances, strict=True))),
        material=attrs.evolve(arm.material, friction=friction),
        bodies=[elastic(body) if body.name in RODS else body for body in arm.bodies],
    )
    settings = Settings(step=step, sample=EVERY, impact="carvalho-martins")
    return prepare_scenario(arm, beginning(thesis_path(path), duration + EVERY), settings)


def in_exudyn(task: Scenario, q: np.ndarray, *, elements: int, duration: float, step: float) -> np.ndarray:
    """(s, 2) the tip of the same arm; of our coordinates those of straight rods say where it is."""
    arm, rod = task.linkage, Rod(elements=elements)
    K = contact_stiffness(arm, arm.clearance_array(None))
    return simulated_elastic(arm, q, efforts_of(task), K, rod, duration=duration, step=step, every=EVERY)


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize("path", ARMS)
def test_at_rest_and_as_it_speeds_up(path: str) -> None:
    """The tip rests where Exudyn has it, and stays within a micrometre of it as it speeds up."""
    duration = 0.01
    task = scenario(path, duration, modes=3, step=2e-6)
    run = simulate(task)
    tip = in_exudyn(task, run.q[0], elements=4, duration=duration, step=4e-6)

    apart = np.linalg.norm(tip - run.tip[: len(tip)], axis=-1)
    assert apart[0] < REST
    assert apart.max() < BEFORE


@pytest.mark.proof
@pytest.mark.skipif(not WHOLE, reason="takes minutes: see make proof")
@pytest.mark.parametrize("path", ARMS)
def test_up_to_a_stroke(path: str) -> None:
    """The tips agree before the blows as two divisions of Exudyn's do, and after them as well as those do."""
    duration = 0.2
    task = scenario(path, duration, modes=6, step=5e-7)
    run = simulate(task)
    coarse, fine = (in_exudyn(task, run.q[0], elements=n, duration=duration, step=1e-6) for n in (8, 12))

    before = slice(0, round(JUMP / EVERY) + 1)
    for one, other in ((coarse, fine), (coarse, run.tip[: len(fine)]), (fine, run.tip[: len(fine)])):
        apart = np.linalg.norm(one - other, axis=-1)
        assert apart[before].max() < BEFORE
        assert np.median(apart) < USUALLY
        assert apart.max() < AFTER
    assert run.distance.max() > 0.2e-3
