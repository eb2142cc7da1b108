"""A program in C or C++ that tests the text of an arm's quantities where it is to be used."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import ranges
from armwright.arrays import Array
from armwright.compiled.quantities import evaluate_quantity
from armwright.compiled.source_text import Language, arm_functions, text_of
from armwright.errors import InvalidValueError
from armwright.kinematics.forward_kinematics import forward
from armwright.tracing.emit_c import Function, Real
from armwright.tracing.identifiers import identifier

# Rows of inputs of each quantity.
_ROWS = 20
# How far a value may be off, in parts of the largest value of its array.
_TOLERANCES = {"double": 1e-9, "float": 1e-4}
# What inputs are drawn from where the limits of the joints do not tell.
_USUAL = 1.0
_LARGEST_WRENCH = 10.0


def check_text(arm: Arm, quantities: Sequence[str], language: Language, real: Real = "double") -> str:
    """Return the text of quantities and a ``main`` that tests it.

    The program compares the outputs for 20 configurations with those of the plain functions of Python, prints the
    largest error of each quantity, and returns 0 where all agree, else 1.

    Args:
        arm: the arm.
        quantities: names of functions of ``CompiledArm``.
        language: ``c`` or ``cpp``.
        real: the type of numbers.

    Raises:
        InvalidValueError: the language is another, or as in ``source_text``.
        UnknownNameError, UnsupportedArmError: as in ``source_text``.
    """
    if language not in {"c", "cpp"}:
        raise InvalidValueError(f"test: expected c or cpp as the language, got {language}")
    functions = arm_functions(arm, quantities, language, real)
    taken = [each.name for each in functions]
    checks = [identifier(f"check_{name}", taken) for name in taken]
    rng = np.random.default_rng(0)
    parts = [text_of(functions, language, real), _START.format(tolerance=_TOLERANCES[real])]
    parts += [
        _check(arm, quantity, function, check, rng, language=language, real=real)
        for quantity, function, check in zip(quantities, functions, checks, strict=True)
    ]
    calls = " + ".join(f"{check}()" for check in checks)
    parts.append(f"int main(void)\n{{\n    return {calls} > 0;\n}}\n")
    return "\n".join(parts)


def _check(
    arm: Arm, quantity: str, function: Function, check: str, rng: np.random.Generator, *, language: str, real: Real
) -> str:
    """Return the function that compares a quantity; it returns 1 where something is wrong, else 0."""
    rows = [_inputs(arm, function, rng, real) for _ in range(_ROWS)]
    expected = [[x for output in evaluate_quantity(arm, quantity, *row) for x in output] for row in rows]
    starts = np.cumsum([0, *(x.width for x in function.inputs)]).tolist()
    arrays = [f"x + {start}" for start in starts[:-1]] + [x.name for x in function.outputs]
    ends = np.cumsum([0, *(x.width for x in function.outputs)]).tolist()
    called = function.name if language == "c" else f"armwright::{function.name}<{real}>"
    declared = "\n".join(
        f"        {'unsigned char' if x.flag else real} {x.name}[{x.width}];" for x in function.outputs
    )
    compared = "\n".join(
        f"        for (i = 0; i < {x.width}; i++) {{\n"
        f"            error = larger(error, difference((double){x.name}[i], expected[row][{start} + i]) / "
        f"{_literal(_size(expected, start, x.width))});\n        }}"
        for x, start in zip(function.outputs, ends, strict=False)
    )
    return f"""\
static int {check}(void)
{{
    static const double inputs[{_ROWS}][{starts[-1]}] = {_table([[v for x in row for v in x] for row in rows])};
    static const double expected[{_ROWS}][{ends[-1]}] = {_table(expected)};
    double error = 0.0;
    int row, i, refused = 0;
    for (row = 0; row < {_ROWS}; row++) {{
        {real} x[{starts[-1]}];
{declared}
        for (i = 0; i < {starts[-1]}; i++) {{
            x[i] = ({real})inputs[row][i];
        }}
        refused += {called}({", ".join(arrays)}) != 0;
{compared}
    }}
    printf("{function.name}: largest error %.2g of the largest value, %d of {_ROWS} refused\\n", error, refused);
    return !(error <= TOLERANCE) || refused > 0;
}}
"""


def _inputs(arm: Arm, function: Function, rng: np.random.Generator, real: Real) -> list[list[float]]:
    """Return the inputs of one configuration, as numbers that the type can hold."""
    values = [_drawn(arm, x.name, x.width, rng) for x in function.inputs]
    return [np.asarray(x, dtype=np.float32 if real == "float" else float).ravel().tolist() for x in values]


def _drawn(arm: Arm, name: str, width: int, rng: np.random.Generator) -> Array:
    largest = {"qd": arm.limits.speed, "qdd": arm.limits.acceleration, "tau": arm.limits.effort}
    if name in ("q", "near"):
        return rng.uniform(*ranges(arm))
    if name == "pose":
        return forward(arm, rng.uniform(*ranges(arm)))
    if name in largest:
        return rng.uniform(-1, 1, arm.n) * np.where(np.isfinite(largest[name]), largest[name], _USUAL)
    return rng.uniform(-1, 1, width) * (_LARGEST_WRENCH if name == "wrench" else _USUAL)


def _size(rows: Sequence[Sequence[float]], start: int, width: int) -> float:
    """Return the largest value of an output, 1 where it has none but 0."""
    size = np.nanmax(np.abs(np.array(rows)[:, start : start + width]), initial=0.0)
    return float(size) if size > 0 else 1.0


def _table(rows: Sequence[Sequence[float]]) -> str:
    return "{" + ",".join(f"\n        {{{', '.join(map(_literal, row))}}}" for row in rows) + "}"


def _literal(value: float) -> str:
    return repr(float(value)) if math.isfinite(value) else "NAN" if math.isnan(value) else "HUGE_VAL"


_START = """\
#include <math.h>
#include <stdio.h>

#define TOLERANCE {tolerance!r}

/* Where there is no value, none is expected. */
static double difference(double value, double expected)
{{
    return value == expected || (value != value && expected != expected) ? 0.0 : fabs(value - expected);
}}

/* What is not a number is larger than any. */
static double larger(double a, double b)
{{
    return a >= b || a != a ? a : b;
}}
"""
