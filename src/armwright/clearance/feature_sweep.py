"""The features of the error curves of many linkages on several paths, as the task of a sweep.

Each linkage is simulated several times with indistinguishable clearances: a feature is the mean over these replicates,
and their spread is its random variation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, Flags, integer
from armwright.clearance.features import simulation_features
from armwright.clearance.free_parameters import FREE_PARAMETERS
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import TEST_PATHS, thesis_path
from armwright.clearance.predictability import MAX_DISTANCE, MAX_REPLICATES, last_time_together, perturb_clearances
from armwright.clearance.scenario import Scenario, prepare_scenario
from armwright.clearance.settings import Settings
from armwright.clearance.simulation import Status, simulate
from armwright.errors import InvalidValueError, one_of
from armwright.sweep.task import FAILURE, Axis, Output

# The units of a path's features and largest force, and their meaning.
_QUANTITIES = {
    "slope": ("m/s", "slope of the straight part of the error"),
    "intercept": ("m", "intercept of the straight part of the error"),
    "amp_dc": ("m", "twice the mean error"),
    "amp_ac": ("m", "largest amplitude of a wave of the error"),
    "offset_x": ("m", "error at the start, along x"),
    "offset_y": ("m", "error at the start, along y"),
    "peak": ("N", "largest force in a pin"),
}
# Replicates in a sweep: with so few a spread is known to 40 %, and the mean spread of some neighbours well.
DEFAULT_REPLICATES = 3


class _RunOutputs(NamedTuple):
    """The outputs of m runs: by name (m,) features, times (s,) [s], errors (m, s, 2) [m], which runs diverged."""

    features: dict[str, Array]
    time: Array
    error: Array
    diverged: Flags


@attrs.frozen(kw_only=True, eq=False, slots=False)
class FeatureSweep:
    """The features of linkages with given clearances, on several paths.

    A point has one clearance for each pin, in its order, and the free parameters after them.

    Attributes:
        linkage: that moves.
        paths: names of test paths, each once; the features describe their straight part.
        simulation_settings: of each run.
        free: names of the free parameters, each once.
        replicates: repetitions of each run, with clearances a nanometre away at most. With none there is no spread.
    """

    linkage: Linkage
    paths: tuple[str, ...]
    simulation_settings: Settings = attrs.field(factory=Settings)
    free: tuple[str, ...] = ()
    replicates: int = DEFAULT_REPLICATES

    def __attrs_post_init__(self) -> None:
        """Refuse unknown and repeated paths and parameters, and more replicates than fill a vector."""
        if integer(self.replicates, "replicates", least=0) > MAX_REPLICATES:
            raise InvalidValueError(f"replicates: expected 0 to {MAX_REPLICATES}, got {self.replicates}")
        for path in self.paths:
            one_of("test path", path, TEST_PATHS)
            if self.paths.count(path) > 1:
                raise InvalidValueError(f"paths: '{path}' occurs twice")
        for name in self.free:
            one_of("free parameter", name, FREE_PARAMETERS)
            if self.free.count(name) > 1:
                raise InvalidValueError(f"free parameters: '{name}' occurs twice")
        if not self.paths:
            raise InvalidValueError("paths: expected one or more, got none")

    @property
    def name(self) -> str:
        """The name of the task."""
        return f"features of {self.linkage.name}"

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of the numbers of a point."""
        return (*(f"c_{pin}" for pin in self.linkage.clearances), *self.free)

    @property
    def settings(self) -> Mapping[str, Any]:
        """The other inputs of the results; folders of before other parameters than friction were free stay the same."""
        others = [name for name in self.free if name != "friction"]
        return {
            "linkage": self.linkage.as_data(),
            "paths": list(self.paths),
            "simulation": attrs.asdict(self.simulation_settings),
            "with_friction": "friction" in self.free,
            "replicates": self.replicates,
            **({"free": others} if others else {}),
        }

    @property
    def outputs(self) -> Mapping[str, Output]:
        """For each path its features and the largest force, their spreads, and until when it is a prediction."""
        outputs: dict[str, Output] = {}
        runs = f"{self.replicates + 1} runs with clearances a nanometre apart at most"
        mean = f", mean over {runs}" if self.replicates else ""
        for path in self.paths:
            for name, (unit, meaning) in _QUANTITIES.items():
                what = f"{meaning}, path {path}"
                outputs[f"{path}_{name}"] = Output(description=what + mean, units=unit)
                if self.replicates:
                    text = f"standard deviation over these runs: {what}"
                    outputs[f"{path}_{name}_spread"] = Output(description=text, units=unit)
            if self.replicates:
                text = f"time until which these runs stay within {MAX_DISTANCE * 1e6:g} um of the first, path {path}"
                outputs[f"{path}_until"] = Output(description=text, units="s")
        return outputs

    @property
    def axes(self) -> Mapping[str, Axis]:
        """No output has an axis of its own."""
        return {}

    @cached_property
    def tasks(self) -> tuple[Scenario, ...]:
        """The prepared paths, computed when they are first needed."""
        return tuple(prepare_scenario(self.linkage, thesis_path(path), self.simulation_settings) for path in self.paths)

    def __call__(self, points: Array) -> dict[str, Any]:
        """Return the outputs at (m, k) points, and which runs diverged."""
        pins = len(self.linkage.pins)
        free = {FREE_PARAMETERS[name].argument: points[:, pins + k] for k, name in enumerate(self.free)}
        rows = perturb_clearances(points[:, :pins], self.replicates)
        outputs: dict[str, Any] = {}
        diverged = np.zeros(len(points), dtype=bool)
        for path, task in zip(self.paths, self.tasks, strict=True):
            runs = [_simulate_outputs(task, row, free) for row in rows]
            diverged |= np.any([run.diverged for run in runs], axis=0)
            for name in _QUANTITIES:
                # The runs of a point are adjacent in memory: their sums then round alike, whatever the other points.
                values = np.stack([run.features[name] for run in runs], axis=-1)
                with np.errstate(invalid="ignore", over="ignore"):
                    outputs[f"{path}_{name}"] = values.mean(axis=-1)
                    if self.replicates:
                        outputs[f"{path}_{name}_spread"] = values.std(axis=-1, ddof=1)
            if self.replicates:
                outputs[f"{path}_until"] = last_time_together(
                    runs[0].time, np.stack([run.error for run in runs]), MAX_DISTANCE
                )
        outputs[FAILURE] = ["the simulation diverged" if failed else "" for failed in diverged]
        return outputs

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the prepared paths, which a worker computes itself."""
        return {key: value for key, value in self.__dict__.items() if key != "tasks"}


def is_random(values: Array, spreads: Array, runs: int) -> bool:
    """Whether a feature is nothing but random: it varies more between indistinguishable runs than over the design.

    Args:
        values: (m,) means over such runs, at the points of a design.
        spreads: (m,) their standard deviations there.
        runs: number of runs in each mean, which contains a part of the random variation.
    """
    variance = float(np.mean(spreads**2))
    return variance > float(np.var(values)) - variance / runs


def feature_vector(values: Mapping[str, Array], paths: Sequence[str], names: Sequence[str]) -> Array:
    """Return (..., f) chosen features of several paths, in that order.

    Args:
        values: by ``path_feature``.
        paths: names of the paths.
        names: of the features.
    """
    return np.stack([np.asarray(values[f"{path}_{name}"]) for path in paths for name in names], axis=-1)


def is_sweep_of(settings: Mapping[str, Any], linkage: Linkage) -> bool:
    """Whether a sweep is one of a linkage; its own clearances, which each run replaces, do not count."""
    swept, own = (
        {**plain, "pins": [{**pin, "clearance": None} for pin in plain.get("pins", [])]}
        for plain in (settings.get("linkage", {}), linkage.as_data())
    )
    return swept == own


def _simulate_outputs(task: Scenario, clearances: Array, free: Mapping[str, Any]) -> _RunOutputs:
    """Simulate (m, p) clearances [m] with free parameters (m,) each and return the outputs of the sweep."""
    # One core: the sweep occupies the others.
    run = simulate(task, clearances, threads=1, **free)
    values = {**simulation_features(run)._asdict(), "peak": run.peaks.max(axis=-1)}
    return _RunOutputs(values, run.time, run.error, np.asarray(run.status != Status.FINISHED))
