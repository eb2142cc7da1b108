"""What a motion asks of the motors, and how much slower it must run for them to give it.

Run k times slower, a motion asks of every joint at every point for

    tau(k) = gravity + Coulomb friction + (viscous friction) / k + (inertia, centrifugal and Coriolis efforts) / k²

so the least slowing follows from the roots of a parabola in 1/k, for each sample of the motion. Springs and the offset
of friction count as gravity does. Stribeck friction and that by the cube root of the speed are taken as they are at the
last k, and the least slowing is sought again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.dynamics.drives import FrictionLaw, coulomb_friction, drive_speeds, efforts_at_joints, friction_law
from armwright.errors import IncapableArmError, KindError, ShapeError, shown
from armwright.motion.limited import limited_efforts, limited_label
from armwright.motion.polynomials import derivative, evaluate
from armwright.motion.solver import AnyArm, Solver, solver_of
from armwright.motion.trajectory import Trajectory

# Least numbers of samples of a segment, and of a motion.
_LOOKS_OF_SEGMENT = 9
_SAMPLES = 600
# Samples at the ends of a segment are inside it by this part of it: there a joint that starts has its dry friction.
_INSIDE = 1e-8
# Where a joint reverses is found by so many halvings of the space between two samples.
_HALVINGS = 16
# From so many of the largest samples the peak is sought: so often, with so many samples, each time closer.
_TOPS, _ZOOMS, _CLOSER = 6, 6, 9
# A joint that moves at less than this part of the top speed of all stands: the sign of its speed is rounding.
_STANDS = 1e-9
# A limit passed by this part of it is rounding.
_ROUNDING = 1e-9
# A motion that must run a million times slower stands still.
_CRAWL = 1e-6
_ROUNDS = 8
# Where friction is no polynomial of the speed, the speed is lowered by this part at least, and so many halvings find
# how much of that is not needed.
_LEAST_LOWERING, _REFINED = 1e-3, 30


class EffortPeaks(NamedTuple):
    """The largest efforts of a motion.

    Attributes:
        peaks: (n,) magnitudes [N m] or [N]; (2 n,) with those of the drives behind, where coupled drives have limits
            of their own: see ``Arm.all_limits``.
        times: when [s], of each.
    """

    peaks: Array
    times: Array


class EffortSlowing(NamedTuple):
    """How much slower a motion must run.

    Attributes:
        factor: times slower; 1 where the efforts are inside their limits as it is.
        joint: that it is for, itself or its drive, from 0; None where no limit binds.
        time: when that joint is at its limit, in the motion as it was given [s].
    """

    factor: float
    joint: int | None
    time: float


class _Samples(NamedTuple):
    """Points of a motion that are sampled: which segments, and which parts of them, (k,) each."""

    segments: npt.NDArray[np.intp]
    parts: Array

    def times(self, trajectory: Trajectory) -> Array:
        """Return when they are in a motion, (k,) [s]."""
        return np.asarray(trajectory.times[self.segments] + self.parts * np.diff(trajectory.times)[self.segments])


class _UnevenFriction(NamedTuple):
    """Friction that is no polynomial of the speed: Stribeck's and that by the cube root, at samples with speeds."""

    arm: Arm
    law: FrictionLaw
    speeds: Array

    def at(self, u: float) -> Array:
        """Return it, of all that has limits, at the part u of the speeds (k, n) of the drives."""
        friction = uneven_friction(self.law, self.speeds * u, self.speeds)
        return limited_efforts(self.arm, efforts_at_joints(self.arm, friction))


class _Shares(NamedTuple):
    """The efforts of all that has limits, at k samples, by how they change when the motion is slowed."""

    lasting: Array
    viscous: Array
    dynamic: Array
    uneven: _UnevenFriction | None = None

    def lasting_at(self, u: float) -> Array:
        """Return what does not change in proportion to a power of the speed, at the part u of it."""
        return self.lasting if self.uneven is None else self.lasting + self.uneven.at(u)

    def at(self, u: float) -> Array:
        """Return the efforts (k, n) of the motion run at the part u of its speed."""
        return self.lasting_at(u) + u * (self.viscous + u * self.dynamic)


