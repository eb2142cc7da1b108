"""Simulation of an arm whose gears are springs: motors on one side, links on the other.

    M(q) q'' + c(q, q') + g(q) = K (theta - q) + D (theta' - q')
    B theta'' + friction(theta') + K (theta - q) + D (theta' - q') = tau

Motors move as they are told, as those of a stiff servo do, or as their efforts make them. The link of a rigid gear
moves as its motor.

Source:
    Spong (1987), "Modeling and control of elastic joint robots".
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import single_configuration
from armwright.arrays import LARGEST_ANGLE, Array, ArrayLike, one_per_joint, positive, read_only
from armwright.compiled.arm import can_be_compiled, compile_arm
from armwright.dynamics.accelerations import without_drives
from armwright.dynamics.drives import friction_law
from armwright.dynamics.energy import kinetic_energy, potential_energy
from armwright.dynamics.flexible_joints import flexible_gears, modes
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.errors import InvalidValueError, UnsupportedArmError
from armwright.files.result_table import ResultTable
from armwright.kinematics.forward_kinematics import forward
from armwright.simulation.controllers import Controller, Reference, returning
from armwright.simulation.integrators import Adaptive, Integrator
from armwright.simulation.result import Status
from armwright.simulation.sample_times import check_samples, sample_times

# More samples than this would exhaust the memory.
_MAX_SAMPLES = 10**6
# More periods of the fastest vibration, or times of its decay, would take hours.
_MOST_PERIODS = 20_000
# Part of a period that rounding may shift a sample by.
_CRUMB = 1e-9


@attrs.frozen(kw_only=True, eq=False)
class FlexibleSimulation:
    """A simulated motion of n joints with flexible gears at m moments.

    Attributes:
        arm: the simulated arm.
        status: how it ended.
        t: (m,) times [s].
        q: (m, n) positions of the links [rad] or [m].
        qd: (m, n) their speeds.
        qdd: (m, n) their accelerations.
        motors: (m, n) positions of the motors, behind their gears.
        motor_speeds: (m, n) speeds of the motors.
        gears: (m, n) efforts that flexible gears transmit to the links; 0 of rigid ones [N m] or [N].
        tau: (m, n) efforts of the motors, those that they need where their positions are given.
        kinetic: (m,) energy of links and rotors [J].
        potential: (m,) energy in the field of gravity, in springs and gears [J].
        work: (m,) what the motors have put in since the start [J].
        heat: (m,) what friction and damping have taken out [J].
    """

    arm: Arm
    status: Status
    t: Array = attrs.field(converter=read_only)
    q: Array = attrs.field(converter=read_only)
    qd: Array = attrs.field(converter=read_only)
    qdd: Array = attrs.field(converter=read_only)
    motors: Array = attrs.field(converter=read_only)
    motor_speeds: Array = attrs.field(converter=read_only)
    gears: Array = attrs.field(converter=read_only)
    tau: Array = attrs.field(converter=read_only)
    kinetic: Array = attrs.field(converter=read_only)
    potential: Array = attrs.field(converter=read_only)
    work: Array = attrs.field(converter=read_only)
    heat: Array = attrs.field(converter=read_only)

    @property
    def energy_imbalance(self) -> Array:
        """Energy that the ledger cannot explain, (m,) [J]: the error of the integration."""
        energy = self.kinetic + self.potential
        return np.asarray(energy - energy[0] - self.work + self.heat)

    @property
    def tool_deflection(self) -> Array:
        """Distance of the tool from where it would be on rigid gears, (m,) [m]."""
        return np.asarray(
            np.linalg.norm((forward(self.arm, self.q) - forward(self.arm, self.motors))[:, :3, 3], axis=1)
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """How and when the simulation ended."""
        return (f"{self.status.name.lower()} after {self.t[-1]:.3f} s, with flexible gears and without stops",)

    def _summary(self) -> dict[str, float]:
        deflection = self.tool_deflection
        return {
            "largest_deflection_m": float(deflection.max()),
            "deflection_at_end_m": float(deflection[-1]),
            "work_of_motors": float(self.work[-1]),
            "heat": float(self.heat[-1]),
            "imbalance": float(np.abs(self.energy_imbalance).max()),
        }

    def as_data(self) -> dict[str, Any]:
        """Return the status, the end, deflections and the energy balance as plain data in SI units."""
        return {"status": self.status.name.lower(), "t": float(self.t[-1]), **self._summary()}

    def tables(self) -> Iterator[ResultTable]:
        """Yield the tables of the joints [deg, mm], and of deflection and energy."""
        rows = []
        for i, joint in enumerate(self.arm.joints):
            lag = (self.q[:, i] - self.motors[:, i]) / joint.units.scale
            texts = (f"{x / joint.units.scale:z.3f}" for x in (self.q[0, i], self.q[-1, i]))
            effort = f"{np.abs(self.gears[:, i]).max():.4g}"
            rows.append((self.arm.joint_label(i), joint.units.display, *texts, f"{np.abs(lag).max():.4f}", effort))
        heads = ("joint", "unit", "start", "end", "largest lag of the link", "gear, N m or N")
        yield ResultTable(title="", heads=heads, rows=rows, numbers=(2, 3, 4, 5))
        facts = self._summary()
        yield ResultTable(
            title="",
            heads=("quantity", "value"),
            rows=(
                ("largest deflection of the tool, mm", f"{facts['largest_deflection_m'] * 1e3:.4f}"),
                ("deflection at the end, mm", f"{facts['deflection_at_end_m'] * 1e3:.4f}"),
                ("work of the motors, J", f"{facts['work_of_motors']:z.6g}"),
                ("heat of friction and gears, J", f"{facts['heat']:z.6g}"),
                ("imbalance of energy, J", f"{facts['imbalance']:z.3g}"),
            ),
            numbers=(1,),
        )


def simulate_flexible(
    arm: Arm,
    q: ArrayLike,
    qd: ArrayLike | None = None,
    *,
    duration: float,
    motors: Reference | None = None,
    controller: Controller | None = None,
    theta: ArrayLike | None = None,
    integrator: Integrator = Adaptive(),  # noqa: B008 - immutable
    period: float = 1e-3,
) -> FlexibleSimulation:
    """Simulate the motion of an arm on the springs of its gears.

    Args:
        arm: the arm, with n joints, some of whose gears are flexible.
        q: (n,) positions of the links at the start [rad] or [m].
        qd: (n,) their speeds, which motors that are driven by efforts share; at rest when left out.
        duration: how long [s].
        motors: positions of the motors at a time, and derivatives of order 1 and 2; a trajectory is one. A link with a
            rigid gear starts where its motor does.
        controller: efforts of the motors by time, positions and speeds of the motors, within the limits of the
            joints; off when both are left out.
        theta: (n,) positions of the motors at the start where efforts drive them; ``q``, with relaxed gears, when left
            out.
        integrator: ``Adaptive`` with its tolerances, or ``Gill`` with its step.
        period: time between two samples of the result [s].

    Returns:
        The motion. When something goes wrong meanwhile, its status says what, and it ends there. Position limits are no
        stops.

    Raises:
        ShapeError: arrays or what the functions return are not n long.
        InvalidValueError: both motors and controller are given, a time is not above 0, the result would have too many
            samples, or a gear is so stiff that it would take too many steps.
        UnsupportedArmError: no gear is flexible, drives are coupled, the mass of a link is unknown, or motors with dry
            friction or without inertia should be driven by efforts.
    """
    flexible_gears(arm)
    start = single_configuration(arm, q)
    speed = np.zeros(arm.n) if qd is None else one_per_joint(qd, arm.n, "qd")
    duration, period = positive(duration, "duration", "s"), positive(period, "period", "s")
    check_samples(duration, period, _MAX_SAMPLES)
    _check_pace(arm, start, duration, driven=motors is None)
    if motors is not None:
        if controller is not None or theta is not None:
            raise InvalidValueError("motors: their positions are given; expected neither efforts nor a start of theirs")
        plant: _Plant = _Guided(arm, motors)
        y = np.concatenate([start, speed, np.zeros(2)])
    else:
        _check_driven(arm)
        first = start if theta is None else one_per_joint(theta, arm.n, "theta")
        plant = _Driven(arm, controller or (lambda _t, _q, _qd: np.zeros(arm.n)))
        y = np.concatenate([start, speed, first, speed, np.zeros(2)])
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        return _run(plant, y, duration, period, integrator)


def _check_pace(arm: Arm, q: Array, duration: float, *, driven: bool) -> None:
    """Refuse gears that are so stiff, or so damped, that the steps of an integrator would be too many."""
    found = modes(arm, q)
    pace = float((found.frequencies * np.maximum(1.0, 2 * found.damping)).max())
    inertia = arm.motor_values("inertia")
    if driven and (moved := flexible_gears(arm) & (inertia > 0)).any():
        own = np.sqrt(arm.motor_values("stiffness")[moved] / inertia[moved]) / (2 * np.pi)
        pace = max(pace, float(own.max()), float((arm.motor_values("damping")[moved] / inertia[moved]).max()))
    if not pace * duration <= _MOST_PERIODS:
        raise InvalidValueError(
            f"arm '{arm.name}': a gear vibrates or creeps at {pace:.3g} Hz, {pace * duration:.3g} times in "
            f"{duration:g} s; expected at most {_MOST_PERIODS}: leave such a gear rigid, or simulate less time"
        )


def _check_driven(arm: Arm) -> None:
    """Refuse motors whose motion does not follow from efforts by a smooth equation."""
    dry = np.any([arm.motor_values(name) > 0 for name in ("coulomb_forward", "coulomb_backward", "stribeck")], axis=0)
    if dry.any():
        raise UnsupportedArmError(
            f"arm '{arm.name}': the motor of {arm.joint_label(int(dry.argmax()))} has dry friction, at which it "
            "sticks; with flexible gears, give the positions of the motors, hold them (--drives held), or omit the "
            "friction"
        )
    light = flexible_gears(arm) & (arm.motor_values("inertia") == 0)
    if light.any():
        raise UnsupportedArmError(
            f"arm '{arm.name}': the motor of {arm.joint_label(int(light.argmax()))} has no inertia, so that efforts do "
            "not tell how it moves; with flexible gears, give the positions of the motors, hold them (--drives held), "
            "or specify its inertia"
        )


class _Moment(NamedTuple):
    """Everything at one moment."""

    q: Array
    qd: Array
    qdd: Array
    theta: Array
    thetad: Array
    thetadd: Array
    gears: Array
    tau: Array
    heat: float


class _Plant(ABC):
    """The equations of an arm whose state y begins with q and q', and ends with work and heat."""

    def __init__(self, arm: Arm) -> None:
        self.arm, self.links = arm, without_drives(arm)
        self.flexible = flexible_gears(arm)
        self.rigid = ~self.flexible
        self._K = np.where(self.flexible, arm.motor_values("stiffness"), 0.0)
        self._D = np.where(self.flexible, arm.motor_values("damping"), 0.0)
        self.B, self.law = arm.motor_values("inertia"), friction_law(arm)
        self.mass_and_bias: Callable[[Array, Array], tuple[Array, Array]] = partial(_mass_and_bias, self.links)
        if can_be_compiled():
            self.mass_and_bias = compile_arm(self.links, quickly=True).mass_and_bias

    @abstractmethod
    def moment(self, t: float, y: Array) -> _Moment:
        """Return everything at a time."""

    def transmitted(self, q: Array, qd: Array, theta: Array, thetad: Array) -> Array:
        """Return the efforts of flexible gears on their links."""
        return np.asarray(self._K * (theta - q) + self._D * (thetad - qd))

    def friction(self, speed: Array) -> Array:
        """Return the efforts that the friction of motors takes."""
        return np.asarray(self.law.viscous * speed + self.law.beyond_viscous(speed, speed))

    def heat(self, qd: Array, thetad: Array, friction: Array) -> float:
        """Return the power that friction and the damping of gears take."""
        return float(friction @ thetad + self._D @ (thetad - qd) ** 2)

    def slope(self, t: float, y: Array) -> Array:
        """Return the derivative of the state."""
        if not np.isfinite(y).all() or np.abs(y[:-2]).max() > LARGEST_ANGLE:
            return np.full_like(y, np.nan)
        now = self.moment(t, y)
        return np.concatenate([now.qd, now.qdd, *self.motor_slopes(now), [now.tau @ now.thetad, now.heat]])

    def motor_slopes(self, _now: _Moment) -> tuple[Array, ...]:
        """Return the derivatives of what the state has of motors."""
        return ()

    def energies(self, q: Array, qd: Array, theta: Array, thetad: Array) -> dict[str, Array]:
        """Return the kinetic and the potential energy at m moments, (m,) each."""
        kinetic = kinetic_energy(self.links, q, qd) + 0.5 * thetad**2 @ self.B
        potential = potential_energy(self.links, q) + 0.5 * (theta - q) ** 2 @ self._K
        return {"kinetic": kinetic, "potential": potential}


