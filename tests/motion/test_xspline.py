"""The X-spline: exact for cubics, of order four, its general parameters, and the jumps of its acceleration."""

import re

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from armwright.arrays import Array, ArrayLike
from armwright.errors import InvalidValueError, ShapeError
from armwright.motion.continuity_report import continuity
from armwright.motion.xspline_path import xspline, xspline_along

ROUNDING = 1e-12


def unequal_steps(rng: np.random.Generator, count: int) -> Array:
    return np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 1.0, size=count))])


def xspline_rates(times: ArrayLike, knots: ArrayLike, *ends: ArrayLike, **parameters: ArrayLike) -> Array:
    """The rates of an X-spline at its knots."""
    spline = xspline(times, knots, *ends, **parameters)
    return spline(spline.times, 1)


def order_of_convergence(**parameters: float) -> Array:
    """By what power the error falls when the steps of knots on a sine are halved, and halved again."""
    errors = []
    for count in (32, 64, 128, 256):
        times = np.linspace(0, 2, count + 1)
        spline = xspline(times, np.sin(times)[:, None], [1.0], [np.cos(2.0)], **parameters)
        t = np.linspace(0, 2, 8001)
        errors.append(np.abs(spline(t)[:, 0] - np.sin(t)).max())
    return np.log2(np.array(errors[:-1]) / errors[1:])


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
    np.testing.assert_allclose(order_of_convergence(), 4, atol=0.25)


def test_xspline_against_scipy(rng: np.random.Generator) -> None:
    """SciPy's Hermite cubic through the same knots and rates is the same curve."""
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 1.0, size=6))])
    knots = rng.normal(size=(7, 3))
    t = np.linspace(0, times[-1], 300)

    rates = xspline_rates(times, knots, np.zeros(3), np.zeros(3))

    np.testing.assert_allclose(xspline(times, knots)(t), CubicHermiteSpline(times, knots, rates)(t), atol=1e-10)


def test_times_must_rise() -> None:
    """Two knots at one time are refused, with the knot."""
    with pytest.raises(InvalidValueError, match=r"got 0\.5 s and then 0\.5 s at knot 2"):
        xspline([0, 0.5, 0.5], np.zeros((3, 1)))
    with pytest.raises(ShapeError, match="k at least 2"):
        xspline([0], np.zeros((1, 1)))


@given(
    steps=st.lists(st.floats(0.2, 1.0), min_size=2, max_size=9),
    share=st.floats(0.0, 0.9),
    terms=st.lists(st.floats(-2, 2), min_size=4, max_size=4),
)
def test_cubics_are_exact_for_every_b(steps: list[float], share: float, terms: list[float]) -> None:
    """With a left out, cubics come back whatever b is, up to nine tenths of h_last / (h_last + h_next)."""
    h = np.array(steps)
    b = share * h[:-1] / (h[:-1] + h[1:])
    times = np.concatenate([[0.0], np.cumsum(h)])
    cubic = np.polynomial.Polynomial(terms)

    rates = xspline_rates(times, cubic(times)[:, None], [cubic.deriv()(0.0)], [cubic.deriv()(times[-1])], b=b)

    np.testing.assert_allclose(rates[:, 0], cubic.deriv()(times), atol=1e-7)


def test_spline_of_continuous_acceleration(rng: np.random.Generator) -> None:
    """With b = h_last / 2(h_last + h_next) it is the cubic spline that SciPy fits to all knots at once."""
    times, knots = unequal_steps(rng, 12), rng.normal(size=(13, 4))
    start, end = rng.normal(size=(2, 4))
    h = np.diff(times)

    spline = xspline(times, knots, start, end, b=h[:-1] / (2 * (h[:-1] + h[1:])))

    t = np.linspace(0, times[-1], 300)
    np.testing.assert_allclose(spline(t), CubicSpline(times, knots, bc_type=((1, start), (1, end)))(t), atol=1e-10)
    assert continuity(spline).order == 2


def test_parameters_solve_their_equations(rng: np.random.Generator) -> None:
    """For any a and b, a m_last + m + b m_next is the same sum of the rates of parabolas, which NumPy fits."""
    times, knots = unequal_steps(rng, 7), rng.normal(size=(8, 1))
    a, b = rng.uniform(-0.5, 0.5, size=(2, 6))

    m = xspline_rates(times, knots, [0.3], [-0.2], a=a, b=b)[:, 0]

    assert (m[0], m[-1]) == (0.3, pytest.approx(-0.2))
    for i in range(1, 7):
        parabola = np.polynomial.Polynomial.fit(times[i - 1 : i + 2], knots[i - 1 : i + 2, 0], 2).deriv()
        weights = np.array((a[i - 1], 1.0, b[i - 1]))
        assert weights @ m[i - 1 : i + 2] == pytest.approx(weights @ parabola(times[i - 1 : i + 2]), abs=1e-10)


@pytest.mark.parametrize(("b", "order"), [(0.25, 4), (-0.1, 4)])
def test_order_of_other_parameters(b: float, order: int) -> None:
    """What is exact for cubics is of order four."""
    np.testing.assert_allclose(order_of_convergence(b=b), order, atol=0.25)


def test_order_where_cubics_are_not_exact() -> None:
    """With an a of one's own the error still falls, by the order three of parabolas."""
    np.testing.assert_allclose(order_of_convergence(a=0.2, b=0.0), 3, atol=0.25)


