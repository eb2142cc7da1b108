"""Derivatives of the dynamics and the regressor of many configurations, beside Pinocchio's functions row by row."""

from measure import compiled_for, in_turn, microseconds, per_call, progress, section, table  # isort: skip - sets the threads first

import attrs
import numpy as np
import pinocchio as pin

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Motor
from oracles.arms import random_arm
from oracles.with_pinocchio import pinocchio_model

ROWS, FEW = 8_000, 500
PEERS = {
    "inverse_dynamics_derivatives": ("computeRNEADerivatives", pin.computeRNEADerivatives),
    "forward_dynamics_derivatives": ("computeABADerivatives", pin.computeABADerivatives),
    "regressor": ("computeJointTorqueRegressor", pin.computeJointTorqueRegressor),
}


def arms() -> list[Arm]:
    """Return arms without drives, which Pinocchio's functions leave out."""
    seven = attrs.evolve(random_arm(np.random.default_rng(1), 7), name="seven skew joints")
    return [attrs.evolve(arm, motors=[Motor()] * arm.n) for arm in (load_arm("puma560"), load_arm("ur5"), seven)]


def compare(arm: Arm, lanes: int) -> list[list[str]]:
    """Return the rows of the table for one arm and one width of the vectors."""
    fast = compiled_for(arm, lanes)
    model, _, _ = pinocchio_model(arm)
    data = model.createData()
    q, qd, third = np.random.default_rng(0).uniform(-2, 2, size=(3, ROWS, arm.n))
    rows = list(zip(q[:FEW], qd[:FEW], third[:FEW], strict=True))
    # What a call of the binding costs that does next to nothing.
    empty = per_call(lambda: pin.computeTotalMass(model, data))[0]
    lines = []
    for name, (title, peer) in PEERS.items():
        progress(f"{name} of {arm.name}, vectors of {lanes}")
        ours = getattr(fast, name)
        out = ours(q, qd, third)

        theirs, own = in_turn(
            lambda peer=peer: [peer(model, data, *row) for row in rows],
            lambda ours=ours, out=out: ours(q, qd, third, out=out, threads=1),
        )
        theirs, own = theirs / FEW, own / ROWS
        lines.append(
            [
                f"`{name}`", f"`{arm.name}`", f"{lanes}", f"`{title}`", microseconds(theirs), microseconds(own),
                f"{theirs / own:.1f}", f"{(theirs - empty) / own:.1f}",
            ]
        )  # fmt: skip
    return lines


if __name__ == "__main__":
    section(
        "Derivatives and regressor of many configurations",
        f"{ROWS} rows, with `out=`; Pinocchio has no call for many, so it is called row by row, {FEW} of them. The "
        "last column leaves out of its time what an empty call of its binding takes. Without drives on both sides.",
        table(
            ["quantity", "arm", "lanes", "Pinocchio", "µs per row", "armwright, µs per row", "ratio", "less a call"],
            [row for lanes in (8, 4) for arm in arms() for row in compare(arm, lanes)],
        ),
    )
