"""Until when a run can be predicted: impacts magnify what nobody knows, until two runs have nothing in common.

A run is made again with clearances that differ by a nanometre, which no workshop and no instrument tells, and with half
the step. Until all of them are still together the run is a prediction; afterwards only their mean and their spread are.

Source:
    Spec of the clearance, 1.6: after the first impacts trajectories are chaotic.
"""

from collections.abc import Sequence

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.clearance.preparing import Task, prepare
from armwright.clearance.simulation import Simulation, simulate
from armwright.errors import InvalidValueError

# By how much the clearances of runs differ that nobody can tell apart [m], and how many runs fill a vector.
PERTURBATION, TWINS = 1e-9, 15
# Runs that are farther from one another have parted [m]. Runs with half the step must be nearer by this factor: after
# an impact the error of a step is of first order, twice what halving it changes, and chance doubles that.
APART, FINER = 1e-5, 4.0


@attrs.frozen(kw_only=True, eq=False)
class Outlook:
    """How far ahead a run tells what would happen.

    Attributes:
        until: the last time at which all runs beside it are within ``APART`` of it, and those with half the step within
            a quarter of that [s].
        mean: (s, 2) mean error of the tip over all of them [m].
        spread: (s, 2) its standard deviation over them [m].
        to_the_end: whether the whole run is a prediction.
        halved: whether runs with half the step are among them.
    """

    until: float
    mean: Array
    spread: Array
    to_the_end: bool
    halved: bool


def perturbed(clearances: Array, count: int = TWINS) -> Array:
    """Return (count + 1, ..., p) clearances: as they are, and others a nanometre or less away, always the same."""
    shifts = np.random.default_rng(0).uniform(-PERTURBATION, PERTURBATION, (count, clearances.shape[-1]))
    lead = (count, *(1,) * (clearances.ndim - 1), clearances.shape[-1])
    # Contact needs some play.
    others = np.maximum(clearances + shifts.reshape(lead), clearances / 2)
    return np.concatenate([clearances[None], others])


def with_outlook(
    task: Task, clearances: Array, *, friction: float | None = None, threads: int | None = None
) -> tuple[Simulation, Outlook]:
    """Return a run, its bits as ``simulate`` has them alone, and until when it is a prediction.

    Args:
        task: the path, made ready.
        clearances: (p,) of the pins [m].
        friction: coefficient of friction; that of the material when left out.
        threads: how many cores to use.

    Raises:
        InvalidValueError: see ``simulate``.
    """
    rows = perturbed(np.asarray(clearances, dtype=np.float64))
    own = simulate(task, rows, frictions=friction, threads=threads)
    errors = [own.error]
    try:
        finer = attrs.evolve(task.settings, step=task.h / 2, sample=task.stride * task.h)
        halved = prepare(task.linkage, task.path, finer, guess=task.ideal.q[0])
        errors.append(simulate(halved, rows, frictions=friction, threads=threads).error[:, : len(own.time)])
    except InvalidValueError:
        # Twice as many steps as are ever made.
        halved = None
    together = [one for one in errors if one.shape == own.error.shape]
    return taken(own, 0), _outlook(own.time, together)


def taken(simulation: Simulation, number: int) -> Simulation:
    """Return one run of several side by side."""
    names = ("clearances", "frictions", "q", "qd", "tip", "error", "forces", "impacts", "peaks", "status")
    return attrs.evolve(
        simulation,
        works={name: one[number] for name, one in simulation.works.items()},
        **{name: getattr(simulation, name)[number] for name in names},
    )


def _outlook(time: Array, errors: Sequence[Array]) -> Outlook:
    all_of_them = np.concatenate(errors)
    with np.errstate(invalid="ignore", over="ignore"):
        apart = [np.linalg.norm(one - all_of_them[0], axis=-1).max(axis=0) for one in errors]
        within = [one <= limit for one, limit in zip(apart, (APART, APART / FINER), strict=False)]
        parted = np.flatnonzero(~np.all(within, axis=0))
        mean, spread = all_of_them.mean(axis=0), all_of_them.std(axis=0)
    first = int(parted[0]) if len(parted) else len(time)
    return Outlook(
        # The last moment at which all were together.
        until=float(time[max(first - 1, 0)]),
        mean=np.asarray(mean, dtype=np.float64),
        spread=np.asarray(spread, dtype=np.float64),
        to_the_end=first == len(time),
        halved=len(errors) > 1,
    )
