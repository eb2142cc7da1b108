"""A motion as rows of text: motion.csv."""

from collections.abc import Iterator

import numpy as np

from armwright.arrays import Array


def motion_csv(t: Array, q: Array, qd: Array, qdd: Array, tau: Array) -> Iterator[str]:
    """Give the lines of motion.csv: time, and per joint position, speed, acceleration and effort, in SI.

    Args:
        t: (k,) times [s].
        q: (k, n) joint positions.
        qd: (k, n) speeds.
        qdd: (k, n) accelerations.
        tau: (k, n) efforts.
    """
    columns = [f"{name}{i + 1}" for name in ("q", "qd", "qdd", "tau") for i in range(q.shape[1])]
    yield ",".join(["t", *columns]) + "\n"
    table = np.concatenate([t[:, None], q, qd, qdd, tau], axis=1)
    # Twelve digits hold a position to 1e-12, so that differences over a tick still show the speed.
    line = ",".join(["%.12g"] * table.shape[1]) + "\n"
    # Adding 0 turns -0 into 0, which reads better.
    yield from (line % tuple(row) for row in (table + 0.0).tolist())
