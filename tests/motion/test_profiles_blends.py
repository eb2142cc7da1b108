"""Straight lines with quartic blends: the three points of the course, and any number of them."""

import re

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from scipy.optimize import minimize_scalar

from armwright.arrays import Array
from armwright.errors import InvalidValueError, KindError, ShapeError, UnknownNameError
from armwright.motion.blends import Ends, blend_timing, blended, via_deviations, via_distances
from armwright.motion.continuity_report import continuity
from armwright.motion.trajectory import Trajectory

# To what the formulas of the course and ours agree, of numbers of size 100.
SAME = 1e-12
# Limits may be passed by this part of them: rounding.
AT_LIMIT = 1e-9

# Joint angles of the course's three configurations [deg].
A = np.array((-100.4577, 70.6108, -48.3997, 0, 60.9896, 29.2746))
B = np.array((-52.1158, -1.4358, 30.2060, 58.6166, 11.4781, 3.2859))
C = np.array((0.0955, 65.7969, 14.3196, 15.3377, -20.1730, 29.5160))


def of_the_course(t: float) -> Array:
    """Position, speed and acceleration as the course's program computes them, T = 0.5 s and t_acc = 0.2 s."""
    if t <= 0.3:
        return np.array(((B - A) * t / 0.5 + A, (B - A) / 0.5, 0 * A))
    if t >= 0.7:
        return np.array((B + (C - B) * (t - 0.5) / 0.5, (C - B) / 0.5, 0 * A))
    h = (t - 0.5 + 0.2) / 0.4
    a0 = (B - A) * 0.3 / 0.5 + A
    a1 = (B - a0) / 0.5
    a3 = 2 * (a0 - B) + 0.8 * (C - B)
    a4 = -0.5 * a3
    return np.array(
        (
            a0 + a1 * h + a3 * h**3 + a4 * h**4,
            (a1 + 3 * a3 * h**2 + 4 * a4 * h**3) / 0.4,
            (6 * a3 * h + 12 * a4 * h**2) / 0.16,
        )
    )


def random_points(rng: np.random.Generator, count: int, joints: int) -> tuple[Array, Array, Array]:
    """Times, points, and blends that leave parts of the lines straight."""
    lasting = rng.uniform(0.3, 1.0, size=count - 1)
    shortest = np.minimum(np.append(lasting, np.inf), np.append(np.inf, lasting))
    blend = rng.uniform(0.05, 0.5, size=count) * shortest
    return np.append(0.0, np.cumsum(lasting)), rng.normal(size=(count, joints)), blend


def test_three_points_of_the_course() -> None:
    """At all 501 samples the motion is the course's, in position, speed and acceleration, and runs at its ends."""
    move = blended([0, 0.5, 1.0], [A, B, C], 0.2, ends="running")

    t = np.arange(501) * 0.002
    expected = np.array([of_the_course(x) for x in t])
    assert move.duration == 1.0
    np.testing.assert_allclose(move(t), expected[:, 0], atol=100 * SAME, rtol=SAME)
    np.testing.assert_allclose(move(t, 1), expected[:, 1], atol=1000 * SAME, rtol=SAME)
    inside = (np.abs(t - 0.3) > 1e-9) & (np.abs(t - 0.7) > 1e-9)  # where it is 0, but for the rounding of the time
    np.testing.assert_allclose(move(t[inside], 2), expected[inside, 2], atol=1e5 * SAME, rtol=SAME)


def test_the_path_misses_the_point_in_the_middle() -> None:
    """The course's path passes B at a distance of 3/16 · t_acc · (change of the rate): joint 2 by 10.4 degrees."""
    times, points = [0, 0.5, 1.0], [A, B, C]
    deviation = via_deviations(times, points, 0.2, ends="running")

    np.testing.assert_allclose(deviation[1], 3 / 16 * 0.2 * (C - 2 * B + A) / 0.5, rtol=SAME)
    np.testing.assert_allclose(blended(times, points, 0.2, ends="running")(0.5) - B, deviation[1], rtol=1e-10)
    assert deviation[1, 1] == pytest.approx(0.075 * (65.7969 + 2 * 1.4358 + 70.6108))
    np.testing.assert_array_equal(deviation[[0, 2]], 0)


