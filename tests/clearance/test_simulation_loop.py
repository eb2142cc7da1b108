"""The loop of a compiled simulation, run as the Python that it is."""

import numpy as np
import pytest

from armwright.arrays import Array
from armwright.clearance import simulation_loop
from armwright.clearance.event_location import crossing_fraction
from armwright.clearance.lane_layout import COLUMNS, LANES, PARAMETERS, PINS, STATES

# What Runge and Kutta's method loses in 200 steps of 1/100, (1/100)⁴ · 2 / 120.
METHOD = 2e-10


def test_the_depth_passes_zero_at_the_root_of_its_cubic() -> None:
    """A depth of (s - 1/4)(s + 1) passes 0 after a quarter of the interval, which a straight line puts at a seventh."""
    assert crossing_fraction(-0.25, 0.75, 1.5, 2.75) == pytest.approx(0.25, abs=1e-12)


def test_a_spring_swings(monkeypatch: pytest.MonkeyPatch) -> None:
    """A mass on a spring with nothing to touch is at cos t after every step, in all lanes; no impact is counted."""

    def spring(x: Array, y: Array) -> None:
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
