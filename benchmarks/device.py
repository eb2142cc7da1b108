"""Rows per second of inverse dynamics on a device of CUDA, beside what its memory allows.

Inputs and results stay on the device. Without a device it says so and ends.
"""

import statistics
import sys
import time
from collections.abc import Callable

import numpy as np

import armwright
from armwright.errors import DeviceError, MissingExtraError
from armwright.tracing.cuda_device import CudaDevice

ARMS = ("puma560", "stanford", "ur5")
ROWS = 4_000_000
REPEATS = 20
# Three inputs and a result of six numbers.
BYTES = 4 * 6 * 8


def main() -> None:
    """Measure each arm."""
    try:
        device = CudaDevice(0)
    except (DeviceError, MissingExtraError) as error:
        sys.exit(f"nothing was measured: {error}")
    rng = np.random.default_rng(1)
    with device.current("benchmark"):
        inputs = [device.array((ROWS, 6), float) for _ in range(3)]
        out = device.array((ROWS, 6), float)
        for array in inputs:
            device.upload(int(array.ptr), rng.uniform(-1.0, 1.0, size=(ROWS, 6)))
    ceiling = device.bandwidth / BYTES
    print(f"memory: {device.bandwidth / 1e9:.0f} GB/s, so at most {ceiling:.3g} rows/s of {BYTES} bytes")
    for name in ARMS:
        arm = armwright.compile_arm(armwright.load_arm(name), device="cuda")
        rate = ROWS / measured(lambda: arm.inverse_dynamics(*inputs, out=out))
        print(f"{name}: {rate:.3g} rows/s, {rate / ceiling:.0%} of what memory allows")


def measured(call: Callable[[], object]) -> float:
    """Return the median of the seconds that a call takes."""
    call()
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


if __name__ == "__main__":
    main()
