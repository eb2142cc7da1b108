"""Where the task of another feature is evaluated, and where its finished runs stay."""

import tempfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import numpy.typing as npt

from armwright.sweep.designs import Design
from armwright.sweep.progress import Progress
from armwright.sweep.runner import BLOCK, run
from armwright.sweep.task import Task


@attrs.frozen(kw_only=True)
class Machines:
    """Where a task is evaluated; see ``run``.

    Attributes:
        workers: processes of this machine; as many as there are cores when left out.
        scheduler: address of a Dask scheduler, whose workers do it instead.
        folder: where finished runs stay, so that the same call goes on after a kill; None where they do not stay.
        progress: called at the start and after every block.
    """

    workers: int | None = None
    scheduler: str | None = None
    folder: Path | str | None = None
    progress: Callable[[Progress], None] | None = None


def evaluate_on(machines: Machines, task: Task, design: Design, *, block: int = BLOCK) -> dict[str, npt.NDArray[Any]]:
    """Evaluate a task at all n points of a design; errors as of ``run``.

    Args:
        machines: where.
        task: what is done.
        design: its points.
        block: rows per call of the task and per file.

    Returns:
        By name the outputs, (n, ...) each, ``status`` (n,) and ``message`` (n,).
    """
    with tempfile.TemporaryDirectory() as passing:
        results = run(
            task,
            design,
            Path(passing, "sweep") if machines.folder is None else machines.folder,
            block=block,
            workers=machines.workers,
            scheduler=machines.scheduler,
            progress=machines.progress,
        )
        with closing(results):
            rows = {name: results[name].to_numpy() for name in (*task.outputs, "status", "message")}
    # A file without any message has them as bytes.
    messages = [text.decode() if isinstance(text, bytes) else text for text in rows["message"].tolist()]
    return rows | {"message": np.array(messages)}
