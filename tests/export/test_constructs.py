"""The table of constructs by targets in docs/export.md: each of its cells is what happens."""

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import attrs
import pytest

from armwright.cell import read_cell
from armwright.cell.reader import DETOURS, parse_cell
from armwright.export import ExportError, export_run
from armwright.program import Recording, Source, run
from export.cases import CELLS, ROOT

PAGE = (ROOT / "docs" / "export.md").read_text(encoding="utf-8").partition("## Plan mode")[2]
HEAD, _, *ROWS = PAGE[PAGE.index("| construct") :].partition("\n\n")[0].splitlines()
TARGETS = [cell.strip() for cell in HEAD.strip("|").split("|")][1:]
TABLE = {
    cells[0].strip(): [cell.strip() for cell in cells[1:]] for cells in (row.strip("|").split("|") for row in ROWS)
}

DECLARED = """
VAR a, b, c, belt : FRAME ; n : SCALAR ; e : EVENT ;
PROCEDURE away ; BEGIN MOVE ARM_1 TO a * XYZ(0, 0, -0.05) END ;
BEGIN
  a = (1,0,0, 0,-1,0, 0,0,-1, 0.40, 0.15,0.20) ;
  b = (1,0,0, 0,-1,0, 0,0,-1, 0.45, 0.00,0.25) ;
  c = (1,0,0, 0,-1,0, 0,0,-1, 0.40,-0.15,0.20) ;
  MOVE ARM_1 TO a ;
"""
PROGRAMS = {
    "MOVE, point to point": "MOVE ARM_1 TO b ;",
    "STRAIGHTLY, APPROACH, DEPARTURE": "MOVE ARM_1 TO b STRAIGHTLY ; MOVE ARM_1 TO c WITH APPROACH = b ;",
    "MOVE to JOINTS": "MOVE ARM_1 TO JOINTS(10, -30, 40, 10, 20, 5) ;",
    "CIRCULARLY": "MOVE ARM_1 TO c CIRCULARLY, VIA (b) ;",
    "SMOOTHLY": "MOVE ARM_1 TO b SMOOTHLY ; MOVE ARM_1 TO c STRAIGHTLY, SMOOTHLY, WITH SPEED = 20 ;",
    "VIA": "MOVE ARM_1 TO c VIA (b) ;",
    "VIA with BLEND": "MOVE ARM_1 TO c VIA (b), WITH BLEND = 0.02 ;",
    "BLEND into the next MOVE of the joints": "MOVE ARM_1 TO b WITH BLEND = 0.02 ; MOVE ARM_1 TO c ;",
    "BLEND into the next MOVE": "MOVE ARM_1 TO b STRAIGHTLY, WITH BLEND = 0.02 ; MOVE ARM_1 TO c STRAIGHTLY ;",
    "SPEED, DURATION": "MOVE ARM_1 TO b WITH SPEED = 30 ; MOVE ARM_1 TO c WITH DURATION = 3 ;",
    "VELOCITY, ROTATION, ACCELERATION": (
        "MOVE ARM_1 TO b WITH VELOCITY = 0.1, WITH ROTATION = 30, WITH ACCELERATION = 0.5 ;"
        " MOVE ARM_1 TO c STRAIGHTLY, WITH VELOCITY = 0.1 ;"
    ),
    "OPEN, GRASP": "OPEN ARM_1 ; GRASP ARM_1 ;",
    "OPEN to a width": "OPEN ARM_1 TO 0.04 ;",
    "OPERATE": "OPERATE LAMP ON ; OPERATE LAMP OFF ;",
    "OPERATE of a device without an output": "OPERATE HORN ON ;",
    "OPERATE to a number": "OPERATE DIMMER TO 0.5 ;",
    "PULSE": "PULSE LAMP FOR 0.5 ; PAUSE 1 ;",
    "a device that is on at the end": "OPERATE LAMP ON ;",
    "PAUSE": "PAUSE 0.5 ;",
    "WAIT for an event": "WAIT e WITHIN 0.5 ELSE n = 1 ;",
    "WAIT UNTIL": "WAIT UNTIL NOT INPUT(door) WITHIN 1 ;",
    "IF of an INPUT": "IF INPUT(door) THEN HALT ; away() ;",
    "LOG": 'LOG "n" (2) ; away() ;',
    "PRINT": 'PRINT ("n", 2) ;',
    "IF, WHILE, FOR, procedures": "n = 2 ; IF n > 1 THEN away() ; WHILE n < 4 DO n = 4 ; FOR n = 1 TO 2 DO away() ;",
    "AFFIX, UNFIX, frames": "AFFIX c TO b ; b = b * XYZ(0, 0, 0.02) ; MOVE ARM_1 TO c STRAIGHTLY ; UNFIX c FROM b ;",
    "READ VISIONS": "READ VISIONS (c) ; MOVE ARM_1 TO c ;",
    "TRY, RECOVER": "TRY MOVE ARM_1 TO a * XYZ(5, 0, 0) RECOVER MOVE ARM_1 TO b END ;",
    "MOVE with TRACKING": "MOVE ARM_1 TO b * XYZ(0, 0, -0.01) WITH TRACKING = belt ;",
    "MOVE with CORRECTION": "MOVE ARM_1 TO b STRAIGHTLY, WITH CORRECTION = 0.002, WITH BOUND = 0.1, WITH RATE = 0.01 ;",
    "QUEUE, PUT": "QUEUE ARM_1 DO PUT b TO ARM_1 ;",
    "MOVE with ON": "MOVE ARM_1 TO c STRAIGHTLY, ON DIST(ARM_1, c) < 0.05 DO HALT ;",
    "WHEN, BRAKE, RESUME": "WHEN DIST(ARM_1, c) < 0.05 DO BEGIN BRAKE ; RESUME END ; MOVE ARM_1 TO c STRAIGHTLY ;",
    "ZERO FORCE": "ZERO FORCE ARM_1 ;",
    "COBEGIN, one thing after the other": "COBEGIN BEGIN MOVE ARM_1 TO b END ; BEGIN n = 2 END COEND ;",
    "COBEGIN, two things at the same time": (
        "COBEGIN BEGIN MOVE ARM_1 TO b END ; BEGIN PAUSE 0.1 ; OPERATE LAMP ON END COEND ;"
    ),
    "a gripper of a second arm": "GRASP ARM_2 ;",
    "a second arm": "MOVE ARM_2 TO ARM_2 * XYZ(0, 0, 0.05) ;",
}
# Where a path is not a straight line after all; the straight way comes too near to the axis of joint 1.
DETOUR = "detours of straight lines"
AROUND = """
VAR a, b : FRAME ;
BEGIN
  a = (1,0,0, 0,-1,0, 0,0,-1,  0.40,0.02,0.30) ;
  b = (1,0,0, 0,-1,0, 0,0,-1, -0.40,0.02,0.30) ;
  MOVE ARM_1 TO a ;
  MOVE ARM_1 TO b STRAIGHTLY ;
END.
"""


