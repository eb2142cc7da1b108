"""The widget in JupyterLab, with a browser. It takes a minute, and JupyterLab: see `make jupyter`."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("jupyterlab")
pytest.importorskip("anywidget")
CELLS = [
    "import armwright as aw\nshown = aw.show(aw.load_arm('ur5'))\nshown",
    "print(shown.studio.workbench.arms['ARM_1'].q[0])",
]


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[str]:
    """The address of a JupyterLab with a notebook in it."""
    cells = [
        {"cell_type": "code", "source": text, "metadata": {}, "outputs": [], "execution_count": None} for text in CELLS
    ]
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    book = {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 4}
    (tmp_path / "arm.ipynb").write_text(json.dumps(book))
    command = [sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root", "--port=0", "--ip=127.0.0.1"]
    own = {f"JUPYTER_{what.upper()}_DIR": str(tmp_path / what) for what in ("config", "data")}
    process = subprocess.Popen(
        [*command, f"--ServerApp.root_dir={tmp_path}"], stderr=subprocess.PIPE, text=True, env={**os.environ, **own}
    )
    assert process.stderr is not None
    try:
        addresses = (re.search(r"http://127\.0\.0\.1:\d+/lab\?token=\w+", line) for line in process.stderr)
        found = next(filter(None, addresses))
        yield found[0].replace("/lab?", "/lab/tree/arm.ipynb?")
    finally:
        process.terminate()
        process.communicate(timeout=30)


def test_in_jupyterlab(browser: Any, lab: str) -> None:
    """A cell that shows an arm draws its page; a slider of it moves the arm of the kernel."""
    page = browser.new_page(viewport={"width": 1300, "height": 1000})
    try:
        page.goto(lab)
        page.locator(".jp-Notebook .jp-CodeCell").first.click(timeout=60_000)
        page.locator(".jp-Notebook .jp-CodeCell .cm-content").first.click()
        page.keyboard.press("Shift+Enter")
        page.locator("iframe[srcdoc]").first.wait_for(timeout=60_000)
        shown = next(frame for frame in page.frames if frame.parent_frame and "srcdoc" in (frame.url or "about:srcdoc"))
        slider = shown.locator("#joint-1")
        for _ in range(200):
            if slider.is_enabled():
                break
            page.wait_for_timeout(100)
        before = shown.evaluate("studio.live.state.arms.ARM_1.q[0]")
        slider.focus()
        for _ in range(20):
            page.keyboard.press("ArrowRight")
        page.wait_for_timeout(1000)
        after = shown.evaluate("studio.live.state.arms.ARM_1.q[0]")
        assert after > before
        page.locator(".jp-Notebook .jp-CodeCell .cm-content").nth(1).click()
        page.keyboard.press("Shift+Enter")
        page.wait_for_timeout(3000)
        printed = page.locator(".jp-OutputArea-output pre").last.inner_text()
        assert float(printed) == pytest.approx(after, abs=1e-6)
    finally:
        page.close()
