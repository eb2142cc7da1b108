"""Completion by the shell: the completions of arguments, and the script that a shell needs for them."""

import contextlib
import os
from collections.abc import Callable, Iterable
from importlib import import_module
from pathlib import Path
from typing import Literal, TypeAlias

from armwright.cli.commands import COMPLETE, NAME

Complete = Callable[[str], list[str]]


# Shells for which there is a completion script.
Shell: TypeAlias = Literal["bash", "zsh", "fish", "powershell"]


def prepare() -> None:
    """Set up Typer's completion if a shell asks for completions."""
    if COMPLETE in os.environ:
        from typer.completion import completion_init  # type: ignore[attr-defined]

        completion_init()


def script(shell: Shell) -> str:
    """Return the completion script of a shell."""
    from typer.completion import get_completion_script  # type: ignore[attr-defined]

    return get_completion_script(prog_name=NAME, complete_var=COMPLETE, shell=shell)


def install(shell: Shell) -> Path:
    """Install the script in the start-up files of a shell; return its path.

    Raises:
        OutputError: the start-up files of the shell cannot be read or written.
    """
    from typer.completion import install as install_script  # type: ignore[attr-defined]

    from armwright.errors import OutputError
    from armwright.files.inputs import regular_file

    try:
        for name in (".bashrc", ".zshrc"):
            regular_file(Path.home() / name)
        return install_script(shell=shell, prog_name=NAME, complete_var=COMPLETE)[1]
    except (OSError, RuntimeError, ValueError) as error:  # RuntimeError: the home folder is unknown
        text = f"cannot install the completion for {shell}: {error}; --show-completion {shell} prints its script"
        raise OutputError(text) from error


# ---- completions ---------------------------------------------------------------------------------------------------


def listed_in(module: str, name: str, *, or_file: bool = False) -> Complete:
    """Return a function that completes a word of a list, whose module is imported only then.

    Args:
        module: the module.
        name: name of the list, or of the function that returns it.
        or_file: the argument may be the path of a file instead.
    """

    def complete(incomplete: str) -> list[str]:
        known = getattr(import_module(module), name)
        words = _beginning(known() if callable(known) else known, incomplete)
        # Without a match the shell itself completes paths.
        return words + _files(incomplete) if or_file and words and incomplete else words

    return complete


def paths(incomplete: str) -> list[str]:
    """Complete the name of a path of the tip of a five-bar."""
    from armwright.clearance.paths import PICK_AND_PLACE, TEST_PATHS

    return _beginning((*TEST_PATHS, PICK_AND_PLACE), incomplete)


def limits(incomplete: str) -> list[str]:
    """Complete the name of a limit."""
    from armwright.files.limits import LIMITS

    return _beginning((f"{name}=" for name in LIMITS), incomplete)


def _beginning(words: Iterable[str], incomplete: str) -> list[str]:
    return [word for word in words if word.startswith(incomplete)]


def _files(incomplete: str) -> list[str]:
    with contextlib.suppress(OSError):
        return sorted(f"{path.name}/" if path.is_dir() else path.name for path in Path().glob(f"{incomplete}*"))
    return []
