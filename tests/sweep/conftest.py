"""What the tests of sweeps share."""

import gc
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from armwright.sweep.designs import Design, full_factorial


@pytest.fixture(autouse=True, scope="module")
def _frozen() -> Iterator[None]:
    """What was there before is not gone through by every collection, which would take half a second each."""
    gc.collect()
    gc.freeze()
    yield
    gc.unfreeze()


@pytest.fixture(autouse=True)
def _collected() -> Iterator[None]:
    """Whatever a test left to the collector is collected behind it, not in the midst of the next one."""
    yield
    gc.collect()


@pytest.fixture(autouse=True, scope="session")
def _patient() -> Iterator[None]:
    """On a busy machine a cluster takes its time to start."""
    try:
        import dask
    except ImportError:
        yield
        return
    with dask.config.set({f"distributed.comm.timeouts.{what}": "240s" for what in ("connect", "tcp")}):
        yield


@pytest.fixture(scope="module")
def local_cluster() -> Iterator[Any]:
    """Start a Dask cluster whose two workers are threads of this process."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=False, dashboard_address=":0"
    ) as started:
        yield started


@pytest.fixture
def speeds() -> Design:
    """Forty start speeds, from 0 to 39 m/s."""
    return full_factorial({"speed": np.arange(40.0)}, units={"speed": "m/s"})
