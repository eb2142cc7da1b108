"""The model of identification: the efforts of an arm as linear functions of its parameters, column by column."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property, lru_cache, partial
from typing import TypeAlias

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arm.drive import Motor
from armwright.arm.model import Arm, Joint, Link
from armwright.arrays import LARGEST, Array, ArrayLike, exact_shape, read_only
from armwright.compiled.arm import compile_arm
from armwright.dynamics.drives import SLOW
from armwright.dynamics.identification import independent_columns, link_order
from armwright.dynamics.regressors import OF_LINK, regressor
from armwright.errors import InvalidValueError, one_of

# What a drive may contribute beside its link, in the order of their columns.
TERMS = ("rotor", "viscous", "coulomb", "forward", "backward", "offset", "cube_root", "stribeck", "stiffness")
# What the motor of a coupled joint contributes by its own speed, beside what joints have by theirs.
_COUPLED_TERMS = ("rotor", "viscous", "coulomb")
LINK_NAMES = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
# Speed at which 1/e of Stribeck friction is left, where nothing is known of it [rad/s, m/s].
STRIBECK_SPEED = 0.1
# States that show which columns are independent.
_STATES = 200

Indices: TypeAlias = npt.NDArray[np.intp]


def _terms(value: Iterable[str]) -> tuple[str, ...]:
    return tuple(value)


@attrs.frozen(kw_only=True, eq=False, slots=False)
class DynamicModel:
    """How the efforts of an arm depend on its unknown parameters: tau = Y(q, qd, qdd) theta.

    The parameters are, for each link, those of ``dynamics.dynamic_parameters`` in the frame of the link; then for each
    joint its terms; then for each motor that is coupled with another joint its own rotor inertia and friction. Efforts
    are those at the joints: of motors with efforts t, behind a coupling C, they are transpose(C) t.

    Attributes:
        arm: the arm; its masses and drives are not used.
        terms: of each joint beside its link, of ``TERMS``. ``coulomb`` is alike both ways, ``forward`` and
            ``backward`` are not; the pull of a spring at position 0 is in ``offset``.
        stribeck_speed: (n,) speed at which 1/e of the Stribeck friction is left [rad/s] or [m/s].
        coupling: (n, n) positions of the motors, in units of the joints, by those of the joints: that of the arm, if
            left out, the identity where every motor moves its own joint alone.
    """

    arm: Arm
    terms: tuple[str, ...] = attrs.field(default=("rotor", "viscous", "coulomb", "offset"), converter=_terms)
    stribeck_speed: Array = attrs.field(
        default=attrs.Factory(lambda self: np.full(self.arm.n, STRIBECK_SPEED), takes_self=True), converter=read_only
    )
    coupling: Array = attrs.field(
        default=attrs.Factory(lambda self: _motors_by_joints(self.arm), takes_self=True), converter=read_only
    )

    def __attrs_post_init__(self) -> None:
        """Refuse unknown or repeated terms, speeds and couplings of another shape, and a coupling without inverse."""
        n = self.arm.n
        for term in self.terms:
            one_of("term of a drive", term, TERMS)
        if len(set(self.terms)) < len(self.terms):
            raise InvalidValueError(f"terms: expected every term once, got {', '.join(self.terms)}")
        speeds = exact_shape(self.stribeck_speed, (n,), "stribeck_speed", LARGEST)
        if not (speeds > 0).all():
            raise InvalidValueError(f"stribeck_speed: expected speeds above 0, got {speeds.tolist()}")
        coupling = exact_shape(self.coupling, (n, n), "coupling", LARGEST)
        if np.linalg.matrix_rank(coupling) < n:
            raise InvalidValueError(f"coupling: expected a matrix with an inverse, got {coupling.tolist()}")

    @property
    def coupled_motors(self) -> tuple[int, ...]:
        """The motors, from 0, that move with more joints than their own."""
        off_diagonal = self.coupling - np.diag(self.coupling.diagonal())
        return tuple(np.flatnonzero(off_diagonal.any(axis=1)).tolist())

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the p parameters: ``m1``, ``mx1``, ``Izz2``, ``rotor1``, ``viscous1``, ``coupled_rotor6``."""
        n, coupled = self.arm.n, [i for i in _COUPLED_TERMS if i in self.terms]
        return (
            *(f"{name}{i}" for i in range(1, n + 1) for name in LINK_NAMES),
            *(f"{term}{i}" for i in range(1, n + 1) for term in self.terms),
            *(f"coupled_{term}{i + 1}" for i in self.coupled_motors for term in coupled),
        )

    def columns(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Array:
        """Return the regressor Y.

        Args:
            q: (k, n) joint positions [rad] or [m].
            qd: (k, n) joint velocities.
            qdd: (k, n) joint accelerations.

        Returns:
            (k, n, p), a column for each of the parameters of ``names``.
        """
        return self._columns(q, qd, qdd, link_columns=self._link_columns)

    @cached_property
    def _link_columns(self) -> Callable[..., Array]:
        return compile_arm(_skeleton(self.arm)).regressor

    def _columns(self, *motion: ArrayLike, link_columns: Callable[..., Array]) -> Array:
        q, qd, qdd = (np.asarray(x, dtype=np.float64) for x in motion)
        n, of_links = self.arm.n, OF_LINK * self.arm.n
        Y = np.zeros((len(q), n, len(self.names)))
        Y[:, :, :of_links] = link_columns(q, qd, qdd)[:, :, :of_links]
        own = Y[:, :, of_links : of_links + n * len(self.terms)].reshape(len(q), n, n, len(self.terms))
        joints = np.arange(n)
        for k, term in enumerate(self.terms):
            own[:, joints, joints, k] = self._effect(term, q, qd, qdd)
        Y[:, :, of_links : of_links + n * len(self.terms)] = own.reshape(len(q), n, -1)
        column = of_links + n * len(self.terms)
        for motor in self.coupled_motors:
            row = self.coupling[motor]
            for term in (i for i in _COUPLED_TERMS if i in self.terms):
                Y[:, :, column] = self._effect(term, q @ row, qd @ row, qdd @ row)[:, None] * row
                column += 1
        return Y

    def joint_efforts(self, motor_efforts: Array) -> Array:
        """Return the efforts (..., n) at the joints by those of the motors, in units of the joints."""
        return np.asarray(motor_efforts @ self.coupling)

    def _effect(self, term: str, q: Array, qd: Array, qdd: Array) -> Array:
        """Return the effort for a unit of a term, of all joints (k, n) or of one motor (k,)."""
        effects: dict[str, Callable[[], Array]] = {
            "rotor": lambda: qdd,
            "viscous": lambda: qd,
            "coulomb": lambda: np.sign(qd),
            "forward": lambda: np.asarray(qd > 0, dtype=np.float64),
            "backward": lambda: -np.asarray(qd < 0, dtype=np.float64),
            "offset": lambda: np.ones_like(qd),
            "cube_root": lambda: np.where(np.abs(qd) < SLOW, qd * SLOW ** (-2 / 3), np.cbrt(qd)),
            "stribeck": lambda: np.sign(qd) * np.exp(-((qd / self.stribeck_speed) ** 2)),
            "stiffness": lambda: q,
        }
        return effects[term]()

    @cached_property
    def base(self) -> BaseParameters:
        """The base parameters, by the geometry, gravity and the terms."""
        n, of_links = self.arm.n, OF_LINK * self.arm.n
        rng = np.random.default_rng(0)
        q, qd, qdd = rng.uniform(-3, 3, size=(3, _STATES, n))
        if "stribeck" in self.terms:
            # Stribeck friction shows at low speeds only.
            qd[::2] *= self.stribeck_speed
        Y = self._columns(q, qd, qdd, link_columns=partial(_few_link_columns, self.arm)).reshape(-1, len(self.names))
        columns, combinations = independent_columns(Y, [*link_order(n), *range(of_links, len(self.names))])
        return BaseParameters(
            columns=columns, names=tuple(self.names[k] for k in columns), combinations=read_only(combinations)
        )

    def base_columns(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Array:
        """Return the independent columns of the regressor (k, n, b): see ``columns``."""
        return self.columns(q, qd, qdd)[:, :, list(self.base.columns)]


@attrs.frozen(kw_only=True, eq=False)
class BaseParameters:
    """The parameters that motions can identify.

    Attributes:
        columns: (b,) which columns of the regressor are independent.
        names: of the parameter of each of these columns; others are combined with it.
        combinations: (b, p) base parameters by all parameters.
    """

    columns: tuple[int, ...]
    names: tuple[str, ...]
    combinations: Array


def _motors_by_joints(arm: Arm) -> Array:
    """Return the positions of the motors by those of the joints, (n, n), as the arm has them."""
    return np.eye(arm.n) if arm.coupling is None else arm.coupling.inverse


def _few_link_columns(arm: Arm, q: Array, qd: Array, qdd: Array) -> Array:
    """Return the regressor at a few states, for which compiling it would take longer."""
    return _regressor_at(_skeleton(arm), q.tobytes(), qd.tobytes(), qdd.tobytes())


@lru_cache(maxsize=8)
def _regressor_at(arm: Arm, *motion: bytes) -> Array:
    """Return the regressor of an arm, which models of it with other terms ask for at the same states."""
    return read_only(regressor(arm, *(np.frombuffer(values).reshape(-1, arm.n) for values in motion)))


def _skeleton(arm: Arm) -> Arm:
    """Return an arm of the same geometry without masses, drives and springs: they are what is unknown."""
    joints = [
        Joint(kind=j.kind, theta=j.theta, d=j.d, a=j.a, alpha=j.alpha, fixed=j.fixed, limits=j.limits)
        for j in arm.joints
    ]
    return attrs.evolve(arm, joints=joints, links=(Link(),) * arm.n, motors=(Motor(),) * arm.n)
