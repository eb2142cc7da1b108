"""MOVE to joint positions, given by numbers or by the name of a joint target of the cell."""

import attrs
import numpy as np
import pytest
from lsprotocol.types import Hover, MarkupContent

from armwright.arrays import Array
from armwright.cell.model import Cell, JointTarget
from armwright.cell.simulator import Simulator
from armwright.kinematics import forward
from armwright.program import Source, compile as translate
from armwright.program.formatter.format import formatted
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language_server.analysis import Settings, analyse
from armwright.program.language_server.cell_lookup import CellCache
from armwright.program.language_server.completions import completions
from armwright.program.language_server.hover import hover
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.machine import RunError
from armwright.program.vm.recording import Recording
from program.running import cell_of, failure, run
from samples import Sample

# Of limits that a motion may use up altogether, for rounding.
ROUNDING = 1 + 1e-9
TARGET = np.array([0.1, -1.0, 0.4, 0.2, 0.9, -0.3])


def taught_cell() -> Cell:
    """A Stanford arm, with a joint target."""
    cell = cell_of("cell1")
    return attrs.evolve(cell, joint_targets={"PARK": JointTarget(arm="ARM_1", q=TARGET)})


def run_here(text: str) -> Recording:
    return run(text, taught_cell())


def reached(recording: Recording) -> Array:
    return recording.configurations["ARM_1"]


def within_limits(recording: Recording, rng: np.random.Generator) -> bool:
    """Whether the recorded motion keeps all limits of the joints at random times."""
    arm = recording.cell.arms["ARM_1"].arm
    for stage in recording.stages:
        t = rng.uniform(0.0, stage.motion.duration, 60)
        q, qd, qdd = (stage.motion(t, order) for order in range(3))
        limits = arm.limits
        inside = (q >= limits.lower - 1e-9).all() and (q <= limits.upper + 1e-9).all()
        if not (inside and (abs(qd) <= limits.speed * ROUNDING).all()):
            return False
        if not (abs(qdd) <= limits.acceleration * ROUNDING).all():
            return False
    return True


def test_random_positions(sample: Sample) -> None:
    """The arm ends exactly where it is told, all joints going straight there at once, within their limits."""
    cell = taught_cell()
    arm = cell.arms["ARM_1"].arm
    lower, upper = np.maximum(arm.limits.lower, -3.0), np.minimum(arm.limits.upper, 3.0)
    failures = 0
    for rng in sample.cases(100):
        q = lower + (upper - lower) * rng.uniform(0.02, 0.98, arm.n)
        speed = rng.uniform(20, 120)
        shown = [np.degrees(x) if turns else x for x, turns in zip(q.tolist(), arm.revolute, strict=True)]
        text = f"BEGIN MOVE ARM_1 TO JOINTS({', '.join(map(repr, map(float, shown)))}) WITH SPEED = {speed:.6f} ; END."
        recording = run_here(text)

        (stage,) = recording.stages
        start, end = stage.motion(0.0), stage.motion(stage.motion.duration)
        part = (stage.motion(rng.uniform(0, stage.motion.duration, 20)) - start) / (end - start)
        np.testing.assert_allclose(reached(recording), q, rtol=0, atol=1e-12)
        np.testing.assert_allclose(part, np.broadcast_to(part[:, :1], part.shape), rtol=0, atol=1e-9)
        failures += not within_limits(recording, rng)
    sample.record("MOVEs to random joint positions, end and limits", sample.count(100), failures)

    assert not failures


def test_target_of_the_cell() -> None:
    """A name that no variable has is that of a joint target."""
    recording = run_here("BEGIN MOVE ARM_1 TO JOINTS(park) ; END.")

    np.testing.assert_allclose(reached(recording), TARGET, rtol=0, atol=1e-12)
    X = recording.cell.arms["ARM_1"].base @ forward(recording.cell.arms["ARM_1"].arm, TARGET)
    np.testing.assert_allclose(recording.tree.world("ARM_1"), X, rtol=0, atol=1e-12)
    assert "PTP JOINTS(park)" in "\n".join(recording.trace())


def test_units_of_the_program() -> None:
    """Angles and lengths count in the units of the program, or in their own."""
    recording = run_here("UNITS MM, RAD ; BEGIN MOVE ARM_1 TO JOINTS(0.1, -1, 40cm, 0.2, 45deg, -0.3) ; END.")

    np.testing.assert_allclose(reached(recording), [0.1, -1.0, 0.4, 0.2, np.pi / 4, -0.3], rtol=0, atol=1e-12)


def test_with_other_clauses() -> None:
    """A line may lead away first, a duration holds for the whole, and a guard ends the motion."""
    text = """VAR f : FRAME ; BEGIN
      MOVE ARM_1 TO JOINTS(park) WITH DEPARTURE = ARM_1 * XYZ(0, 0, -0.02), WITH DURATION = 5 ;
      MOVE ARM_1 TO JOINTS(0, -60, 0.4, 0, 60, 0) ON Z(ARM_1) > 0 DO HALT ;
    END."""
    recording = run_here(text)

    kinds = [stage.stage.kind for stage in recording.stages]
    assert kinds[:2] == ["LINE", "PTP"]
    moves = [effect for effect in recording.effects if effect.kind == "MOVE"]
    assert moves[0].t1 - moves[0].t0 == pytest.approx(5, abs=2e-3)


def test_what_the_arm_cannot_do() -> None:
    """Positions beyond the limits are refused with the joint, before the arm moves."""
    error = failure("BEGIN MOVE ARM_1 TO JOINTS(0, -60, 30, 0, 60, 0) ; END.", taught_cell())

    assert error.diagnostic.code == "E402"
    assert "JOINTS(0, -60, 30, 0, 60, 0)" in error.diagnostic.message
    assert "joint 3" in error.diagnostic.notes[0]


@pytest.mark.parametrize("goal", ["JOINTS(1, 2)", "JOINTS(other)"])
def test_positions_of_another_cell(goal: str) -> None:
    """A program that was checked without a cell fails in one whose arm is another, and can recover from that."""
    text = f"BEGIN TRY MOVE ARM_1 TO {goal} RECOVER (VALUE) PRINT(MESSAGE) END ; MOVE ARM_1 TO {goal} ; END."
    code = translate(Source("test.rlo", text)).code
    assert code is not None
    cell = taught_cell()
    with pytest.raises(RunError) as caught:
        interpret(code, cell, Simulator(cell))
    assert caught.value.diagnostic.code == "E246"


def test_tools() -> None:
    """A joint target is offered behind JOINTS, and explained; the formatter leaves its name as it is written."""
    text = "BEGIN MOVE ARM_1 TO JOINTS(park) ; END."
    cell = taught_cell()
    analysis = analyse("t.rlo", PositionCodec(text), None, CellCache(), Settings(cell=None))
    analysis = attrs.evolve(analysis, cell=cell)

    shown = hover(analysis, text.index("park"), markdown=False)
    assert isinstance(shown, Hover)
    assert isinstance(shown.contents, MarkupContent)
    assert "joint target of ARM_1" in shown.contents.value
    before = "BEGIN MOVE ARM_1 TO "
    offered = {item.label for item in completions(PositionCodec(before), analysis, len(before), snippets=False)}
    assert "JOINTS" in offered
    before += "JOINTS("
    offered = {item.label for item in completions(PositionCodec(before), analysis, len(before), snippets=False)}
    assert "PARK" in offered
    assert "JOINTS(Park)" in formatted(Source("t.rlo", "begin move arm_1 to joints( Park ) end."))
