"""The assessment of a clearance run: errors of the tip, forces, impacts and free flight of pins, energy balance."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from itertools import compress
from typing import Any

import attrs
import numpy as np

from armwright.arrays import Array, finite_or_none
from armwright.clearance.contact import damping, restitution_of_damping
from armwright.clearance.energy_balance import EnergyBalance, energy_balance
from armwright.clearance.features import spectrum
from armwright.clearance.linkage import Coordinate
from armwright.clearance.predictability import DISTANCE_DIVISOR, MAX_DISTANCE, Predictability
from armwright.clearance.simulation import Simulation, Status
from armwright.errors import ShapeError
from armwright.files.result_table import ResultTable
from armwright.version import __version__

# Residuals of the energy balance above this part of the losses, and above this energy [J], have a note.
_MAX_IMBALANCE, _NEGLIGIBLE = 0.02, 1e-4
# What elastic bodies add to the table of energies.
_ROD_ENERGY = {"strain_change": "more strain in elastic bodies", "damping_loss": "lost in their damping"}
# Indentation beyond which the contact law of Hertz does not hold, as a part of the clearance.
_MAX_INDENTATION = 0.1


@attrs.frozen(kw_only=True, eq=False)
class ClearanceRun:
    """One run, as far as its numbers are finite.

    Attributes:
        simulation: of one run, without leading axes.
        rows: how many samples are finite, counted from the start.
        predictability: until when it is a prediction; None where that was not looked at.
        energy: its energy balance.
        strokes: that its worn pins have made; None for new pins.
        gaps: (s, p, 2) from the middle of each bearing to that of its journal [m].
        depths: (s, p) indentation of each journal into its bearing; below 0 in free flight [m].
    """

    simulation: Simulation
    rows: int
    predictability: Predictability | None
    strokes: float | None
    energy: EnergyBalance
    gaps: Array
    depths: Array

    @classmethod
    def of(
        cls,
        simulation: Simulation,
        predictability: Predictability | None = None,
        *,
        strokes: float | None = None,
    ) -> ClearanceRun:
        """Return a run with its energy balance, gaps and indentations.

        Raises:
            ShapeError: there are several runs.
        """
        if simulation.error.ndim != 2:
            raise ShapeError(f"expected one run, got {simulation.error.shape[:-2]} of them: take one out")
        with np.errstate(invalid="ignore", over="ignore"):
            energy, gaps, depths = energy_balance(simulation), simulation.gaps, simulation.depths
            numbers = [simulation.q, simulation.qd, simulation.forces, energy.imbalance[:, None]]
        # Forces and energies become infinite before positions do.
        finite = np.isfinite(np.concatenate(numbers, axis=-1)).all(axis=-1)
        rows = len(simulation.time) if finite.all() else max(1, int(np.argmin(finite)))
        return cls(
            simulation=simulation,
            rows=rows,
            predictability=predictability,
            strokes=strokes,
            energy=energy,
            gaps=gaps,
            depths=depths,
        )

    @property
    def finished(self) -> bool:
        """Whether it came to the end of its path."""
        return int(self.simulation.status) == Status.FINISHED

    @property
    def time(self) -> Array:
        """(r,) of the finite samples [s]."""
        return self.simulation.time[: self.rows]

    @property
    def error(self) -> Array:
        """(r, 2) error of the tip [m]."""
        return self.simulation.error[: self.rows]

    @property
    def distance(self) -> Array:
        """(r,) distance of the tip from its path without clearance [m]."""
        return np.asarray(np.linalg.norm(self.error, axis=-1), dtype=np.float64)

    @property
    def warnings(self) -> list[str]:
        """Those of the notes that a reader must not overlook: but for asked-for wear and the certainty of a run."""
        certain = self.predictability is not None and self.predictability.to_the_end
        harmless = [*_wear_notes(self), *(_predictability_notes(self) if certain else ())]
        return [note for note in self.notes if note not in harmless]

    @property
    def notes(self) -> list[str]:
        """What a reader must know beside the numbers."""
        notes = []
        if not self.finished:
            notes.append(
                f"the run diverged: a number became infinite or the tip left its path by a metre; "
                f"shown until {self.time[-1]:.4g} s"
            )
        notes.extend(_predictability_notes(self))
        notes.extend(_wear_notes(self))
        energy, rows = self.energy, slice(self.rows)
        # The error of the integration has to be small beside the losses, not beside the work that went through.
        lost = float((energy.impact_loss + energy.friction_loss + energy.damping_loss)[rows][-1])
        imbalance = float(np.abs(energy.imbalance[rows]).max())
        if imbalance > max(_MAX_IMBALANCE * lost, _NEGLIGIBLE):
            part = f", {100 * imbalance / lost:.2g} % of them" if lost > 0 else ""
            notes.append(
                f"the energy balance lacks {imbalance:.3g} J beside {lost:.3g} J of losses{part}: "
                f"the step of {self.simulation.scenario.h:.3g} s is long for these impacts"
            )
        deep = (np.max(self.depths[rows], axis=0) / self.simulation.clearances) > _MAX_INDENTATION
        if np.any(deep):
            pins = self.simulation.scenario.linkage.pins
            names = ", ".join(pin.name for pin in compress(pins, deep))
            notes.append(f"{names}: indentation above a tenth of the clearance, where Hertz's contact law is a guess")
        return notes

    def as_data(self) -> dict[str, Any]:
        """Return a summary as plain data in SI units."""
        simulation, energy, last = self.simulation, self.energy, self.rows - 1
        scenario, amplitudes = simulation.scenario, spectrum(self.distance)
        return {
            "linkage": scenario.linkage.name,
            "path": scenario.path.name,
            "duration": scenario.path.duration,
            "worn_strokes": self.strokes,
            "status": Status(int(simulation.status)).name.lower(),
            "sound_until": float(self.time[-1]),
            "predictable_until": None if self.predictability is None else self.predictability.until,
            "pins": {pin.name: _pin_data(self, i) for i, pin in enumerate(scenario.linkage.pins)},
            "error": {
                "largest": float(self.distance.max()),
                "mean": float(self.distance.mean()),
                "largest_x": float(np.abs(self.error[:, 0]).max()),
                "largest_y": float(np.abs(self.error[:, 1]).max()),
                "amp_dc": float(amplitudes[0]),
                "amp_ac": float(amplitudes[1:].max(initial=0.0)),
            },
            "targets": target_errors(self),
            "energy": {
                "driven": float(energy.driven[last]),
                "kinetic_change": float(energy.kinetic[last] - energy.kinetic[0]),
                "potential_change": float(energy.potential[last]),
                "stored_change": float(energy.stored[last] - energy.stored[0]),
                "impact_loss": float(energy.impact_loss[last]),
                "friction_loss": float(energy.friction_loss[last]),
                "imbalance": float(np.abs(energy.imbalance[: self.rows]).max()),
                **_rod_energy(self),
            },
            **({"rods": _rod_data(self)} if scenario.linkage.rods else {}),
            "settings": settings_data(self),
            "versions": {"armwright": __version__, "python": platform.python_version(), "numpy": np.__version__},
        }

    def tables(self) -> Iterator[ResultTable]:
        """Give the pins, the errors at the targets, errors and energy in sum, and the elastic bodies, if any."""
        data = self.as_data()
        yield ResultTable(
            title="Pins",
            heads=("pin", "clearance mm", "peak N", "mean N", "impacts", "free flight %", "deepest µm"),
            rows=[
                (
                    name,
                    f"{pin['clearance'] * 1e3:.4g}",
                    "∞" if pin["peak_force"] is None else f"{pin['peak_force']:.4g}",
                    f"{pin['mean_force']:.4g}",
                    f"{pin['impacts']}",
                    f"{100 * pin['flight']:.3g}",
                    f"{pin['deepest'] * 1e6:.3g}",
                )
                for name, pin in data["pins"].items()
            ],
            numbers=range(1, 7),
        )
        yield ResultTable(
            title="Errors at the targets",
            heads=("time", "x mm", "y mm", "distance mm", "nearest approach mm"),
            rows=[
                (
                    f"{target['time']:.4g} s",
                    *(
                        "" if target[key] is None else f"{target[key] * 1e3:z.4f}"
                        for key in ("error_x", "error_y", "distance", "nearest")
                    ),
                )
                for target in data["targets"]
            ],
            numbers=range(1, 5),
        )
        error, energy = data["error"], data["energy"]
        yield ResultTable(
            title="Error of the tip, and energy balance",
            heads=("", "value", "unit"),
            rows=[
                ("largest error", f"{error['largest'] * 1e3:.4g}", "mm"),
                ("largest error in x", f"{error['largest_x'] * 1e3:.4g}", "mm"),
                ("largest error in y", f"{error['largest_y'] * 1e3:.4g}", "mm"),
                ("mean error", f"{error['mean'] * 1e3:.4g}", "mm"),
                ("largest spectral amplitude", f"{error['amp_ac'] * 1e3:.4g}", "mm"),
                ("work of the drives", f"{energy['driven']:.4g}", "J"),
                ("lost in impacts", f"{energy['impact_loss']:.4g}", "J"),
                ("lost in friction", f"{energy['friction_loss']:.4g}", "J"),
                *((name, f"{energy[key]:.4g}", "J") for key, name in _ROD_ENERGY.items() if key in energy),
                ("residual of the energy balance", f"{energy['imbalance']:.2g}", "J"),
            ],
            numbers=(1,),
        )
        if "rods" in data:
            yield ResultTable(
                title="Elastic bodies",
                heads=(
                    "body",
                    "held as",
                    "first frequency Hz",
                    "bent at the start mm",
                    "bent at most mm",
                    "stretched µm",
                ),
                rows=[
                    (
                        name,
                        "clamped" if rod["clamped"] else "on pins",
                        f"{rod['frequencies'][0]:.4g}",
                        f"{rod['bent_at_start'] * 1e3:.4g}",
                        f"{rod['bent_at_most'] * 1e3:.4g}",
                        f"{rod['stretched_at_most'] * 1e6:.3g}",
                    )
                    for name, rod in data["rods"].items()
                ],
                numbers=range(2, 6),
            )


def _rod_data(run: ClearanceRun) -> dict[str, Any]:
    """Return how far each elastic body bends from the line of its frame, and stretches [m]."""
    linkage, rods = run.simulation.scenario.linkage, {}
    for name, rod in linkage.rods.items():
        first = linkage.coordinates.index(Coordinate(name, "bend1"))
        q = run.simulation.q[: run.rows, first : first + len(rod.stiffness)]
        bent = rod.largest_deflection(q[:, :-1])
        rods[name] = {
            "clamped": rod.clamped,
            "frequencies": list(rod.frequencies),
            "bent_at_start": float(bent[0]),
            "bent_at_most": float(bent.max()),
            "stretched_at_most": float(np.abs(q[:, -1]).max()),
        }
    return rods


def _rod_energy(run: ClearanceRun) -> dict[str, float]:
    """Return what elastic bodies add to the energy balance [J]."""
    if not run.simulation.scenario.linkage.rods:
        return {}
    energy, last = run.energy, run.rows - 1
    return {
        "strain_change": float(energy.strain[last] - energy.strain[0]),
        "damping_loss": float(energy.damping_loss[last]),
    }


def _pin_data(run: ClearanceRun, i: int) -> dict[str, Any]:
    forces, depths = run.simulation.forces[: run.rows, i], run.depths[: run.rows, i]
    return {
        "clearance": float(run.simulation.clearances[i]),
        "wall_growth": 0.0 if run.simulation.worn is None else run.simulation.worn.largest(i),
        "peak_force": finite_or_none(run.simulation.peaks[i]),
        "mean_force": float(forces.mean()),
        "impacts": int(run.simulation.impacts[i]),
        "flight": float((depths < 0).mean()),
        "deepest": float(max(depths.max(), 0.0)),
    }


def target_errors(run: ClearanceRun) -> list[dict[str, Any]]:
    """Return the error at the start and where the path has its goals, at their time and at the nearest approach [m]."""
    scenario, path = run.simulation.scenario, run.simulation.scenario.path
    rows = []
    for t in sorted({0.0, *path.targets}):
        # A run that diverged has no more; the end of another is there but for rounding.
        if t > run.time[-1] + 0.5 * scenario.h:
            continue
        x, y = (float(np.interp(t, run.time, run.error[:, i])) for i in range(2))
        target = {"time": float(t), "error_x": x, "error_y": y, "distance": float(np.hypot(x, y)), "nearest": None}
        if path.follower == "tip":
            distance = np.linalg.norm(run.simulation.tip[: run.rows] - path.evaluate(t).position, axis=-1)
            target["nearest"] = float(distance.min())
        if run.predictability is not None:
            target["mean_x"], target["mean_y"], target["spread_x"], target["spread_y"] = (
                finite_or_none(np.interp(t, run.simulation.time, values[:, i]))
                for values in (run.predictability.mean, run.predictability.spread)
                for i in range(2)
            )
            target["predictable"] = run.predictability.to_the_end or t <= run.predictability.until
        rows.append(target)
    return rows


def settings_data(run: ClearanceRun) -> dict[str, Any]:
    """Return how a run was simulated, as plain data in SI units."""
    scenario, material = run.simulation.scenario, run.simulation.scenario.linkage.material
    how = scenario.settings
    chi = damping(how.impact, material.restitution)
    data: dict[str, Any] = {
        "step": scenario.h,
        "sample": scenario.stride * scenario.h,
        "integrator": how.integrator,
        "control": how.control,
        "start": how.start,
        "located": how.located,
        "impact_law": how.impact,
        "restitution_asked": material.restitution,
        "restitution_given": restitution_of_damping(chi),
        "friction": float(run.simulation.frictions),
        "friction_law": how.friction.law,
        "friction_velocity": how.friction.velocity,
        "friction_threshold": how.threshold,
        "young": material.young,
        "poisson": material.poisson,
        "journal_radius": {pin.name: pin.journal_radius for pin in scenario.linkage.pins},
    }
    if how.control == "pd+ff":
        data["gains"] = list(how.gains)
    return data


def _wear_notes(run: ClearanceRun) -> Iterator[str]:
    """Say how worn the pins are, and how well their walls are known."""
    worn = run.simulation.worn
    if worn is None:
        return
    names = [pin.name for pin in run.simulation.scenario.linkage.pins]
    growths = ", ".join(f"{name} {worn.largest(i) * 1e6:.3g} µm" for i, name in enumerate(names))
    after = "" if run.strokes is None else f" after {run.strokes:.4g} strokes"
    yield (
        f"worn pins{after}: their journals can go farther than the clearance by up to {growths}; "
        f"corners of the worn walls are rounded by at most {worn.smoothing.max() * 1e6:.2g} µm"
    )


def _predictability_notes(run: ClearanceRun) -> Iterator[str]:
    """Say until when a run is a prediction, and what holds afterwards."""
    predictability = run.predictability
    if predictability is None:
        return
    what, apart = "clearances a nanometre away", f"{MAX_DISTANCE * 1e6:g} µm"
    if predictability.finer:
        what += " or a smaller step"
        apart += f" ({MAX_DISTANCE / DISTANCE_DIVISOR * 1e6:g} µm for a smaller step)"
    if predictability.to_the_end:
        yield f"predictable to the end: runs with {what} stay within {apart}"
        return
    yield (
        f"predictable until t = {predictability.until:.4g} s: then a run with {what} is more than {apart} away; "
        f"what comes later is one of many indistinguishable runs"
    )
    for target in target_errors(run):
        if not target["predictable"] and target["spread_x"] is not None:
            means = (f"{target[f'mean_{axis}'] * 1e3:z.4f} ± {target[f'spread_{axis}'] * 1e3:.4f}" for axis in "xy")
            yield f"at {target['time']:.4g} s the error is x {' mm, y '.join(means)} mm over these runs (mean ± spread)"
