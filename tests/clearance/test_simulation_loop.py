"""The loop of a compiled simulation, run as the Python that it is."""

import numpy as np
import pytest

from armwright.arrays import Array
from armwright.clearance import simulation_loop
from armwright.clearance.event_location import crossing_fraction
from armwright.clearance.lane_layout import COLUMNS, FIRST_WALL, LANES, OUTPUTS, PARAMETERS, PINS, STATES
from armwright.clearance.wall_lookup import look_up_walls
from armwright.clearance.worn_walls import wall_at

# What Runge and Kutta's method loses in 200 steps of 1/100, (1/100)⁴ · 2 / 120.
METHOD = 2e-10


def test_the_depth_passes_zero_at_the_root_of_its_cubic() -> None:
    """A depth of (s - 1/4)(s + 1) passes 0 after a quarter of the interval, which a straight line puts at a seventh."""
    assert crossing_fraction(-0.25, 0.75, 1.5, 2.75) == pytest.approx(0.25, abs=1e-12)


def test_a_spring_swings(monkeypatch: pytest.MonkeyPatch) -> None:
    """A mass on a spring with nothing to touch is at cos t after every step, in all lanes; no impact is counted."""

    def spring(x: Array, y: Array, _: Array) -> None:
        y[:LANES], y[LANES : 2 * LANES] = x[LANES : 2 * LANES], -x[:LANES]

    monkeypatch.setattr(simulation_loop, "rates", spring)
    runs, steps, h = 3, 200, 0.01
    start = np.zeros((runs, STATES))
    start[:, 0] = (1.0, 2.0, -0.5)
    samples = np.full((runs, steps + 1, STATES + PINS), np.nan)
    counts, peaks = np.ones((runs, PINS), dtype=np.int64), np.ones((runs, PINS))

    simulation_loop.simulate(
        0,
        runs,
        start,
        np.zeros((runs, PARAMETERS)),
        np.zeros((runs, 0)),
        np.zeros((steps, 3, COLUMNS)),
        np.full(steps, h),
        np.arange(steps + 1),
        np.zeros((0, 0, 0)),
        samples,
        counts,
        peaks,
        np.zeros(1, dtype=np.int64),
    )

    t = h * np.arange(steps + 1)
    np.testing.assert_allclose(samples[:, :, 0], start[:, :1] * np.cos(t), atol=METHOD * 2)
    np.testing.assert_allclose(samples[:, :, 1], -start[:, :1] * np.sin(t), atol=METHOD * 2)
    assert not counts.any()
    assert not peaks.any()


def test_walls_are_looked_up(rng: np.random.Generator) -> None:
    """Every lane finds growth and slopes of its wall as the table gives them; one that has diverged finds some."""
    walls = np.pad(rng.normal(size=(1, 9, 9)), ((0, 0), (1, 2), (1, 2)), mode="wrap")
    x, y = np.zeros((FIRST_WALL + 3 * PINS) * LANES), np.zeros(OUTPUTS * LANES)
    places = rng.uniform(-20, 20, (2, LANES))
    y[: 2 * LANES] = places.ravel()
    y[3] = np.nan

    look_up_walls(x, y, walls)

    found = x[FIRST_WALL * LANES :].reshape(3, LANES)
    expected = np.array(wall_at(walls[0], *places))
    assert np.isfinite(found).all()
    np.testing.assert_allclose(np.delete(found, 3, axis=1), np.delete(expected, 3, axis=1), rtol=0, atol=1e-12)
