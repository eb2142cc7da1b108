"""Vectors and matrices of abstract scalars, as lists: the small algebra that textbook equations need."""

from collections.abc import Sequence
from typing import TypeAlias

from armwright.tracing.scalar import Scalar

Vector: TypeAlias = list[Scalar]
Matrix: TypeAlias = list[list[Scalar]]


def add(*vectors: Sequence[Scalar]) -> Vector:
    """Return the sum of vectors of one length."""
    return [sum(parts[1:], start=parts[0]) for parts in zip(*vectors, strict=True)]


def subtract(a: Sequence[Scalar], b: Sequence[Scalar]) -> Vector:
    """Return a - b."""
    return [x - y for x, y in zip(a, b, strict=True)]


def scale(factor: Scalar, a: Sequence[Scalar]) -> Vector:
    """Return factor · a."""
    return [factor * x for x in a]


def dot(a: Sequence[Scalar], b: Sequence[Scalar]) -> Scalar:
    """Return a · b."""
    first, *others = (x * y for x, y in zip(a, b, strict=True))
    return sum(others, start=first)


def cross(a: Sequence[Scalar], b: Sequence[Scalar]) -> Vector:
    """Return a × b."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def apply(M: Sequence[Sequence[Scalar]], v: Sequence[Scalar]) -> Vector:
    """Return M v."""
    return [dot(row, v) for row in M]


def transpose(M: Sequence[Sequence[Scalar]]) -> Matrix:
    """Return the transpose of M."""
    return [list(column) for column in zip(*M, strict=True)]


def product(A: Sequence[Sequence[Scalar]], B: Sequence[Sequence[Scalar]]) -> Matrix:
    """Return A B."""
    columns = transpose(B)
    return [[dot(row, column) for column in columns] for row in A]


def congruence(R: Sequence[Sequence[Scalar]], S: Sequence[Sequence[Scalar]]) -> Matrix:
    """Return R S Rᵀ of a symmetric S: its upper half, and that half mirrored."""
    half = product(R, S)
    upper = [[dot(half[i], R[j]) if j >= i else 0.0 for j in range(len(R))] for i in range(len(R))]
    return mirrored(upper)


def mirrored(upper: Sequence[Sequence[Scalar]]) -> Matrix:
    """Return the symmetric matrix of an upper half; what stands below it is not used."""
    n = len(upper)
    return [[upper[min(i, j)][max(i, j)] for j in range(n)] for i in range(n)]
