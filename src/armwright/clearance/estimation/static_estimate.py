"""The estimation of clearances from the resting tip, which the contacts of the journals displace.

At rest the gap of a pin is its clearance in the direction of the force it carries, so the offset of the tip is nearly
linear in the clearances: offset = B c. A few poses yield more equations than clearances. The small nonlinear part, and
the compliance of the walls, is corrected by iteration with the computed equilibrium.

Friction holds a journal anywhere within its cone, ± atan μ to either side of that direction. Where it stays is unknown
and counts as noise of the pose, the same for all readings after one approach: with any angle in the cone as likely as
another, the offset of a pose has a scatter of its own, and its mean is a little smaller.

Source:
    Spec of the clearance, 4.3.
"""

from __future__ import annotations

import attrs
import numpy as np
from scipy.optimize import nnls

from armwright.arrays import Array, ArrayLike, Flags, floats, not_negative, positive
from armwright.clearance.estimation.misfit import p_value, widening
from armwright.clearance.ideal import ideal_motion, tip_position, tip_sensitivity
from armwright.clearance.linkage import Linkage
from armwright.clearance.plane_vectors import perpendicular
from armwright.clearance.poses import closed_at_tips
from armwright.clearance.settings import contact_stiffness
from armwright.clearance.static_equilibrium import find_static_equilibrium, force_magnitudes
from armwright.errors import InvalidValueError, ShapeError, TooFewError

_MAX_ROUNDS = 12
# How often the scatter by friction is computed from the clearances.
_SCATTERS = 2
# The iteration ends when no clearance changes by more [m].
_TOLERANCE = 1e-12
# The lower bound of clearances during the iteration: contact needs one [m].
_MIN_CLEARANCE = 1e-7
# A clearance is identifiable when its standard deviation is below this part of its range.
_IDENTIFIABLE = 0.1


