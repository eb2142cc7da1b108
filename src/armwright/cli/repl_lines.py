"""The input lines of a session: from a terminal with history and completion, or from a file or pipe."""

import contextlib
import io
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, cast

from armwright.errors import FileFormatError
from armwright.files.limits import MEGABYTE, limit, limit_message

if TYPE_CHECKING:
    from collections.abc import Callable
    from io import TextIOWrapper
    from types import FrameType

    from armwright.program.repl.session import Session

# Lines of earlier sessions that the arrow keys recall.
_MAX_HISTORY_LENGTH = 2000
# Characters that end a word; a colon begins a command, and a slash separates the folders of a path.
_DELIMITERS = ' \t\n()[],;:=<>*/+"'
_PROMPT = "\001\033[1;34m\002{}\001\033[0m\002"
# The commands whose argument is a file or folder.
PATH_COMMANDS = ("load", "save", "save!", "report")


class Script:
    """The lines of a standard input that is not a terminal, in UTF-8 in every locale."""

    def __init__(self) -> None:
        """Begin with the first line, which may have a byte order mark; other bytes are replaced by a character."""
        # An input of which something has been read, such as a program, keeps its encoding.
        with contextlib.suppress(io.UnsupportedOperation):
            cast("TextIOWrapper", sys.stdin).reconfigure(encoding="utf-8-sig", errors="replace", newline="\n")

    def readline(self) -> str:
        """Return the next line with its end; an empty text at the end of the input.

        Raises:
            FileFormatError: the line is longer than a program may be.
        """
        max_length = limit("program_mb") * MEGABYTE
        line = sys.stdin.readline(max_length + 1)
        if len(line) > max_length:
            raise FileFormatError("standard input", None, "", f"a line is too long: {limit_message('program_mb')}")
        return line


@contextlib.contextmanager
def handle_interrupt(handler: "Callable[[int, FrameType | None], object]") -> Iterator[None]:
    """Call a function on Ctrl-C."""
    before = signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def read_typed_line(prompt: str, *, colour: bool) -> str:
    """Return the line that is typed on a terminal after a prompt, which may be in colour, as a script does.

    Raises:
        KeyboardInterrupt: the line was abandoned.
    """
    try:
        return input(_PROMPT.format(prompt) if colour else prompt) + "\n"
    except EOFError:
        print()
        return ""


@contextlib.contextmanager
def line_editing(session: "Session", commands: tuple[str, ...]) -> Iterator[None]:
    """Let the arrow keys recall lines of this and earlier sessions, and the tab key complete words."""
    from armwright.files.store import make_private

    try:
        import readline
    except ImportError:  # a Python without it still reads lines
        yield
        return
    history = history_file()
    # A session works without a history that can be read or stored.
    if history:
        with contextlib.suppress(OSError):
            readline.read_history_file(history)
    readline.set_history_length(_MAX_HISTORY_LENGTH)
    readline.set_completer_delims(_DELIMITERS)

    def complete(word: str, number: int) -> str | None:
        choices = completions(session, commands, readline.get_line_buffer()[: readline.get_begidx()], word)
        return choices[number] if number < len(choices) else None

    readline.set_completer(complete)
    is_editline = "libedit" in (readline.__doc__ or "")
    readline.parse_and_bind("bind ^I rl_complete" if is_editline else "tab: complete")
    try:
        yield
    finally:
        readline.set_completer(None)
        if history:
            with contextlib.suppress(OSError):
                make_private(history.parent)
                readline.write_history_file(history)


def history_file() -> Path | None:
    """Return the file of the lines of sessions, in the user's cache folder if there is one and it is private."""
    from armwright.files.store import cache_folder, reason_for_distrust

    folder = cache_folder()
    return None if folder is None or reason_for_distrust(folder) else folder / "repl_history"


def completions(session: "Session", commands: tuple[str, ...], before: str, word: str) -> list[str]:
    """Return the completions of a word.

    Args:
        session: the session, whose names are completed.
        commands: names of the commands, without the colon.
        before: the line before the word.
        word: beginning of the word; it may be empty.
    """
    from armwright.program.language.words import SENSORS, VOCABULARIES, Standard
    from armwright.program.repl.frame_view import visible_names
    from armwright.program.semantics.builtins import FUNCTIONS

    start = before.lstrip()
    if start == ":":
        return sorted(command for command in commands if command.startswith(word.lower()))
    if start.startswith(":"):
        command, blank, path = start[1:].partition(" ")
        return _path_completions(path.lstrip(), word) if blank and command in PATH_COMMANDS else []
    words = {*VOCABULARIES[session.std].reserved, *SENSORS}
    if session.std is Standard.RLO_2:
        words |= FUNCTIONS.keys()
    names_ = visible_names(session)
    known = {name.upper() for name in names_}
    # Keywords in the case of the word; names as they are spelled.
    keywords = (str.lower if word.islower() else str.upper)(" ".join(words - known)).split()
    return sorted({choice for choice in (*names_, *keywords) if choice.upper().startswith(word.upper())})


def _path_completions(before: str, word: str) -> list[str]:
    """Return the completions of a path; folders end with a slash."""
    folder, slash, name = before.rpartition("/")
    begun = name + word
    try:
        entries = sorted(Path(folder + slash).expanduser().iterdir())
    except (OSError, RuntimeError, ValueError):  # no such folder, no such user, a zero byte
        return []
    matches = (path for path in entries if path.name.startswith(begun) and (begun or not path.name.startswith(".")))
    return [path.name[len(name) :] + ("/" if path.is_dir() else "") for path in matches]
