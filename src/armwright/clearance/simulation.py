"""The simulation of linkages with clearance: one run, or many with other clearances side by side.

The drives give what a linkage without clearance would need for the path; the deviation of the tip is the error.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import IntEnum
from functools import cache
from typing import Any, NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, floats, leading_axes, of_shape
from armwright.clearance.contact import damping
from armwright.clearance.ideal import pin_gaps, tip_position
from armwright.clearance.kernel import Integrator, Layout, emit_simulation
from armwright.clearance.lane_layout import Integers
from armwright.clearance.linkage import Linkage
from armwright.clearance.scenario import Scenario
from armwright.clearance.settings import check_step, contact_stiffness
from armwright.clearance.static_equilibrium import find_static_equilibrium
from armwright.clearance.worn_walls import WornWalls
from armwright.errors import InvalidValueError
from armwright.tracing.cache import compiled
from armwright.tracing.kernel import on_cores_for_long
from armwright.tracing.native import function_address

# A tip farther from its path than this has diverged [m].
_DIVERGED = 1.0

# What parameters of runs beside the clearances may be: above or from the lower end, up to the upper one.
_RANGES: Mapping[str, tuple[float, float]] = {
    "frictions": (0.0, math.inf),
    "restitutions": (0.0, 1.0),
    "payloads": (0.0, math.inf),
    "torque_scales": (0.0, math.inf),
}
_ABOVE = {"restitutions", "torque_scales"}


class Status(IntEnum):
    """How a run ended."""

    FINISHED = 0
    DIVERGED = 1
    """A number became infinite, or the tip left its path by more than a metre."""


@attrs.frozen(kw_only=True, eq=False)
class Simulation:
    """A simulated motion with clearance; the leading axes are those of clearances and frictions together.

    Attributes:
        scenario: the path and its drives.
        clearances: (..., p) [m].
        frictions: (...) coefficients of friction.
        time: (s,) of the samples [s].
        q: (..., s, n) coordinates [rad, m].
        qd: (..., s, n) their speeds.
        tip: (..., s, 2) position of the tip [m].
        error: (..., s, 2) its deviation from the path without clearance [m].
        forces: (..., s, p) with which journals and bearings pressed on one another [N].
        works: by name (..., s) the work of the drives and the losses in impacts and friction [J].
        impacts: (..., p) the number of impacts of each journal.
        peaks: (..., p) the largest force in each pin [N].
        status: (...) how each run ended.
        worn: the walls of its pins; None where they are round.
        payloads: (...) masses at the tip, beside the loads of the linkage [kg]; None without any.
    """

    scenario: Scenario
    clearances: Array
    frictions: Array
    time: Array
    q: Array
    qd: Array
    tip: Array
    error: Array
    forces: Array
    works: Mapping[str, Array]
    impacts: Integers
    peaks: Array
    status: Integers
    worn: WornWalls | None = None
    payloads: Array | None = None

    @property
    def distance(self) -> Array:
        """(..., s) distance of the tip from the path without clearance [m]."""
        return np.asarray(np.linalg.norm(self.error, axis=-1), dtype=np.float64)

    @property
    def gaps(self) -> Array:
        """(..., s, p, 2) from the middle of each bearing to that of its journal [m]."""
        return pin_gaps(self.scenario.linkage, self.q)

    @property
    def depths(self) -> Array:
        """(..., s, p) indentation of each journal into its wall; below 0 in free flight [m]."""
        return self.contact_geometry(self.gaps)[0]

    @property
    def stiffness(self) -> Array:
        """(..., p) K of the contacts [N/m^1.5]."""
        return contact_stiffness(self.scenario.linkage, mean_clearances(self.clearances, self.worn))

    def contact_geometry(self, gaps: Array) -> tuple[Array, Array]:
        """Return (..., s, p) depths [m] and (..., s, p, 2) outward gradients of them at gaps (..., s, p, 2)."""
        clearances = self.clearances[..., None, :]
        if self.worn is not None:
            return self.worn.gradients(self.scenario.linkage, self.q, gaps, clearances)
        size = np.linalg.norm(gaps, axis=-1)
        outward = gaps / np.maximum(size, np.finfo(float).tiny)[..., None]
        return np.asarray(size - clearances, dtype=np.float64), outward


class Record(NamedTuple):
    """The arrays that the compiled simulation fills; one row per run."""

    samples: Array
    impacts: Integers
    peaks: Array


def simulate(
    scenario: Scenario,
    clearances: ArrayLike | None = None,
    *,
    frictions: ArrayLike | None = None,
    initial: tuple[ArrayLike, ArrayLike] | None = None,
    restitutions: ArrayLike | None = None,
    payloads: ArrayLike | None = None,
    torque_scales: ArrayLike | None = None,
    threads: int | None = None,
    worn: WornWalls | None = None,
) -> Simulation:
    """Simulate a linkage with clearance, driven as one without would be for its path.

    Args:
        scenario: the prepared path; see ``prepare``.
        clearances: (..., p) of the pins [m]; those of the linkage when left out.
        frictions: (...) coefficients of friction; that of the material when left out.
        initial: (..., n) coordinates and speeds from which the runs start; when left out, those of the settings.
        restitutions: (...) of impacts; that of the material when left out.
        payloads: (...) masses at the tip, unknown to the drives, beside the loads of the linkage [kg].
        torque_scales: (...) by which drives yield more than the efforts asked of them.
        threads: how many cores to use; all when left out. The bits do not depend on it.
        worn: walls of pins of these clearances, where they are worn.

    Raises:
        InvalidValueError: a clearance is not above 0, another number is out of its range, or the step is too long for
            the contacts.
        ShapeError: the clearances are not one per pin, or the leading axes do not fit.
    """
    linkage, settings = scenario.linkage, scenario.settings
    loaded = payloads is not None or torque_scales is not None
    if torque_scales is not None and all(drive.kind == "motion" for drive in linkage.drives):
        raise InvalidValueError(f"torque_scales: expected drives by effort; those of {linkage.name} follow a motion")
    c, (mu, e, mass, scale) = _broadcast_parameters(
        linkage,
        clearances,
        frictions=frictions,
        restitutions=restitutions,
        payloads=payloads,
        torque_scales=torque_scales,
    )
    lead = mu.shape
    K = contact_stiffness(linkage, mean_clearances(c, worn))
    check_step(linkage, settings, K)
    layout = Layout(
        linkage=linkage,
        friction=settings.friction,
        control=settings.control,
        located=settings.located,
        worn=worn is not None,
        loaded=loaded,
    )
    start = np.zeros((*lead, layout.states))
    if initial is None:
        initial = (
            initial_coordinates(scenario, c, K, worn, payloads=None if payloads is None else mass),
            initial_speeds(scenario),
        )
    start[..., : layout.n] = of_shape(initial[0], (layout.n,), "initial coordinates")
    start[..., layout.n : 2 * layout.n] = of_shape(initial[1], (layout.n,), "initial speeds")
    different, number = np.unique(e, return_inverse=True)
    chi = np.array([damping(settings.impact, x) for x in different])[number].reshape(*lead, 1)
    parts = np.broadcast_arrays(c, K, chi, mu[..., None], settings.threshold)
    contacts = np.stack(parts, axis=-1).reshape(mu.size, len(parts) * layout.pins)
    controllers = len(linkage.drives) if settings.control == "pd+ff" else 0
    gains = np.tile(settings.gains, (mu.size, controllers))
    if loaded:
        gains = np.column_stack([gains, mass.ravel(), scale.ravel()])
    runs = start.reshape(mu.size, layout.states), contacts, gains
    record = _run_lanes(scenario, layout, runs, worn=worn, threads=threads)
    simulation = _unpack_record(scenario, layout, c, mu, record)
    return attrs.evolve(simulation, worn=worn, payloads=mass if loaded else None)


def mean_clearances(clearances: Array, worn: WornWalls | None) -> Array:
    """Return (..., p) clearances with what has gone from the surfaces on average, by which contacts are stiff [m]."""
    return clearances if worn is None else clearances + worn.means


def initial_coordinates(
    scenario: Scenario,
    clearances: Array,
    K: Array,
    worn: WornWalls | None = None,
    *,
    payloads: Array | None = None,
) -> Array:
    """Return (..., n) the coordinates from which runs start; elastic rods are bent as they are at rest.

    Args:
        scenario: the prepared path.
        clearances: (..., p) [m].
        K: (..., p) stiffness of the contacts [N/m^1.5].
        worn: the walls of the pins, where they are worn.
        payloads: (...) masses at the tip [kg].
    """
    ideal = scenario.ideal.q[0]
    if scenario.settings.start == "centred":
        if scenario.linkage.rods:
            return find_static_equilibrium(scenario.linkage, ideal, np.zeros_like(clearances)).q
        return np.broadcast_to(ideal, (*clearances.shape[:-1], len(ideal)))
    elastic = None if scenario.settings.start == "rigid" else K
    return find_static_equilibrium(scenario.linkage, ideal, clearances, elastic, worn, payload=payloads).q


def initial_speeds(scenario: Scenario) -> Array:
    """Return (n,) the speeds from which runs start: those of the path, and rods that do not move in their frames."""
    qd = scenario.ideal.qd[0]
    return np.concatenate([qd, np.zeros(len(scenario.linkage.coordinates) - len(qd))])


def _broadcast_parameters(
    linkage: Linkage, clearances: ArrayLike | None, **others: ArrayLike | None
) -> tuple[Array, list[Array]]:
    """Return clearances (..., p) and other parameters (...), broadcast together; their usual values where not given."""
    c = linkage.clearance_array(clearances)
    if not np.all(c > 0):
        raise InvalidValueError(f"clearances: contact needs them above 0, got {c.min() * 1e3:g} mm")
    material = linkage.material
    usual = {
        "frictions": material.friction,
        "restitutions": material.restitution,
        "payloads": 0.0,
        "torque_scales": 1.0,
    }
    numbers = [floats(usual[name] if value is None else value, name) for name, value in others.items()]
    for name, values in zip(others, numbers, strict=True):
        low, high = _RANGES[name]
        if np.any(values < low) or (name in _ABOVE and np.any(values == low)):
            bound = f"above {low:g}" if name in _ABOVE else f"none below {low:g}"
            raise InvalidValueError(f"{name}: expected {bound}, got {values.min():g}")
        if np.any(values > high):
            raise InvalidValueError(f"{name}: expected none above {high:g}, got {values.max():g}")
    given = [(name, values) for name, values in zip(others, numbers, strict=True) if others[name] is not None]
    text, arrays = " and ".join(["clearances", *(name for name, _ in given)]), [values for _, values in given]
    lead = leading_axes(text, [c, *arrays], [c.shape[:-1], *(values.shape for values in arrays)])
    return np.broadcast_to(c, (*lead, c.shape[-1])), [np.broadcast_to(values, lead) for values in numbers]


def _run_lanes(
    scenario: Scenario,
    layout: Layout,
    parameters: tuple[Array, Array, Array],
    *,
    worn: WornWalls | None,
    threads: int | None,
) -> Record:
    """Run the compiled simulation from starts, with contacts and gains, blocks of lanes on several cores."""
    walls = np.zeros((0, 0, 0)) if worn is None else worn.table
    runs, pins, rows = len(parameters[0]), layout.pins, len(scenario.table)
    marks = scenario.marks[: rows + 1]
    samples = np.where((marks >= 0) & (marks % scenario.stride == 0), marks // scenario.stride, -1)
    record = Record(
        samples=np.full((runs, scenario.steps // scenario.stride + 1, layout.sampled), np.nan),
        impacts=np.zeros((runs, pins), dtype=np.int64),
        peaks=np.zeros((runs, pins)),
    )
    run = _compiled_kernel(layout, scenario.settings.integrator)
    lengths = scenario.lengths[:rows]
    inputs = (*parameters, scenario.table, lengths, samples, walls, *record)
    on_cores_for_long(lambda first, last, cancelled: run(first, last, *inputs, cancelled), runs, threads)
    return record


@cache
def _compiled_kernel(layout: Layout, integrator: Integrator) -> Any:
    from armwright.tracing.from_numba import announce  # noqa: PLC0415 - Numba takes half a second

    code, title = emit_simulation(layout, integrator), f"the simulation of {layout.linkage.name}"
    for symbol, equations in code.equations.items():
        announce(symbol, function_address(equations, "lanes"))
    return compiled(code.source, "simulate", title)


def _unpack_record(scenario: Scenario, layout: Layout, c: Array, mu: Array, record: Record) -> Simulation:
    """Return a record as motion, forces and works of the linkage."""
    n, lead, linkage = layout.n, mu.shape, scenario.linkage
    samples = record.samples.reshape(*lead, *record.samples.shape[1:])
    q = samples[..., :n]
    number = np.arange(samples.shape[-2]) * scenario.stride
    # Diverged coordinates are infinite and have no sine.
    with np.errstate(invalid="ignore", over="ignore"):
        tip = tip_position(linkage, q)
        error = tip - tip_position(linkage, scenario.ideal.q[number])
        diverged = ~np.all(np.abs(error) < _DIVERGED, axis=(-1, -2))
    first = 2 * n + layout.deflections
    return Simulation(
        scenario=scenario,
        clearances=c,
        frictions=mu,
        time=np.asarray(number * scenario.h, dtype=np.float64),
        q=q,
        qd=samples[..., n : 2 * n],
        tip=tip,
        error=error,
        forces=samples[..., layout.states :],
        works={name: samples[..., first + i] for i, name in enumerate(layout.works)},
        impacts=record.impacts.reshape(*lead, layout.pins),
        peaks=record.peaks.reshape(*lead, layout.pins),
        status=np.where(diverged, Status.DIVERGED, Status.FINISHED),
    )
