"""From the operations of a graph to text for other compilers: C99 and a C++ template.

The text is straight-line code for one configuration, and computes what the kernel of this processor computes: the same
operations in the same order, so the same bits in double, wherever multiply-adds are one instruction there and here.

What it holds of the user's are numbers, and names as identifiers only.
"""

import hashlib
import math
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from armwright.errors import InvalidValueError
from armwright.tracing.emit_llvm import MEANINGLESS, UNUSUAL
from armwright.tracing.graph import Graph, Loop, reachable, traced
from armwright.tracing.machine import TRUTHS, MachineCode, machine_code, scheduled
from armwright.version import __version__

Real: TypeAlias = Literal["double", "float"]

# What float may hold, so that products of a few such numbers stay in its range: squares of inputs may be no larger.
_LIMIT_OF_FLOAT = 1e30
_LINE = 116


class Argument(NamedTuple):
    """An array of a function: how many numbers it holds, and whether they are truth values, of one byte each."""

    name: str
    width: int
    flag: bool = False


class Function(NamedTuple):
    """What becomes a function.

    Attributes:
        name: an identifier, as those of the arguments are.
        code: its operations in double.
        any_type: gives its operations for any type of numbers.
        inputs: what it reads, in the order of the inputs of the code.
        outputs: what it writes.
        operations: how many of each kind it takes.
        description: what it computes, and what its arguments are: lines of text that come from nobody but us.
    """

    name: str
    code: MachineCode
    any_type: Callable[[], MachineCode]
    inputs: Sequence[Argument]
    outputs: Sequence[Argument]
    operations: Mapping[str, int]
    description: Sequence[str] = ()


class Dialect(NamedTuple):
    """How a language writes operations.

    Attributes:
        real: the type of numbers.
        truth: that of truth values.
        literal: writes a constant.
        table: the type of tables of constants.
        of_table: writes a constant in one.
        limit: writes a limit.
        calls: operations that are calls of a function.
    """

    real: str
    truth: str
    literal: Callable[[float], str]
    limit: Callable[[float], str]
    table: str
    of_table: Callable[[float], str]
    calls: Mapping[str, str]


_OPERATORS = {
    "add": "{0} + {1}",
    "subtract": "{0} - {1}",
    "multiply": "{0} * {1}",
    "divide": "{0} / {1}",
    "negate": "-{0}",
    "less": "{0} < {1}",
    "less_equal": "{0} <= {1}",
    "select": "{0} ? {1} : {2}",
    "both": "{0} && {1}",
    "either": "{0} || {1}",
    "differ": "{0} != {1}",
    "not": "!{0}",
}


def c_header(functions: Sequence[Function], real: Real = "double") -> str:
    """Return a C99 header of functions, which is also one of C++.

    Args:
        functions: what becomes a function, their names unlike.
        real: the type of their numbers.

    Raises:
        InvalidValueError: a constant is beyond the range of float.
    """
    dialect = _FLOAT if real == "float" else DOUBLE
    bodies = [_function(each, _code(each, real), dialect, "ARMWRIGHT_FUNCTION int") for each in functions]
    helpers = _of_gcc("ARMWRIGHT_FUNCTION", "static inline", "static", "unused, ") + _C_HELPERS[real]
    # clang warns of a function that nothing calls, where the text is no header but the program itself.
    if any("armwright_bit(" in body for body in bodies):
        helpers += _C_BIT
    return guarded(contract(_C_RULES + (_C_LIBRARY if real == "float" else ""), real), helpers, bodies)


def cpp_header(functions: Sequence[Function]) -> str:
    """Return a header of C++11: templates on the type of numbers, in the namespace ``armwright``.

    Args:
        functions: what becomes a function, their names unlike.
    """
    codes = [each.any_type() for each in functions]
    graphs = [graph for code in codes for graph in _graphs(code)]
    rare = [op for op in _RARE if any(node.op == op for graph in graphs for node in graph.nodes)]
    helpers = _cpp_helpers(rare)
    # Headers of several versions may meet in one program: each finds the helpers that it was written with.
    space = f"detail_{_digest(helpers)[:8]}"
    bodies = [
        _function(each, code, _cpp(space), "template <class Real>\nARMWRIGHT_TEMPLATE int")
        for each, code in zip(functions, codes, strict=True)
    ]
    guard = f"ARMWRIGHT_{space.upper()}"
    start = f"#ifndef {guard}\n#define {guard}\nnamespace armwright {{\nnamespace {space} {{\n"
    includes = "#include <cmath>\n#include <cstdint>\n#include <cstring>\n#include <limits>\n\n"
    helpers = f"{_of_gcc('ARMWRIGHT_TEMPLATE', 'inline')}{includes}{start}{helpers}}}\n}}\n#endif\n"
    return guarded(contract(_CPP_RULES, "Real"), helpers, ["namespace armwright {\n", *bodies, "}\n"])


