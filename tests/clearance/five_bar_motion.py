"""The motion of a five-bar in closed form, an oracle for the generic linkage.

Source:
    Thesis eq. (3.8), (3.11), (3.12), with the corrections of docs/errata.md.
"""

from typing import Literal

import numpy as np

from armwright.arrays import Array, ArrayLike
from armwright.clearance.five_bar import FiveBar, elbow_positions

# Which side of the line from the left elbow to the right elbow the tip is on.
ASSEMBLIES = {"below": -1.0, "above": 1.0}


def forward(bar: FiveBar, cranks: ArrayLike, assembly: Literal["below", "above"] = "below") -> tuple[Array, Array]:
    """Return positions of the tip (..., 2) and angles of all links (..., 4); NaN where the rods do not meet."""
    theta = np.asarray(cranks, dtype=np.float64)
    left, right = np.moveaxis(elbow_positions(bar, theta), -2, 0)
    base = right - left
    square = np.sum(base**2, axis=-1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        along = 0.5 * ((bar.rods[0] ** 2 - bar.rods[1] ** 2) / square + 1)
        across = ASSEMBLIES[assembly] * np.sqrt(bar.rods[0] ** 2 / square - along**2)
    tip = left + along * base + across * np.stack([-base[..., 1], base[..., 0]], axis=-1)
    rods = [np.arctan2(*np.moveaxis((tip - elbow) * (1, -1), -1, 0)) for elbow in (left, right)]
    return tip, np.stack([theta[..., 0], *rods, theta[..., 1]], axis=-1)


def speeds(bar: FiveBar, angles: Array, velocity: ArrayLike) -> Array:
    """Return the speeds of the links (..., 4) at which crank ω1 u1' + rod ω2 u2' is the velocity of the tip."""
    return _rates(bar, angles, [np.asarray(velocity)] * 2)


def accelerations(bar: FiveBar, angles: Array, velocity: ArrayLike, acceleration: ArrayLike) -> Array:
    """Return the accelerations of the links (..., 4): the tip's, less the centripetal part of either arm."""
    centripetal = _along(angles) * (_lengths(bar) * speeds(bar, angles, velocity) ** 2)[..., None]
    return _rates(bar, angles, [np.asarray(acceleration) + centripetal[..., arm, :].sum(axis=-2) for arm in _ARMS])


# Crank and rod of the left arm, and of the right one.
_ARMS = ([0, 1], [3, 2])


def _rates(bar: FiveBar, angles: Array, targets: list[Array]) -> Array:
    rates = np.empty_like(angles)
    normal = np.stack([np.cos(angles), np.sin(angles)], axis=-1) * _lengths(bar)[:, None]
    for arm, target in zip(_ARMS, targets, strict=True):
        columns = np.swapaxes(normal[..., arm, :], -1, -2)
        rates[..., arm] = np.linalg.solve(columns, np.broadcast_to(target, columns.shape[:-1])[..., None])[..., 0]
    return rates


def _along(angles: Array) -> Array:
    """Return u = (sin θ, -cos θ), along which a link points."""
    return np.stack([np.sin(angles), -np.cos(angles)], axis=-1)


def _lengths(bar: FiveBar) -> Array:
    return np.array([bar.cranks[0], *bar.rods, bar.cranks[1]])
