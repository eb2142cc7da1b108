"""The way from Python into a kernel: a built-in function that takes NumPy's arrays as they lie in memory.

Where all arrays are what a kernel takes (float64, in C order, of the right shape), a call checks that, makes the arrays
to fill and calls the kernel, without a line of Python. Everything else, and everything that went wrong, goes to a
function in Python, which converts, broadcasts, and says what is wrong.

The function is emitted like the kernels. It reads the fields of objects where CPython and NumPy keep them; whether they
do is found out before the first use (``layout_is_known``).
"""

import ctypes
import math
import sys
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from armwright.tracing.native import function_address

# Where the fields of objects are, behind what every object begins with [bytes].
_HEAD = object.__basicsize__
_TYPE = _HEAD - 8
_TUPLE_SIZE, _TUPLE_ITEMS = _HEAD, tuple.__basicsize__
_BYTES_DATA = bytes.__basicsize__ - 1
# Of an array: its numbers, how many axes, their lengths, the kind of its numbers, and what is so of it.
_DATA, _AXES, _LENGTHS, _KIND, _FLAGS = _HEAD, _HEAD + 8, _HEAD + 16, _HEAD + 40, _HEAD + 48
# In C order and aligned; and writable.
_READABLE, _WRITABLE = 0x101, 0x501
# Of a built-in function: an array of arguments, and names behind them.
_METH_FASTCALL, _METH_KEYWORDS = 0x80, 0x02
# From so many rows on other threads of Python may run meanwhile.
_ROWS_TO_LET_GO = 256
# After so many rows, milliseconds of work, a signal is heard; a multiple of the lanes. From as many on a call on one
# thread goes to the function in Python, which hears them.
ROWS_BETWEEN_SIGNALS = 65536

# What a function needs to know, by the places in its table; the arrays follow, inputs first.
_FIELDS = (
    "single", "rows", "careful", "empty", "array_type", "none", "one", "out", "threads", "few", "tuple_type",
    "PyObject_Vectorcall", "PyTuple_New", "PyTuple_SetItem", "PyLong_FromSsize_t", "Py_IncRef", "Py_DecRef",
    "PyEval_SaveThread", "PyEval_RestoreThread",
)  # fmt: skip
# The same for the function of a routine.
_OF_ROUTINE = (
    "careful", "array_type", "none", "kind", "PyObject_Vectorcall", "Py_IncRef", "PyMem_RawMalloc", "PyMem_RawFree"
)  # fmt: skip
_FUNCTIONS = tuple(dict.fromkeys(name for name in (*_FIELDS, *_OF_ROUTINE) if name.startswith("Py")))
_AXES_MAX = 4
# Of each array: how many axes a value has, their lengths, its size in bytes, the kind of its numbers, and its shape.
_OF_ARRAY = ("axes", *(f"length{i}" for i in range(_AXES_MAX)), "size", "kind", "shape")
_STRIDE = 8 * len(_OF_ARRAY)


class Passed(NamedTuple):
    """An array of a kernel: the shape of one value, and the type of its numbers."""

    shape: tuple[int, ...]
    kind: type


# A function and its arguments, which make an object in another process.
Origin: TypeAlias = tuple[Callable[..., object], tuple[object, ...]]


class _Table(bytes):
    """What a function needs to know, as it reads it; and, as attributes, what must live as long, and its origin.

    For Python it is the object of which the function is a method: a function is pickled as that object and its name.
    """

    keep: tuple[object, ...]
    origin: Origin | None

    def __reduce__(self) -> Origin:
        if self.origin is None:
            raise TypeError("the function of a kernel cannot be pickled: pickle what it was made of")
        return self.origin


