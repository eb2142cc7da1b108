"""Inputs and analogue devices in cell files."""

from pathlib import Path

import numpy as np
import pytest

from armwright.cell.model import Cell
from armwright.cell.outputs import Device
from armwright.cell.reader import read_cell
from armwright.cell.signals import Input
from armwright.errors import FileFormatError

ARM = "[arms.ARM_1]\njoint_positions = [0.0, 0.5, 0.3, 0.0, 0.6, 0.0]\n"
FRAMES = """[frames]
TRAY = [1, 0, 0,  0, 0, 1,  0,-1, 0,  0.5, 0.1, 0.2]
HELD = { on = "ARM_1", at = [1, 0, 0,  0, 1, 0,  0, 0, 1,  0, 0, 0] }
BELT = { at = [1, 0, 0,  0, 1, 0,  0, 0, 1,  0, 0, 0], moves = { speed_mm_per_s = 10, window_mm = [0, 100] } }
"""
DEVICES = "[devices]\nPRESS = {}\nVALVE = { analogue = true }\n"


def read(folder: Path, text: str) -> Cell:
    path = folder / "cell.toml"
    path.write_text(ARM + text, encoding="utf-8")
    return read_cell(path)


def test_inputs(tmp_path: Path) -> None:
    """Inputs have a start, a timeline, a device that they follow or an event that switches them on."""
    path = tmp_path / "cell.toml"
    path.write_text(
        f"""{ARM}{DEVICES}[inputs]
door = {{ start = 1, timeline = [[0.5, 0], [2, 1]] }}
PRESSED = {{ follows = "press", delay_s = 0.8 }}
ASKED = {{ event = "ready", pulse_s = 0.2 }}
LEVEL = {{ analogue = true, start = -2.5, timeline = [[1, 3.5]] }}
PLAIN = {{}}
""",
        encoding="utf-8",
    )
    cell = read_cell(path)

    assert cell.inputs == {
        "DOOR": Input(start=1.0, timeline=((0.5, 0.0), (2.0, 1.0))),
        "PRESSED": Input(follows="PRESS", delay=0.8),
        "ASKED": Input(event="READY", pulse=0.2),
        "LEVEL": Input(analogue=True, start=-2.5, timeline=((1.0, 3.5),)),
        "PLAIN": Input(),
    }
    assert cell.devices == {"PRESS": Device(), "VALVE": Device(analogue=True)}


def test_zones(tmp_path: Path) -> None:
    """A zone stands on a frame of the file, with a distance or with three sides along its own axes."""
    ball = '{ zone = { on = "tray", within_mm = 20 }, input = 3 }'
    box = "{ zone = { at = [1,0,0, 0,1,0, 0,0,1, 0.9,0,0.5], box_mm = [20, 1000, 500], inverted = true } }"
    inputs = read(tmp_path, f"{FRAMES}[inputs]\nBALL = {ball}\nBOX = {box}\n").inputs
    on_tray, gate = inputs["BALL"].zone, inputs["BOX"].zone
    assert on_tray is not None
    assert gate is not None

    assert (on_tray.arm, on_tray.radius, on_tray.sides, on_tray.inverted) == ("ARM_1", 0.02, None, False)
    np.testing.assert_allclose(on_tray.pose[:3], [[1, 0, 0, 0.5], [0, 0, -1, 0.1], [0, 1, 0, 0.2]], atol=1e-15)
    np.testing.assert_allclose(gate.pose[:3, 3], [0.9, 0, 0.5])
    assert gate.sides is not None
    assert (gate.sides.tolist(), gate.radius, gate.inverted) == ([0.02, 1.0, 0.5], None, True)


@pytest.mark.parametrize(
    ("entry", "says"),
    [
        ("A = { start = 2 }", "start"),
        ("A = { start = 0.5 }", "a digital input is 0 or 1, not 0.5"),
        ("A = { timeline = [[1, 1], [1, 0]] }", "expected times that increase, got 1 s behind 1 s"),
        ("A = { timeline = [[-1, 1]] }", "expected a time from 0 to 1e+06 s"),
        ("A = { timeline = [[1, 7]] }", "a digital input is 0 or 1, not 7"),
        ('A = { follows = "PRES" }', "PRES is not a device of the cell; did you mean PRESS?"),
        ("A = { delay_s = 1 }", "a delay needs the device"),
        ("A = { pulse_s = 1 }", "a pulse needs the EVENT"),
        ("A = { strat = 1 }", "strat"),
        ("PRESS = {}", "PRESS occurs twice"),
        ("ARM_1 = {}", "cannot name a frame or device"),
        ("A = { zone = {} }", "expected either within_mm, a distance, or box_mm, three sides"),
        ("A = { zone = { within_mm = 1, box_mm = [1, 2, 3] } }", "expected either within_mm"),
        ("A = { zone = { within_mm = 0 } }", "within_mm"),
        ("A = { zone = { box_mm = [1, 0, 3] } }", "expected three sides above 0 and up to 1e+06 mm"),
        (
            'A = { zone = { within_mm = 1, on = "TRAYS" } }',
            "TRAYS is not a standing frame",
        ),
        ('A = { zone = { within_mm = 1, on = "HELD" } }', "HELD is not a standing frame"),
        ('A = { zone = { within_mm = 1, on = "BELT" } }', "BELT is not a standing frame"),
        ('A = { zone = { within_mm = 1, arm = "ARM_2" } }', "ARM_2 is not an arm of the cell"),
        ("A = { zone = { within_mm = 1 }, start = 1 }", "an input with a zone is on and off by that alone"),
        ("A = { zone = { within_mm = 1, wihtin = 1 } }", "wihtin"),
    ],
)
def test_wrong_inputs(tmp_path: Path, entry: str, says: str) -> None:
    """A wrong input is refused, with its key and what was expected."""
    with pytest.raises(FileFormatError) as raised:
        read(tmp_path, f"{DEVICES}{FRAMES}[inputs]\n{entry}\n")

    assert says in str(raised.value)
