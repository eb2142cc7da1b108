"""Files of stiffness: what is written is read again."""

from pathlib import Path

import numpy as np

from armwright.arm.load import load_arm
from armwright.dynamics import read_stiffness
from armwright.dynamics.stiffness_file import stiffness_text


def test_written_and_read(tmp_path: Path, rng: np.random.Generator) -> None:
    """Compliances of turning and sliding joints are written as stiffness and read back, but those below 0."""
    arm = load_arm("stanford-jpl")
    compliance = rng.uniform(1e-6, 1e-3, (arm.n, 3))
    compliance[1, 0], compliance[3] = -1e-5, 0.0
    path = tmp_path / "stiffness.toml"
    path.write_text(stiffness_text(arm, compliance), encoding="utf-8")

    assert "z_N_per_m" in path.read_text(encoding="utf-8")
    np.testing.assert_allclose(read_stiffness(path, arm), np.maximum(compliance, 0), rtol=1e-5)
