"""The estimation of clearances from the resting tip, which the contacts of the journals displace.

At rest the gap of a pin is its clearance in the direction of the force it carries, so the offset of the tip is nearly
linear in the clearances: offset = B c. A few poses yield more equations than clearances. The small nonlinear part, and
the compliance of the walls, is corrected by iteration with the computed equilibrium.

Source:
    Spec of the clearance, 4.3.
"""

from __future__ import annotations

import attrs
import numpy as np
from scipy.optimize import nnls

from armwright.arrays import Array, ArrayLike, Flags, floats, positive
from armwright.clearance.estimation.misfit import p_value, widening
from armwright.clearance.ideal import close_pins, ideal_motion, tip_position, tip_sensitivity
from armwright.clearance.linkage import Linkage
from armwright.clearance.scenario import assembly_guess
from armwright.clearance.settings import contact_stiffness
from armwright.clearance.static_equilibrium import find_static_equilibrium, force_magnitudes
from armwright.errors import InvalidValueError, ShapeError, TooFewError

_MAX_ROUNDS = 12
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
        covariance: (p, p) [m²].
        singular_values: of the equations, largest first: the offset per unit of the combinations of clearances.
        residuals: (..., k, 2) of the offset of each pose [m].
        noise: standard deviation of one coordinate of one reading [m].
        readings: (k,) the number of readings whose mean is the offset of each pose.
        noise_freedom: degrees of freedom of the estimated noise; infinite where it is known. Few widen the intervals.
    """

    names: tuple[str, ...]
    values: Array
    covariance: Array
    singular_values: Array
    residuals: Array
    noise: float
    readings: Array
    noise_freedom: float = np.inf

    @property
    def residual_rms(self) -> Array:
        """(...) root mean square of the residuals [m]."""
        return np.asarray(np.sqrt(np.mean(self.residuals**2, axis=(-2, -1))), dtype=np.float64)

    @property
    def chi_square(self) -> Array:
        """(...) sum of squared residuals, in standard deviations."""
        return np.asarray(np.sum(self.standardised**2, axis=(-2, -1)), dtype=np.float64)

    @property
    def standardised(self) -> Array:
        """(..., k, 2) residuals in standard deviations of the offset of their pose."""
        return np.asarray(self.residuals * np.sqrt(self.readings)[:, None] / self.noise, dtype=np.float64)

    @property
    def degrees_of_freedom(self) -> int:
        """The number of measured coordinates minus that of clearances."""
        return 2 * int(self.residuals.shape[-2]) - len(self.names)

    @property
    def misfit(self) -> Array:
        """(...) probability of residuals as large where the model holds; if small, model or noise is wrong."""
        return p_value(self.chi_square, self.degrees_of_freedom, self.noise_freedom)

    @property
    def widening(self) -> Array:
        """(...) the factor by which residuals above the noise widen the deviations."""
        return widening(self.chi_square, self.degrees_of_freedom)

    @property
    def deviations(self) -> Array:
        """(..., p) standard deviations, wider where the residuals exceed the noise [m]."""
        own = np.sqrt(np.diag(self.covariance))
        return np.asarray(self.widening[..., None] * own, dtype=np.float64)

    @property
    def correlation(self) -> Array:
        """(p, p) correlation of the parameters."""
        own = np.sqrt(np.diag(self.covariance))
        return np.asarray(self.covariance / np.outer(own, own), dtype=np.float64)

    @property
    def at_bound(self) -> Flags:
        """(..., p) which clearances are indistinguishable from 0: they are less than their deviation."""
        return np.asarray(self.values <= np.maximum(2 * _MIN_CLEARANCE, self.deviations), dtype=np.bool_)

    def interval(self, level: float = 0.9) -> Array:
        """Return (..., p, 2) the interval in which each clearance lies with the probability ``level`` [m]."""
        if not 0 < level < 1:
            raise InvalidValueError(f"level: expected a probability between 0 and 1, got {level:g}")
        from scipy.stats import norm, t  # noqa: PLC0415 - a slow import

        distribution = norm() if np.isinf(self.noise_freedom) else t(self.noise_freedom)
        half = distribution.ppf(0.5 + level / 2) * self.deviations
        return np.stack([np.maximum(self.values - half, 0.0), self.values + half], axis=-1)

    def identifiable(self, width: float) -> tuple[bool, ...]:
        """Whether each clearance is identifiable: known well compared with its range [m], and not at a bound."""
        return tuple(map(bool, (self.deviations < _IDENTIFIABLE * width) & ~self.at_bound))


def rest_matrix(linkage: Linkage, q: Array) -> Array:
    """Return B: the derivative of the resting position of the tip with respect to the clearances.

    Args:
        linkage: with p pins.
        q: (k, n) coordinates with closed pins; see ``closed_at_poses``.

    Returns:
        (k, 2, p) shift by clearance.

    Raises:
        InvalidValueError: a pin carries no force there.
    """
    still = np.zeros((len(q), 2))
    reactions = ideal_motion(linkage, q, still, still, by_tip=True).reactions
    direction = reactions / force_magnitudes(linkage, reactions)[..., None]
    return np.asarray(np.einsum("kapb,kpb->kap", tip_sensitivity(linkage, q), direction), dtype=np.float64)


def rest_offsets(linkage: Linkage, poses: ArrayLike, clearances: ArrayLike) -> Array:
    """Return (..., k, 2) the offsets of the resting tip [m].

    Args:
        linkage: with p pins.
        poses: (k, 2) positions of its tip without clearance [m].
        clearances: (..., p) [m].
    """
    return _offsets_at(linkage, closed_at_poses(linkage, poses), floats(clearances, "clearances"))


def _offsets_at(linkage: Linkage, q: Array, clearances: Array) -> Array:
    """Return (..., k, 2) the offsets of the tip at closed coordinates (k, n) [m]; see ``rest_offsets``."""
    c = clearances[..., None, :]
    tip = find_static_equilibrium(linkage, q, c, contact_stiffness(linkage, c)).tip
    return np.asarray(tip - tip_position(linkage, q), dtype=np.float64)


def estimate_at_rest(
    linkage: Linkage, poses: ArrayLike, offsets: ArrayLike, noise: float = 1e-6, readings: ArrayLike = 1.0
) -> Estimate:
    """Return the clearances that explain the measured offsets of the resting tip.

    Args:
        linkage: with p pins.
        poses: (k, 2) positions of its tip without clearance [m].
        offsets: (..., k, 2) of the tip there [m].
        noise: standard deviation of a coordinate of one reading [m].
        readings: (k,) the number of readings whose mean is each offset, which is its weight.

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
    counts = np.broadcast_to(floats(readings, "readings"), len(positions))
    if not np.all(counts >= 1):
        raise InvalidValueError(f"readings: expected at least 1 of each pose, got {counts.min():g}")
    names = tuple(linkage.clearances)
    weights = np.sqrt(np.repeat(counts, 2))
    q = closed_at_poses(linkage, positions)
    B = rest_matrix(linkage, q).reshape(-1, len(names))
    singular = np.linalg.svd(B, compute_uv=False)
    if len(singular) < len(names) or singular[-1] < 1e-6 * singular[0]:
        raise TooFewError(f"{len(positions)} poses do not determine {len(names)} clearances; take more, or others")
    best, residuals = _fit_clearances(linkage, q, measured, B, weights)
    weighted = weights[:, None] * B
    return Estimate(
        names=names,
        values=best,
        covariance=np.asarray(noise**2 * np.linalg.inv(weighted.T @ weighted), dtype=np.float64),
        singular_values=np.asarray(singular, dtype=np.float64),
        residuals=residuals,
        noise=noise,
        readings=np.array(counts),
    )


