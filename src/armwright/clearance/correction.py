"""Paths that a linkage with play follows to the right places: nodes, or the whole path, moved against the error.

Correcting is a fixed point, not a search: where the tip comes out by e beside its goal, the path is told to go by e the
other way, and one or two simulations later the goal is met. What is taken away is the mean error over runs that nobody
can tell apart, since after some impacts a single one is left to chance; where the clearances are known as a
distribution, the mean over that.

Source:
    Spec of the clearance, 4.5; thesis, 5.3.
"""

from __future__ import annotations

from collections.abc import Callable
from math import comb

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, floats
from armwright.clearance.ideal import ideal_motion, sensitivity
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import Path, PickAndPlace, hermite
from armwright.clearance.predictability import perturbed
from armwright.clearance.scenario import assembly_guess, closed_along, prepare
from armwright.clearance.settings import Settings
from armwright.clearance.simulation import Simulation, Status, simulate
from armwright.errors import InvalidValueError, ShapeError

# Corrections beyond this belong to another fault than play [m].
_LARGEST = 0.02
# Of the shift of a whole path: closer together than a simulation is sampled they tell nothing more.
_MOST_KNOTS = 1000
# The error falls to a millionth within three; what is left then is chance.
_MOST_ROUNDS = 100


@attrs.frozen(kw_only=True, eq=False)
class Correction:
    """A path corrected for play.

    Attributes:
        path: what to tell the linkage, of the best round.
        nodes: (k, 2) of the path as told [m].
        before: (r, j) error at the goals of the path as it was, of r runs: those of the samples of the clearances, or
            where these are known, sixteen that nobody can tell apart [m].
        after: (r, j) error there of the corrected one; what it differs by from run to run is chance [m].
        history: mean error at the goals before the first and after each round [m].
        best: number of the round whose path this is; 0 for the path as it was.
    """

    path: Path
    nodes: Array
    before: Array
    after: Array
    history: tuple[float, ...]
    best: int


def correct_nodes(
    linkage: Linkage,
    wanted: PickAndPlace,
    clearances: ArrayLike,
    settings: Settings | None = None,
    *,
    rounds: int = 3,
    progress: Callable[[float], None] | None = None,
) -> Correction:
    """Move the nodes of a pick-and-place path so that the tip comes to where they were.

    Args:
        linkage: with p pins.
        wanted: the path whose nodes are the goals.
        clearances: (p,) known, or (s, p) samples of what is known [m].
        settings: how it is simulated.
        rounds: how often the nodes are moved.
        progress: told the mean error after each simulation [m].

    Raises:
        InvalidValueError: the linkage diverges, or more than 20 mm would be needed.
    """

    def told(nodes: Array) -> Path:
        return attrs.evolve(wanted, nodes=nodes).path()

    goals = np.array(wanted.nodes)
    return _corrected(linkage, told, goals, goals, clearances, settings, rounds, progress)


def correct_path(
    linkage: Linkage,
    wanted: Path,
    clearances: ArrayLike,
    settings: Settings | None = None,
    *,
    knots: int = 20,
    rounds: int = 3,
    progress: Callable[[float], None] | None = None,
) -> Correction:
    """Move a whole path against the error: a smooth shift with equally spaced knots is added to it.

    Args:
        linkage: with p pins.
        wanted: the path that the tip shall follow.
        clearances: (p,) known, or (s, p) samples of what is known [m].
        settings: how it is simulated.
        knots: of the shift.
        rounds: how often the path is moved.
        progress: told the mean error after each simulation [m].

    Raises:
        InvalidValueError: the linkage diverges, the number of knots cannot be, or more than 20 mm would be needed.
    """
    if not 2 <= knots <= _MOST_KNOTS:
        raise InvalidValueError(f"knots: expected 2 to {_MOST_KNOTS}, got {knots}")
    times = np.linspace(0.0, wanted.duration, knots)
    timed = attrs.evolve(wanted, targets=tuple(times.tolist()))
    goals = wanted.at(times).at

    def told(nodes: Array) -> Path:
        return shifted(timed, times, nodes - goals)

    return _corrected(linkage, told, goals, goals, clearances, settings, rounds, progress)


def shifted(path: Path, times: Array, shifts: Array) -> Path:
    """Return a path to which a smooth shift is added.

    Args:
        path: with cubic pieces or simpler ones.
        times: (k,) increasing, from its start to its end [s].
        shifts: (k, 2) there [m]; at rest at both ends.
    """
    slopes = np.gradient(shifts, times, axis=0)
    slopes[[0, -1]] = 0.0
    knots = np.union1d(path.knots, times)
    # Times that rounding keeps apart are one.
    knots = knots[np.append(True, np.diff(knots) > 1e-12)]
    extra = hermite(path.name, times.tolist(), shifts, slopes, ())
    middle = (knots[:-1] + knots[1:]) / 2
    size = max(path.pieces.shape[-1], 4)
    pieces = np.zeros((len(middle), 2, size))
    for one in (path, extra):
        number = np.searchsorted(one.knots, middle, side="right") - 1
        pieces += _moved(one.pieces[number], knots[:-1] - one.knots[number], size)
    return attrs.evolve(path, knots=knots, pieces=pieces)


def contact_forces(linkage: Linkage, path: Path, samples: int = 201) -> tuple[Array, Array]:
    """Return times (s,) and the forces (s, p, 2) that the bearings carry where there is no play [N].

    Where one comes near to nothing or turns about, the journal leaves its wall: see ``lost_contacts``.
    """
    times = np.linspace(0.0, path.duration, samples)
    moment = path.at(times)
    by_tip = path.of == "tip"
    q = closed_along(linkage, moment.at, assembly_guess(linkage), by_tip=by_tip)
    motion = ideal_motion(linkage, q, moment.velocity, moment.acceleration, by_tip=by_tip)
    return times, motion.reactions


