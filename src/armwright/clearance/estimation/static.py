"""Clearances from where the tip rests: each journal leans on its wall, and the tip shows it.

At rest the gap of a pin is its clearance in the direction of the force it carries, so the offset of the tip is nearly
linear in the clearances: offset = B c. A few poses give more equations than there are clearances. The little that is
not linear, and the give of the walls, is put right by working the rest out and looking again.

Source:
    Spec of the clearance, 4.3.
"""

from __future__ import annotations

from collections.abc import Iterable

import attrs
import numpy as np
from scipy.optimize import nnls

from armwright.arrays import Array, ArrayLike, Flags, floats
from armwright.clearance.estimation.misfit import chance, widening
from armwright.clearance.ideal import closed, ideal_motion, sensitivity, tip_of
from armwright.clearance.linkage import Linkage
from armwright.clearance.rest import at_rest, forces_of
from armwright.clearance.scenario import assembly_guess
from armwright.clearance.settings import contact_stiffness
from armwright.errors import InvalidValueError, ShapeError, TooFewError

_MOST_ROUNDS = 12
# The rounds end when no clearance changes by more [m].
_SETTLED = 1e-12
# No clearance is taken for smaller while it is sought: contact needs one [m].
_SMALLEST = 1e-7
# A clearance is told when its standard deviation is below this part of the range it may lie in.
_TOLD = 0.1


@attrs.frozen(kw_only=True, eq=False)
class Estimate:
    """Clearances, and how well they are known.

    Attributes:
        names: of the parameters, p of them.
        values: (..., p) clearances [m].
        covariance: (p, p) [m²].
        singular_values: of the equations, largest first; how the offset grows with the best and worst told mixture.
        missing: (..., k, 2) what is left of the offset of each pose [m].
        noise: standard deviation of one coordinate of one reading [m].
        readings: (k,) of how many readings the offset of each pose is the mean.
        freedom: of how many numbers the noise was estimated; infinite where it was known. Few make intervals wider.
    """

    names: tuple[str, ...]
    values: Array
    covariance: Array
    singular_values: Array
    missing: Array
    noise: float
    readings: Array
    freedom: float = np.inf

    @property
    def residual(self) -> Array:
        """(...) root mean square of what is left [m]."""
        return np.asarray(np.sqrt(np.mean(self.missing**2, axis=(-2, -1))), dtype=np.float64)

    @property
    def square(self) -> Array:
        """(...) sum of squares of what is left, in standard deviations."""
        return np.asarray(np.sum(self.standardised**2, axis=(-2, -1)), dtype=np.float64)

    @property
    def standardised(self) -> Array:
        """(..., k, 2) what is left, in standard deviations of the offset of its pose."""
        return np.asarray(self.missing * np.sqrt(self.readings)[:, None] / self.noise, dtype=np.float64)

    @property
    def spare(self) -> int:
        """How many more numbers were measured than clearances are sought."""
        return 2 * int(self.missing.shape[-2]) - len(self.names)

    @property
    def misfit(self) -> Array:
        """(...) probability that so much is left where the model holds; small ones say that model or noise is wrong."""
        return chance(self.square, self.spare, self.freedom)

    @property
    def deviations(self) -> Array:
        """(..., p) standard deviations, wider where more is left than the noise explains [m]."""
        own = np.sqrt(np.diag(self.covariance))
        return np.asarray(widening(self.square, self.spare)[..., None] * own, dtype=np.float64)

    @property
    def correlation(self) -> Array:
        """(p, p) correlation of the parameters."""
        own = np.sqrt(np.diag(self.covariance))
        return np.asarray(self.covariance / np.outer(own, own), dtype=np.float64)

    @property
    def at_bound(self) -> Flags:
        """(..., p) which clearances the data do not tell from none: they are less than their deviation."""
        return np.asarray(self.values <= np.maximum(2 * _SMALLEST, self.deviations), dtype=np.bool_)

    def interval(self, level: float = 0.9) -> Array:
        """Return (..., p, 2) in which each clearance lies with a probability [m]."""
        if not 0 < level < 1:
            raise InvalidValueError(f"level: expected a probability between 0 and 1, got {level:g}")
        from scipy.stats import norm, t  # noqa: PLC0415 - a slow import

        reach = norm.ppf(0.5 + level / 2) if np.isinf(self.freedom) else t.ppf(0.5 + level / 2, self.freedom)
        half = reach * self.deviations
        return np.stack([np.maximum(self.values - half, 0.0), self.values + half], axis=-1)

    def identifiable(self, width: float) -> tuple[bool, ...]:
        """Whether each clearance is told: known well beside the range in which it may lie [m], and not at a bound."""
        told = (self.deviations < _TOLD * width) & ~self.at_bound
        return tuple(map(bool, told))


