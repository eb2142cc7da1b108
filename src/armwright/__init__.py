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
    from armwright.dynamics.newton_euler import inverse_dynamics
    from armwright.errors import ArmwrightError
    from armwright.kinematics.forward import forward, link_poses
    from armwright.kinematics.inverse.closed_form import inverse, inverse_branches
    from armwright.kinematics.jacobian import jacobian
    from armwright.motion.quintic import point_to_point, quintic
    from armwright.motion.trajectory import Trajectory
    from armwright.motion.xspline import xspline

_HOME = {
    "Arm": "arm.model",
    "ArmwrightError": "errors",
    "Trajectory": "motion.trajectory",
    "arm_names": "arm.load",
    "forward": "kinematics.forward",
    "inverse": "kinematics.inverse.closed_form",
    "inverse_branches": "kinematics.inverse.closed_form",
    "inverse_dynamics": "dynamics.newton_euler",
    "jacobian": "kinematics.jacobian",
    "link_poses": "kinematics.forward",
    "load_arm": "arm.load",
    "point_to_point": "motion.quintic",
    "quintic": "motion.quintic",
    "xspline": "motion.xspline",
}

__all__ = [
    "Arm",
    "ArmwrightError",
    "Trajectory",
    "__version__",
    "arm_names",
    "forward",
    "inverse",
    "inverse_branches",
    "inverse_dynamics",
    "jacobian",
    "link_poses",
    "load_arm",
    "point_to_point",
    "quintic",
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
