"""The commands of a session, which begin with a colon: looking round, going back, files."""

import contextlib
import os
import shlex
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import attrs

from armwright.errors import InvalidValueError, OutputError, UnknownNameError, shortened

if TYPE_CHECKING:
    from armwright.program.repl.session import Answer, Session

_PROGRAM = "session.rlo"


class EndOfSessionError(Exception):
    """The session shall end."""


@attrs.frozen(kw_only=True)
class Reply:
    """What a command has to say.

    Attributes:
        lines: for people.
        answer: of a file that was entered, if one was.
    """

    lines: tuple[str, ...] = ()
    answer: "Answer | None" = None


class Commands:
    """The commands of one session."""

    def __init__(self, session: "Session", cell: Path | None) -> None:
        """Serve a session.

        Args:
            session: to be looked at and changed.
            cell: the file of its cell, if one was given.
        """
        self._session, self._cell = session, cell

    def run(self, line: str) -> Reply:
        """Do what a line says that begins with a colon.

        Raises:
            ArmwrightError: it cannot be done.
            EndOfSessionError: it asks for the end.
        """
        word, _, argument = line.strip()[1:].partition(" ")
        argument = argument.strip()
        if (command := _COMMANDS.get(word.lower())) is None:
            raise UnknownNameError("command", f":{word}", [f":{name}" for name in _COMMANDS])
        if command.takes.startswith("[") or not command.takes:
            if argument and not command.takes:
                raise InvalidValueError(f":{word} stands alone, got '{argument}'")
        elif not argument:
            raise InvalidValueError(f":{word} needs {command.takes}, such as `:{word} {command.example}`")
        return command.run(self, argument)

    # ---- looking round ---------------------------------------------------------------------------------------------

    def frames(self, _: str) -> Reply:
        """Show the frame tree: places in the unit of the program, turns about z, y, x in degrees."""
        from armwright.program.repl.frame_view import frames

        return Reply(lines=tuple(frames(self._session)))

    def arms(self, _: str) -> Reply:
        """Show the joints of the arms and what their hands hold."""
        from armwright.program.repl.frame_view import arms

        return Reply(lines=tuple(arms(self._session)))

    def time(self, _: str) -> Reply:
        """Show the clock of the cell."""
        return Reply(lines=(f"{self._session.state.machine.now:.3f} s",))

    def list(self, _: str) -> Reply:
        """Show the session as a program."""
        return Reply(lines=tuple(self._session.program().splitlines()))

    def help(self, _: str) -> Reply:
        """Show this."""
        rows = [(f":{name} {command.takes}".rstrip(), command.does) for name, command in _COMMANDS.items()]
        width = max(len(usage) for usage, _ in rows)
        return Reply(
            lines=(
                "Enter statements, declarations (VAR, PROCEDURE, UNITS, IMPORT), or an expression to see its value.",
                "What is not complete goes on in the next line. Ctrl-C abandons a line, Ctrl-D ends the session.",
                *(f"  {usage:<{width}}  {does}" for usage, does in rows),
            )
        )

    def quit(self, _: str) -> Reply:
        """End the session."""
        raise EndOfSessionError

    # ---- back and forth --------------------------------------------------------------------------------------------

    def undo(self, argument: str) -> Reply:
        """Take back the last statements: frames, arms, clock, camera and devices too."""
        taken = self._session.undo(_count(argument))
        if not taken:
            raise InvalidValueError("nothing is left to be taken back")
        return Reply(lines=tuple(f"taken back: {text}" for text in taken))

    def redo(self, argument: str) -> Reply:
        """Do again what was taken back last."""
        again = self._session.redo(_count(argument))
        if not again:
            raise InvalidValueError("nothing was taken back that could be done again")
        return Reply(lines=tuple(f"done again: {text}" for text in again))

    # ---- files -----------------------------------------------------------------------------------------------------

    def load(self, argument: str) -> Reply:
        """Enter what a file holds, such as a whole program."""
        return Reply(answer=self.load_file(_path(argument)))

    def load_file(self, path: Path) -> "Answer":
        """Enter what a file holds.

        Raises:
            FileFormatError: it cannot be read.
        """
        from armwright.files.inputs import read_program
        from armwright.program.language.source import Source

        # What a file imports it names as seen from its own folder.
        return self._session.load(
            Source(path.name, read_program(path)), lambda name: os.path.normpath(path.parent / name)
        )

    def save(self, argument: str) -> Reply:
        """Write the session as a program that runs to the same end."""
        return self._save(_target(argument), overwrite=False)

    def overwrite(self, argument: str) -> Reply:
        """Write it over a file that is there already."""
        return self._save(_target(argument), overwrite=True)

    def _save(self, path: Path, *, overwrite: bool) -> Reply:
        from armwright.files.output import write_file

        if path.is_dir():
            raise OutputError(f"cannot write '{path}': it is a folder")
        if path.exists() and not overwrite:
            raise OutputError(f"'{path}' is there already; `:save! {path}` overwrites it")
        write_file(path, self._program(path), back=overwrite)
        return Reply(lines=(f"saved: {path}",))

    def _program(self, path: Path) -> str:
        """Return the session as a program that can lie there."""
        cell = [] if self._cell is None else ["--cell", _seen_from(path.parent, str(self._cell))]
        remark = shlex.join(["armwright", "run", path.name, *cell])
        return self._session.program(remark, lambda name: _seen_from(path.parent, name))

    def report(self, argument: str) -> Reply:
        """Write the program and what it did: motion, events, frames, and a page that shows the arms moving."""
        from armwright.files.output import reason

        folder = _target(argument)
        missing = [one for one in (folder, *folder.parents) if not one.exists()]
        try:
            # What the program imports is looked for from there.
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"cannot write to '{folder}': {reason(error, folder)}; nothing was written") from error
        try:
            self._report(folder)
        except BaseException:
            with contextlib.suppress(OSError):
                for one in missing:
                    one.rmdir()
            raise
        return Reply(lines=(f"report: {folder / 'report.html'}",))

    def _report(self, folder: Path) -> None:
        from armwright.cli.programs import imported_files
        from armwright.files.output import write_folder
        from armwright.program import Source, compile as compile_program, run
        from armwright.program.api import import_reader
        from armwright.program.vm.interpreter import warnings
        from armwright.report.files import Origin, result_files, run_record

        session, program = self._session, folder / _PROGRAM
        text = self._program(program)
        compiled = compile_program(
            Source(program.name, text), session.state.cell, std=session.std, read_import=import_reader(folder)
        )
        recording = run(compiled)
        diagnostics = (*compiled.diagnostics, *warnings(recording))
        command = ["armwright", "run", str(program), *(["--cell", str(self._cell)] if self._cell else [])]
        origin = Origin(
            program=program,
            cell=self._cell,
            imports=imported_files(program, compiled),
            command=shlex.join(command),
            options={"std": session.std.value},
            text=text,
        )
        assert compiled.code is not None  # noqa: S101 - it has run
        made = (recording, compiled.code, diagnostics, origin)
        write_folder(folder, {_PROGRAM: text, **result_files(*made)}, run_record(*made))