@pytest.mark.parametrize("ends", ["rest", "running"])
@pytest.mark.parametrize("count", [2, 3, 4, 9])
def test_any_number_of_points(ends: Ends, count: int, rng: np.random.Generator) -> None:
    """Position, speed and acceleration are continuous, no joint is faster than on the lines, all within its time."""
    for _ in range(20):
        times, points, blend = random_points(rng, count, 3)

        move = blended(times, points, blend, ends=ends)

        assert move.duration == times[-1]
        found = continuity(move)
        assert found.order >= 2
        assert found.order_at_ends == ((2, 2) if ends == "rest" else (0, 0))
        np.testing.assert_allclose(move([0, times[-1]]), points[[0, -1]], atol=1e-10)
        np.testing.assert_allclose(move(times), points + via_deviations(times, points, blend, ends=ends), atol=1e-9)
        middle = (times[:-1] + blend[:-1] + times[1:] - blend[1:]) / 2
        np.testing.assert_allclose(move(middle, 2), 0, atol=1e-8)
        np.testing.assert_allclose(move.peaks(1), np.abs(move(middle, 1)).max(axis=0), rtol=1e-9)


def test_straight_lines_between_blends(rng: np.random.Generator) -> None:
    """Farther than the blend from a via point the motion is on the straight line between its points."""
    times, points, blend = random_points(rng, 5, 2)
    move = blended(times, points, blend, ends="running")
    blend[[0, -1]] = 0

    for i in range(4):
        part = np.linspace(times[i] + blend[i], times[i + 1] - blend[i + 1], 9)
        way = (part - times[i]) / (times[i + 1] - times[i])
        np.testing.assert_allclose(move(part), points[i] + way[:, None] * (points[i + 1] - points[i]), atol=1e-10)


def test_the_peak_of_a_blend() -> None:
    """Turning back from 1 to -1 rad/s within half a second on both sides takes 3/4 · 2 / 0.5 = 3 rad/s²."""
    move = blended([0, 1, 2], [[0.0], [1.0], [0.0]], 0.5, ends="running")

    assert move.peaks(2)[0] == pytest.approx(3)
    assert abs(move(1.0, 2)[0]) == pytest.approx(3)
    assert via_deviations([0, 1, 2], [[0.0], [1.0], [0.0]], 0.5, ends="running")[1, 0] == pytest.approx(-3 / 16)


def test_a_start_and_a_stop() -> None:
    """Two points: gather speed for 0.5 s, run, lose it for 0.5 s; the way is run at 1/(2 - 0.5) of it per second."""
    move = blended([0, 2], [[0.0], [1.0]], 0.5)

    assert move(1.0, 1)[0] == pytest.approx(1 / 1.5)
    np.testing.assert_allclose(move([0, 0.5, 1.5, 2])[:, 0], (0, 0.25 / 1.5, 1 - 0.25 / 1.5, 1), atol=SAME)


def test_an_intermediate_point_is_not_missed() -> None:
    """Where the rate does not change there is nothing to blend: the motion goes through the point."""
    times, points = [0, 1, 3], [[0.0, 0.0], [1.0, 2.0], [3.0, 6.0]]

    assert continuity(blended(times, points, 0.4, ends="running")).order == 3
    np.testing.assert_allclose(via_deviations(times, points, 0.4, ends="running"), 0, atol=SAME)


def test_nearest_passes(rng: np.random.Generator) -> None:
    """The distance from a via point is what SciPy finds by searching the time, and no more than the deviation."""
    for _ in range(10):
        times, points, blend = random_points(rng, 5, 3)
        move = blended(times, points, blend)

        distances = via_distances(times, points, blend)

        deviations = np.linalg.norm(via_deviations(times, points, blend), axis=-1)
        assert (distances <= deviations + SAME).all()
        for i in (1, 2, 3):
            near = times[i] + blend[i] * np.linspace(-1, 1, 400)
            off = np.linalg.norm(move(near) - points[i], axis=-1)
            around = near[max(off.argmin() - 1, 0)], near[min(off.argmin() + 1, 399)]

            def distance(t: float, move: Trajectory = move, point: Array = points[i]) -> float:
                return float(np.linalg.norm(move(t) - point))

            least = minimize_scalar(distance, bounds=around, options={"xatol": 1e-12})
            assert distances[i] == pytest.approx(least.fun, abs=1e-9)


def test_equal_rates_pass_nearest_at_the_point() -> None:
    """A right angle run at constant speed is passed at 3/16 · blend · sqrt(2) · speed."""
    times, points = [0, 1, 2], [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]

    assert via_distances(times, points, 0.4, ends="running")[1] == pytest.approx(3 / 16 * 0.4 * np.sqrt(2))


def test_a_point_to_wait_at_is_not_missed() -> None:
    """Where the path waits before it goes on, or after it has come, it has been at the point."""
    points = [[0.0, 0.0], [1.0, 2.0], [1.0, 2.0], [3.0, 1.0]]

    np.testing.assert_allclose(via_distances([0, 1, 2, 3], points, 0.2), 0, atol=SAME)


