"""Inputs and analogue devices in cell files."""

from pathlib import Path

import pytest

from armwright.cell.outputs import Device
from armwright.cell.reader import read_cell
from armwright.cell.signals import Input
from armwright.errors import FileFormatError

ARM = "[arms.ARM_1]\njoint_positions = [0.0, 0.5, 0.3, 0.0, 0.6, 0.0]\n"
DEVICES = "[devices]\nPRESS = {}\nVALVE = { analogue = true }\n"


def read(folder: Path, text: str) -> object:
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
    ],
)
def test_wrong_inputs(tmp_path: Path, entry: str, says: str) -> None:
    """A wrong input is refused, with its key and what was expected."""
    with pytest.raises(FileFormatError) as raised:
        read(tmp_path, f"{DEVICES}[inputs]\n{entry}\n")

    assert says in str(raised.value)
