"""The table ``[inputs]`` of a cell file."""

from collections.abc import Collection

import numpy as np

from armwright.cell.entries import known_name, read_name, read_pose, refuse_too_many
from armwright.cell.frames import WORLD, FrameTree
from armwright.cell.outputs_reader import read_address
from armwright.cell.signals import Changes, Input
from armwright.cell.zones import Zone
from armwright.files.document import Table

# Times that are longer are in another unit [s]; numbers that are larger are a slip.
_MAX_TIME, _MAX_VALUE = 1e6, 1e9
# Longer sides of zones are in another unit [mm].
_MAX_LENGTH = 1e6
# Changes of one input.
_MAX_CHANGES = 10_000


def read_inputs(
    table: Table, devices: Collection[str] | None, arms: Collection[str], standing: FrameTree
) -> dict[str, Input]:
    """Read the inputs of a cell.

    Args:
        table: an empty one where the file has none.
        devices: names of its devices; None where any name will do.
        arms: their names.
        standing: the frames that do not move.

    Raises:
        FileFormatError: a key is unknown or out of range, or an input follows a device that does not exist.
    """
    refuse_too_many(table, "entries")
    inputs: dict[str, Input] = {}
    for key in table:
        inputs[read_name(table, key, {*inputs, *(devices or ())})] = _read_input(
            table.table(key), devices, arms, standing
        )
    return inputs


def _read_input(table: Table, devices: Collection[str] | None, arms: Collection[str], standing: FrameTree) -> Input:
    analogue = table.flag("analogue")
    if "zone" in table:
        for key in ("analogue", "start", "timeline", "follows", "event"):
            if key in table:
                raise table.error(key, "an input with a zone is on and off by that alone; write two inputs")
        zone = _read_zone(table.table("zone"), arms, standing)
        source = Input(zone=zone, address=read_address(table, "input"))
        table.refuse_unknown_keys()
        return source
    largest = _MAX_VALUE if analogue else 1.0
    follows = event = None
    if "follows" in table:
        written = table.text("follows")
        known = [written.upper()] if devices is None else devices
        follows = known_name(table, "follows", written, known, "a device")
    if "event" in table:
        event = read_name(table, "event", (), table.text("event"))
    start = table.number("start", default=0.0, lower=-largest if analogue else 0.0, upper=largest)
    source = Input(
        analogue=analogue,
        start=_value(table, "start", start, analogue=analogue),
        timeline=_read_timeline(table, largest, analogue=analogue) if "timeline" in table else (),
        follows=follows,
        delay=table.number("delay_s", default=0.0, lower=0.0, upper=_MAX_TIME),
        event=event,
        pulse=table.number("pulse_s", lower=0.0, upper=_MAX_TIME) if "pulse_s" in table else None,
        address=read_address(table, "input"),
    )
    if follows is None and "delay_s" in table:
        raise table.error("delay_s", "a delay needs the device that the input follows, `follows`")
    if event is None and source.pulse is not None:
        raise table.error("pulse_s", "a pulse needs the EVENT that begins it, `event`")
    table.allow("follows", "delay_s", "event", "pulse_s", "timeline", "zone")
    table.refuse_unknown_keys()
    return source


def _read_zone(table: Table, arms: Collection[str], standing: FrameTree) -> Zone:
    """Read where the tool of an arm switches an input."""
    arm = known_name(table, "arm", table.text("arm", default=next(iter(arms), "ARM_1")), arms, "an arm")
    frame = known_name(table, "on", table.text("on", default=WORLD), {WORLD, *standing}, "a standing frame")
    is_ball = "within_mm" in table
    if is_ball == ("box_mm" in table):
        raise table.error(
            "box_mm" if is_ball else None, "expected either within_mm, a distance, or box_mm, three sides"
        )
    sides = None if is_ball else table.vector("box_mm", 3) * 1e-3
    if sides is not None and not ((sides > 0) & (sides <= _MAX_LENGTH * 1e-3)).all():
        raise table.error("box_mm", f"expected three sides above 0 and up to {_MAX_LENGTH:g} mm")
    zone = Zone(
        arm=arm,
        pose=standing.world(frame) @ read_pose(table, "at", default=np.eye(4)),
        radius=table.number("within_mm", lower=1e-3, upper=_MAX_LENGTH) * 1e-3 if is_ball else None,
        sides=sides,
        inverted=table.flag("inverted"),
    )
    table.allow("within_mm", "box_mm")
    table.refuse_unknown_keys()
    return zone


def _read_timeline(table: Table, largest: float, *, analogue: bool) -> Changes:
    rows = table.vectors("timeline", 2)
    if len(rows) > _MAX_CHANGES:
        raise table.error("timeline", f"expected at most {_MAX_CHANGES} changes, got {len(rows)}")
    changes = [(float(time), _value(table, "timeline", float(value), analogue=analogue)) for time, value in rows]
    for index, (time, value) in enumerate(changes):
        if not 0 <= time <= _MAX_TIME or abs(value) > largest:
            bounds = f"a time from 0 to {_MAX_TIME:g} s and a value within {largest:g}"
            text = f"expected {bounds}, got [{time:g}, {value:g}]"
            raise table.error("timeline", text, index)
        if index and time <= changes[index - 1][0]:
            text = f"expected times that increase, got {time:g} s behind {changes[index - 1][0]:g} s"
            raise table.error("timeline", text, index)
    return tuple(changes)


def _value(table: Table, key: str, value: float, *, analogue: bool) -> float:
    if not analogue and value not in (0.0, 1.0):
        raise table.error(key, f"a digital input is 0 or 1, not {value:g}; write `analogue = true` for other numbers")
    return value
