"""A Dask cluster as the executor of a sweep."""

import gc
import socket
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armwright.sweep import executors
from armwright.sweep.designs import Design, full_factorial
from armwright.sweep.errors import SweepError
from armwright.sweep.progress import Progress
from armwright.sweep.runner import run
from armwright.sweep.task import Status
from armwright.sweep.worker import evaluate_pickled
from sweep_tasks import Fall, calls_of

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

pytest.importorskip("xarray")
dask = pytest.importorskip("dask")
distributed = pytest.importorskip("distributed")


def test_each_block_once(local_cluster: Any, speeds: Design, tmp_path: Path) -> None:
    """The cluster does every block once; rows that raise are rows with a status there too."""
    task = Fall(calls=tmp_path / "calls", raises_above=38.5)

    results = run(task, speeds, tmp_path / "out", block=8, scheduler=local_cluster.scheduler_address)

    assert results.status.values.tolist() == [Status.DONE] * 39 + [Status.FAILED]
    blocks = [row for _, row in calls_of(tmp_path / "calls") if len(row) == 8]
    assert sorted(blocks) == [tuple(range(k, k + 8)) for k in range(0, 40, 8)]


def test_begun_on_the_cluster(
    local_cluster: Any, speeds: Design, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """A sweep that was stopped on a cluster goes on without it, and the other way round; nothing is printed."""

    def stop(now: Progress) -> None:
        if now.done in {8, 24}:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        run(Fall(), speeds, tmp_path / "out", block=8, scheduler=local_cluster.scheduler_address, progress=stop)
    with pytest.raises(InterruptedError):
        run(Fall(), speeds, tmp_path / "out", workers=1, progress=lambda now: stop(now) if now.done > 8 else None)
    results = run(Fall(), speeds, tmp_path / "out", scheduler=local_cluster.scheduler_address)

    np.testing.assert_array_equal(results.depth, run(Fall(), speeds, tmp_path / "whole", workers=1).depth)
    assert capfd.readouterr() == ("", "")


def test_stopped_while_rows_arrive(
    local_cluster: Any, speeds: Design, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Rows that arrive while a sweep is stopped make no later one wait, and nobody complains of them."""

    def stop(now: Progress) -> None:
        if now.done in {3, 8}:
            raise InterruptedError

    for number in range(8):
        with pytest.raises(InterruptedError):
            run(
                Fall(),
                speeds,
                tmp_path / str(number),
                block=1,
                scheduler=local_cluster.scheduler_address,
                progress=stop,
            )
    run(Fall(), speeds, tmp_path / "out", block=4, scheduler=local_cluster.scheduler_address)

    assert capfd.readouterr() == ("", "")


def test_killed_worker(tmp_path: Path) -> None:
    """A row that kills its Dask worker is a row with a status; the cluster does the others."""
    design = full_factorial({"speed": np.arange(6.0)})
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=True, dashboard_address=":0", silence_logs=50
        ) as cluster,
    ):
        results = run(Fall(kills_above=4.5), design, tmp_path / "out", block=2, scheduler=cluster.scheduler_address)

        assert results.status.values.tolist() == [Status.DONE] * 5 + [Status.KILLED]
        np.testing.assert_allclose(results.depth[:5], 4.905 - np.arange(5.0))


def test_cluster_that_goes_away(speeds: Design, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the scheduler goes away in the midst of a sweep, nobody waits for it, and finished blocks stay."""
    monkeypatch.setattr(executors, "CLUSTER_TIMEOUT", 2.0)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0"
    ) as cluster:

        def close(now: Progress) -> None:
            if now.done:
                cluster.close()

        with pytest.raises(
            SweepError, match=r"the Dask cluster at 'inproc://.*' cannot continue; finished blocks are kept"
        ):
            run(
                Fall(seconds=0.2),
                speeds,
                tmp_path / "out",
                block=8,
                scheduler=cluster.scheduler_address,
                progress=close,
            )

    reports: list[Progress] = []
    run(Fall(), speeds, tmp_path / "out", workers=1, progress=reports.append)
    assert reports[0].resumed >= 8


def test_nobody_answers(speeds: Design, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where there is no scheduler it is said which address did not answer."""
    monkeypatch.setattr(executors, "CLUSTER_TIMEOUT", 0.3)

    with pytest.raises(SweepError, match=r"no Dask scheduler answers at 'tcp://127.0.0.1:1'"):
        run(Fall(), speeds, tmp_path / "out", scheduler="tcp://127.0.0.1:1")


def clients() -> list[Any]:
    """The clients of Dask that are there, after a collection."""
    gc.collect()
    return [one for one in gc.get_objects() if type(one) is distributed.Client]


def test_silence(speeds: Design, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where something listens and never speaks, nobody waits for ever, and no client is left to the collector."""
    monkeypatch.setattr(executors, "CLUSTER_TIMEOUT", 0.5)
    before = clients()
    with socket.create_server(("127.0.0.1", 0)) as deaf:
        address = f"tcp://127.0.0.1:{deaf.getsockname()[1]}"
        with pytest.raises(SweepError, match=f"no Dask scheduler answers at '{address}'"):
            run(Fall(), speeds, tmp_path / "out", scheduler=address)

    assert clients() == before


def test_scheduler_lost_at_once(
    local_cluster: Any, speeds: Design, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A client whose scheduler goes away while it is being made is closed where it was made."""
    made: list[Any] = []

    async def lost(self: Any, **_: Any) -> None:
        made.append(self)
        raise OSError("the line is dead")

    monkeypatch.setattr(distributed.Client, "_ensure_connected", lost)
    with pytest.raises(SweepError, match=r"no Dask scheduler answers at 'inproc://.*the line is dead"):
        run(Fall(), speeds, tmp_path / "out", scheduler=local_cluster.scheduler_address)

    assert [client.status for client in made] == ["closed"]


def test_address_of_a_worker(local_cluster: Any, speeds: Design, tmp_path: Path) -> None:
    """A worker of Dask is no scheduler."""
    worker = next(iter(local_cluster.scheduler_info["workers"]))

    with pytest.raises(SweepError, match=r"kind 'Worker' answers; expected the address of a scheduler"):
        run(Fall(), speeds, tmp_path / "out", scheduler=worker)


def test_address_that_is_none(speeds: Design, tmp_path: Path) -> None:
    """What is no address is no scheduler."""
    with pytest.raises(SweepError, match="no Dask scheduler answers at 'carrier-pigeon://roof'"):
        run(Fall(), speeds, tmp_path / "out", scheduler="carrier-pigeon://roof")


def test_cluster_without_workers(speeds: Design, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A cluster without workers would keep everybody waiting."""
    monkeypatch.setattr(executors, "CLUSTER_TIMEOUT", 0.5)
    with (
        distributed.LocalCluster(n_workers=0, processes=False, dashboard_address=":0") as cluster,
        pytest.raises(SweepError, match=r"the Dask scheduler at 'inproc://.*' has had no worker for 0.5 s"),
    ):
        run(Fall(), speeds, tmp_path / "out", scheduler=cluster.scheduler_address)


def test_worker_of_another_version() -> None:
    """A worker with another armwright refuses to work: its bits could differ."""
    with pytest.raises(SweepError, match=r"a worker has armwright .*, here it is 0.0.1; results could differ"):
        evaluate_pickled("0.0.1", b"", np.zeros((1, 1)))


def test_worker_that_cannot_load_the_task() -> None:
    """A task from a module that a worker has not is told apart from a dead worker."""
    from armwright.version import __version__

    with pytest.raises(SweepError, match=r"a worker cannot load the task: ModuleNotFoundError.*imports? a task from"):
        evaluate_pickled(__version__, b"cno_such_module\nTask\n.", np.zeros((1, 1)))
