"""How the benchmarks measure: one core, the two in turn, medians; and how they write it down."""

import os
import platform
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

# Before NumPy is loaded: one thread, and one core for everything this process starts.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"
if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})

REPEATS = 9


def in_turn(*works: Callable[[], object], repeats: int = REPEATS) -> list[float]:
    """Return the median time of each work [s]: all of them in every round, after one round to warm up."""
    times: list[list[float]] = [[] for _ in works]
    for round_number in range(repeats + 1):
        for work, taken in zip(works, times, strict=True):
            start = time.perf_counter()
            work()
            if round_number:
                taken.append(time.perf_counter() - start)
    return [statistics.median(taken) for taken in times]


def per_call(*works: Callable[[], object], calls: int = 5000, repeats: int = REPEATS) -> list[float]:
    """Return the median time of one call of each work [s], from rounds of ``calls`` calls."""

    def many(work: Callable[[], object]) -> Callable[[], None]:
        def run() -> None:
            for _ in range(calls):
                work()

        return run

    return [taken / calls for taken in in_turn(*map(many, works), repeats=repeats)]


_HOST: dict[str, Any] = {}


def compiled_for(arm: Any, lanes: int) -> Any:
    """Return an arm compiled for vectors of 8 numbers (AVX-512) or of 4, as for a processor with AVX2 and FMA alone.

    What is called for the first time before the next call of this function is compiled for that processor.
    """
    from armwright.compiled.arm import CompiledArm  # noqa: PLC0415 - behind the setting of the threads
    from armwright.tracing import kernel, native  # noqa: PLC0415
    from armwright.tracing.emit_llvm import Target  # noqa: PLC0415

    host = _HOST.setdefault("it", native.processor())
    made_for = host if lanes >= host.target.lanes else native.Processor("haswell", "", Target(lanes, has_fma=True))
    native.processor = kernel.processor = lambda: made_for
    native.surroundings = lambda: ""  # what this machine has compiled for itself is not to be found
    return CompiledArm(arm=arm)


def table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Return a Markdown table."""
    lines = [head, ["---"] * len(head), *[[str(cell) for cell in row] for row in rows]]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def section(title: str, *parts: str) -> None:
    """Print a section of the results."""
    print("\n\n".join([f"## {title}", *parts, ""]), flush=True)


def progress(text: str) -> None:
    """Tell who watches what is being measured."""
    print(f"  {text}", file=sys.stderr, flush=True)


def microseconds(seconds: float) -> str:
    """Return a time in µs with three digits."""
    return f"{seconds * 1e6:.3g}"


def processor() -> str:
    """Return the name of the processor, as far as the system tells it."""
    information = Path("/proc/cpuinfo")
    if information.exists():
        for line in information.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