@given(
    way=st.lists(st.integers(1, 20), min_size=1, max_size=6),
    speed=st.floats(0.1, 10),
    acceleration=st.floats(0.1, 10),
    ends=st.sampled_from(["rest", "running"]),
)
def test_times_from_limits(way: list[int], speed: float, acceleration: float, ends: Ends) -> None:
    """With the times and blends for limits no joint passes one, and a joint is at one: or else two blends touch."""
    points = np.cumsum([[0.0, 0.0], *([(-1) ** i * w, w / 2] for i, w in enumerate(way))], axis=0)

    times, blend = blend_timing(points, (speed, 0.4 * speed), acceleration, ends=ends)
    move = blended(times, points, blend, ends=ends)

    assert (move.peaks(1) <= np.array((speed, 0.4 * speed)) * (1 + AT_LIMIT)).all()
    if len(way) > 1 or ends == "rest":
        assert move.peaks(2).max() == pytest.approx(acceleration)
    touching = (np.diff(times) - blend[:-1] - blend[1:]).min() < AT_LIMIT * times[-1]
    assert touching or (move.peaks(1) / (speed, 0.4 * speed)).max() == pytest.approx(1)


def test_blends_that_overlap() -> None:
    """Overlapping blends are refused with the way, the times they need and the time there is; touching ones are not."""
    points = [[0.0], [1.0], [0.5], [2.0]]
    said = (
        "blends overlap on the segment from point 2 to point 3: they need 0.3 s and 0.25 s of it, 0.55 s together; "
        "it lasts 0.5 s"
    )
    with pytest.raises(InvalidValueError, match=re.escape(said)):
        blended([0, 1, 1.5, 3], points, [0.1, 0.3, 0.25, 0.1])

    touching = blended([0, 1, 1.5, 3], points, [0.1, 0.3, 0.2, 0.1])
    assert continuity(touching).order == 2
    assert len(touching.times) == 7


NONSENSE = [
    (([0.0], [[1.0]], 0.1), {}, ShapeError, "k at least 2"),
    (([0.0, 1.0, 1.0], np.zeros((3, 1)), 0.1), {}, InvalidValueError, "got 1 s and then 1 s at point 2"),
    (([1.0, 2.0], np.zeros((2, 1)), 0.1), {}, InvalidValueError, "times must increase from 0, got 1 s at point 1"),
    (([0.0, 1.0], [[0.0], [np.nan]], 0.1), {}, InvalidValueError, r"points: every number must be finite, got nan"),
    (([0.0, 1.0], np.zeros((2, 1)), 0.0), {}, InvalidValueError, "blend: expected more than 0 s, got 0 s at point 1"),
    (([0.0, 1.0, 2.0], np.zeros((3, 1)), [9, -1, 9]), {"ends": "running"}, InvalidValueError, "got -1 s at point 2"),
    (([0.0, 1.0], np.zeros((2, 1)), [0.1, 0.1, 0.1]), {}, ShapeError, "blend: expected one number, or 2, one per"),
    (([0.0, 1.0], np.zeros((2, 1)), "wide"), {}, KindError, "blend: expected numbers, got 'wide'"),
    (([0.0, 1.0], np.zeros((2, 1)), 0.1), {"ends": "runing"}, UnknownNameError, "Did you mean 'running'"),
]


@pytest.mark.parametrize(("arguments", "options", "kind", "said"), NONSENSE)
def test_blends_of_nonsense(
    arguments: tuple[object, ...], options: dict[str, str], kind: type[Exception], said: str
) -> None:
    """What has no meaning is refused with the place and what came."""
    for function in (blended, via_deviations, via_distances):
        with pytest.raises(kind, match=said):
            function(*arguments, **options)  # type: ignore[operator]


def test_limits_that_give_no_times() -> None:
    """Two equal neighbours, a way or a blend without a limit, too few points: each is named."""
    with pytest.raises(InvalidValueError, match="points 2 and 3 coincide"):
        blend_timing([[0.0], [1.0], [1.0]], 1.0, 1.0)
    with pytest.raises(InvalidValueError, match="no joint that moves from point 1 to point 2 has a limit"):
        blend_timing([[0.0, 0.0], [1.0, 0.0]], [np.inf, 1.0], 1.0)
    with pytest.raises(InvalidValueError, match="no joint whose speed changes at point 1 has a limit"):
        blend_timing([[0.0], [1.0]], 1.0, np.inf)
    with pytest.raises(ShapeError, match=r"blends: expected \(k, n\) points with k at least 2, got \(1, 1\)"):
        blend_timing([[0.0]], 1.0, 1.0)
