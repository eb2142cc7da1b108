"""How a MOVE SMOOTHLY of an arm is shaped, and the gears it is shaped for, as a cell file has them."""

from __future__ import annotations

from typing import get_args

import numpy as np

from armwright.arm.drive import STIFFNESS
from armwright.arm.model import Arm
from armwright.dynamics.flexible_joints import with_gears
from armwright.files.document import Table
from armwright.motion.mode_shaping import ModeShaping, Smoothing

_KINDS: dict[str, Smoothing] = {kind: kind for kind in get_args(Smoothing)}
# Of more modes a shaper would take longer than most moves.
_MODES = 6
_TOLERANCE = (1e-3, 0.5)


def read_shaping(entry: Table) -> ModeShaping:
    """Read how motions are shaped; refuse keys that are unknown."""
    shaping = ModeShaping(
        kind=_KINDS[entry.choice("shaper", _KINDS, default="zvd")],
        count=entry.whole("modes", 1, _MODES, default=2),
        tolerance=entry.number("tolerance", default=0.05, lower=_TOLERANCE[0], upper=_TOLERANCE[1]),
    )
    entry.allow("stiffness_Nm_per_rad", "damping_Nms")
    entry.refuse_unknown_keys()
    return shaping


def with_read_gears(arm: Arm, entry: Table) -> Arm:
    """Return an arm with the gears that the table has; those of its file where it has none."""
    keys = {"stiffness": "stiffness_Nm_per_rad", "damping": "damping_Nms"}
    if not any(key in entry for key in keys.values()):
        return arm
    values = {}
    for name, key in keys.items():
        stiff = name == "stiffness"
        values[name] = entry.vector(key, arm.n, infinite=stiff) if key in entry else arm.motor_values(name)
        lower, rigid = (STIFFNESS[0], ", or inf for a rigid gear") if stiff else (0.0, "")
        for i, value in enumerate(values[name].tolist() if key in entry else ()):
            if not (lower <= value <= STIFFNESS[1] or (stiff and value == np.inf)):
                raise entry.error(key, f"expected {lower:g} to {STIFFNESS[1]:g}{rigid}, got {value:g}", i)
    return with_gears(arm, values["stiffness"], values["damping"])
