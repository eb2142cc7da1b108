"""Inverse and forward dynamics of many configurations, beside Pinocchio's parallel functions on one thread."""

from measure import in_turn, microseconds, progress, section, table  # isort: skip - sets the threads first

import numpy as np
import pinocchio as pin

from armwright.arm.load import load_arm
from armwright.compiled.arm import compile_arm
from oracles.with_pinocchio import pinocchio_model

ROWS = 200_000
ARMS = ("stanford-jpl", "puma560", "ur5")


def compare(name: str) -> list[list[str]]:
    """Return the rows of the table for one arm."""
    arm = load_arm(name)
    q, qd, qdd = np.random.default_rng(0).uniform(-3, 3, size=(3, ROWS, arm.n))
    fast = compile_arm(arm)
    model, _, _ = pinocchio_model(arm)
    model.armature = np.array([motor.inertia for motor in arm.motors])
    pool = pin.ModelPool(model)
    columns, rows = np.empty((arm.n, ROWS), order="F"), np.empty((ROWS, arm.n))
    lines = []
    for work, theirs, ours in (
        ("inverse dynamics", pin.rneaInParallel, fast.inverse_dynamics),
        ("forward dynamics", pin.abaInParallel, fast.forward_dynamics),
    ):
        progress(f"{work} of {name}")
        peer, own, fresh = in_turn(
            lambda theirs=theirs: theirs(1, pool, q.T, qd.T, qdd.T, columns),
            lambda ours=ours: ours(q, qd, qdd, out=rows),
            lambda ours=ours: ours(q, qd, qdd),
        )
        times = [microseconds(x / ROWS) for x in (peer, own, fresh)]
        lines.append([work, f"`{name}`", *times, f"{peer / own:.1f}", f"{peer / fresh:.1f}"])
    return lines


if __name__ == "__main__":
    section(
        "Dynamics of many configurations",
        f"{ROWS} rows, (N, n) row-major in and out. Pinocchio writes into an array at hand, so the ratio is taken with "
        "`out=`; the last two columns are for a new array, whose pages the system has to hand out first. Rotor "
        "inertia counts on both sides; friction, which Pinocchio leaves out, on ours only.",
        table(
            ["work", "arm", "Pinocchio, µs per row", "armwright, µs per row", "into a new array", "ratio", "new array"],
            [row for name in ARMS for row in compare(name)],
        ),
    )
