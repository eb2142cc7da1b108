"""What a planner asks of an arm, plain or compiled: the same functions, evaluated at once or by kernels."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple, TypeAlias

from armwright.arm.model import Arm
from armwright.arm.positions import known_arm
from armwright.arrays import Array
from armwright.compiled.arm import CompiledArm
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.recognise import find_geometry
from armwright.kinematics.inverse_kinematics.solve import inverse_branches

AnyArm: TypeAlias = Arm | CompiledArm


class Solver(NamedTuple):
    """Functions of one arm.

    Attributes:
        arm: the arm.
        forward: tool poses (..., 4, 4) of q (..., n).
        inverse_dynamics: efforts (..., n) of q, qd, qdd (..., n).
        inverse_branches: the eight configurations of poses, see ``kinematics.inverse``; None without a closed form.
    """

    arm: Arm
    forward: Callable[..., Array]
    inverse_dynamics: Callable[..., Array]
    inverse_branches: Callable[..., Any] | None


def solver_of(arm: AnyArm) -> Solver:
    """Return the functions of an arm: kernels of a compiled one, else the plain functions, which compile nothing."""
    if isinstance(arm, CompiledArm):
        closed = find_geometry(arm.arm) is not None
        return Solver(arm.arm, arm.forward, arm.inverse_dynamics, arm.inverse_branches if closed else None)
    branches = partial(inverse_branches, arm) if find_geometry(known_arm(arm)) is not None else None
    return Solver(arm, partial(forward, arm), partial(inverse_dynamics, arm), branches)