class _Guided(_Plant):
    """Motors that are where a reference says; their state is in no equation."""

    def __init__(self, arm: Arm, motors: Reference) -> None:
        super().__init__(arm)
        self._motors = returning(motors, arm.n, "motion of the motors")

    def moment(self, t: float, y: Array) -> _Moment:
        n, rigid, f = self.arm.n, self.rigid, self.flexible
        theta, thetad, thetadd = (self._motors(t, order) for order in range(3))
        q, qd = np.where(rigid, theta, y[:n]), np.where(rigid, thetad, y[n : 2 * n])
        gears = self.transmitted(q, qd, theta, thetad)
        M, bias = self.mass_and_bias(q, qd)
        qdd = np.where(rigid, thetadd, 0.0)
        qdd[f] = np.linalg.solve(M[np.ix_(f, f)], (gears - bias - M @ qdd)[f])
        friction = self.friction(thetad)
        tau = self.B * thetadd + friction + np.where(rigid, M @ qdd + bias, gears)
        return _Moment(q, qd, qdd, theta, thetad, thetadd, gears, tau, self.heat(qd, thetad, friction))


class _Driven(_Plant):
    """Motors that efforts move; theta and theta' are in the state behind q and q'."""

    def __init__(self, arm: Arm, controller: Controller) -> None:
        super().__init__(arm)
        self._controller = returning(controller, arm.n, "efforts of the controller")

    def moment(self, t: float, y: Array) -> _Moment:
        n, rigid, f = self.arm.n, self.rigid, self.flexible
        q, qd = y[:n], y[n : 2 * n]
        theta, thetad = np.where(rigid, q, y[2 * n : 3 * n]), np.where(rigid, qd, y[3 * n : 4 * n])
        limit = self.arm.limits.effort
        tau = np.clip(self._controller(t, theta, thetad), -limit, limit)
        gears, friction = self.transmitted(q, qd, theta, thetad), self.friction(thetad)
        M, bias = self.mass_and_bias(q, qd)
        qdd = np.linalg.solve(M + np.diag(np.where(rigid, self.B, 0.0)), np.where(f, gears, tau - friction) - bias)
        thetadd = qdd.copy()
        thetadd[f] = (tau - friction - gears)[f] / self.B[f]
        return _Moment(q, qd, qdd, theta, thetad, thetadd, gears, tau, self.heat(qd, thetad, friction))

    def motor_slopes(self, _now: _Moment) -> tuple[Array, ...]:
        return _now.thetad, _now.thetadd