def _code(function: Function, real: Real) -> MachineCode:
    return function.code if real == "double" else function.any_type()


# ---- a function ----


def _function(function: Function, code: MachineCode, dialect: Dialect, kind: str) -> str:
    parameters = [f"const {dialect.real} {x.name}[{x.width}]" for x in function.inputs]
    parameters += [f"{'unsigned char' if x.flag else dialect.real} {x.name}[{x.width}]" for x in function.outputs]
    above, _, kind = kind.rpartition("\n")
    head = textwrap.wrap(f"{kind} {function.name}({', '.join(parameters)})", _LINE, subsequent_indent="    ")
    body = (f"    {line}" for line in _statements(function, code, dialect))
    comment = comment_of(function, code) if function.description else ""
    return comment + "\n".join([*above.splitlines(), *head, "{", *body, "}", ""])


def _statements(function: Function, code: MachineCode, dialect: Dialect) -> list[str]:
    places = [f"{x.name}[{i}]" for x in function.inputs for i in range(x.width)]
    # What makes a configuration valid comes first: at the end it would keep all inputs in registers until then.
    first = reachable(code.graph, [x for x in (code.invalid, code.unusual) if x is not None])
    order = [*first, *sorted(set(code.order).difference(first))]
    results: dict[int, list[tuple[Argument, int]]] = {}
    for place, result in zip([(x, i) for x in function.outputs for i in range(x.width)], code.outputs, strict=True):
        results.setdefault(result, []).append(place)

    def written(node: int, name: str) -> list[str]:
        """Write the outputs that a node is."""
        return [f"{x.name}[{i}] = {name}{' ? 1 : 0' * x.flag};" for x, i in results.pop(node, [])]

    if not code.graph.loops:
        order = scheduled(code.graph, order)
        names, lines = Writer(dialect).operations(code.graph, order, places.__getitem__, "v", behind=written)
    else:
        names, lines = Writer(dialect).operations(code.graph, order, places.__getitem__, "v")
    read = {
        places[int(code.graph.nodes[i].value)].partition("[")[0] for i in order if code.graph.nodes[i].op == "input"
    }
    # Inputs on which nothing depends.
    lines[:0] = [f"(void){x.name};" for x in function.inputs if x.name not in read]
    for result in list(results):
        lines += written(result, names[result])
    status = status_of(code, names)
    if dialect is _FLOAT:
        lines += ["int finite = 1;"]
        for x in (x for x in function.outputs if not x.flag):
            lines += [
                f"for (int i = 0; i < {x.width}; i++) {{",
                f"    finite &= {x.name}[i] - {x.name}[i] == 0.0f;",
                "}",
            ]
        status = f"!finite ? {MEANINGLESS} : {status}"
    return [*lines, f"return {status};"]


def status_of(code: MachineCode, names: Mapping[int, str]) -> str:
    """Return the expression of the status of a configuration, by the names of the values."""
    status = "0"
    for condition, bit in ((code.unusual, UNUSUAL), (code.invalid, MEANINGLESS)):
        if condition is not None:
            status = f"{names[condition]} ? {bit} : {status}"
    return status


