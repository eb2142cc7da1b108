"""Values of pins between the states of a life that wears each of them at a pace of its own."""

from __future__ import annotations

import numpy as np

from armwright.arrays import Array


def between_states(states: Array, values: Array, *tables: Array) -> tuple[Array, ...]:
    """Return each table (..., *, p) at values of p pins, on straight lines between s states, which go on beyond them.

    Args:
        states: (s, p) increasing values of each pin, or (s,) of all.
        values: (..., p) at which the tables are asked for.
        tables: (s, *, p) each, by state and pin.
    """
    pins = np.arange(values.shape[-1])
    rows, parts = np.empty(values.shape, dtype=np.int64), np.empty(values.shape)
    for i in pins:
        column = states if states.ndim == 1 else states[:, i]
        row = np.clip(np.searchsorted(column, values[..., i], side="right") - 1, 0, len(column) - 2)
        rows[..., i], parts[..., i] = row, (values[..., i] - column[row]) / np.diff(column)[row]
    found = []
    for table in tables:
        columns = np.moveaxis(table, -1, 1)
        low, high = columns[rows, pins], columns[rows + 1, pins]
        part = parts.reshape(*parts.shape, *[1] * (table.ndim - 2))
        found.append(np.moveaxis(low + part * (high - low), values.ndim - 1, -1))
    return tuple(found)
