"""Writes puma_log.csv and puma_check.csv into a folder: what the controller of an imaginary PUMA 560 logs.

Its masses are up to a fifth other than those of the catalogue, and its drives have friction. It moves as
`plan-excitation` plans, in a cell with physics, and is read by encoders, late, with noisy efforts.
Run it to see how such files are made, with the name of the folder or in it; its numbers are the same in every run, but
for the last digit of some on other processors.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import attrs
import numpy as np

from armwright.arm.drive import Motor
from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.cell.control import Sensors
from armwright.cell.model import Cell, CellArm
from armwright.identification import DynamicModel, plan_excitation
from armwright.physics import PhysicsCell

FACTORS = (0.85, 1.15, 0.9, 1.2, 0.8, 1.1)  # of the masses, by those of the catalogue
DRY = (6.0, 8.0, 5.0, 2.0, 1.5, 1.0)  # Coulomb friction [N m]
PERIOD, EVERY = 2e-3, 10  # of the servo [s], and of its ticks those that are logged
NOISE = 0.01  # of efforts, by their spread


def true_arm() -> Arm:
    """Return the arm as it is."""
    arm = load_arm("puma560")
    links = [
        attrs.evolve(link, mass=factor * link.mass, inertia=factor * link.inertia)
        for link, factor in zip(arm.links, FACTORS, strict=True)
    ]
    motors = [
        Motor(inertia=motor.inertia, viscous=0.5 * x, coulomb_forward=x, coulomb_backward=x, offset=0.05 * x)
        for motor, x in zip(arm.motors, DRY, strict=True)
    ]
    return attrs.evolve(arm, links=links, motors=motors)


def rows(seed: int) -> Iterator[str]:
    """Give the rows of a log: time, positions and efforts."""
    arm, rng = load_arm("puma560"), np.random.default_rng(seed)
    model = DynamicModel(arm=arm, terms=("rotor", "viscous", "coulomb"))
    motion = plan_excitation(model, period=12.0, seed=seed).trajectory
    sensors = Sensors(counts=2**23, delay=1)
    placed = CellArm(arm=arm, plant=true_arm(), start=motion(0.0), sensors=sensors)
    world = PhysicsCell(Cell(name="log", arms={"ARM_1": placed}, period=PERIOD))
    world.start_motion("ARM_1", motion, 0.0, np.eye(4))
    world.advance(motion.duration)
    stream = world.observations().measured[0]
    tau = stream.tau + NOISE * stream.tau.std(axis=0) * rng.normal(size=stream.tau.shape)
    joints = range(1, arm.n + 1)
    yield ",".join(["time_s", *(f"joint_{i}_deg" for i in joints), *(f"joint_{i}_effort_nm" for i in joints)])
    for k in range(0, len(stream.t), EVERY):
        cells = [f"{stream.t[k]:.3f}", *(f"{x:.5f}" for x in np.degrees(stream.q[k])), *(f"{x:.3f}" for x in tau[k])]
        yield ",".join(cells)


def main() -> None:
    """Write the files into the folder."""
    folder = Path(*sys.argv[1:2])
    for name, seed in (("puma_log.csv", 1), ("puma_check.csv", 2)):
        Path(folder, name).write_text("\n".join(rows(seed)) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
