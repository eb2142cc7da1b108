"""What wears a pin: how hard, where and how far its journal slides in its bearing, over one stroke of a linkage.

From a simulation, with its impacts; or leaning, where every journal lies at the wall to which the motion without
clearance presses it. Leaning costs no simulation and is exact while contact lasts.

Source:
    Spec of the life, 1.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.clearance.ideal import place_bodies
from armwright.clearance.linkage import Linkage
from armwright.clearance.plane_vectors import perpendicular, rotate
from armwright.clearance.simulation import Simulation
from armwright.errors import InvalidValueError


@attrs.frozen(kw_only=True, eq=False)
class ContactHistory:
    """The contacts of a linkage with p pins over a stroke, at s times.

    Attributes:
        time: (s,) [s].
        forces: (s, p, 2) on the bearings, in their axes [N].
        slips: (s, p) sliding velocity of the surface of the journal on that of the bearing [m/s].
        rotations: (s, p) angle of the journal's body from that of the bearing's [rad].
    """

    time: Array
    forces: Array
    slips: Array
    rotations: Array

    @property
    def loads(self) -> Array:
        """(s, p) part of each moment in the integral of force times sliding distance, by the trapezoidal rule [N m]."""
        steps = np.diff(self.time)
        weights = np.concatenate([[0.0], steps]) / 2 + np.concatenate([steps, [0.0]]) / 2
        return np.asarray(np.linalg.norm(self.forces, axis=-1) * np.abs(self.slips) * weights[:, None])

    @property
    def work(self) -> Array:
        """(p,) integral of the normal force over the sliding distance [N m]."""
        return np.asarray(self.loads.sum(axis=0))

    @property
    def rotated(self) -> Array:
        """(p,) angle by which the journal has rotated in its bearing, there and back [rad]."""
        return np.asarray(np.abs(np.diff(self.rotations, axis=0)).sum(axis=0))


class PinAngles(NamedTuple):
    """The angles of the bodies that hold a pin, and how fast they rotate, at s times.

    Attributes:
        bearing: (s, p) from the ground [rad].
        journal: (s, p) likewise [rad].
        bearing_spin: (s, p) [rad/s].
        journal_spin: (s, p) [rad/s].
    """

    bearing: Array
    journal: Array
    bearing_spin: Array
    journal_spin: Array


def pin_angles(linkage: Linkage, q: Array, qd: Array) -> PinAngles:
    """Return the angles of the bodies at the pins of a linkage for coordinates and speeds (s, n), without jumps."""
    placement = place_bodies(linkage, q, qd)
    columns: list[list[Array]] = [[], [], [], []]
    for pin in linkage.pins:
        for k, end in enumerate((pin.bearing, pin.journal)):
            frame = placement.frames[end.body]
            angle = np.arctan2(*np.broadcast_arrays(frame.axis.y, frame.axis.x, q[:, 0])[:2])
            columns[k].append(np.unwrap(angle))
            columns[k + 2].append(np.broadcast_to(frame.spin, len(q)))
    return PinAngles(*(np.stack(column, axis=-1) for column in columns))


def simulated_contact(simulation: Simulation, until: float = math.inf) -> ContactHistory:
    """Return the contacts of a single simulated run; its samples must be dense enough for its impacts.

    Args:
        simulation: of one run.
        until: the last moment that counts [s].

    Raises:
        InvalidValueError: there are several runs, or the run diverged before.
    """
    if simulation.q.ndim != 2:
        raise InvalidValueError(f"simulation: expected a single run, got {simulation.q.shape[:-2]}")
    linkage = simulation.scenario.linkage
    rows = int(np.searchsorted(simulation.time, until * (1 + 1e-12), side="right"))
    q, qd = simulation.q[:rows], simulation.qd[:rows]
    if not np.all(np.isfinite(q)):
        raise InvalidValueError(f"{linkage.name}: the run diverged, so that nothing can be said of its wear")
    angles, gaps = pin_angles(linkage, q, qd), simulation.gaps
    gradients = simulation.contact_geometry(gaps)[1][:rows]
    gaps, outward = gaps[:rows], gradients / np.linalg.norm(gradients, axis=-1, keepdims=True)
    placement = place_bodies(linkage, q, qd)
    points = [(placement.point(pin.journal), placement.point(pin.bearing)) for pin in linkage.pins]
    moved = [np.broadcast_arrays(*journal.velocity.minus(bearing.velocity), q[:, 0])[:2] for journal, bearing in points]
    velocities = np.stack([np.stack(velocity, axis=-1) for velocity in moved], axis=1)
    return ContactHistory(
        time=simulation.time[:rows],
        forces=rotate(outward * simulation.forces[:rows, :, None], -angles.bearing),
        slips=_slips(linkage, gaps, outward, velocities, angles),
        rotations=angles.journal - angles.bearing,
    )


def leaning_slips(linkage: Linkage, time: Array, gaps: Array, angles: PinAngles) -> Array:
    """Return (..., s, p) sliding velocities [m/s] of journals with gaps (..., s, p, 2) in the ground's axes [m]."""
    outward = gaps / np.linalg.norm(gaps, axis=-1, keepdims=True)
    return _slips(linkage, gaps, outward, np.gradient(gaps, time, axis=-3), angles)


def _slips(linkage: Linkage, gaps: Array, outward: Array, velocities: Array, angles: PinAngles) -> Array:
    """Return (..., s, p) velocities of the surfaces of journals along walls of these normals (..., s, p, 2)."""
    radii = np.array([pin.journal_radius for pin in linkage.pins])
    along = perpendicular(outward)
    wall = radii + (gaps * outward).sum(axis=-1)
    return np.asarray((velocities * along).sum(axis=-1) + angles.journal_spin * radii - angles.bearing_spin * wall)
