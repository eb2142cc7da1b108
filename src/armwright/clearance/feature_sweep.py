"""Many linkages at once: the features of their error curves on several paths, as the task of a sweep.

Each linkage is simulated several times with clearances that nobody can tell apart: a feature is the mean of these runs,
and their spread says how much of it is chance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, Flags, integer
from armwright.clearance.features import UNITS, features
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import TEST_PATHS, thesis_path
from armwright.clearance.predictability import APART, TWINS, perturbed, together_until
from armwright.clearance.scenario import Scenario, prepare
from armwright.clearance.settings import Settings
from armwright.clearance.simulation import Status, simulate
from armwright.errors import InvalidValueError, one_of
from armwright.sweep.task import FAILURE, Axis, Output

# What a path's features and largest force mean, and in what they are told.
_MEANING = {
    "slope": "slope of the straight part of the error",
    "intercept": "intercept of the straight part of the error",
    "amp_dc": "twice the mean error",
    "amp_ac": "largest amplitude of a wave of the error",
    "offset_x": "error at the start, along x",
    "offset_y": "error at the start, along y",
    "peak": "largest force in a pin",
}
_UNITS = {**UNITS, "peak": "N"}
# Runs beside each of a sweep: of so few each spread is known to 40 %, and those of some neighbours together well.
FEW_TWINS = 3


class _Seen(NamedTuple):
    """What is kept of m runs: by name (m,) numbers, times (s,) [s], the error there (m, s, 2) [m], which diverged."""

    numbers: dict[str, Array]
    time: Array
    error: Array
    lost: Flags


@attrs.frozen(kw_only=True, eq=False, slots=False)
class FeatureSweep:
    """The features of linkages with given clearances, on several paths.

    A point has one clearance for each pin, in its order, and after them the coefficient of friction where
    ``with_friction`` says so.

    Attributes:
        linkage: what moves.
        paths: names of test paths, each once; the features look at the straight part that these have.
        settings_of: how it is simulated.
        with_friction: whether a point has a coefficient of friction too.
        twins: runs beside each, with clearances a nanometre away at most. With none there is no spread.
    """

    linkage: Linkage
    paths: tuple[str, ...]
    settings_of: Settings = attrs.field(factory=Settings)
    with_friction: bool = False
    twins: int = FEW_TWINS

    def __attrs_post_init__(self) -> None:
        """Refuse paths that there are not, or that stand there twice, and more twins than fill a vector."""
        if integer(self.twins, "twins", least=0) > TWINS:
            raise InvalidValueError(f"twins: expected 0 to {TWINS}, got {self.twins}")
        for path in self.paths:
            one_of("test path", path, TEST_PATHS)
            if self.paths.count(path) > 1:
                raise InvalidValueError(f"paths: '{path}' stands there twice")
        if not self.paths:
            raise InvalidValueError("paths: expected one or more, got none")

    @property
    def name(self) -> str:
        """The name of the task."""
        return f"features of {self.linkage.name}"

    @property
    def parameters(self) -> tuple[str, ...]:
        """What a point consists of."""
        names = tuple(f"c_{pin}" for pin in self.linkage.clearances)
        return (*names, "friction") if self.with_friction else names

    @property
    def settings(self) -> Mapping[str, Any]:
        """All else that the results depend on."""
        return {
            "linkage": _told(self.linkage),
            "paths": list(self.paths),
            "simulation": attrs.asdict(self.settings_of),
            "with_friction": self.with_friction,
            "twins": self.twins,
        }

    @property
    def outputs(self) -> Mapping[str, Output]:
        """For each path its features and the largest force, their spreads, and until when it is a prediction."""
        found: dict[str, Output] = {}
        of_all = f", mean over {self.twins + 1} runs with clearances a nanometre apart at most" if self.twins else ""
        for path in self.paths:
            for name, meaning in _MEANING.items():
                what = f"{meaning}, path {path}"
                found[f"{path}_{name}"] = Output(description=what + of_all, units=_UNITS[name])
                if self.twins:
                    text = f"standard deviation of that over these runs: {what}"
                    found[f"{path}_{name}_spread"] = Output(description=text, units=_UNITS[name])
            if self.twins:
                text = f"until when these runs stay within {APART * 1e6:g} um of the first, path {path}"
                found[f"{path}_until"] = Output(description=text, units="s")
        return found

    @property
    def axes(self) -> Mapping[str, Axis]:
        """No output has an axis of its own."""
        return {}

    @cached_property
    def tasks(self) -> tuple[Scenario, ...]:
        """The paths made ready, when they are first needed."""
        return tuple(prepare(self.linkage, thesis_path(path), self.settings_of) for path in self.paths)

    def __call__(self, points: Array) -> dict[str, Any]:
        """Return the outputs at (m, k) points; a run that diverged says so."""
        pins = len(self.linkage.pins)
        frictions = points[:, pins] if self.with_friction else None
        rows = perturbed(points[:, :pins], self.twins)
        found: dict[str, Any] = {}
        lost = np.zeros(len(points), dtype=bool)
        for path, task in zip(self.paths, self.tasks, strict=True):
            runs = [_seen(task, row, frictions) for row in rows]
            lost |= np.any([one.lost for one in runs], axis=0)
            for name in _MEANING:
                # The runs of a point stand side by side in memory: sums then round alike, whatever points are beside.
                values = np.stack([one.numbers[name] for one in runs], axis=-1)
                with np.errstate(invalid="ignore", over="ignore"):
                    found[f"{path}_{name}"] = values.mean(axis=-1)
                    if self.twins:
                        found[f"{path}_{name}_spread"] = values.std(axis=-1, ddof=1)
            if self.twins:
                found[f"{path}_until"] = together_until(runs[0].time, np.stack([one.error for one in runs]), APART)
        found[FAILURE] = ["the simulation diverged" if one else "" for one in lost]
        return found

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what a worker makes for itself."""
        return {key: value for key, value in self.__dict__.items() if key != "tasks"}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        """Take what was kept."""
        self.__dict__.update(state)


