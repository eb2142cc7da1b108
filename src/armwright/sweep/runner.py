"""Running a sweep: each block once, on cores or on a Dask cluster, with every finished block on the disk."""

import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

import attrs

from armwright.arrays import cores, integer
from armwright.errors import InvalidValueError, KindError
from armwright.sweep.designs import Design
from armwright.sweep.executors import evaluate_blocks
from armwright.sweep.extras import check_extras
from armwright.sweep.folder import RESULTS, Folder, lock_folder
from armwright.sweep.progress import Progress
from armwright.sweep.results import load, write_results
from armwright.sweep.task import Task, check_task

if TYPE_CHECKING:
    import xarray

# Rows per block: some lanes of simulations side by side, and some seconds of work.
BLOCK = 64
# Processes of one machine; a larger number is a slip.
_MAX_WORKERS = 1000


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
    """Evaluate a task at all points of a design, and store the results in a folder.

    Every finished block of rows is on the disk at once. After a kill, a full disk or an interruption the same call
    goes on with what is missing; after the end it returns the results. The numbers are the same bits on any workers.

    Args:
        task: what is done.
        design: its points.
        folder: of this sweep alone; made where it is missing.
        block: rows per call of the task and per file. A folder that was begun with another number keeps that.
        workers: processes of this machine; 1 is this process itself; as many as there are cores when left out.
        scheduler: address of a Dask scheduler whose workers do it instead, such as ``tcp://10.0.0.1:8786``.
        progress: called at the start and after every block.

    Returns:
        dataset: see ``load``. A run that failed is a row of NaN with its ``status`` and ``message``.

    Raises:
        FileFormatError: a file of the folder is damaged; it is not changed, and the text says what to do.
        InvalidValueError: a number is out of range, names of the task and the design are the same, or one run has more
            than 2 GiB.
        KindError: an argument is of the wrong kind, or the task cannot be sent to workers.
        MissingExtraError: a library of the extra ``sweep`` is not installed.
        OutputError: a file cannot be written, as on a full disk; finished blocks stay.
        SweepError: the folder is of another sweep or in use, the workers cannot do the task, or the task returns
            something else than its outputs.
    """
    check_extras()  # not after hours of work
    if not isinstance(design, Design):
        raise KindError(f"design: expected a Design, got {type(design).__name__}")
    check_task(task, design.names)
    block = integer(block, "block", least=1)
    if workers is not None:
        if integer(workers, "workers", least=1) > _MAX_WORKERS:
            raise InvalidValueError(
                f"workers: expected at most {_MAX_WORKERS} processes of this machine, got {workers}"
            )
        if scheduler is not None:
            raise InvalidValueError(
                "specify either workers, processes of this machine, or a scheduler, which has its own workers"
            )
    with lock_folder(Path(folder), task, design, block) as sweep:
        if (sweep.path / RESULTS).exists():
            if progress:
                progress(Progress(runs=len(design), done=len(design), resumed=len(design), failed=0, seconds=0.0))
        else:
            _run_missing_blocks(sweep, workers, scheduler, progress or (lambda _: None))
            write_results(sweep)
    return load(folder)


def _run_missing_blocks(
    sweep: Folder, workers: int | None, scheduler: str | None, progress: Callable[[Progress], None]
) -> None:
    """Evaluate and store the blocks that are missing."""
    began = time.monotonic()
    now = Progress(runs=len(sweep.design))
    missing = []
    for number, runs in enumerate(sweep.blocks):
        if sweep.block_path(number).exists():
            now = now.with_runs(sweep.read_block(number)["status"])
        else:
            missing.append((number, sweep.design.points[runs.start : runs.stop]))
    now = attrs.evolve(now, resumed=now.done)
    progress(now)
    if not missing:
        return
    blocks = evaluate_blocks(sweep.task, missing, workers or min(cores(), len(missing)), scheduler)
    with closing(blocks):  # workers end on an error too
        for number, rows in blocks:
            sweep.write_block(number, rows)
            now = attrs.evolve(now.with_runs(rows["status"]), seconds=time.monotonic() - began)
            progress(now)
