"""From the operations of a graph to kernels of CUDA, of which every thread does one row.

Rows lie one after the other in memory, and neighbouring threads that each read their own row would fetch most of it in
vain. A block therefore copies its rows to shared memory, neighbouring threads neighbouring numbers, and each thread
reads its row there; results go back the same way, in pieces where they are many. Rows are of odd length there, so
that the threads of a warp read from different banks.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from armwright.tracing.emit_c import (
    BIT,
    DOUBLE,
    OF_MATH,
    Argument,
    Function,
    Writer,
    comment_of,
    contract,
    guarded,
    status_of,
)
from armwright.tracing.graph import reachable

# Threads of a block, each of which does one row.
BLOCK = 128
# Numbers of a row that shared memory holds: 40 KB for a block, so that four blocks run on a multiprocessor.
_TILE = 40

_RULES = f"""\
Each kernel computes rows of arrays in C order, one row per thread, in blocks of exactly {BLOCK} threads and a grid of
ceil(rows / {BLOCK}) blocks. No output shares memory with another array. status has one number per row, and all is one
number in which the statuses of all rows are joined by "or"; either may be null.
Results have the same bits as on the processor, if the compiler joins no multiplications and additions on its own:
--fmad=false, and no --use_fast_math."""
_ON_DEVICE = "static __device__ __forceinline__"
_HELPERS = f"""\
#ifndef ARMWRIGHT_CUDA
#define ARMWRIGHT_CUDA
#ifndef HUGE_VAL
#define HUGE_VAL __longlong_as_double(0x7ff0000000000000LL)
#endif
#ifndef NAN
#define NAN __longlong_as_double(0x7ff8000000000000LL)
#endif
{BIT.format(kind=f"{_ON_DEVICE} int", name="armwright_bit", whole="unsigned long long", memcpy="memcpy")}
/* Copies rows of a block to shared memory. Threads without a row find zeros. */
template <int width>
{_ON_DEVICE} void armwright_load(const double *from, double *tile, int rows)
{{
    for (int i = threadIdx.x; i < {BLOCK} * width; i += {BLOCK}) {{
        tile[i / width * (width | 1) + i % width] = i < rows * width ? from[i] : 0.0;
    }}
}}

