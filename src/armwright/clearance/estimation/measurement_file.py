"""Measurements of a linkage with clearance, as CSV: resting positions of its tip, or its motion on paths.

At rest, one row for each reading: ``pose, commanded_x_mm, commanded_y_mm, x_mm, y_mm``. On paths, one row for each
sample: ``path, t_s, x_mm, y_mm``; samples after the end of the path are ignored. Lengths may be in m, mm or um, all
of a file in the same unit; time in s or ms.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from pathlib import Path

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.clearance.estimation.misfit import refuse_contradiction
from armwright.clearance.estimation.static_estimate import Estimate, estimate_at_rest
from armwright.clearance.features import Features, error_curve_features
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import named_path
from armwright.files.column_names import LENGTH, TIME, Column, Schema
from armwright.files.limits import limit, limit_message
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
# A larger error is no clearance but another unit, or another arm [m].
_MAX_ERROR = 0.02
# No instrument measures a resting tip more accurately [m].
LEAST_NOISE = 1e-6
# The smallest number of samples of a measured path, and the part of the path that they must cover.
_MIN_COUNT, _COVERAGE = 20, 0.99
# How often noise is drawn for the covariance of features.
_DRAWS = 200


@attrs.frozen(kw_only=True, eq=False)
class RestMeasurement:
    """Readings of a resting tip.

    Attributes:
        names: of k poses.
        poses: (k, 2) commanded positions of the tip [m].
        offsets: (k, 2) from these, means of the readings [m].
        readings: (k,) the number of readings of each pose.
        noise: standard deviation of one coordinate of one reading, from the scatter of the readings of each pose; None
            where no pose was read twice, or no readings differ [m].
    """

    names: tuple[str, ...]
    poses: Array
    offsets: Array
    readings: tuple[int, ...]
    noise: float | None

    def estimate(self, linkage: Linkage, noise: float | None = None, *, friction: float = 0.0) -> Estimate:
        """Return the clearances that explain the readings.

        Args:
            linkage: that was measured.
            noise: standard deviation of one coordinate of one reading; without it that of the readings themselves, and
                where none of them differ, that of the residuals of the fit [m].
            friction: see ``estimate_at_rest``.

        Raises:
            ContradictionError: no clearances explain the readings.
            TooFewError: the poses do not determine all clearances.
        """
        own = self.noise if noise is None else noise
        estimate = estimate_at_rest(
            linkage, self.poses, self.offsets, own or LEAST_NOISE, self.readings, friction=friction
        )
        if noise is None and self.noise is not None:
            estimate = attrs.evolve(estimate, noise_freedom=2.0 * sum(n - 1 for n in self.readings))
        freedom = estimate.degrees_of_freedom
        if own is None and freedom > 0 and (ratio := float(estimate.chi_square) / freedom) > 1:
            # The residuals are the only measure of the noise, so that they cannot contradict the model too.
            return attrs.evolve(
                estimate,
                noise=estimate.noise * math.sqrt(ratio),
                covariance=ratio * estimate.covariance,
                scatter=ratio * estimate.scatter,
                noise_shares=np.ones_like(estimate.noise_shares),
                noise_freedom=float(freedom),
            )
        labels = [f"{axis} of {name}" for name in self.names for axis in "xy"]
        residuals = zip(labels, estimate.standardised.ravel().tolist(), strict=True)
        bounds = [f"{name} at 0" for name in itertools.compress(estimate.names, estimate.at_bound)]
        refuse_contradiction(float(estimate.misfit), residuals, bounds)
        return estimate


@attrs.frozen(kw_only=True, eq=False)
class PathMeasurement:
    """The motion of a tip on paths.

    Attributes:
        times: by path (s,) of the samples [s].
        errors: by path (s, 2) of the tip [m].
    """

    times: Mapping[str, Array]
    errors: Mapping[str, Array]

    def features(self) -> dict[str, Features]:
        """Return the features of each error curve."""
        return {name: error_curve_features(self.times[name], self.errors[name]) for name in self.times}

    def feature_values(self, names: tuple[str, ...]) -> Array:
        """Return (f,) features ``path_feature``."""
        curves = self.features()
        return np.array([getattr(curves[path], feature) for path, feature in (name.split("_", 1) for name in names)])

    def feature_covariance(self, names: tuple[str, ...], noise: float) -> Array:
        """Return the covariance (f, f) of features ``path_feature`` that the noise of the samples causes.

        Args:
            names: of the features.
            noise: standard deviation of one coordinate of a sample [m].
        """
        rng = np.random.default_rng(0)
        columns: dict[str, Array] = {}
        for path, error in self.errors.items():
            drawn = error_curve_features(self.times[path], error + noise * rng.standard_normal((_DRAWS, *error.shape)))
            columns |= {f"{path}_{feature}": values for feature, values in drawn._asdict().items()}
        table = np.stack([columns[name] for name in names], axis=-1)
        return np.atleast_2d(np.cov(table, rowvar=False))


def read_clearance_measurements(
    path: Path | str, *, columns: Mapping[str, str] | None = None, skip_incomplete: bool = False
) -> RestMeasurement | PathMeasurement:
    """Read a file of measurements.

    Args:
        path: the file.
        columns: names of columns, with unit, by those in the file: ``{"X": "x_mm"}``.
        skip_incomplete: leave out rows with empty cells; an ``IncompleteRowsWarning`` says how many.

    Raises:
        FileFormatError: it is missing or broken; columns are missing or in mixed units; a cell is no number; the tip is
            farther from its commanded position than any clearance allows. The text has file and line.
    """
    header = read_header(path, _SCHEMA, columns=columns)
    column = header.either_column("pose", "path")
    expected = _AT_REST if column == "pose" else _ON_PATHS
    header.require(expected)
    table = header.rows(filled=expected, skip_incomplete=skip_incomplete)
    groups = _rows_by_name(table, column)
    numbers = table.numbers(expected[1:])
    return _rest_measurement(table, numbers, groups) if column == "pose" else _path_measurement(table, numbers, groups)


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
            raise table.error(row, column, f"too many: {limit_message('entries')}")
    return groups


def _rest_measurement(table: UnitTable, numbers: Array, groups: Mapping[str, list[int]]) -> RestMeasurement:
    poses, offsets, counts, spread = [], [], [], []
    for name, rows in groups.items():
        values = numbers[rows]
        if np.any(np.ptp(values[:, :2], axis=0) > 0):
            raise table.error(rows[0], name, "this pose is commanded at different positions")
        errors = values[:, 2:] - values[:, :2]
        refuse_large_errors(table, rows[0], name, errors)
        poses.append(values[0, :2])
        offsets.append(errors.mean(axis=0))
        counts.append(len(rows))
        if len(rows) > 1:
            spread.append(((errors - errors.mean(axis=0)) ** 2).sum(axis=0).mean())
    repeated = sum(counts) - len(counts)
    variance = sum(spread) / repeated if repeated else 0.0
    return RestMeasurement(
        names=tuple(groups),
        poses=np.array(poses),
        offsets=np.array(offsets),
        readings=tuple(counts),
        noise=math.sqrt(variance) if variance > 0 else None,
    )


def _path_measurement(table: UnitTable, numbers: Array, groups: Mapping[str, list[int]]) -> PathMeasurement:
    times: dict[str, Array] = {}
    errors: dict[str, Array] = {}
    for name, rows in groups.items():
        try:
            path = named_path(name)
        except LookupError as error:
            raise table.error(rows[0], "path", str(error)) from error
        values = numbers[rows]
        t = values[:, 0]
        if len(rows) < _MIN_COUNT:
            raise table.error(rows[0], name, f"expected {_MIN_COUNT} samples or more, got {len(rows)}")
        steps = np.diff(t)
        if np.any(steps <= 0) or np.ptp(steps) > 0.01 * steps.mean():
            late = int(np.argmax(np.abs(steps - np.median(steps)))) + 1
            raise table.error(rows[late], "t", "samples must be equally spaced in time")
        if abs(t[0]) > 1.5 * steps.mean() or t[-1] < _COVERAGE * path.duration - 1.5 * steps.mean():
            raise table.error(rows[0], "t", f"path {name} takes {path.duration:g} s; got {t[0]:g} to {t[-1]:g} s")
        # The error of the tip at rest after the path must not enter the mean.
        during_path = t <= path.duration + 0.5 * steps.mean()
        times[name] = t[during_path]
        errors[name] = values[during_path, 1:] - path.evaluate(times[name]).position
        refuse_large_errors(table, rows[0], name, errors[name])
    return PathMeasurement(times=times, errors=errors)


def refuse_large_errors(table: UnitTable, row: int, name: str, errors: Array) -> None:
    """Refuse errors (s, 2) of the tip that no clearance explains [m]."""
    worst = float(np.hypot(errors[:, 0], errors[:, 1]).max())
    if worst > _MAX_ERROR:
        text = (
            f"the tip is {worst * 1e3:.4g} mm from its commanded position; are the units right, and is it in the axes "
            f"of the ground? More than {_MAX_ERROR * 1e3:g} mm is no clearance"
        )
        raise table.error(row, name, text)
