"""The layout of the numbers of a run in the lanes of a compiled simulation.

``LANES`` runs are interleaved: number ``i`` of run ``k`` is at ``i * LANES + k`` of an array. The sizes here are
those of the smallest linkage there is, one coordinate and one pin driven by an effort. They, and ``rates``, are what
``kernel.emit_simulation`` exchanges for those of a linkage when it emits the functions of ``simulation_loop`` and
``event_location``; everything else is compiled as it stands there.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from armwright.arrays import Array
from armwright.clearance.equations import WORKS, Contact

# Runs side by side: two to eight vectors.
LANES = 16
# Numbers of pins, runs, impacts and samples.
Integers: TypeAlias = npt.NDArray[np.int64]
# Numbers of the state: coordinates, their velocities, bristle deflections, works. Coordinates alone; pins.
N, PINS = 1, 1
STATES = 2 * N + len(WORKS)
# Of each pin two numbers are remembered; parameters of contacts; gains of controllers; numbers of the drives.
MEMORY, PARAMETERS, GAINS, COLUMNS = 2 * PINS, len(Contact._fields) * PINS, 0, 1
# Where each of them begins among the inputs, behind the state, and how many numbers there are in all.
FIRST_MEMORY = STATES
FIRST_PARAMETER = FIRST_MEMORY + MEMORY
FIRST_GAIN = FIRST_PARAMETER + PARAMETERS
FIRST_DRIVE = FIRST_GAIN + GAINS
# Of each pin with a worn wall its growth and two derivatives of that.
FIRST_WALL = FIRST_DRIVE + COLUMNS
INPUTS = FIRST_WALL
# Outputs: the rates of the state; of each pin whether it touches, the velocity it came with, and the normal force;
# behind them, with events located, its depth and the rate of that.
FIRST_DEPTH = STATES + 3 * PINS
OUTPUTS = FIRST_DEPTH + 2 * PINS
# The integrator: Runge and Kutta's of fourth order in 4 stages, or the semi-implicit one of Euler.
RK4 = True
STAGES = 4
# Whether impacts are located within a step.
LOCATED = False


def rates(x: Array, y: Array, walls: Array) -> None:
    """Evaluate the equations of the linkage for all lanes.

    Args:
        x: (INPUTS · LANES,) state, memory, parameters, gains and drives.
        y: (OUTPUTS · LANES,) to fill.
        walls: those of worn pins, see ``wall_lookup``; empty where pins are round.
    """
    raise NotImplementedError("the equations come with a linkage")
