"""The nearest position in reach, for a tool that keeps its orientation."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import per_joint
from armwright.kinematics.inverse_kinematics.branch_angles import BranchAngles, branch_angles
from armwright.kinematics.inverse_kinematics.geometry import ClosedFormGeometry, Sign, rotated_about_y
from armwright.tracing.vectors import Matrix

# Angles of joint 1 looked at for the nearest place, and how often the neighbourhood of the best is looked at again,
# each time twenty times closer: below 1e-8 rad the distance, flat at its least, has no digit left to tell.
_SAMPLES = 1440
_CLOSER = 7
_FINER = 20


def nearest_wrist_centre(geometry: ClosedFormGeometry, p: Array, R: Array) -> Array:
    """Return the point nearest to ``p`` where the wrist centre can be while the tool has the orientation ``R``.

    Args:
        geometry: the build.
        p: (3,) wrist centre asked for, in the shoulder frame [m].
        R: (3, 3) orientation of the last wrist frame, seen from the shoulder frame.
    """
    if geometry.family == "parallel" or geometry.shoulder_offset:
        return _nearest_by_turning(geometry, p, R)
    return _nearest_in_ring(geometry, p)


def _nearest_in_ring(geometry: ClosedFormGeometry, p: Array) -> Array:
    """Solve a shoulder whose joint 2 is on the axis of joint 1.

    Seen in the half-plane of ``p``, the reach is the ring between two circles, less the strip beside the axis.
    """
    x, y, height = (float(value) for value in p)
    rho, side = math.hypot(x, y), abs(geometry.plane_offset)
    inner, outer = math.hypot(geometry.inner_radius, side), math.hypot(geometry.outer_radius, side)
    rounding = 1e-12 * max(1.0, rho, abs(height))

    def reachable(point: tuple[float, float]) -> bool:
        return point[0] >= side - rounding and inner - rounding <= math.hypot(*point) <= outer + rounding

    candidates = [(rho, height), (side, height)]
    for radius in (inner, outer):
        if math.isinf(radius):
            continue
        distance = math.hypot(rho, height)
        candidates.append((rho * radius / distance, height * radius / distance) if distance else (radius, 0.0))
        corner = math.sqrt(max(radius**2 - side**2, 0.0))
        candidates += [(side, corner), (side, -corner)]
    best = min(filter(reachable, candidates), key=lambda c: math.hypot(c[0] - rho, c[1] - height))
    c, s = (x / rho, y / rho) if rho else (1.0, 0.0)
    return np.array((best[0] * c, best[0] * s, best[1]))


def _nearest_by_turning(geometry: ClosedFormGeometry, p: Array, R: Array) -> Array:
    """Search the angles of joint 1: at each the nearest position is that of a ring in the plane of the arm."""
    rows: Matrix = R.tolist()
    flips: tuple[Sign, ...] = (1, -1) if geometry.family == "parallel" else (1,)
    optima: list[tuple[float, Array]] = []
    for flip in flips:
        nearest = _nearest_by_angle(geometry, p, rows, flip)
        theta, width = np.linspace(-np.pi, np.pi, _SAMPLES, endpoint=False), 2 * np.pi / _SAMPLES
        for _ in range(_CLOSER + 1):
            points = nearest(theta)
            distances = np.linalg.norm(points - p, axis=-1)
            k = int(distances.argmin())
            theta, width = theta[k] + np.linspace(-width, width, 2 * _FINER + 1), width / _FINER
        optima.append((float(distances[k]), points[k]))
    return min(optima, key=lambda optimum: optimum[0])[1]


def _nearest_by_angle(geometry: ClosedFormGeometry, p: Array, R: Matrix, flip: Sign) -> Callable[[Array], Array]:
    """Return the function from angles of joint 1 (k,) to the nearest points (k, 3) in reach at them."""

    def nearest(theta: Array) -> Array:
        c, s = np.cos(theta), np.sin(theta)
        X, Z = c * p[0] + s * p[1] - geometry.shoulder_offset, np.full_like(theta, p[2])
        foot_x, foot_z = np.zeros_like(theta), np.zeros_like(theta)
        if geometry.family == "parallel":
            raised = _wrist_link_angle(geometry, theta, R, flip)
            foot_x, foot_z = rotated_about_y(raised, *geometry.wrist_link)
        x, z = X - foot_x, Z - foot_z
        distance = np.hypot(x, z)
        reached = np.clip(distance, geometry.inner_radius, geometry.outer_radius)
        safe = np.where(distance > 0, distance, 1.0)
        x = np.where(distance > 0, x / safe, 1.0) * reached + foot_x + geometry.shoulder_offset
        z = z / safe * reached + foot_z
        return np.stack([c * x - s * geometry.plane_offset, s * x + c * geometry.plane_offset, z], axis=-1)

    return nearest


def _wrist_link_angle(geometry: ClosedFormGeometry, theta: Array, R: Matrix, flip: Sign) -> Array:
    """Return the angle of the wrist link (k,) that the orientation asks for at angles of joint 1 (k,)."""
    # A wrist centre straight beside joint 1 makes the branch stand at just that angle.
    c, s = np.cos(theta), np.sin(theta)
    far = 1.0 + abs(geometry.plane_offset)
    p = [far * c - geometry.plane_offset * s, far * s + geometry.plane_offset * c, np.zeros_like(theta)]
    solution: BranchAngles = branch_angles(geometry, p, R, (1, 1, flip), per_joint(np.zeros((len(theta), 6))))
    return np.asarray(solution.angles[1] + solution.angles[2] + solution.angles[3])