class Writer:
    """Writes the operations of graphs; the loops of a function are numbered."""

    def __init__(self, dialect: Dialect) -> None:
        self._dialect, self._loops = dialect, 0

    def operations(
        self,
        graph: Graph,
        order: Sequence[int],
        read: Callable[[int], str],
        prefix: str,
        *,
        known: Mapping[int, str] | None = None,
        behind: Callable[[int, str], Sequence[str]] = lambda _node, _name: (),
    ) -> tuple[dict[int, str], list[str]]:
        """Write operations.

        Args:
            graph: of the processor.
            order: its nodes in use.
            read: returns where an input is read, by its number.
            prefix: of the names of the results.
            known: names of results that are written already.
            behind: gives the statements behind that of an operation, by its node and the name of its result.

        Returns:
            The names of the results by node, those known with them, and the statements.
        """
        dialect, lines = self._dialect, list[str]()
        names: dict[int, str] = dict(known or {})
        for i in order:
            op, operands, value = graph.nodes[i]
            if op in ("constant", "limit"):
                names[i] = (dialect.literal if op == "constant" else dialect.limit)(value)
            elif op == "loop":
                names[i], of_loop = self._loop(graph.loops[int(value)], [names[j] for j in operands])
                lines += of_loop
            elif op in ("state", "each"):
                links = len(graph.loops[int(graph.nodes[operands[0]].value)].kinds)
                result, link = divmod(int(value), links)
                place = f"_s[{int(value)}]" if op == "state" else f"_r{result}[{link}]"
                names[i] = names[operands[0]] + place
            else:
                if op == "input":
                    expression = read(int(value))
                elif op == "bit":
                    expression = dialect.calls["bit"].format(names[operands[0]], int(graph.nodes[operands[1]].value))
                else:
                    expression = {**_OPERATORS, **dialect.calls}[op].format(*(names[j] for j in operands))
                names[i] = f"{prefix}{i}"
                lines.append(f"const {dialect.truth if op in TRUTHS else dialect.real} {names[i]} = {expression};")
                if op != "input":
                    lines += behind(i, names[i])
        return names, lines

    def _loop(self, loop: Loop, operands: Sequence[str]) -> tuple[str, list[str]]:
        """Write a loop over links; return its name, of which its arrays are called, and its statements.

        The state is left in ``NAME_s``, the results of the links in ``NAME_r0`` and so on.
        """
        name = f"loop{self._loops}"
        self._loops += 1
        real, table, n = self._dialect.real, self._dialect.table, len(loop.kinds)
        state, values = operands[: loop.carried], operands[loop.carried :]
        columns = [values[k : k + n] for k in range(0, len(values), n)]
        # Results of a loop before this one lie in an array already.
        arrays = [_as_array(column) or f"{name}_x{k}" for k, column in enumerate(columns)]
        width = max(1, *map(len, loop.constants))
        used: set[str] = set()

        def read(k: int) -> str:
            if k < loop.carried:
                return f"{name}_s[{k}]"
            k -= loop.carried
            if k < len(columns):
                used.add(arrays[k])
                return f"{arrays[k]}[i]"
            constant = f"{name}_c[i * {width} + {k - len(columns)}]"
            return constant if table == real else f"{real}({constant})"

        bodies = [self._step(loop, name, kind, read) for kind in range(len(loop.steps))]
        lines = _array(f"{real} {name}_s[{loop.carried}]", state) if state else []
        for array, column in zip(arrays, columns, strict=True):
            if array in used and not _as_array(column):
                lines += _array(f"const {real} {array}[{n}]", column)
        if any(loop.constants):
            rows = [x for row in loop.constants for x in (*row, *[0.0] * (width - len(row)))]
            lines += _array(f"static const {table} {name}_c[{n * width}]", map(self._dialect.of_table, rows))
        if len(bodies) > 1:
            lines += _array(f"static const unsigned char {name}_kind[{n}]", map(str, loop.kinds))
            bodies = [
                [f"if ({name}_kind[i] == {kind}) {{", *(f"    {line}" for line in body), "}"]
                for kind, body in enumerate(bodies)
            ]
        lines += [f"{real} {name}_r{k}[{n}];" for k in range(len(loop.steps[0].results) - loop.carried)]
        lines += [f"for ({f'int i = {n}; i-- > 0;' if loop.reverse else f'int i = 0; i < {n}; i++'}) {{"]
        return name, [*lines, *(f"    {line}" for body in bodies for line in body), "}"]

    def _step(self, loop: Loop, name: str, kind: int, read: Callable[[int], str]) -> list[str]:
        """Write what a loop does for a kind of link."""
        graph, results = loop.steps[kind]
        found, lines = self.operations(graph, reachable(graph, results), read, f"{name}_{kind}_")
        for k, result in enumerate(results):
            place = f"_s[{k}]" if k < loop.carried else f"_r{k - loop.carried}[i]"
            lines.append(f"{name}{place} = {found[result]};")
        return lines


