"""Features of an error curve: slope and intercept of its straight part, its mean, its largest harmonic.

Source:
    Thesis, 4.5.1; spec of the clearance, 1.2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armwright.arrays import Array
from armwright.clearance.simulation import Simulation
from armwright.errors import InvalidValueError

# The window of the thesis' straight line: on paths along y, while the speed is constant [s].
WINDOW = (0.07, 0.12)


class Features(NamedTuple):
    """An error curve in numbers; the leading axes are those of the runs.

    Attributes:
        slope: of the straight part [m/s].
        intercept: of the straight part, at the start of the path [m].
        amp_dc: twice the mean error, which is what the thesis calls the largest amplitude: its spectrum is one-sided
            and counts the constant part, and that is the largest [m].
        amp_ac: the largest amplitude of a wave [m].
        offset_x: error at the start, along x [m].
        offset_y: error at the start, along y [m].
    """

    slope: Array
    intercept: Array
    amp_dc: Array
    amp_ac: Array
    offset_x: Array
    offset_y: Array


def simulation_features(simulation: Simulation) -> Features:
    """Return the features of the error curves of a simulation; see ``error_curve_features``."""
    return error_curve_features(simulation.time, simulation.error)


def error_curve_features(time: Array, error: Array, window: tuple[float, float] = WINDOW) -> Features:
    """Return the features of error curves.

    Args:
        time: (s,) equally spaced [s].
        error: (..., s, 2) error of the tip [m].
        window: start and end of the straight part of the curve [s].

    Raises:
        InvalidValueError: fewer than two samples lie in the window.
    """
    slack = 1e-9 * max(1.0, float(time[-1]))
    inside = (time >= window[0] - slack) & (time <= window[1] + slack)
    if np.count_nonzero(inside) < 2:
        raise InvalidValueError(
            f"window: expected two samples or more from {window[0]:g} to {window[1]:g} s, got "
            f"{np.count_nonzero(inside)} of {len(time)} up to {time[-1]:g} s"
        )
    size = np.ascontiguousarray(np.linalg.norm(error, axis=-1))
    first, last = np.flatnonzero(inside)[[0, -1]]
    straight, t = size[..., first : last + 1], time[inside] - time[inside].mean()
    # Sums of rows, not products of matrices: these would round otherwise where other curves stand beside.
    slope = (straight * t).sum(axis=-1) / (t @ t)
    intercept = straight.mean(axis=-1) - slope * time[inside].mean()
    waves = spectrum(size)
    return Features(slope, intercept, waves[..., 0], waves[..., 1:].max(axis=-1), error[..., 0, 0], error[..., 0, 1])


def spectrum(curve: Array) -> Array:
    """Return the one-sided amplitudes 2 |X| / N of curves (..., s), the constant part first and counted twice.

    The wave at the Nyquist frequency, which an even number of samples resolves, is counted once like the constant
    part of a two-sided spectrum.
    """
    amplitudes = np.asarray(2.0 * np.abs(np.fft.rfft(curve, axis=-1)) / curve.shape[-1], dtype=np.float64)
    if curve.shape[-1] % 2 == 0:
        amplitudes[..., -1] /= 2
    return amplitudes