def rest_matrix(linkage: Linkage, poses: ArrayLike) -> Array:
    """Return B: how the resting tip shifts with the clearances.

    Args:
        linkage: with p pins.
        poses: (k, 2) places of its tip without play [m].

    Returns:
        (k, 2, p) shift by clearance.

    Raises:
        InvalidValueError: a pose cannot be reached, or a pin carries no force there.
    """
    return matrix_at(linkage, posed(linkage, poses))


def matrix_at(linkage: Linkage, q: Array) -> Array:
    """Return B (k, 2, p) at closed coordinates (k, n); see ``rest_matrix``."""
    still = np.zeros((len(q), 2))
    reactions = ideal_motion(linkage, q, still, still, by_tip=True).reactions
    direction = reactions / forces_of(linkage, reactions)[..., None]
    return np.asarray(np.einsum("kapb,kpb->kap", sensitivity(linkage, q), direction), dtype=np.float64)


def rest_offsets(linkage: Linkage, poses: ArrayLike, clearances: ArrayLike) -> Array:
    """Return (..., k, 2) by how much the resting tip is off [m].

    Args:
        linkage: with p pins.
        poses: (k, 2) places of its tip without play [m].
        clearances: (..., p) [m].
    """
    return _offsets_at(linkage, posed(linkage, poses), floats(clearances, "clearances"))


def _offsets_at(linkage: Linkage, q: Array, clearances: Array) -> Array:
    """Return (..., k, 2) by how much the tip is off at closed coordinates (k, n) [m]; see ``rest_offsets``."""
    c = clearances[..., None, :]
    return np.asarray(at_rest(linkage, q, c, contact_stiffness(linkage, c)).tip - tip_of(linkage, q), dtype=np.float64)


def estimate_at_rest(
    linkage: Linkage, poses: ArrayLike, offsets: ArrayLike, noise: float = 1e-6, readings: ArrayLike = 1.0
) -> Estimate:
    """Return the clearances that put the resting tip where it was seen.

    Args:
        linkage: with p pins.
        poses: (k, 2) places of its tip without play [m].
        offsets: (..., k, 2) by how much it was off there [m].
        noise: standard deviation of a coordinate of one reading [m].
        readings: (k,) of how many readings each offset is the mean: it weighs as many times.

    Raises:
        ShapeError: poses and offsets do not fit.
        TooFewError: the poses do not tell all clearances.
    """
    places, seen = floats(poses, "poses"), floats(offsets, "offsets")
    if places.ndim != 2 or places.shape[1] != 2 or seen.shape[-2:] != places.shape:
        raise ShapeError(f"expected (k, 2) poses and as many offsets, got shapes {places.shape} and {seen.shape}")
    if not 0 < noise < np.inf:
        raise InvalidValueError(f"noise: expected a standard deviation above 0, got {noise:g}")
    counts = np.broadcast_to(floats(readings, "readings"), len(places))
    if not np.all(counts >= 1):
        raise InvalidValueError(f"readings: expected at least 1 of each pose, got {counts.min():g}")
    names = tuple(linkage.clearances)
    weights = np.sqrt(np.repeat(counts, 2))
    q = posed(linkage, places)
    B = matrix_at(linkage, q).reshape(-1, len(names))
    singular = np.linalg.svd(B, compute_uv=False)
    if len(singular) < len(names) or singular[-1] < 1e-6 * singular[0]:
        raise TooFewError(
            f"{len(places)} poses do not tell {len(names)} clearances from one another; take more, or others"
        )
    best, missing = _fitted(linkage, q, seen, B, weights)
    weighted = weights[:, None] * B
    return Estimate(
        names=names,
        values=best,
        covariance=np.asarray(noise**2 * np.linalg.inv(weighted.T @ weighted), dtype=np.float64),
        singular_values=np.asarray(singular, dtype=np.float64),
        missing=missing,
        noise=noise,
        readings=np.array(counts),
    )


