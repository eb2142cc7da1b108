"""The correction of paths for joint clearance: nodes, or the entire path, are moved against the error.

The correction is a fixed-point iteration, not a search: where the tip has the error e at its goal, the commanded path
is moved by -e, and after one or two simulations the tip reaches the goal. The correction is the mean error over
indistinguishable runs, since after some impacts a single run is random; where the clearances are known as a
distribution, it is the mean over that. A round that leaves more of the mean than the best one is not gone on from: the
best path is moved once more, by half as much.

An entire path is moved at some knots, smoothly between them. Where these are closer than half a period of the journals
that roll along their walls, the shift itself accelerates the tip so that the mean error at the knots does not go away;
where they are farther apart, the tip swings freely between them.

Source:
    Spec of the clearance, 4.5; thesis, 5.3.
"""

from __future__ import annotations

from collections.abc import Callable
from math import comb

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, floats
from armwright.clearance.ideal import ideal_motion
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import Path, PickAndPlace, hermite_path
from armwright.clearance.predictability import perturb_clearances
from armwright.clearance.scenario import assembly_guess, close_pins_along, prepare_scenario
from armwright.clearance.settings import Settings
from armwright.clearance.simulation import Simulation, Status, simulate
from armwright.errors import InvalidValueError, ShapeError

# Larger corrections have another cause than clearance [m].
_MAX_CORRECTION = 0.02
# Knots of the shift of a path: more would be closer together than the samples of a simulation.
_MAX_KNOTS = 1000
# Three rounds reduce the error to a millionth; the remainder is random.
_MAX_ROUNDS = 100


@attrs.frozen(kw_only=True, eq=False)
class Correction:
    """A path corrected for joint clearance.

    Attributes:
        path: the commanded path of the best round.
        nodes: (k, 2) of the commanded path [m].
        before: (r, j) error at the goals of the original path, of r runs: one for each sample of the clearances, or
            sixteen indistinguishable ones where these are known [m].
        after: (r, j) error there of the corrected path; its scatter over the runs is random [m].
        mean_error: (j, 2) mean of the errors of the corrected path over the runs, which further rounds would remove; it
            is known but for its standard error [m].
        standard_error: (j, 2) that of the mean error: the spread of the runs by the root of their number [m].
        history: mean distance from the goals before the first and after each round [m].
        left: magnitude of the mean error in the same rounds, averaged over the goals [m].
        best: number of the round whose path this is, that with the least of it; 0 for the original path.
    """

    path: Path
    nodes: Array
    before: Array
    after: Array
    mean_error: Array
    standard_error: Array
    history: tuple[float, ...]
    left: tuple[float, ...]
    best: int


def correct_nodes(
    linkage: Linkage,
    goal: PickAndPlace,
    clearances: ArrayLike,
    settings: Settings | None = None,
    *,
    rounds: int = 3,
    progress: Callable[[float], None] | None = None,
) -> Correction:
    """Move the nodes of a pick-and-place path so that the tip reaches their original positions.

    Args:
        linkage: with p pins.
        goal: the path whose nodes are the goals.
        clearances: (p,) known, or (s, p) samples of their distribution [m].
        settings: of the simulation.
        rounds: how often the nodes are moved.
        progress: called with the mean error after each simulation [m].

    Raises:
        InvalidValueError: the linkage diverges, or more than 20 mm would be needed.
    """

    def commanded(nodes: Array) -> Path:
        return attrs.evolve(goal, nodes=nodes).path()

    return _correct_iteratively(linkage, commanded, np.array(goal.nodes), clearances, settings, rounds, progress)


