"""From a graph to the source of a kernel: straight-line code, for one configuration and for many.

Inputs and outputs are passed row-major, one row per configuration. For many, blocks of ``LANES`` configurations are
transposed so that each quantity lies in a row of its own; the loop over the lanes is what the compiler
vectorises. Nothing is left to the compiler that would change a bit: no operation is reordered, and where a
multiplication and an addition become one instruction is written down (``fused``). So a configuration has the same bits
alone, in any batch and inside other compiled code.
"""

import ast
import inspect
import math
import textwrap
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from itertools import islice
from keyword import iskeyword
from typing import Literal, NamedTuple, TypeAlias

import attrs
import numpy as np

from armwright.errors import InvalidValueError, shown
from armwright.tracing.assignments import Code, Watched
from armwright.tracing.elementary import arc_tangent, sine_cosine
from armwright.tracing.graph import Graph, Traced, operation_count, reachable
from armwright.tracing.scalar import Scalar

# Configurations in a block. So few that the processor fetches the next block while it works on this one, and enough
# for two to four vectors.
LANES = 16

# What a kernel returns beside 0; see ``Emitted``.
MEANINGLESS, UNUSUAL = 1, 2

Shape: TypeAlias = tuple[int, ...]

_HEAD = '''"""Emitted by armwright. {count} operations per configuration."""

from math import sqrt

import numpy as np
from llvmlite.binding import get_host_cpu_features
from numba import boolean, float64, int64, njit, types
from numba.extending import intrinsic

if get_host_cpu_features().get("fma", True):

    @intrinsic
    def fma(typing, a, b, c):
        def instruction(context, builder, signature, operands):
            return builder.fma(*operands)

        return float64(float64, float64, float64), instruction

else:

    @njit(forceinline=True)
    def fma(a, b, c):
        return a * b + c

'''

_ROWS = """
SIGNATURE = int64(int64, int64, {signature})

def rows(first, last, {arguments}):
    if {misfit}:
        return 1
    x = np.zeros({in_size})
    y = np.zeros({out_size})
    trusted = np.zeros({lanes})
    for start in range(first, last, {lanes}):
        m = min({lanes}, last - start)
{load}
        for k in range({lanes}):
{body}
            trusted[k] += trust
{store}
    found = 0
    for k in range({lanes}):
        found |= 0 if trusted[k] == 0.0 else (2 if trusted[k] > 0.0 else 1)
    return found
"""

_SINGLE = """
SIGNATURE = int64({signature})

def single({arguments}):
    if {misfit}:
        return 1
{body}
    return 0 if trust == 0.0 else (2 if trust > 0.0 else 1)
"""


class Guarded(NamedTuple):
    """What an equation returns whose values mean something only under conditions.

    Attributes:
        values: one list of scalars per output.
        positive: scalars that must be above 0.
    """

    values: Sequence[Sequence[Scalar]]
    positive: Sequence[Scalar]


Equation: TypeAlias = Callable[..., Sequence[Sequence[Scalar]] | Guarded]


@attrs.frozen(kw_only=True)
class Emitted:
    """The source of a kernel and what it takes.

    Both functions fill the output arrays and return a status, 0 where all is well. ``MEANINGLESS`` is set in it where
    some configuration came out without meaning: the shape of an input is wrong, an input is not finite or too large
    (``LARGEST_ANGLE`` where its sine is taken, ``LARGEST`` elsewhere), or a condition of the equation is broken.
    ``UNUSUAL`` is set where an input is outside of the bounds that were given to ``emit``; the outputs are right all
    the same.

    Attributes:
        title: what it computes, in words.
        rows: source of ``rows(first, last, *inputs, *outputs)``, for arrays of (N, *shape).
        single: source of ``single(*inputs, *outputs)``, for arrays of (*shape).
        inputs: shape of one value of each input, by its name.
        angles: the names of inputs that hold a number whose sine is taken.
        outputs: shape of one value of each output.
        flags: numbers of the outputs that are truth values.
        operations: how many of each kind, per configuration.
        joined: how many additions take in a multiplication.
    """

    title: str
    rows: str
    single: str
    inputs: dict[str, Shape]
    angles: frozenset[str]
    outputs: tuple[Shape, ...]
    flags: tuple[int, ...]
    operations: dict[str, int]
    joined: int


