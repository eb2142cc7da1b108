"""Derivatives of an equation of the user's, exact and compiled."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from itertools import accumulate, pairwise
from numbers import Integral, Real
from typing import Any, Literal

import numpy as np

from armwright.errors import InvalidValueError, KindError, ShapeError, UnknownNameError, counted, shown
from armwright.tracing.derivatives import jacobian
from armwright.tracing.emit import Shape, emit
from armwright.tracing.graph import Graph, Traced
from armwright.tracing.kernel import Kernel
from armwright.tracing.scalar import Scalar
from armwright.tracing.vectors import mirrored

# Numbers of one input at most: each is a node of the graph, and code is written for it.
_MAX_NUMBERS = 10_000

_DOC = "Return the values of the equation, and their derivatives by {}: see ``armwright.compiled.derivative``."


def derivative(
    equation: Callable[..., Scalar | Sequence[Scalar]],
    inputs: Mapping[str, int | Shape],
    *,
    of: str | Sequence[str],
    order: Literal[1, 2] = 1,
) -> Callable[..., Any]:
    """Return a compiled function of the values of an equation and of their derivatives, which are exact.

    The equation is run on scalars that write down what is done with them. It may use + - * /, the power 2, abs,
    comparisons, and the functions of ``armwright.tracing``; instead of a branch on such a scalar it writes ``select``.
    The functions of an arm over abstract scalars, such as ``dynamics.newton_euler.newton_euler``, are equations as
    well. The sine of an angle beyond 1e15, which the equation has computed, is NaN.

    Where there is no derivative, it is 0 for a comparison, for rounding, for ``abs``, ``sqrt`` and
    ``cbrt`` at 0, and for ``atan2`` of the point (0, 0); that of ``select`` is the derivative of the chosen branch.

    Args:
        equation: takes one list of scalars per input, a matrix row by row, and returns a scalar, or a list of m.
        inputs: of each input, by its name, how many numbers one value has, or its shape.
        of: names of the inputs to differentiate by.
        order: 2 for the second derivatives, too, of an equation that returns a scalar.

    Returns:
        A function of one array (..., *shape) per input, which also takes ``threads`` and ``out``, as those of
        ``CompiledArm`` do. It returns a tuple: the values, (...) of a scalar, otherwise (..., m); for each name in
        ``of`` the derivatives, of the shape of the values followed by that of the input; and for order 2 the Hessian,
        (..., k, k), by all k numbers of these inputs together, one input behind the other.

    Raises:
        KindError: ``equation`` is no function, returns something else than scalars, or uses something else together
            with a scalar; or ``inputs`` is no mapping of texts, or ``of`` no text or list of texts.
        ShapeError: an input or a list of values has no numbers, or an input has more than 10 000.
        UnknownNameError: ``of`` names no input.
        InvalidValueError: ``order`` is neither 1 nor 2, or 2 for more than a scalar; the name of an input is no
            identifier; or the equation uses or returns a number beyond the range of float64.

    Source:
        Griewank & Walther (2008), Evaluating Derivatives, chapters 3 and 5.
    """
    shapes = _shapes(inputs)
    names = _names(of, shapes)
    if isinstance(order, bool) or not isinstance(order, Integral) or order not in (1, 2):
        raise InvalidValueError(f"order: expected 1 or 2, got {shown(order)}")
    if not callable(equation):
        raise KindError(f"equation: expected a function of scalars, got {shown(equation)}")
    values, value_shape = _tried(equation, shapes)
    outputs = [value_shape, *((*value_shape, *shapes[name]) for name in names)]
    if order == 2:
        if value_shape:
            raise InvalidValueError(
                f"order: expected 1, for the equation returns a list of {counted(len(values), 'scalar')}"
            )
        size = sum(math.prod(shapes[name]) for name in names)
        outputs.append((size, size))
    with_derivatives = partial(_with_derivatives, equation, shapes, names, second=order == 2)
    title = _title(equation)
    kernel = Kernel(emitted=emit(title, with_derivatives, shapes, shapes=outputs))
    return kernel.function(title, _DOC.format(", ".join(names)))


def _shapes(inputs: Mapping[str, int | Shape]) -> dict[str, Shape]:
    if not isinstance(inputs, Mapping):
        raise KindError(f"inputs: expected names with sizes, such as {{'q': 6}}, got {shown(inputs)}")
    for name in inputs:
        if not isinstance(name, str):
            raise KindError(f"inputs: expected the name of each to be a text, such as 'q', got {shown(name)}")
    return {name: _shape(name, value) for name, value in inputs.items()}


def _names(of: str | Sequence[str], inputs: Mapping[str, Shape]) -> list[str]:
    """Return the names of the inputs to differentiate by, one at least."""
    names: list[Any] = [of] if isinstance(of, str) or not isinstance(of, Iterable) else list(of)
    for name in names:
        if not isinstance(name, str):
            raise KindError(f"of: expected the name of an input, or a list of such, got {shown(of)}")
    for name in names:
        if name not in inputs:
            raise UnknownNameError("input", name, inputs)
    if not names:
        raise InvalidValueError("of: expected the name of an input, got none")
    return names


def _shape(name: str, value: int | Shape) -> Shape:
    sizes = tuple(value) if isinstance(value, Iterable) else (value,)
    shape = tuple(int(size) for size in sizes if isinstance(size, Integral) and not isinstance(size, bool) and size > 0)
    if len(shape) < len(sizes):
        raise ShapeError(f"inputs: expected a size above 0, or a shape of such, for {name!r}, got {shown(value)}")
    if math.prod(shape) > _MAX_NUMBERS:
        raise ShapeError(f"inputs: expected at most {_MAX_NUMBERS:,} numbers for {name!r}, got {shown(value)}")
    return shape


def _tried(equation: Callable[..., Any], shapes: Mapping[str, Shape]) -> tuple[list[Scalar], Shape]:
    """Return what an equation returns, which is known once it has run, as a list of scalars, and its shape."""
    trial = Graph()
    try:
        result = equation(*(trial.inputs(math.prod(shape)) for shape in shapes.values()))
    except TypeError as error:
        error.add_note("An equation takes its functions from armwright.tracing; those of math and NumPy take numbers.")
        raise
    return _values(result)


def _values(result: Any) -> tuple[list[Scalar], Shape]:
    """Return what an equation returns as a list of scalars, and its shape."""
    if isinstance(result, Traced | Real):
        return [result], ()
    if isinstance(result, np.ndarray) and result.ndim == 1:
        result = result.tolist()
    if not isinstance(result, list | tuple) or not all(isinstance(x, Traced | Real) for x in result):
        raise KindError(
            "equation: expected it to return a scalar or a list of scalars, a matrix row by row as by np.ravel, got "
            f"{shown(result)}"
        )
    if not result:
        raise ShapeError("equation: expected it to return at least one scalar, got none")
    return list(result), (len(result),)


def _title(equation: Callable[..., Any]) -> str:
    name = getattr(equation, "__name__", "")
    return name if isinstance(name, str) and name.isidentifier() else "equation"


def _with_derivatives(
    equation: Callable[..., Any], inputs: Iterable[str], names: Sequence[str], *scalars: list[Traced], second: bool
) -> list[list[Scalar]]:
    """Return the values of an equation, their derivatives by each of the inputs named, and the Hessian if wanted."""
    values, _ = _values(equation(*scalars))
    by_name = dict(zip(inputs, scalars, strict=True))
    columns = [x for name in names for x in by_name[name]]
    rows = jacobian(values, columns)
    ends = list(accumulate((len(by_name[name]) for name in names), initial=0))
    derivatives = [[x for row in rows for x in row[start:end]] for start, end in pairwise(ends)]
    if not second:
        return [values, *derivatives]
    return [values, *derivatives, [x for row in mirrored(jacobian(rows[0], columns)) for x in row]]
