"""Inverse and forward dynamics of many configurations, beside Pinocchio's parallel functions on one thread."""

from measure import compiled_for, in_turn, microseconds, progress, section, table  # isort: skip - sets the threads first

import numpy as np
import pinocchio as pin

from armwright.arm.load import load_arm
from oracles.with_pinocchio import pinocchio_model

# What counts is a batch that fits the caches; the smaller and the larger one stand beside it.
ROWS = (8_000, 2_000, 200_000)
# All arms of the catalogue with six joints and known masses.
ARMS = ("stanford-jpl", "puma560", "ur5")


def compare(name: str, lanes: int) -> list[list[str]]:
    """Return the rows of the table for one arm and one width of the vectors."""
    arm = load_arm(name)
    fast = compiled_for(arm, lanes)
    model, _, _ = pinocchio_model(arm)
    model.armature = np.array([motor.inertia for motor in arm.motors])
    pool = pin.ModelPool(model)
    lines = []
    for work, theirs, ours in (
        ("inverse dynamics", pin.rneaInParallel, fast.inverse_dynamics),
        ("forward dynamics", pin.abaInParallel, fast.forward_dynamics),
    ):
        progress(f"{work} of {name}, vectors of {lanes}")
        cells, ratios = [], []
        for rows in ROWS:
            q, qd, qdd = np.random.default_rng(0).uniform(-3, 3, size=(3, rows, arm.n))
            columns, out = np.empty((arm.n, rows), order="F"), np.empty((rows, arm.n))
            repeats = 9 if rows > 100_000 else 51
            peer, own, fresh = in_turn(
                lambda a=(q.T, qd.T, qdd.T), c=columns, theirs=theirs: theirs(1, pool, *a, c),
                lambda a=(q, qd, qdd), out=out, ours=ours: ours(*a, out=out, threads=1),
                lambda a=(q, qd, qdd), ours=ours: ours(*a, threads=1),
                repeats=repeats,
            )
            if rows == ROWS[0]:
                cells = [microseconds(x / rows) for x in (peer, own, fresh)]
            ratios.append(f"{peer / own:.1f}")
        lines.append([work, f"`{name}`", f"{lanes}", *cells, *ratios])
    return lines


if __name__ == "__main__":
    section(
        "Dynamics of many configurations",
        f"(N, n) row-major in and out, N = {ROWS[0]}; Pinocchio writes into an array at hand, so the ratio is taken "
        f"with `out=`; the last columns are the ratios at N = {ROWS[1]} and {ROWS[2]}. Vectors of 4 are what a "
        "processor with AVX2 has, forced here. Rotor inertia counts on both sides; friction, which Pinocchio leaves "
        "out, on ours only.",
        table(
            [
                "work", "arm", "lanes", "Pinocchio, µs per row", "armwright, µs per row", "into a new array",
                "ratio", f"N = {ROWS[1]}", f"N = {ROWS[2]}",
            ],
            [row for lanes in (8, 4) for name in ARMS for row in compare(name, lanes)],
        ),
    )  # fmt: skip
