"""MOVEs that would run into something, and contacts that are wanted."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.kinematics.forward_kinematics import forward
from armwright.physics.clearance import RESOLUTION
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.vm.interpreter import motion_warnings
from armwright.program.vm.machine import RunError
from program.running import failure, run

ARM = """
[arms.ARM_1]
model = "stanford"
hand = [1,0,0, 0,-1,0, 0,0,-1, 0.45, 0.00, 0.25]
[arms.ARM_1.gripper]
opening_mm = 80
"""
SECOND = """
[arms.ARM_2]
model = "stanford"
base  = [-1,0,0, 0,-1,0, 0,0,1, 1.10, 0.00, 0.00]
hand  = [-1,0,0, 0,1,0, 0,0,-1, 0.65, 0.00, 0.25]
"""
TABLE = "table = { z = 0.03, from = [0.15, -0.7], to = [0.9, 0.7] }\n"
BLOCK = """
[parts.BLOCK]
size_mm = [40, 40, 40]
mass_kg = 0.2
at = [1,0,0, 0,1,0, 0,0,1, 0.40, 0.15, 0.05]
grasp = [1,0,0, 0,-1,0, 0,0,-1, 0,0,0]
[visions]
OBJ = { part = "BLOCK" }
"""


def cell_with(tmp_path: Path, scene: str, more: str = "", y: float = 0.0) -> Cell:
    path = tmp_path / "cell.toml"
    path.write_text(f"[scene]\n{scene}{ARM.replace('0.00, 0.25', f'{y}, 0.25')}{more}")
    return read_cell(path)


def box(name: str, at: tuple[float, float, float], size: tuple[float, float, float]) -> str:
    numbers = ", ".join(f"{x:g}" for x in at)
    return f'boxes = [{{ name = "{name}", at = [1,0,0, 0,1,0, 0,0,1, {numbers}], size_mm = {list(size)} }}]\n'


def down(x: float, y: float, z: float) -> str:
    return f"(1,0,0, 0,-1,0, 0,0,-1, {x}, {y}, {z})"


def said(error: RunError) -> Diagnostic:
    """What is said of a MOVE that was refused before the arm moved."""
    assert error.recording is not None
    assert not any(stream.qd.any() for stream in error.recording().streams)
    return error.diagnostic


PICK = f"""
VAR obj, slot, over, above : FRAME ;
BEGIN
  READ VISIONS (obj) ;
  slot = {down(0.40, -0.15, 0.05)} ;
  over = obj * XYZ(0,0,-0.08) ;
  above = slot * XYZ(0,0,-0.08) ;
  OPEN ARM_1 ;
  MOVE ARM_1 TO obj WITH APPROACH = over ;
  GRASP ARM_1 ;
  AFFIX obj TO ARM_1 ;
"""
PLACE = """
  MOVE obj TO slot WITH DEPARTURE = over, WITH APPROACH = above ;
  OPEN ARM_1 ;
  UNFIX obj ;
  MOVE ARM_1 TO above STRAIGHTLY ;
