"""Trajectories: quintic, X-spline, their extremes, slowing and joining."""

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, PPoly

from armwright.arm.load import load_arm
from armwright.errors import InvalidValueError, ShapeError
from armwright.motion.quintic import point_to_point, quintic
from armwright.motion.trajectory import Trajectory, hold, join, whole_ticks
from armwright.motion.xspline import xspline, xspline_rates

ROUNDING = 1e-12


def test_quintic_rests_at_both_ends() -> None:
    """At start and end a quintic stands still and does not accelerate; half-way it is half-way."""
    move = quintic([0.0, 1.0], [2.0, -1.0], 4.0)

    np.testing.assert_allclose(move([0, 2, 4]), [[0, 1], [1, 0], [2, -1]], atol=ROUNDING)
    for order in (1, 2):
        np.testing.assert_allclose(move([0, 4], order), 0, atol=ROUNDING)


def test_quintic_peaks() -> None:
    """The peak speed is 15/8 of the mean, half-way; the peak acceleration 10/sqrt(3) way/time²."""
    move = quintic([0.0], [3.0], 2.0)

    assert move.peaks(1)[0] == pytest.approx(15 / 8 * 3 / 2)
    assert move(1.0, 1)[0] == pytest.approx(15 / 8 * 3 / 2)
    assert move.peaks(2)[0] == pytest.approx(10 / np.sqrt(3) * 3 / 4)


def test_point_to_point_uses_its_limits() -> None:
    """At speed 120 some joint meets a limit exactly and none passes one; at 60 it takes twice as long."""
    arm = load_arm("puma560")
    for goal in ([1, 0.5, -1, 1, 1, 2], [0.01, 0, 0, 0, 0, 0.002]):
        fast, slow = (point_to_point(arm, np.zeros(6), goal, speed) for speed in (120, 60))
        use = max((fast.peaks(1) / arm.limit("speed")).max(), (fast.peaks(2) / arm.limit("acceleration")).max())

        assert use == pytest.approx(1, abs=1e-9)
        assert slow.duration == pytest.approx(2 * fast.duration)


def test_moving_nowhere_takes_no_time() -> None:
    """A move to where the arm stands has no duration and stays there."""
    move = point_to_point(load_arm("puma560"), np.ones(6), np.ones(6))

    assert move.duration == 0
    np.testing.assert_array_equal(move([0.0, 1.0]), np.ones((2, 6)))


@pytest.mark.parametrize("speed", [0, 0.9, 121, np.inf, np.nan])
def test_speed_out_of_range(speed: float) -> None:
    """Speeds run from 1 to 120."""
    with pytest.raises(InvalidValueError, match=r"outside 1\.\.120"):
        point_to_point(load_arm("puma560"), np.zeros(6), np.ones(6), speed)


def test_xspline_rate_of_the_report() -> None:
    """For equal steps the general rule is the report's m = (q+ + 4q - 5q-)/4h - m-/2."""
    h, q = 0.3, np.array([[0.0], [0.4], [0.1], [0.7]])

    m = xspline_rates(h * np.arange(4), q, [0.2], [0.0])[:, 0]

    m1 = (q[2, 0] + 4 * q[1, 0] - 5 * q[0, 0]) / (4 * h) - 0.2 / 2
    m2 = (q[3, 0] + 4 * q[2, 0] - 5 * q[1, 0]) / (4 * h) - m1 / 2
    np.testing.assert_allclose(m, (0.2, m1, m2, 0.0), atol=ROUNDING)


def test_xspline_is_exact_for_cubics(rng: np.random.Generator) -> None:
    """Knots of a cubic, at any steps, with its rates at the ends, give the cubic back."""
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 1.0, size=8))])
    cubic = np.polynomial.Polynomial(rng.normal(size=4))

    spline = xspline(times, cubic(times)[:, None], [cubic.deriv()(0.0)], [cubic.deriv()(times[-1])])

    t = np.linspace(0, times[-1], 200)
    np.testing.assert_allclose(spline(t)[:, 0], cubic(t), atol=1e-10)
    np.testing.assert_allclose(spline(t, 1)[:, 0], cubic.deriv()(t), atol=1e-9)


def test_xspline_order_of_convergence() -> None:
    """Halving the step of knots on a sine divides the error by about 16: order four."""
    errors = []
    for count in (16, 32, 64, 128):
        times = np.linspace(0, 2, count + 1)
        spline = xspline(times, np.sin(times)[:, None], [1.0], [np.cos(2.0)])
        t = np.linspace(0, 2, 4001)
        errors.append(np.abs(spline(t)[:, 0] - np.sin(t)).max())

    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 4, atol=0.25)


