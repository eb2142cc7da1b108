"""The walls of worn pins in the simulation: how far the middle of a journal can go in its bearing.

A journal is nearly as wide as its bearing. Pushed in one direction it may touch the wall beside that direction: a
groove narrower than the journal admits it only in part. So the wall is the boundary of the places that the middle of
the journal can reach, where it is in no direction φ farther out than the clearance and the depths gone from both
surfaces allow:

    wall(θ, ρ) = min over φ of (c + h_B(φ) + h_J(φ - ρ)) / cos(φ - θ)

with the direction θ of the middle in the axes of the bearing, and the rotation ρ of the journal in it. A simulation
looks it up in a table of both angles, smoothed by the cubic B-spline, which has no extremes of its own and a continuous
second derivative. The force follows from the gradient of the depth, so that energy is kept.

Source:
    Spec of the life, 1; de Boor, "A Practical Guide to Splines" (1978), on B-splines.
"""

from __future__ import annotations

from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.clearance.ideal import place_bodies
from armwright.clearance.linkage import Linkage
from armwright.clearance.plane_vectors import perpendicular

# Directions in which a journal may touch the wall beside the one that it is pushed in [rad].
_BESIDE = 1.4
# Cells of the table round each angle; an angle of more cells is no number any more.
_CELLS, _FARTHEST = 360, 1e9
# A journal nearer to the middle of its bearing has no direction [m].
_TINY = 1e-12
# An equilibrium is bracketed to this part of a cell of the table by so many halvings.
_HALVINGS = 45


class WallPlace(NamedTuple):
    """What the table of a pin has at some directions and rotations, (...) each.

    Attributes:
        growth: how much farther than the clearance the wall is [m].
        slope: its derivative by the direction [m/rad].
        turning: its derivative by the rotation of the journal [m/rad].
    """

    growth: Array
    slope: Array
    turning: Array


class PinDirections(NamedTuple):
    """The angles of p pins.

    Attributes:
        bearing: (..., p) of the bearing's body from the ground [rad].
        rotation: (..., p) of the journal's body from it [rad].
    """

    bearing: Array
    rotation: Array