def lost_contacts(
    linkage: Linkage, path: Path, least: float = 1.0, samples: int = 2001
) -> dict[str, list[tuple[float, float]]]:
    """Return by pin from when to when its journal may leave the wall: the force is small, or turns about quickly.

    Args:
        linkage: with p pins.
        path: for its tip or drives.
        least: force that holds a journal to its wall [N].
        samples: at how many times to look.
    """
    times, forces = contact_forces(linkage, path, samples)
    found = {}
    for i, pin in enumerate(linkage.pins):
        force = forces[:, i]
        size = np.linalg.norm(force, axis=-1)
        # A jump of the acceleration that turns the force by more than a right angle throws the journal across.
        turned = np.append((force[1:] * force[:-1]).sum(axis=-1) < 0, False)
        loose = np.flatnonzero((size < least) | turned)
        runs = np.split(loose, np.flatnonzero(np.diff(loose) > 1) + 1) if len(loose) else []
        found[pin.name] = [(float(times[run[0]]), float(times[min(run[-1] + 1, samples - 1)])) for run in runs]
    return found


def leaning_error(linkage: Linkage, path: Path, clearances: ArrayLike, samples: int = 201) -> tuple[Array, Array]:
    """Return times (s,) and the error (..., s, 2) of a tip whose journals never leave their walls [m].

    Every journal leans where the force of the linkage without play presses it: no simulation is needed.

    Args:
        linkage: with p pins.
        path: for its tip.
        clearances: (..., p) [m].
        samples: at how many times.
    """
    times = np.linspace(0.0, path.duration, samples)
    moment = path.at(times)
    q = closed_along(linkage, moment.at, assembly_guess(linkage), by_tip=True)
    force = ideal_motion(linkage, q, moment.velocity, moment.acceleration, by_tip=True).reactions
    direction = force / np.maximum(np.linalg.norm(force, axis=-1, keepdims=True), 1e-12)
    B = np.einsum("sapb,spb->sap", sensitivity(linkage, q), direction)
    return times, np.asarray(np.einsum("sap,...p->...sa", B, floats(clearances, "clearances")), dtype=np.float64)


# ---- inside --------------------------------------------------------------------------------------------------------


def _corrected(  # noqa: PLR0917 - what both kinds of corrections have in common
    linkage: Linkage,
    told: Callable[[Array], Path],
    goals: Array,
    nodes: Array,
    clearances: ArrayLike,
    settings: Settings | None,
    rounds: int,
    progress: Callable[[float], None] | None,
) -> Correction:
    if not 0 <= rounds <= _MOST_ROUNDS:
        raise InvalidValueError(f"rounds: expected 0 to {_MOST_ROUNDS}, got {rounds}")
    c = floats(clearances, "clearances")
    if c.ndim not in (1, 2):
        raise ShapeError(f"clearances: expected one row or several, got shape {c.shape}")
    runs = perturbed(c) if c.ndim == 1 else c
    tried: list[tuple[Array, Array]] = []
    history: list[float] = []
    for turn in range(rounds + 1):
        missing = misses(simulate(prepare(linkage, told(nodes), settings), runs), goals)
        tried.append((nodes, np.asarray(np.linalg.norm(missing, axis=-1), dtype=np.float64)))
        history.append(float(tried[-1][1].mean()))
        if progress is not None:
            progress(history[-1])
        if turn < rounds:
            nodes = nodes - missing.mean(axis=0)
            if np.abs(nodes - goals).max() > _LARGEST:
                raise InvalidValueError(
                    f"{linkage.name}: a correction of {np.abs(nodes - goals).max() * 1e3:.1f} mm would be needed; "
                    f"more than {_LARGEST * 1e3:g} mm is no play"
                )
    # Where impacts change from round to round the last is not the best.
    best = int(np.argmin(history))
    nodes, after = tried[best]
    return Correction(path=told(nodes), nodes=nodes, before=tried[0][1], after=after, history=tuple(history), best=best)


def misses(simulation: Simulation, goals: Array) -> Array:
    """Return (..., j, 2) by how much the tip is beside its goals (j, 2) at the targets of the path [m].

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
    return np.asarray(tip_at(simulation, times) - goals, dtype=np.float64)


def tip_at(simulation: Simulation, times: Array) -> Array:
    """Return (..., j, 2) where the tip was at times (j,), between samples by cubic interpolation [m]."""
    t, tip = simulation.time, simulation.tip
    step = t[1] - t[0]
    number = np.clip((times / step).astype(int), 0, len(t) - 2)
    u = ((times - t[number]) / step)[:, None]
    speed = np.gradient(tip, step, axis=-2, edge_order=2 if len(t) > 2 else 1) * step
    a, b = tip[..., number, :], tip[..., number + 1, :]
    va, vb = speed[..., number, :], speed[..., number + 1, :]
    return np.asarray(a + u * (va + u * (3 * (b - a) - 2 * va - vb + u * (2 * (a - b) + va + vb))), dtype=np.float64)


def _moved(pieces: Array, by: Array, size: int) -> Array:
    """Return polynomials (m, 2, k) in a time that begins later, by (m,), with room for ``size`` coefficients."""
    new = np.zeros((*pieces.shape[:2], size))
    for i in range(pieces.shape[-1]):
        for j in range(i + 1):
            new[..., j] += pieces[..., i] * comb(i, j) * by[:, None] ** (i - j)
    return new
