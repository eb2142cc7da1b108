"""CSV for drives: the positions of all drives in counts of their encoders, at the period of the drives."""

import math

import numpy as np

from armwright.arrays import Array, Flags
from armwright.cell.outputs import Encoders
from armwright.export.arm_motion import arm_motion
from armwright.export.refusals import refusal
from armwright.export.writers.controller_file import ControllerFile
from armwright.program.language.source import Span
from armwright.program.vm.recording import Recording

# What drives count with: whole numbers of 32 bits.
_SMALLEST, _LARGEST = -(2**31), 2**31 - 1
# Rows that are written together.
_ROWS = 4096
_TICK_TOLERANCE = 1e-6


def write(recording: Recording, arm_name: str) -> list[ControllerFile]:
    """Return the positions of an arm at every period of its drives.

    Raises:
        ExportError: nothing is known of its encoders, or counts do not fit into 32 bits.
    """
    placed, source = recording.cell.arms[arm_name], recording.code.source
    mine = [stage for stage in recording.stages if stage.arm == arm_name]
    span = mine[0].span if mine else Span(0, 0)
    encoders = placed.controller.encoders
    if encoders is None:
        text = f"the cell file does not say how the drives of {arm_name} count"
        helps = [f"write `[arms.{arm_name}.encoders]` with `counts`, `offset`, `signs` and `period_ms`"]
        raise refusal(source, "E618", text, span, f"{arm_name} moves here", helps=helps)
    period = encoders.period or recording.cell.period
    motion, coupling = arm_motion(recording, arm_name), placed.arm.coupling
    ticks = np.arange(math.ceil(motion.duration / period - _TICK_TOLERANCE) + 1)
    q = motion(ticks * period)
    counts = _counts(q if coupling is None else coupling.drives(q), encoders, placed.arm.revolute)
    if ((counts < _SMALLEST) | (counts > _LARGEST)).any():
        row, joint = (int(x) for x in np.argwhere((counts < _SMALLEST) | (counts > _LARGEST))[0])
        time = row * period
        at = next((stage.span for stage in mine if stage.t1 >= time), span)
        drive = f"the drive of joint {joint + 1} of {arm_name}"
        text = f"{drive} comes to {counts[row, joint]:,.0f} counts, which 32 bits do not hold"
        raise refusal(source, "E618", text, at, "on this MOVE", helps=["set another `offset` of its encoder"])
    word = "joint" if coupling is None else "drive"
    half = float((np.where(placed.arm.revolute, 2 * np.pi, 1.0) / encoders.counts).max()) / 2
    notes = (
        f"positions are whole counts: they are off by up to half a count, {half:.2g} rad or m",
        "outputs and texts are not part of the table: events.json has them with their times",
    )
    return [ControllerFile(name=f"{arm_name}.csv", text=_text(counts, period, word), approximations=notes)]


def _counts(m: Array, encoders: Encoders, revolute: Flags) -> Array:
    """Return positions (k, n) of the drives in counts, rounded, as floats."""
    turns = m / np.where(revolute, 2 * np.pi, 1.0)
    return np.asarray(np.rint(encoders.offset + encoders.signs * turns * encoders.counts))


def _text(counts: Array, period: float, word: str) -> str:
    columns = ",".join(f"{word}_{i}" for i in range(1, counts.shape[1] + 1))
    line = ",".join(["%d"] * counts.shape[1]) + "\n"
    whole = counts.astype(np.int64)
    pieces = [f"# period {period:.9g} s; positions in counts\n{columns}\n"]
    for first in range(0, len(whole), _ROWS):
        block = whole[first : first + _ROWS]
        pieces.append(line * len(block) % tuple(block.ravel().tolist()))
    return "".join(pieces)
