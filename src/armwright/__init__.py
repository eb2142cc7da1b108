"""A workbench for robot manipulators: model an arm, solve it, move it, program it.

The public functions can be had from here; each is imported when it is first asked for, so that importing the
package costs nothing:

    import armwright

    arm = armwright.load_arm("puma560")
    X = armwright.forward(arm, [0.1, -0.5, 0.6, 0.2, 0.8, 0.0])
    postures = armwright.inverse(arm, X)
"""

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from armwright.version import __version__

if TYPE_CHECKING:
    from armwright.accuracy.assessment import assess
    from armwright.accuracy.compliance import static_compliance
    from armwright.accuracy.corner import corner_deviations
    from armwright.accuracy.distance import distance_accuracy, distance_repeatability
    from armwright.accuracy.measurement_file import read_measurements
    from armwright.accuracy.path import path_deviation, path_velocity
    from armwright.accuracy.pose import pose_accuracy, pose_repeatability
    from armwright.accuracy.settling_time import posing_time, settling
    from armwright.accuracy.trace import Trace
    from armwright.accuracy.variation import exchangeability, multidirectional_variation, pose_drift
    from armwright.accuracy.weaving import weaving_deviation
    from armwright.arm.load import arm_names, load_arm
    from armwright.arm.model import Arm
    from armwright.arm.urdf.reader import load_urdf
    from armwright.calibration.compensation import inverse_calibrated
    from armwright.calibration.correction import corrected_arm, position_covariance
    from armwright.calibration.experiment_design import plan_poses
    from armwright.calibration.fitting import calibrate, calibrate_points
    from armwright.calibration.nongeometric import calibrate_nongeometric
    from armwright.clearance.correction import correct_nodes, correct_path
    from armwright.clearance.estimation.static import estimate_at_rest
    from armwright.clearance.reader import load_linkage
    from armwright.compiled.arm import compile_arm
    from armwright.dynamics.accelerations import forward_dynamics
    from armwright.dynamics.equation_of_motion import terms
    from armwright.dynamics.inertia_matrix import mass_matrix
    from armwright.dynamics.lagrange_euler import coriolis_matrix, coriolis_tensor, pose_derivative_matrices
    from armwright.dynamics.newton_euler import inverse_dynamics, link_forces
    from armwright.dynamics.payloads import payload
    from armwright.errors import ArmwrightError, CacheWarning, GravityWarning, UnitWarning
    from armwright.kinematics.damping import damped_rates
    from armwright.kinematics.differential import differential_inverse
    from armwright.kinematics.forward_kinematics import forward, link_poses
    from armwright.kinematics.inverse_kinematics.solve import inverse, inverse_branches
    from armwright.kinematics.inverse_kinematics.wrapping import equivalent_configurations
    from armwright.kinematics.jacobians import jacobian
    from armwright.kinematics.manipulability_index import manipulability
    from armwright.kinematics.singularity_analysis import singularities
    from armwright.kinematics.wrist_partitioned import wrist_partitioned_inverse, wrist_partitioned_jacobian
    from armwright.motion.blends import blend_timing, blended, via_deviations, via_distances
    from armwright.motion.continuity_report import continuity
    from armwright.motion.cubic_polynomials import cubic, cubic_through
    from armwright.motion.detour import line_or_detour
    from armwright.motion.efforts import effort_peaks, slowing_for_efforts
    from armwright.motion.limit_utilization import limit_use, slowing_for_limits
    from armwright.motion.moves import cartesian_move, joint_move, stopping_move
    from armwright.motion.online import replace_goal, retarget
    from armwright.motion.quintic_polynomials import point_to_point, quintic
    from armwright.motion.straight import straight_line
    from armwright.motion.through import through_frames
    from armwright.motion.time_optimal_path import time_optimal
    from armwright.motion.trajectory import Trajectory, hold, join
    from armwright.motion.trapezoidal_profile import trapezoid
    from armwright.motion.xspline_online import xspline_kernel
    from armwright.motion.xspline_path import xspline, xspline_along
    from armwright.simulation.time_stepping import simulate

