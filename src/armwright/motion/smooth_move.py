"""Moves of arms with flexible gears that leave little vibration: by input shapers, or by flat feedforward."""

from __future__ import annotations

from typing import Any, NamedTuple, get_args

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.dynamics.flexible_joints import links_at_rest, modes
from armwright.errors import IncapableArmError, InvalidValueError, counted, one_of
from armwright.files.result_table import ResultTable
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.deviation import distance_from_line, path_deviation
from armwright.motion.flat_feedforward import FlatMotion, flat_motion, ninth
from armwright.motion.limit_utilization import ROUNDING, slowing_for_limits
from armwright.motion.mode_shaping import Smoothing, mode_shaper
from armwright.motion.moves import Move
from armwright.motion.shaping import Shaper, ShaperKind, shaped
from armwright.motion.solver import AnyArm, solver_of
from armwright.motion.tolerance import Tolerance
from armwright.motion.trajectory import Trajectory, join
from armwright.simulation.flexible_joints import simulate_flexible
from armwright.simulation.integrators import Adaptive
from armwright.simulation.result import Status

# Configurations at which paths are compared.
_COMPARED = 2001
# Rounds in which a move is slowed until it keeps its limits, and what more it is slowed by.
_ROUNDS, _MORE = 30, 1e-3
# After its end an arm is watched for so many periods of its lowest mode, within these times [s].
_WATCHED, _WATCH = 5.0, (0.2, 10.0)
# An arm is at rest when its tool stays so near to its end [m].
_AT_REST = 1e-4
# So far apart may motors be where a leg ends and the next begins [rad], [m].
_GAP = 1e-5
# An end of a move is at rest where nothing is faster [rad/s], [m/s].
_STANDS = 1e-9


class Settling(NamedTuple):
    """How the tool comes to rest, the motors guided by a stiff servo.

    Attributes:
        residual: its largest distance, after the motors stand, from where it comes to rest [m].
        time: from which on it stays within 0.1 mm of that, since the start of the move [s]; None where it does not
            while it is watched.
    """

    residual: float
    time: float | None


@attrs.frozen(kw_only=True, eq=False)
class SmoothMove:
    """A move whose motors are commanded so that the arm vibrates little.

    Attributes:
        move: with the command of the motors as its trajectory.
        smoothing: how.
        frequencies: (k,) mean along the move, of the modes that are shaped [Hz]; none by flat feedforward.
        added: how much longer the move takes than it did [s].
        deviation: the largest distance of the tool from the path of the move as it was, seen at samples, on rigid
            gears; by flat feedforward that of the links [m].
        line: bounds of the distance and the angle of the tool from its straight lines, and what is allowed; None where
            no line was asked for.
        before: how the tool came to rest after the move as it was.
        after: how it comes to rest now.
        softer: the same with gears of 20 % less stiffness than the arm is known by.
    """

    move: Move
    smoothing: Smoothing
    frequencies: Array
    added: float
    deviation: float
    line: tuple[Tolerance, Tolerance] | None
    before: Settling
    after: Settling
    softer: Settling

    @property
    def notes(self) -> tuple[str, ...]:
        """What the command is."""
        notes = ["the motion is that of the motors behind their gears"]
        if self.smoothing == "flat":
            notes.append("the joints stop at every pose")
        if self.line is not None:
            found, allowed = self.line
            notes.append(
                f"straight lines are kept within {found.position * 1e3:.3f} of {allowed.position * 1e3:g} mm and "
                f"{found.orientation * 1e3:.3f} of {allowed.orientation * 1e3:g} mrad"
            )
        return tuple(notes)

    def as_data(self) -> dict[str, Any]:
        """Return it as plain data in SI units."""
        return {
            "smoothing": self.smoothing,
            "frequencies_hz": self.frequencies.tolist(),
            "added_s": self.added,
            "path_deviation_m": self.deviation,
            "line": None if self.line is None else self.line[0]._asdict(),
            **{name: getattr(self, name)._asdict() for name in ("before", "after", "softer")},
        }

    def table(self) -> ResultTable:
        """Return the table of vibrations before and after."""
        rows = []
        for name, settling in (("as it was", self.before), ("now", self.after), ("gears 20 % softer", self.softer)):
            time = "later" if settling.time is None else f"{settling.time:.3f}"
            rows.append((name, f"{settling.residual * 1e3:.4f}", time))
        shaped_modes = ", ".join(f"{f:.2f} Hz" for f in self.frequencies)
        how = f"{self.smoothing.upper()} for {shaped_modes}" if shaped_modes else "flat feedforward"
        return ResultTable(
            title=f"Vibration of the tool, {how}",
            heads=("move", "residual mm", "within 0.1 mm at s"),
            rows=rows,
            numbers=(1, 2),
            remark=f"{self.added:+.3f} s; path deviation {self.deviation * 1e3:.4f} mm",
        )


