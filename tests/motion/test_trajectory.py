"""Trajectories: quintics, exact extremes, slowing, turning round, joining and sampling."""

from collections.abc import Callable
from itertools import pairwise

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from scipy.interpolate import PPoly

from armwright.arm.load import load_arm
from armwright.errors import InvalidValueError, KindError, ShapeError
from armwright.motion.quintic_polynomials import point_to_point, quintic
from armwright.motion.trajectory import Trajectory, hold, join, slowed_together, whole_ticks
from armwright.motion.xspline_path import xspline

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


def test_peaks_are_the_largest_of_the_segments(rng: np.random.Generator) -> None:
    """Segments that cannot hold the largest value are not evaluated, and nothing is missed by that."""
    for _ in range(50):
        segments, powers, joints = (int(rng.integers(1, most)) for most in (30, 11, 8))
        times = np.concatenate([[0.0], np.cumsum(rng.uniform(0, 0.2, segments))])
        scale = 10.0 ** rng.uniform(-3, 3, (1, powers, 1))
        move = Trajectory(times=times, coefficients=rng.normal(size=(segments, powers, joints)) * scale)

        for order in range(3):
            np.testing.assert_array_equal(move.peaks(order), move.segment_peaks(order).max(axis=0))


def test_point_to_point_uses_its_limits() -> None:
    """At speed 120 some joint meets a limit exactly and none passes one; at 60 it takes twice as long."""
    arm = load_arm("puma560-seed")
    for goal in ([1, 0.5, -1, 1, 1, 2], [0.01, 0, 0, 0, 0, 0.002]):
        fast, slow = (point_to_point(arm, np.zeros(6), goal, speed) for speed in (120, 60))
        use = max((fast.peaks(1) / arm.limits.speed).max(), (fast.peaks(2) / arm.limits.acceleration).max())

        assert use == pytest.approx(1, abs=1e-9)
        assert slow.duration == pytest.approx(2 * fast.duration)


def test_moving_nowhere_takes_no_time() -> None:
    """A move to where the arm stands has no duration and stays there."""
    move = point_to_point(load_arm("puma560-seed"), np.ones(6), np.ones(6))

    assert move.duration == 0
    np.testing.assert_array_equal(move([0.0, 1.0]), np.ones((2, 6)))


@pytest.mark.parametrize("speed", [0, 0.9, 121, np.inf, np.nan])
def test_speed_out_of_range(speed: float) -> None:
    """Speeds run from 1 to 120."""
    with pytest.raises(InvalidValueError, match=r"outside 1\.\.120"):
        point_to_point(load_arm("puma560-seed"), np.zeros(6), np.ones(6), speed)


def test_what_has_no_meaning() -> None:
    """A negative order, slowing by nothing, ends and rates that do not fit: each is refused with what came."""
    move = quintic([0.0], [1.0], 1.0)
    with pytest.raises(InvalidValueError, match="of at least 0, got -1"):
        move(0.5, -1)
    with pytest.raises(InvalidValueError, match="more than 0, got 0"):
        move.slowed(0)
    with pytest.raises(ShapeError, match="q_goal: expected 2 numbers"):
        quintic([0.0, 0.0], [1.0, 1.0, 1.0], 1.0)
    with pytest.raises(ShapeError, match="start: expected 2 numbers"):
        xspline([0, 1, 2], np.zeros((3, 2)), start=np.zeros(3))


@pytest.mark.parametrize("powers", [1, 2, 3, 4, 5, 6, 8])
def test_extremes_are_exact(powers: int, rng: np.random.Generator) -> None:
    """No sample of 20 000 passes the extremes, and some sample nearly touches each: SciPy evaluates them."""
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.2, 1.0, size=4))])
    coefficients = rng.normal(size=(4, powers, 2))
    trajectory = Trajectory(times=times, coefficients=coefficients)
    reference = PPoly(coefficients[:, ::-1].transpose(1, 0, 2), times)
    t = np.linspace(0, times[-1], 20001)

    for order in (0, 1, 2, 3):
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


@given(st.lists(st.integers(0, 50), max_size=5), st.floats(0, 1))
def test_slowed_together(ticks: list[int], duration: float) -> None:
    """Trajectories take a duration together, rounded up to a tick; each ends on a tick, and none becomes shorter."""
    moves = [quintic([0.0], [1.0], k * 1e-3) if k else hold([0.0], 0.0) for k in ticks]

    slow = slowed_together(moves, duration, 1e-3)

    counts = [move.duration / 1e-3 for move in slow]
    np.testing.assert_allclose(counts, np.round(counts), atol=ROUNDING)
    assert all(count >= k - ROUNDING for count, k in zip(counts, ticks, strict=True))
    expected = max(sum(ticks), np.ceil(duration / 1e-3 - 1e-9)) if sum(ticks) else 0
    assert sum(counts) == pytest.approx(expected, abs=ROUNDING)


