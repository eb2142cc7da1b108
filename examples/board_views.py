"""Writes board_corners.csv and board_joints.csv into a folder: what a camera on an imaginary UR5 sees of a board.

The camera is 70 mm beside the flange and looks ahead, its lens distorts, and corners have a noise of 0.1 pixels. The
arm is 0.1 mm and 0.5 mrad about where it says that it is. The board of 9 x 7 squares of 30 mm lies on a table.
Run it to see how such files are made, with the name of the folder or in it; its numbers are the same in every run, but
for the last digit of some on other processors.
"""

import sys
from pathlib import Path

import numpy as np

from armwright.arm.load import load_arm
from armwright.calibration.arm_readings import ArmAccuracy, ArmReadings
from armwright.calibration.board import Board
from armwright.kinematics.forward_kinematics import forward
from armwright.spatial.lens import Lens
from armwright.spatial.poses import homogeneous, inverse
from armwright.spatial.rotations import rotation_from_vector

PICTURES, NOISE = 14, 0.1
BOARD = Board(columns=9, rows=7, square=0.03, marker=0.022)
LENS = Lens(width=640, height=480, focal=(612, 610), centre=(322, 236), distortion=(-0.12, 0.05, 0.001, -0.0005, 0))
CAMERA = homogeneous(rotation_from_vector((0.05, -0.03, 1.6)), (0.07, 0.0, 0.04))
# The camera is above the board here, and around here in the pictures.
HOME, SPREAD = np.radians((20, -100, -95, -75, 90, 0)), np.array((0.12, 0.12, 0.12, 0.3, 0.3, 0.5))


def main() -> None:
    """Write the files into the folder."""
    rng, arm, folder = np.random.default_rng(1956), load_arm("ur5"), Path(*sys.argv[1:2])
    middle = np.array([BOARD.columns, BOARD.rows, 0]) * BOARD.square / 2
    board = forward(arm, HOME) @ CAMERA @ homogeneous(np.eye(3), np.array((0, 0, 0.42)) - middle)
    corners, joints = ["picture,corner,x_px,y_px"], [",".join(["picture", *(f"joint_{i}_deg" for i in range(1, 7))])]
    while len(joints) <= PICTURES:
        # As the controller shows them.
        q = np.radians(np.round(np.degrees(HOME + rng.standard_normal(6) * SPREAD), 3))
        readings = ArmReadings(arm=arm, q=q[None], accuracy=ArmAccuracy(position=1e-4, orientation=5e-4))
        (hand,), _ = readings.hand(rng.standard_normal((1, 6)))
        X = inverse(hand @ CAMERA) @ board
        pixels = LENS.project(BOARD.points @ X[:3, :3].T + X[:3, 3])
        pixels += NOISE * rng.standard_normal(pixels.shape)
        inside = ((pixels > 0) & (pixels < (LENS.width - 1, LENS.height - 1))).all(axis=1)
        if inside.mean() < 0.75:
            continue
        name = f"view_{len(joints):02d}.png"
        corners += [f"{name},{k},{x:.3f},{y:.3f}" for k, (x, y) in enumerate(pixels) if inside[k]]
        joints.append(",".join([name, *(f"{angle:.3f}" for angle in np.degrees(q))]))
    (folder / "board_corners.csv").write_text("\n".join(corners) + "\n", encoding="utf-8")
    (folder / "board_joints.csv").write_text("\n".join(joints) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