def _as_array(elements: Sequence[str]) -> str | None:
    """Return the array whose elements these are, all of them in order; None if there is none."""
    array = elements[0].partition("[")[0]
    return array if list(elements) == [f"{array}[{i}]" for i in range(len(elements))] else None


def _array(declaration: str, elements: Iterable[str]) -> list[str]:
    """Return the definition of an array."""
    return textwrap.wrap(f"{declaration} = {{{', '.join(elements)}}};", _LINE - 4, subsequent_indent="    ")


def comment_of(function: Function, code: MachineCode) -> str:
    """Return the comment above a function: what it computes, of how many operations."""
    total = sum(function.operations.values())
    counts = ", ".join(f"{number} {op}" for op, number in function.operations.items())
    numbers, truths = _stack(code.graph, code.order)
    text = (
        f"{total} operations ({counts}); {code.joined} additions are joined with a multiplication. On the stack are at "
        f"most {numbers} numbers and {truths} truth values; far fewer where the compiler optimises."
    )
    return _block([*function.description, *textwrap.wrap(text, _LINE - 4)])


def _stack(graph: Graph, order: Sequence[int]) -> tuple[int, int]:
    """Return how many numbers and truth values the operations of a graph leave, those of its loops with them."""
    ops = [graph.nodes[i].op for i in order]
    truths = sum(op in TRUTHS for op in ops)
    numbers = sum(op not in {"constant", "limit", "loop", "state", "each"} for op in ops) - truths
    for i in order:
        op, operands, value = graph.nodes[i]
        if op == "loop":
            loop = graph.loops[int(value)]
            numbers += len(operands) + len(loop.kinds) * (len(loop.steps[0].results) - loop.carried)
            for step in loop.steps:
                more = _stack(step.graph, reachable(step.graph, step.results))
                numbers, truths = numbers + more[0], truths + more[1]
    return numbers, truths


# ---- the text around it ----

_CONTRACT = """\
Each function computes one configuration and returns a status:
{status}
Units are SI, angles in radians. A matrix stands row by row, and what a function takes many of one after the other.
Nothing is allocated, no state is kept, and any thread may call at any time."""
_STATUS = {
    0: "all is well.",
    MEANINGLESS: "the outputs mean nothing: an input is not finite or too large ({largest}), or the equation has no "
    "answer, as where a joint moves nothing that resists an acceleration.",
    UNUSUAL: "the outputs are right, but a joint is far beyond its limits: is its position in degrees?",
}
_LARGEST = {
    "double": "an angle beyond 1e12, anything else beyond 1e100",
    "float": "an angle beyond 1e12, anything else beyond 1e15, or an output beyond the range of float",
    "Real": "an angle beyond 1e12, anything else beyond 1e100; in float beyond 1e15, where outputs may still be "
    "infinite",
}
_C_RULES = """\
All inputs are read before an output is written, so an array may be both.
A multiplication and an addition are one instruction, rounded once, where the processor has one (ARMWRIGHT_FMA).
Results have the same bits whatever the compiler, if it joins no others on its own: -ffp-contract=off, which
-std=c99 implies for gcc, and no -ffast-math. Functions are not inlined by gcc, which would join some all the same.
"""
# What is different in float.
_C_LIBRARY = """\
Sines, cosines and arc tangents are those of the C library, and so are their last bits."""
_CPP_RULES = """\
All inputs are read before an output is written, so an array may be both.
A multiplication and an addition are one instruction, rounded once, where the processor has one. Results in double
have the same bits whatever the compiler, if it joins no others on its own: -ffp-contract=off, and no -ffast-math.
Sines, cosines and arc tangents of double are written out here; those of another type are found as sin(x) and so on,
in the namespace of the type or in std."""


def contract(rules: str, real: str) -> list[str]:
    """Return the comment above a text: what its functions return, and the rules of its language."""
    status = [
        line
        for value, meaning in _STATUS.items()
        for line in textwrap.wrap(
            meaning.format(largest=_LARGEST[real]), _LINE, initial_indent=f"  {value}  ", subsequent_indent="     "
        )
    ]
    return [*_CONTRACT.format(status="\n".join(status)).splitlines(), *rules.splitlines()]


def _block(lines: Sequence[str]) -> str:
    return "\n".join(["/*", *(f" * {line}".rstrip() for line in lines), " */", ""])


