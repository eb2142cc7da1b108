"""The command ``armwright``: its commands, and what becomes of errors."""

import os
import sys
import warnings
from collections.abc import Collection
from typing import Annotated

import typer

from armwright.cli.command_list import register
from armwright.cli.commands import COMPLETE, NAME, App
from armwright.cli.failures import Commands, run_and_exit
from armwright.cli.shell_completion import Shell, install, limits, prepare, script
from armwright.cli.terminal import bound_widths, prepare_streams
from armwright.version import __version__


def _version(wanted: bool) -> None:
    if wanted:
        print(f"armwright {__version__}")
        raise typer.Exit


def _show_completion(shell: Shell | None) -> None:
    if shell is not None:
        print(script(shell))
        raise typer.Exit


def _install_completion(shell: Shell | None) -> None:
    if shell is not None:
        print(f"completion for {shell}: {install(shell)}; it works in every {shell} that is started from now on")
        raise typer.Exit


def _raise_limits(texts: list[str]) -> list[str]:
    """Let this command, and the processes that it starts, read more of what a limit bounds."""
    from armwright.errors import ArmwrightError
    from armwright.files.limits import VARIABLE, parsed

    try:
        found = {name: number for text in texts for name, number in parsed(text).items()}
    except ArmwrightError as error:
        raise typer.BadParameter(str(error)) from error
    if found:
        before = os.environ.get(VARIABLE)
        told = ",".join(f"{name}={number}" for name, number in found.items())
        os.environ[VARIABLE] = f"{before},{told}" if before else told
    return texts


def root(
    _limits: Annotated[
        list[str] | None,
        typer.Option(
            "--raise",
            help="Read more than is usual, such as table_rows=10000000 (docs/limits.md lists the limits).",
            metavar="NAME=NUMBER",
            autocompletion=limits,
            callback=lambda texts: _raise_limits(texts or []),
        ),
    ] = None,
    _show: Annotated[
        Shell | None,
        typer.Option(
            "--show-completion",
            help="Print what bash, zsh, fish or powershell reads to complete commands, options and names.",
            metavar="SHELL",
            callback=_show_completion,
            is_eager=True,
        ),
    ] = None,
    _install: Annotated[
        Shell | None,
        typer.Option(
            "--install-completion",
            help="Add that to the start-up files of the shell.",
            metavar="SHELL",
            callback=_install_completion,
            is_eager=True,
        ),
    ] = None,
    _version: Annotated[
        bool, typer.Option("--version", help="Print the version and stop.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """A workbench for robot manipulators: model an arm, move it, program it, look at the result.

    **Example:** `armwright run examples/stacking.rlo --cell examples/stanford_cell.toml -o out`
    """


def application(words: Collection[str] | None = None) -> App:
    """Return the command line.

    Args:
        words: that will be called with; only the commands among them are made. None: all are.
    """
    made = App(
        name=NAME,
        cls=Commands,
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode="markdown",
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    register(made, words)
    made.callback()(root)
    return made


def __getattr__(name: str) -> App:
    """Return ``app``, the whole command line, for who looks at all of it."""
    if name == "app":
        made = globals()[name] = application()
        return made
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def main() -> None:
    """Run the command line; an error ends it with one message and the exit status of its kind."""
    bound_widths()
    prepare_streams()
    prepare()
    warnings.showwarning = _warn
    # A shell that asks what may follow is told of all.
    run_and_exit(application(None if COMPLETE in os.environ else sys.argv[1:]))


def _warn(message: Warning | str, category: type[Warning], *where: object, **_more: object) -> None:
    """Tell a warning in one line, without the place in our own code that it comes from."""
    about = "" if issubclass(category, UserWarning) else f"{category.__name__} in {where[0]}:{where[1]}: "
    print(f"armwright: warning: {about}{message}", file=sys.stderr)
