r"""What reaches a terminal: letters, never the commands that a name, a text of a program or a file may hide among them.

Control characters, marks that turn the direction of writing and letters that cannot be seen are printed as escapes such
as ``\u001b``. These are JSON's own, so that JSON stays JSON and says the same.
"""

import contextlib
import io
import os
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rich.console import Console, RenderableType
    from rich.segment import Segment

# C0 without tab and line feed, DEL, C1; soft hyphen; fillers and joiners without width; marks of direction; separators
# of lines and paragraphs; tags and what selects variants.
_HIDDEN = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\xad\u034f\u061c\u115f\u1160\u17b4\u17b5\u180b-\u180f\u200b-\u200f\u2028-\u202e"
    "\u2060-\u206f\u3164\ufe00-\ufe0f\ufeff\uffa0\ufff0-\ufffb\U0001bca0-\U0001bca3\U0001d173-\U0001d17a"
    "\U000e0000-\U000e0fff]"
)


# No terminal has more columns, or lines.
_MOST_COLUMNS = 10_000


def cleaned(text: str) -> str:
    """Return a text without anything that a terminal obeys or hides, as escapes of JSON; lines and tabs stay."""
    return _HIDDEN.sub(_escaped, text)


def _escaped(match: re.Match[str]) -> str:
    units = match[0].encode("utf-16-be")
    return "".join(f"\\u{units[i]:02x}{units[i + 1]:02x}" for i in range(0, len(units), 2))


class CleanStream(io.TextIOWrapper):
    """The output of a command: whatever is printed to it is cleaned, by whomever."""

    def write(self, text: str) -> int:
        """Write a text, cleaned."""
        super().write(cleaned(text))
        return len(text)

    def verbatim(self, text: str) -> int:
        """Write a text as it is."""
        return super().write(text)

    @property
    def rich_proxied_file(self) -> "_Verbatim":
        """Where Rich writes, which adds colours to what ``console`` has cleaned."""
        return _Verbatim(self)


class CleanProxy:
    """Another's stream that takes the place of the output, as one that captures it does: cleaned, and left whole."""

    def __init__(self, stream: Any) -> None:
        """Clean what is written to a stream."""
        self._stream = stream

    def write(self, text: str) -> int:
        """Write a text, cleaned."""
        self._stream.write(cleaned(text))
        return len(text)

    def verbatim(self, text: str) -> int:
        """Write a text as it is."""
        self._stream.write(text)
        return len(text)

    @property
    def rich_proxied_file(self) -> "_Verbatim":
        """Where Rich writes, which adds colours to what ``console`` has cleaned."""
        return _Verbatim(self)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


class _Verbatim:
    """A clean stream as Rich sees it."""

    def __init__(self, stream: CleanStream | CleanProxy) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        return self._stream.verbatim(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def bound_widths() -> None:
    """Take what the environment says of the size of a terminal only where it is the size of one."""
    for name in ("COLUMNS", "LINES", "TERMINAL_WIDTH"):
        told = os.environ.get(name, "")
        if told and not (told.isascii() and told.isdigit() and len(told) < 10 and 0 < int(told) <= _MOST_COLUMNS):
            del os.environ[name]


class ErrorStream(CleanStream):
    """The error output of a command: what it cannot take is lost, and changes neither status nor results."""

    def write(self, text: str) -> int:
        """Write a text, cleaned."""
        return self.verbatim(cleaned(text))

    def verbatim(self, text: str) -> int:
        """Write a text as it is."""
        with contextlib.suppress(OSError):
            super().verbatim(text)
        return len(text)

    def flush(self) -> None:
        """Write what has been kept so far."""
        with contextlib.suppress(OSError):
            super().flush()


def prepare_streams() -> None:
    """Let nothing reach standard and error output uncleaned from now on; what is said to a closed one is lost.

    A closed standard input is an empty one.
    """
    if sys.stdin is None:
        sys.stdin = Path(os.devnull).open(encoding="utf-8")  # noqa: SIM115 - it stays as long as the process
    sys.stdout, sys.stderr = _clean(sys.stdout, CleanStream), _clean(sys.stderr, ErrorStream)


def _clean(stream: Any, kind: type[CleanStream]) -> Any:
    if stream is None:
        # Otherwise errors would be printed to the other of the two, among the results.
        stream = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 - it stays as long as the process
    if isinstance(stream, CleanStream | CleanProxy):
        return stream
    if stream not in (sys.__stdout__, sys.__stderr__) or not isinstance(stream, io.TextIOWrapper):
        return CleanProxy(stream)
    encoding, by_lines, at_once = stream.encoding, stream.line_buffering, stream.write_through
    # A terminal that knows no degree sign gets an escape, not a traceback.
    return kind(
        stream.detach(), encoding=encoding, errors="backslashreplace", line_buffering=by_lines, write_through=at_once
    )


def print_verbatim(text: str) -> None:
    """Print a text for another program to read, such as a formatted one; where a person watches it is cleaned."""
    if isinstance(sys.stdout, CleanStream | CleanProxy) and not sys.stdout.isatty():
        sys.stdout.verbatim(text)
    else:
        print(cleaned(text) if sys.stdout.isatty() else text, end="")


def console(*, stderr: bool = False, **settings: Any) -> "Console":
    """Return a console of Rich's that cleans what it shows; texts are no markup unless ``markup`` says so.

    Args:
        stderr: whether it writes to the error output.
        settings: of Rich's Console.
    """
    from rich.console import Console
    from rich.segment import Segment

    class CleanConsole(Console):
        """A console whose texts are cleaned; colours are added later, and what moves the cursor is no text."""

        def render(self, renderable: "RenderableType", options: Any = None) -> "Iterable[Segment]":
            for segment in super().render(renderable, options):
                if segment.control is None:
                    yield Segment(cleaned(segment.text), segment.style)
                else:
                    yield segment

    return CleanConsole(stderr=stderr, **{"markup": False, **settings})
