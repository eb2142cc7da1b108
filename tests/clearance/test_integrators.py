"""How fast the integrators of the compiled simulation come nearer to the truth."""

from itertools import pairwise

import attrs
import numpy as np
import pytest
from scipy.special import ellipj, ellipk

from armwright.clearance.paths import straight_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import prepare_scenario
from armwright.clearance.settings import Settings
from armwright.clearance.simulation import simulate
from clearance.arms import beginning
from clearance.mechanisms import GRAVITY, block, imbalance, left_alone, pendulum, still, thrown

# Of benchmark A01: six digits are printed.
PRINTED = 6e-7


def swung(integrator: str, step: float, duration: float = 1.0) -> np.ndarray:
    """(s, 2) where the pendulum's bob is each second, released from the level on the left."""
    settings = Settings(step=step, sample=1.0, integrator=integrator)  # type: ignore[arg-type]
    return simulate(left_alone(prepare_scenario(pendulum(), still(duration, -np.pi), settings))).tip


def bob(t: float) -> np.ndarray:
    """Where it is, by elliptic functions: sin(φ/2) = k sn(K - ω t) with k = sin(45°), φ from straight down."""
    k = np.sin(np.pi / 4)
    angle = -2 * np.arcsin(k * ellipj(ellipk(k * k) - np.sqrt(GRAVITY) * t, k * k)[0])
    return np.array((np.sin(angle), -np.cos(angle)))


def test_simple_pendulum() -> None:
    """Released at (-1, 0) the bob is where elliptic functions and benchmark A01 say, after 1, 5 and 10 seconds."""
    tip = swung("rk4", 1e-3, 10.0)

    published = ((0.986292, -0.165011), (-0.942305, -0.334754), (-0.275087, -0.961419))
    for second, position in zip((1, 5, 10), published, strict=True):
        np.testing.assert_allclose(tip[second], bob(second), rtol=0, atol=1e-9)
        np.testing.assert_allclose(tip[second], position, rtol=0, atol=PRINTED)


@pytest.mark.parametrize(("integrator", "order", "step"), [("rk4", 4, 0.02), ("semi-implicit", 1, 2e-3)])
def test_order_in_the_air(integrator: str, order: int, step: float) -> None:
    """Half the step leaves a sixteenth of the error of Runge and Kutta, and half of that of the semi-implicit rule."""
    errors = [np.linalg.norm(swung(integrator, step / 2**i)[-1] - bob(1.0)) for i in range(4)]

    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, order, atol=0.25)


def slid(integrator: str, step: float) -> tuple[np.ndarray, float]:
    """Where the block is that slides in the hole like a pendulum, pressed to the wall by its weight; and its ledger."""
    settings = Settings(step=step, sample=2e-4, integrator=integrator)  # type: ignore[arg-type]
    run = simulate(thrown(block(gravity=GRAVITY, clearance=5e-3), settings, 0.002, (0.15, 0.0)))
    assert run.depths.min() > 0
    # Going round in the hole presses half as much again as weight does: the indentation swings.
    assert np.ptp(run.depths) > 0.1 * run.depths[0]
    return np.concatenate([run.q[-1], run.qd[-1]]), float(np.abs(imbalance(run)).max())


@pytest.mark.parametrize(("integrator", "order", "step"), [("rk4", 4, 2e-5), ("semi-implicit", 1, 2e-5)])
def test_order_on_the_wall(integrator: str, order: int, step: float) -> None:
    """On a wall that is never left the orders are the same."""
    ends = [slid(integrator, step / 2**i)[0] for i in range(4)]

    steps = np.array([np.linalg.norm(b - a) for a, b in pairwise(ends)])
    np.testing.assert_allclose(np.log2(steps[:-1] / steps[1:]), order, atol=0.4)


def test_ledger_on_the_wall() -> None:
    """On the wall no energy comes from nowhere: of 10 mJ less than a millionth of a millionth."""
    assert slid("rk4", 2e-6)[1] < 1e-14


def test_controller_brings_it_to_its_goal() -> None:
    """A pendulum that is held with 200 N m/rad and 10 N m s/rad swings into its goal as a linear one does."""
    settings = Settings(step=1e-4, sample=1e-2, control="pd+ff", gains=(200.0, 10.0))
    task = prepare_scenario(pendulum(), still(0.3, -np.pi / 2), settings)
    displaced = task.ideal.q.copy()
    displaced[0] += 1e-3
    run = simulate(attrs.evolve(task, ideal=attrs.evolve(task.ideal, q=displaced)))

    # Near its lowest place weight is a spring of m g l; inertia is m l².
    a, b = 10.0 / 2, np.sqrt(200.0 + GRAVITY - 25.0)
    t = run.time
    by_hand = 1e-3 * np.exp(-a * t) * (np.cos(b * t) + a / b * np.sin(b * t))
    np.testing.assert_allclose(run.q[:, 0] + np.pi / 2, by_hand, rtol=0, atol=1e-9)


@pytest.mark.parametrize("part", [0.32, 0.5, 0.83])
def test_order_across_a_jump_within_a_step(part: float) -> None:
    """Where the acceleration jumps within a step, Runge-Kutta keeps its order 4: the step is cut at the jump."""
    linkage, clearances = load_linkage("five-bar"), np.full(3, 0.3e-3)
    line = straight_path("diagonal", (-0.12, -0.68), (0.11, -0.47))
    # Up to 10 ms beyond the jump at 50 ms, before a journal comes down for the first time; the jump is off the steps.
    knots = np.array([0.0, 0.05, 0.05 + 0.05 * 20 / (100 + part)])
    path = attrs.evolve(line, knots=knots, pieces=line.pieces[:2], targets=())
    errors = []
    for steps in (3000, 6000, 12000):
        task = prepare_scenario(linkage, path, Settings(step=path.duration / steps, sample=path.duration / 4))
        assert len(task.table) == task.steps + 1
        assert task.lengths.sum() == pytest.approx(path.duration, abs=1e-15)
        errors.append(simulate(task, clearances, frictions=0.0).error[-1])

    differences = np.linalg.norm(np.array(errors[:-1]) - errors[-1], axis=1)
    np.testing.assert_allclose(np.log2(differences[:-1] / differences[1:]), 4, atol=0.4)


def test_located_impacts_in_parted_steps() -> None:
    """Cutting steps at impacts as well as at jumps comes to the same position as a quarter of the step."""
    linkage, clearances = load_linkage("five-bar"), np.full(3, 0.3e-3)
    path = straight_path("diagonal", (-0.12, -0.68), (0.11, -0.47))
    # Beyond the jump; later impacts differ.
    start = beginning(path, path.duration / 4)
    settings = Settings(sample=path.duration / 20, located=True)
    runs = [
        simulate(prepare_scenario(linkage, start, attrs.evolve(settings, step=path.duration / n)), clearances)
        for n in (12880, 51520)
    ]

    np.testing.assert_allclose(runs[0].error, runs[1].error, rtol=0, atol=1e-9)
