"""Who does the work: this process, processes of this machine, or a Dask cluster.

A crew gets pieces of a design and gives back their rows, in any order. It outlives its workers: a piece whose worker
died is done again, alone, so that the blame for a second death is its own.
"""

import asyncio
import concurrent.futures
import multiprocessing
import pickle
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from typing import Any, Protocol

from armwright.arrays import Array
from armwright.errors import KindError, shown
from armwright.sweep.errors import SweepError
from armwright.sweep.extras import extra
from armwright.sweep.task import Rows, Status, Task, evaluate, lost, stacked
from armwright.sweep.worker import ready, settle, work
from armwright.version import __version__

# A Dask cluster has so long to answer, and to have a worker [s].
PATIENCE = 20.0
# Pieces waiting or in work, per worker: no worker waits, and memory does not grow with the sweep.
_PER_WORKER = 2
_KILLED = "the worker process died each time it was tried"


class Crew(Protocol):
    """Workers that do pieces at the same time."""

    again: int
    """How often a piece whose worker died is done again as a whole."""

    def size(self) -> int:
        """Return the number of workers."""

    def submit(self, points: Array) -> Future[Rows]:
        """Begin a piece. Its future, or this call, raises ``BrokenExecutor`` when its worker dies."""

    def renew(self) -> None:
        """Replace workers that died."""


def alone(task: Task, pieces: Iterable[tuple[int, Array]]) -> Iterator[tuple[int, Rows]]:
    """Do pieces in this process, one after the other."""
    with extra("threadpoolctl").threadpool_limits(1):
        for number, points in pieces:
            yield number, evaluate(task, points)


def together(crew: Crew, task: Task, pieces: Iterable[tuple[int, Array]]) -> Iterator[tuple[int, Rows]]:
    """Do pieces by a crew; they come back as they are done.

    Args:
        crew: who does them.
        task: what is done.
        pieces: (m, k) points by number.

    Raises:
        SweepError: the crew cannot go on.
    """
    left = iter(pieces)
    flying: dict[Future[Rows], tuple[int, Array]] = {}
    suspects: list[tuple[int, Array]] = []
    while True:
        while not suspects and len(flying) < _PER_WORKER * crew.size() and (piece := next(left, None)):
            try:
                flying[crew.submit(piece[1])] = piece
            except BrokenExecutor:
                suspects.append(piece)
        if not flying and not suspects:
            return
        done, _ = concurrent.futures.wait(flying, return_when=concurrent.futures.FIRST_COMPLETED)
        for future in done:
            piece = flying.pop(future)
            try:
                rows = future.result()
            except BrokenExecutor:
                suspects.append(piece)
                continue
            yield piece[0], rows
        if suspects and not flying:  # nothing else is in work now
            crew.renew()
            while suspects:
                number, points = suspects.pop()
                yield number, _once_more(crew, task, points, crew.again)


def _once_more(crew: Crew, task: Task, points: Array, tries: int) -> Rows:
    """Do a piece whose worker died again, then row by row; a row that kills its worker then is lost."""
    for _ in range(tries):
        try:
            return crew.submit(points).result()
        except BrokenExecutor:
            crew.renew()
    if len(points) == 1:
        return lost(task, Status.KILLED, _KILLED)
    return stacked([_once_more(crew, task, points[i : i + 1], 1) for i in range(len(points))])


class Processes:
    """Worker processes of this machine, each on one thread."""

    again = 2

    def __init__(self, task: Task, workers: int) -> None:
        """Start the processes.

        Raises:
            KindError: the task cannot be pickled.
            SweepError: they do not start, or cannot load the task.
        """
        self._payload = pickled(task, pickle.dumps)
        self._workers = workers
        self._context = multiprocessing.get_context("spawn")  # a fork of threads that hold locks may wait for ever
        self._begin()

    def _begin(self) -> None:
        self._watched, self._alive = self._context.Pipe(duplex=False)
        self._pool = ProcessPoolExecutor(
            self._workers, mp_context=self._context, initializer=settle, initargs=(self._watched,)
        )
        try:
            self._pool.submit(ready, __version__, self._payload).result()
        except BaseException as error:
            self.end(at_once=True)
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
        """Begin a piece."""
        return self._pool.submit(work, __version__, self._payload, points)

    def renew(self) -> None:
        """Start the processes anew if one of them died: a pool that lost one does no more."""
        try:
            self._pool.submit(ready, __version__, self._payload).result()
        except BrokenExecutor:
            self.end(at_once=True)
            self._begin()

    def end(self, *, at_once: bool) -> None:
        """End the processes, ``at_once`` in the midst of their work."""
        if at_once:
            self._alive.close()
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._alive.close()
        self._watched.close()


@contextmanager
def processes(task: Task, workers: int) -> Iterator[Processes]:
    """Have worker processes; after an error or an interruption they are gone at once."""
    crew = Processes(task, workers)
    try:
        yield crew
    except BaseException:
        crew.end(at_once=True)
        raise
    crew.end(at_once=False)


