"""From an equation to a kernel: it is traced once, and the code of the processor is written from the graph."""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cached_property, partial
from keyword import iskeyword
from typing import NamedTuple, TypeAlias

import attrs
import numpy as np

from armwright.errors import InvalidValueError, ShapeError, shown
from armwright.tracing.emit_llvm import Column, Target, lanes_ir, rows_ir, single_ir
from armwright.tracing.graph import Graph, TooManyNodesError, Traced, nodes_of_angles, operation_count
from armwright.tracing.machine import MachineCode, Watched, machine_code
from armwright.tracing.scalar import Scalar

Shape: TypeAlias = tuple[int, ...]


# What the function of every kernel takes by name.
_OPTIONS = ("threads", "out")


class Guarded(NamedTuple):
    """What an equation returns whose values mean something only under conditions.

    Attributes:
        values: one list of scalars per output.
        positive: scalars that must be above 0.
    """

    values: Sequence[Sequence[Scalar]]
    positive: Sequence[Scalar]


Equation: TypeAlias = Callable[..., Sequence[Sequence[Scalar]] | Guarded]


class Translation(NamedTuple):
    """What tracing an equation yields: see ``Emitted``."""

    code: MachineCode
    any_type: Callable[[], MachineCode]
    angles: frozenset[str]
    operations: dict[str, int]


@attrs.frozen(kw_only=True, eq=False, slots=False)
class Emitted:
    """The code of a kernel and what it takes.

    Its functions fill the output arrays and return a status, 0 where all is well. ``MEANINGLESS`` is set in it where
    some configuration came out without meaning: an input is not finite or too large (``LARGEST_ANGLE`` where its sine
    is taken, ``LARGEST`` elsewhere), or a condition of the equation is broken. ``UNUSUAL`` is set where an input is
    outside of the bounds that were given to ``emit``; the outputs are right all the same.

    Attributes:
        title: what it computes, in words.
        inputs: shape of one value of each input, by its name.
        outputs: shape of one value of each output.
        flags: numbers of the outputs that are truth values.
        origin: what the code follows from; empty where that cannot be said. See ``native.function_address``.
        trace: traces the equation, which is done when something of it is first needed.
    """

    title: str
    inputs: dict[str, Shape]
    outputs: tuple[Shape, ...]
    flags: tuple[int, ...]
    origin: str = ""
    trace: Callable[[], Translation]

    @cached_property
    def _translation(self) -> Translation:
        return self.trace()

    @property
    def code(self) -> MachineCode:
        """The operations of the processor."""
        return self._translation.code

    @property
    def any_type(self) -> Callable[[], MachineCode]:
        """What gives the operations for any type of numbers: see ``machine``."""
        return self._translation.any_type

    @property
    def angles(self) -> frozenset[str]:
        """The names of inputs that hold a number whose sine is taken."""
        return self._translation.angles

    @property
    def operations(self) -> dict[str, int]:
        """How many operations of each kind the equation takes, per configuration."""
        return self._translation.operations

    @property
    def joined(self) -> int:
        """How many additions take in a multiplication."""
        return self.code.joined

    def single_ir(self, target: Target) -> str:
        """Return the LLVM IR of ``single(arrays)``: see ``emit_llvm.single_ir``."""
        return single_ir(self.code, *self._columns(), target)

    def rows_ir(self, target: Target) -> str:
        """Return the LLVM IR of ``rows(first, last, arrays)``, in vectors: see ``emit_llvm.rows_ir``."""
        return rows_ir(self.code, *self._columns(), target)

    def _columns(self) -> tuple[list[Column], list[Column]]:
        inputs = [Column(math.prod(shape)) for shape in self.inputs.values()]
        return inputs, [Column(math.prod(shape), i in self.flags) for i, shape in enumerate(self.outputs)]


def emit(
    title: str,
    equation: Equation,
    inputs: Mapping[str, int | Shape],
    *,
    shapes: Sequence[Shape] | None = None,
    flags: Collection[int] = (),
    bounds: Mapping[str, Sequence[float]] | None = None,
    max_straight: int | None = None,
    origin: str = "",
) -> Emitted:
    """Trace an equation, and give the code of its kernel.

    Args:
        title: what it computes, in words; it stands beside the code, not in it.
        equation: takes one list of scalars per input, returns one list per output, or ``Guarded`` ones.
        inputs: of each input, by its name, the width or the shape of one value; a matrix comes to the equation row
            by row.
        shapes: shape of one value of each output; vectors when left out.
        flags: numbers of the outputs that are truth values.
        bounds: by the name of an input, how far from 0 each of its numbers usually is; farther numbers are reported.
        max_straight: the number of nodes of the graph beyond which scans are loops of the code, and not written out;
            None if they never are.
        origin: what the equation and all other arguments follow from, for equations of armwright itself: it is traced
            only where no process has compiled the same before. Empty for other equations.

    Raises:
        InvalidValueError: there is no input, or the name of one is no identifier, as which a caller may write it, or
            that of an option of every kernel.
        ShapeError: ``shapes`` do not fit what the equation returns.
    """
    if not inputs:
        raise InvalidValueError("inputs: expected at least one")
    for name in inputs:
        if name in _OPTIONS or not (name.isascii() and name.isidentifier()) or iskeyword(name):
            raise InvalidValueError(f"inputs: expected names such as 'qd', got {shown(name)}")
    input_shapes = {name: (shape,) if isinstance(shape, int) else shape for name, shape in inputs.items()}
    known = None if shapes is None else tuple(shapes)
    translate = partial(
        _translated,
        equation,
        input_shapes,
        outputs=known,
        flags=tuple(flags),
        bounds=bounds or {},
        max_straight=max_straight,
    )
    if not origin:
        translation, outputs = translate()
        return Emitted(title=title, inputs=input_shapes, outputs=outputs, flags=tuple(flags), trace=lambda: translation)
    return Emitted(
        title=title,
        inputs=input_shapes,
        outputs=_vectors(equation, input_shapes) if known is None else known,
        flags=tuple(flags),
        origin=origin,
        trace=lambda: translate()[0],
    )