def _fitted(linkage: Linkage, q: Array, seen: Array, B: Array, weights: Array) -> tuple[Array, Array]:
    """Return the clearances (..., p) that explain offsets (..., k, 2) best, and what is left (..., k, 2) [m].

    The weights (2k,) are those of the equations B (2k, p), at closed coordinates (k, n).
    """
    weighted = weights[:, None] * B

    def square(missing: Array) -> Array:
        return np.asarray(np.sum((weights.reshape(-1, 2) * missing) ** 2, axis=(-2, -1)), dtype=np.float64)

    def stepped(c: Array, missing: Array) -> Array:
        """Least squares about c, none below the smallest: with one at its bound, the others make up for it."""
        goal = missing.reshape(*missing.shape[:-2], -1) + (c - _SMALLEST) @ B.T
        rows = [nnls(weighted, weights * one)[0] for one in goal.reshape(-1, len(B))]
        return np.reshape(rows, c.shape) + _SMALLEST

    c = stepped(np.full((*seen.shape[:-2], B.shape[1]), _SMALLEST), seen)
    best, left, settled = c, np.full_like(seen, np.inf), False
    for _ in range(_MOST_ROUNDS):
        missing = seen - _offsets_at(linkage, q, c)
        # The rounds need not end with the best.
        better = square(missing) < square(left)
        best, left = np.where(better[..., None], c, best), np.where(better[..., None, None], missing, left)
        if settled:
            break
        new = stepped(c, missing)
        settled, c = bool(np.abs(new - c).max() < _SETTLED), new
    return np.asarray(best, dtype=np.float64), np.asarray(left, dtype=np.float64)


def best_poses(linkage: Linkage, candidates: ArrayLike, count: int) -> list[int]:
    """Return the numbers of the poses that tell most about all clearances together: D-optimal, taken one by one.

    Args:
        linkage: with p pins.
        candidates: (k, 2) places of its tip [m].
        count: how many to take.

    Raises:
        InvalidValueError: there are not so many.
    """
    places = floats(candidates, "candidates")
    if not 0 < count <= len(places):
        raise InvalidValueError(f"count: expected 1 to {len(places)} poses, got {count}")
    B = rest_matrix(linkage, places)
    information = 1e-9 * np.eye(B.shape[-1])
    taken: list[int] = []
    for _ in range(count):
        gains = [_gain(information, B[k]) if k not in taken else -np.inf for k in range(len(places))]
        taken.append(int(np.argmax(gains)))
        information = information + B[taken[-1]].T @ B[taken[-1]]
    return taken


def _gain(information: Array, rows: Array) -> float:
    return float(np.linalg.slogdet(information + rows.T @ rows)[1])


def posed(linkage: Linkage, poses: ArrayLike) -> Array:
    """Return (k, n) closed coordinates with the tip at each pose, each from the one before."""
    places: Iterable[Array] = floats(poses, "poses").reshape(-1, 2)
    guess, found = assembly_guess(linkage), []
    for place in places:
        guess = closed(linkage, guess, tip=place)
        found.append(guess)
    return np.array(found)
