"""What the pages on file formats say is true."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from armwright.arm.load import read_arm, read_load
from armwright.cell.reader import read_cell
from armwright.errors import FileFormatError

DOCS = Path(__file__).parents[1] / "docs"
CELLS, ARMS = (DOCS / "cells.md").read_text(encoding="utf-8"), (DOCS / "arms.md").read_text(encoding="utf-8")


def example(page: str) -> str:
    """The TOML of a page."""
    return page.partition("```toml\n")[2].partition("```")[0]


def said(path: Path, text: str, read: Callable[[Path], object]) -> str:
    """What is said of a mistake in a file, without its folder."""
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FileFormatError) as caught:
        read(path)
    return str(caught.value).replace(f"{path.parent}/", "")


def test_cell_of_the_page(tmp_path: Path) -> None:
    """The cell on the page is read: two arms, a nest that hangs on the station, a part that is found twice."""
    (tmp_path / "cell.toml").write_text(example(CELLS), encoding="utf-8")

    cell = read_cell(tmp_path / "cell.toml")

    assert {name: arm.arm.name for name, arm in cell.arms.items()} == {"ARM_1": "stanford", "ARM_2": "puma560"}
    np.testing.assert_allclose(cell.tree().world("NEST")[:3, 3], (0.55, 0.10, 0.05), atol=1e-12)
    # The camera hangs 1.5 m above the bench and looks down: what is 1.45 m away from it lies 50 mm high.
    seen = [cell.camera @ X for X in cell.visions["PART"]]
    np.testing.assert_allclose([X[:3, 3] for X in seen], [(0.40, 0.15, 0.05), (0.45, 0.15, 0.05)], atol=1e-12)
    assert (cell.devices, cell.period, cell.deviation) == ({"PRESS", "LAMP"}, 0.002, 0.0005)


def test_arm_of_the_page(tmp_path: Path) -> None:
    """The arm on the page is read, every quantity in SI units."""
    (tmp_path / "lift.toml").write_text(example(ARMS), encoding="utf-8")

    arm = read_arm(tmp_path / "lift.toml")

    assert (arm.name, arm.n, arm.reach, arm.tool_speed) == ("lift", 2, 0.6, 0.5)
    np.testing.assert_array_equal(arm.tool, [[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0.08], [0, 0, 0, 1]])
    np.testing.assert_allclose(arm.limit("upper"), (0.9, np.radians(120)))
    np.testing.assert_allclose(arm.limit("acceleration"), (2, 4))
    # A rotor of 2e-5 kg m² behind a gear of 100:1; 0.51 kg m² about the end of the rod are 0.51 - 4.2 * 0.3² about
    # its middle.
    np.testing.assert_allclose([motor.inertia for motor in arm.motors], (3.0, 0.2))
    np.testing.assert_allclose(np.diag(arm.links[1].inertia), (0.01, 0.132, 0.132))
    assert arm.links[1].inertia[0, 2] == pytest.approx(0.002)


CELL_SLIPS = [
    ("grasp_s = ", "grasp_sec = "),
    ("[0.0, 0.5, 0.4", "[0.0, 3.0, 0.4"),
    ('on = "STATION"', 'on = "STATOIN"'),
]
ARM_SLIPS = [("mass_kg      =", "mass_gk      ="), ("= -120\nupper_deg               = 120", "= 120\nupper_deg = -120")]


@pytest.mark.parametrize("slip", range(len(CELL_SLIPS)))
def test_mistakes_in_a_cell(slip: int, tmp_path: Path) -> None:
    """The messages on the page are what these slips in its example are answered with."""
    text = example(CELLS).replace(*CELL_SLIPS[slip])

    assert f"    armwright: {said(tmp_path / 'cell.toml', text, read_cell)}\n" in CELLS


@pytest.mark.parametrize("slip", range(len(ARM_SLIPS)))
def test_mistakes_in_an_arm(slip: int, tmp_path: Path) -> None:
    """The messages on the page are what these slips in its example are answered with."""
    text = example(ARMS).replace(*ARM_SLIPS[slip])

    assert f"    armwright: {said(tmp_path / 'lift.toml', text, read_arm)}\n" in ARMS


def known_keys(message: str) -> list[str]:
    """The keys that the answer to an unknown one lists."""
    keys = message.split("known here: ")[1].split(", ")
    assert keys
    return keys


HEAD = "[arms.ARM_1]\nposture = [0, 0, 0.3, 0, 0, 0]\n"


@pytest.mark.parametrize(
    ("text", "table"),
    [
        (f"qqqqqqqq = 1\n{HEAD}", ""),
        (f"{HEAD}qqqqqqqq = 1\n", ""),
        (f"{HEAD}[frames.A]\nat = [1,0,0, 0,1,0, 0,0,1, 0,0,0]\nqqqqqqqq = 1\n", ""),
        (f"{HEAD}[camera]\nqqqqqqqq = 1\n", "camera."),
        (f"{HEAD}[contact]\nqqqqqqqq = 1\n", "contact."),
        (f"{HEAD}[motion]\nqqqqqqqq = 1\n", "motion."),
    ],
)
def test_every_key_of_a_cell_is_explained(text: str, table: str, tmp_path: Path) -> None:
    """What the reader of cells knows in a table, the page explains."""
    for key in known_keys(said(tmp_path / "cell.toml", text, read_cell)):
        assert re.search(rf"^\|.*`{table}{key}`.*\|", CELLS, re.MULTILINE), key


REVOLUTE, PRISMATIC = '[[joint]]\nkind = "revolute"\n', '[[joint]]\nkind = "prismatic"\n'
# Where a key may end in several units, the page names one of them in full and tells the others once.
UNITS = re.compile(r"_(rad|cm|mm|m|deg)(_per_s2?)?$")


@pytest.mark.parametrize("joint", [REVOLUTE, PRISMATIC])
@pytest.mark.parametrize("table", ["", "limits", "link", "motor"])
def test_every_key_of_a_joint_is_explained(joint: str, table: str, tmp_path: Path) -> None:
    """What the reader of arms knows below a joint, the page explains."""
    text = f"{joint}[joint.{table}]\nqqqqqqqq = 1\n" if table else f"{joint}qqqqqqqq = 1\n"

    check_explained(said(tmp_path / "arm.toml", text, read_arm))


@pytest.mark.parametrize("table", ["base", "tool", "hand", "gravity", ""])
def test_every_key_of_an_arm_is_explained(table: str, tmp_path: Path) -> None:
    """What the reader of arms knows of the whole arm, the page explains."""
    text = f"{REVOLUTE}[{table}]\nqqqqqqqq = 1\n" if table else f"qqqqqqqq = 1\n{REVOLUTE}"

    check_explained(said(tmp_path / "arm.toml", text, read_arm))


def check_explained(message: str) -> None:
    """Every key stands on the page outside the example, in this unit or in another."""
    explained = re.findall(r"`(?:\w+\.)?(\w+)`", ARMS.replace(example(ARMS), ""))
    stems = {UNITS.sub("", key) for key in explained}
    for key in known_keys(message):
        assert UNITS.sub("", key) in stems or re.search(rf"`\[\[{key}\]\]`|`\[joint\.{key}\]`|`{key}\.", ARMS), key
        for unit in UNITS.findall(key):
            assert f"_{''.join(unit)}`" in ARMS, key


def test_load_of_the_page(tmp_path: Path) -> None:
    """The load on the page on arms is read, every quantity in SI units."""
    (tmp_path / "part.toml").write_text(example(ARMS.partition("## A load in the hand")[2]), encoding="utf-8")

    load = read_load(tmp_path / "part.toml")

    assert load.mass == 1.8
    np.testing.assert_allclose(load.com, (0, 0, 0.05))
    np.testing.assert_array_equal(load.inertia, 0.003 * np.eye(3))
