"""Runge-Kutta-Gill, SciPy's methods, and the search for events between steps."""

import math
from collections.abc import Iterable

import numpy as np
import pytest

from armwright.errors import InvalidValueError, UnknownNameError
from armwright.simulation.integrators import Adaptive, Gill, Step, first_crossing, gill

SWING = np.array((1.0, 0.0))


def _oscillator(_t: float, y: np.ndarray) -> np.ndarray:
    return np.array((y[1], -y[0]))


def _forced(t: float, y: np.ndarray) -> np.ndarray:
    return np.array((y[0] * math.cos(t),))


def _to_the_end(steps: Iterable[Step], end: float) -> np.ndarray:
    *_, last = steps
    assert last.end == end
    return last.state


@pytest.mark.parametrize(
    ("slope", "start", "exact"),
    [(_oscillator, SWING, (math.cos(2.0), -math.sin(2.0))), (_forced, np.ones(1), (math.exp(math.sin(2.0)),))],
)
def test_gill_is_of_order_four(slope: object, start: np.ndarray, exact: tuple[float, ...]) -> None:
    """Half the step leaves a sixteenth of the error, for equations with and without the time in them."""
    errors = [
        np.abs(_to_the_end(Gill(length=length).steps(slope, 0.0, start, 2.0), 2.0) - exact).max()
        for length in (0.1, 0.05, 0.025)
    ]

    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 4.0, atol=0.15)


def test_gill_is_exact_for_cubics() -> None:
    """A slope that is a cubic of the time is integrated without error, as by Simpson's rule."""
    done = gill(lambda t, _y: np.array((4 * t**3,)), 1.0, np.zeros(1), 2.0, np.array((4.0,)))

    assert done[0] == pytest.approx(3**4 - 1, rel=1e-14)


def test_gill_steps_end_on_the_grid() -> None:
    """From 0.25 in steps of 0.1 the ends are 0.3, 0.4 and, cut short, 0.45."""
    ends = [step.end for step in Gill(length=0.1).steps(_oscillator, 0.25, SWING, 0.45)]

    np.testing.assert_allclose(ends, (0.3, 0.4, 0.45), rtol=1e-15)


@pytest.mark.parametrize("length", [0.0, -1.0, math.inf, math.nan])
def test_steps_that_lead_nowhere(length: float) -> None:
    """A step must have a length."""
    with pytest.raises(InvalidValueError, match="Gill: expected a step length above 0 s"):
        Gill(length=length)


def test_settings_that_scipy_has_not() -> None:
    """A method is one of SciPy's, and nothing is integrated without an error."""
    with pytest.raises(UnknownNameError, match=r"no method 'RK54'\. Did you mean 'RK45'\?"):
        Adaptive(method="RK54")
    with pytest.raises(InvalidValueError, match=r"Adaptive: rtol must be above 0, got 0"):
        Adaptive(rtol=0.0)


@pytest.mark.parametrize("method", ["RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA"])
def test_scipy_methods(method: str) -> None:
    """Every method of SciPy's swings the pendulum to where it belongs, and knows what lies between its steps."""
    steps = Adaptive(method=method, rtol=1e-8, atol=1e-10).steps(_oscillator, 0.0, SWING, 0.5)

    done = _to_the_end(steps, 0.5)

    np.testing.assert_allclose(done, (math.cos(0.5), -math.sin(0.5)), atol=1e-6)
    first = next(Adaptive(method=method, rtol=1e-8, atol=1e-10).steps(_oscillator, 0.0, SWING, 0.5))
    middle = (first.start + first.end) / 2
    np.testing.assert_allclose(first.between(middle), (math.cos(middle), -math.sin(middle)), atol=1e-6)


@pytest.mark.parametrize("tame", [1e3, 1e12])
def test_first_crossing(tame: float) -> None:
    """A fall through zero is found to a unit of what counts as nothing, or to the last digit of the time."""
    found = first_crossing(lambda t: tame * (math.cos(t) - 0.5) + 1, 0.0, 2.0)

    value = tame * (math.cos(found) - 0.5) + 1
    assert -1 - 1e-3 <= value < 0
    assert found == pytest.approx(math.acos(0.5 - 1.5 / tame), abs=1.0 / tame)


def test_first_crossing_of_a_cliff() -> None:
    """A jump is found between two neighbouring numbers."""
    found = first_crossing(lambda t: 1e9 if t < 0.3 else -1e9, 0.0, 1.0)

    assert found == pytest.approx(0.3, rel=1e-15)
