"""Poses in a file: where the tool should pass, and when."""

from __future__ import annotations

from pathlib import Path

import attrs
import numpy as np

from armwright.arm.quantities import typed_pose
from armwright.arrays import Array
from armwright.files.document import Document, Table

# A rotation that was changed by less was computed, not typed.
_ROUNDING = 1e-9


@attrs.frozen(kw_only=True, eq=False)
class PosesFile:
    """What a file of poses says.

    Attributes:
        text: of the file, as written.
        title: what it is; may be empty.
        names: of the poses.
        poses: (k, 4, 4), their rotations exact.
        times: (k,) when they are passed [s]; None where the file does not say.
        blend: (k,) how long before and after each pose the path is bent [s]; None where the file does not say.
        lines: (k) of the file, from 1, on which each pose begins.
        notes: what is worth a word: rotations that were typed with few digits.
    """

    text: str
    title: str
    names: tuple[str, ...]
    poses: Array
    times: Array | None
    blend: Array | None
    lines: tuple[int, ...]
    notes: tuple[str, ...]


def read_poses(path: Path | str) -> PosesFile:
    """Read a file of poses.

    Args:
        path: the file, TOML or JSON; its format is in docs/poses.md.

    Raises:
        FileFormatError: the file is missing, broken, or says what cannot be; the text has file, line and key.
    """
    document = Document.read(path)
    top = document.root
    title = top.text("title", default="")
    shared = top.positive("blend_s") if "blend_s" in top else None
    top.allow("blend_s")
    tables = top.tables("pose")
    top.refuse_unknown_keys()
    if len(tables) < 2:
        raise top.error("pose", f"expected two poses or more, got {len(tables)}")
    timed = "time_s" in tables[0]
    times: list[float | None] = []
    blends: list[float | None] = []
    names, poses, lines, notes = [], [], [], []
    for i, table in enumerate(tables):
        name = table.text("name", default=str(i + 1))
        if name in names:
            raise table.error("name", f"'{name}' is already the name of an earlier pose")
        X, change = typed_pose(table)
        times.append(_time(table, times, timed=timed))
        blends.append(_blend(table, shared, timed=timed))
        table.refuse_unknown_keys()
        line = document.line(("pose", i)) or 1
        if change > _ROUNDING:
            notes.append(
                f"line {line}: the rotation matrix of pose {name} is not orthonormal (error {change:.2g}); the "
                "nearest rotation is used"
            )
        names.append(name)
        poses.append(X)
        lines.append(line)
    if any(blend is not None for blend in blends) and None in blends:
        i = blends.index(None)
        message = "missing; other poses have one: specify it for all poses, or once at the top level"
        raise tables[i].error("blend_s", message)
    return PosesFile(
        text=document.text,
        title=title,
        names=tuple(names),
        poses=np.array(poses),
        times=np.array(times) if timed else None,
        blend=None if blends[0] is None else np.array(blends),
        lines=tuple(lines),
        notes=tuple(notes),
    )


def _time(table: Table, before: list[float | None], *, timed: bool) -> float | None:
    """Read when a pose is passed: all of them report it, from 0 and rising, or none."""
    if not timed:
        if "time_s" in table:
            raise table.error("time_s", "the first pose has none; specify it for all poses or for none")
        table.allow("time_s")
        return None
    time = table.number("time_s")
    if not before and time != 0:
        raise table.error("time_s", f"the first pose is passed at 0 s, got {time:g}")
    if before and time <= (before[-1] or 0.0):
        raise table.error("time_s", f"expected more than the {before[-1]:g} s of the previous pose, got {time:g}")
    return time


def _blend(table: Table, shared: float | None, *, timed: bool) -> float | None:
    if not timed and (shared is not None or "blend_s" in table):
        key = "blend_s" if "blend_s" in table else None
        raise table.error(key, "blends are allowed only for poses with times; specify time_s")
    table.allow("blend_s")
    return table.positive("blend_s") if "blend_s" in table else shared
