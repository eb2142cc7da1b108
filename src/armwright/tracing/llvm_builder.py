"""A builder of LLVM IR: writes the instructions of one function, and collects what stands around them."""

import struct
from collections.abc import Sequence

# Bytes of a number, and of a line of the cache.
DOUBLE, CACHE_LINE = 8, 64


class Builder:
    """The IR of one function under construction, for vectors of a number of lanes; one lane is a plain number.

    Attributes:
        lanes: how many numbers a vector holds.
        number: the type of a vector of numbers.
        truth: the type of a vector of truth values.
        false: the vector whose truth values are all false.
    """

    def __init__(self, lanes: int, *, has_fma: bool) -> None:
        """Begin empty.

        Args:
            lanes: how many numbers a vector holds.
            has_fma: whether the processor multiplies and adds in one instruction; otherwise that is rounded twice.
        """
        self.lanes, self._has_fma = lanes, has_fma
        self.number, self.truth = self.vector_type("double"), self.vector_type("i1")
        self.false = self.splat("i1 false")
        self._suffix = "f64" if lanes == 1 else f"v{lanes}f64"
        self._lines: list[str] = []
        self._declarations: set[str] = set()
        self._tables: list[str] = []
        self._stack: list[str] = []
        self._count = 0
        self._block = ""

    @property
    def block(self) -> str:
        """The label of the basic block that is written."""
        return self._block

    def module(self) -> str:
        """Return all of it."""
        entry = self._lines.index("entry:") + 1
        body = [*self._lines[:entry], *self._stack, *self._lines[entry:]]
        return "\n".join([*sorted(self._declarations), *self._tables, "", *body, ""])

    # ---- types and constants ----

    def vector_type(self, element: str) -> str:
        """Return the type of a vector of a type of element."""
        return element if self.lanes == 1 else f"<{self.lanes} x {element}>"

    def splat(self, element: str) -> str:
        """Return a constant vector of one element, written with its type."""
        return element.partition(" ")[2] if self.lanes == 1 else f"<{', '.join([element] * self.lanes)}>"

    def constant(self, value: float) -> str:
        """Return a constant vector of a number."""
        return self.splat(f"double {bits(value)}")

    def table(self, kind: str, values: Sequence[str]) -> str:
        """Return the address of constants."""
        name = f"@table{len(self._tables)}"
        elements = ", ".join(f"{kind} {x}" for x in values)
        self._tables.append(
            f"{name} = private unnamed_addr constant [{len(values)} x {kind}] [{elements}], align {CACHE_LINE}"
        )
        return name

    # ---- instructions ----

    def let(self, expression: str) -> str:
        """Write an instruction, and return the name of its result."""
        self._count += 1
        self._lines.append(f"  %v{self._count} = {expression}")
        return f"%v{self._count}"

    def do(self, statement: str) -> None:
        """Write an instruction without a result or with a name of its own, or a label."""
        if statement.endswith(":"):
            self._block = statement.removesuffix(":")
            self._lines.append(statement)
        else:
            self._lines.append(f"  {statement}")

    def new_label(self, prefix: str) -> str:
        """Return a label that nothing else has."""
        self._count += 1
        return f"{prefix}{self._count}"

    def declare(self, function: str) -> None:
        """Declare a function that is called, once."""
        self._declarations.add(f"declare {function}")

    def intrinsic(self, name: str, *operands: str) -> str:
        """Write the call of an intrinsic of numbers, and return the name of its result."""
        function = f"{self.number} @llvm.{name}.{self._suffix}"
        self.declare(f"{function}({', '.join([self.number] * len(operands))})")
        return self.let(f"call {function}({', '.join(f'{self.number} {x}' for x in operands)})")

    def fma(self, a: str, b: str, c: str) -> str:
        """Write a · b + c, rounded once where the processor can."""
        if self._has_fma:
            return self.intrinsic("fma", a, b, c)
        return self.let(f"fadd {self.number} {self.let(f'fmul {self.number} {a}, {b}')}, {c}")

    def shuffle(self, a: str, b: str, picks: Sequence[int]) -> str:
        """Return a vector of elements of two others, one behind the other."""
        if a == b == "poison":
            return "poison"
        mask = ", ".join(f"i32 {k}" for k in picks)
        return self.let(f"shufflevector {self.number} {a}, {self.number} {b}, <{self.lanes} x i32> <{mask}>")

    # ---- memory ----

    def address(self, pointer: str, offset: str | int, kind: str = "double") -> str:
        """Return the address of an element of an array."""
        return pointer if offset == 0 else self.let(f"getelementptr {kind}, ptr {pointer}, i64 {offset}")

    def stack_vectors(self, count: int) -> str:
        """Return the address of as many vectors on the stack."""
        name = f"%scratch{len(self._stack)}"
        self._stack.append(f"  {name} = alloca [{count} x {self.number}], align {CACHE_LINE}")
        return name

    def load(self, vectors: str, index: str | int) -> str:
        """Return a vector of an array on the stack."""
        address = self.address(vectors, index, self.number)
        return self.let(f"load {self.number}, ptr {address}, align {self.lanes * DOUBLE}")

    def store(self, x: str, vectors: str, index: str | int) -> None:
        """Write a vector of an array on the stack."""
        address = self.address(vectors, index, self.number)
        self.do(f"store {self.number} {x}, ptr {address}, align {self.lanes * DOUBLE}")

    def load_splat(self, table: str, index: str) -> str:
        """Return a constant of a table in all lanes."""
        element = self.let(f"load double, ptr {self.address(table, index)}, align {DOUBLE}")
        if self.lanes == 1:
            return element
        first = self.let(f"insertelement {self.number} poison, double {element}, i32 0")
        mask = f"<{self.lanes} x i32> zeroinitializer"
        return self.let(f"shufflevector {self.number} {first}, {self.number} poison, {mask}")

    def load_first(self, address: str, count: int) -> str:
        """Return the first ``count`` numbers of a vector anywhere in memory, and 0 in the lanes behind them."""
        if count >= self.lanes:
            return self.let(f"load {self.number}, ptr {address}, align {DOUBLE}")
        function = f"{self.number} @llvm.masked.load.{self._suffix}.p0"
        self.declare(f"{function}(ptr, i32, {self.truth}, {self.number})")
        return self.let(
            f"call {function}(ptr {address}, i32 {DOUBLE}, {self.truth} {self._mask(count)}, "
            f"{self.number} zeroinitializer)"
        )

    def store_first(self, x: str, address: str, count: int) -> None:
        """Write the first ``count`` numbers of a vector anywhere in memory."""
        if count >= self.lanes:
            self.do(f"store {self.number} {x}, ptr {address}, align {DOUBLE}")
            return
        function = f"void @llvm.masked.store.{self._suffix}.p0"
        self.declare(f"{function}({self.number}, ptr, i32, {self.truth})")
        self.do(f"call {function}({self.number} {x}, ptr {address}, i32 {DOUBLE}, {self.truth} {self._mask(count)})")

    def _mask(self, count: int) -> str:
        return f"<{', '.join('i1 true' if k < count else 'i1 false' for k in range(self.lanes))}>"

    def copy(self, to: str, source: str, size: str) -> None:
        """Write the copy of so many bytes."""
        self._declarations.add(_copy())
        self.do(f"call void @copy(ptr {to}, ptr {source}, i64 {size})")

    def prefetch(self, start: str, offset: int, *, is_written: bool) -> None:
        """Fetch a line of memory into the cache, to read or to write it."""
        self.declare("void @llvm.prefetch.p0(ptr, i32, i32, i32)")
        address = self.address(start, offset, "i8")
        self.do(f"call void @llvm.prefetch.p0(ptr {address}, i32 {int(is_written)}, i32 3, i32 1)")


