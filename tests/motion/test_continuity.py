"""What jumps in a motion, where, and how that is said."""

import numpy as np
import pytest

from armwright.errors import InvalidValueError, KindError
from armwright.motion.blends import blended
from armwright.motion.continuity_report import continuity
from armwright.motion.cubic_polynomials import cubic
from armwright.motion.quintic_polynomials import quintic
from armwright.motion.trajectory import Trajectory, hold, join
from armwright.motion.trapezoidal_profile import trapezoid


def test_a_quintic_against_rest() -> None:
    """A quintic has no knot inside; at its ends only the jerk jumps, by 60 way / time³."""
    found = continuity(quintic([0.0, 0.0], [1.0, 2.0], 2.0))

    assert (found.order, found.order_at_ends) == (3, (2, 2))
    np.testing.assert_allclose(found.jumps[3, 0], (60 / 8, 120 / 8))
    np.testing.assert_allclose(found.jumps[3, -1], (-60 / 8, -120 / 8))
    np.testing.assert_array_equal(found.largest(3), 0)


def test_a_trapezoid_by_hand() -> None:
    """Accelerating by 1 rad/s², then not, then by -1: the acceleration jumps by -1 twice inside, by 1 at both ends."""
    found = continuity(trapezoid([0.0], [3.0], 1.0, 1.0))

    assert (found.order, found.order_at_ends) == (1, (1, 1))
    np.testing.assert_allclose(found.times, (0, 1, 3, 4))
    np.testing.assert_allclose(found.jumps[2, :, 0], (1, -1, -1, 1))
    np.testing.assert_allclose(found.largest(2), 1)


def test_every_order() -> None:
    """Where a position, a speed, an acceleration or a jerk jumps by one, that is the first to be named."""
    for order, factorial in enumerate((1, 1, 2, 6)):
        coefficients = np.zeros((2, 4, 1))
        coefficients[:, 0] = 5.0
        coefficients[1, order] += 1 / factorial
        found = continuity(Trajectory(times=(0, 1, 2), coefficients=coefficients))

        assert found.order == order - 1
        np.testing.assert_allclose(found.jumps[order, 1], 1)
        assert ("position is discontinuous" in str(found)) == (order == 0)


def test_the_text() -> None:
    """The text says up to which order it is continuous, what jumps first, where and by how much."""
    move = blended([0, 1, 2], [[0.0, 0.0], [1.0, 0.0], [0.0, 4.0]], 0.5, ends="running")

    lines = str(continuity(move)).splitlines()

    # Joint 2 goes from 0 to 4 rad/s: its jerk begins and ends with 6 · 4 / (2 · 0.5)².
    assert lines[0] == "at 2 knots: position, speed and acceleration are continuous"
    assert lines[1] == "  jerk jumps at 2 of them, most at 0.5 s: joint 2 by 24"
    assert lines[2] == "at the start, from rest: position is continuous; speed jumps, most in joint 1 by 1"
    assert lines[3] == "at the end, to rest: position is continuous; speed jumps, most in joint 2 by 4"
    assert str(continuity(quintic([0.0], [1.0], 1.0))).startswith("no knots between start and end\n")


def test_rounding_is_no_jump(rng: np.random.Generator) -> None:
    """A polynomial cut in a thousand pieces is continuous in all orders, however short they are."""
    for duration in (1e-3, 1.0, 1e3):
        move = quintic([0.0, 1.0], [1.0, 100.0], duration)
        cuts = np.sort(rng.uniform(0, duration, size=1000))
        times = np.concatenate([[0.0], cuts, [duration]])
        orders = (1, 1, 2, 6, 24, 120)
        terms = np.stack([move(times[:-1], order) / orders[order] for order in range(6)], axis=1)

        assert continuity(Trajectory(times=times, coefficients=terms), tolerance=1e-9).order == 3


def test_the_tolerance_is_what_is_asked() -> None:
    """A jump of a thousandth of the largest speed counts to 1e-4 of it, and not to 1e-2."""
    first, second = cubic([0.0], [1.0], 1.0, end=[1.5]), cubic([1.0], [3.0], 1.0, start=[1.5015])
    move = join([first, second])

    assert continuity(move, tolerance=1e-4).order == 0
    assert continuity(move, tolerance=1e-2).order == 1


def test_parts_without_duration() -> None:
    """Standing still for no time between two moves changes nothing; a motion of no time at all is smooth."""
    there = quintic([0.0], [1.0], 1.0)
    found = continuity(join([there, hold([1.0], 0.0), there.reversed()]))

    np.testing.assert_allclose(found.times, (0, 1, 2))
    assert continuity(hold([1.0], 0.0)).order == 3


def test_what_is_no_motion() -> None:
    """Something else than a trajectory, or a tolerance below 0, is refused."""
    with pytest.raises(KindError, match="continuity: expected a trajectory, got 'line'"):
        continuity("line")  # type: ignore[arg-type]
    with pytest.raises(InvalidValueError, match="tolerance: expected 0 or more, got -1"):
        continuity(hold([1.0], 1.0), tolerance=-1)
