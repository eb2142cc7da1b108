"""Print the lowest version of everything that armwright asks for itself, as requirements: what CI tries them with."""

import re
import tomllib
from pathlib import Path

# What only tests, documentation and benchmarks ask for is tried at its newest.
_OF_USERS = ("urdf", "online", "optimal", "sweep", "clearance", "calibration", "lsp")


def lowest(requirement: str) -> str:
    """Return a requirement such as ``numpy>=2.0`` with its lowest version alone."""
    found = re.fullmatch(r"([\w.-]+(?:\[[\w,]+\])?)\s*>=\s*([\w.]+)(?:,<.*)?", requirement)
    if found is None:
        raise ValueError(f"pyproject.toml: expected a requirement such as 'numpy>=2.0', got {requirement!r}")
    return f"{found[1]}=={found[2]}"


if __name__ == "__main__":
    project = tomllib.loads(Path(__file__).parents[1].joinpath("pyproject.toml").read_text())["project"]
    extras = (requirement for name in _OF_USERS for requirement in project["optional-dependencies"][name])
    for requirement in dict.fromkeys([*project["dependencies"], *extras]):
        print(lowest(requirement))
