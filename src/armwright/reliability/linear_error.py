"""An error that is linear in normal deviations: of one pose or of many, and the probability that it is too long."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import attrs
import numpy as np
from scipy.special import ndtr

from armwright.arrays import Array, ArrayLike, integer, positive, read_only
from armwright.errors import InvalidValueError, ShapeError
from armwright.reliability.exceedance import exceedance
from armwright.reliability.first_order import nearest_failure

# Directions along which an error may become too long, in the plane and in space: dense enough that between two of them
# the density falls by little at the failures of 1e-8.
_DIRECTIONS = {1: 2, 2: 32, 3: 128}
# Part of a mixture that the nominal density has, and part that its lightest components may lack together.
_NOMINAL, _LIGHT = 0.05, 1e-6
# A direction in which the error varies by less than this part of the most has no failures.
_FLAT = 1e-9
# Components whose centres are nearer to one another, in standard deviations, are one.
_NEAR = 0.7
# Numbers of a block of samples.
_BLOCK = 4_000_000
# Samples at each pose where no exact law holds.
_AT_POSE = 50_000
# Halvings of the interval in which a ray fails, and how far out it is looked for, in its own length.
_HALVINGS, _FARTHEST = 20, 16.0


class Estimate(NamedTuple):
    """A probability that was sampled.

    Attributes:
        probability: its estimate.
        standard_error: of the estimate.
        samples: how many were drawn.
    """

    probability: float
    standard_error: float
    samples: int


def _array(value: ArrayLike) -> Array:
    return read_only(np.array(value, dtype=np.float64))


@attrs.frozen(kw_only=True, eq=False)
class LinearError:
    """Errors e_p = m_p + J_p x of poses p, of independent normal deviations x.

    Attributes:
        names: of the k deviations.
        deviations: (k,) their standard deviations, each in its own unit.
        offset: (p, d) the mean error at each pose, d from 1 to 3.
        jacobian: (p, d, k) derivatives of the errors.
        exact: returns the errors (m, p, d) for (m, k) standard normal numbers, where they are not linear in these;
            offset and jacobian then only lead samples to failures. None where the linear law holds.
        alone: returns the error at one pose of the p, of the deviations that count there, where many count at their own
            pose only.
    """

    names: tuple[str, ...]
    deviations: Array = attrs.field(converter=_array)
    offset: Array = attrs.field(converter=_array)
    jacobian: Array = attrs.field(converter=_array)
    exact: Callable[[Array], Array] | None = None
    alone: Callable[[int], LinearError] | None = None

    def __attrs_post_init__(self) -> None:
        """Refuse arrays that do not fit each other."""
        k = len(self.names)
        poses, dimensions = (*self.offset.shape, 0, 0)[:2]
        if self.jacobian.shape != (poses, dimensions, k) or self.deviations.shape != (k,) or not poses:
            raise ShapeError(
                f"expected jacobian (p, d, {k}), offset (p, d) and deviations ({k},), got {self.jacobian.shape}, "
                f"{self.offset.shape} and {self.deviations.shape}"
            )
        if dimensions not in _DIRECTIONS:
            raise ShapeError(f"offset: expected errors of 1 to 3 coordinates, got {dimensions}")
        if not all(np.isfinite(x).all() for x in (self.deviations, self.offset, self.jacobian)):
            raise InvalidValueError("expected finite numbers in deviations, offset and jacobian")
        if (self.deviations < 0).any():
            raise InvalidValueError(f"deviations: expected none below zero, got {self.deviations.min():g}")

    @property
    def standardized(self) -> Array:
        """(p, d, k) derivatives by deviations in units of their standard deviations."""
        return self.jacobian * self.deviations

    @property
    def covariance(self) -> Array:
        """(p, d, d) covariance of the error at each pose."""
        L = self.standardized
        return np.asarray(L @ np.swapaxes(L, -1, -2))

    @property
    def shares(self) -> Array:
        """(p, k) part of each deviation in the variance of the error at each pose; rows add up to one."""
        variances = (self.standardized**2).sum(axis=1)
        return np.asarray(variances / np.maximum(variances.sum(axis=-1, keepdims=True), np.finfo(float).tiny))

    def pose_probabilities(self, limit: float) -> Array:
        """Return (p,) the probability that the error at each pose is longer than a limit.

        By the exact law of a linear error, and otherwise sampled; see ``path_probability``.
        """
        if self.exact is None:
            return np.array([exceedance(m, C, limit) for m, C in zip(self.offset, self.covariance, strict=True)])
        at = self.alone or self._at
        return np.array([at(i).path_probability(limit, samples=_AT_POSE).probability for i in range(len(self.offset))])

    def errors(self, z: Array) -> Array:
        """Return (m, p, d) the errors for standard normal numbers (m, k)."""
        if self.exact is not None:
            return self.exact(z)
        return np.asarray(np.tensordot(z, self.standardized, axes=([1], [2])) + self.offset)

    def _at(self, pose: int) -> LinearError:
        """Return the error at one pose."""

        def errors(z: Array) -> Array:
            return self.errors(z)[:, [pose]]

        own = None if self.exact is None else errors
        return attrs.evolve(self, offset=self.offset[[pose]], jacobian=self.jacobian[[pose]], exact=own, alone=None)

    def path_probability(self, limit: float, *, samples: int = 100_000, seed: int = 0) -> Estimate:
        """Return the probability that the error is longer than a limit at any of the poses, by importance sampling.

        Args:
            limit: in the unit of the error.
            samples: how many are drawn.
            seed: of the sample.

        Source:
            Rubinstein & Kroese (2008), chapter 5: a mixture of normal densities about the failures of every pose and
            direction, with the balance heuristic of Veach & Guibas (1995), so that no weight exceeds its bound.
        """
        limit, count = positive(limit, "limit"), integer(samples, "samples", least=1000)
        L = self.standardized
        centres, parts = self._mixture(L, limit)
        rng = np.random.default_rng(seed)
        halves = (centres**2).sum(axis=-1) / 2
        total = squares = 0.0
        block = max(_BLOCK // max(len(centres), L.shape[0] * L.shape[1], 1), 1)
        for first in range(0, count, block):
            rows = min(block, count - first)
            z = rng.normal(size=(rows, L.shape[-1])) + centres[rng.choice(len(parts), rows, p=parts)]
            failed = (np.square(self.errors(z)).sum(axis=-1) > limit**2).any(axis=-1)
            # The first centre is the nominal one, so that the largest exponent is 0 or more, and nothing overflows.
            exponents = z[failed] @ centres.T - halves
            top = exponents.max(axis=1, initial=0.0)
            weights = np.exp(-top) / (np.exp(exponents - top[:, None]) @ parts)
            total, squares = total + float(weights.sum()), squares + float((weights**2).sum())
        mean = total / count
        return Estimate(mean, float(np.sqrt(max(squares / count - mean**2, 0.0) / count)), count)

    def _mixture(self, L: Array, limit: float) -> tuple[Array, Array]:
        """Return centres (c, k) of normal densities about failures, and their parts (c,); the first one is nominal."""
        directions = _directions(self.offset.shape[1])
        centres, logs = [], []
        for pose, (mean, each) in enumerate(zip(self.offset, L, strict=True)):
            if np.linalg.norm(mean) >= limit:
                continue  # it fails as it is: the nominal density finds the failures
            # Along the axes of the deviations all directions are equally probable, and of those to the nearest failure
            # and away from it one is the most probable.
            axes, sizes, across = np.linalg.svd(each, full_matrices=False)
            varies = sizes > _FLAT * max(float(sizes[0]), np.finfo(float).tiny)
            if not varies.any():
                continue
            nearest = (nearest_failure(mean, each @ each.T, limit) - mean) @ axes[:, varies] / sizes[varies]
            ways = np.concatenate([directions[:, : len(sizes)][:, varies], nearest[None], -nearest[None]])
            ways = ways[np.linalg.norm(ways, axis=1) > 0]
            ways /= np.linalg.norm(ways, axis=1)[:, None]
            steps = ways * sizes[varies] @ axes[:, varies].T
            a, b = (steps**2).sum(axis=1), steps @ mean
            distance = (np.sqrt(b**2 + a * (limit**2 - mean @ mean)) - b) / a
            points = distance[:, None] * ways @ across[varies]
            if self.exact is not None:
                points, distance = self._moved(points, pose, limit)
            centres.append(points)
            logs.append(-0.5 * distance**2)
        if not centres:
            return np.zeros((1, L.shape[-1])), np.ones(1)
        z, log = np.concatenate(centres), np.concatenate(logs)
        heaviest = np.argsort(-log)
        weights = np.exp(log[heaviest] - log.max())
        heaviest = heaviest[np.cumsum(weights) - weights <= (1 - _LIGHT) * weights.sum()]
        kept, parts = _merged(z[heaviest], weights[: len(heaviest)])
        parts *= (1 - _NOMINAL) / parts.sum()
        return np.concatenate([np.zeros((1, L.shape[-1])), kept]), np.concatenate([[_NOMINAL], parts])

    def _moved(self, points: Array, pose: int, limit: float) -> tuple[Array, Array]:
        """Return the failures at a pose on the rays to points (c, k), and their distances (c,)."""
        low, high = np.zeros(len(points)), np.full(len(points), _FARTHEST)
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            inside = np.linalg.norm(self.errors(middle[:, None] * points)[:, pose], axis=1) < limit
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        # A ray without failure ends far out, where it has no weight.
        return high[:, None] * points, high * np.linalg.norm(points, axis=1)


def _merged(centres: Array, weights: Array) -> tuple[Array, Array]:
    """Return centres that are not near each other, and their weights with those of the centres near them."""
    left = np.arange(len(centres))
    kept, sums = [], []
    while len(left):
        near = np.square(centres[left] - centres[left[0]]).sum(axis=-1) < _NEAR**2
        kept.append(centres[left[0]])
        sums.append(weights[left[near]].sum())
        left = left[~near]
    return np.array(kept), np.array(sums)


def fosm(mean: Array, covariance: Array, limit: float) -> float:
    """Return the probability of failure of first order about the mean error; ``exceedance`` is the exact law."""
    length = float(np.linalg.norm(mean))
    along = mean / length if length else np.zeros_like(mean)
    deviation = float(np.sqrt(along @ covariance @ along))
    return float(ndtr((length - limit) / deviation)) if deviation else float(length > limit)


def _directions(dimensions: int) -> Array:
    """Return unit vectors (c, d), spread evenly."""
    count = _DIRECTIONS[dimensions]
    if dimensions == 1:
        return np.array([[1.0], [-1.0]])
    turns = 2 * np.pi * np.arange(count) / count
    if dimensions == 2:
        return np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    height = 1 - (2 * np.arange(count) + 1) / count
    turns = np.pi * (3 - np.sqrt(5)) * np.arange(count)
    radius = np.sqrt(1 - height**2)
    return np.stack([radius * np.cos(turns), radius * np.sin(turns), height], axis=-1)
