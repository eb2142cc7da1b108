"""Paths that are planned past what a point-to-point MOVE would run into."""

from pathlib import Path

import attrs
import coal
import numpy as np

from armwright.arm.guessed_solids import guessed_solids
from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.kinematics.forward_kinematics import link_poses
from armwright.report.run_summary import RunSummary
from oracles.solids import coal_pose, coal_shape
from program.running import failure, run

ARM = """
[arms.ARM_1]
model = "stanford"
hand = [1,0,0, 0,-1,0, 0,0,-1, 0.45, -0.35, 0.25]
[motion]
plan = true
"""
# A wall between where the arm stands and where it goes, over which it can reach.
WALL = ("WALL", (0.55, 0.0, 0.15), (500, 20, 300))
# A cover around the goal.
COVER = ("COVER", (0.45, 0.35, 0.25), (200, 200, 200))


def cell_with(tmp_path: Path, *boxes: tuple[str, tuple[float, ...], tuple[float, ...]], plan: bool = True) -> Cell:
    path = tmp_path / "cell.toml"
    entries = ", ".join(
        f'{{ name = "{name}", at = [1,0,0, 0,1,0, 0,0,1, {x}, {y}, {z}], size_mm = {list(size)} }}'
        for name, (x, y, z), size in boxes
    )
    path.write_text(f"[scene]\nboxes = [{entries}]\n{ARM}")
    return attrs.evolve(read_cell(path), plan=plan)


def program(clauses: str = "") -> str:
    goal = "(1,0,0, 0,-1,0, 0,0,-1, 0.45, 0.35, 0.25)"
    return f"VAR goal : FRAME ; BEGIN goal = {goal} ; MOVE ARM_1 TO goal {clauses} ; END."


def test_past_a_wall(tmp_path: Path) -> None:
    """A MOVE that would run into a wall goes past it, as coal confirms, and says how; twice with the same bits."""
    cell = cell_with(tmp_path, WALL)
    assert failure(program(), attrs.evolve(cell, plan=False)).diagnostic.code == "E406"

    recording, again = run(program(), cell), run(program(), cell)

    (stage,) = recording.stages
    assert stage.path is not None
    assert stage.path.seed == 0
    (move,) = (effect for effect in recording.effects if effect.kind == "MOVE")
    assert move.data["planned_paths"] == [stage.path.as_data()]
    notes = RunSummary(recording=recording, diagnostics=(), hint="").notes
    assert any("PTP to goal: a path past other bodies was planned" in note for note in notes)
    arm = cell.arms["ARM_1"].arm
    q = recording.streams[0].q
    np.testing.assert_array_equal(q, again.streams[0].q)
    limits = arm.limits
    assert (np.abs(recording.streams[0].qd) <= limits.speed * (1 + 1e-9)).all()
    assert (np.abs(recording.streams[0].qdd) <= limits.acceleration * (1 + 1e-9)).all()
    wall = cell.fixtures["WALL"]
    barrier, placed = coal_shape(wall.shape), coal_pose(wall.pose)
    for X in link_poses(arm, q[::5]):
        for number, solids in enumerate(guessed_solids(arm), 1):
            for solid in solids[: 0 if number == arm.n else None]:
                Y = X[number] @ solid.pose
                request, result = coal.CollisionRequest(), coal.CollisionResult()
                assert not coal.collide(barrier, placed, coal_shape(solid.shape), coal_pose(Y), request, result)


def test_in_a_given_time(tmp_path: Path) -> None:
    """A planned path takes the time that is asked for, where it is no shorter than the straight path needs."""
    recording = run(program("WITH DURATION = 20"), cell_with(tmp_path, WALL))

    (stage,) = recording.stages
    assert stage.path is not None
    np.testing.assert_allclose(stage.duration, 20.0, atol=1e-9)


def test_no_solution_of_the_goal_is_free(tmp_path: Path) -> None:
    """A goal inside a body is refused, with every IK solution and what it overlaps."""
    error = failure(program(), cell_with(tmp_path, COVER)).diagnostic

    assert error.code == "E406"
    note = error.notes[-1]
    assert note.startswith("no path past it was planned: all ")
    assert " IK solutions of the goal are in collision: " in note
    assert "overlaps COVER by " in note


def test_advice(tmp_path: Path) -> None:
    """Where no path is planned, the message says how to plan one; of a straight line it does not."""
    cell = cell_with(tmp_path, WALL, plan=False)

    direct, straight = failure(program(), cell).diagnostic, failure(program("STRAIGHTLY"), cell).diagnostic

    assert any("--plan" in help_ for help_ in direct.helps)
    assert not any("--plan" in help_ for help_ in straight.helps)
