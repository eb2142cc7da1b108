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
from armwright.dynamics.flexible_joints import deflection, flexible_gears
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.errors import IncapableArmError
from armwright.kinematics.inverse_kinematics.solution import violations_of
from armwright.motion.certificate import BindingLimit
from armwright.motion.efforts import lasting_efforts
from armwright.motion.limit_utilization import slowing_for_limits
from armwright.motion.solver import AnyArm, solver_of
from armwright.motion.trajectory import Trajectory

# 126 u⁵ - 420 u⁶ + 540 u⁷ - 315 u⁸ + 70 u⁹, whose first four derivatives are 0 at both ends.
_NINTH = np.array((0.0, 0.0, 0.0, 0.0, 0.0, 126.0, -420.0, 540.0, -315.0, 70.0))
# Pieces of the motion of the motors from rest to rest, and samples of its efforts on each.
_PIECES, _LOOKS = 200, 4
# Part of the limits of effort that is used at most at samples, so that they hold between them too.
_USED = 0.9999
# How far motors may be from what would move the links exactly [rad], [m].
_ERROR = 1e-4
# A motor that would have to move so many times slower not to swing beyond a limit stands at it; the least slowing.
_NEVER, _SLOWER = 10.0, 1e-3


class FlatMotion(NamedTuple):
    """A motion of links, and of the motors that cause it.

    Attributes:
        links: order 9, from rest to rest.
        motors: behind their gears, from rest to rest; quintics with four continuous derivatives.
        efforts: (k, n) of the motors at k even times from start to end, with rotors and friction [N m] or [N].
        error: (n,) how far the motors may be from what would move the links exactly, by the polynomials and by what the
            first order of damping leaves out [rad] or [m].
    """

    links: Trajectory
    motors: Trajectory
    efforts: Array
    error: Array

    @property
    def moving(self) -> tuple[Trajectory, ...]:
        """All that moves."""
        return self.links, self.motors

    def slowing(self, arm: AnyArm) -> tuple[float, BindingLimit | None]:
        """Return about how many times slower links and motors must run to keep all limits, and be known well.

        Args:
            arm: the arm, or a compiled one.

        Returns:
            The factor, 1 where they keep them as it is; and the limit and the joint, from 0, that it is for, None for
            none and for positions. A slower motion of the links has other motors, and is to be tried.

        Raises:
            IncapableArmError: weight and dry friction alone take more than a joint may give, or bend a gear so far that
                its motor would stand beyond its limits, so that no slowing helps.
        """
        needs = [slowing_for_limits(arm, each) for each in self.moving]
        needs.append(self._slowing_for_efforts(arm))
        needs.append((max(self._slowing_for_positions(solver_of(arm).arm), (self.error.max() / _ERROR) ** 0.25), None))
        return max(needs, key=lambda need: need[0])

    def _slowing_for_efforts(self, arm: AnyArm) -> tuple[float, BindingLimit | None]:
        """Return how many times slower the motors must run to keep their efforts."""
        solver = solver_of(arm)
        limit = solver.arm.limits.effort * _USED
        if (np.abs(self.efforts) <= limit).all():
            return 1.0, None
        t = np.linspace(0.0, self.links.duration, len(self.efforts))
        lasting = lasting_efforts(solver, self.links(t), self.motors(t, 1))
        factors = _factors(lasting, self.efforts, -limit, limit)
        factor, joint = float(factors.max()), int(factors.argmax())
        if not math.isfinite(factor):
            label = solver.arm.joint_label(joint)
            raise IncapableArmError(f"weight and dry friction alone take all of the effort of {label}")
        return factor, ("effort", joint)

    def _slowing_for_positions(self, arm: Arm) -> float:
        """Return how many times slower the motors must run not to swing beyond the limits of positions."""
        violated = [each for some in self.motors.extremes() for each in violations_of(arm, some.tolist())]
        if not violated:
            return 1.0
        q = self.links(self.motors.times)
        standing = q - deflection(arm, q)
        factors = _factors(standing, self.motors(self.motors.times), arm.limits.lower, arm.limits.upper)
        if not factors.max() < _NEVER:
            raise IncapableArmError(f"its gears yield on the way, and the motor of {violated[0]}")
        return max(float(factors.max()), 1 + _SLOWER)


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
    K, lag = arm.motor_values("stiffness"), arm.motor_values("damping") / arm.motor_values("stiffness")
    t = np.linspace(0.0, links.duration, _PIECES + 1)
    q, qd, qdd = (links(t, order) for order in range(3))
    tau = make_interp_spline(t, inverse_dynamics(without_drives(arm), q, qd, qdd), k=7)
    rate = tau(t, nu=1)
    rate[[0, -1]] = 0.0
    theta = q + (tau(t) - lag * rate) / K
    # Damping would have the motors begin and end with a jump of their acceleration.
    stand = [[(order, np.zeros(arm.n)) for order in (1, 2)]] * 2
    fine, coarse = (
        np.stack([spline(t[:-1], nu=order) / math.factorial(order) for order in range(6)], axis=1)
        for spline in (make_interp_spline(t[::step], theta[::step], k=5, bc_type=stand) for step in (1, 2))
    )
    motors = Trajectory(times=t, coefficients=fine)
    # Twice as many pieces are several times nearer, so that the difference bounds what is left.
    error = Trajectory(times=t, coefficients=fine - coarse).peaks(0) + np.abs(lag**2 * tau(t, nu=2) / K).max(axis=0)
    t = np.linspace(0.0, links.duration, _LOOKS * _PIECES + 1)
    law, speeds = friction_law(arm), motors(t, 1)
    own = arm.motor_values("inertia") * motors(t, 2) + law.viscous * speeds + law.beyond_viscous(speeds, speeds)
    return FlatMotion(links, motors, np.asarray(tau(t) + own), error)


def _factors(lasting: Array, values: Array, lower: Array, upper: Array) -> Array:
    """Return how many times slower each joint must move, (n,), for values (k, n) that partly do not change by that."""
    moving, factors = values - lasting, np.ones(values.shape[1])
    for beyond, limit in ((values > upper, upper), (values < lower, lower)):
        with np.errstate(divide="ignore", invalid="ignore"):
            need = np.where(beyond, moving / (limit - lasting), 1.0)
        factors = np.maximum(factors, np.where(need > 0, need, np.inf).max(axis=0))
    return np.sqrt(factors)
