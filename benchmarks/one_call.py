"""One call from Python with one configuration, beside Pinocchio's."""

from measure import microseconds, per_call, progress, section, table  # isort: skip - sets the threads first

import numpy as np
import pinocchio as pin

from armwright.arm.load import load_arm
from armwright.compiled.arm import compile_arm
from oracles.with_pinocchio import pinocchio_model

ARMS = ("stanford-jpl", "puma560", "ur5")


def compare(name: str) -> list[list[str]]:
    """Return the rows of the table for one arm."""
    progress(f"one call, {name}")
    arm = load_arm(name)
    q, qd, x = np.random.default_rng(0).uniform(-2, 2, size=(3, arm.n))
    fast = compile_arm(arm)
    model, _, frame = pinocchio_model(arm)
    data = model.createData()

    def pose_and_jacobian() -> None:
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacement(model, data, frame)
        pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)

    rows = []
    for work, theirs, ours in (
        ("inverse dynamics", lambda: pin.rnea(model, data, q, qd, x), lambda: fast.inverse_dynamics(q, qd, x)),
        ("forward dynamics", lambda: pin.aba(model, data, q, qd, x), lambda: fast.forward_dynamics(q, qd, x)),
        ("mass matrix", lambda: pin.crba(model, data, q), lambda: fast.mass_matrix(q)),
        ("pose and Jacobian", pose_and_jacobian, lambda: fast.pose_and_jacobian(q)),
    ):
        peer, own = per_call(theirs, ours)
        rows.append([work, f"`{name}`", microseconds(peer), microseconds(own), f"{peer / own:.2f}"])
    return rows


if __name__ == "__main__":
    section(
        "One call from Python",
        "One configuration a call, the result in a new array on our side, in Pinocchio's data on theirs. Of our time "
        "the kernel itself takes 0.1 to 0.4 µs; the rest is Python, the passing of arrays and a new array.",
        table(
            ["work", "arm", "Pinocchio, µs", "armwright, µs", "ratio"],
            [row for name in ARMS for row in compare(name)],
        ),
    )