def cell_text(name: str) -> str:
    """A cell of the tests with a second arm, a device without an output, and an answer of the camera."""
    text = CELLS[name].read_text(encoding="utf-8")
    text = re.sub(r'model = "([\w./]+)\.toml"', lambda found: f'model = "{CELLS[name].parent}/{found[1]}.toml"', text)
    model = re.search(r"model = .*", text)
    convention = re.search(r"controller = .*", text)
    assert model is not None
    second = f"""
[frames.BELT]
at = [1, 0, 0,  0, 1, 0,  0, 0, 1,  0.4, 0, 0.1]
moves = {{ speed_mm_per_s = 10, window_mm = [-500, 500] }}

[arms.ARM_2]
{model[0]}
{convention[0] if convention else ""}
base = [1, 0, 0,  0, 1, 0,  0, 0, 1,   0.00, 3.00, 0.00]
hand = [1, 0, 0,  0,-1, 0,  0, 0,-1,   0.40, 3.00, 0.25]
encoders = {{ counts = [1e6, 1e6, 1e6, 1e6, 1e6, 1e6] }}
"""
    dimmer = '\nHORN = {}\nDIMMER = { analogue = true, output = 5, signal = "aoDimmer" }'
    text = text.replace("[devices]", f"{second}\n[devices]{dimmer}")
    text = text.replace("[inputs]", "[inputs]\nDOOR = {}") if "[inputs]" in text else f"{text}\n[inputs]\nDOOR = {{}}\n"
    text += "\n[arms.ARM_1.smooth]\nstiffness_Nm_per_rad = [6e4, 6e4, 4e4, inf, inf, inf]\n"
    return text.replace("[visions]", "[visions]\nC = [[1, 0, 0,  0,-1, 0,  0, 0,-1,   0.42,-0.10, 0.20]]")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str], Recording]:
    """The run of the program of a construct in the cell of a target; targets of one cell share it."""
    folder = tmp_path_factory.mktemp("constructs")

    @cache
    def in_cell(name: str, construct: str) -> Recording:
        path = folder / f"{name}.toml"
        path.write_text(cell_text(name), encoding="utf-8")
        return run(Source("construct.rlo", f"{DECLARED}{PROGRAMS[construct]}\nEND."), read_cell(path))

    return lambda target, construct: in_cell(target if target in CELLS else "urscript", construct)


