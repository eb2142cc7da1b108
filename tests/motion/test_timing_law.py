"""Runs along a path: against the closed form of the fastest run of a slide whose speed is limited piece by piece."""

import numpy as np
import pytest

from armwright.arm.limits import Limits
from armwright.arm.model import Arm, Joint
from armwright.arrays import Array
from armwright.motion.solver import solver_of
from armwright.motion.timing_law import TimedPath, timed
from armwright.motion.trajectory import Trajectory

ACCELERATION = 5.0
SLIDE = Arm(name="slide", joints=[Joint(kind="prismatic", limits=Limits(speed=1e3, acceleration=ACCELERATION))])


def fastest(places: Array, caps: Array) -> float:
    """Return how long the fastest run takes from rest to rest through segments with their largest speeds."""
    # Denser towards the ends, where the speed is 0.
    angle = (np.arange(20_000) + 0.5) / 20_000 * np.pi
    s = places[-1] * (1 - np.cos(angle)) / 2
    squares = 2 * ACCELERATION * np.minimum(s, places[-1] - s)
    for start, end, cap in zip(places[:-1], places[1:], caps, strict=True):
        away = np.maximum(np.maximum(start - s, s - end), 0.0)
        squares = np.minimum(squares, cap**2 + 2 * ACCELERATION * away)
    return float((np.sin(angle) / np.sqrt(squares)).mean() * places[-1] * np.pi / 2)


def run_of(places: Array, caps: Array) -> TimedPath:
    """Return the run of the slide along a path whose parameter is its position."""
    coefficients = np.zeros((len(caps), 4, 1))
    coefficients[:, 0, 0], coefficients[:, 1, 0] = places[:-1], 1
    return timed(solver_of(SLIDE), Trajectory(times=places, coefficients=coefficients), caps)


@pytest.mark.parametrize("size", [0.1, 1.0, 10.0])
def test_no_limit_is_passed(size: float, rng: np.random.Generator) -> None:
    """Segments with any limits of speed: none is passed, nor that of the acceleration, and the peaks are those seen."""
    for _ in range(6):
        places = np.append(0.0, np.cumsum(rng.uniform(0.1, 1.0, int(rng.integers(2, 12))))) * size
        caps = rng.uniform(0.2, 1.0, len(places) - 1)

        run = run_of(places, caps)

        t = np.linspace(0, run.trajectory.duration, 5001)
        q, speed, acceleration = (run.trajectory(t, order)[:, 0] for order in (0, 1, 2))
        segment = np.clip(np.searchsorted(places, q, side="right") - 1, 0, len(caps) - 1)
        inside = np.abs(q[:, None] - places).min(axis=1) > 1e-9 * size
        assert (speed <= caps[segment] * (1 + 1e-6))[inside].all()
        assert np.abs(acceleration).max() <= ACCELERATION * (1 + 1e-6)
        seen = speed.max(), np.abs(acceleration).max()
        np.testing.assert_allclose((run.speed[0], run.acceleration[0]), seen, rtol=1e-2)
        assert run.trajectory.duration >= fastest(places, caps) * (1 - 1e-5)


@pytest.mark.parametrize("size", [0.1, 1.0, 10.0])
def test_hardly_longer_than_the_fastest(size: float) -> None:
    """Where the limit of the speed changes slowly, averaging costs 0.6 % of the time, and at most 0.05 s: no less."""
    places = np.linspace(0, size, 301)
    caps = 0.6 + 0.3 * np.sin(5 * places[1:] / size)

    run = run_of(places, caps)

    shortest = fastest(places, caps)
    grid = 0.003 * shortest  # a speed that is kept on all of an interval
    assert 0 <= run.run.grid.shortest - shortest <= grid
    cost = run.trajectory.duration - run.run.grid.shortest
    assert cost == pytest.approx(min(0.006 * run.run.grid.shortest, 0.05), rel=1e-6)


def test_very_different_limits(rng: np.random.Generator) -> None:
    """Where the limit of the speed jumps by orders of magnitude, no part of the run passes it."""
    for _ in range(3):
        places = np.append(0.0, np.cumsum(10 ** rng.uniform(-3, 0, 50)))
        caps = 10 ** rng.uniform(-3, 0, 50)

        trajectory = run_of(places, caps).trajectory

        times = trajectory.times
        t = (times[1:] + times[:-1]) / 2
        q, speed = (trajectory(t, order)[:, 0] for order in (0, 1))
        segment = np.clip(np.searchsorted(places, q, side="right") - 1, 0, len(caps) - 1)
        inside = np.abs(q[:, None] - places).min(axis=1) > 1e-9
        assert (speed <= caps[segment] * (1 + 1e-9))[inside].all()
