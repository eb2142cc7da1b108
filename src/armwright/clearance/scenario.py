"""The preparation of a path for many simulations: the motion and the drive efforts without clearance."""

from __future__ import annotations

import math

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arrays import Array, ArrayLike, floats
from armwright.clearance.ideal import IdealMotion, close_pins, ideal_motion
from armwright.clearance.linkage import Coordinate, Linkage
from armwright.clearance.paths import ROUNDING, Path
from armwright.clearance.placement import Placement
from armwright.clearance.settings import Settings
from armwright.errors import InvalidValueError, ShapeError

# So many points of a path are solved one after the other, and from them all points between at once.
_COARSE = 60
# A path that takes less time is none, and nothing could be worked out on it [s].
_SHORTEST = 1e-9
# A coordinate that changes by more between two moments has jumped [rad, m].
_JUMP = 0.05


@attrs.frozen(kw_only=True, eq=False)
class Scenario:
    """A path prepared for many runs.

    Attributes:
        linkage: that moves.
        path: for its tip or its drives.
        settings: of the simulation.
        steps: how many there are.
        h: how long each is [s].
        stride: how many of them lie between two samples; the last sample is at the end.
        table: (rows, 3, columns) commands of the drives at the start, the middle and the end of each row. A row is a
            step, or a part of one: a step in which the acceleration jumps is made in parts that meet at the jump, since
            no rule of integration keeps its order across one.
        lengths: (rows,) how long each is [s].
        marks: (rows + 1,) the number of the step that begins with each row, and the end; -1 within a step.
        ideal: the motion without clearance at the start of each step and at the end of the last.
    """

    linkage: Linkage
    path: Path
    settings: Settings
    steps: int
    h: float
    stride: int
    table: Array
    lengths: Array
    marks: npt.NDArray[np.int64]
    ideal: IdealMotion