class Door:
    """The functions of one kernel that are called from Python."""

    def __init__(self, inputs: Sequence[Passed], outputs: Sequence[Passed], few: int) -> None:
        """Prepare functions of arrays.

        Args:
            inputs: the arrays that they take, one value or rows of values.
            outputs: the arrays that they fill.
            few: from so many rows on several threads are worth while, and the careful function is called.
        """
        self._inputs, self._outputs, self._few = inputs, outputs, few
        self._kernels = {"single": 0, "rows": 0}
        self._tables: list[_Table] = []

    def connect(self, part: str, address: int) -> None:
        """Tell where a function of the kernel is, ``single`` or ``rows``; before, the careful function is called."""
        self._kernels[part] = address
        for table in self._tables:
            ctypes.c_uint64.from_address(_address_of(table) + 8 * _FIELDS.index(part)).value = address

    def open(
        self, name: str, doc: str, careful: Callable[..., Any], origin: Origin | None = None
    ) -> Callable[..., Any]:
        """Return a built-in function, or the careful one where the arrays are of a shape it does not know.

        Args:
            name: of the function.
            doc: its docstring, behind its signature in the form of built-in functions.
            careful: takes the same arguments in all other cases.
            origin: makes an object that has the function as its method, for another process; None where none does.
        """
        arrays = [*self._inputs, *self._outputs]
        if not layout_is_known() or any(len(one.shape) > _AXES_MAX for one in arrays):
            return careful
        known: dict[str, int] = {
            **self._kernels, "careful": id(careful), "empty": id(np.empty), "array_type": id(np.ndarray),
            "none": id(None), "one": id(1), "out": id(_OUT), "threads": id(_THREADS), "few": self._few,
            "tuple_type": id(tuple), **_api(),
        }  # fmt: skip
        words = [known[field] for field in _FIELDS]
        shapes, kinds = [one.shape for one in arrays], [np.dtype(one.kind) for one in arrays]
        for shape, kind in zip(shapes, kinds, strict=True):
            lengths = [*shape, *[0] * (_AXES_MAX - len(shape))]
            words += [len(shape), *lengths, math.prod(shape) * kind.itemsize, id(kind), id(shape)]
        numbers = len(self._inputs), len(self._outputs)
        address = function_address(lambda: _ir(*numbers), "call", f"{__name__} {numbers}", quickly=True)
        texts = name.encode(), doc.encode()
        table = _table(words, address, *map(_address_of, texts))
        table.keep = (careful, shapes, kinds, texts, np.empty, _OUT, _THREADS)
        table.origin = origin
        self._tables.append(table)
        for part, place in self._kernels.items():  # another thread may have compiled it meanwhile
            self.connect(part, place)
        return _built_in(table, 8 * len(words))


class RoutineDoor:
    """The function of a routine, see ``loops``: it takes all arrays of the routine, and returns nothing."""

    def __init__(self, axes: Sequence[int]) -> None:
        """Prepare a function of arrays that have so many axes each."""
        self._axes = tuple(axes)

    def ir(self) -> str:
        """Return the IR of ``call``, which stands beside that of ``routine(tables, lengths, allocate, free)``."""
        return _ir_of_routine(self._axes)

    def open(self, name: str, address: int, careful: Callable[..., None]) -> Callable[..., None]:
        """Return a built-in function.

        Args:
            name: of the function.
            address: of ``call``.
            careful: takes the same arrays where they are not in C order, not of numbers, or where memory is short.
        """
        known = {"careful": id(careful), "array_type": id(np.ndarray), "none": id(None),
                 "kind": id(np.dtype(np.float64)), **_api()}  # fmt: skip
        words = [known[field] for field in _OF_ROUTINE]
        text = name.encode()
        table = _table(words, address, _address_of(text), 0)
        table.keep, table.origin = (careful, text), None
        return _built_in(table, 8 * len(words))


def _table(words: Sequence[int], address: int, name: int, doc: int) -> _Table:
    """Return a table: what its function needs to know, and the definition of the function, by addresses.

    The object of the function owns the table, and the table has to keep all that it points to.
    """
    definition = [name, address, _METH_FASTCALL | _METH_KEYWORDS, doc]
    return _Table(np.array([*words, *definition], dtype=np.uint64).tobytes())


def _built_in(table: _Table, definition: int) -> Callable[..., Any]:
    new = ctypes.pythonapi.PyCFunction_NewEx
    new.restype, new.argtypes = ctypes.py_object, [ctypes.c_void_p, ctypes.py_object, ctypes.c_void_p]
    return new(_address_of(table) + definition, table, None)  # type: ignore[no-any-return]


_OUT, _THREADS = sys.intern("out"), sys.intern("threads")


def _address_of(text: bytes) -> int:
    return id(text) + _BYTES_DATA


@cache
def _api() -> dict[str, int]:
    return {name: ctypes.cast(getattr(ctypes.pythonapi, name), ctypes.c_void_p).value or 0 for name in _FUNCTIONS}


