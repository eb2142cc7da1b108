"""Linkages as scripts of Exudyn, whose tips follow those of our simulation."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from armwright.clearance.exudyn.export import exudyn_files
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import Path as TipPath, constant_speed_path, thesis_path
from armwright.clearance.reader import load_linkage
from armwright.clearance.scenario import prepare_scenario
from armwright.clearance.settings import Settings
from armwright.errors import InvalidValueError
from clearance.arms import beginning

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

# What two integrators with steps of 10 µs and two points of contact leave [m].
NEAR = 1e-7


@pytest.mark.parametrize(
    ("name", "path"),
    [
        # Past the jump of the torques at 0.05 s.
        ("five-bar", beginning(thesis_path("y1"), 0.06)),
        pytest.param("slider-crank", constant_speed_path("turning", 0.0, 10.0, 0.02), marks=pytest.mark.drawn(0.34)),
        pytest.param("four-bar", constant_speed_path("turning", np.pi / 3, 6.0, 0.02), marks=pytest.mark.drawn(0.34)),
    ],
    ids=["five-bar", "slider-crank", "four-bar"],
)
def test_the_script_repeats_the_run(name: str, path: TipPath, tmp_path: Path) -> None:
    """The script that was written runs, and its tip stays within a tenth of a micrometre of ours."""
    settings = Settings(impact="carvalho-martins", sample=1e-3)
    for file, text in exudyn_files(prepare_scenario(load_linkage(name), path, settings)).items():
        (tmp_path / file).write_text(text)
    spec = importlib.util.spec_from_file_location("run_linkage", tmp_path / "run_linkage.py")
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)

    tip = script.simulate()

    reference = np.loadtxt(tmp_path / "reference.csv", delimiter=",", skiprows=1)
    assert len(tip) == len(reference)
    np.testing.assert_allclose(tip[:, 1:], reference[:, 1:], atol=NEAR)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (Settings(), "impact law lankarani-nikravesh; expected carvalho-martins"),
        (Settings(impact="carvalho-martins", control="pd+ff"), "a controller; expected control by effort"),
    ],
)
def test_what_exudyn_does_not_know(settings: Settings, message: str) -> None:
    """What Exudyn has no counterpart for is rejected by name."""
    linkage: Linkage = load_linkage("five-bar")
    with pytest.raises(InvalidValueError, match=message):
        exudyn_files(prepare_scenario(linkage, beginning(thesis_path("y1"), 0.01), settings))