def guarded(rules: Sequence[str], helpers: str, bodies: Sequence[str]) -> str:
    """Return a text that may be included twice, below its hash and a comment."""
    text = "\n".join([helpers, *bodies])
    digest = _digest(text)
    guard = f"ARMWRIGHT_{digest[:16].upper()}_H"
    first = f"Written by armwright {__version__}. SHA-256 of the code: {digest}"
    return f"{_block([first, '', *rules])}#ifndef {guard}\n#define {guard}\n\n{text}\n#endif\n"


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


# ---- numbers ----


def _double(value: float) -> str:
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "HUGE_VAL" if value > 0 else "(-HUGE_VAL)"
    return _in_brackets(repr(value))


def _float(value: float) -> str:
    if not math.isfinite(value):
        return f"(float){_double(value)}"
    if abs(value) > float(np.finfo(np.float32).max):
        raise InvalidValueError(f"real: expected double, as the number {value!r} is beyond the range of float")
    return _in_brackets(f"{np.float32(value)!s}f")


def _in_brackets(literal: str) -> str:
    return f"({literal})" if literal.startswith("-") else literal


def _real(value: float) -> str:
    if not math.isfinite(value):
        return "std::numeric_limits<Real>::" + ("quiet_NaN()" if math.isnan(value) else "infinity()")
    return f"Real({value!r})"


# ---- languages ----

# Functions that few equations have.
_RARE = ("exp", "cbrt")

OF_MATH = {"absolute": "fabs({0})", "sqrt": "sqrt({0})", "number": "(double){0}"}
DOUBLE = Dialect(
    "double",
    "int",
    _double,
    _double,
    "double",
    _double,
    {**OF_MATH, "fma": "ARMWRIGHT_FMA({0}, {1}, {2})", "bit": "armwright_bit({0}, {1})"},
)
_FLOAT = Dialect(
    "float",
    "int",
    _float,
    lambda value: _float(min(value, _LIMIT_OF_FLOAT)),
    "float",
    _float,
    {
        "absolute": "fabsf({0})",
        "sqrt": "sqrtf({0})",
        "number": "(float){0}",
        "fma": "ARMWRIGHT_FMAF({0}, {1}, {2})",
        "sin": "sinf({0})",
        "cos": "cosf({0})",
        "atan2": "atan2f({0}, {1})",
        "exp": "expf({0})",
        "cbrt": "cbrtf({0})",
        "round": "rintf({0})",
    },
)


def _cpp(space: str) -> Dialect:
    names = {"absolute": 1, "sqrt": 1, "fma": 3, "sin": 1, "cos": 1, "atan2": 2, "exp": 1, "cbrt": 1, "round": 1}
    operands = {op: ", ".join(f"{{{i}}}" for i in range(count)) for op, count in names.items()}
    calls = {op: f"{space}::{op}_of({operands[op]})" for op in names} | {"number": "Real({0} ? 1 : 0)"}
    limit = f"{space}::limit<Real>({{!r}})".format
    # Constants that the compiler knows: those of another type would be made when the function is first called.
    return Dialect("Real", "bool", _real, limit, "double", _double, calls)


def _has_fma(letter: str, of_arm: int) -> str:
    """Return when a processor multiplies and adds in one instruction; not every compiler defines what C99 asks for."""
    of_processor = f"defined __ARM_FEATURE_FMA && defined __ARM_FP && (__ARM_FP & {of_arm})"
    return f"#if defined FP_FAST_FMA{letter} || defined __FMA__ || ({of_processor})"


def _of_gcc(name: str, kind: str, kind_of_gcc: str = "", attributes: str = "") -> str:
    """Return the definition of what stands before a function.

    gcc joins the multiplications and additions of neighbours when it makes vectors of them, -ffp-contract=off or not:
    for a function of its own that can be forbidden.
    """
    forbidden = f'__attribute__(({attributes}noinline, optimize("no-tree-slp-vectorize")))'
    return f"""\
#ifndef {name}
#if defined __GNUC__ && !defined __clang__
#define {name} {f"{kind_of_gcc} {forbidden}".strip()}
#else
#define {name} {kind}
#endif
#endif

"""


