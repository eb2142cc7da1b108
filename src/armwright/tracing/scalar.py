"""Functions of an abstract scalar: a float, an array of a value per configuration, or a node of an expression graph."""

import math
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from armwright.tracing.graph import Traced, exponential, is_traced, traced

# A float, an array of any shape with one value per configuration, or a ``Traced``. Equations use + - * / and the
# functions below.
Scalar: TypeAlias = Any

# The types of conditions that hold or do not.
_DECIDED = frozenset({bool, np.bool_})


def _evaluate(op: str, on_arrays: Callable[..., Any], on_floats: Callable[..., float], *operands: Scalar) -> Scalar:
    """Apply a function to scalars: as an operation of a graph, to arrays or to floats."""
    if is_traced(*operands):
        return traced(op, *operands)
    return (on_arrays if any(isinstance(x, np.ndarray) for x in operands) else on_floats)(*operands)


def sin(x: Scalar) -> Scalar:
    """Return the sine of ``x`` [rad]."""
    return _evaluate("sin", np.sin, lambda x: math.sin(x) if math.isfinite(x) else math.nan, x)


def cos(x: Scalar) -> Scalar:
    """Return the cosine of ``x`` [rad]."""
    return _evaluate("cos", np.cos, lambda x: math.cos(x) if math.isfinite(x) else math.nan, x)


def sqrt(x: Scalar) -> Scalar:
    """Return the root of ``x``, and 0 for what rounding has pushed below 0."""
    return _evaluate("sqrt", lambda x: np.sqrt(np.maximum(x, 0.0)), lambda x: math.sqrt(max(x, 0.0)), x)


def cbrt(x: Scalar) -> Scalar:
    """Return the cube root of ``x``, which has its sign."""
    return _evaluate("cbrt", np.cbrt, math.cbrt, x)


def exp(x: Scalar) -> Scalar:
    """Return e to the power of ``x``."""
    return _evaluate("exp", np.exp, exponential, x)


def atan2(y: Scalar, x: Scalar) -> Scalar:
    """Return the angle of the point (x, y) [rad], in (-pi, pi]."""
    return _evaluate("atan2", np.arctan2, math.atan2, y, x)


def round_half_even(x: Scalar) -> Scalar:
    """Return the whole number nearest to ``x``, as a float; the even one of two."""
    return _evaluate("round", np.round, lambda x: float(round(x)) if math.isfinite(x) else x, x)


def select(condition: Any, then: Scalar, otherwise: Scalar) -> Scalar:
    """Return ``then`` where ``condition`` holds and ``otherwise`` elsewhere; both are evaluated."""
    if type(condition) in _DECIDED:
        return then if condition else otherwise
    if isinstance(condition, Traced) or isinstance(then, Traced) or isinstance(otherwise, Traced):
        return traced("select", condition, then, otherwise)
    if isinstance(condition, np.ndarray):
        return np.where(condition, then, otherwise)
    return then if condition else otherwise


def larger(x: Scalar, y: Scalar) -> Scalar:
    """Return the larger one of two scalars."""
    return select(x < y, y, x)


def smaller(x: Scalar, y: Scalar) -> Scalar:
    """Return the smaller one of two scalars."""
    return select(y < x, y, x)


def reciprocal(x: Scalar) -> Scalar:
    """Return 1 / ``x``, and infinity for a float 0 as for one in an array."""
    return math.inf if isinstance(x, float) and x == 0 else 1.0 / x
