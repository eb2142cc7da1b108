"""Simulation of an arm under its drives: friction that sticks, stops, brakes, and a ledger of energy.

Between events the motion is smooth: some joints move, each in a direction that its dry friction opposes, and others
are held. An event ends that: a speed falls to zero, a stop is met, the effort that holds a joint exceeds what can
hold it, a brake goes on or off. At an event, which joints are held from then on is one system of inequalities with
one answer (``solve_complementarity``), so nothing chatters and no speed creeps.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from armwright.arm.coupling import Coupling
from armwright.arm.model import Arm
from armwright.arm.positions import single_configuration
from armwright.arrays import LARGEST_ANGLE, Array, ArrayLike, exact_shape, one_per_joint, positive
from armwright.dynamics.accelerations import check_pivots, eliminated
from armwright.dynamics.energy import kinetic_energy, potential_energy
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.errors import InvalidValueError, KindError, UnsupportedArmError, shown
from armwright.simulation.controllers import Controller, no_effort, returning
from armwright.simulation.integrators import Gill, Integrator, Slope, Step, first_crossing
from armwright.simulation.plant import Moment, Phase, Plant, Start
from armwright.simulation.result import Brake, Event, JointState, Simulation, Status
from armwright.simulation.sample_times import check_samples, sample_times

# So many events within so short a time [s] are an entanglement.
_ENTANGLED = 50
_INSTANT = 1e-9
# More samples than this would exhaust the memory.
_MAX_SAMPLES = 10**7
# No position or speed of a robot is as large; of larger angles no sine means anything.
_LOST = LARGEST_ANGLE


def simulate(
    arm: Arm,
    q: ArrayLike,
    qd: ArrayLike | None = None,
    *,
    duration: float,
    controller: Controller | None = None,
    integrator: Integrator = Gill(),  # noqa: B008 - immutable
    period: float = 1e-3,
    brakes: Sequence[Brake] = (),
    stops: bool = True,
    saturation: bool = True,
) -> Simulation:
    """Simulate the motion of an arm under its drives.

    Args:
        arm: the arm, with n joints; its motors have rotor inertia and friction, its joints springs, its limits
            stops and largest efforts.
        q: (n,) joint positions at the start [rad] or [m].
        qd: (n,) joint speeds at the start; at rest when left out.
        duration: how long [s].
        controller: gives the efforts of the drives; off when left out.
        integrator: ``Gill`` with its step, or ``Adaptive`` with its tolerances.
        period: time between two samples of the result [s].
        brakes: which are on, and when.
        stops: whether position limits are stops, which take all energy of a joint that meets them.
        saturation: whether effort limits bound what the drives do.

    Returns:
        The motion. When something goes wrong meanwhile, its status says what, and it ends there.

    Raises:
        KindError: ``arm`` is no arm, a number none, or controller, integrator or a brake something else.
        ShapeError: ``q``, ``qd`` or what the controller returns are not n long.
        InvalidValueError: the arm starts outside its stops, a time is not above 0, a number is not finite, a brake has
            no joint, or the result would have too many samples.
        UnsupportedArmError: some joint moves nothing that resists an acceleration.

    Source:
        TR-83-008, section 4 and appendix V; Gill (1951). The friction is that of ``Motor``: at rest it holds as much as
        it takes when a motion begins.
    """
    start = single_configuration(arm, q)
    speed = np.zeros(arm.n) if qd is None else one_per_joint(qd, arm.n, "qd")
    duration, period = positive(duration, "duration", "s"), positive(period, "period", "s")
    check_samples(duration, period, _MAX_SAMPLES)
    _check_kinds(controller, integrator, brakes)
    unlimited = np.full(arm.n, np.inf)
    plant = Plant(
        arm=arm,
        controller=no_effort(arm) if controller is None else returning(controller, arm.n, "efforts of the controller"),
        brakes=tuple(brakes),
        lower=arm.limits.lower if stops else -unlimited,
        upper=arm.limits.upper if stops else unlimited,
        effort=arm.limits.effort if saturation else unlimited,
        drive_effort=arm.coupling.drive_limits.effort if saturation and arm.coupling is not None else unlimited,
    )
    _check(plant, start, speed)
    run = _Run(plant, integrator, duration, period)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        status = run.go(start, speed)
        return run.result(status)


def _check_kinds(controller: Controller | None, integrator: Integrator, brakes: Sequence[Brake]) -> None:
    """Refuse what cannot steer, integrate or hold."""
    if controller is not None and not callable(controller):
        raise KindError(f"controller: expected a function of t, q and qd that returns efforts, got {shown(controller)}")
    if isinstance(integrator, type) or not callable(getattr(integrator, "steps", None)):
        raise KindError(f"integrator: expected one such as Gill() or Adaptive(), got {shown(integrator)}")
    if not isinstance(brakes, Sequence) or not all(isinstance(brake, Brake) for brake in brakes):
        raise KindError(f"brakes: expected a list of Brake, got {shown(brakes)}")


def _check(plant: Plant, q: Array, qd: Array) -> None:
    """Refuse a start outside the stops, a brake without a joint, a controller that drives another arm."""
    arm = plant.arm
    if arm.coupling is not None:
        _refuse_held_drives(arm, arm.coupling, plant.brakes)
    for i in np.flatnonzero((q < plant.lower) | (q > plant.upper)):
        units = arm.joints[i].units
        unit = units.display
        position, lower, upper = (float(x[i]) / units.scale for x in (q, plant.lower, plant.upper))
        raise InvalidValueError(
            f"{arm.joint_label(int(i))} starts at {position:g} {unit}, outside its stops at {lower:g} and {upper:g} "
            f"{unit}; start between them, or simulate without stops"
        )
    for brake in plant.brakes:
        if not 0 <= brake.joint < arm.n:
            raise InvalidValueError(f"brake: expected a joint from 0 to {arm.n - 1}, got {brake.joint}")
    exact_shape(plant.controller(0.0, q, qd), (arm.n,), "efforts of the controller")
    check_pivots(arm, eliminated(arm, mass_matrix(arm, q)))


class _Sample(NamedTuple):
    """The state at one moment of the result, and what stops and brakes have taken until then."""

    t: float
    y: Array
    phase: Phase
    impact: float


class _Run:
    """One simulation running. Its state y holds positions, speeds, work of the drives and heat, n of each."""

    def __init__(self, plant: Plant, integrator: Integrator, duration: float, period: float) -> None:
        self._plant, self._integrator = plant, integrator
        self._times = sample_times(duration, period)
        changes = {time for brake in plant.brakes for time in (brake.start, brake.end) if 0 < time < duration}
        self._ends = [*sorted(changes), duration]
        self._samples: list[_Sample] = []
        self._events: list[Event] = []
        self._impact = 0.0

    def go(self, q: Array, qd: Array) -> Status:
        """Go from phase to phase to the end."""
        n = len(q)
        t, y = 0.0, np.concatenate([q, qd, np.zeros(2 * n)])
        before = np.full(n, JointState.MOVES, dtype=np.int8)
        recent: list[float] = []
        while True:
            start = self._plant.begin(t, y[:n], y[n : 2 * n])
            phase = start.phase
            self._impact += start.loss
            y = np.concatenate([start.q, start.qd, y[2 * n :]])
            self._note(t, before, start)
            before = phase.state
            if not self._samples:
                self._samples.append(_Sample(t, y, phase, self._impact))
            recent = [time for time in recent if time > t - _INSTANT] + [t]
            if len(recent) > _ENTANGLED:
                return Status.ENTANGLED
            end = next(time for time in self._ends if time > t or time == self._ends[-1])
            reached = self._phase(t, y, phase, end)
            if isinstance(reached, Status):
                return reached
            t, y = reached
            if t >= self._ends[-1]:
                self._samples.append(_Sample(t, y, phase, self._impact))
                return Status.FINISHED

    def _note(self, t: float, before: npt.NDArray[np.int8], start: Start) -> None:
        """Keep the events at the start of a phase; a joint that meets a stop and leaves it at once has two."""
        for i in range(len(before)):
            course = [before[i], start.phase.state[i]]
            if start.collided[i] not in (JointState.MOVES, course[1]):
                course.insert(1, start.collided[i])
            for earlier, later in itertools.pairwise(course):
                if earlier != later:
                    self._events.append(Event(t, i, JointState(earlier), JointState(later)))

    def _phase(self, t: float, y: Array, phase: Phase, end: float) -> tuple[float, Array] | Status:
        """Integrate one phase to its end or to the first event."""
        for step in self._integrator.steps(self._slope(phase), t, y, end):
            if not np.abs(step.state[: 2 * self._plant.arm.n]).max() < _LOST or not np.isfinite(step.state).all():
                return Status.DIVERGED
            if self._watch(phase, step.end, step.state) < 0:
                crossing = first_crossing(self._watched(phase, step), step.start, step.end)
                self._record(step, y, crossing, phase)
                return crossing, step.between(crossing)
            self._record(step, y, step.end, phase)
            t, y = step.end, step.state
        return (t, y) if t >= end else Status.IMPRECISE

    def _slope(self, phase: Phase) -> Slope:
        plant, n = self._plant, self._plant.arm.n

        def slope(t: float, y: Array) -> Array:
            if not np.isfinite(y).all() or np.abs(y[: 2 * n]).max() > _LOST:
                return np.full_like(y, np.nan)
            q, qd = y[:n], y[n : 2 * n]
            moment = plant.moment(t, q, qd, phase)
            return np.concatenate([qd, moment.qdd, moment.tau * qd, -moment.friction * qd])

        return slope

    def _watch(self, phase: Phase, t: float, y: Array) -> float:
        n = self._plant.arm.n
        return self._plant.watch(t, y[:n], y[n : 2 * n], phase)

    def _watched(self, phase: Phase, step: Step) -> Callable[[float], float]:
        """Return how far the nearest event is at any time within a step."""
        return lambda t: self._watch(phase, t, step.between(t))

    def _record(self, step: Step, y: Array, end: float, phase: Phase) -> None:
        """Keep the samples of a step that starts in state y, up to but without its end."""
        while len(self._samples) < len(self._times) - 1:
            time = self._times[len(self._samples)]
            if time >= end:
                return
            state = y if time <= step.start else step.between(time)
            self._samples.append(_Sample(time, state, phase, self._impact))

    def result(self, status: Status) -> Simulation:
        """Return what has been kept, with efforts and energies."""
        arm = self._plant.arm
        n = arm.n
        states = np.array([sample.y for sample in self._samples])
        q, qd = states[:, :n], states[:, n : 2 * n]
        moments = [self._plant.moment(s.t, s.y[:n], s.y[n : 2 * n], s.phase) for s in self._samples]
        efforts = {name: np.array([getattr(moment, name) for moment in moments]) for name in Moment._fields}
        return Simulation(
            arm=arm,
            status=status,
            t=np.array([sample.t for sample in self._samples]),
            q=q,
            qd=qd,
            **efforts,
            state=np.array([sample.phase.state for sample in self._samples]),
            kinetic=kinetic_energy(arm, q, qd),
            potential=potential_energy(arm, q),
            work=states[:, 2 * n : 3 * n],
            heat=states[:, 3 * n :],
            impact=np.array([sample.impact for sample in self._samples]),
            events=tuple(self._events),
        )


def _refuse_held_drives(arm: Arm, coupling: Coupling, brakes: Sequence[Brake]) -> None:
    """Refuse what holds coupled drives and not joints: dry friction, brakes, and position limits of the drives.

    Raises:
        UnsupportedArmError: there is some.
    """
    dry = ("coulomb_forward", "coulomb_backward", "stribeck")
    rubs = np.any([arm.motor_values(name) > 0 for name in dry], axis=0)
    if rubs.any():
        raise UnsupportedArmError(
            f"arm '{arm.name}' has coupled drives, and that of {arm.joint_label(int(np.argmax(rubs)))} has dry "
            "friction, which holds drives and not joints; this simulation has dry friction of joints only. Omit it, or "
            "run the arm in a cell with physics (armwright run --physics)"
        )
    held = [brake.joint for brake in brakes if brake.joint in coupling.mixed]
    if held:
        raise UnsupportedArmError(
            f"arm '{arm.name}': the drive of {arm.joint_label(held[0])} is coupled, so that a brake would hold the "
            "drive and not the joint; this simulation has brakes of joints only. Omit it"
        )
    ends = np.isfinite([coupling.drive_limits.lower, coupling.drive_limits.upper]).any(axis=0)
    if ends.any():
        raise UnsupportedArmError(
            f"arm '{arm.name}': the drive of {arm.joint_label(int(np.argmax(ends)))} has position limits of its own; "
            "this simulation has stops of joints only. Omit them, or run the arm in a cell with physics "
            "(armwright run --physics)"
        )
