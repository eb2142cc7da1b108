"""Figures of the study of the five-bar."""

from types import SimpleNamespace

import numpy as np

from armwright.study.five_bar_figures import _fit


def test_line_through_an_error_curve() -> None:
    """Of an error that grows by 2 mm/s from 0.3 mm the fitted line does so too."""
    t = np.linspace(0.0, 0.25, 101)

    ends, values = _fit(SimpleNamespace(time=t, distance=0.3e-3 + 2e-3 * t))  # type: ignore[arg-type]

    np.testing.assert_allclose(values, 0.3 + 2.0 * ends, atol=1e-12)
