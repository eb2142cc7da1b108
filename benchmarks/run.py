"""Run the benchmarks, each in a process of its own, and write results.md. Run with `make bench`.

With names, such as `python benchmarks/run.py dynamics latency`, only those are run, and only printed.
"""

import platform
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path

from measure import REPEATS, processor

HERE = Path(__file__).parent
ALL = (
    "dynamics",
    "derivatives",
    "kinematics",
    "inverse_kinematics",
    "inverse_classes",
    "one_call",
    "c_text",
    "scaling",
    "latency",
    "simulation",
    "physics",
    "motion_lines",
    "motion_path",
    "motion_knots",
    "motion_online",
    "language",
    "export",
    "play",
    "calibration",
    "studio",
    "studio_page",
)
PEERS = (
    "pin",
    "roboticstoolbox-python",
    "eaik",
    "casadi",
    "ruckig",
    "toppra",
    "lark",
    "exudyn",
    "pybotics",
    "numpy",
    "numba",
    "scipy",
)


def main() -> None:
    """Run what is asked for."""
    names = sys.argv[1:] or ALL
    sections = []
    for name in names:
        print(f"{name}:", file=sys.stderr, flush=True)
        start = time.perf_counter()
        done = subprocess.run([sys.executable, HERE / f"{name}.py"], stdout=subprocess.PIPE, text=True, check=True)
        sections.append(done.stdout.strip())
        print(sections[-1], f"  ({time.perf_counter() - start:.0f} s)", sep="\n", flush=True)
    if sys.argv[1:]:
        return
    versions = ", ".join(f"{peer} {version(peer)}" for peer in PEERS)
    how = (
        f"By `make bench` on {processor()}, Python {platform.python_version()}, {versions}. Everything on one core; "
        f"the peer and armwright in turn in one process, on the same numbers; medians of {REPEATS} rounds."
    )
    (HERE / "results.md").write_text("\n\n".join(["# Measured", how, *sections]) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
