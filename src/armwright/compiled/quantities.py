"""The quantities of an arm that can be compiled: their equations, shapes and conditions, and their emitted code."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from armwright.arm.model import Arm
from armwright.arm.positions import admitted, ask_for_degrees
from armwright.arrays import Array
from armwright.dynamics.accelerations import NEGLIGIBLE, driven_accelerations, forward_dynamics
from armwright.dynamics.arguments import weighed
from armwright.dynamics.articulated_body import Pivot
from armwright.dynamics.derivatives import acceleration_partials, effort_partials, forward_dynamics_derivatives
from armwright.dynamics.drives import less_friction, with_drives, with_rotors
from armwright.dynamics.energy import link_kinetic_energy, link_potential_energy, rotor_energy
from armwright.dynamics.identification import base_parameters, effort_base_regressor
from armwright.dynamics.inertia_matrix import composite_rigid_body
from armwright.dynamics.newton_euler import newton_euler
from armwright.dynamics.regressors import effort_regressor, parameter_count
from armwright.dynamics.shares import gravity_shares, speed_shares
from armwright.dynamics.springs import less_springs, spring_energy, with_springs
from armwright.errors import UnknownNameError
from armwright.kinematics.forward_kinematics import link_frames, tool_frame
from armwright.kinematics.inverse_kinematics.branches import merged
from armwright.kinematics.inverse_kinematics.closed_forms import closed_form_of
from armwright.kinematics.jacobians import frame_columns, tool_columns
from armwright.tracing.emit import Emitted, Equation, Guarded, emit
from armwright.tracing.evaluation import evaluate
from armwright.tracing.graph import Graph, Traced
from armwright.tracing.kernel import Kernel
from armwright.tracing.scalar import Scalar
from armwright.tracing.vectors import Matrix, Vector

Numbers = Sequence[Scalar]
Inputs = Sequence[Traced]
Rows = list[list[Scalar]]


def emit_quantity(arm: Arm, name: str, *, loops: bool | None = None, origin: str = "") -> Emitted:
    """Return the code of a quantity's kernel and its operation count.

    Args:
        arm: the arm.
        name: of a quantity of ``CompiledArm``.
        loops: whether loops over the links stay loops, where the equation has them; None for long code only.
        origin: all that the arm is: see ``tracing.emit``.

    Raises:
        UnknownNameError: no such quantity.
        UnsupportedArmError: the arm has no such quantity.
    """
    if name not in _QUANTITIES:
        raise UnknownNameError("quantity", name, _QUANTITIES)
    quantity = _QUANTITIES[name]
    if name not in _GEOMETRY:
        weighed(arm)
    if name == "inverse_branches":
        closed_form_of(arm)
    outputs = [tuple(_size(arm, x) for x in shape) for shape in quantity.outputs]
    inputs = {key: tuple(_size(arm, x) for x in shape) for key, shape in quantity.inputs.items()}
    max_straight = quantity.max_straight
    if loops is not None and max_straight is not None:
        max_straight = 0 if loops else None
    bounds = dict.fromkeys(_POSITIONS, admitted(arm).tolist())
    equation: Equation = partial(quantity.equation, arm)
    return emit(
        f"{name} of {arm.name}",
        equation,
        inputs,
        shapes=outputs,
        flags=quantity.flags,
        bounds=bounds,
        max_straight=max_straight,
        origin=origin and f"{__name__} {name} {loops} {origin}",
    )


def quantity_kernel(arm: Arm, name: str, origin: str = "", *, quickly: bool = False) -> Kernel:
    """Return the kernel of a quantity, with the errors and the warnings of the plain function; compiled when called.

    Args:
        arm: the arm.
        name: of a quantity of ``CompiledArm``.
        origin: all that the arm is: see ``tracing.emit``.
        quickly: whether it is compiled with the least effort: see ``tracing.native.function_address``.

    Raises:
        UnknownNameError: no such quantity.
        UnsupportedArmError: the arm has no such quantity.
    """
    emitted = emit_quantity(arm, name, origin=origin)
    plain, remark = _QUANTITIES[name].plain, partial(_ask_for_degrees, arm, emitted.inputs)
    return Kernel(emitted=emitted, raise_for_invalid=plain and partial(plain, arm), remark=remark, quickly=quickly)


def evaluate_quantity(arm: Arm, name: str, *inputs: Sequence[float]) -> Rows:
    """Return the values of a quantity for one configuration, by the graph of its equation on plain numbers.

    Args:
        arm: the arm.
        name: of a quantity that the arm has.
        inputs: the numbers of each input, a matrix row by row; as many as the input has.

    Returns:
        The numbers of each output.
    """
    graph = Graph()
    result = _QUANTITIES[name].equation(arm, *(graph.inputs(len(x)) for x in inputs))
    numbers = [x for row in inputs for x in row]
    return [evaluate(graph, row, numbers) for row in (result.values if isinstance(result, Guarded) else result)]


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


def _tool_jacobian(arm: Arm, q: Numbers) -> Rows:
    columns = tool_columns(arm, q)
    return [[column[i] for i in range(6) for column in columns]]


def _inverse_branches(arm: Arm, X_BT: Numbers, near: Numbers) -> Rows:
    R = [list(X_BT[4 * i : 4 * i + 3]) for i in range(3)]
    q, singular = merged(closed_form_of(arm).branches(arm, R, [X_BT[4 * i + 3] for i in range(3)], near))
    return [[x for row in q for x in row], singular]


def _inverse_dynamics(arm: Arm, q: Numbers, qd: Numbers, qdd: Numbers, *wrench: Numbers) -> Rows:
    return [with_drives(arm, with_springs(arm, newton_euler(arm, q, qd, qdd, *wrench), q), qd, qdd)]


def _forward_dynamics(arm: Arm, q: Numbers, qd: Numbers, tau: Numbers) -> Guarded:
    driving = less_springs(arm, less_friction(arm, qd, tau), q)
    accelerations, pivots = driven_accelerations(arm, q, qd, driving)
    return _if_inertias_count([accelerations], pivots)


def _if_inertias_count(values: Rows, pivots: Iterable[Pivot]) -> Guarded:
    """Return values that mean something only where every joint moves more inertia than rounding leaves."""
    return Guarded(values, [pivot.inertia - NEGLIGIBLE * pivot.size for pivot in pivots])


def _mass_matrix(arm: Arm, q: Numbers) -> Rows:
    return [_flat(with_rotors(arm, composite_rigid_body(arm, q)))]


def _mass_and_bias(arm: Arm, q: Numbers, qd: Numbers) -> Rows:
    return [*_mass_matrix(arm, q), *_bias(arm, q, qd)]


def _bias(arm: Arm, q: Numbers, qd: Numbers) -> Rows:
    return [with_springs(arm, newton_euler(arm, q, qd, [0.0] * arm.n), q)]


def _gravity_efforts(arm: Arm, q: Numbers) -> Rows:
    return [gravity_shares(arm, q)]


def _coriolis_efforts(arm: Arm, q: Numbers, qd: Numbers) -> Rows:
    return [speed_shares(arm, q, qd)]


def _kinetic_energy(arm: Arm, q: Numbers, qd: Numbers) -> Rows:
    return [[link_kinetic_energy(arm, q, qd) + rotor_energy(arm, qd)]]


def _potential_energy(arm: Arm, q: Numbers) -> Rows:
    return [[link_potential_energy(arm, q) + spring_energy(arm, q)]]


def _inverse_dynamics_derivatives(arm: Arm, q: Inputs, qd: Inputs, qdd: Inputs) -> Rows:
    return [_flat(A) for A in effort_partials(arm, q, qd, qdd)]


def _forward_dynamics_derivatives(arm: Arm, q: Inputs, qd: Inputs, tau: Inputs) -> Guarded:
    matrices, pivots = acceleration_partials(arm, q, qd, tau)
    return _if_inertias_count([_flat(A) for A in matrices], pivots)


def _regressor(arm: Arm, q: Numbers, qd: Numbers, qdd: Numbers) -> Rows:
    return [_flat(effort_regressor(arm, q, qd, qdd))]


def _base_regressor(arm: Arm, q: Numbers, qd: Numbers, qdd: Numbers) -> Rows:
    return [_flat(effort_base_regressor(arm, q, qd, qdd))]


def _flat(A: Matrix) -> list[Scalar]:
    return [x for row in A for x in row]


def _pose(frame: tuple[Matrix, Vector]) -> Vector:
    rows = [[*row, coordinate] for row, coordinate in zip(*frame, strict=True)]
    return [x for row in [*rows, [0.0, 0.0, 0.0, 1.0]] for x in row]


class _Quantity(NamedTuple):
    """A quantity of the table below.

    In shapes, n is the number of joints, f that of the frames, p that of the parameters, b that of the base parameters,
    k that of the branches of the inverse kinematics.

    Attributes:
        equation: over abstract scalars.
        inputs: their shapes by their names.
        outputs: their shapes.
        flags: which outputs are truth values.
        plain: the function of the same quantity that is not compiled, which raises the error of inputs that break a
            condition; None without conditions.
        max_straight: the number of nodes of the graph beyond which loops over links are loops of the code; these were
            measured to be faster there. None if they never are.
    """

    equation: Callable[..., Rows | Guarded]
    inputs: Mapping[str, tuple[str | int, ...]]
    outputs: tuple[tuple[str | int, ...], ...]
    flags: tuple[int, ...] = ()
    plain: Callable[..., object] | None = None
    max_straight: int | None = None


def _size(arm: Arm, letter: str | int) -> int:
    if isinstance(letter, int):
        return letter
    if letter == "k":
        return len(closed_form_of(arm).signs)
    if letter == "b":
        return len(base_parameters(arm).columns)
    return parameter_count(arm) if letter == "p" else {"n": arm.n, "f": arm.n + 2}[letter]


# The inputs that are positions of joints.
_POSITIONS = ("q", "near")
_STATE: dict[str, tuple[str | int, ...]] = {"q": ("n",), "qd": ("n",)}
_MOTION = {**_STATE, "qdd": ("n",)}
_FORCED = {**_STATE, "tau": ("n",)}
_Q = {"q": ("n",)}
# Those that ask for no masses and inertias.
_GEOMETRY = {"forward", "link_poses", "jacobian", "tool_jacobian", "pose_and_jacobian", "inverse_branches"}
_THREE_MATRICES = (("n", "n"),) * 3
_QUANTITIES = {
    "forward": _Quantity(_forward, _Q, ((4, 4),)),
    "link_poses": _Quantity(_link_poses, _Q, (("f", 4, 4),)),
    "jacobian": _Quantity(_jacobian, _Q, ((6, "n"),)),
    "tool_jacobian": _Quantity(_tool_jacobian, _Q, ((6, "n"),)),
    "pose_and_jacobian": _Quantity(_pose_and_jacobian, _Q, ((4, 4), (6, "n"))),
    "inverse_branches": _Quantity(
        _inverse_branches, {"pose": (4, 4), "near": ("n",)}, (("k", "n"), ("k",)), flags=(1,)
    ),
    "inverse_dynamics": _Quantity(_inverse_dynamics, _MOTION, (("n",),), max_straight=2300),
    "inverse_dynamics_with_wrench": _Quantity(
        _inverse_dynamics, {**_MOTION, "wrench": (6,)}, (("n",),), max_straight=2300
    ),
    "forward_dynamics": _Quantity(_forward_dynamics, _FORCED, (("n",),), plain=forward_dynamics, max_straight=10_000),
    "mass_matrix": _Quantity(_mass_matrix, _Q, (("n", "n"),)),
    "mass_and_bias": _Quantity(_mass_and_bias, _STATE, (("n", "n"), ("n",))),
    "bias": _Quantity(_bias, _STATE, (("n",),)),
    "gravity_efforts": _Quantity(_gravity_efforts, _Q, (("n",),)),
    "coriolis_efforts": _Quantity(_coriolis_efforts, _STATE, (("n",),)),
    "kinetic_energy": _Quantity(_kinetic_energy, _STATE, ((),)),
    "potential_energy": _Quantity(_potential_energy, _Q, ((),)),
    "inverse_dynamics_derivatives": _Quantity(_inverse_dynamics_derivatives, _MOTION, _THREE_MATRICES),
    "forward_dynamics_derivatives": _Quantity(
        _forward_dynamics_derivatives, _FORCED, _THREE_MATRICES, plain=forward_dynamics_derivatives
    ),
    "regressor": _Quantity(_regressor, _MOTION, (("n", "p"),)),
    "base_regressor": _Quantity(_base_regressor, _MOTION, (("n", "b"),)),
}
