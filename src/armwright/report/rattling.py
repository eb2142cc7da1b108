"""A linkage with play in numbers: its summary, its samples as a table, and what a reader must know beside them."""

import platform
from collections.abc import Iterator
from typing import Any

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.clearance.contact import damping, restitution_of
from armwright.clearance.energy_balance import EnergyBalance, energy_balance
from armwright.clearance.features import spectrum
from armwright.clearance.predictability import APART, FINER, Outlook
from armwright.clearance.simulation import Simulation, Status
from armwright.errors import ShapeError
from armwright.files.rows import text_cell
from armwright.version import __version__

# Energy that the balance may lack before a reader is told, as a part of what was lost, or so little [J].
_UNEXPLAINED, _LITTLE = 0.02, 1e-4
# A journal that is so deep in the wall is no longer what the law of contact means, as a part of its clearance.
_DEEP = 0.1


@attrs.frozen(kw_only=True, eq=False)
class Run:
    """One run, as far as its numbers are sound.

    Attributes:
        simulation: of one run, without leading axes.
        rows: how many samples are sound, counted from the start.
        outlook: until when it is a prediction; None where that was not looked at.
        energy: where its energy was.
        gaps: (s, p, 2) from the middle of each bearing to that of its journal [m].
        depths: (s, p) how deep each journal is in the wall; below 0 where it flies [m].
    """

    simulation: Simulation
    rows: int
    outlook: Outlook | None
    energy: EnergyBalance
    gaps: Array
    depths: Array

    @classmethod
    def of(cls, simulation: Simulation, outlook: Outlook | None = None) -> "Run":
        """Return a run with what reports tell of it.

        Raises:
            ShapeError: there are several runs.
        """
        if simulation.error.ndim != 2:
            raise ShapeError(f"expected one run, got {simulation.error.shape[:-2]} of them: take one out")
        with np.errstate(invalid="ignore", over="ignore"):
            energy, gaps, depths = energy_balance(simulation), simulation.gaps, simulation.depths
            told = [simulation.q, simulation.qd, simulation.forces, energy.imbalance[:, None]]
        # Forces and energies become infinite before places do.
        sound = np.isfinite(np.concatenate(told, axis=-1)).all(axis=-1)
        rows = len(simulation.time) if sound.all() else max(1, int(np.argmin(sound)))
        return cls(simulation=simulation, rows=rows, outlook=outlook, energy=energy, gaps=gaps, depths=depths)

    @property
    def finished(self) -> bool:
        """Whether it came to the end of its path."""
        return int(self.simulation.status) == Status.FINISHED

    @property
    def time(self) -> Array:
        """(r,) of the sound samples [s]."""
        return self.simulation.time[: self.rows]

    @property
    def error(self) -> Array:
        """(r, 2) by how much the tip was off [m]."""
        return self.simulation.error[: self.rows]

    @property
    def distance(self) -> Array:
        """(r,) how far the tip was off [m]."""
        return np.asarray(np.linalg.norm(self.error, axis=-1), dtype=np.float64)


def summary(run: Run) -> dict[str, Any]:
    """Return a run in short, as plain data in SI units."""
    simulation, last = run.simulation, run.rows - 1
    task, energy = simulation.task, run.energy
    waves = spectrum(run.distance)
    return {
        "linkage": task.linkage.name,
        "path": task.path.name,
        "duration": task.path.duration,
        "status": Status(int(simulation.status)).name.lower(),
        "sound_until": float(run.time[-1]),
        "predictable_until": None if run.outlook is None else run.outlook.until,
        "pins": {pin.name: _pin(run, i) for i, pin in enumerate(task.linkage.pins)},
        "error": {
            "largest": float(run.distance.max()),
            "mean": float(run.distance.mean()),
            "largest_x": float(np.abs(run.error[:, 0]).max()),
            "largest_y": float(np.abs(run.error[:, 1]).max()),
            "amp_dc": float(waves[0]),
            "amp_ac": float(waves[1:].max(initial=0.0)),
        },
        "targets": targets(run),
        "energy": {
            "driven": float(energy.driven[last]),
            "kinetic_change": float(energy.kinetic[last] - energy.kinetic[0]),
            "potential_change": float(energy.potential[last]),
            "stored_change": float(energy.stored[last] - energy.stored[0]),
            "impact_loss": float(energy.impact_loss[last]),
            "friction_loss": float(energy.friction_loss[last]),
            "imbalance": float(np.abs(energy.imbalance[: run.rows]).max()),
        },
        "settings": settings(run),
        "versions": {"armwright": __version__, "python": platform.python_version(), "numpy": np.__version__},
    }