@cache
def layout_is_known() -> bool:
    """Whether objects lie in memory as the emitted function reads them."""
    if sys.implementation.name != "cpython" or ctypes.sizeof(ctypes.c_void_p) != 8:
        return False
    array, pair, text = np.zeros((3, 5)), (array_name := "out", 7), b"armwright"
    array.setflags(write=False)

    def word(thing: object, offset: int, kind: Any = ctypes.c_uint64) -> int:
        return int(kind.from_address(id(thing) + offset).value)

    lengths = word(array, _LENGTHS)
    found = (
        word(array, _TYPE), word(array, _DATA), word(array, _AXES, ctypes.c_int32),
        ctypes.c_int64.from_address(lengths).value, ctypes.c_int64.from_address(lengths + 8).value,
        word(array, _KIND), word(array, _FLAGS, ctypes.c_int32) & _WRITABLE,
        word(pair, _TUPLE_SIZE), word(pair, _TUPLE_ITEMS), ctypes.string_at(id(text) + _BYTES_DATA),
    )  # fmt: skip
    expected = (
        id(np.ndarray), array.ctypes.data, 2, 3, 5, id(np.dtype(np.float64)), _READABLE, 2, id(array_name), text
    )  # fmt: skip
    return found == expected


class _Text:
    """The IR of one function, whose table has the given fields."""

    def __init__(self, fields: Sequence[str]) -> None:
        self.lines: list[str] = []
        self._count = 0
        self._fields = fields

    def let(self, expression: str) -> str:
        self._count += 1
        self.lines.append(f"  %v{self._count} = {expression}")
        return f"%v{self._count}"

    def do(self, statement: str) -> None:
        self.lines.append(statement if statement.endswith(":") else f"  {statement}")

    def at(self, pointer: str, offset: int | str) -> str:
        return self.let(f"getelementptr i8, ptr {pointer}, i64 {offset}")

    def load(self, kind: str, pointer: str, offset: int | str = 0) -> str:
        return self.let(f"load {kind}, ptr {self.at(pointer, offset)}")

    def known(self, name: str, kind: str = "ptr") -> str:
        return self.load(kind, "%table", 8 * self._fields.index(name))

    def of(self, array: int, name: str, kind: str = "i64") -> str:
        return self.load(kind, "%table", 8 * len(_FIELDS) + _STRIDE * array + 8 * _OF_ARRAY.index(name))

    def equal(self, a: str, b: str | int, kind: str = "ptr") -> str:
        return self.let(f"icmp eq {kind} {a}, {b}")

    def all(self, conditions: Sequence[str]) -> str:
        first, *others = conditions
        for one in others:
            first = self.let(f"and i1 {first}, {one}")
        return first

    def unless(self, condition: str, otherwise: str) -> None:
        """Go on if a condition holds, and to a label otherwise."""
        self._count += 1
        self.do(f"br i1 {condition}, label %go{self._count}, label %{otherwise}")
        self.do(f"go{self._count}:")

    def call(self, kind: str, function: str, *operands: str) -> str:
        return self.let(f"call {kind} {function}({', '.join(operands)})")

    def begin(self, arrays: int) -> None:
        """Begin a built-in function, which has room for the addresses of so many arrays."""
        self.do("define ptr @call(ptr %self, ptr %args, i64 %nargs, ptr %names) nounwind {")
        self.do("entry:")
        self.do(f"%table = getelementptr i8, ptr %self, i64 {_BYTES_DATA}")
        self.do(f"%arrays = alloca [{arrays} x ptr]")

    def end(self) -> str:
        """End it with what the careful function answers to the same arguments, and return all of it."""
        self.do("careful:")
        operands = f"ptr {self.known('careful')}", "ptr %args", "i64 %nargs", "ptr %names"
        self.do(f"ret ptr {self.call('ptr', self.known('PyObject_Vectorcall'), *operands)}")
        self.do("}")
        return "\n".join([*self.lines, ""])


