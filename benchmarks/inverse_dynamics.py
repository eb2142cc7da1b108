"""Inverse dynamics of many configurations: Pinocchio and armwright on the same rows, one core each.

Run with `make bench`. Prints the median time per configuration of each and the ratio, and writes them to results.md.
"""

import os
import platform
import statistics
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import pinocchio as pin

from armwright.arm.load import load_arm
from armwright.dynamics.quantities import compile_quantity
from oracles.with_pinocchio import pinocchio_model

ROWS = 200_000
REPEATS = 9
ARMS = ("stanford-jpl", "puma560", "ur5")
RESULTS = Path(__file__).parent / "results.md"


def median_time(work: Callable[[], object]) -> float:
    """Return the median time of ``REPEATS`` runs, after one to warm up [s]."""
    work()
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def compare(name: str) -> tuple[float, float]:
    """Return the time per row of Pinocchio and of armwright for one arm [µs]."""
    arm = load_arm(name)
    q, qd, qdd = np.random.default_rng(0).uniform(-3, 3, size=(3, ROWS, arm.n))
    ours = compile_quantity(arm, "inverse_dynamics")
    model, _, _ = pinocchio_model(arm)
    model.armature = np.array([motor.inertia for motor in arm.motors])
    pool = pin.ModelPool(model)
    result = np.empty((arm.n, ROWS), order="F")
    theirs_time = median_time(lambda: pin.rneaInParallel(1, pool, q.T, qd.T, qdd.T, result))
    ours_time = median_time(lambda: ours(q, qd, qdd))
    return 1e6 * theirs_time / ROWS, 1e6 * ours_time / ROWS


def processor() -> str:
    """Return the name of the processor, as far as the system tells it."""
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.processor()


def main() -> None:
    """Measure, print and write."""
    lines = [
        "# Measured",
        "",
        f"`make bench` on {processor()}, Python {platform.python_version()}, Pinocchio {pin.__version__}.",
        f"Inverse dynamics of {ROWS} rows, row-major in and out, one core each, median of {REPEATS} runs.",
        "",
        "| arm | Pinocchio `rneaInParallel`, µs per row | armwright, µs per row | ratio |",
        "|---|---|---|---|",
    ]
    for name in ARMS:
        theirs, ours = compare(name)
        lines.append(f"| `{name}` | {theirs:.3f} | {ours:.4f} | {theirs / ours:.1f} |")
        print(lines[-1])
    RESULTS.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
