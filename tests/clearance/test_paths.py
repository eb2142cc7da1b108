"""Paths for the tip: where they run, how fast, and what happens where their acceleration jumps."""

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from armwright.clearance.paths import (
    RAMP,
    TEST_PATHS,
    TOP_SPEED,
    PickAndPlace,
    constant_speed_path,
    hermite_path,
    named_path,
    straight_path,
    thesis_path,
)
from armwright.errors import InvalidValueError, ShapeError, UnknownNameError

ROUNDING = 1e-12


class TestStraight:
    """Straight lines with a trapezoid of speed."""

    def test_y1(self) -> None:
        """The thesis' y1 climbs 300 mm in 0.25 s: 0.05 s to reach 1.5 m/s, and 0.05 s to stop."""
        path = thesis_path("y1")

        assert path.duration == pytest.approx(0.25)
        np.testing.assert_allclose(path.knots, (0.0, 0.05, 0.2, 0.25), atol=ROUNDING)
        now = path.evaluate([0.0, 0.025, 0.05, 0.125, 0.225, 0.25])
        heights = -0.7 + np.array((0.0, 0.009375, 0.0375, 0.15, 0.290625, 0.3))
        np.testing.assert_allclose(now.position, np.stack([np.full(6, -0.15), heights], axis=-1), rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(now.velocity[:, 1], (0, 0.75, 1.5, 1.5, 0.75, 0), rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(now.acceleration[[0, 3, 4], 1], (30.0, 0.0, -30.0), rtol=0, atol=ROUNDING)

    @pytest.mark.parametrize("name", TEST_PATHS)
    def test_all_24(self, name: str) -> None:
        """Every test path moves from its start to its goal and stops there, without a jump of position or speed."""
        path = thesis_path(name)
        start, goal = TEST_PATHS[name]

        ends = path.evaluate([0.0, path.duration])
        np.testing.assert_allclose(ends.position, (start, goal), rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(ends.velocity, 0.0, atol=ROUNDING)
        inside = path.knots[1:-1]
        after, before = (path.evaluate(inside, np.arange(len(inside)) + i) for i in (1, 0))
        np.testing.assert_allclose(after.position, before.position, rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(after.velocity, before.velocity, rtol=0, atol=ROUNDING)
        assert np.linalg.norm(path.evaluate(path.duration / 2).velocity) == pytest.approx(TOP_SPEED)

    def test_there_are_24(self) -> None:
        """Ten along x and fourteen along y, each there and back."""
        assert len(TEST_PATHS) == 24
        assert TEST_PATHS["x1"] == TEST_PATHS["x6"][::-1]
        assert TEST_PATHS["y7"] == TEST_PATHS["y14"][::-1]

    def test_shortest(self) -> None:
        """Where there is just room to speed up and slow down, nothing is left between."""
        path = straight_path("short", (0, 0), (TOP_SPEED * RAMP, 0))

        assert len(path.pieces) == 2
        assert path.duration == pytest.approx(2 * RAMP)
        np.testing.assert_allclose(path.evaluate(path.duration).position, (TOP_SPEED * RAMP, 0), atol=ROUNDING)

    def test_too_short(self) -> None:
        """10 mm are not enough to reach 1.5 m/s in 0.05 s: 75 mm are."""
        with pytest.raises(InvalidValueError, match=r"path dash: 10 mm are too short .* at least 75 mm are needed"):
            straight_path("dash", (0, 0), (0.01, 0))
        with pytest.raises(InvalidValueError, match="too short"):
            straight_path("dash", (0.1, 0), (0.1, 0))

    @pytest.mark.parametrize("wrong", [{"speed": 0.0}, {"speed": -1.0}, {"ramp": 0.0}, {"ramp": -0.1}])
    def test_speeds_that_lead_nowhere(self, wrong: dict[str, float]) -> None:
        """Speed and ramp are above 0."""
        with pytest.raises(InvalidValueError, match="speed and ramp must be above 0"):
            straight_path("back", (0, 0), (1, 0), **wrong)

    def test_three_numbers(self) -> None:
        """The plane has two axes."""
        with pytest.raises(ShapeError, match=r"start: expected a shape ending in \(2,\), got \(3,\)"):
            straight_path("up", (0, 0, 0), (1, 0))


class TestHermite:
    """Cubic pieces through positions with specified velocities."""

    TIMES = (0.0, 0.1, 0.35, 0.4)

    def test_scipy(self, rng: np.random.Generator) -> None:
        """They are SciPy's cubic Hermite spline, with its slopes."""
        positions, velocities = rng.uniform(-1, 1, (2, 4, 2))
        path = hermite_path("curve", self.TIMES, positions, velocities, (1, 3))
        spline = CubicHermiteSpline(self.TIMES, positions, velocities)
        t = np.linspace(0.0, 0.4, 83)

        now = path.evaluate(t)

        assert path.targets == (0.1, 0.4)
        np.testing.assert_allclose(now.position, spline(t), rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(now.velocity, spline(t, 1), rtol=0, atol=1e-10)
        np.testing.assert_allclose(now.acceleration, spline(t, 2), rtol=0, atol=1e-7)

    @pytest.mark.parametrize("times", [(0.1, 0.2), (0.0, 0.0), (0.0, -1.0)])
    def test_times_that_do_not_pass(self, times: tuple[float, float]) -> None:
        """Time begins at 0 and goes on."""
        with pytest.raises(InvalidValueError, match="path x: times must increase from 0"):
            hermite_path("x", times, np.zeros((2, 2)), np.zeros((2, 2)), ())

    def test_places_without_times(self) -> None:
        """There are as many positions as times."""
        with pytest.raises(ShapeError, match=r"expected \(m \+ 1\) times and \(m \+ 1, 2\) positions and velocities"):
            hermite_path("x", (0, 1), np.zeros((3, 2)), np.zeros((3, 2)), ())

    def test_pick_and_place(self) -> None:
        """It picks at (-180, -600), passes (0, -575) at 1.5 m/s, and ends at (180, -600) mm, 0.25 s apart."""
        path = PickAndPlace().path()

        now = path.evaluate(path.targets)
        np.testing.assert_allclose(path.targets, (0.0, 0.25, 0.5), atol=ROUNDING)
        np.testing.assert_allclose(now.position, ((-0.18, -0.6), (0, -0.575), (0.18, -0.6)), rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(now.velocity, ((0, 0), (1.5, 0), (0, 0)), rtol=0, atol=1e-10)
        np.testing.assert_allclose(path.evaluate((0.05, 0.45)).velocity, ((0, 0.3), (0, -0.3)), rtol=0, atol=1e-10)


def test_turning() -> None:
    """A crank at 3 rad/s is 0.6 rad farther after 0.2 s."""
    path = constant_speed_path("round", 1.0, 3.0, 0.5)

    now = path.evaluate(0.2)
    assert path.follower == "drives"
    assert (now.position[0], now.velocity[0], now.acceleration[0]) == pytest.approx((1.6, 3.0, 0.0))


@pytest.mark.parametrize("duration", [0.0, -1.0, np.nan])
def test_turning_for_no_time(duration: float) -> None:
    """A path takes time."""
    with pytest.raises(InvalidValueError, match="path round: expected a duration above 0"):
        constant_speed_path("round", 0.0, 1.0, duration)


def test_before_and_after() -> None:
    """Before the start and after the end the tip is where the path begins and ends."""
    path = thesis_path("x1")

    np.testing.assert_array_equal(path.evaluate([-1.0, 9.0]).position, path.evaluate([0.0, path.duration]).position)


@pytest.mark.parametrize("steps", [10, 25, 40, 2500])
def test_no_step_sees_a_jump(steps: int) -> None:
    """Of a step that ends where the acceleration jumps all moments have the acceleration from before the jump."""
    path = thesis_path("y1")

    after, before = path.halves(steps)

    assert after.position.shape == (2 * steps + 1, 2)
    np.testing.assert_allclose(after.position, before.position, rtol=0, atol=ROUNDING)
    jumps = np.flatnonzero(np.any(after.acceleration != before.acceleration, axis=-1))
    times = np.linspace(0.0, path.duration, 2 * steps + 1)
    hit = [i for i, t in enumerate(times) if np.abs(path.knots[1:-1] - t).min() < ROUNDING]
    assert jumps.tolist() == hit
    assert (before.acceleration[jumps, 1] - after.acceleration[jumps, 1]).tolist() == pytest.approx([30.0] * len(hit))


def test_unknown_names() -> None:
    """A path that nobody drew is refused with the nearest one."""
    with pytest.raises(UnknownNameError, match=r"no test path 'y15'"):
        thesis_path("y15")
    with pytest.raises(UnknownNameError, match=r"no path 'pick_and_place'. Did you mean 'pick-and-place'\?"):
        named_path("pick_and_place")
