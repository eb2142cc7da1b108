"""The quantities of an arm that can be compiled: their equations, shapes and conditions, and their emitted sources."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from armwright.arm.model import Arm
from armwright.arm.positions import admitted, ask_for_degrees
from armwright.arrays import Array
from armwright.dynamics.accelerations import NEGLIGIBLE, forward_dynamics, less_friction
from armwright.dynamics.arguments import weighed
from armwright.dynamics.articulated_body import articulated_body
from armwright.dynamics.inertia_matrix import composite_rigid_body
from armwright.dynamics.newton_euler import drive_effort, newton_euler
from armwright.errors import UnknownNameError
from armwright.kinematics.forward_kinematics import link_frames, tool_frame
from armwright.kinematics.inverse_kinematics.branches import branches, merged
from armwright.kinematics.inverse_kinematics.recognise import closed_form_geometry
from armwright.kinematics.jacobians import frame_columns
from armwright.tracing.emit import Emitted, Equation, Guarded, emit
from armwright.tracing.kernel import Kernel
from armwright.tracing.scalar import Scalar
from armwright.tracing.vectors import Matrix, Vector

Numbers = Sequence[Scalar]
Rows = list[list[Scalar]]


def emit_quantity(arm: Arm, name: str) -> Emitted:
    """Return the source of a quantity's kernel and its operation count.

    Args:
        arm: the arm.
        name: of a quantity of ``CompiledArm``.

    Raises:
        UnknownNameError: no such quantity.
        UnsupportedArmError: the arm has no such quantity.
    """
    if name not in _QUANTITIES:
        raise UnknownNameError("quantity", name, _QUANTITIES)
    quantity = _QUANTITIES[name]
    if name in _WEIGH:
        weighed(arm)
    outputs = [tuple(_size(arm, x) for x in shape) for shape in quantity.outputs]
    inputs = {key: tuple(_size(arm, x) for x in shape) for key, shape in quantity.inputs.items()}
    bounds = dict.fromkeys(_POSITIONS, admitted(arm).tolist())
    equation: Equation = partial(quantity.equation, arm)
    return emit(f"{name} of {arm.name}", equation, inputs, shapes=outputs, flags=quantity.flags, bounds=bounds)


def quantity_kernel(arm: Arm, name: str) -> Kernel:
    """Return the kernel of a quantity, with the errors and the warnings of the plain function; compiled when called.

    Args:
        arm: the arm.
        name: of a quantity of ``CompiledArm``.

    Raises:
        UnknownNameError: no such quantity.
        UnsupportedArmError: the arm has no such quantity.
    """
    emitted = emit_quantity(arm, name)
    plain, remark = _QUANTITIES[name].plain, partial(_ask_for_degrees, arm, emitted.inputs)
    return Kernel(emitted=emitted, raise_for_invalid=plain and partial(plain, arm), remark=remark)


def evaluate_quantity(arm: Arm, name: str, *inputs: Sequence[float]) -> Rows:
    """Return the values of a quantity for one configuration, by its equation on plain numbers.

    Args:
        arm: the arm.
        name: of a quantity that the arm has.
        inputs: the numbers of each input, a matrix row by row.

    Returns:
        The numbers of each output.
    """
    result = _QUANTITIES[name].equation(arm, *inputs)
    return [list(row) for row in (result.values if isinstance(result, Guarded) else result)]


def quantity_names() -> tuple[str, ...]:
    """Return the names of the quantities that can be compiled."""
    return tuple(_QUANTITIES)


def _ask_for_degrees(arm: Arm, inputs: Iterable[str], arrays: Sequence[Array], callers: int) -> None:
    for name, array in zip(inputs, arrays, strict=True):
        if name in _POSITIONS:
            ask_for_degrees(arm, array, name, callers + 1)


def _forward(arm: Arm, q: Numbers) -> Rows:
    return [_pose(tool_frame(arm, link_frames(arm, q)[-1]))]


def _link_poses(arm: Arm, q: Numbers) -> Rows:
    frames = link_frames(arm, q)
    return [[x for frame in [*frames, tool_frame(arm, frames[-1])] for x in _pose(frame)]]


def _pose_and_jacobian(arm: Arm, q: Numbers) -> Rows:
    frames = link_frames(arm, q)
    tool = tool_frame(arm, frames[-1])
    columns = frame_columns(arm, frames, tool[1])
    return [_pose(tool), [column[i] for i in range(6) for column in columns]]


def _jacobian(arm: Arm, q: Numbers) -> Rows:
    return _pose_and_jacobian(arm, q)[1:]


def _inverse_branches(arm: Arm, X_BT: Numbers, near: Numbers) -> Rows:
    R = [list(X_BT[4 * i : 4 * i + 3]) for i in range(3)]
    q, singular = merged(branches(arm, closed_form_geometry(arm), R, [X_BT[4 * i + 3] for i in range(3)], near))
    return [[x for row in q for x in row], singular]


def _inverse_dynamics(arm: Arm, q: Numbers, qd: Numbers, qdd: Numbers, *wrench: Numbers) -> Rows:
    efforts = newton_euler(arm, q, qd, qdd, *wrench)
    drives = (drive_effort(*of_joint) for of_joint in zip(arm.motors, qd, qdd, strict=True))
    return [[effort + drive for effort, drive in zip(efforts, drives, strict=True)]]


def _forward_dynamics(arm: Arm, q: Numbers, qd: Numbers, tau: Numbers) -> Guarded:
    accelerations, pivots = articulated_body(arm, q, qd, less_friction(arm, qd, tau))
    return Guarded([accelerations], [pivot.inertia - NEGLIGIBLE * pivot.size for pivot in pivots])


def _mass_matrix(arm: Arm, q: Numbers) -> Rows:
    M = composite_rigid_body(arm, q)
    for i, motor in enumerate(arm.motors):
        M[i][i] = M[i][i] + motor.inertia
    return [[x for row in M for x in row]]


def _mass_and_bias(arm: Arm, q: Numbers, qd: Numbers) -> Rows:
    return [*_mass_matrix(arm, q), newton_euler(arm, q, qd, [0.0] * arm.n)]


def _pose(frame: tuple[Matrix, Vector]) -> Vector:
    rows = [[*row, coordinate] for row, coordinate in zip(*frame, strict=True)]
    return [x for row in [*rows, [0.0, 0.0, 0.0, 1.0]] for x in row]


class _Quantity(NamedTuple):
    """One row of the table: shapes stand in letters, n for the number of joints and f for that of the frames.

    Attributes:
        equation: over abstract scalars.
        inputs: their shapes by their names.
        outputs: their shapes.
        flags: which outputs are truth values.
        plain: the plain function, which raises what belongs to inputs that break a condition; None without conditions.
    """

    equation: Callable[..., Rows | Guarded]
    inputs: Mapping[str, tuple[str | int, ...]]
    outputs: tuple[tuple[str | int, ...], ...]
    flags: tuple[int, ...] = ()
    plain: Callable[..., object] | None = None


def _size(arm: Arm, letter: str | int) -> int:
    return letter if isinstance(letter, int) else {"n": arm.n, "f": arm.n + 2}[letter]


# The inputs that are positions of joints.
_POSITIONS = ("q", "near")
_STATE: dict[str, tuple[str | int, ...]] = {"q": ("n",), "qd": ("n",)}
_MOTION = {**_STATE, "qdd": ("n",)}
_Q = {"q": ("n",)}
# Those that ask for masses and inertias.
_WEIGH = ("inverse_dynamics", "inverse_dynamics_with_wrench", "forward_dynamics", "mass_matrix", "mass_and_bias")
_QUANTITIES = {
    "forward": _Quantity(_forward, _Q, ((4, 4),)),
    "link_poses": _Quantity(_link_poses, _Q, (("f", 4, 4),)),
    "jacobian": _Quantity(_jacobian, _Q, ((6, "n"),)),
    "pose_and_jacobian": _Quantity(_pose_and_jacobian, _Q, ((4, 4), (6, "n"))),
    "inverse_branches": _Quantity(_inverse_branches, {"pose": (4, 4), "near": (6,)}, ((8, 6), (8,)), flags=(1,)),
    "inverse_dynamics": _Quantity(_inverse_dynamics, _MOTION, (("n",),)),
    "inverse_dynamics_with_wrench": _Quantity(_inverse_dynamics, {**_MOTION, "wrench": (6,)}, (("n",),)),
    "forward_dynamics": _Quantity(_forward_dynamics, {**_STATE, "tau": ("n",)}, (("n",),), plain=forward_dynamics),
    "mass_matrix": _Quantity(_mass_matrix, _Q, (("n", "n"),)),
    "mass_and_bias": _Quantity(_mass_and_bias, _STATE, (("n", "n"), ("n",))),
}