class Cluster:
    """The workers of a Dask cluster."""

    again = 0  # the scheduler has tried several workers already

    def __init__(self, client: Any, address: str, task: Task) -> None:
        """Find out whether the cluster has workers that can do the task.

        Raises:
            KindError: the task cannot be pickled.
            SweepError: there is no worker, or one cannot load the task.
        """
        self._client, self._address = client, address
        self._arriving: set[asyncio.Future[Any]] = set()
        self._over = False
        self._payload = pickled(task, extra("cloudpickle").dumps)  # workers need not have the script that sweeps
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError as error:
            raise SweepError(f"the Dask scheduler at '{address}' has had no worker for {PATIENCE:g} s") from error
        try:
            client.submit(ready, __version__, self._payload, pure=False).result()
        except SweepError:
            raise
        except Exception as error:
            raise SweepError(f"the Dask workers cannot load armwright {__version__}: {shown(error)}") from error

    def size(self) -> int:
        """Return the number of threads of all workers, which may come and go."""
        threads: dict[str, int] = self._client.nthreads()
        return max(1, sum(threads.values()))

    def submit(self, points: Array) -> Future[Rows]:
        """Begin a piece, known to the cluster by what it is: asked for twice at a time, it is done once."""
        future: Future[Rows] = Future()
        remote = self._client.submit(work, __version__, self._payload, points, pure=True)
        self._client.loop.add_callback(self._hand_over, remote, future)
        return future

    async def _hand_over(self, remote: Any, future: Future[Rows]) -> None:
        """Say with the words of ``concurrent.futures`` how a future of Dask ended.

        It waits on the loop of its own client and ends with that. Dask's callbacks of all clients share one thread: one
        that asks for rows while its client is closed would wait there for ever, and all others behind it.
        """
        from distributed import KilledWorker  # noqa: PLC0415 - a library of the extra

        try:
            rows = await self._rows(remote)
        except KilledWorker as error:
            future.set_exception(BrokenExecutor(str(error)))
        except (CancelledError, asyncio.CancelledError, OSError) as error:
            text = f"the Dask cluster at '{self._address}' went away: {error}; start again to go on"
            future.set_exception(SweepError(text))
        except BaseException as error:  # noqa: BLE001 - it is raised where it is waited for
            future.set_exception(error)
        else:
            future.set_result(rows)

    async def _rows(self, remote: Any) -> Rows:
        """Wait for rows and fetch them, unless nobody wants them any more."""
        await remote.exception()
        if self._over:
            raise CancelledError
        arriving = asyncio.ensure_future(remote.result())
        self._arriving.add(arriving)
        arriving.add_done_callback(self._arriving.discard)
        rows: Rows = await arriving
        return rows

    def renew(self) -> None:
        """Do nothing: a cluster replaces its own workers."""

    def end(self) -> None:
        """Fetch no more rows, and let those arrive that are on their way: a scheduler whose client goes complains."""
        with suppress(TimeoutError, RuntimeError):
            self._client.sync(self._arrived, callback_timeout=PATIENCE)

    async def _arrived(self) -> None:
        self._over = True
        if self._arriving:
            await asyncio.wait(self._arriving)


@contextmanager
def cluster(task: Task, address: str) -> Iterator[Cluster]:
    """Be a client of a Dask cluster.

    Raises:
        SweepError: nobody answers at the address, or what answers is no scheduler.
    """
    distributed = extra("distributed")
    _refuse_silence(address)
    with _client(distributed.Client, address) as client, extra("threadpoolctl").threadpool_limits(1):
        # Where the workers are threads of this process, its threads are theirs.
        crew = Cluster(client, address, task)
        try:
            yield crew
        finally:
            crew.end()


@contextmanager
def _client(kind: Any, address: str) -> Iterator[Any]:
    """Have a Dask client that is closed here whatever happens, also while it is being made.

    One that is left to the collector is closed by it, in the midst of anything: where that holds the lock that closing
    takes (another client or a cluster being started), both wait for ever.
    """
    client = kind.__new__(kind)
    try:
        client.__init__(address, timeout=PATIENCE, set_as_default=False)
        yield client
    except OSError as error:
        raise SweepError(f"no Dask scheduler answers at '{address}': {shown(error)}") from error
    finally:
        client.close()


def _refuse_silence(address: str) -> None:
    """See to it that a scheduler answers at an address before a client is made.

    Raises:
        SweepError: nobody answers there, or what does is no scheduler.
    """
    # In a thread of its own: the caller may have an event loop that runs, as notebooks do.
    with concurrent.futures.ThreadPoolExecutor(1) as thread:
        try:
            kind = thread.submit(asyncio.run, _kind_of(address)).result()
        except (OSError, ValueError) as error:
            raise SweepError(f"no Dask scheduler answers at '{address}': {shown(error)}") from error
    if kind != "Scheduler":
        raise SweepError(f"at '{address}' answers {shown(kind)} of Dask; expected the address of its scheduler")


async def _kind_of(address: str) -> object:
    """Ask what stands at an address of Dask: a scheduler or a worker."""
    distributed = extra("distributed")
    async with asyncio.timeout(PATIENCE):
        arguments = distributed.Security().get_connection_args("client")
        there = distributed.rpc(address, timeout=PATIENCE, connection_args=arguments)
        try:
            answer = await there.identity()
        finally:
            await there.close_rpc()
    return answer.get("type") if isinstance(answer, dict) else answer


def pickled(task: Task, dumps: Callable[[Task], bytes]) -> bytes:
    """Return a task as bytes.

    Raises:
        KindError: it cannot be pickled.
    """
    try:
        return dumps(task)
    except Exception as error:
        raise KindError(f"task '{task.name}' cannot be sent to workers: {shown(error)}") from error
