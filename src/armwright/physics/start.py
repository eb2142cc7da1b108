"""What a world with physics must be at its start: made of known arguments, with no arm's base inside what stands."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from armwright.arrays import integer
from armwright.cell.model import Cell
from armwright.errors import InvalidValueError, KindError, shown
from armwright.physics.contacts import OVERLAP, Contacts, Overlap


def check_arguments(cell: Cell, seed: int, laws: object, parts: object) -> None:
    """Refuse arguments of a world of which nothing can be made.

    Args:
        cell: the cell.
        seed: an integer of 0 or more.
        laws: functions by name of an arm; None for none.
        parts: as they are in the world, the same ones as those of the cell; None where they are to be drawn.

    Raises:
        KindError: one of them is of another kind.
        InvalidValueError: the seed is below 0, or the parts are not those of the cell.
    """
    if not isinstance(cell, Cell):
        raise KindError(f"cell: expected a Cell, such as read_cell returns, got {shown(cell)}")
    integer(seed, "seed", least=0)
    if laws is not None and not isinstance(laws, Mapping):
        raise KindError(f"laws: expected functions by the name of an arm, got {shown(laws)}")
    for name, law in (laws or {}).items():
        if not isinstance(name, str) or not callable(law):
            raise KindError(f"laws: expected a function of t, q, qd and reference for {shown(name)}, got {shown(law)}")
    if parts is not None and (not isinstance(parts, Mapping) or parts.keys() != cell.parts.keys()):
        known = ", ".join(cell.parts) or "none"
        raise InvalidValueError(f"parts: expected those of cell '{cell.name}' by name ({known}), got {shown(parts)}")


def buried_bases(cell: Cell, contacts: Contacts, model: Any, data: Any) -> list[Overlap]:
    """Return which bases of arms stand inside fixtures: neither can move, so MuJoCo has no contacts between them.

    Args:
        cell: the cell.
        contacts: its geoms.
        model: the MjModel.
        data: the MjData, with the poses of the geoms.
    """
    import mujoco  # noqa: PLC0415 - only cells with several bodies need it

    bases = [number for number, name in enumerate(contacts.names) if name in {f"{arm} base" for arm in cell.arms}]
    standing = [number for number, name in enumerate(contacts.names) if name in cell.fixtures]
    found, nearest = [], np.zeros(6)
    for base in bases:
        for fixture in standing:
            depth = -mujoco.mj_geomDistance(model, data, base, fixture, 0.0, nearest)
            if depth > OVERLAP:
                found.append(Overlap(contacts.names[base], contacts.names[fixture], depth))
    return found
