"""Surrogates learnt from a sweep: of the features of error curves that are not random."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arrays import Array
from armwright.clearance.estimation.kriging import Surrogate, fit_surrogate
from armwright.clearance.feature_sweep import is_random, is_sweep_of
from armwright.clearance.free_parameters import FREE_PARAMETERS
from armwright.clearance.linkage import Linkage
from armwright.errors import FileFormatError, InvalidValueError, shown
from armwright.sweep.folder import RESULTS
from armwright.sweep.results import load

# No swept quantity has a larger number, in SI units.
_MAX_VALUE = 1e9
# Errors of reading results that anybody may have written.
_MALFORMED = (LookupError, ValueError, TypeError, AttributeError, ArithmeticError, RecursionError, MemoryError)


@attrs.frozen(kw_only=True, eq=False)
class SweepSurrogate:
    """A surrogate learnt from a sweep.

    Attributes:
        surrogate: of the features that are not random.
        random_features: names of the other features.
        predictable_until: by path, the time until which half of the runs are predictions [s]; empty for a sweep without
            replicates.
        runs: number of linkages in the sweep.
    """

    surrogate: Surrogate
    random_features: tuple[str, ...]
    predictable_until: Mapping[str, float]
    runs: int


def learn_from_sweep(
    folder: Path | str,
    linkage: Linkage,
    paths: Sequence[str],
    features: Sequence[str],
    progress: Callable[[str], None] | None = None,
) -> SweepSurrogate:
    """Learn the features of some paths from a sweep.

    Args:
        folder: of the sweep.
        linkage: that was measured.
        paths: names of the measured paths.
        features: names of the features of each path.
        progress: called with the name of each feature before it is learnt.

    Raises:
        FileFormatError: the folder does not have the results of a sweep of clearances.
        InvalidValueError: the sweep is of another linkage, a path is missing, or all features are random.
    """
    sweep = _read_sweep(folder, linkage, paths, features)
    table, finished, replicates = sweep.table, sweep.finished, sweep.replicates
    all_names = [f"{path}_{feature}" for path in paths for feature in features]

    def is_noise(name: str) -> bool:
        return is_random(table[name][finished], table[f"{name}_spread"][finished], replicates + 1)

    names = [name for name in all_names if not (replicates and is_noise(name))]
    if not names:
        raise InvalidValueError(
            f"{folder}: on {', '.join(paths)} all features are random: they vary more between indistinguishable runs "
            f"than over the clearances of the sweep; measure and sweep other paths"
        )
    surrogate = fit_surrogate(
        sweep.parameters,
        sweep.points,
        names,
        np.stack([np.where(finished, table[name], np.nan) for name in names], axis=-1),
        spreads=np.stack([table[f"{name}_spread"] for name in names], axis=-1) if replicates else None,
        ranges=sweep.ranges,
        progress=progress,
    )
    return SweepSurrogate(
        surrogate=surrogate,
        random_features=tuple(name for name in all_names if name not in names),
        predictable_until={path: float(np.median(table[f"{path}_until"][finished])) for path in paths if replicates},
        runs=len(sweep.points),
    )


class _Sweep(NamedTuple):
    """The results of a sweep: p parameters of n runs, and outputs by name, each (n,)."""

    parameters: tuple[str, ...]
    points: Array
    finished: npt.NDArray[np.bool_]
    table: Mapping[str, Array]
    replicates: int
    ranges: list[tuple[float, float]] | None


def _read_sweep(folder: Path | str, linkage: Linkage, paths: Sequence[str], features: Sequence[str]) -> _Sweep:
    """Read the results of a sweep, which anybody may have written."""
    with load(folder) as data:
        try:
            settings = json.loads(data.attrs["settings"])
            design = json.loads(data.attrs["design"])["ranges"]
            same, replicates = is_sweep_of(settings, linkage), int(settings.get("replicates", 0))
            parameters = tuple(
                name for name in map(str, data.coords) if name.startswith("c_") or name in FREE_PARAMETERS
            )
            # The two bounds of a random design, or the levels of a full factorial.
            in_design = set(parameters) <= set(design)
            ranges = [_swept_range(design[name], name) for name in parameters] if in_design else None
            outputs = [f"{path}_{feature}" for path in paths for feature in features]
            if replicates:
                outputs += [f"{name}_spread" for name in outputs] + [f"{path}_until" for path in paths]
            missing = sorted(path for path in paths if f"{path}_{features[0]}" not in data)
            runs = data.sizes["run"]
            table = {} if missing else {name: _output_values(data[name].to_numpy(), name, runs) for name in outputs}
            points = np.stack([_output_values(data[name].to_numpy(), name, runs) for name in parameters], axis=-1)
            finished = _output_values(data["status"].to_numpy(), "status", runs) == 0
        except _MALFORMED as error:
            path = Path(folder) / RESULTS
            why = shown(error) if str(error) else "its attributes cannot be read"
            raise FileFormatError(path, None, "", f"not the results of a sweep of clearances: {why}") from error
    if not same:
        raise InvalidValueError(f"{folder}: the sweep is of another linkage than {linkage.name}; sweep this one")
    if missing:
        names = ", ".join(missing)
        raise InvalidValueError(f"{folder}: the sweep has no path {names}; sweep the paths that were measured")
    return _Sweep(parameters, points, finished, table, replicates, ranges)


def _output_values(values: npt.NDArray[Any], name: str, runs: int) -> Array:
    """Return an output as numbers, one for each run; those of failed runs may be NaN.

    Raises:
        ValueError: it has another type or shape, or numbers that no linkage has.
    """
    if values.shape != (runs,) or values.dtype.kind not in "fiu":
        raise ValueError(f"{name}: expected {runs} numbers, got {values.dtype} of shape {values.shape}")
    numbers = values.astype(np.float64)
    if np.any(np.abs(numbers) > _MAX_VALUE):
        raise ValueError(f"{name}: expected numbers up to {_MAX_VALUE:g}, got {np.nanmax(np.abs(numbers)):g}")
    return numbers


def _swept_range(levels: Any, name: str) -> tuple[float, float]:
    """Return the ends of the swept range of a parameter.

    Raises:
        ValueError: they are no finite numbers.
    """
    ends = float(min(levels)), float(max(levels))
    if not all(map(math.isfinite, ends)):
        raise ValueError(f"{name}: expected a range of numbers, got {levels}")
    return ends
