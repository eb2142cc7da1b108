"""What the README says is true."""

import inspect
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import armwright

README = (Path(__file__).parents[1] / "README.md").read_text()


def _section(title: str) -> str:
    """Return the indented lines of a section."""
    section = README.split(f"## {title}\n")[1].split("\n## ")[0]
    return "\n".join(line[4:] for line in section.split("\n") if line.startswith("    "))


def test_python_examples_run() -> None:
    """The Python lines of the README run, find the configuration they started from, and their line holds."""
    scope: dict[str, Any] = {}

    exec(_section("From Python"), scope)

    assert abs(scope["solution"].best.q - scope["q"]).max() < 1e-9
    assert scope["line"].certificate.holds
    assert scope["detour"].method == "line"
    assert scope["move"].certificate.deviation <= 1e-4
    assert scope["optimal"].trajectory.duration < scope["move"].trajectory.duration
    assert armwright.motion.continuity(scope["replanned"]).order >= 2


def test_links_lead_somewhere() -> None:
    """Every file that the README links to is there."""
    for target in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (Path(__file__).parents[1] / target).exists(), target


FOLDERS = {path.parent.name for path in Path(str(armwright.__file__)).parent.glob("*/__init__.py")}
DOORS = [
    armwright,
    *(getattr(armwright, name) for name in armwright.__all__ if inspect.ismodule(getattr(armwright, name))),
]


@pytest.mark.parametrize("door", DOORS, ids=lambda door: door.__name__)
def test_public_names(door: ModuleType) -> None:
    """Every public name of the package and of its namespaces can be had and is listed; no module hides a function."""
    for name in getattr(door, "__all__", []):
        assert getattr(door, name) is not None
        assert name in dir(door)
        assert inspect.ismodule(getattr(door, name)) is (door is armwright and name.islower() and name in FOLDERS)


def test_namespaces_tell_the_nearest_name() -> None:
    """Who misspells a name hears the nearest one."""
    with pytest.raises(AttributeError, match="no attribute 'foward'; did you mean 'forward'"):
        armwright.kinematics.foward  # noqa: B018 - it is asked for


def test_programs_run_from_python() -> None:
    """A program is run by its path and that of its cell; one with errors says the first of them."""
    examples = Path(__file__).parents[1] / "examples"
    recording = armwright.program.run(examples / "stacking.rlo", examples / "stanford_cell.toml")

    assert recording.duration > 1
    with pytest.raises(armwright.program.ProgramError, match=r"p\.rlo:1: E"):
        armwright.program.run(armwright.program.Source("p.rlo", "BEGIN MOVE END."), examples / "stanford_cell.toml")
    with pytest.raises(armwright.ArmwrightError, match="needs a cell to run in"):
        armwright.program.run(armwright.program.Source("p.rlo", "BEGIN OPEN ARM_1 END."))
