"""``armwright repl``: enter statements interactively in a simulated cell."""

import functools
import io
import json
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option

from armwright.cli.failures import outcome
from armwright.cli.programs import CellFile, Std, error_data, print_diagnostics, read_cell_option
from armwright.errors import ArmwrightError, ExitStatus
from armwright.program.language.words import Standard

if TYPE_CHECKING:
    from armwright.cli.repl_commands import Commands
    from armwright.program.repl.session import InputResult, Session
    from armwright.program.vm.recording import Effect

_DIM = "dim"
_EVENT_LOG_HINT = "`:report DIR` writes all to events.jsonl"


def repl(
    program: Annotated[Path | None, Argument(help="Program in RLO to load first.")] = None,
    cell: CellFile = None,
    std: Std = Standard.RLO_2,
    as_json: Annotated[bool, Option("--json", help="Print one line of JSON for each input, without prompts.")] = False,
) -> None:
    """Enter RLO interactively: each statement is executed in a simulated cell, and can be undone.

    An expression prints its value, :frames the frame tree; :undo undoes a statement, :save writes the session as a
    program, and :help lists all commands. The tab key completes names and keywords. Without a terminal the session
    reads the lines of the standard input, and the exit status is the highest of all errors: 1 for a statement with
    errors, 3 for one that cannot be executed, 4 for a file.

    **Example:** `armwright repl --cell examples/stanford_cell.toml`
    """
    from armwright.cli.repl_commands import COMMANDS, Commands
    from armwright.cli.repl_lines import Script, handle_interrupt, line_editing, read_typed_line
    from armwright.program.api import import_reader
    from armwright.program.repl.session import Session

    session = Session(read_cell_option(cell), std, import_reader(Path()))
    commands = Commands(session, cell)
    interactive = sys.stdin.isatty() and sys.stdout.isatty() and not as_json
    printer = _JsonPrinter(session) if as_json else _Printer()
    if isinstance(sys.stdout, io.TextIOWrapper):
        # A program at the other end of a pipe waits for the results.
        sys.stdout.reconfigure(line_buffering=True)
    if program is not None:
        printer.answer(commands.load_file(program))
    if not interactive:
        script = Script()
        _converse(session, commands, lambda _: script.readline(), printer)
        if printer.status:
            raise typer.Exit(printer.status)
        return
    _greet(session)
    # Ctrl-C ends a line or a statement instead of the session.
    with handle_interrupt(signal.default_int_handler), line_editing(session, COMMANDS):
        colour = not os.environ.get("NO_COLOR") and os.environ.get("TERM", "dumb") != "dumb"
        _converse(session, commands, functools.partial(read_typed_line, colour=colour), printer)


def _greet(session: "Session") -> None:
    from armwright.version import __version__

    cell, language = session.state.cell, "RLO-83" if session.std is Standard.RLO_83 else "RLO-2"
    setting = f"in '{cell.name}' with {', '.join(sorted(cell.arms))}" if cell.arms else "without arms (see --cell)"
    print(f"armwright {__version__}: {language} {setting}. :help lists the commands, Ctrl-D ends the session.")


# ---- the conversation ----------------------------------------------------------------------------------------------


def _converse(session: "Session", commands: "Commands", next_line: Callable[[str], str], printer: "_Printer") -> None:
    """Read and execute lines until the input ends; ``next_line`` takes a prompt, and returns an empty text then."""
    from armwright.cli.repl_commands import EndOfSessionError

    incomplete = ""
    while True:
        number = session.line + incomplete.count("\n")
        try:
            line = next_line(f"... {number}> " if incomplete else f"rlo {number}> ")
        except KeyboardInterrupt:
            print()
            # Abandoned lines keep their numbers.
            session.skip_lines(incomplete)
            incomplete = ""
            continue
        if not line:
            break
        try:
            incomplete = _execute_line(session, commands, incomplete, line.rstrip("\r\n"), printer)
        except EndOfSessionError:
            return
        except KeyboardInterrupt:
            incomplete = ""
            printer.interrupted()
    if incomplete:
        printer.answer(session.enter(incomplete, complete=True))