@given(
    terms=st.lists(st.floats(-1, 1), min_size=3, max_size=9),
    fading=st.integers(0, 16),
    length=st.sampled_from([1e-6, 1e-3, 1.0, 1e3]),
)
def test_no_extreme_is_missed(terms: list[float], fading: int, length: float) -> None:
    """Whatever the coefficients, the last of them next to nothing or nothing, no look finds more than the extremes.

    The segment may be short or long; the coefficients are those of its part that has passed.
    """
    parts = np.array(terms)
    parts[-1] *= 10.0**-fading
    trajectory = Trajectory(times=(0.0, length), coefficients=(parts / length ** np.arange(len(parts)))[None, :, None])
    values = np.polynomial.Polynomial(parts)(np.linspace(0, 1, 2001))

    lowest, highest = trajectory.extremes()

    assert (lowest[0] <= values.min() + 1e-13) & (highest[0] >= values.max() - 1e-13)
    assert (lowest[0] >= values.min() - 1e-4) & (highest[0] <= values.max() + 1e-4)


@pytest.mark.parametrize("places", [(0.5, 0.5), (0.3, 0.3, 0.3), (0.2, 0.2, 0.8, 0.8), (0.4, 0.6, 0.6, 0.6, 0.9)])
def test_extremes_where_roots_meet(places: tuple[float, ...]) -> None:
    """Where the speed only touches zero, its extremes are found all the same, to ten digits."""
    speed = np.polynomial.Polynomial.fromroots(places)
    position = speed.integ()
    trajectory = Trajectory(times=(0.0, 1.0), coefficients=position.coef[None, :, None])

    lowest, highest = trajectory.extremes()

    at = position(np.array((0.0, *places, 1.0)))
    assert (lowest[0], highest[0]) == pytest.approx((at.min(), at.max()), abs=1e-10)


def test_extremes_of_parabola_by_hand() -> None:
    """Thrown up at 4 m/s under 2 m/s², a ball turns at 4 m after 2 s; its speed goes from 4 to -4 m/s."""
    flight = Trajectory(times=(0.0, 4.0), coefficients=[[[0.0], [4.0], [-1.0]]])

    assert flight.extremes(0) == (0.0, 4.0)
    assert flight.extremes(1) == (-4.0, 4.0)
    assert flight.extremes(2) == (-2.0, -2.0)
    assert flight.extremes(3) == (0.0, 0.0)


def test_running_in_another_time() -> None:
    """Run in a given time, a motion ends on it to the last bit, on the same path."""
    move = xspline([0, 0.1, 0.25, 0.7], [[0.0], [1.0], [0.3], [0.4]])
    for duration in (0.1, 1 / 3, np.pi, 1e3):
        other = move.retimed(duration)

        assert other.duration == duration
        part = np.linspace(0, 1, 50)
        np.testing.assert_allclose(other(part * duration), move(part * move.duration), atol=1e-11)
        np.testing.assert_allclose(other.peaks(1), move.peaks(1) * move.duration / duration)


def test_reversed_trajectory(rng: np.random.Generator) -> None:
    """Backwards, a motion is at the same places at the mirrored times, its speed and jerk of the other sign."""
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.2, 1.0, size=5))])
    move = xspline(times, rng.normal(size=(6, 3)), rng.normal(size=3), rng.normal(size=3))

    back = move.reversed()

    t = np.linspace(0, times[-1], 333)[1:-1]
    for order, sign in enumerate((1, -1, 1, -1)):
        np.testing.assert_allclose(back(t, order), sign * move(times[-1] - t, order), atol=1e-8)
    assert back.duration == move.duration
    np.testing.assert_allclose(back.reversed().coefficients, move.coefficients, atol=1e-9)


def test_samples_of_a_servo() -> None:
    """A servo of 0.3 s sees a motion of 1 s at 0, 0.3, 0.6 and 0.9 s, and at its end."""
    move = quintic([0.0, 1.0], [1.0, 3.0], 1.0)

    samples = move.sampled(0.3)

    np.testing.assert_allclose(samples.times, (0, 0.3, 0.6, 0.9, 1.0))
    assert samples.times[-1] == move.duration
    for order, values in enumerate((samples.q, samples.qd, samples.qdd, samples.jerk)):
        np.testing.assert_array_equal(values, move(samples.times, order))


@pytest.mark.parametrize(("duration", "count"), [(1.0, 1001), (0.1 * 3, 301), (0.0005, 2)])
def test_whole_periods_have_no_last_sliver(duration: float, count: int) -> None:
    """A duration that is a whole number of periods but for rounding has that many of them, and one sample more."""
    times = quintic([0.0], [1.0], duration).sampled(1e-3).times

    assert len(times) == count
    assert np.diff(times).min() > 0.4e-3
    assert hold([1.0], 0.0).sampled(1e-3).times.tolist() == [0.0]
    assert quintic([0.0], [1.0], 1e-9).sampled(10.0).times.tolist() == [0.0, 1e-9]


