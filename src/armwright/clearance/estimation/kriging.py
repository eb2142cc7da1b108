"""Surrogates of error-curve features as functions of clearances: one Gaussian process per feature.

Source:
    Thesis, 4.5.3 (Kriging); spec of the clearance, 4.2 and 4.4. Anisotropic squared exponential, with a noise of its
    own: the random effect of impacts is noise to a smooth surface.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence

import attrs
import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_triangular
from scipy.optimize import least_squares

from armwright.arrays import Array, ArrayLike, exact_shape, floats, one_core
from armwright.errors import InvalidValueError, ShapeError, TooFewError
from armwright.extras import import_extra

# Bounds of the length scales, as parts of the range of a parameter.
_LENGTHS = (0.1, 30.0)
# Bounds of the noise, as parts of the variance of a feature: rounding is below the smallest, and a feature that is
# nothing but random has the largest.
_NOISE = (1e-8, 1.0)
_AMPLITUDE = (1e-2, 1e4)
# The largest number of points of a surrogate; the time grows with their cube.
MAX_POINTS = 300
# The weight of the estimated correlation of residuals, which stems from a few hundred points.
_CORRELATION_WEIGHT = 0.98
# The distance over which spreads are averaged, as part of the range of a parameter.
_NEIGHBOURHOOD = 0.2
# Features are compared at so many points first, and fitted from the best of them: fewer starts end in a local minimum.
_CANDIDATES, _STARTS = 480, 6


@attrs.frozen(kw_only=True, eq=False)
class Process:
    """A fitted Gaussian process over the unit cube.

    Attributes:
        x: (m, k) training points.
        lengths: (k,) length scales.
        amplitude: variance of the smooth part.
        noise: variance of the noise.
        weights: (m,) of the points.
        whitener: (m, m) W with Wᵀ W the inverse of their covariance; the inverse itself would round far worse.
        mean: of the training values.
        scale: their deviation, by which all the above is divided.
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
        variance = self.amplitude + self.noise - ((near @ self.whitener.T) ** 2).sum(axis=-1)
        # Rounding must not reduce the variance below that of the noise.
        deviation = np.sqrt(np.maximum(variance, self.noise))
        return self.mean + self.scale * (near @ self.weights), np.asarray(self.scale * deviation, dtype=np.float64)

    def leave_one_out(self) -> Array:
        """Return (m,) the residual of each point from its prediction by the others, in standard deviations.

        Source:
            Rasmussen & Williams (2006), eq. 5.12.
        """
        return np.asarray(self.weights / np.sqrt((self.whitener**2).sum(axis=0)), dtype=np.float64)

    def gradient(self, unit: Array) -> Array:
        """Return (k,) the gradient of the mean at a point (k,)."""
        apart = (self.x - unit) / self.lengths
        near = self.amplitude * np.exp(-0.5 * (apart**2).sum(axis=-1))
        return np.asarray(self.scale * ((near * self.weights) @ apart) / self.lengths, dtype=np.float64)


@attrs.frozen(kw_only=True, eq=False)
class Surrogate:
    """The features of a linkage as smooth functions of its parameters.

    Attributes:
        parameters: k names.
        features: f names.
        lower: (k,) lower ends of the range of the simulations.
        upper: (k,) its upper ends.
        processes: one per feature.
        correlation: (f, f) of the residuals: a run with too large a slope has too small an intercept; the identity for
            features that were not learnt together.
        spreads: (m, f) standard deviations over indistinguishable runs, at the points of the processes; None where
            they are not known.
    """

    parameters: tuple[str, ...]
    features: tuple[str, ...]
    lower: Array
    upper: Array
    processes: tuple[Process, ...]
    correlation: Array = attrs.field(default=attrs.Factory(lambda self: np.eye(len(self.features)), takes_self=True))
    spreads: Array | None = None

    def predict(self, points: ArrayLike) -> tuple[Array, Array]:
        """Return features (m, f) at points (m, k), and their standard deviations.

        The deviation contains that of the surface and the random variation of a single run.
        """
        unit = (floats(points, "points") - self.lower) / (self.upper - self.lower)
        predictions = [process.predict(unit) for process in self.processes]
        mean, deviation = (np.stack(columns, axis=-1) for columns in zip(*predictions, strict=True))
        return mean, np.asarray(np.hypot(deviation, self._run_deviation(unit)), dtype=np.float64)

    def _run_deviation(self, unit: Array) -> Array | float:
        """Return the standard deviation of single runs about points (m, k): a mean over their neighbours."""
        if self.spreads is None:
            return 0.0
        apart = ((unit[:, None] - self.processes[0].x) ** 2).sum(axis=-1) / _NEIGHBOURHOOD**2
        # Far from all others only the nearest counts.
        near = np.exp(-0.5 * (apart - apart.min(axis=-1, keepdims=True)))
        return np.asarray(np.sqrt(near @ self.spreads**2 / near.sum(axis=-1, keepdims=True)), dtype=np.float64)

    def select(self, names: Sequence[str]) -> Surrogate:
        """Return the surrogate of the named features."""
        numbers = [self.features.index(name) for name in names]
        return attrs.evolve(
            self,
            features=tuple(names),
            processes=tuple(self.processes[i] for i in numbers),
            correlation=self.correlation[np.ix_(numbers, numbers)],
            spreads=None if self.spreads is None else self.spreads[:, numbers],
        )