def effort_peaks(arm: AnyArm, trajectory: Trajectory) -> EffortPeaks:
    """Return the largest effort of every joint during a motion, and when.

    A motion is sampled at 600 points or more, at both ends of every segment and wherever a joint reverses among
    them; around the largest samples the peak is sought ever closer. A peak that is narrower than the space between two
    samples may be missed.

    Args:
        arm: the arm, or a compiled one, which is faster where there are many segments.
        trajectory: of its n joints.

    Raises:
        KindError: ``trajectory`` is no trajectory.
        ShapeError: it is of another number of joints.
    """
    solver = solver_of(arm)
    checked(solver.arm, trajectory)
    samples = _spread(solver.arm, trajectory)
    tau = _efforts(solver, trajectory, samples)
    peaks, indices = _peaks(solver, trajectory, samples, tau)
    return EffortPeaks(peaks, indices.times(trajectory))


def slowing_for_efforts(arm: AnyArm, trajectory: Trajectory) -> EffortSlowing:
    """Return how many times slower a motion must run to keep the effort limits: as little as it can be.

    It holds at all samples of ``effort_peaks``. Use ``trajectory.slowed(found.factor)``.

    Args:
        arm: the arm, or a compiled one.
        trajectory: of its n joints.

    Raises:
        KindError: ``trajectory`` is no trajectory.
        ShapeError: it is of another number of joints.
        IncapableArmError: gravity and dry friction alone take more than a joint may give, so that no slowing helps.
    """
    solver = solver_of(arm)
    checked(solver.arm, trajectory)
    limits = solver.arm.all_limits.effort
    if not np.isfinite(limits).any():
        return EffortSlowing(1.0, None, 0.0)
    samples = _spread(solver.arm, trajectory)
    u, joint, time = 1.0, None, 0.0
    for _ in range(_ROUNDS):
        shares, times = _shares(solver, trajectory, samples), samples.times(trajectory)
        check_lasting(solver.arm, shares.lasting, 1 - _ROUNDING, times, "at {:.3f} s".format)
        part, binding = _largest_part(solver.arm, shares, limits)
        if binding is not None and part < u:
            u, joint, time = part, binding[1] % solver.arm.n, float(times[binding[0]])
        # What lies between the samples is sampled as well, where the efforts are largest: positions stay when slowed.
        peaks, near = _peaks(solver, trajectory.slowed(1 / u), samples, shares.at(u))
        if (peaks <= limits * (1 + _ROUNDING)).all():
            break
        samples = _Samples(np.append(samples.segments, near.segments), np.append(samples.parts, near.parts))
    return EffortSlowing(1 / u, joint, time)


def checked(arm: Arm, trajectory: Trajectory, what: str = "trajectory") -> None:
    """Refuse what is no motion of an arm, and call it by the name of the argument.

    Raises:
        KindError: it is no trajectory.
        ShapeError: it is of another number of joints.
    """
    if not isinstance(trajectory, Trajectory):
        raise KindError(f"{what}: expected a Trajectory, got {shown(trajectory)}")
    joints = trajectory.coefficients.shape[2]
    if joints != arm.n:
        raise ShapeError(f"{what}: expected one of {arm.n} joints, as '{arm.name}' has, got one of {joints}")


def check_lasting(arm: Arm, lasting: Array, most: float, at: Array, location: Callable[[float], str]) -> None:
    """Refuse a motion where what lasts however slow it is takes more than a part ``most`` of what a joint may give.

    Args:
        arm: the arm, with n joints.
        lasting: efforts by gravity and Coulomb friction, at k samples, of all that has limits.
        most: part of the limits.
        at: (k,) times or path parameters of these.
        location: says in words where one of them is on the motion.

    Raises:
        IncapableArmError: it takes more, with the joint and the effort.
    """
    limits = arm.all_limits.effort
    use = np.abs(lasting) / limits
    if use.max() > most:
        k, number = (int(i) for i in np.unravel_index(int(use.argmax()), use.shape))
        unit, most_allowed = arm.joints[number % arm.n].units.effort, float(limits[number])
        causes = "gravity, springs" if any(x.spring.stiffness for x in arm.joints) else "gravity"
        raise IncapableArmError(
            f"{location(float(at[k]))} {causes} and Coulomb friction alone require {abs(lasting[k, number]):.4g} "
            f"{unit} of {limited_label(arm, number)}, {most_allowed:.4g} {unit} are allowed: a slower motion is "
            "infeasible too"
        )


