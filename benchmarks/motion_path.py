"""A Cartesian move through a thousand poses, beside roboticstoolbox's numeric inverse at as many samples."""

from measure import in_turn, progress, section, table  # isort: skip - sets the threads first

import numpy as np

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.compiled.arm import compile_arm
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.moves import cartesian_move
from armwright.spatial.rotations import rotation_from_vector
from kinematics import toolbox_robot

POSES = 1000
TIMES = np.linspace(0, 20, POSES)
START = np.array([0.6, 0.2, 0.6, 0.3, 0.9, 0.1])


def wavy(X: Array) -> Array:
    """Return poses on a path of half a metre that swings to all sides and turns the hand."""
    s = np.linspace(0, 1, POSES)
    none = np.zeros(POSES)
    poses = np.repeat(X[None], POSES, axis=0)
    poses[:, :3, 3] += np.stack([0.05 * np.sin(6 * np.pi * s), -0.4 * s, -0.1 * np.sin(4 * np.pi * s)], axis=1)
    turns = rotation_from_vector(np.stack([0.3 * np.sin(3 * s), 0.2 * np.cos(5 * s) - 0.2, none], axis=1))
    poses[:, :3, :3] = poses[:, :3, :3] @ turns
    return poses


def main() -> None:
    """Measure and print."""
    progress("a path through a thousand poses")
    arm = load_arm("puma560")
    fast = compile_arm(arm)
    poses = wavy(forward(arm, START))
    move = cartesian_move(fast, poses, TIMES)
    if move.tool_path is None or move.certificate is None:
        raise SystemExit("a Cartesian move plans a path of the hand")
    samples = move.tool_path(move.trajectory.times)
    robot = toolbox_robot(arm)

    def numeric() -> None:
        q = move.trajectory(0.0)
        for X in samples:
            q = robot.ikine_LM(X, q0=q, tol=1e-10).q

    ours, plain, theirs = in_turn(
        lambda: cartesian_move(fast, poses, TIMES), lambda: cartesian_move(arm, poses, TIMES), numeric, repeats=3
    )
    section(
        "A Cartesian move through a thousand poses",
        f"`puma560`, 0.5 m, 20 s. armwright: `cartesian_move`, blends of place and orientation at every pose, "
        f"{len(samples)} knots, the hand within {move.certificate.deviation * 1e3:.4f} mm of its planned path, a bound "
        "that holds between the knots. roboticstoolbox: `ikine_LM` from one of these knots to the next, and nothing "
        "else.",
        table(
            ["planner", "ms", "ratio"],
            [
                ["roboticstoolbox", f"{theirs * 1e3:.0f}", ""],
                ["armwright, compiled", f"{ours * 1e3:.1f}", f"{theirs / ours:.0f}"],
                ["armwright, plain", f"{plain * 1e3:.1f}", f"{theirs / plain:.0f}"],
            ],
        ),
    )


if __name__ == "__main__":
    main()
