"""Calling the command line as a user does."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path


def armwright(
    *arguments: str | Path, columns: int = 80, cwd: Path | None = None, before: Callable[[], None] | None = None
) -> subprocess.CompletedProcess[str]:
    """Call it in a terminal of that width that nobody watches; ``before`` runs in the new process first."""
    return subprocess.run(
        [sys.executable, "-m", "armwright", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        cwd=cwd,
        preexec_fn=before,
        env={**os.environ, "COLUMNS": str(columns), "NO_COLOR": "1"},
        timeout=300,
    )
