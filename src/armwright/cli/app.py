"""The command ``armwright``: its commands, its own options and its entry point."""

import os
import sys
import warnings
from collections.abc import Collection
from typing import Annotated

import typer
from typer import Option

from armwright.cli.command_list import register
from armwright.cli.commands import COMPLETE, NAME, App
from armwright.cli.failures import Commands, run_and_exit
from armwright.cli.shell_completion import Shell, install, limits, prepare, script
from armwright.cli.terminal import bound_widths, prepare_streams
from armwright.version import __version__


def _version(requested: bool) -> None:
    if requested:
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
    """Raise limits on the size of inputs for this command and for the processes that it starts."""
    from armwright.errors import ArmwrightError
    from armwright.files.limits import VARIABLE, parse_limits

    try:
        raised = {name: number for text in texts for name, number in parse_limits(text).items()}
    except ArmwrightError as error:
        raise typer.BadParameter(str(error)) from error
    if raised:
        before = os.environ.get(VARIABLE)
        settings = ",".join(f"{name}={number}" for name, number in raised.items())
        os.environ[VARIABLE] = f"{before},{settings}" if before else settings
    return texts


def root(
    _limits: Annotated[
        list[str] | None,
        Option(
            "--raise",
            help="Raise a limit on the size of inputs, as in table_rows=10000000 (docs/limits.md lists the limits).",
            metavar="NAME=NUMBER",
            autocompletion=limits,
            callback=lambda texts: _raise_limits(texts or []),
        ),
    ] = None,
    _show: Annotated[
        Shell | None,
        Option(
            "--show-completion",
            help="Print the script with which bash, zsh, fish or powershell completes commands, options and names.",
            metavar="SHELL",
            callback=_show_completion,
            is_eager=True,
        ),
    ] = None,
    _install: Annotated[
        Shell | None,
        Option(
            "--install-completion",
            help="Install that script in the start-up files of the shell.",
            metavar="SHELL",
            callback=_install_completion,
            is_eager=True,
        ),
    ] = None,
    _version: Annotated[
        bool, Option("--version", help="Print the version and stop.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """A workbench for robot manipulators: model an arm, move it, program it, inspect the result.

    **Example:** `armwright run examples/stacking.rlo --cell examples/stanford_cell.toml -o out`
    """


def application(words: Collection[str] | None = None) -> App:
    """Return the command line.

    Args:
        words: arguments of the command line; only the commands among them are imported. None: all are.
    """
    app = App(
        name=NAME,
        cls=Commands,
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode="markdown",
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    register(app, words)
    app.callback()(root)
    return app


def __getattr__(name: str) -> App:
    """Return ``app``, the command line with all commands imported, for tools that document it."""
    if name == "app":
        app = globals()[name] = application()
        return app
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def main() -> None:
    """Run the command line; an error ends it with a message and the exit status of its kind."""
    bound_widths()
    prepare_streams()
    prepare()
    warnings.showwarning = _warn
    # Completion by a shell needs all commands.
    run_and_exit(application(None if COMPLETE in os.environ else sys.argv[1:]))


def _warn(message: Warning | str, category: type[Warning], *location: object, **_more: object) -> None:
    """Print a warning on one line, without the location in our own code that it comes from."""
    about = "" if issubclass(category, UserWarning) else f"{category.__name__} in {location[0]}:{location[1]}: "
    print(f"armwright: warning: {about}{message}", file=sys.stderr)
