"""Stops in mid-motion."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.interpolate import CubicSpline

from armwright.arm.load import load_arm
from armwright.errors import InvalidValueError
from armwright.motion.continuity_report import continuity
from armwright.motion.controlled_stop import brake, resume, stop_on_path
from armwright.motion.quintic_polynomials import point_to_point
from armwright.motion.trajectory import Trajectory
from samples import Sample

# Positions, speeds and accelerations go on to rounding.
ROUNDING = 1e-9


@pytest.fixture(scope="module")
def running() -> Trajectory:
    arm = load_arm("puma560-seed")
    return point_to_point(arm, np.zeros(6), np.array([1.2, -0.4, 0.3, 0.0, 0.9, -2.0]), 100.0)


@given(share=st.floats(0.0, 1.0))
def test_a_stop_goes_on_from_the_motion(running: Trajectory, share: float) -> None:
    """Position, speed and acceleration have no jump where the stop begins, and the arm rests at its end."""
    t = share * running.duration
    stop = brake(running, t, load_arm("puma560-seed").limits.acceleration)

    for order in range(3):
        np.testing.assert_allclose(stop(0.0, order), running(t, order), atol=ROUNDING)
    np.testing.assert_allclose(stop(stop.duration - 1e-12, 1), 0, atol=1e-6)
    np.testing.assert_allclose(stop(stop.duration - 1e-12, 2), 0, atol=1e-6)


@given(share=st.floats(0.0, 1.0))
def test_a_stop_keeps_the_limit(running: Trajectory, share: float) -> None:
    """No joint brakes harder than it may, nor harder than it was accelerating already."""
    t = share * running.duration
    limit = np.maximum(load_arm("puma560-seed").limits.acceleration, np.abs(running(t, 2)))

    assert (brake(running, t, np.full(6, limit)).peaks(2) <= limit * (1 + 1e-6)).all()


def test_one_joint_at_constant_speed() -> None:
    """From 1 rad/s with 3 rad/s² a stop takes v / a and one ramp of 10 ms, and goes half as far as at full speed."""
    running = Trajectory(times=[0.0, 1.0], coefficients=[[[0.0], [1.0]]])
    stop = brake(running, 0.5, [3.0])

    assert stop.duration == pytest.approx(1 / 3 + 0.01, rel=5e-3)
    assert stop(stop.duration)[0] - 0.5 == pytest.approx(stop.duration / 2, rel=5e-3)


@given(share=st.floats(0.0, 1.0))
def test_a_stop_keeps_to_its_path(running: Trajectory, share: float) -> None:
    """A motion from point to point is straight in joint space, and so is its stop; it never turns back."""
    start = running(0.0)
    way = (running(running.duration) - start) / np.linalg.norm(running(running.duration) - start)
    stop = brake(running, share * running.duration, load_arm("puma560").limits.acceleration)
    q = stop(np.linspace(0, stop.duration, 200)) - start

    np.testing.assert_allclose(q, (q @ way)[:, None] * way, atol=ROUNDING)
    assert (np.diff(q @ way) >= -ROUNDING).all()


def test_stops_of_random_motions(sample: Sample) -> None:
    """Splines through random configurations, as fast as the limits allow, are stopped within them at any time."""
    arm = load_arm("puma560")
    speed, acceleration = arm.limits.speed, arm.limits.acceleration
    worst = 0.0
    for rng in sample.cases(300):
        knots = rng.uniform(-1, 1, (int(rng.integers(3, 9)), arm.n))
        times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.05, 1.0, len(knots) - 1))])
        spline = CubicSpline(times, knots, bc_type="clamped")
        terms = np.ascontiguousarray(np.swapaxes(spline.c[::-1], 0, 1))
        raw = Trajectory(times=times, coefficients=terms)
        factor = max((raw.peaks(1) / speed).max(), np.sqrt((raw.peaks(2) / acceleration).max()))
        running = raw.slowed(float(factor))
        stop = brake(running, rng.uniform(0, running.duration), acceleration, period=1e-3)
        used = max((stop.peaks(1) / speed).max(), (stop.peaks(2) / acceleration).max())
        worst = max(worst, used)
        assert used <= 1 + 1e-5
        assert not stop(stop.duration, 1).any()
    sample.record("stops of splines at their limits", sample.count(300), 0, worst=worst)


def test_resumed_motions_keep_path_and_limits(sample: Sample) -> None:
    """A spline at its limits that is stopped at any time and resumed stays on its path, and within its limits."""
    arm = load_arm("puma560")
    speed, acceleration = arm.limits.speed, arm.limits.acceleration
    worst = 0.0
    for rng in sample.cases(100):
        knots = rng.uniform(-1, 1, (int(rng.integers(3, 9)), arm.n))
        times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.05, 1.0, len(knots) - 1))])
        spline = CubicSpline(times, knots, bc_type="clamped")
        raw = Trajectory(times=times, coefficients=np.ascontiguousarray(np.swapaxes(spline.c[::-1], 0, 1)))
        factor = max((raw.peaks(1) / speed).max(), np.sqrt((raw.peaks(2) / acceleration).max()))
        running = raw.slowed(float(factor))
        stop = stop_on_path(running, rng.uniform(0, running.duration), acceleration, period=1e-3)
        resumption = resume(running, stop.reached, acceleration, period=1e-3)
        rest, times = resumption.trajectory, np.linspace(0, resumption.trajectory.duration, 50)
        np.testing.assert_allclose(running(resumption.clock(times)[:, 0]), rest(times), atol=ROUNDING)
        assert (np.diff(resumption.clock(times)[:, 0]) >= 0).all()
        np.testing.assert_allclose(rest(0.0), stop.trajectory(stop.trajectory.duration), atol=ROUNDING)
        np.testing.assert_allclose(rest(rest.duration), running(running.duration), atol=ROUNDING)
        assert not rest(0.0, 1).any()
        worst = max(worst, (rest.peaks(1) / speed).max(), (rest.peaks(2) / acceleration).max())
        assert worst <= 1 + 1e-5
    sample.record("resumed splines at their limits", sample.count(100), 0, worst=worst)


def test_resumed_from_its_start(running: Trajectory) -> None:
    """A motion resumed at its very start or end is the motion with a soft start, or stays where it is."""
    acceleration = load_arm("puma560-seed").limits.acceleration

    np.testing.assert_allclose(resume(running, 0.0, acceleration).trajectory(0.0), running(0.0), atol=ROUNDING)
    assert not resume(running, running.duration, acceleration, period=1e-3).trajectory.peaks(1).any()
    report = continuity(resume(running, 0.3 * running.duration, acceleration).trajectory)
    assert max(report.largest(order).max() for order in range(3)) < 10 * ROUNDING


def test_joints_stop_together(running: Trajectory) -> None:
    """The whole stop has no jump inside either, and lasts a whole number of servo periods when one is given."""
    t = 0.4 * running.duration
    stop = brake(running, t, load_arm("puma560-seed").limits.acceleration, period=1e-3)

    assert stop.duration / 1e-3 == pytest.approx(round(stop.duration / 1e-3), abs=1e-6)
    assert max(continuity(stop).largest(order).max() for order in range(3)) < ROUNDING


def test_at_rest() -> None:
    """An arm at rest stays where it is."""
    rest = Trajectory(times=[0.0, 1.0], coefficients=[[[0.3]]])

    np.testing.assert_allclose(brake(rest, 1.0, [1.0], period=1e-3)(5.0), 0.3)


@pytest.mark.parametrize(("t", "limit", "text"), [(-1.0, 1.0, "expected 0 to"), (0.1, 0.0, "more than 0")])
def test_refused(running: Trajectory, t: float, limit: float, text: str) -> None:
    """A moment outside the motion and a limit of nothing are refused."""
    with pytest.raises(InvalidValueError, match=text):
        brake(running, t, np.full(6, limit))
