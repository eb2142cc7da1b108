"""Simulate a linkage without clearance in MuJoCo, as ``python run_linkage.py`` does.

Reads linkage.xml, drives.csv and reference.csv beside it, writes tip.csv, and prints how far the tip is from that of
reference.csv. Needs mujoco and numpy.
"""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np

FOLDER = Path(__file__).parent


def simulate(folder: Path = FOLDER) -> Any:
    """Simulate the linkage of a folder; return (s, 3) time and position of its tip, and write them to tip.csv."""
    efforts = np.loadtxt(folder / "drives.csv", delimiter=",", skiprows=1, ndmin=2)
    times = np.loadtxt(folder / "reference.csv", delimiter=",", skiprows=1, ndmin=2)[:, 0]
    model = mujoco.MjModel.from_xml_path(str(folder / "linkage.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    h = model.opt.timestep
    rows = []
    for time in times:
        while data.time < time - h / 2:
            # MuJoCo holds the efforts during a step.
            for drive, column in enumerate(efforts.T[1:]):
                data.ctrl[drive] = np.interp(data.time + h / 2, efforts[:, 0], column)
            mujoco.mj_step(model, data)
        mujoco.mj_kinematics(model, data)
        rows.append([time, *data.site("tip").xpos[:2]])
    tip = np.array(rows)
    np.savetxt(folder / "tip.csv", tip, delimiter=",", header="time_s,tip_x_m,tip_y_m", comments="")
    return tip


if __name__ == "__main__":
    reference = np.loadtxt(FOLDER / "reference.csv", delimiter=",", skiprows=1, ndmin=2)
    run = simulate()
    apart = np.linalg.norm(run[:, 1:] - reference[:, 1:], axis=1)
    print(f"largest distance from the reference: {apart.max() * 1e6:.3f} um at {run[apart.argmax(), 0]:.4f} s")