def lasting_efforts(solver: Solver, q: Array, qd: Array) -> Array:
    """Return what gravity and dry friction take of joints (..., n) that move, however slowly, as ``qd`` does."""
    still = np.zeros_like(q)
    return np.asarray(solver.inverse_dynamics(q, still, still) + coulomb_friction(solver.arm, qd))


def is_uneven(law: FrictionLaw) -> bool:
    """Whether friction is more than a constant and a part in proportion to the speed."""
    return law.stribeck is not None or law.cube_root is not None


def uneven_friction(law: FrictionLaw, qd: Array, direction: Array) -> Array:
    """Return Stribeck friction and that by the cube root of the speed (..., n), of joints that move in a direction."""
    rest = law._replace(forward=np.zeros_like(law.forward), backward=np.zeros_like(law.backward), offset=None)
    return np.asarray(rest.beyond_viscous(qd, direction))


def _spread(arm: Arm, trajectory: Trajectory) -> _Samples:
    """Return samples of all segments, at both ends of each among them, and where joints reverse.

    There their dry friction jumps, so that they are sampled just before and just after.
    """
    m, each = len(trajectory.coefficients), _each(trajectory)
    parts = np.linspace(_INSIDE, 1 - _INSIDE, each)
    samples = _Samples(np.repeat(np.arange(m), each), np.tile(parts, m))
    dry = ("coulomb_forward", "coulomb_backward", "stribeck")
    rubs = sum(arm.motor_values(name) for name in dry) > 0
    speeds = drive_speeds(arm, _states(trajectory, samples)[1]).reshape(m, each, -1)
    segment, before, joint = np.nonzero((speeds[:, 1:] * speeds[:, :-1] < 0) & rubs)
    low, high, sign = parts[before], parts[before + 1], np.sign(speeds[segment, before, joint])
    for _ in range(_HALVINGS if len(joint) else 0):
        middle = (low + high) / 2
        speed = drive_speeds(arm, _states(trajectory, _Samples(segment, middle))[1])[np.arange(len(joint)), joint]
        early = speed * sign > 0
        low, high = np.where(early, middle, low), np.where(early, high, middle)
    return _Samples(np.concatenate([samples.segments, segment, segment]), np.concatenate([samples.parts, low, high]))


