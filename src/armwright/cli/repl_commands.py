"""The commands of a session, which begin with a colon: inspection, undo, files."""

import contextlib
import os
import shlex
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from armwright.errors import InvalidValueError, OutputError, UnknownNameError, shortened

if TYPE_CHECKING:
    from armwright.program.repl.session import InputResult, Session

_PROGRAM = "session.rlo"


class EndOfSessionError(Exception):
    """The user has ended the session."""


class Commands:
    """The commands of one session."""

    def __init__(self, session: "Session", cell: Path | None) -> None:
        """Serve a session.

        Args:
            session: the session.
            cell: the file of its cell; None without a file.
        """
        self._session, self._cell = session, cell

    def run(self, line: str) -> "list[str] | InputResult":
        """Run the command of a line that begins with a colon; return its lines, or the results of a file it has loaded.

        Raises:
            ArmwrightError: the command is unknown, or fails.
            EndOfSessionError: the command ends the session.
        """
        word, _, argument = line.strip()[1:].partition(" ")
        argument = argument.strip()
        if (command := _COMMANDS.get(word.lower())) is None:
            raise UnknownNameError("command", f":{word}", [f":{name}" for name in _COMMANDS])
        if command.argument.startswith("[") or not command.argument:
            if argument and not command.argument:
                raise InvalidValueError(f":{word} takes no argument, got '{argument}'")
        elif not argument:
            raise InvalidValueError(f":{word} needs {command.argument}, such as `:{word} {command.example}`")
        return command.run(self, argument)

    # ---- inspection ------------------------------------------------------------------------------------------------

    def frames(self, _: str) -> list[str]:
        """Show the frame tree: positions in the unit of the program, rotations about z, y, x in degrees."""
        from armwright.program.repl.frame_view import frame_table_lines

        return frame_table_lines(self._session)

    def arms(self, _: str) -> list[str]:
        """Show the joints of the arms and the objects that they grasp."""
        from armwright.program.repl.frame_view import arm_lines

        return arm_lines(self._session)

    def time(self, _: str) -> list[str]:
        """Show the clock of the cell."""
        return [f"{self._session.state.machine.now:.3f} s"]

    def list_program(self, _: str) -> list[str]:
        """Show the session as a program."""
        return self._session.program().splitlines()

    def help(self, _: str) -> list[str]:
        """List the commands."""
        rows = [
            (f":{name} {command.argument}".rstrip(), (command.run.__doc__ or "").rstrip("."))
            for name, command in _COMMANDS.items()
        ]
        width = max(len(usage) for usage, _ in rows)
        return [
            "Enter statements, declarations (VAR, PROCEDURE, UNITS, IMPORT), or an expression to see its value.",
            "An incomplete statement continues on the next line. Ctrl-C abandons a line, Ctrl-D ends the session.",
            *(f"  {usage:<{width}}  {summary}" for usage, summary in rows),
        ]

    def quit(self, _: str) -> list[str]:
        """End the session."""
        raise EndOfSessionError

    # ---- undo and redo ---------------------------------------------------------------------------------------------

    def undo(self, argument: str) -> list[str]:
        """Undo the last statements, with frames, arms, clock, camera and devices."""
        undone = self._session.undo(_parse_count(argument))
        if not undone:
            raise InvalidValueError("there is nothing to undo")
        return [f"undone: {text}" for text in undone]

    def redo(self, argument: str) -> list[str]:
        """Redo the statements that were undone last."""
        redone = self._session.redo(_parse_count(argument))
        if not redone:
            raise InvalidValueError("there is nothing to redo")
        return [f"redone: {text}" for text in redone]

    # ---- files -----------------------------------------------------------------------------------------------------

    def load(self, argument: str) -> "InputResult":
        """Enter the statements of a file, such as a program."""
        return self.load_file(_parse_path(argument))

    def load_file(self, path: Path) -> "InputResult":
        """Enter the statements of a file.

        Raises:
            FileFormatError: the file cannot be read.
        """
        from armwright.files.inputs import read_program
        from armwright.program.language.source import Source

        # The imports of a file are relative to its folder.
        return self._session.load(
            Source(path.name, read_program(path)), lambda name: os.path.normpath(path.parent / name)
        )

    def save(self, argument: str) -> list[str]:
        """Write the session as a program with the same final state."""
        return self._save(_output_path(argument), overwrite=False)

    def overwrite(self, argument: str) -> list[str]:
        """Write the session over an existing file."""
        return self._save(_output_path(argument), overwrite=True)

    def _save(self, path: Path, *, overwrite: bool) -> list[str]:
        from armwright.files.output import write_file

        if path.is_dir():
            raise OutputError(f"cannot write '{path}': it is a folder")
        if path.exists() and not overwrite:
            raise OutputError(f"'{path}' exists already; `:save! {path}` overwrites it")
        write_file(path, self._program(path), back=overwrite)
        return [f"saved: {path}"]

    def _program(self, path: Path) -> str:
        """Return the session as a program at a path: relative paths start from its folder."""
        cell = [] if self._cell is None else ["--cell", _relative_to(path.parent, str(self._cell))]
        remark = shlex.join(["armwright", "run", path.name, *cell])
        return self._session.program(remark, lambda name: _relative_to(path.parent, name))

    def report(self, argument: str) -> list[str]:
        """Write the program and its results: motion, events, frames, and a page that shows the arms moving."""
        from armwright.files.output import folder_error_text

        folder = _output_path(argument)
        missing = [path for path in (folder, *folder.parents) if not path.exists()]
        try:
            # The imports of the program are relative to this folder.
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(
                f"cannot write to '{folder}': {folder_error_text(error, folder)}; nothing was written"
            ) from error
        try:
            self._report(folder)
        except BaseException:
            with contextlib.suppress(OSError):
                for path in missing:
                    path.rmdir()
            raise
        return [f"report: {folder / 'report.html'}"]

    def _report(self, folder: Path) -> None:
        from armwright.program import Source, compile as compile_program, run
        from armwright.program.api import import_reader, imported_files
        from armwright.program.vm.interpreter import run_diagnostics
        from armwright.report.run_files import RunInputs, write_run

        session, program = self._session, folder / _PROGRAM
        text = self._program(program)
        compiled = compile_program(
            Source(program.name, text), session.state.cell, std=session.std, read_import=import_reader(folder)
        )
        recording = run(compiled)
        command = ["armwright", "run", str(program), *(["--cell", str(self._cell)] if self._cell else [])]
        origin = RunInputs(
            program=program,
            cell=self._cell,
            imports=imported_files(program, compiled),
            command=shlex.join(command),
            options={"std": session.std.value},
            text=text,
        )
        write_run(folder, recording, (*compiled.diagnostics, *run_diagnostics(recording)), origin)


