"""Arrays as rows of text: motion.csv and other tables of samples."""

from collections.abc import Iterator, Mapping

import numpy as np

from armwright.arrays import Array
from armwright.files.rows import text_cell
from armwright.simulation.flexible_joints import FlexibleSimulation


def motion_csv(t: Array, q: Array, qd: Array, qdd: Array, tau: Array) -> Iterator[str]:
    """Give the lines of motion.csv: time, and per joint position, speed, acceleration and effort, in SI.

    Args:
        t: (k,) times [s].
        q: (k, n) joint positions.
        qd: (k, n) speeds.
        qdd: (k, n) accelerations.
        tau: (k, n) efforts.
    """
    quantities = {"q": q, "qd": qd, "qdd": qdd, "tau": tau}
    columns = {f"{name}{i + 1}": values[:, i] for name, values in quantities.items() for i in range(q.shape[1])}
    # Twelve digits hold a position to 1e-12, so that differences over a tick still show the speed.
    return csv_lines({"t": t, **columns}, 12)


def flexible_motion_files(simulation: FlexibleSimulation) -> dict[str, Iterator[str]]:
    """Return motion.csv of the links, and motors.csv of the motors behind their gears, in SI."""
    s = simulation
    motors = {"motor": s.motors, "motor_speed": s.motor_speeds, "gear": s.gears}
    columns = {f"{name}{i + 1}": values[:, i] for name, values in motors.items() for i in range(s.q.shape[1])}
    return {
        "motion.csv": motion_csv(s.t, s.q, s.qd, s.qdd, s.tau),
        "motors.csv": csv_lines({"t": s.t, **columns}, 12),
    }


def csv_lines(columns: Mapping[str, Array], digits: int) -> Iterator[str]:
    """Give the lines of a table: the names of its columns, and their numbers (k,) with so many significant digits."""
    yield ",".join(map(text_cell, columns)) + "\n"
    line = ",".join([f"%.{digits}g"] * len(columns)) + "\n"
    # Adding 0 turns -0 into 0, which reads better.
    yield from (line % tuple(row) for row in (np.stack(list(columns.values()), axis=-1) + 0.0).tolist())
