"""The commands by name, and what each does, in the words of its own help: a list of them needs none of their modules."""

# ruff: noqa: E501 - a sentence a line

from collections.abc import Callable, Collection
from importlib import import_module
from typing import Any

from armwright.cli.commands import App

COMMANDS = {
    "run": "Run an RLO program in a simulated cell.",
    "check": "Check RLO programs without running them.",
    "explain": "Explain the code of a message: what it means, what to do, a wrong program and a right one.",
    "repl": "Try RLO out: each statement is done as it is entered, in a simulated cell, and can be taken back.",
    "debug": "Run an RLO program step by step, forwards and back.",
    "fmt": "Lay RLO programs out: one statement a line, indented, words of the language in upper case, comments kept.",
    "fix": "Cure what is certain in RLO programs: a missing `;` or `=`, a matrix row by row, look-alike characters.",
    "lsp": "Serve an editor that speaks the Language Server Protocol, over standard input and output.",
    "code": "Show what a program becomes, or write it out so that it can be changed by hand and run.",
    "arms": "List the arms of the catalogue.",
    "show": "Print the Denavit-Hartenberg, limit, inertia and drive tables of an arm.",
    "convert": "Write an arm as URDF or as an arm file, and say what the file cannot hold.",
    "forward": "Print the tool pose for joint positions.",
    "inverse": "Print every posture that puts the tool at a pose, judged: inside the limits, out of them, out of reach, singular.",
    "jacobian": "Print the Jacobian of the tool point: three linear rows, then three angular, in SI units and radians.",
    "torque": "Print the efforts of a motion, in all and by cause, as the report's main program did.",
    "singularity": "Print the factors of the Jacobian's determinant, which are near zero, and what the hand cannot do there.",
    "simulate": "Let an arm go and follow it: friction, stops and weight included, with an account of the energy.",
    "move": "Move an arm through the poses of a file.",
    "iso9283": "Print the measures of ISO 9283 that measured poses and paths allow, with the cycles of each.",
    "calibrate": "Find the errors of an arm from what its tool was measured at, and write the corrected arm.",
    "plan-poses": "Propose poses inside the limits whose measured points tell most of an arm's errors.",
    "study": "Run one of the sources' experiments and print its numbers beside ours.",
    "kernel": "Print the kernel that a quantity is compiled to for an arm, and its operation count.",
    "clearance": "Linkages with play in their pins: how they rattle, and what that does to the path.",
}
# Those whose module has another name than their own.
_MODULES = {"jacobian": "forward"}


def register(app: App, words: Collection[str] | None) -> None:
    """Add all commands to a collection.

    Args:
        app: takes them.
        words: those of the command line: a command that none of them names is listed, and not imported. None: all are.
    """
    for name, does in COMMANDS.items():
        if words is not None and name not in words:
            app.command(name)(_listed(does))
            continue
        function = name.replace("-", "_")
        found: Any = getattr(import_module(f"armwright.cli.{_MODULES.get(name, function)}"), function)
        if isinstance(found, App):
            app.add_typer(found)
        else:
            app.command(name)(found)


def _listed(does: str) -> Callable[[], None]:
    """Return what stands for a command that is not called."""

    def command() -> None:
        raise AssertionError(does)

    command.__doc__ = does
    return command
