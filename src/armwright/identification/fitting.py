"""Least squares for base parameters: weighted by joint, robust against outliers, with errors for noise in time.

Noise of currents and what a model of friction leaves out are correlated in time, so that neighbouring equations tell
less than as many independent ones. The residuals of each joint are taken for an autoregressive process, and the
covariance of the parameters follows from its spectrum (a parametric form of the estimators that are consistent under
autocorrelation).

Equations are gone through several times, and added up: memory does not grow with them where they are made anew.

Source:
    Huber (1981), Robust Statistics, chapters 6 and 7, for the fit, its scale and its covariance; den Haan & Levin
    (1997) for autoregressive spectra in covariances.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arrays import Array, Flags, read_only
from armwright.errors import TooFewError, counted
from armwright.identification.equations import Equations

# Residuals beyond so many standard deviations have less weight, and beyond so many they are outliers, with a name.
_HUBER, _OUTLIER = 2.5, 6.0
# The mean of the squares of normal residuals that are cut off at ``_HUBER``.
_CONSISTENT = 0.9776
_MAX_PASSES = 30
# Parameters that change by less than this part of their standard errors are found.
_SETTLED = 1e-3
# Joint weights settle in so many rounds.
_ROUNDS = 4
# Lags at which residuals are compared, and the largest order of their process.
_LAGS = 60
_LARGEST_ORDER = 12
# A combination of columns that is shorter than this part of the longest is not excited at all; its square is rounding.
_SINGULAR = 1e-6
# A single column that is shorter than this part of the longest is rounding.
_SHORT = 1e-8
# No residual is smaller than this part of the efforts of its joint, nor than that part of those of other joints.
_EXACT, _LIKE_OTHERS = 1e-6, 1e-5
_TINY = float(np.finfo(float).tiny)
_MAX_OUTLIERS = 1000


class Sums(NamedTuple):
    """Products of columns and efforts, added up over any number of equations.

    Attributes:
        products: (n, b + 1, b + 1) for each joint, those of its columns and its effort, the last.
        counts: (n,) usable equations of each joint.
    """

    products: Array
    counts: Array

    def __add__(self, other: object) -> Sums:
        """Add those of other equations."""
        if not isinstance(other, Sums):
            return NotImplemented
        return Sums(self.products + other.products, self.counts + other.counts)

    def __sub__(self, other: Sums) -> Sums:
        """Take those of some equations off."""
        return Sums(self.products - other.products, self.counts - other.counts)

    def columns(self, kept: Sequence[int]) -> Sums:
        """Return the sums of a model that has some of the columns."""
        index = [*kept, self.products.shape[1] - 1]
        return Sums(self.products[:, index][:, :, index], self.counts)

    def squares(self, values: Array) -> Array:
        """Return the sum of squared residuals of each joint (n,), given parameters (b,)."""
        x = np.append(-values, 1.0)
        return np.asarray(np.maximum(np.einsum("i,nij,j->n", x, self.products, x), 0.0))


def summed(blocks: Iterable[Equations], fit: Fit | None = None) -> Sums:
    """Return the sums of equations.

    Args:
        blocks: the equations.
        fit: outliers among them have the weight that they have in this fit; all count alike when left out.

    Raises:
        TooFewError: there are none.
    """
    total: Sums | None = None
    for block in blocks:
        weights = block.usable.astype(np.float64)
        if fit is not None:
            weights = np.sqrt(_weights(block.tau - block.columns @ fit.values, fit.sigma, block.usable))
        both = np.concatenate([block.columns, block.tau[:, :, None]], axis=2) * weights[:, :, None]
        products = np.matmul(both.transpose(1, 2, 0), both.transpose(1, 0, 2))
        new = Sums(products, block.usable.sum(axis=0).astype(np.float64))
        total = new if total is None else total + new
    if total is None:
        raise TooFewError("no equation is left: the logs are too short, or their joints hardly move")
    return total


class Outlier(NamedTuple):
    """An equation whose residual is too large for chance.

    Attributes:
        log: its name.
        t: time [s].
        joint: from 0.
        residual: [N m] or [N].
        deviations: by standard deviations of the joint.
    """

    log: str
    t: float
    joint: int
    residual: float
    deviations: float


@attrs.frozen(kw_only=True, eq=False)
class Fit:
    """Base parameters that were fitted.

    Attributes:
        values: (b,) parameters.
        covariance: (b, b) of them.
        sigma: (n,) standard deviation of the residuals of each joint [N m] or [N].
        counts: (n,) usable equations of each joint.
        normal: (b, b) sums of products of the columns, weighted by joint.
        outliers: equations that have hardly any weight.
        order: of the autoregressive process of the residuals of each joint.
        correlation: (n,) by how much more the variance of a mean is than if residuals were independent.
    """

    values: Array = attrs.field(converter=read_only)
    covariance: Array = attrs.field(converter=read_only)
    sigma: Array = attrs.field(converter=read_only)
    counts: Array = attrs.field(converter=read_only)
    normal: Array = attrs.field(converter=read_only)
    outliers: tuple[Outlier, ...] = ()
    order: tuple[int, ...] = ()
    correlation: Array = attrs.field(factory=lambda: np.ones(0), converter=read_only)

    def take(self, kept: Sequence[int]) -> Fit:
        """Return the fit of some of the parameters; what is known of the others is in their errors."""
        both = np.ix_(kept, kept)
        return attrs.evolve(self, values=self.values[kept], covariance=self.covariance[both], normal=self.normal[both])

    @property
    def condition(self) -> float:
        """The condition number of the columns, weighted by joint."""
        sizes = np.linalg.eigvalsh(self.normal)
        return float(np.sqrt(sizes[-1] / max(sizes[0], np.finfo(float).eps * sizes[-1])))

    @property
    def errors(self) -> Array:
        """(b,) standard errors of the parameters."""
        return np.sqrt(self.covariance.diagonal())


def ordinary(sums: Sums) -> Fit:
    """Return the parameters by ordinary least squares, all joints alike.

    Raises:
        TooFewError: there are fewer equations than parameters.
    """
    return _of_sums(sums, np.ones(len(sums.counts)))


def weighted(sums: Sums) -> Fit:
    """Return the parameters by least squares in which each joint has the weight of its own residuals.

    Raises:
        TooFewError: there are fewer equations than parameters.
    """
    fit = ordinary(sums)
    for _ in range(_ROUNDS):
        fit = _of_sums(sums, fit.sigma)
    return fit


def _of_sums(sums: Sums, sigma: Array) -> Fit:
    b, total = sums.products.shape[1] - 1, float(sums.counts.sum())
    if total <= b:
        raise TooFewError(
            f"{counted(int(total), 'usable equation')} for {counted(b, 'base parameter')}: log a longer motion, in "
            "which every joint moves"
        )
    weights = np.where(sums.counts > 0, 1 / sigma**2, 0.0)
    N = np.einsum("n,nij->ij", weights, sums.products)
    inverse = inverse_of(N[:b, :b])
    values = inverse @ N[:b, b]
    squares = sums.squares(values)
    new = _deviations(squares, sums.products[:, b, b], sums.counts, b)
    scale = float((weights * squares).sum() / (total - b))
    return Fit(values=values, covariance=scale * inverse, sigma=new, counts=sums.counts, normal=N[:b, :b])


def _deviations(squares: Array, efforts: Array, counts: Array, parameters: int) -> Array:
    """Return the standard deviations of residuals (n,), by their squares and those of the efforts, added up."""
    # Parameters make residuals smaller, those of each joint by its share.
    own = np.maximum(counts * (1 - parameters / counts.sum()), 1.0)
    # Efforts that are predicted to the last digit do not make all others worthless, nor do those of joints without any.
    variances = np.maximum(squares, _EXACT**2 * efforts) / own
    return np.asarray(np.sqrt(np.maximum(variances, max(_LIKE_OTHERS**2 * float(variances.max()), _TINY))))


def inverse_of(N: Array) -> Array:
    """Return the inverse (b, b) of normal equations; of what is not excited it is very large."""
    half, _ = _inverse_root(N)
    # A matrix times its transpose has no variance below 0.
    return np.asarray(half @ half.T)


def _inverse_root(N: Array) -> tuple[Array, Flags]:
    """Return a root (b, b) of the inverse of normal equations, and which of its columns are of excited combinations."""
    squares = N.diagonal()
    # A column of zeros has no length of its own; it is as far below the others as numbers that are rounded.
    lengths = np.sqrt(np.maximum(squares, max(_SHORT**2 * squares.max(), _TINY)))
    sizes, vectors = np.linalg.eigh(N / np.outer(lengths, lengths))
    # What is not excited keeps a variance, a very large one.
    least = _SINGULAR**2 * sizes[-1]
    return vectors / np.sqrt(np.maximum(sizes, least)) / lengths[:, None], sizes > least


def robust(blocks: Iterable[Equations], start: Fit | None = None) -> Fit:
    """Return the parameters by iteratively reweighted least squares, with outliers and autocorrelated errors.

    Args:
        blocks: equations, which are gone through several times.
        start: a fit to begin with; ``weighted`` when left out.

    Raises:
        TooFewError: there are fewer equations than parameters.
    """
    fit = weighted(summed(blocks)) if start is None else start
    values, sigma = fit.values, fit.sigma
    for _ in range(_MAX_PASSES):
        new, sigma, inverse = _reweighted(blocks, values, sigma)
        done = (np.abs(new - values) <= _SETTLED * np.sqrt(inverse.diagonal())).all()
        values = new
        if done:
            break
    return _with_errors(blocks, values, sigma, fit)


def weighted_errors(blocks: Iterable[Equations], sigma: Array) -> Fit:
    """Return the parameters by least squares with given weights, and their errors as ``robust`` has them.

    Args:
        blocks: equations, which are gone through several times.
        sigma: (n,) standard deviations of the residuals of the joints [N m] or [N].

    Raises:
        TooFewError: there are fewer equations than parameters.
    """
    fit = _of_sums(summed(blocks), sigma)
    return _with_errors(blocks, fit.values, fit.sigma, fit)


def _weights(residuals: Array, sigma: Array, usable: Flags) -> Array:
    """Return Huber's weights of equations (k, n)."""
    beyond = np.abs(residuals) / sigma
    return np.where(usable, np.minimum(1.0, _HUBER / np.maximum(beyond, _HUBER)), 0.0)