def correct_path(
    linkage: Linkage,
    goal: Path,
    clearances: ArrayLike,
    settings: Settings | None = None,
    *,
    knots: int = 20,
    rounds: int = 5,
    progress: Callable[[float], None] | None = None,
) -> Correction:
    """Move an entire path against the error: a smooth shift with equally spaced knots is added to it.

    Args:
        linkage: with p pins.
        goal: the path that the tip is to follow.
        clearances: (p,) known, or (s, p) samples of their distribution [m].
        settings: of the simulation.
        knots: of the shift.
        rounds: how often the path is moved.
        progress: called with the mean error after each simulation [m].

    Raises:
        InvalidValueError: the linkage diverges, the number of knots is out of range, or a correction exceeds 20 mm.
    """
    if not 2 <= knots <= _MAX_KNOTS:
        raise InvalidValueError(f"knots: expected 2 to {_MAX_KNOTS}, got {knots}")
    times = np.linspace(0.0, goal.duration, knots)
    timed = attrs.evolve(goal, targets=tuple(times.tolist()))
    goals = goal.evaluate(times).position

    def commanded(nodes: Array) -> Path:
        return shift_path(timed, times, nodes - goals)

    return _correct_iteratively(linkage, commanded, goals, clearances, settings, rounds, progress)


def shift_path(path: Path, times: Array, shifts: Array) -> Path:
    """Return a path to which a smooth shift is added.

    Args:
        path: with polynomial pieces.
        times: (k,) increasing, from its start to its end [s].
        shifts: (k, 2) at these times [m]; at rest at both ends.
    """
    slopes = np.gradient(shifts, times, axis=0)
    slopes[[0, -1]] = 0.0
    knots = np.union1d(path.knots, times)
    # Times that differ by rounding are equal.
    knots = knots[np.append(True, np.diff(knots) > 1e-12)]
    extra = hermite_path(path.name, times.tolist(), shifts, slopes, ())
    middle = (knots[:-1] + knots[1:]) / 2
    size = max(path.pieces.shape[-1], 4)
    pieces = np.zeros((len(middle), 2, size))
    for part in (path, extra):
        number = np.searchsorted(part.knots, middle, side="right") - 1
        pieces += _delay_polynomials(part.pieces[number], knots[:-1] - part.knots[number], size)
    return attrs.evolve(path, knots=knots, pieces=pieces)


def ideal_contact_forces(linkage: Linkage, path: Path, samples: int = 201) -> tuple[Array, Array]:
    """Return times (s,) and the forces (s, p, 2) on the bearings without clearance [N].

    Where a force is small or reverses its direction, the journal leaves its wall: see ``predict_contact_loss``.
    """
    times = np.linspace(0.0, path.duration, samples)
    state = path.evaluate(times)
    by_tip = path.follower == "tip"
    q = close_pins_along(linkage, state.position, assembly_guess(linkage), by_tip=by_tip)
    return times, ideal_motion(linkage, q, state.velocity, state.acceleration, by_tip=by_tip).reactions


def predict_contact_loss(
    linkage: Linkage, path: Path, least: float = 1.0, samples: int = 2001
) -> dict[str, list[tuple[float, float]]]:
    """Return by pin the intervals in which its journal may leave the wall: its force is small, or reverses quickly.

    Args:
        linkage: with p pins.
        path: for its tip or drives.
        least: force that keeps a journal on its wall [N].
        samples: number of times at which the force is evaluated.
    """
    times, forces = ideal_contact_forces(linkage, path, samples)
    intervals = {}
    for i, pin in enumerate(linkage.pins):
        force = forces[:, i]
        size = np.linalg.norm(force, axis=-1)
        # A jump of the acceleration that rotates the force by more than a right angle throws the journal across.
        reversal = np.append((force[1:] * force[:-1]).sum(axis=-1) < 0, False)
        loose = np.flatnonzero((size < least) | reversal)
        runs = np.split(loose, np.flatnonzero(np.diff(loose) > 1) + 1) if len(loose) else []
        intervals[pin.name] = [(float(times[run[0]]), float(times[min(run[-1] + 1, samples - 1)])) for run in runs]
    return intervals


# ---- inside --------------------------------------------------------------------------------------------------------