def _execute_line(session: "Session", commands: "Commands", incomplete: str, line: str, printer: "_Printer") -> str:
    """Execute a line; return the text of a statement that is not complete yet."""
    if not incomplete and line.lstrip().startswith(":"):
        session.skip_lines(line)
        printer.command(commands, line)
        return ""
    text = f"{incomplete}{line}\n"
    answer = session.enter(text)
    if not answer.is_complete:
        return text
    printer.answer(answer)
    return ""


class _Printer:
    """Prints the results of inputs for people.

    Attributes:
        status: the highest exit status so far.
    """

    def __init__(self) -> None:
        from armwright.cli.terminal import console

        self.status = ExitStatus.DONE
        self._console = console(highlight=False, soft_wrap=True)

    def answer(self, answer: "InputResult") -> None:
        """Print the effects of an input in order, and then its diagnostics."""
        from armwright.program.repl.undo_report import SILENT_EFFECTS
        from armwright.program.vm.excerpt import MAX_TERMINAL_LINES, excerpt, omission_text

        self.status = max(self.status, answer.status)
        effects = [effect for effect in answer.effects if effect.kind not in SILENT_EFFECTS]
        shown = excerpt(effects, MAX_TERMINAL_LINES).map(_effect_text)
        for text, style in shown.join((omission_text(shown.omitted, _EVENT_LOG_HINT), _DIM)):
            self._console.print(text, style=style)
        if answer.diagnostics:
            print_diagnostics(answer.diagnostics, answer.source)
        for remark in answer.remarks:
            self._console.print(remark, style="yellow")

    def command(self, commands: "Commands", line: str) -> None:
        """Run a command and print its reply."""
        try:
            reply = commands.run(line)
        except ArmwrightError as error:
            self.status = max(self.status, error.exit_status)
            self._console.print(f"error: {error}", style="bold red")
            return
        if isinstance(reply, list):
            for text in reply:
                self._console.print(text)
        else:
            self.answer(reply)

    def interrupted(self) -> None:
        """Print that a statement was interrupted."""
        self._console.print("interrupted; the current statement was undone", style="yellow")


def _effect_text(effect: "Effect") -> tuple[str, str]:
    """Return the text and the style of an effect."""
    from armwright.program.vm.excerpt import shorten_line

    if effect.kind == "PRINT":
        return shorten_line(effect.data["printed"], _EVENT_LOG_HINT), ""
    return f"{effect.t1:9.3f}  {shorten_line(effect.text, _EVENT_LOG_HINT)}", _DIM


class _JsonPrinter(_Printer):
    """Prints a line of JSON for each input, for programs."""

    def __init__(self, session: "Session") -> None:
        super().__init__()
        self._session = session

    def answer(self, answer: "InputResult") -> None:
        """Print the result of an input as plain data."""
        self.status = max(self.status, answer.status)
        self._print(_as_data(answer))

    def command(self, commands: "Commands", line: str) -> None:
        """Print the reply of a command, and the result of the statements that it entered."""
        data: dict[str, Any] = {"command": line.strip()}
        try:
            reply = commands.run(line)
        except ArmwrightError as error:
            self.status = max(self.status, error.exit_status)
            self._print({**data, "ok": False, **outcome(error)})
            return
        if isinstance(reply, list):
            self._print({**data, "ok": True, "exit_status": ExitStatus.DONE, "lines": reply})
        else:
            self.status = max(self.status, reply.status)
            self._print({**data, **_as_data(reply), "lines": []})

    def _print(self, data: dict[str, Any]) -> None:
        print(json.dumps({**data, "time": self._session.state.machine.now}, ensure_ascii=False))


def _as_data(answer: "InputResult") -> dict[str, Any]:
    from armwright.program.language.diagnostic import to_json

    return {
        "ok": not answer.is_wrong,
        **error_data(answer.diagnostics, answer.source),
        "exit_status": answer.status,
        "printed": list(answer.printed_lines),
        "effects": [
            {**{name: getattr(effect, name) for name in ("t0", "t1", "kind", "arm", "text")}, **effect.data}
            for effect in answer.effects
        ],
        "diagnostics": [to_json(diagnostic, answer.source) for diagnostic in answer.diagnostics],
        "remarks": list(answer.remarks),
    }