def test_xspline_against_scipy(rng: np.random.Generator) -> None:
    """SciPy's Hermite cubic through the same knots and rates is the same curve."""
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 1.0, size=6))])
    knots = rng.normal(size=(7, 3))
    t = np.linspace(0, times[-1], 300)

    rates = xspline_rates(times, knots, np.zeros(3), np.zeros(3))

    np.testing.assert_allclose(xspline(times, knots)(t), CubicHermiteSpline(times, knots, rates)(t), atol=1e-10)


def test_what_has_no_meaning() -> None:
    """A negative order, slowing by nothing, ends and rates that do not fit: each is refused with what came."""
    move = quintic([0.0], [1.0], 1.0)
    with pytest.raises(InvalidValueError, match="0 or more, got -1"):
        move(0.5, -1)
    with pytest.raises(InvalidValueError, match="more than 0, got 0"):
        move.slowed(0)
    with pytest.raises(ShapeError, match="q_goal: expected 2 numbers"):
        quintic([0.0, 0.0], [1.0, 1.0, 1.0], 1.0)
    with pytest.raises(ShapeError, match="start: expected 2 numbers"):
        xspline([0, 1, 2], np.zeros((3, 2)), start=np.zeros(3))


def test_times_must_rise() -> None:
    """Two knots at one time are refused, with the knot."""
    with pytest.raises(InvalidValueError, match=r"got 0\.5 s and then 0\.5 s at knot 2"):
        xspline([0, 0.5, 0.5], np.zeros((3, 1)))
    with pytest.raises(ShapeError, match="k at least 2"):
        xspline([0], np.zeros((1, 1)))


@pytest.mark.parametrize("powers", [2, 3, 4, 6])
def test_extremes_are_exact(powers: int, rng: np.random.Generator) -> None:
    """No sample of 20 000 passes the extremes, and some sample nearly touches each: SciPy evaluates them."""
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.2, 1.0, size=4))])
    coefficients = rng.normal(size=(4, powers, 2))
    trajectory = Trajectory(times=times, coefficients=coefficients)
    reference = PPoly(coefficients[:, ::-1].transpose(1, 0, 2), times)
    t = np.linspace(0, times[-1], 20001)

    for order in (0, 1, 2):
        samples = reference.derivative(order)(t) if order else reference(t)
        lowest, highest = trajectory.extremes(order)

        np.testing.assert_allclose(trajectory(t[:-1], order), samples[:-1], atol=1e-8)
        assert (samples >= lowest - 1e-9).all()
        assert (samples <= highest + 1e-9).all()
        if order == 0 or powers > 2:
            np.testing.assert_allclose(samples.min(axis=0), lowest, atol=2e-3 * np.abs(coefficients).max() * powers**2)
            np.testing.assert_allclose(samples.max(axis=0), highest, atol=2e-3 * np.abs(coefficients).max() * powers**2)


def test_slowing_keeps_the_path() -> None:
    """Twice as slow is the same places at twice the time, half the speed, a quarter of the acceleration."""
    move = quintic([0.0], [1.0], 1.0)
    slow = move.slowed(2.0)

    np.testing.assert_allclose(slow(0.8), move(0.4), atol=ROUNDING)
    np.testing.assert_allclose(slow(0.8, 1), move(0.4, 1) / 2, atol=ROUNDING)
    np.testing.assert_allclose(slow(0.8, 2), move(0.4, 2) / 4, atol=ROUNDING)


def test_joining() -> None:
    """A move, a rest and a move back: each part runs at its own time."""
    there, back = quintic([0.0], [1.0], 1.0), quintic([1.0], [0.0], 2.0)

    whole = join([there, hold([1.0], 0.5), back])

    assert whole.duration == pytest.approx(3.5)
    np.testing.assert_allclose(whole([0.4, 1.2, 2.5])[:, 0], (there(0.4)[0], 1.0, back(1.0)[0]), atol=ROUNDING)


@pytest.mark.parametrize(("duration", "ticks"), [(0.9995, 1000), (1.0, 1000), (1.0001, 1001), (0.0001, 1)])
def test_whole_ticks(duration: float, ticks: int) -> None:
    """A stage ends on a tick of the servo and is never made faster."""
    move = whole_ticks(quintic([0.0], [1.0], duration), 1e-3)

    assert move.duration == pytest.approx(ticks * 1e-3, abs=ROUNDING)
