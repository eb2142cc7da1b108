"""The key ``moves`` of a frame in a cell file."""

import numpy as np

from armwright.arrays import Array
from armwright.cell.moving_frames import MovingFrame
from armwright.files.document import Table

# Faster belts, longer windows and times are in another unit [mm/s], [mm], [s].
_MAX_SPEED, _MAX_PLACE, _MAX_TIME = 1e4, 1e6, 1e6
# A shorter ramp is a jump, which no arm can follow [s].
_RAMPS = (0.05, 600.0)
_MAX_CHANGES = 10_000


def read_moving_frame(table: Table, X_WF: Array) -> MovingFrame:
    """Read how a frame moves.

    Args:
        table: its key ``moves``.
        X_WF: (4, 4) where it is at the start, in the world.

    Raises:
        FileFormatError: a key is missing, unknown or out of range.
    """
    along = table.vector("along", 3, default=np.array([1.0, 0.0, 0.0]))
    length = float(np.linalg.norm(along))
    if not 0 < length < np.inf:
        raise table.error("along", "expected a direction along the axes of the frame, not [0, 0, 0]")
    low, high = (float(place) for place in table.vector("window_mm", 2))
    if not -_MAX_PLACE <= low < high <= _MAX_PLACE:
        text = f"expected two places that increase, within {_MAX_PLACE:g} mm, got [{low:g}, {high:g}]"
        raise table.error("window_mm", text)
    ramp = table.number("ramp_s", default=0.5, lower=_RAMPS[0], upper=_RAMPS[1])
    frame = MovingFrame(
        pose=X_WF,
        direction=X_WF[:3, :3] @ along / length,
        speed=table.number("speed_mm_per_s", lower=-_MAX_SPEED, upper=_MAX_SPEED) * 1e-3,
        changes=_read_changes(table, ramp) if "timeline" in table else (),
        ramp=ramp,
        window=(low * 1e-3, high * 1e-3),
    )
    table.allow("timeline")
    table.refuse_unknown_keys()
    return frame


def _read_changes(table: Table, ramp: float) -> tuple[tuple[float, float], ...]:
    rows = table.vectors("timeline", 2)
    if len(rows) > _MAX_CHANGES:
        raise table.error("timeline", f"expected at most {_MAX_CHANGES} changes, got {len(rows)}")
    earliest = 0.0
    for index, (time, speed) in enumerate(rows):
        if not earliest <= time <= _MAX_TIME:
            text = f"expected a time from {earliest:g} to {_MAX_TIME:g} s, behind the ramp before it, got {time:g} s"
            raise table.error("timeline", text, index)
        if abs(speed) > _MAX_SPEED:
            raise table.error("timeline", f"expected a speed within {_MAX_SPEED:g} mm/s, got {speed:g}", index)
        earliest = float(time) + ramp
    return tuple((float(time), float(speed) * 1e-3) for time, speed in rows)