def _fit_clearances(linkage: Linkage, q: Array, offsets: Array, B: Array, weights: Array) -> tuple[Array, Array]:
    """Return the clearances (..., p) that explain offsets (..., k, 2) best, and the residuals (..., k, 2) [m].

    The weights (2k,) are those of the equations B (2k, p), at closed coordinates (k, n).
    """
    weighted = weights[:, None] * B

    def square(residuals: Array) -> Array:
        return np.asarray(np.sum((weights.reshape(-1, 2) * residuals) ** 2, axis=(-2, -1)), dtype=np.float64)

    def step(c: Array, residuals: Array) -> Array:
        """Solve the least squares about c, with no clearance below the smallest."""
        goal = residuals.reshape(*residuals.shape[:-2], -1) + (c - _MIN_CLEARANCE) @ B.T
        rows = [nnls(weighted, weights * row)[0] for row in goal.reshape(-1, len(B))]
        return np.reshape(rows, c.shape) + _MIN_CLEARANCE

    c = step(np.full((*offsets.shape[:-2], B.shape[1]), _MIN_CLEARANCE), offsets)
    best, smallest, converged = c, np.full_like(offsets, np.inf), False
    for _ in range(_MAX_ROUNDS):
        residuals = offsets - _offsets_at(linkage, q, c)
        # The last round need not be the best.
        better = square(residuals) < square(smallest)
        best = np.where(better[..., None], c, best)
        smallest = np.where(better[..., None, None], residuals, smallest)
        if converged:
            break
        new = step(c, residuals)
        converged, c = bool(np.abs(new - c).max() < _TOLERANCE), new
    return np.asarray(best, dtype=np.float64), np.asarray(smallest, dtype=np.float64)


def closed_at_poses(linkage: Linkage, poses: ArrayLike) -> Array:
    """Return (k, n) closed coordinates with the tip at each pose, each from the one before."""
    configurations = [assembly_guess(linkage)]
    for position in floats(poses, "poses").reshape(-1, 2):
        configurations.append(close_pins(linkage, configurations[-1], tip=position))
    return np.array(configurations[1:])
