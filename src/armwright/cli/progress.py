"""Progress bars and status lines on the error output, where it is a terminal."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import TaskID

    from armwright.sweep.progress import Progress


def watched_console(*, quiet: bool = False) -> "Console | None":
    """Return the console of the error output; None where it is not a terminal, or with ``quiet``."""
    from armwright.cli.terminal import console

    stderr = console(stderr=True)
    return None if quiet or not stderr.is_terminal else stderr


@contextmanager
def waiting(text: str, *, quiet: bool = False) -> "Iterator[Callable[[str], None] | None]":
    """Show a status line.

    Args:
        text: text of the line.
        quiet: show nothing.

    Yields:
        update: replaces the text; None where nothing is shown.
    """
    console = watched_console(quiet=quiet)
    if console is None:
        yield None
        return
    with console.status(text) as status:
        yield status.update


@contextmanager
def counting(title: str, *, quiet: bool = False) -> "Iterator[Callable[..., None] | None]":
    """Show a progress bar with the number of finished items.

    Args:
        title: name of the work.
        quiet: show nothing.

    Yields:
        progress: takes the number of finished items, the number of all, and further text; None where nothing is shown.
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
    """Show a progress bar for each of several tasks.

    Yields:
        update: takes the name of a task and the finished part of it, 0 to 1; None where nothing is shown.
    """
    from rich.progress import Progress as Bar

    console = watched_console()
    if console is None:
        yield None
        return
    with Bar(console=console, transient=True) as bar:
        lines: dict[str, TaskID] = {}

        def update(task: str, part: float) -> None:
            if task not in lines:
                lines[task] = bar.add_task(task, total=1.0)
            bar.update(lines[task], completed=part)

        yield update


@contextmanager
def sweep_bar(title: str, *, quiet: bool = False) -> "Iterator[Callable[[Progress], None] | None]":
    """Show the progress of a sweep: runs, rate, remaining time, failures.

    Args:
        title: name of the sweep.
        quiet: show nothing.

    Yields:
        progress: the argument of this name of ``sweep.run``; None where nothing is shown.
    """
    with counting(title, quiet=quiet) as update:
        yield None if update is None else lambda now: update(now.done, now.runs, progress_text(now))


def progress_text(now: "Progress") -> str:
    """Return rate, remaining time and number of failures as text."""
    words = []
    if now.rate > 0:
        words.append(f"{now.rate:.3g} runs/s")
    if now.remaining:
        minutes, seconds = divmod(round(now.remaining), 60)
        words.append(f"{minutes // 60}:{minutes % 60:02d}:{seconds:02d} left")
    if now.failed:
        words.append(f"{now.failed} failed")
    return ", ".join(words)
