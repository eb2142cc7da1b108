"""The measured five-bar of the examples, what it has, and how near an estimate must come."""

from pathlib import Path
from typing import Any

import numpy as np

EXAMPLES = Path(__file__).parents[1] / "examples"
REST, PATHS = EXAMPLES / "five_bar_rest.csv", EXAMPLES / "five_bar_paths.csv"
# What the example's arm has [m], and how its friction goes.
PLAY = {"J2": 0.328e-3, "J3": 0.171e-3, "J4": 0.483e-3}
CENTRE = ("--friction-velocity", "centre", "--threshold-mm-s", "10")


def assert_clearances_found(found: dict[str, Any], accuracy: float) -> None:
    """Means are near the truth, which lies near or in the intervals."""
    right = [1 - abs(one["mean"] / PLAY[name] - 1) for name, one in found["parameters"].items()]
    assert list(found["parameters"]) == list(PLAY)
    assert np.mean(right) > accuracy
    for name, one in found["parameters"].items():
        low, high = one["interval"]
        assert low < one["mean"] < high
        assert abs(one["mean"] - PLAY[name]) < 3.5 * one["deviation"]
        assert one["identifiable"]
    assert np.shape(found["correlation"]) == (3, 3)
