"""What a person sees who waits: bars and words on the error output, where it is a terminal."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import TaskID

    from armwright.sweep.progress import Progress


def watched_console(*, quiet: bool = False) -> "Console | None":
    """Return the console of the error output; None where nobody watches, or wants to."""
    from armwright.cli.terminal import console

    found = console(stderr=True)
    return None if quiet or not found.is_terminal else found


@contextmanager
def waiting(text: str, *, quiet: bool = False) -> "Iterator[Callable[[str], None] | None]":
    """Say what is going on.

    Args:
        text: in a few words.
        quiet: say nothing.

    Yields:
        told: takes other words; None where nobody watches.
    """
    console = watched_console(quiet=quiet)
    if console is None:
        yield None
        return
    with console.status(text) as status:
        yield status.update


@contextmanager
def counting(title: str, *, quiet: bool = False) -> "Iterator[Callable[..., None] | None]":
    """Show how many of how many pieces are done.

    Args:
        title: what is being done.
        quiet: show nothing.

    Yields:
        told: takes how many are done, of how many, and more words; None where nobody watches.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, Progress as Bar, TextColumn

    console = watched_console(quiet=quiet)
    if console is None:
        yield None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[more]}"))
    with Bar(*columns, console=console, transient=True) as bar:
        line = bar.add_task(title, total=None, more="")
        yield lambda done, total, more="": bar.update(line, total=total, completed=done, more=more)


@contextmanager
def parts() -> "Iterator[Callable[[str, float], None] | None]":
    """Show a bar for each of several pieces of work.

    Yields:
        told: takes the name of one and how much of it is done, 0 to 1; None where nobody watches.
    """
    from rich.progress import Progress as Bar

    console = watched_console()
    if console is None:
        yield None
        return
    with Bar(console=console, transient=True) as bar:
        lines: dict[str, TaskID] = {}

        def told(what: str, part: float) -> None:
            if what not in lines:
                lines[what] = bar.add_task(what, total=1.0)
            bar.update(lines[what], completed=part)

        yield told


@contextmanager
def sweep_bar(title: str, *, quiet: bool = False) -> "Iterator[Callable[[Progress], None] | None]":
    """Show how far a sweep is: runs, rate, time left, failures.

    Args:
        title: what is running.
        quiet: show nothing.

    Yields:
        progress: what ``run`` takes of this name; None where nobody watches.
    """
    with counting(title, quiet=quiet) as told:
        yield None if told is None else lambda now: told(now.done, now.runs, progress_text(now))


def progress_text(now: "Progress") -> str:
    """Write rate, time left and what went wrong in a few words."""
    words = []
    if now.rate > 0:
        words.append(f"{now.rate:.3g} runs/s")
    if now.remaining:
        minutes, seconds = divmod(round(now.remaining), 60)
        words.append(f"{minutes // 60}:{minutes % 60:02d}:{seconds:02d} left")
    if now.failed:
        words.append(f"{now.failed} failed")
    return ", ".join(words)
