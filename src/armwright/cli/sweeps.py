"""Commands whose work is a sweep, or may be one."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

from typer import Option

from armwright.cli.progress import sample_bar, waiting

if TYPE_CHECKING:
    from armwright.sweep.machines import Machines

SampleWorkers: TypeAlias = Annotated[
    int | None,
    Option(
        min=1,
        help="Number of processes that compute the random linkages, as a sweep; without it this process does it alone.",
    ),
]
SampleScheduler: TypeAlias = Annotated[
    str | None,
    Option(help="Address of a Dask scheduler whose workers compute the random linkages, as in tcp://10.0.0.1:8786."),
]
# The folder of the sweep, in that of the results.
SAMPLES = "samples"


@contextmanager
def resumable(folder: Path | None, runs: str) -> Iterator[None]:
    """Add to any error where the finished runs of a sweep are.

    Args:
        folder: of the sweep; None where they are kept nowhere.
        runs: what they are.
    """
    try:
        yield
    except BaseException as error:
        if folder is not None and folder.exists():
            error.add_note(f"finished {runs} are stored in '{folder}'; the same command resumes the sweep")
        raise


@contextmanager
def sampling(
    title: str, workers: int | None, scheduler: str | None, output: Path | None, *, quiet: bool
) -> "Iterator[tuple[Callable[[str], None] | None, Machines | None]]":
    """Show the progress of an assessment with random linkages.

    Args:
        title: name of the samples.
        workers: of ``SampleWorkers``.
        scheduler: of ``SampleScheduler``.
        output: folder of the results; finished samples of a sweep stay in a folder in it.
        quiet: show nothing.

    Yields:
        update: takes what is being done; None where nothing is shown.
        machines: that compute the samples; None where this process does it alone.

    Raises:
        MissingExtraError: a library of the extra ``sweep`` is not installed, and there are workers.
    """
    if workers is None and scheduler is None:
        with waiting(title, quiet=quiet) as update:
            yield update, None
        return
    from armwright.sweep.extras import check_extras
    from armwright.sweep.machines import Machines

    check_extras()
    folder = None if output is None else output / SAMPLES
    with sample_bar(title, quiet=quiet) as (update, progress), resumable(folder, "samples"):
        yield update, Machines(workers=workers, scheduler=scheduler, folder=folder, progress=progress)
