"""The error of the resting tip of a linkage whose clearances and other dimensions are random.

Near the mean clearances the error is linear in all deviations. The clearances are normal or lognormal, and may be
correlated, as those of an estimate; the other dimensions are normal and independent.

Source:
    Spec of the life, 4.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Literal, TypeAlias

import attrs
import numpy as np
from scipy.special import ndtr

from armwright.arrays import Array, ArrayLike, floats, not_negative, read_only
from armwright.clearance.dimensions import dimensions_of
from armwright.clearance.ideal import close_pins, tip_position, tip_sensitivity
from armwright.clearance.linkage import Linkage
from armwright.clearance.plane_vectors import perpendicular, rotate
from armwright.clearance.sensitivities import rest_sensitivities
from armwright.clearance.static_equilibrium import find_static_equilibrium
from armwright.errors import InvalidValueError, ShapeError, one_of
from armwright.reliability.linear_error import LinearError
from armwright.reliability.tip_errors import sampled_tip_errors
from armwright.reliability.tip_samples import LINKAGES, TipErrorTask

Shape: TypeAlias = Literal["normal", "lognormal"]
SHAPES: tuple[Shape, ...] = ("normal", "lognormal")
# An eigenvalue of a covariance below this part of the largest is rounding.
_FLAT = 1e-12
# A clearance that varies by more is none [m].
_WIDEST = 1.0
# Logarithm of a factor that is beyond every limit, and whose square can be represented.
LARGEST_LOG = 100.0
# Equilibria that are solved at once, where clearances alone differ.
_EQUILIBRIA = 20_000
# Standard deviation of a number that is evenly spread from -1 to 1.
_EVEN = 1 / np.sqrt(3.0)
# The least clearance that has a direction [m].
_LEAST = 1e-9


def _numbers(value: ArrayLike) -> Array:
    return read_only(floats(value, "clearances"))


@attrs.frozen(kw_only=True, eq=False)
class RandomClearances:
    """The clearances of many linkages that are built alike.

    Attributes:
        mean: (p,) [m].
        covariance: (p, p) [m²].
        shape: ``normal``, where a clearance below 0 counts as 0, or ``lognormal``.
    """

    mean: Array = attrs.field(converter=_numbers)
    covariance: Array = attrs.field(converter=_numbers)
    shape: Shape = "normal"

    def __attrs_post_init__(self) -> None:
        """Refuse numbers that no clearances have."""
        p = len(self.mean)
        if self.mean.ndim != 1 or self.covariance.shape != (p, p):
            raise ShapeError(
                f"clearances: expected mean (p,), covariance (p, p), got {self.mean.shape}, {self.covariance.shape}"
            )
        one_of("shape", self.shape, SHAPES)
        least = 0.0 if self.shape == "normal" else np.finfo(float).tiny
        if not (self.mean >= least).all():
            raise InvalidValueError(
                f"clearances: expected means {'of 0 or more' if self.shape == 'normal' else 'above 0'}, got "
                f"{self.mean.min() * 1e3:g} mm"
            )
        values = np.linalg.eigvalsh(self.covariance)
        if not np.allclose(self.covariance, self.covariance.T, rtol=1e-9, atol=0) or (
            p and values[0] < -1e-9 * max(float(values[-1]), 1e-300)
        ):
            raise InvalidValueError("clearances: expected a symmetric covariance without negative eigenvalues")
        if p and self.deviations.max() > _WIDEST:
            raise InvalidValueError(
                f"clearances: expected deviations up to {_WIDEST * 1e3:g} mm, got {self.deviations.max() * 1e3:g} mm"
            )
        if self.shape == "lognormal" and (self._relative <= -1).any():
            raise InvalidValueError("clearances: no lognormal ones have correlations that are so negative")

    @property
    def deviations(self) -> Array:
        """(p,) standard deviations [m]."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def below_zero(self) -> float:
        """The largest probability that a clearance would be below 0, where it counts as 0."""
        if self.shape == "lognormal":
            return 0.0
        sizes = np.where(self.deviations > 0, self.deviations, np.inf)
        return float(ndtr(-self.mean / sizes).max(where=self.deviations > 0, initial=0.0))

    @property
    def _relative(self) -> Array:
        return np.asarray(self.covariance / np.outer(self.mean, self.mean))

    @property
    def _root(self) -> Array:
        """A root of the covariance, (p, p): of clearances, or of their logarithms."""
        matrix = self.covariance if self.shape == "normal" else np.log1p(self._relative)
        if not np.any(matrix - np.diag(np.diag(matrix))):
            return np.diag(np.sqrt(np.diag(matrix)))
        values, axes = np.linalg.eigh(matrix)
        return np.asarray(axes * np.sqrt(np.where(values > _FLAT * values[-1], values, 0.0)))

    @property
    def linear(self) -> Array:
        """(p, p) derivatives by standard normal numbers at 0, where clearances are at their mean or median [m]."""
        return self._root if self.shape == "normal" else self.mean[:, None] * self._root

    def values(self, z: Array) -> Array:
        """Return clearances (..., p) for standard normal numbers (..., p), none of them below 0 [m]."""
        shifts = z @ self._root.T
        if self.shape == "normal":
            return np.maximum(self.mean + shifts, 0.0)
        logs = np.minimum(shifts - np.diag(np.log1p(self._relative)) / 2, LARGEST_LOG)
        return np.asarray(self.mean * np.exp(logs))


