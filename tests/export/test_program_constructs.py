"""The table of constructs of program mode in docs/export.md: each of its cells is what is written."""

import re
from pathlib import Path

import pytest

from armwright.cell import Cell, read_cell
from armwright.export import ExportError, export_program
from armwright.program import Source, compile as compile_program
from export.cases import EXAMPLES, ROOT

PAGE = (ROOT / "docs" / "export.md").read_text(encoding="utf-8")
SECTION = PAGE[PAGE.index("## Program mode") : PAGE.index("## Plan mode")]
HEAD, _, *ROWS = SECTION[SECTION.index("| construct") :].partition("\n\n")[0].splitlines()
TARGETS = [cell.strip() for cell in HEAD.strip("|").split("|")][1:]
TABLE = {
    cells[0].strip(): [cell.strip() for cell in cells[1:]] for cells in (row.strip("|").split("|") for row in ROWS)
}
CELLS = {
    "urscript": EXAMPLES / "ur5_cell.toml",
    "krl": EXAMPLES / "kr6_cell.toml",
    "rapid": EXAMPLES / "irb120_cell.toml",
    "fanuc": EXAMPLES / "lrmate_cell.toml",
}
DECLARED = """
UNITS MM ;
RECORD part ; weight : SCALAR ; place : FRAME ; END ; VAR n : SCALAR ; note : TEXT ; flag : BOOLEAN ;
VAR item : ARRAY [2] OF part ; a, b, c, belt : FRAME ; slot : ARRAY [2] OF FRAME ;
PROCEDURE visit(f : FRAME) ; BEGIN MOVE ARM_1 TO f END ;
FUNCTION beside(f : FRAME) : FRAME ; BEGIN RETURN f * XYZ(n, 0, 0) END ;
BEGIN
  n = 50 ;
  a = (1,0,0, 0,-1,0, 0,0,-1, 400, 50, 150) ;
  b = (1,0,0, 0,-1,0, 0,0,-1, 400, 90, 150) ;
  MOVE ARM_1 TO a ;
"""
PROGRAMS = {
    "assignment, numbers, conditions": "n = n + 1 ; flag = n > 2 ;",
    "frames, `f * t`, INV": "c = a * XYZ(0, 0, 20) ; MOVE ARM_1 TO c * (INV(a) * b) ;",
    "arrays": "slot[1] = a ; MOVE ARM_1 TO slot[1] ;",
    "RECORD": "item[1].weight = 5 ; item[1].place = b ; item[2] = item[1] ; MOVE ARM_1 TO item[2].place ;",
    "IF": "IF n > 2 THEN PAUSE 0.1 ELSE PAUSE 0.2 ;",
    "WHILE, REPEAT": "WHILE n > 49 DO n = n - 1 ; REPEAT n = n + 1 UNTIL n > 60 ;",
    "FOR": "FOR n = 1 TO 3 DO PAUSE 0.1 ;",
    "PROCEDURE": "visit(b) ;",
    "FUNCTION": "n = 10 ; MOVE ARM_1 TO beside(a) ;",
    "MOVE, point to point": "MOVE ARM_1 TO b ;",
    "STRAIGHTLY, APPROACH, DEPARTURE": "MOVE ARM_1 TO b STRAIGHTLY ; MOVE ARM_1 TO a WITH APPROACH = b ;",
    "VIA, BLEND": "MOVE ARM_1 TO b VIA (a * XYZ(0, 0, -40), b * XYZ(0, 0, -40)), WITH BLEND = 10 ;",
    "SPEED that is worked out": "MOVE ARM_1 TO b STRAIGHTLY, WITH SPEED = n ;",
    "DURATION": "MOVE ARM_1 TO b WITH DURATION = 3 ;",
    "AFFIX, UNFIX": "c = a ; AFFIX c TO ARM_1 ; MOVE c TO b ; UNFIX c ;",
    "OPEN, GRASP, OPERATE": "OPEN ARM_1 ; GRASP ARM_1 ; OPERATE LAMP ON ;",
    "PULSE": "PULSE LAMP FOR 200ms ;",
    "INPUT, OUTPUT": "IF INPUT(large) OR OUTPUT(lamp) THEN PAUSE 0.1 ;",
    "WAIT UNTIL": "WAIT UNTIL INPUT(part_there) ;",
    "WAIT UNTIL ... WITHIN ... ELSE": "WAIT UNTIL INPUT(large) WITHIN 0.5 ELSE PAUSE 0.1 ;",
    "PAUSE": "PAUSE 0.5 ;",
    "PRINT of texts and numbers": 'PRINT("n", n) ;',
    "READ VISIONS": "READ VISIONS (c) ; MOVE ARM_1 TO c ;",
    "HALT": "HALT ;",
    "MOVE with TRACKING": "MOVE ARM_1 TO b * XYZ(0, 0, -10) WITH TRACKING = belt ;",
    "MOVE with CORRECTION": "MOVE ARM_1 TO b STRAIGHTLY, WITH CORRECTION = 2, WITH BOUND = 5, WITH RATE = 10 ;",
    "QUEUE, PUT": "QUEUE ARM_1 DO PUT b TO ARM_1 ;",
    "MOVE with ON": "MOVE ARM_1 TO b STRAIGHTLY, ON DIST(ARM_1, b) < 5 DO HALT ;",
    "OPEN to a width": "OPEN ARM_1 TO 40mm ;",
    "TRY, RECOVER, RAISE": "TRY RAISE odd ; RECOVER PAUSE 0.1 ; END ;",
    "WHEN, BRAKE, RESUME": "WHEN n > 99 DO n = 1 ;",
    "TIMER": "TIMER t ON ;",
    "MOVE to JOINTS": "MOVE ARM_1 TO JOINTS(10, -60, 60, 0, 30, 0) ;",
    "CIRCULARLY": "MOVE ARM_1 TO b CIRCULARLY, VIA (b * XYZ(20, 20, 0)) ;",
    "SMOOTHLY": "IF n > 99 THEN MOVE ARM_1 TO b SMOOTHLY ;",
    "VELOCITY, ROTATION, ACCELERATION": "MOVE ARM_1 TO b STRAIGHTLY, WITH ROTATION = 20 ;",
    "BLEND into the next MOVE": "MOVE ARM_1 TO b WITH BLEND = 10 ; MOVE ARM_1 TO a ;",
    "COBEGIN, EVENT, LOCK": "COBEGIN BEGIN PAUSE 0.1 END ; BEGIN n = 2 END COEND ;",
    "TIME, LOG, TEXT, MOD, ROUND, FORCE, ANALOG": 'note = TEXT("n", n) ; PRINT(note) ;',
}


