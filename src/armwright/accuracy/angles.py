"""Small angles about a, b, c that may be on either side of 180 deg: 179.9 and -179.9 deg are 0.2 deg apart."""

import numpy as np

from armwright.arrays import Array
from armwright.errors import InvalidValueError

# Angles that scatter further than this [rad] are no small angles, and have neither a mean nor a deviation.
_MAX_SCATTER = np.pi / 2


def wrap_to_pi(angles: Array) -> Array:
    """Return angles of any size as those of the same direction in [-pi, pi) [rad]."""
    return np.asarray((angles + np.pi) % (2 * np.pi) - np.pi)


def mean_angles(angles: Array, what: str = "angles") -> Array:
    """Return the means of angles (n, k) [rad], (k,), each in [-pi, pi).

    Deviations are taken from the mean direction, so that whole revolutions change nothing.

    Raises:
        InvalidValueError: those of one column scatter by more than 90 deg about their mean.
    """
    direction = np.arctan2(np.sin(angles).mean(axis=0), np.cos(angles).mean(axis=0))
    deviations = wrap_to_pi(angles - direction)
    widest = np.abs(deviations).max(initial=0.0)
    if widest > _MAX_SCATTER:
        scatter = f"they scatter by {np.degrees(widest):.0f} deg about their mean"
        raise InvalidValueError(f"{what}: {scatter}, which is defined only for angles within 90 deg")
    return wrap_to_pi(direction + deviations.mean(axis=0))


def angle_deviations(angles: Array, what: str = "angles") -> Array:
    """Return how far angles (n, k) are from their means [rad], (n, k).

    Raises:
        InvalidValueError: those of one column scatter by more than 90 deg about their mean.
    """
    return wrap_to_pi(angles - mean_angles(angles, what))


def three_sigma(deviations: Array) -> Array:
    """Return three standard deviations of rows (n, k) whose mean is known to be 0, (k,)."""
    return np.asarray(3 * np.sqrt(np.sum(deviations**2, axis=0) / (len(deviations) - 1)))
