"""Functions of an abstract scalar: a float, or an array that holds one value per configuration."""

import math
from typing import Any, TypeAlias

import numpy as np

# A float, or an array of any shape with one value per configuration. Equations use + - * / and the functions below.
Scalar: TypeAlias = Any


def sin(x: Scalar) -> Scalar:
    """Return the sine of ``x`` [rad]."""
    return np.sin(x) if isinstance(x, np.ndarray) else math.sin(x)


def cos(x: Scalar) -> Scalar:
    """Return the cosine of ``x`` [rad]."""
    return np.cos(x) if isinstance(x, np.ndarray) else math.cos(x)


def sqrt(x: Scalar) -> Scalar:
    """Return the root of ``x``, and 0 for what rounding has pushed below 0."""
    return np.sqrt(np.maximum(x, 0.0)) if isinstance(x, np.ndarray) else math.sqrt(max(x, 0.0))


def atan2(y: Scalar, x: Scalar) -> Scalar:
    """Return the angle of the point (x, y) [rad], in (-pi, pi]."""
    if isinstance(y, np.ndarray) or isinstance(x, np.ndarray):
        return np.arctan2(y, x)
    return math.atan2(y, x)


def sign(x: Scalar) -> Scalar:
    """Return -1, 0 or 1 with the sign of ``x``."""
    return np.sign(x) if isinstance(x, np.ndarray) else float((x > 0) - (x < 0))


def select(condition: Any, then: Scalar, otherwise: Scalar) -> Scalar:
    """Return ``then`` where ``condition`` holds and ``otherwise`` elsewhere; both are evaluated."""
    return (
        np.where(condition, then, otherwise)
        if isinstance(condition, np.ndarray)
        else (then if condition else otherwise)
    )