/* Copies a piece of the rows of a block from shared memory. */
template <int width, int piece, class Number>
{_ON_DEVICE} void armwright_store(const double *tile, Number *to, int rows)
{{
    for (int i = threadIdx.x; i < rows * piece; i += {BLOCK}) {{
        to[i / piece * width + i % piece] = (Number)tile[i / piece * (piece | 1) + i % piece];
    }}
}}
#endif
"""
_DIALECT = DOUBLE._replace(calls={**OF_MATH, "fma": "fma({0}, {1}, {2})", "bit": "armwright_bit({0}, {1})"})


class _Piece(NamedTuple):
    """Some numbers of an output: those from ``first`` on."""

    output: Argument
    first: int
    length: int


def cuda_source(functions: Sequence[Function]) -> str:
    """Return a source of CUDA: a kernel for each function, of which every thread does one row.

    Args:
        functions: what becomes a kernel, their names unlike.
    """
    return guarded(contract(_RULES, "double"), _HELPERS, [_kernel(each) for each in functions])


def _kernel(function: Function) -> str:
    parameters = [f"const double *{x.name}" for x in function.inputs]
    parameters += [f"{_number(x)} *{x.name}" for x in function.outputs]
    head = f"{function.name}({', '.join(parameters)}, int *status, int *all, long long rows)"
    body = "\n".join(f"    {line}" for line in _body(function))
    bounds = f"__launch_bounds__({BLOCK})"
    return f'{comment_of(function, function.code)}extern "C" __global__ void {bounds}\n{head}\n{{\n{body}\n}}\n'


def _number(output: Argument) -> str:
    return "unsigned char" if output.flag else "double"


def _body(function: Function) -> Iterator[str]:
    """Write what a thread does."""
    code, widths = function.code, [_odd(x.width) for x in function.inputs]
    staged = sum(widths) + 5 <= _TILE
    # Inputs are read again for every piece: results lie beside them, but those of a single piece lie in their place.
    at_once = sum(x.width for x in function.outputs) < _TILE and len(function.outputs) == 1
    beside = sum(widths) if staged and not at_once else 0
    pieces = list(_pieces(function.outputs, _TILE - beside))
    size = max([sum(widths) if staged else 1, *(beside + _odd(piece.length) for piece in pieces)])
    yield f"__shared__ double tile[{BLOCK * size}];"
    yield f"const long long first = (long long)blockIdx.x * {BLOCK};"
    yield f"const int count = rows - first < {BLOCK} ? (int)(rows - first) : {BLOCK};"
    if not staged:
        yield "const long long row = first + ((int)threadIdx.x < count ? (int)threadIdx.x : 0);"
    places: list[str] = []
    for i, (x, width) in enumerate(zip(function.inputs, widths, strict=True)):
        if staged:
            tile = f"tile + {BLOCK * sum(widths[:i])}"
            yield f"armwright_load<{x.width}>({x.name} + first * {x.width}, {tile}, count);"
            places += [f"tile[{BLOCK * sum(widths[:i])} + threadIdx.x * {width} + {k}]" for k in range(x.width)]
        else:
            places += [f"{x.name}[row * {x.width} + {k}]" for k in range(x.width)]
    if staged:
        yield "__syncthreads();"
        yield "const volatile double *const again = tile;"
        # Zeros need no input: the efforts of an arm without masses.
        yield "(void)again;"
    writer, names = Writer(_DIALECT), dict[int, str]()
    results = iter(code.outputs)
    ends = [x for x in (code.invalid, code.unusual) if x is not None]
    for piece in [None, *pieces]:
        if piece is not None:
            ends = [next(results) for _ in range(piece.length)]
        # What makes a configuration valid comes first: at the end it would keep all inputs in registers until then.
        order = [i for i in reachable(code.graph, ends) if i not in names]
        names, lines = writer.operations(code.graph, order, places.__getitem__, "v", known=names)
        yield from lines
        if piece is None:
            yield f"const int of_row = {status_of(code, names)};"
            if staged:
                # From here on they are read from shared memory at each use, and take no registers until then.
                inputs = [i for i in names if code.graph.nodes[i].op == "input"]
                names |= {i: places[int(code.graph.nodes[i].value)].replace("tile", "again", 1) for i in inputs}
            yield "if ((int)threadIdx.x < count) {"
            yield "    if (status) {"
            yield "        status[first + threadIdx.x] = of_row;"
            yield "    }"
            yield "    if (all && of_row) {"
            yield "        atomicOr(all, of_row);"
            yield "    }"
            yield "}"
        else:
            yield from _stored(piece, BLOCK * beside, [names[i] for i in ends])


def _stored(piece: _Piece, start: int, values: Sequence[str]) -> Iterator[str]:
    """Write how a block stores a piece of its rows, which lie in shared memory from ``start`` on."""
    output, first, length = piece
    if not start:
        # They take the place of inputs: an input that is a result is read before the first of them is written.
        read = {value: f"again_{k}" for k, value in enumerate(values) if value.startswith("again[")}
        yield from (f"const double {name} = {value};" for value, name in read.items())
        values = [read.get(value, value) for value in values]
    yield "__syncthreads();"
    for k, value in enumerate(values):
        yield f"tile[{start} + threadIdx.x * {_odd(length)} + {k}] = {value};"
    yield "__syncthreads();"
    to = f"{output.name} + first * {output.width} + {first}"
    yield f"armwright_store<{output.width}, {length}>(tile + {start}, {to}, count);"


def _pieces(outputs: Sequence[Argument], room: int) -> Iterator[_Piece]:
    """Cut outputs into pieces that shared memory has room for, of whole sectors of memory where there are several."""
    for x in outputs:
        most = x.width if _odd(x.width) <= room else (room - 1) // 4 * 4
        for first in range(0, x.width, most):
            yield _Piece(x, first, min(most, x.width - first))


def _odd(width: int) -> int:
    return width | 1
