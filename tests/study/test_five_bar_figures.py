"""Figures of the study of the five-bar."""

from types import SimpleNamespace

import numpy as np

from armwright.study.five_bar_clearance import EstimateRow, TargetRow
from armwright.study.five_bar_clearance_study import FiveBarClearance
from armwright.study.five_bar_figures import _fit


def test_line_through_an_error_curve() -> None:
    """Of an error that grows by 2 mm/s from 0.3 mm the fitted line does so too."""
    t = np.linspace(0.0, 0.25, 101)

    ends, values = _fit(SimpleNamespace(time=t, distance=0.3e-3 + 2e-3 * t))  # type: ignore[arg-type]

    np.testing.assert_allclose(values, 0.3 + 2.0 * ends, atol=1e-12)


def test_headline() -> None:
    """The page begins with the best estimate of arm A and its errors before and after the correction."""
    true = (0.4, 0.3, 0.2)
    study = FiveBarClearance(
        swept=SimpleNamespace(points=np.zeros((729, 3))),  # type: ignore[arg-type]
        repeatability=[],
        features=[],
        estimates=[
            EstimateRow("A", "slope", true, true, true, 90.0, (91.0, 92.0, 93.0)),
            EstimateRow("A", "amp_dc", true, true, true, 95.5, (97.0, 98.0, 99.0)),
            EstimateRow("B", "at rest", true, None, true, None, (100.0, 100.0, 100.0)),
        ],
        targets=[],
        corrected=None,  # type: ignore[arg-type]
        corrections=[
            TargetRow("A", "uncorrected", (0.5, 0.6, 0.7), (0.55, 0.5, 0.6)),
            TargetRow("A", "corrected by intercept", (0.01, 0.02, 0.03), (0.001, 0.002, 0.003)),
            TargetRow("A", "corrected by all nine", None, (0.0, 0.0, 0.0)),
        ],
    )

    numbers = [(tile.value, tile.label) for tile in study.headline()]

    assert numbers == [
        ("98.00 %", "accuracy of the clearances of arm A, by amplitude; printed 95.50 %"),
        ("0.5500 mm", "mean error of arm A at the targets, uncorrected; printed 0.600 mm"),
        ("0.0020 mm", "mean error of arm A at the targets, corrected by intercept; printed 0.020 mm"),
        ("729", "linkages simulated on three paths"),
    ]
