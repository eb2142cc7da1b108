"""Writes puma_points.csv into a folder: what a laser tracker would measure of an imaginary PUMA 560 (puma560-seed).

Its dimensions are off by tenths of a millimetre and of a degree, its shoulder and elbow give under gravity, and it
comes back to some hundredths of a millimetre. The tracker stands somewhere in the hall.
Run it to see how such files are made, with the name of the folder or in it; its numbers are the same in every run, but
for the last digit of some on other processors.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from armwright.arm.load import load_arm
from armwright.calibration.chain import kinematic_chain
from armwright.calibration.experiment_design import plan_poses
from armwright.calibration.joint_errors import compliances
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector

POSES, REPEATED, CYCLES, CHECKED = 60, 6, 5, 12
LENGTH, ANGLE = 3e-4, 1.5e-3  # of the errors of the arm [m], [rad]
SAG = {"joint2.sag": 1.2e-3, "joint3.sag": 0.8e-3}  # under the largest effort of gravity [rad]
RETURN, TRACKER = 2e-5, 1e-5  # noise of a coordinate, of the arm and of the tracker [m]
HALL = homogeneous(rotation_from_vector((0.02, -0.01, 2.2)), (2.8, 1.1, -0.4))


def rows() -> Iterator[str]:
    """Give the rows: poses to fit, some of them several times, and poses by chance to check with."""
    rng = np.random.default_rng(1984)
    arm = load_arm("puma560-seed")
    chain = kinematic_chain(arm, base=HALL, joint_errors=compliances(arm))
    errors = rng.standard_normal(len(chain.names)) * np.where(chain.is_length, LENGTH, ANGLE)
    for i, name in enumerate(chain.names):
        errors[i] = SAG.get(name, 0.0 if name.endswith(".sag") else errors[i])
    planned = plan_poses(arm, POSES).q
    lower, upper = arm.limits.lower, arm.limits.upper
    chance = lower + (upper - lower) * rng.random((CHECKED, arm.n))
    # As the controller shows them.
    q = np.radians(np.round(np.degrees(np.vstack([planned, *[planned[:REPEATED]] * (CYCLES - 1), chance])), 3))
    noise = rng.standard_normal((len(q), 3)) * RETURN + rng.standard_normal((len(q), 3)) * TRACKER
    points = chain.forward(q, errors).position + noise
    yield ",".join([*(f"joint_{i + 1}_deg" for i in range(arm.n)), "x_mm", "y_mm", "z_mm", "set"])
    for number, (angles, place) in enumerate(zip(np.degrees(q), points * 1e3, strict=True)):
        cells = [*(f"{angle:.3f}" for angle in angles), *(f"{x:.4f}" for x in place)]
        yield ",".join([*cells, "fit" if number < len(q) - CHECKED else "check"])


def main() -> None:
    """Write the file into the folder."""
    Path(*sys.argv[1:2], "puma_points.csv").write_text("\n".join(rows()) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