def _pin(run: Run, i: int) -> dict[str, Any]:
    forces, depths = run.simulation.forces[: run.rows, i], run.depths[: run.rows, i]
    return {
        "clearance": float(run.simulation.clearances[i]),
        "peak_force": _finite(run.simulation.peaks[i]),
        "mean_force": float(forces.mean()),
        "impacts": int(run.simulation.impacts[i]),
        "flight": float((depths < 0).mean()),
        "deepest": float(max(depths.max(), 0.0)),
    }


def _finite(x: float) -> float | None:
    """Return a number as JSON knows it: what is infinite is none."""
    return float(x) if np.isfinite(x) else None


def newtons(force: float | None) -> str:
    """Write a force [N]; none is one beyond all bounds."""
    return "∞" if force is None else f"{force:.4g}"


def targets(run: Run) -> list[dict[str, Any]]:
    """Return the error at the start and where the path has its goals, at their time and at the nearest approach [m]."""
    task, path = run.simulation.task, run.simulation.task.path
    found = []
    for t in sorted({0.0, *path.targets}):
        # Of a run that diverged there is no more; the end of another is told but for rounding.
        if t > run.time[-1] + 0.5 * task.h:
            continue
        x, y = (float(np.interp(t, run.time, run.error[:, i])) for i in range(2))
        one = {"time": float(t), "error_x": x, "error_y": y, "distance": float(np.hypot(x, y)), "nearest": None}
        if path.of == "tip":
            away = np.linalg.norm(run.simulation.tip[: run.rows] - path.at(t).at, axis=-1)
            one["nearest"] = float(away.min())
        if run.outlook is not None:
            one["mean_x"], one["mean_y"], one["spread_x"], one["spread_y"] = (
                _finite(np.interp(t, run.simulation.time, values[:, i]))
                for values in (run.outlook.mean, run.outlook.spread)
                for i in range(2)
            )
            one["predictable"] = run.outlook.to_the_end or t <= run.outlook.until
        found.append(one)
    return found


def settings(run: Run) -> dict[str, Any]:
    """Return how a run was simulated, as plain data in SI units."""
    task, material = run.simulation.task, run.simulation.task.linkage.material
    how = task.settings
    chi = damping(how.impact, material.restitution)
    data: dict[str, Any] = {
        "step": task.h,
        "sample": task.stride * task.h,
        "integrator": how.integrator,
        "control": how.control,
        "start": how.start,
        "located": how.located,
        "impact_law": how.impact,
        "restitution_asked": material.restitution,
        "restitution_given": restitution_of(chi),
        "friction": float(run.simulation.frictions),
        "friction_law": how.friction.law,
        "friction_velocity": how.friction.velocity,
        "friction_threshold": how.threshold,
        "young": material.young,
        "poisson": material.poisson,
        "journal_radius": {pin.name: pin.journal_radius for pin in task.linkage.pins},
    }
    if how.control == "pd+ff":
        data["gains"] = list(how.gains)
    return data


