"""The command ``armwright``: its commands, and what becomes of errors."""

import io
import os
import signal
import sys
from typing import Annotated, NoReturn

import typer

from armwright.cli.arms import arms
from armwright.cli.calibrate import calibrate
from armwright.cli.check import check
from armwright.cli.clearance import clearance
from armwright.cli.code import code
from armwright.cli.convert import convert
from armwright.cli.debug import debug
from armwright.cli.explain import explain
from armwright.cli.fix import fix
from armwright.cli.fmt import fmt
from armwright.cli.forward import forward, jacobian
from armwright.cli.inverse import inverse
from armwright.cli.iso9283 import iso9283
from armwright.cli.kernel import kernel
from armwright.cli.lsp import lsp
from armwright.cli.move import move
from armwright.cli.plan_poses import plan_poses
from armwright.cli.repl import repl
from armwright.cli.run import run
from armwright.cli.show import show
from armwright.cli.simulate import simulate
from armwright.cli.singularity import singularity
from armwright.cli.study import study
from armwright.cli.torque import torque
from armwright.errors import ArmwrightError, CheckFailedError, ContradictionError
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
app.command()(explain)
app.command()(repl)
app.command()(debug)
app.command()(fmt)
app.command()(fix)
app.command()(lsp)
app.command()(code)
app.command()(arms)
app.command()(show)
app.command()(convert)
app.command()(forward)
app.command()(inverse)
app.command()(jacobian)
app.command()(torque)
app.command()(singularity)
app.command()(simulate)
app.command()(move)
app.command()(iso9283)
app.command()(calibrate)
app.command("plan-poses")(plan_poses)
app.add_typer(clearance)
app.command()(study)
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


class _Interrupted(BaseException):
    """Ctrl-C; an exception of our own, since Typer takes KeyboardInterrupt for itself and says nothing."""


def _interrupt(_signal: int, _frame: object) -> None:
    raise _Interrupted


def main() -> None:
    """Run the command line; a caller's mistake ends it with one message and exit status 1."""
    signal.signal(signal.SIGINT, _interrupt)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # A terminal that knows no degree sign gets an escape, not a traceback.
            stream.reconfigure(errors="backslashreplace")
    try:
        app()
    except CheckFailedError as error:
        _end(5, str(error))
    except ContradictionError as error:
        _end(3, str(error))
    except ArmwrightError as error:
        _end(1, str(error))
    except BrokenPipeError:
        # The reader of our output has gone (as in `armwright show ur5 | head`): nothing is left to say.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        _end(1, f"cannot write the output: {error.strerror or error}")
    except _Interrupted as interrupted:
        # A command that leaves something behind says so in a note.
        _end(130, "; ".join(["interrupted", *getattr(interrupted, "__notes__", ["nothing was written"])]))


def _end(status: int, message: str) -> NoReturn:
    print(f"armwright: {message}", file=sys.stderr)
    sys.exit(status)
