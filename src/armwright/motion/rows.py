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
    """Evaluate an equation by a kernel, which is compiled when it is first needed: see ``Evaluator``.

    Every joint is a row of the kernel, so that it is the same for all arms.
    """
    joints = of_joints[0].shape[2] if of_joints else 1
    inputs = [np.ascontiguousarray(x.swapaxes(1, 2)).reshape(-1, x.shape[1]) for x in of_joints]
    inputs += [x.repeat(joints, axis=0) for x in of_rows] if of_joints else of_rows
    results = _kernel(equation, *(x.shape[1] for x in inputs))(*inputs)
    outputs = results if isinstance(results, tuple) else (results,)
    if not of_joints:
        return list(outputs)
    return [x.reshape(-1, joints, x.shape[1]).swapaxes(1, 2) for x in outputs]


@cache
def _kernel(equation: RowEquation, *widths: int) -> Callable[..., Any]:
    """Return the kernel of an equation for inputs of so many scalars."""
    name = equation.__name__.strip("_")
    inputs = {f"x{i}": width for i, width in enumerate(widths)}
    emitted = emit(name, equation, inputs, origin=_origin(equation, widths))
    # Motions have few rows: compiling with more effort takes longer than it saves.
    return Kernel(emitted=emitted, quickly=True).function(name)


def _origin(equation: RowEquation, widths: Sequence[int]) -> str:
    """Name an equation for other processes; empty for one that is not a function of a module of armwright."""
    module, name = equation.__module__, equation.__qualname__
    return f"{module} {name} {widths}" if name.isidentifier() and module.startswith(f"{__package__}.") else ""
