"""A controlled stop: from any moment of a motion to rest, along the path that was planned.

A motion q(τ) is run by a clock τ(t), which goes at the rate 1 until the stop and comes to a standstill. The tool stays
on its path, and with

    qd = q' τ̇,    qdd = q'' τ̇² + q' τ̈

a clock that only slows down never asks a joint for more speed than the motion does, nor, where τ̈ is 0, for more
acceleration. So there is always a stop within the limits, however near to them the motion runs: at worst its own end.

A motion that was stopped so is resumed by a clock that begins at the rate 0 and comes smoothly to the rate 1. Where the
path asks for all of an acceleration, a slower start leaves room for that of the clock.
"""

from __future__ import annotations

import math
from itertools import pairwise

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, number, one_per_joint
from armwright.errors import InvalidValueError
from armwright.motion.polynomials import composition, derivative, evaluate, shifted
from armwright.motion.trajectory import Trajectory, hold

# How long the clock takes to go from no deceleration to the largest, so that the acceleration does not jump [s].
_RAMP = 0.01
# The clock is worked out in steps of this length or less [s], and of this part of the shortest stop or less.
_STEP = 2e-3
_PART = 0.05
# Between two steps an acceleration bends; so much of its limit is kept for that.
_MARGIN = 5e-4
# What a stop may exceed a limit by: rounding.
_ROUNDING = 1e-6
# A time this part of a period behind a tick is on it.
_ROUNDING = 1e-9
# Steps are halved so often before the motion is run to its own end instead.
_HALVINGS = 6
# A start that is too fast is made so many times longer, at most so often; each try is dear, and a longer start is slow.
_LONGER = 1.25
_TRIES = 60
# Positions on each step at which accelerations are sampled.
_LOOKS = np.linspace(0.0, 1.0, 9)


@attrs.frozen
class Stop:
    """A motion that was stopped on its path.

    Attributes:
        trajectory: from the stop to rest.
        reached: the time of the motion whose position the arm comes to rest at [s].
    """

    trajectory: Trajectory
    reached: float


@attrs.frozen
class Resumption:
    """A motion that goes on along its path from rest.

    Attributes:
        trajectory: from rest to the end of the motion.
        clock: the time of the motion [s] at each time of the trajectory, as a motion of one number.
    """

    trajectory: Trajectory
    clock: Trajectory


def brake(running: Trajectory, t: float, acceleration: ArrayLike, *, period: float | None = None) -> Trajectory:
    """Return the motion that stops an arm along its path.

    It goes on with the position, speed and acceleration of the motion, and its accelerations jump only where those of
    the path do. A joint whose acceleration has no limit brakes no harder than the motion itself, or 1 rad/s² or m/s².

    Args:
        running: the motion to be stopped, within its limits.
        t: when [s], within it.
        acceleration: largest accelerations (n,) [rad/s²] or [m/s²].
        period: of the servo [s], to last a whole number of them; any duration when left out.

    Raises:
        InvalidValueError: ``t`` is outside the motion, or an acceleration is not above 0.
    """
    return stop_on_path(running, t, acceleration, period=period).trajectory


def stop_on_path(running: Trajectory, t: float, acceleration: ArrayLike, *, period: float | None = None) -> Stop:
    """Return the motion that stops an arm along its path, as ``brake`` does, and how far on its path the arm comes."""
    limit, own = _limits(running, t, acceleration)
    if t == running.duration or not running(t, 1).any():
        return Stop(hold(running(t), period or _STEP), t)
    # What the motion exceeds its limits by, it cannot be held to.
    allowed = np.maximum(limit, own) * (1 + _ROUNDING)
    for halving in range(_HALVINGS):
        cells = _Clock(running, limit, t, period).cells(0.5**halving)
        stop = _run_by(running, cells)
        if (_peaks(stop) <= allowed).all():
            return Stop(until_a_tick(stop, period), min(cells[-1].at(cells[-1].length)[0], running.duration))
    return Stop(until_a_tick(_run_by(running, _to_its_end(running, t)), period), running.duration)


