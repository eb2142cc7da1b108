"""Executors: how many blocks are at work at a time, and on how many threads."""

from collections.abc import Collection, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ThreadPoolExecutor, wait
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armwright.sweep.designs import Design
from armwright.sweep.executors import evaluate_in_parallel
from armwright.sweep.runner import run
from armwright.sweep.task import Rows, evaluate
from sweep_tasks import Fall, Threads

pytest.importorskip("xarray")
pytest.importorskip("distributed")


class Threaded:
    """An executor of three threads."""

    died = BrokenExecutor
    attempts = 1

    def __init__(self) -> None:
        self.pool = ThreadPoolExecutor(3)

    def size(self) -> int:
        """Three."""
        return 3

    def submit(self, points: np.ndarray) -> Future[Rows]:
        """Begin a block."""
        return self.pool.submit(evaluate, Fall(), points)

    def wait(self, futures: Collection[Future[Rows]]) -> Collection[Future[Rows]]:
        """Wait until some are done."""
        return wait(futures, return_when=FIRST_COMPLETED).done

    def restart(self) -> None:
        """Not asked for: no thread dies."""
        raise AssertionError


def test_few_blocks_at_a_time() -> None:
    """However long a sweep is, no more than two blocks per worker are begun and not yet handed on."""
    begun: list[int] = []

    def blocks() -> Iterator[tuple[int, np.ndarray]]:
        for number in range(500):
            begun.append(number)
            yield number, np.array([[float(number)]])

    handed = []
    for number, rows in evaluate_in_parallel(Threaded(), Fall(), blocks()):
        handed.append(number)
        assert len(begun) - len(handed) < 2 * 3
        assert rows["depth"].tolist() == [4.905 - number]

    assert sorted(handed) == list(range(500))


@pytest.mark.parametrize("way", ["here", "processes", "cluster"])
def test_one_thread_each(way: str, local_cluster: Any, speeds: Design, tmp_path: Path) -> None:
    """Linear algebra has one thread in every worker, and the caller's own number again afterwards."""
    ways: dict[str, dict[str, Any]] = {
        "here": {"workers": 1},
        "processes": {"workers": 2},
        "cluster": {"scheduler": local_cluster.scheduler_address},
    }
    before = Threads().most()

    results = run(Threads(), speeds, tmp_path / "out", block=10, **ways[way])

    assert results.threads.values.tolist() == [1] * 40
    assert Threads().most() == before
