"""The predictability of a run: impacts magnify unknown differences, until two runs have nothing in common.

A run is repeated with clearances that differ by a nanometre, which no workshop and no instrument resolves, and with a
half and a third of the step. As long as all repetitions agree the run is a prediction; afterwards only their mean and
their spread are.

Source:
    Spec of the clearance, 1.6: after the first impacts trajectories are chaotic.
"""

from __future__ import annotations

import contextlib

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.clearance.scenario import Scenario, prepare_scenario
from armwright.clearance.simulation import Simulation, simulate
from armwright.clearance.worn_walls import WornWalls
from armwright.errors import InvalidValueError

# The difference of the clearances of indistinguishable runs [m], and how many of them beside the first fill a vector.
PERTURBATION, MAX_REPLICATES = 1e-9, 15
# Runs that are farther from one another have diverged [m]. With smaller steps they must be nearer by a factor: after an
# impact the error of a step is of first order, half as much again as what a third of it changes, and random variation
# more than doubles that. One of them may meet an impact at the same part of its step as the whole one, and hardly both.
MAX_DISTANCE, STEP_DIVISORS, DISTANCE_DIVISOR = 1e-5, (2, 3), 4.0


@attrs.frozen(kw_only=True, eq=False)
class Predictability:
    """The time until which a run is a prediction, and the scatter of its repetitions.

    Attributes:
        until: the last time at which all repetitions are within ``MAX_DISTANCE`` of it, and those with smaller steps
            within a quarter of that [s].
        mean: (s, 2) mean error of the tip over all of them [m].
        spread: (s, 2) its standard deviation over them [m].
        to_the_end: whether the whole run is a prediction.
        finer: whether runs with a half and a third of the step are among them.
    """

    until: float
    mean: Array
    spread: Array
    to_the_end: bool
    finer: bool


def perturb_clearances(clearances: Array, count: int = MAX_REPLICATES) -> Array:
    """Return (count + 1, ..., p) clearances: the original ones, then the same others at most a nanometre away."""
    shifts = np.random.default_rng(0).uniform(-PERTURBATION, PERTURBATION, (count, clearances.shape[-1]))
    lead = (count, *(1,) * (clearances.ndim - 1), clearances.shape[-1])
    # Contact needs a clearance above 0.
    others = np.maximum(clearances + shifts.reshape(lead), clearances / 2)
    return np.concatenate([clearances[None], others])


def simulate_with_predictability(
    scenario: Scenario,
    clearances: Array,
    *,
    friction: float | None = None,
    threads: int | None = None,
    worn: WornWalls | None = None,
) -> tuple[Simulation, Predictability]:
    """Return a run, bit by bit that of ``simulate`` alone, and its predictability.

    Args:
        scenario: the prepared path.
        clearances: (p,) of the pins [m].
        friction: coefficient of friction; that of the material when left out.
        threads: how many cores to use.
        worn: the walls of its pins, where they are worn.

    Raises:
        InvalidValueError: see ``simulate``.
    """
    rows = perturb_clearances(np.asarray(clearances, dtype=np.float64))
    own = simulate(scenario, rows, frictions=friction, threads=threads, worn=worn)
    smaller_steps = []
    for parts in STEP_DIVISORS:
        settings = attrs.evolve(scenario.settings, step=scenario.h / parts, sample=scenario.stride * scenario.h)
        # The steps may be more than the limit.
        with contextlib.suppress(InvalidValueError):
            again = prepare_scenario(scenario.linkage, scenario.path, settings, guess=scenario.ideal.q[0])
            finer_run = simulate(again, rows, frictions=friction, threads=threads, worn=worn)
            smaller_steps.append(finer_run.error[:, : len(own.time)])
    complete = [error.shape for error in smaller_steps] == [own.error.shape] * len(STEP_DIVISORS)
    finer = np.concatenate(smaller_steps) if complete else None
    return select_run(own, 0), _predictability(own.time, own.error, finer)


def select_run(simulation: Simulation, number: int) -> Simulation:
    """Return one run of several side by side."""
    names = ("clearances", "frictions", "q", "qd", "tip", "error", "forces", "impacts", "peaks", "status")
    payloads = None if simulation.payloads is None else simulation.payloads[number]
    return attrs.evolve(
        simulation,
        payloads=payloads,
        works={name: work[number] for name, work in simulation.works.items()},
        **{name: getattr(simulation, name)[number] for name in names},
    )


def last_time_together(time: Array, errors: Array, within: float) -> Array:
    """Return (...) the last time up to which runs stay together [s].

    Args:
        time: (s,) of the samples [s].
        errors: (r, ..., s, 2) of r runs; the others are compared with the first [m].
        within: largest distance from it [m].
    """
    with np.errstate(invalid="ignore", over="ignore"):
        apart = np.linalg.norm(errors - errors[0], axis=-1).max(axis=0)
        # Infinite distances and NaN are not near.
        near = apart <= within
    first = np.where(near.all(axis=-1), len(time), np.argmin(near, axis=-1))
    return np.asarray(time[np.maximum(first - 1, 0)], dtype=np.float64)


def _predictability(time: Array, own: Array, finer: Array | None) -> Predictability:
    """Return the predictability of the first of r runs (r, s, 2), compared with the others and with smaller steps."""
    until, repetitions = float(last_time_together(time, own, MAX_DISTANCE)), own
    if finer is not None:
        repetitions = np.concatenate([own, finer])
        compared = np.concatenate([own[:1], finer])
        until = min(until, float(last_time_together(time, compared, MAX_DISTANCE / DISTANCE_DIVISOR)))
    with np.errstate(invalid="ignore", over="ignore"):
        mean, spread = (np.asarray(x, dtype=np.float64) for x in (repetitions.mean(axis=0), repetitions.std(axis=0)))
    to_the_end = until == float(time[-1])
    return Predictability(until=until, mean=mean, spread=spread, to_the_end=to_the_end, finer=finer is not None)
