"""Rattling: how a tip shakes on a path and after it, how hard and how often journals hit, and what that costs.

After the first impacts a run is random, so that each number is a mean over indistinguishable runs, with its spread.
When the path ends the drives are locked, and the tip is watched for a while as it comes to rest.

Source:
    Spec of the life, 3.
"""

from __future__ import annotations

from collections.abc import Mapping

import attrs
import numpy as np

from armwright.arrays import Array, not_negative
from armwright.clearance.ideal import place_bodies, stack
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import Path
from armwright.clearance.predictability import perturb_clearances
from armwright.clearance.scenario import Scenario, prepare_scenario
from armwright.clearance.settings import Settings
from armwright.clearance.simulation import Simulation, Status, simulate
from armwright.errors import InvalidValueError

# Indistinguishable runs, which fill a vector; and how long the tip is watched after the path [s].
RUNS, DWELL = 16, 0.05
# The time between samples, or the step where it is longer [s]: no impact falls between two samples.
SAMPLE = 1e-5
_LONGEST_DWELL = 1.0


@attrs.frozen(kw_only=True, eq=False)
class Rattling:
    """What r indistinguishable runs of a linkage with p pins do on a path and in the dwell after it.

    Attributes:
        path: that was followed.
        window: start and end of the motion between its first and its last piece, those of speeding up and slowing down
            on the test paths [s].
        dwell: how long the drives were locked afterwards [s]; 0 for a path of the drives, which does not come to rest.
        sample: time over which accelerations are averaged [s].
        motion_rms: (r,) root mean square of the acceleration of the tip in the window, beyond that of the path [m/s²].
        motion_peak: (r,) its largest magnitude [m/s²].
        dwell_rms: (r,) root mean square of the acceleration of the tip in the dwell [m/s²]; NaN without one.
        dwell_peak: (r,) its largest magnitude [m/s²]; NaN without one.
        force: (r, p) largest force in each pin, in motion and dwell [N].
        impacts: (r, p) number of impacts.
        flight: (r, p) share of the time without contact.
        loss: (r,) energy lost in impacts [J].
        goal: (r,) distance of the tip from its goal at the end of the path [m].
    """

    path: Path
    window: tuple[float, float]
    dwell: float
    sample: float
    motion_rms: Array
    motion_peak: Array
    dwell_rms: Array
    dwell_peak: Array
    force: Array
    impacts: Array
    flight: Array
    loss: Array
    goal: Array

    @property
    def totals(self) -> Mapping[str, Array]:
        """(r,) by name, each quantity once: forces and flight of the worst pin, impacts of all together."""
        return {
            "loss": self.loss,
            "motion-rms": self.motion_rms,
            "motion-peak": self.motion_peak,
            "dwell-rms": self.dwell_rms,
            "dwell-peak": self.dwell_peak,
            "force": self.force.max(axis=-1),
            "impacts": self.impacts.sum(axis=-1),
            "flight": self.flight.max(axis=-1),
        }


