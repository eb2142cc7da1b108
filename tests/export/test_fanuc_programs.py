"""Program mode for FANUC: what is worked out before, what is refused, and what its machine does not run."""

import re

import pytest

from armwright.cell import read_cell
from armwright.export import ExportError, export_program
from armwright.export.checkers.actions import CheckError, ReadProgram
from armwright.export.checkers.cell_world import CellWorld
from armwright.export.checkers.fanuc_machine import run as run_files
from armwright.program import Source
from export.cases import EXAMPLES

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

CELL = read_cell(EXAMPLES / "lrmate_cell.toml")
HEAD = """UNITS MM ;
VAR a, b : FRAME ; n, m : SCALAR ; flag : BOOLEAN ;
PROCEDURE visit(f : FRAME) ; BEGIN MOVE ARM_1 TO f ; m = m + 1 END ;
BEGIN
a = WORLD * XYZ(400, 20, 120) * RPY(180, 0, 10) ; b = a * XYZ(0, 60, 0) ; n = 1 ; m = 0 ;
"""
FILE = "/PROG T\n/ATTR\n/MN\n{lines}\n/POS\n/END\n"


def files(statements: str) -> dict[str, str]:
    """The files of some statements, which have been proved."""
    found = export_program("fanuc", Source("test.rlo", f"{HEAD}{statements}\nEND."), CELL, name="test").files
    return {name: text for name, text in found.items() if name != "proof.json"}


def refused(statements: str) -> ExportError:
    """Why some statements are refused."""
    with pytest.raises(ExportError) as caught:
        files(statements)
    return caught.value


def ran(*lines: str) -> ReadProgram:
    """What the machine does by some lines."""
    numbered = "\n".join(f"{i:4d}:  {line} ;" for i, line in enumerate(lines, 1))
    return run_files([FILE.format(lines=numbered)], CellWorld(CELL, ()))


def test_a_procedure_is_written_for_each_place() -> None:
    """Calls for one place share a program, and others have one of their own, with the positions that it needs."""
    found = files("visit(a) ; visit(b) ; visit(a) ;")

    assert [*found] == ["TEST.ls", "VISIT.ls", "VISIT_2.ls"]
    assert re.findall(r"CALL (\w+)", found["TEST.ls"]) == ["VISIT", "VISIT_2", "VISIT"]
    assert found["VISIT.ls"] != found["VISIT_2.ls"].replace("VISIT_2", "VISIT")


def test_passes_stand_one_after_the_other_where_frames_depend_on_them() -> None:
    """A FOR stays one where it can; where its frames differ it is written out, and frames placed in it are known."""
    plain = files("FOR n = 1 TO 3 DO BEGIN visit(a) ; visit(b) END ;")
    moved = files("FOR n = 1 TO 3 DO FOR m = 1 TO n DO MOVE ARM_1 TO a * XYZ(5*n, 10*m, 0) ;")
    placed = files("FOR n = 1 TO 3 DO b = a * XYZ(0, 20*n, 0) ; MOVE ARM_1 TO b ;")

    assert plain["TEST.ls"].count("CALL ") == 2
    assert "FOR " not in moved["TEST.ls"]
    assert moved["TEST.ls"].count("\nP[") == 1 + 6
    assert placed["TEST.ls"].count("\nP[") == 1 + 1


@pytest.mark.parametrize(
    ("statements", "code", "word"),
    [
        ("WHILE n < 3 DO BEGIN MOVE ARM_1 TO a * XYZ(0, 10*n, 0) ; n = n + 1 END ;", "E620", "this MOVE leads"),
        ("IF INPUT(large) THEN b = a ;\nMOVE ARM_1 TO b ;", "E620", "this MOVE leads"),
        ("IF INPUT(large) THEN n = 4 ;\nPRINT(n) ;", "E620", "MESSAGE"),
        ("IF INPUT(large) THEN n = 4 ;\nm = SQRT(n) ;", "E620", "SQRT"),
        ("PULSE lamp FOR 0.25 ;", "E619", "PULSE"),
        ("IF INPUT(large) THEN n = 4 ;\nWAIT UNTIL INPUT(part_there) WITHIN 5*n ;", "E619", "WITHIN"),
    ],
)
def test_what_is_known_only_while_the_program_runs_is_refused(statements: str, code: str, word: str) -> None:
    """It is refused with the line that needs it."""
    error = refused(statements)

    assert error.diagnostic.code == code
    assert word in str(error)
    assert str(error).startswith(f"test.rlo:{6 + statements.count(chr(10))}: ")


def test_conditions_and_numbers_as_the_pendant_writes_them() -> None:
    """A signal or a flag alone is negated, what is always so is decided, and negative numbers stand in parentheses."""
    text = files("n = -2 ; flag = NOT (n > 2 OR INPUT(large)) ; IF X(a) > 100 THEN m = -n ELSE m = 9 ;")["TEST.ls"]

    assert "R[101:n]=(-2) " in text
    assert "F[103:flag]" not in text
    assert "F[101:flag]=((R[101:n]<=2) AND (!DI[2])) " in text
    assert "R[102:m]=(0-R[101:n]) " in text
    assert "[102:m]=9 " not in text


def test_the_machine_runs_control_flow() -> None:
    """Loops up and down, jumps, and both ways of an IF, against what the words say."""
    lines = ["R[1]=0", "FOR R[2]=3 DOWNTO 1", "R[1]=(R[1]*10+R[2])", "ENDFOR", "LBL[7]", "R[1]=(R[1]-100)"]
    lines += ["IF (R[1]>50),JMP LBL[7]", "IF (R[1]=21) THEN", "MESSAGE[yes]", "ELSE", "MESSAGE[no]", "ENDIF"]
    lines += ["FOR R[3]=2 TO 1", "MESSAGE[never]", "ENDFOR", "ABORT", "MESSAGE[behind]"]
    done = ran(*lines)

    assert [action.text for action in done.actions] == ["yes"]


@pytest.mark.parametrize(
    ("line", "word"),
    [
        ("R[1]=(R[2]+1)", "holds nothing yet"),
        ("JMP LBL[3]", "no LBL"),
        ("CALL NOBODY", "no program NOBODY"),
        ("CALL T", "too deep"),
        ("R[1]=ON", "cannot hold"),
        ("FOR R[1]=1 TO 2", "no end"),
        ("ENDIF", "ends no block"),
        ("FOR R[1]=1 TO 1.5 ;\n   2:  ENDFOR", "whole numbers"),
        ("J P[1] 10% FINE", "with the tool"),
        ("UTOOL[9]=PR[9]", "holds nothing yet"),
        ("SELECT R[1]=1,JMP LBL[1]", "does not know"),
    ],
)
def test_the_machine_names_what_it_does_not_run(line: str, word: str) -> None:
    """What a controller would stop at, or what is not known here, ends the proof with its line."""
    with pytest.raises(CheckError, match=rf"^line \d+: .*{word}"):
        ran(line)
