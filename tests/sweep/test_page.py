"""The page on sweeps: its example runs and prints what the page says."""

import subprocess
import sys
from pathlib import Path

import pytest

from armwright.sweep.task import Status

pytest.importorskip("xarray")

PAGE = (Path(__file__).parents[2] / "docs" / "sweeps.md").read_text(encoding="utf-8")


def test_example(tmp_path: Path) -> None:
    """The example prints the table on the page: at 10 m/s a stone rises v²/2g = 5.097 m."""
    (tmp_path / "throw.py").write_text(PAGE.partition("```python\n")[2].partition("```")[0], encoding="utf-8")

    done = subprocess.run(
        [sys.executable, "-W", "error", "throw.py"],
        cwd=tmp_path,
        env={"PYTHONPATH": ":".join(sys.path)},
        capture_output=True,
        encoding="utf-8",
        check=False,
        timeout=300,
    )

    assert done.stderr == ""
    assert done.stdout == PAGE.partition("```text\n")[2].partition("```")[0]


def test_table_of_status() -> None:
    """Every status stands on the page."""
    for status in Status:
        assert f"| {status.value} | `{status.name.lower()}` |" in PAGE