@cache
def _ir(inputs: int, outputs: int) -> str:
    """Return the IR of ``call``, with the signature of a built-in function, for so many arrays."""
    text = _Text(_FIELDS)
    every, ins, outs = range(inputs + outputs), range(inputs), range(inputs, inputs + outputs)
    text.begin(len(every))
    text.do("%pair = alloca [2 x ptr]")
    text.do("%none = load ptr, ptr " + text.at("%table", 8 * _FIELDS.index("none")))
    text.unless(text.equal("%nargs", inputs, "i64"), "careful")
    text.do("br label %start")
    text.do("start:")
    text.do(f"br i1 {text.equal('%names', 'null')}, label %given, label %named")
    text.do("named:")
    count = text.load("i64", "%names", _TUPLE_SIZE)
    text.unless(text.let(f"icmp ule i64 {count}, 2"), "careful")
    text.unless(text.let(f"icmp ugt i64 {count}, 0"), "careful")
    last = text.let(f"sub i64 {count}, 1")
    places = ["0", text.let(f"mul i64 {last}, 8")]
    names = [text.load("ptr", text.at("%names", _TUPLE_ITEMS), place) for place in places]
    values = [text.load("ptr", text.at("%args", 8 * inputs), place) for place in places]
    out, threads = text.known("out"), text.known("threads")
    is_out, is_threads = ([text.equal(one, which) for one in names] for which in (out, threads))
    text.unless(text.all([text.let(f"or i1 {a}, {b}") for a, b in zip(is_out, is_threads, strict=True)]), "careful")
    found = []
    for which in (is_out, is_threads):
        other = text.let(f"select i1 {which[1]}, ptr {values[1]}, ptr %none")
        found.append(text.let(f"select i1 {which[0]}, ptr {values[0]}, ptr {other}"))
    one_thread = text.equal(found[1], text.known("one"))
    any_threads = text.equal(found[1], "%none")
    text.unless(text.let(f"or i1 {one_thread}, {any_threads}"), "careful")
    text.do("br label %named_end")
    text.do("named_end:")
    text.do("br label %given")
    text.do("given:")
    text.do(f"%out = phi ptr [%none, %start], [{found[0]}, %named_end]")
    text.do(f"%alone = phi i1 [false, %start], [{one_thread}, %named_end]")
    objects = [text.load("ptr", "%args", 8 * k) for k in ins]
    text.unless(
        text.all([text.equal(text.load("ptr", x, _TYPE), text.known("array_type")) for x in objects]), "careful"
    )
    text.unless(
        text.all([_is_plain(text, x, text.of(k, "kind", "ptr"), _READABLE) for k, x in enumerate(objects)]), "careful"
    )
    axes = [text.let(f"sext i32 {text.load('i32', x, _AXES)} to i64") for x in objects]
    text.do(f"br i1 {text.equal(axes[0], text.of(0, 'axes'), 'i64')}, label %one, label %many")
    for many in (False, True):
        _case(text, objects, axes, ins, outs, many=many)
    return text.end()


@cache
def _ir_of_routine(axes: tuple[int, ...]) -> str:
    """Return the IR of ``call`` for arrays that have so many axes each."""
    text = _Text(_OF_ROUTINE)
    text.begin(len(axes))
    text.do(f"%lengths = alloca [{max(sum(axes), 1)} x i64]")
    array_type, kind = text.known("array_type"), text.known("kind")
    text.unless(text.equal("%nargs", len(axes), "i64"), "careful")
    text.unless(text.equal("%names", "null"), "careful")
    place = 0
    for k, count in enumerate(axes):
        x = text.load("ptr", "%args", 8 * k)
        text.unless(text.equal(text.load("ptr", x, _TYPE), array_type), "careful")
        same_axes = text.equal(text.load("i32", x, _AXES), count, "i32")
        text.unless(text.all([_is_plain(text, x, kind, _READABLE), same_axes]), "careful")
        text.do(f"store ptr {text.load('ptr', x, _DATA)}, ptr {text.at('%arrays', 8 * k)}")
        found = text.load("ptr", x, _LENGTHS) if count else ""
        for i in range(count):
            text.do(f"store i64 {text.load('i64', found, 8 * i)}, ptr {text.at('%lengths', 8 * (place + i))}")
        place += count
    memory = [f"ptr {text.known(name)}" for name in ("PyMem_RawMalloc", "PyMem_RawFree")]
    status = text.call("i64", "@routine", "ptr %arrays", "ptr %lengths", *memory)
    text.unless(text.equal(status, 0, "i64"), "careful")
    none = text.known("none")
    text.do(f"call void {text.known('Py_IncRef')}(ptr {none})")
    text.do(f"ret ptr {none}")
    return text.end()


def _is_plain(text: _Text, array: str, kind: str, flags: int) -> str:
    found = text.let(f"and i32 {text.load('i32', array, _FLAGS)}, {flags}")
    return text.all([text.equal(found, flags, "i32"), text.equal(text.load("ptr", array, _KIND), kind)])


