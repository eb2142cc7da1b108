"""Values in words, as PRINT, the trace and the events show them."""

import numpy as np

from armwright.program.language.units import UnitSystem
from armwright.program.vm.process import Value
from armwright.spatial.poses import to_noap

# What is nearer to 0 than this is rounding.
_ROUNDING = 1e-12


def shown(value: Value, units: UnitSystem) -> str:
    """Return a value for people: numbers to six digits, poses with lengths in the units of the program.

    Args:
        value: a number, a truth value, a pose or a step.
        units: of the program.
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float | int):
        return f"{value + 0.0:.6g}"
    assert isinstance(value, np.ndarray)  # noqa: S101 - elements have been read
    numbers = to_noap(value)
    numbers[9:] /= units.metres
    texts = [f"{0.0 if abs(number) < _ROUNDING else number:.6g}" for number in numbers.tolist()]
    return "(" + ", ".join(",".join(texts[i : i + 3]) for i in range(0, 12, 3)) + ")"
