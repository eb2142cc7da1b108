"""Vectors and matrices of scalars, held against those of NumPy."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from armwright.tracing.vectors import (
    add,
    apply,
    congruence,
    cross,
    dot,
    mirrored,
    product,
    scale,
    subtract,
    transpose,
)


def test_against_numpy(rng: np.random.Generator) -> None:
    """Every operation gives what NumPy gives, for vectors of three numbers and of more."""
    for n in (1, 3, 5):
        a, b, c = rng.normal(size=(3, n))
        A, B = rng.normal(size=(n, 4)), rng.normal(size=(4, n))
        v, S = rng.normal(size=4), rng.normal(size=(4, 4))
        S = S + S.T
        pairs: list[tuple[Any, Any]] = [
            (add(a, b, c), a + b + c),
            (subtract(a, b), a - b),
            (scale(3.0, a), 3 * a),
            (dot(a, b), a @ b),
            (apply(A.tolist(), v.tolist()), A @ v),
            (transpose(A.tolist()), A.T),
            (product(A.tolist(), B.tolist()), A @ B),
            (congruence(A.tolist(), S.tolist()), A @ S @ A.T),
            (mirrored(np.triu(S).tolist()), S),
        ]
        for found, expected in pairs:
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14 * max(1.0, np.abs(expected).max()))
    a, b = rng.normal(size=(2, 3))
    np.testing.assert_allclose(cross(a, b), np.cross(a, b), rtol=0, atol=1e-14)


def test_symmetric_to_the_last_bit(rng: np.random.Generator) -> None:
    """What is symmetric has equal halves; what stands below the upper half does not count."""
    R, S = rng.normal(size=(2, 3, 3))

    for found in (congruence(R.tolist(), (S + S.T).tolist()), mirrored(S.tolist())):
        assert np.array_equal(found, np.transpose(found))


@pytest.mark.parametrize("operation", [add, subtract, dot])
def test_lengths_that_do_not_fit(operation: Callable[..., object]) -> None:
    """Vectors of two lengths are a mistake, of which nothing is left out silently."""
    with pytest.raises(ValueError, match="argument 2 is shorter"):
        operation([1.0, 2.0, 3.0], [1.0, 2.0])
