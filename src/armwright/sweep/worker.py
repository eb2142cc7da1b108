"""The code that runs in a worker: a process of this machine, or a worker of a Dask cluster."""

import os
import pickle
import signal
import sys
import threading
from functools import lru_cache
from multiprocessing.connection import Connection, wait

from armwright.arrays import Array
from armwright.errors import shown
from armwright.sweep.errors import SweepError
from armwright.sweep.extras import extra
from armwright.sweep.task import Rows, Task, evaluate
from armwright.version import __version__

# What libraries read when they are loaded. Sums are taken in another order by another number of threads.
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")


def initialize_process(alive: Connection) -> None:
    """Prepare a process of this machine: one thread for its work, and it ends with the process that started it.

    Args:
        alive: nothing is ever sent over it; it ends when the process that sweeps closes it or dies, even by kill -9.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that sweeps
    os.environ.update(_ONE_THREAD)
    if "numba" in sys.modules:  # loaded already, by the script that sweeps
        sys.modules["numba"].set_num_threads(1)

    def watch() -> None:
        wait([alive])
        os._exit(0)

    threading.Thread(target=watch, daemon=True).start()


def evaluate_pickled(version: str, payload: bytes, points: Array) -> Rows:
    """Evaluate a pickled task at some points.

    Args:
        version: of armwright where the sweep was started.
        payload: the task, pickled.
        points: (m, k) one row per run.

    Raises:
        SweepError: this worker has another armwright, cannot load the task, or the task returned something else than
            its outputs.
    """
    if version != __version__:
        raise SweepError(f"a worker has armwright {__version__}, here it is {version}; results could differ")
    task = _load_task(payload)
    extra("threadpoolctl").threadpool_limits(1)  # in this process from now on; what was loaded meanwhile too
    return evaluate(task, points)


@lru_cache(maxsize=4)
def _load_task(payload: bytes) -> Task:
    try:
        task: Task = pickle.loads(payload)  # noqa: S301 - made by the process that sweeps
    except Exception as error:
        raise SweepError(
            f"a worker cannot load the task: {shown(error)}; workers import a task from the module it is defined in"
        ) from error
    return task
