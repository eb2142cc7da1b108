"""Until when a run can be predicted: impacts magnify what nobody knows, until two runs have nothing in common.

A run is made again with clearances that differ by a nanometre, which no workshop and no instrument tells, and with a
half and a third of the step. Until all of them are still together the run is a prediction; afterwards only their mean
and their spread are.

Source:
    Spec of the clearance, 1.6: after the first impacts trajectories are chaotic.
"""

from __future__ import annotations

import contextlib

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.clearance.scenario import Scenario, prepare
from armwright.clearance.simulation import Simulation, simulate
from armwright.errors import InvalidValueError

# By how much the clearances of runs differ that nobody can tell apart [m], and how many runs fill a vector.
PERTURBATION, TWINS = 1e-9, 15
# Runs that are farther from one another have parted [m]. With smaller steps they must be nearer by a factor: after an
# impact the error of a step is of first order, half as much again as what a third of it changes, and chance more than
# doubles that. One of them may meet an impact at the same part of its step as the whole one, and hardly both.
APART, PARTS, FINER = 1e-5, (2, 3), 4.0


@attrs.frozen(kw_only=True, eq=False)
class Outlook:
    """How far ahead a run tells what would happen.

    Attributes:
        until: the last time at which all runs beside it are within ``APART`` of it, and those with smaller steps
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


def perturbed(clearances: Array, count: int = TWINS) -> Array:
    """Return (count + 1, ..., p) clearances: as they are, and others a nanometre or less away, always the same."""
    shifts = np.random.default_rng(0).uniform(-PERTURBATION, PERTURBATION, (count, clearances.shape[-1]))
    lead = (count, *(1,) * (clearances.ndim - 1), clearances.shape[-1])
    # Contact needs some play.
    others = np.maximum(clearances + shifts.reshape(lead), clearances / 2)
    return np.concatenate([clearances[None], others])


def with_outlook(
    scenario: Scenario, clearances: Array, *, friction: float | None = None, threads: int | None = None
) -> tuple[Simulation, Outlook]:
    """Return a run, its bits as ``simulate`` has them alone, and until when it is a prediction.

    Args:
        scenario: the path, made ready.
        clearances: (p,) of the pins [m].
        friction: coefficient of friction; that of the material when left out.
        threads: how many cores to use.

    Raises:
        InvalidValueError: see ``simulate``.
    """
    rows = perturbed(np.asarray(clearances, dtype=np.float64))
    own = simulate(scenario, rows, frictions=friction, threads=threads)
    finer = []
    for parts in PARTS:
        settings = attrs.evolve(scenario.settings, step=scenario.h / parts, sample=scenario.stride * scenario.h)
        # There may be more steps than are ever made.
        with contextlib.suppress(InvalidValueError):
            again = prepare(scenario.linkage, scenario.path, settings, guess=scenario.ideal.q[0])
            finer.append(simulate(again, rows, frictions=friction, threads=threads).error[:, : len(own.time)])
    known = len(finer) == len(PARTS) and all(error.shape == own.error.shape for error in finer)
    return taken(own, 0), _outlook(own.time, own.error, np.concatenate(finer) if known else None)


def taken(simulation: Simulation, number: int) -> Simulation:
    """Return one run of several side by side."""
    names = ("clearances", "frictions", "q", "qd", "tip", "error", "forces", "impacts", "peaks", "status")
    return attrs.evolve(
        simulation,
        works={name: one[number] for name, one in simulation.works.items()},
        **{name: getattr(simulation, name)[number] for name in names},
    )


def together_until(time: Array, errors: Array, within: float) -> Array:
    """Return (...) the last time up to which runs stay together [s].

    Args:
        time: (s,) of the samples [s].
        errors: (r, ..., s, 2) of r runs; those of the first are what the others are held against [m].
        within: how far they may be from it [m].
    """
    with np.errstate(invalid="ignore", over="ignore"):
        apart = np.linalg.norm(errors - errors[0], axis=-1).max(axis=0)
        # What is infinite or no number is not near.
        near = apart <= within
    first = np.where(near.all(axis=-1), len(time), np.argmin(near, axis=-1))
    return np.asarray(time[np.maximum(first - 1, 0)], dtype=np.float64)


def _outlook(time: Array, own: Array, finer: Array | None) -> Outlook:
    """Return what runs (r, s, 2) say of the first of them, and those with smaller steps, if there are any."""
    until, all_of_them = together_until(time, own, APART), own
    if finer is not None:
        all_of_them = np.concatenate([own, finer])
        until = np.minimum(until, together_until(time, np.concatenate([own[:1], finer]), APART / FINER))
    with np.errstate(invalid="ignore", over="ignore"):
        mean, spread = all_of_them.mean(axis=0), all_of_them.std(axis=0)
    return Outlook(
        until=float(until),
        mean=np.asarray(mean, dtype=np.float64),
        spread=np.asarray(spread, dtype=np.float64),
        to_the_end=float(until) == float(time[-1]),
        finer=finer is not None,
    )
