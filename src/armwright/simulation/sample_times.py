"""The times of the samples that a simulation returns."""

from __future__ import annotations

import math

import numpy as np

from armwright.errors import InvalidValueError

# Part of a period that rounding may shift a sample by.
_CRUMB = 1e-9


def check_samples(duration: float, period: float, most: int) -> None:
    """Refuse a duration [s] with more samples, one every period [s], than the memory should hold.

    Raises:
        InvalidValueError: there would be more.
    """
    if duration / period > most:
        raise InvalidValueError(
            f"duration: {duration:g} s, one sample every {period:g} s, would be {duration / period:.3g} samples; "
            f"expected at most {most:g}: make the duration shorter or the period longer"
        )


def sample_times(duration: float, period: float) -> list[float]:
    """Return the times of the samples: 0 and every period [s] behind it, the last at the end [s]."""
    times: list[float] = (period * np.arange(math.floor(duration / period + _CRUMB) + 1)).tolist()
    if duration - times[-1] > _CRUMB * period:
        times.append(duration)
    times[-1] = duration
    return times