def _each(trajectory: Trajectory) -> int:
    """Return how often a segment is sampled."""
    return max(_LOOKS_OF_SEGMENT, -(-_SAMPLES // len(trajectory.coefficients)) + 1)


def _states(trajectory: Trajectory, samples: _Samples) -> tuple[Array, Array, Array]:
    """Return positions, speeds and accelerations (k, n) at samples: of the sampled segment, at its ends too."""
    terms = trajectory.coefficients[samples.segments]
    local = (samples.parts * np.diff(trajectory.times)[samples.segments])[:, None]
    q, qd, qdd = (evaluate(derivative(terms, order), local) for order in range(3))
    # No joint is faster than this, and few are many times slower.
    h = np.diff(trajectory.times)[:, None]
    fastest = float(evaluate(np.abs(derivative(trajectory.coefficients, 1)), h).max())
    return q, without_rounding(qd, fastest), qdd


def without_rounding(qd: Array, fastest: float) -> Array:
    """Return the velocities of joints, 0 of those that stand: dry friction would take the sign of their rounding.

    Args:
        qd: (..., n) velocities.
        fastest: the top speed of the motion.
    """
    return np.where(np.abs(qd) > _STANDS * fastest, qd, 0.0)


def _efforts(solver: Solver, trajectory: Trajectory, samples: _Samples) -> Array:
    return limited_efforts(solver.arm, np.asarray(solver.inverse_dynamics(*_states(trajectory, samples))))


def _shares(solver: Solver, trajectory: Trajectory, samples: _Samples) -> _Shares:
    arm, (q, qd, qdd) = solver.arm, _states(trajectory, samples)
    lasting = limited_efforts(arm, lasting_efforts(solver, q, qd))
    speeds, law = drive_speeds(arm, qd), friction_law(arm)
    viscous = limited_efforts(arm, efforts_at_joints(arm, speeds * arm.motor_values("viscous")))
    uneven = _UnevenFriction(arm, law, speeds) if is_uneven(law) else None
    dynamic = limited_efforts(arm, np.asarray(solver.inverse_dynamics(q, qd, qdd))) - lasting - viscous
    return _Shares(lasting, viscous, dynamic if uneven is None else dynamic - uneven.at(1.0), uneven)


def _peaks(solver: Solver, trajectory: Trajectory, samples: _Samples, tau: Array) -> tuple[Array, _Samples]:
    """Return the largest efforts, and where, from the efforts (k, ...) of all that has limits at samples."""
    n = tau.shape[1]
    size = np.abs(tau)
    edge = np.full((1, n), -1.0)
    tops = (size >= np.concatenate([edge, size[:-1]])) & (size >= np.concatenate([size[1:], edge]))
    best = np.argsort(np.where(tops, -size, 0.0), axis=0, kind="stable")[:_TOPS]
    joints = np.broadcast_to(np.arange(n), best.shape).ravel()
    best = best.ravel()
    peaks, segments, parts = size[best, joints], samples.segments[best], samples.parts[best]
    rows = np.arange(len(joints))
    width = 1.0 / (_each(trajectory) - 1)
    for _ in range(_ZOOMS):
        near = np.clip(parts[:, None] + np.linspace(-width, width, _CLOSER), _INSIDE, 1 - _INSIDE)
        sizes = np.abs(_efforts(solver, trajectory, _Samples(np.repeat(segments, _CLOSER), near.ravel())))
        of_joint = sizes.reshape(len(rows), _CLOSER, n)[rows, :, joints]
        best = of_joint.argmax(axis=1)
        better = of_joint[rows, best] > peaks
        peaks = np.where(better, of_joint[rows, best], peaks)
        parts = np.where(better, near[rows, best], parts)
        width *= 2.0 / (_CLOSER - 1)
    largest = peaks.reshape(-1, n).argmax(axis=0) * n + np.arange(n)
    return peaks[largest], _Samples(segments[largest], parts[largest])


def _largest_part(arm: Arm, shares: _Shares, limits: Array) -> tuple[float, tuple[int, int] | None]:
    """Return at which part of its speed, 1 at most, a motion keeps the limits, and which sample and joint decide."""
    u, before, binding = 1.0, 1.0, None
    lowering = _ROUNDING if shares.uneven is None else _LEAST_LOWERING
    while True:
        tau = shares.at(u)
        over = np.argwhere(np.abs(tau) > limits * (1 + _ROUNDING))
        if not len(over):
            return (u if shares.uneven is None else _refined(shares, limits, u, before)), binding
        k, j = over.T
        side = np.sign(tau[k, j])
        # Of side (lasting + viscous u + dynamic u²) = limit the root below u, up from which the limit is passed.
        a, b, c = (
            side * shares.dynamic[k, j],
            side * shares.viscous[k, j],
            side * shares.lasting_at(u)[k, j] - limits[j],
        )
        root = np.sqrt(np.maximum(b * b - 4 * a * c, 0.0))
        stable = b >= 0
        below = np.where(stable, -2 * c / np.where(stable, b + root, 1.0), (root - b) / np.where(stable, 1.0, 2 * a))
        worst = int(below.argmin())
        before, u = u, min(float(below[worst]), u * (1 - lowering))
        binding = int(k[worst]), int(j[worst])
        if u < _CRAWL:
            message = f"would have to move {1 / u:.3g} times slower to keep its effort limit"
            raise IncapableArmError(f"{limited_label(arm, binding[1])} {message}")


def _refined(shares: _Shares, limits: Array, u: float, beyond: float) -> float:
    """Return a part of the speed that keeps the limits, as u does, next to one that does not."""
    for _ in range(_REFINED):
        middle = (u + beyond) / 2
        keeps = (np.abs(shares.at(middle)) <= limits * (1 + _ROUNDING)).all()
        u, beyond = (middle, beyond) if keeps else (u, middle)
    return u