_HOME = {
    "Arm": "arm.model",
    "ArmwrightError": "errors",
    "CacheWarning": "errors",
    "GravityWarning": "errors",
    "Trace": "accuracy.trace",
    "Trajectory": "motion.trajectory",
    "UnitWarning": "errors",
    "arm_names": "arm.load",
    "assess": "accuracy.assessment",
    "blend_timing": "motion.blends",
    "blended": "motion.blends",
    "calibrate": "calibration.fitting",
    "calibrate_nongeometric": "calibration.nongeometric",
    "calibrate_points": "calibration.fitting",
    "cartesian_move": "motion.moves",
    "compile_arm": "compiled.arm",
    "continuity": "motion.continuity_report",
    "coriolis_matrix": "dynamics.lagrange_euler",
    "coriolis_tensor": "dynamics.lagrange_euler",
    "corner_deviations": "accuracy.corner",
    "correct_nodes": "clearance.correction",
    "correct_path": "clearance.correction",
    "corrected_arm": "calibration.correction",
    "cubic": "motion.cubic_polynomials",
    "cubic_through": "motion.cubic_polynomials",
    "damped_rates": "kinematics.damping",
    "differential_inverse": "kinematics.differential",
    "distance_accuracy": "accuracy.distance",
    "distance_repeatability": "accuracy.distance",
    "effort_peaks": "motion.efforts",
    "equivalent_configurations": "kinematics.inverse_kinematics.wrapping",
    "estimate_at_rest": "clearance.estimation.static",
    "exchangeability": "accuracy.variation",
    "forward": "kinematics.forward_kinematics",
    "forward_dynamics": "dynamics.accelerations",
    "hold": "motion.trajectory",
    "inverse": "kinematics.inverse_kinematics.solve",
    "inverse_branches": "kinematics.inverse_kinematics.solve",
    "inverse_calibrated": "calibration.compensation",
    "inverse_dynamics": "dynamics.newton_euler",
    "jacobian": "kinematics.jacobians",
    "join": "motion.trajectory",
    "joint_move": "motion.moves",
    "limit_use": "motion.limit_utilization",
    "line_or_detour": "motion.detour",
    "link_forces": "dynamics.newton_euler",
    "link_poses": "kinematics.forward_kinematics",
    "load_arm": "arm.load",
    "load_linkage": "clearance.reader",
    "load_urdf": "arm.urdf.reader",
    "manipulability": "kinematics.manipulability_index",
    "mass_matrix": "dynamics.inertia_matrix",
    "multidirectional_variation": "accuracy.variation",
    "path_deviation": "accuracy.path",
    "path_velocity": "accuracy.path",
    "payload": "dynamics.payloads",
    "plan_poses": "calibration.experiment_design",
    "position_covariance": "calibration.correction",
    "point_to_point": "motion.quintic_polynomials",
    "pose_accuracy": "accuracy.pose",
    "pose_derivative_matrices": "dynamics.lagrange_euler",
    "pose_drift": "accuracy.variation",
    "pose_repeatability": "accuracy.pose",
    "posing_time": "accuracy.settling_time",
    "quintic": "motion.quintic_polynomials",
    "read_measurements": "accuracy.measurement_file",
    "replace_goal": "motion.online",
    "retarget": "motion.online",
    "settling": "accuracy.settling_time",
    "simulate": "simulation.time_stepping",
    "singularities": "kinematics.singularity_analysis",
    "slowing_for_efforts": "motion.efforts",
    "slowing_for_limits": "motion.limit_utilization",
    "static_compliance": "accuracy.compliance",
    "stopping_move": "motion.moves",
    "straight_line": "motion.straight",
    "terms": "dynamics.equation_of_motion",
    "through_frames": "motion.through",
    "time_optimal": "motion.time_optimal_path",
    "trapezoid": "motion.trapezoidal_profile",
    "via_deviations": "motion.blends",
    "via_distances": "motion.blends",
    "weaving_deviation": "accuracy.weaving",
    "wrist_partitioned_inverse": "kinematics.wrist_partitioned",
    "wrist_partitioned_jacobian": "kinematics.wrist_partitioned",
    "xspline": "motion.xspline_path",
    "xspline_along": "motion.xspline_path",
    "xspline_kernel": "motion.xspline_online",
}

__all__ = [
    "Arm",
    "ArmwrightError",
    "CacheWarning",
    "GravityWarning",
    "Trace",
    "Trajectory",
    "UnitWarning",
    "__version__",
    "arm_names",
    "assess",
    "blend_timing",
    "blended",
    "calibrate",
    "calibrate_nongeometric",
    "calibrate_points",
    "cartesian_move",
    "compile_arm",
    "continuity",
    "coriolis_matrix",
    "coriolis_tensor",
    "corner_deviations",
    "correct_nodes",
    "correct_path",
    "corrected_arm",
    "cubic",
    "cubic_through",
    "damped_rates",
    "differential_inverse",
    "distance_accuracy",
    "distance_repeatability",
    "effort_peaks",
    "equivalent_configurations",
    "estimate_at_rest",
    "exchangeability",
    "forward",
    "forward_dynamics",
    "hold",
    "inverse",
    "inverse_branches",
    "inverse_calibrated",
    "inverse_dynamics",
    "jacobian",
    "join",
    "joint_move",
    "limit_use",
    "line_or_detour",
    "link_forces",
    "link_poses",
    "load_arm",
    "load_linkage",
    "load_urdf",
    "manipulability",
    "mass_matrix",
    "multidirectional_variation",
    "path_deviation",
    "path_velocity",
    "payload",
    "plan_poses",
    "point_to_point",
    "pose_accuracy",
    "pose_derivative_matrices",
    "pose_drift",
    "pose_repeatability",
    "posing_time",
    "position_covariance",
    "quintic",
    "read_measurements",
    "replace_goal",
    "retarget",
    "settling",
    "simulate",
    "singularities",
    "slowing_for_efforts",
    "slowing_for_limits",
    "static_compliance",
    "stopping_move",
    "straight_line",
    "terms",
    "through_frames",
    "time_optimal",
    "trapezoid",
    "via_deviations",
    "via_distances",
    "weaving_deviation",
    "wrist_partitioned_inverse",
    "wrist_partitioned_jacobian",
    "xspline",
    "xspline_along",
    "xspline_kernel",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for."""
    if name not in _HOME:
        # With these two Python tells the nearest public name below the traceback.
        raise AttributeError(f"module 'armwright' has no attribute '{name}'", name=name, obj=sys.modules[__name__])
    return getattr(import_module(f"armwright.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    """List the public names."""
    return __all__
