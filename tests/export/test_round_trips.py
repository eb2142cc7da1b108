"""Exported programs, read back by their checkers and run on the model of the arm."""

from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from armwright.export import export_run
from armwright.export.checkers import (
    fanuc as fanuc_checker,
    krl as krl_checker,
    rapid as rapid_checker,
    urscript as urscript_checker,
)
from armwright.export.checkers.comparison import Model, compare
from armwright.export.checkers.orientations import angle_apart
from armwright.export.checkers.posture import PostureReader
from armwright.export.plan_mode import plan_statements
from armwright.export.statements import MoveJoints, MoveKnots, MoveLines
from armwright.export.writers import fanuc, krl, rapid, urscript
from armwright.kinematics import forward
from armwright.program import Recording, Source, run
from export.cases import CELLS, EXAMPLES, mapped_arm, planned, random_joints, recorded

LANGUAGES = {
    "urscript": (urscript, urscript_checker),
    "krl": (krl, krl_checker),
    "rapid": (rapid, rapid_checker),
    "fanuc": (fanuc, fanuc_checker),
}
PLACE, ANGLE = 1e-6, 1e-5  # what is allowed [m], [rad]


def export(target: str, recording: Recording) -> dict[str, float]:
    """The worst of each quantity of the proof of an export."""
    return {one.quantity: one.worst for one in export_run(target, recording, "program").proof.comparisons}


@pytest.mark.parametrize("target", LANGUAGES)
def test_the_twelve_forms_of_move(target: str) -> None:
    """All forms of MOVE come back within a micrometre and 10 µrad, the digits of the files being much finer."""
    plan = planned("twelve_moves.rlo", target)
    kinds = [type(statement) for statement in plan.statements]
    assert (kinds.count(MoveJoints), kinds.count(MoveLines), kinds.count(MoveKnots)) == (6, 10, 4)

    worst = export(target, recorded("twelve_moves.rlo", target))

    assert worst["positions of targets"] < 2e-4  # mm
    assert worst["orientations of targets"] < 5e-7
    assert worst["joints at targets, at the ends of straight lines too"] < 1e-6


@pytest.mark.parametrize("program", ["palletise.rlo", "stacking.rlo", "weld.rlo", "portable.rlo"])
@pytest.mark.parametrize("target", LANGUAGES)
def test_examples(target: str, program: str) -> None:
    """The examples for one arm are exported with their proof."""
    worst = export(target, recorded(program, target))

    assert worst["statements that differ in kind, text or order"] == 0


BLENDED = """
VAR a, b, c, d : FRAME ;
BEGIN
  a = (1,0,0, 0,-1,0, 0,0,-1, 0.40, 0.15,0.20) ;
  b = (1,0,0, 0,-1,0, 0,0,-1, 0.45, 0.05,0.30) ;
  c = (1,0,0, 0,-1,0, 0,0,-1, 0.45,-0.05,0.30) ;
  d = (1,0,0, 0,-1,0, 0,0,-1, 0.40,-0.15,0.20) ;
  MOVE ARM_1 TO a ;
  MOVE ARM_1 TO d VIA (b, c), WITH BLEND = 0.03 ;
  MOVE ARM_1 TO a VIA (c, b), WITH BLEND = 0.5 ;
  OPERATE LAMP ON ;
  PRINT ("done") ;
  MOVE ARM_1 TO a WITH DURATION = 0.5 ;
  MOVE ARM_1 TO a ;
END.
"""


@pytest.mark.parametrize("target", LANGUAGES)
def test_blends_become_zones(target: str) -> None:
    """A corner is rounded from the asked distance on, never beyond 0.4 of a leg, and the last point is a stop."""
    recording = recorded(BLENDED, target)
    lines = [one for one in plan_statements(recording, "x").statements if isinstance(one, MoveLines)]
    legs = [float(np.linalg.norm(np.diff(one.poses[:, :3, 3], axis=0), axis=-1).min()) for one in lines]

    np.testing.assert_allclose(lines[0].zones, [0.03, 0.03, 0.0], atol=1e-12)
    np.testing.assert_allclose(lines[1].zones[:2], 0.4 * min(legs), atol=1e-9)
    assert export(target, recording)["statements that differ in kind, text or order"] == 0


def test_lines_without_a_turn_are_not_held_up() -> None:
    """A line whose ends differ in orientation by rounding alone is not slowed by the speed of the rotation in KRL."""
    text = export_run("krl", recorded("BEGIN MOVE ARM_1 TO ARM_1 * XYZ(0, 0, 0.05) STRAIGHTLY END.", "krl"), "x").files
    turns = [float(line.partition("=")[2]) for line in text["x.src"].splitlines() if line.startswith("$VEL.ORI")]

    assert turns == [0.1, 0.1]


@pytest.mark.parametrize("target", LANGUAGES)
def test_rests_and_nothing(target: str) -> None:
    """A MOVE to where the arm is takes the time it is given, and none without that; the end switches devices off."""
    statements = plan_statements(recorded(BLENDED, target), "x").statements

    assert [type(one).__name__ for one in statements[3:]] == ["SetOutput", "Say", "Wait", "SetOutput"]
    assert statements[-2].seconds == pytest.approx(0.5)
    assert (statements[3].on, statements[-1].on) == (True, False)


