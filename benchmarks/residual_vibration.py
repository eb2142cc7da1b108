"""What shapers and flat feedforward leave of the vibration of two arms of six joints: random moves, seed fixed.

Not a benchmark of time: these gears are assumed, so the figures say what to expect, not what a maker states.
"""

import numpy as np
from measure import progress, section, table

from armwright.arm.load import load_arm
from armwright.dynamics.flexible_joints import modes, with_gears
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.moves import joint_move
from armwright.motion.smooth_move import settling, smooth_move
from armwright.motion.tolerance import tolerance

SEED, MOVES = 20261127, 4
# Stiffness of the gears of the first three joints [N m/rad]; those of the wrist, whose links are light, are rigid.
WRIST = (np.inf,) * 3
ARMS = {"puma560": ((3e4, 3e4, 2e4, *WRIST), 10.0), "ur5": ((2e4, 2e4, 2e4, *WRIST), 10.0)}
KINDS = ("zv", "zvd", "ei", "flat")
# Frequencies of the arm by those of its model.
FACTORS = (1.0, 0.9, 1.1)


def main() -> None:
    """Print the table."""
    rows = []
    for name, (stiffness, damping) in ARMS.items():
        arm = with_gears(load_arm(name), stiffness, damping)
        arms = {x: with_gears(arm, np.multiply(stiffness, x**2), damping) for x in FACTORS}
        rng = np.random.default_rng(SEED)
        left: dict[tuple[str, float], list[float]] = {}
        added: dict[str, list[float]] = {}
        plain, slowest = [], []
        for k in range(MOVES):
            progress(f"{name}: move {k + 1} of {MOVES}")
            ends = rng.uniform(0.3 * arm.limits.lower, 0.3 * arm.limits.upper, (2, 6))
            slowest.append(float(modes(arm, ends[1]).frequencies[0]))
            move = joint_move(arm, forward(arm, ends), near=ends[0])
            before = {x: settling(other, move.trajectory).residual for x, other in arms.items()}
            plain.append(before[1.0])
            for kind in KINDS:
                smooth = smooth_move(arm, move, kind, allowed=tolerance(1e-3, 1e-3))
                added.setdefault(kind, []).append(smooth.added)
                for x, other in arms.items():
                    after = smooth.after if x == 1.0 else settling(other, smooth.move.trajectory)
                    left.setdefault((kind, x), []).append(after.residual / before[x])
        said = f"{name}: {min(slowest):.1f} to {max(slowest):.1f} Hz, {1e6 * float(np.median(plain)):.3g} um unshaped"
        for kind in KINDS:
            cells = [f"{100 * float(np.median(left[kind, x])):.2f} ({100 * max(left[kind, x]):.1f})" for x in FACTORS]
            rows.append((said, kind, *cells, f"{float(np.median(added[kind])):.3f}"))
            said = ""
    heads = ("arm", "command", *(f"left %, frequencies x {x:g}: median (worst)" for x in FACTORS), "added s")
    section("Residual vibration after random joint moves", table(heads, rows))


if __name__ == "__main__":
    main()
