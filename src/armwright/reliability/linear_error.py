"""An error that is linear in normal deviations: of one pose or of many, and the probability that it is too long."""

from __future__ import annotations

from typing import NamedTuple

import attrs
import numpy as np
from scipy.special import ndtr

from armwright.arrays import Array, floats, integer, positive
from armwright.errors import InvalidValueError, ShapeError
from armwright.reliability.exceedance import exceedance
from armwright.reliability.first_order import nearest_failure

# Directions along which an error may become too long, in the plane and in space: dense enough that between two of them
# the density falls by little at the failures of 1e-8.
_DIRECTIONS = {1: 2, 2: 48, 3: 320}
# Components of a mixture that are lighter than this part of it are left out; the nominal density has its own part.
_LIGHT, _NOMINAL = 1e-5, 0.05
# Numbers of a block of samples.
_BLOCK = 4_000_000


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


@attrs.frozen(kw_only=True, eq=False)
class LinearError:
    """Errors e_p = m_p + J_p x of poses p, of independent normal deviations x.

    Attributes:
        names: of the k deviations.
        deviations: (k,) their standard deviations, each in its own unit.
        offset: (p, d) the mean error at each pose, d from 1 to 3.
        jacobian: (p, d, k) derivatives of the errors.
    """

    names: tuple[str, ...]
    deviations: Array = attrs.field(converter=lambda x: floats(x, "deviations"))
    offset: Array = attrs.field(converter=lambda x: floats(x, "offset"))
    jacobian: Array = attrs.field(converter=lambda x: floats(x, "jacobian"))

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
        """Return (p,) the probability that the error at each pose is longer than a limit, by the exact law."""
        return np.array([exceedance(m, C, limit) for m, C in zip(self.offset, self.covariance, strict=True)])

    def path_probability(self, limit: float, *, samples: int = 200_000, seed: int = 0) -> Estimate:
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
            errors = np.tensordot(z, L, axes=([1], [2])) + self.offset
            failed = (np.square(errors).sum(axis=-1) > limit**2).any(axis=-1)
            weights = 1 / (np.exp(z[failed] @ centres.T - halves) @ parts)
            total, squares = total + float(weights.sum()), squares + float((weights**2).sum())
        mean = total / count
        return Estimate(mean, float(np.sqrt(max(squares / count - mean**2, 0.0) / count)), count)

    def _mixture(self, L: Array, limit: float) -> tuple[Array, Array]:
        """Return centres (c, k) of normal densities about failures, and their parts (c,); the first one is nominal."""
        directions = _directions(self.offset.shape[1])
        centres, logs = [], []
        for p, mean in enumerate(self.offset):
            inverse = np.linalg.pinv(L[p] @ L[p].T, rcond=1e-12, hermitian=True)
            found = nearest_failure(mean, L[p] @ L[p].T, limit)
            targets = np.concatenate([limit * directions, found[None]]) - mean
            z = targets @ inverse @ L[p]
            # A direction into which the deviations cannot push is no failure.
            reached = np.abs(z @ L[p].T - targets).max(axis=-1) < 1e-6 * limit
            centres.append(z[reached])
            logs.append(-0.5 * (z[reached] ** 2).sum(axis=-1))
        z, log = np.concatenate(centres), np.concatenate(logs)
        parts = np.exp(log - log.max()) if len(log) else log
        kept = parts > _LIGHT * parts.sum()
        z, parts = z[kept], parts[kept]
        parts = parts / parts.sum() * (1 - _NOMINAL) if len(parts) else parts
        nominal = np.zeros((1, L.shape[-1]))
        return np.concatenate([nominal, z]), np.concatenate([[1 - parts.sum()], parts])


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
