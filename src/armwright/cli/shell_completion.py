"""Completion by the shell: the completions of arguments, and the script that a shell needs for them."""

import contextlib
import enum
import os
from collections.abc import Callable, Iterable
from pathlib import Path

from armwright.cli.commands import COMPLETE, NAME

Complete = Callable[[str], list[str]]


class Shell(enum.StrEnum):
    """A shell for which there is a completion script."""

    BASH = "bash"
    ZSH = "zsh"
    FISH = "fish"
    POWERSHELL = "powershell"


def prepare() -> None:
    """Set up Typer's completion if a shell asks for completions."""
    if COMPLETE in os.environ:
        from typer.completion import completion_init  # type: ignore[attr-defined]

        completion_init()


def script(shell: Shell) -> str:
    """Return the completion script of a shell."""
    from typer.completion import get_completion_script  # type: ignore[attr-defined]

    return get_completion_script(prog_name=NAME, complete_var=COMPLETE, shell=shell.value)


def install(shell: Shell) -> Path:
    """Install the script in the start-up files of a shell; return its path.

    Raises:
        OutputError: the start-up files of the shell cannot be read or written.
    """
    from typer.completion import install as install_script  # type: ignore[attr-defined]

    from armwright.errors import OutputError
    from armwright.files.inputs import regular

    try:
        for name in (".bashrc", ".zshrc"):
            regular(Path.home() / name)
        return install_script(shell=shell.value, prog_name=NAME, complete_var=COMPLETE)[1]
    except (OSError, RuntimeError, ValueError) as error:  # RuntimeError: the home folder is unknown
        text = f"cannot install the completion for {shell}: {error}; --show-completion {shell} prints its script"
        raise OutputError(text) from error


# ---- completions ---------------------------------------------------------------------------------------------------


def arms(incomplete: str) -> list[str]:
    """Complete the name of an arm, or the path of an arm file."""
    from armwright.arm.load import arm_names

    return _or_files(arm_names(), incomplete)


def linkages(incomplete: str) -> list[str]:
    """Complete the name of a linkage, or the path of its file."""
    from armwright.clearance.reader import linkage_names

    return _or_files(linkage_names(), incomplete)


def codes(incomplete: str) -> list[str]:
    """Complete the code of a message."""
    from armwright.program.diagnostics.index import codes as known

    return _beginning(known(), incomplete)


def quantities(incomplete: str) -> list[str]:
    """Complete the name of a compiled quantity."""
    from armwright.compiled.quantities import quantity_names

    return _beginning(quantity_names(), incomplete)


def studies(incomplete: str) -> list[str]:
    """Complete the name of a study."""
    from armwright.study.study import STUDIES

    return _beginning(STUDIES, incomplete)


def paths(incomplete: str) -> list[str]:
    """Complete the name of a path of the tip of a five-bar."""
    from armwright.clearance.paths import PICK_AND_PLACE, TEST_PATHS

    return _beginning((*TEST_PATHS, PICK_AND_PLACE), incomplete)


def limits(incomplete: str) -> list[str]:
    """Complete the name of a limit."""
    from armwright.files.limits import LIMITS

    return _beginning((f"{name}=" for name in LIMITS), incomplete)


def one_of(*words: str) -> Complete:
    """Return a function that completes a word of a list."""

    def complete(incomplete: str) -> list[str]:
        return _beginning(words, incomplete)

    return complete


def setting(name: str) -> Complete:
    """Return a function that completes a word of a constant of ``clearance.settings`` with this name."""

    def complete(incomplete: str) -> list[str]:
        from armwright.clearance import settings

        return _beginning(getattr(settings, name), incomplete)

    return complete


def _beginning(words: Iterable[str], incomplete: str) -> list[str]:
    return [word for word in words if word.startswith(incomplete)]


def _or_files(names: Iterable[str], incomplete: str) -> list[str]:
    """Complete a name, or a path if a name matches too; without a match the shell itself completes paths."""
    choices = _beginning(names, incomplete)
    if choices and incomplete:
        with contextlib.suppress(OSError):
            paths = Path().glob(f"{incomplete}*")
            choices += sorted(f"{path.name}/" if path.is_dir() else path.name for path in paths)
    return choices
