"""MOVE with VIA: the path of the cell's corners in RLO-2, the report's X-spline in RLO-83."""

import attrs
import numpy as np
import pytest

from armwright.cell.simulator import Simulator
from armwright.compiled.arm import compile_arm
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.through import through_frames
from armwright.motion.trajectory import whole_ticks
from armwright.program.bytecode.assembler import assemble, assembly
from armwright.program.bytecode.instructions import Code
from armwright.program.language.words import Standard
from armwright.program.vm.interpreter import interpret
from armwright.program.vm.recording import Recording
from program.running import cell_of, code_of, run

FRAMES = (
    "VAR a, b, c : FRAME ; BEGIN "
    "a = (1,0,0, 0,-1,0, 0,0,-1, 0.40,0.15,0.20) ; b = (1,0,0, 0,-1,0, 0,0,-1, 0.50,-0.10,0.15) ; "
    "c = (1,0,0, 0,-1,0, 0,0,-1, 0.45,-0.15,0.10) ; "
)
VIA = FRAMES + "MOVE ARM_1 TO c VIA (a, b) END."


CELL = cell_of("cell1")


def run_code(code: Code) -> Recording:
    return interpret(code, CELL, Simulator(CELL))


def test_a_guard_changes_neither_path_nor_time() -> None:
    """With a condition to look out for the arm runs on the same bits as without, at every tick."""
    (plain,) = run(VIA).streams
    (guarded,) = run(VIA.replace(" END.", ", ON FORCE(Z) > 1000 DO HALT END.")).streams

    np.testing.assert_array_equal(plain.t, guarded.t)
    for one, other in ((plain.q, guarded.q), (plain.qd, guarded.qd), (plain.qdd, guarded.qdd)):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("corner", [2e-3, 20e-3])
def test_the_corner_of_the_cell(corner: float) -> None:
    """A VIA frame is passed within the corner that the cell allows, and the stage is no farther off its legs."""
    cell = attrs.evolve(CELL, corner=corner)
    recording = interpret(code_of(VIA, cell), cell, Simulator(cell))

    (stage,), (stream,) = recording.stages, recording.streams
    hand = forward(cell.arms["ARM_1"].arm, stream.q)[:, :3, 3]
    for frame in ((0.40, 0.15, 0.20), (0.50, -0.10, 0.15)):
        assert np.linalg.norm(hand - frame, axis=-1).min() <= corner
    assert 0.0 < stage.stage.deviation <= corner


def test_corners_of_twenty_deviations() -> None:
    """A cell that tells no corner allows twenty times what a straight line may be off."""
    assert attrs.evolve(CELL, deviation=2e-4).corner_deviation == pytest.approx(4e-3)
    assert attrs.evolve(CELL, corner=7e-3).corner_deviation == 7e-3


def test_the_report_keeps_its_spline() -> None:
    """In RLO-83 the joints follow the report's X-spline through the frames, to the last bit; its code says so."""
    code = code_of(VIA, CELL, std=Standard.RLO_83)
    (stage,) = run_code(code).stages

    arm, q = CELL.arms["ARM_1"].arm, CELL.arms["ARM_1"].start
    report = through_frames(compile_arm(arm), q, _frames(), deviation=CELL.deviation)
    expected = whole_ticks(report.trajectory, CELL.period)
    np.testing.assert_array_equal(stage.stage.trajectory.coefficients, expected.coefficients)
    np.testing.assert_array_equal(stage.stage.trajectory.times, expected.times)
    again = assemble(assembly(code))
    assert again.standard is Standard.RLO_83
    np.testing.assert_array_equal(
        run_code(again).stages[0].stage.trajectory.coefficients, stage.stage.trajectory.coefficients
    )


def _frames() -> list[np.ndarray]:
    poses = []
    for place in ((0.40, 0.15, 0.20), (0.50, -0.10, 0.15), (0.45, -0.15, 0.10)):
        X = np.diag((1.0, -1.0, -1.0, 1.0))
        X[:3, 3] = place
        poses.append(X)
    return poses
