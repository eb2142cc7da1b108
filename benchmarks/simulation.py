"""Simulated motion: the PUMA let go under gravity, with dry friction that sticks."""

from measure import in_turn, progress, section, table  # isort: skip - sets the threads first

import numpy as np

from armwright.arm.load import load_arm
from armwright.simulation.integrators import Adaptive, Gill
from armwright.simulation.simulator import simulate

DURATION = 5.0


def main() -> None:
    """Measure and print."""
    arm = load_arm("puma560")
    rows = []
    for title, integrator in (("Runge-Kutta-Gill, steps of 1 ms", Gill()), ("DOP853, rtol 1e-8", Adaptive())):
        progress(title)
        (taken,) = in_turn(
            lambda integrator=integrator: simulate(arm, np.zeros(arm.n), duration=DURATION, integrator=integrator),
            repeats=5,
        )
        rows.append([title, f"{taken:.2f}", f"{DURATION / taken:.1f}"])
    section(
        "Simulation",
        f"`puma560` released at q = 0 with its dry friction, {DURATION:g} s of motion.",
        table(["integrator", "s", "times real time"], rows),
    )


if __name__ == "__main__":
    main()
