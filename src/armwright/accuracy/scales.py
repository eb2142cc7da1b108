"""Commanded and attained values that look as if they were in different units."""

from __future__ import annotations

import numpy as np

from armwright.arrays import Array

# How many of the second unit are one of the first.
_LENGTHS = {
    "metres and millimetres": 1000.0,
    "metres and centimetres": 100.0,
    "metres and inches": 1 / 0.0254,
    "inches and millimetres": 25.4,
    "centimetres and millimetres": 10.0,
}
_DEGREES = 180 / np.pi
# How well a ratio must fit, and two directions agree.
_FIT, _ALIGNED = 0.02, 0.999
# Nearer to the origin, or in a path smaller than this [m], a large ratio may be an honest error.
_FAR = 0.05
# Angles smaller than this [rad] say nothing of their unit.
_LARGE_ANGLE = np.radians(10)


def lengths_question(commanded: Array, attained: Array) -> str:
    """Ask whether commanded and attained places are in different units; empty where nothing looks like it.

    Args:
        commanded: (c, d) commanded path, told by its extent, or (1, d) pose, told by its distance from the origin [m].
        attained: (n, d) attained ones [m].

    Returns:
        What is odd, and a question.
    """
    if len(commanded) > 1:
        asked, got = float(np.linalg.norm(np.ptp(commanded, axis=0))), float(np.linalg.norm(np.ptp(attained, axis=0)))
    else:
        asked, got = _outward(commanded[0], attained.mean(axis=0))
    if min(asked, got) > 0 and max(asked, got) > _FAR:
        for units, factor in _LENGTHS.items():
            for larger, ratio in (("attained", got / asked), ("commanded", asked / got)):
                if abs(ratio / factor - 1) < _FIT:
                    return f"the {larger} places are {factor:.4g} times as large as the others: {units}?"
    return ""


def angles_question(commanded: Array, attained: Array) -> str:
    """Ask whether commanded angles (k,) and attained ones (n, k) are in different units; empty where not [rad]."""
    for asked, got in zip(np.abs(commanded), np.abs(attained.mean(axis=0)), strict=True):
        small, large = sorted((float(asked), float(got)))
        if small > 0 and large > _LARGE_ANGLE and abs(large / small / _DEGREES - 1) < _FIT:
            larger = "attained" if got > asked else "commanded"
            return f"the {larger} angles are {_DEGREES:.3g} times as large as the others: radians and degrees?"
    return ""


def _outward(commanded: Array, attained: Array) -> tuple[float, float]:
    """Return the distances from the origin of two places in one direction from it; nothing of others."""
    asked, got = float(np.linalg.norm(commanded)), float(np.linalg.norm(attained))
    if not commanded @ attained > _ALIGNED * asked * got:
        return 0.0, 0.0
    return asked, got
