"""Equations of one row, such as a segment of a motion, for many rows: with NumPy, or by a kernel.

An equation is written once, over abstract scalars. It takes lists of scalars and returns lists of scalars. NumPy
evaluates it with an array of all rows in place of a scalar, which needs no compilation but takes a call for every
operation; a kernel does in one call what takes a hundred.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, Protocol, TypeAlias

import numpy as np

from armwright.arrays import Array
from armwright.tracing.emit import emit
from armwright.tracing.kernel import Kernel
from armwright.tracing.scalar import Scalar

# Of one row, and of one joint where joints have the same equation: lists of scalars in, lists of scalars out.
RowEquation: TypeAlias = Callable[..., Sequence[Sequence[Scalar]]]


class Evaluator(Protocol):
    """What evaluates the equation of a row for many rows."""

    def __call__(self, equation: RowEquation, of_joints: Sequence[Array], of_rows: Sequence[Array]) -> list[Array]:
        """Return what an equation gives, of every joint.

        Args:
            equation: of one row and one joint. It takes one list of scalars per input, and returns one per output.
            of_joints: inputs (m, k, n) of m rows and n joints.
            of_rows: inputs (m, w) that are the same for all joints of a row.

        Returns:
            Outputs (m, k, n); (m, k) where no input is of joints.
        """


def on_arrays(equation: RowEquation, of_joints: Sequence[Array], of_rows: Sequence[Array]) -> list[Array]:
    """Evaluate an equation with NumPy: see ``Evaluator``."""
    joints = [[x[:, i] for i in range(x.shape[1])] for x in of_joints]
    rows = [[x[:, i, None] if of_joints else x[:, i] for i in range(x.shape[1])] for x in of_rows]
    # Of a choice both values are computed, and one of them may be none.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return [np.stack(output, axis=1) for output in equation(*joints, *rows)]


def by_kernels(equation: RowEquation, of_joints: Sequence[Array], of_rows: Sequence[Array]) -> list[Array]:
    """Evaluate an equation by a kernel, which is compiled for its shapes when it is first needed: see ``Evaluator``."""
    joints = of_joints[0].shape[2] if of_joints else 0
    widths = tuple(x.shape[1] for x in (*of_joints, *of_rows))
    results = _kernel(equation, joints, widths, len(of_joints))(*of_joints, *of_rows)
    return list(results) if isinstance(results, tuple) else [results]


@cache
def _kernel(equation: RowEquation, joints: int, widths: tuple[int, ...], of_joints: int) -> Callable[..., Any]:
    """Return the kernel of an equation for rows of so many joints, of which the first inputs are."""

    def of_row(*inputs: list[Scalar]) -> list[list[Scalar]]:
        if not joints:
            return [list(output) for output in equation(*inputs)]
        of_rows = inputs[of_joints:]
        of_each = [equation(*(x[j::joints] for x in inputs[:of_joints]), *of_rows) for j in range(joints)]
        # Row by row of an output, all joints of each.
        return [[x for row in zip(*output, strict=True) for x in row] for output in zip(*of_each, strict=True)]

    shapes = {f"x{i}": (width, joints) if i < of_joints else (width,) for i, width in enumerate(widths)}
    # How many scalars each output has does not depend on their values.
    outputs = [len(output) for output in equation(*([1.0] * width for width in widths))]
    name = equation.__name__.strip("_")
    kernel = Kernel(
        emitted=emit(name, of_row, shapes, shapes=[(size, joints) if joints else (size,) for size in outputs])
    )
    return kernel.function(name)
