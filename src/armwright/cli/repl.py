"""``armwright repl``: statements done as they are typed, in a simulated cell."""

import contextlib
import io
import json
import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from armwright.cli.failures import failure_data
from armwright.cli.programs import CellFile, Std
from armwright.errors import ArmwrightError, ExitStatus
from armwright.program.language.words import Standard

if TYPE_CHECKING:
    from armwright.cli.repl_commands import Commands
    from armwright.cli.repl_lines import Lines
    from armwright.program.repl.session import Answer, Session
    from armwright.program.vm.recording import Effect

_DIM = "dim"
_ALL_OF_IT = "`:report DIR` keeps all in events.jsonl"


def repl(
    program: Annotated[Path | None, typer.Argument(help="A program to begin with, in RLO.")] = None,
    cell: CellFile = None,
    std: Std = Standard.RLO_2,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one line of JSON for each input, without prompts.")
    ] = False,
) -> None:
    """Try RLO out: each statement is done as it is entered, in a simulated cell, and can be taken back.

    An expression shows its value, :frames the frame tree, :undo goes back, :save writes the session as a program,
    :help tells the rest. Names and words are completed with the tab key. Without a terminal the lines of the
    standard input are taken, and the exit status is the highest of what went wrong: 1 for a statement with errors,
    3 for one that could not be done, 4 for a file.

    **Example:** `armwright repl --cell examples/stanford_cell.toml`
    """
    from armwright.cli.programs import given_cell
    from armwright.cli.repl_commands import COMMANDS, Commands
    from armwright.cli.repl_lines import Script, Terminal, editing
    from armwright.program.api import import_reader
    from armwright.program.repl.session import Session

    session = Session(given_cell(cell), std, import_reader(Path()))
    commands = Commands(session, cell)
    watched = sys.stdin.isatty() and sys.stdout.isatty() and not as_json
    talk = _Json(session) if as_json else _Talk()
    if isinstance(sys.stdout, io.TextIOWrapper):
        # Whoever feeds a pipe waits for answers.
        sys.stdout.reconfigure(line_buffering=True)
    if program is not None:
        talk.answer(commands.load_file(program))
    if not watched:
        _converse(session, commands, Script(), talk)
        if talk.status:
            raise typer.Exit(talk.status)
        return
    _greet(session)
    with _interruptible(), editing(session, COMMANDS):
        _converse(session, commands, Terminal(colour=_colour()), talk)