@pytest.mark.share(0.002)
@pytest.mark.parametrize("target", LANGUAGES)
def test_random_targets(target: str, sample: Any) -> None:
    """Joint positions and poses anywhere come back within a micrometre and 10 µrad, with words that the joints have."""
    writer, checker = LANGUAGES[target]
    mapped, many, per_file = mapped_arm(target), sample.count(100_000), 50
    model, reader = Model(mapped), PostureReader(mapped)
    plan = attrs.evolve(plan_statements(recorded("BEGIN PAUSE 0.1 END.", target), "x"), mapped=mapped)
    pause, worst = plan.statements[0], np.zeros(3)
    for rng in sample.cases(-(-many // per_file)):
        q = np.array([random_joints(mapped.arm, rng) for _ in range(per_file)])
        X = forward(mapped.arm, q)
        common = {"span": pause.span, "stage": None, "duration": 1.0}
        lines = {"zones": [0.0], "speed": 0.1, "turn_speed": 0.1, "acceleration": 1.0}
        statements = [
            MoveLines(poses=X[i : i + 1], q=q[i : i + 1], **common, **lines)
            if i % 2
            else MoveJoints(q=q[i], speed_part=0.5, **common)
            for i in range(per_file)
        ]
        actions = checker.read(writer.write(attrs.evolve(plan, statements=tuple(statements))).text).actions[1:]
        for i, action in enumerate(actions):
            if i % 2:
                Y = forward(mapped.arm, model.joints(action.q)) if action.X is None else mapped.X_BC @ action.X
                words = reader.words(mapped.joints(q[i]))
                assert all(value in words[word] for word, value in action.configuration.items()), q[i].tolist()
            else:
                own = model.joints(action.q)
                worst[2] = max(worst[2], np.abs(own - q[i]).max())
                Y = forward(mapped.arm, own)
            worst[0] = max(worst[0], np.linalg.norm(Y[:3, 3] - X[i, :3, 3]))
            worst[1] = max(worst[1], angle_apart(Y[:3, :3], X[i, :3, :3]))
        assert (worst < (PLACE, ANGLE, ANGLE)).all(), worst.tolist()
    sample.record(f"random targets in {target}", many, 0, place_m=worst[0], turn_rad=worst[1], joint_rad=worst[2])


def test_the_checker_follows_lines_through_half_turns() -> None:
    """A line on which the tool turns by half a turn is followed to the joints of the plan."""
    text = """
    VAR a, b : FRAME ;
    BEGIN
      a = (1,0,0, 0,-1,0, 0,0,-1, 0.40, 0.15,0.20) ;
      b = (0,1,0, 1,0,0, 0,0,-1, 0.40,-0.15,0.20) ;
      MOVE ARM_1 TO a ;
      MOVE ARM_1 TO b STRAIGHTLY ;
      MOVE ARM_1 TO ARM_1 * ROTZ(170) STRAIGHTLY ;
    END.
    """
    for target in LANGUAGES:
        assert export(target, recorded(text, target))["joints at targets, at the ends of straight lines too"] < 1e-6


def test_a_tool_of_the_cell_is_the_tool_of_the_controller(tmp_path: Path) -> None:
    """The tool of a cell file is written, and targets are those of its tip."""
    text = CELLS["krl"].read_text(encoding="utf-8").replace('model = "', f'model = "{CELLS["krl"].parent}/')
    tool = "tool = [0, 1, 0,  -1, 0, 0,  0, 0, 1,   0.01, 0.02, 0.12]\nhand ="
    cell = text.replace("hand =", tool).replace("0.40, 0.00, 0.30]\ng", "0.40, 0.00, 0.35]\ng")
    path = tmp_path / "cell.toml"
    path.write_text(cell, encoding="utf-8")

    files = export_run("krl", run(EXAMPLES / "palletise.rlo", path), "tool").files

    assert "$TOOL={X 10.00000,Y 20.00000,Z 120.00000,A 90.00000,B 0.00000,C 0.00000}" in files["tool.src"]


def test_a_base_in_the_world_is_no_base_of_the_controller(tmp_path: Path) -> None:
    """Poses are those of the base frame of the arm, wherever that stands in the world."""
    lines = CELLS["urscript"].read_text(encoding="utf-8")
    moved = lines.replace('model = "ur5"', 'model = "ur5"\nbase = [0,1,0, -1,0,0, 0,0,1, 1.0, 2.0, 0.5]')
    moved = moved.replace("0.45, 0.00, 0.25]\ng", "1.00, 2.45, 0.75]\ng")
    source = Source("m.rlo", "BEGIN MOVE ARM_1 TO ARM_1 * XYZ(0, 0, 0.05) STRAIGHTLY END.")
    path = tmp_path / "cell.toml"
    path.write_text(moved, encoding="utf-8")

    text = export_run("urscript", run(source, path), "m").files["m.script"]

    assert "movel(p[0.4500000, 0.0000000, 0.2000000, " in text


def test_more_actions_than_statements_are_a_difference() -> None:
    """What a file does beyond the plan is no less wrong than what it leaves out."""
    plan = plan_statements(recorded("BEGIN PAUSE 0.1 END.", "rapid"), "x")
    text = rapid.write(plan).text.replace("WaitTime 0.1000;", "WaitTime 0.1000;\nWaitTime 0.1000;")

    assert compare(rapid_checker.read(text), plan)[0].worst == 1
