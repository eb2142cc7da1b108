"""Executors of a sweep: this process, processes of this machine, or a Dask cluster.

They take blocks of a design and return their rows, in any order. A sweep outlives its workers: a block whose worker
died is done again row by row, with nothing else at work, so that the row that kills its worker is known.
"""

import asyncio
import concurrent.futures
import multiprocessing
import os
import pickle
from collections.abc import Callable, Collection, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import closing, contextmanager
from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.errors import ArmwrightError, KindError, shown
from armwright.sweep.errors import SweepError
from armwright.sweep.extras import extra
from armwright.sweep.task import Rows, Status, Task, evaluate, failed_row
from armwright.sweep.worker import initialize, work
from armwright.version import __version__

# Time for a Dask cluster to answer, and to have a worker [s].
PATIENCE = 20.0
# Blocks waiting or at work, per worker: no worker waits, and memory does not grow with the sweep.
_PER_WORKER = 2
_KILLED = "the worker process died each time it was tried"


def serial(task: Task, blocks: Iterable[tuple[int, Array]]) -> Iterator[tuple[int, Rows]]:
    """Evaluate blocks in this process, one after the other."""
    with extra("threadpoolctl").threadpool_limits(1):
        for number, points in blocks:
            yield number, evaluate(task, points)


def parallel(
    executor: "Processes | Cluster", task: Task, blocks: Iterable[tuple[int, Array]]
) -> Iterator[tuple[int, Rows]]:
    """Evaluate blocks by workers; rows come in the order in which they are done.

    Args:
        executor: has the workers.
        task: what is done.
        blocks: (m, k) points by number.

    Raises:
        SweepError: the executor cannot go on.
    """
    queue = iter(blocks)
    running: dict[Any, tuple[int, Array]] = {}
    interrupted: list[tuple[int, Array]] = []
    while True:
        while not interrupted and len(running) < _PER_WORKER * executor.size() and (block := next(queue, None)):
            try:
                running[executor.submit(block[1])] = block
            except executor.died:
                interrupted.append(block)
        if running:
            for future in executor.wait(running):
                block = running.pop(future)
                try:
                    rows = future.result()
                except executor.died:
                    interrupted.append(block)
                else:
                    yield block[0], rows
        elif interrupted:
            executor.restart()
            while interrupted:
                number, points = interrupted.pop()
                yield number, np.concatenate([_alone(executor, task, points[i : i + 1]) for i in range(len(points))])
        else:
            return


def _alone(executor: "Processes | Cluster", task: Task, point: Array) -> Rows:
    """Evaluate a row of a block whose worker died, with nothing else at work."""
    for _ in range(executor.attempts):
        try:
            rows: Rows = executor.submit(point).result()
        except executor.died:
            executor.restart()
        else:
            return rows
    return failed_row(task, Status.KILLED, _KILLED)


class Processes:
    """Worker processes of this machine, each with one thread."""

    died = BrokenExecutor
    """The error of submitting, or of a future, whose worker died."""
    attempts = 2
    """How often a row of a block whose worker died is tried, alone."""

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
            self._workers, mp_context=context, initializer=initialize, initargs=(self._watched,)
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
        return self._pool.submit(work, __version__, self._payload, points)

    def wait(self, futures: Collection[Future[Rows]]) -> Collection[Future[Rows]]:
        """Wait until some of the futures are done, and return those."""
        return concurrent.futures.wait(futures, return_when=FIRST_COMPLETED).done

    def restart(self) -> None:
        """Start all processes again: a pool that lost one does no more."""
        self.close()
        self._start()

    def close(self) -> None:
        """End the processes, in the midst of their work if need be."""
        self._alive.close()
        self._pool.shutdown(cancel_futures=True)
        self._watched.close()


class Cluster:
    """The workers of a Dask cluster, which replaces those that die."""

    attempts = 1  # of the scheduler, each of which means several workers

    def __init__(self, client: Any, task: Task) -> None:
        """Use a cluster by its client.

        Raises:
            KindError: the task cannot be pickled.
        """
        self._client, self._distributed = client, extra("distributed")
        self._payload = _pickled(task, extra("cloudpickle").dumps)  # workers need not have the script that sweeps
        self.died: type[Exception] = self._distributed.KilledWorker

    def size(self) -> int:
        """Return the number of threads of all workers, which may come and go."""
        threads: dict[str, int] = self._client.nthreads()
        return max(1, sum(threads.values()))

    def submit(self, points: Array) -> Any:
        """Begin a block; see ``Processes.submit``."""
        return self._client.submit(work, __version__, self._payload, points, pure=False)

    def wait(self, futures: Collection[Any]) -> Collection[Any]:
        """Wait until some of the futures are done, and return those. Their rows are fetched when they are asked for."""
        with self._client.as_current():
            done: Collection[Any] = self._distributed.wait(list(futures), return_when=FIRST_COMPLETED).done
        return done

    def restart(self) -> None:
        """Do nothing: the cluster does."""


@contextmanager
def cluster(task: Task, address: str) -> Iterator[Cluster]:
    """Be a client of a Dask cluster.

    Raises:
        KindError: the task cannot be pickled.
        SweepError: no scheduler answers at the address, it has no worker, or the cluster cannot go on.
    """
    # The client is closed here whatever happens, also while it is being made. One that is left to the collector is
    # closed by it, in the midst of anything: where that holds the lock that closing takes (another client or a cluster
    # being started), both wait for ever.
    kind = extra("distributed").Client
    _check_scheduler(address)
    # Where the workers are threads of this process, its threads are theirs.
    with closing(kind.__new__(kind)) as client, extra("threadpoolctl").threadpool_limits(1):
        failure = f"no Dask scheduler answers at '{address}'"
        try:
            client.__init__(address, timeout=PATIENCE, set_as_default=False)
            failure = f"the Dask scheduler at '{address}' has had no worker for {PATIENCE:g} s"
            client.wait_for_workers(1, timeout=PATIENCE)
            failure = f"the Dask cluster at '{address}' cannot go on; finished blocks stay"
            yield Cluster(client, task)
        except ArmwrightError:
            raise
        except (Exception, asyncio.CancelledError) as error:
            raise SweepError(f"{failure}: {' '.join(str(error).split()) or shown(error)}") from error


def _check_scheduler(address: str) -> None:
    """Check that a scheduler answers at an address, before a client is made.

    Raises:
        SweepError: nobody answers there, or what does is no scheduler.
    """
    distributed = extra("distributed")

    async def identity() -> Any:
        async with asyncio.timeout(PATIENCE):
            arguments = distributed.Security().get_connection_args("client")
            there = distributed.rpc(address, timeout=PATIENCE, connection_args=arguments)
            try:
                return await there.identity()
            finally:
                await there.close_rpc()

    # In a thread of its own: the caller may have an event loop that runs, as notebooks do.
    with concurrent.futures.ThreadPoolExecutor(1) as thread:
        try:
            answer = thread.submit(asyncio.run, identity()).result()
        except (OSError, ValueError) as error:
            raise SweepError(f"no Dask scheduler answers at '{address}': {shown(error)}") from error
    kind = answer.get("type") if isinstance(answer, dict) else answer
    if kind != "Scheduler":
        raise SweepError(f"at '{address}' answers {shown(kind)} of Dask; expected the address of its scheduler")


def _pickled(task: Task, dumps: Callable[[Task], bytes]) -> bytes:
    """Return a task as bytes.

    Raises:
        KindError: it cannot be pickled.
    """
    try:
        return dumps(task)
    except Exception as error:
        raise KindError(f"task '{task.name}' cannot be sent to workers: {shown(error)}") from error