def _reweighted(blocks: Iterable[Equations], values: Array, sigma: Array) -> tuple[Array, Array, Array]:
    """Return parameters and scales after one pass, and the inverse of the normal equations."""
    N, right = np.zeros((len(values), len(values))), np.zeros(len(values))
    squares, efforts, counts = np.zeros_like(sigma), np.zeros_like(sigma), np.zeros_like(sigma)
    for block in blocks:
        residuals = block.tau - block.columns @ values
        weights = _weights(residuals, sigma, block.usable)
        A = (block.columns * (np.sqrt(weights) / sigma)[:, :, None]).reshape(-1, len(values))
        N, right = N + A.T @ A, right + A.T @ (block.tau * np.sqrt(weights) / sigma).reshape(-1)
        squares += ((weights * residuals) ** 2 * block.usable).sum(axis=0)
        efforts += (block.tau**2 * block.usable).sum(axis=0)
        counts += block.usable.sum(axis=0)
    inverse = inverse_of(N)
    return inverse @ right, _deviations(squares / _CONSISTENT, efforts, counts, len(values)), inverse


def _with_errors(blocks: Iterable[Equations], values: Array, sigma: Array, start: Fit) -> Fit:
    """Return a fit with its covariance and its outliers."""
    n, b = len(sigma), len(values)
    outliers: list[Outlier] = []
    products, pairs = np.zeros((_LAGS + 1, n)), np.zeros((_LAGS + 1, n))
    across, together, inliers, counts = np.zeros((n, n)), np.zeros((n, n)), np.zeros(n), np.zeros(n)
    N = np.zeros((b, b))
    for block in blocks:
        residuals = block.tau - block.columns @ values
        deviations = residuals / sigma
        psi = deviations * _weights(residuals, sigma, block.usable)
        usable = block.usable.astype(np.float64)
        for lag in range(min(_LAGS, len(psi) - 1) + 1):
            products[lag] += (psi[lag:] * psi[: len(psi) - lag]).sum(axis=0)
            pairs[lag] += (usable[lag:] * usable[: len(psi) - lag]).sum(axis=0)
        across, together = across + psi.T @ psi, together + usable.T @ usable
        inliers += (block.usable & (np.abs(deviations) < _HUBER)).sum(axis=0)
        counts += usable.sum(axis=0)
        A = (block.columns * (usable / sigma)[:, :, None]).reshape(-1, b)
        N += A.T @ A
        for k, joint in np.argwhere(block.usable & (np.abs(deviations) > _OUTLIER)):
            if len(outliers) < _MAX_OUTLIERS:
                row = int(k), int(joint)
                outliers.append(
                    Outlier(block.name, float(block.t[k]), int(joint), float(residuals[row]), float(deviations[row]))
                )
    processes = [_process(products[:, j] / np.maximum(pairs[:, j], 1.0), counts[j]) for j in range(n)]
    scale = np.sqrt(np.diagonal(across) / np.maximum(counts, 1.0))
    correlation = across / np.maximum(together, 1.0) / np.maximum(np.outer(scale, scale), _TINY)
    np.fill_diagonal(correlation, 1.0)
    meat = _meat(blocks, sigma, processes, correlation, b)
    # Huber's estimator loses the equations that are cut off; parameters have made residuals smaller.
    slopes = np.where(counts > 0, inliers / np.maximum(counts, 1.0), 1.0)
    kept = float((slopes * counts).sum() / counts.sum())
    half, excited = _inverse_root(N)
    # How much more the parameters vary than by independent residuals; of what is not excited no residual tells.
    more = half.T @ meat @ half
    more[~excited], more[:, ~excited] = 0.0, 0.0
    more[~excited, ~excited] = 1.0
    total = float(counts.sum())
    covariance = half @ more @ half.T / kept**2 * total / max(total - b, 1.0)
    return attrs.evolve(
        start,
        values=values,
        sigma=sigma,
        counts=counts,
        covariance=(covariance + covariance.T) / 2,
        normal=N,
        outliers=tuple(outliers),
        order=tuple(len(process.coefficients) for process in processes),
        correlation=np.array([process.spectrum(1)[0] / max(process.variance, 1e-300) for process in processes]),
    )