def test_streams_of_whole_periods() -> None:
    """A motion of a whole number of periods, but for rounding, is streamed in so many."""
    counted = 0
    for seconds in (0.84, 0.968, 0.976):
        motion = f"{DECLARED}MOVE ARM_1 TO b SMOOTHLY, WITH DURATION = {seconds:.3f} ;\nEND."
        recording = run(Source("stream.rlo", motion), parse_cell(Path("urscript.toml"), cell_text("urscript")))
        counted += recording.stages[-1].motion.duration > round(seconds / 0.008) * 0.008
        script = export_run("urscript", recording, "stream").files["stream.script"]
        assert script.count("servoj(") == round(seconds / 0.008)
    assert counted


def test_the_table_is_whole() -> None:
    """Every construct of the table has a program, and no other has; every target has a column."""
    assert set(TABLE) == {*PROGRAMS, DETOUR}
    assert TARGETS == ["urscript", "krl", "rapid", "fanuc", "ros2", "csv"]


@pytest.mark.parametrize("construct", PROGRAMS)
@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.drawn(0.3)
def test_cells_of_the_table(target: str, construct: str, recorded: Callable[[str, str], Recording]) -> None:
    """What the table says is in the files, or is the code of the refusal."""
    said = TABLE[construct][TARGETS.index(target)]
    recording = recorded(target, construct)
    if said.startswith("E6"):
        with pytest.raises(ExportError) as caught:
            export_run(target, recording, "construct")
        assert caught.value.diagnostic.code == said
        assert str(caught.value).startswith("construct.rlo:9: ")
        return
    files = export_run(target, recording, "construct").files
    texts = "\n".join(f"{name}\n{text}" for name, text in files.items() if name != "proof.json")

    assert said.strip("`") in texts


@pytest.mark.parametrize("construct", ["READ VISIONS", "TRY, RECOVER", "IF of an INPUT", "LOG"])
def test_what_is_fixed_is_said(construct: str, recorded: Callable[[str, str], Recording]) -> None:
    """Answers of a camera, values of inputs, rows and errors of the run are named in the proof, with their lines."""
    notes = export_run("ros2", recorded("ros2", construct), "construct").proof.notes

    assert [note[:8] for note in notes] == ["line 9: "]


def test_waits_for_an_event_keep_their_time(recorded: Callable[[str, str], Recording]) -> None:
    """A program that waits for an event in vain waits on the controller too, as long as in the run."""
    recording = recorded("urscript", "WAIT for an event")
    (waited,) = (effect for effect in recording.effects if effect.kind == "WAIT")
    text = export_run("urscript", recording, "construct").files["construct.script"]

    assert waited.t1 - waited.t0 == pytest.approx(0.5)
    assert text.count("  sleep(0.5000)\n") == 1


def test_detours_are_knots() -> None:
    """A detour is written as a path past frames is."""
    recording = run(Source("construct.rlo", AROUND), attrs.evolve(read_cell(CELLS["urscript"]), around=DETOURS["via"]))

    assert [stage.stage.detour is None for stage in recording.stages] == [True, False]
    for target in ("urscript", "ros2"):
        exported = export_run(target, recording, "construct")
        assert any(TABLE[DETOUR][TARGETS.index(target)].strip("`") in text for text in exported.files.values())
    assert TABLE[DETOUR] == TABLE["VIA"]
