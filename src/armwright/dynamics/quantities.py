"""Quantities of an arm as compiled kernels: the same equations, traced for that arm."""

from collections.abc import Callable, Sequence

import attrs

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike
from armwright.dynamics.newton_euler import drive_effort, newton_euler
from armwright.errors import UnknownNameError
from armwright.kinematics.forward import link_frames, tool_frame
from armwright.kinematics.jacobian import jacobian_columns
from armwright.tracing.emit import Emitted, emit
from armwright.tracing.kernel import Kernel, compiled
from armwright.tracing.scalar import Scalar

Rows = Sequence[Sequence[Scalar]]


@attrs.frozen(kw_only=True, eq=False)
class Quantity:
    """One quantity of an arm, compiled.

    Attributes:
        kernel: on flat rows.
        shape: of one value, such as (4, 4) for a pose.
    """

    kernel: Kernel
    shape: tuple[int, ...]

    def __call__(self, *inputs: ArrayLike, threads: int = 1) -> Array:
        """Evaluate it for one configuration or many.

        Args:
            inputs: arrays (..., n): positions, and for efforts speeds and accelerations.
            threads: how many cores to use; the bits do not depend on it.

        Returns:
            (..., *shape).

        Raises:
            ShapeError: a shape does not fit.
            InvalidValueError: a number is NaN or infinite.
        """
        (flat,) = self.kernel(*inputs, threads=threads)
        return flat.reshape(*flat.shape[:-1], *self.shape)


def compile_quantity(arm: Arm, name: str) -> Quantity:
    """Return a quantity of an arm as a compiled kernel; the first time takes a second or more.

    Args:
        arm: the arm.
        name: ``forward``, ``jacobian`` or ``inverse_dynamics``, as the plain functions are called.

    Raises:
        UnknownNameError: no such quantity.
    """
    return Quantity(kernel=compiled(emit_quantity(arm, name)), shape=_shape(arm, name))


def emit_quantity(arm: Arm, name: str) -> Emitted:
    """Return the source of a quantity's kernel and its operation count; the arguments of ``compile_quantity``."""
    if name not in _EQUATIONS:
        raise UnknownNameError("quantity", name, _EQUATIONS)
    equation, inputs = _EQUATIONS[name]
    return emit(f"{name} of {arm.name}", lambda *lists: equation(arm, *lists), [arm.n] * inputs)


def quantity_names() -> tuple[str, ...]:
    """Return the names of the quantities that can be compiled."""
    return tuple(_EQUATIONS)


def _forward(arm: Arm, q: Sequence[Scalar]) -> Rows:
    R, p = tool_frame(arm, link_frames(arm, q)[-1])
    rows = [[*row, place] for row, place in zip(R, p, strict=True)]
    return [[x for row in [*rows, [0.0, 0.0, 0.0, 1.0]] for x in row]]


def _jacobian(arm: Arm, q: Sequence[Scalar]) -> Rows:
    columns = jacobian_columns(arm, q)
    return [[column[i] for i in range(6) for column in columns]]


def _inverse_dynamics(arm: Arm, q: Sequence[Scalar], qd: Sequence[Scalar], qdd: Sequence[Scalar]) -> Rows:
    efforts = newton_euler(arm, q, qd, qdd)
    drives = (drive_effort(*of_joint) for of_joint in zip(arm.motors, qd, qdd, strict=True))
    return [[effort + drive for effort, drive in zip(efforts, drives, strict=True)]]


_EQUATIONS: dict[str, tuple[Callable[..., Rows], int]] = {
    "forward": (_forward, 1),
    "jacobian": (_jacobian, 1),
    "inverse_dynamics": (_inverse_dynamics, 3),
}


def _shape(arm: Arm, name: str) -> tuple[int, ...]:
    return {"forward": (4, 4), "jacobian": (6, arm.n)}.get(name, (arm.n,))
