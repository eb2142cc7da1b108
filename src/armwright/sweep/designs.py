"""Designs of experiments: full factorial, Latin hypercube, Sobol, or any table of points.

A design is the table of its points, one row per run, and records how it was made. The same call makes the same points,
bit for bit.
"""

from collections.abc import Mapping, Sequence
from math import prod
from typing import Any

import attrs
import numpy as np

from armwright.arrays import LARGEST, Array, array_key, floats, integer, read_only, reduce_by_fields
from armwright.errors import InvalidValueError, KindError, ShapeError, one_of, shown

# More runs than this are a slip in a level, not a plan.
MAX_RUNS = 10_000_000


def _parameter_names(value: Sequence[str]) -> tuple[str, ...]:
    if isinstance(value, str):
        raise KindError(f"names: expected a sequence of parameter names, one per column, got the string {shown(value)}")
    return tuple(value)


def _design_points(value: Any) -> Array:
    points = floats(value, "points")
    if points.ndim != 2 or 0 in points.shape:
        raise ShapeError(
            f"points: expected one row per run and one column per parameter, neither empty, got shape {points.shape}"
        )
    return read_only(points)


@attrs.frozen(kw_only=True)
class Design:
    """The points of the runs of a sweep. A table of the caller's own is of the kind ``given``.

    Attributes:
        names: of the k parameters.
        points: (n, k) values of the parameters, one row per run.
        units: of every parameter; "1" where there is none.
        kind: how the points were made: given, full factorial, latin hypercube or sobol.
        seed: of the random numbers that the points were made with.
        ranges: by parameter, the levels of a full factorial or the two bounds of the others; empty for ``given``.
    """

    names: tuple[str, ...] = attrs.field(converter=_parameter_names)
    points: Array = attrs.field(converter=_design_points, eq=array_key)
    units: Mapping[str, str] = attrs.field(factory=dict, hash=False)
    kind: str = "given"
    seed: int | None = None
    ranges: Mapping[str, tuple[float, ...]] = attrs.field(factory=dict, hash=False)

    __reduce__ = reduce_by_fields

    def __attrs_post_init__(self) -> None:
        """Refuse a column without a name, and units of an unknown parameter."""
        if len(self.names) != self.points.shape[1]:
            raise ShapeError(f"design: {len(self.names)} names, but points of {self.points.shape[1]} parameters")
        for name in self.units:
            one_of("parameter", name, self.names)
        object.__setattr__(self, "units", {name: str(self.units.get(name, "1")) for name in self.names})

    def __len__(self) -> int:
        """Return the number of runs."""
        return len(self.points)


def full_factorial(levels: Mapping[str, Sequence[float]], *, units: Mapping[str, str] | None = None) -> Design:
    """Return every combination of levels; the last parameter changes fastest.

    Args:
        levels: by parameter, its levels.
        units: by parameter, where it has one.

    Raises:
        InvalidValueError: there is no parameter, one has no level or the same one twice, a level is not finite, or
            there are more than ten million combinations.
        KindError: a level is no number.
        UnknownNameError: ``units`` names something that is no parameter.
    """
    _check_mapping(levels, "levels")
    columns = {name: floats(values, f"levels of {name}") for name, values in levels.items()}
    for name, column in columns.items():
        if column.ndim != 1 or not column.size:
            raise ShapeError(f"levels of {name}: expected one level or more, got {shown(levels[name])}")
        if len(np.unique(column)) < column.size:
            raise InvalidValueError(f"levels of {name}: a level occurs twice: {shown(levels[name])}")
    _check_runs(prod(column.size for column in columns.values()))
    grids = np.meshgrid(*columns.values(), indexing="ij")
    points = np.stack([grid.ravel() for grid in grids], axis=-1)
    ranges = {name: tuple(column.tolist()) for name, column in columns.items()}
    return Design(names=(*columns,), points=points, units=units or {}, kind="full factorial", ranges=ranges)


