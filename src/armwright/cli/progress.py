"""The progress bar of a sweep, for commands whose work takes minutes."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armwright.sweep.progress import Progress


@contextmanager
def sweep_bar(title: str, *, quiet: bool = False) -> "Iterator[Callable[[Progress], None] | None]":
    """Show how far a sweep is, on the error output and when a person watches: runs, rate, time left, failures.

    Args:
        title: what is running.
        quiet: show nothing.

    Yields:
        progress: what ``run`` takes of this name; None where nobody watches.
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[more]}"))
    with Bar(*columns, console=console, transient=True) as bar:
        line = bar.add_task(title, total=None, more="")
        yield lambda now: bar.update(line, total=now.runs, completed=now.done, more=progress_text(now))


def progress_text(now: "Progress") -> str:
    """Write rate, time left and what went wrong in a few words."""
    words = []
    if now.rate > 0:
        words.append(f"{now.rate:.3g} runs/s")
    if now.left:
        minutes, seconds = divmod(round(now.left), 60)
        words.append(f"{minutes // 60}:{minutes % 60:02d}:{seconds:02d} left")
    if now.failed:
        words.append(f"{now.failed} failed")
    if now.damaged:
        words.append(f"{now.damaged} damaged blocks made again")
    return ", ".join(words)
