"""An arm whose laws are compiled: the same equations as everywhere, traced for that arm."""

# The methods of a compiled arm have signatures and docstrings alone: what they do is in their kernels.
# mypy: disable-error-code="empty-body"

from __future__ import annotations  # what help shows keeps the names of array types, which are long

import os
import warnings
from collections import OrderedDict
from collections.abc import Callable
from functools import cached_property, partial, wraps
from threading import RLock
from typing import Any, TypeVar, cast

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import known_arm
from armwright.arrays import Array, ArrayLike, Flags
from armwright.compiled.quantities import quantity_kernel
from armwright.errors import CompilerWarning
from armwright.tracing.image import CAN_BE_LINKED, can_be_placed
from armwright.tracing.kernel import Kernel

_Method = TypeVar("_Method", bound=Callable[..., Any])

# Arms whose functions are kept, those asked for last.
_MAX_ARMS = 64
_COMPILED: OrderedDict[object, CompiledArm] = OrderedDict()
_COMPILED_LOCK = RLock()
# A process that is forked while another thread holds it would wait for ever.
os.register_at_fork(
    before=_COMPILED_LOCK.acquire, after_in_parent=_COMPILED_LOCK.release, after_in_child=_COMPILED_LOCK.release
)


def compile_arm(arm: Arm, *, device: str | None = None, quickly: bool = False) -> CompiledArm:
    """Return an arm whose quantities are compiled, each when it is first asked for.

    A first compilation takes hundredths to tenths of a second and is kept on disk: see
    ``armwright.files.store.cache_folder``. Of the arms asked for last the compiled ones are kept, so asking again costs
    nothing. Threads may ask at the same time.

    Args:
        arm: the arm, with n joints.
        device: ``cuda`` or ``cuda:1``, a device that computes the quantities (extra ``cuda``); the processor when None.
        quickly: whether it is compiled for this processor with the least effort, in a third of the time: for a short
            program, which computes little. The results have the same bits; what was compiled before stays as fast.

    Raises:
        KindError: ``arm`` is no arm.
        InvalidValueError: a device is called otherwise.
        MissingExtraError: the libraries of CUDA are not installed.
        DeviceError: there is no such device.
    """
    key = (_bits(known_arm(arm)), device, quickly)
    with _COMPILED_LOCK:
        compiled = _COMPILED.pop(key, None) or _new(arm, device, quickly=quickly)
        _COMPILED[key] = compiled
        if len(_COMPILED) > _MAX_ARMS:
            _COMPILED.popitem(last=False)
    return compiled


def can_be_compiled() -> bool:
    """Whether the system allows memory for compiled code, as far as that is known before."""
    return not CAN_BE_LINKED or can_be_placed()


def planning_arm(arm: Arm) -> CompiledArm | Arm:
    """Return what to plan a short program of an arm with: the arm compiled quickly, or itself where nothing can be.

    Warns:
        CompilerWarning: the system refuses memory for compiled code.
    """
    if can_be_compiled():
        return compile_arm(arm, quickly=True)
    warnings.warn(
        "this system refuses memory that can be executed (execmem of SELinux), so equations are not compiled; planning "
        "takes ten times as long",
        CompilerWarning,
        stacklevel=2,
    )
    return arm


def _new(arm: Arm, device: str | None, *, quickly: bool) -> CompiledArm:
    if device is None:
        return CompiledArm(arm=arm, quickly=quickly)
    from armwright.compiled.device_arm import DeviceArm, device_number  # noqa: PLC0415 - only where it is asked for
    from armwright.tracing.cuda_device import CudaDevice  # noqa: PLC0415

    return DeviceArm(arm=arm, device=CudaDevice(device_number(device)))


# What an arm looks like is in none of its equations.
_IN_NO_EQUATION = frozenset({"solids", "base_solids", "collisions"})