def _fits(text: _Text, array: str, k: int, axes: str = "", *, many: bool) -> list[str]:
    """Write whether the axes of an array are those of a value, behind that of the rows; checks how many first."""
    axes = axes or text.let(f"sext i32 {text.load('i32', array, _AXES)} to i64")
    own = text.of(k, "axes")
    text.unless(text.equal(axes, text.let(f"add i64 {own}, {int(many)}"), "i64"), "careful")
    lengths = text.load("ptr", array, _LENGTHS)
    if not many:  # an array without axes has none
        lengths = text.let(f"select i1 {text.equal(own, 0, 'i64')}, ptr %table, ptr {lengths}")
    fits = []
    for i in range(_AXES_MAX):
        # Behind the axes that there are nothing is read.
        there = text.let(f"icmp ugt i64 {own}, {i}")
        place = text.let(f"select i1 {there}, i64 {8 * (i + many)}, i64 0")
        same = text.equal(text.load("i64", lengths, place), text.of(k, f"length{i}"), "i64")
        fits.append(text.let(f"select i1 {there}, i1 {same}, i1 true"))
    if many:
        fits.append(text.equal(text.load("i64", lengths), "%rows", "i64"))
    return fits


def _case(text: _Text, objects: Sequence[str], axes: Sequence[str], ins: range, outs: range, *, many: bool) -> None:
    """Write the calls for one configuration, or for many."""
    case = "many" if many else "one"
    text.do(f"{case}:")
    text.unless(text.let(f"icmp ne ptr {text.known('rows' if many else 'single')}, null"), "careful")
    if many:
        text.unless(text.equal(axes[0], text.let(f"add i64 {text.of(0, 'axes')}, 1"), "i64"), "careful")
        text.do("%rows = load i64, ptr " + text.load("ptr", objects[0], _LENGTHS))
        # The function in Python hears signals between parts of many rows.
        most = text.let(f"select i1 %alone, i64 {ROWS_BETWEEN_SIGNALS}, i64 {text.known('few', 'i64')}")
        text.unless(text.let(f"icmp ult i64 %rows, {most}"), "careful")
    for k, x in zip(ins, objects, strict=True):
        text.unless(text.all(_fits(text, x, k, axes[k], many=many)), "careful")
        text.do(f"store ptr {text.load('ptr', x, _DATA)}, ptr {text.at('%arrays', 8 * k)}")
    text.do(f"br i1 {text.equal('%out', '%none')}, label %{case}_new, label %{case}_given")
    text.do(f"{case}_new:")
    fresh: list[str] = []
    for k in outs:
        x = _new_array(text, k, fresh, case, many=many)
        text.do(f"store ptr {text.load('ptr', x, _DATA)}, ptr {text.at('%arrays', 8 * k)}")
        fresh.append(x)
    status = _status(text, f"{case}_new", many=many)
    text.do(f"br i1 {text.equal(status, 0, 'i64')}, label %{case}_made, label %{case}_drop")
    text.do(f"{case}_drop:")
    for x in fresh:
        text.do(f"call void {text.known('Py_DecRef')}(ptr {x})")
    text.do("br label %careful")
    text.do(f"{case}_made:")
    if len(fresh) == 1:
        text.do(f"ret ptr {fresh[0]}")
    else:
        answer = text.call("ptr", text.known("PyTuple_New"), f"i64 {len(fresh)}")
        text.do(f"br i1 {text.equal(answer, 'null')}, label %{case}_missing, label %{case}_tuple")
        text.do(f"{case}_missing:")
        for x in fresh:
            text.do(f"call void {text.known('Py_DecRef')}(ptr {x})")
        text.do("ret ptr null")
        text.do(f"{case}_tuple:")
        for i, x in enumerate(fresh):
            text.call("i32", text.known("PyTuple_SetItem"), f"ptr {answer}", f"i64 {i}", f"ptr {x}")
        text.do(f"ret ptr {answer}")
    text.do(f"{case}_given:")
    given = ["%out"]
    if len(outs) > 1:
        text.unless(text.equal(text.load("ptr", "%out", _TYPE), text.known("tuple_type")), "careful")
        text.unless(text.equal(text.load("i64", "%out", _TUPLE_SIZE), len(outs), "i64"), "careful")
        given = [text.load("ptr", "%out", _TUPLE_ITEMS + 8 * i) for i in range(len(outs))]
    text.unless(text.all([text.equal(text.load("ptr", x, _TYPE), text.known("array_type")) for x in given]), "careful")
    kinds = [text.of(k, "kind", "ptr") for k in outs]
    text.unless(text.all([_is_plain(text, *pair, _WRITABLE) for pair in zip(given, kinds, strict=True)]), "careful")
    for k, x in zip(outs, given, strict=True):
        text.unless(text.all(_fits(text, x, k, many=many)), "careful")
        text.do(f"store ptr {text.load('ptr', x, _DATA)}, ptr {text.at('%arrays', 8 * k)}")
    text.unless(text.all(_apart(text, ins, outs, many=many)), "careful")
    status = _status(text, f"{case}_given", many=many)
    text.unless(text.equal(status, 0, "i64"), "careful")
    text.do(f"call void {text.known('Py_IncRef')}(ptr %out)")
    text.do("ret ptr %out")


