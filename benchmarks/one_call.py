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
    for work, theirs, ours, inputs in (
        ("inverse dynamics", lambda: pin.rnea(model, data, q, qd, x), fast.inverse_dynamics, (q, qd, x)),
        ("forward dynamics", lambda: pin.aba(model, data, q, qd, x), fast.forward_dynamics, (q, qd, x)),
        ("mass matrix", lambda: pin.crba(model, data, q), fast.mass_matrix, (q,)),
        ("pose and Jacobian", pose_and_jacobian, fast.pose_and_jacobian, (q,)),
    ):
        out = ours(*inputs)
        peer, own, fresh = per_call(
            theirs,
            lambda ours=ours, inputs=inputs, out=out: ours(*inputs, out=out),
            lambda ours=ours, inputs=inputs: ours(*inputs),
        )
        times = map(microseconds, (peer, own, fresh))
        rows.append([work, f"`{name}`", *times, f"{own / peer:.2f}", f"{fresh / peer:.2f}"])
    return rows


if __name__ == "__main__":
    section(
        "One call from Python",
        "One configuration a call, the result in an array at hand or in a new one on our side, in Pinocchio's data on "
        "theirs; then our time in parts of theirs.",
        table(
            ["work", "arm", "Pinocchio, µs", "armwright, `out=`, µs", "new array, µs", "part, `out=`", "part, new"],
            [row for name in ARMS for row in compare(name)],
        ),
    )
