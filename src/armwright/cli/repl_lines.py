"""Where the lines of a session come from: a terminal with history and completion, or a file or pipe."""

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from armwright.errors import FileFormatError
from armwright.files.limits import MEGABYTE, beyond, limit

if TYPE_CHECKING:
    from armwright.program.repl.session import Session

# Lines of earlier sessions that the arrow keys come back to.
_LONGEST_HISTORY = 2000
# What ends a word; a colon begins a command, and a slash parts the folders of a path.
_DELIMITERS = ' \t\n()[],;:=<>*/+"'
_PROMPT = "\001\033[1;34m\002{}\001\033[0m\002"
# The commands whose argument is a file or folder.
WITH_PATH = ("load", "save", "save!", "report")


class Lines(Protocol):
    """Gives the lines of a session, one after the other."""

    def line(self, prompt: str) -> str | None:
        """Return the next line without its end; None behind the last."""


class Script:
    """Lines of the standard input that nobody types: no prompts, no history."""

    def __init__(self) -> None:
        """Begin with the first line, before which a mark of byte order may stand."""
        self._encoding = "utf-8-sig"

    def line(self, prompt: str) -> str | None:  # noqa: ARG002 - nobody would read it
        """Return the next line; characters that are not UTF-8 become the one that stands for them.

        Raises:
            FileFormatError: it is longer than a program may be.
        """
        most = limit("program_mb") * MEGABYTE
        line = sys.stdin.buffer.readline(most + 1)
        if len(line) > most:
            raise FileFormatError("standard input", None, "", f"a line is too long: {beyond('program_mb')}")
        text, self._encoding = line.decode(self._encoding, errors="replace"), "utf-8"
        return text.rstrip("\r\n") if line else None


class Terminal:
    """Lines that somebody types."""

    def __init__(self, *, colour: bool) -> None:
        """Write prompts, in colour if wanted."""
        self._colour = colour

    def line(self, prompt: str) -> str | None:
        """Return what is typed behind a prompt.

        Raises:
            KeyboardInterrupt: the line was abandoned.
        """
        try:
            return input(_PROMPT.format(prompt) if self._colour else prompt)
        except EOFError:
            print()
            return None


@contextlib.contextmanager
def editing(session: "Session", commands: tuple[str, ...]) -> Iterator[None]:
    """Let the arrow keys bring back earlier lines, also of earlier sessions, and the tab key complete words."""
    from armwright.files.store import make_private

    try:
        import readline
    except ImportError:  # a Python without it: lines can be typed all the same
        yield
        return
    history = history_file()
    # A history that cannot be read or kept is no reason to do without a session.
    if history:
        with contextlib.suppress(OSError):
            readline.read_history_file(history)
    readline.set_history_length(_LONGEST_HISTORY)
    readline.set_completer_delims(_DELIMITERS)

    def complete(word: str, number: int) -> str | None:
        choices = completions(session, commands, readline.get_line_buffer()[: readline.get_begidx()], word)
        return choices[number] if number < len(choices) else None

    readline.set_completer(complete)
    by_editline = "libedit" in (readline.__doc__ or "")
    readline.parse_and_bind("bind ^I rl_complete" if by_editline else "tab: complete")
    try:
        yield
    finally:
        readline.set_completer(None)
        if history:
            with contextlib.suppress(OSError):
                make_private(history.parent)
                readline.write_history_file(history)


def history_file() -> Path | None:
    """Return where the lines of sessions are kept: in the user's cache folder, if there is one and it is private."""
    from armwright.files.store import cache_folder, distrust

    folder = cache_folder()
    return None if folder is None or distrust(folder) else folder / "repl_history"


def completions(session: "Session", commands: tuple[str, ...], before: str, word: str) -> list[str]:
    """Return what a word may become.

    Args:
        session: whose names can be used.
        commands: those that begin with a colon, without it.
        before: the line in front of the word.
        word: its beginning; it may be empty.
    """
    from armwright.program.language.words import SENSORS, VOCABULARIES, Standard
    from armwright.program.repl.frame_view import names
    from armwright.program.semantics.builtins import FUNCTIONS

    start = before.lstrip()
    if start == ":":
        return sorted(command for command in commands if command.startswith(word.lower()))
    if start.startswith(":"):
        command, blank, path = start[1:].partition(" ")
        return _paths(path.lstrip(), word) if blank and command in WITH_PATH else []
    words = {*VOCABULARIES[session.std].reserved, *SENSORS}
    if session.std is Standard.RLO_2:
        words |= FUNCTIONS.keys()
    own = names(session)
    known = {name.upper() for name in own}
    # Words of the language as the line writes them; names as they are spelled.
    shown = (str.lower if word.islower() else str.upper)(" ".join(words - known)).split()
    return sorted({one for one in (*own, *shown) if one.upper().startswith(word.upper())})


def _paths(before: str, word: str) -> list[str]:
    """Return the ends of paths that begin so; folders end with a slash."""
    folder, slash, name = before.rpartition("/")
    begun = name + word
    try:
        entries = sorted(Path(folder + slash).expanduser().iterdir())
    except (OSError, RuntimeError, ValueError):  # no such folder, nobody called so, a zero byte
        return []
    fitting = (one for one in entries if one.name.startswith(begun) and (begun or not one.name.startswith(".")))
    return [one.name[len(name) :] + ("/" if one.is_dir() else "") for one in fitting]