@attrs.frozen(kw_only=True, eq=False)
class Estimate:
    """Estimated clearances and their uncertainty.

    Attributes:
        names: of the parameters, p of them.
        values: (..., p) clearances [m].
        covariance: (..., p, p), with leading axes only where friction makes it depend on the values [m²].
        singular_values: of the equations, largest first: the offset per unit of the combinations of clearances.
        residuals: (..., k, 2) of the offset of each pose [m].
        noise: standard deviation of one coordinate of one reading [m].
        readings: (k,) the number of readings whose mean is the offset of each pose.
        scatter: (..., k, 2, 2) likewise, covariance of the offset of each pose by noise and friction [m²].
        noise_shares: (..., p) likewise, share of the noise in the variance of each clearance; friction has the rest.
        noise_freedom: degrees of freedom of the estimated noise; infinite where it is known. Few widen the intervals.
    """

    names: tuple[str, ...]
    values: Array
    covariance: Array
    singular_values: Array
    residuals: Array
    noise: float
    readings: Array
    scatter: Array
    noise_shares: Array
    noise_freedom: float = np.inf

    @property
    def residual_rms(self) -> Array:
        """(...) root mean square of the residuals [m]."""
        return np.asarray(np.sqrt(np.mean(self.residuals**2, axis=(-2, -1))), dtype=np.float64)

    @property
    def chi_square(self) -> Array:
        """(...) sum of squared residuals, in standard deviations."""
        whitened = whitening(self.scatter) @ self.residuals[..., None]
        return np.asarray(np.sum(whitened**2, axis=(-3, -2, -1)), dtype=np.float64)

    @property
    def standardised(self) -> Array:
        """(..., k, 2) residuals in standard deviations of the offset of their pose."""
        variances = np.diagonal(self.scatter, axis1=-2, axis2=-1)
        return np.asarray(self.residuals / np.sqrt(variances), dtype=np.float64)

    @property
    def degrees_of_freedom(self) -> int:
        """The number of measured coordinates minus that of clearances."""
        return 2 * int(self.residuals.shape[-2]) - len(self.names)

    @property
    def misfit(self) -> Array:
        """(...) probability of residuals as large where the model holds; if small, model or noise is wrong."""
        return p_value(self.chi_square, self.degrees_of_freedom, self.scatter_freedom)

    @property
    def scatter_freedom(self) -> float:
        """Degrees of freedom of the scatter of the poses (Welch and Satterthwaite): that of friction is known."""
        own = 2 * self.noise**2 * float(np.mean(1 / self.readings))
        return self.noise_freedom * (float(np.trace(self.scatter, axis1=-2, axis2=-1).mean()) / own) ** 2

    @property
    def widening(self) -> Array:
        """(...) the factor by which residuals above the noise widen the deviations."""
        return widening(self.chi_square, self.degrees_of_freedom)

    @property
    def deviations(self) -> Array:
        """(..., p) standard deviations, wider where the residuals exceed the noise [m]."""
        return np.asarray(self.widening[..., None] * self._own_deviations, dtype=np.float64)

    @property
    def _own_deviations(self) -> Array:
        return np.asarray(np.sqrt(np.diagonal(self.covariance, axis1=-2, axis2=-1)), dtype=np.float64)

    @property
    def correlation(self) -> Array:
        """(..., p, p) correlation of the parameters."""
        own = self._own_deviations
        return np.asarray(self.covariance / (own[..., :, None] * own[..., None, :]), dtype=np.float64)

    @property
    def at_bound(self) -> Flags:
        """(..., p) which clearances are indistinguishable from 0: they are less than their deviation."""
        return np.asarray(self.values <= np.maximum(2 * _MIN_CLEARANCE, self.deviations), dtype=np.bool_)

    def interval(self, level: float = 0.9) -> Array:
        """Return (..., p, 2) the interval in which each clearance lies with the probability ``level`` [m]."""
        if not 0 < level < 1:
            raise InvalidValueError(f"level: expected a probability between 0 and 1, got {level:g}")
        from scipy.stats import t  # noqa: PLC0415 - a slow import

        # By Welch and Satterthwaite: only the variance by the noise is uncertain.
        half = t.ppf(0.5 + level / 2, self.noise_freedom / self.noise_shares**2) * self.deviations
        return np.stack([np.maximum(self.values - half, 0.0), self.values + half], axis=-1)

    def identifiable(self, width: float) -> tuple[bool, ...]:
        """Whether each clearance is identifiable: known well compared with its range [m], and not at a bound."""
        return tuple(map(bool, (self.deviations < _IDENTIFIABLE * width) & ~self.at_bound))


def rest_matrix(linkage: Linkage, q: Array) -> Array:
    """Return B: the derivative of the resting position of the tip with respect to the clearances.

    Args:
        linkage: with p pins.
        q: (k, n) coordinates with closed pins; see ``closed_at_tips``.

    Returns:
        (k, 2, p) shift by clearance.

    Raises:
        InvalidValueError: a pin carries no force there.
    """
    return np.asarray(np.einsum("kapb,kpb->kap", tip_sensitivity(linkage, q), _contact_directions(linkage, q)))


def friction_scatter(linkage: Linkage, q: Array, clearances: ArrayLike, friction: float) -> Array:
    """Return the covariance of the resting tip where friction holds each journal anywhere in its cone.

    Args:
        linkage: with p pins.
        q: (k, n) coordinates with closed pins.
        clearances: (..., p) [m].
        friction: coefficient of friction.

    Returns:
        (..., k, 2, 2) of each pose [m²].
    """
    direction, gains = _contact_directions(linkage, q), tip_sensitivity(linkage, q)
    across = perpendicular(direction)
    mean, angle = _mean_part(friction), 2 * float(np.arctan(friction))
    # Of the cosine and the sine of an angle that is anywhere within ± atan μ with the same probability.
    shrinking = np.sinc(angle / np.pi) / 2
    squares = floats(clearances, "clearances")[..., None, :, None, None] ** 2
    parts = [
        variance * np.einsum("kpa,kpb->kpab", shift, shift)
        for variance, shift in (
            (max(0.5 + shrinking - mean**2, 0.0), np.einsum("kapb,kpb->kpa", gains, direction)),
            (max(0.5 - shrinking, 0.0), np.einsum("kapb,kpb->kpa", gains, across)),
        )
    ]
    return np.asarray((squares * (parts[0] + parts[1])).sum(axis=-3), dtype=np.float64)


