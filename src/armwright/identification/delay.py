"""The delay between efforts and positions: positions come from another device than currents, and later."""

from __future__ import annotations

from collections.abc import Sequence

import attrs

from armwright.identification.equations import equations
from armwright.identification.fitting import summed, weighted
from armwright.identification.friction import without_dry
from armwright.identification.log import Log
from armwright.identification.model import DynamicModel
from armwright.identification.signals import Preparation, motions

# Steps at most, and the part of a period of the readings at which the delay is found.
_MAX_STEPS, _FOUND = 8, 0.03
# Nothing is read later than by this [s]: where the search leads beyond, efforts tell nothing of a delay.
_LARGEST = 0.5


def with_delay(model: DynamicModel, logs: Sequence[Log], preparation: Preparation) -> Preparation:
    """Return a preparation with the delay at which motions explain efforts best, by Gauss and Newton's method.

    Args:
        model: of the arm.
        logs: of its motions.
        preparation: of motions; its delay is the first guess, and stays where no delay is found.

    Raises:
        TooFewError: there are fewer equations than parameters.
    """
    size = preparation.decimation
    values = weighted(summed(equations(model, motions(logs, preparation), size))).values
    guess = preparation
    for _ in range(_MAX_STEPS):
        smooth = without_dry(model, values)
        step = weighted(summed(equations(model, motions(logs, preparation), size, values=smooth))).values
        delay = preparation.delay + float(step[-1])
        if not abs(delay) <= _LARGEST:
            return guess
        preparation = attrs.evolve(preparation, delay=delay)
        values = step[:-1]
        if abs(step[-1]) < _FOUND * logs[0].period:
            break
    return preparation
