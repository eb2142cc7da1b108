"""Base parameters as readable text: which parameters they combine, with products of the lengths of the arm."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations_with_replacement

import numpy as np

from armwright.arm.model import Arm
from armwright.identification.model import BaseParameters, DynamicModel

# A coefficient is a product of lengths if they differ by no more than this part.
_SAME = 1e-8
# A length or the sine of an angle that is no more than rounding of a table.
_NOTHING = 1e-9


def groupings(model: DynamicModel) -> tuple[str, ...]:
    """Return what each base parameter of a model is, such as ``Izz2 + rotor2 + a2² (m3 + m4)``.

    A coefficient is written as a product of the lengths and angles of the Denavit-Hartenberg table where it is one,
    otherwise as a number.
    """
    base, products = model.base, list(_products(model.arm))
    return tuple(_text(base, row, model.names, products) for row in range(len(base.columns)))


def _text(base: BaseParameters, row: int, names: tuple[str, ...], products: list[tuple[str, float]]) -> str:
    kept = base.columns[row]
    by_coefficient: dict[tuple[str, bool], list[str]] = {}
    for column in np.flatnonzero(base.combinations[row]).tolist():
        if column != kept:
            value = float(base.combinations[row, column])
            by_coefficient.setdefault((_coefficient(abs(value), products), value < 0), []).append(names[column])
    parts = [names[kept]]
    for (coefficient, negative), members in by_coefficient.items():
        several = " + ".join(members)
        factor = several if not coefficient else f"{coefficient} {several if len(members) == 1 else f'({several})'}"
        # A minus sign stands before every member of a sum without a coefficient.
        parts.append(f"- {factor.replace(' + ', ' - ') if not coefficient else factor}" if negative else f"+ {factor}")
    return " ".join(parts)


def _coefficient(value: float, products: list[tuple[str, float]]) -> str:
    """Return the text of a coefficient above 0; empty for 1."""
    for text, product in products:
        if math.isclose(value, product, rel_tol=_SAME):
            return text
    return f"{value:.4g}"


def _products(arm: Arm) -> Iterator[tuple[str, float]]:
    """Give products of lengths and angles that coefficients may be, above 0, the simplest first."""
    yield "", 1.0
    lengths, angles = [], [("", 1.0)]
    for i, joint in enumerate(arm.joints, 1):
        lengths += [(f"{name}{i}", abs(x)) for name, x in (("a", joint.a), ("d", joint.d)) if abs(x) > _NOTHING]
        for name, x in (("sin", math.sin(joint.alpha)), ("cos", math.cos(joint.alpha))):
            if _NOTHING < abs(x) < 1 - _NOTHING:
                angles.append((f"{name}(alpha{i})", abs(x)))
    terms = [("2", 2.0), *lengths, *((f"2 {name}", 2 * x) for name, x in lengths)]
    pairs = list(combinations_with_replacement(lengths, 2))
    terms += [(f"{a}²" if a == b else f"{a} {b}", x * y) for (a, x), (b, y) in pairs]
    terms += [(f"2 {a} {b}", 2 * x * y) for (a, x), (b, y) in pairs if a != b]
    terms += [(f"({a}² + {b}²)", x * x + y * y) for (a, x), (b, y) in pairs if a != b]
    terms += [(f"1/{name}", 1 / x) for name, x in lengths]
    for angle, factor in angles:
        if angle:
            yield angle, factor
        for name, x in terms:
            yield f"{name} {angle}".strip(), x * factor