def emit(
    title: str,
    equation: Equation,
    inputs: Mapping[str, int | Shape],
    *,
    shapes: Sequence[Shape] | None = None,
    flags: Collection[int] = (),
    bounds: Mapping[str, Sequence[float]] | None = None,
) -> Emitted:
    """Trace an equation and write its kernel.

    Args:
        title: what it computes, in words; it stands beside the source, not in it.
        equation: takes one list of scalars per input, returns one list per output, or ``Guarded`` ones.
        inputs: of each input, by its name, the width or the shape of one value; a matrix comes to the equation row
            by row.
        shapes: shape of one value of each output; vectors when left out.
        flags: numbers of the outputs that are truth values.
        bounds: by the name of an input, how far from 0 each of its numbers usually is; farther numbers are reported.

    Raises:
        InvalidValueError: the name of an input is no identifier: names become part of what is executed.
    """
    for name in inputs:
        if not (name.isascii() and name.isidentifier()) or iskeyword(name):
            raise InvalidValueError(f"inputs: expected names such as 'qd', got {shown(name)}")
    graph = Graph()
    input_shapes = {name: (shape,) if isinstance(shape, int) else shape for name, shape in inputs.items()}
    scalars = {name: graph.inputs(math.prod(shape)) for name, shape in input_shapes.items()}
    result = equation(*scalars.values())
    rows, positive = result if isinstance(result, Guarded) else (result, ())
    outputs = [[_node(graph, x) for x in row] for row in rows]
    row_shapes = tuple((len(row),) for row in outputs) if shapes is None else tuple(shapes)
    flat = [node for row in outputs for node in row]
    # The nodes that the argument of a sine or cosine comes of.
    turned = set(reachable(graph, [node.operands[0] for node in graph.nodes if node.op in ("sin", "cos")]))
    nodes = [x.node for row in scalars.values() for x in row]
    watched = Watched(
        angles=[node for node in nodes if node in turned],
        others=[node for node in nodes if node not in turned],
        positive=[_node(graph, x) for x in positive],
        bounds={
            x.node: float(bound)
            for name, numbers in (bounds or {}).items()
            for x, bound in zip(scalars.get(name, ()), numbers, strict=False)
            if math.isfinite(bound)
        },
    )
    code = Code(graph, flat, watched)
    operations = operation_count(graph, flat)
    signature = ArraySignature(tuple(input_shapes.values()), row_shapes, tuple(flags))
    return Emitted(
        title=title,
        rows=head(operations) + _rows_source(code, signature),
        single=head(operations) + _single_source(code, signature),
        inputs=input_shapes,
        angles=frozenset(name for name, row in scalars.items() if turned.intersection(x.node for x in row)),
        outputs=row_shapes,
        flags=tuple(flags),
        operations=operations,
        joined=len(code.joined),
    )


@attrs.frozen(kw_only=True)
class KernelBody:
    """The body of a kernel, straight-line code that other loops take in: for ``LANES`` configurations side by side.

    Attributes:
        lines: assignments for lane ``k``, that read ``x[row * LANES + k]`` and write ``y[row * LANES + k]``.
        outputs: how many rows are written.
        operations: how many of each kind, per configuration.
    """

    lines: str
    outputs: int
    operations: dict[str, int]


def kernel_body(equation: Callable[[list[Scalar]], Sequence[Scalar]], inputs: int) -> KernelBody:
    """Trace an equation for a loop of the caller's.

    Args:
        equation: takes a list of scalars, returns another.
        inputs: how many scalars it takes.
    """
    graph = Graph()
    outputs = [_node(graph, x) for x in equation(list(graph.inputs(inputs)))]
    lines = _lane_lines(Code(graph, outputs), inputs, len(outputs))
    return KernelBody(lines=lines, outputs=len(outputs), operations=operation_count(graph, outputs))


def _lane_lines(code: Code, inputs: int, outputs: int) -> str:
    """Return the assignments for lane ``k`` of a block."""
    load = [f"x[{row} * {LANES} + k]" for row in range(inputs)]
    return code.lines(load, [f"y[{row} * {LANES} + k] = {{}}" for row in range(outputs)])


def head(operations: Mapping[str, int]) -> str:
    """Return the first lines of an emitted source: its imports, and the functions that its operations call.

    No name or title stands in it: a source is executed, and those are texts that a user wrote.

    Args:
        operations: how many of each kind, per configuration.
    """
    helpers = (helper for helper, ops in _HELPERS.items() if not ops.isdisjoint(operations))
    texts = (f'\n@njit(error_model="numpy", forceinline=True)\n{inspect.getsource(helper)}\n' for helper in helpers)
    return _HEAD.format(count=sum(operations.values())) + "".join(texts)


