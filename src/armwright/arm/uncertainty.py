"""How well the dimensions of an arm are known: the covariance of its errors, as a calibration tells it."""

from __future__ import annotations

from collections.abc import Iterable

import attrs
import numpy as np

from armwright.arrays import Array, ArrayLike, array_key, floats, not_negative, read_only, reduce_by_fields
from armwright.errors import InvalidValueError, ShapeError

# Covariances are written and read to the last bit; this part of the largest is rounding.
_ROUNDING = 1e-9
# A correlation of two errors that are nearly one is known to so many digits.
_SMALLEST = 1e-6


def _names(value: Iterable[str]) -> tuple[str, ...]:
    return tuple(str(name) for name in value)


def _covariance(value: ArrayLike) -> Array:
    return read_only(floats(value, "covariance"))


@attrs.frozen(kw_only=True)
class Uncertainty:
    """How well an arm is known.

    Attributes:
        errors: f names such as ``base.x``, ``joint2.alpha``, ``tool.z``: of the frame of the base, along its axes; of
            the numbers of the table; of the frame of the tool, along its axes.
        covariance: (f, f) of what they are still off by [m], [rad].
        noise: standard deviation of a coordinate of the measurement [m].
    """

    errors: tuple[str, ...] = attrs.field(converter=_names)
    covariance: Array = attrs.field(converter=_covariance, eq=array_key)
    noise: float

    __reduce__ = reduce_by_fields

    def __attrs_post_init__(self) -> None:
        """Refuse what is no covariance of these errors."""
        f = len(self.errors)
        if len(set(self.errors)) != f:
            raise InvalidValueError("uncertainty: expected different names of errors, got one twice")
        if self.covariance.shape != (f, f):
            raise ShapeError(f"uncertainty: expected ({f}, {f}) for {f} errors, got {self.covariance.shape}")
        C = self.covariance
        size = np.sqrt(np.abs(np.diag(C)))
        scaled = C / np.maximum(np.outer(size, size), np.finfo(float).tiny)
        symmetric = np.allclose(scaled, scaled.T, rtol=0, atol=_ROUNDING)
        if not symmetric or np.linalg.eigvalsh(scaled).min(initial=0.0) < -_SMALLEST:
            message = "expected a covariance matrix, symmetric and with variances of 0 or more"
            raise InvalidValueError(f"uncertainty: {message}")
        object.__setattr__(self, "noise", not_negative(self.noise, "uncertainty: noise", "m"))
