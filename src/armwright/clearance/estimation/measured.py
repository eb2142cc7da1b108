"""What was measured of a linkage with play: where its tip rests, or how it follows paths; as CSV.

At rest, one row for each reading: ``pose, commanded_x_mm, commanded_y_mm, x_mm, y_mm``. On paths, one row for each
sample: ``path, t_s, x_mm, y_mm``; those after the end of the path are left out. Lengths may be in m, mm or um, all of a
file in the same unit; time in s or ms.
"""

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
from armwright.errors import FileFormatError, closest
from armwright.files.limits import beyond, limit
from armwright.files.rows import number_in_cell, of_one_width, read_rows

_LENGTHS = {"m": 1.0, "mm": 1e-3, "um": 1e-6}
_TIMES = {"s": 1.0, "ms": 1e-3}
_AT_REST = ("pose", "commanded_x", "commanded_y", "x", "y")
_ON_PATHS = ("path", "t", "x", "y")
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


def read_measured(path: Path | str) -> RestMeasured | PathsMeasured:
    """Read a file of measurements.

    Raises:
        FileFormatError: it is missing or broken; columns are missing or in mixed units; a number is none; the tip is
            farther off than any play lets it be. The text has file and line.
    """
    path = Path(path)
    head, below = read_rows(path)
    columns, scales = _columns(path, head.line, [name.lower() for name in head.cells])
    wanted = _AT_REST if "pose" in columns else _ON_PATHS
    found: dict[str, list[tuple[int, list[float]]]] = {}
    most = limit("entries")
    for row in of_one_width(path, head, below):
        values = [number_in_cell(path, row.line, name, row.cells[columns[name]]) * scales[name] for name in wanted[1:]]
        name = row.cells[columns[wanted[0]]]
        if not name:
            raise FileFormatError(path, row.line, wanted[0], "expected a name, got nothing")
        found.setdefault(name, []).append((row.line, values))
        if len(found) > most:
            raise FileFormatError(path, row.line, wanted[0], f"too many: {beyond('entries')}")
    return _at_rest(path, found) if "pose" in columns else _on_paths(path, found)


def _columns(path: Path, line: int, head: list[str]) -> tuple[dict[str, int], dict[str, float]]:
    """Return where the columns are, and what their units are in SI.

    Raises:
        FileFormatError: one is missing, stands there twice, is unknown, or lengths are in different units.
    """
    wanted = _AT_REST if "pose" in head else _ON_PATHS
    found: dict[str, int] = {}
    scales: dict[str, float] = {}
    lengths: dict[str, str] = {}
    for i, name in enumerate(head):
        base, _, unit = name.rpartition("_")
        if name in ("pose", "path"):
            base = name
        elif base not in wanted or unit not in (units := _TIMES if base == "t" else _LENGTHS):
            usual = [wanted[0], *(f"{one}_s" if one == "t" else f"{one}_mm" for one in wanted[1:])]
            near = next((one for one in usual if one.rpartition("_")[0] == base), None) or closest(name, usual)
            hint = f"; did you mean {near}?" if near else ""
            raise FileFormatError(path, line, name, f"unknown column{hint}; expected {_expected(wanted)}")
        else:
            scales[base] = units[unit]
            if base != "t":
                lengths[name] = unit
        if base in found:
            raise FileFormatError(path, line, name, "this column stands there twice")
        found[base] = i
    missing = [name for name in wanted if name not in found]
    if missing:
        raise FileFormatError(path, line, missing[0], f"missing; expected the columns {_expected(wanted)}")
    if len(set(lengths.values())) > 1:
        raise FileFormatError(
            path, line, "", f"lengths are in mixed units: {', '.join(lengths)}; expected one unit for all"
        )
    return found, scales


def _expected(wanted: tuple[str, ...]) -> str:
    return ", ".join([wanted[0], *(f"{name}_s" if name == "t" else f"{name}_mm" for name in wanted[1:])])


def _at_rest(path: Path, table: Mapping[str, list[tuple[int, list[float]]]]) -> RestMeasured:
    poses, offsets, counts, spread = [], [], [], []
    for name, rows in table.items():
        values = np.array([row for _, row in rows])
        if np.any(np.ptp(values[:, :2], axis=0) > 0):
            raise FileFormatError(path, rows[0][0], name, "this pose is commanded at different places")
        off = values[:, 2:] - values[:, :2]
        _refuse_far(path, rows[0][0], name, off)
        poses.append(values[0, :2])
        offsets.append(off.mean(axis=0))
        counts.append(len(rows))
        if len(rows) > 1:
            spread.append(((off - off.mean(axis=0)) ** 2).sum(axis=0).mean())
    again = sum(counts) - len(counts)
    variance = sum(spread) / again if again else 0.0
    return RestMeasured(
        names=tuple(table),
        poses=np.array(poses),
        offsets=np.array(offsets),
        readings=tuple(counts),
        noise=math.sqrt(variance) if variance > 0 else None,
    )


def _on_paths(path: Path, table: Mapping[str, list[tuple[int, list[float]]]]) -> PathsMeasured:
    times: dict[str, Array] = {}
    errors: dict[str, Array] = {}
    for name, rows in table.items():
        try:
            wanted = named_path(name)
        except LookupError as error:
            raise FileFormatError(path, rows[0][0], "path", str(error)) from error
        values = np.array([row for _, row in rows])
        t = values[:, 0]
        if len(rows) < _FEWEST:
            raise FileFormatError(path, rows[0][0], name, f"expected {_FEWEST} samples or more, got {len(rows)}")
        steps = np.diff(t)
        if np.any(steps <= 0) or np.ptp(steps) > 0.01 * steps.mean():
            late = int(np.argmax(np.abs(steps - np.median(steps)))) + 1
            raise FileFormatError(path, rows[late][0], "t", "samples must be equally spaced in time")
        if abs(t[0]) > 1.5 * steps.mean() or t[-1] < _WHOLE * wanted.duration - 1.5 * steps.mean():
            raise FileFormatError(
                path, rows[0][0], "t", f"path {name} takes {wanted.duration:g} s; got {t[0]:g} to {t[-1]:g} s"
            )
        # While the tip rests after the path its error says something else than on the way: a mean must not count it.
        on_the_way = t <= wanted.duration + 0.5 * steps.mean()
        t, values = t[on_the_way], values[on_the_way]
        off = values[:, 1:] - wanted.at(t).at
        _refuse_far(path, rows[0][0], name, off)
        times[name], errors[name] = t, off
    return PathsMeasured(times=times, errors=errors)


def _refuse_far(path: Path, line: int, name: str, off: Array) -> None:
    """Refuse what no play explains."""
    worst = float(np.hypot(off[:, 0], off[:, 1]).max())
    if worst > _LARGEST:
        raise FileFormatError(
            path,
            line,
            name,
            f"the tip is {worst * 1e3:.4g} mm from where it was told to be; are the units right, and is it in the axes "
            f"of the ground? More than {_LARGEST * 1e3:g} mm is no play",
        )
