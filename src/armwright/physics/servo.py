"""The servo of an arm in a world: where it is sent, what its sensors read, and the efforts that follow from both."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache
from inspect import signature
from typing import Any, NamedTuple, Protocol

import attrs
import numpy as np

from armwright.arm.drive import Motor
from armwright.arm.model import Arm
from armwright.arrays import LARGEST, Array, exact_shape
from armwright.cell.control import Sensors, Servo
from armwright.compiled.arm import compile_arm
from armwright.dynamics.drives import drive_speeds, efforts_at_joints, friction_law
from armwright.motion.trajectory import Trajectory
from armwright.physics.friction import constant_efforts, dry_offsets
from armwright.physics.plant import ArmIndices
from armwright.tracing.emit import emit
from armwright.tracing.kernel import Kernel
from armwright.tracing.scalar import Scalar, larger, select, smaller
from armwright.tracing.vectors import dot

Scalars = Sequence[Scalar]
# The integral of errors is fed back with this part of the cube of the bandwidth.
_INTEGRAL = 0.2
# Dry friction is compensated in full where the reference moves faster than this [rad/s, m/s].
_MOVING = 1e-3
# Part of a new difference of positions in the estimated speed.
_SMOOTHING = 0.2
# A duration that exceeds whole ticks by no more has those.
_TICK_TOLERANCE = 1e-9


class Reference(NamedTuple):
    """Where the joints of an arm are sent at a moment, (n,) each.

    Attributes:
        q: positions [rad] or [m].
        qd: speeds.
        qdd: accelerations.
        friction: of the believed arm at these speeds, but the viscous one [N m] or [N].
    """

    q: Array
    qd: Array
    qdd: Array
    friction: Array


class TorqueLaw(Protocol):
    """A controller of a user's own: called at every servo tick, for the efforts of the joints."""

    def __call__(self, t: float, q: Array, qd: Array, reference: Reference) -> Array:
        """Return the efforts (n,) [N m] or [N].

        Args:
            t: time [s].
            q: (n,) joint positions, as the sensors read them.
            qd: (n,) joint speeds, as the sensors read them.
            reference: where the joints are sent.
        """


class Sent:
    """A trajectory on the ticks of the servo."""

    def __init__(
        self, trajectory: Trajectory, tick: int, period: float, friction: Callable[[Array], Array] = np.zeros_like
    ) -> None:
        """Begin at a tick.

        Args:
            trajectory: from that tick on.
            tick: of the servo.
            period: of the servo [s].
            friction: returns the friction at speeds (k, n), see ``Reference``; none where it is left out.
        """
        self.trajectory, self.tick = trajectory, tick
        count = math.ceil(trajectory.duration / period - _TICK_TOLERANCE) + 1
        t = np.minimum(np.arange(count) * period, trajectory.duration)
        q, qd, qdd = (trajectory(t, order) for order in range(3))
        # Then the arm stands.
        qd[-1] = qdd[-1] = 0.0
        self._rows = np.stack([q, qd, qdd, friction(qd)], axis=1)
        self._last = count - 1

    def at(self, tick: int) -> Array:
        """Return where the joints are sent at a tick: the fields (4, n) of a ``Reference``."""
        row: Array = self._rows[min(max(tick - self.tick, 0), self._last)]
        return row

    def positions(self, first: int, last: int) -> Array:
        """Return where the joints are sent (k, n) at the ticks from the first one up to, but without, the last one."""
        return np.asarray(self._rows[np.clip(np.arange(first, last) - self.tick, 0, self._last), 0])

    def configuration(self, time: float, period: float) -> Array:
        """Return the positions (n,) at any time from its beginning on."""
        return self.trajectory(min(max(0.0, time - self.tick * period), self.trajectory.duration))


class Measured(NamedTuple):
    """What the servo read and did at a tick, (n,) each.

    Attributes:
        q: joint positions, as the sensors read them.
        qd: joint speeds, as the sensors read them.
        tau: efforts of the motors, at the joints.
        actual: joint positions, as they are.
    """

    q: Array
    qd: Array
    tau: Array
    actual: Array