class _Process(NamedTuple):
    """An autoregressive process.

    Attributes:
        coefficients: of the values before, the latest first.
        innovation: variance of what is new in every value.
        variance: of the values.
    """

    coefficients: Array
    innovation: float
    variance: float

    def spectrum(self, count: int) -> Array:
        """Return its power at frequencies (count,) from 0 to half the sampling rate."""
        phase = np.exp(-1j * np.outer(np.linspace(0, np.pi, count), np.arange(1, len(self.coefficients) + 1)))
        return np.asarray(self.innovation / np.abs(1 - phase @ self.coefficients) ** 2)


def _process(autocovariance: Array, count: float) -> _Process:
    """Return the process of an autocovariance (lags,), its order by the Bayesian information criterion.

    Source:
        Levinson (1947), Durbin (1960); Schwarz (1978).
    """
    variance = max(float(autocovariance[0]), _TINY)
    best = _Process(np.zeros(0), variance, variance)
    coefficients, innovation, least = np.zeros(0), variance, 0.0
    for order in range(1, _LARGEST_ORDER + 1):
        before = autocovariance[1:order][::-1]
        reflection = (autocovariance[order] - coefficients @ before) / innovation
        if not abs(reflection) < 1:
            break
        coefficients = np.append(coefficients - reflection * coefficients[::-1], reflection)
        innovation *= 1 - reflection**2
        score = count * np.log(innovation / variance) + order * np.log(max(count, 2.0))
        if score < least:
            least, best = score, _Process(coefficients, innovation, variance)
    return best


def _meat(blocks: Iterable[Equations], sigma: Array, processes: list[_Process], correlation: Array, b: int) -> Array:
    """Return the variance (b, b) of the weighted sums of residuals, by the spectra of these."""
    # Joints whose noise goes together: a root of their correlations.
    sizes, vectors = np.linalg.eigh(correlation)
    root = (vectors * np.sqrt(np.maximum(sizes, 0.0))).T
    total = np.zeros((b, b))
    for block in blocks:
        length = 1 << int(np.ceil(np.log2(len(block.t) + 4 * _LAGS)))
        weighted_columns = block.columns * (block.usable / sigma)[:, :, None]
        spectra = np.fft.rfft(weighted_columns, length, axis=0)
        spectra *= np.sqrt([process.spectrum(len(spectra)) for process in processes]).T[:, :, None]
        mixed = np.einsum("mn,fnb->fmb", root, spectra, optimize=True)
        # Frequencies between 0 and the highest stand for two.
        mixed[1:-1] *= np.sqrt(2.0)
        parts = np.concatenate([mixed.real.reshape(-1, b), mixed.imag.reshape(-1, b)])
        total += parts.T @ parts / length
    return total