def smooth_move(
    arm: AnyArm, move: Move, smoothing: Smoothing, *, allowed: Tolerance, count: int = 2, tolerance: float = 0.05
) -> SmoothMove:
    """Return a move that leaves little vibration; it keeps the limits of speed, acceleration and effort.

    Shapers take the mean frequencies and damping along the move. Between poses at which the arm stops, every leg is
    shaped for itself.

    Args:
        arm: the arm, or a compiled one.
        move: of that arm, from rest to rest.
        smoothing: ``zv``, ``zvd`` or ``ei``, see ``shaper``; ``flat``, see ``flat_motion``.
        allowed: distance and angle of the tool from straight lines.
        count: how many modes are shaped, the slowest ones.
        tolerance: of ``ei``.

    Raises:
        UnsupportedArmError: no gear is flexible, drives are coupled, or the mass of a link is unknown.
        InvalidValueError: the move starts or ends in motion, a straight line would be left, or a path of the tool
            cannot be run that way.
        IncapableArmError: no slowing keeps the limits.
    """
    one_of("smoothing", smoothing, get_args(Smoothing))
    solver = solver_of(arm)
    planned = move.trajectory
    ends = planned(np.array((0.0, planned.duration)), 1)
    if np.abs(ends).max() > _STANDS:
        raise InvalidValueError("ends: a move that leaves no vibration starts and ends at rest; expected ends at rest")
    links_at_rest(solver.arm, planned(0.0))
    straight = bool(move.tool_path or move.detours)
    if smoothing == "flat":
        if straight:
            raise InvalidValueError(
                "flat feedforward needs four derivatives of the joints, and straight lines of the tool have two; "
                "expected a joint move, or zv, zvd or ei"
            )
        command = _flat(arm, move)
    else:
        command = _shaped(arm, move, smoothing, count=count, tolerance=tolerance)
    bounds = _straight(solver.arm, move, command.parts, smoothing, allowed) if straight else None
    motors = join(command.parts, gap=_GAP)
    times = np.append(0.0, np.cumsum([part.duration for part in command.parts]))
    passing = np.zeros(len(move.times))
    if len(times) != len(move.times):
        # One leg through all poses: of each the delayed time, and the distance in the space of the joints.
        stretch = command.before.duration / planned.duration
        times = np.clip(move.times * stretch + command.delay, 0, motors.duration)
        times[[0, -1]] = 0.0, motors.duration
        passing = _passing(motors, move.configurations)
    final = attrs.evolve(
        move, trajectory=motors, times=times, passing_distances=passing, tool_path=None, certificate=None, detours=()
    )
    softer = attrs.evolve(
        solver.arm,
        motors=[attrs.evolve(motor, stiffness=0.8 * motor.stiffness) for motor in solver.arm.motors],
    )
    return SmoothMove(
        move=final,
        smoothing=smoothing,
        frequencies=command.frequencies,
        added=motors.duration - planned.duration,
        deviation=path_deviation(solver.arm, planned, command.links),
        line=None if bounds is None else (bounds, allowed),
        before=settling(solver.arm, command.before),
        after=settling(solver.arm, motors),
        softer=settling(softer, motors),
    )


def settling(arm: Arm, motors: Trajectory) -> Settling:
    """Return how the tool comes to rest after a motion of the motors, by simulation with flexible gears.

    Args:
        arm: with n joints, of which some have flexible gears.
        motors: their motion behind the gears, from rest; the links start in equilibrium.

    Raises:
        UnsupportedArmError: no gear is flexible, drives are coupled, or the mass of a link is unknown.
        IncapableArmError: the gears do not carry the weight, or the simulation fails.
    """
    end = links_at_rest(arm, motors(motors.duration))
    watched = float(np.clip(_WATCHED / modes(arm, end).frequencies[0], *_WATCH))
    run = simulate_flexible(
        arm,
        links_at_rest(arm, motors(0.0)),
        duration=motors.duration + watched,
        motors=motors,
        integrator=Adaptive(rtol=1e-6, atol=1e-8),
        period=2e-3,
    )
    if run.status is not Status.FINISHED:
        raise IncapableArmError(f"the simulation with flexible gears ended at {run.t[-1]:.3f} s: {run.status.value}")
    distance = np.linalg.norm(forward(arm, run.q)[:, :3, 3] - forward(arm, end)[:3, 3], axis=1)
    far = np.flatnonzero(distance > _AT_REST)
    last = int(far[-1]) + 1 if len(far) else 0
    after = run.t >= motors.duration - 1e-9
    return Settling(float(distance[after].max()), float(run.t[last]) if last < len(run.t) else None)