def function_source(function: Callable[..., object], decorator: str = "") -> str:
    """Return the text of a function for an emitted source: its statements alone, whatever else they are read with.

    Args:
        function: one whose names all stand in the emitted source.
        decorator: a line to put above it.
    """
    (definition,) = ast.parse(inspect.getsource(function)).body
    assert isinstance(definition, ast.FunctionDef)  # noqa: S101 - what is emitted is ours
    if ast.get_docstring(definition) is not None:
        del definition.body[0]
    definition.returns = None
    for argument in definition.args.args:
        argument.annotation = None
    return f"{decorator}\n{ast.unparse(definition)}".lstrip("\n")


_HELPERS: dict[Callable[..., object], set[str]] = {sine_cosine: {"sin", "cos"}, arc_tangent: {"atan2"}}


def _node(graph: Graph, x: Scalar) -> int:
    return x.node if isinstance(x, Traced) else graph.constant(float(x))


class ArraySignature(NamedTuple):
    """The shapes of the arrays that a kernel takes and fills, and which outputs are truth values."""

    inputs: tuple[Shape, ...]
    outputs: tuple[Shape, ...]
    flags: tuple[int, ...]

    @property
    def names(self) -> list[str]:
        """The names of the arrays in emitted source."""
        return [*(f"in{i}" for i in range(len(self.inputs))), *(f"out{i}" for i in range(len(self.outputs)))]

    def types(self, *, rows: bool) -> str:
        """Return the types of the arrays; inputs may be read-only."""
        kinds = [f'types.Array(float64, {len(shape) + rows}, "C", readonly=True)' for shape in self.inputs]
        for i, shape in enumerate(self.outputs):
            kind = "boolean" if i in self.flags else "float64"
            kinds.append(f'types.Array({kind}, {len(shape) + rows}, "C")')
        return ", ".join(kinds)

    def misfits(self, before: int = 0) -> Iterator[str]:
        """Give the conditions under which the shape of an input is wrong; of many rows there may be too few."""
        for i, shape in enumerate(self.inputs):
            if before:
                yield f"in{i}.shape[0] < last"
            for axis, size in enumerate(shape):
                yield f"in{i}.shape[{axis + before}] != {size}"

    def elements(self, side: Literal["in", "out"], before: str = "") -> Iterator[str]:
        """Yield the location of every number of the inputs or the outputs, such as ``in0[1, 2]``."""
        shapes = self.inputs if side == "in" else self.outputs
        for i, shape in enumerate(shapes):
            yield from (f"{side}{i}[{before}{', '.join(map(str, index))}]" for index in np.ndindex(shape))

    def stores(self, before: str = "") -> Iterator[str]:
        """Yield the statement that fills every element of the outputs, with a gap for the value."""
        for element in self.elements("out", before):
            is_flag = int(element[3 : element.index("[")]) in self.flags
            yield f"{element} = {{}} != 0" if is_flag else f"{element} = {{}}"


def _rows_source(code: Code, signature: ArraySignature) -> str:
    width_in = sum(map(math.prod, signature.inputs))
    width_out = sum(map(math.prod, signature.outputs))
    elements, stores = signature.elements("in", "start + r, "), signature.stores("start + r, ")
    load = (f"x[{row} * {LANES} + r] = {element}" for row, element in enumerate(elements))
    store = (statement.format(f"y[{row} * {LANES} + r]") for row, statement in enumerate(stores))
    return _ROWS.format(
        signature=signature.types(rows=True),
        arguments=", ".join(signature.names),
        misfit=" or ".join(signature.misfits(before=1)),
        in_size=width_in * LANES,
        out_size=width_out * LANES,
        lanes=LANES,
        load=_moves(load, signature.inputs),
        body=textwrap.indent(_lane_lines(code, width_in, width_out), " " * 12),
        store=_moves(store, signature.outputs),
    )


def _moves(lines: Iterator[str], shapes: Sequence[Shape]) -> str:
    """Write the loops that carry rows in or out of a block, one per array."""
    text: list[str] = []
    for shape in shapes:
        text.append("        for r in range(m):")
        text += ["            " + line for line in islice(lines, math.prod(shape))]
    return "\n".join(text)


def _single_source(code: Code, signature: ArraySignature) -> str:
    body = code.lines(list(signature.elements("in")), list(signature.stores()))
    return _SINGLE.format(
        signature=signature.types(rows=False),
        arguments=", ".join(signature.names),
        misfit=" or ".join(signature.misfits()),
        body=textwrap.indent(body, " " * 4),
    )
