"""A stand-in for the libraries of CUDA: memory of the device is memory of the host, kernels run as C++."""

import ctypes
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from armwright.arm.model import Arm
from armwright.compiled.device_arm import DeviceArm
from armwright.compiled.source_text import source_text
from armwright.tracing import cuda_device
from oracles.compilers import Compiled


class OnDevice:
    """An array of another library on the device, which tells of it by DLPack."""

    def __init__(self, array: np.ndarray[Any, Any], number: int = 0) -> None:
        self.array, self.number = array, number

    def __dlpack_device__(self) -> tuple[int, int]:
        return 2, self.number


class View(OnDevice):
    """What a view tells of an array."""

    def __init__(self, array: np.ndarray[Any, Any], number: int = 0) -> None:
        super().__init__(array, number)
        self.ptr, self.shape, self.dtype = array.ctypes.data, array.shape, array.dtype
        self.strides = tuple(step // array.itemsize for step in array.strides)
        self.device_id, self.readonly = number, not array.flags.writeable


class FakeCuda:
    """The libraries, with what was asked of them.

    Attributes:
        launches: rows of each launch.
        fails: the name of the function of the driver that fails.
    """

    def __init__(self, arm: Arm, folder: Path) -> None:
        self._arm, self._folder = arm, folder
        self.launches: list[int] = []
        self.fails = ""
        self.context, self.seen_streams = 77, list[int]()
        self.core = SimpleNamespace(
            Device=lambda _: SimpleNamespace(
                arch="90", set_current=self._set_current, allocate=self._allocate,
                create_stream=lambda: SimpleNamespace(handle=5, sync=lambda: None),
            ),
            Program=self._program,
            ProgramOptions=lambda **options: options,
            LaunchConfig=SimpleNamespace,
            LEGACY_DEFAULT_STREAM="legacy",
            launch=self._launch,
            utils=SimpleNamespace(
                StridedMemoryView=SimpleNamespace(from_any_interface=self._view, from_buffer=self._from_buffer)
            ),
        )  # fmt: skip
        self.driver = SimpleNamespace(
            cuInit=lambda _: (0,),
            cuCtxGetCurrent=lambda: (0, self.context),
            cuCtxSetCurrent=self._set_context,
            cuGetErrorName=lambda _: (0, b"CUDA_ERROR_OUT_OF_MEMORY"),
            cuMemcpyHtoDAsync=lambda to, source, size, _: self._copy("cuMemcpyHtoDAsync", to, source, size),
            cuMemcpyDtoHAsync=lambda to, source, size, _: self._copy("cuMemcpyDtoHAsync", to, source, size),
        )

    def arm(self, monkeypatch: pytest.MonkeyPatch) -> DeviceArm:
        """Return the arm on this device."""
        modules = {"cuda.core": self.core, "cuda.bindings.driver": self.driver}
        monkeypatch.setattr(cuda_device, "import_extra", lambda module, *_: modules[module])
        return DeviceArm(arm=self._arm, device=cuda_device.CudaDevice(0))

    def _set_current(self) -> None:
        self.context = 99

    def _set_context(self, context: int) -> tuple[int]:
        self.context = context
        return (0,)

    def _allocate(self, size: int, *, stream: Any) -> Any:
        assert stream.handle == 5
        memory = np.full(size + 64, 0xFF, dtype=np.uint8)  # NaN
        return SimpleNamespace(handle=memory.ctypes.data, memory=memory, set_deallocation_stream=self._freed_on)

    def _freed_on(self, stream: str) -> None:
        assert stream == "legacy"

    def _copy(self, name: str, to: int, source: int, size: int) -> tuple[int]:
        assert self.context == 99
        ctypes.memmove(to, source, size)
        return (2 if name == self.fails else 0,)

    def _view(self, value: OnDevice, *, stream_ptr: int) -> View:
        self.seen_streams.append(stream_ptr)
        return View(value.array, value.number)

    def _from_buffer(self, buffer: Any, shape: tuple[int, ...], *, dtype: Any) -> View:
        count = int(np.prod(shape))
        return View(buffer.memory[: count * dtype.itemsize].view(dtype).reshape(shape))

    def _program(self, text: str, kind: str, options: dict[str, Any]) -> Any:
        assert (kind, options) == ("c++", {"arch": "sm_90", "fma": False})

        def get_kernel(name: str) -> Any:
            quantity = name.removeprefix(f"{self._arm.name}_")
            assert text == source_text(self._arm, [quantity], "cuda")
            (self._folder / quantity).mkdir()
            compiled = Compiled(self._arm, [quantity], self._folder / quantity, compiler="g++", language="cuda")
            return compiled._library[f"all_{name}"]

        return SimpleNamespace(compile=lambda _: SimpleNamespace(get_kernel=get_kernel))

    def _launch(self, stream: Any, config: Any, kernel: Any, *arguments: Any) -> None:
        *pointers, rows = arguments
        assert isinstance(rows, np.int64)
        assert (stream.handle, config.grid, config.block) == (5, -(-int(rows) // 128), 128)
        self.launches.append(int(rows))
        kernel(ctypes.c_long(int(rows)), *map(ctypes.c_void_p, pointers))