def is_chance(values: Array, spreads: Array, runs: int) -> bool:
    """Whether a feature tells chance alone: runs that nobody can tell apart differ by more than the design changes it.

    Args:
        values: (m,) means over such runs, at the points of a design.
        spreads: (m,) their standard deviations there.
        runs: over how many the means are taken: a part of the chance is left in them.
    """
    chance = float(np.mean(spreads**2))
    return chance > float(np.var(values)) - chance / runs


def feature_vector(values: Mapping[str, Array], paths: Sequence[str], names: Sequence[str]) -> Array:
    """Return (..., f) chosen features of several paths, in that order.

    Args:
        values: by ``path_feature``.
        paths: names of the paths.
        names: of the features.
    """
    return np.stack([np.asarray(values[f"{path}_{name}"]) for path in paths for name in names], axis=-1)


def is_sweep_of(settings: Mapping[str, Any], linkage: Linkage) -> bool:
    """Whether the settings of a sweep are those of a linkage, whatever its own clearances: each run had others."""
    both = [dict(one) for one in (settings.get("linkage", {}), _told(linkage))]
    for one in both:
        one["pins"] = [{key: value for key, value in pin.items() if key != "clearance"} for pin in one.get("pins", [])]
    return both[0] == both[1]


def _seen(task: Scenario, clearances: Array, frictions: Array | None) -> _Seen:
    """Simulate (m, p) clearances [m] and keep what a sweep tells of them."""
    # One core: the sweep has the others.
    run = simulate(task, clearances, frictions=frictions, threads=1)
    numbers = {**features(run)._asdict(), "peak": run.peaks.max(axis=-1)}
    return _Seen(numbers, run.time, run.error, np.asarray(run.status != Status.FINISHED))


def _told(linkage: Linkage) -> dict[str, Any]:
    """Return a linkage as plain data."""
    plain: dict[str, Any] = _plain(attrs.asdict(linkage))
    return plain


def _plain(value: Any) -> Any:
    """Return something as JSON can hold it."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(one) for one in value]
    return value
