"""Fourier series of joint positions that start and end a period at rest."""

from __future__ import annotations

import attrs
import numpy as np

from armwright.arrays import Array, read_only


@attrs.frozen(kw_only=True, eq=False)
class Fourier:
    """Positions of n joints as a sum of harmonics of one period: a_k sin(k w t) / (k w) - b_k cos(k w t) / (k w).

    With the sum of a_k 0, the velocity is 0 where the period begins and ends; with that of k b_k, the acceleration is.

    Attributes:
        period: [s].
        a: (h, n) coefficients of velocities in phase with the cosine [rad/s] or [m/s].
        b: (h, n) coefficients of velocities in phase with the sine.
        centre: (n,) positions that the series moves about [rad] or [m].
    """

    period: float
    a: Array = attrs.field(converter=read_only)
    b: Array = attrs.field(converter=read_only)
    centre: Array = attrs.field(converter=read_only)

    @classmethod
    def zero(cls, joints: int, harmonics: int, period: float) -> Fourier:
        """Return the series that stands still at 0."""
        nothing = np.zeros((harmonics, joints))
        return cls(period=period, a=nothing, b=nothing, centre=np.zeros(joints))

    def __call__(self, t: Array) -> tuple[Array, Array, Array]:
        """Return positions, velocities and accelerations (k, n) at times (k,) [s]."""
        k = np.arange(1, len(self.a) + 1)
        w = 2 * np.pi / self.period * k
        s, c = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
        q = s / w @ self.a - c / w @ self.b + self.centre
        return q, c @ self.a + s @ self.b, -s * w @ self.a + c * w @ self.b

    @property
    def size(self) -> float:
        """The largest coefficient [rad/s] or [m/s]."""
        return float(max(np.abs(self.a).max(), np.abs(self.b).max()))

    def scaled(self, factor: float) -> Fourier:
        """Return a series that moves by a part about the same centre."""
        return attrs.evolve(self, a=factor * self.a, b=factor * self.b)

    def slowed(self, factor: float) -> Fourier:
        """Return the same path at a part of the speed, in a longer period."""
        return attrs.evolve(self, period=self.period / factor, a=factor * self.a, b=factor * self.b)

    def basis(self, t: Array) -> tuple[Array, Array, Array]:
        """Return positions, velocities and accelerations (k, 2 h - 1) of each free coefficient; the last is the centre.

        Args:
            t: (k,) times [s].
        """
        bound = self._bound
        unit = attrs.evolve(self, a=bound[: len(self.a)], b=bound[len(self.a) :], centre=np.zeros(bound.shape[1]))
        q, qd, qdd = unit(t)
        standing, still = np.ones((len(t), 1)), np.zeros((len(t), 1))
        return np.hstack([q, standing]), np.hstack([qd, still]), np.hstack([qdd, still])

    def with_coefficients(self, free: Array, centre: Array) -> Fourier:
        """Return the series of free coefficients (2 h - 2, n) about a centre (n,)."""
        both = self._bound @ free
        return attrs.evolve(self, a=both[: len(self.a)], b=both[len(self.a) :], centre=centre)

    @property
    def _bound(self) -> Array:
        """The coefficients (2 h, 2 h - 2) of series that start at rest: orthonormal columns."""
        h = len(self.a)
        still, steady = np.ones((1, h)) / np.sqrt(h), np.arange(1, h + 1)[None] / np.linalg.norm(np.arange(1, h + 1))
        blocks = [np.linalg.svd(row)[2][1:].T for row in (still, steady)]
        nothing = np.zeros((h, h - 1))
        return np.block([[blocks[0], nothing], [nothing, blocks[1]]])