@attrs.frozen(kw_only=True)
class _Command:
    """A command.

    Attributes:
        run: what it does.
        takes: its argument for people, in brackets where it can be left out; empty without one.
        example: of the argument.
    """

    run: Callable[[Commands, str], Reply]
    takes: str = ""
    example: str = ""

    @property
    def does(self) -> str:
        """What it does, for people."""
        return (self.run.__doc__ or "").rstrip(".")


_COMMANDS: Mapping[str, _Command] = {
    "frames": _Command(run=Commands.frames),
    "arms": _Command(run=Commands.arms),
    "time": _Command(run=Commands.time),
    "list": _Command(run=Commands.list),
    "undo": _Command(run=Commands.undo, takes="[n]"),
    "redo": _Command(run=Commands.redo, takes="[n]"),
    "load": _Command(run=Commands.load, takes="FILE", example="stacking.rlo"),
    "save": _Command(run=Commands.save, takes="FILE", example="try.rlo"),
    "save!": _Command(run=Commands.overwrite, takes="FILE", example="try.rlo"),
    "report": _Command(run=Commands.report, takes="DIR", example="out"),
    "help": _Command(run=Commands.help),
    "quit": _Command(run=Commands.quit),
}
COMMANDS = tuple(_COMMANDS)


def _count(argument: str) -> int:
    if not argument:
        return 1
    if argument.isascii() and argument.isdigit() and int(argument[:9]) > 0:
        return int(argument[:9])
    raise InvalidValueError(f"expected a whole number from 1, got '{argument}'")


def _path(argument: str) -> Path:
    quoted = len(argument) > 1 and argument[0] == argument[-1] == '"'
    path = Path(argument[1:-1] if quoted else argument)
    try:
        return path.expanduser()
    except RuntimeError:  # nobody is called so
        return path


def _target(argument: str) -> Path:
    """Return a path to be written to.

    Raises:
        OutputError: there can be no such path, or what is there cannot be looked at.
    """
    path = _path(argument)
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return path
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise OutputError(f"cannot write '{shortened(str(path))}': {why}; nothing was written") from error
    return path


def _seen_from(folder: Path, name: str) -> str:
    """Return how a program in a folder names a file that is named from here."""
    return name if Path(name).is_absolute() else Path(os.path.relpath(name, folder)).as_posix()
