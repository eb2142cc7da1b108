"""Outputs and encoders in cell files."""

import re

import numpy as np

from armwright.cell.entries import read_name, refuse_too_many
from armwright.cell.outputs import Controller, Device, Encoders, Output
from armwright.files.document import Table

# No controller has more outputs; names of signals are identifiers of RAPID.
_MAX_OUTPUT = 100_000
_SIGNAL = re.compile(r"[A-Z][A-Z0-9_]{0,31}", re.IGNORECASE | re.ASCII)
# A drive that counts more per revolution is in another unit, and so is a slower one [ms].
_MAX_COUNTS = 1e12
_PERIOD_MS = (0.05, 1000.0)


def read_output(table: Table) -> Output | None:
    """Read the output that a device is connected to, if the table names one, and refuse other keys."""
    address = read_address(table, "output")
    table.refuse_unknown_keys()
    return address


def read_address(table: Table, key: str) -> Output | None:
    """Read the number, under a key, and the name of an output or an input of a controller, if the table has any."""
    number = table.whole(key, 0, _MAX_OUTPUT) if key in table else None
    signal = table.text("signal") if "signal" in table else None
    if signal is not None and not _SIGNAL.fullmatch(signal):
        raise table.error("signal", f"{signal!r} cannot name a signal: a letter, then up to 31 letters, digits and _")
    table.allow(key, "signal")
    return None if number is None and signal is None else Output(number=number, signal=signal)


def read_devices(table: Table) -> dict[str, Device]:
    """Read the devices of a cell: the outputs that they are connected to, and which can be set to any number."""
    refuse_too_many(table, "entries")
    devices: dict[str, Device] = {}
    for key in table:
        name, entry = read_name(table, key, devices), table.table(key)
        analogue = entry.flag("analogue")
        devices[name] = Device(output=read_output(entry), analogue=analogue)
    return devices


def read_controller(table: Table, joints: int) -> Controller:
    """Read what the table of an arm with so many joints says of its real controller."""
    table.allow("controller", "encoders")
    return Controller(
        convention=table.text("controller") if "controller" in table else None,
        gripper_output=read_output(table.table("gripper_output")),
        encoders=_read_encoders(table.table("encoders"), joints) if "encoders" in table else None,
    )


def _read_encoders(table: Table, joints: int) -> Encoders:
    """Read the encoders of an arm with so many joints."""
    counts = table.vector("counts", joints)
    if (counts <= 0).any() or (counts > _MAX_COUNTS).any():
        raise table.error("counts", f"expected counts above 0 and up to {_MAX_COUNTS:g}, got {counts.tolist()}")
    signs = table.vector("signs", joints, default=np.ones(joints))
    if not np.isin(signs, (1, -1)).all():
        raise table.error("signs", f"expected 1 or -1 for each joint, got {signs.tolist()}")
    encoders = Encoders(
        counts=counts,
        offset=table.vector("offset", joints, default=np.zeros(joints)),
        signs=signs,
        period=table.number("period_ms", lower=_PERIOD_MS[0], upper=_PERIOD_MS[1]) * 1e-3
        if "period_ms" in table
        else None,
    )
    table.allow("period_ms")
    table.refuse_unknown_keys()
    return encoders
