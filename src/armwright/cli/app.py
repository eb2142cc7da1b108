"""The command ``armwright``: its commands, and what becomes of errors."""

import os
import sys
from typing import Annotated

import typer

from armwright.cli.arms import arms
from armwright.cli.check import check
from armwright.cli.forward import forward, jacobian
from armwright.cli.inverse import inverse
from armwright.cli.kernel import kernel
from armwright.cli.run import run
from armwright.cli.show import show
from armwright.cli.torque import torque
from armwright.errors import ArmwrightError
from armwright.version import __version__

app = typer.Typer(
    name="armwright",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command()(run)
app.command()(check)
app.command()(arms)
app.command()(show)
app.command()(forward)
app.command()(inverse)
app.command()(jacobian)
app.command()(torque)
app.command()(kernel)


def _version(wanted: bool) -> None:
    if wanted:
        print(f"armwright {__version__}")
        raise typer.Exit


@app.callback()
def root(
    _version: Annotated[
        bool, typer.Option("--version", help="Print the version and stop.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """A workbench for robot manipulators: model an arm, move it, program it, look at the result.

    **Example:** `armwright run examples/stacking.rlo --cell examples/stanford_cell.toml -o out`
    """


def main() -> None:
    """Run the command line; a caller's mistake ends it with one message and exit status 1."""
    try:
        app()
    except ArmwrightError as error:
        print(f"armwright: {error}", file=sys.stderr)
        sys.exit(1)
    except BrokenPipeError:
        # The reader of our output has gone (as in `armwright show ur5 | head`): nothing is left to say.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except KeyboardInterrupt:
        print("armwright: interrupted; nothing was written", file=sys.stderr)
        sys.exit(130)
