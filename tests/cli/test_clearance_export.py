"""``armwright clearance export`` from the outside."""

from pathlib import Path

import mujoco

from cli_calls import armwright, check_mistake


def test_a_model_of_mujoco(tmp_path: Path) -> None:
    """A linkage with closed pins is written with its script, and MuJoCo loads it."""
    options = ("slider-crank", "--speed-rpm", "300", "--revolutions", "0.1", "--format", "mjcf", "--step", "1e-4")
    done = armwright("clearance", "export", *options, "-o", str(tmp_path / "out"))

    assert done.stdout.endswith("run_linkage.py\n")
    names = {"run_linkage.py", "linkage.xml", "drives.csv", "reference.csv"}
    assert names <= {path.name for path in (tmp_path / "out").iterdir()}
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "linkage.xml")).nu == 1


def test_closed_pins_have_no_clearance(tmp_path: Path) -> None:
    """Clearances for a model without any are refused."""
    options = ("five-bar", "--path", "y1", "--format", "mjcf", "--clearance", "J2=0.1", "-o", "out")
    said = "expected none with --format mjcf, where all pins are closed"
    check_mistake("clearance", "export", *options, said=said, folder=tmp_path)
