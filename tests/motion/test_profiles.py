"""Profiles from one configuration to another: trapezoids of speed and cubics."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from scipy.interpolate import CubicHermiteSpline

from armwright.errors import InvalidValueError, KindError, ShapeError
from armwright.motion.continuity_report import continuity
from armwright.motion.cubic_polynomials import cubic, cubic_through
from armwright.motion.trapezoidal_profile import shortest_trapezoid, trapezoid

ROUNDING = 1e-12
# Limits may be passed by this part of them: rounding.
AT_LIMIT = 1e-9

displacements = st.lists(st.floats(-5, 5).filter(lambda x: x == 0 or abs(x) > 1e-6), min_size=1, max_size=4).filter(any)
limits = st.floats(0.05, 20)


def test_trapezoid_by_hand() -> None:
    """3 rad at 1 rad/s and 1 rad/s²: half a rad in the first second, half in the last, 2 rad in the 2 s between."""
    move = trapezoid([0.0], [3.0], 1.0, 1.0)

    assert move.duration == 4.0
    np.testing.assert_allclose(move([0, 1, 2, 3, 4])[:, 0], (0, 0.5, 1.5, 2.5, 3), atol=ROUNDING)
    np.testing.assert_allclose(move([0.5, 1.5, 3.5], 1)[:, 0], (0.5, 1, 0.5), atol=ROUNDING)
    np.testing.assert_allclose(move([0.5, 1.5, 3.5], 2)[:, 0], (1, 0, -1), atol=ROUNDING)


def test_triangle_by_hand() -> None:
    """1 rad at 4 rad/s² takes 1 s and never gets faster than 2 rad/s, whatever is allowed."""
    for speed in (2.0, 10.0, np.inf):
        move = trapezoid([0.0], [1.0], speed, 4.0)

        assert move.duration == pytest.approx(1.0)
        assert len(move.times) == 3
        assert move.peaks(1)[0] == pytest.approx(2.0)
        assert move(0.5)[0] == pytest.approx(0.5)


@given(way=displacements, speed=limits, acceleration=limits)
def test_trapezoids_keep_limits_and_use_them(way: list[float], speed: float, acceleration: float) -> None:
    """No joint passes a limit, some joint is at one, all joints start and stop together on a straight line."""
    start = np.arange(len(way), dtype=float)
    # A limit for each joint, not only one for all.
    speeds, accelerations = speed * (1 + start), acceleration / (1 + start)

    move = trapezoid(start, start + way, speeds, accelerations)

    assert (move.peaks(1) <= speeds * (1 + AT_LIMIT)).all()
    assert (move.peaks(2) <= accelerations * (1 + AT_LIMIT)).all()
    assert (move.peaks(2) / accelerations).max() == pytest.approx(1)
    assert move.duration == pytest.approx(shortest_trapezoid(way, speeds, accelerations), rel=1e-9)
    np.testing.assert_allclose(move([0.0, move.duration]), [start, start + way], atol=1e-11)
    np.testing.assert_allclose(move([0.0, move.duration], 1), 0, atol=1e-9)
    assert continuity(move, tolerance=1e-7).order >= 1
    part = (move(0.3 * move.duration) - start) / np.where(way, way, 1.0)
    np.testing.assert_allclose(part[np.nonzero(way)], part[np.flatnonzero(way)[0]], atol=1e-7)


@given(way=displacements, speed=limits, acceleration=limits, longer=st.floats(1, 50))
def test_trapezoids_of_given_duration(way: list[float], speed: float, acceleration: float, longer: float) -> None:
    """With more time than needed a move lasts exactly so long, speeds up as hard, and runs slower."""
    duration = longer * shortest_trapezoid(way, speed, acceleration)

    move = trapezoid(np.zeros(len(way)), way, speed, acceleration, duration)

    assert move.duration == duration
    assert move.peaks(2).max() == pytest.approx(acceleration)
    assert (move.peaks(1) <= speed * (1 + AT_LIMIT)).all()
    np.testing.assert_allclose(move(duration), way, atol=1e-11)


def test_trapezoid_against_ruckig(rng: np.random.Generator) -> None:
    """Without a limit of jerk, Ruckig needs as long as the trapezoid, and is at the same place at the same time."""
    ruckig = pytest.importorskip("ruckig")
    for way, speed, acceleration in rng.uniform(0.1, 3, size=(50, 3)):
        request, found = ruckig.InputParameter(1), ruckig.Trajectory(1)
        request.current_position, request.target_position = [0.0], [way]
        request.max_velocity, request.max_acceleration = [speed], [acceleration]
        ruckig.Ruckig(1).calculate(request, found)

        move = trapezoid([0.0], [way], speed, acceleration)

        assert move.duration == pytest.approx(found.duration, rel=1e-9)
        for t in np.linspace(0, move.duration, 20):
            assert move(t)[0] == pytest.approx(found.at_time(t)[0][0], abs=1e-8)


def test_trapezoid_nowhere() -> None:
    """A move to where the arm stands takes no time, or the time that is asked for."""
    assert trapezoid([1.0], [1.0], 1.0, 1.0).duration == 0
    assert trapezoid([1.0], [1.0], 1.0, 1.0, 2.0).duration == 2
    assert shortest_trapezoid([0.0, 0.0], 1.0, 1.0) == 0


def test_durations_that_no_joint_can_keep() -> None:
    """A duration too short is refused with the joint, its way, the time asked and the time needed."""
    with pytest.raises(
        InvalidValueError, match=r"1\.5 s is too short for joint 2, whose travel of 2 takes at least 3 s"
    ):
        trapezoid([0.0, 0.0], [0.1, -2.0], 1.0, 1.0, 1.5)
    with pytest.raises(InvalidValueError, match="no moving joint has a limit, so the velocity would be discontinuous"):
        trapezoid([0.0, 0.0], [1.0, 0.0], 1.0, [np.inf, 1.0])


@pytest.mark.parametrize(
    ("arguments", "kind", "said"),
    [
        (([0.0], [1.0], -1.0, 1.0), InvalidValueError, "speed: expected more than 0, got -1 for joint 1"),
        (([0.0], [1.0], 1.0, 0.0), InvalidValueError, "acceleration: expected more than 0, got 0 for joint 1"),
        (([0.0], [1.0], np.nan, 1.0), InvalidValueError, "speed: every number must be finite, got nan"),
        (([0.0], [1.0], "fast", 1.0), KindError, "speed: expected numbers, got 'fast'"),
        (([0.0], [1.0], [1.0, 2.0], 1.0), ShapeError, "speed: expected one number, or 1, one per joint"),
        (([0.0], [1.0], 1.0, 1.0, 0.0), InvalidValueError, "duration: expected at least 1e-09 s, got 0"),
        (([0.0], [1.0], 1.0, 1.0, 1e60), InvalidValueError, r"duration: expected at most 1e\+50 s, got 1e\+60"),
        (([0.0], [1.0], 1e-300, 1.0), InvalidValueError, r"duration: expected at most 1e\+50 s, got 1e\+300"),
        ((0.0, 1.0, 1.0, 1.0), ShapeError, r"q_start: expected shape \(n,\), got \(\)"),
        (([np.nan], [1.0], 1.0, 1.0), InvalidValueError, "q_start: every number must be finite, got nan"),
    ],
)
def test_trapezoids_of_nonsense(arguments: tuple[object, ...], kind: type[Exception], said: str) -> None:
    """What has no meaning is refused with the argument and what came."""
    with pytest.raises(kind, match=said):
        trapezoid(*arguments)  # type: ignore[arg-type]


def test_cubic_by_hand() -> None:
    """From rest to rest a cubic is half-way at half time, peaks at 3/2 of the mean speed and at 6 way/time²."""
    move = cubic([0.0, 1.0], [2.0, -3.0], 4.0)

    np.testing.assert_allclose(move([0, 2, 4]), [[0, 1], [1, -1], [2, -3]], atol=ROUNDING)
    np.testing.assert_allclose(move([0, 4], 1), 0, atol=ROUNDING)
    np.testing.assert_allclose(move.peaks(1), (1.5 * 2 / 4, 1.5 * 4 / 4))
    np.testing.assert_allclose(move.peaks(2), (6 * 2 / 16, 6 * 4 / 16))


def test_cubic_with_rates_against_scipy(rng: np.random.Generator) -> None:
    """Given rates at both ends, it is SciPy's Hermite cubic."""
    q, m = rng.normal(size=(2, 2, 5))
    t = np.linspace(0, 1.7, 50)

    move = cubic(q[0], q[1], 1.7, m[0], m[1])

    np.testing.assert_allclose(move(t), CubicHermiteSpline([0, 1.7], q, m)(t), atol=ROUNDING)