class ArmServo:
    """The servo of one arm."""

    def __init__(  # noqa: PLR0917 - what an arm is driven by
        self,
        arm: Arm,
        plant: Arm,
        indices: ArmIndices,
        settings: Servo,
        sensors: Sensors,
        period: float,
        law: TorqueLaw | None = None,
    ) -> None:
        """Take an arm.

        Args:
            arm: that the controller believes in.
            plant: that stands in the world.
            indices: where it is in the arrays of the world.
            settings: of the controller.
            sensors: what it knows.
            period: of the servo [s].
            law: another controller; None for that of the settings.
        """
        self.arm, self.indices, self._period, self._settings, self._law = arm, indices, period, settings, law
        self._tick = np.array([period])
        # Compensated friction would chatter at rest with the measured speed: what is not viscous follows the reference.
        smooth = tuple(Motor(inertia=x.inertia, viscous=x.viscous, gear_ratio=x.gear_ratio) for x in arm.motors)
        self._compiled = compile_arm(attrs.evolve(arm, motors=smooth), quickly=True)
        self._friction_law = friction_law(arm)
        forward, backward = arm.motor_values("coulomb_forward"), arm.motor_values("coulomb_backward")
        self._dry, self._lean = (forward + backward) / 2, -dry_offsets(arm)
        self._offsets = constant_efforts(plant)
        # What is known of a part in the hand: its mass [kg] at the tool point.
        self.load = 0.0
        # Whether errors are not to be integrated: against what an arm leans on the integral would grow and grow.
        self.leaning = False
        self._sums = np.zeros(arm.n)
        effort = arm.limits.effort
        # Noise is a part of the largest efforts; there is none of those that are not known.
        self.finite_effort = np.where(np.isfinite(effort), effort, 0.0)
        self._limits = np.minimum(effort, LARGEST)
        self._coupling = arm.coupling
        w = settings.bandwidth
        self._gains = np.array([w**2, 2 * w, _INTEGRAL * w**3 if settings.integral else 0.0])
        self._commanded, self._limited, self._carrying = (_kernel(it, arm.n) for it in (_command, _limit, _carry))
        self._sensors = sensors
        turns = np.array([2 * math.pi if joint.revolute else 1.0 for joint in arm.joints])
        # An encoder is on the motor, before the gear.
        gears = np.abs(arm.motor_values("gear_ratio"))
        self._count = turns / (sensors.counts * gears) if sensors.counts else None
        # The latest readings of positions, the newest last; so many are kept that the oldest is the delayed one.
        self._readings: tuple[Array, ...] = ()
        self._speed = np.zeros(arm.n)

    def start(self, data: Any) -> None:
        """Begin at rest in a new world."""
        data.qfrc_applied[self.indices.speeds] = self._offsets

    @property
    def reads_exactly(self) -> bool:
        """Whether positions, speeds and efforts are read as they are."""
        return self._sensors.exact and not self._sensors.effort_noise

    def drive(self, data: Any, t: float, reference: Array) -> tuple[Array, Array, Array]:
        """Read the sensors, and command the motors until the next tick.

        Args:
            data: of the world.
            t: time [s].
            reference: where the joints are sent: the fields (4, n) of a ``Reference``.

        Returns:
            Positions and speeds (n,) as the sensors read them, and the efforts (n,) of the motors, at the joints.
        """
        q, qd = self._read(data.qpos[self.indices.positions], data)
        if self._law is not None:
            tau = np.clip(self._own_efforts(self._law, t, q, qd, Reference(*reference)), -self._limits, self._limits)
        else:
            qdd, errors = self._commanded(q, qd, reference, self._sums, self._gains)
            if self._settings.law == "pd":
                # The weight is taken off, and errors are corrected as if each joint moved its own inertia.
                correction = self._compiled.mass_matrix(q).diagonal() * (qdd - reference[2])
                tau = self._compiled.gravity_efforts(q) + correction
            else:
                tau = self._compiled.inverse_dynamics(q, qd, qdd)
                if self.load:
                    # What a part in the hand asks for; its centripetal acceleration is left out.
                    tau = self._carrying(tau, self._compiled.jacobian(q), qdd, self._load())
            tau, sums = self._limited(tau, reference, self._limits, self._sums, errors, self._tick)
            if not self.leaning:
                self._sums = sums
        if self._coupling is None:
            data.ctrl[self.indices.motors] = tau
        else:
            most = self._coupling.drive_limits.effort
            efforts = np.clip(self._coupling.drive_efforts(tau), -most, most)
            data.ctrl[self.indices.motors], tau = efforts, self._coupling.joint_efforts(efforts)
        return q, qd, tau

    def _load(self) -> Array:
        """Return the mass in the hand [kg] and the gravity (3,) on it."""
        return np.array([self.load, *self.arm.gravity])

    def _own_efforts(self, law: TorqueLaw, t: float, q: Array, qd: Array, reference: Reference) -> Array:
        """Return the efforts (n,) of a user's law.

        Raises:
            KindError: they are not real numbers.
            ShapeError: they are not one for each joint.
            InvalidValueError: one is NaN or infinite.
        """
        # The law may change the arrays that it is given.
        efforts = law(t, q.copy(), qd.copy(), Reference(*(row.copy() for row in reference)))
        return exact_shape(efforts, (self.arm.n,), f"efforts of the torque law of '{self.arm.name}' at {t:.3f} s")

    def friction(self, qd: Array) -> Array:
        """Return the friction (k, n) of the believed arm at speeds (k, n) of its reference, but the viscous one."""
        qd = drive_speeds(self.arm, qd)
        direction, fading = np.tanh(qd / _MOVING), self._friction_law.fading(qd)
        dry = self._dry if fading is None else self._dry + fading
        friction = dry * direction + self._lean * np.abs(direction) + self._friction_law.smooth(qd)
        return efforts_at_joints(self.arm, np.asarray(friction))

    def configuration(self, data: Any) -> Array:
        """Return the joint positions (n,) as the sensors read them at the latest tick."""
        if self._sensors.exact or not self._readings:
            return np.array(data.qpos[self.indices.positions])
        return self._latest().copy()

    def _read(self, q: Array, data: Any) -> tuple[Array, Array]:
        """Return positions and speeds as the controller knows them."""
        if self._sensors.exact:
            return q, data.qvel[self.indices.speeds]
        if self._count is not None:
            q = drive_speeds(self.arm, q)
            q = np.round(q / self._count) * self._count
            q = q if self._coupling is None else self._coupling.joints(q)
        keep = self._sensors.delay + 2
        self._readings = (*self._readings, q)[-keep:]
        latest, before = self._latest(), self._readings[0]
        # Speed is known by differences alone, smoothed over a few ticks.
        self._speed += _SMOOTHING * ((latest - before) / self._period - self._speed)
        return latest, self._speed

    def _latest(self) -> Array:
        """Return the reading that has come to the controller last."""
        return self._readings[max(0, len(self._readings) - 1 - self._sensors.delay)]

    def copy(self) -> ArmServo:
        """Return a servo in the same state."""
        other = object.__new__(ArmServo)
        other.__dict__.update(self.__dict__)
        # Sums are replaced, speeds are added to.
        other._speed = self._speed.copy()
        return other