def latin_hypercube(
    bounds: Mapping[str, tuple[float, float]], n: int, seed: int, *, units: Mapping[str, str] | None = None
) -> Design:
    """Return n points: cut the range of any parameter into n equal parts, and each part has one of them.

    Args:
        bounds: by parameter, the lower and the upper bound.
        n: how many points.
        seed: of the random numbers; the same seed makes the same points.
        units: by parameter, where it has one.

    Raises:
        InvalidValueError: there is no parameter, bounds are reversed, equal or not finite, or ``n`` or ``seed`` is
            out of range.
        KindError: a bound is no number, or ``n`` or ``seed`` no whole number.
        ShapeError: there are not two bounds.
        UnknownNameError: ``units`` names something that is no parameter.

    Source:
        McKay, Beckman & Conover (1979), as in ``scipy.stats.qmc.LatinHypercube``.
    """
    return _sample("latin hypercube", bounds, integer(n, "n", least=1), seed, units)


def sobol(
    bounds: Mapping[str, tuple[float, float]], n: int, seed: int, *, units: Mapping[str, str] | None = None
) -> Design:
    """Return n points of a scrambled Sobol sequence, which fills the ranges evenly.

    Args:
        bounds: by parameter, the lower and the upper bound.
        n: how many points, a power of two: with another number the sequence is out of balance.
        seed: of the scrambling; the same seed makes the same points.
        units: by parameter, where it has one.

    Raises:
        InvalidValueError: there is no parameter, bounds are reversed, equal, not finite or beyond 1e100, ``n`` is
            no power of two, or ``seed`` is below 0.
        KindError: a bound is no number, or ``n`` or ``seed`` no whole number.
        ShapeError: there are not two bounds.
        UnknownNameError: ``units`` names something that is no parameter.

    Source:
        Sobol (1967), scrambled after Matousek (1998), as in ``scipy.stats.qmc.Sobol``.
    """
    n = integer(n, "n", least=1)
    below = 1 << n.bit_length() - 1
    if n != below:
        raise InvalidValueError(
            f"n: a Sobol design needs a power of two of points, got {n}; the nearest are {below} and {2 * below}"
        )
    return _sample("sobol", bounds, n, seed, units)


def _sample(
    kind: str, bounds: Mapping[str, tuple[float, float]], n: int, seed: int, units: Mapping[str, str] | None
) -> Design:
    """Return a sample of the unit cube, scaled to the bounds."""
    from scipy.stats import qmc  # noqa: PLC0415 - slow to load, and full factorials do without

    _check_mapping(bounds, "bounds")
    ends = np.array([_interval(name, pair) for name, pair in bounds.items()])
    rng = np.random.default_rng(integer(seed, "seed", least=0))
    _check_runs(n)
    sampler = (qmc.Sobol if kind == "sobol" else qmc.LatinHypercube)(len(bounds), rng=rng)
    points = ends[:, 0] + (ends[:, 1] - ends[:, 0]) * sampler.random(n)
    ranges = dict(zip(bounds, map(tuple, ends.tolist()), strict=True))
    return Design(names=(*bounds,), points=points, units=units or {}, kind=kind, seed=seed, ranges=ranges)


def _interval(name: str, pair: tuple[float, float]) -> Array:
    """Return the lower and the upper bound of a parameter."""
    ends = floats(pair, f"bounds of {name}", LARGEST)
    if ends.shape != (2,):
        raise ShapeError(f"bounds of {name}: expected a lower and an upper one, got {shown(pair)}")
    lower, upper = ends
    if not lower < upper:
        what = "reversed" if lower > upper else "equal"
        raise InvalidValueError(f"bounds of {name}: they are {what}: from {lower:g} to {upper:g}")
    return ends


def _check_mapping(value: Mapping[str, Any], what: str) -> None:
    if not isinstance(value, Mapping):
        raise KindError(f"{what}: expected numbers by parameter, {{'name': (...)}}, got {shown(value)}")
    if not value:
        raise InvalidValueError(f"{what}: expected one parameter or more, got none")


def _check_runs(runs: int) -> None:
    if runs > MAX_RUNS:
        raise InvalidValueError(f"design: expected at most {MAX_RUNS} runs, got {runs}; use fewer levels or points")
