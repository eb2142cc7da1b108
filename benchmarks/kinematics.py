"""Tool pose and Jacobian of many configurations, beside Pinocchio's and roboticstoolbox's."""

from measure import in_turn, microseconds, progress, section, table  # isort: skip - sets the threads first

import numpy as np
import pinocchio as pin
import roboticstoolbox as rtb

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.compiled.arm import compile_arm
from armwright.kinematics.forward_kinematics import link_poses
from oracles.with_pinocchio import pinocchio_model

ROWS = 8_000
FEW = 2_000  # for the peers that are called row by row
SLOW = 100
ARMS = ("stanford", "puma560", "ur5")


def toolbox_robot(arm: Arm) -> rtb.DHRobot:
    """Return the arm as roboticstoolbox has it."""
    links = [
        rtb.RevoluteDH(d=j.d, a=j.a, alpha=j.alpha, offset=j.theta)
        if j.revolute
        else rtb.PrismaticDH(theta=j.theta, a=j.a, alpha=j.alpha, offset=j.d)
        for j in arm.joints
    ]
    return rtb.DHRobot(links, name=arm.name)


def compare(name: str) -> list[list[str]]:
    """Return the rows of the table for one arm."""
    progress(f"pose and Jacobian of {name}")
    arm = load_arm(name)
    q = np.random.default_rng(0).uniform(-3, 3, size=(ROWS, arm.n))
    fast = compile_arm(arm).pose_and_jacobian
    model, _, frame = pinocchio_model(arm)
    data = model.createData()
    robot = toolbox_robot(arm)
    chain = robot.ets()
    out = np.empty((ROWS, 4, 4)), np.empty((ROWS, 6, arm.n))

    def pinocchio() -> None:
        for row in q[:FEW]:
            pin.computeJointJacobians(model, data, row)
            pin.updateFramePlacement(model, data, frame)
            pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)

    def pinocchio_least() -> None:
        for row in q[:FEW]:
            pin.computeJointJacobians(model, data, row)

    def toolbox() -> None:
        for row in q[:SLOW]:
            robot.fkine(row)
            robot.jacob0(row)

    def toolbox_chain() -> None:
        for row in q[:FEW]:
            chain.fkine(row)
            chain.jacob0(row)

    np.testing.assert_allclose(robot.fkine(q[0]).A, arm_pose(arm, q[0]), atol=1e-12)
    times = in_turn(pinocchio, pinocchio_least, toolbox, toolbox_chain, lambda: fast(q, out=out), lambda: fast(q))
    each = [x / n for x, n in zip(times, (FEW, FEW, SLOW, FEW, ROWS, ROWS), strict=True)]
    peers = (
        "Pinocchio, `computeJointJacobians`, `updateFramePlacement`, `getFrameJacobian`",
        "Pinocchio, `computeJointJacobians` alone",
        "roboticstoolbox, `DHRobot.fkine`, `.jacob0`",
        "roboticstoolbox, `ETS.fkine`, `.jacob0`",
    )
    own, fresh = each[4:]
    return [
        [f"`{name}`", peer, *map(microseconds, (taken, own, fresh)), f"{taken / own:.0f}"]
        for peer, taken in zip(peers, each, strict=False)
    ]


def arm_pose(arm: Arm, q: np.ndarray) -> np.ndarray:
    """Return the pose of the last link: what roboticstoolbox calls the end, base and tool left out."""
    return np.linalg.inv(arm.base) @ link_poses(arm, q)[-2]


if __name__ == "__main__":
    section(
        "Tool pose and Jacobian of many configurations",
        f"armwright: {ROWS} rows, row-major in and out, with `out=` and into new arrays (352 bytes a row, so memory "
        f"bounds it). The peers take one configuration a call, in a Python loop over {FEW} rows "
        f"(`DHRobot`: {SLOW}).",
        table(
            ["arm", "peer", "peer, µs per row", "armwright, µs per row", "into new arrays", "ratio"],
            [row for name in ARMS for row in compare(name)],
        ),
    )
