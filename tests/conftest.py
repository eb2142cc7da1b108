"""What all tests share: chance that can be repeated, random samples, and one browser."""

import gc
import os
import random
import shutil
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import settings

from samples import WHOLE, Sample, drawn

# Modules and fixtures that stay loaded are not gone through again and again, which takes a tenth of the time.
gc.set_threshold(50_000, 20, 50)
gc.disable()  # while tests are collected; see pytest_collection_finish

# No test depends on how fast a machine is.
settings.register_profile("untimed", deadline=None, max_examples=100 if WHOLE else 20)
settings.load_profile("untimed")


@pytest.fixture
def rng() -> np.random.Generator:
    """Random numbers, the same in every run."""
    return np.random.default_rng(83008)


@pytest.fixture
def sample(request: pytest.FixtureRequest) -> Iterator[Sample]:
    """Random cases, drawn anew in every run; a failure says how to repeat them."""
    share = request.node.get_closest_marker("share")
    mine = drawn(request.node.nodeid, *(share.args if share else ()))
    yield mine
    if folder := os.environ.get("ARMWRIGHT_PROOF"):
        mine.keep(Path(folder))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Begin the longest files first, mark what `make proof` runs whole, leave out what `make test` does not draw."""
    items.sort(key=lambda item: item.get_closest_marker("early") is None)
    parts = defaultdict(list)
    for item in items:
        if (mark := item.get_closest_marker("drawn")) is not None:
            parts[item.nodeid.partition("[")[0], *mark.args].append(item)
        elif (mark := item.get_closest_marker("part")) is not None:
            parts[item.nodeid.partition("::")[0], *mark.args].append(item)
        examples = getattr(getattr(item, "obj", None), "is_hypothesis_test", False)
        if mark is not None or examples or "sample" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.proof)
    # The same in all processes of a run, and shown at its start: `--randomly-seed` repeats the choice.
    seed = config.getoption("randomly_seed", None)
    if WHOLE or seed is None:
        return
    left_out = set()
    for (name, part), group in parts.items():
        chosen = random.Random(f"{seed} {name}").sample(group, max(1, round(part * len(group))))
        left_out |= set(group) - set(chosen)
    if left_out:
        config.hook.pytest_deselected(items=list(left_out))
        items[:] = [item for item in items if item not in left_out]


def pytest_collection_finish() -> None:
    """Leave what was loaded until here out of all collections of garbage."""
    gc.freeze()
    gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Any:
    """Put the seed into the report of a test that failed on a random sample."""
    report = yield
    mine = getattr(item, "funcargs", {}).get("sample")
    if isinstance(mine, Sample) and report.failed:
        report.sections.append(("random sample", f"repeat with: {mine.how_to_repeat()}"))
    return report


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Start the system's chromium once for the pages of a module.

    Its event loop runs as long as it does; no longer than that, because tests of the language server need their own.
    """
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("no chromium on this machine: pages are not tried in a browser")
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with sync_api.sync_playwright() as playwright:
        started = playwright.chromium.launch(
            executable_path=chromium, args=["--headless", "--no-sandbox", "--disable-gpu"]
        )
        yield started
        started.close()
