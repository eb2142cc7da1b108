"""Running a sweep: each block once, on cores or on a Dask cluster, with all that is finished on the disk."""

from collections.abc import Callable, Generator
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING

from armwright.arrays import Array, cores
from armwright.errors import InvalidValueError, KindError
from armwright.sweep.crew import alone, cluster, processes, together
from armwright.sweep.designs import Design, whole
from armwright.sweep.extras import check_extras
from armwright.sweep.folder import Folder, held
from armwright.sweep.progress import Counter, Progress
from armwright.sweep.results import gather, load, refuse_too_long
from armwright.sweep.task import Rows, Task, check_task, failures

if TYPE_CHECKING:
    import xarray

# Rows per block: some lanes of simulations side by side, and some seconds of work.
BLOCK = 64
# Processes of one machine; a number beyond is a slip.
_MOST_WORKERS = 1000


def run(
    task: Task,
    design: Design,
    folder: Path | str,
    *,
    block: int = BLOCK,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> "xarray.Dataset":
    """Do a task at all points of a design, and keep the results in a folder.

    Every finished block of rows is on the disk at once. After a kill, a full disk or an interruption the same call
    goes on with what is missing; after the end it returns the results. The numbers are the same bits whoever does
    the work.

    Args:
        task: what is done.
        design: its points.
        folder: of this sweep alone; made where it is missing.
        block: rows that are done in one call of the task and kept in one file. A folder that was begun with another
            number keeps that.
        workers: processes of this machine; 1 is this process itself; as many as there are cores when left out.
        scheduler: address of a Dask scheduler whose workers do it instead, such as ``tcp://10.0.0.1:8786``.
        progress: told how far it is, at the start and after every block.

    Returns:
        dataset: see ``load``. A run that failed is a row of NaN with its ``status`` and ``message``.

    Raises:
        FileFormatError: a file of the folder is damaged; it stays as it is, and the text says what to do.
        InvalidValueError: a number is out of range, names of the task and the design are the same, or an output has
            more than 4 GiB.
        KindError: an argument is of the wrong kind, or the task cannot be sent to workers.
        MissingExtraError: a library of the extra ``sweep`` is not installed.
        OutputError: a file cannot be written, as on a full disk; what is finished stays.
        SweepError: the folder is of another sweep or in use, the workers cannot do the task, or the task returns
            something else than it said.
    """
    check_extras()  # not after hours of work
    if not isinstance(design, Design):
        raise KindError(f"design: expected a Design, got {type(design).__name__}")
    check_task(task, design.names)
    refuse_too_long(task, len(design))
    block = whole(block, "block", least=1)
    if workers is not None:
        workers = whole(workers, "workers", least=1)
        if workers > _MOST_WORKERS:
            raise InvalidValueError(
                f"workers: expected at most {_MOST_WORKERS} processes of this machine, got {workers}"
            )
        if scheduler is not None:
            raise InvalidValueError("workers are processes of this machine, a scheduler has its own: give one of them")
    with held(Path(folder), task, design, block) as sweep:
        if sweep.results.exists():
            if progress:
                progress(Counter(sweep.runs, sweep.runs).now())
        else:
            _finish(sweep, design, workers, scheduler, progress)
            gather(sweep, design)
    return load(folder)


def _finish(
    sweep: Folder,
    design: Design,
    workers: int | None,
    scheduler: str | None,
    progress: Callable[[Progress], None] | None,
) -> None:
    """Do the blocks that are missing."""
    missing, found, failed = [], 0, 0
    for number in range(sweep.blocks):
        rows = sweep.kept(number)
        if rows is None:
            missing.append(number)
        else:
            found, failed = found + len(rows.status), failed + failures(rows)
    counter = Counter(sweep.runs, found, failed)
    tell = progress or (lambda _: None)
    tell(counter.now())
    with closing(_done(sweep, missing, design.points, workers, scheduler)) as done:  # workers end on an error too
        for number, rows in done:
            sweep.keep(number, rows)
            counter.add(len(rows.status), failures(rows))
            tell(counter.now())


def _done(
    sweep: Folder, missing: list[int], points: Array, workers: int | None, scheduler: str | None
) -> Generator[tuple[int, Rows]]:
    """Do the missing blocks by whoever is asked to."""
    pieces = ((number, points[sweep.rows_of(number)]) for number in missing)
    workers = workers or min(cores(), len(missing))
    if not missing:
        return
    with ExitStack() as stack:
        if scheduler is not None:
            yield from together(stack.enter_context(cluster(sweep.task, scheduler)), sweep.task, pieces)
        elif workers == 1:
            yield from alone(sweep.task, pieces)
        else:
            yield from together(stack.enter_context(processes(sweep.task, workers)), sweep.task, pieces)