def fit_surrogate(
    parameters: Sequence[str],
    points: ArrayLike,
    features: Sequence[str],
    values: ArrayLike,
    *,
    spreads: ArrayLike | None = None,
    ranges: ArrayLike | None = None,
    progress: Callable[[str], None] | None = None,
) -> Surrogate:
    """Learn features from simulations.

    Args:
        parameters: k names.
        points: (m, k) of the simulations; those that failed (NaN) are left out.
        features: f names.
        values: (m, f) features of the simulations.
        spreads: (m, f) their standard deviations over indistinguishable runs, which a single measured run has too;
            none when left out.
        ranges: (k, 2) of the design; by default those of the points, which are a little narrower.
        progress: called with the name of each feature before it is learnt.

    Raises:
        MissingExtraError: scikit-learn is not installed.
        ShapeError: the tables do not fit together.
        InvalidValueError: there are too few points, one lies outside the ranges, or a parameter does not vary.
    """
    x, y = floats(points, "points"), np.asarray(values, dtype=np.float64)
    deviations = None if spreads is None else np.asarray(spreads, dtype=np.float64)
    if x.ndim != 2 or y.shape != (len(x), len(features)) or x.shape[1] != len(parameters):
        raise ShapeError(
            f"expected (m, {len(parameters)}) points and (m, {len(features)}) values, got {x.shape} and {y.shape}"
        )
    if deviations is not None and deviations.shape != y.shape:
        raise ShapeError(f"spreads: expected {y.shape}, as the values, got {deviations.shape}")
    rows = _training_rows(y, 4 * (len(parameters) + 1))
    lower, upper = _ranges(x[rows], ranges)
    for name, low, high in zip(parameters, lower, upper, strict=True):
        if not low < high:
            raise InvalidValueError(f"parameter {name} does not vary: it is {low:g} in every run")
    unit = (x[rows] - lower) / (upper - lower)
    processes = []
    for i, name in enumerate(features):
        if progress is not None:
            progress(name)
        processes.append(_fit_process(unit, y[rows, i]))
    correlation = np.atleast_2d(np.corrcoef(np.stack([process.leave_one_out() for process in processes])))
    return Surrogate(
        parameters=tuple(parameters),
        features=tuple(features),
        lower=lower,
        upper=upper,
        processes=tuple(processes),
        correlation=_CORRELATION_WEIGHT * correlation + (1 - _CORRELATION_WEIGHT) * np.eye(len(processes)),
        spreads=None if deviations is None else deviations[rows],
    )


