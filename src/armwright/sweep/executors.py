"""Executors of a sweep: this process, processes of this machine, or a Dask cluster.

They take blocks of a design and return their rows, in any order. A sweep outlives its workers: a block whose worker
died is evaluated again row by row, alone, so that the row that kills its worker is known.
"""

import asyncio
import multiprocessing
import os
import pickle
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from contextlib import closing, contextmanager
from functools import partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from armwright.arrays import Array
from armwright.errors import ArmwrightError, KindError, shown
from armwright.sweep.errors import SweepError
from armwright.sweep.extras import extra
from armwright.sweep.task import Rows, Status, Task, evaluate, failed_row
from armwright.sweep.worker import evaluate_pickled, initialize_process
from armwright.version import __version__

# The number of a block, and its (m, k) points.
Block: TypeAlias = tuple[int, Array]

# Timeout for a Dask cluster to answer, and to have a worker [s].
CLUSTER_TIMEOUT = 20.0
# Blocks in the queue of each worker: no worker waits, and memory does not grow with the sweep.
_BLOCKS_PER_WORKER = 2
_KILLED_MESSAGE = "the worker process died each time it was tried"


def evaluate_blocks(
    task: Task, blocks: list[Block], workers: int, scheduler: str | None
) -> Generator[tuple[int, Rows]]:
    """Evaluate blocks and return the number and the rows of each, in the order in which they are done.

    Args:
        task: evaluated at the points.
        blocks: of the design.
        workers: processes of this machine; 1 is this process itself.
        scheduler: address of a Dask scheduler, whose workers do it instead.

    Raises:
        KindError: the task cannot be pickled.
        SweepError: the workers do not start or cannot go on, or the task returned something else than its outputs.
    """
    # Where the workers are threads of this process, its limit is theirs.
    with extra("threadpoolctl").threadpool_limits(1):
        if workers == 1 and scheduler is None:
            yield from ((number, evaluate(task, points)) for number, points in blocks)
            return
        connection = (
            closing(WorkerProcesses(task, workers)) if scheduler is None else connect_to_cluster(task, scheduler)
        )
        with connection as executor:
            yield from evaluate_in_parallel(executor, task, blocks)


def evaluate_in_parallel(
    executor: "WorkerProcesses | Cluster", task: Task, blocks: Iterable[Block]
) -> Iterator[tuple[int, Rows]]:
    """Evaluate blocks by workers; see ``evaluate_blocks``."""
    interrupted = []
    for block, rows in _complete_blocks(executor, blocks, lambda: _BLOCKS_PER_WORKER * executor.size()):
        if rows is None:
            interrupted.append(block)
        else:
            yield block[0], rows
    for number, points in interrupted:
        killed = failed_row(task, Status.KILLED, _KILLED_MESSAGE)
        alone = _complete_blocks(executor, enumerate(np.split(points, len(points))), lambda: 1)
        yield number, np.concatenate([killed if row is None else row for _, row in alone])


def _complete_blocks(
    executor: "WorkerProcesses | Cluster", blocks: Iterable[Block], capacity: Callable[[], int]
) -> Iterator[tuple[Block, Rows | None]]:
    """Evaluate blocks, at most ``capacity()`` at a time, and give each with its rows; None where its worker died."""
    queue = iter(blocks)
    running: dict[Future[Rows], Block] = {}
    while True:
        while len(running) < capacity() and (block := next(queue, None)):
            running[executor.submit(block[1])] = block
        if not running:
            return
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            rows: Rows | None
            try:
                rows = future.result()
            except executor.worker_death:
                rows = None
            yield running.pop(future), rows


