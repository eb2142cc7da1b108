"""What a start costs: the import, the command line, the first call with and without a cache."""

from measure import progress, section, table  # isort: skip - sets the threads first

import os
import statistics
import subprocess
import sys
import tempfile
import time

REPEATS = 5
_CALL = """
import time
import numpy as np
from armwright.arm.load import load_arm
from armwright.compiled.arm import compile_arm
arm = load_arm("puma560")
start = time.perf_counter()
fast = compile_arm(arm)
function = getattr(fast, {name!r})
inputs = [np.zeros((*{lead}, *shape)) for shape in fast.kernel({name!r}).emitted.inputs.values()]
function(*inputs)
print(time.perf_counter() - start)
"""


def whole(*command: str) -> float:
    """Return the median time of a process [s]."""
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        subprocess.run([sys.executable, *command], check=True, stdout=subprocess.DEVNULL)
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def first_call(name: str, lead: tuple[int, ...]) -> tuple[float, float]:
    """Return the time of the first call in a process, with an empty cache and with a full one [s]."""
    progress(f"first call of {name}")
    script = _CALL.format(name=name, lead=lead)
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "ARMWRIGHT_CACHE": cache}

        def run() -> float:
            done = subprocess.run(
                [sys.executable, "-c", script], env=environment, stdout=subprocess.PIPE, text=True, check=True
            )
            return float(done.stdout)

        return run(), statistics.median(run() for _ in range(REPEATS))


def main() -> None:
    """Measure and print."""
    empty = whole("-c", "pass")
    starts = [
        ["`python -c pass`", f"{empty:.3f}"],
        ["`import armwright`", f"{whole('-c', 'import armwright'):.3f}"],
        ["`import pinocchio`", f"{whole('-c', 'import pinocchio'):.3f}"],
        ["`import roboticstoolbox`", f"{whole('-c', 'import roboticstoolbox'):.3f}"],
        ["`armwright --help`", f"{whole('-m', 'armwright', '--help'):.3f}"],
        ["`armwright arms`", f"{whole('-m', 'armwright', 'arms'):.3f}"],
    ]
    section("Starting", "Whole processes.", table(["process", "s"], starts))
    calls = []
    for name in ("forward", "pose_and_jacobian", "inverse_dynamics", "forward_dynamics", "inverse_branches"):
        for what, lead in (("one configuration", ()), ("many", (2,))):
            cold, warm = first_call(name, lead)
            calls.append([f"`{name}`", what, f"{cold:.2f}", f"{warm:.2f}"])
    section(
        "First call",
        "Of `puma560` in a new process, the loading of the compiler included, once with an empty cache and then with "
        "what that left.",
        table(["function", "for", "empty cache, s", "full cache, s"], calls),
    )


if __name__ == "__main__":
    main()