def resume(running: Trajectory, t: float, acceleration: ArrayLike, *, period: float | None = None) -> Resumption:
    """Return the motion from rest at a position of a path along the rest of it.

    Its speeds and accelerations begin at 0 and do not jump; once the start is over it runs as the motion did. To resume
    what was resumed and stopped again, the clock tells where on the path of the first motion that was.

    Args:
        running: the motion whose path is followed, within its limits, to rest at its end.
        t: its time whose position the arm stands at [s].
        acceleration: largest accelerations (n,) [rad/s²] or [m/s²]; a joint without a limit counts as in ``brake``.
        period: of the servo [s], to last a whole number of them; any duration when left out.

    Raises:
        InvalidValueError: ``t`` is outside the motion, or an acceleration is not above 0.
    """
    limit, own = _limits(running, t, acceleration)
    if t == running.duration:
        return Resumption(*(hold(at_end, period or _STEP) for at_end in (running(t), np.array([t]))))
    allowed = np.maximum(limit, own) * (1 + _ROUNDING)
    length = max(2 * float((np.abs(running(t, 1)) / limit).max()), period or _STEP, 2 * _RAMP)
    for _ in range(_TRIES):
        cells = _from_rest(running, t, length)
        start = _run_by(running, cells)
        if (start.peaks(2) <= allowed).all():
            break
        length *= _LONGER
    terms = np.array([[cell.tau, cell.rate, cell.slowing / 2, cell.fading / 6] for cell in cells])
    clock = Trajectory(times=start.times, coefficients=terms[:, :, None])
    return Resumption(until_a_tick(start, period), until_a_tick(clock, period))


def _limits(running: Trajectory, t: float, acceleration: ArrayLike) -> tuple[Array, Array]:
    """Return the largest accelerations (n,) that are allowed, and those of the motion itself; check the arguments."""
    if not 0 <= number(t, "t") <= running.duration:
        raise InvalidValueError(f"t: expected 0 to {running.duration:g} s, got {t:g}")
    limit = np.asarray(acceleration, dtype=np.float64)
    own = running.peaks(2)
    limit = one_per_joint(np.where(np.isfinite(limit), limit, np.maximum(own, 1.0)), len(own), "acceleration")
    if not (limit > 0).all():
        raise InvalidValueError(f"acceleration: expected more than 0 for every joint, got {limit.min():g}")
    return limit, own


@attrs.frozen
class _Cell:
    """A stretch of time in which the second derivative of the clock goes straight from one value to another.

    Attributes:
        length: [s].
        segment: of the motion, in which the whole stretch lies.
        tau: the time of the motion at its start [s].
        rate: of the clock at its start.
        slowing: second derivative of the clock at its start [1/s].
        fading: its rate [1/s²].
    """

    length: float
    segment: int
    tau: float
    rate: float
    slowing: float
    fading: float

    def at(self, t: float) -> tuple[float, float, float]:
        """Return clock, rate and second derivative after a time [s]."""
        slowing = self.slowing + self.fading * t
        rate = self.rate + (self.slowing + self.fading * t / 2) * t
        tau = self.tau + (self.rate + (self.slowing / 2 + self.fading * t / 6) * t) * t
        return tau, rate, slowing

    def until(self, tau: float) -> float:
        """Return when the clock, which does not run backwards here, comes to a time of the motion."""
        low, high = 0.0, self.length
        while low < (middle := (low + high) / 2) < high:
            low, high = (middle, high) if self.at(middle)[0] < tau else (low, middle)
        return high


class _Clock:
    """The clock of a stop: it slows down as fast as the accelerations of the joints allow."""

    def __init__(self, running: Trajectory, limit: Array, t: float, period: float | None) -> None:
        """Stand at the time of a motion at which the stop begins."""
        self._times = running.times.tolist()
        self._first, self._second = derivative(running.coefficients, 1), derivative(running.coefficients, 2)
        self._limit = limit * (1 - _MARGIN)
        self._tau, self._segment = t, 0
        self._skip()
        speed = np.abs(self._state(t)[0])
        # How long the joint that takes longest needs to stop by itself; nothing is stopped sooner than in a tick.
        alone = max(float((speed / limit).max()), period or _STEP)
        self._fade = 1 / (alone * _RAMP)
        self._step = min(_STEP, _PART * 2 / math.sqrt(self._fade))

    def cells(self, finer: float) -> list[_Cell]:
        """Return the stretches until the clock stands still, or the motion is at its end."""
        cells: list[_Cell] = []
        rate, slowing = 1.0, 0.0
        while self._segment < len(self._first):
            slowing = max(slowing, self._most(self._tau, rate))
            cell, closing = self._next(rate, slowing, self._step * finer)
            ends = self._times[self._segment + 1]
            if cell.at(cell.length)[0] > ends:
                cell = attrs.evolve(cell, length=cell.until(ends))
                self._tau, closing = ends, False
            else:
                self._tau = cell.at(cell.length)[0]
            cells.append(cell)
            if closing:
                break
            _, rate, slowing = cell.at(cell.length)
            self._skip()
        return cells

    def _next(self, rate: float, slowing: float, length: float) -> tuple[_Cell, bool]:
        """Return the next stretch, and whether it is the last: there the slowing fades, and the clock comes to rest."""
        here = (self._segment, self._tau, rate, slowing)
        last = _Cell(-2 * rate / slowing, *here, slowing**2 / (2 * rate)) if slowing < 0 else None
        if last is not None and rate <= slowing**2 / (2 * self._fade):
            return last, True
        most = slowing - self._fade * length
        for _ in range(2):
            cell = _Cell(length, *here, (most - slowing) / length)
            tau, after, _ = cell.at(length)
            most = max(most, self._most(tau, max(after, 0.0)))
        cell = _Cell(length, *here, (most - slowing) / length)
        if last is not None and cell.at(length)[1] < most**2 / (4 * self._fade):
            return last, True
        return cell, False

    def _most(self, tau: float, rate: float) -> float:
        """Return how fast the clock may slow down, a number of 0 or less."""
        first, second = self._state(tau)
        bend = second * rate**2 * np.sign(first)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            most = np.where(first != 0, (-self._limit - bend) / np.abs(first), -np.inf)
        return min(0.0, float(most.max()))

    def _state(self, tau: float) -> tuple[Array, Array]:
        """Return the first and second derivative of the motion; beyond its segment the polynomial goes on."""
        segment = self._segment
        local = np.array([[tau - self._times[segment]]])
        first, second = (evaluate(terms[segment : segment + 1], local)[0] for terms in (self._first, self._second))
        return first, second

    def _skip(self) -> None:
        """Go to the segment that begins or goes on at the present time."""
        while self._segment < len(self._first) and self._times[self._segment + 1] <= self._tau:
            self._segment += 1


