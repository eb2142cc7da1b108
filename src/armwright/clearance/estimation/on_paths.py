"""What a sweep teaches of features of error curves, and which of them it shows to be chance alone."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arrays import Array
from armwright.clearance.estimation.kriging import Surrogate, learn
from armwright.clearance.feature_sweep import is_chance, is_sweep_of
from armwright.clearance.linkage import Linkage
from armwright.errors import FileFormatError, InvalidValueError, shown
from armwright.sweep.folder import RESULTS
from armwright.sweep.results import load

# Nothing that is swept has a larger number, in SI units.
_LARGEST = 1e9


@attrs.frozen(kw_only=True, eq=False)
class Learnt:
    """What a sweep teaches.

    Attributes:
        surrogate: of the features that tell more than chance.
        chance: names of the others, which are left out.
        until: by path, until when half of the runs are predictions [s]; empty where the sweep has no runs beside each.
        runs: how many linkages were swept.
    """

    surrogate: Surrogate
    chance: tuple[str, ...]
    until: Mapping[str, float]
    runs: int


def learnt_from(
    folder: Path | str,
    linkage: Linkage,
    paths: Sequence[str],
    features: Sequence[str],
    progress: Callable[[str], None] | None = None,
) -> Learnt:
    """Learn the features of some paths from a sweep.

    Args:
        folder: of the sweep.
        linkage: that was measured.
        paths: names of the paths that were measured.
        features: names of what is compared on each.
        progress: told the name of each feature before it is learnt.

    Raises:
        FileFormatError: what is there is not what a sweep of clearances writes.
        InvalidValueError: the sweep is of another linkage, a path is missing, or all features are chance.
    """
    swept = _swept(folder, linkage, paths, features)
    table, done, twins = swept.table, swept.done, swept.twins
    names = tuple(f"{path}_{feature}" for path in paths for feature in features)
    chance = tuple(
        name for name in names if twins and is_chance(table[name][done], table[f"{name}_spread"][done], twins + 1)
    )
    names = tuple(name for name in names if name not in chance)
    if not names:
        raise InvalidValueError(
            f"{folder}: on {', '.join(paths)} all features are chance: runs that nobody can tell apart differ by more "
            f"than the clearances change them; measure and sweep other paths"
        )
    surrogate = learn(
        swept.parameters,
        swept.points,
        names,
        np.stack([np.where(done, table[name], np.nan) for name in names], axis=-1),
        spreads=np.stack([table[f"{name}_spread"] for name in names], axis=-1) if twins else None,
        ranges=swept.ranges,
        progress=progress,
    )
    until = {path: float(np.median(table[f"{path}_until"][done])) for path in paths if twins}
    return Learnt(surrogate=surrogate, chance=chance, until=until, runs=len(swept.points))


@attrs.frozen(kw_only=True, eq=False)
class _Swept:
    """What is used of the results of a sweep: of n runs p parameters, and outputs by name, each (n,)."""

    parameters: tuple[str, ...]
    points: Array
    done: npt.NDArray[np.bool_]
    table: Mapping[str, Array]
    twins: int
    ranges: list[tuple[float, float]] | None


def _swept(folder: Path | str, linkage: Linkage, paths: Sequence[str], features: Sequence[str]) -> _Swept:
    """Read the results of a sweep, which anybody may have written."""
    with load(folder) as data:
        try:
            settings = json.loads(data.attrs["settings"])
            told = json.loads(data.attrs["design"])["ranges"]
            same, twins = is_sweep_of(settings, linkage), int(settings.get("twins", 0))
            parameters = tuple(name for name in map(str, data.coords) if name.startswith("c_") or name == "friction")
            known = set(parameters) <= set(told)
            # The two bounds of a design by chance, or the levels of a full factorial.
            ranges = [_ends(told[name], name) for name in parameters] if known else None
            outputs = [f"{path}_{feature}" for path in paths for feature in features]
            outputs += [f"{name}_spread" for name in outputs] + [f"{path}_until" for path in paths] if twins else []
            missing = sorted(path for path in paths if f"{path}_{features[0]}" not in data)
            runs = data.sizes["run"]
            table = {} if missing else {name: _numbers(data[name].to_numpy(), name, runs) for name in outputs}
            points = np.stack([_numbers(data[name].to_numpy(), name, runs) for name in parameters], axis=-1)
            done = _numbers(data["status"].to_numpy(), "status", runs) == 0
        except (
            LookupError,
            ValueError,
            TypeError,
            AttributeError,
            ArithmeticError,
            RecursionError,
            MemoryError,
        ) as error:
            path = Path(folder) / RESULTS
            why = shown(error) if str(error) else "it says of itself more than can be read"
            raise FileFormatError(path, None, "", f"not the results of a sweep of clearances: {why}") from error
    if not same:
        raise InvalidValueError(f"{folder}: the sweep is of another linkage than {linkage.name}; sweep this one")
    if missing:
        raise InvalidValueError(
            f"{folder}: the sweep has no path {', '.join(missing)}; sweep the paths that were measured"
        )
    return _Swept(parameters=parameters, points=points, done=done, table=table, twins=twins, ranges=ranges)


def _numbers(values: npt.NDArray[Any], name: str, runs: int) -> Array:
    """Return an output as numbers, one a run; those of runs that failed may be NaN.

    Raises:
        ValueError: it is something else, or has numbers that no linkage has.
    """
    if values.shape != (runs,) or values.dtype.kind not in "fiu":
        raise ValueError(f"{name}: expected {runs} numbers, got {values.dtype} of shape {values.shape}")
    numbers = values.astype(np.float64)
    if np.any(np.abs(numbers) > _LARGEST):
        raise ValueError(f"{name}: expected numbers up to {_LARGEST:g}, got {np.nanmax(np.abs(numbers)):g}")
    return numbers


def _ends(range_: Any, name: str) -> tuple[float, float]:
    """Return from where to where a parameter was swept.

    Raises:
        ValueError: it is not told in numbers.
    """
    ends = float(min(range_)), float(max(range_))
    if not all(map(math.isfinite, ends)):
        raise ValueError(f"{name}: expected a range of numbers, got {range_}")
    return ends