def whitening(scatter: Array) -> Array:
    """Return (..., 2, 2) the matrices that make offsets with covariances (..., 2, 2) unit noise."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(scatter)), dtype=np.float64)


def _contact_directions(linkage: Linkage, q: Array) -> Array:
    """Return (k, p, 2) the directions from bearing to journal at rest, without friction."""
    still = np.zeros((len(q), 2))
    reactions = ideal_motion(linkage, q, still, still, by_tip=True).reactions
    return np.asarray(reactions / force_magnitudes(linkage, reactions)[..., None])


def _mean_part(friction: float) -> float:
    """Return the mean cosine of an angle anywhere within the friction cone."""
    return float(np.sinc(np.arctan(friction) / np.pi))


def rest_offsets(linkage: Linkage, poses: ArrayLike, clearances: ArrayLike) -> Array:
    """Return (..., k, 2) the offsets of the resting tip [m].

    Args:
        linkage: with p pins.
        poses: (k, 2) positions of its tip without clearance [m].
        clearances: (..., p) [m].
    """
    return _offsets_at(linkage, closed_at_tips(linkage, poses), floats(clearances, "clearances"))


def _offsets_at(linkage: Linkage, q: Array, clearances: Array) -> Array:
    """Return (..., k, 2) the offsets of the tip at closed coordinates (k, n) [m]; see ``rest_offsets``."""
    c = clearances[..., None, :]
    tip = find_static_equilibrium(linkage, q, c, contact_stiffness(linkage, c)).tip
    return np.asarray(tip - tip_position(linkage, q), dtype=np.float64)


def estimate_at_rest(
    linkage: Linkage,
    poses: ArrayLike,
    offsets: ArrayLike,
    noise: float = 1e-6,
    readings: ArrayLike = 1.0,
    *,
    friction: float = 0.0,
) -> Estimate:
    """Return the clearances that explain the measured offsets of the resting tip.

    Args:
        linkage: with p pins.
        poses: (k, 2) positions of its tip without clearance [m].
        offsets: (..., k, 2) of the tip there [m].
        noise: standard deviation of a coordinate of one reading [m].
        readings: (k,) the number of readings whose mean is each offset, which is its weight.
        friction: coefficient of friction, which holds each journal anywhere in its cone, in all readings of a pose.

    Raises:
        ShapeError: poses and offsets do not fit.
        TooFewError: the poses do not determine all clearances.
    """
    positions, measured = floats(poses, "poses"), floats(offsets, "offsets")
    if positions.ndim != 2 or positions.shape[1] != 2 or measured.shape[-2:] != positions.shape:
        raise ShapeError(
            f"expected (k, 2) poses and as many offsets, got shapes {positions.shape} and {measured.shape}"
        )
    positive(noise, "noise", "m")
    not_negative(friction, "friction")
    counts = np.broadcast_to(floats(readings, "readings"), len(positions))
    if not np.all(counts >= 1):
        raise InvalidValueError(f"readings: expected at least 1 of each pose, got {counts.min():g}")
    names = tuple(linkage.clearances)
    q = closed_at_tips(linkage, positions)
    B = rest_matrix(linkage, q) * _mean_part(friction)
    singular = np.linalg.svd(B.reshape(-1, len(names)), compute_uv=False)
    if len(singular) < len(names) or singular[-1] < 1e-6 * singular[0]:
        raise TooFewError(f"{len(positions)} poses do not determine {len(names)} clearances; take more, or others")
    own = scatter = (noise**2 / counts)[:, None, None] * np.eye(2)
    fit = _fit_clearances(linkage, q, measured, B, scatter, _mean_part(friction))
    for _ in range(_SCATTERS if friction > 0 else 0):
        scatter = own + friction_scatter(linkage, q, fit[0], friction)
        fit = _fit_clearances(linkage, q, measured, B, scatter, _mean_part(friction))
    whitened = _whitened_matrix(B, scatter)
    covariance = np.linalg.inv(np.swapaxes(whitened, -1, -2) @ whitened)
    gain = covariance @ np.swapaxes(whitened, -1, -2)
    by_noise = gain @ _block_diagonal(whitening(scatter) * (noise / np.sqrt(counts))[:, None, None])
    return Estimate(
        names=names,
        values=fit[0],
        covariance=np.asarray(covariance, dtype=np.float64),
        singular_values=np.asarray(singular, dtype=np.float64),
        residuals=fit[1],
        noise=noise,
        readings=np.array(counts),
        scatter=np.asarray(scatter, dtype=np.float64),
        noise_shares=np.asarray(
            (by_noise**2).sum(axis=-1) / np.diagonal(covariance, axis1=-2, axis2=-1), dtype=np.float64
        ),
    )


def _whitened_matrix(B: Array, scatter: Array) -> Array:
    """Return (..., 2k, p) the equations B (k, 2, p), made unit noise."""
    whitened = whitening(scatter) @ B
    return np.asarray(whitened.reshape(*whitened.shape[:-3], -1, B.shape[-1]))


def _block_diagonal(blocks: Array) -> Array:
    """Return (..., 2k, 2k) matrices of blocks (..., k, 2, 2)."""
    k = blocks.shape[-3]
    matrix = np.zeros((*blocks.shape[:-3], k, 2, k, 2))
    for i in range(k):
        matrix[..., i, :, i, :] = blocks[..., i, :, :]
    return matrix.reshape(*blocks.shape[:-3], 2 * k, 2 * k)


def _fit_clearances(  # noqa: PLR0917 - one system of equations
    linkage: Linkage, q: Array, offsets: Array, B: Array, scatter: Array, mean_part: float
) -> tuple[Array, Array]:
    """Return the clearances (..., p) that explain offsets (..., k, 2) best, and the residuals (..., k, 2) [m].

    The covariances (..., k, 2, 2) are those of the offsets, with equations B (k, 2, p), at closed coordinates (k, n).
    The mean part of the clearances displaces the tip.
    """
    white, weighted = whitening(scatter), _whitened_matrix(B, scatter)

    def whitened(residuals: Array) -> Array:
        product = white @ residuals[..., None]
        return np.asarray(product.reshape(*residuals.shape[:-2], -1), dtype=np.float64)

    def step(c: Array, residuals: Array) -> Array:
        """Solve the least squares about c, with no clearance below the smallest."""
        goal = whitened(residuals) + np.einsum("...ip,...p->...i", weighted, c - _MIN_CLEARANCE)
        matrices = np.broadcast_to(weighted, (*c.shape[:-1], *weighted.shape[-2:])).reshape(-1, *weighted.shape[-2:])
        rows = [nnls(*system)[0] for system in zip(matrices, goal.reshape(-1, goal.shape[-1]), strict=True)]
        return np.reshape(rows, c.shape) + _MIN_CLEARANCE

    c = step(np.full((*offsets.shape[:-2], B.shape[-1]), _MIN_CLEARANCE), offsets)
    best, smallest, converged = c, np.full_like(offsets, np.inf), False
    least = np.full(offsets.shape[:-2], np.inf)
    for _ in range(_MAX_ROUNDS):
        residuals = offsets - _offsets_at(linkage, q, mean_part * c)
        square = (whitened(residuals) ** 2).sum(axis=-1)
        # The last round need not be the best.
        better = square < least
        best, least = np.where(better[..., None], c, best), np.where(better, square, least)
        smallest = np.where(better[..., None, None], residuals, smallest)
        if converged:
            break
        new = step(c, residuals)
        converged, c = bool(np.abs(new - c).max() < _TOLERANCE), new
    return np.asarray(best, dtype=np.float64), np.asarray(smallest, dtype=np.float64)