def _bits(value: object) -> object:
    """Return what two values have in common if no bit of them differs: arms that are equal may differ in -0.0."""
    if isinstance(value, np.ndarray):
        return value.shape, value.tobytes()
    if isinstance(value, tuple):
        return tuple(map(_bits, value))
    if attrs.has(kind := type(value)):
        names = (field.name for field in attrs.fields(kind) if field.name not in _IN_NO_EQUATION)
        # The code of an arm whose drives are not coupled is known from before there were couplings.
        values = ((name, getattr(value, name)) for name in names)
        return kind.__qualname__, *(_bits(x) for name, x in values if name != "coupling" or x is not None)
    return value.hex() if isinstance(value, float) else value


class _KernelMethod:
    """A method that is, for each arm, the function of a kernel: a call goes there without a detour."""

    def __init__(self, method: Callable[..., Any]) -> None:
        self._method = method

    def __get__(self, compiled: CompiledArm | None, _owner: type) -> Callable[..., Any]:
        method, name = self._method, self._method.__name__
        if compiled is None:
            return wraps(method)(lambda arm, *inputs, **options: getattr(arm, name)(*inputs, **options))
        function = compiled._function(name, method.__doc__ or "")  # noqa: SLF001 - where it is computed
        # Found there before this descriptor from now on.
        compiled.__dict__[name] = function
        return function


def _kernel_method(method: _Method) -> _Method:
    """Let a method of ``CompiledArm`` be the function of the kernel of its name."""
    return cast("_Method", _KernelMethod(method))