BIT = """\
{kind} {name}(double x, int place)
{{
    {whole} bits;
    {memcpy}(&bits, &x, sizeof bits);
    return (bits >> place & 1) != 0 ? 1 : 0;
}}
"""
_C_HELPERS = {
    "double": f"""\
#include <math.h>
#include <stdint.h>
#include <string.h>

#ifndef ARMWRIGHT_FMA
{_has_fma("", 8)}
#ifdef __GNUC__
#define ARMWRIGHT_FMA(a, b, c) __builtin_fma(a, b, c)
#else
#define ARMWRIGHT_FMA(a, b, c) fma(a, b, c)
#endif
#else
#define ARMWRIGHT_FMA(a, b, c) ((a) * (b) + (c))
#endif
#endif
""",
    "float": f"""\
#include <math.h>

#ifndef ARMWRIGHT_FMAF
{_has_fma("F", 4)}
#ifdef __GNUC__
#define ARMWRIGHT_FMAF(a, b, c) __builtin_fmaf(a, b, c)
#else
#define ARMWRIGHT_FMAF(a, b, c) fmaf(a, b, c)
#endif
#else
#define ARMWRIGHT_FMAF(a, b, c) ((a) * (b) + (c))
#endif
#endif
""",
}
_C_BIT = f"""\

#ifndef ARMWRIGHT_BIT
#define ARMWRIGHT_BIT
{BIT.format(kind="static inline int", name="armwright_bit", whole="uint64_t", memcpy="memcpy")}#endif
"""
_CPP_GENERAL = """\
template <class Real>
inline Real {op}_of(const Real& x)
{{
    using std::{name};
    return {name}(x);
}}
"""


def _graphs(code: MachineCode) -> Iterator[Graph]:
    """Give the graph of operations, and those of the steps of its loops."""
    yield code.graph
    yield from (step.graph for loop in code.graph.loops for step in loop.steps)


def _cpp_helpers(rare: Iterable[str]) -> str:
    """Return the functions of numbers: for any type, and for double the same operations as on this processor.

    Args:
        rare: functions that are not for every header.
    """
    names = {"absolute": "abs", "sqrt": "sqrt", "sin": "sin", "cos": "cos", "round": "rint", **{op: op for op in rare}}
    text = "".join(_CPP_GENERAL.format(op=op, name=name) for op, name in names.items())
    text += (
        _CPP_GENERAL.replace("const Real& x", "const Real& y, const Real& x")
        .replace("(x)", "(y, x)")
        .format(op="atan2", name="atan2")
    )
    text += """\
template <class Real>
inline Real fma_of(const Real& a, const Real& b, const Real& c)
{
    return a * b + c;
}
"""
    for letter, real, of_arm in (("", "double", 8), ("F", "float", 4)):
        text += f"""\
{_has_fma(letter, of_arm)}
inline {real} fma_of({real} a, {real} b, {real} c)
{{
    return std::fma(a, b, c);
}}
#endif
"""
    text += f"""\
template <class Real>
inline Real limit(double value)
{{
    return Real(value);
}}
template <>
inline float limit<float>(double value)
{{
    return float(value < {_LIMIT_OF_FLOAT!r} ? value : {_LIMIT_OF_FLOAT!r});
}}
"""
    text += BIT.format(kind="inline int", name="bit_of", whole="std::uint64_t", memcpy="std::memcpy")
    dialect = DOUBLE._replace(
        truth="bool",
        calls={
            "absolute": "std::fabs({0})",
            "sqrt": "std::sqrt({0})",
            "number": "({0} ? 1.0 : 0.0)",
            "fma": "fma_of({0}, {1}, {2})",
            "bit": "bit_of({0}, {1}) != 0",
        },
    )
    return text + "".join(_written_out(op, dialect) for op in ("sin", "cos", "atan2", "round", *rare))


def _written_out(op: str, dialect: Dialect) -> str:
    """Return an elementary function of double."""
    graph = Graph()
    operands = graph.inputs(2 if op == "atan2" else 1)
    code = machine_code(graph, [traced(op, *operands).node])
    parameters = ["y", "x"][-len(operands) :]
    names = [f"double {name}" for name in parameters]
    (result,) = code.outputs
    function = Function("", code, lambda: code, [Argument(x, 1) for x in parameters], [], {})
    lines = [x.replace("[0]", "") for x in _statements(function, code._replace(outputs=[]), dialect)]
    body = "\n".join(f"    {line}" for line in [*lines[:-1], f"return v{result};"])
    return f"inline double {op}_of({', '.join(names)})\n{{\n{body}\n}}\n"
