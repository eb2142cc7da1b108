"""A straight line of half a metre to a tenth of a millimetre, beside roboticstoolbox's Cartesian trajectory."""

from measure import in_turn, progress, section, table  # isort: skip - sets the threads first

from itertools import pairwise

import numpy as np
import roboticstoolbox as rtb
from spatialmath import SE3

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.compiled.arm import compile_arm
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.straight import straight_line
from kinematics import toolbox_robot

DEVIATION = 1e-4
START = np.array([0.6, -0.3, 0.9, 0.3, 0.9, 0.1])
WAY = (0.1, -0.4, -0.28)


def deviation_of_samples(q: Array, X: Array, Y: Array) -> float:
    """Return how far the hand strays from the line when the joints go straight from sample to sample [m]."""
    t = np.linspace(0, 1, 20)[:, None]
    between = np.concatenate([a + t * (b - a) for a, b in pairwise(q)])
    come, way = forward(load_arm("puma560"), between)[:, :3, 3] - X[:3, 3], Y[:3, 3] - X[:3, 3]
    s = np.clip(come @ way / (way @ way), 0, 1)
    return float(np.linalg.norm(come - s[:, None] * way, axis=-1).max())


def main() -> None:
    """Measure and print."""
    progress("straight line")
    arm = load_arm("puma560")
    fast = compile_arm(arm)
    X = forward(arm, START)
    Y = X.copy()
    Y[:3, 3] += WAY
    robot = toolbox_robot(arm)
    A, B = SE3(X, check=False), SE3(Y, check=False)

    def numeric(samples: int) -> Array:
        q, rows = START, []
        for T in rtb.ctraj(A, B, samples):
            q = robot.ikine_LM(T, q0=q, tol=1e-10).q
            rows.append(q)
        return np.array(rows)

    samples = next(n for n in range(10, 2000, 10) if deviation_of_samples(numeric(n), X, Y) <= DEVIATION)
    ours, plain, theirs = in_turn(
        lambda: straight_line(fast, START, Y, deviation=DEVIATION),
        lambda: straight_line(arm, START, Y, deviation=DEVIATION),
        lambda: numeric(samples),
    )
    certificate = straight_line(fast, START, Y, deviation=DEVIATION).certificate
    section(
        "A straight line to a tenth of a millimetre",
        f"`puma560`, {np.linalg.norm(WAY):.2f} m. roboticstoolbox: `ctraj` of as many samples as keep the hand within "
        f"the deviation when the joints go straight from one to the next, {samples} of them, found by trial, and "
        "`ikine_LM` from sample to sample; no times, no limits, no bound between samples. armwright: "
        f"`straight_line`, {certificate.knots} knots, limits of speed, acceleration and effort kept, and a certificate "
        f"({certificate.deviation * 1e3:.3f} mm).",
        table(
            ["planner", "ms", "ratio"],
            [
                ["roboticstoolbox", f"{theirs * 1e3:.1f}", ""],
                ["armwright, compiled", f"{ours * 1e3:.2f}", f"{theirs / ours:.0f}"],
                ["armwright, plain", f"{plain * 1e3:.2f}", f"{theirs / plain:.0f}"],
            ],
        ),
    )


if __name__ == "__main__":
    main()
