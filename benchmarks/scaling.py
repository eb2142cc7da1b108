"""How the time grows with the number of configurations and of joints, and what memory it takes (Linux)."""

from measure import REPEATS, compiled_for, in_turn, microseconds, per_call, progress, section, table  # isort: skip - sets the threads first

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
ROWS = 8_000


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
    """Return the time of inverse and forward dynamics for arms of 2 to 50 joints, and what the first call costs."""
    works = {"inverse_dynamics": pin.rneaInParallel, "forward_dynamics": pin.abaInParallel}
    rows = []
    for name, theirs in works.items():
        rng = np.random.default_rng(1)
        for joints in JOINTS:
            progress(f"{name} of {joints} joints")
            arm = random_arm(rng, joints)
            q, qd, x = rng.uniform(-3, 3, size=(3, ROWS, joints))
            with tempfile.TemporaryDirectory() as cache:
                os.environ["ARMWRIGHT_CACHE"] = cache
                start = time.process_time()
                fast = getattr(compiled_for(arm, 8), name)
                fast(q[:2], qd[:2], x[:2])
                first = time.process_time() - start
            model, _, _ = pinocchio_model(arm)
            pool = pin.ModelPool(model)
            columns, out = np.empty((joints, ROWS), order="F"), np.empty((ROWS, joints))
            narrow = getattr(compiled_for(arm, 4), name)
            peer, own, of_four = in_turn(
                lambda pool=pool, a=(q.T, qd.T, x.T), c=columns, theirs=theirs: theirs(1, pool, *a, c),
                lambda a=(q, qd, x), out=out, fast=fast: fast(*a, out=out, threads=1),
                lambda a=(q, qd, x), out=out, narrow=narrow: narrow(*a, out=out, threads=1),
            )
            times = map(microseconds, (peer / ROWS, own / ROWS))
            ratios = (f"{peer / own:.1f}", f"{peer / of_four:.1f}")
            rows.append([f"`{name}`", f"{joints}", *times, *ratios, f"{first:.2f}"])
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
        f"Random arms with nothing at a right angle, {ROWS} rows, with `out=`; the first call with an empty cache. The "
        "code of long arms is a loop over the links: inverse dynamics from some 11 joints on, forward dynamics from "
        "some 19.",
        table(
            [
                "work",
                "joints",
                "Pinocchio, µs per row",
                "armwright, µs per row",
                "ratio",
                "lanes of 4",
                "first call, s",
            ],
            by_joints(),
        ),
    )
    section(
        "Memory",
        "Of a process that computes inverse dynamics of `puma560`: beyond the arrays at the door there is nothing "
        "that grows.",
        table(["rows", "after the first call, MiB", "at most, MiB", "of it the arrays, MiB"], memory()),
    )
