"""Torque laws of a user's own, and where the tool of an arm really is."""

from typing import Any

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.cell.control import Sensors
from armwright.cell.model import Cell, CellArm
from armwright.cell.observations import Observations
from armwright.errors import ArmwrightError, InvalidValueError, KindError, ShapeError
from armwright.motion.quintic_polynomials import quintic
from armwright.physics.servo import Reference
from armwright.physics.world import PhysicsCell
from armwright.spatial.poses import homogeneous

STANFORD = load_arm("stanford")
START = (STANFORD.limits.lower + STANFORD.limits.upper) / 2
GOAL = START + 0.1


def one_arm(**changes: Any) -> Cell:
    """A cell with an arm and nothing else."""
    return Cell(name="bare", arms={"ARM_1": CellArm(arm=STANFORD, start=START, **changes)})


def moved(world: PhysicsCell, seconds: float = 2.0) -> PhysicsCell:
    """The world after a motion of some seconds, and half a second at rest."""
    world.start_motion("ARM_1", quintic(START, GOAL, seconds), 0.0, np.eye(4))
    assert world.advance(seconds + 0.5) is None
    return world


def as_plain(observed: Observations) -> dict[str, Any]:
    """The facts of a run, as they are in its file."""
    return dict(observed.facts)


@pytest.mark.parametrize(
    ("efforts", "error", "message"),
    [
        (
            np.zeros(5),
            ShapeError,
            r"'stanford' at 0.000 s: expected a shape ending in \(6,\), got \(5,\)",
        ),
        (0.0, ShapeError, r"expected a shape ending in \(6,\), got \(\)"),
        (None, KindError, "torque law of 'stanford' at 0.000 s"),
        (np.full(6, np.nan), InvalidValueError, "every number must be finite, got nan at"),
    ],
)
def test_what_is_no_effort_is_refused(efforts: Any, error: type[ArmwrightError], message: str) -> None:
    """What a law returns is one finite effort for each joint; an error says what it returned, and when."""
    world = PhysicsCell(one_arm(), laws={"ARM_1": lambda *_: efforts})

    with pytest.raises(error, match=message):
        world.advance(0.01)


def test_a_law_that_writes_into_what_it_is_given() -> None:
    """A law may compute in place: neither the reference nor what is recorded changes by that."""
    cell = one_arm()

    def careful(t: float, q: Array, qd: Array, reference: Reference) -> Array:  # noqa: ARG001 - what a law is given
        return 400.0 * (reference.q - q) + 60.0 * (reference.qd - qd)

    def careless(t: float, q: Array, qd: Array, reference: Reference) -> Array:
        efforts = careful(t, q, qd, reference)
        for array in (q, qd, *reference):
            array[:] = 1.0
        return efforts

    streams = []
    for law in (careful, careless):
        world = PhysicsCell(cell, laws={"ARM_1": law})
        world.start_motion("ARM_1", quintic(START, GOAL, 0.2), 0.0, np.eye(4))
        world.advance(0.05)
        streams.append(world.observations().measured[0])
    for name in ("q", "qd", "tau", "sent"):
        np.testing.assert_array_equal(getattr(streams[0], name), getattr(streams[1], name))


def test_a_tool_that_is_elsewhere_than_believed() -> None:
    """A tool that is 3 mm beside the one that the controller believes in is 3 mm off, whatever the joints read."""
    aside = attrs.evolve(STANFORD, tool=STANFORD.tool @ homogeneous(np.eye(3), (0.003, 0.0, 0.0)))

    exact, off = (moved(PhysicsCell(one_arm(plant=plant))).observations() for plant in (None, aside))
    (exact_tip, exact_joints), (tip, joints) = (
        (facts["tip"]["ARM_1"], facts["tracking"]["ARM_1"]) for facts in (as_plain(exact), as_plain(off))
    )

    assert exact_tip < 0.2e-3
    assert tip == pytest.approx(3e-3, abs=exact_tip + 1e-5)
    np.testing.assert_allclose(joints, exact_joints, atol=1e-6)


def test_readings_that_are_late() -> None:
    """A servo that reads late keeps its readings where it sends the arm: the arm itself leads by speed times delay."""
    delay, seconds = 0.005, 1.0
    measured = moved(PhysicsCell(one_arm(sensors=Sensors(delay=5))), seconds).observations().measured[0]

    peak = 1.875 * (GOAL - START) / seconds
    read, actual = (np.abs(q - measured.sent).max(axis=0) for q in (measured.q, measured.actual))
    np.testing.assert_allclose(measured.actual[:-5], measured.q[5:], atol=0)
    assert (read < 0.5 * peak * delay).all()
    assert (np.abs(actual - peak * delay) < 0.5 * peak * delay).all()
