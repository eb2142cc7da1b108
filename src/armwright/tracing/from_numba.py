"""Kernels for loops that Numba compiles: called there as any function, without a step through Python."""

from collections.abc import Callable, Sequence
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core.errors import TypingError
from numba.extending import intrinsic
from numba.np.numpy_support import from_dtype

from armwright.tracing.door import Passed
from armwright.tracing.emit_llvm import MEANINGLESS


def callable_from_numba(address: int, inputs: Sequence[Passed], outputs: Sequence[Passed]) -> Callable[..., int]:
    """Return a function of arrays, inputs and outputs of a kernel, that other compiled functions can call.

    It returns the status of the kernel, and ``MEANINGLESS`` where the shape of an array is another. Arrays of other
    numbers, in another order, or outputs that are only to be read, are an error of types. Functions that call it cannot
    be kept by Numba's own cache, since the address is another in every process.

    Args:
        address: of the kernel for one configuration, a function of the addresses of its arrays.
        inputs: the arrays that are read.
        outputs: the arrays that are written.
    """
    passed = (*inputs, *outputs)
    kinds = [types.Array(from_dtype(np.dtype(one.kind)), len(one.shape), "C", readonly=True) for one in inputs]
    kinds += [types.Array(from_dtype(np.dtype(one.kind)), len(one.shape), "C") for one in outputs]

    def fits(given: Any, kind: Any) -> bool:
        return bool(given == kind or given == kind.copy(readonly=False))

    @intrinsic
    def call(typing: Any, arrays: Any) -> Any:  # noqa: ARG001 - Numba's protocol
        if len(arrays) != len(kinds) or not all(map(fits, arrays, kinds)):
            raise TypingError(f"expected arrays {kinds}, got {arrays}")

        def generate(context: Any, builder: Any, signature: Any, operands: Any) -> Any:
            (values,) = operands
            word, pointer = ir.IntType(64), ir.IntType(8).as_pointer()
            same = ir.Constant(ir.IntType(1), 1)
            places = builder.alloca(pointer, len(passed))
            for i, (kind, (shape, _)) in enumerate(zip(signature.args[0], passed, strict=True)):
                array = context.make_array(kind)(context, builder, builder.extract_value(values, i))
                for axis, length in enumerate(shape):
                    found = builder.extract_value(array.shape, axis)
                    same = builder.and_(same, builder.icmp_signed("==", found, ir.Constant(word, length)))
                builder.store(builder.bitcast(array.data, pointer), builder.gep(places, [ir.Constant(word, i)]))
            # Numba keeps no code on disk that holds such an address.
            place = context.add_dynamic_addr(builder, address, info="kernel")
            kernel = builder.bitcast(place, ir.FunctionType(word, [pointer.as_pointer()]).as_pointer())
            with builder.if_else(same) as (good, bad):
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