class _Command(NamedTuple):
    """A command.

    Attributes:
        run: the method that runs it; its docstring describes the command for people.
        argument: name of its argument for people, in brackets where it is optional; empty without an argument.
        example: example of the argument.
    """

    run: "Callable[[Commands, str], list[str] | InputResult]"
    argument: str = ""
    example: str = ""


_COMMANDS: Mapping[str, _Command] = {
    "frames": _Command(Commands.frames),
    "arms": _Command(Commands.arms),
    "time": _Command(Commands.time),
    "list": _Command(Commands.list_program),
    "undo": _Command(Commands.undo, "[n]"),
    "redo": _Command(Commands.redo, "[n]"),
    "load": _Command(Commands.load, "FILE", "stacking.rlo"),
    "save": _Command(Commands.save, "FILE", "try.rlo"),
    "save!": _Command(Commands.overwrite, "FILE", "try.rlo"),
    "report": _Command(Commands.report, "DIR", "out"),
    "help": _Command(Commands.help),
    "quit": _Command(Commands.quit),
}
COMMANDS = tuple(_COMMANDS)


def _parse_count(argument: str) -> int:
    if not argument:
        return 1
    if argument.isascii() and argument.isdigit() and int(argument[:9]) > 0:
        return int(argument[:9])
    raise InvalidValueError(f"expected an integer from 1, got '{argument}'")


def _parse_path(argument: str) -> Path:
    quoted = len(argument) > 1 and argument[0] == argument[-1] == '"'
    path = Path(argument[1:-1] if quoted else argument)
    try:
        return path.expanduser()
    except RuntimeError:  # there is no such user
        return path


def _output_path(argument: str) -> Path:
    """Return the path of an output.

    Raises:
        OutputError: the path is invalid or not accessible.
    """
    path = _parse_path(argument)
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return path
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise OutputError(f"cannot write '{shortened(str(path))}': {why}; nothing was written") from error
    return path


def _relative_to(folder: Path, name: str) -> str:
    """Return the path of a file relative to a folder."""
    return name if Path(name).is_absolute() else Path(os.path.relpath(name, folder)).as_posix()
