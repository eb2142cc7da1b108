"""What was measured of a linkage with play: where its tip rests, or how it follows paths; as CSV.

At rest, one row for each reading: ``pose, commanded_x_mm, commanded_y_mm, x_mm, y_mm``. On paths, one row for each
sample: ``path, t_s, x_mm, y_mm``; those after the end of the path are left out. Lengths may be in m, mm or um, all of a
file in the same unit; time in s or ms.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.clearance.estimation.misfit import refuse_contradiction
from armwright.clearance.estimation.static import Estimate, estimate_at_rest
from armwright.clearance.features import Features, features_of
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import named_path
from armwright.files.column_names import LENGTH, TIME, Column, Schema
from armwright.files.limits import beyond, limit
from armwright.files.unit_table import UnitTable, read_header

_AT_REST = ("pose", "commanded_x", "commanded_y", "x", "y")
_ON_PATHS = ("path", "t", "x", "y")
_SCHEMA = Schema(
    columns=(
        Column(name="pose"),
        Column(name="path"),
        Column(name="t", quantity=TIME),
        *(
            Column(name=name, quantity=LENGTH, group="lengths", synonyms=(f"{name[-1]}_nominal",) * (len(name) > 1))
            for name in _AT_REST[1:]
        ),
    )
)
# An error beyond this is no play but another unit, or another arm [m].
_LARGEST = 0.02
# No instrument that is meant tells a resting tip to less [m].
LEAST_NOISE = 1e-6
# Samples of a measured path, at least, and how much of the path they must tell.
_FEWEST, _WHOLE = 20, 0.99


@attrs.frozen(kw_only=True, eq=False)
class RestMeasured:
    """Readings of a resting tip.

    Attributes:
        names: of k poses.
        poses: (k, 2) where the tip was told to be [m].
        offsets: (k, 2) by how much it was off, mean of the readings [m].
        readings: (k,) how many there are of each.
        noise: standard deviation of one coordinate of one reading, from how all readings of a pose differ; None where
            none was read twice, or no readings differ [m].
    """

    names: tuple[str, ...]
    poses: Array
    offsets: Array
    readings: tuple[int, ...]
    noise: float | None

    def estimate(self, linkage: Linkage, noise: float | None = None) -> Estimate:
        """Return the clearances that the readings tell.

        Args:
            linkage: that was measured.
            noise: standard deviation of one coordinate of one reading; that of the readings themselves without it, and
                where none of them differ, what is left of the fit [m].

        Raises:
            ContradictionError: no clearances explain the readings.
            TooFewError: the poses do not tell all clearances.
        """
        own = self.noise if noise is None else noise
        found = estimate_at_rest(linkage, self.poses, self.offsets, own or LEAST_NOISE, self.readings)
        if noise is None and self.noise is not None:
            found = attrs.evolve(found, freedom=2.0 * sum(n - 1 for n in self.readings))
        if own is None and found.spare > 0 and found.square > found.spare:
            # Nothing but what is left says how large the noise is, and it cannot contradict the model too.
            more = float(found.square) / found.spare
            return attrs.evolve(
                found,
                noise=found.noise * math.sqrt(more),
                covariance=more * found.covariance,
                freedom=float(found.spare),
            )
        off = found.standardised.tolist()
        farthest = [
            (f"{axis} of {name}", x)
            for name, pair in zip(self.names, off, strict=True)
            for axis, x in zip("xy", pair, strict=True)
        ]
        bounds = [f"{name} at 0" for name, ends in zip(found.names, found.at_bound, strict=True) if ends]
        refuse_contradiction(float(found.misfit), farthest, bounds)
        return found


@attrs.frozen(kw_only=True, eq=False)
class PathsMeasured:
    """How a tip followed paths.

    Attributes:
        times: by path (s,) of the samples [s].
        errors: by path (s, 2) by how much it was off [m].
    """

    times: Mapping[str, Array]
    errors: Mapping[str, Array]

    def features(self) -> dict[str, Features]:
        """Return the features of each error curve."""
        return {name: features_of(self.times[name], self.errors[name]) for name in self.times}

    def seen(self, names: tuple[str, ...]) -> Array:
        """Return (f,) features ``path_feature``."""
        found = self.features()
        return np.array([getattr(found[path], name) for path, _, name in (one.partition("_") for one in names)])

    def noise_of(self, names: tuple[str, ...], noise: float, *, draws: int = 200, seed: int = 0) -> Array:
        """Return the covariance (f, f) that a noise of the samples gives to features ``path_feature``.

        Args:
            names: of the features.
            noise: standard deviation of one coordinate of a sample [m].
            draws: how often noise is drawn.
            seed: of the draws.
        """
        rng = np.random.default_rng(seed)
        columns: dict[str, Array] = {}
        for path, error in self.errors.items():
            drawn = features_of(self.times[path], error + noise * rng.standard_normal((draws, *error.shape)))
            columns |= {f"{path}_{feature}": values for feature, values in drawn._asdict().items()}
        table = np.stack([columns[name] for name in names], axis=-1)
        return np.atleast_2d(np.cov(table, rowvar=False))


def read_measured(
    path: Path | str, *, columns: Mapping[str, str] | None = None, skip_incomplete: bool = False
) -> RestMeasured | PathsMeasured:
    """Read a file of measurements.

    Args:
        path: the file.
        columns: names of columns, with unit, by those in the file: ``{"X": "x_mm"}``.
        skip_incomplete: leave out rows with empty cells; an ``IncompleteRowsWarning`` says how many.

    Raises:
        FileFormatError: it is missing or broken; columns are missing or in mixed units; a number is none; the tip is
            farther off than any play lets it be. The text has file and line.
    """
    header = read_header(path, _SCHEMA, columns=columns)
    names = header.present(("pose", "path"))
    if len(names) != 1:
        there = "both" if names else "neither"
        raise header.error("pose", f"expected a column pose or a column path, and there are {there}: {header.listing}")
    wanted = _AT_REST if names[0] == "pose" else _ON_PATHS
    header.require(wanted)
    table = header.rows(filled=wanted, skip_incomplete=skip_incomplete)
    groups = _rows_by_name(table, names[0])
    numbers = table.numbers(wanted[1:])
    return _at_rest(table, numbers, groups) if names[0] == "pose" else _on_paths(table, numbers, groups)


def _rows_by_name(table: UnitTable, column: str) -> dict[str, list[int]]:
    """Return the numbers of the rows of each pose or path.

    Raises:
        FileFormatError: there are more poses or paths than the limit.
    """
    groups: dict[str, list[int]] = {}
    most = limit("entries")
    for row, name in enumerate(table.words(column)):
        groups.setdefault(name, []).append(row)
        if len(groups) > most:
            raise table.error(row, column, f"too many: {beyond('entries')}")
    return groups


def _at_rest(table: UnitTable, numbers: Array, groups: Mapping[str, list[int]]) -> RestMeasured:
    poses, offsets, counts, spread = [], [], [], []
    for name, rows in groups.items():
        values = numbers[rows]
        if np.any(np.ptp(values[:, :2], axis=0) > 0):
            raise table.error(rows[0], name, "this pose is commanded at different positions")
        off = values[:, 2:] - values[:, :2]
        _refuse_far(table, rows[0], name, off)
        poses.append(values[0, :2])
        offsets.append(off.mean(axis=0))
        counts.append(len(rows))
        if len(rows) > 1:
            spread.append(((off - off.mean(axis=0)) ** 2).sum(axis=0).mean())
    again = sum(counts) - len(counts)
    variance = sum(spread) / again if again else 0.0
    return RestMeasured(
        names=tuple(groups),
        poses=np.array(poses),
        offsets=np.array(offsets),
        readings=tuple(counts),
        noise=math.sqrt(variance) if variance > 0 else None,
    )


def _on_paths(table: UnitTable, numbers: Array, groups: Mapping[str, list[int]]) -> PathsMeasured:
    times: dict[str, Array] = {}
    errors: dict[str, Array] = {}
    for name, rows in groups.items():
        try:
            wanted = named_path(name)
        except LookupError as error:
            raise table.error(rows[0], "path", str(error)) from error
        values = numbers[rows]
        t = values[:, 0]
        if len(rows) < _FEWEST:
            raise table.error(rows[0], name, f"expected {_FEWEST} samples or more, got {len(rows)}")
        steps = np.diff(t)
        if np.any(steps <= 0) or np.ptp(steps) > 0.01 * steps.mean():
            late = int(np.argmax(np.abs(steps - np.median(steps)))) + 1
            raise table.error(rows[late], "t", "samples must be equally spaced in time")
        if abs(t[0]) > 1.5 * steps.mean() or t[-1] < _WHOLE * wanted.duration - 1.5 * steps.mean():
            raise table.error(rows[0], "t", f"path {name} takes {wanted.duration:g} s; got {t[0]:g} to {t[-1]:g} s")
        # While the tip rests after the path its error says something else than on the way: a mean must not count it.
        on_the_way = t <= wanted.duration + 0.5 * steps.mean()
        t, values = t[on_the_way], values[on_the_way]
        off = values[:, 1:] - wanted.at(t).at
        _refuse_far(table, rows[0], name, off)
        times[name], errors[name] = t, off
    return PathsMeasured(times=times, errors=errors)


def _refuse_far(table: UnitTable, row: int, name: str, off: Array) -> None:
    """Refuse what no play explains."""
    worst = float(np.hypot(off[:, 0], off[:, 1]).max())
    if worst > _LARGEST:
        raise table.error(
            row,
            name,
            f"the tip is {worst * 1e3:.4g} mm from where it was told to be; are the units right, and is it in the axes "
            f"of the ground? More than {_LARGEST * 1e3:g} mm is no play",
        )
