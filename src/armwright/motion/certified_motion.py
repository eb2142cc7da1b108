"""Motions with a certificate: a followed motion of the tool, run as fast as the limits of the joints allow."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.errors import IncapableArmError
from armwright.motion.certificate import LIMITS, BindingLimit, Certificate, LimitName, slowing, stretched_peaks
from armwright.motion.deviation import TrackingError
from armwright.motion.efforts import effort_peaks, slowing_for_efforts
from armwright.motion.knots import segments_at
from armwright.motion.limited import limited_efforts, limited_motion
from armwright.motion.solver import AnyArm, Solver, solver_of
from armwright.motion.timing_law import timed
from armwright.motion.tolerance import Tolerance
from armwright.motion.tracking import Tracking
from armwright.motion.trajectory import Trajectory, hold, join, whole_ticks
from armwright.tracing.loops import Loops, Table
from armwright.tracing.scalar import Scalar, select

# Efforts are sampled so often along a motion, and at the ends and in the middle of every segment, as the first ones of
# a motion are short; those that come as near to a limit as this part of it are sampled closely.
_SAMPLES, _NEAR = 101, 0.8
# A joint that moves at less than this part of the top speed of all stands.
_STANDS = 1e-9


@attrs.frozen(kw_only=True, eq=False)
class CertifiedMotion:
    """A motion of the joints, planned.

    Attributes:
        trajectory: of the joints, at rest at both ends.
        certificate: what it keeps.
    """

    trajectory: Trajectory
    certificate: Certificate

    def slowed(self, arm: AnyArm, factor: float, because: BindingLimit) -> CertifiedMotion:
        """Return the same motion run ``factor`` times slower, for a limit of a joint, from 0."""
        trajectory = self.trajectory.slowed(factor)
        certificate = self.certificate.run_slower(factor, limit_peaks(arm, trajectory), because)
        return CertifiedMotion(trajectory=trajectory, certificate=certificate)

    def on_ticks(self, period: float) -> CertifiedMotion:
        """Return the same motion slowed by less than a servo period [s], to end on a whole number of them."""
        trajectory, certificate = whole_ticks(self.trajectory, period), self.certificate
        if not trajectory.duration:
            return self
        stretch = trajectory.duration / self.trajectory.duration
        return CertifiedMotion(trajectory=trajectory, certificate=certificate.retimed(stretch))


def joined(motions: Sequence[CertifiedMotion]) -> CertifiedMotion:
    """Return motions run one after the other, with what all of them keep; of the slowing the largest."""
    certificates = [motion.certificate for motion in motions]
    starts = np.cumsum([0.0, *(motion.trajectory.duration for motion in motions)])
    worst = int(np.argmax([each.deviation_sampled for each in certificates]))
    slowest = max(certificates, key=lambda each: each.factor)
    peaks = {name: np.max([each.peaks[name] for each in certificates], axis=0) for name in LIMITS}
    certificate = attrs.evolve(
        certificates[worst],
        deviation=max(each.deviation for each in certificates),
        rotation=max(each.rotation for each in certificates),
        rotation_sampled=max(each.rotation_sampled or 0.0 for each in certificates),
        worst_time=float(starts[worst]) + certificates[worst].worst_time,
        knots=sum(each.knots for each in certificates),
        samples=sum(each.samples for each in certificates),
        peaks=peaks,
        factor=slowest.factor,
        because=slowest.because,
        backward=max(each.backward or 0.0 for each in certificates),
    )
    return CertifiedMotion(trajectory=join([motion.trajectory for motion in motions]), certificate=certificate)


def certificate_of(
    arm: AnyArm,
    trajectory: Trajectory,
    error: TrackingError,
    allowed: Tolerance,
    *,
    time: float | None = None,
    peaks: dict[LimitName, Array] | None = None,
    factor: float = 1.0,
    because: BindingLimit | None = None,
) -> Certificate:
    """Return the certificate of a motion, whatever its limits say.

    Args:
        arm: the arm, or a compiled one.
        trajectory: the motion.
        error: of the tool on it.
        allowed: what it was asked to keep.
        time: when the tool is farthest off [s]; as ``error`` has it when left out.
        peaks: of speeds, accelerations and efforts, where they are known.
        factor: how many times slower it is than the speed of the tool has it.
        because: which limit, and which joint, that is for.
    """
    solver = solver_of(arm)
    time = error.worst_time if time is None else time
    return Certificate(
        arm=solver.arm,
        deviation_tolerance=allowed.position,
        deviation=float(error.position.max()),
        deviation_sampled=float(error.sampled_position.max()),
        rotation_tolerance=allowed.orientation,
        rotation=float(error.orientation.max()),
        rotation_sampled=float(error.sampled_orientation.max()),
        worst_time=time,
        worst_position=np.asarray(solver.forward(_position(trajectory, time))[:3, 3]),
        knots=len(error.position) + 1,
        samples=error.samples * len(error.position),
        peaks=limit_peaks(arm, trajectory) if peaks is None else peaks,
        backward=error.backward,
        factor=factor,
        because=because,
    )


def _position(trajectory: Trajectory, t: float) -> Array:
    """Return where the joints (n,) are at a time from the start to the end of a trajectory."""
    k = segments_at(trajectory.times, t, len(trajectory.coefficients))
    terms = trajectory.coefficients[k]
    return np.asarray((t - trajectory.times[k]) ** np.arange(len(terms)) @ terms)


def fastest(
    arm: AnyArm,
    tracking: Tracking,
    allowed: Tolerance,
    *,
    nominal: float,
    period: float | None = None,
    weak: bool = False,
    ramp: float = 0.0,
) -> CertifiedMotion:
    """Return the fastest run along a followed path whose time is a mere parameter, inside all limits.

    Speeds and accelerations are kept point by point, efforts by running all of it slower.

    Args:
        arm: the arm, or a compiled one.
        tracking: the joints along the path at full speed from end to end.
        allowed: that they were asked to keep.
        nominal: how long it would take if no joint limited it [s].
        period: of the servo [s], to end on a whole number of them; any duration when left out.
        weak: whether a motion is run as it is where gravity alone takes more than a joint may give.
        ramp: as for ``timed``.

    Raises:
        IncapableArmError: gravity alone takes more than a joint may give, and ``weak`` is not set.
    """
    solver, path, error = solver_of(arm), tracking.trajectory, tracking.error
    run = timed(solver, path, np.ones(len(path.times) - 1), ramp=ramp)
    time = run.when(error.worst_time)
    trajectory, efforts, slower = _inside_efforts(solver, run.trajectory, weak=weak)
    stretch, factor = trajectory.duration / run.trajectory.duration, trajectory.duration / nominal
    peaks = stretched_peaks(run.speed, run.acceleration, efforts, stretch)
    because = None if factor <= 1 else run.because if slower is None else ("effort", slower)
    certificate = certificate_of(
        solver, trajectory, error, allowed, time=time * trajectory.duration, peaks=peaks, factor=max(1.0, factor),
        because=because,
    )  # fmt: skip
    motion = CertifiedMotion(trajectory=trajectory, certificate=certificate)
    return motion if period is None else motion.on_ticks(period)


def slowed_alike(arm: AnyArm, tracking: Tracking, allowed: Tolerance) -> CertifiedMotion:
    """Return a followed motion, all of it slowed until the joints keep their limits; efforts where that helps."""
    model, planned = solver_of(arm).arm, tracking.trajectory
    factor, because = slowing(model, planned)
    trajectory, _, slower = _inside_efforts(arm, planned.slowed(factor), weak=True)
    factor = trajectory.duration / planned.duration
    because = because if slower is None else ("effort", slower)
    time = tracking.error.worst_time * factor
    certificate = certificate_of(arm, trajectory, tracking.error, allowed, time=time, factor=factor, because=because)
    return CertifiedMotion(trajectory=trajectory, certificate=certificate)


def standstill(solver: Solver, q: Array, allowed: Tolerance) -> CertifiedMotion:
    """Return the motion to where the arm is."""
    certificate = Certificate(
        arm=solver.arm,
        deviation_tolerance=allowed.position,
        deviation=0.0,
        deviation_sampled=0.0,
        rotation_tolerance=allowed.orientation,
        rotation=0.0,
        rotation_sampled=0.0,
        worst_time=0.0,
        worst_position=solver.forward(q)[:3, 3],
        knots=1,
        samples=0,
        peaks=dict.fromkeys(LIMITS, np.zeros(len(solver.arm.all_limits.effort))),
        backward=0.0,
    )
    return CertifiedMotion(trajectory=hold(q, 0.0), certificate=certificate)


def limit_peaks(arm: AnyArm, trajectory: Trajectory) -> dict[LimitName, Array]:
    """Return the largest speeds, accelerations and efforts of all that has limits; no efforts where none is limited."""
    motion = limited_motion(solver_of(arm).arm, trajectory)
    return {"speed": motion.peaks(1), "acceleration": motion.peaks(2), "effort": _efforts(arm, trajectory)}


def _efforts(arm: AnyArm, trajectory: Trajectory) -> Array:
    """Return the largest efforts of all that has limits: at samples, but exactly where they come near a limit."""
    solver = solver_of(arm)
    limits = solver.arm.all_limits.effort
    if not np.isfinite(limits).any():
        return np.zeros(len(limits))
    m, _, n = trajectory.coefficients.shape
    shape = _SAMPLES + 2 * m + 1, n
    q, qd, qdd = solver.run(_sampled_states, [trajectory.times, trajectory.coefficients], shape, shape, shape)
    efforts = np.abs(limited_efforts(solver.arm, np.asarray(solver.inverse_dynamics(q, qd, qdd)))).max(axis=0)
    return effort_peaks(arm, trajectory).peaks if (efforts > _NEAR * limits).any() else np.asarray(efforts)


def _sampled_states(loops: Loops, *tables: Table) -> None:
    """Write positions, speeds and accelerations at the samples of ``_efforts``; read times and polynomials."""
    times, terms, q, qd, qdd = tables
    m, powers, n = terms.shape
    even = q.shape[0] - 2 * m - 1
    duration = times[m]
    (spread,) = loops.each([even], lambda i: [duration * (loops.number(i) / (even - 1))])
    (middles,) = loops.each([m], lambda i: [(times[i + 1] + times[i]) / 2])

    def written(first: Scalar, at: Table, segment: Callable[[Scalar], Scalar]) -> None:
        samples = at.shape[0]

        def where(i: Scalar) -> list[Scalar]:
            piece = segment(i)
            return [loops.number(piece), at[i] - times[piece]]

        pieces, local = loops.each([samples], where, 2)

        def state(i: Scalar, j: Scalar) -> tuple[Scalar, ...]:
            piece, t = loops.whole(pieces[i]), local[i]
            zero = 0.0 * t
            value, rate, bend = loops.walk(
                powers,
                (zero, zero, zero),
                lambda p, x, v, a: (x * t + terms[piece, p, j], v * t + x, a * t + v),
                reverse=True,
            )
            return value, rate, 2 * bend

        loops.fill([table.behind(first) for table in (q, qd, qdd)], [samples, n], state)

    written(0, spread, lambda i: loops.segment(times, spread[i], m))
    written(even, times, lambda i: loops.segment(times, times[i], m))
    written(even + m + 1, middles, lambda i: i + 0)
    # The sign of the speed of a joint that stands is rounding, and would give it Coulomb friction.
    (tops,) = loops.each([n], lambda j: [loops.largest(even + 2 * m + 1, lambda i: abs(qd[i, j]))])
    fastest = loops.largest(n, lambda j: tops[j])
    (moving,) = loops.each(qd.shape, lambda i, j: [select(abs(qd[i, j]) > _STANDS * fastest, qd[i, j], 0.0)])
    loops.fill([qd], qd.shape, lambda i, j: [moving[i, j]])


def _inside_efforts(arm: AnyArm, trajectory: Trajectory, *, weak: bool) -> tuple[Trajectory, Array, int | None]:
    """Return a motion slowed for its efforts, the largest of them, and for which joint, from 0, it is slowed."""
    efforts = _efforts(arm, trajectory)
    if (efforts <= _NEAR * solver_of(arm).arm.all_limits.effort).all():
        return trajectory, efforts, None
    try:
        slowing_down = slowing_for_efforts(arm, trajectory)
    except IncapableArmError:
        if not weak:
            raise
        return trajectory, efforts, None
    if slowing_down.joint is None:
        return trajectory, efforts, None
    trajectory = trajectory.slowed(slowing_down.factor)
    return trajectory, _efforts(arm, trajectory), slowing_down.joint