def test_cubics_through_points() -> None:
    """Without rates, a joint rests at the ends and where it turns back, and runs at the mean slope elsewhere."""
    move = cubic_through([0, 1, 3, 4], [[0.0], [1.0], [5.0], [4.0]])

    np.testing.assert_allclose(move([0, 1, 3, 4])[:, 0], (0, 1, 5, 4), atol=ROUNDING)
    np.testing.assert_allclose(move([0, 1, 3, 4], 1)[:, 0], (0, 1.5, 0, 0), atol=ROUNDING)
    assert continuity(move).order == 1


def test_cubics_through_points_at_rates(rng: np.random.Generator) -> None:
    """With rates they are SciPy's Hermite cubics."""
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 1, size=5))])
    q, m = rng.normal(size=(2, 6, 3))
    t = np.linspace(0, times[-1], 200)

    np.testing.assert_allclose(cubic_through(times, q, m)(t), CubicHermiteSpline(times, q, m)(t), atol=1e-10)


def test_cubics_through_nonsense() -> None:
    """Too few points, times that fall, rates that do not fit, are refused with the place and what came."""
    with pytest.raises(ShapeError, match="k at least 2"):
        cubic_through([0.0], [[1.0]])
    with pytest.raises(InvalidValueError, match="cubics: times must increase, got 2 s and then 1 s at point 2"):
        cubic_through([0.0, 2.0, 1.0], np.zeros((3, 1)))
    with pytest.raises(ShapeError, match=r"rates: expected a shape ending in \(2, 1\), got \(2, 2\)"):
        cubic_through([0.0, 1.0], np.zeros((2, 1)), np.zeros((2, 2)))
    with pytest.raises(ShapeError, match="end: expected 1 numbers"):
        cubic([0.0], [1.0], 1.0, end=[0.0, 0.0])
