"""Compiled arms where Numba is not installed."""

import os
import subprocess
import sys
from pathlib import Path

import armwright

_START = """
import sys
sys.modules["numba"] = None  # cannot be imported
import numpy as np
import armwright.compiled
from armwright.arm.load import load_arm
from armwright.compiled.arm import compile_arm
from armwright.kinematics.forward_kinematics import forward
arm = load_arm("puma560")
q = np.linspace(-2, 2, 54).reshape(9, 6)
for given in (q, q[0], q.tolist()):
    np.testing.assert_allclose(compile_arm(arm).forward(given), forward(arm, given), atol=1e-12)
"""


def test_without_numba(tmp_path: Path) -> None:
    """Only loops need Numba: a compiled arm is compiled and called without it, and without a word."""
    sources = str(Path(armwright.__file__).parents[1])
    environment = {**os.environ, "PYTHONPATH": sources, "ARMWRIGHT_CACHE": str(tmp_path)}
    command = [sys.executable, "-W", "error", "-c", _START]

    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)

    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
