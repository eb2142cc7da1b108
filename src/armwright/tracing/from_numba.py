"""Kernels for loops that Numba compiles: called there as any function, without a step through Python."""

from collections.abc import Callable
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir
from numba import njit, types
from numba.core.errors import TypingError
from numba.extending import intrinsic

from armwright.tracing.emit import Shape
from armwright.tracing.emit_llvm import MEANINGLESS


def callable_from_numba(address: int, shapes: tuple[Shape, ...]) -> Callable[..., int]:
    """Return a function of arrays, inputs and outputs of a kernel, that other compiled functions can call.

    It returns the status of the kernel, and ``MEANINGLESS`` where the shape of an array is another.

    Args:
        address: of the kernel for one configuration, a function of the addresses of its arrays.
        shapes: of the arrays.
    """

    @intrinsic
    def call(typing: Any, arrays: Any) -> Any:  # noqa: ARG001 - Numba's protocol
        if len(arrays) != len(shapes) or not all(
            isinstance(one, types.Array) and one.layout == "C" and one.ndim == len(shape)
            for one, shape in zip(arrays, shapes, strict=True)
        ):
            raise TypingError(f"expected {len(shapes)} arrays in C order, of shapes {shapes}, got {arrays}")

        def generate(context: Any, builder: Any, signature: Any, operands: Any) -> Any:
            (values,) = operands
            word, pointer = ir.IntType(64), ir.IntType(8).as_pointer()
            fits = ir.Constant(ir.IntType(1), 1)
            places = builder.alloca(pointer, len(shapes))
            for i, (kind, shape) in enumerate(zip(signature.args[0], shapes, strict=True)):
                array = context.make_array(kind)(context, builder, builder.extract_value(values, i))
                for axis, length in enumerate(shape):
                    found = builder.extract_value(array.shape, axis)
                    fits = builder.and_(fits, builder.icmp_signed("==", found, ir.Constant(word, length)))
                builder.store(builder.bitcast(array.data, pointer), builder.gep(places, [ir.Constant(word, i)]))
            kernel = builder.inttoptr(
                ir.Constant(word, address), ir.FunctionType(word, [pointer.as_pointer()]).as_pointer()
            )
            with builder.if_else(fits) as (good, bad):
                with good:
                    status = builder.call(kernel, [places])
                    good_end = builder.block
                with bad:
                    bad_end = builder.block
            result = builder.phi(word)
            result.add_incoming(status, good_end)
            result.add_incoming(ir.Constant(word, MEANINGLESS), bad_end)
            return result

        return types.int64(arrays), generate

    @njit
    def single(*arrays: Any) -> int:
        return call(arrays)  # type: ignore[call-arg]

    return single  # type: ignore[no-any-return]


def announce(name: str, address: int) -> None:
    """Let compiled functions find another one by its name."""
    llvm.add_symbol(name, address)
