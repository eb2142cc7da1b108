"""What the README says is true."""

import re
from pathlib import Path
from typing import Any

import armwright

README = (Path(__file__).parents[1] / "README.md").read_text()


def _section(title: str) -> str:
    """Return the indented lines of a section."""
    section = README.split(f"## {title}\n")[1].split("\n## ")[0]
    return "\n".join(line[4:] for line in section.split("\n") if line.startswith("    "))


def test_python_examples_run() -> None:
    """The Python lines of the README run, find the posture they started from, and their line holds."""
    scope: dict[str, Any] = {}

    exec(_section("From Python"), scope)

    assert abs(scope["solution"].best.q - scope["q"]).max() < 1e-9
    assert scope["line"].certificate.holds
    assert scope["round_it"].by == "line"
    assert scope["move"].certificate.deviation <= 1e-4
    assert scope["quick"].trajectory.duration < scope["move"].trajectory.duration
    assert armwright.continuity(scope["other"]).order >= 2


def test_links_lead_somewhere() -> None:
    """Every file that the README links to is there."""
    for target in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (Path(__file__).parents[1] / target).exists(), target


def test_public_names() -> None:
    """Every public name of the package can be had, and is listed."""
    for name in armwright.__all__:
        assert getattr(armwright, name) is not None
        assert name in dir(armwright)