def _to_its_end(running: Trajectory, t: float) -> list[_Cell]:
    """Return the clock that does not slow down, from ``t`` on."""
    times = running.times.tolist()
    parts = ((segment, max(t, start), end) for segment, (start, end) in enumerate(pairwise(times)))
    return [_Cell(end - start, segment, start, 1.0, 0.0, 0.0) for segment, start, end in parts if end > start]


def _from_rest(running: Trajectory, t: float, length: float) -> list[_Cell]:
    """Return the clock that stands still at a time of the motion, and runs at the rate 1 after a length of time."""
    times, half, most = running.times.tolist(), length / 2, 2 / length
    segment = int(np.searchsorted(running.times, t, side="right")) - 1
    cells: list[_Cell] = []
    tau, rate, slowing = t, 0.0, 0.0
    for fading in (most / half, -most / half):
        left = half
        while left > 0 and segment < len(times) - 1:
            cell, end = _Cell(left, segment, tau, rate, slowing, fading), times[segment + 1]
            tau, rate, slowing = cell.at(left)
            if tau >= end:
                cell = attrs.evolve(cell, length=cell.until(end))
                _, rate, slowing = cell.at(cell.length)
                tau, segment = end, segment + 1
            left -= cell.length
            cells += [cell] if cell.length > 0 else []
    return cells + (_to_its_end(running, tau) if segment < len(times) - 1 else [])


def _run_by(running: Trajectory, cells: list[_Cell]) -> Trajectory:
    """Return a motion run by a clock: the polynomials of the one with those of the other put in for the time."""
    segments = [cell.segment for cell in cells]
    starts = np.array([cell.tau for cell in cells]) - running.times[segments]
    path = shifted(running.coefficients[segments], starts)
    clock = np.array([[cell.rate, cell.slowing / 2, cell.fading / 6] for cell in cells])
    times = np.concatenate([[0.0], np.cumsum([cell.length for cell in cells])])
    return Trajectory(times=times, coefficients=composition(path, clock))


def _peaks(motion: Trajectory) -> Array:
    """Return the largest accelerations (n,) at positions close to one another."""
    steps = np.diff(motion.times)
    states = motion.coefficients[:, None].repeat(len(_LOOKS), axis=1).reshape(-1, *motion.coefficients.shape[1:])
    fractions = (steps[:, None] * _LOOKS).reshape(-1, 1)
    return np.asarray(np.abs(evaluate(derivative(states, 2), fractions)).max(axis=0))


def until_a_tick(stop: Trajectory, period: float | None) -> Trajectory:
    """Return a stop with rest behind it until the next tick of the servo."""
    if period is None:
        return stop
    end = math.ceil(stop.duration / period - _ROUNDING) * period
    standstill = np.zeros_like(stop.coefficients[:1])
    standstill[0, 0] = stop(stop.duration)
    times = np.append(stop.times, max(end, stop.duration))
    return Trajectory(times=times, coefficients=np.concatenate([stop.coefficients, standstill]))