def _apart(text: _Text, ins: range, outs: range, *, many: bool) -> list[str]:
    """Write whether no array to fill shares memory with another array."""
    ends = {}
    for k in (*ins, *outs):
        start = text.let(f"ptrtoint ptr {text.load('ptr', '%arrays', 8 * k)} to i64")
        size = text.of(k, "size")
        size = text.let(f"mul i64 {size}, %rows") if many else size
        ends[k] = start, text.let(f"add i64 {start}, {size}")
    apart = []
    for k in outs:
        for other in (*ins, *(x for x in outs if x < k)):
            before = text.let(f"icmp ule i64 {ends[k][1]}, {ends[other][0]}")
            behind = text.let(f"icmp ule i64 {ends[other][1]}, {ends[k][0]}")
            apart.append(text.let(f"or i1 {before}, {behind}"))
    return apart


def _new_array(text: _Text, k: int, before: Sequence[str], case: str, *, many: bool) -> str:
    """Write the making of an array; an error of that is the answer."""
    shape = text.of(k, "shape", "ptr")
    if many:
        axes = text.of(k, "axes")
        longer = text.call("ptr", text.known("PyTuple_New"), f"i64 {text.let(f'add i64 {axes}, 1')}")
        rows = text.call("ptr", text.known("PyLong_FromSsize_t"), "i64 %rows")
        text.call("i32", text.known("PyTuple_SetItem"), f"ptr {longer}", "i64 0", f"ptr {rows}")
        for i in range(_AXES_MAX):
            there = text.let(f"icmp ugt i64 {axes}, {i}")
            label = f"{case}_axis{k}_{i}"
            text.do(f"br i1 {there}, label %{label}, label %{label}_behind")
            text.do(f"{label}:")
            item = text.load("ptr", shape, _TUPLE_ITEMS + 8 * i)
            text.do(f"call void {text.known('Py_IncRef')}(ptr {item})")
            text.call("i32", text.known("PyTuple_SetItem"), f"ptr {longer}", f"i64 {i + 1}", f"ptr {item}")
            text.do(f"br label %{label}_behind")
            text.do(f"{label}_behind:")
        shape = longer
    text.do(f"store ptr {shape}, ptr %pair")
    text.do(f"store ptr {text.of(k, 'kind', 'ptr')}, ptr {text.at('%pair', 8)}")
    call = text.known("PyObject_Vectorcall")
    made = text.call("ptr", call, f"ptr {text.known('empty')}", "ptr %pair", "i64 2", "ptr null")
    if many:
        text.do(f"call void {text.known('Py_DecRef')}(ptr {shape})")
    label = f"{case}_array{k}"
    text.do(f"br i1 {text.equal(made, 'null')}, label %{label}_missing, label %{label}")
    text.do(f"{label}_missing:")
    for x in before:
        text.do(f"call void {text.known('Py_DecRef')}(ptr {x})")
    text.do("ret ptr null")
    text.do(f"{label}:")
    return made


def _status(text: _Text, label: str, *, many: bool) -> str:
    """Write the call of the kernel; for many rows other threads of Python may run meanwhile."""
    if not many:
        return text.call("i64", text.known("single"), "ptr %arrays")
    text.do(f"br i1 {text.let(f'icmp ult i64 %rows, {_ROWS_TO_LET_GO}')}, label %{label}_short, label %{label}_long")
    text.do(f"{label}_short:")
    short = text.call("i64", text.known("rows"), "i64 0", "i64 %rows", "ptr %arrays")
    text.do(f"br label %{label}_end")
    text.do(f"{label}_long:")
    state = text.call("ptr", text.known("PyEval_SaveThread"))
    long = text.call("i64", text.known("rows"), "i64 0", "i64 %rows", "ptr %arrays")
    text.do(f"call void {text.known('PyEval_RestoreThread')}(ptr {state})")
    text.do(f"br label %{label}_end")
    text.do(f"{label}_end:")
    return text.let(f"phi i64 [{short}, %{label}_short], [{long}, %{label}_long]")
