"""What features say of clearances, learnt from simulations: one Gaussian process per feature.

Source:
    Thesis, 4.5.3 (Kriging); spec of the clearance, 4.2 and 4.4. Anisotropic squared exponential, with a noise of its
    own: what impacts leave to chance is noise to a smooth surface.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence

import attrs
import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_triangular
from scipy.optimize import least_squares

from armwright.arrays import Array, ArrayLike, floats, one_core
from armwright.errors import InvalidValueError, MissingExtraError, ShapeError, TooFewError

# Lengths over which a feature may change, as part of the range of a parameter.
_LENGTHS = (0.1, 30.0)
# What chance adds, as part of the variance of a feature: less than the smallest is lost in rounding, and a feature
# that impacts leave to chance is nothing but noise. What cannot be told from it teaches nothing.
_NOISE = (1e-8, 1.0)
_AMPLITUDE = (1e-2, 1e4)
# From so many points the surface of a feature is learnt; more cost time with their cube.
MOST_POINTS = 300
# A correlation of what surfaces miss is believed so far: it comes of a few hundred points.
_SURE = 0.98
# How much of what chance does to a feature at one place it does at another, as part of the range of a parameter.
_NEIGHBOURS = 0.2
# Features are compared at so many points first, and matched from the best of them: fewer starts end in a wrong valley.
_TRIED, _STARTS = 480, 6


@attrs.frozen(kw_only=True, eq=False)
class Process:
    """A fitted Gaussian process over the unit cube.

    Attributes:
        x: (m, k) what it was learnt from.
        lengths: (k,) over which it changes.
        amplitude: variance of the smooth part.
        noise: variance of what chance adds.
        weights: (m,) of the points.
        whitener: (m, m) W with Wᵀ W the inverse of their covariance; the inverse itself would round far worse.
        mean: of what was learnt.
        scale: its deviation, by which all the above is divided.
    """

    x: Array
    lengths: Array
    amplitude: float
    noise: float
    weights: Array
    whitener: Array
    mean: float
    scale: float

    def predict(self, unit: Array) -> tuple[Array, Array]:
        """Return mean and standard deviation (q,) at points (q, k)."""
        a, b = unit / self.lengths, self.x / self.lengths
        apart = (a**2).sum(axis=-1)[:, None] + (b**2).sum(axis=-1) - 2 * a @ b.T
        near = self.amplitude * np.exp(-0.5 * np.maximum(apart, 0.0))
        left = self.amplitude + self.noise - ((near @ self.whitener.T) ** 2).sum(axis=-1)
        # Rounding must not make a run surer than chance lets it be.
        deviation = np.sqrt(np.maximum(left, self.noise))
        return self.mean + self.scale * (near @ self.weights), np.asarray(self.scale * deviation, dtype=np.float64)

    def left_out(self) -> Array:
        """Return (m,) by how many deviations each point is off where the others alone predict it.

        Source:
            Rasmussen & Williams (2006), eq. 5.12.
        """
        return np.asarray(self.weights / np.sqrt((self.whitener**2).sum(axis=0)), dtype=np.float64)

    def slope(self, unit: Array) -> Array:
        """Return (k,) how the mean changes about a point (k,)."""
        apart = (self.x - unit) / self.lengths
        near = self.amplitude * np.exp(-0.5 * (apart**2).sum(axis=-1))
        return np.asarray(self.scale * ((near * self.weights) @ apart) / self.lengths, dtype=np.float64)


@attrs.frozen(kw_only=True, eq=False)
class Surrogate:
    """The features of a linkage as smooth functions of its parameters.

    Attributes:
        parameters: k names.
        features: f names.
        lower: (k,) of the range that was learnt.
        upper: (k,).
        processes: one per feature.
        correlation: (f, f) of what the surfaces miss: a run whose slope comes out too large has too small an
            intercept. Of features that were not learnt together, none.
        spreads: (m, f) standard deviations over runs that nobody can tell apart, at the points of the processes; None
            where they are not known.
    """

    parameters: tuple[str, ...]
    features: tuple[str, ...]
    lower: Array
    upper: Array
    processes: tuple[Process, ...]
    correlation: Array = attrs.field()
    spreads: Array | None = None

    @correlation.default
    def _alone(self) -> Array:
        return np.eye(len(self.features))

    def predict(self, points: ArrayLike) -> tuple[Array, Array]:
        """Return features (m, f) at points (m, k), and their standard deviations.

        The deviation is that of the surface, and of what chance adds to a single run.
        """
        unit = (floats(points, "points") - self.lower) / (self.upper - self.lower)
        found = [process.predict(unit) for process in self.processes]
        mean, deviation = (np.stack(one, axis=-1) for one in zip(*found, strict=True))
        return mean, np.asarray(np.hypot(deviation, self._chance(unit)), dtype=np.float64)

    def _chance(self, unit: Array) -> Array | float:
        """Return by how much single runs differ about points (m, k) [standard deviation]: that of their neighbours."""
        if self.spreads is None:
            return 0.0
        apart = ((unit[:, None] - self.processes[0].x) ** 2).sum(axis=-1) / _NEIGHBOURS**2
        # Far from all others the nearest counts.
        near = np.exp(-0.5 * (apart - apart.min(axis=-1, keepdims=True)))
        return np.asarray(np.sqrt(near @ self.spreads**2 / near.sum(axis=-1, keepdims=True)), dtype=np.float64)

    def chosen(self, names: Sequence[str]) -> Surrogate:
        """Return the surrogate of some of the features."""
        numbers = [self.features.index(name) for name in names]
        return attrs.evolve(
            self,
            features=tuple(names),
            processes=tuple(self.processes[i] for i in numbers),
            correlation=self.correlation[np.ix_(numbers, numbers)],
            spreads=None if self.spreads is None else self.spreads[:, numbers],
        )


def learn(
    parameters: Sequence[str],
    points: ArrayLike,
    features: Sequence[str],
    values: ArrayLike,
    *,
    spreads: ArrayLike | None = None,
    ranges: ArrayLike | None = None,
    seed: int = 0,
    restarts: int = 0,
    progress: Callable[[str], None] | None = None,
) -> Surrogate:
    """Learn features from simulations.

    Args:
        parameters: k names.
        points: (m, k) at which was simulated; those that came to nothing (NaN) are left out.
        features: f names.
        values: (m, f) what came of it.
        spreads: (m, f) standard deviations of it over runs that nobody can tell apart, by which a single run that is
            measured may be off; none when left out.
        ranges: (k, 2) of the design; those of the points when left out, which chance leaves a little narrower.
        seed: which points are taken where there are more than ``MOST_POINTS``.
        restarts: how often the lengths are sought again from another start.
        progress: told the name of each feature before it is learnt.

    Raises:
        MissingExtraError: scikit-learn is not installed.
        ShapeError: the tables do not fit together.
        InvalidValueError: there are too few points, one lies outside the ranges, or a parameter does not vary.
    """
    x, y = floats(points, "points"), np.asarray(values, dtype=np.float64)
    shaken = None if spreads is None else np.asarray(spreads, dtype=np.float64)
    if x.ndim != 2 or y.shape != (len(x), len(features)) or x.shape[1] != len(parameters):
        raise ShapeError(
            f"expected (m, {len(parameters)}) points and (m, {len(features)}) values, got {x.shape} and {y.shape}"
        )
    if shaken is not None and shaken.shape != y.shape:
        raise ShapeError(f"spreads: expected {y.shape}, as the values, got {shaken.shape}")
    kept = _kept(y, 4 * (len(parameters) + 1), seed)
    lower, upper = _ranges(x[kept], ranges)
    for name, low, high in zip(parameters, lower, upper, strict=True):
        if not low < high:
            raise InvalidValueError(f"parameter {name} does not vary: it is {low:g} in every run")
    unit = (x[kept] - lower) / (upper - lower)
    processes = []
    for i, name in enumerate(features):
        if progress is not None:
            progress(name)
        processes.append(_fitted(unit, y[kept, i], seed, restarts))
    missed = np.stack([process.left_out() for process in processes])
    return Surrogate(
        parameters=tuple(parameters),
        features=tuple(features),
        lower=lower,
        upper=upper,
        processes=tuple(processes),
        correlation=_SURE * np.atleast_2d(np.corrcoef(missed)) + (1 - _SURE) * np.eye(len(processes)),
        spreads=None if shaken is None else shaken[kept],
    )


def solve_features(surrogate: Surrogate, seen: ArrayLike, weights: ArrayLike | None = None) -> Array:
    """Return the parameters (k,) whose features come nearest to those seen: the thesis' way.

    Args:
        surrogate: with f features.
        seen: (f,) features.
        weights: (f,) standard deviations by which to compare, or their covariance (f, f); those of the surrogate when
            left out.

    Raises:
        ShapeError: the features are not f.
    """
    goal = floats(seen, "seen")
    if goal.shape != (len(surrogate.features),):
        raise ShapeError(f"seen: expected {len(surrogate.features)} features, got shape {goal.shape}")
    width = surrogate.upper - surrogate.lower
    middle = (surrogate.lower + surrogate.upper)[None] / 2
    scale = surrogate.predict(middle)[1][0] if weights is None else floats(weights, "weights")
    whitener = np.diag(1 / scale) if scale.ndim == 1 else np.linalg.inv(np.linalg.cholesky(scale))

    def missing(unit: Array) -> Array:
        mean, _ = surrogate.predict((surrogate.lower + unit * width)[None])
        return np.asarray(whitener @ (mean[0] - goal), dtype=np.float64)

    def slopes(unit: Array) -> Array:
        # Differences would tell the rounding of the means, which is large where chance adds next to nothing.
        return np.asarray(whitener @ np.stack([process.slope(unit) for process in surrogate.processes]))

    rng = np.random.default_rng(0)
    starts = rng.random((_TRIED, len(width)))
    with one_core():
        means, _ = surrogate.predict(surrogate.lower + starts * width)
        order = np.argsort((((means - goal) @ whitener.T) ** 2).sum(axis=-1))
        found = [least_squares(missing, starts[i], slopes, bounds=(0.0, 1.0), xtol=1e-12) for i in order[:_STARTS]]
    best = min(found, key=lambda one: float(one.cost))
    return np.asarray(surrogate.lower + best.x * width, dtype=np.float64)


def _kept(y: Array, least: int, seed: int) -> npt.NDArray[np.intp]:
    """Return which rows (m, f) are learnt from: those that ended well, at most ``MOST_POINTS``.

    Raises:
        TooFewError: there are fewer than ``least``.
    """
    kept = np.flatnonzero(np.all(np.isfinite(y), axis=-1))
    if len(kept) < least:
        raise TooFewError(f"points: expected {least} or more that ended well, got {len(kept)}")
    if len(kept) > MOST_POINTS:
        kept = np.sort(np.random.default_rng(seed).choice(kept, MOST_POINTS, replace=False))
    return kept


def _ranges(x: Array, ranges: ArrayLike | None) -> tuple[Array, Array]:
    """Return (k,) the lower and upper ends of what was simulated.

    Raises:
        ShapeError: there is not one range for each parameter.
        InvalidValueError: a point lies outside.
    """
    low, high = x.min(axis=0), x.max(axis=0)
    if ranges is None:
        return low, high
    ends = floats(ranges, "ranges")
    if ends.shape != (x.shape[1], 2):
        raise ShapeError(f"ranges: expected shape {(x.shape[1], 2)}, got {ends.shape}")
    if np.any(low < ends[:, 0]) or np.any(high > ends[:, 1]):
        raise InvalidValueError("ranges: a point lies outside of them")
    return ends[:, 0], ends[:, 1]


def check_extra() -> None:
    """Import what learning needs.

    Raises:
        MissingExtraError: it is not installed.
    """
    try:
        import sklearn.gaussian_process  # noqa: F401, PLC0415 - an extra
    except ImportError as error:
        raise MissingExtraError(
            'learning from simulations needs scikit-learn; install it by: pip install "armwright[clearance]"'
        ) from error


def _fitted(unit: Array, y: Array, seed: int, restarts: int) -> Process:
    check_extra()
    from sklearn.exceptions import ConvergenceWarning  # noqa: PLC0415 - an extra
    from sklearn.gaussian_process import GaussianProcessRegressor  # noqa: PLC0415
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel  # noqa: PLC0415

    kernel = ConstantKernel(10.0, _AMPLITUDE) * RBF([1.0] * unit.shape[1], _LENGTHS) + WhiteKernel(1e-5, _NOISE)
    # Scaled here, so that the way back is ours too.
    mean, scale = float(y.mean()), float(y.std()) or 1.0
    process = GaussianProcessRegressor(kernel, n_restarts_optimizer=restarts, random_state=seed)
    with warnings.catch_warnings(), one_core():
        # A length at its bound is a feature that hardly depends on a parameter.
        warnings.simplefilter("ignore", ConvergenceWarning)
        process.fit(unit, (y - mean) / scale)
    smooth, chance = process.kernel_.k1, process.kernel_.k2
    return Process(
        x=unit,
        lengths=np.array(smooth.k2.length_scale, dtype=np.float64),
        amplitude=float(smooth.k1.constant_value),
        noise=float(chance.noise_level),
        weights=np.array(process.alpha_, dtype=np.float64),
        whitener=np.asarray(solve_triangular(process.L_, np.eye(len(unit)), lower=True), dtype=np.float64),
        mean=mean,
        scale=scale,
    )
