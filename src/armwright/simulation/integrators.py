"""Integrators of ordinary differential equations, one step at a time, with what lies between.

Whoever asks for the steps watches for events between their ends and begins anew behind each.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Literal, NamedTuple, Protocol, TypeAlias, get_args

import attrs
import numpy as np

from armwright.arrays import Array, number
from armwright.errors import InvalidValueError, one_of

# The derivative of the state y at time t.
Slope: TypeAlias = Callable[[float, Array], Array]
Method: TypeAlias = Literal["RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA"]

# Part of a step by which a step to a grid point may be longer rather than leave a crumb.
_CRUMB = 1e-9
_ROOT_2 = math.sqrt(2.0)


class Step(NamedTuple):
    """One step.

    Attributes:
        start: time at its start [s].
        end: time at its end [s].
        state: there.
        between: the state at any time in between.
    """

    start: float
    end: float
    state: Array
    between: Callable[[float], Array]


class Integrator(Protocol):
    """A method of integration."""

    def steps(self, slope: Slope, t: float, y: Array, end: float) -> Iterator[Step]:
        """Give the steps from the state y at time t up to ``end``, or to where none is as precise as asked."""


@attrs.frozen(kw_only=True)
class Gill:
    """Runge-Kutta-Gill, order 4, in fixed steps that end at multiples of their length.

    Attributes:
        length: of a step [s].

    Source:
        Gill (1951); TR-83-008, section 4.
    """

    length: float = 1e-3

    def __attrs_post_init__(self) -> None:
        """Refuse steps that lead nowhere."""
        if not 0 < number(self.length, "Gill: length") < math.inf:
            raise InvalidValueError(f"Gill: expected a step length above 0 s, got {self.length}")

    def steps(self, slope: Slope, t: float, y: Array, end: float) -> Iterator[Step]:
        """Give the steps from the state y at time t up to ``end``."""
        while t < end:
            grid = self.length * (math.floor(t / self.length + _CRUMB) + 1)
            stop = end if grid > end - _CRUMB * self.length else grid
            between = _gill_from(slope, t, y)
            step = Step(start=t, end=stop, state=between(stop), between=between)
            yield step
            t, y = stop, step.state


def _gill_from(slope: Slope, start: float, y: Array) -> Callable[[float], Array]:
    """Return the state at any time after a start by one step of Runge-Kutta-Gill."""
    first = slope(start, y)
    return lambda t: gill(slope, start, y, t - start, first)


def gill(slope: Slope, t: float, y: Array, h: float, first: Array) -> Array:
    """Return the state after one step of Runge-Kutta-Gill.

    Args:
        slope: the derivative of the state.
        t: time at the start [s].
        y: state at the start.
        h: length of the step [s].
        first: the slope there.

    Source:
        Gill (1951), "A process for the step-by-step integration of differential equations in an automatic digital
        computing machine", without its sparing of memory.
    """
    second = slope(t + h / 2, y + h / 2 * first)
    third = slope(t + h / 2, y + h * ((_ROOT_2 - 1) / 2 * first + (2 - _ROOT_2) / 2 * second))
    fourth = slope(t + h, y + h * (-_ROOT_2 / 2 * second + (2 + _ROOT_2) / 2 * third))
    return y + h / 6 * (first + (2 - _ROOT_2) * second + (2 + _ROOT_2) * third + fourth)


@attrs.frozen(kw_only=True)
class Adaptive:
    """One of SciPy's methods, which choose their steps by the error they estimate.

    Attributes:
        method: its name in SciPy; ``Radau`` and ``BDF`` for stiff controllers.
        rtol: error allowed per step, relative to the state.
        atol: error allowed per step beside that [rad], [m], or per second.
        longest: the longest step [s]. Between the ends of a step nothing is watched that comes and goes.

    Source:
        Hairer, Nørsett & Wanner (1993), sections II.4 and II.5, as in SciPy.
    """

    method: Method = "DOP853"
    rtol: float = 1e-8
    atol: float = 1e-10
    longest: float = 0.02

    def __attrs_post_init__(self) -> None:
        """Refuse what SciPy does not know, and tolerances that nothing meets."""
        one_of("method", self.method, get_args(Method))
        for name in ("rtol", "atol", "longest"):
            if not number(getattr(self, name), f"Adaptive: {name}") > 0:
                raise InvalidValueError(f"Adaptive: {name} must be above 0, got {getattr(self, name)}")

    def steps(self, slope: Slope, t: float, y: Array, end: float) -> Iterator[Step]:
        """Give the steps from the state y at time t up to ``end``, or to where none is as precise as asked."""
        from scipy import integrate  # noqa: PLC0415 - SciPy takes longer to import than all else

        lost = False

        def watched(t: float, y: Array) -> Array:
            nonlocal lost
            derivative = slope(t, y)
            lost |= not np.isfinite(derivative).all()
            return derivative

        method = getattr(integrate, self.method)
        solver = method(watched, t, y, end, rtol=self.rtol, atol=self.atol, max_step=self.longest)
        while solver.status == "running":
            start = float(solver.t)
            try:
                message = solver.step()
            except ValueError:
                # The implicit methods stumble over a slope that is no number.
                if not lost:
                    raise
                return
            if message is not None or solver.status == "failed":
                return
            yield Step(start=start, end=float(solver.t), state=solver.y.copy(), between=solver.dense_output())


def first_crossing(value: Callable[[float], float], start: float, end: float) -> float:
    """Return a time just behind the time at which a function falls through 0, between -1 and 0 if time allows.

    Args:
        value: the function; at least 0 at the start, below 0 at the end. It is measured in what counts as nothing.
        start: time [s].
        end: time [s].

    Source:
        Dowell & Jarratt (1971), the Illinois method, with a bisection whenever it is slow.
    """
    above, below = max(value(start), 0.0), value(end)
    weight, kept_side = 1.0, 0
    for turn in range(200):
        if below >= -1 or np.nextafter(start, end) >= end:
            break
        # The end that stays for a second time counts half, so that the other one comes nearer too.
        high, low = (above * weight, below) if kept_side > 0 else (above, below * weight)
        middle = start + (high / (high - low) if turn % 3 < 2 else 0.5) * (end - start)
        if not start < middle < end:
            middle = (start + end) / 2
        level = value(middle)
        side = 1 if level < 0 else -1
        weight, kept_side = (weight / 2 if side == kept_side else 1.0), side
        if level < 0:
            end, below = middle, level
        else:
            start, above = middle, level
    return float(end)
