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
    import csv

    import numpy as np

    from armwright.errors import FileFormatError
    from armwright.files.document import read_text

    reader = csv.reader(read_text(path).splitlines())
    try:
        lines = [(reader.line_num, row) for row in reader if row]
    except csv.Error as error:
        raise FileFormatError(path, reader.line_num + 1, "", f"not valid CSV: {error}") from error
    header = [name.strip() for name in lines[0][1]] if lines else []
    wanted = [f"{quantity}{i + 1}" for quantity in quantities for i in range(arm.n)]
    missing = [name for name in wanted if name not in header]
    if missing:
        raise FileFormatError(path, 1, missing[0], f"no such column; expected {wanted[0]} to {wanted[-1]}, with commas")
    twice = [name for name in wanted if header.count(name) > 1]
    if twice:
        raise FileFormatError(path, 1, twice[0], "there are two columns of this name")
    places = [header.index(name) for name in wanted]
    table = []
    for line, row in lines[1:]:
        try:
            values = [float(row[place]) for place in places]
        except IndexError as error:
            raise FileFormatError(path, line, "", f"expected {len(header)} numbers, got {len(row)}") from error
        except ValueError as error:
            raise FileFormatError(path, line, "", f"expected {len(header)} numbers: {error}") from error
        if not all(map(math.isfinite, values)):
            raise FileFormatError(path, line, "", "every number must be finite")
        table.append(values)
    if not table:
        raise FileFormatError(path, None, "", "no rows below the names of the columns")
    array = np.array(table).reshape(len(table), len(quantities), arm.n)
    _ask_for_degrees(arm, path, array[:, 0])
    return [array[:, i] for i in range(len(quantities))]


def _ask_for_degrees(arm: "Arm", path: Path, q: "Array") -> None:
    """Say on the error output that the positions (rows, n) of a file look like degrees, if they do."""
    from armwright.arm.positions import degrees_by_mistake

    found = degrees_by_mistake(arm, q)
    if found:
        print(f"armwright: warning: {path}: {found}; the columns of a file are in SI units", file=sys.stderr)
