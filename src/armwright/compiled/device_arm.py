"""An arm whose quantities are computed on a device of CUDA."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.compiled.arm import CompiledArm
from armwright.compiled.source_text import arm_functions, text_of
from armwright.errors import InvalidValueError, KindError, ShapeError, shown
from armwright.tracing.cuda_device import CudaDevice, is_on_device
from armwright.tracing.kernel import Kernel

# Arrays of the host go to the device in parts of so many bytes, whatever its memory.
_PART = 256 << 20


@attrs.frozen(kw_only=True, slots=False)
class DeviceArm(CompiledArm):
    """The functions of ``CompiledArm``, computed on a device of CUDA with the same bits.

    Arrays of NumPy are copied to the device and back. Arrays on the device (of CuPy, Torch and others, by DLPack or
    ``__cuda_array_interface__``) stay there: all inputs, float64 in C order with the same leading axes, and the
    results, which those libraries take by ``from_dlpack``. ``threads`` has no effect. Every call waits until its
    results are there.

    Attributes:
        device: the device.
    """

    device: CudaDevice = attrs.field(repr=False, eq=False)

    def _function(self, name: str, doc: str) -> Callable[..., Any]:
        kernel = DeviceKernel(self.arm, name, self.kernel(name), self.device)

        def method(*arguments: Any, **named: Any) -> Any:
            return kernel(*arguments, **named)

        method.__name__, method.__doc__ = name, doc
        return method

    def __reduce__(self) -> tuple[Callable[[Arm], CompiledArm], tuple[Arm]]:
        """Let another process compile for itself."""
        from armwright.compiled.arm import compile_arm  # noqa: PLC0415 - it makes objects of this class

        return partial(compile_arm, device=f"cuda:{self.device.number}"), (self.arm,)


class DeviceKernel:
    """A quantity on a device, compiled when it is first called.

    Args:
        arm: the arm.
        quantity: name of the quantity.
        kernel: that of the processor, whose checks, errors and warnings are those of the device.
        device: where it is computed.
    """

    def __init__(self, arm: Arm, quantity: str, kernel: Kernel, device: CudaDevice) -> None:
        self._arm, self._quantity, self._kernel, self._device = arm, quantity, kernel, device

    @cached_property
    def _compiled(self) -> Any:
        functions = arm_functions(self._arm, [self._quantity], "cuda")
        return self._device.compile(text_of(functions, "cuda"), functions[0].name)

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Evaluate the quantity: see ``Kernel.function``.

        Raises:
            KindError: some inputs are on the device and some are not, or an array is not of float64.
            ShapeError: an array on the device has another shape or order, or cannot be written.
            InvalidValueError: an array is on another device.
            DeviceError: something went wrong on the device.
        """
        bound = self._kernel.signature.bind(*arguments, **named).arguments
        inputs = [bound[name] for name in self._kernel.emitted.inputs]
        threads, out = bound.get("threads"), bound.get("out")
        on_device = [is_on_device(x) for x in inputs]
        if any(on_device):
            if not all(on_device):
                raise KindError(f"{self._quantity}: expected all inputs on the device or none, got both")
            arrays, results, status = self._of_device(inputs, out)
        else:
            arrays, lead, results = self._kernel.prepared(inputs, threads, out)
            status = self._of_host(arrays, lead, results)
        self._kernel.judge(arrays, status, 3)
        return results[0] if len(results) == 1 else tuple(results)

    def _of_host(self, arrays: Sequence[Array], lead: tuple[int, ...], results: Sequence[Array]) -> int:
        """Fill results part by part; return the statuses of all rows, joined."""
        rows, status = math.prod(lead), 0
        inputs = []
        for x, shape in zip(arrays, self._kernel.emitted.inputs.values(), strict=True):
            whole = np.require(np.broadcast_to(x, (*lead, *shape)), requirements=("C", "A"))
            inputs.append(whole.reshape(rows, math.prod(shape)))
        outputs = [x.reshape(rows, math.prod(x.shape[len(lead) :])) for x in results]
        flat = [*inputs, *outputs]
        part = max(_PART // sum(x.shape[1] * x.itemsize for x in flat), 1)
        with self._device.current(self._quantity):
            buffers = [self._device.allocate(min(part, rows) * x.shape[1] * x.itemsize) for x in flat]
            pointers = [int(buffer.handle) for buffer in buffers]
            for start in range(0, rows, part):
                end = min(start + part, rows)
                for x, pointer in zip(inputs, pointers, strict=False):
                    self._device.upload(pointer, x[start:end])
                status |= self._device.launch(self._compiled, pointers, end - start)
                for x, pointer in zip(outputs, pointers[len(inputs) :], strict=True):
                    self._device.download(x[start:end], pointer)
        return status

    def _of_device(self, inputs: Sequence[Any], out: Any) -> tuple[list[Array], list[Any], int]:
        """Compute where the inputs are; return copies of them where something is wrong, the results and the status."""
        emitted, device = self._kernel.emitted, self._device
        copies: list[Array] = []
        with device.current(self._quantity):
            views = [device.view(x) for x in inputs]
            lead = _lead(views[0], len(next(iter(emitted.inputs.values()))))
            for view, (name, shape) in zip(views, emitted.inputs.items(), strict=True):
                _require(name, view, (*lead, *shape), np.dtype(float), device.number)
            kinds = [bool if i in emitted.flags else float for i in range(len(emitted.outputs))]
            shapes = [(*lead, *shape) for shape in emitted.outputs]
            if out is None:
                results = filled = [device.array(shape, kind) for shape, kind in zip(shapes, kinds, strict=True)]
            else:
                results = list(out) if isinstance(out, tuple) else [out]
                if len(results) != len(shapes) or not all(map(is_on_device, results)):
                    raise ShapeError(f"out: expected {len(shapes)} arrays on the device")
                filled = [device.view(x) for x in results]
                for view, shape, kind in zip(filled, shapes, kinds, strict=True):
                    _require("out", view, shape, np.dtype(kind), device.number, writable=True)
                _require_apart(views, filled)
            pointers = [int(view.ptr) for view in (*views, *filled)]
            status = device.launch(self._compiled, pointers, math.prod(lead))
            if status:
                copies = [np.empty(view.shape) for view in views]
                for copy, view in zip(copies, views, strict=True):
                    device.download(copy, int(view.ptr))
        return copies, results, status


def _lead(view: Any, axes: int) -> tuple[int, ...]:
    return tuple(view.shape)[: max(len(view.shape) - axes, 0)]


def _require(
    name: str, view: Any, shape: tuple[int, ...], kind: np.dtype[Any], number: int, *, writable: bool = False
) -> None:
    """Raise what is wrong with an array on the device."""
    if view.dtype != kind:
        raise KindError(f"{name}: expected {kind} on the device, got {view.dtype}")
    if tuple(view.shape) != shape:
        raise ShapeError(f"{name}: expected shape {shape}, got shape {tuple(view.shape)}; a device broadcasts nothing")
    steps = [math.prod(shape[i + 1 :]) for i in range(len(shape))]
    strides = view.strides or steps
    if math.prod(shape) and any(s != step for s, step, n in zip(strides, steps, shape, strict=True) if n > 1):
        raise ShapeError(f"{name}: expected an array in C order on the device")
    if view.device_id != number:
        raise InvalidValueError(f"{name}: expected an array on device {number}, got one on device {view.device_id}")
    if writable and view.readonly:
        raise ShapeError(f"{name}: expected a writable array, got one to be read only")


def _require_apart(inputs: Sequence[Any], outputs: Sequence[Any]) -> None:
    """Raise if an array to fill shares memory with another."""
    spans = [(int(x.ptr), int(x.ptr) + math.prod(x.shape) * x.dtype.itemsize) for x in (*outputs, *inputs)]
    for i, (start, end) in enumerate(spans[: len(outputs)]):
        if any(start < other_end and other < end for other, other_end in spans[i + 1 :]):
            raise ShapeError("out: expected arrays apart from each other and the inputs, got some that share memory")


def device_number(device: str) -> int:
    """Return the number of a device: of ``cuda`` 0, of ``cuda:1`` 1.

    Raises:
        InvalidValueError: it is called otherwise.
    """
    match = re.fullmatch(r"cuda(?::(\d{1,3}))?", device) if isinstance(device, str) else None
    if match is None:
        raise InvalidValueError(f"device: expected cuda or a number such as cuda:1, got {shown(device)}")
    return int(match[1] or 0)