def _mass_and_bias(links: Arm, q: Array, qd: Array) -> tuple[Array, Array]:
    return mass_matrix(links, q), inverse_dynamics(links, q, qd, np.zeros_like(q))


def _run(plant: _Plant, y: Array, duration: float, period: float, integrator: Integrator) -> FlexibleSimulation:
    times = sample_times(duration, period)
    samples, status, reached = [(0.0, y)], Status.FINISHED, 0.0
    for step in integrator.steps(plant.slope, 0.0, y, duration):
        if not np.isfinite(step.state).all() or np.abs(step.state[:-2]).max() > LARGEST_ANGLE:
            status = Status.DIVERGED
            break
        while len(samples) < len(times) and times[len(samples)] <= step.end:
            time = times[len(samples)]
            samples.append((time, step.state if time == step.end else step.between(time)))
        reached = step.end
    if status is Status.FINISHED and reached < duration:
        status = Status.IMPRECISE
    moments = [plant.moment(t, state) for t, state in samples]
    now = {name: np.array([getattr(one, name) for one in moments]) for name in _Moment._fields}
    return FlexibleSimulation(
        arm=plant.arm,
        status=status,
        t=np.array([t for t, _ in samples]),
        **{name: now[name] for name in ("q", "qd", "qdd", "gears", "tau")},
        motors=now["theta"],
        motor_speeds=now["thetad"],
        **plant.energies(now["q"], now["qd"], now["theta"], now["thetad"]),
        work=np.array([state[-2] for _, state in samples]),
        heat=np.array([state[-1] for _, state in samples]),
    )