def notes(run: Run) -> list[str]:
    """Return what a reader must know beside the numbers."""
    said = []
    if not run.finished:
        said.append(
            f"the run diverged: a number became infinite or the tip left its path by a metre; "
            f"shown until {run.time[-1]:.4g} s"
        )
    said.extend(_outlook_in_words(run))
    energy, rows = run.energy, slice(run.rows)
    # What the integration loses or makes is to be small beside what impacts and friction took, not beside what went by.
    lost = float((energy.impact_loss + energy.friction_loss)[rows][-1])
    lacking = float(np.abs(energy.imbalance[rows]).max())
    if lacking > max(_UNEXPLAINED * lost, _LITTLE):
        part = f", {100 * lacking / lost:.2g} % of them" if lost > 0 else ""
        said.append(
            f"the energy balance lacks {lacking:.3g} J beside {lost:.3g} J of losses{part}: "
            f"the step of {run.simulation.task.h:.3g} s is long for these impacts"
        )
    deep = (np.max(run.depths[rows], axis=0) / run.simulation.clearances) > _DEEP
    if np.any(deep):
        names = [pin.name for pin, one in zip(run.simulation.task.linkage.pins, deep, strict=True) if one]
        said.append(f"{', '.join(names)}: deeper in the wall than a tenth of the clearance, where Hertz is a guess")
    return said


def _outlook_in_words(run: Run) -> Iterator[str]:
    """Say until when a run is a prediction, and what holds afterwards."""
    one = run.outlook
    if one is None:
        return
    what = f"clearances a nanometre away{' or a smaller step' if one.finer else ''}"
    apart = f"{APART * 1e6:g} µm{f' ({APART / FINER * 1e6:g} µm for a smaller step)' if one.finer else ''}"
    if one.to_the_end:
        yield f"predictable to the end: runs with {what} stay within {apart}"
        return
    yield (
        f"predictable until t = {one.until:.4g} s: then a run with {what} is more than {apart} away; "
        f"what comes later is one of many runs that nobody can tell apart"
    )
    for target in targets(run):
        if not target["predictable"] and target["spread_x"] is not None:
            means = (f"{target[f'mean_{axis}'] * 1e3:z.4f} ± {target[f'spread_{axis}'] * 1e3:.4f}" for axis in "xy")
            yield f"at {target['time']:.4g} s the error is x {' mm, y '.join(means)} mm over these runs (mean ± spread)"


def samples_csv(run: Run) -> Iterator[str]:
    """Give the lines of samples.csv, in SI; every column has its unit in its name."""
    simulation = run.simulation
    linkage, rows = simulation.task.linkage, slice(run.rows)
    columns: dict[str, Array] = {"time_s": run.time}
    for i, axis in enumerate("xy"):
        columns[f"tip_{axis}_m"] = simulation.tip[rows, i]
    for i, axis in enumerate("xy"):
        columns[f"error_{axis}_m"] = run.error[:, i]
    columns["error_m"] = run.distance
    for i, one in enumerate(linkage.coordinates):
        unit = "rad" if one.kind == "angle" else "m"
        columns[f"{one}_{unit}"] = simulation.q[rows, i]
        columns[f"{one}_speed_{unit}/s"] = simulation.qd[rows, i]
    for i, pin in enumerate(linkage.pins):
        columns[f"{pin.name}.gap_x_m"], columns[f"{pin.name}.gap_y_m"] = run.gaps[rows, i].T
        columns[f"{pin.name}.depth_m"] = run.depths[rows, i]
        columns[f"{pin.name}.force_N"] = simulation.forces[rows, i]
    for field in attrs.fields(EnergyBalance):
        columns[f"{field.name}_J"] = getattr(run.energy, field.name)[rows]
    yield ",".join(map(text_cell, columns)) + "\n"
    line = ",".join(["%.10g"] * len(columns)) + "\n"
    # Adding 0 turns -0 into 0, which reads better.
    yield from (line % tuple(row) for row in (np.stack(list(columns.values()), axis=-1) + 0.0).tolist())