@attrs.frozen(kw_only=True, slots=False)
class CompiledArm:
    """Functions of one arm, as fast as the processor goes.

    They are called like the plain functions of the same names, without the arm, and give the same numbers but for
    rounding. A configuration has the same bits alone, in any batch and on any number of threads. Positions that seem
    like degrees get the same warning.

    Every function takes, by name, ``threads``, how many cores to use (all when left out), and ``out``, the arrays to
    fill: writable, in C order, of the shape of the result. Every function raises

    - KindError: an input is something else than real numbers.
    - ShapeError: a last axis, the leading axes or ``out`` do not fit.
    - InvalidValueError: a number is NaN, infinite or beyond 1e100, an angle is beyond 1e12, or ``threads`` is below 1.

    Attributes:
        arm: the arm, with n joints.
        quickly: whether they are compiled with the least effort.
    """

    arm: Arm
    quickly: bool = False
    _kernels: dict[str, Kernel] = attrs.field(factory=dict, init=False, eq=False, repr=False)

    @_kernel_method
    def forward(self, q: ArrayLike, *, threads: int | None = None, out: Array | None = None) -> Array:
        """Return the tool pose in the base frame.

        Args:
            q: (..., n) joint positions [rad] or [m].
            threads: how many cores to use; all when None.
            out: (..., 4, 4) to fill.

        Returns:
            X_BT: (..., 4, 4) homogeneous poses, translations in [m].
        """

    @_kernel_method
    def link_poses(self, q: ArrayLike, *, threads: int | None = None, out: Array | None = None) -> Array:
        """Return the poses of all frames in the base frame.

        Args:
            q: (..., n) joint positions [rad] or [m].
            threads: how many cores to use; all when None.
            out: (..., n + 2, 4, 4) to fill.

        Returns:
            (..., n + 2, 4, 4) homogeneous poses of frames 0 to n and of the tool, translations in [m].
        """

    @_kernel_method
    def jacobian(self, q: ArrayLike, *, threads: int | None = None, out: Array | None = None) -> Array:
        """Return the Jacobian of the tool point along the axes of the base.

        Args:
            q: (..., n) joint positions [rad] or [m].
            threads: how many cores to use; all when None.
            out: (..., 6, n) to fill.

        Returns:
            J: (..., 6, n), linear rows first: velocity [m/s] and angular velocity [rad/s] per joint velocity.
        """

    @_kernel_method
    def tool_jacobian(self, q: ArrayLike, *, threads: int | None = None, out: Array | None = None) -> Array:
        """Return the Jacobian of the tool point along the axes of the tool.

        Args:
            q: (..., n) joint positions [rad] or [m].
            threads: how many cores to use; all when None.
            out: (..., 6, n) to fill.

        Returns:
            J: (..., 6, n), linear rows first: velocity [m/s] and angular velocity [rad/s] per joint velocity.
        """

    @_kernel_method
    def pose_and_jacobian(
        self, q: ArrayLike, *, threads: int | None = None, out: tuple[Array, Array] | None = None
    ) -> tuple[Array, Array]:
        """Return the tool pose and the Jacobian together, as ``forward`` and ``jacobian`` do.

        Args:
            q: (..., n) joint positions [rad] or [m].
            threads: how many cores to use; all when None.
            out: (..., 4, 4) and (..., 6, n) to fill.

        Returns:
            X_BT: (..., 4, 4) homogeneous poses, translations in [m].
            J: (..., 6, n) Jacobian of the tool point along the axes of the base.
        """

    @_kernel_method
    def inverse_branches(
        self, pose: ArrayLike, near: ArrayLike, *, threads: int | None = None, out: tuple[Array, Flags] | None = None
    ) -> tuple[Array, Flags]:
        """Return all k IK branches of poses, unjudged, as ``kinematics.inverse_branches`` does: eight of six joints.

        Args:
            pose: (..., 4, 4) tool poses in the base frame.
            near: (..., n) joint positions [rad] or [m]; angles come back within pi of it, and a free joint
                takes its value from it.
            threads: how many cores to use; all when None.
            out: (..., k, n) and (..., k) to fill.

        Returns:
            q: (..., k, n) joint positions [rad] or [m].
            singular: (..., k) whether a joint is free there.

        Raises:
            UnsupportedArmError: the arm has no closed form.
        """

    @_kernel_method
    def inverse_dynamics(
        self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, *, threads: int | None = None, out: Array | None = None
    ) -> Array:
        """Return the efforts that a motion takes, drives included.

        Args:
            q: (..., n) joint positions [rad] or [m].
            qd: (..., n) joint velocities [rad/s] or [m/s].
            qdd: (..., n) joint accelerations [rad/s²] or [m/s²].
            threads: how many cores to use; all when None.
            out: (..., n) to fill.

        Returns:
            tau: (..., n) efforts [N m] or [N].

        Raises:
            UnsupportedArmError: nothing is known of the mass of some link.
        """

    @_kernel_method
    def inverse_dynamics_with_wrench(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        qdd: ArrayLike,
        wrench: ArrayLike,
        *,
        threads: int | None = None,
        out: Array | None = None,
    ) -> Array:
        """Return the efforts that a motion takes while the surroundings push at the tool.

        Args:
            q: (..., n) joint positions [rad] or [m].
            qd: (..., n) joint velocities [rad/s] or [m/s].
            qdd: (..., n) joint accelerations [rad/s²] or [m/s²].
            wrench: (..., 6) force [N] and moment [N m] on the tool along the axes of the base.
            threads: how many cores to use; all when None.
            out: (..., n) to fill.

        Returns:
            tau: (..., n) efforts [N m] or [N].

        Raises:
            UnsupportedArmError: nothing is known of the mass of some link.
        """

    @_kernel_method
    def forward_dynamics(
        self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike, *, threads: int | None = None, out: Array | None = None
    ) -> Array:
        """Return the accelerations that efforts of the drives cause.

        Args:
            q: (..., n) joint positions [rad] or [m].
            qd: (..., n) joint velocities [rad/s] or [m/s].
            tau: (..., n) efforts [N m] or [N].
            threads: how many cores to use; all when None.
            out: (..., n) to fill.

        Returns:
            qdd: (..., n) joint accelerations [rad/s²] or [m/s²].

        Raises:
            UnsupportedArmError: some joint moves nothing that resists an acceleration, or nothing is known of the mass
                of some link.
        """

    @_kernel_method
    def mass_matrix(self, q: ArrayLike, *, threads: int | None = None, out: Array | None = None) -> Array:
        """Return the mass matrix, rotor inertia included.

        Args:
            q: (..., n) joint positions [rad] or [m].
            threads: how many cores to use; all when None.
            out: (..., n, n) to fill.

        Returns:
            M: (..., n, n) [kg m²], [kg m] or [kg].

        Raises:
            UnsupportedArmError: nothing is known of the mass of some link.
        """

    @_kernel_method
    def mass_and_bias(
        self, q: ArrayLike, qd: ArrayLike, *, threads: int | None = None, out: tuple[Array, Array] | None = None
    ) -> tuple[Array, Array]:
        """Return the mass matrix, and the efforts of velocities, gravity and springs: tau = M qdd + bias + friction.

        Args:
            q: (..., n) joint positions [rad] or [m].
            qd: (..., n) joint velocities [rad/s] or [m/s].
            threads: how many cores to use; all when None.
            out: (..., n, n) and (..., n) to fill.

        Returns:
            M: (..., n, n) mass matrix, rotor inertia included [kg m²], [kg m] or [kg].
            bias: (..., n) efforts [N m] or [N].

        Raises:
            UnsupportedArmError: nothing is known of the mass of some link.
        """

    @_kernel_method
    def bias(self, q: ArrayLike, qd: ArrayLike, *, threads: int | None = None, out: Array | None = None) -> Array:
        """Return the efforts that velocities, gravity and springs take, friction left out.

        Args:
            q: (..., n) joint positions [rad] or [m].
            qd: (..., n) joint velocities [rad/s] or [m/s].
            threads: how many cores to use; all when None.
            out: (..., n) to fill.

        Returns:
            (..., n) efforts [N m] or [N].

        Raises:
            UnsupportedArmError: nothing is known of the mass of some link.
        """

    @_kernel_method
    def gravity_efforts(self, q: ArrayLike, *, threads: int | None = None, out: Array | None = None) -> Array:
        """Return the efforts that hold the arm against gravity and the springs at its joints.

        Args:
            q: (..., n) joint positions [rad] or [m].
            threads: how many cores to use; all when None.
            out: (..., n) to fill.

        Returns:
            G: (..., n) efforts [N m] or [N].

        Raises:
            UnsupportedArmError: nothing is known of the mass of some link.
        """

    @_kernel_method
    def coriolis_efforts(
        self, q: ArrayLike, qd: ArrayLike, *, threads: int | None = None, out: Array | None = None
    ) -> Array:
        """Return the centrifugal and Coriolis efforts.

        Args:
            q: (..., n) joint positions [rad] or [m].
            qd: (..., n) joint velocities [rad/s] or [m/s].
            threads: how many cores to use; all when None.
            out: (..., n) to fill.

        Returns:
            H: (..., n) efforts [N m] or [N].

        Raises:
            UnsupportedArmError: nothing is known of the mass of some link.
        """

    @_kernel_method
    def kinetic_energy(
        self, q: ArrayLike, qd: ArrayLike, *, threads: int | None = None, out: Array | None = None
    ) -> Array:
        """Return the kinetic energy, that of the rotors included.

        Args:
            q: (..., n) joint positions [rad] or [m].
            qd: (..., n) joint velocities [rad/s] or [m/s].
            threads: how many cores to use; all when None.
            out: (...) to fill.

        Returns:
            (...) energy [J].

        Raises:
            UnsupportedArmError: nothing is known of the mass of some link.
        """

    @_kernel_method
    def potential_energy(self, q: ArrayLike, *, threads: int | None = None, out: Array | None = None) -> Array:
        """Return the potential energy of gravity and springs; that of a mass at the base origin is 0.

        Args:
            q: (..., n) joint positions [rad] or [m].
            threads: how many cores to use; all when None.
            out: (...) to fill.

        Returns:
            (...) energy [J].

        Raises:
            UnsupportedArmError: nothing is known of the mass of some link.
        """

    @_kernel_method
    def inverse_dynamics_derivatives(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        qdd: ArrayLike,
        *,
        threads: int | None = None,
        out: tuple[Array, Array, Array] | None = None,
    ) -> tuple[Array, Array, Array]:
        """Return the derivatives of the efforts of a motion, drives included.

        Args:
            q: (..., n) joint positions [rad] or [m].
            qd: (..., n) joint velocities [rad/s] or [m/s]. Dry friction has the derivative 0, at rest too.
            qdd: (..., n) joint accelerations [rad/s²] or [m/s²].
            threads: how many cores to use; all when None.
            out: three arrays (..., n, n) to fill.

        Returns:
            dq: (..., n, n) derivative of effort i by position j.
            dqd: (..., n, n) derivative of effort i by velocity j.
            M: (..., n, n) mass matrix, rotor inertia included: derivative of effort i by acceleration j.

        Raises:
            UnsupportedArmError: nothing is known of the mass of some link.
        """

    @_kernel_method
    def forward_dynamics_derivatives(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        tau: ArrayLike,
        *,
        threads: int | None = None,
        out: tuple[Array, Array, Array] | None = None,
    ) -> tuple[Array, Array, Array]:
        """Return the derivatives of the accelerations that efforts of the drives cause.

        Args:
            q: (..., n) joint positions [rad] or [m].
            qd: (..., n) joint velocities [rad/s] or [m/s]. Dry friction has the derivative 0, at rest too.
            tau: (..., n) efforts [N m] or [N].
            threads: how many cores to use; all when None.
            out: three arrays (..., n, n) to fill.

        Returns:
            dq: (..., n, n) derivative of acceleration i by position j.
            dqd: (..., n, n) derivative of acceleration i by velocity j.
            dtau: (..., n, n) derivative of acceleration i by effort j: the inverse of the mass matrix.

        Raises:
            UnsupportedArmError: some joint moves nothing that resists an acceleration, or nothing is known of the mass
                of some link.
        """

    @_kernel_method
    def regressor(
        self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, *, threads: int | None = None, out: Array | None = None
    ) -> Array:
        """Return the regressor Y of a motion: tau = Y theta, with the parameters of ``dynamics.dynamic_parameters``.

        Args:
            q: (..., n) joint positions [rad] or [m].
            qd: (..., n) joint velocities [rad/s] or [m/s].
            qdd: (..., n) joint accelerations [rad/s²] or [m/s²].
            threads: how many cores to use; all when None.
            out: (..., n, p) to fill.

        Returns:
            Y: (..., n, p): ten columns per link, for its mass, first moments and inertia tensor about the origin of its
            frame; behind them four per joint, for rotor inertia, viscous friction, and dry friction in and against the
            direction of q, and those of other friction and of springs where the arm has them.

        Raises:
            UnsupportedArmError: nothing is known of the mass of some link.
        """

    @_kernel_method
    def base_regressor(
        self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, *, threads: int | None = None, out: Array | None = None
    ) -> Array:
        """Return the independent columns of the regressor: tau = Y pi, pi those of ``dynamics.base_parameters``.

        Args:
            q: (..., n) joint positions [rad] or [m].
            qd: (..., n) joint velocities [rad/s] or [m/s].
            qdd: (..., n) joint accelerations [rad/s²] or [m/s²].
            threads: how many cores to use; all when None.
            out: (..., n, b) to fill.

        Returns:
            Y: (..., n, b) one column for each of the b base parameters.

        Raises:
            UnsupportedArmError: nothing is known of the mass of some link.
        """

    def _function(self, name: str, doc: str) -> Callable[..., Any]:
        """Return the function of a quantity."""
        return self.kernel(name).function(name, doc, self.__reduce__())

    def kernel(self, quantity: str) -> Kernel:
        """Return the kernel behind a function, whose part for one configuration other compiled code can call.

        Args:
            quantity: name of the function.

        Raises:
            UnknownNameError: no such function.
            UnsupportedArmError: the arm has no such function.
        """
        # Of two threads each may make one: they are alike, and compile once between them.
        if quantity not in self._kernels:
            self._kernels[quantity] = quantity_kernel(self.arm, quantity, self._origin, quickly=self.quickly)
        return self._kernels[quantity]

    @cached_property
    def _origin(self) -> str:
        return repr(_bits(self.arm))

    def __reduce__(self) -> tuple[Callable[[Arm], CompiledArm], tuple[Arm]]:
        """Let another process compile for itself: it finds the kernels on disk."""
        return partial(compile_arm, quickly=self.quickly), (self.arm,)