def test_parts_that_do_not_meet() -> None:
    """A part that begins elsewhere than the one before it ends is refused, and so is one of other joints."""
    there = quintic([0.0, 0.0], [1.0, 2.0], 1.0)
    with pytest.raises(InvalidValueError, match=r"part 2 begins with joint 2 at 1\.5, part 1 ends with it at 2: 0\.5"):
        join([there, quintic([1.0, 1.5], [0.0, 0.0], 1.0)])
    with pytest.raises(ShapeError, match="part 3 moves 1 joints, part 2 before it 2"):
        join([there, there.reversed(), quintic([0.0], [1.0], 1.0)])
    with pytest.raises(ShapeError, match="at least one trajectory, got none"):
        join([])
    with pytest.raises(KindError, match="join: expected trajectories, got 5"):
        join([there, 5])  # type: ignore[list-item]
    with pytest.raises(KindError, match="join: expected a list of trajectories, got None"):
        join(None)  # type: ignore[arg-type]
    with pytest.raises(KindError, match="gap: expected a number, got 'small'"):
        join([there, there.reversed()], gap="small")  # type: ignore[arg-type]
    assert join([there, quintic([1.0, 1.5], [0.0, 0.0], 1.0)], gap=0.6).duration == 2


def test_times_that_mean_nothing() -> None:
    """Periods and durations of nothing, and periods that nobody can wait for, are refused with what came."""
    move = quintic([0.0], [1.0], 1.0)
    for period in (0.0, -1e-3, np.nan, np.inf):
        expected = r"no more than 1e\+100 s" if period == np.inf else "more than 0 s"
        with pytest.raises(InvalidValueError, match=f"period: expected {expected}, got {period}"):
            move.sampled(period)
        with pytest.raises(InvalidValueError, match=f"duration: expected {expected}, got {period}"):
            move.retimed(period)
        with pytest.raises(InvalidValueError, match=f"period: expected {expected}, got {period}"):
            whole_ticks(move, period)
    with pytest.raises(KindError, match="period: expected a number, got None"):
        whole_ticks(move, None)  # type: ignore[arg-type]
    with pytest.raises(InvalidValueError, match="divides 1 s into more ticks than can be counted"):
        whole_ticks(move, 1e-320)
    with pytest.raises(InvalidValueError, match="duration: expected 0 s or more, got nan"):
        slowed_together([move], np.nan, 1e-3)
    with pytest.raises(InvalidValueError, match=r"1e-12 s divides 1 s into 1e\+12 samples; at most 1e\+08 are allowed"):
        move.sampled(1e-12)
    with pytest.raises(InvalidValueError, match=r"a motion of 0 s cannot be stretched to 2 s; use hold\(q, 2\)"):
        hold([0.0], 0.0).retimed(2)


def test_standing_nowhere() -> None:
    """Standing still needs one position per joint, and a time that does not run backwards."""
    with pytest.raises(ShapeError, match=r"q: expected shape \(n,\), got \(\)"):
        hold(1.0, 1.0)
    with pytest.raises(InvalidValueError, match=r"duration: expected 0 s or more, got -1\.0"):
        hold([1.0], -1)
    with pytest.raises(KindError, match="duration: expected a number, got 'long'"):
        hold([1.0], "long")  # type: ignore[arg-type]


@pytest.mark.parametrize("ask", [Trajectory.extremes, Trajectory.peaks, Trajectory.segment_peaks])
def test_extremes_of_no_derivative(ask: Callable[[Trajectory, object], object]) -> None:
    """There is no derivative of half or negative order, and none gets the extremes of another."""
    move = quintic([0.0], [1.0], 1.0)
    with pytest.raises(InvalidValueError, match="order: expected an integer of at least 0, got -1"):
        ask(move, -1)
    for order in (0.5, "speed", True):
        with pytest.raises(KindError, match="order: expected an integer, got "):
            ask(move, order)


def test_the_rest_of_a_motion(rng: np.random.Generator) -> None:
    """What is left of a motion after a time is the same motion, that time later; of one that is over, standing."""
    motion = join([quintic(a, b, 1.5) for a, b in pairwise(rng.normal(size=(4, 3)))])
    for t in (0.0, 0.7, 1.5, 4.2):
        rest = motion.after(t)
        local = np.linspace(0, rest.duration, 50)
        assert rest.duration == pytest.approx(motion.duration - t)
        for order in range(3):
            np.testing.assert_allclose(rest(local, order)[:-1], motion(local + t, order)[:-1], atol=1e-9)
    assert motion.after(9.0).duration == 0
    np.testing.assert_array_equal(motion.after(9.0)(0.0), motion(motion.duration))
    with pytest.raises(InvalidValueError):
        motion.after(-1.0)
