"""Joint values from the command line, in degrees and millimetres, and from tables, in SI units."""

import sys
from typing import TYPE_CHECKING

from armwright.cli.numbers import numbers

if TYPE_CHECKING:
    from armwright.arm.model import Arm
    from armwright.arrays import Array
    from armwright.cli.tables import TableFile
    from armwright.files.column_names import Schema


def joint_values(arm: "Arm", text: str, option: str) -> "Array":
    """Read one value per joint, in degrees or millimetres (per second, per second squared), as SI (n,)."""
    import numpy as np

    return np.array(numbers(text, arm.n, option)) * units(arm)


def units(arm: "Arm") -> "Array":
    """Return, per joint, the SI value of a degree or of a millimetre, (n,)."""
    import numpy as np

    return np.array([joint.units.scale for joint in arm.joints])


def unit_names(arm: "Arm") -> list[str]:
    """Return the headings of a table with joint values in ``units``: ``j1 deg``, ``j3 mm``."""
    return [f"j{i} {joint.units.display}" for i, joint in enumerate(arm.joints, 1)]


def rows(arm: "Arm", file: "TableFile", quantities: tuple[str, ...]) -> list["Array"]:
    """Read columns such as q1 … qn, qd1 … qdn of a CSV file, such as motion.csv, in SI; other columns are ignored.

    Args:
        arm: the arm.
        file: the table, and how to read it.
        quantities: those to read of q, qd and qdd; the first is q.

    Returns:
        One array (rows, n) per quantity.

    Raises:
        FileFormatError: the file, a column or all rows are missing, or a value is not a finite number.
    """
    from armwright.arm.positions import degrees_by_mistake
    from armwright.cli.results import warn_of_stray
    from armwright.errors import shown
    from armwright.files.unit_table import read_header

    warn_of_stray(file.path)
    columns = [f"{quantity}{i + 1}" for quantity in quantities for i in range(arm.n)]
    header = read_header(file.path, _columns(arm, quantities), columns=file.columns)
    header.require(columns, f"{arm.name} has {arm.n} joints")
    table = header.rows(filled=columns, skip_incomplete=file.skip_incomplete)
    arms = table.words("arm")
    other = next((i for i, name in enumerate(arms) if name != arms[0]), None)
    if other is not None:
        text = f"expected rows of a single arm, got {shown(arms[0])} and {shown(arms[other])}"
        raise table.error(other, "arm", text)
    numbers = [table.numbers(columns[k : k + arm.n]) for k in range(0, len(columns), arm.n)]
    in_radians = any(table.headings[name].unit == "rad" for name in columns[: arm.n])
    if in_radians and (suspicion := degrees_by_mistake(arm, numbers[0])):
        print(f"armwright: warning: {file.path}: {suspicion}; columns without a unit are in SI units", file=sys.stderr)
    return numbers


def _columns(arm: "Arm", quantities: tuple[str, ...]) -> "Schema":
    """Return the columns of joint positions, velocities and accelerations, in SI where their names have no unit."""
    from armwright.files import column_names as names

    kinds = {
        "q": ("", (names.ANGLE, "rad"), (names.LENGTH, "m")),
        "qd": ("_velocity", (names.ANGULAR_VELOCITY, "rad_per_s"), (names.VELOCITY, "m_per_s")),
        "qdd": ("_acceleration", (names.ANGULAR_ACCELERATION, "rad_per_s2"), (names.ACCELERATION, "m_per_s2")),
    }
    columns = [names.Column(name="arm")]
    for symbol in quantities:
        suffix, *units = kinds[symbol]
        for i, joint in enumerate(arm.joints, 1):
            quantity, unit = units[not joint.revolute]
            synonyms = tuple(f"{name}{suffix}" for name in (f"joint_{i}", joint.name) if name)
            columns.append(names.Column(name=f"{symbol}{i}", quantity=quantity, unit=unit, synonyms=synonyms))
    return names.Schema(columns=columns, ignores_unknown=True)