def _vectors(equation: Equation, shapes: Mapping[str, Shape]) -> tuple[Shape, ...]:
    """Return the shapes of what an equation returns, by running it on arrays."""
    with np.errstate(all="ignore"):
        result = equation(*([np.ones(1)] * math.prod(shape) for shape in shapes.values()))
    return tuple((len(row),) for row in (result.values if isinstance(result, Guarded) else result))


def _translated(
    equation: Equation,
    shapes: Mapping[str, Shape],
    *,
    outputs: tuple[Shape, ...] | None,
    flags: tuple[int, ...],
    bounds: Mapping[str, Sequence[float]],
    max_straight: int | None,
) -> tuple[Translation, tuple[Shape, ...]]:
    """Trace an equation; return the translation, and the shapes of the outputs."""
    try:
        graph, scalars, (rows, positive) = _traced(Graph(max_nodes=max_straight), equation, shapes)
    except TooManyNodesError:
        graph, scalars, (rows, positive) = _traced(Graph(rolls=True), equation, shapes)
    widths = [len(row) for row in rows]
    outputs = tuple((width,) for width in widths) if outputs is None else outputs
    if [math.prod(shape) for shape in outputs] != widths:
        raise ShapeError(f"shapes: expected values of {shown(widths)} numbers, as the equation returns, got {outputs}")
    nodes_of_rows = [[graph.node(x) for x in row] for row in rows]
    flat = [node for row in nodes_of_rows for node in row]
    are_flags = [i in flags for i, row in enumerate(nodes_of_rows) for _ in row]
    of_angles = nodes_of_angles(graph)
    nodes = [x.node for row in scalars.values() for x in row]
    watched = Watched(
        angles=[node for node in nodes if node in of_angles],
        others=[node for node in nodes if node not in of_angles],
        positive=[graph.node(x) for x in positive],
        bounds={
            x.node: float(bound)
            for name, numbers in bounds.items()
            for x, bound in zip(scalars.get(name, ()), numbers, strict=False)
            if math.isfinite(bound)
        },
    )
    translate = partial(machine_code, graph, flat, watched, [i for i, flag in enumerate(are_flags) if flag])
    translation = Translation(
        code=translate(),
        any_type=partial(translate, any_type=True),
        angles=frozenset(name for name, row in scalars.items() if of_angles.intersection(x.node for x in row)),
        operations=operation_count(graph, flat),
    )
    return translation, outputs


def _traced(
    graph: Graph, equation: Equation, shapes: Mapping[str, Shape]
) -> tuple[Graph, dict[str, list[Traced]], Guarded]:
    """Run an equation on the inputs of a graph; return the graph, the inputs and the result."""
    scalars = {name: graph.inputs(math.prod(shape)) for name, shape in shapes.items()}
    result = equation(*scalars.values())
    return graph, scalars, result if isinstance(result, Guarded) else Guarded(result, ())


@attrs.frozen(kw_only=True)
class LaneKernel:
    """An equation for loops of the caller's that keep many configurations side by side.

    Attributes:
        ir: LLVM IR of ``lanes(x, y)``, for arrays in which the numbers of one kind of all configurations are together.
        outputs: how many numbers come out.
    """

    ir: str
    outputs: int


def emit_lanes(
    equation: Callable[[list[Scalar]], Sequence[Scalar]], inputs: int, count: int, target: Target
) -> LaneKernel:
    """Trace an equation for a loop of the caller's.

    Args:
        equation: takes a list of scalars, returns another.
        inputs: how many scalars it takes.
        count: how many configurations are side by side, a multiple of the lanes.
        target: what it is written for.
    """
    graph = Graph()
    outputs = [graph.node(x) for x in equation(list(graph.inputs(inputs)))]
    code = machine_code(graph, outputs)
    return LaneKernel(ir=lanes_ir(code, inputs, count, target), outputs=len(outputs))
