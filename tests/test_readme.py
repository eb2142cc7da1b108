"""What the README says is true."""

import re
from pathlib import Path

import armwright

README = (Path(__file__).parents[1] / "README.md").read_text()


def _block(start: str) -> str:
    lines = README.split("\n")
    first = next(i for i, line in enumerate(lines) if line.strip() == start)
    block = []
    for line in lines[first:]:
        if line.strip() and not line.startswith("    "):
            break
        block.append(line[4:])
    return "\n".join(block)


def test_python_example_runs() -> None:
    """The Python lines of the README run, and find the posture they started from."""
    scope: dict[str, object] = {}

    exec(_block("import armwright"), scope)

    solution = scope["solution"]
    assert isinstance(solution, armwright.kinematics.inverse.solution.InverseSolution)
    assert abs(solution.best.q - scope["q"]).max() < 1e-9


def test_links_lead_somewhere() -> None:
    """Every file that the README links to is there."""
    for target in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (Path(__file__).parents[1] / target).exists(), target


def test_public_names() -> None:
    """Every public name of the package can be had, and is listed."""
    for name in armwright.__all__:
        assert getattr(armwright, name) is not None
        assert name in dir(armwright)
