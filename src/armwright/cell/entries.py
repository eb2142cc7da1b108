"""Entries that recur in cell files: names and poses."""

import re
from collections.abc import Collection, Iterable

import numpy as np

from armwright.arrays import Array
from armwright.cell.frames import WORLD
from armwright.cell.names import arm_name
from armwright.cell.scene import Spread
from armwright.errors import closest
from armwright.files.document import Table
from armwright.files.limits import limit, limit_message
from armwright.spatial.poses import from_noap, homogeneous
from armwright.spatial.rotations import nearest_rotation, orthonormality_error

ARM_NAME = re.compile(r"ARM[-_]([0-9]+)", re.IGNORECASE | re.ASCII)
NAME = re.compile(r"[A-Z][A-Z0-9_]*", re.IGNORECASE | re.ASCII)
# Orthonormality error of a rotation: two digits deviate by up to 0.018 and are made exact; more is a mistake.
_MAX_ROTATION_ERROR = 2e-2


def read_name(table: Table, key: str, taken: Iterable[str], text: str | None = None) -> str:
    """Return a name in the form in which the language compares it: in upper case, and valid in a program."""
    written = key if text is None else text
    name, match = written.upper(), ARM_NAME.fullmatch(written)
    if text is not None and match:
        return arm_name(match[1])
    if not NAME.fullmatch(written) or (text is None and (name == WORLD or match)):
        raise table.error(
            key, f"{written!r} cannot name a frame or device: letters A to Z, digits and _, not WORLD or an arm"
        )
    if name in taken:
        raise table.error(key, f"{name} occurs twice; case does not distinguish names")
    return name


def known_name(table: Table, key: str, name: str, known: Collection[str], kind: str) -> str:
    """Return a name under a key, in upper case, that must be one of those of the cell.

    Args:
        table: with the key.
        key: for the message.
        name: as it is written.
        known: names of the cell.
        kind: what they are, with its article, such as ``a part``.

    Raises:
        FileFormatError: it is none of them.
    """
    name = read_name(table, key, (), name)
    if name not in known:
        near = closest(name, known)
        there = f"there is {', '.join(sorted(known))}" if known else "there is none"
        raise table.error(key, f"{name} is not {kind} of the cell; {f'did you mean {near}?' if near else there}")
    return name


def read_pose(table: Table, key: str, default: Array | None = None) -> Array:
    """Return a pose (4, 4), written as twelve numbers; the default where the key is missing."""
    if default is not None and key not in table:
        table.allow(key)
        return default
    return to_pose(table, key, table.vector(key, 12))


def read_spread(table: Table, position: str, yaw: str, tilt: str | None = None) -> Spread:
    """Return how far from its place something may be, by the keys of its offset [mm] and of its rotations [deg]."""
    return Spread(
        position=table.number(position, default=0.0, lower=0.0, upper=1e6) * 1e-3,
        yaw=np.radians(table.number(yaw, default=0.0, lower=0.0, upper=180.0)),
        tilt=0.0 if tilt is None else np.radians(table.number(tilt, default=0.0, lower=0.0, upper=90.0)),
    )


def to_pose(table: Table, key: str, numbers: Array, index: int | None = None) -> Array:
    """Return twelve numbers as a pose (4, 4), which are under a key, or an entry of the list there."""
    X = from_noap(numbers)
    error = float(orthonormality_error(X[:3, :3]))
    if error > _MAX_ROTATION_ERROR:
        by_rows = np.linalg.norm(numbers.reshape(3, 4)[:, :3], axis=-1)
        rows = np.allclose(by_rows, 1.0, atol=_MAX_ROTATION_ERROR)
        hint = "; they look like rows: write the columns n, o, a, p" if rows else ""
        raise table.error(key, f"the first nine numbers are not a rotation (error {error:.2g}){hint}", index)
    return homogeneous(nearest_rotation(X[:3, :3]), X[:3, 3])


def refuse_too_many(table: Table, bound: str) -> None:
    """Refuse a table with more keys than a limit."""
    got = sum(1 for _ in table)
    if got > limit(bound):
        raise table.error(None, f"too many: {limit_message(bound, got)}")
