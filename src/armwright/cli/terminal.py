r"""Output streams that escape control characters, which names, programs or files may contain, for the terminal.

Control characters, marks of writing direction and invisible characters are printed as escapes of JSON, such as
``\u001b``, so that a JSON document keeps its meaning.
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
# of lines and paragraphs; tags and variation selectors.
_HIDDEN = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\xad\u034f\u061c\u115f\u1160\u17b4\u17b5\u180b-\u180f\u200b-\u200f\u2028-\u202e"
    "\u2060-\u206f\u3164\ufe00-\ufe0f\ufeff\uffa0\ufff0-\ufffb\U0001bca0-\U0001bca3\U0001d173-\U0001d17a"
    "\U000e0000-\U000e0fff]"
)


# Largest plausible number of columns or lines of a terminal.
_MAX_COLUMNS = 10_000


def cleaned(text: str) -> str:
    """Return a text with control and invisible characters, except line breaks and tabs, as escapes of JSON."""
    return _HIDDEN.sub(_escaped, text)


def _escaped(match: re.Match[str]) -> str:
    units = match[0].encode("utf-16-be")
    return "".join(f"\\u{units[i]:02x}{units[i + 1]:02x}" for i in range(0, len(units), 2))


class _StreamWrapper:
    """A stream that adds behaviour to another one."""

    def __init__(self, raw: Any) -> None:
        """Write to a stream."""
        self.raw = raw

    def __getattr__(self, name: str) -> Any:
        return getattr(self.raw, name)


class CleanStream(_StreamWrapper):
    """An output of a command; all text that is written to it is cleaned.

    Attributes:
        raw: the stream itself.
    """

    def write(self, text: str) -> int:
        """Write a text, cleaned."""
        self.raw.write(cleaned(text))
        return len(text)

    def writelines(self, lines: "Iterable[str]") -> None:
        """Write texts, cleaned."""
        self.write("".join(lines))

    @property
    def rich_proxied_file(self) -> Any:
        """The stream for Rich, which adds colours to text that ``console`` has cleaned."""
        return self.raw


class _TolerantStream(_StreamWrapper):
    """The error output of a command; failures to write it are ignored, so that they change no status or results."""

    def write(self, text: str) -> int:
        with contextlib.suppress(OSError):
            self.raw.write(text)
        return len(text)

    def flush(self) -> None:
        with contextlib.suppress(OSError):
            self.raw.flush()


def bound_widths() -> None:
    """Remove implausible sizes of the terminal from the environment."""
    for name in ("COLUMNS", "LINES", "TERMINAL_WIDTH"):
        size = os.environ.get(name, "")
        if size and not (size.isascii() and size.isdigit() and len(size) < 10 and 0 < int(size) <= _MAX_COLUMNS):
            del os.environ[name]


def prepare_streams() -> None:
    """Replace standard and error output by clean streams; output to a closed stream is discarded.

    A closed standard input is treated as empty.
    """
    if sys.stdin is None:
        sys.stdin = Path(os.devnull).open(encoding="utf-8")  # noqa: SIM115 - open until the process ends
    for name in ("stdout", "stderr"):
        stream: Any = getattr(sys, name)
        if isinstance(stream, CleanStream):
            continue
        if stream is None:
            # Otherwise errors would be printed among the results.
            stream = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 - open until the process ends
        if stream in (sys.__stdout__, sys.__stderr__) and isinstance(stream, io.TextIOWrapper):
            # A terminal whose encoding has no degree sign gets an escape, not a traceback.
            stream.reconfigure(errors="backslashreplace")
        setattr(sys, name, CleanStream(_TolerantStream(stream) if name == "stderr" else stream))


def print_verbatim(text: str) -> None:
    """Print a text for other programs, such as a formatted program, unchanged; on a terminal it is cleaned."""
    stream = sys.stdout.raw if isinstance(sys.stdout, CleanStream) else sys.stdout
    stream.write(cleaned(text) if stream.isatty() else text)


def console(*, stderr: bool = False, **settings: Any) -> "Console":
    """Return a console of Rich that cleans its texts, does not interpret markup, and does not highlight.

    Args:
        stderr: whether it writes to the error output.
        settings: further arguments of Rich's Console.
    """
    from rich.console import Console
    from rich.segment import Segment

    class CleanConsole(Console):
        """A console whose texts are cleaned; styles and control codes of Rich itself are not."""

        def render(self, renderable: "RenderableType", options: Any = None) -> "Iterable[Segment]":
            for segment in super().render(renderable, options):
                if segment.control is None:
                    yield Segment(cleaned(segment.text), segment.style)
                else:
                    yield segment

    return CleanConsole(stderr=stderr, **{"markup": False, "highlight": False, **settings})
