"""All inverse solutions of arms of other classes: by decomposition beside EAIK, by continuation beside descents."""

from measure import in_turn, microseconds, progress, section, table  # isort: skip - sets the threads first

import time

import attrs
import numpy as np
from eaik.IK_HP import HPRobot

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.compiled.arm import compile_arm
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.axes import joint_axes
from armwright.kinematics.inverse_kinematics.numeric import numeric_inverse
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.spatial.poses import homogeneous
from oracles.arms import random_configurations
from oracles.published_arms import bent_wrist, cobra600, iiwa14, jaco, panda, sixteen, skew_shoulder, wx250, xarm6

ROWS, FEW, POSES = 8_000, 2_000, 10


def peer_of(arm: Arm, q: Array) -> HPRobot:
    """Return the arm in EAIK; of seven joints the last is held where it stands in q."""
    axes = joint_axes(arm)
    steps = np.diff(axes.points, axis=0, prepend=np.zeros((1, 3)))
    links = np.concatenate([steps, [axes.X_BT[:3, 3] - axes.points[-1]]])
    return HPRobot(axes.directions, links, *([[(6, float(q[6]))]] if arm.n == 7 else []))


def decomposed(arm: Arm) -> list[str]:
    """Return the row of an arm with a closed form."""
    progress(f"all branches of {arm.name}")
    q = random_configurations(arm, np.random.default_rng(0), ROWS)
    q[:, 6:] = 0.3
    fast = compile_arm(arm)
    X = forward(arm, q)
    own = [lambda: fast.inverse_branches(X, q, threads=1)]
    count, n = fast.inverse_branches(X[:1], q[:1])[0].shape[1:]
    if arm.n < 6:
        return [f"`{arm.name}`", f"{count} of {n}", "", microseconds(in_turn(*own)[0] / ROWS), ""]
    peer, zero = peer_of(arm, q[0]), joint_axes(arm).X_BT[:3, :3]
    poses = [homogeneous(x[:3, :3] @ zero.T, x[:3, 3]) for x in X[:FEW]]

    def batched() -> None:
        for solution in peer.IK_batched(poses, num_worker_threads=1):
            _ = solution.Q

    theirs, ours = in_turn(batched, *own)
    theirs, ours = theirs / FEW, ours / ROWS
    return [f"`{arm.name}`", f"{count} of {n}", microseconds(theirs), microseconds(ours), f"{theirs / ours:.0f}"]


def continued(arm: Arm) -> list[str]:
    """Return the row of an arm of six joints without a closed form."""
    progress(f"all solutions of {arm.name}")
    poses = forward(arm, random_configurations(arm, np.random.default_rng(0), POSES))
    near = np.zeros(6)
    inverse(arm, poses[0], near)
    found, times = [], []
    for solve in (inverse, numeric_inverse):
        start = time.perf_counter()
        found.append(sum(len(solve(arm, X, near).branches) for X in poses))
        times.append((time.perf_counter() - start) / POSES)
    ours, theirs = (f"{1e3 * t:.0f}" for t in times)
    return [f"`{arm.name}`", str(found[0]), ours, str(found[1]), theirs]


if __name__ == "__main__":
    no_limits = [attrs.evolve(arm, tool=np.eye(4)) for arm in (xarm6(), jaco(), sixteen())]
    section(
        "All inverse solutions of arms of other classes",
        f"armwright: {ROWS} poses, one thread; EAIK: {FEW}, which has seven joints with the last one held, and neither "
        "slides nor fewer than six joints.",
        table(
            ["arm", "branches and joints", "EAIK, µs per pose", "armwright, µs per pose", "ratio"],
            [decomposed(arm) for arm in (bent_wrist(), skew_shoulder(), panda(), iiwa14(), wx250(), cobra600())],
        )
        + f"\n\nSix joints without a closed form, {POSES} poses, one at a time: continuation, and damped least squares "
        "from many starts.\n\n"
        + table(
            ["arm", "solutions by continuation", "ms per pose", "by descents", "ms per pose"],
            [continued(arm) for arm in no_limits],
        ),
    )
