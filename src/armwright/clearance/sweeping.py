"""Many linkages at once: the features of their error curves on several paths, as the task of a sweep."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.clearance.features import UNITS, Features, features
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import TEST_PATHS, thesis_path
from armwright.clearance.preparing import Task, prepare
from armwright.clearance.settings import Settings
from armwright.clearance.simulation import Status, simulate
from armwright.errors import InvalidValueError, one_of
from armwright.sweep.task import FAILURE, Axis, Output

_MEANING = {
    "slope": "slope of the straight part of the error",
    "intercept": "intercept of the straight part of the error",
    "amp_dc": "twice the mean error",
    "amp_ac": "largest amplitude of a wave of the error",
    "offset_x": "error at the start, along x",
    "offset_y": "error at the start, along y",
}


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
    """

    linkage: Linkage
    paths: tuple[str, ...]
    settings_of: Settings = attrs.field(factory=Settings)
    with_friction: bool = False

    def __attrs_post_init__(self) -> None:
        """Refuse paths that there are not, or that stand there twice."""
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
        }

    @property
    def outputs(self) -> Mapping[str, Output]:
        """One number for each feature and path, and the largest forces."""
        found = {
            f"{path}_{name}": Output(description=f"{_MEANING[name]}, path {path}", units=UNITS[name])
            for path in self.paths
            for name in Features._fields
        }
        return found | {
            f"{path}_peak": Output(description=f"largest force in a pin, path {path}", units="N") for path in self.paths
        }

    @property
    def axes(self) -> Mapping[str, Axis]:
        """No output has an axis of its own."""
        return {}

    @cached_property
    def tasks(self) -> tuple[Task, ...]:
        """The paths made ready, when they are first needed."""
        return tuple(prepare(self.linkage, thesis_path(path), self.settings_of) for path in self.paths)

    def __call__(self, points: Array) -> dict[str, Any]:
        """Return the outputs at (m, k) points; a run that diverged says so."""
        pins = len(self.linkage.pins)
        frictions = points[:, pins] if self.with_friction else None
        found: dict[str, Any] = {}
        lost = np.zeros(len(points), dtype=bool)
        for path, task in zip(self.paths, self.tasks, strict=True):
            # One core: the sweep has the others.
            run = simulate(task, points[:, :pins], frictions=frictions, threads=1)
            for name, values in features(run)._asdict().items():
                found[f"{path}_{name}"] = values
            found[f"{path}_peak"] = run.peaks.max(axis=-1)
            lost |= run.status != Status.FINISHED
        found[FAILURE] = ["the simulation diverged" if one else "" for one in lost]
        return found

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what a worker makes for itself."""
        return {key: value for key, value in self.__dict__.items() if key != "tasks"}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        """Take what was kept."""
        self.__dict__.update(state)


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
