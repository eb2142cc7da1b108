"""A device of CUDA: text is compiled for it, and kernels are launched on it; the libraries come with an extra."""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from armwright.errors import ArmwrightError, DeviceError
from armwright.extras import import_extra
from armwright.tracing.emit_cuda import BLOCK
from armwright.tracing.emit_llvm import MEANINGLESS, UNUSUAL

_PURPOSE = "computing on a device"
# What DLPack calls memory of CUDA: on the device, and managed.
_MEMORY = (2, 13)


class CudaDevice:
    """A device and a stream of our own on it, which waits for nobody's work but what it is told of."""

    def __init__(self, number: int) -> None:
        """Open the device.

        Raises:
            MissingExtraError: the libraries are not installed.
            DeviceError: there is no driver, or no such device.
        """
        self._core = import_extra("cuda.core", _PURPOSE, "cuda", "cuda-core")
        self._driver = import_extra("cuda.bindings.driver", _PURPOSE, "cuda", "cuda-bindings")
        self.number, self._process = number, os.getpid()
        with _errors(f"no device {number} of CUDA"):
            self._device = self._core.Device(number)
            with self._kept_context():
                self._device.set_current()
                self._stream = self._device.create_stream()

    @property
    def bandwidth(self) -> float:
        """What its memory transfers [B/s], by its clock and width; two transfers in a cycle."""
        properties = self._device.properties
        return 2e3 * float(properties.memory_clock_rate) * float(properties.global_memory_bus_width) / 8

    @contextmanager
    def current(self, work: str) -> Iterator[None]:
        """Make the device that of this thread for a while; errors of CUDA become ours.

        Args:
            work: what is done, for the message.

        Raises:
            DeviceError: something went wrong on the device.
        """
        if os.getpid() != self._process:
            raise DeviceError(f"{work}: the device was opened before this process was forked; spawn it")
        with _errors(work), self._kept_context():
            self._device.set_current()
            try:
                yield
            finally:
                # Nothing of the caller's is in use after a call, even after a signal.
                self._stream.sync()

    @contextmanager
    def _kept_context(self) -> Iterator[None]:
        """Leave the thread with the context that it had: other libraries rely on theirs."""
        driver = self._driver
        _checked(driver, *driver.cuInit(0))
        before = _checked(driver, *driver.cuCtxGetCurrent())
        try:
            yield
        finally:
            _checked(driver, *driver.cuCtxSetCurrent(before))

    def compile(self, text: str, name: str) -> Any:
        """Compile a text, and return its kernel of that name."""
        options = self._core.ProgramOptions(arch=f"sm_{self._device.arch}", fma=False)
        return self._core.Program(text, "c++", options).compile("cubin").get_kernel(name)

    def allocate(self, size: int) -> Any:
        """Return memory of the device; what others still do with it on the default stream ends before it is freed."""
        buffer = self._device.allocate(max(size, 8), stream=self._stream)
        buffer.set_deallocation_stream(self._core.LEGACY_DEFAULT_STREAM)
        return buffer

    def upload(self, pointer: int, array: np.ndarray[Any, Any]) -> None:
        """Copy an array in C order to memory of the device."""
        self._driver_call("cuMemcpyHtoDAsync", pointer, array.ctypes.data, array.nbytes)

    def download(self, array: np.ndarray[Any, Any], pointer: int) -> None:
        """Copy memory of the device to an array in C order."""
        self._driver_call("cuMemcpyDtoHAsync", array.ctypes.data, pointer, array.nbytes)
        self._stream.sync()

    def launch(self, kernel: Any, pointers: Sequence[int], rows: int) -> int:
        """Run a kernel on rows, and return the statuses of all, joined by "or"."""
        status = np.zeros(1, dtype=np.intc)
        if rows:
            on_device = self.allocate(status.nbytes)
            self.upload(int(on_device.handle), status)
            config = self._core.LaunchConfig(grid=-(-rows // BLOCK), block=BLOCK)
            arguments = [*pointers, 0, int(on_device.handle), np.int64(rows)]
            self._core.launch(self._stream, config, kernel, *arguments)
            self.download(status, int(on_device.handle))
        return int(status[0]) & (MEANINGLESS | UNUSUAL)

    def view(self, value: object) -> Any:
        """Return a view of an array on the device, after what its owner has begun to do with it."""
        return self._core.utils.StridedMemoryView.from_any_interface(value, stream_ptr=int(self._stream.handle))

    def array(self, shape: tuple[int, ...], kind: type) -> Any:
        """Return a new array on the device, which others take by DLPack."""
        dtype = np.dtype(kind)
        buffer = self.allocate(int(np.prod(shape, dtype=np.int64)) * dtype.itemsize)
        return self._core.utils.StridedMemoryView.from_buffer(buffer, shape, dtype=dtype)

    def _driver_call(self, name: str, *arguments: Any) -> None:
        _checked(self._driver, *getattr(self._driver, name)(*arguments, self._stream.handle))


def is_on_device(value: object) -> bool:
    """Return whether a value is an array on a device of CUDA."""
    if hasattr(value, "__dlpack_device__"):
        return int(value.__dlpack_device__()[0]) in _MEMORY
    return hasattr(value, "__cuda_array_interface__")


def _checked(driver: Any, error: Any, *results: Any) -> Any:
    if int(error) != 0:
        _, name = driver.cuGetErrorName(error)
        raise DeviceError(f"CUDA: {name.decode() if isinstance(name, bytes) else error}")
    return results[0] if results else None


@contextmanager
def _errors(work: str) -> Iterator[None]:
    """Make errors of CUDA's libraries, which have no common class, one of ours."""
    try:
        yield
    except ArmwrightError:
        raise
    except Exception as error:
        raise DeviceError(f"{work}: {error}") from error
