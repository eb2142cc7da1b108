"""What a planner asks of an arm, plain or compiled: the same functions, evaluated at once or by kernels."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import known_arm
from armwright.arrays import Array
from armwright.compiled.arm import CompiledArm
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.closed_forms import find_closed_form
from armwright.kinematics.inverse_kinematics.redundant import Locked
from armwright.kinematics.inverse_kinematics.solve import inverse_branches
from armwright.motion.rows import Evaluator, by_kernels, on_arrays
from armwright.tracing.loops import Runner, compiled, compiled_quickly, with_numpy


class Solver(NamedTuple):
    """Functions of one arm.

    Attributes:
        arm: the arm.
        forward: tool poses (..., 4, 4) of q (..., n).
        inverse_dynamics: efforts (..., n) of q, qd, qdd (..., n).
        inverse_branches: the branches of poses, see ``kinematics.inverse_branches``; None without a closed form for
            all poses.
        rows: evaluates other equations of many rows.
        run: runs routines.
    """

    arm: Arm
    forward: Callable[..., Array]
    inverse_dynamics: Callable[..., Array]
    inverse_branches: Callable[..., Any] | None
    rows: Evaluator
    run: Runner


# A planner that has the functions of an arm hands them on.
AnyArm: TypeAlias = Arm | CompiledArm | Solver


def solver_of(arm: AnyArm) -> Solver:
    """Return the functions of an arm: kernels of a compiled one, else the plain functions, which compile nothing."""
    if isinstance(arm, Solver):
        return arm
    if isinstance(arm, CompiledArm):
        forward_, dynamics = partial(_by_kernel, arm, "forward", 1), partial(_by_kernel, arm, "inverse_dynamics", 1)
        branches_ = partial(_by_kernel, arm, "inverse_branches", 2)
        run = compiled_quickly if arm.quickly else compiled
        return Solver(arm.arm, forward_, dynamics, branches_ if _has_branches(arm.arm) else None, by_kernels, run)
    branches = partial(inverse_branches, arm) if _has_branches(known_arm(arm)) else None
    return Solver(arm, partial(forward, arm), partial(inverse_dynamics, arm), branches, on_arrays, with_numpy)


def _has_branches(arm: Arm) -> bool:
    """Whether a closed form leads along any path: not one that holds a joint where others can go on."""
    form = find_closed_form(arm)
    return form is not None and not isinstance(form, Locked)


def _by_kernel(arm: CompiledArm, name: str, axes: int, *inputs: Array) -> Any:
    """Call a function of a compiled arm, of whose first input one value has so many axes.

    The kernel is traced only here, as not every arm has each of them. It takes rows, as many of each input: a kernel
    has other code for one value alone, which would have to be compiled as well.
    """
    first, *others = inputs
    lead = first.shape[:-axes]
    if len(lead) == 1 and all(x.shape[:-1] == lead for x in others):
        return getattr(arm, name)(*inputs)
    rows = [x.reshape(-1, x.shape[-1]) if x.shape[:-1] == lead else _repeated(x, lead) for x in others]
    results = getattr(arm, name)(first.reshape(-1, *first.shape[-axes:]), *rows)
    if isinstance(results, tuple):
        return tuple(x.reshape(*lead, *x.shape[1:]) for x in results)
    return results.reshape(*lead, *results.shape[1:])


def _repeated(x: Array, lead: tuple[int, ...]) -> Array:
    """Return an input (..., n) as rows, the same ones for what it lacks of the leading axes."""
    rows = np.empty((*lead, x.shape[-1]))
    rows[...] = x
    return rows.reshape(-1, x.shape[-1])
