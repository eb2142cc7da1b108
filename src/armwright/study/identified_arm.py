"""An arm that is identified from its own log, and tracks better: the loop from excitation to control, simulated.

The truth is a PUMA 560 with friction that its drawing does not have, in a cell with physics. Its controller believes in
the drawing. It moves as planned, is logged by encoders with quantisation, delay and noise, is identified, and runs
another motion with the identified arm.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, ClassVar

import attrs
import numpy as np

from armwright.arm.drive import Motor
from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.cell.control import Alarms, Sensors, Servo
from armwright.cell.model import Cell, CellArm
from armwright.errors import MissingExtraError
from armwright.files.result_table import ResultTable
from armwright.identification.excitation import plan_excitation
from armwright.identification.identify import identify
from armwright.identification.log import Log
from armwright.identification.model import DynamicModel
from armwright.motion.trajectory import Trajectory
from armwright.report.elements import Tile
from armwright.report.figures import Drawing, bar_chart

# The servo tick [s], the counts of encoders per turn of a joint, the delay of readings in ticks.
_PERIOD, _COUNTS, _DELAY = 2e-3, 2**23, 1
# Noise of measured efforts, by their spread, and how it hangs together from reading to reading.
_NOISE, _CORRELATION = 0.01, 0.9
# A servo without an integral, slow enough for the model to count [rad/s].
_SERVO = Servo(bandwidth=20.0, integral=False)
# Masses of the drawing, by those of the truth.
_DRAWN = (1.2, 0.8, 1.15, 0.85, 1.2, 0.8)
_SEEDS = (1, 2)
# The drawing tracks badly; that is what is measured, and no reason to stop.
_NO_ALARMS = Alarms(tracking_angle=1.0)


@attrs.frozen(kw_only=True, eq=False)
class IdentifiedArm:
    """Tracking before and after.

    Attributes:
        law: of friction that was chosen.
        held: root mean squares (6,) of what is not predicted of the motion that was not fitted to, by the efforts.
        tracking: root mean squares (6,) of the errors of positions by what the controller believes [rad].
        known: base parameters that are within three of their standard errors, and all of them.
    """

    law: str
    held: Array
    tracking: dict[str, Array]
    known: tuple[int, int]

    title: ClassVar[str] = "an arm identified from its own log tracks better (simulated truth)"
    notes: ClassVar[tuple[str, ...]] = (
        "simulated: Stribeck and viscous friction, encoders of 23 bits a turn, readings a tick late, noisy efforts",
        "the controller: computed torque without an integral",
    )

    @classmethod
    def run(cls, progress: Callable[[str, float], None] | None = None) -> IdentifiedArm:
        """Run the study.

        Raises:
            MissingExtraError: Clarabel is not installed.
        """
        report = progress or (lambda _task, _part: None)
        truth = _truth()
        drawn = _drawing(truth)
        model = DynamicModel(arm=drawn, terms=("rotor", "viscous", "coulomb"))
        report("planning", 0.0)
        first, second = (plan_excitation(model, seed=seed).trajectory for seed in _SEEDS)
        report("logging", 0.2)
        rng = np.random.default_rng(0)
        fitted, held_out = (_logged(drawn, truth, motion, rng)[0] for motion in (first, second))
        report("identifying", 0.5)
        found = identify(drawn, [fitted], check=[held_out])
        if found.arm is None:
            raise MissingExtraError(found.warnings[-1])
        believed = {"drawing": drawn, "identified": found.arm, "truth": truth}
        tracking = {}
        for k, (name, arm) in enumerate(believed.items()):
            report("tracking", 0.7 + 0.1 * k)
            tracking[name] = _logged(arm, truth, second, rng)[1]
        return cls(
            law=found.law,
            held=found.validation[0].relative,
            tracking=tracking,
            known=(len(found.fit.values) - len(found.weak), len(found.fit.values)),
        )

    def as_data(self) -> dict[str, Any]:
        """Return the results as plain data."""
        return {
            "friction": self.law,
            "held_out": self.held.tolist(),
            "tracking": {name: errors.tolist() for name, errors in self.tracking.items()},
            "known": list(self.known),
        }

    def tables(self) -> Iterator[ResultTable]:
        """Yield tracking by what the controller believes, and what is not predicted."""
        heads = ("controller believes", *(f"j{i}" for i in range(1, 7)), "all")
        yield ResultTable(
            title="Root mean square of tracking errors, mdeg",
            heads=heads,
            rows=[
                (name, *(f"{np.degrees(x) * 1e3:.2f}" for x in (*errors, _all(errors))))
                for name, errors in self.tracking.items()
            ],
            numbers=range(1, 8),
        )
        yield ResultTable(
            title="Efforts of the other motion that are not predicted, %",
            heads=heads[:-1],
            rows=[("identified", *(f"{100 * x:.2f}" for x in self.held))],
            numbers=range(1, 7),
        )

    def headline(self) -> Iterator[Tile]:
        """Give the tracking errors before and after."""
        for name, errors in self.tracking.items():
            yield Tile(f"{np.degrees(_all(errors)) * 1e3:.1f} mdeg", f"tracking error; the controller believes: {name}")
        yield Tile(f"{self.known[0]} of {self.known[1]}", "base parameters known well")

    def figures(self) -> list[Drawing]:
        """Return the tracking errors by joint."""
        values = {name: (np.degrees(errors) * 1e3).tolist() for name, errors in self.tracking.items()}
        title = "Tracking errors by what the controller believes"
        names = [f"joint {i}" for i in range(1, 7)]
        svg = bar_chart(title, names, values, y_label="root mean square, mdeg", logarithmic=True)
        return [Drawing("tracking", title, svg)]


def _all(errors: Array) -> float:
    return float(np.sqrt((errors**2).mean()))


def _truth() -> Arm:
    """Return the PUMA with friction that fades as it gets faster."""
    arm = load_arm("puma560")
    dry = (6.0, 8.0, 5.0, 2.0, 1.5, 1.0)
    motors = [
        Motor(
            inertia=motor.inertia,
            viscous=0.5 * x,
            coulomb_forward=x,
            coulomb_backward=x,
            offset=0.05 * x,
            stribeck=0.4 * x,
            stribeck_speed=0.15,
        )
        for motor, x in zip(arm.motors, dry, strict=True)
    ]
    return attrs.evolve(arm, motors=motors)


def _drawing(truth: Arm) -> Arm:
    """Return what is believed before: masses that are a fifth off, and no friction."""
    links = [
        attrs.evolve(link, mass=factor * link.mass, inertia=factor * link.inertia)
        for link, factor in zip(truth.links, _DRAWN, strict=True)
    ]
    return attrs.evolve(truth, links=links, motors=[Motor(inertia=motor.inertia) for motor in truth.motors])


def _logged(believed: Arm, truth: Arm, motion: Trajectory, rng: np.random.Generator) -> tuple[Log, Array]:
    """Return the log of a motion, and the root mean squares (6,) of its tracking errors [rad]."""
    from scipy.signal import lfilter  # noqa: PLC0415 - takes a tenth of a second to load

    from armwright.physics.world import PhysicsCell  # noqa: PLC0415

    sensors = Sensors(counts=_COUNTS, delay=_DELAY)
    placed = CellArm(arm=believed, plant=truth, start=motion(0.0), servo=_SERVO, sensors=sensors)
    world = PhysicsCell(Cell(name="loop", arms={"ARM_1": placed}, period=_PERIOD, alarms=_NO_ALARMS))
    world.start_motion("ARM_1", motion, 0.0, np.eye(4))
    world.advance(motion.duration)
    stream = world.observations().measured[0]
    white = rng.normal(size=stream.tau.shape)
    coloured = np.sqrt(1 - _CORRELATION**2) * lfilter([1.0], [1.0, -_CORRELATION], white, axis=0)
    tau = stream.tau + _NOISE * stream.tau.std(axis=0) * coloured
    error = np.sqrt(((stream.actual - stream.sent) ** 2).mean(axis=0))
    return Log(name="log", t=stream.t, q=stream.q, effort=tau), error