def prepare_scenario(
    linkage: Linkage, path: Path, settings: Settings | None = None, *, guess: ArrayLike | None = None
) -> Scenario:
    """Determine the commands of the drives that follow a path without clearance.

    Args:
        linkage: that moves.
        path: for its tip or its drives.
        settings: of the simulation.
        guess: (n,) coordinates near those at the start, in the same assembly; that of the linkage when left out.

    Raises:
        InvalidValueError: the path cannot be followed, or takes too many steps.
        ShapeError: it has not as many axes as there are drives.
    """
    settings = settings or Settings()
    if not _SHORTEST <= path.duration < math.inf:
        raise InvalidValueError(f"path {path.name}: expected a duration from {_SHORTEST:g} s, got {path.duration:g} s")
    by_tip = path.follower == "tip"
    axes = 2 if by_tip else len(linkage.drives)
    if path.pieces.shape[1] != axes:
        raise ShapeError(f"path {path.name}: expected {axes} axes for the {path.follower}, got {path.pieces.shape[1]}")
    steps = settings.steps(path.duration)
    stride = min(steps, max(1, round(settings.sample * steps / path.duration)))
    # A few more, where that is needed for the last sample to be at the end.
    steps = -(-steps // stride) * stride
    after, before = path.halves(steps)
    start = assembly_guess(linkage) if guess is None else floats(guess, "guess")
    q = close_pins_along(linkage, after.position, start, by_tip=by_tip)
    ideal = ideal_motion(linkage, q, after.velocity, after.acceleration, by_tip=by_tip)
    commands = _drive_commands(linkage, settings, ideal)
    table = np.stack([commands[:-1:2], commands[1::2], commands[2::2]], axis=1)
    # A step that ends where the acceleration jumps ends with the command before the jump.
    jumps = np.flatnonzero(np.any(after.acceleration != before.acceleration, axis=-1))
    jumps = jumps[(jumps > 0) & (jumps % 2 == 0)]
    if len(jumps):
        came = ideal_motion(linkage, q[jumps], before.velocity[jumps], before.acceleration[jumps], by_tip=by_tip)
        table[jumps // 2 - 1, 2] = _drive_commands(linkage, settings, came)
    table, lengths, marks = _split_at_jumps(linkage, path, settings, q[::2], table)
    return Scenario(
        linkage=linkage,
        path=path,
        settings=settings,
        steps=steps,
        h=path.duration / steps,
        stride=stride,
        table=np.ascontiguousarray(table),
        lengths=lengths,
        marks=marks,
        ideal=IdealMotion(**{name: x[::2] for name, x in attrs.asdict(ideal, recurse=False).items()}),
    )


def assembly_guess(linkage: Linkage) -> Array:
    """Return coordinates near those of the assembly that ``assembly`` of the linkage describes.

    Each free body is placed so that the first pin that joins it to a placed body is closed.
    """
    coordinates = linkage.rigid_coordinates
    q = np.array([linkage.assembly.get(body, 0.0) if kind in ("angle", "slide") else 0.0 for body, kind in coordinates])
    waiting = [body.name for body in linkage.bodies if linkage.joint(body.name) is None]
    while waiting:
        placement = Placement(linkage, list(q), [0.0] * len(q))
        for pin in linkage.pins:
            ends = [pin.bearing, pin.journal]
            loose = next((end for end in ends if end.body in waiting), None)
            other = next((end for end in ends if end.body not in waiting), None)
            if loose is not None and other is not None:
                shift = placement.point(other).position.minus(placement.point(loose).position)
                x = coordinates.index(Coordinate(loose.body, "x"))
                q[x : x + 2] += shift
                waiting.remove(loose.body)
                break
        else:
            raise InvalidValueError(f"{linkage.name}: no pin joins {', '.join(waiting)} to the other bodies")
    return q


def close_pins_along(linkage: Linkage, goals: Array, guess: Array, *, by_tip: bool) -> Array:
    """Return (s, n) closed coordinates along a path (s, 2) of the tip, or (s, d) of the drives, without a jump.

    Raises:
        InvalidValueError: the path leaves what can be reached, or passes a singular configuration.
    """
    picks = np.unique(np.linspace(0, len(goals) - 1, min(_COARSE, len(goals))).astype(int))
    coarse = [_close(linkage, guess, goals[0], by_tip=by_tip)]
    for pick in picks[1:]:
        # The last step is extrapolated, then corrected.
        ahead = 2 * coarse[-1] - coarse[-2] if len(coarse) > 1 else coarse[-1]
        coarse.append(_close(linkage, ahead, goals[pick], by_tip=by_tip))
    known = np.array(coarse)
    if len(picks) == 1:
        return known
    between = [np.interp(np.arange(len(goals)), picks, known[:, i]) for i in range(known.shape[1])]
    q = _close(linkage, np.stack(between, axis=-1), goals, by_tip=by_tip)
    jumps = np.abs(np.diff(q, axis=0)).max(axis=-1)
    # Between neighbouring times a body moves about as far as on average; to another assembly it jumps.
    if jumps.max() > _JUMP + 50 * jumps.mean():
        raise InvalidValueError(
            f"{linkage.name}: the path reaches a singular configuration at sample {int(jumps.argmax())} of "
            f"{len(goals)}, at which the linkage changes to another assembly"
        )
    return q


def _close(linkage: Linkage, guess: Array, goal: Array, *, by_tip: bool) -> Array:
    """Return closed coordinates for positions of the tip, or of the drives; see ``close_pins``."""
    return close_pins(linkage, guess, **{"tip" if by_tip else "drives": goal})


def _split_at_jumps(
    linkage: Linkage, path: Path, settings: Settings, q: Array, table: Array
) -> tuple[Array, Array, npt.NDArray[np.int64]]:
    """Return the table with its steps split where the acceleration jumps within them; lengths and marks of its rows."""
    steps = len(table)
    h = path.duration / steps
    grid = np.linspace(0.0, path.duration, steps + 1)
    knots = np.array([knot for knot in path.knots[1:-1] if np.abs(grid - knot).min() > ROUNDING * h])
    ends = np.union1d(grid, knots)
    marks = np.full(len(ends), -1)
    marks[np.searchsorted(ends, grid)] = np.arange(steps + 1)
    lengths = np.where((marks[:-1] >= 0) & (marks[1:] >= 0), h, np.diff(ends))
    number = np.maximum.accumulate(marks)[:-1]
    parts = np.flatnonzero((marks[:-1] < 0) | (marks[1:] < 0))
    rows = table[number]
    if len(parts):
        times = ends[parts, None] + lengths[parts, None] * (0.0, 0.5, 1.0)
        piece = np.searchsorted(path.knots, times[:, 1], side="right") - 1
        moment = path.evaluate(times, np.broadcast_to(piece[:, None], times.shape))
        by_tip = path.follower == "tip"
        near = np.broadcast_to(q[number[parts], None], (*times.shape, q.shape[1]))
        closed = _close(linkage, near, moment.position, by_tip=by_tip)
        ideal = ideal_motion(linkage, closed, moment.velocity, moment.acceleration, by_tip=by_tip)
        rows[parts] = _drive_commands(linkage, settings, ideal)
    return rows, lengths, marks


def _drive_commands(linkage: Linkage, settings: Settings, ideal: IdealMotion) -> Array:
    """Return the commands of the drives: efforts or prescribed accelerations; for a controller also goals."""
    driven = list(linkage.driven)
    prescribed = np.array([drive.kind == "motion" for drive in linkage.drives])
    commands = np.where(prescribed, ideal.qdd[..., driven], ideal.efforts)
    if settings.control == "effort":
        return commands
    parts = np.stack([commands, ideal.q[..., driven], ideal.qd[..., driven]], axis=-1)
    return parts.reshape(*parts.shape[:-2], -1)