def solve_features(surrogate: Surrogate, measured: ArrayLike, weights: ArrayLike | None = None) -> Array:
    """Return the parameters (k,) whose features come nearest to measured ones: the method of the thesis.

    Args:
        surrogate: with f features.
        measured: (f,) features.
        weights: (f,) standard deviations of the features, or their covariance (f, f); by default those of the
            surrogate.

    Raises:
        ShapeError: the features are not f.
    """
    goal = exact_shape(measured, (len(surrogate.features),), "measured features")
    width = surrogate.upper - surrogate.lower
    middle = (surrogate.lower + surrogate.upper)[None] / 2
    scale = surrogate.predict(middle)[1][0] if weights is None else floats(weights, "weights")
    whitener = np.diag(1 / scale) if scale.ndim == 1 else np.linalg.inv(np.linalg.cholesky(scale))

    def residuals(unit: Array) -> Array:
        mean, _ = surrogate.predict((surrogate.lower + unit * width)[None])
        return np.asarray(whitener @ (mean[0] - goal), dtype=np.float64)

    def jacobian(unit: Array) -> Array:
        # Finite differences would amplify the rounding of the means, which is large where the noise is small.
        return np.asarray(whitener @ np.stack([process.gradient(unit) for process in surrogate.processes]))

    rng = np.random.default_rng(0)
    starts = rng.random((_CANDIDATES, len(width)))
    with one_core():
        means, _ = surrogate.predict(surrogate.lower + starts * width)
        order = np.argsort((((means - goal) @ whitener.T) ** 2).sum(axis=-1))
        fits = [least_squares(residuals, starts[i], jacobian, bounds=(0.0, 1.0), xtol=1e-12) for i in order[:_STARTS]]
    best = min(fits, key=lambda fit: float(fit.cost))
    return np.asarray(surrogate.lower + best.x * width, dtype=np.float64)


def _training_rows(y: Array, least: int) -> npt.NDArray[np.intp]:
    """Return the numbers of the rows (m, f) to learn from: those without NaN, at most ``MAX_POINTS``.

    Raises:
        TooFewError: there are fewer than ``least``.
    """
    rows = np.flatnonzero(np.all(np.isfinite(y), axis=-1))
    if len(rows) < least:
        raise TooFewError(f"points: expected {least} or more simulations that finished, got {len(rows)}")
    if len(rows) > MAX_POINTS:
        rows = np.sort(np.random.default_rng(0).choice(rows, MAX_POINTS, replace=False))
    return rows


def _ranges(x: Array, ranges: ArrayLike | None) -> tuple[Array, Array]:
    """Return (k,) the lower and (k,) the upper ends of the simulated range.

    Raises:
        ShapeError: there is not one range for each parameter.
        InvalidValueError: a point lies outside.
    """
    low, high = x.min(axis=0), x.max(axis=0)
    if ranges is None:
        return low, high
    ends = exact_shape(ranges, (x.shape[1], 2), "ranges")
    if np.any(low < ends[:, 0]) or np.any(high > ends[:, 1]):
        raise InvalidValueError("ranges: a point lies outside of them")
    return ends[:, 0], ends[:, 1]


def check_extra() -> None:
    """Import the package that learning needs.

    Raises:
        MissingExtraError: it is not installed.
    """
    import_extra("sklearn.gaussian_process", "learning from simulations", "clearance", "scikit-learn")


def _fit_process(unit: Array, y: Array) -> Process:
    check_extra()
    from sklearn.exceptions import ConvergenceWarning  # noqa: PLC0415 - an extra
    from sklearn.gaussian_process import GaussianProcessRegressor  # noqa: PLC0415
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel  # noqa: PLC0415

    kernel = ConstantKernel(10.0, _AMPLITUDE) * RBF([1.0] * unit.shape[1], _LENGTHS) + WhiteKernel(1e-5, _NOISE)
    # Scaled here, since the predictions scale back here too.
    mean, scale = float(y.mean()), float(y.std()) or 1.0
    process = GaussianProcessRegressor(kernel, random_state=0)
    with warnings.catch_warnings(), one_core():
        # A length at its bound is a feature that hardly depends on a parameter.
        warnings.simplefilter("ignore", ConvergenceWarning)
        process.fit(unit, (y - mean) / scale)
    smooth, noise = process.kernel_.k1, process.kernel_.k2
    return Process(
        x=unit,
        lengths=np.array(smooth.k2.length_scale, dtype=np.float64),
        amplitude=float(smooth.k1.constant_value),
        noise=float(noise.noise_level),
        weights=np.array(process.alpha_, dtype=np.float64),
        whitener=np.asarray(solve_triangular(process.L_, np.eye(len(unit)), lower=True), dtype=np.float64),
        mean=mean,
        scale=scale,
    )
