"""What the tests import is what `make test` installs, whatever else is in an environment."""

import ast
import re
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, packages_distributions, requires
from pathlib import Path

TESTS = Path(__file__).parent
# Modules that no metadata name, and what the Makefile installs without its dependencies.
OTHER_NAMES = {"pinocchio": "pin", "coal": "coal", "pybotics": "pybotics"}


def _name(requirement: str) -> str:
    found = re.match(r"[\w.-]+", requirement)
    assert found, requirement
    return found[0].lower().replace("_", "-")


def _installed() -> set[str]:
    """Return the distributions that `make test` asks for, and what they depend on."""
    project = tomllib.loads((TESTS.parent / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    waiting = [*project["dependencies"], *extras["test"], *extras["urdf"]]
    found = {"pybotics"}
    while waiting:
        name = _name(waiting.pop())
        if name not in found:
            found.add(name)
            try:
                waiting += [x for x in requires(name) or () if "extra ==" not in x]
            except PackageNotFoundError:  # for another platform or version of Python
                continue
    return found


def _imported(path: Path) -> set[str]:
    """Return the top names of the modules that a file imports."""
    names = set[str]()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names.add(node.module)
    return {name.split(".")[0] for name in names}


def test_imports_of_tests_are_installed() -> None:
    """Each module of others that a test imports comes with the extras that `make test` installs."""
    installed, distributions = _installed(), packages_distributions()
    own = {path.stem for path in TESTS.iterdir()} | {"armwright"} | set(sys.stdlib_module_names)
    files = sorted(TESTS.rglob("*.py"))
    assert len(files) > 100
    for path in files:
        for module in sorted(_imported(path) - own):
            names = {_name(x) for x in distributions.get(module, [OTHER_NAMES.get(module, module)])}
            assert names & installed, f"{path.relative_to(TESTS)} imports {module}, which make test does not install"
