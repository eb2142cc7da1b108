"""Motors of flexible gears that make the links follow a motion exactly: theta = q + K⁻¹ (M q'' + c + g).

The motion needs four derivatives, for the motors to be steady: its ends are of order 9.

Source:
    De Luca & Book (2016), "Robots with flexible elements", Springer Handbook of Robotics, on inverse dynamics.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.dynamics.accelerations import without_drives
from armwright.dynamics.drives import friction_law
from armwright.dynamics.flexible_joints import flexible_gears
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.motion.trajectory import Trajectory

# 126 u⁵ - 420 u⁶ + 540 u⁷ - 315 u⁸ + 70 u⁹, whose first four derivatives are 0 at both ends.
_NINTH = np.array((0.0, 0.0, 0.0, 0.0, 0.0, 126.0, -420.0, 540.0, -315.0, 70.0))
# Pieces of the motion of the motors from rest to rest.
_PIECES = 200


class FlatMotion(NamedTuple):
    """A motion of links, and of the motors that cause it.

    Attributes:
        links: order 9, from rest to rest.
        motors: behind their gears; quintics with four continuous derivatives.
        efforts: (k, n) of the motors at the ends of their pieces, with rotors and friction [N m] or [N].
    """

    links: Trajectory
    motors: Trajectory
    efforts: Array


def ninth(q_start: Array, q_goal: Array, duration: float) -> Trajectory:
    """Return the motion of order 9 from rest to rest, with four derivatives of 0 at both ends.

    Args:
        q_start: (n,) joint positions [rad] or [m].
        q_goal: (n,) joint positions.
        duration: above 0 [s].
    """
    terms = np.outer(_NINTH * duration ** -np.arange(10.0), q_goal - q_start)
    terms[0] = q_start
    return Trajectory(times=(0.0, duration), coefficients=terms[None])


def flat_motion(arm: Arm, links: Trajectory) -> FlatMotion:
    """Return the motion of the motors that makes the links move as they should.

    Of the damping of the gears the first order counts: theta - q = K⁻¹ (tau - D K⁻¹ tau'), with the effort tau on the
    links. What is left out is smaller by (D w / K)² at vibrations of w.

    Args:
        arm: with n joints, of which some have flexible gears.
        links: a motion from rest to rest with four continuous derivatives.

    Raises:
        UnsupportedArmError: no gear is flexible, drives are coupled, or the mass of a link is unknown.
    """
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415 - SciPy takes longer to import than all else

    flexible_gears(arm)
    K, D = arm.motor_values("stiffness"), arm.motor_values("damping")
    t = np.linspace(0.0, links.duration, _PIECES + 1)
    q, qd, qdd = (links(t, order) for order in range(3))
    tau = inverse_dynamics(without_drives(arm), q, qd, qdd)
    spline = make_interp_spline(t, tau, k=7)
    lag = [(spline(t, nu=order) - D / K * spline(t, nu=order + 1)) / K for order in range(3)]
    ends = [(1, np.zeros(arm.n))], [(1, np.zeros(arm.n))]
    for side, at in zip(ends, (0, -1), strict=True):
        side.append((2, lag[2][at]))
    motion = make_interp_spline(t, q + lag[0], k=5, bc_type=ends)
    terms = np.stack([motion(t[:-1], nu=order) / math.factorial(order) for order in range(6)], axis=1)
    motors = Trajectory(times=t, coefficients=terms)
    law, speeds = friction_law(arm), motors(t, 1)
    own = arm.motor_values("inertia") * motors(t, 2) + law.viscous * speeds + law.beyond_viscous(speeds, speeds)
    return FlatMotion(links, motors, np.asarray(tau + own))
