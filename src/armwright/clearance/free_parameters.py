"""What a linkage may have unknown beside its clearances: friction, restitution, payload, and scale of its efforts.

A point of a sweep has one number for each, and an estimate from its simulations tells which of them are identifiable.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class FreeParameter(NamedTuple):
    """A parameter of runs beside the clearances.

    Attributes:
        argument: of ``simulate``.
        unit: SI; "1" without one.
        ends: values that nature does not pass, so that they are no ends of a swept range.
    """

    argument: str
    unit: str
    ends: tuple[float, ...]


FREE_PARAMETERS: Mapping[str, FreeParameter] = {
    "friction": FreeParameter("frictions", "1", (0.0,)),
    "restitution": FreeParameter("restitutions", "1", (0.0, 1.0)),
    "payload": FreeParameter("payloads", "kg", (0.0,)),
    "torque_scale": FreeParameter("torque_scales", "1", (0.0,)),
}


def is_physical_end(name: str, value: float) -> bool:
    """Whether a parameter, ``c_PIN`` for a clearance, cannot lie beyond a value by its nature."""
    return value in (FREE_PARAMETERS[name].ends if name in FREE_PARAMETERS else (0.0,))


def parameter_text(name: str, value: float) -> str:
    """Return a value of a parameter with its unit; those that are not free are clearances, in mm."""
    if name not in FREE_PARAMETERS:
        return f"{value * 1e3:g} mm"
    unit = FREE_PARAMETERS[name].unit
    return f"{value:g}" if unit == "1" else f"{value:g} {unit}"