class WorkerProcesses:
    """Worker processes of this machine, each with one thread."""

    worker_death: type[Exception] = BrokenExecutor

    def __init__(self, task: Task, workers: int) -> None:
        """Start the processes.

        Raises:
            KindError: the task cannot be pickled.
            SweepError: they do not start.
        """
        self._payload = _pickled(task, pickle.dumps)
        self._workers = workers
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")  # a fork of threads that hold locks may wait for ever
        self._watched, self._alive = context.Pipe(duplex=False)
        self._pool = ProcessPoolExecutor(
            self._workers, mp_context=context, initializer=initialize_process, initargs=(self._watched,)
        )
        try:
            self._pool.submit(os.getpid).result()
        except BaseException as error:
            self.close()
            if isinstance(error, BrokenExecutor):
                raise SweepError(
                    "worker processes do not start. A script that starts a sweep does so below "
                    "`if __name__ == '__main__':`, because every worker imports it; workers=1 needs no processes"
                ) from error
            raise

    def size(self) -> int:
        """Return the number of processes."""
        return self._workers

    def submit(self, points: Array) -> Future[Rows]:
        """Begin a block of (m, k) points and return the future of its rows."""
        try:
            return self._pool.submit(evaluate_pickled, __version__, self._payload, points)
        except BrokenExecutor:  # a pool that lost a process does no more
            self.close()
            self._start()
            return self._pool.submit(evaluate_pickled, __version__, self._payload, points)

    def close(self) -> None:
        """End the processes, also during their work."""
        self._alive.close()
        self._pool.shutdown(cancel_futures=True)
        self._watched.close()


class Cluster(NamedTuple):
    """The workers of a Dask cluster, which replaces those that die and tries a block several times.

    Attributes:
        size: number of threads of all workers, which may come and go.
        submit: begins a block of (m, k) points and returns the future of its rows.
        worker_death: error of a future whose worker died.
    """

    size: Callable[[], int]
    submit: Callable[[Array], Future[Rows]]
    worker_death: type[Exception]


@contextmanager
def connect_to_cluster(task: Task, address: str) -> Iterator[Cluster]:
    """Connect to a Dask cluster.

    Raises:
        KindError: the task cannot be pickled.
        SweepError: no scheduler answers at the address, it has no worker, or the cluster cannot go on.
    """
    # The client is closed here whatever happens, also while it is being made. One that is left to the collector is
    # closed by it, in the midst of anything: where that holds the lock that closing takes (another client or a cluster
    # being started), both wait for ever.
    kind = extra("distributed").Client
    payload = _pickled(task, extra("cloudpickle").dumps)  # workers need not have the script that sweeps
    failure = f"no Dask scheduler answers at '{address}'"
    try:
        _check_scheduler(address)
        with closing(kind.__new__(kind)) as client:
            client.__init__(address, timeout=CLUSTER_TIMEOUT, set_as_default=False)
            failure = f"the Dask scheduler at '{address}' has had no worker for {CLUSTER_TIMEOUT:g} s"
            client.wait_for_workers(1, timeout=CLUSTER_TIMEOUT)
            failure = f"the Dask cluster at '{address}' cannot continue; finished blocks are kept"
            yield Cluster(
                size=lambda: max(1, sum(client.nthreads().values())),
                submit=partial(client.get_executor(pure=False).submit, evaluate_pickled, __version__, payload),
                worker_death=extra("distributed").KilledWorker,
            )
    except ArmwrightError:
        raise
    except (Exception, asyncio.CancelledError) as error:
        raise SweepError(f"{failure}: {' '.join(str(error).split()) or shown(error)}") from error


def _check_scheduler(address: str) -> None:
    """Check that a scheduler answers at an address: a client would wait for ever for one that is silent.

    Raises:
        SweepError: another part of Dask answers there.
    """
    distributed = extra("distributed")

    async def identity() -> Any:
        arguments = distributed.Security().get_connection_args("client")
        async with asyncio.timeout(CLUSTER_TIMEOUT), distributed.rpc(address, connection_args=arguments) as component:
            return await component.identity()

    # In a thread of its own: the caller may have an event loop that runs, as notebooks do.
    with ThreadPoolExecutor(1) as thread:
        kind = thread.submit(asyncio.run, identity()).result()["type"]
    if kind != "Scheduler":
        raise SweepError(
            f"at '{address}' a Dask component of kind '{kind}' answers; expected the address of a scheduler"
        )


def _pickled(task: Task, dumps: Callable[[Task], bytes]) -> bytes:
    """Return a task as bytes.

    Raises:
        KindError: it cannot be pickled.
    """
    try:
        return dumps(task)
    except Exception as error:
        raise KindError(f"task '{task.name}' cannot be sent to workers: {shown(error)}") from error