def rattle(
    linkage: Linkage,
    path: Path,
    clearances: Array,
    settings: Settings | None = None,
    *,
    friction: float | None = None,
    dwell: float = DWELL,
    threads: int | None = None,
) -> Rattling:
    """Return how indistinguishable runs of a linkage rattle on a path and after it.

    Args:
        linkage: with p pins.
        path: to follow; one of the tip ends with a dwell.
        clearances: (p,) [m].
        settings: of the simulation; its samples are those that accelerations need.
        friction: coefficient of friction; that of the material when left out.
        dwell: how long the tip is watched after the path, with locked drives [s].
        threads: how many cores to use.

    Raises:
        InvalidValueError: a run diverged, the dwell is out of range, or see ``simulate``.
    """
    if not_negative(dwell, "dwell", "s") > _LONGEST_DWELL:
        raise InvalidValueError(f"dwell: expected at most {_LONGEST_DWELL:g} s, got {dwell:g} s")
    settings = settings or Settings()
    settings = attrs.evolve(settings, sample=max(SAMPLE, settings.step))
    scenario = prepare_scenario(linkage, path, settings)
    rows = perturb_clearances(np.asarray(clearances, dtype=np.float64), RUNS - 1)
    motion = _finished(simulate(scenario, rows, frictions=friction, threads=threads))
    rest = None
    if dwell > 0 and path.follower == "tip":
        held = _held_scenario(scenario, dwell)
        speeds = motion.qd[:, -1].copy()
        speeds[:, list(linkage.driven)] = 0.0
        initial = motion.q[:, -1], speeds
        rest = _finished(simulate(held, rows, frictions=friction, initial=initial, threads=threads))
    parts = [motion] if rest is None else [motion, rest]
    start, end = _window(path)
    moving = _tip_accelerations(motion)
    inside = (motion.time[:-1] >= start) & (motion.time[1:] <= end + 1e-9)
    still = np.full((RUNS, 1), np.nan) if rest is None else _tip_accelerations(rest)
    return Rattling(
        path=path,
        window=(start, end),
        dwell=0.0 if rest is None else dwell,
        sample=scenario.stride * scenario.h,
        motion_rms=_rms(moving[:, inside]),
        motion_peak=moving[:, inside].max(axis=-1),
        dwell_rms=_rms(still),
        dwell_peak=still.max(axis=-1),
        force=np.maximum.reduce([part.peaks for part in parts]),
        impacts=np.asarray(sum(part.impacts for part in parts), dtype=np.float64),
        flight=np.concatenate([part.depths < 0 for part in parts], axis=1).mean(axis=1),
        loss=np.asarray(sum(part.works["impact loss"][:, -1] for part in parts)),
        goal=motion.distance[:, -1],
    )


def _finished(simulation: Simulation) -> Simulation:
    if np.any(simulation.status != Status.FINISHED):
        scenario = simulation.scenario
        raise InvalidValueError(
            f"{scenario.linkage.name}, {scenario.path.name}: the simulation diverged; expected a smaller step"
        )
    return simulation


def _held_scenario(scenario: Scenario, dwell: float) -> Scenario:
    """Return the scenario of a linkage that stays at the end of a path with its drives locked."""
    linkage, path = scenario.linkage, scenario.path
    locked = attrs.evolve(linkage, drives=[attrs.evolve(drive, kind="motion") for drive in linkage.drives])
    goal = path.evaluate(path.duration).position
    still = Path(name=path.name, knots=np.array([0.0, dwell]), pieces=goal[None, :, None])
    # A controller would move locked drives on to the goal.
    settings = attrs.evolve(scenario.settings, control="effort")
    return prepare_scenario(locked, still, settings, guess=scenario.ideal.q[-1])


def _window(path: Path) -> tuple[float, float]:
    """Return the times between which a path neither begins nor ends [s]."""
    inner = path.knots[1:-1]
    return (float(inner[0]), float(inner[-1])) if len(inner) > 1 else (0.0, path.duration)


def _tip_accelerations(simulation: Simulation) -> Array:
    """Return (r, s - 1) magnitudes of the mean acceleration of the tip between samples, beyond the ideal one [m/s²]."""
    scenario = simulation.scenario
    number = np.arange(len(simulation.time)) * scenario.stride
    error = _tip_velocity(simulation, simulation.q, simulation.qd)
    error -= _tip_velocity(simulation, scenario.ideal.q[number], scenario.ideal.qd[number])
    return np.asarray(np.linalg.norm(np.diff(error, axis=-2), axis=-1) / (scenario.stride * scenario.h))


def _tip_velocity(simulation: Simulation, q: Array, qd: Array) -> Array:
    linkage = simulation.scenario.linkage
    return stack(q.shape[:-1], place_bodies(linkage, q, qd).point(linkage.tip).velocity)


def _rms(values: Array) -> Array:
    return np.asarray(np.sqrt(np.mean(values**2, axis=-1)))
