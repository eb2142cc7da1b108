"""A workbench for robot manipulators: model an arm, solve it, move it, program it.

The public functions can be had from here; each is imported when it is first asked for, so that importing the
package costs nothing:

    import armwright

    arm = armwright.load_arm("puma560")
    X = armwright.forward(arm, [0.1, -0.5, 0.6, 0.2, 0.8, 0.0])
    postures = armwright.inverse(arm, X)
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from armwright.version import __version__

if TYPE_CHECKING:
    from armwright.arm.load import arm_names, load_arm
    from armwright.arm.model import Arm
    from armwright.arm.urdf.reader import load_urdf
    from armwright.dynamics.compiled import compile_arm
    from armwright.dynamics.forward_dynamics import forward_dynamics
    from armwright.dynamics.mass_matrix import mass_matrix
    from armwright.dynamics.newton_euler import inverse_dynamics
    from armwright.dynamics.payload import payload
    from armwright.dynamics.simulate import simulate
    from armwright.dynamics.terms import terms
    from armwright.errors import ArmwrightError, UnitWarning
    from armwright.kinematics.forward import forward, link_poses
    from armwright.kinematics.inverse.closed_form import inverse, inverse_branches
    from armwright.kinematics.jacobian import jacobian
    from armwright.kinematics.singularities import singularities
    from armwright.motion.detour import line_or_detour
    from armwright.motion.quintic import point_to_point, quintic
    from armwright.motion.straight import straight_line
    from armwright.motion.trajectory import Trajectory
    from armwright.motion.xspline import xspline

_HOME = {
    "Arm": "arm.model",
    "ArmwrightError": "errors",
    "Trajectory": "motion.trajectory",
    "UnitWarning": "errors",
    "arm_names": "arm.load",
    "compile_arm": "dynamics.compiled",
    "forward": "kinematics.forward",
    "forward_dynamics": "dynamics.forward_dynamics",
    "inverse": "kinematics.inverse.closed_form",
    "inverse_branches": "kinematics.inverse.closed_form",
    "inverse_dynamics": "dynamics.newton_euler",
    "jacobian": "kinematics.jacobian",
    "line_or_detour": "motion.detour",
    "link_poses": "kinematics.forward",
    "load_arm": "arm.load",
    "load_urdf": "arm.urdf.reader",
    "mass_matrix": "dynamics.mass_matrix",
    "payload": "dynamics.payload",
    "point_to_point": "motion.quintic",
    "quintic": "motion.quintic",
    "simulate": "dynamics.simulate",
    "singularities": "kinematics.singularities",
    "straight_line": "motion.straight",
    "terms": "dynamics.terms",
    "xspline": "motion.xspline",
}

__all__ = [
    "Arm",
    "ArmwrightError",
    "Trajectory",
    "UnitWarning",
    "__version__",
    "arm_names",
    "compile_arm",
    "forward",
    "forward_dynamics",
    "inverse",
    "inverse_branches",
    "inverse_dynamics",
    "jacobian",
    "line_or_detour",
    "link_poses",
    "load_arm",
    "load_urdf",
    "mass_matrix",
    "payload",
    "point_to_point",
    "quintic",
    "simulate",
    "singularities",
    "straight_line",
    "terms",
    "xspline",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for."""
    if name not in _HOME:
        raise AttributeError(f"module 'armwright' has no attribute '{name}'")
    return getattr(import_module(f"armwright.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    """List the public names."""
    return __all__
