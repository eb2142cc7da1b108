"""Other roads to the motion of the five-bar: its bodies tied by Lagrange multipliers, in Cartesian coordinates.

Twelve coordinates, x, y and θ of the four links, from the downward vertical. The pins of the cranks are four
equations Φ = 0, held together by Baumgarte's γ - 2αΦ' - β²Φ; the three pins with play are forces. Thesis eq. (3.22) to
(3.33) as the spec corrects them; nothing here is taken from the package.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

MASS = np.array((2.5, 0.8, 0.8, 2.5))
INERTIA = np.array((0.0233, 0.0282, 0.0282, 0.0233))
LENGTH = np.array((0.3, 0.65, 0.65, 0.3))
BASES = {0: np.array((-0.1, 0.0)), 3: np.array((0.1, 0.0))}
G, LOAD, RADIUS = 9.81, 0.98, 0.01
BAUMGARTE = 20.0


class Wall(NamedTuple):
    """What a contact is like: K [N/m^1.5], elastic; friction against the sliding of the surfaces."""

    clearance: float
    stiffness: float
    friction: float = 0.0
    threshold: float = 1e-3


def along(theta: np.ndarray | float) -> np.ndarray:
    return np.array((np.sin(theta), -np.cos(theta)))


def position(q: np.ndarray, body: int, s: float) -> np.ndarray:
    """A point of a link, ``s`` of its length from its centre."""
    return q[3 * body : 3 * body + 2] + s * LENGTH[body] * along(q[3 * body + 2])


def speed(q: np.ndarray, v: np.ndarray, body: int, s: float) -> np.ndarray:
    theta = q[3 * body + 2]
    return v[3 * body : 3 * body + 2] + s * LENGTH[body] * v[3 * body + 2] * np.array((np.cos(theta), np.sin(theta)))


# Of each pin: the body with the bearing and where on it, the one with the journal and where on that.
PINS = ((0, 0.5, 1, -0.5), (1, 0.5, 2, 0.5), (3, 0.5, 2, -0.5))


def forces(q: np.ndarray, v: np.ndarray, torques: np.ndarray, wall: Wall) -> np.ndarray:
    """The generalised forces on all links."""
    Q = np.zeros(12)
    Q[1::3] -= MASS * G
    Q[2] += torques[0]
    Q[11] += torques[1]
    push(Q, q, 2, position(q, 2, 0.5), np.array((0.0, -LOAD)))
    for bearing, end, journal, on in PINS:
        e = position(q, journal, on) - position(q, bearing, end)
        size = np.linalg.norm(e)
        depth = size - wall.clearance
        if depth <= 0:
            continue
        n = e / size
        t = np.array((-n[1], n[0]))
        point = position(q, bearing, end) + (wall.clearance + RADIUS) * n
        slip = (skin(q, v, journal, point) - skin(q, v, bearing, point)) @ t
        normal = wall.stiffness * depth**1.5
        force = normal * (n + wall.friction * np.clip(slip / wall.threshold, -1, 1) * t)
        push(Q, q, bearing, point, force)
        push(Q, q, journal, point, -force)
    return Q


def skin(q: np.ndarray, v: np.ndarray, body: int, point: np.ndarray) -> np.ndarray:
    """The velocity of a body where a point of space is."""
    arm = point - q[3 * body : 3 * body + 2]
    return v[3 * body : 3 * body + 2] + v[3 * body + 2] * np.array((-arm[1], arm[0]))


def push(Q: np.ndarray, q: np.ndarray, body: int, point: np.ndarray, force: np.ndarray) -> None:
    arm = point - q[3 * body : 3 * body + 2]
    Q[3 * body : 3 * body + 2] += force
    Q[3 * body + 2] += arm[0] * force[1] - arm[1] * force[0]


def motion(
    q: np.ndarray, v: np.ndarray, torques: Callable[[float], np.ndarray], wall: Wall, times: np.ndarray
) -> np.ndarray:
    """(s, 12) coordinates at times, from (12) coordinates and speeds, by SciPy's DOP853."""
    M = np.zeros(12)
    M[0::3], M[1::3], M[2::3] = MASS, MASS, INERTIA

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        q, v = y[:12], y[12:]
        phi, dphi, J, gamma = np.zeros(4), np.zeros(4), np.zeros((4, 12)), np.zeros(4)
        for k, (body, base) in enumerate(BASES.items()):
            theta, spin, half = q[3 * body + 2], v[3 * body + 2], LENGTH[body] / 2
            rows = slice(2 * k, 2 * k + 2)
            phi[rows], dphi[rows] = position(q, body, -0.5) - base, speed(q, v, body, -0.5)
            J[2 * k, 3 * body] = J[2 * k + 1, 3 * body + 1] = 1.0
            J[rows, 3 * body + 2] = -half * np.array((np.cos(theta), np.sin(theta)))
            gamma[rows] = half * spin**2 * np.array((-np.sin(theta), np.cos(theta)))
        A = np.block([[np.diag(M), J.T], [J, np.zeros((4, 4))]])
        right = np.concatenate([forces(q, v, torques(t), wall), gamma - 2 * BAUMGARTE * dphi - BAUMGARTE**2 * phi])
        return np.concatenate([v, np.linalg.solve(A, right)[:12]])

    done = solve_ivp(
        rates, (0.0, times[-1]), np.concatenate([q, v]), method="DOP853", t_eval=times, rtol=1e-12, atol=1e-14
    )
    assert done.success
    return np.asarray(done.y[:12].T)
