"""Progress bars and status lines on the error output, where it is a terminal."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from rich.console import Console
    from rich.progress import Progress as Bars, ProgressColumn, TaskID

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
    with nullcontext() if console is None else console.status(text) as status:
        yield None if status is None else status.update


def _bars(*columns: "ProgressColumn", quiet: bool) -> "AbstractContextManager[Bars | None]":
    """Return the context of progress bars; of None where nothing is shown."""
    from rich.progress import Progress as Bars

    console = watched_console(quiet=quiet)
    return nullcontext() if console is None else Bars(*columns, console=console, transient=True)


@contextmanager
def counting(title: str, *, quiet: bool = False) -> "Iterator[Callable[..., None] | None]":
    """Show a progress bar with the number of finished items.

    Args:
        title: name of the work.
        quiet: show nothing.

    Yields:
        progress: takes the number of finished items, the number of all, and further text; None where nothing is shown.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[more]}"))
    with _bars(*columns, quiet=quiet) as bars:
        if bars is None:
            yield None
        else:
            line = bars.add_task(title, total=None, more="")
            yield lambda done, total, more="": bars.update(line, total=total, completed=done, more=more)


@contextmanager
def parts() -> "Iterator[Callable[[str, float], None] | None]":
    """Show a progress bar for each of several tasks.

    Yields:
        update: takes the name of a task and the finished part of it, 0 to 1; None where nothing is shown.
    """
    with _bars(quiet=False) as bars:
        lines: dict[str, TaskID] = {}

        def update(task: str, part: float) -> None:
            assert bars is not None  # noqa: S101 - it is not given away without bars
            if task not in lines:
                lines[task] = bars.add_task(task, total=1.0)
            bars.update(lines[task], completed=part)

        yield None if bars is None else update


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


@contextmanager
def sample_bar(
    title: str, *, quiet: bool = False
) -> "Iterator[tuple[Callable[[str], None], Callable[[Progress], None]] | tuple[None, None]]":
    """Show the progress of samples that are a sweep, and behind it what else is done.

    Args:
        title: name of the samples.
        quiet: show nothing.

    Yields:
        update: replaces the text behind the bar; None where nothing is shown.
        progress: see ``sweep_bar``.
    """
    with counting(title, quiet=quiet) as show:
        if show is None:
            yield None, None
            return
        count: tuple[int, int | None] = (0, None)

        def progress(now: "Progress") -> None:
            nonlocal count
            count = now.done, now.runs
            show(*count, progress_text(now))

        yield lambda text: show(*count, text), progress


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
