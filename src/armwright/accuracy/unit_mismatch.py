"""Commanded and attained values that are probably in different units."""

import numpy as np

from armwright.arrays import Array

# How many of the second unit are one of the first.
_LENGTH_RATIOS = {
    "metres and millimetres": 1000.0,
    "metres and centimetres": 100.0,
    "metres and inches": 1 / 0.0254,
    "inches and millimetres": 25.4,
    "centimetres and millimetres": 10.0,
}
_DEGREES = 180 / np.pi
# How well a ratio must fit, and two directions agree.
_RATIO_TOLERANCE, _MIN_COSINE = 0.02, 0.999
# Nearer to the origin, or in a path smaller than this [m], a large ratio may be an honest error.
_MIN_EXTENT = 0.05
# Angles smaller than this [rad] say nothing of their unit.
_MIN_ANGLE = np.radians(10)


def length_unit_question(commanded: Array, attained: Array) -> str:
    """Ask whether commanded and attained positions are in different units; empty where nothing suggests it.

    Args:
        commanded: (c, d) commanded path, of which the extent is compared, or (1, d) pose, of which the distance from
            the origin is [m].
        attained: (n, d) attained ones [m].

    Returns:
        What is odd, and a question.
    """
    if len(commanded) > 1:
        commanded_norm, attained_norm = (float(np.linalg.norm(np.ptp(P, axis=0))) for P in (commanded, attained))
    else:
        commanded_norm, attained_norm = _aligned_norms(commanded[0], attained.mean(axis=0))
    if min(commanded_norm, attained_norm) > 0 and max(commanded_norm, attained_norm) > _MIN_EXTENT:
        for units, factor in _LENGTH_RATIOS.items():
            for larger, ratio in (
                ("attained", attained_norm / commanded_norm),
                ("commanded", commanded_norm / attained_norm),
            ):
                if abs(ratio / factor - 1) < _RATIO_TOLERANCE:
                    return f"the {larger} positions are {factor:.4g} times as large as the others: {units}?"
    return ""


def angle_unit_question(commanded: Array, attained: Array) -> str:
    """Ask whether commanded angles (k,) and attained ones (n, k) are in different units; empty where not [rad]."""
    for commanded_norm, attained_norm in zip(np.abs(commanded), np.abs(attained.mean(axis=0)), strict=True):
        small, large = sorted((float(commanded_norm), float(attained_norm)))
        if small > 0 and large > _MIN_ANGLE and abs(large / small / _DEGREES - 1) < _RATIO_TOLERANCE:
            larger = "attained" if attained_norm > commanded_norm else "commanded"
            return f"the {larger} angles are {_DEGREES:.3g} times as large as the others: radians and degrees?"
    return ""


def _aligned_norms(commanded: Array, attained: Array) -> tuple[float, float]:
    """Return the distances from the origin of two positions in one direction from it; nothing of others."""
    commanded_norm, attained_norm = float(np.linalg.norm(commanded)), float(np.linalg.norm(attained))
    if not commanded @ attained > _MIN_COSINE * commanded_norm * attained_norm:
        return 0.0, 0.0
    return commanded_norm, attained_norm
