"""Functions of an abstract scalar: a float, an array with one value per configuration, or a node of a graph."""

import math
from typing import Any, TypeAlias

import numpy as np

from armwright.tracing.graph import is_traced, traced

# A float, an array of any shape with one value per configuration, or a ``Traced``. Equations use + - * / and the
# functions below.
Scalar: TypeAlias = Any


def sin(x: Scalar) -> Scalar:
    """Return the sine of ``x`` [rad]."""
    if is_traced(x):
        return traced("sin", x)
    return np.sin(x) if isinstance(x, np.ndarray) else math.sin(x)


def cos(x: Scalar) -> Scalar:
    """Return the cosine of ``x`` [rad]."""
    if is_traced(x):
        return traced("cos", x)
    return np.cos(x) if isinstance(x, np.ndarray) else math.cos(x)


def sqrt(x: Scalar) -> Scalar:
    """Return the root of ``x``, and 0 for what rounding has pushed below 0."""
    if is_traced(x):
        return traced("sqrt", x)
    return np.sqrt(np.maximum(x, 0.0)) if isinstance(x, np.ndarray) else math.sqrt(max(x, 0.0))


def atan2(y: Scalar, x: Scalar) -> Scalar:
    """Return the angle of the point (x, y) [rad], in (-pi, pi]."""
    if is_traced(y, x):
        return traced("atan2", y, x)
    if isinstance(y, np.ndarray) or isinstance(x, np.ndarray):
        return np.arctan2(y, x)
    return math.atan2(y, x)


def round_half_even(x: Scalar) -> Scalar:
    """Return the whole number nearest to ``x``, as a float; the even one of two."""
    if is_traced(x):
        return traced("round", x)
    return np.round(x) if isinstance(x, np.ndarray) else float(round(x))


def select(condition: Any, then: Scalar, otherwise: Scalar) -> Scalar:
    """Return ``then`` where ``condition`` holds and ``otherwise`` elsewhere; both are evaluated."""
    if is_traced(condition, then, otherwise):
        return traced("select", condition, then, otherwise)
    if isinstance(condition, np.ndarray):
        return np.where(condition, then, otherwise)
    return then if condition else otherwise


def reciprocal(x: Scalar) -> Scalar:
    """Return 1 / ``x``, and infinity for a float 0 as for one in an array."""
    if isinstance(x, float) and x == 0:
        return math.inf
    return 1.0 / x