def _correct_iteratively(  # noqa: PLR0917 - the inputs that both kinds of correction share
    linkage: Linkage,
    commanded: Callable[[Array], Path],
    goals: Array,
    clearances: ArrayLike,
    settings: Settings | None,
    rounds: int,
    progress: Callable[[float], None] | None,
) -> Correction:
    """Move the nodes of a path against the mean error at its goals (j, 2), which are the nodes of the original path."""
    if not 0 <= rounds <= _MAX_ROUNDS:
        raise InvalidValueError(f"rounds: expected 0 to {_MAX_ROUNDS}, got {rounds}")
    c = floats(clearances, "clearances")
    if c.ndim not in (1, 2):
        raise ShapeError(f"clearances: expected one row or several, got shape {c.shape}")
    runs = perturb_clearances(c) if c.ndim == 1 else c
    nodes, gain = goals, 1.0
    tried: list[tuple[Array, Array]] = []
    history: list[float] = []
    left: list[float] = []
    for round_number in range(rounds + 1):
        errors = tip_errors(simulate(prepare_scenario(linkage, commanded(nodes), settings), runs), goals)
        tried.append((nodes, errors))
        history.append(float(np.linalg.norm(errors, axis=-1).mean()))
        left.append(float(np.linalg.norm(errors.mean(axis=0), axis=-1).mean()))
        if progress is not None:
            progress(history[-1])
        # Where impacts change from round to round the last is not the best.
        best = int(np.argmin(left))
        if best < round_number:
            gain /= 2
        if round_number < rounds:
            nodes = tried[best][0] - gain * tried[best][1].mean(axis=0)
            largest = np.abs(nodes - goals).max()
            if largest > _MAX_CORRECTION:
                raise InvalidValueError(
                    f"{linkage.name}: a correction of {largest * 1e3:.1f} mm would be needed; "
                    f"more than {_MAX_CORRECTION * 1e3:g} mm is no clearance"
                )
    nodes, errors = tried[best]
    return Correction(
        path=commanded(nodes),
        nodes=nodes,
        before=np.asarray(np.linalg.norm(tried[0][1], axis=-1), dtype=np.float64),
        after=np.asarray(np.linalg.norm(errors, axis=-1), dtype=np.float64),
        mean_error=np.asarray(errors.mean(axis=0), dtype=np.float64),
        standard_error=np.asarray(errors.std(axis=0, ddof=1) / np.sqrt(len(errors)), dtype=np.float64),
        history=tuple(history),
        left=tuple(left),
        best=best,
    )


def tip_errors(simulation: Simulation, goals: Array) -> Array:
    """Return (..., j, 2) the errors of the tip from its goals (j, 2) at the targets of the path [m].

    Raises:
        InvalidValueError: a run diverged, or the targets are not as many as the goals.
    """
    times = np.array(simulation.scenario.path.targets)
    if len(times) != len(goals):
        raise InvalidValueError(f"expected one target for each of {len(goals)} goals, got {len(times)}")
    if np.any(simulation.status != Status.FINISHED):
        raise InvalidValueError(
            f"{simulation.scenario.linkage.name}: the simulation diverged; the path cannot be corrected"
        )
    return np.asarray(tip_positions(simulation, times) - goals, dtype=np.float64)


def tip_positions(simulation: Simulation, times: Array) -> Array:
    """Return (..., j, 2) positions of the tip at times (j,), by cubic interpolation of the samples [m]."""
    t, tip = simulation.time, simulation.tip
    step = t[1] - t[0]
    number = np.clip((times / step).astype(int), 0, len(t) - 2)
    u = ((times - t[number]) / step)[:, None]
    speed = np.gradient(tip, step, axis=-2, edge_order=2 if len(t) > 2 else 1) * step
    a, b = tip[..., number, :], tip[..., number + 1, :]
    va, vb = speed[..., number, :], speed[..., number + 1, :]
    return np.asarray(a + u * (va + u * (3 * (b - a) - 2 * va - vb + u * (2 * (a - b) + va + vb))), dtype=np.float64)


def _delay_polynomials(pieces: Array, delay: Array, size: int) -> Array:
    """Return polynomials (m, 2, k) in a time that begins later, by (m,), with room for ``size`` coefficients."""
    new = np.zeros((*pieces.shape[:2], size))
    for i in range(pieces.shape[-1]):
        for j in range(i + 1):
            new[..., j] += pieces[..., i] * comb(i, j) * delay[:, None] ** (i - j)
    return new