END.
"""


def test_into_the_table(tmp_path: Path) -> None:
    """A hand that is sent below the top of a table is refused: with what meets what, where, how deep."""
    cell = cell_with(tmp_path, TABLE)
    program = f"VAR low : FRAME ; BEGIN low = {down(0.45, 0, 0.01)} ; MOVE ARM_1 TO low STRAIGHTLY ; END."

    fault = said(failure(program, cell))

    # The fingers end at the tool point, 0.22 of 0.24 m above the table, and 20 mm below its top at the end.
    assert fault.code == "E406"
    assert fault.message == (
        "`low` cannot be reached by ARM_1 on this path: finger would hit TABLE 92 % of the way there, 20 mm deep"
    )
    assert "z" not in fault.notes[0]
    x, y, z = (float(number) for number in fault.notes[0].split("(")[1].split(")")[0].split(","))
    assert (x, abs(y), z) == (pytest.approx(450, abs=15), pytest.approx(0, abs=50), pytest.approx(30, abs=1))
    assert any("APPROACH" in help_ for help_ in fault.helps)


def test_a_thin_plate_at_full_speed(tmp_path: Path) -> None:
    """A plate of a millimetre in the way is found at the highest speed; beside the way it is none."""
    program = f"VAR b : FRAME ; BEGIN b = {down(0.45, 0.3, 0.25)} ; MOVE ARM_1 TO b WITH SPEED = 120 ; END."
    plates = [box("PLATE", (0.5, 0.0, z), (300, 1, 100)) for z in (0.25, 0.0)]
    there, below = (cell_with(tmp_path, plate, y=-0.3) for plate in plates)

    fault = said(failure(program, there))

    assert (fault.code, "finger would hit PLATE" in fault.message) == ("E406", True)
    assert run(program, below).failure is None


def test_wanted_contacts(tmp_path: Path) -> None:
    """A part that lies on a table is grasped, lifted, set down and let go, and nothing is wrong with that."""
    cell = cell_with(tmp_path, TABLE, BLOCK)

    recording = run(PICK + PLACE, cell)

    track = recording.parts["BLOCK"]
    assert track.carriers == (None, "ARM_1", None)
    np.testing.assert_allclose(track.poses[-1][:3, 3], (0.40, -0.15, 0.05), atol=1e-6)
    q = recording.streams[0].q[round(2.5 / cell.period)]
    arm, X_HP = track.at(2.5)
    hand = cell.arms["ARM_1"].base @ forward(cell.arms["ARM_1"].arm, q)
    assert arm == "ARM_1"
    np.testing.assert_allclose((hand @ X_HP)[:3, 3], hand[:3, 3], atol=1e-6)


def test_dragged_along_the_table(tmp_path: Path) -> None:
    """A part that is not lifted first, or is set down too deep, is refused."""
    cell = cell_with(tmp_path, TABLE, BLOCK)
    dragged = PICK + "MOVE obj TO slot STRAIGHTLY ; END."
    deep = PICK.replace("0.15, 0.05)", "0.15, 0.049)") + PLACE

    fault = failure(dragged, cell).diagnostic
    assert (fault.code, "BLOCK would" in fault.message, "TABLE" in fault.message) == ("E406", True, True)
    fault = failure(deep, cell).diagnostic
    assert "BLOCK would hit TABLE 9" in fault.message
    assert fault.message.endswith("1 mm deep")


def test_held_part_into_a_box(tmp_path: Path) -> None:
    """What the hand holds meets a wall that the hand itself passes over."""
    # The fingers end at 0.13 m, the part at 0.11 m.
    cell = cell_with(tmp_path, TABLE + box("WALL", (0.40, 0.0, 0.0725), (200, 20, 85)), BLOCK)
    way = "MOVE {} TO over STRAIGHTLY ; MOVE {} TO above STRAIGHTLY ; END."

    fault = failure(PICK + way.format("obj", "obj"), cell).diagnostic

    assert fault.code == "E406"
    assert "BLOCK would hit WALL" in fault.message
    assert fault.message.endswith(", 5 mm deep")
    assert run(PICK + "OPEN ARM_1 ; UNFIX obj ; " + way.format("ARM_1", "ARM_1"), cell).failure is None


def test_try_recovers(tmp_path: Path) -> None:
    """A collision is an error as the others: RECOVER finds another way."""
    cell = cell_with(tmp_path, box("POST", (0.45, 0.0, 0.25), (40, 40, 300)), y=-0.25)
    text = f"""VAR b, beyond : FRAME ; BEGIN
      b = {down(0.45, 0.25, 0.25)} ; beyond = {down(0.62, 0.0, 0.25)} ;
      {{}} END."""

    assert failure(text.format("MOVE ARM_1 TO b STRAIGHTLY ;"), cell).diagnostic.code == "E406"
    recording = run(text.format("TRY MOVE ARM_1 TO b STRAIGHTLY ; RECOVER MOVE ARM_1 TO b VIA (beyond) ; END"), cell)
    assert [effect.kind for effect in recording.effects if effect.kind in ("ERROR", "MOVE")] == ["ERROR", "MOVE"]


def test_force_guard(tmp_path: Path) -> None:
    """A MOVE that a force ends may touch what it presses on, and the next one may leave it."""
    cell = cell_with(tmp_path, TABLE)
    low = f"VAR low, up : FRAME ; BEGIN low = {down(0.45, 0, 0.02)} ; up = {down(0.45, 0, 0.25)} ;"

    guarded = f"{low} MOVE ARM_1 TO low STRAIGHTLY, ON FORCE(Z) > 8 DO HALT ; MOVE ARM_1 TO up STRAIGHTLY ; END."
    assert run(guarded, cell).failure is None
    again = guarded.replace("END.", "MOVE ARM_1 TO low STRAIGHTLY ; END.")
    assert failure(again, cell).diagnostic.code == "E406"


def test_touching_at_the_start(tmp_path: Path) -> None:
    """An arm that stands in something before it moves is told with both names."""
    cell = cell_with(tmp_path, box("BOX", (0.45, 0.0, 0.24), (300, 300, 100)))

    program = f"VAR a : FRAME ; BEGIN a = {down(0.45, 0.1, 0.25)} ; MOVE ARM_1 TO a ; END."

    fault = said(failure(program, cell))

    assert fault.message.startswith("`a` cannot be reached by ARM_1: ")
    assert " touches BOX before it moves, " in fault.message


def test_clearance(tmp_path: Path) -> None:
    """The least distance of a stage is known, and warned of where it is less than the cell wants."""
    cell = cell_with(tmp_path, TABLE, "[motion]\nclearance_mm = 40\n")
    program = f"""VAR a, b : FRAME ; BEGIN a = {down(0.45, -0.2, 0.06)} ; b = {down(0.45, 0.2, 0.06)} ;
      MOVE ARM_1 TO a ; MOVE ARM_1 TO b STRAIGHTLY ; MOVE ARM_1 TO b * XYZ(0,0,-0.1) ; END."""

    recording = run(program, cell)

    last = recording.stages[1].clearance
    assert last is not None
    assert last.distance == pytest.approx(0.03, abs=1.1e-3)  # the deviation of the line
    assert last.bound <= 0.03
    assert last.bound >= last.distance * 0.9 - RESOLUTION
    assert last.bodies == ("finger", "TABLE")
    warnings = [warning for warning in motion_warnings(recording.stages, cell) if warning.code == "W404"]
    assert len(warnings) == 3
    assert warnings[1].message.startswith("finger of ARM_1 comes within 30")


def test_two_arms(tmp_path: Path) -> None:
    """An arm does not come to where another stands, nor into the way of one that moves; it may once that has gone."""
    cell = cell_with(tmp_path, "", SECOND)
    head = f"""VAR meet, away, back : FRAME ; gone : EVENT ; BEGIN
      meet = {down(0.62, 0.0, 0.25)} ; away = {down(0.80, 0.3, 0.25)} ; back = {down(0.45, 0.0, 0.25)} ;"""

    fault = said(failure(f"{head} MOVE ARM_1 TO meet STRAIGHTLY ; END.", cell))
    assert (fault.code, "ARM_2" in fault.message) == ("E406", True)
    assert any("ARM_2 is out of the way" in help_ for help_ in fault.helps)
    assert run(f"{head} MOVE ARM_2 TO away ; MOVE ARM_1 TO meet STRAIGHTLY ; END.", cell).failure is None
    branches = "COBEGIN BEGIN MOVE ARM_2 TO away {} END ; BEGIN {} MOVE ARM_1 TO meet {} END COEND END."
    together = branches.format("WITH SPEED = 10 ;", "PAUSE 0.001 ;", "WITH SPEED = 100 ;")
    assert failure(head + together, cell).diagnostic.code == "E406"
    later = branches.format(";", "PAUSE 0.001 ;", "WITH SPEED = 10 ;")
    assert run(head + later, cell).failure is None


def test_an_arm_that_is_stopped_in_the_way_of_another(tmp_path: Path) -> None:
    """An arm that relied on another going away is stopped when that one halts; RECOVER of it goes on."""
    cell = cell_with(tmp_path, "", SECOND)
    text = f"""VAR meet, away, back : FRAME ; BEGIN
      meet = {down(0.62, 0.0, 0.25)} ; away = {down(0.80, 0.3, 0.25)} ; back = {down(0.45, 0.0, 0.25)} ;
      COBEGIN
        BEGIN MOVE ARM_2 TO away WITH SPEED = 60, ON DIST(ARM_2, away) < 0.32 DO HALT END ;
        BEGIN PAUSE 0.001 ; {{}} END
      COEND END."""
    relying = "MOVE ARM_1 TO meet WITH SPEED = 10 ;"

    queue = failure(text.format("QUEUE ARM_1 WITH SPEED = 10 DO PUT meet TO ARM_1"), cell).diagnostic
    assert queue.code == "E406"
    assert queue.label == "ARM_2 was to be elsewhere by then, but it has been stopped"
    fault = failure(text.format(relying), cell).diagnostic
    assert fault.code == "E406"
    assert "ARM_2 was to be elsewhere by then, but it has been stopped" in fault.notes
    recording = run(text.format(f"TRY {relying} RECOVER MOVE ARM_1 TO back ; END"), cell)
    assert recording.failure is None
    assert any(stage.stopped and stage.arm == "ARM_1" for stage in recording.stages)


def test_imported_only_where_it_is_needed(tmp_path: Path) -> None:
    """A cell with one arm and nothing to run into imports neither the engine nor what checks collisions."""
    (tmp_path / "a.toml").write_text(ARM)
    (tmp_path / "b.toml").write_text(f"[scene]\n{TABLE}{ARM}")
    program = f"VAR a : FRAME ; BEGIN a = {down(0.45, 0.1, 0.25)} ; MOVE ARM_1 TO a ; END."
    script = (
        "import sys; from armwright.program import run; r = run(sys.argv[1], cell=sys.argv[2]);"
        "print(r.checked is None, *(name in sys.modules for name in ('mujoco', 'armwright.physics.collisions')))"
    )
    (tmp_path / "p.rlo").write_text(program)
    for name, answer in (("a", "True False False"), ("b", "False True True")):
        command = [sys.executable, "-c", script, str(tmp_path / "p.rlo"), str(tmp_path / f"{name}.toml")]
        assert subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip() == answer
