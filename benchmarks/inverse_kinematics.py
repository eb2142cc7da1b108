"""All closed-form solutions of many poses, beside EAIK's and roboticstoolbox's."""

from measure import in_turn, microseconds, progress, section, table  # isort: skip - sets the threads first

import numpy as np
import roboticstoolbox as rtb
from eaik.IK_DH import DhRobot

from armwright.arm.load import load_arm
from armwright.compiled.arm import compile_arm
from armwright.kinematics.forward_kinematics import link_poses

ROWS = 8_000
FEW = 5_000
SLOW = 100
ARMS = ("puma560", "ur5")


def compare(name: str) -> list[list[str]]:
    """Return the rows of the table for one arm."""
    progress(f"all branches of {name}")
    arm = load_arm(name)
    q = np.random.default_rng(0).uniform(-2.5, 2.5, size=(ROWS, arm.n))
    fast = compile_arm(arm)
    X = fast.forward(q)
    near = np.zeros((ROWS, arm.n))
    # EAIK has neither base nor tool nor offsets of the joint angles: it gets the pose of the last link.
    frames = link_poses(arm, q[:FEW])
    flange = list(np.linalg.inv(frames[:, 0]) @ frames[:, -2])
    peer = DhRobot(*(np.array([getattr(j, key) for j in arm.joints]) for key in ("alpha", "a", "d")))
    angles = q[0] + [j.theta for j in arm.joints]
    np.testing.assert_allclose(peer.fwdKin(angles), flange[0], atol=1e-12)
    out = np.empty((ROWS, 8, 6)), np.empty((ROWS, 8), dtype=bool)
    own = [lambda: fast.inverse_branches(X, near, out=out), lambda: fast.inverse_branches(X, near)]

    def batched() -> None:
        for solution in peer.IK_batched(flange, num_worker_threads=1):
            _ = solution.Q

    works, counts, titles = [batched], [FEW], ["EAIK, `IK_batched` on one thread, and its `Q`"]
    if name == "puma560":
        robot = rtb.models.DH.Puma560()
        poses = [robot.fkine(row) for row in q[:SLOW]]

        def toolbox() -> None:
            for pose in poses:
                robot.ikine_a(pose)

        works.append(toolbox)
        counts.append(SLOW)
        titles.append("roboticstoolbox, `ikine_a` (one solution)")
    times = [t / n for t, n in zip(in_turn(*works, *own), [*counts, ROWS, ROWS], strict=True)]
    return [
        [f"`{name}`", title, microseconds(t), microseconds(times[-2]), microseconds(times[-1]), f"{t / times[-2]:.0f}"]
        for title, t in zip(titles, times, strict=False)
    ]


if __name__ == "__main__":
    section(
        "All inverse solutions of many poses",
        f"armwright: {ROWS} poses, eight solutions each with a flag for a free joint, angles within half a "
        f"revolution of a given configuration; EAIK: {FEW} poses; `ikine_a`: {SLOW}, on its own PUMA.",
        table(
            ["arm", "peer", "peer, µs per pose", "armwright, µs per pose", "into new arrays", "ratio"],
            [row for name in ARMS for row in compare(name)],
        ),
    )
