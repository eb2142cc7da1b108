"""What the tests of calibration share."""

from collections.abc import Iterator

import pytest
from threadpoolctl import threadpool_limits


@pytest.fixture(scope="package", autouse=True)
def one_thread() -> Iterator[None]:
    """Solve small systems on one thread: on a busy machine, several wait for each other longer than they compute."""
    with threadpool_limits(1):
        yield