@attrs.frozen(kw_only=True, eq=False)
class WornWalls:
    """The walls of p worn pins, in m = 360 directions and at as many rotations, from the axes of their bodies.

    Attributes:
        table: (p, m + 3, m + 3) growth of the walls by rotation and direction [m]; the first cells are repeated behind
            the last, so that no sum of four needs a remainder.
        means: (p,) mean depth gone from both surfaces of each pin [m].
        smoothing: (p,) largest change of the walls by the spline [m].
    """

    table: Array
    means: Array
    smoothing: Array

    @classmethod
    def of(cls, linkage: Linkage, bearing: Array, journal: Array) -> WornWalls:
        """Return the walls of a linkage.

        Args:
            linkage: with p pins, new.
            bearing: (p, n) depths gone from the bearings, in n directions from the axes of their bodies [m].
            journal: (p, n) from the journals likewise [m].
        """
        clearances = list(linkage.clearances.values())
        bearing, journal = (np.stack([_resampled(profile) for profile in side]) for side in (bearing, journal))
        growths = np.stack([_growth(*of_pin) for of_pin in zip(clearances, bearing, journal, strict=True)])
        table = np.pad(growths, ((0, 0), (1, 2), (1, 2)), mode="wrap")
        angles: Array = np.linspace(0.0, 2 * np.pi, _CELLS, endpoint=False)
        changes = [
            wall_at(one, angles[None], angles[:, None]).growth - g for one, g in zip(table, growths, strict=True)
        ]
        return cls(
            table=table,
            means=bearing.mean(axis=-1) + journal.mean(axis=-1),
            smoothing=np.abs(changes).max(axis=(1, 2)),
        )

    def largest(self, pin: int) -> float:
        """Return how much farther than its clearance the journal of a pin can go at most [m]."""
        return float(self.table[pin].max())

    def at(self, pin: int, direction: Array, rotation: Array) -> WallPlace:
        """Return the wall of a pin in directions (...) at rotations of its journal (...) [rad]."""
        return wall_at(self.table[pin], direction, rotation)

    def gradients(self, linkage: Linkage, q: Array, gaps: Array, clearances: Array) -> tuple[Array, Array]:
        """Return depths (..., p) and their gradients by the gaps (..., p, 2), in the axes of the ground.

        Args:
            linkage: with n coordinates and p pins.
            q: (..., n) coordinates.
            gaps: (..., p, 2) from the middle of each bearing to that of its journal [m].
            clearances: (..., p) of the new pins [m].
        """
        bearing, rotation = pin_directions(linkage, q)
        size = np.linalg.norm(gaps, axis=-1)
        far = np.maximum(size, _TINY)[..., None]
        outward = gaps / far
        angle = np.arctan2(gaps[..., 1], gaps[..., 0]) - bearing
        places = [self.at(i, angle[..., i], rotation[..., i]) for i in range(len(linkage.pins))]
        growth, slope = (np.stack([place[k] for place in places], axis=-1) for k in range(2))
        tilt = slope[..., None] / far
        along = perpendicular(outward)
        return size - clearances - growth, outward - tilt * along

    def resting_gaps(self, linkage: Linkage, q: Array, forces: Array, clearances: Array, K: Array | float) -> Array:
        """Return (..., p, 2) where journals rest under forces on their bearings, in the axes of the ground [m].

        Args:
            linkage: with n coordinates and p pins.
            q: (..., n) coordinates.
            forces: (..., p, 2) none of which is 0 [N].
            clearances: (..., p) of the new pins [m].
            K: (..., p) stiffness of the contacts [N/m^1.5]; infinite for rigid ones.
        """
        bearing, rotation = pin_directions(linkage, q)
        size = np.linalg.norm(forces, axis=-1)
        angle = np.arctan2(forces[..., 1], forces[..., 0])
        depth = np.broadcast_to((size / K) ** (2 / 3), size.shape)
        gaps = np.zeros_like(forces)
        for i in range(len(linkage.pins)):
            c = np.broadcast_to(clearances[..., i] + depth[..., i], size.shape[:-1])
            at = self._resting_direction(i, angle[..., i] - bearing[..., i], rotation[..., i], c)
            place = self.at(i, at, rotation[..., i])
            # The gradient of the depth is longer than 1 where the wall leans: less depth carries the same force.
            steep = np.hypot(1.0, place.slope / (c + place.growth))
            r = c + place.growth - depth[..., i] * (1 - steep ** (-2 / 3))
            ground = at + bearing[..., i]
            gaps[..., i, :] = r[..., None] * np.stack([np.cos(ground), np.sin(ground)], axis=-1)
        return gaps

    def _resting_direction(self, pin: int, force: Array, rotation: Array, clearance: Array) -> Array:
        """Return (...) directions in which journals rest under forces of directions (...) in the bearing's axes."""
        m = self.table.shape[-1] - 3
        cell = 2 * np.pi / m
        tried = force[..., None] + np.arange(-(m // 4), m // 4 + 1) * cell
        reach = clearance[..., None] + self.at(pin, tried, np.broadcast_to(rotation[..., None], tried.shape)).growth
        farthest = np.argmax(reach * np.cos(tried - force[..., None]), axis=-1)
        middle = np.take_along_axis(tried, farthest[..., None], axis=-1)[..., 0]
        low, high = middle - cell, middle + cell
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            place = self.at(pin, middle, rotation)
            ahead = (clearance + place.growth) * np.sin(force - middle) + place.slope * np.cos(force - middle) > 0
            low, high = np.where(ahead, middle, low), np.where(ahead, high, middle)
        return np.asarray((low + high) / 2)


def wall_at(table: Array, direction: Array, rotation: Array) -> WallPlace:
    """Return what the table (m + 3, m + 3) of a pin has in directions (...) at rotations (...) [rad]."""
    m = len(table) - 3
    column, along, along_rate = _spline_weights(direction * (m / (2 * np.pi)), m)
    row, across, across_rate = _spline_weights(rotation * (m / (2 * np.pi)), m)
    row, column = np.broadcast_arrays(row, column)
    cells = table[row[..., None, None] + np.arange(4)[:, None], column[..., None, None] + np.arange(4)]
    growth, slope, turning = (
        np.einsum("...ij,...i,...j->...", cells, a, b)
        for a, b in ((across, along), (across, along_rate), (across_rate, along))
    )
    return WallPlace(growth, slope * (m / (2 * np.pi)), turning * (m / (2 * np.pi)))


def pin_directions(linkage: Linkage, q: Array) -> PinDirections:
    """Return the angles of the bodies at the pins of a linkage at coordinates (..., n)."""
    placement = place_bodies(linkage, q)
    bearing, rotation = np.zeros((2, *q.shape[:-1], len(linkage.pins)))
    for i, pin in enumerate(linkage.pins):
        own, other = (placement.frames[end.body].axis for end in (pin.bearing, pin.journal))
        bearing[..., i] = np.arctan2(own.y, own.x)
        rotation[..., i] = np.arctan2(own.x * other.y - own.y * other.x, own.dot(other))
    return PinDirections(bearing, rotation)


def _resampled(profile: Array) -> Array:
    """Return a profile in the directions of the table."""
    n = len(profile)
    places = np.arange(_CELLS) * (n / _CELLS)
    return np.asarray(np.interp(places, np.arange(n + 1), np.append(profile, profile[0])))


def _growth(clearance: float, bearing: Array, journal: Array) -> Array:
    """Return (m, m) growth of the wall of a pin by rotation and direction [m]."""
    m = len(bearing)
    turned = (np.arange(m) - np.arange(m)[:, None]) % m
    gone = clearance + (bearing + journal[turned])
    farthest = int(_BESIDE * m / (2 * np.pi))
    around, wall = np.pad(gone, ((0, 0), (farthest, farthest)), mode="wrap"), gone.copy()
    for k in range(1, farthest + 1):
        longer = 1 / np.cos(k * 2 * np.pi / m)
        for first in (farthest - k, farthest + k):
            np.minimum(wall, longer * around[:, first : first + m], out=wall)
    return np.asarray(wall - clearance)


def _spline_weights(place: Array, m: int) -> tuple[Array, Array, Array]:
    """Return the first of the four cells (...) at a place in cells, and weights and their rates (..., 4)."""
    # What has diverged has no place.
    place = np.where(np.abs(place) < _FARTHEST, place, 0.0)
    first = np.floor(place)
    t = place - first
    u = 1 - t
    weights = [u**3 / 6, (3 * t**3 - 6 * t**2 + 4) / 6, (3 * u**3 - 6 * u**2 + 4) / 6, t**3 / 6]
    rates = [-(u**2) / 2, (3 * t**2 - 4 * t) / 2, (4 * u - 3 * u**2) / 2, t**2 / 2]
    return np.mod(first, m).astype(np.int64), np.stack(weights, axis=-1), np.stack(rates, axis=-1)