@pytest.mark.parametrize("knots", [2, 3, 4, 5, 8, 9, 31, 1000])
def test_rates_one_after_the_other(knots: int, rng: np.random.Generator) -> None:
    """Solved all together, the rates are those that the rule gives one after the other."""
    times, q = unequal_steps(rng, knots - 1), rng.normal(size=(knots, 2))
    h = np.diff(times)[:, None]
    slope = np.diff(q, axis=0) / h
    m = [np.array((0.5, -0.5))]
    for i in range(1, knots - 1):
        a = h[i] / (h[i - 1] + h[i])
        curve = (slope[i] - slope[i - 1]) / (h[i - 1] + h[i])
        m.append(a * (slope[i - 1] - h[i - 1] * curve) + slope[i - 1] + h[i - 1] * curve - a * m[-1])

    rates = xspline_rates(times, q, [0.5, -0.5], [0.0, 0.0])

    np.testing.assert_allclose(rates[:-1], m, rtol=1e-11, atol=1e-11)


def test_parameters_without_one_spline() -> None:
    """Where |a| + |b| is not below 1 there may be no spline or many: refused with the knot and the numbers."""
    times, knots = np.arange(5.0), np.zeros((5, 1))
    with pytest.raises(InvalidValueError, match=re.escape("got 1.1 at knot 2 (a = 0.6, b = -0.5)")):
        xspline(times, knots, a=[0.5, 0.6, 0.5], b=[0.0, -0.5, 0.0])
    with pytest.raises(InvalidValueError, match="below 1 for the spline to exist and be unique, got 1 at knot 1"):
        xspline(times, knots, a=1.0)
    with pytest.raises(ShapeError, match="a: expected one number, or 3, one per inner knot, got shape"):
        xspline(times, knots, a=[0.1, 0.2])


def test_jump_of_the_acceleration() -> None:
    """On equal steps h the acceleration jumps by -h²/3 times the fourth derivative, here that of a sine."""
    for h in (0.1, 0.01):
        times = h * np.arange(round(2 / h) + 1)
        jumps = continuity(xspline(times, np.sin(times)[:, None], [1.0], [np.cos(times[-1])])).jumps[2, :, 0]

        settled = slice(10, -10)  # what the given rates at the ends do to their neighbours has died away
        np.testing.assert_allclose(-jumps[settled] * 3 / h**2, np.sin(times[settled]), atol=3 * h)


@pytest.mark.parametrize("bound", [1e-1, 1e-2, 1e-3])
def test_jumps_within_a_bound(bound: float) -> None:
    """Knots are added until no acceleration jumps by more than allowed, and not many more than needed."""

    def curve(t: Array) -> Array:
        return np.stack([np.sin(3 * t), 0.2 * np.exp(-t)], axis=-1)

    spline = xspline_along(curve, np.linspace(0, 2, 5), bound, start=(3, -0.2), end=(3 * np.cos(6), -0.2 * np.exp(-2)))

    assert np.abs(continuity(spline).jumps[2, 1:-1]).max() <= bound
    # Equal steps of sqrt(3 bound / largest fourth derivative) would do.
    assert len(spline.times) < 2.5 * 2 / np.sqrt(3 * bound / 81)
    np.testing.assert_allclose(spline(spline.times), curve(spline.times), atol=ROUNDING)
    t = np.linspace(0, 2, 1000)
    np.testing.assert_allclose(spline(t), curve(t), atol=bound**2)


def test_a_bound_for_each_joint() -> None:
    """A joint whose acceleration may jump as it likes asks for no knots."""

    def curve(t: Array) -> Array:
        return np.stack([np.sin(9 * t) * t**2, t**2], axis=-1)

    end = 9 * np.cos(9) + 2 * np.sin(9), 2.0
    free = xspline_along(curve, np.linspace(0, 1, 4), (np.inf, 1e-6), end=end)
    both = xspline_along(curve, np.linspace(0, 1, 4), (1.0, 1e-6), end=end)

    assert len(free.times) == 4
    assert len(both.times) > 20


@pytest.mark.parametrize("start", [(0.0,), (1.0,)])
def test_no_spacing_helps(start: tuple[float]) -> None:
    """A corner of the curve, or a rate at its start that is not its own, is said with the place and the numbers."""

    def curve(t: Array) -> Array:
        return np.abs(t - 1.0)[:, None] if start == (1.0,) else np.sin(t)[:, None]

    with pytest.raises(InvalidValueError, match=r"acceleration of joint 1 still jumps by .* s, 0\.1 is allowed"):
        xspline_along(curve, np.linspace(0, 2, 4), 0.1, start=start, end=[np.cos(2.0)])


def test_knots_that_are_none() -> None:
    """Too few knots, times that do not begin at 0, a number that is none: each with what came."""
    with pytest.raises(InvalidValueError, match="knots: every number must be finite, got nan at"):
        xspline([0, 1, 2], [[0.0], [np.nan], [1.0]])
    with pytest.raises(InvalidValueError, match="times: expected non-decreasing times"):
        xspline([1, 2, 3], np.zeros((3, 1)))
    with pytest.raises(InvalidValueError, match="jump: expected more than 0, got 0 for joint 1"):
        xspline_along(lambda t: t[:, None], [0, 1, 2], 0.0)