class _Command(NamedTuple):
    """What smooths a move.

    Attributes:
        parts: of the motors, between stops.
        links: their motion on gears that yield as they should.
        before: the move as it was, slowed where the limits ask for it.
        frequencies: (k,) that are shaped [Hz].
        delay: by which a shaper is late on the mean [s].
    """

    parts: list[Trajectory]
    links: Trajectory
    before: Trajectory
    frequencies: Array
    delay: float


def _flat(arm: AnyArm, move: Move) -> _Command:
    """Return the command of flat feedforward from pose to pose."""
    legs = _flat_legs(arm, move)
    return _Command([leg.motors for leg in legs], join([leg.links for leg in legs]), move.trajectory, np.zeros(0), 0.0)


def _shaped(arm: AnyArm, move: Move, kind: ShaperKind, *, count: int, tolerance: float) -> _Command:
    """Return the command of shapers for the slowest modes."""
    by, frequencies = mode_shaper(solver_of(arm).arm, move.trajectory, kind, count=count, tolerance=tolerance)
    legs, parts = _shaped_legs(arm, _legs(move), by)
    return _Command(parts, join(parts), join(legs), frequencies, float(by.parts @ by.delays))


def _legs(move: Move) -> list[Trajectory]:
    """Return the parts of a move between its stops."""
    return [detour.trajectory for detour in move.detours] or [move.trajectory]


def _shaped_legs(arm: AnyArm, legs: list[Trajectory], by: Shaper) -> tuple[list[Trajectory], list[Trajectory]]:
    """Return legs, slowed where their efforts ask for it, as they are and shaped."""
    for _ in range(_ROUNDS):
        parts = [shaped(leg, by) if leg.duration else leg for leg in legs]
        factor, _because = slowing_for_limits(arm, join(parts))
        if factor <= 1 + ROUNDING:
            return legs, parts
        legs = [leg.slowed(factor * (1 + _MORE)) for leg in legs]
    raise IncapableArmError("no slower motion keeps its limits when it is shaped")


def _flat_legs(arm: AnyArm, move: Move) -> list[FlatMotion]:
    """Return legs of order 9 from pose to pose that keep the limits of links and motors."""
    legs = []
    model = solver_of(arm).arm
    for start, goal, planned in zip(move.configurations, move.configurations[1:], np.diff(move.times), strict=False):
        duration = float(planned)
        for _ in range(_ROUNDS):
            leg = flat_motion(model, ninth(start, goal, duration))
            factor, _because = leg.slowing(arm)
            if factor <= 1 + ROUNDING:
                legs.append(leg)
                break
            duration *= factor * (1 + _MORE)
        else:
            raise IncapableArmError(
                f"from pose {len(legs) + 1} to pose {len(legs) + 2} no slower motion of the motors keeps their limits"
            )
    return legs


def _straight(arm: Arm, move: Move, parts: list[Trajectory], smoothing: Smoothing, allowed: Tolerance) -> Tolerance:
    """Return bounds of how far shaped legs are from straight lines of the tool.

    Raises:
        InvalidValueError: they are farther than allowed, or no lines from stop to stop.
    """
    if len(parts) != len(move.poses) - 1:
        raise InvalidValueError(
            f"a path of the tool past {counted(len(move.poses) - 2, 'pose')} without a stop cannot be shaped; expected "
            "two poses, or a stop at each (--around)"
        )
    worst = Tolerance(0.0, 0.0)
    for i, part in enumerate(parts):
        if move.detours and move.detours[i].method != "line":
            raise InvalidValueError(f"the detour from pose {i + 1} to pose {i + 2} cannot be shaped; expected a line")
        found = distance_from_line(arm, part, move.poses[i], move.poses[i + 1]).largest
        if found.position > allowed.position or found.orientation > allowed.orientation:
            raise InvalidValueError(
                f"shaped by {smoothing}, the straight line from pose {i + 1} to pose {i + 2} would be left by up to "
                f"{found.position * 1e3:.3g} mm and {found.orientation * 1e3:.3g} mrad; {allowed.position * 1e3:g} mm "
                f"and {allowed.orientation * 1e3:g} mrad are allowed. A slower move, zv or fewer modes keep nearer; "
                "--deviation-mm allows more"
            )
        worst = Tolerance(*(max(pair) for pair in zip(worst, found, strict=True)))
    return worst


def _passing(command: Trajectory, configurations: Array) -> Array:
    """Return how near a motion passes configurations in the space of the joints, (k,), at samples."""
    q = command(np.linspace(0, command.duration, _COMPARED))
    return np.array([np.linalg.norm(q - each, axis=1).min() for each in configurations])
