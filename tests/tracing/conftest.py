"""What the tests of kernels share: a cache of their own."""

from collections.abc import Iterator

import pytest


@pytest.fixture(scope="module")
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Compile into a folder of the module's own; the modules behind it use the user's again."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("ARMWRIGHT_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield
