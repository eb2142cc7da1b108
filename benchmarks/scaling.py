"""How the time grows with the number of configurations and of joints, and what memory it takes (Linux)."""

from measure import REPEATS, in_turn, microseconds, per_call, progress, section, table  # isort: skip - sets the threads first

import os
import subprocess
import sys
import tempfile
import time

import numpy as np
import pinocchio as pin

from armwright.arm.load import load_arm
from armwright.compiled.arm import compile_arm
from oracles.arms import random_arm
from oracles.with_pinocchio import pinocchio_model

SIZES = (1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000)
JOINTS = (2, 3, 4, 6, 8, 12, 16, 24, 32, 50)
ROWS = 20_000


def by_rows() -> list[list[str]]:
    """Return the time of the PUMA's inverse dynamics for 1 to 10 million rows."""
    arm = load_arm("puma560")
    fast = compile_arm(arm).inverse_dynamics
    model, _, _ = pinocchio_model(arm)
    pool = pin.ModelPool(model)
    rows = []
    for size in SIZES:
        progress(f"{size} rows")
        q, qd, qdd = np.random.default_rng(0).uniform(-3, 3, size=(3, size, arm.n))
        columns, out = np.empty((arm.n, size), order="F"), np.empty((size, arm.n))
        works = (
            lambda q=q, qd=qd, qdd=qdd, c=columns: pin.rneaInParallel(1, pool, q.T, qd.T, qdd.T, c),
            lambda q=q, qd=qd, qdd=qdd, out=out: fast(q, qd, qdd, out=out),
            lambda q=q, qd=qd, qdd=qdd: fast(q, qd, qdd),
        )
        calls = max(1, 20_000 // size)
        repeats = REPEATS if size < 10**7 else 3
        peer, own, fresh = (x / size for x in per_call(*works, calls=calls, repeats=repeats))
        rows.append([f"{size}", *map(microseconds, (peer, own, fresh)), f"{peer / min(own, fresh):.1f}"])
    return rows


def by_joints() -> list[list[str]]:
    """Return the time of inverse dynamics for arms of 2 to 50 joints, and what the first call costs."""
    rows = []
    rng = np.random.default_rng(1)
    for joints in JOINTS:
        progress(f"{joints} joints")
        arm = random_arm(rng, joints)
        with tempfile.TemporaryDirectory() as cache:
            os.environ["ARMWRIGHT_CACHE"] = cache
            start = time.perf_counter()
            compiled = compile_arm(arm)
            fast = compiled.inverse_dynamics
            q, qd, qdd = rng.uniform(-3, 3, size=(3, ROWS, joints))
            fast(q[:2], qd[:2], qdd[:2])
            first = time.perf_counter() - start
        model, _, _ = pinocchio_model(arm)
        pool = pin.ModelPool(model)
        columns, out = np.empty((joints, ROWS), order="F"), np.empty((ROWS, joints))
        peer, own = in_turn(
            lambda: pin.rneaInParallel(1, pool, q.T, qd.T, qdd.T, columns), lambda: fast(q, qd, qdd, out=out)
        )
        operations = sum(compiled.kernel("inverse_dynamics").emitted.operations.values())
        rows.append(
            [
                f"{joints}", f"{operations}", microseconds(peer / ROWS), microseconds(own / ROWS),
                f"{peer / own:.1f}", f"{first:.1f}",
            ]
        )  # fmt: skip
    return rows


_MEMORY = """
import sys
from pathlib import Path
import numpy as np
from armwright.arm.load import load_arm
from armwright.compiled.arm import compile_arm
fast = compile_arm(load_arm("puma560")).inverse_dynamics
q = np.zeros((2, 6))
fast(q, q, q)
def most():
    status = Path("/proc/self/status").read_text()
    return next(line.split()[1] for line in status.splitlines() if line.startswith("VmHWM"))
before = most()
q = np.ones((int(sys.argv[1]), 6))
tau = fast(q, q, q)
print(before, most())
"""


def memory() -> list[list[str]]:
    """Return the greatest memory of a process that does nothing else."""
    rows = []
    for size in (1, 1_000_000):
        done = subprocess.run([sys.executable, "-c", _MEMORY, str(size)], stdout=subprocess.PIPE, text=True, check=True)
        before, after = (int(x) / 1024 for x in done.stdout.split())
        arrays = 2 * size * 6 * 8 / 2**20
        rows.append([f"{size}", f"{before:.0f}", f"{after:.0f}", f"{arrays:.0f}"])
    return rows


if __name__ == "__main__":
    section(
        "Growth with the number of configurations",
        "Inverse dynamics of `puma560`, with `out=` and into a new array; the ratio is that of the better.",
        table(
            ["rows", "Pinocchio `rneaInParallel`, µs per row", "armwright, µs per row", "into a new array", "ratio"],
            by_rows(),
        ),
    )
    section(
        "Growth with the number of joints",
        f"Inverse dynamics of random arms with nothing at a right angle, {ROWS} rows, with `out=`; the first call "
        "with an empty cache. From 8 joints on the code of a kernel, which is one straight line, outgrows the 32 KiB "
        "of a first-level instruction cache (23 KiB for 6 joints, 34 for 8, 44 for 12), and fetching it takes longer "
        "than running it.",
        table(
            ["joints", "operations", "Pinocchio, µs per row", "armwright, µs per row", "ratio", "first call, s"],
            by_joints(),
        ),
    )
    section(
        "Memory",
        "Of a process that computes inverse dynamics of `puma560`: beyond the arrays at the door there is nothing "
        "that grows.",
        table(["rows", "after the first call, MiB", "at most, MiB", "of it the arrays, MiB"], memory()),
    )
