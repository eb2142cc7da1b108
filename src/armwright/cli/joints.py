"""Joint values and poses on the command line: degrees and millimetres in, rows of SI files too."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from armwright.arm.model import Arm
    from armwright.arrays import Array


def numbers(text: str, count: int, option: str) -> list[float]:
    """Read numbers apart by commas or blanks.

    Raises:
        BadParameter: it is not ``count`` finite numbers.
    """
    words = text.replace(",", " ").split()
    try:
        values = [float(word) for word in words]
    except ValueError:
        wrong = next(word for word in words if not _is_number(word))
        raise typer.BadParameter(f"expected {count} numbers, got '{wrong}'", param_hint=option) from None
    if len(values) != count or not all(map(math.isfinite, values)):
        raise typer.BadParameter(f"expected {count} finite numbers, got {len(values)}: {text}", param_hint=option)
    return values


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

    Returns:
        One array (rows, n) per quantity.

    Raises:
        FileFormatError: the file is missing, a column is missing, or a value is no finite number.
    """
    import csv

    import numpy as np

    from armwright.errors import FileFormatError
    from armwright.files.document import read_text

    reader = csv.reader(read_text(path).splitlines())
    header = [name.strip() for name in next(reader, [])]
    wanted = [f"{quantity}{i + 1}" for quantity in quantities for i in range(arm.n)]
    missing = [name for name in wanted if name not in header]
    if missing:
        raise FileFormatError(path, 1, missing[0], f"no such column; expected {wanted[0]} to {wanted[-1]}")
    places = [header.index(name) for name in wanted]
    table = []
    for row in reader:
        if not row:
            continue
        try:
            values = [float(row[place]) for place in places]
        except (ValueError, IndexError) as error:
            raise FileFormatError(path, reader.line_num, "", f"expected {len(header)} numbers: {error}") from error
        if not all(map(math.isfinite, values)):
            raise FileFormatError(path, reader.line_num, "", "every number must be finite")
        table.append(values)
    array = np.array(table).reshape(len(table), len(quantities), arm.n)
    return [array[:, i] for i in range(len(quantities))]


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
