"""The sensor of forces and moments between an arm and its tool: its errors, its rate, its zero."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable

import numpy as np

from armwright.arrays import Array
from armwright.cell.control import ForceSensor

# A time so little before a reading is at it, as a part of the time between two.
_EARLY = 1e-6


class WristSensor:
    """A sensor that reads wrenches: force [N] and moment about the tool point [N m], along the axes of the world."""

    def __init__(self, settings: ForceSensor) -> None:
        """Begin without a reading, and with zero where nothing pushes."""
        self._settings = settings
        self._zero: Array = np.zeros(6)
        # The latest reading with its number; a sensor reads at its own rate.
        self._number, self._reading = -1, np.zeros(6)

    def read(self, tick: int, now: float, wrench: Callable[[], Array], rng: np.random.Generator) -> Array:
        """Return the wrench (6,) that the sensor reads, less its zero.

        Args:
            tick: the servo tick.
            now: its time [s].
            wrench: returns the true wrench (6,), where that is needed.
            rng: the noise is drawn from it.
        """
        settings = self._settings
        number = math.floor(now * settings.rate + _EARLY) if settings.rate else tick
        if number != self._number:
            reading = wrench() + np.repeat((settings.bias, settings.moment_bias), 3)
            if settings.noise:
                reading[:3] += rng.normal(scale=settings.noise, size=3)
            if settings.moment_noise:
                reading[3:] += rng.normal(scale=settings.moment_noise, size=3)
            self._number, self._reading = number, reading
        return self._reading - self._zero

    def zero(self, tick: int, now: float, wrench: Callable[[], Array], rng: np.random.Generator) -> Array:
        """Let what it reads now count as zero from now on; return that (6,). The arguments are those of ``read``."""
        self._zero = self._zero + self.read(tick, now, wrench, rng)
        return self._zero

    def copy(self) -> WristSensor:
        """Return a sensor in the same state."""
        return copy.copy(self)
