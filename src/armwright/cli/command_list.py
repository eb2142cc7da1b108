"""The commands by name with the first sentence of their help: listing the commands imports none of their modules."""

# ruff: noqa: E501 - a sentence a line

from collections.abc import Collection
from importlib import import_module
from typing import Any

from armwright.cli.commands import App

COMMANDS = {
    "run": "Run an RLO program in a simulated cell.",
    "replay": "Show the joint states of a log, measured beside planned, with tracking errors and delays of each joint.",
    "check": "Check RLO programs without running them.",
    "explain": "Explain the code of a diagnostic: what it means, what to do, a wrong program and a correct one.",
    "repl": "Enter RLO interactively: each statement is executed in a simulated cell, and can be undone.",
    "studio": "Move arms by hand, teach frames, write and run programs, in a browser.",
    "debug": "Run an RLO program step by step, forwards and backwards.",
    "fmt": "Format RLO programs: one statement per line, indented, keywords in upper case, comments preserved.",
    "fix": "Correct the mistakes in RLO programs that have a certain correction, such as a missing `;` or `=`.",
    "lsp": "Serve an editor by the Language Server Protocol, over standard input and output.",
    "export": "Run an RLO program in a simulated cell, and write it, or its motion, for a real controller, with its proof.",
    "code": "Print the intermediate code of a program, or write it to a file that can be edited and run.",
    "arms": "List the arms of the catalogue.",
    "show": "Print the Denavit-Hartenberg, limit, inertia and drive tables of an arm.",
    "convert": "Write an arm as URDF, as MJCF or as an arm file, or a cell as MJCF, and report what the format cannot represent.",
    "forward": "Print the tool pose for joint positions.",
    "inverse": "Print all solutions of the inverse kinematics of a pose, and whether each is within the joint limits.",
    "jacobian": "Print the Jacobian of the tool point: three linear rows, then three angular, in SI units and radians.",
    "torque": "Print the efforts of a motion, in total and by cause, as the report's main program did.",
    "deflection": "Print how far the tool of an arm yields at rest by weight and payload, and which joint yields most.",
    "singularity": "Print the factors of the Jacobian's determinant, those near zero, and the lost directions of the tool.",
    "simulate": "Simulate the free response of an arm with friction, stops and gravity, and print its energy balance.",
    "move": "Plan a motion of an arm through the poses of a file.",
    "iso9283": "Print the performance characteristics of ISO 9283 from measured poses and paths.",
    "calibrate": "Identify the geometric errors of an arm from measured points of its tool, and write the corrected arm.",
    "calibrate-camera": "Calibrate a camera from pictures of a board: its lens, and its pose on an arm or beside it.",
    "plan-poses": "Propose measurement configurations at which the errors of an arm are most observable.",
    "plan-excitation": "Plan a motion from which masses, inertias and friction of an arm can be identified.",
    "identify": "Identify masses, inertias and friction of an arm from logs of its motions.",
    "tolerance": "Print how far tolerances of an arm's dimensions move its tool, with probabilities, and what to tighten or relax.",
    "life": "Print how long the reducers, bearings and the repeatability of an arm last that repeats a motion.",
    "vibration": "Print natural frequencies of an arm on the springs of its gears, and how far its tool yields.",
    "study": "Repeat an experiment of the sources and print its published numbers beside the computed ones.",
    "kernel": "Print the compiled kernel of a quantity for an arm, as LLVM IR, C, C++ or CUDA, and its operation count.",
    "clearance": "Simulate, estimate, correct and compare linkages with clearance in their pins; how long they stay accurate.",
}
# Commands whose module has another name.
_MODULES = {"jacobian": "forward"}


def register(app: App, words: Collection[str] | None) -> None:
    """Add all commands to an application.

    Args:
        app: the application.
        words: arguments of the command line; a command that is not among them is listed only. None: all are imported.
    """
    for name, summary in COMMANDS.items():
        if words is not None and name not in words:
            app.command(name, help=summary)(_not_imported)
            continue
        function = name.replace("-", "_")
        command: Any = getattr(import_module(f"armwright.cli.{_MODULES.get(name, function)}"), function)
        if isinstance(command, App):
            app.add_typer(command)
        else:
            app.command(name)(command)


def _not_imported() -> None:
    """Stand in the list of commands for a command whose module is not imported."""
    raise AssertionError
