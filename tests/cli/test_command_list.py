"""The list of commands: what it says is what each says of itself, and it needs none of them."""

import inspect
import subprocess
import sys

import pytest
import typer

from armwright.cli.app import app, application
from armwright.cli.command_list import COMMANDS


def test_each_command_is_listed_with_its_first_sentence() -> None:
    """Each command is listed with the first sentence of its help, and no other is."""
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    said = {name: inspect.cleandoc(one.help).split("\n\n")[0].replace("\n", " ") for name, one in commands.items()}

    assert said == COMMANDS


@pytest.mark.parametrize(("words", "loaded"), [(["--help"], set()), (["arms"], {"arms"}), (["-h", "show"], {"show"})])
def test_only_the_named_command_is_imported(words: list[str], loaded: set[str]) -> None:
    """A list of commands needs neither Rich nor the modules of commands; a command needs its own."""
    names = {name.replace("-", "_") for name in COMMANDS} - {"jacobian"}
    script = (
        "import sys\n"
        "from armwright.cli.app import application\n"
        f"application({words!r})\n"
        f"if {words!r} == ['--help']:\n"
        f"    application({words!r})({words!r}, standalone_mode=False)\n"
        f"loaded = sorted(name for name in {names!r} if f'armwright.cli.{{name}}' in sys.modules)\n"
        "print(loaded, 'rich' in sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60)

    assert done.stdout.splitlines()[-1] == f"{sorted(loaded)} False"


def test_every_command_can_be_called() -> None:
    """Whatever words a command line has, the commands among them are real ones, and the others are listed."""
    for name, line in COMMANDS.items():
        made = typer.main.get_command(application([name])).commands  # type: ignore[attr-defined]
        assert made[name].help != line or "\n" not in inspect.cleandoc(made[name].help)
        assert set(made) == set(COMMANDS)
