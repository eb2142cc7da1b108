"""Linkages of the catalogue beside other simulators."""

import numpy as np
import pytest

from armwright.clearance.paths import constant_speed_path
from armwright.study import linkage_simulators
from armwright.study.linkage_simulators import CHAOS, Comparison, LinkageSimulators


@pytest.mark.drawn(0.34)
@pytest.mark.parametrize("exudyn", [True, False], ids=["both", "MuJoCo alone"])
def test_beside_other_simulators(exudyn: bool, monkeypatch: pytest.MonkeyPatch) -> None:  # noqa: FBT001 - a parameter
    """Others have the tip where ours has it; without Exudyn its rows are left out, and a note says so."""
    if exudyn:
        pytest.importorskip("exudyn", reason="exudyn is not installed")
    else:
        monkeypatch.setattr(linkage_simulators, "find_spec", lambda _name: None)
    short = [("slider-crank", constant_speed_path("short", 0.0, 10.0, 0.004))]
    monkeypatch.setattr(linkage_simulators, "motions", lambda: short)

    study = LinkageSimulators.run()

    others = ["MuJoCo", "Exudyn"] if exudyn else ["MuJoCo"]
    assert [row.simulator.partition(" ")[0] for row in study.comparisons] == [*others, "armwright,"]
    assert all(row.apart.max() < 1e-7 for row in study.comparisons)
    assert all(row.together == len(row.time) == 5 for row in study.comparisons)
    assert ("Exudyn is not installed" in study.notes[2]) is not exudyn
    (told,) = study.tables()
    assert len(told.rows) == len(study.as_data()["comparisons"]) == len(others) + 1
    assert len(list(study.headline())) == len(others)
    assert [drawing.name for drawing in study.figures()] == ["slider-crank"]


def test_until_the_pins_rattle_apart() -> None:
    """What is told ends before the tips are too far apart for the first time."""
    apart = np.array((0.0, 0.5, 0.9, 1.1, 0.2)) * CHAOS
    row = Comparison(linkage="l", motion="m", simulator="s", pins="closed", time=np.arange(5.0), apart=apart)

    assert row.together == 3
    ((_, _, _, _, most, until, end),) = next(LinkageSimulators(comparisons=[row], notes=()).tables()).rows
    assert (most, until, end) == ("4.5", "2", "1")
