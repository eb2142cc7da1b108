"""The pressure between a journal and its bearing, worn or not: an elastic foundation of springs around the wall.

The wall is divided into bins. Where the journal would lie in the wall by δ the pressure is K δ; the journal rests where
the pressures carry its force. On a worn wall the contact so becomes wider by itself.

Source:
    Spec of the life, 1: pressure of a Winkler foundation, and of the half-angle of Hertz.
"""

from __future__ import annotations

import numpy as np

from armwright.arrays import Array, positive
from armwright.clearance.linkage import Material

# The search for a position of rest ends when forces balance to this part of them.
_BALANCED = 1e-12
_MAX_ITERATIONS, _HALVINGS = 100, 12
# Springs whose matrix is flatter resist in one direction only.
_FLAT = 1e-10


def bin_angles(count: int) -> Array:
    """Return (count,) the angles of the middles of the bins, from the axis of the body [rad]."""
    return np.asarray(np.arange(count) * (2 * np.pi / count), dtype=np.float64)


def layer_modulus(material: Material, thickness: float) -> float:
    """Return K of a thin layer bonded to a stiff bearing [N/m³]: its constrained modulus by its thickness.

    Args:
        material: of the layer.
        thickness: [m].
    """
    nu = material.poisson
    if nu >= 0.5:
        # An incompressible layer cannot be pressed; a foundation does not describe it.
        nu = 0.499
    return material.young * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) / positive(thickness, "thickness", "m")


def hertz_half_angle(force: Array, clearance: float, radius: float, width: float, material: Material) -> Array:
    """Return the half-angle of the line contact of a journal in its new bearing [rad].

    Args:
        force: (...) [N].
        clearance: radius of the bearing minus that of the journal [m].
        radius: of the journal [m].
        width: of the bearing [m].
        material: of both.

    Source:
        Hertz (1881); half-width √(4 F R / (π b E*)) with 1 / R = 1 / R_J - 1 / R_B.
    """
    relative = radius * (radius + clearance) / clearance
    modulus = material.young / (2 * (1 - material.poisson**2))
    return np.asarray(np.sqrt(4 * force * relative / (np.pi * width * modulus)) / radius)


def foundation_modulus(force: Array, half_angle: Array, clearance: float, radius: float, width: float) -> Array:
    """Return K of the foundation on which a force makes a contact of this half-angle in a new bearing [N/m³].

    A foundation carries F = b R K c [(ε + sin ε cos ε) / cos ε - 2 sin ε] on the half-angle ε.

    Args:
        force: (...) [N].
        half_angle: (...) [rad].
        clearance: radius of the bearing minus that of the journal [m].
        radius: of the journal [m].
        width: of the bearing [m].
    """
    angle = np.minimum(half_angle, 0.45 * np.pi)
    # The closed form of a small angle loses its digits.
    exact = (angle + np.sin(angle) * np.cos(angle)) / np.cos(angle) - 2 * np.sin(angle)
    part = np.where(angle < 1e-2, 2 / 3 * angle**3, exact)
    return np.asarray(force / (width * radius * clearance * part))


def rest_positions(forces: Array, walls: Array, springs: Array) -> tuple[Array, Array]:
    """Return where journals rest in their bearings under forces, and how the bins share these.

    Args:
        forces: (s, 2) on the bearing, in its axes; none is 0 [N].
        walls: (s, m) distance of the wall from the journal in the middle of the bearing [m].
        springs: (s,) of a bin [N/m].

    Returns:
        (s, 2) centres of the journals from those of the bearings [m], and (s, m) the part of each bin in the sum of
        the pressures; 1 in all.
    """
    angles = bin_angles(walls.shape[-1])
    u = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    size = np.linalg.norm(forces, axis=-1)
    n = forces / size[:, None]
    # Products of the components: x x, x y, y y.
    uu = np.stack([u[:, 0] ** 2, u[:, 0] * u[:, 1], u[:, 1] ** 2], axis=-1)
    ahead = np.argmax(n @ u.T, axis=-1)
    rows = np.arange(len(forces))
    e = n * (walls[rows, ahead] / (n * u[ahead]).sum(axis=-1) + size / springs)[:, None]
    rolling = size / walls.min(axis=-1)
    for _ in range(_MAX_ITERATIONS):
        depths = np.maximum(e @ u.T - walls, 0.0)
        rest = forces - springs[:, None] * (depths @ u)
        open_rows = np.linalg.norm(rest, axis=-1) > _BALANCED * size
        if not np.any(open_rows):
            break
        xx, xy, yy = (springs[:, None] * ((depths > 0).astype(np.float64) @ uu)).T
        trace, determinant = xx + yy, xx * yy - xy**2
        # A journal on one spring rolls like a pendulum as long as the clearance.
        more = np.where(determinant <= _FLAT * trace**2, rolling, 0.0)
        xx, yy = xx + more, yy + more
        inverse = open_rows / (xx * yy - xy**2)
        step = np.stack([yy * rest[:, 0] - xy * rest[:, 1], xx * rest[:, 1] - xy * rest[:, 0]], -1) * inverse[:, None]
        e = _descend(e, step, forces=forces, walls=walls, springs=springs, u=u)
    depths = np.maximum(e @ u.T - walls, 0.0)
    return e, depths / depths.sum(axis=-1, keepdims=True)


def _descend(e: Array, step: Array, *, forces: Array, walls: Array, springs: Array, u: Array) -> Array:
    """Return positions moved by as much of a step as lowers the energy."""

    def energy(at: Array) -> Array:
        depths = np.maximum(at @ u.T - walls, 0.0)
        return np.asarray(0.5 * springs * (depths**2).sum(axis=-1) - (forces * at).sum(axis=-1))

    before, part = energy(e), np.ones(len(e))
    slack = 1e-15 * np.abs(before)
    for _ in range(_HALVINGS):
        worse = energy(e + part[:, None] * step) > before + slack
        if not np.any(worse):
            break
        part[worse] /= 2
    return np.asarray(e + part[:, None] * step)