@cache
def _kernel(equation: Callable[..., list[list[Scalar]]], n: int) -> Callable[..., Any]:
    """Return the kernel of an equation below for arms of n joints."""
    sizes: dict[str, int | tuple[int, ...]] = {"q": n, "qd": n, "qdd": n, "tau": n, "errors": n, "sums": n, "limits": n}
    sizes |= {"reference": (4, n), "J": (6, n), "gains": 3, "load": 4, "period": 1}
    names = signature(equation).parameters
    emitted = emit(
        equation.__name__, equation, {name: sizes[name] for name in names}, origin=f"{__name__} {equation.__name__} {n}"
    )
    return Kernel(emitted=emitted, quickly=True).function(equation.__name__)


def _command(q: Scalars, qd: Scalars, reference: Scalars, sums: Scalars, gains: Scalars) -> list[list[Scalar]]:
    """Return the accelerations that the joints are to have, and the errors of their positions."""
    n, (kp, kd, ki) = len(q), gains
    errors = [reference[i] - q[i] for i in range(n)]
    feedback = [kd * (reference[n + i] - qd[i]) + kp * errors[i] + ki * sums[i] for i in range(n)]
    return [[reference[2 * n + i] + feedback[i] for i in range(n)], errors]


def _limit(  # noqa: PLR0917 - of one kernel
    tau: Scalars, reference: Scalars, limits: Scalars, sums: Scalars, errors: Scalars, period: Scalars
) -> list[list[Scalar]]:
    """Return what the motors give of efforts without friction, and the sums of errors after the tick."""
    efforts = [x + friction for x, friction in zip(tau, reference[3 * len(tau) :], strict=True)]
    limited = [larger(smaller(x, limit), -limit) for x, limit in zip(efforts, limits, strict=True)]
    # What a motor cannot give is not to be asked for twice.
    grown = [x + error * period[0] for x, error in zip(sums, errors, strict=True)]
    return [limited, [select(abs(x) < it, y, z) for x, it, y, z in zip(efforts, limits, grown, sums, strict=True)]]


def _carry(tau: Scalars, J: Scalars, qdd: Scalars, load: Scalars) -> list[list[Scalar]]:
    """Return efforts and what a mass at the tool point asks for beside them."""
    n, (mass, *gravity) = len(tau), load
    rows = [J[n * k : n * k + n] for k in range(3)]
    force = [mass * (dot(row, qdd) - g) for row, g in zip(rows, gravity, strict=True)]
    return [[tau[i] + dot([row[i] for row in rows], force) for i in range(n)]]