@attrs.frozen(kw_only=True, eq=False)
class RandomLinkage:
    """A linkage of random dimensions at poses of rest.

    Attributes:
        linkage: with m pins.
        q: (p, n) coordinates with closed pins, at which the drives are locked.
        clearances: of its m pins.
        deviations: standard deviations of other dimensions by name, as ``dimensions_of`` has them [m, rad, kg, N].
        offset: (p, 2) error of the tip with mean dimensions [m].
        jacobian: (p, 2, m) its derivatives by the clearances.
        others: (p, 2, k) its derivatives by the other dimensions.
        friction: whether it holds each journal anywhere in its friction cone, at each pose anew, with the same
            probability; without it journals lie in the directions of their forces.
    """

    linkage: Linkage
    q: Array
    clearances: RandomClearances
    deviations: Mapping[str, float]
    offset: Array
    jacobian: Array
    others: Array
    friction: bool = False

    @classmethod
    def at(
        cls,
        linkage: Linkage,
        q: ArrayLike,
        clearances: RandomClearances,
        deviations: Mapping[str, float] | None = None,
        *,
        friction: bool = False,
    ) -> RandomLinkage:
        """Return a linkage at poses of rest, linear about its mean clearances.

        Args:
            linkage: with m pins.
            q: (p, n) coordinates with closed pins, at which the drives are locked.
            clearances: of its m pins.
            deviations: standard deviations of other dimensions by name [m, rad, kg, N].
            friction: whether it holds journals anywhere in their friction cones.

        Raises:
            InvalidValueError: a pin carries no force at rest, or a number is out of its range.
            UnknownNameError: there is no such dimension, beside the clearances.
        """
        given = dict(deviations or {})
        known = [each.name for each in dimensions_of(linkage) if each.kind != "clearance"]
        for name, value in given.items():
            not_negative(value, f"deviation of {one_of('dimension', name, known)}")
        closed = np.atleast_2d(floats(q, "q"))
        if len(clearances.mean) != len(linkage.pins):
            raise ShapeError(f"clearances: expected one for each pin, {len(linkage.pins)}")
        found = rest_sensitivities(linkage, closed, clearances.mean)
        columns = [found.column(name) for name in given]
        return cls(
            linkage=linkage,
            q=closed,
            clearances=clearances,
            deviations=given,
            offset=found.tip - tip_position(linkage, closed),
            jacobian=found.of("clearance"),
            others=np.stack(columns, axis=-1) if columns else np.zeros((*found.tip.shape, 0)),
            friction=friction and linkage.material.friction > 0,
        )

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all random dimensions, those of the pins first."""
        return (*self.linkage.clearances, *self.deviations)

    @property
    def spreads(self) -> Array:
        """(m + k,) standard deviations of all random dimensions."""
        return np.array([*self.clearances.deviations, *self.deviations.values()])

    @property
    def size(self) -> int:
        """How many standard normal numbers describe it: one for each dimension, and one for each journal at a pose."""
        return len(self.names) + len(self.q) * len(self.linkage.pins) * self.friction

    @property
    def error(self) -> LinearError:
        """The error of the tip, linear in deviations that are independent."""
        linear, names = self.jacobian @ self.clearances.linear, self.names
        columns, deviations = [linear, self.others], [1.0] * len(self.linkage.pins) + list(self.deviations.values())
        if self.friction:
            p, _, m = self.jacobian.shape
            own = np.zeros((p, 2, p, m))
            own[range(p), :, range(p)] = self.across * self.clearances.mean
            columns.append(own.reshape(p, 2, p * m))
            names += tuple(f"{pin} friction {i + 1}" for i in range(p) for pin in self.linkage.clearances)
            deviations += [self.cone * _EVEN] * (p * m)
        is_linear = self.clearances.shape == "normal" and not self.friction
        return LinearError(
            names=names,
            deviations=deviations,
            offset=self.offset,
            jacobian=np.concatenate(columns, axis=-1),
            exact=None if is_linear else self.drawn_errors,
            alone=self._error_at if self.friction else None,
        )

    def _error_at(self, pose: int) -> LinearError:
        own = [pose]
        return attrs.evolve(
            self, q=self.q[own], offset=self.offset[own], jacobian=self.jacobian[own], others=self.others[own]
        ).error

    def drawn_errors(self, z: Array) -> Array:
        """Return (s, p, 2) errors by the linear law, of linkages that numbers (s, size) describe [m]."""
        m, k = len(self.linkage.pins), len(self.names)
        clearances = self.clearances.values(z[:, :m])
        errors = self.errors(clearances, z[:, m:k] * self.spreads[m:])
        if self.friction:
            errors += np.einsum("pam,spm->spa", self.across, clearances[:, None] * self._tilts(z))
        return errors

    @property
    def cone(self) -> float:
        """Half angle of the friction cones [rad]."""
        return float(np.arctan(self.linkage.material.friction))

    def _tilts(self, z: Array) -> Array:
        """Return (s, p, m) angles of journals beside their forces, evenly spread over the cones [rad]."""
        own = z[:, len(self.names) :].reshape(len(z), len(self.q), len(self.linkage.pins))
        return np.asarray(self.cone * (2 * ndtr(own) - 1))

    @property
    def shares(self) -> Array:
        """(p, m + k) part of each dimension in the variance of the error at each pose; rows add up to one.

        Of correlated clearances one that balances another has a negative part. With friction there are m parts more,
        those of the friction in each pin.
        """
        own = (self.jacobian * (self.jacobian @ self.clearances.covariance)).sum(axis=1)
        rest = ((self.others * np.array(list(self.deviations.values()))) ** 2).sum(axis=1)
        held = (self.across * self.clearances.mean * self.cone * _EVEN) ** 2
        parts = np.concatenate([own, rest, *([held.sum(axis=1)] if self.friction else [])], axis=-1)
        return np.asarray(parts / np.maximum(parts.sum(axis=-1, keepdims=True), np.finfo(float).tiny))

    @cached_property
    def across(self) -> Array:
        """(p, 2, m) shift of the tip by the angle at which a journal lies beside its force, by its clearance."""
        rest = find_static_equilibrium(self.linkage, self.q, np.maximum(self.clearances.mean, _LEAST))
        ways = rest.gaps / np.linalg.norm(rest.gaps, axis=-1, keepdims=True)
        sideways = perpendicular(ways)
        return np.asarray(np.einsum("pami,pmi->pam", tip_sensitivity(self.linkage, rest.q), sideways))

    def errors(self, clearances: Array, shifts: Array) -> Array:
        """Return (s, p, 2) errors by the linear law [m].

        Args:
            clearances: (s, m) [m].
            shifts: (s, k) of the other dimensions [m] or [rad].
        """
        steps = clearances - self.clearances.mean
        errors = np.tensordot(steps, self.jacobian, axes=([1], [2])) + self.offset
        return np.asarray(errors + np.tensordot(shifts, self.others, axes=([1], [2])))

    def equilibria(self, z: Array) -> Array:
        """Return (s, p, 2) errors in complete equilibrium, of linkages that numbers (s, size) describe [m].

        Args:
            z: standard normal numbers.

        Raises:
            InvalidValueError: one of the linkages cannot be assembled.
        """
        m, k = len(self.linkage.pins), len(self.names)
        clearances = self.clearances.values(z[:, :m])
        if self.deviations:
            means = dict(zip(self.linkage.clearances, self.clearances.mean.tolist(), strict=True))
            names = [*(f"{pin}.clearance" for pin in means), *self.deviations]
            steps = np.concatenate([clearances - self.clearances.mean, z[:, m:k] * self.spreads[m:]], axis=1)
            errors = sampled_tip_errors(self.linkage.with_clearances(means), self.q, names, steps)
            return errors + (self.drawn_errors(z) - attrs.evolve(self, friction=False).drawn_errors(z))
        return np.asarray(self._tips(clearances, z) - tip_position(self.linkage, self.q))

    @property
    def task(self) -> TipErrorTask:
        """The errors in complete equilibrium, of linkages that numbers (s, size) describe."""
        clearances = self.clearances
        return TipErrorTask(
            linkage=self.linkage.name,
            poses=len(self.q),
            errors=self.equilibria,
            settings={
                "linkage": self.linkage.as_data(),
                "q": self.q.tolist(),
                "clearances": {
                    "mean": clearances.mean.tolist(),
                    "covariance": clearances.covariance.tolist(),
                    "shape": clearances.shape,
                },
                "deviations": dict(self.deviations),
                "friction": self.friction,
            },
            block=LINKAGES if self.deviations else max(1, _EQUILIBRIA // len(self.q)),
        )

    def _tips(self, clearances: Array, z: Array) -> Array:
        """Return (s, p, 2) positions of the tip in equilibrium [m]."""
        rest = find_static_equilibrium(self.linkage, self.q, clearances[:, None])
        if not self.friction:
            return rest.tip
        drives = self.q[:, list(self.linkage.driven)]
        gaps = rotate(rest.gaps, self._tilts(z))
        return tip_position(self.linkage, close_pins(self.linkage, rest.q, drives=drives, gaps=gaps))
