"""Joint values on the command line: degrees and millimetres in, rows of SI files too."""

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from armwright.cli.numbers import numbers

if TYPE_CHECKING:
    from armwright.arm.model import Arm
    from armwright.arrays import Array


def joint_values(arm: "Arm", text: str, option: str) -> "Array":
    """Read one value per joint, in degrees or millimetres (per second, per second squared), as SI (n,)."""
    import numpy as np

    return np.array(numbers(text, arm.n, option)) * units(arm)


def units(arm: "Arm") -> "Array":
    """Return, per joint, the SI value of a degree or of a millimetre, (n,)."""
    import numpy as np

    return np.array([math.pi / 180 if joint.revolute else 1e-3 for joint in arm.joints])


def unit_names(arm: "Arm") -> list[str]:
    """Return, per joint, what ``units`` counts in, for the head of a table: ``j1 deg``, ``j3 mm``."""
    return [f"j{i} {'deg' if joint.revolute else 'mm'}" for i, joint in enumerate(arm.joints, 1)]


def rows(arm: "Arm", path: Path, quantities: tuple[str, ...]) -> list["Array"]:
    """Read columns such as q1 … qn, qd1 … qdn of a CSV file in SI units, such as motion.csv; others are passed over.

    Args:
        arm: the arm.
        path: the file.
        quantities: what to read; the first are the joint positions.

    Returns:
        One array (rows, n) per quantity.

    Raises:
        FileFormatError: the file, a column or all rows are missing, or a value is no finite number.
    """
    from array import array

    import numpy as np

    from armwright.cli.results import warn_of_stray
    from armwright.errors import FileFormatError, shown
    from armwright.files.rows import number_in_cell, of_one_width, read_rows

    warn_of_stray(path)
    head, below = read_rows(path)
    header = head.cells
    wanted = [f"{quantity}{i + 1}" for quantity in quantities for i in range(arm.n)]
    missing = [name for name in wanted if name not in header]
    if missing:
        raise FileFormatError(path, 1, missing[0], f"no such column; expected {wanted[0]} to {wanted[-1]}, with commas")
    twice = [name for name in wanted if header.count(name) > 1]
    if twice:
        raise FileFormatError(path, 1, twice[0], "there are two columns of this name")
    places = [(name, header.index(name)) for name in wanted]
    # Eight bytes a number: a table may have many millions.
    values = array("d")
    at, name_of_arm = header.index("arm") if "arm" in header else None, ""
    for row in of_one_width(path, head, below):
        if at is not None and row.cells[at] != (name_of_arm := name_of_arm or row.cells[at]):
            said = f"rows of several arms, {shown(name_of_arm)} and {shown(row.cells[at])}; leave those of one"
            raise FileFormatError(path, row.line, "arm", said)
        values.extend(number_in_cell(path, row.line, name, row.cells[place]) for name, place in places)
    table = np.array(values).reshape(-1, len(quantities), arm.n)
    _ask_for_degrees(arm, path, table[:, 0])
    return [table[:, i] for i in range(len(quantities))]


def _ask_for_degrees(arm: "Arm", path: Path, q: "Array") -> None:
    """Say on the error output that the positions (rows, n) of a file look like degrees, if they do."""
    from armwright.arm.positions import degrees_by_mistake

    found = degrees_by_mistake(arm, q)
    if found:
        print(f"armwright: warning: {path}: {found}; the columns of a file are in SI units", file=sys.stderr)
