"""The command ``armwright``: its commands, and what becomes of errors."""

import sys
import warnings
from typing import Annotated

import typer

from armwright.cli.arms import arms
from armwright.cli.calibrate import calibrate
from armwright.cli.check import check
from armwright.cli.clearance import clearance
from armwright.cli.code import code
from armwright.cli.convert import convert
from armwright.cli.debug import debug
from armwright.cli.explain import explain
from armwright.cli.failures import Commands, run_and_exit
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
from armwright.cli.terminal import clean_output
from armwright.cli.torque import torque
from armwright.version import __version__

app = typer.Typer(
    name="armwright",
    cls=Commands,
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


def _raise_limits(texts: list[str]) -> list[str]:
    """Let this command, and the processes that it starts, read more of what a limit bounds."""
    import os

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


@app.callback()
def root(
    _limits: Annotated[
        list[str] | None,
        typer.Option(
            "--raise",
            help="Read more than is usual, such as table_rows=10000000 (docs/limits.md lists the limits).",
            metavar="NAME=NUMBER",
            callback=lambda texts: _raise_limits(texts or []),
            show_default=False,
        ),
    ] = None,
    _version: Annotated[
        bool, typer.Option("--version", help="Print the version and stop.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """A workbench for robot manipulators: model an arm, move it, program it, look at the result.

    **Example:** `armwright run examples/stacking.rlo --cell examples/stanford_cell.toml -o out`
    """


def main() -> None:
    """Run the command line; an error ends it with one message and the exit status of its kind."""
    clean_output()
    warnings.showwarning = _warn
    run_and_exit(app)


def _warn(message: Warning | str, category: type[Warning], *where: object, **_more: object) -> None:
    """Tell a warning in one line, without the place in our own code that it comes from."""
    about = "" if issubclass(category, UserWarning) else f"{category.__name__} in {where[0]}:{where[1]}: "
    print(f"armwright: warning: {about}{message}", file=sys.stderr)