@contextlib.contextmanager
def _interruptible() -> Iterator[None]:
    """Let Ctrl-C abandon a line or a statement, and not the session."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _colour() -> bool:
    return not os.environ.get("NO_COLOR") and os.environ.get("TERM", "dumb") != "dumb"


def _greet(session: "Session") -> None:
    from armwright.version import __version__

    cell, language = session.state.cell, "RLO-83" if session.std is Standard.RLO_83 else "RLO-2"
    where = f"in '{cell.name}' with {', '.join(sorted(cell.arms))}" if cell.arms else "without arms (see --cell)"
    print(f"armwright {__version__}: {language} {where}. :help tells more, Ctrl-D ends.")


# ---- the conversation ----------------------------------------------------------------------------------------------


def _converse(session: "Session", commands: "Commands", lines: "Lines", talk: "_Talk") -> None:
    """Take lines until there are no more."""
    from armwright.cli.repl_commands import EndOfSessionError

    begun = ""
    while True:
        number = session.line + begun.count("\n")
        try:
            line = lines.line(f"... {number}> " if begun else f"rlo {number}> ")
        except KeyboardInterrupt:
            print()
            # Lines that were seen keep their numbers.
            session.pass_over(begun)
            begun = ""
            continue
        if line is None:
            break
        try:
            begun = _one(session, commands, begun, line, talk)
        except EndOfSessionError:
            return
        except KeyboardInterrupt:
            begun = ""
            talk.interrupted()
    if begun:
        talk.answer(session.enter(begun, whole=True))


def _one(session: "Session", commands: "Commands", begun: str, line: str, talk: "_Talk") -> str:
    """Take one line; return what has to be gone on with."""
    if not begun and line.lstrip().startswith(":"):
        session.pass_over(line)
        talk.command(commands, line)
        return ""
    text = f"{begun}{line}\n"
    answer = session.enter(text)
    if not answer.complete:
        return text
    talk.answer(answer)
    return ""


class _Talk:
    """Shows people what came of their inputs.

    Attributes:
        status: the highest of all that went wrong so far.
    """

    def __init__(self) -> None:
        from armwright.cli.terminal import console

        self.status = ExitStatus.DONE
        self._console = console(highlight=False, soft_wrap=True)

    def answer(self, answer: "Answer") -> None:
        """Show what was done, in order, and then what is wrong."""
        from armwright.cli.programs import print_diagnostics
        from armwright.program.repl.undo_report import SILENT
        from armwright.program.vm.excerpt import ON_A_TERMINAL, excerpt, more

        self.status = max(self.status, answer.status)
        found = excerpt([one for one in answer.effects if one.kind not in SILENT], ON_A_TERMINAL).mapped(_shown)
        for text, style in found.joined((more(found.left_out, _ALL_OF_IT), _DIM)):
            self._console.print(text, style=style)
        if answer.diagnostics:
            print_diagnostics(answer.diagnostics, answer.source)
        for remark in answer.remarks:
            self._console.print(remark, style="yellow")

    def command(self, commands: "Commands", line: str) -> None:
        """Do a command and show what it says."""
        try:
            reply = commands.run(line)
        except ArmwrightError as error:
            self.status = max(self.status, error.exit_status)
            self._console.print(f"error: {error}", style="bold red")
            return
        for text in reply.lines:
            self._console.print(text)
        if reply.answer is not None:
            self.answer(reply.answer)

    def interrupted(self) -> None:
        """Say what became of a statement that was interrupted."""
        self._console.print("interrupted; the statement under way was taken back", style="yellow")


def _shown(effect: "Effect") -> tuple[str, str]:
    """Return what is shown of an effect, and how it looks."""
    from armwright.program.vm.excerpt import one_line

    if effect.kind == "PRINT":
        return one_line(effect.data["printed"], _ALL_OF_IT), ""
    return f"{effect.t1:9.3f}  {one_line(effect.text, _ALL_OF_IT)}", _DIM


class _Json(_Talk):
    """Gives programs one line of JSON for each input."""

    def __init__(self, session: "Session") -> None:
        super().__init__()
        self._session = session

    def answer(self, answer: "Answer") -> None:
        """Give an answer as plain data."""
        self.status = max(self.status, answer.status)
        self._give(_as_data(answer))

    def command(self, commands: "Commands", line: str) -> None:
        """Give what a command says, line by line, and what it entered, if it did."""
        data: dict[str, Any] = {"command": line.strip()}
        try:
            reply = commands.run(line)
        except ArmwrightError as error:
            self.status = max(self.status, error.exit_status)
            self._give({**data, "ok": False, **failure_data(error.exit_status, error, str(error))})
            return
        entered = {} if reply.answer is None else _as_data(reply.answer)
        if reply.answer is not None:
            self.status = max(self.status, reply.answer.status)
        self._give({**data, "ok": True, "exit_status": ExitStatus.DONE, "lines": list(reply.lines), **entered})

    def _give(self, data: dict[str, Any]) -> None:
        print(json.dumps({**data, "time": self._session.state.machine.now}, ensure_ascii=False))


def _as_data(answer: "Answer") -> dict[str, Any]:
    from armwright.cli.programs import error_data
    from armwright.program.language.diagnostic import to_json

    return {
        "ok": not answer.is_wrong,
        **error_data(answer.diagnostics, answer.source),
        "exit_status": answer.status,
        "printed": list(answer.printed),
        "effects": [
            {"t0": one.t0, "t1": one.t1, "kind": one.kind, "arm": one.arm, "text": one.text, **one.data}
            for one in answer.effects
        ],
        "diagnostics": [to_json(one, answer.source) for one in answer.diagnostics],
        "remarks": list(answer.remarks),
    }
