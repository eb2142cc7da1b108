"""The public functions that take joint arrays, by the argument that is handed in."""

from collections.abc import Callable
from typing import Any

import numpy as np

import armwright
from armwright.dynamics.accelerations import toacc
from armwright.dynamics.bejczy import bejczy_efforts
from armwright.dynamics.energy import kinetic_energy, potential_energy
from armwright.dynamics.lagrange_euler import coriolis_matrix, coriolis_tensor
from armwright.dynamics.shares import coriolis_efforts, gravity_efforts
from armwright.kinematics.damped_least_squares import damped_rates
from armwright.kinematics.differential import differential_inverse
from armwright.kinematics.jacobians import jacobian_rate, tool_twist
from armwright.kinematics.manipulability_index import manipulability
from armwright.kinematics.singularity_analysis import singularity_factors
from armwright.simulation.controllers import computed_torque, pd, standing

PUMA = armwright.load_arm("puma560-seed")
Q = (0.1, 0.6, 0.2, 0.3, 0.9, 0.1)
OTHER = (0.2, 0.5, 0.3, 0.2, 0.8, 0.2)
REST = (0.0,) * 6

Door = Callable[[Any], Any]
# Functions of arrays (..., 6), by the argument that is handed in.
MANY: dict[str, Door] = {
    "forward: q": lambda x: armwright.kinematics.forward(PUMA, x),
    "link_poses: q": lambda x: armwright.kinematics.link_poses(PUMA, x),
    "jacobian: q": lambda x: armwright.kinematics.jacobian(PUMA, x),
    "jacobian_rate: q": lambda x: jacobian_rate(PUMA, x, Q),
    "jacobian_rate: qd": lambda x: jacobian_rate(PUMA, Q, x),
    "tool_twist: q": lambda x: tool_twist(PUMA, x, Q),
    "tool_twist: qd": lambda x: tool_twist(PUMA, Q, x),
    "manipulability: q": lambda x: manipulability(PUMA, x),
    "singularity_factors: q": lambda x: singularity_factors(PUMA, x),
    "damped_rates: q": lambda x: damped_rates(PUMA, x, Q).rates,
    "damped_rates: twist": lambda x: damped_rates(PUMA, Q, x).rates,
    "differential_inverse: q": lambda x: differential_inverse(PUMA, x, Q).rates,
    "differential_inverse: twist": lambda x: differential_inverse(PUMA, Q, x).rates,
    "inverse_dynamics: q": lambda x: armwright.dynamics.inverse_dynamics(PUMA, x, Q, Q),
    "inverse_dynamics: qd": lambda x: armwright.dynamics.inverse_dynamics(PUMA, Q, x, Q),
    "inverse_dynamics: qdd": lambda x: armwright.dynamics.inverse_dynamics(PUMA, Q, Q, x),
    "inverse_dynamics: wrench": lambda x: armwright.dynamics.inverse_dynamics(PUMA, Q, Q, Q, wrench=x),
    "mass_matrix: q": lambda x: armwright.dynamics.mass_matrix(PUMA, x),
    "forward_dynamics: q": lambda x: armwright.dynamics.forward_dynamics(PUMA, x, Q, Q),
    "forward_dynamics: qd": lambda x: armwright.dynamics.forward_dynamics(PUMA, Q, x, Q),
    "forward_dynamics: tau": lambda x: armwright.dynamics.forward_dynamics(PUMA, Q, Q, x),
    "inverse_dynamics_derivatives: q": lambda x: armwright.dynamics.inverse_dynamics_derivatives(PUMA, x, Q, Q).dq,
    "forward_dynamics_derivatives: tau": lambda x: armwright.dynamics.forward_dynamics_derivatives(PUMA, Q, Q, x).dq,
    "base_regressor: qd": lambda x: armwright.dynamics.base_regressor(PUMA, Q, x, Q),
    "regressor: qd": lambda x: armwright.dynamics.regressor(PUMA, Q, x, Q),
    "toacc: q": lambda x: toacc(PUMA, x, Q, Q),
    "toacc: tau": lambda x: toacc(PUMA, Q, Q, x),
    "terms: q": lambda x: armwright.dynamics.terms(PUMA, x, Q, Q).total,
    "terms: qdd": lambda x: armwright.dynamics.terms(PUMA, Q, Q, x).total,
    "kinetic_energy: q": lambda x: kinetic_energy(PUMA, x, Q),
    "kinetic_energy: qd": lambda x: kinetic_energy(PUMA, Q, x),
    "potential_energy: q": lambda x: potential_energy(PUMA, x),
    "gravity_efforts: q": lambda x: gravity_efforts(PUMA, x),
    "coriolis_efforts: qd": lambda x: coriolis_efforts(PUMA, Q, x),
    "coriolis_matrix: q": lambda x: coriolis_matrix(PUMA, x, Q),
    "coriolis_tensor: q": lambda x: coriolis_tensor(PUMA, x),
    "inverse_branches: near": lambda x: armwright.kinematics.inverse_branches(
        PUMA, armwright.kinematics.forward(PUMA, Q), x
    )[0],
    "bejczy_efforts: q": lambda x: bejczy_efforts(x, Q),
    "bejczy_efforts: qdd": lambda x: bejczy_efforts(Q, x),
}
# Functions of one configuration (6,).
ONE: dict[str, Door] = {
    "singularities: q": lambda x: armwright.kinematics.singularities(PUMA, x).singular_values,
    "simulate: q": lambda x: armwright.simulation.simulate(PUMA, x, duration=1e-3, stops=False).q,
    "simulate: qd": lambda x: armwright.simulation.simulate(PUMA, Q, x, duration=1e-3).q,
    "inverse: near": lambda x: armwright.kinematics.inverse(PUMA, armwright.kinematics.forward(PUMA, Q), x).best.q,
    "point_to_point: q_start": lambda x: armwright.motion.point_to_point(PUMA, x, OTHER).coefficients,
    "point_to_point: q_goal": lambda x: armwright.motion.point_to_point(PUMA, OTHER, x).coefficients,
    "quintic: q_goal": lambda x: armwright.motion.quintic(OTHER, x, 1.0).coefficients,
    "cubic: q_goal": lambda x: armwright.motion.cubic(OTHER, x, 1.0).coefficients,
    "cubic: end": lambda x: armwright.motion.cubic(Q, OTHER, 1.0, end=x).coefficients,
    "trapezoid: q_goal": lambda x: armwright.motion.trapezoid(OTHER, x, 1.0, 1.0).coefficients,
    "xspline: start": lambda x: armwright.motion.xspline([0, 1], [Q, OTHER], x).coefficients,
    "xspline: end": lambda x: armwright.motion.xspline([0, 1], [Q, OTHER], end=x).coefficients,
    "retarget: q": lambda x: armwright.motion.retarget(PUMA, x, REST, REST, OTHER).coefficients,
    "retarget: qd": lambda x: armwright.motion.retarget(PUMA, Q, x, REST, OTHER).coefficients,
    "retarget: qdd": lambda x: armwright.motion.retarget(PUMA, Q, REST, x, OTHER, brake=True).coefficients,
    "retarget: q_goal": lambda x: armwright.motion.retarget(PUMA, Q, REST, REST, x).coefficients,
    "pd: kp": lambda x: pd(PUMA, standing(Q), x, 1.0)(0.0, np.zeros(6), np.zeros(6)),
    "computed_torque: kd": lambda x: computed_torque(PUMA, standing(Q), 1.0, x)(0.0, np.zeros(6), np.zeros(6)),
}
DOORS = {**MANY, **ONE}