def cell(target: str, folder: Path) -> Cell:
    """The cell of a target, whose camera sees C."""
    text = CELLS[target].read_text(encoding="utf-8")
    text = re.sub(r'model = "(\w+\.toml)"', lambda found: f'model = "{EXAMPLES / found[1]}"', text)
    path = folder / f"{target}.toml"
    belt = (
        "[frames.BELT]\nat = [1,0,0, 0,1,0, 0,0,1, 0.4,0,0.1]\nmoves = { speed_mm_per_s = 10, window_mm = [-500, 500] }"
    )
    text += "\n[arms.ARM_1.smooth]\nstiffness_Nm_per_rad = [6e4, 6e4, 4e4, inf, inf, inf]\n"
    seen = "C = [[1,0,0, 0,-1,0, 0,0,-1, 0.40,0.06,0.16]]"
    path.write_text(text.replace("[visions]", f"{belt}\n\n[visions]\n{seen}"), "utf-8")
    return read_cell(path)


def test_the_table_is_whole() -> None:
    """Every construct of the table has a program, and no other has; every target has a column."""
    assert set(TABLE) == set(PROGRAMS)
    assert [*CELLS] == TARGETS


@pytest.mark.parametrize("construct", PROGRAMS)
@pytest.mark.parametrize("target", CELLS)
@pytest.mark.drawn(0.4)
def test_cells_of_the_table(target: str, construct: str, tmp_path: Path) -> None:
    """What the table says is in the file, which does what the run did, or is the code of the refusal."""
    said = TABLE[construct][TARGETS.index(target)].strip("`")
    program = Source("construct.rlo", f"{DECLARED}{PROGRAMS[construct]}\nEND.")
    compiled = compile_program(program, cell(target, tmp_path))
    if not said.startswith("E6"):
        files = export_program(target, compiled, mode="program").files
        assert any(said.strip() in text for name, text in files.items() if name != "proof.json"), next(
            iter(files.values())
        )
        return
    with pytest.raises(ExportError) as caught:
        export_program(target, compiled, mode="program")
    assert caught.value.diagnostic.code == said
    assert str(caught.value).startswith("construct.rlo:12: ")