def bits(value: float) -> str:
    """Return a number as IR has it without rounding: its representation."""
    (whole,) = struct.unpack("<Q", struct.pack("<d", value))
    return f"0x{whole:016X}"


def _copy() -> str:
    """Return a function that copies bytes, 64 and 8 at once while as many are left: emitted code calls no library."""
    lines = ["define internal void @copy(ptr %to, ptr %from, i64 %size) nounwind {", "entry:", "  br label %by64"]
    done, before = "0", "entry"
    for size, then in ((64, "by8"), (8, "by1"), (1, "end")):
        kind = f"<{size} x i8>" if size > 1 else "i8"
        lines += [
            f"by{size}:",
            f"  %at{size} = phi i64 [{done}, %{before}], [%next{size}, %copy{size}]",
            f"  %next{size} = add i64 %at{size}, {size}",
            f"  %fits{size} = icmp ule i64 %next{size}, %size",
            f"  br i1 %fits{size}, label %copy{size}, label %{then}",
            f"copy{size}:",
            f"  %from{size} = getelementptr i8, ptr %from, i64 %at{size}",
            f"  %to{size} = getelementptr i8, ptr %to, i64 %at{size}",
            f"  %x{size} = load {kind}, ptr %from{size}, align 1",
            f"  store {kind} %x{size}, ptr %to{size}, align 1",
            f"  br label %by{size}",
        ]
        done, before = f"%at{size}", f"by{size}"
    return "\n".join([*lines, "end:", "  ret void", "}"])
